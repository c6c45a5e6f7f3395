//! SDO block upload: the client reads an object in sub-blocks of up to 127 segments, each acknowledged as a
//! whole (CiA 301, 7.2.4.3.12 to 7.2.4.3.15).
//!
//! Segments are taken in order only. When one was lost, the acknowledge names the last one before it, and the
//! server sends the rest again. After a time-out it is not certain where the server stands: what comes then
//! must be proved right by the CRC or the announced size, and where a server offers neither, nothing is tried.

use super::crc::crc16;
use super::upload::LONGEST;
use super::{
    AbortCode, BlockSize, PATIENCE, Progress, TransferError, Upload, Uploaded, Violation, abort_frame, abort_of,
    multiplexer, number,
};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;

/// A read in blocks, in progress.
#[derive(Clone, Debug)]
pub struct BlockUpload {
    node: NodeId,
    object: ObjectId,
    block_size: BlockSize,
    threshold: u8,
    state: State,
    bytes: Vec<u8>,
    announced: Option<u32>,
    /// Whether the server computes a CRC.
    crc: bool,
    /// How many bytes the frame of the last segment fell short of eight.
    missing: usize,
    /// Sub-blocks in a row that brought nothing or did not come to their end.
    setbacks: u8,
    /// Whether anything had to be sent again.
    disturbed: bool,
    /// Takes over when the server answers as to a normal read.
    plain: Upload,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Initiated,
    /// The server chose an expedited or segmented answer.
    Plain,
    SubBlock {
        /// Segments taken, all in order.
        taken: u8,
        /// The highest sequence number seen.
        highest: u8,
        /// What the acknowledge before this sub-block said; 0 before the first.
        acknowledged: u8,
        /// The frame that ended the sub-block before: when it comes twice it ends nothing.
        closing: Option<Frame>,
    },
    /// Everything is acknowledged; the end frame is awaited. `closing` is the frame of the last segment.
    Acknowledged {
        closing: Frame,
    },
}

impl BlockUpload {
    /// A read of `object` from `node`. With a `threshold` (the standard's "protocol switch threshold", 0 for
    /// none) the server may answer as to a normal read when the object has no more bytes than that;
    /// `accept_60` counts there, see [`Upload::new`].
    pub fn new(node: NodeId, object: ObjectId, threshold: u8, accept_60: bool) -> BlockUpload {
        BlockUpload {
            node,
            object,
            block_size: BlockSize::LARGEST,
            threshold,
            state: State::Initiated,
            bytes: Vec::new(),
            announced: None,
            crc: false,
            missing: 0,
            setbacks: 0,
            disturbed: false,
            plain: Upload::new(node, object, accept_60),
        }
    }

    /// The same read with other sub-blocks than the largest.
    pub fn with_block_size(mut self, block_size: BlockSize) -> BlockUpload {
        self.block_size = block_size;
        self
    }

    /// The request that starts the transfer: a CRC is always asked for.
    pub fn request(&self) -> Frame {
        let [a, b, c] = self.object.multiplexer();
        let request = [0xa4, a, b, c, self.block_size.get(), self.threshold, 0, 0];
        Frame::full(CanId::sdo_request(self.node), request)
    }

    /// Whether the server has begun to answer. A refusal while this is `false` was one of the request: nothing
    /// has been transferred, another way may be tried.
    pub fn has_begun(&self) -> bool {
        match self.state {
            State::Initiated => false,
            State::Plain => self.plain.has_begun(),
            State::SubBlock { .. } | State::Acknowledged { .. } => true,
        }
    }

    /// Whether the server answers in blocks. It has not, if it answered as to a normal read.
    pub fn is_in_blocks(&self) -> bool {
        matches!(self.state, State::SubBlock { .. } | State::Acknowledged { .. })
    }

    /// Bytes received so far and bytes announced, for a progress bar.
    pub fn received(&self) -> (usize, Option<u32>) {
        if self.state == State::Plain { self.plain.received() } else { (self.bytes.len(), self.announced) }
    }

    /// Takes a frame of the bus; what is to be sent next goes to `out`. A segment that moves the transfer on
    /// is [`Progress::Continue`] with nothing to send: the wait for the next one starts anew.
    pub fn on_frame(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        if self.state == State::Plain {
            return self.plain.on_frame(frame, out);
        }
        if let Some(code) = abort_of(frame, self.node, self.object) {
            return Progress::Failed(TransferError::Aborted(code));
        }
        let (true, Some(&head)) = (frame.id() == CanId::sdo_response(self.node), frame.data().first()) else {
            return Progress::NotOurs;
        };
        match self.state {
            State::Initiated => self.initiated(head, frame, out),
            State::SubBlock { .. } => self.segment(head, frame, out),
            State::Acknowledged { closing } if head & 0xe1 == 0xc1 => self.end(head, closing, frame, out),
            State::Plain | State::Acknowledged { .. } => Progress::NotOurs,
        }
    }

    /// Nothing came in time. Within a sub-block, what came of it is acknowledged, so that the server sends
    /// the rest again, and `None` says that the transfer goes on. Otherwise it is given up, and the
    /// server is told.
    pub fn on_timeout(&mut self, out: &mut Vec<Frame>) -> Option<TransferError> {
        if let State::SubBlock { taken, acknowledged, .. } = self.state {
            // With nothing taken, either the sub-block was lost or the acknowledge before it, and the
            // server's place is known only if both come to the same: after an acknowledge of nothing.
            let unambiguous = taken > 0 || acknowledged == 0;
            let provable = self.crc || self.announced.is_some();
            if unambiguous && provable && self.setbacks < PATIENCE {
                self.setbacks += 1;
                self.disturbed = true;
                self.acknowledge(taken, None, out);
                return None;
            }
        }
        self.abort(AbortCode::TIMEOUT, out);
        Some(TransferError::NoAnswer)
    }

    /// Tells the server that the transfer is over. Of a request that was not answered, too: perhaps only the
    /// answer was lost, and a server in a block transfer takes everything that follows for a part of it.
    pub fn abort(&mut self, code: AbortCode, out: &mut Vec<Frame>) {
        out.push(abort_frame(self.node, self.object, code));
    }

    fn initiated(&mut self, head: u8, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        let data = frame.data();
        if multiplexer(data) != Some(self.object) {
            return Progress::NotOurs;
        }
        if head & 0xe1 != 0xc0 {
            // As to a normal read, or against the protocol: both are known there.
            let progress = self.plain.on_frame(frame, out);
            if progress == Progress::Continue {
                self.state = State::Plain;
            }
            return progress;
        }
        self.crc = head & 0x04 != 0;
        self.announced = if head & 0x02 != 0 { number(data) } else { None };
        self.state = State::SubBlock { taken: 0, highest: 0, acknowledged: 0, closing: None };
        self.send(0xa3, 0, 0, out);
        Progress::Continue
    }

    fn segment(&mut self, head: u8, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        let State::SubBlock { taken, highest, acknowledged, closing } = self.state else { return Progress::NotOurs };
        let sequence = head & 0x7f;
        let is_last = head & 0x80 != 0;
        let in_order = sequence == taken + 1;
        if sequence == 0 || sequence > self.block_size.get() || (!in_order && closing == Some(*frame)) {
            return Progress::NotOurs;
        }
        let taken = if in_order {
            let part = frame.data().get(1..).unwrap_or_default();
            // Only of the last segment the end frame tells which bytes count.
            if part.len() < 7 && !is_last {
                return self.fail(Violation::Short, frame, out);
            }
            self.missing = 7 - part.len();
            self.bytes.extend_from_slice(part);
            self.bytes.extend(std::iter::repeat_n(0, self.missing));
            if self.bytes.len() > LONGEST {
                return self.fail(Violation::TooLong, frame, out);
            }
            sequence
        } else {
            taken
        };
        if in_order && is_last {
            self.acknowledge(taken, Some(*frame), out);
            self.state = State::Acknowledged { closing: *frame };
        } else if is_last || sequence == self.block_size.get() {
            self.disturbed |= !in_order;
            self.setbacks = if taken > 0 { 0 } else { self.setbacks + 1 };
            if self.setbacks > PATIENCE {
                return self.fail(Violation::Stuck, frame, out);
            }
            self.acknowledge(taken, Some(*frame), out);
        } else if in_order || sequence > highest {
            self.state = State::SubBlock { taken, highest: highest.max(sequence), acknowledged, closing };
        } else {
            return Progress::NotOurs;
        }
        Progress::Continue
    }

    /// Acknowledges the first `taken` segments of the sub-block; the next one begins.
    fn acknowledge(&mut self, taken: u8, closing: Option<Frame>, out: &mut Vec<Frame>) {
        self.state = State::SubBlock { taken: 0, highest: 0, acknowledged: taken, closing };
        self.send(0xa2, taken, self.block_size.get(), out);
    }

    fn end(&mut self, head: u8, closing: Frame, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        let data = frame.data();
        let unused = usize::from(head >> 2 & 7);
        let misnamed = self.is_full_by_proof(unused, data);
        let length = if misnamed { self.bytes.len() } else { self.bytes.len().saturating_sub(unused) };
        let expected = if self.crc { crc16(&self.bytes[..length]) } else { 0 };
        let [low, high] = expected.to_le_bytes();
        // Segment 65, when it is the last, begins as an end frame does. Come twice, it is none, unless it
        // says what the end frame must say.
        if *frame == closing && data != [head, low, high, 0, 0, 0, 0, 0] {
            return Progress::NotOurs;
        }
        if !misnamed && unused < self.missing {
            return self.fail(Violation::Short, frame, out);
        }
        if self.crc {
            match data {
                [_, a, b, ..] if [*a, *b] == [low, high] => {}
                [_, _, _, ..] => return self.fail(Violation::Crc, frame, out),
                _ => return self.fail(Violation::Short, frame, out),
            }
        }
        // The CRC does not see how many zeros come first.
        if self.disturbed && self.announced.is_some_and(|size| usize::try_from(size) != Ok(length)) {
            return self.fail(Violation::Size, frame, out);
        }
        self.send(0xa1, 0, 0, out);
        let mut bytes = std::mem::take(&mut self.bytes);
        bytes.truncate(length);
        Progress::Done(Uploaded { bytes, indicated: true, announced: self.announced, misnamed_end: misnamed })
    }

    /// Whether an end frame that takes back the whole last segment is wrong: the announced size and the CRC
    /// both say that all of it counts. durand 0.5.0 ends every object of a multiple of seven bytes so.
    fn is_full_by_proof(&self, unused: usize, end: &[u8]) -> bool {
        let announced = self.announced.is_some_and(|size| usize::try_from(size) == Ok(self.bytes.len()));
        let given = matches!(end, [_, low, high, ..] if u16::from_le_bytes([*low, *high]) == crc16(&self.bytes));
        unused == 7 && self.missing == 0 && !self.bytes.is_empty() && announced && self.crc && given
    }

    fn send(&self, command: u8, first: u8, second: u8, out: &mut Vec<Frame>) {
        out.push(Frame::full(CanId::sdo_request(self.node), [command, first, second, 0, 0, 0, 0, 0]));
    }

    fn fail(&mut self, violation: Violation, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        self.abort(violation.abort_code(), out);
        Progress::Failed(TransferError::Violation(violation, *frame))
    }
}
