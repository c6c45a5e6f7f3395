//! A block transfer. The sender is the node in a read, and the master in a write.

use super::Outcome;
use super::open::Step;
use crate::canopen::frame::Frame;
use crate::canopen::sdo::{LONGEST, Uploaded, Violation, crc16};
use crate::master::Operation;

/// A block transfer in progress.
#[derive(Clone, Debug)]
pub(super) struct Block {
    phase: Phase,
    /// The acknowledged bytes.
    bytes: Vec<u8>,
    announced: Option<u32>,
    /// Whether both sides compute a CRC.
    has_crc: bool,
    /// Whether the master computes a CRC.
    offers_crc: bool,
    /// The segments of the present block that were received in order.
    segments: Vec<[u8; 7]>,
    /// Whether the last element of `segments` is the last segment of the transfer.
    has_last: bool,
    has_wrong_end: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Requested,
    Segments,
    /// All segments are acknowledged. The end frame follows.
    Acknowledged,
    /// The end frame was sent. Its acknowledgement follows.
    Ended,
}

impl Block {
    /// Creates the transfer that a request starts.
    pub(super) fn new(operation: Operation, data: &[u8]) -> Block {
        let command = data.first().copied().unwrap_or_default();
        let mut block = Block {
            phase: Phase::Requested,
            bytes: Vec::new(),
            announced: None,
            has_crc: false,
            offers_crc: command & 0x04 != 0,
            segments: Vec::new(),
            has_last: false,
            has_wrong_end: false,
        };
        if operation == Operation::Write {
            block.announced = size(command, data);
        }
        block
    }

    pub(super) fn has_begun(&self) -> bool {
        self.phase != Phase::Requested
    }

    /// Whether each frame of the sender is a segment.
    pub(super) fn is_in_segments(&self) -> bool {
        self.phase == Phase::Segments
    }

    /// Whether the node answers the request of a block read with an expedited or segmented transfer.
    pub(super) fn is_answered_otherwise(&self, operation: Operation, is_answer: bool, frame: &Frame) -> bool {
        let is_read = operation == Operation::Read && self.phase == Phase::Requested && is_answer;
        is_read && frame.data().first().is_some_and(|command| command >> 5 != 6)
    }

    /// Handles a frame of the sender.
    pub(super) fn on_sender(&mut self, frame: &Frame) -> Step {
        let data = frame.data();
        let Some(&head) = data.first() else { return Step::Stray };
        match self.phase {
            // The answer to the request of a read.
            Phase::Requested => {
                self.announced = size(head, data);
                self.begin(head);
                Step::Continue
            }
            Phase::Segments if self.is_end_of_empty_object(head, data) => self.on_end(head, frame),
            Phase::Segments => self.on_segment(head, frame),
            Phase::Acknowledged if head & 0xe1 == 0xc1 => self.on_end(head, frame),
            Phase::Acknowledged | Phase::Ended => Step::Stray,
        }
    }

    /// Handles a frame of the receiver.
    pub(super) fn on_receiver(&mut self, frame: &Frame) -> Step {
        let data = frame.data();
        let Some(&command) = data.first() else { return Step::Stray };
        match (self.phase, command & 0xe3) {
            // The answer to the request of a write.
            (Phase::Requested, 0xa0) => {
                self.begin(command);
                Step::Continue
            }
            (Phase::Requested, _) => Step::End(Outcome::Violation(Violation::Command, *frame)),
            // The start of a read.
            (Phase::Segments, 0xa3) => Step::Continue,
            (Phase::Segments, 0xa2) => self.on_acknowledge(frame),
            (Phase::Ended, 0xa1) => {
                let done = Uploaded::complete(std::mem::take(&mut self.bytes));
                let (announced, has_wrong_end) = (self.announced, self.has_wrong_end);
                Step::End(Outcome::Done(Uploaded { announced, has_wrong_end, ..done }))
            }
            _ => Step::Stray,
        }
    }

    fn begin(&mut self, answer: u8) {
        self.has_crc = self.offers_crc && answer & 0x04 != 0;
        self.phase = Phase::Segments;
    }

    fn on_segment(&mut self, head: u8, frame: &Frame) -> Step {
        let sequence = usize::from(head & 0x7f);
        if sequence == 0 {
            return Step::Stray;
        }
        // After a gap, the receiver requests the segments again.
        if sequence == self.segments.len() + 1 && !self.has_last {
            let mut segment = [0; 7];
            let part = frame.data().get(1..).unwrap_or_default();
            segment[..part.len()].copy_from_slice(part);
            self.segments.push(segment);
            self.has_last = head & 0x80 != 0;
        }
        Step::Continue
    }

    fn on_acknowledge(&mut self, frame: &Frame) -> Step {
        let acknowledged = frame.data().get(1).copied().map(usize::from);
        let Some(acknowledged) = acknowledged.filter(|&acknowledged| acknowledged <= self.segments.len()) else {
            // A segment of the transfer was lost on the way to this program.
            return Step::End(Outcome::Violation(Violation::Sequence, *frame));
        };
        let is_complete = self.has_last && acknowledged == self.segments.len();
        self.bytes.extend(self.segments[..acknowledged].iter().flatten());
        self.segments.clear();
        self.has_last = false;
        if self.bytes.len() > LONGEST + 6 {
            return Step::End(Outcome::Violation(Violation::TooLong, *frame));
        }
        if is_complete {
            self.phase = Phase::Acknowledged;
        }
        Step::Continue
    }

    fn on_end(&mut self, head: u8, frame: &Frame) -> Step {
        let unused = usize::from(head >> 2 & 7);
        let is_given = |bytes: &[u8]| {
            let [low, high] = crc16(bytes).to_le_bytes();
            matches!(frame.data(), [_, a, b, ..] if [*a, *b] == [low, high])
        };
        let is_announced = self.announced.is_some_and(|size| usize::try_from(size) == Ok(self.bytes.len()));
        // Some servers declare a full last segment unused, although size and CRC include it.
        self.has_wrong_end = unused == 7 && is_announced && self.has_crc && is_given(&self.bytes);
        if !self.has_wrong_end {
            self.bytes.truncate(self.bytes.len().saturating_sub(unused));
        }
        if self.has_crc && !is_given(&self.bytes) {
            return Step::End(Outcome::Violation(Violation::Crc, *frame));
        }
        self.phase = Phase::Ended;
        Step::Continue
    }

    /// Whether this is the end frame of an object of 0 bytes. Some servers omit the empty segment before it.
    fn is_end_of_empty_object(&self, head: u8, data: &[u8]) -> bool {
        let is_empty = self.announced == Some(0) && self.bytes.is_empty() && self.segments.is_empty();
        is_empty && head & 0xe1 == 0xc1 && data[1..].iter().all(|&byte| byte == 0)
    }
}

/// Parses the size that a request or answer announces.
fn size(command: u8, data: &[u8]) -> Option<u32> {
    match data {
        [_, _, _, _, a, b, c, d, ..] if command & 0x02 != 0 => Some(u32::from_le_bytes([*a, *b, *c, *d])),
        _ => None,
    }
}
