//! Messages and hints if the bit rate of a bus was not found.

use super::CauseText;
use crate::tasks::detect::DetectFailure;

/// The message and the hint for a cause.
pub(super) fn words(cause: &DetectFailure) -> CauseText {
    match cause {
        DetectFailure::NotFound { interface, detection, active } => {
            let has_errors = detection.tried.iter().any(|tried| tried.errors > 0);
            let ask = format!("only with a single device: cangauge bus detect {interface} --active");
            let (message, hint) = match (active, has_errors) {
                (false, true) => (
                    "errors but no valid frame at any bit rate",
                    format!("the frames of a single device are not acknowledged, so they are not valid; {ask}"),
                ),
                (false, false) => (
                    "no frame at any bit rate",
                    format!("the devices may be silent: listen longer (--for 5s), or {ask}"),
                ),
                (true, _) => (
                    "no valid frame and no acknowledgement at any bit rate",
                    "check the sensor's power, the wiring and the 120 ohm terminators".to_owned(),
                ),
            };
            CauseText::new(format!("{interface}: {message}")).hint(hint)
        }
        DetectFailure::NotRestored { interface, found, error } => {
            let restored = format!("{interface} was not restored to its previous bit rate: {error}");
            match found {
                Some(bit_rate) => CauseText::new(format!("the bus runs at {bit_rate} bit/s, but {restored}")),
                None => CauseText::new(restored),
            }
        }
    }
}
