//! Formats typed rows, starts the next file when it is due, and passes whole lines to the writer.
//!
//! This module does not depend on the format.

use super::format::{HeaderMismatch, RowFormat};
use super::line_writer::LineWriter;
use super::rotation::CurrentFile;
use super::row::{Columns, Row, Values};
use super::setup::Setup;
use super::target::FileChange;
use crate::bus::{Mono, Stamp};
use crate::output::elapsed::Elapsed;
use std::io;
use std::time::Duration;

/// Lines are collected up to this many bytes.
const BLOCK_SIZE: usize = 32 * 1024;

/// The longest time that a row waits before it is passed to the writer.
pub(in crate::output) const MAX_DELAY: Duration = Duration::from_millis(500);

/// Formats and passes on rows.
#[derive(Debug)]
pub(super) struct RowSink {
    writer: LineWriter,
    format: Box<dyn RowFormat>,
    setup: Setup,
    /// Formatted rows that are not passed to the writer yet.
    block: Vec<u8>,
    block_rows: u64,
    /// When the first row in the block was received.
    oldest: Option<Mono>,
    elapsed: Option<Elapsed>,
    rows: u64,
    file: CurrentFile,
    /// Rows lost because the next file could not be created.
    rows_without_file: u64,
}

impl RowSink {
    /// Writes nothing before the first row.
    pub(super) fn new(writer: LineWriter, setup: Setup) -> RowSink {
        RowSink {
            writer,
            format: setup.format.writer(&setup),
            block: Vec::with_capacity(BLOCK_SIZE + 4096),
            block_rows: 0,
            oldest: None,
            elapsed: None,
            rows: 0,
            file: CurrentFile::new(setup.rotation),
            rows_without_file: 0,
            setup,
        }
    }

    /// Whether rows with these columns may follow those in the existing file.
    pub(super) fn check_columns(&self, columns: Columns<'_>) -> Result<(), HeaderMismatch> {
        self.setup.check_columns(columns)
    }

    /// Adds a row; `at` is the time of its first value. Rows above the maximum number are ignored.
    pub(super) fn put(&mut self, at: Stamp, values: Values<'_>) -> io::Result<()> {
        if self.is_complete() {
            return Ok(());
        }
        let elapsed = self.elapsed.get_or_insert_default().advance(at);
        let columns = values.columns();
        self.prepare_file(elapsed, columns)?;
        let start = self.block.len();
        self.format.write(&Row { time: at.wall, elapsed, values }, &mut self.block)?;
        self.rows += 1;
        let length = self.block.len() - start;
        let mut result = Ok(());
        if !self.file.has_room(length) {
            let row = self.block.split_off(start);
            result = self.flush().and_then(|()| self.start_file(columns));
            self.block = row;
        }
        self.file.add_row(length);
        self.block_rows += 1;
        self.oldest.get_or_insert(at.mono);
        result?;
        if self.block.len() >= BLOCK_SIZE { self.flush() } else { Ok(()) }
    }

    /// Prepares a file with a header for a row of this time.
    fn prepare_file(&mut self, elapsed: Duration, columns: Columns<'_>) -> io::Result<()> {
        if self.rows == 0 {
            let header = self.format.header(columns);
            if !self.setup.continues {
                self.block.extend_from_slice(&header);
                self.file.start(self.block.len());
            }
            self.file.set_end(elapsed);
            return self.writer.keep_header(header);
        } else if self.file.is_over(elapsed) {
            if let Err(error) = self.flush().and_then(|()| self.start_file(columns)) {
                self.rows_without_file += 1;
                return Err(error);
            }
            self.file.set_end(elapsed);
        }
        Ok(())
    }

    fn start_file(&mut self, columns: Columns<'_>) -> io::Result<()> {
        let header = self.format.header(columns);
        self.file.start(header.len());
        self.writer.start_file(header)
    }

    /// Starts the next file for the following rows. Without a series, the same file continues.
    pub(super) fn start_next_file(&mut self, columns: Columns<'_>) -> io::Result<()> {
        if self.rows == 0 || !self.setup.has_series {
            return Ok(());
        }
        self.flush()?;
        self.start_file(columns)
    }

    /// Changes the columns for the following rows.
    pub(super) fn change_columns(&mut self, columns: Columns<'_>) -> io::Result<()> {
        if self.rows == 0 && !self.setup.continues {
            return Ok(());
        }
        self.flush()?;
        if self.setup.has_series {
            return self.start_file(columns);
        }
        match self.format.new_columns(columns) {
            lines if lines.is_empty() => Ok(()),
            lines => self.writer.put_header(lines),
        }
    }

    /// Passes on the rows that have waited long enough.
    pub(super) fn advance(&mut self, now: Mono) -> io::Result<()> {
        match self.oldest {
            Some(oldest) if now.since(oldest) >= MAX_DELAY => self.flush(),
            _ => self.writer.check(),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.oldest = None;
        let rows = std::mem::take(&mut self.block_rows);
        self.writer.put_rows(&mut self.block, rows)
    }

    /// Passes on all rows, and waits until they are written or `give_up` returns true.
    pub(super) fn finish(&mut self, give_up: &mut dyn FnMut() -> bool) -> io::Result<()> {
        self.flush().and(self.writer.finish(give_up))
    }

    /// Whether the maximum number of rows is reached.
    pub(super) fn is_complete(&self) -> bool {
        self.setup.max_rows.is_some_and(|max| self.rows >= max)
    }

    /// The number of rows so far.
    pub(super) fn rows(&self) -> u64 {
        self.rows
    }

    /// Rows that were lost because writing was too slow or failed.
    pub(super) fn lost(&self) -> u64 {
        self.writer.lost() + self.rows_without_file
    }

    /// Changes of the files by other programs since the last call.
    pub(super) fn take_changes(&mut self) -> Vec<FileChange> {
        self.writer.take_changes()
    }

    /// Rows that were lost because writing was too slow.
    pub(super) fn overflowed(&self) -> u64 {
        self.writer.overflowed()
    }

    /// Time between the first row and `at`; `None` before the first row.
    pub(super) fn elapsed(&self, at: Stamp) -> Option<Duration> {
        self.elapsed.as_ref().map(|elapsed| elapsed.at(at))
    }
}
