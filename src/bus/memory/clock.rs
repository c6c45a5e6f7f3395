//! The two clocks of the bus inside the process, and the wait that a person can interrupt.

use crate::bus::interrupt::Interrupts;
use crate::bus::time::{Mono, Wall};
use std::time::{Duration, Instant};

/// Which clock a bus inside the process goes by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// The host's: for people.
    #[default]
    Real,
    /// Its own, which jumps to the next happening and stands still while nobody receives: for tests.
    Virtual,
}

/// Where the virtual clock starts: 2026-01-01 00:00 UTC.
pub const VIRTUAL_EPOCH: Wall = Wall::at(Duration::from_secs(1_767_225_600));

/// Waits on the host's clock, and tells when the user wants to stop.
pub trait Sleeper: Send {
    /// Waits for `length`. Returns `true` at once, and once, when the user has asked to stop; with a length
    /// of zero it only looks.
    fn sleep(&mut self, length: Duration) -> bool;
}

/// Ctrl-C and SIGTERM.
impl Sleeper for Interrupts {
    fn sleep(&mut self, length: Duration) -> bool {
        if length.is_zero() { self.take() } else { self.wait_for(length) }
    }
}

/// Waits that nobody interrupts.
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

/// The host's clock as the bus sees it: both time lines begin when the bus is opened, and run together
/// from there, so that a frame has the same distance on both.
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

    /// What the host's clock says; `None` on the virtual one, which says nothing by itself.
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
