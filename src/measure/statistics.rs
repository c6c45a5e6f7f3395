//! Statistics in one pass (Welford), numerically stable for any number of samples.
//!
//! Welford's sums lose precision with each sample, because the terms become smaller than the last bit of the sum. A
//! second number keeps the lost part (Neumaier), so a billion samples have the same precision as a thousand.

use super::histogram::Histogram;
use std::time::Duration;

/// A sum, and the part that is below its last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sum {
    sum: f64,
    rest: f64,
}

impl Sum {
    fn add(&mut self, term: f64) {
        let sum = self.sum + term;
        let lost = if self.sum.abs() >= term.abs() { (self.sum - sum) + term } else { (term - sum) + self.sum };
        self.rest += lost;
        self.sum = sum;
    }

    fn value(self) -> f64 {
        self.sum + self.rest
    }
}

/// Count, minimum, maximum, mean and standard deviation of one signal's values, and the intervals between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    valid: u64,
    invalid: u64,
    mean: Sum,
    squares: Sum,
    min: f64,
    max: f64,
    first: Option<Duration>,
    last: Option<Duration>,
    intervals: Histogram,
    gaps: u64,
}

/// The distances of the intervals between samples from their median. All times are exact to 0.025 % of the interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jitter {
    /// The median interval.
    pub median: Duration,
    /// Half of the intervals are within this distance from the median.
    pub p50: Duration,
    /// 99 % of the intervals are within this distance from the median.
    pub p99: Duration,
    /// The greatest distance from the median.
    pub max: Duration,
}

impl Statistics {
    /// Adds a sample: its number, or `None` if it is invalid, and its monotonic time.
    pub fn add(&mut self, value: Option<f64>, at: Duration) {
        self.first.get_or_insert(at);
        if let Some(last) = self.last {
            self.intervals.add(at.saturating_sub(last));
        }
        self.last = Some(at);
        let Some(value) = value else {
            self.invalid += 1;
            return;
        };
        self.valid += 1;
        if self.valid == 1 {
            (self.min, self.max) = (value, value);
        }
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        let before = value - self.mean.value();
        self.mean.add(before / self.valid as f64);
        self.squares.add(before * (value - self.mean.value()));
    }

    /// Counts the last interval as a gap.
    pub fn add_gap(&mut self) {
        self.gaps += 1;
    }

    /// The number of intervals that were gaps.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// The number of samples, valid and invalid.
    pub fn count(&self) -> u64 {
        self.valid + self.invalid
    }

    /// The number of samples without a value.
    pub fn invalid(&self) -> u64 {
        self.invalid
    }

    /// The minimum.
    pub fn min(&self) -> Option<f64> {
        (self.valid > 0).then_some(self.min)
    }

    /// The maximum.
    pub fn max(&self) -> Option<f64> {
        (self.valid > 0).then_some(self.max)
    }

    /// The arithmetic mean.
    pub fn mean(&self) -> Option<f64> {
        (self.valid > 0).then(|| self.mean.value())
    }

    /// The sample standard deviation (n - 1); `None` for fewer than two values.
    pub fn deviation(&self) -> Option<f64> {
        (self.valid > 1).then(|| (self.squares.value().max(0.0) / (self.valid - 1) as f64).sqrt())
    }

    /// Samples per second between the first and the last one.
    pub fn rate(&self) -> Option<f64> {
        let span = self.last?.checked_sub(self.first?)?.as_secs_f64();
        (self.count() > 1 && span > 0.0).then(|| (self.count() - 1) as f64 / span)
    }

    /// The longest interval between two samples.
    pub fn longest_interval(&self) -> Duration {
        self.intervals.longest().unwrap_or_default()
    }

    /// The intervals between two samples.
    pub fn intervals(&self) -> &Histogram {
        &self.intervals
    }

    /// The distances of the intervals from their median; `None` for fewer than two intervals.
    pub fn jitter(&self) -> Option<Jitter> {
        if self.intervals.count() < 2 {
            return None;
        }
        let median = self.intervals.quantile(0.5)?;
        Some(Jitter {
            median,
            p50: self.intervals.distance(median, 0.5)?,
            p99: self.intervals.distance(median, 0.99)?,
            max: self.intervals.farthest(median)?,
        })
    }

    /// The time of the last sample.
    pub fn last(&self) -> Option<Duration> {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_deviation_of_a_signal_far_from_zero() {
        // A naive sum of squares has no correct digit here.
        let mut statistics = Statistics::default();
        for (at, value) in [1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0].into_iter().enumerate() {
            statistics.add(Some(value), Duration::from_millis(10 * at as u64));
        }
        assert_eq!(statistics.mean(), Some(1e9 + 10.0));
        assert_eq!(statistics.deviation(), Some(30f64.sqrt()));
        assert_eq!((statistics.min(), statistics.max()), (Some(1e9 + 4.0), Some(1e9 + 16.0)));
        assert!((statistics.rate().expect("a rate") - 100.0).abs() < 1e-9);
        assert_eq!(statistics.longest_interval(), Duration::from_millis(10));
    }

    /// Each sample changes the mean by less than the last bit of the mean.
    #[test]
    fn precision_does_not_fall_with_the_number_of_samples() {
        // A billion samples of 1e6, then many that are a little greater.
        let mut statistics = Statistics {
            valid: 1_000_000_000,
            mean: Sum { sum: 1e6, rest: 0.0 },
            min: 1e6,
            max: 1e6,
            ..Statistics::default()
        };
        let more = 2_000_000;
        for n in 0..more {
            let value = if n % 2 == 0 { 1e6 + 0.1 } else { 1e6 + 0.3 };
            statistics.add(Some(value), Duration::from_millis(n));
        }
        let (before, after) = (1e9, more as f64);
        let mean = 0.2 * after / (before + after);
        let found = statistics.mean().expect("a mean") - 1e6;
        assert!((found - mean).abs() < mean * 1e-6, "{found:e}, {mean:e}");
        // The squares within the group around 0.2, plus the squares of the distance between both groups.
        let squares = 0.01 * after + 0.04 * before * after / (before + after);
        let deviation = (squares / (before + after - 1.0)).sqrt();
        let found = statistics.deviation().expect("a deviation");
        assert!((found / deviation - 1.0).abs() < 1e-6, "{found:e}, {deviation:e}");
    }

    /// With values from 1 to 1e12, the sums have no digits left for the next term.
    #[test]
    fn extreme_values_keep_precision() {
        let mut statistics = Statistics::default();
        let mut at = Duration::ZERO;
        for value in [1e12, 1.0, -1e12, 3.0].into_iter().cycle().take(4_000_000) {
            statistics.add(Some(value), at);
            at += Duration::from_millis(1);
        }
        let mean = statistics.mean().expect("a mean");
        assert!((mean - 1.0).abs() < 1e-6, "{mean}: 1e-12 of the added values");
        let deviation = (2e24f64 / 4.0 * 4e6 / (4e6 - 1.0)).sqrt();
        let found = statistics.deviation().expect("a deviation");
        assert!((found / deviation - 1.0).abs() < 1e-12, "{found:e}, {deviation:e}");
        let jitter = statistics.jitter().expect("intervals");
        assert_eq!((jitter.median, jitter.max), (Duration::from_millis(1), Duration::ZERO));
    }

    #[test]
    fn jitter_is_the_distance_from_the_usual_interval() {
        let mut statistics = Statistics::default();
        let mut at = Duration::ZERO;
        for n in 0..1000u64 {
            statistics.add(Some(1.0), at);
            // Intervals of 10 ms: every tenth is 100 us longer, the next one 100 us shorter. One is 50 ms.
            let late = if n % 10 == 0 { 100 } else { 0 };
            let early = if n % 10 == 1 { 100 } else { 0 };
            at += Duration::from_micros(if n == 500 { 50_000 } else { 10_000 + late - early });
        }
        let jitter = statistics.jitter().expect("intervals");
        let micros = |time: Duration| time.as_micros();
        assert!((9_995..=10_005).contains(&micros(jitter.median)), "{jitter:?}");
        assert!(micros(jitter.p50) <= 5 && (95..=105).contains(&micros(jitter.p99)), "{jitter:?}");
        assert!((39_995..=40_005).contains(&micros(jitter.max)), "{jitter:?}");
        assert_eq!(statistics.longest_interval(), Duration::from_millis(50));
    }

    #[test]
    fn invalid_samples_are_only_counted() {
        let mut statistics = Statistics::default();
        assert_eq!((statistics.mean(), statistics.rate(), statistics.min()), (None, None, None));
        statistics.add(None, Duration::ZERO);
        assert_eq!((statistics.count(), statistics.invalid(), statistics.mean()), (1, 1, None));
        statistics.add(Some(-3.0), Duration::from_secs(1));
        assert_eq!((statistics.max(), statistics.deviation(), statistics.rate()), (Some(-3.0), None, Some(1.0)));
    }
}
