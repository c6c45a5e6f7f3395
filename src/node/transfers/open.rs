//! One transfer in progress.

use super::block::Block;
use super::{Form, Outcome, READ_TIMEOUT, Transfer, WRITE_TIMEOUT};
use crate::bus::{Mono, Received, Stamp};
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{LONGEST, Progress, TransferError, Upload, Uploaded, Violation};
use crate::master::Operation;

/// A transfer in progress.
#[derive(Clone, Debug)]
pub(super) struct Open {
    pub(super) node: NodeId,
    pub(super) object: ObjectId,
    pub(super) operation: Operation,
    pub(super) requested: Stamp,
    pub(super) answered: Option<Stamp>,
    /// The time of the last frame.
    pub(super) last: Stamp,
    pub(super) is_disturbed: bool,
    state: State,
}

#[derive(Clone, Debug)]
enum State {
    Upload(Upload),
    Download(Download),
    Block(Block),
}

/// What a frame means for a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// The frame does not belong to the transfer.
    Stray,
    /// The transfer continues.
    Continue,
    /// The transfer has ended.
    End(Outcome),
}

impl Open {
    /// Creates the transfer that a request starts. With `accept_60`, the node answers reads with 60h.
    pub(super) fn new(node: NodeId, object: ObjectId, accept_60: bool, received: &Received) -> Open {
        let data = received.frame.data();
        let command = data.first().copied().unwrap_or_default();
        let (operation, state) = match command >> 5 {
            1 => (Operation::Write, State::Download(Download::new(data))),
            6 => (Operation::Write, State::Block(Block::new(Operation::Write, data))),
            5 => (Operation::Read, State::Block(Block::new(Operation::Read, data))),
            _ => (Operation::Read, State::Upload(Upload::new(node, object, accept_60))),
        };
        let at = received.at;
        Open { node, object, operation, requested: at, answered: None, last: at, is_disturbed: false, state }
    }

    /// The time at which the transfer ends without a further frame.
    pub(super) fn deadline(&self) -> Mono {
        self.last.mono + if self.operation == Operation::Read { READ_TIMEOUT } else { WRITE_TIMEOUT }
    }

    /// Whether the node has answered and more frames follow.
    pub(super) fn has_begun(&self) -> bool {
        match &self.state {
            State::Upload(upload) => upload.has_begun(),
            State::Download(download) => download.has_begun,
            State::Block(block) => block.has_begun(),
        }
    }

    /// Whether each frame of the sender is now a segment of a block. In a read the sender is the node, in a write the
    /// master.
    pub(super) fn expects_segment(&self, operation: Operation) -> bool {
        matches!(&self.state, State::Block(block) if self.operation == operation && block.is_in_segments())
    }

    /// Handles a frame of the SDO channel of the node.
    pub(super) fn on_frame(&mut self, received: &Received) -> Step {
        let frame = &received.frame;
        let is_answer = frame.id().sdo_response_node().is_some();
        if let State::Block(block) = &self.state
            && block.is_answered_otherwise(self.operation, is_answer, frame)
        {
            // The node chose another form than block transfer.
            self.state = State::Upload(Upload::new(self.node, self.object, false));
        }
        let is_sender = is_answer == (self.operation == Operation::Read);
        let step = match &mut self.state {
            State::Upload(upload) if is_answer => upload_step(upload, frame),
            State::Upload(upload) => upload_request(upload, frame),
            State::Download(download) if is_answer => download.on_answer(frame),
            State::Download(download) => download.on_segment(frame),
            State::Block(block) if is_sender => block.on_sender(frame),
            State::Block(block) => block.on_receiver(frame),
        };
        if step != Step::Stray {
            self.last = received.at;
            if is_answer {
                self.answered.get_or_insert(received.at);
            }
        }
        step
    }

    /// Returns the transfer after its end. `at` is the time of the frame that ended it.
    pub(super) fn finished(self, at: Option<Stamp>, outcome: Outcome) -> Transfer {
        let form = match &self.state {
            State::Block(_) => Form::Block,
            State::Download(download) if download.is_expedited => Form::Expedited,
            State::Upload(upload) if !upload.has_begun() => Form::Expedited,
            _ => Form::Segmented,
        };
        Transfer {
            node: self.node,
            object: self.object,
            operation: self.operation,
            form,
            requested: self.requested,
            answered: self.answered,
            ended: at.unwrap_or(self.last),
            is_disturbed: self.is_disturbed,
            outcome,
        }
    }
}

fn upload_step(upload: &mut Upload, frame: &Frame) -> Step {
    // The other master requests the segments, so the requests of this state machine are dropped.
    match upload.on_frame(frame, &mut Vec::new()) {
        Progress::NotOurs => Step::Stray,
        Progress::Continue => Step::Continue,
        Progress::Done(uploaded) => Step::End(Outcome::Done(uploaded)),
        Progress::Failed(TransferError::Violation(violation, frame)) => Step::End(Outcome::Violation(violation, frame)),
        Progress::Failed(TransferError::Aborted(code)) => Step::End(Outcome::Aborted { code, by_master: false }),
        Progress::Failed(TransferError::NoAnswer) => Step::End(Outcome::NoAnswer),
    }
}

/// Handles a request for a segment.
fn upload_request(upload: &Upload, frame: &Frame) -> Step {
    let is_segment = frame.data().first().is_some_and(|command| command >> 5 == 3);
    if upload.has_begun() && is_segment { Step::Continue } else { Step::Stray }
}

/// An expedited or segmented write.
#[derive(Clone, Debug)]
struct Download {
    uploaded: Uploaded,
    is_expedited: bool,
    /// Whether the node acknowledged the request, and segments follow.
    has_begun: bool,
    toggle: bool,
    /// `Some` if a segment waits for its acknowledgement; the value is `true` for the last segment.
    segment: Option<bool>,
}

impl Download {
    fn new(data: &[u8]) -> Download {
        let command = data.first().copied().unwrap_or_default();
        let (is_expedited, has_size) = (command & 0x02 != 0, command & 0x01 != 0);
        let rest = data.get(4..).unwrap_or_default();
        let mut uploaded = Uploaded::complete(Vec::new());
        if is_expedited {
            let unused = if has_size { usize::from(command >> 2 & 3) } else { 0 };
            uploaded.bytes = rest[..rest.len().min(4 - unused)].to_vec();
            uploaded.indicated = has_size;
        } else if let (true, Some(size)) = (has_size, rest.first_chunk()) {
            uploaded.announced = Some(u32::from_le_bytes(*size));
        }
        Download { uploaded, is_expedited, has_begun: false, toggle: false, segment: None }
    }

    fn on_segment(&mut self, frame: &Frame) -> Step {
        let Some(&command) = frame.data().first() else { return Step::Stray };
        let is_next = command >> 5 == 0 && (command & 0x10 != 0) == self.toggle && self.segment.is_none();
        let part = frame.data().get(1..8 - usize::from(command >> 1 & 7));
        let (true, true, Some(part)) = (is_next, self.has_begun, part) else { return Step::Stray };
        if self.uploaded.bytes.len() + part.len() > LONGEST {
            return Step::End(Outcome::Violation(Violation::TooLong, *frame));
        }
        self.uploaded.bytes.extend_from_slice(part);
        self.segment = Some(command & 0x01 != 0);
        Step::Continue
    }

    fn on_answer(&mut self, frame: &Frame) -> Step {
        let Some(&command) = frame.data().first() else { return Step::Stray };
        match (self.has_begun, command >> 5) {
            (false, 3) if self.is_expedited => Step::End(Outcome::Done(self.uploaded.clone())),
            (false, 3) => {
                self.has_begun = true;
                Step::Continue
            }
            (false, _) => Step::End(Outcome::Violation(Violation::Command, *frame)),
            (true, 1) if (command & 0x10 != 0) == self.toggle => match self.segment.take() {
                Some(true) => {
                    Step::End(Outcome::Done(std::mem::replace(&mut self.uploaded, Uploaded::complete(Vec::new()))))
                }
                Some(false) => {
                    self.toggle = !self.toggle;
                    Step::Continue
                }
                None => Step::Stray,
            },
            (true, _) => Step::Stray,
        }
    }
}
