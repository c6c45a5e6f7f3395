//! Judges measurements by what is expected of them: one reading, or all of a recording.

use crate::bus::Stamp;
use crate::canopen::id::NodeId;
use crate::master::{Error, Master};
use crate::measure::expression::Expression;
use crate::measure::expression::bind::Offers;
use crate::measure::expression::judge::Jury;
use crate::measure::expression::verdict::{Ruling, Silence, Verdict};
use crate::measure::sample::{Sample, Source};
use crate::node::Node;
use crate::node::Overrides;
use crate::tasks::log::{self, Mode, Note, Observer, RecordingReport, Remark, log};
use crate::tasks::read::{Target, requests, sample, surveyed, targets};
use crate::tasks::{Failure, Kind};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Duration;

/// What is expected, and how it is measured.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Of which nodes.
    pub nodes: Vec<NodeId>,
    /// Whether a node that lacks a signal is left out where another one has it.
    pub excuse: bool,
    /// What is expected.
    pub expressions: Vec<Expression>,
    /// How the values come, and for how long if not to the end of what is played; `None` for one reading by SDO.
    pub measuring: Option<(Mode, Option<Duration>)>,
    /// Descriptions named by the user.
    pub overrides: Overrides,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Report {
    /// In the order of the expressions and their nodes.
    pub verdicts: Vec<Verdict>,
    /// When the first value came.
    pub begun: Option<Stamp>,
    /// From the first value to the last.
    pub length: Duration,
    /// Why values did not come.
    pub failures: Vec<Failure>,
    /// What else there is to say.
    pub remarks: Vec<Remark>,
}

impl Report {
    /// How many of the expressions came to this.
    pub fn count(&self, ruling: Ruling) -> usize {
        self.verdicts.iter().filter(|verdict| verdict.ruling == ruling).count()
    }
}

/// Why not everything that was expected is so; nothing if it is.
///
/// # Errors
/// That something failed, else that there was nothing to judge by, with the reason in `failures`.
pub fn all_met(verdicts: &[Verdict], failures: &[Failure]) -> Result<(), Failure> {
    let count = |ruling| verdicts.iter().filter(|verdict| verdict.ruling == ruling).count();
    let (failed, without, all) = (count(Ruling::Fail), count(Ruling::NoData), verdicts.len());
    let word = if all == 1 { "check" } else { "checks" };
    if failed > 0 {
        return Err(Failure::new(Kind::CheckFailed, format!("{failed} of {all} {word} failed")));
    }
    if without == 0 {
        return Ok(());
    }
    Err(match failures {
        [first, others @ ..] if others.iter().all(|other| other.kind == first.kind) => first.clone(),
        _ => Failure::new(Kind::NoAnswer, format!("no data for {without} of {all} {word}")),
    })
}

/// Measures and judges.
///
/// # Errors
/// Expressions that do not fit the devices, before anything is measured; what stops the measuring.
pub fn check(master: &mut Master<'_>, plan: &Plan, observer: &mut dyn Observer) -> Result<Report, Failure> {
    plan.expressions.iter().try_for_each(|expression| expression.names_only(&plan.nodes))?;
    match plan.measuring {
        Some((mode, duration)) => record(master, plan, mode, duration, observer),
        None => read_once(master, plan),
    }
}

fn read_once(master: &mut Master<'_>, plan: &Plan) -> Result<Report, Failure> {
    master.listen_to(&plan.nodes)?;
    let (mut instruments, mut failures, mut silent) = (Vec::new(), Vec::new(), Vec::new());
    for (node, instrument) in plan.nodes.iter().zip(surveyed(master, &plan.nodes, &plan.overrides)?) {
        match instrument {
            Ok(instrument) => instruments.push(instrument),
            Err(failure) => {
                silent.push(Silence { node: *node, signal: None, reason: failure.message.clone() });
                failures.push(failure);
            }
        }
    }
    let mut jury = Jury::new(&plan.expressions);
    jury.bind(&plan.nodes, &Offers::of_instruments(instruments.iter().map(Node::layout)), plan.excuse, &silent)?;
    let all = wanted_targets(&instruments, &jury)?;
    let sources: Vec<Source> = all.iter().map(|target| target.source.clone()).collect();
    let mut answers = master.transfer(all.iter().flat_map(requests).collect(), &mut |_| {})?.into_iter();
    let mut samples: Vec<Sample> = Vec::new();
    for target in &all {
        let value = answers.next();
        let status = target.status.and_then(|_| answers.next());
        match value.map(|value| sample(target, value, status)) {
            Some(Ok(sample)) => samples.push(sample),
            Some(Err(error)) => {
                let (node, signal) = (target.source.node, Some(target.source.signal.to_string()));
                silent.push(Silence { node, signal, reason: error.to_string() });
                failures.push(error.into());
            }
            None => {}
        }
    }
    jury.take(&samples, &sources);
    let verdicts = jury.verdicts(None, &silent);
    let begun = samples.first().map(|sample| sample.at);
    let length = begun.zip(samples.last()).map_or(Duration::ZERO, |(first, last)| last.at.mono.since(first.mono));
    Ok(Report { verdicts, begun, length, failures, remarks: Vec::new() })
}

/// What is read of every instrument, numbered through.
fn wanted_targets(instruments: &[Node], jury: &Jury) -> Result<Vec<Target>, Failure> {
    let (mut all, mut number) = (Vec::new(), 0);
    for instrument in instruments {
        let wanted = jury.wanted_of(instrument.id);
        // Nothing wanted would be everything.
        if !wanted.is_empty() {
            all.extend(targets(instrument, &wanted, &mut number)?);
        }
    }
    Ok(all)
}

fn record(
    master: &mut Master<'_>,
    plan: &Plan,
    mode: Mode,
    duration: Option<Duration>,
    observer: &mut dyn Observer,
) -> Result<Report, Failure> {
    let mut wanted = Vec::new();
    for item in plan.expressions.iter().flat_map(Expression::wanted) {
        if !wanted.contains(&item) {
            wanted.push(item);
        }
    }
    let recording = log::Plan {
        nodes: plan.nodes.clone(),
        wanted,
        mode,
        duration,
        count: None,
        nmt: true,
        max_gap: None,
        overrides: plan.overrides.clone(),
    };
    let mut expecting = Expecting::new(&plan.expressions, &plan.nodes, plan.excuse, observer);
    let outcome = log(master, &recording, &mut expecting)?;
    if outcome.interrupted {
        return Err(Error::Interrupted.into());
    }
    let begun = expecting.begun;
    let verdicts = expecting.verdicts(&outcome)?;
    let failures = outcome.nothing.into_iter().collect();
    Ok(Report { verdicts, begun, length: outcome.length, failures, remarks: outcome.remarks })
}

/// Judges what an observer is told of a recording.
pub struct Expecting<'a> {
    jury: Jury,
    nodes: Vec<NodeId>,
    excuse: bool,
    /// Whether the devices were known before they were recorded.
    is_bound: bool,
    /// The sources that something has come of, where the devices were not known: what is known of another one
    /// may yet be learned.
    came: BTreeSet<usize>,
    begun: Option<Stamp>,
    failure: Option<Failure>,
    observer: &'a mut dyn Observer,
}

impl<'a> Expecting<'a> {
    /// Passes everything on to `observer` and judges it by `expressions`. With `excuse`, a node that lacks a
    /// signal is left out where another one has it.
    pub fn new(
        expressions: &[Expression],
        nodes: &[NodeId],
        excuse: bool,
        observer: &'a mut dyn Observer,
    ) -> Expecting<'a> {
        Expecting {
            jury: Jury::new(expressions),
            nodes: nodes.to_vec(),
            excuse,
            is_bound: false,
            came: BTreeSet::new(),
            begun: None,
            failure: None,
            observer,
        }
    }

    fn judge(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        let before = self.came.len();
        if !self.is_bound {
            self.came.extend(samples.iter().map(|sample| sample.source));
        }
        if self.came.len() > before {
            let came: Vec<Source> = self.came.iter().filter_map(|&source| sources.get(source)).cloned().collect();
            if let Err(error) = self.jury.bind_recorded(&came) {
                self.failure = Some(error.into());
                return ControlFlow::Break(());
            }
        }
        self.begun = self.begun.or(samples.first().map(|sample| sample.at));
        self.jury.take(samples, sources);
        ControlFlow::Continue(())
    }

    /// The verdicts at the end of a recording.
    ///
    /// # Errors
    /// An expression that turned out not to fit the devices.
    pub fn verdicts(mut self, outcome: &RecordingReport) -> Result<Vec<Verdict>, Failure> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let silence = |node: &NodeId| {
            let lost = || format!("node {node} was silent at the end");
            let reason = outcome.nothing.as_ref().map_or_else(lost, |failure| failure.message.clone());
            Silence { node: *node, signal: None, reason }
        };
        let silent: Vec<Silence> = outcome.lost.iter().map(silence).collect();
        if !self.is_bound && !self.excuse {
            self.jury.settle_missing(&self.nodes);
        }
        let end = self.begun.map(|begun| begun.mono + outcome.length);
        Ok(self.jury.verdicts(end, &silent))
    }
}

impl Observer for Expecting<'_> {
    fn begin(&mut self, instruments: &[Node]) -> Result<(), Failure> {
        self.jury.bind(&self.nodes, &Offers::of_instruments(instruments.iter().map(Node::layout)), self.excuse, &[])?;
        self.is_bound = true;
        self.observer.begin(instruments)
    }

    fn sources(&mut self, sources: &[Source]) -> Result<(), Failure> {
        self.observer.sources(sources)
    }

    fn cycle(&mut self, number: u64, at: Stamp) -> ControlFlow<()> {
        self.observer.cycle(number, at)
    }

    fn polled(&mut self, cycle: u64, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.judge(samples, sources)?;
        self.observer.polled(cycle, samples, sources)
    }

    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.judge(samples, sources)?;
        self.observer.samples(samples, sources)
    }

    fn note(&mut self, note: &Note, at: Stamp) {
        self.observer.note(note, at);
    }

    fn tick(&mut self, at: Stamp, rows: u64) -> ControlFlow<()> {
        self.observer.standing(&self.jury, at);
        self.observer.tick(at, rows)
    }
}
