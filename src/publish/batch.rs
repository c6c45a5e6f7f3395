//! The rows of a chunk on their way to the server. A rejected batch is halved until the rejected rows are found.

use super::sink::Rejection;
use super::spool::Place;
use std::ops::Range;

/// A line of the recording with its encoded rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The number of the line.
    pub line: u64,
    /// Its place in the chunk.
    pub source: Range<usize>,
    /// The place of its encoded rows.
    pub encoded: Range<usize>,
    /// The number of its rows.
    pub rows: usize,
    /// The time of its first row, in microseconds.
    pub time_us: Option<i64>,
}

/// A line that is never accepted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rejected {
    /// The number of the line.
    pub line: u64,
    /// Its place in the chunk.
    pub source: Range<usize>,
    /// The words of the server; `None` for a line that is not a row.
    pub reason: Option<String>,
}

/// The lines of a chunk.
#[derive(Debug)]
pub struct Batch {
    /// The place after the lines.
    pub end: Place,
    /// The header of the line after them.
    pub header: String,
    /// The lines as they are in the recording.
    pub source: Vec<u8>,
    /// The encoded rows of all lines.
    pub body: Vec<u8>,
    /// The rows that were acknowledged.
    pub accepted: u64,
    /// The lines that are never accepted.
    pub rejected: Vec<Rejected>,
    entries: Vec<Entry>,
    /// Ranges of `entries` to send; the last one is the next.
    parts: Vec<Range<usize>>,
    /// Whether every rejection so far is about the contents of rows.
    is_credible: bool,
}

impl Batch {
    /// A batch without lines.
    pub fn new(end: Place) -> Batch {
        Batch {
            end,
            header: String::new(),
            source: Vec::new(),
            body: Vec::new(),
            accepted: 0,
            rejected: Vec::new(),
            entries: Vec::new(),
            parts: Vec::new(),
            is_credible: true,
        }
    }

    /// Adds a line with rows. A line without rows needs no acknowledgement.
    pub fn add(&mut self, entry: Entry) {
        if entry.rows > 0 {
            self.entries.push(entry);
        }
    }

    /// Adds a line that is not a row.
    pub fn add_other(&mut self, line: u64, source: Range<usize>) {
        self.rejected.push(Rejected { line, source, reason: None });
    }

    /// Queues all lines, in parts of at most `most_rows` lines. Earlier answers are forgotten.
    pub fn queue(&mut self, most_rows: usize) {
        let count = self.entries.len();
        let starts = (0..count).step_by(most_rows.min(count.max(1)));
        self.parts = starts.map(|start| start..start.saturating_add(most_rows).min(count)).rev().collect();
        self.rejected.retain(|rejected| rejected.reason.is_none());
        (self.accepted, self.is_credible) = (0, true);
    }

    /// Takes the next part.
    pub fn next_part(&mut self) -> Option<Range<usize>> {
        self.parts.pop()
    }

    /// The encoded rows of a part.
    pub fn bytes(&self, part: &Range<usize>) -> &[u8] {
        match &self.entries[part.clone()] {
            [first, .., last] => &self.body[first.encoded.start..last.encoded.end],
            [only] => &self.body[only.encoded.clone()],
            [] => &[],
        }
    }

    /// The server acknowledged a part.
    pub fn accept(&mut self, part: &Range<usize>) {
        self.accepted += self.rows(part);
    }

    /// The server rejected at least one row of a part.
    pub fn reject(&mut self, part: Range<usize>, rejection: Rejection) {
        if part.len() > 1 && rejection.dropped != Some(self.rows(&part)) {
            return self.split(part);
        }
        self.is_credible &= rejection.is_about_rows;
        self.reject_all(part, &rejection.reason);
    }

    /// Sends a part again in two halves. A single line cannot be halved, and is never accepted.
    pub fn split(&mut self, part: Range<usize>) {
        if part.len() <= 1 {
            return self.reject_all(part, "too large");
        }
        let middle = part.start + part.len() / 2;
        self.parts.extend([middle..part.end, part.start..middle]);
    }

    /// Sends a part again.
    pub fn put_back(&mut self, part: Range<usize>) {
        self.parts.push(part);
    }

    /// The words of the server if it rejected lines for a reason that may concern every row.
    pub fn doubtful_rejection(&self) -> Option<String> {
        let mut reasons = self.rejected.iter().filter_map(|rejected| rejected.reason.clone());
        if self.is_credible { None } else { reasons.next() }
    }

    /// The time of the last row.
    pub fn last_time(&self) -> Option<i64> {
        self.entries.last().and_then(|entry| entry.time_us)
    }

    fn rows(&self, part: &Range<usize>) -> u64 {
        self.entries[part.clone()].iter().map(|entry| entry.rows as u64).sum()
    }

    fn reject_all(&mut self, part: Range<usize>, reason: &str) {
        let reason = Some(reason.to_owned());
        let rejected = self.entries[part].iter().map(|entry| Rejected {
            line: entry.line,
            source: entry.source.clone(),
            reason: reason.clone(),
        });
        self.rejected.extend(rejected);
    }
}
