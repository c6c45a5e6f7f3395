//! The SYNC producer: when the next one is due, and how well the ones before kept their time.

use super::nth;
use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::master::Master;
use crate::measure::histogram::Histogram;
use std::time::Duration;

/// What was sent, and how late.
#[derive(Clone, Debug, Default)]
pub struct Syncs {
    /// SYNC messages that the bus took.
    pub sent: u64,
    /// Those whose time had passed, and those that nobody took.
    pub left_out: u64,
    /// How long after its time each was handed to the bus. The times are counted from the first, not from the one
    /// before: a delay never moves those after it.
    pub delays: Histogram,
}

/// Sends SYNC at an interval, without drift.
pub(super) struct Producer {
    period: Duration,
    id: CanId,
    begin: Mono,
    slot: u64,
    /// The slot whose SYNC has been given to the master, and not yet taken by the bus.
    waiting: Option<u64>,
    pub(super) syncs: Syncs,
}

impl Producer {
    pub(super) fn new(period: Duration, id: CanId, begin: Mono) -> Producer {
        Producer { period, id, begin, slot: 0, waiting: None, syncs: Syncs::default() }
    }

    /// When the next one is due. Computed from the beginning, never from the last one: no drift.
    pub(super) fn due(&self) -> Mono {
        self.begin + nth(self.period, self.slot)
    }

    /// The number of the next one.
    pub(super) fn slot(&self) -> u64 {
        self.slot
    }

    /// Sends the one that is due.
    pub(super) fn send(&mut self, master: &mut Master<'_>) {
        self.look(master);
        if master.send_first(Frame::empty(self.id)) {
            self.waiting = Some(self.slot);
        }
        self.slot = next_slot(self.begin, master.now(), self.period, self.slot);
    }

    /// Looks whether the last one has been sent.
    pub(super) fn look(&mut self, master: &mut Master<'_>) {
        if let Some(at) = master.take_first_at()
            && let Some(slot) = self.waiting.take()
        {
            self.syncs.sent += 1;
            self.syncs.delays.add(at.since(self.begin + nth(self.period, slot)));
        }
    }

    /// All that were sent, at the end.
    pub(super) fn finish(&mut self, master: &mut Master<'_>) -> Syncs {
        self.look(master);
        let unsent = u64::from(master.take_back_first());
        self.syncs.left_out = self.slot - self.syncs.sent - unsent;
        self.syncs.clone()
    }
}

/// When the next SYNC is due after that of `slot`. A program that was stopped makes up for none: a burst would
/// be no rhythm, and two would be closer together than anybody asked for.
fn next_slot(begin: Mono, now: Mono, period: Duration, slot: u64) -> u64 {
    let passed = now.since(begin).as_nanos() / period.as_nanos().max(1);
    let passed = u64::try_from(passed).unwrap_or(u64::MAX - 2);
    if passed <= slot {
        return slot + 1;
    }
    let next = begin + nth(period, passed + 1);
    if next.since(now) * 2 < period { passed + 2 } else { passed + 1 }
}
