//! Compares the samples of one node with one expression.

use super::bind::{Aggregate, BoundExpression, ShownQuantity};
use super::formula::{Formula, Rule, Values};
use super::series::{SeriesId, SharedSignals};
use super::tree::Function;
use super::verdict::{LiveResult, MissingData, Outcome, QuantityValue, Reason, Verdict, Violation};
use crate::bus::{Mono, Stamp};
use crate::measure::sample::Status;
use crate::measure::statistics::Statistics;
use std::time::Duration;

/// The number and times of the samples of a signal.
#[derive(Clone, Copy, Debug, Default)]
struct Arrivals {
    count: u32,
    first: Mono,
    last: Mono,
}

impl Arrivals {
    fn add(&mut self, now: Mono) {
        if self.count == 0 {
            self.first = now;
        }
        self.count = self.count.saturating_add(1);
        self.last = now;
    }

    /// Whether the signal stopped: no sample for five usual intervals, and for at least one second.
    fn has_stopped(&self, end: Mono) -> bool {
        let intervals = self.count.saturating_sub(1).max(1);
        let usual = self.last.since(self.first) / intervals;
        end.since(self.last) > (usual * 5).max(Duration::from_secs(1))
    }
}

/// The inputs of one formula. The formula is evaluated when all inputs have a new value.
#[derive(Clone, Debug)]
struct InputGroup {
    inputs: Vec<usize>,
    /// Which inputs have a new value since the last evaluation.
    fresh: Vec<bool>,
}

impl InputGroup {
    fn new(inputs: Vec<usize>) -> InputGroup {
        let fresh = vec![false; inputs.len()];
        InputGroup { inputs, fresh }
    }

    fn is_fresh(&self, input: usize) -> bool {
        self.inputs.iter().zip(&self.fresh).any(|(&own, &fresh)| own == input && fresh)
    }

    fn set_fresh(&mut self, input: usize) {
        for (own, fresh) in self.inputs.iter().zip(&mut self.fresh) {
            *fresh |= *own == input;
        }
    }

    fn is_complete(&self) -> bool {
        !self.fresh.is_empty() && self.fresh.iter().all(|&fresh| fresh)
    }

    fn is_pending(&self) -> bool {
        self.fresh.iter().any(|&fresh| fresh)
    }
}

/// What the value of an input group is used for.
#[derive(Clone, Copy, Debug)]
enum Purpose {
    /// A rule for each sample.
    Rule(usize),
    /// A function of all samples.
    Aggregate(usize),
    /// A value that the verdict shows.
    Show(usize),
}

/// The statistics of a formula.
#[derive(Clone, Debug)]
enum Figures {
    /// The formula has one input, so other expressions can use the same statistics.
    Shared(SeriesId),
    Own(Box<Statistics>),
}

impl Figures {
    /// Creates the statistics of a formula. `places` contains the place of each input in `signals`.
    fn new(formula: &Formula, places: &[usize], signals: &mut SharedSignals) -> Figures {
        let mut inputs = Vec::new();
        formula.inputs(&mut inputs);
        match inputs[..] {
            [input] => Figures::Shared(signals.series(places[input], formula)),
            _ => Figures::Own(Box::default()),
        }
    }

    fn get<'a>(&'a self, signals: &'a SharedSignals) -> &'a Statistics {
        match self {
            Figures::Shared(id) => signals.statistics(*id),
            Figures::Own(statistics) => statistics,
        }
    }

    /// Adds a value, unless [`SharedSignals::add`] does so.
    fn add(&mut self, value: Option<f64>, at: Duration) {
        if let Figures::Own(statistics) = self {
            statistics.add(value, at);
        }
    }
}

/// The time when a sample was received, the time since the first sample, and the status from the device.
pub(super) type SampleContext = (Stamp, Duration, Option<Status>);

/// One expression and its state during a measurement.
#[derive(Clone, Debug)]
pub(super) struct Comparison {
    bound: BoundExpression,
    /// The latest value of each input.
    values: Vec<Option<f64>>,
    arrivals: Vec<Arrivals>,
    digits: Vec<Option<u8>>,
    groups: Vec<(InputGroup, Purpose)>,
    /// For each rule: the number of evaluated samples, and the number of those without a valid value.
    evaluated: Vec<(u64, u64)>,
    aggregates: Vec<Figures>,
    shown: Vec<Figures>,
    /// The place of each input in the shared signals.
    places: Vec<usize>,
    violations: u64,
    first: Option<Violation>,
    last: Option<SampleContext>,
}

impl Comparison {
    pub(super) fn new(mut bound: BoundExpression, signals: &mut SharedSignals) -> Comparison {
        bound.sample_rules.iter_mut().for_each(Rule::fold);
        let places: Vec<usize> = bound.inputs.iter().map(|input| signals.signal(input)).collect();
        let mut figures = |formula: &Formula| Figures::new(formula, &places, signals);
        let shown: Vec<Figures> = bound.shown.iter().map(|shown| figures(&shown.formula)).collect();
        let aggregates: Vec<Figures> = bound.aggregates.iter().map(|it| figures(&it.argument)).collect();
        let group = |add_inputs: &dyn Fn(&mut Vec<usize>), purpose| {
            let mut inputs = Vec::new();
            add_inputs(&mut inputs);
            (InputGroup::new(inputs), purpose)
        };
        let mut groups = Vec::new();
        // Shown values are evaluated first, because a violation contains the values of its own sample.
        let own = |(_, figures): &(usize, &Figures)| matches!(figures, Figures::Own(_));
        for (at, _) in shown.iter().enumerate().filter(own) {
            let shown = &bound.shown[at];
            groups.push(group(&|inputs| shown.formula.inputs(inputs), Purpose::Show(at)));
        }
        for (at, rule) in bound.sample_rules.iter().enumerate() {
            groups.push(group(&|inputs| rule.inputs(inputs), Purpose::Rule(at)));
        }
        for (at, aggregate) in bound.aggregates.iter().enumerate() {
            groups.push(group(&|inputs| aggregate.argument.inputs(inputs), Purpose::Aggregate(at)));
        }
        // A formula without inputs is never evaluated for a sample.
        groups.retain(|(group, _)| !group.inputs.is_empty());
        Comparison {
            values: vec![None; bound.inputs.len()],
            arrivals: vec![Arrivals::default(); bound.inputs.len()],
            digits: vec![None; bound.inputs.len()],
            groups,
            evaluated: vec![(0, 0); bound.sample_rules.len()],
            aggregates,
            shown,
            places,
            violations: 0,
            first: None,
            last: None,
            bound,
        }
    }

    pub(super) fn bound(&self) -> &BoundExpression {
        &self.bound
    }

    /// The place of each input in the shared signals.
    pub(super) fn places(&self) -> &[usize] {
        &self.places
    }

    /// Adds a value of an input.
    pub(super) fn add(&mut self, input: usize, value: Option<f64>, digits: Option<u8>, context: SampleContext) {
        if let ([only], [arrivals]) = (&mut self.values[..], &mut self.arrivals[..]) {
            // With one input, no value waits for another input.
            *only = value;
            arrivals.add(context.0.mono);
            self.digits[input] = digits.or(self.digits[input]);
            self.last = Some(context);
            for at in 0..self.groups.len() {
                self.evaluate(self.groups[at].1, context);
            }
            return;
        }
        // If another input has no new value yet, the old value is evaluated before it is replaced.
        self.evaluate_groups(|group| group.is_fresh(input), self.last.unwrap_or(context));
        self.values[input] = value;
        self.arrivals[input].add(context.0.mono);
        self.digits[input] = digits.or(self.digits[input]);
        self.groups.iter_mut().for_each(|(group, _)| group.set_fresh(input));
        self.last = Some(context);
        self.evaluate_groups(InputGroup::is_complete, context);
    }

    /// Evaluates values that still wait for another signal.
    pub(super) fn finish(&mut self) {
        if let Some(last) = self.last {
            self.evaluate_groups(InputGroup::is_pending, last);
        }
    }

    fn evaluate_groups(&mut self, is_due: impl Fn(&InputGroup) -> bool, context: SampleContext) {
        for at in 0..self.groups.len() {
            let (group, purpose) = &mut self.groups[at];
            if is_due(group) && group.inputs.iter().all(|&input| self.arrivals[input].count > 0) {
                group.fresh.fill(false);
                let purpose = *purpose;
                self.evaluate(purpose, context);
            }
        }
    }

    fn evaluate(&mut self, purpose: Purpose, context: SampleContext) {
        let values = Values { inputs: &self.values, aggregates: &[] };
        let at = context.0.mono.since_start();
        match purpose {
            Purpose::Show(shown) => {
                let value = self.bound.shown[shown].formula.value(values);
                self.shown[shown].add(value, at);
            }
            Purpose::Aggregate(aggregate) => {
                let Aggregate { function, argument, .. } = &self.bound.aggregates[aggregate];
                let (function, value) = (*function, argument.value(values));
                self.aggregates[aggregate].add(value, at);
                if value.is_none() && function != Function::Invalid {
                    self.add_violation(context);
                }
            }
            Purpose::Rule(rule) => {
                let is_satisfied = self.bound.sample_rules[rule].is_satisfied(values);
                let (evaluated, invalid) = &mut self.evaluated[rule];
                *evaluated += 1;
                match is_satisfied {
                    Some(true) => return,
                    Some(false) => self.violations += 1,
                    None => *invalid += 1,
                }
                self.add_violation(context);
            }
        }
    }

    /// Keeps the first violation.
    fn add_violation(&mut self, (at, elapsed, status): SampleContext) {
        if self.first.is_none() {
            let values = Values { inputs: &self.values, aggregates: &[] };
            let values = self.bound.shown.iter().map(|shown| shown.formula.value(values)).collect();
            self.first = Some(Violation { at, elapsed, values, status });
        }
    }

    /// Returns the present value of each function.
    fn aggregate_values(&self, signals: &SharedSignals) -> Vec<Option<f64>> {
        let value_of = |(aggregate, figures): (&Aggregate, &Figures)| value(aggregate.function, figures.get(signals));
        self.bound.aggregates.iter().zip(&self.aggregates).map(value_of).collect()
    }

    fn count(&self, signals: &SharedSignals) -> u64 {
        let aggregates = self.aggregates.iter().map(|figures| figures.get(signals).count());
        self.evaluated.iter().map(|&(evaluated, _)| evaluated).chain(aggregates).max().unwrap_or(0)
    }

    /// Returns the number of samples without a valid value. Samples inside `invalid()` do not count.
    fn invalid(&self, signals: &SharedSignals) -> u64 {
        let is_counted = |aggregate: &Aggregate| aggregate.function != Function::Invalid;
        let aggregates =
            self.bound.aggregates.iter().zip(&self.aggregates).filter(|(aggregate, _)| is_counted(aggregate));
        let aggregates = aggregates.map(|(_, figures)| figures.get(signals).invalid());
        self.evaluated.iter().map(|&(_, invalid)| invalid).chain(aggregates).max().unwrap_or(0)
    }

    /// Returns the verdict. `end` is the end of the recording: a signal that stopped earlier has no verdict.
    pub(super) fn verdict(&self, signals: &SharedSignals, end: Option<Mono>, missing: &[MissingData]) -> Verdict {
        let aggregates = self.aggregate_values(signals);
        let (outcome, reason) = self.outcome((&aggregates, signals), end, missing);
        Verdict {
            text: self.bound.text.clone(),
            node: self.bound.node,
            outcome,
            values: self.quantities((&aggregates, signals), false),
            count: self.count(signals),
            violations: self.violations,
            invalid: self.invalid(signals),
            first: self.first.clone(),
            reason,
        }
    }

    fn outcome(
        &self,
        (aggregates, signals): (&[Option<f64>], &SharedSignals),
        end: Option<Mono>,
        missing: &[MissingData],
    ) -> (Outcome, Option<Reason>) {
        if self.violations > 0 || self.invalid(signals) > 0 {
            return (Outcome::Fail, None);
        }
        let is_needed = |missing: &&MissingData| {
            let mut inputs = self.bound.inputs.iter().filter(|input| input.node == missing.node);
            inputs.any(|input| missing.signal.as_ref().is_none_or(|signal| *signal == input.name))
        };
        if let Some(missing) = missing.iter().find(is_needed) {
            return (Outcome::NoData, Some(missing.reason.clone()));
        }
        for (input, arrivals) in self.bound.inputs.iter().zip(&self.arrivals) {
            let (node, signal) = (input.node, input.name.clone());
            if arrivals.count == 0 {
                return (Outcome::NoData, Some(Reason::NotReceived { node, signal }));
            }
            if end.is_some_and(|end| arrivals.has_stopped(end)) {
                return (Outcome::NoData, Some(Reason::Stopped { node, signal }));
            }
        }
        let values = Values { inputs: &self.values, aggregates };
        let results: Vec<Option<bool>> = self.bound.final_rules.iter().map(|rule| rule.is_satisfied(values)).collect();
        if results.contains(&Some(false)) {
            return (Outcome::Fail, None);
        }
        if results.contains(&None) && !aggregates.contains(&None) {
            return (Outcome::Fail, Some(Reason::NotANumber));
        }
        if results.contains(&None) {
            return (Outcome::NoData, Some(Reason::TooFewSamples));
        }
        (Outcome::Ok, None)
    }

    pub(super) fn live_result(&self, signals: &SharedSignals) -> LiveResult {
        let aggregates = self.aggregate_values(signals);
        let is_satisfied = match self.outcome((&aggregates, signals), None, &[]).0 {
            Outcome::Ok => Some(true),
            Outcome::Fail => Some(false),
            Outcome::NoData => None,
        };
        let values = self.quantities((&aggregates, signals), true);
        LiveResult { text: self.bound.text.clone(), node: self.bound.node, is_satisfied, values }
    }

    /// Returns the quantities with their latest values, or with mean and range if `latest` is false.
    fn quantities(&self, (aggregates, signals): (&[Option<f64>], &SharedSignals), latest: bool) -> Vec<QuantityValue> {
        let quantity = |(shown, figures): (&ShownQuantity, &Figures)| {
            let statistics = figures.get(signals);
            let values = Values { inputs: &self.values, aggregates };
            let has_several = statistics.count() > 1 && !latest;
            QuantityValue {
                name: shown.name.clone(),
                unit: shown.unit,
                digits: self.digits_of(&shown.formula),
                is_exact: self.is_exact(&shown.formula),
                value: if has_several { statistics.mean() } else { shown.formula.value(values) },
                range: statistics.min().zip(statistics.max()).filter(|_| has_several),
            }
        };
        self.bound.shown.iter().zip(&self.shown).map(quantity).collect()
    }

    /// The part of a formula that determines its digits: `min`, `max` and `| |` keep the digits of their argument.
    fn digits_source<'a>(&'a self, formula: &'a Formula) -> Option<&'a Formula> {
        match formula {
            Formula::Aggregate(at) => {
                let aggregate = self.bound.aggregates.get(*at)?;
                matches!(aggregate.function, Function::Min | Function::Max).then_some(&aggregate.argument)
            }
            Formula::Absolute(inner) => Some(inner),
            other => Some(other),
        }
    }

    fn digits_of(&self, formula: &Formula) -> Option<u8> {
        match self.digits_source(formula)? {
            Formula::Input(input) => self.digits.get(*input).copied().flatten(),
            _ => None,
        }
    }

    fn is_exact(&self, formula: &Formula) -> bool {
        let is_count = |at: &usize| {
            let aggregate = self.bound.aggregates.get(*at);
            aggregate.is_some_and(|aggregate| matches!(aggregate.function, Function::Count | Function::Invalid))
        };
        match formula {
            Formula::Aggregate(at) if is_count(at) => true,
            other => matches!(self.digits_source(other), Some(Formula::Input(_))),
        }
    }
}

/// Returns the present value of a function.
fn value(function: Function, statistics: &Statistics) -> Option<f64> {
    match function {
        Function::Mean => statistics.mean(),
        Function::Noise => statistics.deviation(),
        Function::Min => statistics.min(),
        Function::Max => statistics.max(),
        Function::Rate => statistics.rate(),
        Function::Gap => (statistics.count() > 1).then(|| statistics.longest_interval().as_secs_f64()),
        Function::Count => Some(statistics.count() as f64),
        Function::Invalid => Some(statistics.invalid() as f64),
    }
}
