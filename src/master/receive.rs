//! Receives the next event, and reads the clock as rarely as possible: on some machines, reading the clock takes as
//! long as receiving a frame.
//!
//! After a request of a transfer in progress, the clock is not read. Most answers arrive within some milliseconds. If
//! no answer arrives, the clock is read, and the time-out starts at this moment. So a time-out may be some 10 ms too
//! long, but is never too short.

use super::active::ActiveTransfer;
use super::sdo::SdoClient;
use super::{Error, Master, Timing};
use crate::bus::{Event, Mono};
use std::time::Duration;

/// If a deadline is nearer than this, the clock is read at once, because [`crate::bus::Bus::receive_answer`] may wait
/// beyond the deadline.
const ANSWER_WAIT_LIMIT: Duration = Duration::from_millis(40);

/// If other frames arrive instead of the answer, the clock is read this long after the request.
pub(super) const CLOCK_DELAY: Duration = Duration::from_millis(10);

impl Master<'_> {
    /// Waits for the next event until `limit`, or until the next time-out of a transfer. Returns the event with the
    /// deadline that applied, or `None` after starting time-outs: then call it again.
    pub(super) fn receive(&mut self, limit: Mono) -> Result<Option<(Event, Mono)>, Error> {
        if let Some(received) = self.pending.take() {
            return Ok(Some((Event::Frame(received), limit)));
        }
        if !self.sdo.awaits_clock() {
            let deadline = limit.min(self.sdo.next_deadline().unwrap_or(limit));
            return Ok(Some((self.bus.receive(deadline)?, deadline)));
        }
        let is_far = limit.since(self.seen) > ANSWER_WAIT_LIMIT;
        let event = if is_far { self.bus.receive_answer()? } else { None };
        if event.is_none() {
            self.start_timeouts();
        }
        Ok(event.map(|event| (event, limit)))
    }

    /// Starts the time-outs of the requests that were sent without reading the clock.
    pub(super) fn start_timeouts(&mut self) {
        self.seen = self.now();
        self.sdo.start_timeouts(self.seen, &self.timing);
    }
}

impl SdoClient {
    /// Whether a time-out has not started yet, because the clock was not read after sending.
    fn awaits_clock(&mut self) -> bool {
        // This flag avoids a search through all nodes in most calls.
        if self.awaits_clock && self.active_transfers().all(|active| active.read_clock_at.is_none()) {
            // The answer has arrived: only later deadlines apply.
            self.awaits_clock = false;
            self.update_due();
        }
        self.awaits_clock
    }

    /// Whether the clock must be read at this moment, to start a time-out.
    pub(super) fn needs_clock(&self, now: Mono) -> bool {
        self.awaits_clock && self.active_transfers().any(|active| active.read_clock_at.is_some_and(|at| at <= now))
    }

    /// Starts the time-outs that have not started yet.
    fn start_timeouts(&mut self, now: Mono, timing: &Timing) {
        for number in &self.open {
            let Some(active) = self.nodes.get_mut(number).and_then(|node| node.active.as_mut()) else { continue };
            if active.read_clock_at.take().is_some() {
                active.start_timeout(now, timing);
            }
        }
        self.awaits_clock = false;
        self.update_due();
    }
}

impl ActiveTransfer {
    /// Starts the time-out. `now` is a moment after sending.
    pub(super) fn start_timeout(&mut self, now: Mono, timing: &Timing) {
        let mut deadline = now + self.timeout(timing);
        if self.machine.has_begun() {
            deadline = deadline.min(*self.begun_at.get_or_insert(now) + self.time(timing));
        }
        self.deadline = Some(deadline);
    }

    /// The end of the wait for an answer, or when the clock must be read to start this wait.
    pub(super) fn due(&self) -> Option<Mono> {
        self.deadline.or(self.read_clock_at)
    }
}
