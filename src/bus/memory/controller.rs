//! What a CAN controller counts and concludes (ISO 11898-1, fault confinement), in the simplest form that
//! shows people and programs what a wrong bit rate does.

use crate::bus::Fault;
use crate::bus::time::Mono;
use crate::canopen::wire_length::bit_time;
use std::time::Duration;

/// How long an error-passive controller waits before it tries again. A real one waits a few bit times;
/// this keeps a frame that nobody takes from filling hours of virtual time with errors.
pub(super) const PASSIVE_PAUSE: Duration = Duration::from_millis(10);

const WARNING: u16 = 96;
const PASSIVE: u16 = 128;
const OFF: u16 = 256;
/// 128 times 11 bits without traffic end bus-off.
const RECOVERY_BITS: u32 = 128 * 11;

/// What a transmission came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Everybody who should has it.
    Delivered,
    /// Nobody acknowledged it.
    Unacknowledged,
    /// Somebody destroyed it: another bit rate, or two senders with one identifier.
    Disturbed,
}

/// The error counters of one participant.
#[derive(Clone, Debug, Default)]
pub(super) struct Controller {
    transmit_errors: u16,
    receive_errors: u16,
    /// Off, or not trying again, until then.
    pub(super) waits_until: Option<Mono>,
}

/// How sure a controller is of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    Active,
    Warning,
    Passive,
    Off,
}

impl Level {
    /// As it is reported.
    pub(super) fn fault(self) -> Fault {
        match self {
            Level::Active => Fault::ErrorActive,
            Level::Warning => Fault::ErrorWarning,
            Level::Passive => Fault::ErrorPassive,
            Level::Off => Fault::BusOff,
        }
    }
}

impl Controller {
    pub(super) fn level(&self) -> Level {
        match self.transmit_errors.max(self.receive_errors) {
            _ if self.transmit_errors >= OFF => Level::Off,
            PASSIVE.. => Level::Passive,
            WARNING.. => Level::Warning,
            _ => Level::Active,
        }
    }

    /// Whether its error flags destroy frames.
    pub(super) fn disturbs(&self) -> bool {
        self.level() < Level::Passive
    }

    /// What a transmission of its own came to, complete at `now`. One that nobody acknowledges takes a
    /// controller no further than error-passive.
    pub(super) fn transmitted(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Delivered => self.transmit_errors = self.transmit_errors.saturating_sub(1),
            Outcome::Unacknowledged if self.level() >= Level::Passive => {}
            Outcome::Unacknowledged | Outcome::Disturbed => self.transmit_errors += 8,
        }
    }

    /// It received a frame, or an error.
    pub(super) fn received(&mut self, valid: bool) {
        if valid {
            // From far beyond, one frame is enough to come back (CiA's and ISO's "between 119 and 127").
            self.receive_errors = self.receive_errors.min(PASSIVE).saturating_sub(1);
        } else {
            self.receive_errors = (self.receive_errors + 1).min(OFF - 1);
        }
    }

    /// Bus-off from `now` on, and error-active again after the recovery that the standard wants.
    pub(super) fn switch_off(&mut self, now: Mono, bit_rate: u32) {
        *self = Controller { waits_until: Some(now + bit_time(RECOVERY_BITS, bit_rate)), ..Controller::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_alone_gets_passive_and_who_is_disturbed_switches_off() {
        let mut alone = Controller::default();
        (0..1000).for_each(|_| alone.transmitted(Outcome::Unacknowledged));
        assert_eq!(alone.level(), Level::Passive);
        let mut disturbed = Controller::default();
        let levels = [(12, Level::Warning), (16, Level::Passive), (32, Level::Off)];
        let mut sent = 0;
        for (count, level) in levels {
            assert!(disturbed.level() < level);
            (sent..count).for_each(|_| disturbed.transmitted(Outcome::Disturbed));
            assert_eq!(disturbed.level(), level, "after {count}");
            sent = count;
        }
    }
}
