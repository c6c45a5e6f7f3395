//! SDO upload, expedited and segmented: the client reads an object (CiA 301, 7.2.4.3.5 and 7.2.4.3.6).

use super::{AbortCode, Progress, TransferError, Violation, abort_frame, abort_of, multiplexer, number};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;

/// The limit for the size of an object in bytes. No file in a device is larger.
pub const LONGEST: usize = 64 << 20;

/// The answer to an upload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Uploaded {
    /// The bytes in wire order. An expedited answer without a size has all four bytes.
    pub bytes: Vec<u8>,
    /// Whether the server indicated the size. `false` for an expedited answer without a size (42h, 60h).
    pub indicated: bool,
    /// The size in bytes that a segmented or block transfer announced.
    pub announced: Option<u32>,
    /// Whether a segment before the last one had fewer than seven bytes.
    pub has_short_segment: bool,
    /// The expedited answer, if it has fewer bytes than it declares. The missing bytes are never filled.
    pub truncated: Option<Frame>,
    /// Whether the end frame of a block transfer declared a segment invalid, but size and CRC include it. The segment
    /// is kept.
    pub has_wrong_end: bool,
}

impl Uploaded {
    /// Creates the result for bytes whose size the server indicated.
    pub fn complete(bytes: Vec<u8>) -> Uploaded {
        Uploaded {
            bytes,
            indicated: true,
            announced: None,
            has_short_segment: false,
            truncated: None,
            has_wrong_end: false,
        }
    }

    /// Whether bytes may be missing, because the length is not the announced one or an earlier segment is short.
    pub fn has_doubtful_length(&self) -> bool {
        self.has_short_segment || self.announced.is_some_and(|size| usize::try_from(size) != Ok(self.bytes.len()))
    }
}

/// An upload in progress.
#[derive(Clone, Debug)]
pub struct Upload {
    node: NodeId,
    object: ObjectId,
    state: State,
    bytes: Vec<u8>,
    announced: Option<u32>,
    has_short_segment: bool,
    accept_60: bool,
    /// The limit for the size of the object in bytes.
    limit: usize,
    segments: usize,
}

/// Whether this frame proves that a server answers uploads with 60h. The frame then contains the device type (1000h).
/// 1000h cannot be written, so the frame does not acknowledge a download.
pub fn proves_upload_answer_60(frame: &Frame) -> bool {
    let [0x60, 0x00, 0x10, 0, number @ ..] = frame.data() else { return false };
    number.len() == 4 && number.iter().any(|&byte| byte != 0)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Initiated,
    Segments { toggle: bool },
}

impl Upload {
    /// Creates an upload of `object` from `node`. If `accept_60` is set, 60h counts as an answer without a size
    /// ([`crate::device::quirk::Quirk::UploadAnswered60`]).
    pub fn new(node: NodeId, object: ObjectId, accept_60: bool) -> Upload {
        let (state, bytes) = (State::Initiated, Vec::new());
        let (limit, segments) = (LONGEST, 0);
        Upload { node, object, state, bytes, announced: None, has_short_segment: false, accept_60, limit, segments }
    }

    /// Limits the size of the object to this number of bytes.
    pub fn up_to(mut self, limit: usize) -> Upload {
        self.limit = limit.min(LONGEST);
        self
    }

    /// Returns the request that starts the transfer.
    pub fn request(&self) -> Frame {
        let [a, b, c] = self.object.multiplexer();
        Frame::full(CanId::sdo_request(self.node), [0x40, a, b, c, 0, 0, 0, 0])
    }

    /// Whether the server has answered. If the transfer then fails, the server needs an abort.
    pub fn has_begun(&self) -> bool {
        self.state != State::Initiated
    }

    /// Bytes received so far and bytes announced, for a progress bar.
    pub fn received(&self) -> (usize, Option<u32>) {
        (self.bytes.len(), self.announced)
    }

    /// Handles a received frame. Frames to send go to `out`.
    pub fn on_frame(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        if let Some(code) = abort_of(frame, self.node, self.object) {
            return Progress::Failed(TransferError::Aborted(code));
        }
        let data = frame.data();
        let (true, Some(&command)) = (frame.id() == CanId::sdo_response(self.node), data.first()) else {
            return Progress::NotOurs;
        };
        match self.state {
            State::Initiated if multiplexer(data) == Some(self.object) => self.initiated(command, frame, out),
            State::Segments { toggle } if command >> 5 == 0 => self.segment(command, toggle, frame, out),
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

    fn initiated(&mut self, command: u8, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        let data = frame.data();
        let expedited = command & 0x02 != 0;
        let indicated = command & 0x01 != 0;
        if command == 0x60 && (self.accept_60 || proves_upload_answer_60(frame)) {
            return Progress::Done(Uploaded { indicated: false, ..Uploaded::complete(data[4..].to_vec()) });
        }
        if command >> 5 != 2 {
            let violation = if command == 0x60 { Violation::WriteAcknowledgeToRead } else { Violation::Command };
            return Progress::Failed(TransferError::Violation(violation, *frame));
        }
        if expedited {
            let unused = if indicated { usize::from(command >> 2 & 3) } else { 0 };
            // If a short frame has fewer bytes than it declares, the type decides whether they suffice.
            let end = data.len().min(8 - unused).max(4);
            let truncated = (indicated && data.len() < 8 - unused).then_some(*frame);
            return Progress::Done(Uploaded { indicated, truncated, ..Uploaded::complete(data[4..end].to_vec()) });
        }
        self.state = State::Segments { toggle: false };
        self.announced = if indicated { number(data) } else { None };
        if indicated && self.announced.is_none() {
            return self.fail(Violation::Short, frame, out);
        }
        if self.announced.is_some_and(|size| usize::try_from(size).is_ok_and(|size| size > self.limit)) {
            return self.fail(Violation::TooLong, frame, out);
        }
        out.push(self.segment_request(false));
        Progress::Continue
    }

    fn segment(&mut self, command: u8, toggle: bool, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        if (command & 0x10 != 0) != toggle {
            return self.fail(Violation::Toggle, frame, out);
        }
        let data = frame.data();
        let unused = usize::from(command >> 1 & 7);
        let Some(part) = data.get(1..8 - unused) else { return self.fail(Violation::Short, frame, out) };
        self.bytes.extend_from_slice(part);
        // Each segment except the last one has at least one byte, so the number of segments is limited, too.
        self.segments += 1;
        if self.bytes.len() > self.limit || self.segments > self.limit + 1 {
            return self.fail(Violation::TooLong, frame, out);
        }
        if command & 0x01 != 0 {
            let bytes = std::mem::take(&mut self.bytes);
            let (announced, has_short_segment) = (self.announced, self.has_short_segment);
            return Progress::Done(Uploaded { announced, has_short_segment, ..Uploaded::complete(bytes) });
        }
        self.has_short_segment |= unused > 0;
        self.state = State::Segments { toggle: !toggle };
        out.push(self.segment_request(!toggle));
        Progress::Continue
    }

    fn segment_request(&self, toggle: bool) -> Frame {
        Frame::full(CanId::sdo_request(self.node), [if toggle { 0x70 } else { 0x60 }, 0, 0, 0, 0, 0, 0, 0])
    }

    fn fail(&mut self, violation: Violation, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        self.abort(violation.abort_code(), out);
        Progress::Failed(TransferError::Violation(violation, *frame))
    }
}
