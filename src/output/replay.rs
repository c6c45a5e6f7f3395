//! Notes about a recording that is replayed.

use crate::bus::replay::ReplayNote;
use crate::bus::time::format_duration;

/// A note as text, and whether it is a warning.
pub fn note(file: &str, note: &ReplayNote) -> (String, bool) {
    match note {
        ReplayNote::Skipped { format, count: 1, first } => {
            (format!("{file}: 1 line skipped: line {first} is not a line of {}", format.name()), true)
        }
        ReplayNote::Skipped { format, count, first } => {
            let what = format!("they are not lines of {}", format.name());
            (format!("{file}: {count} lines skipped, line {first} first: {what}"), true)
        }
        ReplayNote::CutOff(line) => {
            (format!("{file}: the file ends in the middle of line {line}, which was skipped"), true)
        }
        ReplayNote::ClockSet { count, line, by, is_backwards } => {
            let direction = if *is_backwards { "back" } else { "forward" };
            let more = if *count > 1 { format!(", and {} more times", count - 1) } else { String::new() };
            let what = format!("the clock was set {direction} by {} at line {line}{more}", format_duration(*by));
            (format!("{file}: {what}; these steps count as no time"), true)
        }
        ReplayNote::NoDate => (format!("{file}: the times have no date; they count from 1970-01-01"), false),
    }
}
