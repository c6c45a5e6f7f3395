//! The rows of a recording: typed rows, file formats, rotation, and the writing of whole lines.
//!
//! [`Rows`] converts samples to typed rows, by layout. A sink formats each row and starts the next file when it is due.
//! A [`LineWriter`] writes the lines. To add a format, add a file in `format/` and its lines in `format.rs`.

mod cells;
mod format;
mod line_writer;
mod resume;
mod rotation;
mod row;
mod series;
mod setup;
mod sink;
mod target;
mod wide;

use crate::bus::Stamp;
use crate::measure::sample::{Sample, Source};
pub use cells::{Dialect, TimeForm};
pub(super) use cells::{Times, push_number, push_seconds, push_text, push_texts};
pub use format::{CHOICES, FileFormat, HeaderMismatch};
pub use line_writer::{LineWriter, QUEUE_CAPACITY};
pub use resume::{ExistingLines, existing_lines};
pub use rotation::Rotation;
pub(super) use row::LONG_COLUMNS;
use row::{Columns, Values};
pub use series::Series;
pub use setup::{Layout, Setup};
use sink::RowSink;
use std::io;
use std::time::Duration;
pub use target::{FileChange, OutputTarget};
use wide::Wide;

/// Converts samples to rows, one per value or one per cycle, and writes them.
#[derive(Debug)]
pub struct Rows {
    sink: RowSink,
    /// The rows of layout `wide`; `None` in layout `long`.
    wide: Option<Wide>,
    column_changes: u64,
}

impl Rows {
    /// Rows for `writer`. The header is written with the first row, so without rows nothing is written.
    pub fn new(writer: LineWriter, setup: Setup) -> Rows {
        let wide = (setup.layout == Layout::Wide).then(Wide::default);
        Rows { sink: RowSink::new(writer, setup), wide, column_changes: 0 }
    }

    /// Sets the signals that will be measured: the columns of layout `wide`.
    ///
    /// # Errors
    /// The existing file has other columns.
    pub fn set_sources(&mut self, sources: &[Source]) -> Result<(), HeaderMismatch> {
        let Some(wide) = &mut self.wide else { return Ok(()) };
        wide.set_sources(sources);
        self.sink.check_columns(Columns::Wide(wide.columns()))
    }

    /// Starts a cycle.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn start_cycle(&mut self, number: u64, at: Stamp) -> io::Result<()> {
        let Some(wide) = &mut self.wide else { return Ok(()) };
        wide.start_cycle(number, at);
        self.put_cycles(at, false)
    }

    /// Adds samples that were received together. Polled samples have the number of their cycle.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn put(&mut self, cycle: Option<u64>, samples: &[Sample], sources: &[Source]) -> io::Result<()> {
        if self.wide.is_none() {
            return samples.iter().try_for_each(|sample| {
                self.sink.put(sample.at, Values::One { sample, source: &sources[sample.source] })
            });
        }
        for sample in samples {
            if self.wide.as_ref().is_some_and(|wide| !wide.has_column(sample)) {
                self.add_column(sample, sources)?;
            }
            if let Some(wide) = &mut self.wide {
                wide.put(cycle, sample);
            }
        }
        samples.last().map_or(Ok(()), |last| self.put_cycles(last.at, false))
    }

    fn put_cycles(&mut self, now: Stamp, all_but_last: bool) -> io::Result<()> {
        let Some(wide) = &mut self.wide else { return Ok(()) };
        while let Some((at, cycle)) = wide.pop(now.mono, all_but_last) {
            self.sink.put(at, Values::Cycle { columns: wide.columns(), cells: &cycle.cells })?;
        }
        Ok(())
    }

    /// Adds the column of a new signal or unit.
    fn add_column(&mut self, sample: &Sample, sources: &[Source]) -> io::Result<()> {
        self.put_cycles(sample.at, true)?;
        let Some(wide) = &mut self.wide else { return Ok(()) };
        wide.add_column(sample, sources);
        self.column_changes += 1;
        self.sink.change_columns(Columns::Wide(wide.columns()))
    }

    /// Starts the next file for the next device, if rows were written to a file.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn start_file(&mut self, at: Stamp) -> io::Result<()> {
        self.put_cycles(at, true)?;
        self.sink.start_next_file(self.wide.as_ref().map_or(Columns::Long, |wide| Columns::Wide(wide.columns())))
    }

    /// Writes the rows that have waited long enough.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn advance(&mut self, now: Stamp) -> io::Result<()> {
        self.put_cycles(now, false)?;
        self.sink.advance(now.mono)
    }

    /// At the end, waits until everything is written. If nothing is written for 100 ms, asks `give_up`; if that
    /// returns true, the remaining rows are lost.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn finish(&mut self, give_up: &mut dyn FnMut() -> bool) -> io::Result<()> {
        let mut result = Ok(());
        if let Some(wide) = &mut self.wide {
            while let Some((at, cycle)) = wide.drain() {
                let values = Values::Cycle { columns: wide.columns(), cells: &cycle.cells };
                result = result.and(self.sink.put(at, values));
            }
        }
        result.and(self.sink.finish(give_up))
    }

    /// Whether the maximum number of rows is reached.
    pub fn is_complete(&self) -> bool {
        self.sink.is_complete()
    }

    /// Rows so far.
    pub fn count(&self) -> u64 {
        self.sink.rows()
    }

    /// Rows that were lost because writing was too slow or failed.
    pub fn lost(&self) -> u64 {
        self.sink.lost()
    }

    /// Changes of the files by other programs since the last call.
    pub fn take_changes(&mut self) -> Vec<FileChange> {
        self.sink.take_changes()
    }

    /// Rows that were lost because writing was too slow.
    pub fn overflowed(&self) -> u64 {
        self.sink.overflowed()
    }

    /// Values that are missing in layout `wide`, because they were too late or not the first in their cycle.
    pub fn left_out(&self) -> u64 {
        self.wide.as_ref().map_or(0, |wide| wide.left_out)
    }

    /// The number of changes of the columns in layout `wide`.
    pub fn column_changes(&self) -> u64 {
        self.column_changes
    }

    /// Time between the first row and `at`; `None` before the first row.
    pub fn elapsed(&self, at: Stamp) -> Option<Duration> {
        self.sink.elapsed(at)
    }
}

#[cfg(test)]
mod tests;
