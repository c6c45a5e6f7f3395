//! The error counters and states of a CAN controller (ISO 11898-1, fault confinement), simplified. Used to simulate the
//! effect of a wrong bit rate.

use crate::bus::Fault;
use crate::bus::time::Mono;
use crate::canopen::wire_length::bit_time;
use std::time::Duration;

/// The wait of an error-passive controller before a retry. It is longer than in a real controller (a few bit times), to
/// limit the number of retries in hours of virtual time.
pub(super) const PASSIVE_PAUSE: Duration = Duration::from_millis(10);

const WARNING_LIMIT: u16 = 96;
const PASSIVE_LIMIT: u16 = 128;
const BUS_OFF_LIMIT: u16 = 256;
/// The length of bus-off: 128 times 11 recessive bits.
const RECOVERY_BITS: u32 = 128 * 11;

/// The outcome of a transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// All receivers received the frame.
    Delivered,
    /// No station acknowledged the frame.
    Unacknowledged,
    /// The frame was destroyed by a station at another bit rate, or by two senders with one identifier.
    Disturbed,
}

/// The error counters of one controller.
#[derive(Clone, Debug, Default)]
pub(super) struct Controller {
    transmit_errors: u16,
    receive_errors: u16,
    /// The time at which bus-off or the wait for a retry ends.
    pub(super) waits_until: Option<Mono>,
}

/// The error state of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    Active,
    Warning,
    Passive,
    Off,
}

impl Level {
    /// The fault that reports this state.
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
            _ if self.transmit_errors >= BUS_OFF_LIMIT => Level::Off,
            PASSIVE_LIMIT.. => Level::Passive,
            WARNING_LIMIT.. => Level::Warning,
            _ => Level::Active,
        }
    }

    /// Whether the error flags of the controller destroy frames of other stations.
    pub(super) fn disturbs(&self) -> bool {
        self.level() < Level::Passive
    }

    /// Counts a transmission of this controller. A missing acknowledgement leads to error-passive at most.
    pub(super) fn transmitted(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Delivered => self.transmit_errors = self.transmit_errors.saturating_sub(1),
            Outcome::Unacknowledged if self.level() >= Level::Passive => {}
            Outcome::Unacknowledged | Outcome::Disturbed => self.transmit_errors += 8,
        }
    }

    /// Counts a received frame or a receive error.
    pub(super) fn received(&mut self, valid: bool) {
        if valid {
            // One valid frame ends error-passive (ISO 11898-1: "between 119 and 127").
            self.receive_errors = self.receive_errors.min(PASSIVE_LIMIT).saturating_sub(1);
        } else {
            self.receive_errors = (self.receive_errors + 1).min(BUS_OFF_LIMIT - 1);
        }
    }

    /// Switches to bus-off at `now`, for the recovery time of the standard.
    pub(super) fn switch_off(&mut self, now: Mono, bit_rate: u32) {
        *self = Controller { waits_until: Some(now + bit_time(RECOVERY_BITS, bit_rate)), ..Controller::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_acknowledge_error_passive_with_disturbance_bus_off() {
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
