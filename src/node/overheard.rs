//! The objects of nodes that other masters read and write, from their SDO traffic. Nothing is sent.

use super::Identity;
use super::transfers::{Outcome, Transfer, Transfers};
use crate::bus::Received;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::catalog::{Model, recognise};
use crate::master::{Operation, SecondAnswer};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Facts about nodes from the SDO traffic of other masters.
#[derive(Default)]
pub struct Overheard {
    known: BTreeMap<(NodeId, ObjectId), Vec<u8>>,
    /// Objects whose read was rejected by the node.
    refused: BTreeSet<(NodeId, ObjectId)>,
    transfers: Transfers,
}

impl Overheard {
    /// Handles a frame. Returns node and object if the frame completes a new value or the first rejected read.
    pub fn take(&mut self, received: &Received) -> Option<(NodeId, ObjectId)> {
        self.transfers.take(received);
        let mut learned = None;
        while let Some(transfer) = self.transfers.next_finished() {
            learned = self.learn(transfer).or(learned);
        }
        learned
    }

    /// The next node that sent two answers to one request, with the object.
    pub fn next_second_answer(&mut self) -> Option<(NodeId, ObjectId, SecondAnswer)> {
        self.transfers.next_second_answer()
    }

    /// Forgets the objects of a node for which `is_forgotten` is true.
    pub fn forget(&mut self, node: NodeId, is_forgotten: impl Fn(ObjectId) -> bool) {
        let is_kept = |(of, object): &(NodeId, ObjectId)| *of != node || !is_forgotten(*object);
        self.known.retain(|key, _| is_kept(key));
        self.refused.retain(is_kept);
        self.transfers.forget(node, is_forgotten);
    }

    /// Returns the bytes of an object.
    pub fn bytes(&self, node: NodeId, object: ObjectId) -> Option<&[u8]> {
        self.known.get(&(node, object)).map(Vec::as_slice)
    }

    /// Returns the first four bytes of an object as a number.
    pub fn number(&self, node: NodeId, object: ObjectId) -> Option<u32> {
        self.bytes(node, object).map(first_four)
    }

    /// Whether the node rejected the read of an object.
    pub fn is_refused(&self, node: NodeId, object: ObjectId) -> bool {
        self.refused.contains(&(node, object))
    }

    /// Returns the identity of a node (1000h, 1018h, 1008h), as far as it is known.
    pub fn identity(&self, node: NodeId) -> Identity {
        let number = |index, sub| self.number(node, ObjectId::new(index, sub));
        let name = self.bytes(node, ObjectId::new(0x1008, 0));
        Identity {
            device_type: number(0x1000, 0),
            vendor: number(0x1018, 1),
            product: number(0x1018, 2),
            revision: number(0x1018, 3),
            serial: number(0x1018, 4),
            name: name.and_then(|bytes| DataType::VisibleString.decode(bytes).ok()).map(|name| name.to_string()),
        }
    }

    /// Returns the built-in description that fits the known identity of a node.
    pub fn recognise(&self, node: NodeId) -> Option<Arc<Model>> {
        let mut traits = self.identity(node).traits();
        let answers = self.known.iter().filter(|((of, _), _)| *of == node);
        traits.answers = answers.map(|(&(_, object), bytes)| (object, bytes.clone())).collect();
        recognise(&traits)
    }

    fn learn(&mut self, transfer: Transfer) -> Option<(NodeId, ObjectId)> {
        let key = (transfer.node, transfer.object);
        let is_new = match (transfer.outcome, transfer.operation) {
            (Outcome::Done(uploaded), _) => self.known.insert(key, uploaded.bytes.clone()) != Some(uploaded.bytes),
            (Outcome::Aborted { by_master: false, .. } | Outcome::Violation(..), Operation::Read) => {
                self.refused.insert(key)
            }
            _ => false,
        };
        is_new.then_some(key)
    }
}

/// Returns the first four bytes as a number; missing bytes are 0.
pub fn first_four(bytes: &[u8]) -> u32 {
    let mut wide = [0; 4];
    let len = bytes.len().min(4);
    wide[..len].copy_from_slice(&bytes[..len]);
    u32::from_le_bytes(wide)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::Stamp;

    fn heard(frames: &[&str]) -> (Overheard, Vec<ObjectId>) {
        let mut heard = Overheard::default();
        let mut learned = Vec::new();
        for frame in frames {
            let received = Received { frame: frame.parse().expect("a frame"), at: Stamp::default() };
            learned.extend(heard.take(&received).map(|(_, object)| object));
        }
        (heard, learned)
    }

    #[test]
    fn identity_from_expedited_and_segmented_answers() {
        let node = NodeId::new(5).expect("a node-ID");
        let (heard, learned) = heard(&[
            "605#4000100000000000",
            "585#4300100094010200",
            "605#4018100100000000",
            "585#4318100147000000",
            "605#4008100000000000",
            "585#4108100008000000",
            "605#6000000000000000",
            "585#004D482D342D4341",
            "605#7000000000000000",
            "585#1D4E000000000000",
        ]);
        let identity = heard.identity(node);
        assert_eq!((identity.device_type, identity.vendor), (Some(0x0002_0194), Some(71)));
        assert_eq!((identity.name.as_deref(), identity.product), (Some("MH-4-CAN"), None));
        assert_eq!(learned.len(), 3);
    }

    #[test]
    fn writes_count_after_the_acknowledge_and_refusals_are_known() {
        let (node, timer) = (NodeId::new(5).expect("a node-ID"), ObjectId::new(0x1800, 5));
        let write = "605#2B00180564000000";
        assert_eq!(heard(&[write]).0.number(node, timer), None);
        assert_eq!(heard(&[write, "585#8000180511000906"]).0.number(node, timer), None);
        let (mut acknowledged, _) = heard(&[write, "585#6000180500000000"]);
        assert_eq!(acknowledged.number(node, timer), Some(100));
        acknowledged.forget(node, |object| object.index == 0x1800);
        assert_eq!(acknowledged.number(node, timer), None);
        assert!(heard(&["605#4000180500000000", "585#8000180511000906"]).0.is_refused(node, timer));
    }
}
