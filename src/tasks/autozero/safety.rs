//! The safety checks before anything is changed.

use super::failure::Quantity;
use super::samples::Samples;
use crate::device::unit::Unit;
use crate::measure::sample::Status;

/// The limit for the reading, as a part of the measuring range.
const READING_LIMIT: f64 = 0.01;
/// The limit for the variation, as a part of the limit for the reading.
const VARIATION_LIMIT: f64 = 0.5;
/// The limit for the total offset, as a part of the measuring range.
const OFFSET_LIMIT: f64 = 0.05;

/// The largest reading that is accepted as zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Limit {
    /// One hundredth of the measuring range.
    #[default]
    Default,
    /// A percentage of the measuring range.
    Percent(f64),
    /// A value in this unit, or in the present unit of the signal.
    Value(f64, Option<Unit>),
}

/// The limits in the present unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    pub(super) reading: f64,
    pub(super) spread: f64,
    pub(super) total_offset: f64,
    /// The limit of the reading in percent of the range; `None` if it was given as a value.
    percent: Option<f64>,
    /// The limit of the spread in percent of the range; `None` if the range is unknown.
    spread_percent: Option<f64>,
}

impl Limits {
    /// Returns `None` if the limit is a part of an unknown range, or if the unit of the limit does not convert.
    pub(super) fn new(limit: Limit, range: Option<f64>, unit: Option<Unit>) -> Option<Limits> {
        let (reading, percent) = match limit {
            Limit::Default => (range? * READING_LIMIT, Some(100.0 * READING_LIMIT)),
            Limit::Percent(percent) => (range? * percent / 100.0, Some(percent)),
            Limit::Value(value, None) => (value, None),
            Limit::Value(value, Some(from)) => {
                let to = unit?;
                let from = from.beside(to);
                // The limit is a difference, not a point on the scale.
                (from.convert(value, to)? - from.convert(0.0, to)?, None)
            }
        };
        let spread = VARIATION_LIMIT * range.map_or(reading, |range| range * READING_LIMIT);
        let total_offset = range.map_or(reading, |range| reading.max(range * OFFSET_LIMIT));
        let spread_percent = range.map(|_| 100.0 * READING_LIMIT * VARIATION_LIMIT);
        Some(Limits { reading, spread, total_offset, percent, spread_percent })
    }
}

/// Why a safety check failed.
#[derive(Clone, Debug, PartialEq)]
pub enum FailedCheck {
    /// The sensor measures absolute pressure.
    Absolute,
    /// A reading is invalid.
    Invalid {
        /// The signal.
        signal: String,
        /// Its status.
        status: &'static str,
    },
    /// The measuring range is unknown, so no default limit applies.
    RangeUnknown {
        /// The signal.
        signal: String,
    },
    /// The reading is too far from zero.
    TooFar {
        /// The signal.
        signal: String,
        /// The mean.
        reading: Quantity,
        /// The limit.
        limit: Quantity,
        /// The limit in percent of the range; `None` if the user gave a value.
        percent: Option<f64>,
        /// A round limit that accepts this reading.
        sufficient_limit: String,
    },
    /// The readings vary too much.
    Unsteady {
        /// The signal.
        signal: String,
        /// The difference between the greatest and the least reading.
        spread: Quantity,
        /// The limit.
        limit: Quantity,
        /// The limit in percent of the range; `None` if the range is unknown.
        percent: Option<f64>,
    },
    /// The total offset would become too large.
    TotalOffset {
        /// The present offset.
        offset: Quantity,
        /// The total offset that would result.
        total: Quantity,
        /// The limit.
        limit: Quantity,
    },
}

impl FailedCheck {
    /// Whether this check also applies to a tare. For a tare, the process value may be far from zero.
    pub(super) fn concerns_tare(&self) -> bool {
        matches!(self, FailedCheck::Invalid { .. } | FailedCheck::Unsteady { .. })
    }
}

/// The input of the safety checks.
pub(super) struct Measured<'a> {
    pub(super) signal: &'a str,
    pub(super) unit: Option<Unit>,
    pub(super) decimals: usize,
    pub(super) absolute: Option<bool>,
    pub(super) before: &'a Samples,
    /// The present offset.
    pub(super) offset: Option<f64>,
}

impl Measured<'_> {
    fn quantity(&self, value: f64) -> Quantity {
        Quantity { value, unit: self.unit, decimals: self.decimals }
    }

    /// Returns all failed checks, the most serious first.
    pub(super) fn failed_checks(&self, limits: Option<&Limits>) -> Vec<FailedCheck> {
        let mut found = Vec::new();
        let signal = || self.signal.to_owned();
        if self.absolute == Some(true) {
            found.push(FailedCheck::Absolute);
        }
        if let Some(status) = self.before.bad {
            let status = match status {
                Status::Ok | Status::Invalid => "invalid",
                other => other.as_str(),
            };
            found.push(FailedCheck::Invalid { signal: signal(), status });
        }
        let Some(limits) = limits else {
            found.push(FailedCheck::RangeUnknown { signal: signal() });
            return found;
        };
        let Some(mean) = self.before.mean() else { return found };
        if mean.abs() > limits.reading {
            found.push(FailedCheck::TooFar {
                signal: signal(),
                reading: self.quantity(mean),
                limit: self.quantity(limits.reading),
                percent: limits.percent,
                sufficient_limit: sufficient_limit(mean),
            });
        }
        if self.before.spread() > limits.spread {
            found.push(FailedCheck::Unsteady {
                signal: signal(),
                spread: self.quantity(self.before.spread()),
                limit: self.quantity(limits.spread),
                percent: limits.spread_percent,
            });
        }
        let total = self.offset.map(|offset| offset - mean).filter(|total| total.abs() > limits.total_offset);
        if let (Some(total), Some(offset)) = (total, self.offset) {
            let limit = self.quantity(limits.total_offset);
            found.push(FailedCheck::TotalOffset { offset: self.quantity(offset), total: self.quantity(total), limit });
        }
        found
    }
}

/// A round limit that accepts this reading.
fn sufficient_limit(mean: f64) -> String {
    let needed = 1.05 * mean.abs();
    let step = 10f64.powf(needed.log10().floor() - 1.0);
    let steps = (needed / step).ceil();
    let decimals = (0..=9).find(|&decimals| 10f64.powi(-decimals) <= step * 1.000_001).unwrap_or(9);
    format!("{:.*}", usize::try_from(decimals).unwrap_or(0), steps * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_is_a_part_of_the_range_or_a_value() {
        let bar = Unit::from_symbol("bar");
        let limits = Limits::new(Limit::Default, Some(10.0), bar).expect("known");
        assert_eq!((limits.reading, limits.spread, limits.total_offset), (0.1, 0.05, 0.5));
        let limits = Limits::new(Limit::Value(3.5, None), Some(10.0), bar).expect("known");
        assert_eq!((limits.reading, limits.spread, limits.total_offset), (3.5, 0.05, 3.5));
        let limits = Limits::new(Limit::Value(200.0, Unit::from_symbol("mbar")), None, bar).expect("known");
        assert!((limits.reading - 0.2).abs() < 1e-12 && (limits.spread - 0.1).abs() < 1e-12);
        let limits = Limits::new(Limit::Percent(2.0), Some(10.0), None).expect("known");
        assert_eq!((limits.reading, limits.total_offset), (0.2, 0.5));
        // A difference of 9 degF is 5 K.
        let (fahrenheit, kelvin) = (Unit::from_symbol("degF"), Unit::from_symbol("K"));
        let limits = Limits::new(Limit::Value(9.0, fahrenheit), None, kelvin).expect("known");
        assert!((limits.reading - 5.0).abs() < 1e-9);
        assert_eq!(Limits::new(Limit::Default, None, bar), None);
        assert_eq!(Limits::new(Limit::Value(1.0, bar), Some(1.0), Unit::from_symbol("degC")), None);
    }

    #[test]
    fn suggested_limit_is_round_and_sufficient() {
        for (mean, offered) in [(3.204, "3.4"), (-0.0123, "0.013"), (17.9, "19"), (950.0, "1000"), (0.1, "0.11")] {
            assert_eq!(sufficient_limit(mean), offered);
            assert!(offered.parse::<f64>().expect("a number") >= mean.abs());
        }
    }
}
