//! The queue of frames to send. Frames are sent no faster than the bit rate allows. If the transmit queue is full,
//! sending is tried again.

use super::{Ticket, Transcript};
use crate::bus::{Bus, BusError, Mono};
use crate::canopen::frame::Frame;
use crate::canopen::wire_length::{bit_time, frame_time};
use std::collections::VecDeque;
use std::time::Duration;

/// The wait before a full transmit queue is tried again. Linux does not report when the queue has space again.
const QUEUE_RETRY_INTERVAL: Duration = Duration::from_millis(1);

/// The largest number of frames that may wait in the interface. The default transmit queue of a Linux interface holds
/// 10.
const MAX_QUEUED_FRAMES: u32 = 4;

/// The longest classic frame with an 11-bit identifier, in bits: 8 data bytes, all stuff bits, intermission.
const LONGEST_FRAME_BITS: u32 = 135;

/// When a frame of a transfer was passed to the bus.
#[derive(Clone, Copy, Debug)]
pub(super) struct SendTime {
    /// A moment before sending.
    pub(super) before: Mono,
    /// A moment after sending; `None` if the clock was not read.
    pub(super) after: Option<Mono>,
}

/// The queue between the protocol machines and the bus.
pub(super) struct Outgoing {
    queue: VecDeque<(Frame, Option<Ticket>)>,
    /// The bit rate in bit/s, read when first needed, because this takes time on some buses.
    bit_rate: Option<Option<u32>>,
    /// When the bus has carried all frames sent so far, if no other node sends.
    wire_free_at: Mono,
    full_since: Option<Mono>,
    /// Whether a frame that cannot be sent is dropped without an error.
    tolerates_outages: bool,
    /// The frame that was last queued by `push_first`, until it is sent.
    first: Option<Frame>,
    /// When the bus accepted the last frame of `push_first`.
    first_at: Option<Mono>,
    /// Whether the moment before sending matters for a queued frame.
    is_timed: bool,
    /// The record of all frames in both directions, while one is made.
    pub(super) transcript: Option<Transcript>,
}

impl Outgoing {
    pub(super) fn new() -> Outgoing {
        let wire_free_at = Mono::START;
        Outgoing {
            queue: VecDeque::new(),
            bit_rate: None,
            wire_free_at,
            full_since: None,
            tolerates_outages: false,
            first: None,
            first_at: None,
            is_timed: false,
            transcript: None,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    pub(super) fn push(&mut self, frame: Frame, ticket: Option<Ticket>) {
        self.is_timed |= ticket.is_none();
        self.queue.push_back((frame, ticket));
    }

    /// The moment before the next frame is sent matters: earlier frames cannot answer it.
    pub(super) fn set_timed(&mut self) {
        self.is_timed = true;
    }

    /// Whether [`Outgoing::flush`] needs the present moment. It does not for the next request of a transfer in
    /// progress: only its time-out counts, from the moment after sending.
    pub(super) fn needs_time(&self) -> bool {
        let is_slowed_down = self.bit_rate.flatten().is_some() || self.queue.len() > MAX_QUEUED_FRAMES as usize;
        self.is_timed || is_slowed_down || self.full_since.is_some()
    }

    /// Queues a frame before all others; `false` if such a frame already waits.
    pub(super) fn push_first(&mut self, frame: Frame) -> bool {
        let is_new = self.queue.front() != Some(&(frame, None));
        if is_new {
            self.is_timed = true;
            self.queue.push_front((frame, None));
            (self.first, self.first_at) = (Some(frame), None);
        }
        is_new
    }

    /// Drops all frames and reads the bit rate again when it is needed.
    pub(super) fn reset(&mut self) {
        let transcript = self.transcript.take();
        *self = Outgoing { tolerates_outages: self.tolerates_outages, transcript, ..Outgoing::new() };
    }

    /// Returns the time at which the bus accepted the last frame of `push_first`, and clears the time. `None` if the
    /// frame still waits or was dropped.
    pub(super) fn take_first_at(&mut self) -> Option<Mono> {
        self.first_at.take()
    }

    /// Removes the last frame of `push_first`, if it still waits.
    pub(super) fn remove_first(&mut self) -> bool {
        self.first.take().is_some_and(|frame| {
            let before = self.queue.len();
            self.remove(&frame);
            self.queue.len() < before
        })
    }

    pub(super) fn set_tolerates_outages(&mut self, tolerates_outages: bool) {
        self.tolerates_outages = tolerates_outages;
    }

    /// Removes a waiting frame that does not belong to an SDO transfer.
    pub(super) fn remove(&mut self, removed: &Frame) {
        self.queue.retain(|(frame, ticket)| ticket.is_some() || frame != removed);
    }

    /// Removes the frames of all SDO transfers.
    pub(super) fn drop_requests(&mut self) {
        self.queue.retain(|(_, ticket)| ticket.is_none());
    }

    /// Removes the frames of one SDO transfer.
    pub(super) fn drop_ticket(&mut self, removed: Ticket) {
        self.queue.retain(|(_, ticket)| *ticket != Some(removed));
    }

    /// Drops all frames, because no node acknowledges them. Later, they would be out of date.
    fn drop_all(&mut self, now: Mono, sent: &mut dyn FnMut(Ticket, SendTime)) {
        (self.first, self.full_since) = (None, None);
        let dropped = SendTime { before: now, after: Some(now) };
        self.queue.drain(..).filter_map(|(_, ticket)| ticket).for_each(|ticket| sent(ticket, dropped));
    }

    /// Sends all frames that can be sent now, and calls `sent` for each frame of a transfer. `now` may be earlier than
    /// the present moment unless [`Outgoing::needs_time`]. Returns when to try again if frames are left.
    ///
    /// # Errors
    /// An error of the bus, or a transmit queue that stays full for `queue_timeout` (at least one second). With
    /// [`Outgoing::set_tolerates_outages`], a full queue and an interface that is down are not errors.
    pub(super) fn flush(
        &mut self,
        bus: &mut dyn Bus,
        now: Mono,
        queue_timeout: Duration,
        sent: &mut dyn FnMut(Ticket, SendTime),
    ) -> Result<Option<Mono>, BusError> {
        if self.queue.len() > MAX_QUEUED_FRAMES as usize && self.bit_rate.is_none() {
            self.bit_rate = Some(bus.bit_rate().filter(|&rate| rate > 0));
        }
        let bit_rate = self.bit_rate.flatten();
        let reads_clock = self.needs_time() || !bus.waits_without_clock();
        while let Some((frame, ticket)) = self.queue.front() {
            if let Some(bit_rate) = bit_rate {
                let longest = bit_time(LONGEST_FRAME_BITS, bit_rate);
                if self.wire_free_at.since(now) > longest * MAX_QUEUED_FRAMES {
                    return Ok(Some(now + longest));
                }
            }
            let mut is_accepted = true;
            match bus.send(frame) {
                Ok(()) => {}
                Err(BusError::QueueFull) => {
                    let since = *self.full_since.get_or_insert(now);
                    if now.since(since) <= queue_timeout.max(Duration::from_secs(1)) {
                        return Ok(Some(now + QUEUE_RETRY_INTERVAL));
                    }
                    if !self.tolerates_outages {
                        return Err(BusError::QueueFull);
                    }
                    self.drop_all(now, sent);
                    return Ok(None);
                }
                Err(BusError::Down(_) | BusError::NoInterface(_)) if self.tolerates_outages => is_accepted = false,
                Err(error) => return Err(error),
            }
            if let Some(transcript) = self.transcript.as_mut().filter(|_| is_accepted) {
                transcript.push(bus.mono(), true, *frame);
            }
            if ticket.is_none() && self.first == Some(*frame) {
                self.first = None;
                self.first_at = is_accepted.then_some(now);
            }
            if let Some(ticket) = ticket {
                // On a bus that several procedures share (`bus::parallel`), sending may wait: the clock is read again.
                // The time-out starts after the last frame.
                let is_last = self.queue.get(1).is_none_or(|(_, next)| next != &Some(*ticket));
                sent(*ticket, SendTime { before: now, after: (reads_clock && is_last).then(|| bus.mono()) });
            }
            // Uses the length of this frame. With the longest length, a long burst would be slower than the bus.
            if let Some(bit_rate) = bit_rate {
                self.wire_free_at = self.wire_free_at.max(now) + frame_time(frame, bit_rate);
            }
            self.queue.pop_front();
            self.full_since = None;
        }
        self.is_timed = false;
        Ok(None)
    }
}
