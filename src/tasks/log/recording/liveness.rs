//! Tracks which of the recorded nodes still send.

use super::super::heartbeats::{HeartbeatChange, HeartbeatMonitor};
use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::ErrorControlMessage;
use crate::canopen::pdo::Transmission;
use crate::measure::interval::IntervalTracker;
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::tasks::log::Mode;
use std::collections::BTreeMap;
use std::time::Duration;

/// Watches the samples and heartbeats of each node.
#[derive(Debug, Default)]
pub(super) struct Liveness {
    nodes: BTreeMap<NodeId, NodeLiveness>,
    heartbeats: HeartbeatMonitor,
}

#[derive(Debug, Default)]
struct NodeLiveness {
    samples: IntervalTracker,
    /// Whether the node was reported as silent, until its next sample.
    is_silent: bool,
    /// Whether the node sends only on change. Its silence is normal while its heartbeat shows OPERATIONAL.
    sends_on_change: bool,
}

impl Liveness {
    /// Expects samples from these nodes.
    pub(super) fn new(nodes: impl Iterator<Item = NodeId>) -> Liveness {
        let nodes = nodes.map(|node| (node, NodeLiveness::default())).collect();
        Liveness { nodes, heartbeats: HeartbeatMonitor::default() }
    }

    /// Returns the nodes of which samples are expected or were received.
    pub(super) fn nodes(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.nodes.keys().copied()
    }

    /// Whether samples of this node are expected or were received.
    pub(super) fn has(&self, node: NodeId) -> bool {
        self.nodes.contains_key(&node)
    }

    /// Expects no samples from this node.
    pub(super) fn remove(&mut self, node: NodeId) {
        self.nodes.remove(&node);
    }

    /// Watches the heartbeat of a node from now on, if it has one.
    pub(super) fn watch_heartbeat(&mut self, node: &Node, mode: Mode, now: Mono) {
        self.heartbeats.watch(node, now);
        if let Some(liveness) = self.nodes.get_mut(&node.id) {
            liveness.sends_on_change = sends_on_change(node, mode);
        }
    }

    /// Handles samples of a node. Returns whether the node was reported as silent.
    pub(super) fn on_samples(&mut self, node: NodeId, at: Mono) -> bool {
        let liveness = self.nodes.entry(node).or_default();
        liveness.samples.add(at, None);
        std::mem::take(&mut liveness.is_silent)
    }

    /// Handles a heartbeat or boot-up message.
    pub(super) fn on_life(&mut self, node: NodeId, life: ErrorControlMessage, at: Mono) -> HeartbeatChange {
        self.heartbeats.on_life(node, life, at)
    }

    /// Measures the silence of a node from now on, because nothing could be recorded until now.
    pub(super) fn restart(&mut self, node: NodeId, now: Mono) {
        if let Some(liveness) = self.nodes.get_mut(&node) {
            liveness.samples.restart(now);
        }
    }

    /// Measures the silence of all nodes from now on, because nothing could be received until now.
    pub(super) fn restart_all(&mut self, now: Mono) {
        self.nodes.values_mut().for_each(|liveness| liveness.samples.restart(now));
        self.heartbeats.restart(now);
    }

    /// Returns a node that stopped sending samples, and the length of its silence. Each silence is returned once.
    pub(super) fn next_silent(&mut self, now: Mono) -> Option<(NodeId, Duration)> {
        let heartbeats = &self.heartbeats;
        self.nodes.iter_mut().find_map(|(&node, liveness)| {
            if liveness.sends_on_change && heartbeats.is_operational(node) {
                return None;
            }
            let silence = liveness.samples.silence(now).filter(|_| !liveness.is_silent)?;
            liveness.is_silent = true;
            Some((node, silence))
        })
    }

    /// Returns a node whose heartbeat stopped, and the time since its last heartbeat. Each loss is returned once.
    pub(super) fn next_lost_heartbeat(&mut self, now: Mono) -> Option<(NodeId, Duration)> {
        self.heartbeats.next_lost(now)
    }

    /// Returns the nodes that sent no samples at all, or stopped before `end`.
    pub(super) fn lost(&self, end: Mono) -> Vec<NodeId> {
        let is_lost = |node: NodeId, liveness: &NodeLiveness| {
            liveness.samples.is_lost(end) && !(liveness.sends_on_change && self.heartbeats.is_operational(node))
        };
        let lost = self.nodes.iter().filter(|&(&node, liveness)| is_lost(node, liveness));
        lost.map(|(&node, _)| node).collect()
    }

    /// Whether this node sent at least one sample.
    pub(super) fn has_sent(&self, node: NodeId) -> bool {
        self.nodes.get(&node).is_some_and(|liveness| liveness.samples.has_received())
    }
}

/// Whether a node sends its TPDOs only on change, without an event timer or SYNC.
fn sends_on_change(node: &Node, mode: Mode) -> bool {
    let mut valid = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).peekable();
    let is_due = |tpdo: &Tpdo| match tpdo.transmission {
        Some(Transmission::AcyclicSync) => false,
        Some(Transmission::Manufacturer | Transmission::Profile) => {
            node.event_timer(tpdo.transmission, tpdo.event_timer_ms).is_some()
        }
        _ => true,
    };
    !matches!(mode, Mode::Poll(_) | Mode::Request(_) | Mode::Passive)
        && valid.peek().is_some()
        && valid.all(|tpdo| !is_due(tpdo))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::nmt::NmtState;
    use crate::canopen::pdo::{CobId, TpdoNumber};

    fn at(milliseconds: u64) -> Mono {
        Mono::at(Duration::from_millis(milliseconds))
    }

    /// Whether a node is lost at `end` (in ms). It sent two samples, and then heartbeats with `state` until 9 s.
    fn is_lost(transmission: u8, timer: u16, cob_id: u32, state: NmtState, end: u64) -> bool {
        let id = NodeId::new(5).expect("a node-ID");
        let mut node = Node::new(id);
        node.heartbeat_ms = Some(1000);
        node.tpdos.push(Tpdo {
            number: TpdoNumber::new(1).expect("a number"),
            cob_id: CobId(cob_id),
            transmission: Some(Transmission::from_code(transmission)),
            event_timer_ms: Some(timer),
            mapping: Vec::new(),
        });
        let mut liveness = Liveness::new([id].into_iter());
        liveness.watch_heartbeat(&node, Mode::AsSent, at(0));
        liveness.on_samples(id, at(100));
        liveness.on_samples(id, at(200));
        for second in 1..10 {
            liveness.on_life(id, ErrorControlMessage::State(state), at(second * 1000));
        }
        while liveness.next_lost_heartbeat(at(end)).is_some() {}
        !liveness.lost(at(end)).is_empty()
    }

    #[test]
    fn node_that_sends_on_change_is_not_lost_while_operational() {
        let operational = NmtState::Operational;
        assert!(!is_lost(255, 0, 0x185, operational, 10_000));
        assert!(!is_lost(0, 0, 0x185, operational, 10_000), "at a SYNC after a change");
        assert!(is_lost(255, 0, 0x185, operational, 20_000), "the heartbeat stopped");
        assert!(is_lost(255, 0, 0x185, NmtState::PreOperational, 10_000));
        assert!(is_lost(254, 100, 0x185, operational, 10_000), "the event timer is due");
        assert!(is_lost(1, 0, 0x185, operational, 10_000), "a SYNC is due");
        assert!(is_lost(255, 0, 0x8000_0185, operational, 10_000), "the TPDO is off");
    }
}
