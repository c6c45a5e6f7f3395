//! Samples in, verdicts out.
//!
//! Every sample has to satisfy what stands for every sample, and one without a valid value satisfies nothing
//! but what is asked about `invalid()`. Where several signals stand in one comparison, it is judged when each
//! of them has come anew; one that comes twice before is judged with the newest of the others, so that no
//! sample goes unjudged.

use super::bind::{Bound, Offers, unit_of};
use super::case::Case;
use super::verdict::{Silence, Standing, Verdict};
use super::{Expression, ExpressionError};
use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use crate::measure::sample::{Number, Sample, Source};

/// How a sample of a source comes into a slot of a case.
#[derive(Clone, Copy, Debug)]
struct Way {
    case: usize,
    slot: usize,
    unit: SlotUnit,
}

/// Whether a source still has the unit that its slot was bound with.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SlotUnit {
    Same,
    /// It has another one of the same quantity by now.
    Changed(Unit, Unit),
    /// What it has by now does not convert: its values say nothing.
    Lost,
}

/// Judges samples by expressions.
#[derive(Clone, Debug)]
pub struct Jury {
    expressions: Vec<Expression>,
    cases: Vec<Case>,
    /// The verdicts of those that nothing can be measured for.
    settled: Vec<Verdict>,
    ways: Vec<Vec<Way>>,
    first: Option<Mono>,
}

impl Jury {
    /// A jury that knows no signals yet. Who says the same twice gets one verdict.
    pub fn new(all: &[Expression]) -> Jury {
        let mut expressions: Vec<Expression> = Vec::new();
        for expression in all {
            if !expressions.contains(expression) {
                expressions.push(expression.clone());
            }
        }
        Jury { expressions, cases: Vec::new(), settled: Vec::new(), ways: Vec::new(), first: None }
    }

    /// Finds the signals among what is offered: an expression that names no node is judged for each of
    /// `nodes`. With `excuse`, a node that lacks a signal is left out where another one has it. What needs a
    /// node that is silent is settled already.
    ///
    /// # Errors
    /// Signals that there are not, and units that do not go together.
    pub fn bind(
        &mut self,
        nodes: &[NodeId],
        offers: &Offers,
        excuse: bool,
        silent: &[Silence],
    ) -> Result<(), ExpressionError> {
        for expression in &self.expressions {
            expression.names_only(nodes)?;
            let reason =
                |node: NodeId| silent.iter().find(|silence| silence.node == node).map(|silence| &silence.reason);
            let of_every_node = expression.is_of_every_node();
            let named = expression.signals().into_iter().find_map(|signal| reason(signal.node?));
            let having = |node: &NodeId| offers.has_all(*node, expression);
            let excused = excuse && nodes.iter().any(having);
            for node in nodes.iter().take(if of_every_node { nodes.len() } else { 1 }) {
                let own = reason(*node).filter(|_| of_every_node);
                if let Some(reason) = named.or(own) {
                    let node = Some(*node).filter(|_| of_every_node);
                    self.settled.push(Verdict::nothing(expression.text(), node, reason));
                } else if !of_every_node || !excused || having(node) {
                    self.cases.push(Case::new(expression.bind(Some(*node), offers)?));
                }
            }
        }
        Ok(())
    }

    /// Finds the signals among those that have come by now, of the nodes that were not bound before.
    ///
    /// # Errors
    /// Units that do not go together.
    pub fn bind_recorded(&mut self, sources: &[Source]) -> Result<(), ExpressionError> {
        let offers = Offers::of_sources(sources);
        for expression in &self.expressions {
            for node in offers.nodes() {
                let node_of_case = expression.is_of_every_node().then_some(node);
                let is_bound =
                    |case: &Case| case.bound().text == expression.text() && case.bound().node == node_of_case;
                if offers.has_all(node, expression) && !self.cases.iter().any(is_bound) {
                    self.cases.push(Case::new(expression.bind(node_of_case, &offers)?));
                    self.ways.clear();
                }
            }
        }
        Ok(())
    }

    /// Settles what was to be judged for each of `nodes` and could not be for one of them: it gave nothing.
    pub fn settle_missing(&mut self, nodes: &[NodeId]) {
        for expression in self.expressions.iter().filter(|expression| expression.is_of_every_node()) {
            for &node in nodes {
                let is_bound = |bound: &Bound| bound.text == expression.text() && bound.node == Some(node);
                if !self.cases.iter().map(Case::bound).any(is_bound) {
                    let reason = format!("node {node} gave nothing of it");
                    self.settled.push(Verdict::nothing(expression.text(), Some(node), reason));
                }
            }
        }
    }

    /// Every case, bound.
    pub fn bound(&self) -> impl Iterator<Item = &Bound> {
        self.cases.iter().map(Case::bound)
    }

    /// What has to be measured of `node`, each once.
    pub fn wanted_of(&self, node: NodeId) -> Vec<Wanted> {
        let mut wanted = Vec::new();
        for slot in self.bound().flat_map(|bound| &bound.slots).filter(|slot| slot.node == node) {
            if !wanted.contains(&slot.what) {
                wanted.push(slot.what.clone());
            }
        }
        wanted
    }

    /// Takes samples in the order in which they came.
    pub fn take(&mut self, samples: &[Sample], sources: &[Source]) {
        for source in sources.iter().skip(self.ways.len()) {
            self.ways.push(ways(&self.cases, source));
        }
        for sample in samples {
            let first = *self.first.get_or_insert(sample.at.mono);
            let elapsed = sample.at.mono.since(first);
            for way in self.ways.get(sample.source).into_iter().flatten() {
                let value = sample.value.map(as_it_reads).and_then(|value| match way.unit {
                    SlotUnit::Same => Some(value),
                    SlotUnit::Changed(from, to) => from.convert(value, to),
                    SlotUnit::Lost => None,
                });
                let digits = match (sample.value, way.unit) {
                    (Some(Number::Decimal { digits, .. }), SlotUnit::Same) => Some(digits),
                    _ => None,
                };
                if let Some(case) = self.cases.get_mut(way.case) {
                    case.take(way.slot, value, digits, (sample.at, elapsed, sample.status));
                }
            }
        }
    }

    /// How things stand now.
    pub fn standing(&self) -> Vec<Standing> {
        self.cases.iter().map(Case::standing).collect()
    }

    /// The verdicts, in the order of the expressions and their nodes. `silent` are nodes and signals that gave
    /// nothing, or nothing any more; with the `end` of a recording, signals that ceased before it are found, too.
    pub fn verdicts(mut self, end: Option<Mono>, silent: &[Silence]) -> Vec<Verdict> {
        self.cases.iter_mut().for_each(Case::finish);
        let mut verdicts = Vec::new();
        for expression in &self.expressions {
            let judged = self.cases.iter().filter(|case| case.bound().text == expression.text());
            let settled = self.settled.iter().filter(|verdict| verdict.text == expression.text()).cloned();
            let mut of_it: Vec<Verdict> = judged.map(|case| case.verdict(end, silent)).chain(settled).collect();
            if of_it.is_empty() {
                of_it.push(Verdict::nothing(expression.text(), None, "nothing of it was measured"));
            }
            of_it.sort_by_key(|verdict| verdict.node);
            verdicts.extend(of_it);
        }
        verdicts
    }
}

/// The number that the text of a value reads as: what prints as 9.95 is 9.95, in REAL32 too.
fn as_it_reads(number: Number) -> f64 {
    match number {
        Number::Real32(_) => number.to_string().parse().unwrap_or_else(|_| number.as_f64()),
        Number::Decimal { .. } | Number::Real64(_) => number.as_f64(),
    }
}

fn ways(cases: &[Case], source: &Source) -> Vec<Way> {
    let mut ways = Vec::new();
    for (at, case) in cases.iter().enumerate() {
        for (slot, known) in case.bound().slots.iter().enumerate() {
            if known.node != source.node || *known.name != *source.signal {
                continue;
            }
            let unit = match (unit_of(source), known.unit) {
                // Who did not know the unit compares with nothing that has one.
                (_, None) => SlotUnit::Same,
                (now, then) if now == then => SlotUnit::Same,
                (Some(now), Some(then)) if now.convert(0.0, then).is_some() => SlotUnit::Changed(now, then),
                _ => SlotUnit::Lost,
            };
            ways.push(Way { case: at, slot, unit });
        }
    }
    ways
}
