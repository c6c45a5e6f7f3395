//! What is not taken for zero: the checks before anything is changed.

use super::samples::Samples;
use crate::device::unit::Unit;
use crate::measure::sample::Status;

/// The part of the measuring range within which a reading is taken for zero.
const READING: f64 = 0.01;
/// How far readings may be apart, as a part of the same.
const SPREAD: f64 = 0.5;
/// The part of the measuring range to which offsets may add up.
const SUM: f64 = 0.05;

/// What is still taken for zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Limit {
    /// One hundredth of the measuring range.
    #[default]
    Default,
    /// This many percent of the measuring range.
    Percent(f64),
    /// A number in this unit, or in the present one.
    Value(f64, Option<Unit>),
}

/// The limits in the present unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    pub(super) reading: f64,
    pub(super) spread: f64,
    pub(super) sum: f64,
    /// What the limit of the reading is in percent of the range, where it was not named as a number.
    percent: Option<f64>,
    /// What the limit of the spread is in percent of the range, where that is known.
    spread_percent: Option<f64>,
}

impl Limits {
    /// `None` where a part of the range was asked for and the range, or a unit that does not convert, is not known.
    pub(super) fn new(limit: Limit, range: Option<f64>, unit: Option<Unit>) -> Option<Limits> {
        let (reading, percent) = match limit {
            Limit::Default => (range? * READING, Some(100.0 * READING)),
            Limit::Percent(percent) => (range? * percent / 100.0, Some(percent)),
            Limit::Value(value, None) => (value, None),
            Limit::Value(value, Some(from)) => {
                let to = unit?;
                // A distance, not a point on the scale.
                (from.convert(value, to)? - from.convert(0.0, to)?, None)
            }
        };
        let spread = SPREAD * range.map_or(reading, |range| range * READING);
        let sum = range.map_or(reading, |range| reading.max(range * SUM));
        let spread_percent = range.map(|_| 100.0 * READING * SPREAD);
        Some(Limits { reading, spread, sum, percent, spread_percent })
    }
}

/// Why a zero is not set, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Objection {
    pub(super) reason: String,
    pub(super) hint: Hint,
}

/// What to do about an objection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Hint {
    /// In words.
    Say(String),
    /// Allow more with this limit.
    Limit(String),
}

/// What is measured, in words and numbers.
pub(super) struct Measured<'a> {
    pub(super) signal: &'a str,
    pub(super) unit: &'a str,
    pub(super) decimals: usize,
    pub(super) absolute: Option<bool>,
    pub(super) before: &'a Samples,
    /// The offset that stands already.
    pub(super) offset: Option<f64>,
}

impl Measured<'_> {
    fn show(&self, value: f64) -> String {
        format!("{value:.*} {}", self.decimals, self.unit).trim_end().to_owned()
    }

    /// Everything that speaks against setting the zero, the gravest first.
    pub(super) fn objections(&self, limits: Option<&Limits>) -> Vec<Objection> {
        let mut found = Vec::new();
        let mut object = |reason: String, hint: Hint| found.push(Objection { reason, hint });
        let say = |text: &str| Hint::Say(text.to_owned());
        if self.absolute == Some(true) {
            let reason = "the sensor measures absolute pressure: vented it reads the air's, and that is no zero";
            object(reason.to_owned(), say("with a vacuum on it, --force"));
        }
        if let Some(status) = self.before.bad {
            let status = match status {
                Status::Ok | Status::Invalid => "invalid",
                other => other.as_str(),
            };
            object(format!("{} has no valid value: {status}", self.signal), say("find out why, then try again"));
        }
        let Some(limits) = limits else {
            let reason = format!("the measuring range of {} is not known, and so not what is near zero", self.signal);
            object(reason, say("name the largest reading that is taken for zero: --limit VALUE"));
            return found;
        };
        let Some(mean) = self.before.mean() else { return found };
        if mean.abs() > limits.reading {
            let part =
                limits.percent.map_or_else(|| "--limit".to_owned(), |percent| format!("{percent} % of the range"));
            let (reads, limit) = (self.show(mean), self.show(limits.reading));
            let reason = format!("{} reads {reads}; more than {limit} ({part}) is not taken for zero", self.signal);
            object(reason, Hint::Limit(enough(mean)));
        }
        if self.before.spread() > limits.spread {
            let part = limits
                .spread_percent
                .map_or_else(|| "half of --limit".to_owned(), |part| format!("{part} % of the range"));
            let (spread, limit) = (self.show(self.before.spread()), self.show(limits.spread));
            let reason =
                format!("the readings of {} are {spread} apart; more than {limit} ({part}) is no rest", self.signal);
            object(reason, say("let the pressure settle, or --force"));
        }
        let sum = self.offset.map(|offset| offset - mean).filter(|sum| sum.abs() > limits.sum);
        if let (Some(sum), Some(offset)) = (sum, self.offset) {
            let (offset, sum, limit) = (self.show(offset), self.show(sum), self.show(limits.sum));
            let reason = format!("an offset of {offset} stands already and would become {sum}, more than {limit}");
            object(reason, say("many small steps make a large one: check the sensor, or --force"));
        }
        found
    }
}

/// A round number that is enough of a limit for this reading.
fn enough(mean: f64) -> String {
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
    fn limits_are_parts_of_the_range_or_numbers() {
        let bar = Unit::from_symbol("bar");
        let limits = Limits::new(Limit::Default, Some(10.0), bar).expect("known");
        assert_eq!((limits.reading, limits.spread, limits.sum), (0.1, 0.05, 0.5));
        let limits = Limits::new(Limit::Value(3.5, None), Some(10.0), bar).expect("known");
        assert_eq!((limits.reading, limits.spread, limits.sum), (3.5, 0.05, 3.5));
        let limits = Limits::new(Limit::Value(200.0, Unit::from_symbol("mbar")), None, bar).expect("known");
        assert!((limits.reading - 0.2).abs() < 1e-12 && (limits.spread - 0.1).abs() < 1e-12);
        let limits = Limits::new(Limit::Percent(2.0), Some(10.0), None).expect("known");
        assert_eq!((limits.reading, limits.sum), (0.2, 0.5));
        // 9 degF are a distance of 5 K.
        let (fahrenheit, kelvin) = (Unit::from_symbol("degF"), Unit::from_symbol("K"));
        let limits = Limits::new(Limit::Value(9.0, fahrenheit), None, kelvin).expect("known");
        assert!((limits.reading - 5.0).abs() < 1e-9);
        assert_eq!(Limits::new(Limit::Default, None, bar), None);
        assert_eq!(Limits::new(Limit::Value(1.0, bar), Some(1.0), Unit::from_symbol("degC")), None);
    }

    #[test]
    fn the_limit_that_is_offered_is_round_and_enough() {
        for (mean, offered) in [(3.204, "3.4"), (-0.0123, "0.013"), (17.9, "19"), (950.0, "1000"), (0.1, "0.11")] {
            assert_eq!(enough(mean), offered);
            assert!(offered.parse::<f64>().expect("a number") >= mean.abs());
        }
    }
}
