//! Checks measurements against expressions: one reading by SDO, or all samples of a recording.

mod failure;
mod figures;

pub use failure::CheckFailure;
pub use figures::check_figures;

use crate::bus::Stamp;
use crate::canopen::id::NodeId;
use crate::canopen::value::DataType;
use crate::master::{Error, Master};
use crate::measure::decode::Wanted;
use crate::measure::expression::Expression;
use crate::measure::expression::bind::{AvailableSignals, LimitWithoutUnit};
use crate::measure::expression::evaluator::Evaluator;
use crate::measure::expression::verdict::{MissingData, Outcome, Reason, Verdict};
use crate::measure::sample::{Doubt, Sample, Source};
use crate::node::read::Reader;
use crate::node::survey::survey_each;
use crate::node::{Node, Overrides};
use crate::tasks::Failure;
use crate::tasks::log::{self, LogEvent, Mode, Observer, RecordingReport, Remark, log};
use crate::tasks::read::{ReadFailure, Target, objects, sample, targets};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Duration;

/// The expressions to check, and how to measure.
#[derive(Clone, Debug)]
pub struct CheckOptions {
    /// The nodes.
    pub nodes: Vec<NodeId>,
    /// Whether a node without the signal is skipped if another node has it.
    pub skip_unsupported: bool,
    /// The expressions, which must all be satisfied.
    pub expressions: Vec<Expression>,
    /// The mode and duration of a recording; `None` for one reading by SDO. Without a duration, a replayed recording is
    /// read to its end.
    pub recording: Option<(Mode, Option<Duration>)>,
    /// Descriptions given by the user.
    pub overrides: Overrides,
}

/// The result of a check.
#[derive(Clone, Debug)]
pub struct CheckReport {
    /// The verdicts, sorted by expression and node.
    pub verdicts: Vec<Verdict>,
    /// When the first value was received.
    pub started: Option<Stamp>,
    /// The time from the first to the last value.
    pub length: Duration,
    /// The failures that caused missing values. [`Reason::Failed`] is an index into this list.
    pub failures: Vec<Failure>,
    /// Further observations.
    pub remarks: Vec<Remark>,
}

impl CheckReport {
    /// Creates the report of a check that stopped before the first measurement.
    pub fn not_measured(expressions: &[Expression], failure: Failure) -> CheckReport {
        let verdict = |expression: &Expression| Verdict::no_data(expression.text(), None, Reason::Failed(0));
        CheckReport {
            verdicts: expressions.iter().map(verdict).collect(),
            started: None,
            length: Duration::ZERO,
            failures: vec![failure],
            remarks: Vec::new(),
        }
    }

    /// Whether a node satisfies its expressions, and other nodes have no data.
    pub fn is_partial(&self) -> bool {
        let of = |outcome| self.verdicts.iter().filter(move |verdict| verdict.outcome == outcome);
        let lacks_data = |node| {
            of(Outcome::NoData).any(|verdict| verdict.node == Some(node))
                || self.failures.iter().any(|failure| failure.node == Some(node))
        };
        of(Outcome::Ok).any(|verdict| verdict.node.is_some_and(|node| !lacks_data(node)))
    }

    /// Returns the number of verdicts with this outcome.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.verdicts.iter().filter(|verdict| verdict.outcome == outcome).count()
    }
}

/// Checks that all verdicts are good.
///
/// # Errors
/// `check-failed` if an expression is not satisfied. If data is missing: the kind of failure, if it is the same for all
/// missing data, else `no-answer`.
pub fn all_satisfied(verdicts: &[Verdict], failures: &[Failure]) -> Result<(), Failure> {
    let failed: Vec<Verdict> = verdicts.iter().filter(|verdict| verdict.outcome == Outcome::Fail).cloned().collect();
    let without = verdicts.iter().filter(|verdict| verdict.outcome == Outcome::NoData).count();
    let all = verdicts.len();
    if !failed.is_empty() {
        return Err(Failure::general(CheckFailure::NotSatisfied { failed, all }));
    }
    if without == 0 {
        return Ok(());
    }
    Err(match failures {
        [first, others @ ..] if others.iter().all(|other| other.kind() == first.kind()) => first.clone(),
        _ => Failure::general(CheckFailure::NoData { without, all }),
    })
}

/// Measures the signals, and evaluates the expressions.
///
/// # Errors
/// Expressions that do not fit the devices (before anything is measured), and failures of the bus.
pub fn check(
    master: &mut Master<'_>,
    options: &CheckOptions,
    observer: &mut dyn Observer,
) -> Result<CheckReport, Failure> {
    options.expressions.iter().try_for_each(|expression| expression.check_nodes(&options.nodes))?;
    match options.recording {
        Some((mode, duration)) => check_recording(master, options, mode, duration, observer),
        None => check_reading(master, options, observer),
    }
}

/// Reads each signal once by SDO.
fn check_reading(
    master: &mut Master<'_>,
    options: &CheckOptions,
    observer: &mut dyn Observer,
) -> Result<CheckReport, Failure> {
    master.listen_to(&options.nodes)?;
    let (mut known, mut failures, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    for (&node, result) in options.nodes.iter().zip(survey_each(master, &options.nodes, &options.overrides)?) {
        match result {
            Ok(node) => known.push(node),
            Err(failure) => {
                missing.push(MissingData { node, signal: None, reason: Reason::Failed(failures.len()) });
                failures.push(failure.into());
            }
        }
    }
    let mut evaluator = Evaluator::new(&options.expressions);
    let available = available(&known, &options.expressions);
    evaluator.bind(&options.nodes, &available, options.skip_unsupported, &missing)?;
    let all = wanted_targets(&known, &evaluator)?;
    let at = master.bus().now();
    evaluator.limits_without_unit().into_iter().for_each(|limit| observer.event(&limit_without_unit(limit), at));
    let sources: Vec<Source> = all.iter().map(|target| target.source.clone()).collect();
    let asked: Vec<_> = all.iter().flat_map(objects).collect();
    let mut answers = Reader::new(master).read(&asked)?.into_iter();
    let mut samples: Vec<Sample> = Vec::new();
    let mut remarks = Vec::new();
    for target in &all {
        let value = answers.next();
        let status = target.second_object().and_then(|_| answers.next());
        match value.map(|value| sample(target, value, status)) {
            Some(Ok(sample)) => {
                let name = target.source.signal.to_string();
                remarks.extend(sample.doubt.map(|doubt| Remark::Doubt(target.source.node, name, doubt)));
                samples.push(sample);
            }
            Some(Err(error)) => {
                let (node, signal) = (target.source.node, Some(target.source.signal.to_string()));
                missing.push(MissingData { node, signal, reason: Reason::Failed(failures.len()) });
                failures.push(error.into());
            }
            None => {}
        }
    }
    evaluator.add(&samples, &sources);
    let verdicts = evaluator.verdicts(None, &missing);
    let started = samples.first().map(|sample| sample.at);
    let length = started.zip(samples.last()).map_or(Duration::ZERO, |(first, last)| last.at.mono.since(first.mono));
    Ok(CheckReport { verdicts, started, length, failures, remarks })
}

fn limit_without_unit(limit: LimitWithoutUnit) -> LogEvent {
    LogEvent::Remark(Remark::LimitWithoutUnit(limit))
}

/// Returns all signals of these nodes, and the objects named in the expressions.
fn available<'a>(nodes: &'a [Node], expressions: &[Expression]) -> AvailableSignals<'a> {
    let mut available = AvailableSignals::from_layouts(nodes.iter().map(Node::layout));
    for node in nodes {
        for item in expressions.iter().flat_map(Expression::wanted) {
            if let (Wanted::Signal(name), Wanted::Named(known, _)) = (&item, node.wanted(&item)) {
                available.name_object(node.id, name, &known);
            }
        }
    }
    available
}

/// Returns the objects to read from all nodes.
fn wanted_targets(nodes: &[Node], evaluator: &Evaluator) -> Result<Vec<Target>, Failure> {
    let (mut all, mut number) = (Vec::new(), 0);
    for node in nodes {
        let wanted = evaluator.wanted_of(node.id);
        // An empty list would select all signals.
        if !wanted.is_empty() {
            let own = targets(node, &wanted, &mut number)?;
            refuse_unknown_types(&own)?;
            all.extend(own);
        }
    }
    Ok(all)
}

/// Rejects objects whose data type is unknown or not numeric, because an expression compares numbers.
fn refuse_unknown_types(targets: &[Target]) -> Result<(), Failure> {
    let without_number = |target: &&Target| !target.reading.data_type().is_some_and(DataType::is_number);
    match targets.iter().find(without_number) {
        Some(target) if target.reading.data_type().is_some() => {
            let signal = target.source.signal.to_string();
            Err(Failure::at(target.source.node, ReadFailure::NotNumber { signal }))
        }
        Some(target) => Err(unknown_type(&target.source)),
        None => Ok(()),
    }
}

fn unknown_type(source: &Source) -> Failure {
    Failure::at(source.node, CheckFailure::UnknownType { signal: source.signal.to_string() })
}

/// Records samples as `log` does, and evaluates each of them.
fn check_recording(
    master: &mut Master<'_>,
    options: &CheckOptions,
    mode: Mode,
    duration: Option<Duration>,
    observer: &mut dyn Observer,
) -> Result<CheckReport, Failure> {
    let mut wanted = Vec::new();
    for item in options.expressions.iter().flat_map(Expression::wanted) {
        if !wanted.contains(&item) {
            wanted.push(item);
        }
    }
    let recording = log::LogOptions {
        nodes: options.nodes.clone(),
        wanted,
        mode,
        duration,
        count: None,
        nmt: true,
        start_all: false,
        max_gap: None,
        overrides: options.overrides.clone(),
    };
    let mut checker = Checker::new(&options.expressions, &options.nodes, options.skip_unsupported, observer);
    let outcome = log(master, &recording, &mut checker)?;
    if outcome.interrupted {
        return Err(Error::Interrupted.into());
    }
    let started = checker.started;
    let verdicts = checker.verdicts(&outcome)?;
    let failures = failures(&outcome).cloned().collect();
    Ok(CheckReport { verdicts, started, length: outcome.length, failures, remarks: outcome.remarks })
}

/// Returns the failures of a recording. Verdicts refer to them by their index.
fn failures(report: &RecordingReport) -> impl Iterator<Item = &Failure> {
    let nodes = report.two_devices.iter().chain(&report.replaced);
    report.failed.iter().chain(&report.nothing).chain(nodes)
}

/// An observer of a recording that evaluates expressions, and passes all calls on to another observer.
pub struct Checker<'a> {
    evaluator: Evaluator,
    nodes: Vec<NodeId>,
    skip_unsupported: bool,
    /// The nodes whose setup could not be read, in the order of [`RecordingReport::failed`].
    failed: Vec<NodeId>,
    /// Whether the devices were known before the recording.
    is_bound: bool,
    /// The sources with at least one sample, if the devices were not known before. The units of other sources may still
    /// be unknown.
    received: BTreeSet<usize>,
    started: Option<Stamp>,
    /// The reported limits without a unit.
    limits_without_unit: Vec<LimitWithoutUnit>,
    failure: Option<Failure>,
    observer: &'a mut dyn Observer,
}

impl<'a> Checker<'a> {
    /// Creates a checker. With `skip_unsupported`, a node without the signal is skipped if another node has the signal.
    pub fn new(
        expressions: &[Expression],
        nodes: &[NodeId],
        skip_unsupported: bool,
        observer: &'a mut dyn Observer,
    ) -> Checker<'a> {
        Checker {
            evaluator: Evaluator::new(expressions),
            nodes: nodes.to_vec(),
            skip_unsupported,
            failed: Vec::new(),
            is_bound: false,
            received: BTreeSet::new(),
            started: None,
            limits_without_unit: Vec::new(),
            failure: None,
            observer,
        }
    }

    fn evaluate(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        if self.evaluator.expressions().is_empty() {
            return ControlFlow::Continue(());
        }
        let before = self.received.len();
        if !self.is_bound {
            self.received.extend(samples.iter().map(|sample| sample.source));
        }
        if self.received.len() > before {
            let received = self.received.iter().filter_map(|&source| sources.get(source));
            let received: Vec<Source> = received.cloned().collect();
            if let Err(error) = self.evaluator.bind_recorded(&received) {
                self.failure = Some(error.into());
                return ControlFlow::Break(());
            }
        }
        let has_no_type = |sample: &&Sample| sample.doubt == Some(Doubt::UnknownType);
        for source in samples.iter().filter(has_no_type).filter_map(|sample| sources.get(sample.source)) {
            if self.evaluator.wanted_of(source.node).iter().any(|wanted| wanted.name() == *source.signal) {
                self.failure = Some(unknown_type(source));
                return ControlFlow::Break(());
            }
        }
        if let Some(first) = samples.first().filter(|_| self.started.is_none() || self.received.len() > before) {
            self.report_limits_without_unit(first.at);
        }
        self.started = self.started.or(samples.first().map(|sample| sample.at));
        self.evaluator.add(samples, sources);
        ControlFlow::Continue(())
    }

    fn report_limits_without_unit(&mut self, at: Stamp) {
        for limit in self.evaluator.limits_without_unit() {
            if !self.limits_without_unit.contains(&limit) {
                self.limits_without_unit.push(limit.clone());
                self.observer.event(&limit_without_unit(limit), at);
            }
        }
    }

    /// Returns the nodes whose setup could not be read. The reason is the index of the failure in
    /// [`RecordingReport::failed`].
    fn missing_nodes(&self) -> Vec<MissingData> {
        let missing = |(at, &node)| MissingData { node, signal: None, reason: Reason::Failed(at) };
        self.failed.iter().enumerate().map(missing).collect()
    }

    /// Returns the verdicts at the end of a recording.
    ///
    /// # Errors
    /// An expression that does not fit the devices, if they became known during the recording.
    pub fn verdicts(mut self, report: &RecordingReport) -> Result<Vec<Verdict>, Failure> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let mut all_missing = Vec::new();
        let missing = |&node: &NodeId| {
            let reason = match report.nothing {
                Some(_) => Reason::Failed(report.failed.len()),
                None => Reason::NodeStopped(node),
            };
            MissingData { node, signal: None, reason }
        };
        all_missing.extend(report.lost.iter().map(missing));
        let of_node = |(at, failure): (usize, &Failure)| {
            Some(MissingData { node: failure.node?, signal: None, reason: Reason::Failed(at) })
        };
        all_missing.extend(failures(report).enumerate().filter_map(of_node));
        if !self.is_bound && !self.skip_unsupported {
            self.evaluator.add_missing_nodes(&self.nodes);
        }
        let end = self.started.map(|started| started.mono + report.length);
        Ok(self.evaluator.verdicts(end, &all_missing))
    }
}

impl Observer for Checker<'_> {
    fn failed(&mut self, failures: &[Failure]) {
        self.failed = failures.iter().filter_map(|failure| failure.node).collect();
        self.observer.failed(failures);
    }

    fn begin(&mut self, nodes: &[Node]) -> Result<(), Failure> {
        let available = available(nodes, self.evaluator.expressions());
        self.evaluator.bind(&self.nodes, &available, self.skip_unsupported, &self.missing_nodes())?;
        self.is_bound = true;
        wanted_targets(nodes, &self.evaluator)?;
        self.observer.begin(nodes)
    }

    fn sources(&mut self, sources: &[Source]) -> Result<(), Failure> {
        self.observer.sources(sources)
    }

    fn cycle(&mut self, number: u64, at: Stamp) -> ControlFlow<()> {
        self.observer.cycle(number, at)
    }

    fn polled(&mut self, cycle: u64, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.evaluate(samples, sources)?;
        self.observer.polled(cycle, samples, sources)
    }

    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.evaluate(samples, sources)?;
        self.observer.samples(samples, sources)
    }

    fn event(&mut self, event: &LogEvent, at: Stamp) {
        self.observer.event(event, at);
    }

    fn tick(&mut self, at: Stamp, rows: u64) -> ControlFlow<()> {
        self.observer.evaluated(&self.evaluator, at);
        self.observer.tick(at, rows)
    }
}
