//! `cangauge check`.

use super::args::{BusSpec, Duration, Nodes};
use super::exit::Several;
use super::file::ReportFile;
use super::recording::{poll_interval, print_event, refuse_to_send, sync_interval};
use super::{Global, descriptions, open};
use cangauge::bus::Stamp;
use cangauge::bus::claim::{Claim, Claims};
use cangauge::canopen::id::NodeId;
use cangauge::master::Master;
use cangauge::measure::expression::Expression;
use cangauge::measure::expression::evaluator::Evaluator;
use cangauge::measure::sample::{Sample, Source};
use cangauge::output::check_progress::CheckProgress;
use cangauge::output::console::Console;
use cangauge::output::events::{event_text, remark_text};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::{github, junit, verdict};
use cangauge::tasks::check::{CheckOptions, CheckReport, all_satisfied, check, check_figures};
use cangauge::tasks::health::{self, HealthOptions};
use cangauge::tasks::log::{LogEvent, Mode, Observer};
use cangauge::tasks::{Failure, Kind};
use clap::Args;
use std::env;
use std::fs::OpenOptions;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration as StdDuration;

/// Check measurements against limits (exit code 0: all satisfied, 1: not satisfied, 3: no data)
///
/// Without --for, one reading by SDO is checked. With --for, the command records for this time, as log does, and checks
/// each sample. With -b replay:FILE, each sample of the file is checked. If a sample is invalid, the check fails. All
/// expressions must be satisfied.
#[derive(Debug, Args)]
#[command(after_help = "\
Expressions:
  'pressure in 9.95..10.05 bar'    both ends belong to the range
  'temperature < 60 degC'          without a unit: the unit of the device
  '|5.pressure - 6.pressure| < 0.1 bar'
                                   the signals of two nodes
  'noise(pressure) < 0.01 bar'     a function of all samples
  'bus.load < 60 %'                a figure of the bus
  'node.heartbeat.max < 1.1 s'     a figure of each node
  'pressure.status == 0'           the status of a signal
  '0x6130:1 > 9'                   an object
Quote each expression. A signal without a node-ID is checked for each node.

Operators:
  < <= > >= == != in  + - * /  | |  ( )  and or not
Calculated values are equal if they differ by less than 1e-9 of the larger one.

Functions:
  mean, min, max    of the values
  noise             standard deviation of the values
  rate              samples per second
  gap               longest interval between two samples, in s
  count             number of samples
  invalid           number of invalid samples. If an expression contains this
                    function, invalid samples do not make it fail

Figures of the bus and of each node:
  bus.load, bus.load.peak, bus.errors
  node.heartbeat.max, node.sdo.p99, node.emcy, node.restarts
All figures: cangauge health

Examples:
  cangauge -b sim check 1 'pressure > 0.5 bar'
  cangauge -b sim check 1,127 'pressure < 1000 psi' 'noise(pressure) < 1 psi' --for 1s --poll 50ms
  cangauge check 5 'pressure in 9.95..10.05 bar' --for 10s --sync 10ms --junit report.xml")]
pub(crate) struct Check {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Expression to check (see below)
    #[arg(required = true, value_name = "EXPR")]
    expressions: Vec<Expression>,
    /// Check all samples during this time
    #[arg(long = "for", value_name = "DUR")]
    duration: Option<Duration>,
    /// Send SYNC at this interval
    #[arg(long, value_name = "DUR", requires = "duration", conflicts_with = "poll", value_parser = sync_interval)]
    sync: Option<Duration>,
    /// Read by SDO at this interval
    #[arg(long, value_name = "DUR", requires = "duration", value_parser = poll_interval)]
    poll: Option<Duration>,
    /// Write the verdicts as JUnit XML for CI servers: one test case per expression and node. An existing file is
    /// replaced
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Print an annotation per expression and node to stderr, and append a table to the file in GITHUB_STEP_SUMMARY
    /// [default: github if GITHUB_ACTIONS is true]
    #[arg(long, value_name = "SERVER")]
    annotate: Option<Annotate>,
}

/// The servers with annotations.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Annotate {
    Github,
}

impl Check {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        refuse_to_send(global, self.sync.or(self.poll))?;
        self.validate(global)?;
        let limit = self.duration.map(|duration| duration.0);
        let file = self.junit.as_deref().map(|path| ReportFile::create(path, false, limit)).transpose()?;
        let waited = file.as_ref().map_or(StdDuration::ZERO, |file| file.waited);
        let report = match self.measure(global, waited) {
            // A CI server also needs a report if nothing was measured.
            Err(error) => {
                let failure = error.downcast_ref::<Failure>().filter(|failure| failure.kind() != Kind::Usage);
                if let Some(failure) = failure {
                    self.deliver(global, file, &CheckReport::not_measured(&self.expressions, failure.clone()))?;
                }
                return Err(error);
            }
            Ok(report) => report,
        };
        let console = global.console();
        report.remarks.iter().for_each(|remark| console.note(&remark_text(remark)));
        self.deliver(global, file, &report)?;
        global.print(&verdict::rows(&report))?;
        match all_satisfied(&report.verdicts, &report.failures) {
            Err(failure) if failure.kind() != Kind::CheckFailed && report.is_partial() => {
                let failures = if report.failures.is_empty() { vec![failure] } else { report.failures };
                Err(Several { kind: Kind::Partial, failures }.into())
            }
            result => Ok(result?),
        }
    }

    /// Writes the reports for CI servers.
    fn deliver(&self, global: &Global, file: Option<ReportFile>, report: &CheckReport) -> anyhow::Result<()> {
        // With errors as JSON, stderr contains nothing else, unless annotations are requested.
        let is_automatic =
            || env::var_os("GITHUB_ACTIONS").is_some_and(|value| value == "true") && !global.console().json;
        if self.annotate.is_some() || is_automatic() {
            let console = global.console();
            github::annotations(report).iter().for_each(|line| console.plain(line));
            if let Some(path) = env::var_os("GITHUB_STEP_SUMMARY").filter(|path| !path.is_empty()) {
                let opened = OpenOptions::new().append(true).create(true).open(&path);
                if let Err(error) = opened.and_then(|mut file| file.write_all(github::summary(report).as_bytes())) {
                    console.warn(&format!("no step summary: {}: {error}", path.display()));
                }
            }
        }
        file.map_or(Ok(()), |file| file.write(junit::document(report).as_bytes()))
    }

    /// Checks the arguments before the bus is opened.
    fn validate(&self, global: &Global) -> anyhow::Result<()> {
        if let Nodes::These(nodes) = &self.nodes {
            self.expressions.iter().try_for_each(|expression| expression.check_nodes(nodes)).map_err(Failure::from)?;
        }
        let function = self.expressions.iter().find_map(Expression::needs_many_samples);
        let is_replay = matches!(global.bus, Some(BusSpec::Replay(_)));
        match function.filter(|_| self.duration.is_none() && !is_replay) {
            Some(function) => {
                let message = format!("{}() needs more than one reading", function.as_str());
                Err(ErrorMessage::usage(message).hint("measure for some time: --for 10s").into())
            }
            None => self.validate_figures(is_replay),
        }
    }

    /// Checks the names of figures, and that a measuring time is given.
    fn validate_figures(&self, is_replay: bool) -> anyhow::Result<()> {
        let known = health::names();
        for expression in &self.expressions {
            let figures = expression.figures();
            let Some(first) = figures.first() else { continue };
            let error = |message: String, hint: &str| ErrorMessage::usage(message).hint(hint.to_owned());
            if let Some(unknown) = figures.iter().find(|name| !known.contains(*name)) {
                return Err(
                    error(format!("no figure \"{unknown}\""), "list the figures: cangauge health -f csv").into()
                );
            }
            if figures.len() < expression.wanted().len() {
                let message = format!("\"{}\" compares {first} with a measured value", expression.text());
                return Err(error(message, "check them in two expressions").into());
            }
            if self.duration.is_none() && !is_replay {
                let message = format!("{first} needs some time");
                return Err(error(message, "measure for some time: --for 10s").into());
            }
        }
        Ok(())
    }

    /// Measures the figures of the bus and of the nodes, and then the signals.
    fn measure(&self, global: &Global, waited: StdDuration) -> anyhow::Result<CheckReport> {
        let (figures, signals): (Vec<Expression>, Vec<Expression>) =
            self.expressions.iter().cloned().partition(|expression| !expression.figures().is_empty());
        if figures.is_empty() {
            return self.measure_signals(&signals, global, waited);
        }
        let measured = global.with_master(|master| {
            let (nodes, reads) = (nodes_to_check(&self.nodes, master, global)?, master.bus().is_live());
            let (duration, bit_rate) = (self.duration.map(|duration| duration.0.saturating_sub(waited)), None);
            let overrides = descriptions::overrides(global, &nodes)?;
            Ok(check_figures(master, &figures, &HealthOptions { nodes, reads, duration, bit_rate, overrides })?)
        })?;
        if signals.is_empty() {
            return Ok(measured);
        }
        let mut report = self.measure_signals(&signals, global, waited)?;
        report.verdicts.extend(measured.verdicts);
        Ok(report)
    }

    /// Measures the signals. `waited` (the wait for the reader of a FIFO) is subtracted from the duration.
    fn measure_signals(
        &self,
        expressions: &[Expression],
        global: &Global,
        waited: StdDuration,
    ) -> anyhow::Result<CheckReport> {
        let duration = self.duration.map(|duration| duration.0.saturating_sub(waited));
        let (shows_progress, color) = (duration.is_some() && global.shows_progress(), global.console().color);
        let progress = CheckProgress::new(shows_progress, color, duration.unwrap_or_default());
        let console = Console { progress: Some(progress.multi()), ..global.console() };
        global.with_claims(|master, claims| {
            // A replayed recording is receive-only, and is checked from its start to its end.
            let live = master.bus().is_live();
            let nodes = nodes_to_check(&self.nodes, master, global)?;
            let mode = if live { self.mode() } else { Mode::Passive };
            let options = CheckOptions {
                overrides: descriptions::overrides_on(master, global, &nodes)?,
                nodes,
                skip_unsupported: self.nodes == Nodes::All,
                expressions: expressions.to_vec(),
                recording: (duration.is_some() || !live).then_some((mode, duration)),
            };
            // Without --poll, the nodes are locked only until the recording starts.
            let claims = self.poll.is_none().then(|| std::mem::take(claims));
            let mut view = View { progress, console, started: None, claims };
            let report = check(master, &options, &mut view);
            let interrupted = report.as_ref().is_err_and(|failure| failure.kind() == Kind::Interrupted);
            view.progress.finish(interrupted);
            Ok(report?)
        })
    }

    fn mode(&self) -> Mode {
        match (self.sync, self.poll) {
            (Some(period), _) => Mode::Sync(period.0),
            (None, Some(period)) => Mode::Poll(period.0),
            (None, None) => Mode::AsSent,
        }
    }
}

/// Returns the nodes to check. In a replayed recording, `all` means every node-ID.
fn nodes_to_check(nodes: &Nodes, master: &mut Master<'_>, global: &Global) -> anyhow::Result<Vec<NodeId>> {
    match nodes {
        Nodes::All if !master.bus().is_live() => Ok(NodeId::all().collect()),
        nodes => open::nodes(master, global, nodes),
    }
}

/// Shows the progress of a check on stderr.
struct View {
    progress: CheckProgress,
    console: Console,
    started: Option<Stamp>,
    /// Keeps other cangauge processes away from the nodes until the recording starts.
    claims: Option<Claims>,
}

impl Observer for View {
    fn samples(&mut self, _samples: &[Sample], _sources: &[Source]) -> ControlFlow<()> {
        self.claims = None;
        ControlFlow::Continue(())
    }

    fn event(&mut self, event: &LogEvent, _at: Stamp) {
        print_event(&self.console, &event_text(event));
    }

    fn evaluated(&mut self, evaluator: &Evaluator, at: Stamp) {
        let started = self.started.get_or_insert(at).mono;
        if !self.progress.is_hidden() {
            self.progress.show(&evaluator.live_results(), at.mono.since(started));
        }
    }

    fn tick(&mut self, _at: Stamp, _rows: u64) -> ControlFlow<()> {
        self.claims = None;
        ControlFlow::Continue(())
    }
}
