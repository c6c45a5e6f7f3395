//! SDO download, expedited and segmented: the client writes an object (CiA 301, 7.2.4.3.3 and 7.2.4.3.4).

use super::{AbortCode, Progress, TransferError, Violation, abort_frame, abort_of, multiplexer};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;

/// Whether a download indicates its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DownloadSize {
    /// The size is indicated: 2Fh, 2Bh, 27h, 23h, 21h.
    #[default]
    Indicated,
    /// The size is not indicated: 22h, 20h. The manuals of D-20-9 and DPS show this form.
    Omitted,
}

/// A download in progress.
#[derive(Clone, Debug)]
pub struct Download {
    node: NodeId,
    object: ObjectId,
    data: Vec<u8>,
    size: DownloadSize,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Initiated,
    /// A segment was sent. The bytes before `end` are sent, and the acknowledgement with `toggle` is expected.
    Segment {
        end: usize,
        toggle: bool,
    },
}

impl Download {
    /// Creates a download of `data` to `object` of `node`. One to four bytes are sent expedited, other sizes segmented.
    /// An expedited transfer cannot indicate 0 bytes.
    pub fn new(node: NodeId, object: ObjectId, data: Vec<u8>, size: DownloadSize) -> Download {
        Download { node, object, data, size, state: State::Initiated }
    }

    fn is_expedited(&self) -> bool {
        (1..=4).contains(&self.data.len())
    }

    /// Returns the initiate request.
    pub fn request(&self) -> Frame {
        let [a, b, c] = self.object.multiplexer();
        let mut frame = [0, a, b, c, 0, 0, 0, 0];
        if self.is_expedited() {
            frame[4..4 + self.data.len()].copy_from_slice(&self.data);
            frame[0] = match (self.size, self.data.len()) {
                (DownloadSize::Omitted, _) => 0x22,
                (DownloadSize::Indicated, 1) => 0x2f,
                (DownloadSize::Indicated, 2) => 0x2b,
                (DownloadSize::Indicated, 3) => 0x27,
                (DownloadSize::Indicated, _) => 0x23,
            };
        } else {
            frame[0] = 0x20;
            if let (DownloadSize::Indicated, Ok(size)) = (self.size, u32::try_from(self.data.len())) {
                frame[0] = 0x21;
                frame[4..].copy_from_slice(&size.to_le_bytes());
            }
        }
        Frame::full(CanId::sdo_request(self.node), frame)
    }

    /// Whether the server has answered. If the transfer then fails, the server needs an abort.
    pub fn has_begun(&self) -> bool {
        self.state != State::Initiated
    }

    /// Bytes sent so far and in total, for a progress bar.
    pub fn sent(&self) -> (usize, usize) {
        match self.state {
            State::Initiated => (0, self.data.len()),
            State::Segment { end, .. } => (end, self.data.len()),
        }
    }

    /// Handles a received frame. Frames to send go to `out`.
    pub fn on_frame(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<()> {
        if let Some(code) = abort_of(frame, self.node, self.object) {
            return Progress::Failed(TransferError::Aborted(code));
        }
        let data = frame.data();
        let (true, Some(&command)) = (frame.id() == CanId::sdo_response(self.node), data.first()) else {
            return Progress::NotOurs;
        };
        match self.state {
            State::Initiated if multiplexer(data) == Some(self.object) => {
                if command != 0x60 {
                    return Progress::Failed(TransferError::Violation(Violation::Command, *frame));
                }
                if self.is_expedited() {
                    return Progress::Done(());
                }
                self.send_segment(0, false, out);
                Progress::Continue
            }
            State::Segment { end, toggle } if command >> 5 == 1 => {
                if (command & 0x10 != 0) != toggle {
                    self.abort(AbortCode::TOGGLE, out);
                    return Progress::Failed(TransferError::Violation(Violation::Toggle, *frame));
                }
                if end == self.data.len() {
                    return Progress::Done(());
                }
                self.send_segment(end, !toggle, out);
                Progress::Continue
            }
            _ => Progress::NotOurs,
        }
    }

    /// Handles a time-out: sends an abort if the server had answered.
    pub fn on_timeout(&mut self, out: &mut Vec<Frame>) -> TransferError {
        self.abort(AbortCode::TIMEOUT, out);
        TransferError::NoAnswer
    }

    /// Ends the transfer: sends an abort if the server had answered.
    pub fn abort(&mut self, code: AbortCode, out: &mut Vec<Frame>) {
        if self.has_begun() {
            out.push(abort_frame(self.node, self.object, code));
        }
    }

    fn send_segment(&mut self, start: usize, toggle: bool, out: &mut Vec<Frame>) {
        let end = self.data.len().min(start + 7);
        let part = &self.data[start..end];
        let mut frame = [0u8; 8];
        frame[1..=part.len()].copy_from_slice(part);
        let unused = (7 - part.len()).to_le_bytes()[0];
        frame[0] = u8::from(toggle) << 4 | unused << 1 | u8::from(end == self.data.len());
        self.state = State::Segment { end, toggle };
        out.push(Frame::full(CanId::sdo_request(self.node), frame));
    }
}
