//! Handles a received frame in the transfer of its node.

use super::super::Timing;
use super::super::active::{LengthCheck, begins_blocks};
use super::super::request::{Answer, Operation, SdoError, SdoFailure};
use super::super::send::Outgoing;
use super::super::transfer::Blocks;
use super::{ActiveTransfer, Finished, Node};
use crate::bus::{Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::sdo::{AbortCode, Progress, TransferError, Uploaded, abort_frame};
use std::time::Duration;

/// The inaccuracy when a send time is compared with a receive time.
const CLOCK_TOLERANCE: Duration = Duration::from_millis(5);

/// The effect of a frame on its transfer.
enum Step {
    /// The transfer continues.
    Continued,
    /// The transfer pauses because of foreign traffic, and is restarted later.
    BackedOff,
    /// The transfer is restarted.
    Repeated,
    /// The transfer has ended.
    Ended(Result<Answer, SdoError>),
}

/// The context of the steps of a transfer.
struct Context<'a> {
    /// [`crate::device::quirk::Quirk::UploadAnswered60`].
    accept_60: bool,
    /// Whether a request to this node had two answers.
    has_second_answer: bool,
    timing: &'a Timing,
}

impl Node {
    /// Handles a frame with one of the node's SDO COB-IDs; `false` if it does not belong to the transfer.
    pub(super) fn on_frame(
        &mut self,
        received: &Received,
        timing: &Timing,
        outgoing: &mut Outgoing,
        finished: &mut Finished,
    ) -> bool {
        let at = received.at.mono;
        let is_request = received.frame.id().sdo_request_node().is_some();
        if is_request {
            self.answers.on_foreign_request(at);
        }
        let Some(active) = &mut self.active else {
            if !is_request && !self.has_stale(&received.frame) {
                self.answers.on_unexpected(&received.frame, at);
            }
            self.remove_stale(&received.frame);
            return false;
        };
        let mut out = Vec::new();
        let operation = active.request.operation();
        let in_segments = active.machine.has_begun() && !active.machine.is_in_blocks();
        let asked_at = active.asked_at.filter(|_| !active.machine.has_begun() && !active.is_repeated);
        if !active.is_repeated && self.answers.is_repetition(&received.frame, operation, in_segments, at) {
            self.answers.on_unexpected(&received.frame, at);
            return true;
        }
        let progress = match active.asked_at {
            Some(asked_at) if at + CLOCK_TOLERANCE >= asked_at && !active.is_answered_before_sent(&received.frame) => {
                active.machine.on_frame(&received.frame, &mut out)
            }
            _ => Progress::NotOurs,
        };
        if matches!(progress, Progress::NotOurs) {
            self.on_foreign_frame(is_request, received, timing, outgoing, finished);
            return false;
        }
        let context =
            Context { accept_60: self.accept_60, has_second_answer: self.answers.finding().is_some(), timing };
        let step = active.on_progress(progress, received, &context, &mut out, outgoing);
        match step {
            Step::BackedOff => return true,
            Step::Repeated => self.answers.on_repeated(active.request.object),
            Step::Continued | Step::Ended(_) => self.answers.on_answer(received.frame, operation, asked_at, at),
        }
        let Step::Ended(result) = step else {
            if !out.is_empty() {
                active.enqueue(out, outgoing);
            }
            return true;
        };
        for frame in out {
            outgoing.push(frame, None);
        }
        self.is_written |= operation == Operation::Write && result.is_ok();
        self.end(result, outgoing, finished);
        true
    }

    /// Ends the transfer in progress.
    fn end(&mut self, result: Result<Answer, SdoError>, outgoing: &mut Outgoing, finished: &mut Finished) {
        let Some(active) = self.active.take() else { return };
        outgoing.drop_ticket(active.ticket);
        match active.deferred {
            // Any answer, even an abort, proves that all older requests were answered. Answers to retries of the
            // barrier read come before the answer to the deferred request.
            Some(deferred) => {
                self.stale.clear();
                self.waiting.push_front(deferred);
            }
            None => finished.push_back((active.ticket, result)),
        }
    }

    /// Handles a frame that does not belong to the transfer in progress.
    fn on_foreign_frame(
        &mut self,
        is_request: bool,
        received: &Received,
        timing: &Timing,
        outgoing: &mut Outgoing,
        finished: &mut Finished,
    ) {
        let Some(active) = &mut self.active else { return };
        if is_request {
            active.record_request(&received.frame);
        } else if self.answers.on_unexpected(&received.frame, received.at.mono) {
            self.remove_stale(&received.frame);
            return;
        }
        if !active.record_foreign(self.accept_60, received, timing, outgoing) {
            let error = active.error(active.disturbance());
            finished.push_back((active.ticket, Err(error)));
            outgoing.drop_ticket(active.ticket);
            self.active = None;
        }
        self.remove_stale(&received.frame);
    }
}

impl ActiveTransfer {
    /// Takes the next step after a frame of this transfer. The caller sends `out`.
    fn on_progress(
        &mut self,
        progress: Progress<Option<Uploaded>>,
        received: &Received,
        context: &Context<'_>,
        out: &mut Vec<Frame>,
        outgoing: &mut Outgoing,
    ) -> Step {
        let at = received.at.mono;
        match progress {
            Progress::NotOurs => Step::Continued,
            // A segment of a block: each segment has its own time-out.
            Progress::Continue if out.is_empty() => {
                if self.unsent == 0 {
                    (self.deadline, self.read_clock_at) = (Some(at + self.timeout(context.timing)), None);
                }
                Step::Continued
            }
            Progress::Continue => {
                if self.request.blocks == Blocks::WhenLarge && self.machine.is_worth_blocks() {
                    self.restart_in_blocks(context.accept_60, out);
                }
                Step::Continued
            }
            Progress::Done(_) if self.ambiguous => Step::Ended(Err(self.error(SdoFailure::Ambiguous))),
            Progress::Done(uploaded) if self.is_suspect(uploaded.as_ref()) => {
                if self.back_off(context.accept_60, at, context.timing, outgoing) {
                    return Step::BackedOff;
                }
                Step::Ended(Err(self.error(self.disturbance())))
            }
            Progress::Done(uploaded) => match self.check_length(uploaded.as_ref(), context.accept_60) {
                LengthCheck::Accepted => Step::Ended(Ok(Answer { uploaded, at: received.at, kind: self.kind() })),
                LengthCheck::Again => {
                    out.push(self.machine.request());
                    Step::Continued
                }
                LengthCheck::WrongLength => {
                    let (announced, delivered) = uploaded.map_or((None, 0), |read| (read.announced, read.bytes.len()));
                    let frame = received.frame;
                    Step::Ended(Err(self.error(SdoFailure::WrongLength { announced, delivered, frame })))
                }
            },
            Progress::Failed(error) => self.on_failure(error, at, context, out, outgoing),
        }
    }

    /// Restarts the transfer after a failure if this can help.
    fn on_failure(
        &mut self,
        error: TransferError,
        at: Mono,
        context: &Context<'_>,
        out: &mut Vec<Frame>,
        outgoing: &mut Outgoing,
    ) -> Step {
        if self.foreign.explains(error) {
            if self.back_off(context.accept_60, at, context.timing, outgoing) {
                return Step::BackedOff;
            }
            // An abort would end the foreign transfer.
            out.clear();
            return Step::Ended(Err(self.error(self.disturbance())));
        }
        if begins_blocks(error) && out.is_empty() {
            out.push(abort_frame(self.request.node, self.request.object, AbortCode::TIMEOUT));
        }
        if self.lacks_block_transfer(error) {
            self.request.fall_back();
            *self = ActiveTransfer::new(self.ticket, self.request.clone(), context.accept_60, context.timing);
            out.push(self.machine.request());
            return Step::Repeated;
        }
        if self.restart(error, context.accept_60, out, outgoing) {
            return Step::Repeated;
        }
        Step::Ended(Err(self.error(match error {
            TransferError::Aborted(code) => SdoFailure::Refused(code),
            TransferError::Violation(..) if context.has_second_answer => self.disturbance(),
            TransferError::Violation(violation, frame) => SdoFailure::Violation(violation, frame),
            TransferError::NoAnswer => SdoFailure::Cancelled,
        })))
    }
}
