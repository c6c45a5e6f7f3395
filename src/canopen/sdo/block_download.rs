//! SDO block download: the client writes an object in sub-blocks of up to 127 segments, each acknowledged as
//! a whole (CiA 301, 7.2.4.3.9 to 7.2.4.3.11).
//!
//! All segments of a block go to `out` at once. The caller limits their rate and reports each sent frame
//! ([`BlockDownload::on_sent`]). Segments that the server does not acknowledge are sent again. Nothing is repeated
//! after a time-out.

use super::crc::crc16;
use super::{
    AbortCode, BlockSize, DownloadSize, MAX_STALLED_BLOCKS, Progress, TransferError, Violation, abort_frame, abort_of,
    multiplexer,
};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;

/// A block download in progress.
#[derive(Clone, Debug)]
pub struct BlockDownload {
    node: NodeId,
    object: ObjectId,
    data: Vec<u8>,
    size: DownloadSize,
    state: State,
    /// Whether the server checks a CRC.
    crc: bool,
    /// The number of consecutive blocks of which the server accepted no segment.
    stalled_blocks: u8,
    /// The acknowledgement of the previous block.
    acknowledge: Option<Frame>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Initiated,
    SubBlock {
        /// Acknowledged bytes before this block.
        start: usize,
        /// Segments in the block.
        count: u8,
        /// Segments already sent.
        sent: u8,
    },
    /// All segments are acknowledged and the end frame was sent.
    Ended,
}

impl BlockDownload {
    /// Creates a download of `data` (any length) to `object` of `node`.
    pub fn new(node: NodeId, object: ObjectId, data: Vec<u8>, size: DownloadSize) -> BlockDownload {
        let state = State::Initiated;
        BlockDownload { node, object, data, size, state, crc: false, stalled_blocks: 0, acknowledge: None }
    }

    /// Returns the initiate request, which always offers a CRC.
    pub fn request(&self) -> Frame {
        let [a, b, c] = self.object.multiplexer();
        let mut frame = [0xc4, a, b, c, 0, 0, 0, 0];
        if let (DownloadSize::Indicated, Ok(size)) = (self.size, u32::try_from(self.data.len())) {
            frame[0] = 0xc6;
            frame[4..].copy_from_slice(&size.to_le_bytes());
        }
        Frame::full(CanId::sdo_request(self.node), frame)
    }

    /// Whether the server has accepted data. An abort before that rejects the request, so another kind of transfer may
    /// be tried.
    pub fn has_begun(&self) -> bool {
        self.state != State::Initiated
    }

    /// Bytes sent so far and in total, for a progress bar.
    pub fn sent(&self) -> (usize, usize) {
        let all = self.data.len();
        match self.state {
            State::Initiated => (0, all),
            State::SubBlock { start, sent, .. } => (all.min(start + 7 * usize::from(sent)), all),
            State::Ended => (all, all),
        }
    }

    /// Counts a sent frame. A server never acknowledges unsent segments. So the number of sent segments identifies a
    /// repeated acknowledgement of the previous block.
    pub fn on_sent(&mut self) {
        if let State::SubBlock { count, sent, .. } = &mut self.state {
            *sent = (*count).min(*sent + 1);
        }
    }

    /// Handles a received frame. Frames to send go to `out`. If there are any, the caller must drop earlier frames that
    /// were not sent yet.
    pub fn on_frame(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<()> {
        if let Some(code) = abort_of(frame, self.node, self.object) {
            return Progress::Failed(TransferError::Aborted(code));
        }
        let data = frame.data();
        let (true, Some(&command)) = (frame.id() == CanId::sdo_response(self.node), data.first()) else {
            return Progress::NotOurs;
        };
        match (self.state, command & 0xe3) {
            (State::Initiated, 0xa0) if multiplexer(data) == Some(self.object) => {
                self.crc = command & 0x04 != 0;
                let block_size = data.get(4).copied();
                self.send_sub_block(0, block_size, frame, out)
            }
            (State::Initiated, _) if multiplexer(data) == Some(self.object) => {
                Progress::Failed(TransferError::Violation(Violation::Command, *frame))
            }
            (State::SubBlock { start, count, sent }, 0xa2) => self.on_acknowledge(start, count, sent, frame, out),
            (State::SubBlock { .. }, 0xa1) => self.fail(Violation::Command, frame, out),
            (State::Ended, 0xa1) => Progress::Done(()),
            _ => Progress::NotOurs,
        }
    }

    /// Handles a time-out: aborts the transfer.
    pub fn on_timeout(&mut self, out: &mut Vec<Frame>) -> TransferError {
        self.abort(AbortCode::TIMEOUT, out);
        TransferError::NoAnswer
    }

    /// Aborts the transfer, even if the request was not answered. The answer may be lost, and the server would treat
    /// all further frames as part of the block transfer.
    pub fn abort(&mut self, code: AbortCode, out: &mut Vec<Frame>) {
        out.push(abort_frame(self.node, self.object, code));
    }

    fn on_acknowledge(
        &mut self,
        start: usize,
        count: u8,
        sent: u8,
        frame: &Frame,
        out: &mut Vec<Frame>,
    ) -> Progress<()> {
        let data = frame.data();
        let Some(&accepted) = data.get(1) else { return self.fail(Violation::Short, frame, out) };
        if accepted > sent {
            if self.acknowledge == Some(*frame) {
                return Progress::NotOurs;
            }
            return self.fail(Violation::Sequence, frame, out);
        }
        self.acknowledge = Some(*frame);
        let next = start + 7 * usize::from(accepted);
        if accepted == count && next >= self.data.len() {
            self.send_end(next - self.data.len(), out);
            return Progress::Continue;
        }
        self.stalled_blocks = if accepted > 0 { 0 } else { self.stalled_blocks + 1 };
        if self.stalled_blocks > MAX_STALLED_BLOCKS {
            return self.fail(Violation::Stuck, frame, out);
        }
        self.send_sub_block(next, data.get(2).copied(), frame, out)
    }

    /// Sends the segments from byte `start` on, up to the block size.
    fn send_sub_block(
        &mut self,
        start: usize,
        block_size: Option<u8>,
        frame: &Frame,
        out: &mut Vec<Frame>,
    ) -> Progress<()> {
        self.state = State::SubBlock { start, count: 0, sent: 0 };
        let Some(block_size) = block_size.and_then(BlockSize::new) else {
            return self.fail(Violation::BlockSize, frame, out);
        };
        let rest = &self.data[start..];
        // An empty object is sent as one segment without valid bytes.
        let last = rest.len().div_ceil(7).max(1);
        let mut count = 0;
        for sequence in 1..=block_size.get() {
            let from = 7 * usize::from(count);
            let part = &rest[from..rest.len().min(from + 7)];
            count = sequence;
            let is_last = usize::from(sequence) == last;
            let mut segment = [0u8; 8];
            segment[0] = u8::from(is_last) << 7 | sequence;
            segment[1..=part.len()].copy_from_slice(part);
            out.push(Frame::full(CanId::sdo_request(self.node), segment));
            if is_last {
                break;
            }
        }
        self.state = State::SubBlock { start, count, sent: 0 };
        Progress::Continue
    }

    fn send_end(&mut self, unused: usize, out: &mut Vec<Frame>) {
        let [low, high] = if self.crc { crc16(&self.data).to_le_bytes() } else { [0, 0] };
        let [unused, ..] = unused.to_le_bytes();
        let end = [0xc1 | unused << 2, low, high, 0, 0, 0, 0, 0];
        self.state = State::Ended;
        out.push(Frame::full(CanId::sdo_request(self.node), end));
    }

    fn fail(&mut self, violation: Violation, frame: &Frame, out: &mut Vec<Frame>) -> Progress<()> {
        self.abort(violation.abort_code(), out);
        Progress::Failed(TransferError::Violation(violation, *frame))
    }
}
