//! The emergency messages of the recorded nodes.

use crate::bus::Mono;
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::device::quirk::Quirk;
use crate::node::Node;
use std::collections::BTreeMap;
use std::time::Duration;

/// Recognises emergency messages.
#[derive(Debug, Default)]
pub(super) struct Emergencies {
    nodes: BTreeMap<CanId, NodeId>,
    /// The meaning of each emergency code, from the descriptions.
    meanings: BTreeMap<(NodeId, u16), String>,
    /// The last emergency of each node that repeats it while it is pending ([`Quirk::EmergencyRepeats`]).
    repeating: BTreeMap<NodeId, Option<Emergency>>,
    /// Emergencies reported less than [`REPEAT_INTERVAL`] ago.
    recent: Vec<Recent>,
}

/// An emergency that was reported.
#[derive(Debug)]
struct Recent {
    node: NodeId,
    emergency: Emergency,
    reported: Mono,
    /// Identical ones received since then.
    count: u64,
}

/// Identical emergencies are reported once, then as one count in this time.
const REPEAT_INTERVAL: Duration = Duration::from_secs(1);

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

    /// Takes what became known of a node, and keeps its last emergency.
    pub(super) fn learn(&mut self, node: &Node) {
        let last = self.repeating.get(&node.id).copied();
        self.watch(node);
        if let (Some(last), Some(known)) = (last, self.repeating.get_mut(&node.id)) {
            *known = last;
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

    /// Takes an emergency. Returns whether it is reported now; if not, it is counted.
    pub(super) fn is_new(&mut self, node: NodeId, emergency: Emergency, now: Mono) -> bool {
        let mut recent = self.recent.iter_mut();
        if let Some(recent) = recent.find(|recent| recent.node == node && recent.emergency == emergency) {
            recent.count += 1;
            return false;
        }
        self.recent.push(Recent { node, emergency, reported: now, count: 0 });
        true
    }

    /// An emergency that was repeated, and how often since it was last reported. `at_end` does not wait for the interval.
    pub(super) fn next_repeated(&mut self, now: Mono, at_end: bool) -> Option<(NodeId, Emergency, u64)> {
        let is_over = |recent: &Recent| at_end || now.since(recent.reported) >= REPEAT_INTERVAL;
        self.recent.retain(|recent| recent.count > 0 || !is_over(recent));
        let recent = self.recent.iter_mut().find(|recent| is_over(recent))?;
        recent.reported = now;
        Some((recent.node, recent.emergency, std::mem::take(&mut recent.count)))
    }

    /// What an emergency code means on this node.
    pub(super) fn meaning(&self, node: NodeId, emergency: Emergency) -> String {
        let described = self.meanings.get(&(node, emergency.code)).map(String::as_str);
        described.unwrap_or_else(|| Emergency::class(emergency.code)).to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identical_emergencies_are_counted_once_a_second() {
        let at = |milliseconds| Mono::at(Duration::from_millis(milliseconds));
        let node = NodeId::new(5).expect("a node-ID");
        let emergency = |text: &str| Emergency::parse(&text.parse().expect("a frame")).expect("an emergency");
        let (one, other) = (emergency("085#3050810101000000"), emergency("085#3050810102000000"));
        let mut emergencies = Emergencies::default();
        let mut reported = Vec::new();
        for step in 0..1000 {
            let now = at(step * 2);
            // Two alternating ones are no less of a flood.
            let emergency = if step % 2 == 0 { one } else { other };
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
