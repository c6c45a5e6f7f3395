//! The rows of a log, as CSV or JSON Lines, written whole.

mod cells;
mod resume;
mod series;
mod setup;
mod sink;
mod wide;

use super::elapsed::Elapsed;
use super::json;
use crate::bus::{Mono, Stamp};
use crate::measure::sample::{Sample, Source, Status};
pub use cells::{Dialect, TimeForm};
pub(super) use cells::{Times, push_number, push_seconds, push_text, push_texts};
use cells::{push_raw, push_value};
pub use resume::{Kept, look};
pub use series::Series;
pub use setup::{Form, Layout, OtherHead, Rotation, Setup};
pub use sink::{CAPACITY, Sink, Target};
use std::io;
use std::time::Duration;
use wide::{Cycle, Wide};

/// Rows wait here for at most this many bytes.
const BLOCK: usize = 32 * 1024;

/// Rows are handed to the kernel at the latest after this.
pub(super) const LATEST: Duration = Duration::from_millis(500);

/// Writes the rows of a log.
#[derive(Debug)]
pub struct Rows {
    sink: Sink,
    setup: Setup,
    times: Times,
    wide: Option<Wide>,
    block: Vec<u8>,
    /// Rows in the block.
    waiting: u64,
    /// When the first of them was put there.
    since: Option<Mono>,
    elapsed: Option<Elapsed>,
    rows: u64,
    /// Of the present file: its bytes, its rows, and when the next one begins.
    bytes: u64,
    rows_here: u64,
    until: Duration,
    /// How often the columns have changed.
    changes: u64,
    /// Rows whose file could not be begun.
    homeless: u64,
}

impl Rows {
    /// Rows into `sink`. The header comes with the first row: where nothing was measured, nothing is written.
    pub fn new(sink: Sink, setup: Setup) -> Rows {
        Rows {
            sink,
            times: Times::new(setup.time),
            wide: (setup.layout == Layout::Wide).then(Wide::default),
            setup,
            block: Vec::with_capacity(BLOCK + 4096),
            waiting: 0,
            since: None,
            elapsed: None,
            rows: 0,
            bytes: 0,
            rows_here: 0,
            until: Duration::ZERO,
            changes: 0,
            homeless: 0,
        }
    }

    /// What will be measured: the columns of the wide layout.
    ///
    /// # Errors
    /// The file that is to be continued has other ones.
    pub fn columns(&mut self, sources: &[Source]) -> Result<(), OtherHead> {
        match &mut self.wide {
            None => Ok(()),
            Some(wide) => {
                wide.set(sources);
                self.setup.fits_with(self.wide.as_ref())
            }
        }
    }

    /// A cycle begins.
    pub fn cycle(&mut self, number: u64, at: Stamp) -> io::Result<()> {
        if let Some(wide) = &mut self.wide {
            wide.begin(number, at);
        }
        self.write_cycles(at.mono)
    }

    /// Takes samples that came together, of the cycle of this number if they were polled.
    pub fn add(&mut self, cycle: Option<u64>, samples: &[Sample], sources: &[Source]) -> io::Result<()> {
        if self.wide.is_none() {
            return samples.iter().try_for_each(|sample| self.long(sample, &sources[sample.source]));
        }
        for sample in samples {
            if self.wide.as_ref().is_some_and(|wide| !wide.knows(sample)) {
                self.change_columns(sample, sources)?;
            }
            if let Some(wide) = &mut self.wide {
                wide.put(cycle, sample);
            }
        }
        samples.last().map_or(Ok(()), |last| self.write_cycles(last.at.mono))
    }

    fn long(&mut self, sample: &Sample, source: &Source) -> io::Result<()> {
        if self.is_complete() {
            return Ok(());
        }
        let elapsed = self.begin_row(sample.at)?;
        let begin = self.block.len();
        let Dialect { delimiter, decimal, .. } = self.setup.dialect;
        let line = &mut self.block;
        match self.setup.form {
            Form::Csv => {
                self.times.write(line, sample.at.wall, decimal)?;
                line.push(delimiter);
                push_seconds(line, elapsed, decimal);
                line.push(delimiter);
                push_number(line, u64::from(source.node.get()));
                line.push(delimiter);
                push_text(line, &source.signal, delimiter);
                line.push(delimiter);
                push_value(line, sample.value, decimal)?;
                line.push(delimiter);
                push_text(line, &source.unit, delimiter);
                line.push(delimiter);
                line.extend_from_slice(sample.status.map_or("", Status::as_str).as_bytes());
                line.push(delimiter);
                push_raw(line, &sample.raw);
                line.push(b'\n');
            }
            Form::Json => {
                let time = self.times.json(sample.at.wall)?;
                json::row(line, &time, elapsed.as_secs_f64(), sample, source)?;
            }
        }
        self.end_row(begin, sample.at.mono)
    }

    fn write_cycles(&mut self, now: Mono) -> io::Result<()> {
        while let Some((at, cycle)) = self.wide.as_mut().and_then(|wide| wide.pop(now, false)) {
            self.row_of_cycle(at, &cycle)?;
        }
        Ok(())
    }

    fn row_of_cycle(&mut self, at: Stamp, cycle: &Cycle) -> io::Result<()> {
        if self.is_complete() {
            return Ok(());
        }
        let Some(wide) = self.wide.take() else { return Ok(()) };
        let result = self.wide_row(at, cycle, &wide);
        self.wide = Some(wide);
        result
    }

    fn wide_row(&mut self, at: Stamp, cycle: &Cycle, wide: &Wide) -> io::Result<()> {
        let elapsed = self.begin_row_under(at, Some(wide))?;
        let begin = self.block.len();
        let Dialect { delimiter, decimal, .. } = self.setup.dialect;
        let line = &mut self.block;
        match self.setup.form {
            Form::Csv => {
                self.times.write(line, at.wall, decimal)?;
                line.push(delimiter);
                push_seconds(line, elapsed, decimal);
                for cell in &cycle.cells {
                    let (value, status) = cell.unwrap_or_default();
                    line.push(delimiter);
                    push_value(line, value, decimal)?;
                    line.push(delimiter);
                    line.extend_from_slice(status.map_or("", Status::as_str).as_bytes());
                }
                line.push(b'\n');
            }
            Form::Json => {
                let time = self.times.json(at.wall)?;
                let cells = cycle.cells.iter().map(|cell| cell.unwrap_or_default());
                json::wide_row(line, &time, elapsed.as_secs_f64(), wide.names().zip(cells))?;
            }
        }
        // What waits in a row that takes long has waited since its first value.
        self.end_row_under(begin, at.mono, Some(wide))
    }

    fn change_columns(&mut self, sample: &Sample, sources: &[Source]) -> io::Result<()> {
        while let Some((at, cycle)) = self.wide.as_mut().and_then(|wide| wide.pop(sample.at.mono, true)) {
            self.row_of_cycle(at, &cycle)?;
        }
        if let Some(wide) = &mut self.wide {
            wide.change(sample, sources);
        }
        self.changes += 1;
        if self.rows > 0 || self.setup.continues {
            self.flush()?;
            let mut head = Vec::new();
            match (self.setup.has_series, self.setup.form) {
                (false, Form::Json) => return Ok(()),
                (false, Form::Csv) => head.push(b'\n'),
                (true, _) => {}
            }
            head.extend(self.setup.head(self.wide.as_ref()));
            return self.begin_file(self.setup.has_series, head);
        }
        Ok(())
    }

    fn begin_row(&mut self, at: Stamp) -> io::Result<Duration> {
        self.begin_row_under(at, None)
    }

    /// How long after the first row this one is; a new file where one is due.
    fn begin_row_under(&mut self, at: Stamp, wide: Option<&Wide>) -> io::Result<Duration> {
        let elapsed = self.elapsed.get_or_insert_default().take(at);
        if self.rows == 0 {
            if !self.setup.continues {
                self.block.extend(self.setup.head(wide));
                self.bytes = self.block.len() as u64;
            }
            self.set_end(elapsed);
        } else if elapsed >= self.until && matches!(self.setup.rotation, Some(Rotation::Every(_))) {
            let flushed = self.flush();
            if let Err(error) = flushed.and_then(|()| self.begin_file(true, self.setup.head(wide))) {
                // There is no place for this row.
                self.homeless += 1;
                return Err(error);
            }
            self.set_end(elapsed);
        }
        Ok(elapsed)
    }

    /// The end of the file that a row of this time begins: a whole multiple, so that nothing drifts.
    fn set_end(&mut self, elapsed: Duration) {
        if let Some(Rotation::Every(length)) = self.setup.rotation {
            let past = elapsed.as_nanos() % length.as_nanos().max(1);
            self.until = elapsed - Duration::from_nanos(u64::try_from(past).unwrap_or(0)) + length;
        }
    }

    fn begin_file(&mut self, next: bool, head: Vec<u8>) -> io::Result<()> {
        (self.bytes, self.rows_here) = (head.len() as u64, 0);
        self.sink.head(next, head)
    }

    fn end_row(&mut self, begin: usize, since: Mono) -> io::Result<()> {
        self.end_row_under(begin, since, None)
    }

    /// A row stands in the block from `begin` on.
    fn end_row_under(&mut self, begin: usize, since: Mono, wide: Option<&Wide>) -> io::Result<()> {
        let length = (self.block.len() - begin) as u64;
        let mut result = Ok(());
        self.rows += 1;
        if let Some(Rotation::Size(most)) = self.setup.rotation
            && self.rows_here > 0
            && self.bytes + length > most
        {
            let row = self.block.split_off(begin);
            result = self.flush().and_then(|()| self.begin_file(true, self.setup.head(wide)));
            self.block = row;
        }
        self.bytes += length;
        self.rows_here += 1;
        self.waiting += 1;
        self.since.get_or_insert(since);
        result?;
        if self.block.len() >= BLOCK { self.flush() } else { Ok(()) }
    }

    /// Time passes: hands over what has waited long enough.
    pub fn pass(&mut self, now: Stamp) -> io::Result<()> {
        self.write_cycles(now.mono)?;
        if self.since.is_some_and(|since| now.mono.since(since) >= LATEST) { self.flush() } else { self.sink.check() }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.since = None;
        let rows = std::mem::take(&mut self.waiting);
        self.sink.rows(&mut self.block, rows)
    }

    /// Hands everything over at the end, and waits for it to be written; while that does not go on, `give_up` is
    /// asked ten times a second.
    pub fn finish(&mut self, give_up: &mut dyn FnMut() -> bool) -> io::Result<()> {
        let mut result = Ok(());
        while let Some((at, cycle)) = self.wide.as_mut().and_then(Wide::drain) {
            result = result.and(self.row_of_cycle(at, &cycle));
        }
        result.and(self.flush()).and(self.sink.finish(give_up))
    }

    /// Whether there are as many rows as there may be.
    pub fn is_complete(&self) -> bool {
        self.setup.limit.is_some_and(|limit| self.rows >= limit)
    }

    /// Rows made so far.
    pub fn count(&self) -> u64 {
        self.rows
    }

    /// Rows that were lost: they came faster than they could be written, or could not be.
    pub fn lost(&self) -> u64 {
        self.sink.lost() + self.homeless
    }

    /// Those that came faster than they could be written.
    pub fn late(&self) -> u64 {
        self.sink.late()
    }

    /// Values that had no place in the wide layout: too late, or not the first ones in their cycle.
    pub fn left_out(&self) -> u64 {
        self.wide.as_ref().map_or(0, |wide| wide.left_out)
    }

    /// How often the columns of the wide layout have changed.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// How long after the first row `at` is; nothing before there is one.
    pub fn elapsed(&self, at: Stamp) -> Option<Duration> {
        self.elapsed.as_ref().map(|elapsed| elapsed.look(at))
    }
}

#[cfg(test)]
mod tests;
