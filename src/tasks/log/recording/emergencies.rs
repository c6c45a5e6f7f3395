//! The emergency messages of the recorded nodes.

use super::repetitions::Repetitions;
use crate::bus::Mono;
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::device::catalog::Model;
use crate::device::description::emergency_text;
use crate::device::quirk::Quirk;
use crate::node::Node;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Recognises emergency messages.
#[derive(Debug, Default)]
pub(super) struct Emergencies {
    nodes: BTreeMap<CanId, NodeId>,
    /// The descriptions of the nodes.
    models: BTreeMap<NodeId, Arc<Model>>,
    /// The last emergency of each node that repeats pending emergencies ([`Quirk::EmergencyRepeats`]).
    repeating: BTreeMap<NodeId, Option<Emergency>>,
    /// The emergencies that were reported a short time ago.
    recent: Repetitions<(NodeId, Emergency)>,
}

/// A change of the overload of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OverloadChange {
    /// An overload of this channel begins; `None` if the emergency contains no channel.
    Begins(Option<u8>),
    /// The overload ends.
    Ends,
}

impl Emergencies {
    /// Replaces the COB-ID (1014h) and the description of a node.
    pub(super) fn watch(&mut self, node: &Node) {
        let id = node.id;
        self.nodes.retain(|_, of| *of != id);
        self.nodes.insert(node.emergency, id);
        self.models.remove(&id);
        self.models.extend(node.model.clone().map(|model| (id, model)));
        let quirks = node.model.as_ref().map_or(&[][..], |model| &model.description.quirks);
        self.repeating.remove(&id);
        if quirks.contains(&Quirk::EmergencyRepeats) {
            self.repeating.insert(id, None);
        }
    }

    /// Updates the facts about a node, and keeps its last emergency.
    pub(super) fn learn(&mut self, node: &Node) {
        let last = self.repeating.get(&node.id).copied();
        self.watch(node);
        if let (Some(last), Some(known)) = (last, self.repeating.get_mut(&node.id)) {
            *known = last;
        }
    }

    /// Returns the emergency in a frame, and the node that sent it.
    pub(super) fn parse(&self, frame: &Frame) -> Option<(NodeId, Emergency)> {
        let node = *self.nodes.get(&frame.id())?;
        Some((node, Emergency::parse(frame)?))
    }

    /// Whether a device repeats an emergency that was already recorded.
    pub(super) fn is_repetition(&mut self, node: NodeId, emergency: Emergency) -> bool {
        self.repeating.get_mut(&node).is_some_and(|last| last.replace(emergency) == Some(emergency))
    }

    /// Handles an emergency. Returns whether to report it now; if not, it is counted.
    pub(super) fn is_new(&mut self, node: NodeId, emergency: Emergency, now: Mono) -> bool {
        // The manufacturer bytes may be a counter.
        let is_same = |&(of, other): &(NodeId, Emergency)| {
            of == node && other.code == emergency.code && other.register == emergency.register
        };
        self.recent.is_new((node, emergency), is_same, now)
    }

    /// Returns an emergency that was repeated, and the number of repetitions since its last report. With `at_end`, the
    /// interval need not be over.
    pub(super) fn next_repeated(&mut self, now: Mono, at_end: bool) -> Option<(NodeId, Emergency, u64)> {
        self.recent.next(now, at_end).map(|((node, emergency), count)| (node, emergency, count))
    }

    /// Returns the meaning of an emergency code on this node, and the set bits of its error register. The bits are
    /// omitted if the device always sends the same register with this code.
    pub(super) fn meaning(&self, node: NodeId, emergency: Emergency) -> String {
        emergency_text(self.models.get(&node).map(|model| &model.description), emergency)
    }

    /// Returns the change of an overload that an emergency reports.
    pub(super) fn overload(&self, node: NodeId, emergency: Emergency) -> Option<OverloadChange> {
        let description = &self.models.get(&node)?.description;
        if emergency.code != 0 {
            let entry = description.emergency(emergency.code).filter(|entry| entry.overload)?;
            return Some(OverloadChange::Begins(entry.channel(emergency.manufacturer)));
        }
        // Another error may have ended. The register then still shows the overload.
        let pending = description.overload_register().zip(emergency.register);
        let is_pending = pending.is_some_and(|(bits, register)| register.0 & bits == bits);
        (!is_pending).then_some(OverloadChange::Ends)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn overload_of_a_device_without_status_lasts_until_the_error_is_over() {
        let mut node = Node::new(NodeId::new(127).expect("a node-ID"));
        node.model = crate::device::catalog::by_name("dps");
        let mut emergencies = Emergencies::default();
        emergencies.watch(&node);
        for (frame, change, text) in [
            ("0FF#0132050000000000", Some(OverloadChange::Begins(None)), "overflow or underflow"),
            ("0FF#0122070000000000", None, "sensor failure"),
            ("0FF#0000050000000000", None, "no error, overflow or underflow"),
            ("0FF#0000000000000000", Some(OverloadChange::Ends), "no error, no error"),
        ] {
            let emergency = Emergency::parse(&frame.parse().expect("a frame")).expect("an emergency");
            assert_eq!(emergencies.overload(node.id, emergency), change, "{frame}");
            assert_eq!(emergencies.meaning(node.id, emergency), text, "{frame}");
        }
    }

    #[test]
    fn identical_emergencies_are_counted_once_a_second() {
        let at = |milliseconds| Mono::at(Duration::from_millis(milliseconds));
        let node = NodeId::new(5).expect("a node-ID");
        let emergency = |text: &str| Emergency::parse(&text.parse().expect("a frame")).expect("an emergency");
        let (one, other) = (emergency("085#3050810101000000"), emergency("085#3050800101000000"));
        let mut emergencies = Emergencies::default();
        let mut reported = Vec::new();
        for step in 0..1000 {
            let now = at(step * 2);
            // The limit also applies to alternating emergencies, and if the manufacturer bytes are a counter.
            let emergency = if step % 2 == 0 { one } else { other };
            let counter = step.to_le_bytes();
            let emergency = Emergency { manufacturer: [counter[0], counter[1], 0, 0, 0], ..emergency };
            if emergencies.is_new(node, emergency, now) {
                reported.push(0);
            }
            while let Some((_, _, count)) = emergencies.next_repeated(now, false) {
                reported.push(count);
            }
        }
        while let Some((_, _, count)) = emergencies.next_repeated(at(2000), true) {
            reported.push(count);
        }
        assert_eq!(reported.len(), 6, "{reported:?}");
        assert_eq!(reported.iter().sum::<u64>(), 998, "all are counted");
        assert!(emergencies.is_new(node, one, at(9000)), "a later one is reported again");
    }
}
