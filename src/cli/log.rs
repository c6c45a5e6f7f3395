//! `cangauge log`.

use super::args::{BusSpec, Duration, Nodes, SignalArg};
use super::exit::{Several, stdout};
use super::file::OutFile;
use super::{Format, Global, When, check, open};
use crate::bus::Stamp;
use crate::bus::time::spoken;
use crate::canopen::emcy::Emergency;
use crate::canopen::id::NodeId;
use crate::measure::decode::Wanted;
use crate::measure::expression::Expression;
use crate::measure::expression::verdict::Verdict;
use crate::measure::sample::{Sample, Source};
use crate::output::console::Console;
use crate::output::progress::Progress;
use crate::output::rows::{Form, Rows, Target};
use crate::output::summary;
use crate::tasks::check::{Expecting, all_met};
use crate::tasks::log::{Mode, Note, Observer, Outcome, Plan, log};
use crate::tasks::{Failure, Kind};
use clap::Args;
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
  cangauge -b sim log 127 --duration 5s -o dps.csv
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
    #[arg(short = 'n', long, value_name = "N", value_parser = positive)]
    count: Option<u64>,
    /// Send SYNC at this interval
    #[arg(long, value_name = "DUR", conflicts_with_all = ["poll", "passive"], value_parser = sync_period)]
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
    /// Overwrite files that exist
    #[arg(long)]
    force: bool,
    /// Write the summary as JSON to a file; - for stdout
    #[arg(long, value_name = "FILE")]
    summary: Option<PathBuf>,
    /// Exit with 1 at the end unless this held: 'pressure in 9..11 bar', see cangauge check --help
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    expect: Vec<Expression>,
}

fn positive(text: &str) -> Result<u64, String> {
    text.parse()
        .ok()
        .filter(|&count| count > 0)
        .ok_or_else(|| format!("\"{text}\" is not a number of rows (1 or more)"))
}

/// The shortest interval of SYNC.
const SHORTEST_SYNC: std::time::Duration = std::time::Duration::from_millis(1);

pub(super) fn sync_period(text: &str) -> Result<Duration, String> {
    let period: Duration = text.parse()?;
    if period.0 < SHORTEST_SYNC { Err(format!("\"{text}\" is too short for SYNC (1ms or more)")) } else { Ok(period) }
}

/// Who only plays a recording cannot send at an interval.
pub(super) fn refuse_to_send(global: &Global, interval: Option<Duration>) -> Result<(), Failure> {
    if matches!(global.bus, Some(BusSpec::Replay(_))) && interval.is_some() {
        return Err(Failure::new(Kind::Usage, "a recording (replay:) receives only: --sync and --poll send"));
    }
    Ok(())
}

impl Log {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        refuse_to_send(global, self.sync.or(self.poll))?;
        self.refuse_at_once()?;
        let create = |path: &Path| OutFile::create(path, self.force);
        let file = self.output.as_deref().map(create).transpose()?;
        let summary = self.summary.as_deref().filter(|path| *path != Path::new("-")).map(create).transpose()?;
        let (outcome, verdicts) = self.record(global, file.as_ref())?;
        check::say(&global.console(), &verdicts);
        self.finish(&outcome, &verdicts, summary)
    }

    /// What is expected has to be recorded.
    fn refuse_at_once(&self) -> Result<(), Failure> {
        let wanted: Vec<&Wanted> = self.signals.iter().map(|signal| &signal.0).collect();
        for expression in &self.expect {
            if let Nodes::These(nodes) = &self.nodes {
                expression.names_only(nodes)?;
            }
            if !wanted.is_empty() {
                expression.needs_only(&wanted)?;
            }
        }
        Ok(())
    }

    fn record(&self, global: &Global, file: Option<&OutFile>) -> anyhow::Result<(Outcome, Vec<Verdict>)> {
        // Rows and live lines on one terminal would tear each other.
        let torn = global.progress == When::Auto && file.is_none() && io::stdout().is_terminal();
        let show = global.shows_progress() && !torn;
        let duration = self.duration.map(|duration| duration.0);
        let progress = Progress::new(show, duration, self.count);
        let console = Console { progress: Some(progress.multi()), ..global.console() };
        let form = if global.format == Format::Json { Form::Json } else { Form::Csv };
        let (outcome, verdicts, screen) = global.with_master(|master| {
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
                count: self.count,
                nmt: !self.no_nmt,
            };
            let target = match file {
                Some(file) => Target::File(file.handle()?),
                None => Target::Stream(Box::new(io::stdout())),
            };
            let mut screen = Screen { rows: Rows::new(target, form), progress, console, error: None, begun: None };
            let mut expecting = Expecting::new(&self.expect, &plan.nodes, true, &mut screen);
            let outcome = log(master, &plan, &mut expecting);
            let verdicts = match &outcome {
                Ok(outcome) => expecting.verdicts(outcome),
                Err(_) => Ok(Vec::new()),
            };
            let interrupted = match &outcome {
                Ok(outcome) => outcome.interrupted,
                Err(failure) => failure.kind == Kind::Interrupted,
            };
            screen.progress.finish(interrupted);
            Ok((outcome, verdicts, screen))
        })?;
        let Screen { mut rows, console, error, .. } = screen;
        let flushed = rows.flush();
        if let Some(error) = error.or(flushed.err()) {
            if rows.lost() > 0 && error.kind() != io::ErrorKind::BrokenPipe {
                let word = if rows.lost() == 1 { "row" } else { "rows" };
                console.warn(&format!("{} {word} could not be written", rows.lost()));
            }
            return Err(match file {
                Some(file) => file.error(error),
                None => stdout(error),
            });
        }
        let outcome = outcome?;
        if let Some(failure) = outcome.nothing {
            return Err(failure.into());
        }
        summary::lines(&outcome).iter().for_each(|line| console.note(line));
        Ok((outcome, verdicts?))
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

    fn finish(&self, outcome: &Outcome, verdicts: &[Verdict], file: Option<OutFile>) -> anyhow::Result<()> {
        if self.summary.is_some() {
            let mut text = Vec::new();
            summary::json(&mut text, outcome)?;
            match file {
                Some(mut file) => file.write(&text)?,
                None => io::stdout().lock().write_all(&text).map_err(stdout)?,
            }
        }
        // What was expected and is not so comes first: it gives the exit code.
        let (unmet, lost) = (all_met(verdicts, &[]).err(), self.lost(outcome));
        let failures = match unmet {
            Some(unmet) if unmet.kind == Kind::CheckFailed => [Some(unmet), lost],
            unmet => [lost, unmet],
        };
        let failures: Vec<Failure> = failures.into_iter().flatten().collect();
        if failures.is_empty() { Ok(()) } else { Err(Several(failures).into()) }
    }

    fn lost(&self, outcome: &Outcome) -> Option<Failure> {
        let names: Vec<String> = outcome.lost.iter().map(|node| node.to_string()).collect();
        let kind = if self.all_lost(outcome) { Kind::NoAnswer } else { Kind::Partial };
        let word = if names.len() == 1 { "node" } else { "nodes" };
        let message = format!("{word} {} lost: silent at the end", names.join(", "));
        outcome.lost.first().map(|first| Failure { node: Some(*first), ..Failure::new(kind, message) })
    }

    fn all_lost(&self, outcome: &Outcome) -> bool {
        outcome.statistics.iter().all(|(source, _)| outcome.lost.contains(&source.node))
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
        tell(&self.console, note);
    }

    fn tick(&mut self, at: Stamp, rows: u64) -> ControlFlow<()> {
        let begun = self.begun.get_or_insert(at).mono;
        self.progress.tick(at.mono.since(begun), rows);
        let result = self.rows.flush_if_due(at);
        self.or_break(result)
    }
}

/// Says what happens while it is recorded.
pub(super) fn tell(console: &Console, note: &Note) {
    match note {
        Note::Remark(text) => console.warn(text),
        Note::Emergency(node, emergency, meaning) => {
            console.warn(&format!("node {node}: {}", emergency_text(emergency, meaning)));
        }
        Note::Share(period, share) => console.note(&format!(
            "SYNC every {} and the answers take about {:.1} % of the bus",
            spoken(*period),
            share * 100.0
        )),
        Note::Restarted(node) => console.warn(&format!("node {node} restarted")),
        Note::Gap(node, length) => console.detail(&format!("node {node}: a gap of {}", spoken(*length))),
        Note::Silent(node, since) => console.warn(&format!("node {node}: silent for {}", spoken(*since))),
        Note::Back(node) => console.note(&format!("node {node} is back")),
        Note::WrongLength(node) => {
            console.warn(&format!("node {node}: a TPDO has not the length of its mapping: no row is made of it"))
        }
        Note::Fault(fault) => console.detail(&fault.to_string()),
        Note::Dropped(count) => console.warn(&format!("the kernel dropped {count} frames")),
        Note::Link(true) => console.note("the interface is up again"),
        Note::Link(false) => console.warn("the interface went down; waiting for it"),
    }
}

fn emergency_text(emergency: &Emergency, meaning: &str) -> String {
    if emergency.code == 0 {
        return "emergency over (0000h)".to_owned();
    }
    let register = emergency.register.map(|register| format!(", {register}")).unwrap_or_default();
    format!("emergency {:04X}h, {meaning}{register}", emergency.code)
}
