//! The emergency messages of the recorded nodes.

use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::device::quirk::Quirk;
use crate::node::Node;
use std::collections::BTreeMap;

/// Recognises emergency messages.
#[derive(Debug, Default)]
pub(super) struct Emergencies {
    nodes: BTreeMap<CanId, NodeId>,
    /// The meaning of each emergency code, from the descriptions.
    meanings: BTreeMap<(NodeId, u16), String>,
    /// The last emergency of each node that repeats it while it is pending ([`Quirk::EmergencyRepeats`]).
    repeating: BTreeMap<NodeId, Option<Emergency>>,
}

impl Emergencies {
    /// Takes the COB-ID (1014h) and the description of a node, instead of those known before.
    pub(super) fn watch(&mut self, node: &Node) {
        let id = node.id;
        self.nodes.retain(|_, of| *of != id);
        self.nodes.insert(node.emergency, id);
        self.meanings.retain(|(of, _), _| *of != id);
        let described = node.model.as_ref().map_or(&[][..], |model| &model.description.emergencies);
        self.meanings.extend(described.iter().map(|entry| ((id, entry.code), entry.text.clone())));
        let quirks = node.model.as_ref().map_or(&[][..], |model| &model.description.quirks);
        self.repeating.remove(&id);
        if quirks.contains(&Quirk::EmergencyRepeats) {
            self.repeating.insert(id, None);
        }
    }

    /// The emergency in a frame, and the node that sent it.
    pub(super) fn parse(&self, frame: &Frame) -> Option<(NodeId, Emergency)> {
        let node = *self.nodes.get(&frame.id())?;
        Some((node, Emergency::parse(frame)?))
    }

    /// Whether a device repeats an emergency that was already recorded.
    pub(super) fn is_repetition(&mut self, node: NodeId, emergency: Emergency) -> bool {
        self.repeating.get_mut(&node).is_some_and(|last| last.replace(emergency) == Some(emergency))
    }

    /// What an emergency code means on this node.
    pub(super) fn meaning(&self, node: NodeId, emergency: Emergency) -> String {
        let described = self.meanings.get(&(node, emergency.code)).map(String::as_str);
        described.unwrap_or_else(|| Emergency::class(emergency.code)).to_owned()
    }
}
