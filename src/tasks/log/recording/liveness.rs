//! Which of the recorded nodes still send.

use super::super::heartbeats::{HeartbeatChange, HeartbeatMonitor};
use super::super::interval::IntervalTracker;
use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::Life;
use crate::node::Node;
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
    /// Reported as silent, until the next sample.
    is_silent: bool,
}

impl Liveness {
    /// Expects samples from these nodes.
    pub(super) fn new(nodes: impl Iterator<Item = NodeId>) -> Liveness {
        let nodes = nodes.map(|node| (node, NodeLiveness::default())).collect();
        Liveness { nodes, heartbeats: HeartbeatMonitor::default() }
    }

    /// The nodes of which samples are expected or were received.
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
    pub(super) fn watch_heartbeat(&mut self, node: &Node, now: Mono) {
        self.heartbeats.watch(node, now);
    }

    /// Takes samples of a node. Returns whether it had been reported as silent.
    pub(super) fn take_samples(&mut self, node: NodeId, at: Mono) -> bool {
        let liveness = self.nodes.entry(node).or_default();
        liveness.samples.add(at, None);
        std::mem::take(&mut liveness.is_silent)
    }

    /// Takes a heartbeat or boot-up message.
    pub(super) fn take_life(&mut self, node: NodeId, life: Life, at: Mono) -> HeartbeatChange {
        self.heartbeats.take(node, life, at)
    }

    /// Nothing of this node could be recorded until now.
    pub(super) fn restart(&mut self, node: NodeId, now: Mono) {
        if let Some(liveness) = self.nodes.get_mut(&node) {
            liveness.samples.restart(now);
        }
    }

    /// Nothing could be received until now.
    pub(super) fn restart_all(&mut self, now: Mono) {
        self.nodes.values_mut().for_each(|liveness| liveness.samples.restart(now));
        self.heartbeats.restart(now);
    }

    /// A node that stopped sending samples, and for how long. Each silence is returned once.
    pub(super) fn next_silent(&mut self, now: Mono) -> Option<(NodeId, Duration)> {
        self.nodes.iter_mut().find_map(|(&node, liveness)| {
            let silence = liveness.samples.silence(now).filter(|_| !liveness.is_silent)?;
            liveness.is_silent = true;
            Some((node, silence))
        })
    }

    /// A node whose heartbeat stopped, and for how long. Each loss is returned once.
    pub(super) fn next_lost_heartbeat(&mut self, now: Mono) -> Option<(NodeId, Duration)> {
        self.heartbeats.next_lost(now)
    }

    /// The nodes that sent no samples at all, or stopped before `end`.
    pub(super) fn lost(&self, end: Mono) -> Vec<NodeId> {
        let lost = self.nodes.iter().filter(|(_, liveness)| liveness.samples.is_lost(end));
        lost.map(|(&node, _)| node).collect()
    }

    /// Whether this node sent at least one sample.
    pub(super) fn has_sent(&self, node: NodeId) -> bool {
        self.nodes.get(&node).is_some_and(|liveness| liveness.samples.has_received())
    }
}
