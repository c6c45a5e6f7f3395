//! Everything that a recording shows and writes while it runs.

use super::super::recording::print_event;
use crate::bus::claim::Claims;
use crate::bus::{Mono, Stamp};
use crate::measure::sample::{Sample, Source};
use crate::output::console::Console;
use crate::output::events::{Events, Weight, Words, words};
use crate::output::progress::Progress;
use crate::output::rows::{HeaderMismatch, Rows};
use crate::tasks::log::{Note, Observer};
use crate::tasks::{Failure, Kind};
use std::io;
use std::ops::ControlFlow;
use std::time::Duration;

/// How often it is looked whether rows are being lost.
const LOOK: Duration = Duration::from_millis(100);

/// What could not be written.
#[derive(Debug)]
pub(super) enum Unwritten {
    Rows(io::Error),
    Events(io::Error),
}

pub(super) struct Screen {
    pub(super) rows: Rows,
    pub(super) events: Option<Events>,
    pub(super) progress: Progress,
    pub(super) console: Console,
    pub(super) error: Option<Unwritten>,
    /// The file that is to be continued has other columns than will come.
    pub(super) other_head: Option<HeaderMismatch>,
    /// What is kept from others until the recording has begun.
    pub(super) claims: Option<Claims>,
    begun: Option<Mono>,
    looked: Option<Mono>,
    lost: u64,
    is_losing: bool,
    changes: u64,
}

impl Screen {
    pub(super) fn new(rows: Rows, events: Option<Events>, progress: Progress, console: Console) -> Screen {
        Screen {
            rows,
            events,
            progress,
            console,
            error: None,
            claims: None,
            other_head: None,
            begun: None,
            looked: None,
            lost: 0,
            is_losing: false,
            changes: 0,
        }
    }

    fn rows_or_break(&mut self, result: io::Result<()>) -> ControlFlow<()> {
        if let Err(error) = result {
            self.error.get_or_insert(Unwritten::Rows(error));
        }
        // An event may have failed before.
        if self.error.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn event(&mut self, words: &Words, at: Stamp) {
        print_event(&self.console, words);
        let elapsed = self.rows.elapsed(at);
        if let Some(events) = &mut self.events
            && let Err(error) = events.add(at, elapsed, words)
        {
            self.error.get_or_insert(Unwritten::Events(error));
        }
    }

    fn take(&mut self, cycle: Option<u64>, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.progress.take(samples, sources);
        let mut result = self.rows.put(cycle, samples, sources);
        if let (Ok(()), Some(last)) = (&result, samples.last()) {
            result = self.rows.advance(last.at);
            self.look(last.at);
        }
        self.rows_or_break(result)?;
        if self.rows.is_complete() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Says what has changed with the rows.
    fn look(&mut self, at: Stamp) {
        if self.looked.is_some_and(|looked| at.mono.since(looked) < LOOK) {
            return;
        }
        self.looked = Some(at.mono);
        if let Some(Err(error)) = self.events.as_mut().map(Events::write_header) {
            self.error.get_or_insert(Unwritten::Events(error));
        }
        let changes = self.rows.column_changes();
        if changes > std::mem::replace(&mut self.changes, changes) {
            let text = "a mapping or a unit has changed: the rows go on with new columns, of a file in the next file";
            self.event(&Words::of_all("columns", Weight::Warning, text.to_owned()), at);
        }
        let lost = self.rows.overflowed();
        let more = lost > std::mem::replace(&mut self.lost, lost);
        match (self.is_losing, more) {
            (false, true) => {
                self.is_losing = true;
                let text = "what takes the rows is too slow: rows are being lost".to_owned();
                self.event(&Words::of_all("rows-lost", Weight::Warning, text), at);
            }
            (true, false) => {
                self.is_losing = false;
                let text = format!("rows are written again; {lost} were lost so far");
                self.event(&Words::of_all("rows-again", Weight::Warning, text), at);
            }
            _ => {}
        }
    }
}

impl Observer for Screen {
    fn sources(&mut self, sources: &[Source]) -> Result<(), Failure> {
        self.rows.set_sources(sources).map_err(|other| {
            self.other_head = Some(other);
            Failure::new(Kind::Usage, "the file has other columns")
        })
    }

    fn cycle(&mut self, number: u64, at: Stamp) -> ControlFlow<()> {
        let result = self.rows.start_cycle(number, at);
        self.rows_or_break(result)?;
        if self.rows.is_complete() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn polled(&mut self, cycle: u64, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.take(Some(cycle), samples, sources)
    }

    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.claims = None;
        self.take(None, samples, sources)
    }

    fn note(&mut self, note: &Note, at: Stamp) {
        self.event(&words(note), at);
    }

    fn tick(&mut self, at: Stamp, _rows: u64) -> ControlFlow<()> {
        self.claims = None;
        let begun = *self.begun.get_or_insert(at.mono);
        self.progress.tick(at.mono.since(begun), self.rows.count());
        let result = self.rows.advance(at);
        if self.rows.count() > 0 {
            self.look(at);
        }
        self.rows_or_break(result)?;
        if self.rows.is_complete() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
