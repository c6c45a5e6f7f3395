//! What waits to be sent: paced to the bit rate, patient with a full transmit queue.

use super::Ticket;
use crate::bus::{Bus, BusError, Mono};
use crate::canopen::frame::Frame;
use crate::canopen::wire_length::{bit_time, frame_time};
use std::collections::VecDeque;
use std::time::Duration;

/// How long to wait before trying a full transmit queue again. Linux gives no wake-up for it.
const RETRY: Duration = Duration::from_millis(1);

/// How many frames may be ahead of the wire. The default transmit queue of a Linux interface holds 10.
const AHEAD: u32 = 4;

/// The longest classic frame with an 11-bit identifier: 8 bytes, every stuff bit, and the gap.
const LONGEST_FRAME_BITS: u32 = 135;

/// The queue between the protocol machines and the bus.
pub(super) struct Outgoing {
    queue: VecDeque<(Frame, Option<Ticket>)>,
    /// Asked for when there is first something to be paced: on some buses the question takes its time.
    bit_rate: Option<Option<u32>>,
    /// When the wire will have carried everything sent so far, if nobody else sends.
    wire_free_at: Mono,
    full_since: Option<Mono>,
    /// What cannot be sent is lost, as on the wire, and no error.
    rides_out: bool,
    /// What was put before all others, while it waits.
    first: Option<Frame>,
    /// When it was handed to the bus.
    first_at: Option<Mono>,
}

impl Outgoing {
    pub(super) fn new() -> Outgoing {
        let wire_free_at = Mono::START;
        Outgoing {
            queue: VecDeque::new(),
            bit_rate: None,
            wire_free_at,
            full_since: None,
            rides_out: false,
            first: None,
            first_at: None,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    pub(super) fn push(&mut self, frame: Frame, ticket: Option<Ticket>) {
        self.queue.push_back((frame, ticket));
    }

    /// Puts a frame before all others, unless the very same is there already.
    pub(super) fn push_first(&mut self, frame: Frame) -> bool {
        let is_new = self.queue.front() != Some(&(frame, None));
        if is_new {
            self.queue.push_front((frame, None));
            (self.first, self.first_at) = (Some(frame), None);
        }
        is_new
    }

    /// Forgets everything, and what it knew of the bus: that is at another bit rate now.
    pub(super) fn begin_anew(&mut self) {
        *self = Outgoing { rides_out: self.rides_out, ..Outgoing::new() };
    }

    /// When the bus took the frame that was last put before all others; told once. Nothing where it still waits or
    /// was lost.
    pub(super) fn take_first_at(&mut self) -> Option<Mono> {
        self.first_at.take()
    }

    /// Takes back what was put before all others, if it still waits.
    pub(super) fn take_back_first(&mut self) -> bool {
        self.first.take().is_some_and(|frame| {
            let before = self.queue.len();
            self.take_back(&frame);
            self.queue.len() < before
        })
    }

    pub(super) fn ride_out(&mut self, rides_out: bool) {
        self.rides_out = rides_out;
    }

    /// Forgets a frame that is no part of an SDO transfer, if it still waits.
    pub(super) fn take_back(&mut self, gone: &Frame) {
        self.queue.retain(|(frame, ticket)| ticket.is_some() || frame != gone);
    }

    /// Forgets the frames of SDO transfers.
    pub(super) fn drop_requests(&mut self) {
        self.queue.retain(|(_, ticket)| ticket.is_none());
    }

    /// Forgets the frames of one SDO transfer.
    pub(super) fn drop_ticket(&mut self, gone: Ticket) {
        self.queue.retain(|(_, ticket)| *ticket != Some(gone));
    }

    /// Sends what can be sent now and tells `sent` of each frame of a transfer. Returns when to try again,
    /// if something is left.
    ///
    /// # Errors
    /// The bus's own, and a transmit queue that stays full for `patience` (at least a second). Neither a full
    /// queue nor an interface that is down while [`Outgoing::ride_out`] holds.
    pub(super) fn flush(
        &mut self,
        bus: &mut dyn Bus,
        now: Mono,
        patience: Duration,
        sent: &mut dyn FnMut(Ticket, Mono),
    ) -> Result<Option<Mono>, BusError> {
        if self.queue.len() > AHEAD as usize && self.bit_rate.is_none() {
            self.bit_rate = Some(bus.bit_rate().filter(|&rate| rate > 0));
        }
        let bit_rate = self.bit_rate.flatten();
        while let Some((frame, ticket)) = self.queue.front() {
            if let Some(bit_rate) = bit_rate {
                let longest = bit_time(LONGEST_FRAME_BITS, bit_rate);
                if self.wire_free_at.since(now) > longest * AHEAD {
                    return Ok(Some(now + longest));
                }
            }
            let mut is_taken = true;
            match bus.send(frame) {
                Ok(()) => {}
                Err(BusError::QueueFull) => {
                    let since = *self.full_since.get_or_insert(now);
                    if now.since(since) <= patience.max(Duration::from_secs(1)) {
                        return Ok(Some(now + RETRY));
                    }
                    if !self.rides_out {
                        return Err(BusError::QueueFull);
                    }
                    // Nobody takes anything. What waits would be too late when somebody does again.
                    self.first = None;
                    self.queue.drain(..).filter_map(|(_, ticket)| ticket).for_each(|ticket| sent(ticket, now));
                    self.full_since = None;
                    return Ok(None);
                }
                Err(BusError::Down(_) | BusError::NoInterface(_)) if self.rides_out => is_taken = false,
                Err(error) => return Err(error),
            }
            if ticket.is_none() && self.first == Some(*frame) {
                self.first = None;
                self.first_at = is_taken.then_some(now);
            }
            if let Some(ticket) = ticket {
                sent(*ticket, now);
            }
            // What this very frame takes: at the longest for each, a long burst would fall behind the wire.
            if let Some(bit_rate) = bit_rate {
                self.wire_free_at = self.wire_free_at.max(now) + frame_time(frame, bit_rate);
            }
            self.queue.pop_front();
            self.full_since = None;
        }
        Ok(None)
    }
}
