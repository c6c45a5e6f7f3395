//! The real and the virtual clock of the simulated bus, and interruptible waits.

use crate::bus::interrupt::Interrupts;
use crate::bus::time::{Mono, Wall};
use std::time::{Duration, Instant};

/// The clock of a simulated bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// The clock of the host, for interactive use.
    #[default]
    Real,
    /// A virtual clock, for tests. It jumps to the next event, and advances only in `receive`.
    Virtual,
}

/// The start of the virtual clock: 2026-01-01 00:00 UTC.
pub const VIRTUAL_EPOCH: Wall = Wall::at(Duration::from_secs(1_767_225_600));

/// Waits on the clock of the host, and reports an interrupt by the user.
pub trait Sleeper: Send {
    /// Waits for `length`. If the user asks to stop, returns `true` immediately, and only once. With a length of zero,
    /// only checks for a stop.
    fn sleep(&mut self, length: Duration) -> bool;
}

/// Waits that end on Ctrl-C and SIGTERM.
impl Sleeper for Interrupts {
    fn sleep(&mut self, length: Duration) -> bool {
        if length.is_zero() { self.take() } else { self.wait_for(length) }
    }
}

/// Waits that are never interrupted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uninterrupted;

impl Sleeper for Uninterrupted {
    fn sleep(&mut self, length: Duration) -> bool {
        if !length.is_zero() {
            std::thread::sleep(length);
        }
        false
    }
}

/// The monotonic time and the wall time of a bus. Both start when the bus is opened and advance together, so that
/// intervals are equal on both.
#[derive(Clone, Copy, Debug)]
pub(super) enum TimeLine {
    Real { opened: Instant, epoch: Wall },
    Virtual,
}

impl TimeLine {
    pub(super) fn open(clock: Clock) -> TimeLine {
        match clock {
            Clock::Real => TimeLine::Real { opened: Instant::now(), epoch: Wall::now() },
            Clock::Virtual => TimeLine::Virtual,
        }
    }

    /// The time of the host; `None` for a virtual clock.
    pub(super) fn host_now(&self) -> Option<Mono> {
        match self {
            TimeLine::Real { opened, .. } => Some(Mono::at(opened.elapsed())),
            TimeLine::Virtual => None,
        }
    }

    pub(super) fn wall(&self, mono: Mono) -> Wall {
        let epoch = match self {
            TimeLine::Real { epoch, .. } => *epoch,
            TimeLine::Virtual => VIRTUAL_EPOCH,
        };
        epoch + mono.since_start()
    }
}
