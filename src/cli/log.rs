//! `cangauge log`.

use super::args::{Duration, Nodes, SignalArg};
use super::exit::{FileError, stdout};
use super::{Format, Global, When, open};
use crate::bus::Stamp;
use crate::bus::time::spoken;
use crate::canopen::emcy::Emergency;
use crate::canopen::id::NodeId;
use crate::measure::sample::{Sample, Source};
use crate::output::console::Console;
use crate::output::progress::Progress;
use crate::output::rows::{Form, Rows, Target};
use crate::output::summary;
use crate::tasks::log::{Mode, Note, Observer, Outcome, Plan, log};
use crate::tasks::{Failure, Kind};
use clap::Args;
use std::fs::{File, OpenOptions};
use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Record measurements as CSV or JSON Lines
///
/// Without --sync and --poll the TPDOs are recorded as the nodes send them. Nodes that are not known to
/// be operational are started, and returned at the end to the state they were known to be in.
#[derive(Debug, Args)]
#[command(after_help = "\
Columns: time (UTC), elapsed_s, node, signal, value, unit, status (ok, invalid, overload-high,
overload-low, or empty where the device tells none), raw (the bytes on the wire).

Examples:
  cangauge -b sim log 1 --sync 100ms --count 20
  cangauge -b sim log 127 --duration 10s -o dps.csv
  cangauge -b sim log 1-3,127 pressure --poll 200ms --duration 5s --format json
  cangauge log 5 --passive --device mh4 -o run.csv")]
pub(crate) struct Log {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Only these: pressure, temperature, ch1 to ch16, pressure.status, or an object: 0x6130:1
    signals: Vec<SignalArg>,
    /// End after this time
    #[arg(short, long, value_name = "DUR")]
    duration: Option<Duration>,
    /// End after this many rows
    #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,
    /// Send SYNC at this interval
    #[arg(long, value_name = "DUR", conflicts_with_all = ["poll", "passive"])]
    sync: Option<Duration>,
    /// Read by SDO at this interval
    #[arg(long, value_name = "DUR", conflicts_with = "passive")]
    poll: Option<Duration>,
    /// Send nothing at all
    #[arg(long)]
    passive: bool,
    /// Leave the nodes' NMT states alone
    #[arg(long)]
    no_nmt: bool,
    /// Write to a file instead of stdout
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long, requires = "output")]
    force: bool,
    /// Write the summary as JSON to a file; - for stdout
    #[arg(long, value_name = "FILE")]
    summary: Option<PathBuf>,
}

impl Log {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let file = self.output.as_deref().map(|path| self.create(path)).transpose()?;
        let result = self.record(global, file.as_ref());
        if let (Some(path), Ok(None) | Err(_)) = (&self.output, &result) {
            remove_if_empty(path, file.as_ref());
        }
        let Some(outcome) = result? else { return Ok(()) };
        self.finish(&outcome)
    }

    fn create(&self, path: &Path) -> anyhow::Result<File> {
        let mut options = OpenOptions::new();
        options.write(true);
        let is_file = path.symlink_metadata().is_ok_and(|metadata| metadata.is_file());
        let result = if self.force && is_file {
            options.truncate(true).open(path)
        } else if path.exists() && !is_file {
            // A FIFO, a device, a link: opened as it is, as other programs do.
            options.open(path)
        } else {
            options.create_new(true).open(path)
        };
        result.map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => Failure::new(Kind::Usage, format!("{} exists", path.display()))
                .hint("overwrite it with --force, or name another file")
                .into(),
            _ => FileError { what: format!("create {}", path.display()), source }.into(),
        })
    }

    fn record(&self, global: &Global, file: Option<&File>) -> anyhow::Result<Option<Outcome>> {
        // Rows and live lines on one terminal would tear each other.
        let torn = global.progress == When::Auto && file.is_none() && io::stdout().is_terminal();
        let show = global.shows_progress() && !torn;
        let duration = self.duration.map(|duration| duration.0);
        let progress = Progress::new(show, duration, self.count);
        let console = Console { progress: Some(progress.multi()), ..global.console() };
        let form = if global.format == Format::Json { Form::Json } else { Form::Csv };
        let (outcome, screen) = global.with_master(|master| {
            let nodes = match (&self.nodes, self.passive) {
                (Nodes::All, true) => NodeId::all().collect(),
                _ => open::nodes(master, global, &self.nodes)?,
            };
            let plan = Plan {
                overrides: open::overrides(global, &nodes)?,
                nodes,
                wanted: self.signals.iter().map(|signal| signal.0.clone()).collect(),
                mode: self.mode(),
                duration,
                count: self.count,
                nmt: !self.no_nmt,
            };
            let target = match file {
                Some(file) => Target::File(file.try_clone().map_err(|source| self.file_error(source))?),
                None => Target::Stream(Box::new(io::stdout())),
            };
            let mut screen = Screen { rows: Rows::new(target, form), progress, console, error: None, begun: None };
            let outcome = log(master, &plan, &mut screen);
            let interrupted = match &outcome {
                Ok(outcome) => outcome.interrupted,
                Err(failure) => failure.kind == Kind::Interrupted,
            };
            screen.progress.finish(interrupted);
            Ok((outcome, screen))
        })?;
        let Screen { mut rows, console, error, .. } = screen;
        let flushed = rows.flush();
        if let Some(error) = error.or(flushed.err()) {
            if rows.lost() > 0 && error.kind() != io::ErrorKind::BrokenPipe {
                console.warn(&format!("{} rows could not be written", rows.lost()));
            }
            return Err(self.row_error(error));
        }
        let outcome = outcome?;
        if let Some(failure) = outcome.nothing {
            return Err(failure.into());
        }
        summary::lines(&outcome).iter().for_each(|line| console.note(line));
        Ok(Some(outcome))
    }

    fn mode(&self) -> Mode {
        match (self.sync, self.poll, self.passive) {
            (Some(period), _, _) => Mode::Sync(period.0),
            (_, Some(period), _) => Mode::Poll(period.0),
            (_, _, true) => Mode::Passive,
            _ => Mode::AsSent,
        }
    }

    fn file_error(&self, source: io::Error) -> anyhow::Error {
        let name = self.output.as_ref().map_or_else(|| "stdout".to_owned(), |path| path.display().to_string());
        FileError { what: format!("write {name}"), source }.into()
    }

    fn row_error(&self, error: io::Error) -> anyhow::Error {
        if self.output.is_none() { stdout(error) } else { self.file_error(error) }
    }

    fn finish(&self, outcome: &Outcome) -> anyhow::Result<()> {
        match self.summary.as_deref() {
            None => {}
            Some(path) if path == Path::new("-") => {
                summary::json(&mut io::stdout().lock(), outcome).map_err(stdout)?;
            }
            Some(path) => {
                let what = format!("write {}", path.display());
                let wrap = |source| FileError { what: what.clone(), source };
                let mut file = File::create(path).map_err(wrap)?;
                summary::json(&mut file, outcome).and_then(|()| file.flush()).map_err(wrap)?;
            }
        }
        match outcome.lost.as_slice() {
            [] => Ok(()),
            lost => {
                let names: Vec<String> = lost.iter().map(|node| node.to_string()).collect();
                let kind = if self.all_lost(outcome) { Kind::NoAnswer } else { Kind::Partial };
                let word = if lost.len() == 1 { "node" } else { "nodes" };
                let message = format!("{word} {} lost: silent at the end", names.join(", "));
                Err(Failure { node: lost.first().copied(), ..Failure::new(kind, message) }.into())
            }
        }
    }

    fn all_lost(&self, outcome: &Outcome) -> bool {
        outcome.statistics.iter().all(|(source, _)| outcome.lost.contains(&source.node))
    }
}

/// A file in which not one row came to stand was not there before and shall not be there now.
fn remove_if_empty(path: &Path, file: Option<&File>) {
    let length =
        file.and_then(|file| file.metadata().ok()).filter(|metadata| metadata.is_file()).map(|metadata| metadata.len());
    if length == Some(0) {
        // What cannot be removed stays, with its header: nothing is lost by it.
        let _ = std::fs::remove_file(path);
    }
}

/// Everything a recording shows and writes.
struct Screen {
    rows: Rows,
    progress: Progress,
    console: Console,
    error: Option<io::Error>,
    begun: Option<Stamp>,
}

impl Screen {
    fn or_break(&mut self, result: io::Result<()>) -> ControlFlow<()> {
        match result {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.error.get_or_insert(error);
                ControlFlow::Break(())
            }
        }
    }
}

impl Observer for Screen {
    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.progress.take(samples, sources);
        let mut result = samples.iter().try_for_each(|sample| self.rows.add(sample, &sources[sample.source]));
        if let (Ok(()), Some(last)) = (&result, samples.last()) {
            result = self.rows.flush_if_due(last.at);
        }
        self.or_break(result)
    }

    fn note(&mut self, note: &Note, _at: Stamp) {
        match note {
            Note::Remark(text) => self.console.warn(text),
            Note::Emergency(node, emergency) => {
                self.console.warn(&format!("node {node}: {}", emergency_text(emergency)))
            }
            Note::Restarted(node) => self.console.warn(&format!("node {node} restarted")),
            Note::Silent(node, since) => self.console.warn(&format!("node {node}: silent for {}", spoken(*since))),
            Note::Back(node) => self.console.note(&format!("node {node} is back")),
            Note::WrongLength(node) => self
                .console
                .warn(&format!("node {node}: a TPDO has not the length of its mapping: no row is made of it")),
            Note::Fault(fault) => self.console.detail(&fault.to_string()),
            Note::Dropped(count) => self.console.warn(&format!("the kernel dropped {count} frames")),
            Note::Link(true) => self.console.note("the interface is up again"),
            Note::Link(false) => self.console.warn("the interface went down; waiting for it"),
        }
    }

    fn tick(&mut self, at: Stamp, rows: u64) -> ControlFlow<()> {
        let begun = self.begun.get_or_insert(at).mono;
        self.progress.tick(at.mono.since(begun), rows);
        let result = self.rows.flush_if_due(at);
        self.or_break(result)
    }
}

fn emergency_text(emergency: &Emergency) -> String {
    let register = emergency.register.map(|register| format!(", {register}")).unwrap_or_default();
    format!("emergency {:04X}h, {}{register}", emergency.code, Emergency::class(emergency.code))
}
