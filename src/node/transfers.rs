//! SDO transfers between other masters and the nodes, assembled from their frames. Nothing is sent.

mod block;
mod open;
#[cfg(test)]
mod tests;

use crate::bus::{Mono, Received, Stamp};
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, Uploaded, Violation, multiplexer, proves_upload_answer_60};
pub use crate::master::Operation;
use crate::master::{Answers, SecondAnswer};
use open::{Open, Step};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// A read ends after this time without frames.
const READ_TIMEOUT: Duration = Duration::from_secs(2);

/// A write ends after this time without frames. Storing to non-volatile memory takes the longest time.
const WRITE_TIMEOUT: Duration = Duration::from_secs(10);

/// If another request follows within this time, its master did not wait for the answer: two masters use the channel.
const SHORTEST_TIMEOUT: Duration = Duration::from_millis(20);

/// The largest number of transfers in progress. A scan starts 127.
const MAX_OPEN: usize = 512;

/// How a transfer carries its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// In the request or in the first answer.
    Expedited,
    /// In segments that are acknowledged one by one.
    Segmented,
    /// In blocks of segments.
    Block,
}

/// How a transfer ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It is complete, with these bytes.
    Done(Uploaded),
    /// The node or the master ended it with an abort code.
    Aborted {
        /// The abort code.
        code: AbortCode,
        /// Whether the master sent the abort.
        by_master: bool,
    },
    /// A frame violates the protocol.
    Violation(Violation, Frame),
    /// No answer was received, or no further answer.
    NoAnswer,
}

/// A transfer that has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// The node.
    pub node: NodeId,
    /// The object.
    pub object: ObjectId,
    /// Its direction.
    pub operation: Operation,
    /// How it carries its bytes.
    pub form: Form,
    /// The time of the request.
    pub requested: Stamp,
    /// The time of the first answer.
    pub answered: Option<Stamp>,
    /// The time of the last frame.
    pub ended: Stamp,
    /// Whether another master sent a request while the transfer was in progress.
    pub is_disturbed: bool,
    /// The result.
    pub outcome: Outcome,
}

/// Whether a frame belongs to a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The frame has no COB-ID of an SDO channel.
    OtherFrame,
    /// The frame belongs to a transfer.
    OfTransfer,
    /// The frame has the COB-ID of an SDO channel, but belongs to no transfer.
    Stray,
}

/// Assembles the transfers of all nodes.
#[derive(Clone, Debug, Default)]
pub struct Transfers {
    open: Vec<Open>,
    finished: VecDeque<Transfer>,
    /// Nodes that answer reads with 60h.
    answers_60: BTreeSet<NodeId>,
    answers: BTreeMap<NodeId, Answers>,
    second_answers: VecDeque<(NodeId, ObjectId, SecondAnswer)>,
}

impl Transfers {
    /// Handles a frame. [`Transfers::next_finished`] then returns the transfers that have ended.
    pub fn take(&mut self, received: &Received) -> Part {
        self.expire(received.at.mono);
        let frame = &received.frame;
        let is_part = if let Some(node) = frame.id().sdo_request_node() {
            self.on_request(node, received)
        } else if let Some(node) = frame.id().sdo_response_node() {
            self.on_answer(node, received)
        } else {
            return Part::OtherFrame;
        };
        if is_part { Part::OfTransfer } else { Part::Stray }
    }

    /// The next transfer that has ended.
    pub fn next_finished(&mut self) -> Option<Transfer> {
        self.finished.pop_front()
    }

    /// The next node that sent two answers to one request, with the object. Each node is reported once, and once more
    /// if the answers differ only later.
    pub fn next_second_answer(&mut self) -> Option<(NodeId, ObjectId, SecondAnswer)> {
        self.second_answers.pop_front()
    }

    /// The time at which the next transfer without an answer ends.
    pub fn next_deadline(&self) -> Option<Mono> {
        self.open.iter().map(Open::deadline).min()
    }

    /// Ends the transfers that had no frame for a long time.
    pub fn expire(&mut self, now: Mono) {
        self.end_where(|open| open.deadline() <= now);
    }

    /// Ends all transfers in progress.
    pub fn end_all(&mut self) {
        self.end_where(|_| true);
    }

    /// Forgets the transfers in progress of these objects of a node.
    pub fn forget(&mut self, node: NodeId, is_forgotten: impl Fn(ObjectId) -> bool) {
        self.open.retain(|open| open.node != node || !is_forgotten(open.object));
    }

    fn end_where(&mut self, is_over: impl Fn(&Open) -> bool) {
        let mut at = 0;
        while at < self.open.len() {
            if is_over(&self.open[at]) { self.finish(at, None, Outcome::NoAnswer) } else { at += 1 }
        }
    }

    /// Ends a transfer. `at` is the time of the frame that ended it.
    fn finish(&mut self, index: usize, at: Option<Stamp>, outcome: Outcome) {
        let open = self.open.remove(index);
        if outcome == Outcome::NoAnswer && open.answered.is_none() {
            self.answers.entry(open.node).or_default().on_repeated(open.object);
        }
        self.finished.push_back(open.finished(at, outcome));
    }

    fn position(&self, node: NodeId, fits: impl Fn(&Open) -> bool) -> Option<usize> {
        self.open.iter().position(|open| open.node == node && fits(open))
    }

    /// Handles a frame of a master; `false` if it belongs to no transfer.
    fn on_request(&mut self, node: NodeId, received: &Received) -> bool {
        let frame = &received.frame;
        let Some(&command) = frame.data().first() else { return false };
        let is_abort = command == 0x80;
        if let Some(index) = self.position(node, |open| open.expects_segment(Operation::Write) && !is_abort) {
            return self.step(index, received);
        }
        let object = multiplexer(frame.data());
        match (command >> 5, object) {
            (4, Some(object)) => self.on_abort(node, object, received, true),
            (1 | 2, Some(object)) => self.start(Open::new(node, object, self.answers_60.contains(&node), received)),
            (5, Some(object)) if command & 0x03 == 0 => self.start(Open::new(node, object, false, received)),
            (6, Some(object)) if command & 0x01 == 0 => self.start(Open::new(node, object, false, received)),
            _ => match self.position(node, Open::has_begun) {
                Some(index) => self.step(index, received),
                None => false,
            },
        }
    }

    /// Handles a frame of a node; `false` if it belongs to no transfer.
    fn on_answer(&mut self, node: NodeId, received: &Received) -> bool {
        let frame = &received.frame;
        let Some(&command) = frame.data().first() else { return false };
        let is_abort = command == 0x80;
        if let Some(index) = self.position(node, |open| open.expects_segment(Operation::Read) && !is_abort) {
            return self.step(index, received);
        }
        let object = multiplexer(frame.data());
        let is_first = match command >> 5 {
            2 | 3 => true,
            5 => command & 0x03 == 0,
            6 => command & 0x01 == 0,
            _ => false,
        };
        let index = match object {
            Some(object) if is_abort => return self.on_abort(node, object, received, false),
            Some(object) if is_first => self.position(node, |open| open.object == object && !open.has_begun()),
            _ => self.position(node, Open::has_begun),
        };
        let Some(index) = index else {
            self.on_stray_answer(node, received);
            return false;
        };
        if is_first {
            self.on_first_answer(index, received);
        }
        if self.open[index].object == ObjectId::DEVICE_TYPE && proves_upload_answer_60(frame) {
            self.answers_60.insert(node);
        }
        // Segments or blocks follow.
        let has_segments = matches!(command >> 5, 5 | 6) || command >> 5 == 2 && command & 0x02 == 0;
        let index = if is_first { self.end_earlier(index, has_segments) } else { index };
        self.step(index, received)
    }

    /// Ends earlier transfers of the node: a server answers requests in their order, and it has answered the request of
    /// the transfer at `index`. If segments follow (`has_segments`), an earlier segmented transfer has also ended.
    /// Returns the new index.
    fn end_earlier(&mut self, mut index: usize, has_segments: bool) -> usize {
        let (node, mut at) = (self.open[index].node, 0);
        while at < index {
            let earlier = &self.open[at];
            if earlier.node == node && (has_segments || !earlier.has_begun()) {
                self.finish(at, None, Outcome::NoAnswer);
                index -= 1;
            } else {
                at += 1;
            }
        }
        index
    }

    fn on_abort(&mut self, node: NodeId, object: ObjectId, received: &Received, by_master: bool) -> bool {
        let Some(index) = self.position(node, |open| open.object == object) else {
            if !by_master {
                self.on_stray_answer(node, received);
            }
            return false;
        };
        if !by_master && !self.open[index].has_begun() {
            self.on_first_answer(index, received);
        }
        let code = match received.frame.data() {
            [_, _, _, _, a, b, c, d, ..] => AbortCode(u32::from_le_bytes([*a, *b, *c, *d])),
            _ => AbortCode(0),
        };
        if !by_master {
            self.open[index].answered.get_or_insert(received.at);
        }
        self.finish(index, Some(received.at), Outcome::Aborted { code, by_master });
        true
    }

    fn on_first_answer(&mut self, index: usize, received: &Received) {
        let Open { node, operation, requested, .. } = self.open[index];
        let answers = self.answers.entry(node).or_default();
        answers.on_answer(received.frame, operation, Some(requested.mono), received.at.mono);
    }

    /// Handles an answer without a request. Two devices, or a bridge that repeats frames, send two answers to one
    /// request.
    fn on_stray_answer(&mut self, node: NodeId, received: &Received) {
        let Some(object) = multiplexer(received.frame.data()) else { return };
        let answers = self.answers.entry(node).or_default();
        let before = answers.finding();
        answers.on_unexpected(&received.frame, received.at.mono);
        let finding = answers.finding().filter(|_| answers.finding() != before);
        self.second_answers.extend(finding.map(|finding| (node, object, finding)));
    }

    fn start(&mut self, new: Open) -> bool {
        let is_repeated = |open: &Open| open.object == new.object && open.operation == new.operation;
        if let Some(index) = self.position(new.node, |open| is_repeated(open) && !open.has_begun()) {
            self.finish(index, None, Outcome::NoAnswer);
        }
        for open in self.open.iter_mut().filter(|open| open.node == new.node) {
            open.is_disturbed |= new.requested.mono.since(open.last.mono) < SHORTEST_TIMEOUT;
        }
        if self.open.len() >= MAX_OPEN {
            self.finish(0, None, Outcome::NoAnswer);
        }
        self.open.push(new);
        true
    }

    fn step(&mut self, index: usize, received: &Received) -> bool {
        match self.open[index].on_frame(received) {
            Step::Stray => return false,
            Step::Continue => {}
            Step::End(outcome) => self.finish(index, Some(received.at), outcome),
        }
        true
    }
}
