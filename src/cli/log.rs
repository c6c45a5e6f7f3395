//! `cangauge log`.

mod files;
mod finish;
mod recorder;
mod run_file;

use super::args::{Duration, Nodes, SignalArg};
use super::recording::{poll_interval, print_verdicts, refuse_to_send, request_interval, sync_interval};
use super::{Global, When, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::bus::time::ahead_of_utc;
use cangauge::canopen::id::NodeId;
use cangauge::master::Master;
use cangauge::measure::decode::Wanted;
use cangauge::measure::expression::Expression;
use cangauge::output::console::Console;
use cangauge::output::plot::{Plot, TimeAxis};
use cangauge::output::progress::Progress;
use cangauge::output::recording::{Recording, TimeBase};
use cangauge::output::rows::FileFormat;
use cangauge::output::stderr_size;
use cangauge::output::summary::SummaryForm;
use cangauge::tasks::check::Checker;
use cangauge::tasks::log::{LogOptions, Mode, log};
use cangauge::tasks::{Failure, Kind};
use clap::Args;
use files::{Files, OpenFiles};
use finish::{Ended, Finished, wait_for_writers};
use recorder::Recorder;
use std::io::{self, IsTerminal};

/// Record measurements as CSV, JSON Lines or InfluxDB line protocol
///
/// Without --sync, --poll and --request, log records the TPDOs as the nodes send them. It starts sensors that are not
/// known to be operational, unless another NMT master is seen. At the end it restores their previous NMT states, if
/// known.
#[derive(Debug, Args)]
#[command(after_help = "\
Columns:
  time                  UTC
  elapsed_s             seconds since the first row
  node, signal, value, unit
  status                ok, invalid, overload-high, overload-low or clipped;
                        empty if the device reports no status
  raw                   the bytes of the value in wire order

Columns of --layout wide:
  time, elapsed_s
  5.pressure [bar], 5.pressure.status, and so on for each signal
Each cycle is a row with the time of its first value. Cells without data are
empty. If a mapping or a unit changes, a new file is started.

Slow output:
Up to 12 MiB of rows can wait for the output. Further rows are lost and counted,
and the exit code is 8.

Early end:
If the recording ends before --count or --duration is reached, the exit code is
130 (Ctrl-C) or 8 (output closed).

Examples:
  cangauge -b sim log 1 --sync 100ms --count 20
  cangauge -b sim log 127 --duration 5s -o dps.csv
  cangauge -b sim log 1-3,127 pressure --poll 200ms --duration 5s --format json
  cangauge -b sim log 1,127 --sync 10ms --layout wide --duration 5s -o wide.csv
  cangauge -b sim log 127 --duration 5s --tag bench=3 --tag part=P107 -o p107.csv
  cangauge -b sim log 127 --duration 5s --format influx
  cangauge log 5 --request 100ms --count 20
  cangauge log 1 --sync 10ms -o run.csv --rotate 1h --events events.csv
  cangauge log 5 --passive --device mh4 -o run.csv --append")]
pub(crate) struct Log {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Signals [default: all]: pressure, temperature, ch1 to ch16, pressure.status, or an object: 0x6130:1
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
    #[arg(long, value_name = "DUR", conflicts_with = "passive", value_parser = poll_interval)]
    poll: Option<Duration>,
    /// Request TPDOs by remote frames (RTR) at this interval. The values may be old; prefer --poll
    #[arg(long, value_name = "DUR", conflicts_with_all = ["sync", "poll", "passive"], value_parser = request_interval)]
    request: Option<Duration>,
    /// Send nothing
    #[arg(long)]
    pub(super) passive: bool,
    /// Start all nodes, also drives and I/O modules, and even if another NMT master is seen [default: start only
    /// sensors]
    #[arg(long, conflicts_with_all = ["no_nmt", "passive", "poll"])]
    start: bool,
    /// Do not change the NMT state of the nodes. This is the default if another NMT master is seen
    #[arg(long)]
    no_nmt: bool,
    /// Report longer intervals as gaps [default: 3 times the usual interval]
    #[arg(long, value_name = "DUR")]
    max_gap: Option<Duration>,
    /// Exit with 1 at the end if this expression is not satisfied: 'pressure in 9..11 bar' (see check --help)
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    expect: Vec<Expression>,
    /// Plot the values at the end, on stderr (see cangauge plot)
    #[arg(long)]
    plot: bool,
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
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        if self.passive { Claim::Nothing } else { self.nodes.claim() }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let interval = self.sync.or(self.poll).or(self.request);
        refuse_to_send(global, interval)?;
        self.check_expectations()?;
        let format = FileFormat::from(global.format);
        self.files.check(format, interval.is_some())?;
        let mut files = self.files.open(format, self.count, self.duration.map(|duration| duration.0))?;
        let finished = self.record(global, &mut files)?;
        print_verdicts(&global.console(), &finished.verdicts);
        finished.write_summary(self.files.summary.is_some(), &mut files)?;
        finished.result(&files)
    }

    /// Checks that every signal for `--expect` is recorded.
    fn check_expectations(&self) -> Result<(), Failure> {
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

    fn record(&self, global: &Global, files: &mut OpenFiles) -> anyhow::Result<Finished> {
        // Rows and live lines cannot share a terminal.
        let is_shared = global.progress == When::Auto && files.rows.is_none() && io::stdout().is_terminal();
        let progress = Progress::new(global.shows_progress() && !is_shared, global.console().color);
        let console = Console { progress: Some(progress.multi()), ..global.console() };
        let (report, verdicts, mut recorder) = global.with_claims(|master, claims| {
            let is_live = master.bus().is_live();
            let nodes = match (&self.nodes, self.passive || !is_live) {
                (Nodes::All, true) => NodeId::all().collect(),
                _ => open::nodes(master, global, &self.nodes)?,
            };
            let mut options = self.options(master, global, nodes, is_live)?;
            options.duration = options.duration.map(|duration| duration.saturating_sub(files.waited));
            let waits = master.bus().waits();
            let run = files.start_run(&open::spec(global)?, master.bus().now().wall);
            let mut recorder =
                Recorder::new(files.rows(waits)?, files.rows_name(), files.events(waits)?, progress, console);
            recorder.run = run;
            (recorder.counts.duration, recorder.counts.count) = (self.duration.map(|duration| duration.0), self.count);
            recorder.plot = self.plot.then(|| Recording::new(TimeBase::Clock));
            // Without --poll, the nodes are free for other processes as soon as the recording runs.
            recorder.claims = self.poll.is_none().then(|| std::mem::take(claims));
            let mut checker = Checker::new(&self.expect, &options.nodes, true, &mut recorder);
            let report = log(master, &options, &mut checker);
            let verdicts = match &report {
                Ok(report) => checker.verdicts(report),
                Err(_) => Ok(Vec::new()),
            };
            let interrupted = match &report {
                Ok(report) => report.interrupted,
                Err(failure) => failure.kind() == Kind::Interrupted,
            };
            recorder.progress.finish(interrupted);
            Ok((report, verdicts, recorder))
        })?;
        let interrupted = report.as_ref().is_ok_and(|report| report.interrupted);
        let is_limited = self.count.is_some() || self.duration.is_some();
        let plot = recorder.plot.take();
        let Ended { written, unwritten, deleted } = wait_for_writers(recorder, interrupted);
        let is_closed = match unwritten {
            Some(unwritten) if is_limited && unwritten.is_closed_output() => true,
            Some(unwritten) => return Err(unwritten.into_error(&global.console(), files, written.lost)),
            None => false,
        };
        let report = report?;
        if let Some(failure) = report.nothing {
            return Err(failure.into());
        }
        let mut finished = Finished { report, verdicts: Vec::new(), written, deleted, is_limited, is_closed };
        let console = global.console();
        let form = SummaryForm { verbose: global.verbose > 0, width: stderr_size().map(|(width, _)| width) };
        finished.summary().lines(form).iter().for_each(|line| console.note(line));
        files.written().iter().for_each(|files| console.note(&format!("written to {files}")));
        let title = self.files.output.as_ref().map(|file| file.display().to_string()).unwrap_or_default();
        let axis = TimeAxis::Clock(ahead_of_utc);
        let plot = plot.and_then(|recording| Plot::new(recording, title, axis, [None; 2]));
        plot.iter().for_each(|plot| console.plot(plot));
        finished.verdicts = verdicts?;
        Ok(finished)
    }

    fn options(
        &self,
        master: &mut Master<'_>,
        global: &Global,
        nodes: Vec<NodeId>,
        is_live: bool,
    ) -> anyhow::Result<LogOptions> {
        Ok(LogOptions {
            overrides: descriptions::overrides_on(master, global, &nodes)?,
            nodes,
            wanted: self.signals.iter().map(|signal| signal.0.clone()).collect(),
            mode: self.mode(is_live),
            duration: self.duration.map(|duration| duration.0),
            // In layout wide, --count counts cycles and not values.
            count: self.count.filter(|_| !self.files.is_wide()),
            nmt: !self.no_nmt,
            start_all: self.start,
            max_gap: self.max_gap.map(|longest| longest.0),
        })
    }

    /// A replayed recording is always passive.
    fn mode(&self, is_live: bool) -> Mode {
        match (self.sync, self.poll, self.request) {
            (Some(interval), ..) => Mode::Sync(interval.0),
            (_, Some(interval), _) => Mode::Poll(interval.0),
            (.., Some(interval)) => Mode::Request(interval.0),
            _ if self.passive || !is_live => Mode::Passive,
            _ => Mode::AsSent,
        }
    }
}
