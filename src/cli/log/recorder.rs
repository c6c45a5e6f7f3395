//! Writes and shows a recording while it runs.

use super::super::recording::print_event;
use super::run_file::RunFile;
use cangauge::bus::claim::Claims;
use cangauge::bus::{Mono, Stamp};
use cangauge::canopen::id::NodeId;
use cangauge::measure::sample::{Sample, Source};
use cangauge::node::Node;
use cangauge::output::console::Console;
use cangauge::output::events::{EventText, Events, Severity, event_text, file_change_text};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::live::LiveCounts;
use cangauge::output::progress::Progress;
use cangauge::output::recording::Recording;
use cangauge::output::rows::{FileChange, Rows};
use cangauge::tasks::Failure;
use cangauge::tasks::log::{Change, LogEvent, LogFailure, Observer};
use std::io;
use std::ops::ControlFlow;
use std::time::Duration;

/// The interval of checks for lost rows and changed columns.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// The output that could not be written, with its error.
#[derive(Debug)]
pub(super) enum Unwritten {
    Rows(io::Error),
    Events(io::Error),
    Run(anyhow::Error),
}

/// Writes rows and events, and shows them.
pub(super) struct Recorder {
    pub(super) rows: Rows,
    pub(super) events: Option<Events>,
    pub(super) progress: Progress,
    pub(super) console: Console,
    pub(super) error: Option<Unwritten>,
    /// The file of the run; `None` as soon as it is written, before the first row.
    pub(super) run: Option<RunFile>,
    /// The values and events for `--plot`.
    pub(super) plot: Option<Recording>,
    /// The counts for the live view.
    pub(super) counts: LiveCounts,
    /// Frames that the kernel dropped.
    dropped: u64,
    /// The name of the file with rows.
    file: String,
    /// The nodes that no other cangauge may use until the recording runs.
    pub(super) claims: Option<Claims>,
    start: Option<Mono>,
    last_check: Option<Mono>,
    lost: u64,
    /// The files that another program deleted.
    pub(super) deleted: Vec<String>,
    is_losing: bool,
    column_changes: u64,
}

impl Recorder {
    pub(super) fn new(
        rows: Rows,
        file: String,
        events: Option<Events>,
        progress: Progress,
        console: Console,
    ) -> Recorder {
        Recorder {
            rows,
            events,
            progress,
            console,
            error: None,
            run: None,
            plot: None,
            counts: LiveCounts { file: file.clone(), ..LiveCounts::default() },
            dropped: 0,
            claims: None,
            file,
            start: None,
            last_check: None,
            lost: 0,
            deleted: Vec::new(),
            is_losing: false,
            column_changes: 0,
        }
    }

    /// Ends the recording after a failed write, or if it has enough rows.
    fn proceed(&mut self, result: io::Result<()>) -> ControlFlow<()> {
        if let Err(error) = result {
            self.error.get_or_insert(Unwritten::Rows(error));
        }
        if self.error.is_some() || self.rows.is_complete() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn put_event(&mut self, text: &EventText, at: Stamp) {
        print_event(&self.console, text);
        if let (Some(plot), Some(event)) = (&mut self.plot, text.event) {
            plot.push_event(at, text.node.map(NodeId::get), event);
        }
        let elapsed = self.rows.elapsed(at);
        if let Some(Err(error)) = self.events.as_mut().map(|events| events.add(at, elapsed, text)) {
            self.error.get_or_insert(Unwritten::Events(error));
        }
    }

    fn warn(&mut self, event: &'static str, text: String, at: Stamp) {
        self.put_event(&EventText::of_all(event, Severity::Warning, text), at);
    }

    fn put(&mut self, cycle: Option<u64>, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.progress.update_values(samples, sources);
        if let Some(plot) = &mut self.plot {
            let known = samples.iter().filter_map(|sample| Some((sample, sources.get(sample.source)?)));
            known.for_each(|(sample, source)| plot.push(sample, source));
        }
        // The run is written before the first row, so a program that follows the file finds the run of each row.
        if let Some(first) = samples.first()
            && let Some(run) = self.run.take()
            && let Err(error) = run.write(first.at.wall)
        {
            self.error.get_or_insert(Unwritten::Run(error));
            return ControlFlow::Break(());
        }
        let mut result = self.rows.put(cycle, samples, sources);
        if let (Ok(()), Some(last)) = (&result, samples.last()) {
            result = self.rows.advance(last.at);
            self.check_rows(last.at);
        }
        self.proceed(result)
    }

    /// Returns a text for each file that another program changed since the last call.
    pub(super) fn take_changes(&mut self) -> Vec<String> {
        let mut changes = self.rows.take_changes();
        changes.extend(self.events.as_mut().map(Events::take_changes).unwrap_or_default());
        for change in &changes {
            if let FileChange::Deleted(path) = change {
                self.deleted.push(path.display().to_string());
            }
        }
        changes.iter().map(file_change_text).collect()
    }

    /// Reports changed files and columns, and the start and end of lost rows.
    fn check_rows(&mut self, at: Stamp) {
        if self.last_check.is_some_and(|last| at.mono.since(last) < CHECK_INTERVAL) {
            return;
        }
        self.last_check = Some(at.mono);
        if let Some(Err(error)) = self.events.as_mut().map(Events::write_header) {
            self.error.get_or_insert(Unwritten::Events(error));
        }
        for text in self.take_changes() {
            self.warn("file", text, at);
        }
        let changes = self.rows.column_changes();
        if changes > std::mem::replace(&mut self.column_changes, changes) {
            let text = "a mapping or a unit has changed: the rows continue with new columns, a file in the next file";
            self.warn("columns", text.to_owned(), at);
        }
        let lost = self.rows.overflowed();
        let has_more_lost = lost > std::mem::replace(&mut self.lost, lost);
        match (self.is_losing, has_more_lost) {
            (false, true) => {
                self.is_losing = true;
                self.warn("rows-lost", "the output cannot keep up: rows are being lost".to_owned(), at);
            }
            (true, false) => {
                self.is_losing = false;
                self.warn("rows-again", format!("rows are written again; {lost} rows lost so far"), at);
            }
            _ => {}
        }
    }
}

impl Observer for Recorder {
    fn begin(&mut self, nodes: &[Node]) -> Result<(), Failure> {
        self.run.iter_mut().for_each(|run| run.set_nodes(nodes));
        Ok(())
    }

    fn failed(&mut self, failures: &[Failure]) {
        for failure in failures {
            self.console.warn(&format!("{}: the node is not recorded", ErrorMessage::of(failure).message));
        }
    }

    fn sources(&mut self, sources: &[Source]) -> Result<(), Failure> {
        self.rows.set_sources(sources).map_err(|mismatch| {
            Failure::general(LogFailure::OtherColumns {
                file: self.file.clone(),
                found: mismatch.found,
                expected: mismatch.expected,
            })
        })
    }

    fn cycle(&mut self, number: u64, at: Stamp) -> ControlFlow<()> {
        let result = self.rows.start_cycle(number, at);
        self.proceed(result)
    }

    fn polled(&mut self, cycle: u64, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.put(Some(cycle), samples, sources)
    }

    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.claims = None;
        self.put(None, samples, sources)
    }

    fn event(&mut self, event: &LogEvent, at: Stamp) {
        if let LogEvent::ReadAgain(_, changes) = event
            && changes.iter().any(|change| matches!(change, Change::Device(..)))
            && let Err(error) = self.rows.start_file(at)
        {
            self.error.get_or_insert(Unwritten::Rows(error));
        }
        match event {
            LogEvent::Gap(..) => self.counts.gaps += 1,
            LogEvent::Dropped(count) => self.dropped += u64::from(*count),
            _ => {}
        }
        self.put_event(&event_text(event), at);
    }

    fn tick(&mut self, at: Stamp, _rows: u64) -> ControlFlow<()> {
        self.claims = None;
        let start = *self.start.get_or_insert(at.mono);
        self.counts.elapsed = at.mono.since(start);
        self.counts.rows = self.rows.count();
        self.counts.lost = self.rows.overflowed() + self.dropped;
        self.progress.tick(at.mono, self.counts.clone());
        let result = self.rows.advance(at);
        if self.rows.count() > 0 {
            self.check_rows(at);
        }
        self.proceed(result)
    }
}
