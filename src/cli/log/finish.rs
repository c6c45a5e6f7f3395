//! The end of `cangauge log`: the remaining rows, the summary, and the exit code.

use super::super::exit::{Several, open_stdout, stdout};
use super::super::file::OutFile;
use super::files::OpenFiles;
use super::recorder::{Recorder, Unwritten};
use cangauge::bus::interrupt::Interrupts;
use cangauge::measure::expression::verdict::Verdict;
use cangauge::output::console::Console;
use cangauge::output::events::Events;
use cangauge::output::summary::{Summary, Written, write_json};
use cangauge::tasks::check::all_satisfied;
use cangauge::tasks::log::{LogFailure, RecordingReport};
use cangauge::tasks::{Failure, Kind};
use std::io::{self, Write};

/// The longest wait for a blocked output after Ctrl-C, in tenths of a second.
const FLUSH_TIMEOUT: u32 = 20;

/// The result of writing rows and events.
pub(super) struct Ended {
    pub(super) written: Written,
    pub(super) unwritten: Option<Unwritten>,
    /// The files that another program deleted.
    pub(super) deleted: Vec<String>,
}

/// Waits until everything is written, or until the user stops waiting.
pub(super) fn wait_for_writers(mut recorder: Recorder, interrupted: bool) -> Ended {
    let mut interrupts = Interrupts::new().ok();
    let mut waited = 0;
    let mut give_up = || {
        waited += 1;
        interrupted && waited > FLUSH_TIMEOUT || interrupts.as_mut().is_some_and(Interrupts::take)
    };
    let rows = recorder.rows.finish(&mut give_up);
    let events = recorder.events.as_mut().map_or(Ok(()), |events| events.finish(&mut give_up));
    let written = Written {
        rows: recorder.rows.count(),
        lost: recorder.rows.lost(),
        events_lost: recorder.events.as_ref().map_or(0, Events::lost),
        left_out: recorder.rows.left_out(),
    };
    recorder.take_changes().iter().for_each(|text| recorder.console.warn(text));
    let unwritten = recorder.error.or(rows.err().map(Unwritten::Rows)).or(events.err().map(Unwritten::Events));
    Ended { written, unwritten, deleted: recorder.deleted }
}

impl Unwritten {
    /// Whether the reader closed the output of the rows.
    pub(super) fn is_closed_output(&self) -> bool {
        matches!(self, Unwritten::Rows(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }

    /// The error of the file or stream. If rows were lost, prints their number.
    pub(super) fn into_error(self, console: &Console, files: &OpenFiles, lost: u64) -> anyhow::Error {
        let (file, error) = match (self, &files.events) {
            (Unwritten::Run(error), _) => return error,
            (Unwritten::Events(error), Some(file)) => return file.error(error),
            (Unwritten::Rows(error) | Unwritten::Events(error), _) => (&files.rows, error),
        };
        if lost > 0 && error.kind() != io::ErrorKind::BrokenPipe {
            console.warn(&format!("{lost} {} could not be written", if lost == 1 { "row" } else { "rows" }));
        }
        match file {
            Some(file) => file.error(error),
            None => stdout(error),
        }
    }
}

/// A recording that has at least one row.
pub(super) struct Finished {
    pub(super) report: RecordingReport,
    pub(super) verdicts: Vec<Verdict>,
    pub(super) written: Written,
    /// The files that another program deleted.
    pub(super) deleted: Vec<String>,
    /// Whether --count or --duration was given.
    pub(super) is_limited: bool,
    /// Whether the reader closed the output.
    pub(super) is_closed: bool,
}

impl Finished {
    /// Whether the recording ended as planned. Without --count and --duration, every end is planned.
    fn is_complete(&self) -> bool {
        !(self.is_limited && (self.is_closed || self.report.interrupted))
    }

    pub(super) fn summary(&self) -> Summary<'_> {
        Summary { report: &self.report, written: self.written, complete: self.is_complete() }
    }

    /// Writes the summary as JSON, to a file or to stdout.
    pub(super) fn write_summary(&self, is_wanted: bool, files: &mut OpenFiles) -> anyhow::Result<()> {
        if !is_wanted {
            return Ok(());
        }
        let mut text = Vec::new();
        write_json(&self.summary(), &mut text)?;
        match files.summary.take() {
            Some(file) => file.write(&text),
            None if self.is_closed => Ok(()),
            None => open_stdout()?.lock().write_all(&text).map_err(stdout),
        }
    }

    /// Returns success or the failures. The first failure decides the exit code. It is `partial` if only some nodes
    /// could not be recorded.
    pub(super) fn result(&self, files: &OpenFiles) -> anyhow::Result<()> {
        let unmet = all_satisfied(&self.verdicts, &[]).err();
        let (failed, without_data) = match unmet {
            Some(unmet) if unmet.kind() == Kind::CheckFailed => (Some(unmet), None),
            unmet => (None, unmet),
        };
        let deleted = self.deleted.first().map(|file| LogFailure::FileDeleted { file: file.clone() });
        let run_failures = [self.ended_early(), self.too_slow(files), deleted, self.lost_nodes()];
        let mut failures: Vec<Failure> = failed.into_iter().collect();
        failures.extend(self.report.two_devices.iter().chain(&self.report.replaced).cloned());
        failures.extend(run_failures.into_iter().flatten().map(Failure::general));
        let nodes = self.report.failed.clone();
        let partial = (failures.is_empty() && !nodes.is_empty()).then_some(Kind::Partial);
        failures.extend(nodes.into_iter().chain(without_data));
        match partial.or(failures.first().map(Failure::kind)) {
            None => Ok(()),
            Some(kind) => Err(Several { kind, failures }.into()),
        }
    }

    fn ended_early(&self) -> Option<LogFailure> {
        let rows = self.written.rows.saturating_sub(self.written.lost);
        match (self.is_complete(), self.is_closed) {
            (true, _) => None,
            (false, true) => Some(LogFailure::OutputClosed { rows }),
            (false, false) => Some(LogFailure::EndedEarly { rows }),
        }
    }

    /// The failure if rows or events were lost because the output was too slow.
    fn too_slow(&self, files: &OpenFiles) -> Option<LogFailure> {
        let name = |file: &Option<OutFile>| {
            file.as_ref().map_or_else(|| "stdout".to_owned(), |file| file.path().display().to_string())
        };
        match (self.written.lost, self.written.events_lost) {
            _ if self.is_closed => None,
            (0, 0) => None,
            (0, _) => Some(LogFailure::EventsLost { output: name(&files.events) }),
            (rows, _) => Some(LogFailure::RowsLost { rows, output: name(&files.rows) }),
        }
    }

    /// The failure if nodes stopped before the end.
    fn lost_nodes(&self) -> Option<LogFailure> {
        let nodes = self.report.lost.clone();
        let all = self.report.statistics.iter().all(|(source, _)| nodes.contains(&source.node));
        (!nodes.is_empty()).then_some(LogFailure::NodesLost { nodes, all })
    }
}
