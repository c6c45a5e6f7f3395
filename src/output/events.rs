//! The events of a recording, as text and as CSV.

mod text;

use super::rows::{Dialect, FileChange, LineWriter, TimeForm, Times, push_number, push_seconds, push_text, push_texts};
use crate::bus::Stamp;
use crate::canopen::id::NodeId;
use std::io;
use std::time::Duration;
pub(super) use text::left_operational;
pub use text::{event_text, heartbeat_text, remark_text, two_senders};

/// The columns of the CSV file.
pub const COLUMNS: [&str; 5] = ["time", "elapsed_s", "node", "event", "text"];

/// The importance of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// A problem.
    Warning,
    /// Information.
    Note,
    /// Shown only with `-v`.
    Detail,
}

/// An event as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventText {
    /// The word in the column `event`; `None` if it is not written to the file.
    pub event: Option<&'static str>,
    /// The node of the event.
    pub node: Option<NodeId>,
    /// The text, as one line.
    pub text: String,
    /// The importance, which decides how the event is shown.
    pub severity: Severity,
}

impl EventText {
    /// An event that does not belong to a single node.
    pub fn of_all(event: &'static str, severity: Severity, text: String) -> EventText {
        EventText { event: Some(event), node: None, text, severity }
    }
}

/// The text for a change of a file by another program.
pub fn file_change_text(change: &FileChange) -> String {
    match change {
        FileChange::Shortened(path) => {
            format!("another program truncated {}: the rows continue after a new header", path.display())
        }
        FileChange::Moved(path) => format!("{} was moved: the rows continue in the moved file", path.display()),
        FileChange::Deleted(path) => format!("{} was deleted: its rows are lost", path.display()),
    }
}

/// Writes events as CSV.
#[derive(Debug)]
pub struct Events {
    writer: LineWriter,
    dialect: Dialect,
    times: Times,
    /// Whether the file already has its header; `None` after [`Events::write_header`].
    header: Option<bool>,
}

impl Events {
    /// Writes events with `writer`. With `continues`, the file already has its header.
    pub fn new(writer: LineWriter, dialect: Dialect, time: TimeForm, continues: bool) -> Events {
        Events { writer, dialect, times: Times::new(time), header: Some(continues) }
    }

    /// The header, without line end and byte order mark.
    pub fn header(dialect: Dialect) -> String {
        let mut head = Vec::new();
        push_texts(&mut head, COLUMNS, dialect.delimiter);
        String::from_utf8_lossy(&head).trim_end().to_owned()
    }

    /// Writes the header, also for a file without events.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_header(&mut self) -> io::Result<()> {
        let Some(is_present) = self.header.take() else { return self.writer.check() };
        let mark = if self.dialect.bom { "\u{feff}" } else { "" };
        let header = format!("{mark}{}\n", Events::header(self.dialect)).into_bytes();
        if is_present { self.writer.keep_header(header) } else { self.writer.put_header(header) }
    }

    /// Writes an event at once. `elapsed` is the time since the first row.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, at: Stamp, elapsed: Option<Duration>, event: &EventText) -> io::Result<()> {
        let Some(word) = event.event else { return Ok(()) };
        self.write_header()?;
        let Dialect { delimiter, decimal, .. } = self.dialect;
        let mut line = Vec::new();
        self.times.write(&mut line, at.wall, decimal)?;
        line.push(delimiter);
        if let Some(elapsed) = elapsed {
            push_seconds(&mut line, elapsed, decimal);
        }
        line.push(delimiter);
        if let Some(node) = event.node {
            push_number(&mut line, u64::from(node.get()));
        }
        line.push(delimiter);
        line.extend_from_slice(word.as_bytes());
        line.push(delimiter);
        push_text(&mut line, &event.text, delimiter);
        line.push(b'\n');
        self.writer.put_rows(&mut line, 1)
    }

    /// Waits until everything is written, as [`super::rows::Rows::finish`] does.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(&mut self, give_up: &mut dyn FnMut() -> bool) -> io::Result<()> {
        self.writer.finish(give_up)
    }

    /// Returns the changes of the file by other programs since the last call.
    pub fn take_changes(&mut self) -> Vec<FileChange> {
        self.writer.take_changes()
    }

    /// The number of lost events.
    pub fn lost(&self) -> u64 {
        self.writer.lost()
    }
}
