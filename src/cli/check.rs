//! `cangauge check`.

use super::args::{BusSpec, Duration, Nodes};
use super::exit::stdout;
use super::file::OutFile;
use super::recording::{print_event, refuse_to_send, sync_interval};
use super::{Format, Global, open};
use crate::bus::Stamp;
use crate::bus::claim::{Claim, Claims};
use crate::canopen::id::NodeId;
use crate::measure::expression::Expression;
use crate::measure::expression::judge::Jury;
use crate::measure::expression::verdict::Verdict;
use crate::measure::sample::{Sample, Source};
use crate::output::console::Console;
use crate::output::events::{remark_text, words};
use crate::output::limits::Limits;
use crate::output::{junit, verdict};
use crate::tasks::check::{Plan, Report, all_met, check};
use crate::tasks::log::{Mode, Note, Observer};
use crate::tasks::{Failure, Kind};
use clap::Args;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Check measurements against limits: exit code 0 if all hold, 1 if not, 3 without data
///
/// Without --for one reading by SDO is judged; with it every sample of a recording, as log records it, and of
/// replay:FILE all of them. An invalid sample satisfies nothing.
#[derive(Debug, Args)]
#[command(after_help = "\
Expressions, one word each for the shell, and all have to hold:
  'pressure in 9.95..10.05 bar'      every sample; both ends belong to the range
  'temperature < 60'                 a number without a unit is in the device's current unit
  '|5.pressure - 6.pressure| < 0.1'  several nodes; without a node: each of NODES for itself
  'noise(pressure) < 0.01'           all samples together: mean, min, max, noise (standard
                                     deviation), rate (1/s), gap (longest interval, s), count,
                                     and invalid, which allows for invalid ones
  < <= > >= == != in, + - * /, | |, ( ), and, or, not; pressure.status, 0x6130:1

Calculated values count as equal within 1e-9 of the larger one.

Examples:
  cangauge -b sim check 1 'pressure > 0.5 bar'
  cangauge -b sim check 1,127 'pressure < 1000 psi' 'noise(pressure) < 1' --for 1s --poll 50ms
  cangauge check 5 'pressure in 9.95..10.05 bar' --for 10s --sync 10ms --junit report.xml")]
pub(crate) struct Check {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// What has to hold, see below
    #[arg(required = true, value_name = "EXPR")]
    expressions: Vec<Expression>,
    /// Judge all samples that come in this time
    #[arg(long = "for", value_name = "DUR")]
    duration: Option<Duration>,
    /// Send SYNC at this interval
    #[arg(long, value_name = "DUR", requires = "duration", conflicts_with = "poll", value_parser = sync_interval)]
    sync: Option<Duration>,
    /// Read by SDO at this interval
    #[arg(long, value_name = "DUR", requires = "duration")]
    poll: Option<Duration>,
    /// Write the verdicts as JUnit XML, for CI servers: one test case per expression
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Overwrite a file that exists
    #[arg(long)]
    force: bool,
}

impl Check {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        refuse_to_send(global, self.sync.or(self.poll))?;
        self.refuse_at_once(global)?;
        let file = self.junit.as_deref().map(|path| OutFile::create(path, self.force)).transpose()?;
        let report = match self.measure(global) {
            // A server that finds no file knows nothing of the checks that were to be.
            Err(error) if file.is_some() => {
                let failure = error.downcast_ref::<Failure>().filter(|failure| failure.kind != Kind::Usage);
                if let (Some(failure), Some(file)) = (failure, file) {
                    self.write_junit(file, &self.undone(failure))?;
                }
                return Err(error);
            }
            result => result?,
        };
        let console = global.console();
        report.remarks.iter().for_each(|remark| console.note(&remark_text(remark)));
        if let Some(file) = file {
            self.write_junit(file, &report)?;
        }
        print(&report.verdicts, global.format).map_err(stdout)?;
        Ok(all_met(&report.verdicts, &report.failures)?)
    }

    /// What can be known to be wrong before the bus is opened.
    fn refuse_at_once(&self, global: &Global) -> Result<(), Failure> {
        if let Nodes::These(nodes) = &self.nodes {
            self.expressions.iter().try_for_each(|expression| expression.names_only(nodes))?;
        }
        let function = self.expressions.iter().find_map(Expression::needs_many);
        let is_recorded = matches!(global.bus, Some(BusSpec::Replay(_)));
        match function.filter(|_| self.duration.is_none() && !is_recorded) {
            Some(function) => {
                let message = format!("{}() of one reading says nothing", function.as_str());
                Err(Failure::new(Kind::Usage, message).hint("measure for a while: --for 10s"))
            }
            None => Ok(()),
        }
    }

    fn measure(&self, global: &Global) -> anyhow::Result<Report> {
        let duration = self.duration.map(|duration| duration.0);
        let limits = Limits::new(duration.is_some() && global.shows_progress(), duration.unwrap_or_default());
        let console = Console { progress: Some(limits.multi()), ..global.console() };
        global.with_claims(|master, claims| {
            // A recording (`replay:`) can only be listened to, and is judged from its beginning to its end.
            let live = master.bus().is_live();
            let nodes = match &self.nodes {
                Nodes::All if !live => NodeId::all().collect(),
                nodes => open::nodes(master, global, nodes)?,
            };
            let mode = if live { self.mode() } else { Mode::Passive };
            let plan = Plan {
                overrides: open::overrides(global, &nodes)?,
                nodes,
                excuse: self.nodes == Nodes::All,
                expressions: self.expressions.clone(),
                measuring: (duration.is_some() || !live).then_some((mode, duration)),
            };
            // Whoever only listens from then on leaves the nodes to others.
            let claims = self.poll.is_none().then(|| std::mem::take(claims));
            let mut screen = Screen { limits, console, begun: None, claims };
            let report = check(master, &plan, &mut screen);
            let interrupted = report.as_ref().is_err_and(|failure| failure.kind == Kind::Interrupted);
            screen.limits.finish(interrupted);
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

    /// Checks that were not made.
    fn undone(&self, failure: &Failure) -> Report {
        let verdict = |expression: &Expression| Verdict::nothing(expression.text(), None, &failure.message);
        Report {
            verdicts: self.expressions.iter().map(verdict).collect(),
            begun: None,
            length: std::time::Duration::ZERO,
            failures: Vec::new(),
            remarks: Vec::new(),
        }
    }

    fn write_junit(&self, mut file: OutFile, report: &Report) -> anyhow::Result<()> {
        file.write(junit::document(report).as_bytes())
    }
}

fn print(verdicts: &[Verdict], format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match format {
        Format::Text => verdict::lines(&mut out, verdicts)?,
        Format::Json => verdict::json(&mut out, verdicts)?,
        Format::Csv => verdict::csv(&mut out, verdicts)?,
    }
    out.flush()
}

/// What is shown while it is measured.
struct Screen {
    limits: Limits,
    console: Console,
    begun: Option<Stamp>,
    /// What is kept from others until it has begun.
    claims: Option<Claims>,
}

impl Observer for Screen {
    fn samples(&mut self, _samples: &[Sample], _sources: &[Source]) -> ControlFlow<()> {
        self.claims = None;
        ControlFlow::Continue(())
    }

    fn note(&mut self, note: &Note, _at: Stamp) {
        print_event(&self.console, &words(note));
    }

    fn standing(&mut self, jury: &Jury, at: Stamp) {
        let begun = self.begun.get_or_insert(at).mono;
        if !self.limits.is_hidden() {
            self.limits.show(&jury.standing(), at.mono.since(begun));
        }
    }

    fn tick(&mut self, _at: Stamp, _rows: u64) -> ControlFlow<()> {
        self.claims = None;
        ControlFlow::Continue(())
    }
}
