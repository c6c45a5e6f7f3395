//! The SYNC producer: sends SYNC without drift, and measures the delay of each SYNC. It also paces remote requests.

use super::multiply;
use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::master::Master;
use crate::measure::histogram::Histogram;
use std::time::Duration;

/// The SYNC messages of a recording.
#[derive(Clone, Debug, Default)]
pub struct SyncStatistics {
    /// SYNC messages sent.
    pub sent: u64,
    /// SYNC messages omitted because their time had passed or the bus did not accept them.
    pub left_out: u64,
    /// The delay of each SYNC after its nominal time. Nominal times are multiples of the interval since the start, so
    /// one delay does not shift later times.
    pub delays: Histogram,
}

/// Sends SYNC at an interval.
pub(super) struct Producer {
    interval: Duration,
    /// The COB-ID of SYNC; `None` if the producer only paces remote requests.
    id: Option<CanId>,
    /// 1019h: the counter in the SYNC message runs from 1 to this value. `None`: SYNC has no counter.
    overflow: Option<u8>,
    start: Mono,
    slot: u64,
    /// The slot of the SYNC that is queued but not sent yet.
    waiting: Option<u64>,
    statistics: SyncStatistics,
}

impl Producer {
    pub(super) fn new(interval: Duration, id: Option<CanId>, overflow: Option<u8>, start: Mono) -> Producer {
        Producer { interval, id, overflow, start, slot: 0, waiting: None, statistics: SyncStatistics::default() }
    }

    /// Moves the first SYNC to `at`.
    pub(super) fn delay_start(&mut self, at: Mono) {
        self.start = at;
    }

    /// Returns the next SYNC message. The counter continues only if the previous message was sent.
    fn frame(&self, id: CanId) -> Frame {
        match self.overflow {
            None => Frame::empty(id),
            Some(overflow) => {
                let counter = self.statistics.sent % u64::from(overflow.max(1)) + 1;
                Frame::byte(id, u8::try_from(counter).unwrap_or(1))
            }
        }
    }

    /// Returns when the next SYNC is due. The time is computed from the start, so it does not drift.
    pub(super) fn due(&self) -> Mono {
        self.start + multiply(self.interval, self.slot)
    }

    /// Returns the number of the next SYNC.
    pub(super) fn slot(&self) -> u64 {
        self.slot
    }

    /// Sends the SYNC that is due.
    pub(super) fn send(&mut self, master: &mut Master<'_>) {
        self.check_sent(master);
        if let Some(id) = self.id
            && master.send_first(self.frame(id))
        {
            self.waiting = Some(self.slot);
        }
        self.slot = next_slot(self.start, master.now(), self.interval, self.slot);
    }

    /// Counts the last SYNC if it was sent.
    pub(super) fn check_sent(&mut self, master: &mut Master<'_>) {
        if let Some(at) = master.take_first_at()
            && let Some(slot) = self.waiting.take()
        {
            self.statistics.sent += 1;
            self.statistics.delays.add(at.since(self.start + multiply(self.interval, slot)));
        }
    }

    /// Returns the number of SYNC messages sent so far.
    pub(super) fn sent(&self) -> u64 {
        self.statistics.sent
    }

    /// Ends the production and returns the statistics of the sent frames.
    pub(super) fn finish(mut self, master: &mut Master<'_>) -> SyncStatistics {
        self.check_sent(master);
        let unsent = u64::from(master.remove_first());
        let due = self.id.map_or(0, |_| self.slot);
        self.statistics.left_out = due.saturating_sub(self.statistics.sent + unsent);
        self.statistics
    }
}

/// Returns the slot that follows `slot`. If the program was stopped, the missed SYNC messages are omitted. Otherwise
/// they would be sent in a burst.
fn next_slot(start: Mono, now: Mono, interval: Duration, slot: u64) -> u64 {
    let passed = now.since(start).as_nanos() / interval.as_nanos().max(1);
    let passed = u64::try_from(passed).unwrap_or(u64::MAX - 2);
    if passed <= slot {
        return slot + 1;
    }
    let next = start + multiply(interval, passed + 1);
    if next.since(now) * 2 < interval { passed + 2 } else { passed + 1 }
}
