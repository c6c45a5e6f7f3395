//! How long a command may take, by what was asked for.

use crate::command::{Command, Measuring};
use crate::spec::Spec;
use std::time::Duration;

/// What the devices' own heartbeats may make of it: 1017h has 16 bits of milliseconds.
const LONGEST_HEARTBEAT: Duration = Duration::from_millis(0xffff);

/// The time that a command may take by what was asked for: some sixty exchanges one after the other that get their
/// answer at the last moment, storing and starting again, and what the command itself is to last.
pub(crate) fn bound(spec: &Spec) -> Duration {
    let ms = Duration::from_millis;
    let unit = ms(spec.timeout_ms) * (spec.retries + 1);
    let asked = match &spec.command {
        // Each segment may come just in time, and before that all of it once in blocks.
        Command::SdoRead { .. } | Command::SdoWrite { .. } => return ms(1000) + unit * 20 + ms(spec.timeout_ms) * 360,
        Command::Log { duration_ms, .. } => ms(*duration_ms),
        Command::Check { how, .. } => match how {
            Measuring::Once => Duration::ZERO,
            Measuring::AsSent { for_ms } | Measuring::Sync { for_ms, .. } | Measuring::Poll { for_ms, .. } => {
                ms(*for_ms)
            }
        },
        Command::NmtWatch { for_ms, .. } | Command::PdoWatch { for_ms, .. } => ms(*for_ms),
        // Every bit rate there is, listened to and asked at; at the lowest the questions alone take some seconds.
        Command::Detect { each_ms, .. } => ms(*each_ms) * 20 + ms(8000),
        // The interface and the device go there and back.
        Command::Assign { retime: true, .. } => ms(20_000),
        // A heartbeat is waited for, by the period that the device tells.
        Command::Nmt { .. } | Command::NmtState { .. } if spec.lies() => LONGEST_HEARTBEAT,
        _ => Duration::ZERO,
    };
    ms(30_000) + unit * 60 + asked
}
