//! Stores the times of the last frames of each node, to prove that a node was silent for several seconds.
//!
//! A command sends requests or listens in several steps. Frames received in one step also count in the next steps.

use super::Master;
use crate::bus::{Mono, Received};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss::Fastscan;
use crate::canopen::nmt::ErrorControlMessage;

/// The times of the last frames of one node.
#[derive(Clone, Copy, Debug, Default)]
struct Times {
    /// The last heartbeat or boot-up message of the node.
    heartbeat: Option<Mono>,
    /// The last SDO answer of the node.
    answer: Option<Mono>,
    /// The last two requests to the node, the later one first.
    requests: [Option<Mono>; 2],
}

/// The times of the last frames of all nodes, and of LSS slaves without a node-ID.
#[derive(Debug)]
pub(super) struct ReceiveTimes {
    nodes: Box<[Times; 128]>,
    /// The last answer to a fastscan request.
    fastscan: Option<Mono>,
}

impl Default for ReceiveTimes {
    fn default() -> ReceiveTimes {
        ReceiveTimes { nodes: Box::new([Times::default(); 128]), fastscan: None }
    }
}

impl ReceiveTimes {
    fn node(&mut self, node: NodeId) -> &mut Times {
        &mut self.nodes[usize::from(node.get())]
    }

    /// Records a received frame.
    pub(super) fn on_frame(&mut self, received: &Received) {
        let (frame, at) = (&received.frame, received.at.mono);
        if let Some(node) = frame.id().sdo_response_node() {
            self.node(node).answer = Some(at);
        } else if let Some((node, _)) = ErrorControlMessage::parse(frame) {
            self.node(node).heartbeat = Some(at);
        } else if frame.id() == CanId::LSS_SLAVE && Fastscan::is_answer(frame) {
            self.fastscan = Some(at);
        }
    }

    /// Records the first request of a transfer.
    pub(super) fn on_request(&mut self, node: NodeId, at: Mono) {
        let requests = &mut self.node(node).requests;
        *requests = [Some(at), requests[0]];
    }
}

impl Master<'_> {
    /// Whether a heartbeat or a boot-up message of a node was received at this moment or later. The filters must pass
    /// these frames, as the filters of [`Master::listen_to`] for this node do.
    pub fn has_heartbeat_since(&self, node: NodeId, since: Mono) -> bool {
        self.sdo.receive_times.nodes[usize::from(node.get())].heartbeat >= Some(since)
    }

    /// Whether an SDO answer of a node was received at this moment or later, even if its transfer had ended before.
    pub fn has_answered_since(&self, node: NodeId, since: Mono) -> bool {
        self.sdo.receive_times.nodes[usize::from(node.get())].answer >= Some(since)
    }

    /// Returns the time of the last request to the node, if there were at least two requests since this moment.
    pub fn asked_twice_since(&self, node: NodeId, since: Mono) -> Option<Mono> {
        let [last, before] = self.sdo.receive_times.nodes[usize::from(node.get())].requests;
        last.filter(|_| before >= Some(since))
    }

    /// Whether a slave answered a fastscan request at this moment or later.
    pub(super) fn has_fastscan_answer_since(&self, since: Mono) -> bool {
        self.sdo.receive_times.fastscan >= Some(since)
    }
}
