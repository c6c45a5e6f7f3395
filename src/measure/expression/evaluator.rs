//! Evaluates expressions: samples in, verdicts out.
//!
//! - Each sample must satisfy the expression. A sample without a valid value fails every expression except `invalid()`.
//!   A value outside the measuring range is invalid, even if the device still sends a number.
//! - A comparison of several signals is evaluated when all of them have a new value. If a signal has a second value
//!   before that, its first value is compared with the latest other values. So no sample is skipped.

use super::bind::{AvailableSignals, BoundExpression, LimitWithoutUnit, unit_of};
use super::comparison::Comparison;
use super::series::SharedSignals;
use super::verdict::{LiveResult, MissingData, Reason, Verdict};
use super::{Expression, ExpressionError};
use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use crate::measure::sample::{Doubt, Number, Sample, Source, Status};

/// Connects a source of samples to a signal of expressions.
#[derive(Clone, Debug)]
struct Route {
    signal: usize,
    unit: UnitChange,
    /// The comparisons with this signal, each with the number of the input.
    inputs: Vec<(usize, usize)>,
}

/// Whether a source still has the unit that its input expects.
#[derive(Clone, Copy, Debug, PartialEq)]
enum UnitChange {
    Unchanged,
    /// The unit changed. The first unit can be converted to the second.
    Convertible(Unit, Unit),
    /// The new unit cannot be converted: the values are invalid.
    Incompatible,
}

/// Evaluates expressions with samples.
#[derive(Clone, Debug)]
pub struct Evaluator {
    expressions: Vec<Expression>,
    comparisons: Vec<Comparison>,
    signals: SharedSignals,
    /// Verdicts of expressions that cannot be measured.
    without_data: Vec<Verdict>,
    /// The routes of each source, in the order of the sources.
    routes: Vec<Vec<Route>>,
    first: Option<Mono>,
}

impl Evaluator {
    /// Creates an evaluator without signals. A repeated expression has one verdict.
    pub fn new(all: &[Expression]) -> Evaluator {
        let mut expressions: Vec<Expression> = Vec::new();
        for expression in all {
            if !expressions.contains(expression) {
                expressions.push(expression.clone());
            }
        }
        let signals = SharedSignals::default();
        let (comparisons, without_data, routes) = (Vec::new(), Vec::new(), Vec::new());
        Evaluator { expressions, comparisons, signals, without_data, routes, first: None }
    }

    /// Finds the signals of the expressions. An expression without a node is evaluated for each of `nodes`.
    ///
    /// With `skip_unsupported`, a node without the signal is skipped if another node has it. An expression that needs a
    /// node in `missing` has a verdict without data.
    ///
    /// # Errors
    /// A signal that does not exist, or units that cannot be compared.
    pub fn bind(
        &mut self,
        nodes: &[NodeId],
        available: &AvailableSignals<'_>,
        skip_unsupported: bool,
        missing: &[MissingData],
    ) -> Result<(), ExpressionError> {
        for expression in &self.expressions {
            expression.check_nodes(nodes)?;
            let reason =
                |node: NodeId| missing.iter().find(|missing| missing.node == node).map(|missing| &missing.reason);
            let for_each = expression.applies_to_each_node();
            let reason_of_named = expression.signals().into_iter().find_map(|signal| reason(signal.node?));
            let has_signals = |node: &NodeId| available.has_all(*node, expression);
            let may_skip = skip_unsupported && nodes.iter().any(has_signals);
            for node in nodes.iter().take(if for_each { nodes.len() } else { 1 }) {
                let own_reason = reason(*node).filter(|_| for_each);
                if let Some(reason) = reason_of_named.or(own_reason) {
                    let node = Some(*node).filter(|_| for_each);
                    self.without_data.push(Verdict::no_data(expression.text(), node, reason.clone()));
                } else if !for_each || !may_skip || has_signals(node) {
                    let bound = expression.bind(Some(*node), available)?;
                    self.comparisons.push(Comparison::new(bound, &mut self.signals));
                }
            }
        }
        Ok(())
    }

    /// Finds signals among the sources received until now. Nodes that are already bound do not change.
    ///
    /// # Errors
    /// Units that cannot be compared.
    pub fn bind_recorded(&mut self, sources: &[Source]) -> Result<(), ExpressionError> {
        let available = AvailableSignals::from_sources(sources);
        for expression in &self.expressions {
            for node in available.nodes() {
                let node_of_comparison = expression.applies_to_each_node().then_some(node);
                let is_bound = |comparison: &Comparison| {
                    let bound = comparison.bound();
                    bound.text == expression.text() && bound.node == node_of_comparison
                };
                if available.has_all(node, expression) && !self.comparisons.iter().any(is_bound) {
                    let bound = expression.bind(node_of_comparison, &available)?;
                    self.comparisons.push(Comparison::new(bound, &mut self.signals));
                    self.routes.clear();
                }
            }
        }
        Ok(())
    }

    /// Adds a verdict without data for each silent node in `nodes`.
    pub fn add_missing_nodes(&mut self, nodes: &[NodeId]) {
        for expression in self.expressions.iter().filter(|expression| expression.applies_to_each_node()) {
            for &node in nodes {
                let is_bound = |bound: &BoundExpression| bound.text == expression.text() && bound.node == Some(node);
                if !self.comparisons.iter().map(Comparison::bound).any(is_bound) {
                    let reason = Reason::NodeNotReceived(node);
                    self.without_data.push(Verdict::no_data(expression.text(), Some(node), reason));
                }
            }
        }
    }

    /// The expressions, without repetitions.
    pub fn expressions(&self) -> &[Expression] {
        &self.expressions
    }

    /// All bound expressions.
    pub fn bound(&self) -> impl Iterator<Item = &BoundExpression> {
        self.comparisons.iter().map(Comparison::bound)
    }

    /// The limits without a unit, without repetitions.
    pub fn limits_without_unit(&self) -> Vec<LimitWithoutUnit> {
        let mut limits = Vec::new();
        for limit in self.bound().flat_map(|bound| &bound.limits_without_unit) {
            if !limits.contains(limit) {
                limits.push(limit.clone());
            }
        }
        limits
    }

    /// Returns the signals of a node to measure, without repetitions.
    pub fn wanted_of(&self, node: NodeId) -> Vec<Wanted> {
        let mut wanted = Vec::new();
        for input in self.bound().flat_map(|bound| &bound.inputs).filter(|input| input.node == node) {
            if !wanted.contains(&input.what) {
                wanted.push(input.what.clone());
            }
        }
        wanted
    }

    /// Adds samples in the order in which they were received.
    pub fn add(&mut self, samples: &[Sample], sources: &[Source]) {
        for source in sources.iter().skip(self.routes.len()) {
            self.routes.push(routes(&self.comparisons, &self.signals, source));
        }
        for sample in samples {
            let first = *self.first.get_or_insert(sample.at.mono);
            let elapsed = sample.at.mono.since(first);
            let Some(routes) = self.routes.get(sample.source).filter(|routes| !routes.is_empty()) else { continue };
            // Without its decimal digits, a number may be wrong by a power of ten.
            let is_scaled = sample.doubt != Some(Doubt::UnknownDigits);
            let is_valid = is_scaled && !sample.status.is_some_and(Status::is_overload);
            let value = sample.value.filter(|_| is_valid).map(printed_value);
            for route in routes {
                let value = value.and_then(|value| match route.unit {
                    UnitChange::Unchanged => Some(value),
                    UnitChange::Convertible(from, to) => from.convert(value, to),
                    UnitChange::Incompatible => None,
                });
                let digits = match (sample.value, route.unit) {
                    (Some(Number::Decimal { digits, .. }), UnitChange::Unchanged) => Some(digits),
                    _ => None,
                };
                self.signals.add(route.signal, value, sample.at.mono.since_start());
                for &(comparison, input) in &route.inputs {
                    self.comparisons[comparison].add(input, value, digits, (sample.at, elapsed, sample.status));
                }
            }
        }
    }

    /// The present state of all expressions.
    pub fn live_results(&self) -> Vec<LiveResult> {
        self.comparisons.iter().map(|comparison| comparison.live_result(&self.signals)).collect()
    }

    /// Returns the verdicts, sorted by expression and node.
    ///
    /// `missing` lists nodes and signals that failed. `end` is the end of a recording: a signal that stopped earlier
    /// has no verdict.
    pub fn verdicts(mut self, end: Option<Mono>, missing: &[MissingData]) -> Vec<Verdict> {
        self.comparisons.iter_mut().for_each(Comparison::finish);
        let mut verdicts = Vec::new();
        for expression in &self.expressions {
            let text = expression.text();
            let compared = self.comparisons.iter().filter(|comparison| comparison.bound().text == text);
            let without_data = self.without_data.iter().filter(|verdict| verdict.text == text).cloned();
            let compared = compared.map(|comparison| comparison.verdict(&self.signals, end, missing));
            let mut of_expression: Vec<Verdict> = compared.chain(without_data).collect();
            if of_expression.is_empty() {
                of_expression.push(Verdict::no_data(text, None, Reason::NothingReceived));
            }
            of_expression.sort_by_key(|verdict| verdict.node);
            verdicts.extend(of_expression);
        }
        verdicts
    }
}

/// Returns the value as printed. For example, a REAL32 value printed as 9.95 is compared as 9.95.
fn printed_value(number: Number) -> f64 {
    match number {
        Number::Real32(_) => number.to_string().parse().unwrap_or_else(|_| number.as_f64()),
        Number::Decimal { .. } | Number::Real64(_) => number.as_f64(),
    }
}

/// Finds the signals of expressions that a source delivers, and the inputs with these signals.
fn routes(comparisons: &[Comparison], signals: &SharedSignals, source: &Source) -> Vec<Route> {
    let own = signals.all().filter(|(_, known)| known.node == source.node && *known.name == *source.signal);
    own.map(|(signal, known)| {
        let unit = match (unit_of(source), known.unit) {
            // If the unit was unknown when the expression was bound, the value is not converted.
            (_, None) => UnitChange::Unchanged,
            (now, then) if now == then => UnitChange::Unchanged,
            (Some(now), Some(then)) if now.convert(0.0, then).is_some() => UnitChange::Convertible(now, then),
            _ => UnitChange::Incompatible,
        };
        let inputs = comparisons.iter().enumerate().flat_map(|(comparison, it)| {
            let places = it.places().iter().enumerate().filter(move |(_, place)| **place == signal);
            places.map(move |(input, _)| (comparison, input))
        });
        Route { signal, unit, inputs: inputs.collect() }
    })
    .collect()
}
