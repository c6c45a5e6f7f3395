//! How long a command may take, by what was asked for.

use crate::command::Command;
use crate::spec::Spec;
use std::time::Duration;

/// The time that a command may take by what was asked for.
pub(crate) fn bound(spec: &Spec) -> Duration {
    let unit = Duration::from_millis(spec.timeout_ms) * (spec.retries + 1);
    match &spec.command {
        // Segments and answers that come just in time; what a device is, and the other way to say a size.
        Command::SdoRead { .. } | Command::SdoWrite { .. } => Duration::from_secs(1) + unit * 60,
        Command::Log { duration_ms, .. } => Duration::from_secs(60) + unit * 300 + Duration::from_millis(*duration_ms),
        _ => Duration::from_secs(60) + unit * 300,
    }
}

