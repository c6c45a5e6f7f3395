//! Watches the heartbeats of the recorded nodes: a heartbeat stops or is back, or its NMT state changes.

use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{ErrorControlMessage, NmtState};
use crate::node::Node;
use std::collections::BTreeMap;
use std::time::Duration;

/// A heartbeat is lost after two periods and this tolerance. The timers of devices are inaccurate.
const HEARTBEAT_TOLERANCE: Duration = Duration::from_millis(50);

/// The effect of a heartbeat or boot-up message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HeartbeatChange {
    /// No effect.
    None,
    /// The heartbeat was lost and is back.
    Back,
    /// The state differs from the state in the last heartbeat.
    State(NmtState),
}

#[derive(Debug)]
struct Heartbeat {
    /// The producer heartbeat time (1017h).
    period: Duration,
    last: Mono,
    state: Option<NmtState>,
    is_lost: bool,
}

/// Watches the nodes that have a heartbeat (1017h is not 0).
#[derive(Debug, Default)]
pub(super) struct HeartbeatMonitor {
    heartbeats: BTreeMap<NodeId, Heartbeat>,
}

impl HeartbeatMonitor {
    /// Watches the heartbeat of a node from now on, if it has one.
    pub(super) fn watch(&mut self, node: &Node, now: Mono) {
        self.heartbeats.remove(&node.id);
        if let Some(milliseconds) = node.heartbeat_ms.filter(|&milliseconds| milliseconds > 0) {
            let period = Duration::from_millis(u64::from(milliseconds));
            let heartbeat = Heartbeat { period, last: now, state: None, is_lost: false };
            self.heartbeats.insert(node.id, heartbeat);
        }
    }

    /// Handles a heartbeat or boot-up message.
    pub(super) fn on_life(&mut self, node: NodeId, life: ErrorControlMessage, now: Mono) -> HeartbeatChange {
        let Some(heartbeat) = self.heartbeats.get_mut(&node) else { return HeartbeatChange::None };
        heartbeat.last = now;
        let was_lost = std::mem::take(&mut heartbeat.is_lost);
        let state = match life {
            ErrorControlMessage::State(state) => Some(state),
            // A boot-up message does not show the following state.
            ErrorControlMessage::BootUp => None,
        };
        let before = std::mem::replace(&mut heartbeat.state, state);
        match (before, state) {
            _ if was_lost => HeartbeatChange::Back,
            (Some(before), Some(state)) if before != state => HeartbeatChange::State(state),
            _ => HeartbeatChange::None,
        }
    }

    /// Whether the heartbeat of a node is not lost and shows OPERATIONAL.
    pub(super) fn is_operational(&self, node: NodeId) -> bool {
        let heartbeat = self.heartbeats.get(&node).filter(|heartbeat| !heartbeat.is_lost);
        heartbeat.is_some_and(|heartbeat| heartbeat.state == Some(NmtState::Operational))
    }

    /// Returns a node whose heartbeat has stopped, and the time since its last heartbeat. Each loss is returned once.
    pub(super) fn next_lost(&mut self, now: Mono) -> Option<(NodeId, Duration)> {
        let is_late = |heartbeat: &Heartbeat| {
            !heartbeat.is_lost && now.since(heartbeat.last) > heartbeat.period * 2 + HEARTBEAT_TOLERANCE
        };
        let (&node, heartbeat) = self.heartbeats.iter_mut().find(|(_, heartbeat)| is_late(heartbeat))?;
        heartbeat.is_lost = true;
        Some((node, now.since(heartbeat.last)))
    }

    /// Starts all periods now, because nothing could be received before.
    pub(super) fn restart(&mut self, now: Mono) {
        self.heartbeats.values_mut().for_each(|heartbeat| heartbeat.last = now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_after_two_periods_and_back() {
        let at = |milliseconds| Mono::at(Duration::from_millis(milliseconds));
        let node = NodeId::new(5).expect("a node-ID");
        let mut recorded = Node::new(node);
        let mut monitor = HeartbeatMonitor::default();
        monitor.watch(&recorded, at(0));
        assert_eq!(monitor.next_lost(at(1_000_000)), None, "it has none");
        recorded.heartbeat_ms = Some(100);
        monitor.watch(&recorded, at(0));
        let operational = ErrorControlMessage::State(NmtState::Operational);
        let stopped = ErrorControlMessage::State(NmtState::Stopped);
        assert_eq!(monitor.on_life(node, operational, at(100)), HeartbeatChange::None);
        assert_eq!(monitor.on_life(node, stopped, at(200)), HeartbeatChange::State(NmtState::Stopped));
        assert_eq!(monitor.next_lost(at(450)), None);
        assert_eq!(monitor.next_lost(at(451)), Some((node, Duration::from_millis(251))));
        assert_eq!(monitor.next_lost(at(600)), None, "returned once");
        assert_eq!(monitor.on_life(node, operational, at(700)), HeartbeatChange::Back);
        assert_eq!(monitor.on_life(node, ErrorControlMessage::BootUp, at(750)), HeartbeatChange::None);
        assert_eq!(
            monitor.on_life(node, operational, at(800)),
            HeartbeatChange::None,
            "no state before a boot-up counts"
        );
        monitor.restart(at(9000));
        assert_eq!(monitor.next_lost(at(9250)), None);
    }
}
