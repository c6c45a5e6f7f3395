//! Converts the kernel's error frames to faults.

use crate::bus::Fault;
use socketcan::CanErrorFrame;
use socketcan::errors::{ControllerProblems, ErrorCause, Location};

/// Returns the faults in an error frame, each once. Lost arbitration and error counters are not faults.
pub(super) fn faults(frame: CanErrorFrame) -> Vec<Fault> {
    let mut found = Vec::new();
    let mut add = |fault| {
        if !found.contains(&fault) {
            found.push(fault);
        }
    };
    for cause in frame.into_error() {
        match cause {
            ErrorCause::LostArbitration(_) | ErrorCause::Counters { .. } => {}
            ErrorCause::TransmitTimeout => add(Fault::TransmitTimeout),
            ErrorCause::Controller(problems) => {
                if problems.intersects(ControllerProblems::RX_OVERFLOW | ControllerProblems::TX_OVERFLOW) {
                    add(Fault::ControllerOverflow);
                }
                // The kernel may report a state for each direction. The worse state is reported.
                if problems.intersects(ControllerProblems::RX_PASSIVE | ControllerProblems::TX_PASSIVE) {
                    add(Fault::ErrorPassive);
                } else if problems.intersects(ControllerProblems::RX_WARNING | ControllerProblems::TX_WARNING) {
                    add(Fault::ErrorWarning);
                } else if problems.contains(ControllerProblems::ACTIVE) {
                    add(Fault::ErrorActive);
                }
            }
            // Some drivers report a missing acknowledgement only by the location of the violation.
            ErrorCause::Protocol { location: Location::AckSlot, .. } | ErrorCause::NoAck => add(Fault::NoAcknowledge),
            ErrorCause::Protocol { .. } => add(Fault::Protocol),
            ErrorCause::Transceiver { .. } => add(Fault::Transceiver),
            ErrorCause::BusOff => add(Fault::BusOff),
            ErrorCause::Restarted => add(Fault::Restarted),
            // This class only reports that there is an error. Other classes in the frame show which one.
            ErrorCause::BusError => {}
            _ => add(Fault::Other),
        }
    }
    if found.is_empty() && frame.error_bits() & socketcan::errors::CAN_ERR_BUSERROR != 0 {
        found.push(Fault::Protocol);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the faults of an error frame with these classes and data.
    fn faults_in(classes: u32, data: [u8; 8]) -> Vec<Fault> {
        faults(CanErrorFrame::new_error(classes, &data).unwrap())
    }

    #[test]
    fn error_frames_of_drivers_are_converted() {
        // Classes and data as in linux/can/error.h; the combinations come from the drivers sja1000 and gs_usb.
        assert_eq!(faults_in(0x040, [0; 8]), [Fault::BusOff]);
        assert_eq!(faults_in(0x100, [0; 8]), [Fault::Restarted]);
        assert_eq!(faults_in(0x020, [0; 8]), [Fault::NoAcknowledge]);
        assert_eq!(faults_in(0x001, [0; 8]), [Fault::TransmitTimeout]);
        assert_eq!(faults_in(0x204, [0, 0x0c, 0, 0, 0, 0, 96, 100]), [Fault::ErrorWarning]);
        assert_eq!(faults_in(0x204, [0, 0x24, 0, 0, 0, 0, 128, 96]), [Fault::ErrorPassive]);
        assert_eq!(faults_in(0x204, [0, 0x40, 0, 0, 0, 0, 1, 0]), [Fault::ErrorActive]);
        assert_eq!(faults_in(0x004, [0, 0x01, 0, 0, 0, 0, 0, 0]), [Fault::ControllerOverflow]);
        assert_eq!(faults_in(0x088, [0, 0, 0x04, 0x0a, 0, 0, 0, 0]), [Fault::Protocol]);
        assert_eq!(faults_in(0x088, [0, 0, 0x80, 0x19, 0, 0, 0, 0]), [Fault::NoAcknowledge]);
        assert_eq!(faults_in(0x0a8, [0, 0, 0, 0x19, 0, 0, 0, 0]), [Fault::NoAcknowledge]);
        assert_eq!(faults_in(0x080, [0; 8]), [Fault::Protocol]);
        assert_eq!(faults_in(0x010, [0, 0, 0, 0, 0x04, 0, 0, 0]), [Fault::Transceiver]);
        assert_eq!(faults_in(0x044, [0, 0x30, 0, 0, 0, 0, 0, 0]), [Fault::ErrorPassive, Fault::BusOff]);
    }

    #[test]
    fn harmless_and_unknown_classes_are_handled() {
        assert_eq!(faults_in(0x002, [5, 0, 0, 0, 0, 0, 0, 0]), []);
        assert_eq!(faults_in(0x200, [0, 0, 0, 0, 0, 0, 7, 7]), []);
        assert_eq!(faults_in(0, [0; 8]), [Fault::Other]);
        assert_eq!(faults_in(0x0800_0000, [0; 8]), [Fault::Other]);
    }
}
