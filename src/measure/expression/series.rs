//! The signals of all expressions, and the statistics of their values.
//!
//! Many expressions use the same signal. Its statistics are computed once per sample, not once per expression.

use super::bind::Input;
use super::formula::{Formula, Values};
use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::statistics::Statistics;
use std::time::Duration;

/// The statistics of one signal, or of a formula with this signal only.
#[derive(Clone, Debug)]
struct Series {
    /// The formula; the signal is its input 0.
    formula: Formula,
    statistics: Statistics,
}

/// A signal that expressions use.
#[derive(Clone, Debug)]
pub(super) struct SharedSignal {
    /// The node.
    pub(super) node: NodeId,
    /// The name as in [`Source`](crate::measure::sample::Source).
    pub(super) name: String,
    /// The unit of its values, if known.
    pub(super) unit: Option<Unit>,
    series: Vec<Series>,
    /// Whether a sample was received. Expressions that are bound later have fewer samples, so they do not share this
    /// signal.
    has_samples: bool,
}

/// The place of the statistics of a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SeriesId {
    signal: usize,
    series: usize,
}

/// All signals of expressions.
#[derive(Clone, Debug, Default)]
pub(super) struct SharedSignals(Vec<SharedSignal>);

impl SharedSignals {
    /// Returns the place of a signal for a new expression, and adds the signal if necessary.
    pub(super) fn signal(&mut self, wanted: &Input) -> usize {
        let can_share = |known: &SharedSignal| {
            !known.has_samples && (known.node, &known.name, known.unit) == (wanted.node, &wanted.name, wanted.unit)
        };
        if let Some(at) = self.0.iter().position(can_share) {
            return at;
        }
        let Input { node, name, unit, .. } = wanted.clone();
        self.0.push(SharedSignal { node, name, unit, series: Vec::new(), has_samples: false });
        self.0.len() - 1
    }

    /// Returns the place of the statistics of a formula whose only input is this signal.
    pub(super) fn series(&mut self, signal: usize, formula: &Formula) -> SeriesId {
        let formula = formula.of_first_input();
        let all = &mut self.0[signal].series;
        let series = all.iter().position(|known| known.formula == formula).unwrap_or_else(|| {
            all.push(Series { formula, statistics: Statistics::default() });
            all.len() - 1
        });
        SeriesId { signal, series }
    }

    /// Returns the statistics of a formula.
    pub(super) fn statistics(&self, id: SeriesId) -> &Statistics {
        &self.0[id.signal].series[id.series].statistics
    }

    /// Adds a value of a signal.
    pub(super) fn add(&mut self, signal: usize, value: Option<f64>, at: Duration) {
        let signal = &mut self.0[signal];
        signal.has_samples = true;
        for Series { formula, statistics } in &mut signal.series {
            statistics.add(formula.value(Values { inputs: &[value], aggregates: &[] }), at);
        }
    }

    /// All signals with their places.
    pub(super) fn all(&self) -> impl Iterator<Item = (usize, &SharedSignal)> {
        self.0.iter().enumerate()
    }
}
