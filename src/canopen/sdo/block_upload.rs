//! SDO block upload: the client reads an object in sub-blocks of up to 127 segments, each acknowledged as a
//! whole (CiA 301, 7.2.4.3.12 to 7.2.4.3.15).
//!
//! Segments are accepted only in order. After a lost segment, the acknowledgement contains the number of the last
//! segment before it. The server repeats the rest. After a time-out the position of the server is uncertain. Then the
//! CRC or the announced size must confirm the data; without both, the transfer fails.

use super::crc::crc16;
use super::{
    AbortCode, BlockSize, LONGEST, MAX_STALLED_BLOCKS, Progress, TransferError, Upload, Uploaded, Violation,
    abort_frame, abort_of, multiplexer, number,
};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;

/// A block upload in progress.
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
    /// The number of bytes missing in the frame of the last segment.
    missing: usize,
    /// The number of consecutive blocks without progress or without an end.
    blocks_without_progress: u8,
    /// Whether segments were repeated.
    has_repeated_segments: bool,
    /// The limit for the size of the object in bytes.
    limit: usize,
    /// Handles the answers if the server chooses an expedited or segmented upload.
    plain: Upload,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Initiated,
    /// The server chose an expedited or segmented answer.
    Plain,
    SubBlock {
        /// The number of segments that were accepted in order.
        accepted: u8,
        /// The highest sequence number seen.
        highest: u8,
        /// The segment number in the last acknowledgement; 0 before the first block.
        acknowledged: u8,
        /// The frame that ended the previous block. A repetition of this frame is ignored.
        closing: Option<Frame>,
    },
    /// All segments are acknowledged; the end frame is expected. `closing` is the frame of the last segment.
    Acknowledged {
        closing: Frame,
    },
}

impl BlockUpload {
    /// Creates an upload of `object` from `node`. `threshold` is the "protocol switch threshold" of the standard, 0 for
    /// none. If the object has at most this many bytes, the server may answer expedited or segmented. For `accept_60`
    /// see [`Upload::new`].
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
            blocks_without_progress: 0,
            has_repeated_segments: false,
            limit: LONGEST,
            plain: Upload::new(node, object, accept_60),
        }
    }

    /// Sets another block size.
    pub fn with_block_size(mut self, block_size: BlockSize) -> BlockUpload {
        self.block_size = block_size;
        self
    }

    /// Limits the size of the object to this number of bytes.
    pub fn up_to(mut self, limit: usize) -> BlockUpload {
        self.limit = limit.min(LONGEST);
        self.plain = self.plain.up_to(limit);
        self
    }

    /// Returns the initiate request, which always asks for a CRC.
    pub fn request(&self) -> Frame {
        let [a, b, c] = self.object.multiplexer();
        let request = [0xa4, a, b, c, self.block_size.get(), self.threshold, 0, 0];
        Frame::full(CanId::sdo_request(self.node), request)
    }

    /// Whether the server has answered. An abort before that rejects the request, so another kind of transfer may be
    /// tried.
    pub fn has_begun(&self) -> bool {
        match self.state {
            State::Initiated => false,
            State::Plain => self.plain.has_begun(),
            State::SubBlock { .. } | State::Acknowledged { .. } => true,
        }
    }

    /// Whether the server answers in blocks.
    pub fn is_in_blocks(&self) -> bool {
        matches!(self.state, State::SubBlock { .. } | State::Acknowledged { .. })
    }

    /// Bytes received so far and bytes announced, for a progress bar.
    pub fn received(&self) -> (usize, Option<u32>) {
        if self.state == State::Plain { self.plain.received() } else { (self.bytes.len(), self.announced) }
    }

    /// Handles a received frame. Frames to send go to `out`. For an accepted segment, returns [`Progress::Continue`]
    /// without a frame to send; the time-out restarts.
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
            State::SubBlock { accepted: 0, highest: 0, acknowledged: 0, .. }
                if self.is_end_of_empty_object(head, frame) =>
            {
                self.end(head, None, frame, out)
            }
            State::SubBlock { .. } => self.segment(head, frame, out),
            State::Acknowledged { closing } if head & 0xe1 == 0xc1 => self.end(head, Some(closing), frame, out),
            State::Plain | State::Acknowledged { .. } => Progress::NotOurs,
        }
    }

    /// Handles a time-out. Within a block, acknowledges the received segments, so that the server repeats the rest.
    /// Otherwise aborts the transfer. `None` means that the transfer continues.
    pub fn on_timeout(&mut self, out: &mut Vec<Frame>) -> Option<TransferError> {
        if let State::SubBlock { accepted, acknowledged, .. } = self.state {
            // If no segment was received, either the block or our last acknowledgement was lost. A new acknowledgement
            // is right in both cases only if the last one was 0.
            let unambiguous = accepted > 0 || acknowledged == 0;
            let provable = self.crc || self.announced.is_some();
            if unambiguous && provable && self.blocks_without_progress < MAX_STALLED_BLOCKS {
                self.blocks_without_progress += 1;
                self.has_repeated_segments = true;
                self.acknowledge(accepted, None, out);
                return None;
            }
        }
        self.abort(AbortCode::TIMEOUT, out);
        Some(TransferError::NoAnswer)
    }

    /// Aborts the transfer, even if the request was not answered. The answer may be lost, and the server would treat
    /// all further frames as part of the block transfer.
    pub fn abort(&mut self, code: AbortCode, out: &mut Vec<Frame>) {
        out.push(abort_frame(self.node, self.object, code));
    }

    fn initiated(&mut self, head: u8, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        let data = frame.data();
        if multiplexer(data) != Some(self.object) {
            return Progress::NotOurs;
        }
        // 46h may be C6h with one wrong bit: an expedited answer without a size must not set bits 2 and 3.
        if head & 0xf3 == 0x42 && head & 0x0c != 0 {
            return self.fail(Violation::Command, frame, out);
        }
        if head & 0xe1 != 0xc0 {
            // A segmented or expedited answer, or a violation: `Upload` handles both.
            let progress = self.plain.on_frame(frame, out);
            if progress == Progress::Continue {
                self.state = State::Plain;
            }
            return progress;
        }
        self.crc = head & 0x04 != 0;
        self.announced = if head & 0x02 != 0 { number(data) } else { None };
        if head & 0x02 != 0 && self.announced.is_none() {
            return self.fail(Violation::Short, frame, out);
        }
        if self.announced.is_some_and(|size| usize::try_from(size).is_ok_and(|size| size > self.limit)) {
            return self.fail(Violation::TooLong, frame, out);
        }
        self.state = State::SubBlock { accepted: 0, highest: 0, acknowledged: 0, closing: None };
        self.send(0xa3, 0, 0, out);
        Progress::Continue
    }

    fn segment(&mut self, head: u8, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        let State::SubBlock { accepted, highest, acknowledged, closing } = self.state else { return Progress::NotOurs };
        let sequence = head & 0x7f;
        let is_last = head & 0x80 != 0;
        let in_order = sequence == accepted + 1;
        if sequence == 0 || sequence > self.block_size.get() || (!in_order && closing == Some(*frame)) {
            return Progress::NotOurs;
        }
        let accepted = if in_order {
            let part = frame.data().get(1..).unwrap_or_default();
            // The end frame gives the number of valid bytes in the last segment only.
            if part.len() < 7 && !is_last {
                return self.fail(Violation::Short, frame, out);
            }
            self.missing = 7 - part.len();
            self.bytes.extend_from_slice(part);
            self.bytes.extend(std::iter::repeat_n(0, self.missing));
            // The end frame may declare up to six bytes of the last segment as unused.
            if self.bytes.len() > self.limit.saturating_add(6) {
                return self.fail(Violation::TooLong, frame, out);
            }
            sequence
        } else {
            accepted
        };
        if in_order && is_last {
            self.acknowledge(accepted, Some(*frame), out);
            self.state = State::Acknowledged { closing: *frame };
        } else if is_last || sequence == self.block_size.get() {
            self.has_repeated_segments |= !in_order;
            self.blocks_without_progress = if accepted > 0 { 0 } else { self.blocks_without_progress + 1 };
            if self.blocks_without_progress > MAX_STALLED_BLOCKS {
                return self.fail(Violation::Stuck, frame, out);
            }
            self.acknowledge(accepted, Some(*frame), out);
        } else if in_order || sequence > highest {
            self.state = State::SubBlock { accepted, highest: highest.max(sequence), acknowledged, closing };
        } else {
            return Progress::NotOurs;
        }
        Progress::Continue
    }

    /// Acknowledges the first `accepted` segments of the block and starts the next one.
    fn acknowledge(&mut self, accepted: u8, closing: Option<Frame>, out: &mut Vec<Frame>) {
        self.state = State::SubBlock { accepted: 0, highest: 0, acknowledged: accepted, closing };
        self.send(0xa2, accepted, self.block_size.get(), out);
    }

    /// Whether this is the end frame of an object of 0 bytes. Some servers omit the empty segment before it.
    fn is_end_of_empty_object(&self, head: u8, frame: &Frame) -> bool {
        let is_empty = self.announced == Some(0) || self.announced.is_none() && self.crc;
        is_empty && head & 0xe1 == 0xc1 && frame.data()[1..].iter().all(|&byte| byte == 0)
    }

    fn end(&mut self, head: u8, closing: Option<Frame>, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        let data = frame.data();
        let unused = usize::from(head >> 2 & 7);
        let is_last_full = self.is_last_segment_full(unused, data);
        let length = if is_last_full { self.bytes.len() } else { self.bytes.len().saturating_sub(unused) };
        let expected = if self.crc { crc16(&self.bytes[..length]) } else { 0 };
        let [low, high] = expected.to_le_bytes();
        // If segment 65 is the last one, it starts like an end frame. A repetition of this segment is not an end frame,
        // unless it has the expected contents.
        if closing == Some(*frame) && data != [head, low, high, 0, 0, 0, 0, 0] {
            return Progress::NotOurs;
        }
        if !is_last_full && unused < self.missing {
            return self.fail(Violation::Short, frame, out);
        }
        if self.crc {
            match data {
                [_, a, b, ..] if [*a, *b] == [low, high] => {}
                [_, _, _, ..] => return self.fail(Violation::Crc, frame, out),
                _ => return self.fail(Violation::Short, frame, out),
            }
        }
        // The CRC does not detect missing leading zeros.
        if self.has_repeated_segments && self.announced.is_some_and(|size| usize::try_from(size) != Ok(length)) {
            return self.fail(Violation::Size, frame, out);
        }
        self.send(0xa1, 0, 0, out);
        let mut bytes = std::mem::take(&mut self.bytes);
        bytes.truncate(length);
        Progress::Done(Uploaded { announced: self.announced, has_wrong_end: is_last_full, ..Uploaded::complete(bytes) })
    }

    /// Whether an end frame wrongly declares the whole last segment invalid, although the announced size and the CRC
    /// include the segment. durand 0.5.0 does this if the size is a multiple of seven bytes.
    fn is_last_segment_full(&self, unused: usize, end: &[u8]) -> bool {
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
