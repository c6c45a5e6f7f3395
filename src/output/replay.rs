//! Notes about a recording that is replayed.

use crate::bus::replay::ReplayNote;

/// A note as text, and whether it is a warning.
pub fn note(file: &str, note: &ReplayNote) -> (String, bool) {
    match note {
        ReplayNote::Skipped { count: 1, first } => {
            (format!("{file}: 1 line skipped: line {first} is not a line of a candump log"), true)
        }
        ReplayNote::Skipped { count, first } => {
            (format!("{file}: {count} lines skipped, line {first} first: they are not lines of a candump log"), true)
        }
        ReplayNote::CutOff(line) => {
            (format!("{file}: the file ends in the middle of line {line}, which was skipped"), true)
        }
        ReplayNote::NoDate => (format!("{file}: the times have no date; they count from 1970-01-01"), false),
    }
}
