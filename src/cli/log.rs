//! `cangauge log`.

mod files;
mod screen;

use super::args::{Duration, Nodes, SignalArg};
use super::exit::{Several, stdout};
use super::file::OutFile;
use super::recording::{print_verdicts, refuse_to_send, sync_interval};
use super::{Format, Global, When, open};
use crate::bus::claim::Claim;
use crate::bus::interrupt::Interrupts;
use crate::canopen::id::NodeId;
use crate::measure::decode::Wanted;
use crate::measure::expression::Expression;
use crate::measure::expression::verdict::Verdict;
use crate::output::console::Console;
use crate::output::events::Events;
use crate::output::progress::Progress;
use crate::output::rows::FileFormat;
use crate::output::summary::{self, Written};
use crate::tasks::check::{Checker, all_satisfied};
use crate::tasks::log::{Mode, Plan, RecordingReport, log};
use crate::tasks::{Failure, Kind};
use clap::Args;
use files::{Files, Opened};
use screen::{Screen, Unwritten};
use std::io::{self, IsTerminal, Write};

/// Record measurements as CSV or JSON Lines
///
/// Without --sync and --poll the TPDOs are recorded as the nodes send them. Nodes that are not known to
/// be operational are started, and returned at the end to the state they were known to be in.
#[derive(Debug, Args)]
#[command(after_help = "\
Columns: time (UTC), elapsed_s, node, signal, value, unit, status (ok, invalid, overload-high,
overload-low, or empty where the device tells none), raw (the bytes on the wire).
Layout wide: time, elapsed_s, then 5.pressure [bar] and 5.pressure.status for every signal; a row per
cycle, its time that of its first value, its cells empty where nothing came. New columns begin a new file.

What takes the rows may be slow: 12 MiB wait for it, what is more is counted as lost (exit code 8).

Examples:
  cangauge -b sim log 1 --sync 100ms --count 20
  cangauge -b sim log 127 --duration 5s -o dps.csv
  cangauge -b sim log 1-3,127 pressure --poll 200ms --duration 5s --format json
  cangauge -b sim log 1,127 --sync 10ms --layout wide --duration 5s -o wide.csv
  cangauge log 1 --sync 10ms -o run.csv --rotate 1h --events events.csv
  cangauge log 5 --passive --device mh4 -o run.csv --append")]
pub(crate) struct Log {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Only these: pressure, temperature, ch1 to ch16, pressure.status, or an object: 0x6130:1
    signals: Vec<SignalArg>,
    /// End after this time
    #[arg(short, long, value_name = "DUR")]
    duration: Option<Duration>,
    /// End after this many rows
    #[arg(short = 'n', long, value_name = "N", value_parser = positive)]
    count: Option<u64>,
    /// Send SYNC at this interval
    #[arg(long, value_name = "DUR", conflicts_with_all = ["poll", "passive"], value_parser = sync_interval)]
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
    /// The longest interval that is no gap; three usual ones where nothing is said
    #[arg(long, value_name = "DUR")]
    max_gap: Option<Duration>,
    /// Exit with 1 at the end unless this held: 'pressure in 9..11 bar', see cangauge check --help
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    expect: Vec<Expression>,
    #[command(flatten)]
    files: Files,
}

fn positive(text: &str) -> Result<u64, String> {
    text.parse()
        .ok()
        .filter(|&count| count > 0)
        .ok_or_else(|| format!("\"{text}\" is not a number of rows (1 or more)"))
}

impl Log {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        if self.passive { Claim::Nothing } else { self.nodes.claim() }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        refuse_to_send(global, self.sync.or(self.poll))?;
        self.refuse_at_once()?;
        let format = if global.format == Format::Json { FileFormat::JsonLines } else { FileFormat::Csv };
        self.files.refuse(format, self.sync.or(self.poll).is_some())?;
        let mut opened = self.files.open(format, self.count)?;
        let recorded = self.record(global, &mut opened)?;
        print_verdicts(&global.console(), &recorded.verdicts);
        self.finish(&recorded, &mut opened)
    }

    /// What is expected has to be recorded.
    fn refuse_at_once(&self) -> Result<(), Failure> {
        let wanted: Vec<&Wanted> = self.signals.iter().map(|signal| &signal.0).collect();
        for expression in &self.expect {
            if let Nodes::These(nodes) = &self.nodes {
                expression.check_nodes(nodes)?;
            }
            if !wanted.is_empty() {
                expression.check_recorded(&wanted)?;
            }
        }
        Ok(())
    }

    fn record(&self, global: &Global, opened: &mut Opened) -> anyhow::Result<Recorded> {
        // Rows and live lines on one terminal would tear each other.
        let torn = global.progress == When::Auto && opened.rows.is_none() && io::stdout().is_terminal();
        let show = global.shows_progress() && !torn;
        let duration = self.duration.map(|duration| duration.0);
        let progress = Progress::new(show, duration, self.count);
        let console = Console { progress: Some(progress.multi()), ..global.console() };
        let (outcome, verdicts, screen) = global.with_claims(|master, claims| {
            let nodes = match (&self.nodes, self.passive || !master.bus().is_live()) {
                (Nodes::All, true) => NodeId::all().collect(),
                _ => open::nodes(master, global, &self.nodes)?,
            };
            let mode = self.mode(master.bus().is_live());
            let plan = Plan {
                overrides: open::overrides(global, &nodes)?,
                nodes,
                wanted: self.signals.iter().map(|signal| signal.0.clone()).collect(),
                mode,
                duration,
                // In the wide layout it counts rows, which are made of many values.
                count: self.count.filter(|_| !self.files.is_wide()),
                nmt: !self.no_nmt,
                max_gap: self.max_gap.map(|longest| longest.0),
            };
            let waits = master.bus().waits();
            let (rows, events) = (opened.rows(waits)?, opened.events(waits)?);
            let mut screen = Screen::new(rows, events, progress, console);
            // Whoever only listens from then on leaves the nodes to others.
            screen.claims = self.poll.is_none().then(|| std::mem::take(claims));
            let mut checker = Checker::new(&self.expect, &plan.nodes, true, &mut screen);
            let outcome = log(master, &plan, &mut checker);
            let verdicts = match &outcome {
                Ok(outcome) => checker.verdicts(outcome),
                Err(_) => Ok(Vec::new()),
            };
            let interrupted = match &outcome {
                Ok(outcome) => outcome.interrupted,
                Err(failure) => failure.kind() == Kind::Interrupted,
            };
            screen.progress.finish(interrupted);
            Ok((outcome, verdicts, screen))
        })?;
        if let Some(other) = &screen.other_head {
            return Err(opened.other_head(other).into());
        }
        let interrupted = outcome.as_ref().is_ok_and(|outcome| outcome.interrupted);
        let written = end(screen, opened, interrupted)?;
        let outcome = outcome?;
        if let Some(failure) = outcome.nothing {
            return Err(failure.into());
        }
        let console = global.console();
        summary::lines(&outcome, written).iter().for_each(|line| console.note(line));
        Ok(Recorded { outcome, verdicts: verdicts?, written })
    }

    /// A recording (`replay:`) can only be listened to.
    fn mode(&self, live: bool) -> Mode {
        match (self.sync, self.poll, self.passive || !live) {
            (Some(period), _, _) => Mode::Sync(period.0),
            (_, Some(period), _) => Mode::Poll(period.0),
            (_, _, true) => Mode::Passive,
            _ => Mode::AsSent,
        }
    }

    fn finish(&self, recorded: &Recorded, opened: &mut Opened) -> anyhow::Result<()> {
        let Recorded { outcome, verdicts, written } = recorded;
        if self.files.summary.is_some() {
            let mut text = Vec::new();
            summary::json(&mut text, outcome, *written)?;
            match &mut opened.summary {
                Some(file) => file.write(&text)?,
                None => io::stdout().lock().write_all(&text).map_err(stdout)?,
            }
        }
        // What was expected and is not so comes first: it gives the exit code.
        let (unmet, lost) = (all_satisfied(verdicts, &[]).err(), self.lost(outcome));
        let name = |file: &Option<OutFile>| {
            file.as_ref().map_or_else(|| "stdout".to_owned(), |file| file.path().display().to_string())
        };
        let too_slow =
            |what: String, file| Failure::new(Kind::Io, format!("{what} were lost: {} was too slow", name(file)));
        let late = (written.lost > 0).then(|| too_slow(rows(written.lost), &opened.rows));
        let late = late.or((written.events_lost > 0).then(|| too_slow("events".to_owned(), &opened.events)));
        let failures = match unmet {
            Some(unmet) if unmet.kind() == Kind::CheckFailed => [Some(unmet), late, lost],
            unmet => [late, lost, unmet],
        };
        let failures: Vec<Failure> = failures.into_iter().flatten().collect();
        match failures.first().map(Failure::kind) {
            None => Ok(()),
            Some(kind) => Err(Several { kind, failures }.into()),
        }
    }

    fn lost(&self, outcome: &RecordingReport) -> Option<Failure> {
        let names: Vec<String> = outcome.lost.iter().map(|node| node.to_string()).collect();
        let kind = if self.all_lost(outcome) { Kind::NoAnswer } else { Kind::Partial };
        let word = if names.len() == 1 { "node" } else { "nodes" };
        let message = format!("{word} {} lost: silent at the end", names.join(", "));
        outcome.lost.first().map(|first| Failure { node: Some(*first), ..Failure::new(kind, message) })
    }

    fn all_lost(&self, outcome: &RecordingReport) -> bool {
        outcome.statistics.iter().all(|(source, _)| outcome.lost.contains(&source.node))
    }
}

/// What came of it.
struct Recorded {
    outcome: RecordingReport,
    verdicts: Vec<Verdict>,
    written: Written,
}

/// Who ended the recording waits for a reader that does not read only for so many tenths of a second.
const HURRY: u32 = 20;

/// Waits until everything is written, or the user does not want to wait.
fn end(mut screen: Screen, opened: &Opened, interrupted: bool) -> anyhow::Result<Written> {
    let mut interrupts = Interrupts::new().ok();
    let mut waited = 0;
    let mut give_up = || {
        waited += 1;
        interrupted && waited > HURRY || interrupts.as_mut().is_some_and(Interrupts::take)
    };
    let finished = screen.rows.finish(&mut give_up);
    let told = screen.events.as_mut().map_or(Ok(()), |events| events.finish(&mut give_up));
    let Screen { rows: writer, console, error, events, .. } = screen;
    let error = error.or(finished.err().map(Unwritten::Rows)).or(told.err().map(Unwritten::Events));
    match (error, &opened.rows, &opened.events) {
        (None, _, _) => Ok(Written {
            rows: writer.count(),
            lost: writer.lost(),
            events_lost: events.as_ref().map_or(0, Events::lost),
            left_out: writer.left_out(),
        }),
        (Some(Unwritten::Events(error)), _, Some(file)) => Err(file.error(error)),
        (Some(Unwritten::Rows(error) | Unwritten::Events(error)), file, _) => {
            if writer.lost() > 0 && error.kind() != io::ErrorKind::BrokenPipe {
                console.warn(&format!("{} could not be written", rows(writer.lost())));
            }
            Err(match file {
                Some(file) => file.error(error),
                None => stdout(error),
            })
        }
    }
}

fn rows(count: u64) -> String {
    if count == 1 { "1 row".to_owned() } else { format!("{count} rows") }
}
