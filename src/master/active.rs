//! One SDO transfer in progress.

use super::Timing;
use super::foreign_traffic::ForeignTraffic;
use super::machine::Machine;
use super::request::{Operation, Request, SdoError, SdoFailure, Ticket};
use super::send::Outgoing;
use super::transfer::{Blocks, TransferKind, is_about_object};
use crate::bus::{Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, TransferError, Uploaded, Violation};
use std::time::Duration;

/// The shortest time limit of a transfer.
const MIN_TRANSFER_LIMIT: Duration = Duration::from_secs(5);

/// The additional time limit for each byte. A full segment needs less than 0.2 s, also on a loaded bus with 10 kbit/s.
const TIME_PER_BYTE: Duration = Duration::from_millis(30);

/// A transfer in progress.
#[derive(Debug)]
pub(super) struct ActiveTransfer {
    pub(super) ticket: Ticket,
    pub(super) request: Request,
    pub(super) machine: Machine,
    /// The end of the wait for an answer. It is set when our last frame was sent. Other traffic never extends it.
    pub(super) deadline: Option<Mono>,
    /// When the clock must be read to start the time-out; `None` if the time-out has started. See
    /// [`super::send::SendTime`].
    pub(super) read_clock_at: Option<Mono>,
    /// The number of our frames that still wait to be sent.
    pub(super) unsent: usize,
    pub(super) attempts_left: u32,
    /// How often the transfer may still be restarted after a failure in the middle.
    pub(super) restarts_left: u32,
    /// Whether a read was rejected because the node still had a transfer in progress. The read was repeated.
    pub(super) was_rejected: bool,
    /// When the first request was sent. Earlier frames cannot answer the request.
    pub(super) asked_at: Option<Mono>,
    /// When the device began to answer.
    pub(super) begun_at: Option<Mono>,
    pub(super) foreign: ForeignTraffic,
    /// The transfer of the caller. It waits for a barrier read, which makes sure that no stale answer is pending.
    pub(super) deferred: Option<(Ticket, Request)>,
    /// Whether another master wrote the same object. The acknowledgement may then be for either write.
    pub(super) ambiguous: bool,
    /// The bytes of a first read whose length is doubtful. The object is read once more.
    pub(super) doubtful: Option<Vec<u8>>,
    /// Whether the request was sent more than once. Then more than one answer may arrive.
    pub(super) is_repeated: bool,
}

/// The result of [`ActiveTransfer::check_length`].
pub(super) enum LengthCheck {
    /// The bytes are the answer.
    Accepted,
    /// The length is doubtful: the object is read once more.
    Again,
    /// The length is wrong.
    WrongLength,
}

impl ActiveTransfer {
    pub(super) fn new(ticket: Ticket, request: Request, accept_60: bool, timing: &Timing) -> ActiveTransfer {
        // If the server does not answer a block request, the next request is a segmented request, not a retry.
        let attempts = if request.falls_back() { 0 } else { timing.retries };
        let attempts_left = if request.repeatable { attempts } else { 0 };
        let machine = request.machine(accept_60);
        let (deadline, read_clock_at, asked_at, begun_at, deferred) = (None, None, None, None, None);
        let foreign = ForeignTraffic::default();
        ActiveTransfer {
            ticket,
            restarts_left: if request.may_restart() { timing.retries } else { 0 },
            was_rejected: false,
            request,
            machine,
            deadline,
            read_clock_at,
            unsent: 0,
            attempts_left,
            asked_at,
            begun_at,
            foreign,
            deferred,
            ambiguous: false,
            doubtful: None,
            is_repeated: false,
        }
    }

    /// Checks the length of the bytes read. If the length differs from the announced one, the object is read once more.
    /// If both reads give the same bytes, the bytes are accepted with a note.
    pub(super) fn check_length(&mut self, uploaded: Option<&Uploaded>, accept_60: bool) -> LengthCheck {
        let Some(uploaded) = uploaded else { return LengthCheck::Accepted };
        match self.doubtful.take() {
            None if uploaded.has_doubtful_length() => {
                self.doubtful = Some(uploaded.bytes.clone());
                self.machine = self.request.machine(accept_60);
                self.asked_at = None;
                LengthCheck::Again
            }
            Some(first) if first != uploaded.bytes || self.request.is_exact => LengthCheck::WrongLength,
            None | Some(_) => LengthCheck::Accepted,
        }
    }

    /// Returns the failure of a transfer that was disturbed by unexpected frames.
    pub(super) fn disturbance(&self) -> SdoFailure {
        if self.foreign.is_requested() { SdoFailure::Disturbed } else { SdoFailure::TwoDevices(None) }
    }

    /// Queues frames for sending. They replace frames of this transfer that are still in the queue.
    pub(super) fn enqueue(&mut self, frames: Vec<Frame>, outgoing: &mut Outgoing) {
        if self.unsent > 0 {
            outgoing.drop_ticket(self.ticket);
        }
        self.unsent = frames.len();
        (self.deadline, self.read_clock_at) = (None, None);
        if self.asked_at.is_none() {
            outgoing.set_timed();
        }
        for frame in frames {
            outgoing.push(frame, Some(self.ticket));
        }
    }

    /// Whether a frame answers a segment that is not sent yet. The frame then comes from another device with the same
    /// node-ID. Initiate requests are not checked, because they may be retries. Aborts may come at any time.
    pub(super) fn is_answered_before_sent(&self, frame: &Frame) -> bool {
        let in_segments = self.machine.has_begun() && !self.machine.is_in_blocks();
        self.unsent > 0 && in_segments && frame.data().first() != Some(&0x80)
    }

    /// Waits for a foreign transfer to end, then restarts. Returns `false` if the transfer must not be repeated, or if
    /// the time limit has passed. No abort is sent, because it would end the foreign transfer.
    pub(super) fn back_off(&mut self, accept_60: bool, now: Mono, timing: &Timing, outgoing: &mut Outgoing) -> bool {
        let limit = self.timeout(timing) * (1 + timing.retries);
        if !self.request.repeatable || !self.foreign.back_off(now, limit) {
            return false;
        }
        self.enqueue(Vec::new(), outgoing);
        self.machine = self.request.machine(accept_60);
        self.asked_at = None;
        self.deadline = self.foreign.back_off_until();
        true
    }

    /// Records a foreign frame. Returns whether our transfer can continue.
    pub(super) fn record_foreign(
        &mut self,
        accept_60: bool,
        received: &Received,
        timing: &Timing,
        outgoing: &mut Outgoing,
    ) -> bool {
        let now = received.at.mono;
        self.foreign.record(&received.frame, now);
        if let Some(until) = self.foreign.back_off_until() {
            (self.deadline, self.read_clock_at) = (Some(until), None);
            return true;
        }
        let in_segments = self.machine.has_begun() && !self.machine.is_in_blocks();
        !in_segments || !self.foreign.conflicts() || self.back_off(accept_60, now, timing, outgoing)
    }

    /// Whether the segmented transfer that has just ended may contain foreign segments.
    pub(super) fn is_suspect(&self, uploaded: Option<&Uploaded>) -> bool {
        let in_segments = self.machine.has_begun() && !self.machine.is_in_blocks();
        let delivered = uploaded.map_or(0, |uploaded| uploaded.bytes.len());
        in_segments && self.foreign.is_suspect(uploaded.and_then(|uploaded| uploaded.announced), delivered)
    }

    /// Restarts a segmented upload of a large object as a block upload.
    pub(super) fn restart_in_blocks(&mut self, accept_60: bool, out: &mut Vec<Frame>) {
        out.clear();
        self.machine.abort(AbortCode::GENERAL, out);
        self.request.blocks = Blocks::First { threshold: 0 };
        self.attempts_left = 0;
        self.machine = self.request.machine(accept_60);
        out.push(self.machine.request());
    }

    /// Restarts a transfer after this failure. Returns `false` if a restart is not allowed or would not help. `out`
    /// contains the abort for the server.
    pub(super) fn restart(
        &mut self,
        error: TransferError,
        accept_60: bool,
        out: &mut Vec<Frame>,
        outgoing: &mut Outgoing,
    ) -> bool {
        let has_begun = self.machine.has_begun();
        let is_rejected = error == TransferError::Aborted(AbortCode::COMMAND_SPECIFIER) || begins_blocks(error);
        let is_read = self.request.operation() == Operation::Read;
        if !has_begun && is_rejected && is_read && self.request.may_restart() && !self.was_rejected {
            // A server with an interrupted transfer rejects the first request, and accepts the next one. It also does
            // this if a corrupted request started another transfer, and our abort ended that transfer.
            self.was_rejected = true;
        } else if has_begun && is_transmission_failure(error) && self.restarts_left > 0 {
            self.restarts_left -= 1;
        } else {
            return false;
        }
        self.machine = self.request.machine(accept_60);
        self.asked_at = None;
        self.is_repeated = true;
        out.push(self.machine.request());
        self.enqueue(std::mem::take(out), outgoing);
        true
    }

    /// Whether the transfer failed only because the server does not support block transfer.
    pub(super) fn lacks_block_transfer(&self, error: TransferError) -> bool {
        // Some devices include the padding of the last segment in the CRC. A segmented read may still succeed.
        if matches!(error, TransferError::Violation(Violation::Crc, _)) {
            return self.request.operation() == Operation::Read && self.request.falls_back();
        }
        // A segmented request would get the same abort code about the object. A write with an unknown answer is not
        // repeated, because it may have had an effect.
        let refused = match error {
            TransferError::Aborted(code) => !is_about_object(code),
            TransferError::Violation(..) => self.request.operation() == Operation::Read,
            TransferError::NoAnswer => false,
        };
        refused && self.request.falls_back() && !self.machine.has_begun()
    }

    pub(super) fn kind(&self) -> TransferKind {
        if self.machine.is_in_blocks() {
            TransferKind::Blocks
        } else if self.request.refused_blocks {
            TransferKind::PlainFallback
        } else {
            TransferKind::Plain
        }
    }

    /// How long the request has been repeated after the usual retries.
    pub(super) fn time_after_retries(&self, now: Mono, timing: &Timing) -> Duration {
        let usual = self.timeout(timing) * (1 + timing.retries);
        self.asked_at.map_or(Duration::ZERO, |asked_at| now.since(asked_at).saturating_sub(usual))
    }

    pub(super) fn timeout(&self, timing: &Timing) -> Duration {
        self.request.timeout.unwrap_or(timing.timeout)
    }

    /// The time limit of a transfer, from the first answer of the device. Without the limit, a device could send one
    /// byte per segment, each just before the time-out.
    pub(super) fn time(&self, timing: &Timing) -> Duration {
        let bytes = u32::try_from(self.machine.moved().0).unwrap_or(u32::MAX);
        MIN_TRANSFER_LIMIT.max(self.timeout(timing).saturating_mul(10)).saturating_add(TIME_PER_BYTE * bytes)
    }

    /// Whether the transfer is too slow.
    pub(super) fn is_over(&self, now: Mono, timing: &Timing) -> bool {
        self.begun_at.is_some_and(|begun_at| now.since(begun_at) >= self.time(timing))
    }

    pub(super) fn error(&self, failure: SdoFailure) -> SdoError {
        self.request.error(failure)
    }

    /// An error for the deferred request. If this is a write that was never sent, the error is for the barrier read.
    pub(super) fn error_of_sent(&self, failure: SdoFailure) -> SdoError {
        let was_sent = |request: &Request| request.operation() == Operation::Read || request.refused_blocks;
        let deferred = self.deferred.as_ref().map(|(_, request)| request).filter(|request| was_sent(request));
        deferred.unwrap_or(&self.request).error(failure)
    }

    /// Records a request of another master. If it writes the same object, an acknowledgement may belong to either
    /// write.
    pub(super) fn record_request(&mut self, frame: &Frame) {
        if let [command, a, b, c, ..] = frame.data() {
            let same = ObjectId::from_multiplexer([*a, *b, *c]) == self.request.object;
            self.ambiguous |= same && command >> 5 == 1 && self.request.operation() == Operation::Write;
        }
    }
}

/// Whether the server has started a block transfer that was not requested, because a bit of the request was changed.
/// The server would treat the next requests as part of this transfer.
pub(super) fn begins_blocks(error: TransferError) -> bool {
    let TransferError::Violation(Violation::Command, frame) = error else { return false };
    frame.data().first().is_some_and(|command| matches!(command & 0xe1, 0xa0 | 0xc0))
}

/// Whether a lost or changed frame can cause this failure in the middle of a transfer.
fn is_transmission_failure(error: TransferError) -> bool {
    match error {
        TransferError::Violation(Violation::TooLong, _) => false,
        TransferError::Violation(..) | TransferError::NoAnswer => true,
        // 05xx is about the transfer, 06xx and 08xx are about the object.
        TransferError::Aborted(AbortCode(code)) => code >> 24 == 0x05,
    }
}
