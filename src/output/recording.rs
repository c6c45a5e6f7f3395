//! Reads the files of `log`: recordings in both layouts and both formats, and events.

mod cells;

use super::events;
use super::rows::LONG_COLUMNS;
use crate::bus::{Mono, Stamp};
use crate::measure::interval::IntervalTracker;
use crate::measure::sample::{Sample, Source, Status};
use crate::publish::cells::{Cells, Clock, decimal, micros, text, wide_column};
use cells::{LongRow, WideRow};
use std::io::{self, BufRead};
use std::time::Duration;

/// The byte order mark at the start of a file.
const BOM: &[u8] = b"\xef\xbb\xbf";

/// The recorded values of one signal in one unit, in the order of their times.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The node.
    pub node: u8,
    /// `pressure`, `ch1`, an object.
    pub signal: String,
    /// The unit; empty if it is unknown.
    pub unit: String,
    /// The number of the run, counted from 1. Always 1 if the times are those of the clock.
    pub run: usize,
    /// The values.
    pub points: Vec<Point>,
}

/// A recorded value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The time in microseconds.
    pub at: i64,
    /// The number; NaN if there is none. NaN without a status is a gap.
    pub value: f64,
    /// The status, unless it is `ok`.
    pub status: Option<Status>,
}

/// A recorded event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventMark {
    /// The time in microseconds.
    pub at: i64,
    /// The node, if the event belongs to one.
    pub node: Option<u8>,
    /// The word in the column `event`.
    pub event: String,
}

/// The times of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeBase {
    /// Column `time`: since 1970-01-01 UTC.
    Clock,
    /// Column `elapsed_s`: since the first row of the run.
    Elapsed,
}

/// The parts of a file that were not read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Omitted {
    /// Lines that are not rows.
    pub lines: u64,
    /// The number of the first line that is not a row.
    pub first: u64,
    /// Whether the last line is incomplete.
    pub is_cut: bool,
}

/// Why a file cannot be used.
#[derive(Debug)]
pub enum RecordingError {
    /// It cannot be read.
    Io(io::Error),
    /// It has no content.
    Empty,
    /// Neither a recording nor a file of events.
    OtherKind,
}

/// The table to which the next lines of a CSV file belong, with the delimiter.
#[derive(Debug)]
enum Table {
    Long(u8),
    /// Node, signal and unit of each pair of columns.
    Wide(u8, Vec<(u8, String, String)>),
    Events(u8),
}

/// The contents of one or several files.
#[derive(Debug)]
pub struct Recording {
    base: TimeBase,
    /// One curve for each signal of each node in each unit.
    pub curves: Vec<Curve>,
    /// The events.
    pub events: Vec<EventMark>,
    run: usize,
    elapsed: i64,
    clock: Clock,
    /// The index of the curve of the last value. The next value is usually in the next curve, because rows repeat the
    /// signals in the same order.
    last: usize,
    /// The usual interval of each curve of a running recording.
    intervals: Vec<IntervalTracker>,
}

/// The largest number of values of each signal that a running recording keeps.
const MAX_POINTS: usize = 1 << 15;

/// The number of time columns. In each, a running recording keeps the first, lowest, highest and last value.
const TIME_COLUMNS: i64 = 1 << 11;

impl Recording {
    /// An empty recording.
    pub fn new(base: TimeBase) -> Recording {
        Recording {
            base,
            curves: Vec::new(),
            events: Vec::new(),
            run: 1,
            elapsed: 0,
            clock: Clock::default(),
            last: 0,
            intervals: Vec::new(),
        }
    }

    /// Adds a value of a running recording. If there are too many values, some are removed.
    pub fn push(&mut self, sample: &Sample, source: &Source) {
        let at = microseconds(sample.at);
        let value = sample.value.map_or(f64::NAN, |value| value.as_f64());
        let status = sample.status.filter(|status| *status != Status::Ok);
        self.add(source.node.get(), &source.signal, &source.unit, Point { at, value, status });
        self.intervals.resize(self.curves.len(), IntervalTracker::default());
        let points = &mut self.curves[self.last].points;
        if self.intervals[self.last].add(sample.at.mono, None).is_some() {
            points.insert(points.len() - 1, gap(at));
        }
        if points.len() >= MAX_POINTS {
            thin_out(points);
        }
    }

    /// Adds an event of a running recording.
    pub fn push_event(&mut self, at: Stamp, node: Option<u8>, event: &str) {
        if self.events.len() < MAX_POINTS {
            self.events.push(EventMark { at: microseconds(at), node, event: event.to_owned() });
        }
    }

    /// Adds the contents of a file.
    ///
    /// # Errors
    /// The file cannot be read, is empty, or is of another kind.
    pub fn read(&mut self, input: &mut dyn BufRead) -> Result<Omitted, RecordingError> {
        let (mut line, mut number, mut table, mut omitted) = (Vec::new(), 0, None, Omitted::default());
        let (mut has_rows, mut has_lines) = (false, false);
        loop {
            line.clear();
            match input.read_until(b'\n', &mut line) {
                // The compressed file was cut off.
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => omitted.is_cut = true,
                read => drop(read.map_err(RecordingError::Io)?),
            }
            number += 1;
            let is_whole = line.ends_with(b"\n");
            let mut row = line.trim_ascii_end();
            if number == 1 {
                row = row.strip_prefix(BOM).unwrap_or(row);
            }
            has_lines |= !row.is_empty();
            if !is_whole {
                // Without its line end, a row may lack digits.
                omitted.is_cut |= !row.is_empty() && (table.is_some() || has_rows || row.starts_with(b"{"));
                break;
            }
            if row.is_empty() {
                continue;
            }
            if let Some(found) = header(row) {
                table = Some(found);
            } else if self.row(row, table.as_ref()).is_some() {
                has_rows = true;
            } else if table.is_none() && !has_rows {
                return Err(RecordingError::OtherKind);
            } else {
                omitted.lines += 1;
                omitted.first = if omitted.lines == 1 { number } else { omitted.first };
            }
        }
        match (has_lines, table.is_some() || has_rows || omitted.is_cut) {
            (false, _) => Err(RecordingError::Empty),
            (true, false) => Err(RecordingError::OtherKind),
            (true, true) => Ok(omitted),
        }
    }

    /// Sorts values and events by time, because files can be given in any order. Then marks the gaps.
    pub fn finish(&mut self) {
        for curve in &mut self.curves {
            if !curve.points.is_sorted_by_key(|point| point.at) {
                curve.points.sort_by_key(|point| point.at);
            }
            mark_gaps(&mut curve.points);
        }
        self.events.sort_by_key(|event| event.at);
    }

    /// Reads one row. `None` if the line is not a row.
    fn row(&mut self, row: &[u8], table: Option<&Table>) -> Option<()> {
        if row.starts_with(b"{") {
            return self.json_row(row);
        }
        match table? {
            Table::Long(delimiter) => {
                let mut cells = Cells::new(row, *delimiter);
                let at = self.time(&mut cells)?;
                let (node, signal) = (text(&cells.next()?).parse().ok()?, cells.next()?);
                let (value, unit, status) = (cells.next()?, cells.next()?, cells.next()?);
                let point = point(at, &value, &status)?;
                self.add(node, &text(&signal), &text(&unit), point);
            }
            Table::Wide(delimiter, columns) => {
                let mut cells = Cells::new(row, *delimiter);
                let at = self.time(&mut cells)?;
                for (node, signal, unit) in columns {
                    let (value, status) = (cells.next()?, cells.next()?);
                    if !value.is_empty() || !status.is_empty() {
                        self.add(*node, signal, unit, point(at, &value, &status)?);
                    }
                }
            }
            Table::Events(delimiter) => {
                let mut cells = Cells::new(row, *delimiter);
                let (time, elapsed) = (self.clock.time(&cells.next()?)?, cells.next()?);
                let (node, event) = (text(&cells.next()?).parse().ok(), text(&cells.next()?).into_owned());
                // An event before the first row has no elapsed time.
                let at = match self.base {
                    TimeBase::Clock => Some(time),
                    TimeBase::Elapsed => decimal(&elapsed).map(micros),
                };
                self.events.extend(at.map(|at| EventMark { at, node, event }));
            }
        }
        Some(())
    }

    fn json_row(&mut self, row: &[u8]) -> Option<()> {
        if let Ok(row) = serde_json::from_slice::<LongRow>(row) {
            let at = self.choose_time(row.time.0, micros(row.elapsed_s));
            let status = status(row.status.as_deref().unwrap_or_default().as_bytes())?;
            let point = Point { at, value: row.value.unwrap_or(f64::NAN), status };
            self.add(row.node, &row.signal, row.unit.as_deref().unwrap_or_default(), point);
            return Some(());
        }
        let row = serde_json::from_slice::<WideRow>(row).ok()?;
        let at = self.choose_time(row.time?, micros(row.elapsed_s?));
        for (name, value) in &row.values {
            let (node, signal, unit) = wide_column(name)?;
            let status_name = format!("{node}.{signal}.status");
            let word = row.statuses.iter().find(|(name, _)| *name == status_name);
            let status_word = word.and_then(|(_, word)| word.as_deref());
            if value.is_some() || status_word.is_some() {
                let status = status(status_word.unwrap_or_default().as_bytes())?;
                self.add(node, signal, unit, Point { at, value: value.unwrap_or(f64::NAN), status });
            }
        }
        Some(())
    }

    /// Reads the time of a row from its first two cells.
    fn time(&mut self, cells: &mut Cells<'_>) -> Option<i64> {
        let time = self.clock.time(&cells.next()?)?;
        let elapsed = micros(decimal(&cells.next()?)?);
        Some(self.choose_time(time, elapsed))
    }

    fn choose_time(&mut self, time: i64, elapsed: i64) -> i64 {
        if self.base == TimeBase::Clock {
            return time;
        }
        // Each run starts with 0.
        if elapsed == 0 && self.elapsed > 0 {
            self.run += 1;
        }
        self.elapsed = elapsed;
        elapsed
    }

    fn add(&mut self, node: u8, signal: &str, unit: &str, point: Point) {
        let run = self.run;
        let is_same =
            |curve: &Curve| curve.node == node && curve.run == run && curve.signal == signal && curve.unit == unit;
        let next = if self.last + 1 < self.curves.len() { self.last + 1 } else { 0 };
        self.last = match self.curves.get(next).is_some_and(is_same) {
            true => next,
            false => self.curves.iter().position(is_same).unwrap_or_else(|| {
                let (signal, unit) = (signal.to_owned(), unit.to_owned());
                self.curves.push(Curve { node, signal, unit, run, points: Vec::new() });
                self.curves.len() - 1
            }),
        };
        self.curves[self.last].points.push(point);
    }
}

fn microseconds(at: Stamp) -> i64 {
    i64::try_from(at.wall.since_epoch().as_micros()).unwrap_or(i64::MAX)
}

/// Returns a point that marks a gap before the value at this time.
fn gap(at: i64) -> Point {
    Point { at, value: f64::NAN, status: None }
}

/// Marks the gaps: intervals that are longer than three usual intervals.
fn mark_gaps(points: &mut Vec<Point>) {
    let Some(start) = points.first().map(|point| point.at) else { return };
    let mut intervals = IntervalTracker::default();
    let mut is_gap = |point: &Point| {
        let since_start = Duration::from_micros(u64::try_from(point.at - start).unwrap_or(0));
        intervals.add(Mono::at(since_start), None).is_some()
    };
    let gaps: Vec<usize> = (0..points.len()).filter(|&at| is_gap(&points[at])).collect();
    if gaps.is_empty() {
        return;
    }
    let mut gaps = gaps.into_iter().peekable();
    let with_gap = |(at, point): (usize, Point)| [gaps.next_if_eq(&at).map(|_| gap(point.at)), Some(point)];
    *points = std::mem::take(points).into_iter().enumerate().flat_map(with_gap).flatten().collect();
}

/// Keeps in each time column: the first, lowest, highest and last value, one gap, and one value with each status.
fn thin_out(points: &mut Vec<Point>) {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return };
    let (first, width) = (first.at, (last.at - first.at) / TIME_COLUMNS + 1);
    let mut kept = Vec::new();
    for column in points.chunk_by(|a, b| (a.at - first) / width == (b.at - first) / width) {
        let value_at = |at: usize| column[at].value;
        let numbers = || (0..column.len()).filter(|&at| value_at(at).is_finite());
        let lowest = numbers().min_by(|&a, &b| value_at(a).total_cmp(&value_at(b)));
        let highest = numbers().max_by(|&a, &b| value_at(a).total_cmp(&value_at(b)));
        let gap = column.iter().position(|point| point.value.is_nan() && point.status.is_none());
        let marks = MARKED.map(|status| column.iter().position(|point| point.status == Some(status)));
        let ends = [numbers().next(), lowest, highest, numbers().next_back(), gap];
        let mut places: Vec<usize> = ends.into_iter().chain(marks).flatten().collect();
        places.sort_unstable();
        places.dedup();
        kept.extend(places.into_iter().map(|at| column[at]));
    }
    *points = kept;
}

/// Returns the table that starts with this header. `None` if the line is not a header.
fn header(line: &[u8]) -> Option<Table> {
    let delimiter = *line.strip_prefix(LONG_COLUMNS[0].as_bytes())?.first()?;
    if !matches!(delimiter, b',' | b';' | b'|' | b'\t') {
        return None;
    }
    let names: Vec<String> = Cells::new(line, delimiter).map(|cell| text(&cell).into_owned()).collect();
    // Tags (log --tag) follow the other columns. Their names contain no dot.
    if names.starts_with(&LONG_COLUMNS.map(str::to_owned)) {
        return Some(Table::Long(delimiter));
    }
    if names == events::COLUMNS {
        return Some(Table::Events(delimiter));
    }
    let is_tag =
        |name: &&String| name.starts_with(|first: char| first.is_ascii_alphabetic()) && *name != LONG_COLUMNS[1];
    let tags = names.iter().rev().take_while(is_tag);
    let [time, elapsed, pairs @ ..] = &names[..names.len() - tags.count()] else { return None };
    if (time.as_str(), elapsed.as_str()) != (LONG_COLUMNS[0], LONG_COLUMNS[1]) || !pairs.len().is_multiple_of(2) {
        return None;
    }
    let columns = pairs.chunks(2).map(|pair| {
        let (node, signal, unit) = wide_column(&pair[0])?;
        (pair[1] == format!("{node}.{signal}.status")).then(|| (node, signal.to_owned(), unit.to_owned()))
    });
    Some(Table::Wide(delimiter, columns.collect::<Option<Vec<_>>>()?))
}

fn point(at: i64, value: &[u8], word: &[u8]) -> Option<Point> {
    let value = if value.is_empty() { f64::NAN } else { decimal(value)? };
    Some(Point { at, value, status: status(word)? })
}

/// The statuses that a plot marks.
pub(super) const MARKED: [Status; 4] = [Status::OverloadHigh, Status::OverloadLow, Status::Clipped, Status::Invalid];

/// Parses a status: `Some(None)` for `ok` and for an empty word. `None` if the word is not a status.
fn status(word: &[u8]) -> Option<Option<Status>> {
    if word.is_empty() || word == Status::Ok.as_str().as_bytes() {
        return Some(None);
    }
    MARKED.into_iter().find(|status| status.as_str().as_bytes() == word).map(Some)
}

#[cfg(test)]
mod tests;
