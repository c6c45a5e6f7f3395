//! The last signs of life on the bus, for proofs that need several seconds of silence.
//!
//! A command asks or listens in several steps. What it received in one step counts in the next ones too.

use super::Master;
use crate::bus::{Mono, Received};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss::Fastscan;
use crate::canopen::nmt::Life;

/// The last moments of one node.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    /// Its last heartbeat or boot-up message.
    life: Option<Mono>,
    /// Its last SDO answer.
    answer: Option<Mono>,
    /// The last two requests to it, the latest one first.
    asked: [Option<Mono>; 2],
}

/// The signs of life of all nodes and of LSS slaves without a node-ID.
#[derive(Debug)]
pub(super) struct Heard {
    nodes: Box<[Moments; 128]>,
    /// The last answer to a fastscan request.
    fastscan: Option<Mono>,
}

impl Default for Heard {
    fn default() -> Heard {
        Heard { nodes: Box::new([Moments::default(); 128]), fastscan: None }
    }
}

impl Heard {
    fn node(&mut self, node: NodeId) -> &mut Moments {
        &mut self.nodes[usize::from(node.get())]
    }

    /// Records a received frame.
    pub(super) fn on_frame(&mut self, received: &Received) {
        let (frame, at) = (&received.frame, received.at.mono);
        if let Some(node) = frame.id().sdo_response_node() {
            self.node(node).answer = Some(at);
        } else if let Some((node, _)) = Life::parse(frame) {
            self.node(node).life = Some(at);
        } else if frame.id() == CanId::LSS_SLAVE && Fastscan::is_answer(frame) {
            self.fastscan = Some(at);
        }
    }

    /// Records the first request of a transfer.
    pub(super) fn on_request(&mut self, node: NodeId, at: Mono) {
        let asked = &mut self.node(node).asked;
        *asked = [Some(at), asked[0]];
    }
}

impl Master<'_> {
    /// Whether a heartbeat or a boot-up message of a node was received at this moment or later. The filters must let it
    /// pass: all filters of [`Master::listen_to`] with this node do.
    pub fn has_lived_since(&self, node: NodeId, since: Mono) -> bool {
        self.sdo.heard.nodes[usize::from(node.get())].life >= Some(since)
    }

    /// Whether an SDO answer of a node was received at this moment or later, also if its transfer was over by then.
    pub fn has_answered_since(&self, node: NodeId, since: Mono) -> bool {
        self.sdo.heard.nodes[usize::from(node.get())].answer >= Some(since)
    }

    /// When the node was asked for the last time, if it was asked at least twice since this moment.
    pub fn asked_twice_since(&self, node: NodeId, since: Mono) -> Option<Mono> {
        let [last, before] = self.sdo.heard.nodes[usize::from(node.get())].asked;
        last.filter(|_| before >= Some(since))
    }

    /// Whether a slave answered a fastscan request at this moment or later.
    pub(super) fn has_fastscan_answer_since(&self, since: Mono) -> bool {
        self.sdo.heard.fastscan >= Some(since)
    }
}
