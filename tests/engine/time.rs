//! The longest time that a command may take.

use crate::command::{Command, Measuring};
use crate::spec::{Other, Spec};
use std::time::Duration;

/// The longest heartbeat time: 1017h has 16 bits of milliseconds.
const LONGEST_HEARTBEAT: Duration = Duration::from_millis(0xffff);

/// The longest time of a command: sixty exchanges in sequence with answers at the last moment, storing and restarting,
/// and the duration that the user asked for.
pub(crate) fn bound(spec: &Spec) -> Duration {
    let ms = Duration::from_millis;
    let unit = ms(spec.timeout_ms) * (spec.retries + 1);
    let asked = match &spec.command {
        // Each segment may take the whole time-out, and a block transfer may fail before.
        Command::SdoRead { .. } | Command::SdoWrite { .. } => return ms(1000) + unit * 20 + ms(spec.timeout_ms) * 360,
        Command::Log { duration_ms, .. } => ms(*duration_ms),
        Command::Check { how, .. } => match how {
            Measuring::Once => Duration::ZERO,
            Measuring::AsSent { for_ms } | Measuring::Sync { for_ms, .. } | Measuring::Poll { for_ms, .. } => {
                ms(*for_ms)
            }
        },
        Command::NmtWatch { for_ms, .. } | Command::PdoWatch { for_ms, .. } => ms(*for_ms),
        // All bit rates, one after the other; at the lowest one the requests alone take seconds.
        Command::Detect { each_ms, .. } => ms(*each_ms) * 20 + ms(8000),
        // Interface and device switch to the new bit rate and back.
        Command::Assign { retime: true, .. } => ms(20_000),
        // The command waits for a heartbeat, with the period that the device reported.
        Command::Nmt { .. } | Command::NmtState { .. } if spec.falsifies_data() => LONGEST_HEARTBEAT,
        _ => Duration::ZERO,
    };
    // Beside heavy traffic, a request and its answer wait for 5 % of the time of the bus, and a search asks all nodes. With
    // CANopen identifiers in the traffic, each of them seems to be present, and its identity is read.
    let is_busy = spec.others.iter().any(|other| matches!(other, Other::NoiseSender { .. }));
    let search = if is_busy { ms(20) * 127 * 8 * (spec.retries + 1) } else { Duration::ZERO };
    ms(30_000) + unit * 60 + asked + search
}
