//! Decides when the next file of a recording starts.

use std::time::Duration;

/// When the next file starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    /// Each file contains the rows of this much of `elapsed_s`.
    Every(Duration),
    /// Each file has at most this many bytes, or one row.
    Size(u64),
}

/// The facts about the current file that rotation needs.
#[derive(Debug)]
pub(super) struct CurrentFile {
    rotation: Option<Rotation>,
    bytes: u64,
    rows: u64,
    /// `elapsed_s` at which the next file starts.
    ends_at: Duration,
}

impl CurrentFile {
    pub(super) fn new(rotation: Option<Rotation>) -> CurrentFile {
        CurrentFile { rotation, bytes: 0, rows: 0, ends_at: Duration::ZERO }
    }

    /// A file starts with a header of this many bytes.
    pub(super) fn start(&mut self, header_bytes: usize) {
        (self.bytes, self.rows) = (header_bytes as u64, 0);
    }

    /// Sets the end of the file whose first row has this time. The end is a whole multiple of the interval, to avoid
    /// drift.
    pub(super) fn set_end(&mut self, elapsed: Duration) {
        if let Some(Rotation::Every(interval)) = self.rotation {
            let excess = elapsed.as_nanos() % interval.as_nanos().max(1);
            self.ends_at = elapsed - Duration::from_nanos(u64::try_from(excess).unwrap_or(0)) + interval;
        }
    }

    /// Whether a row of this time belongs to the next file.
    pub(super) fn is_over(&self, elapsed: Duration) -> bool {
        matches!(self.rotation, Some(Rotation::Every(_))) && elapsed >= self.ends_at
    }

    /// Whether a row of this many bytes fits. The first row of a file always fits.
    pub(super) fn has_room(&self, row_bytes: usize) -> bool {
        match self.rotation {
            Some(Rotation::Size(max)) => self.rows == 0 || self.bytes + row_bytes as u64 <= max,
            _ => true,
        }
    }

    pub(super) fn add_row(&mut self, row_bytes: usize) {
        self.bytes += row_bytes as u64;
        self.rows += 1;
    }
}
