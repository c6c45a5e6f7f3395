//! Statistics in one pass (Welford): numerically sound over as many samples as one likes.

use std::time::Duration;

/// Count, extremes, mean and spread of the values of one signal, and of the times between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    valid: u64,
    invalid: u64,
    mean: f64,
    squares: f64,
    min: f64,
    max: f64,
    first: Option<Duration>,
    last: Option<Duration>,
    longest: Duration,
}

impl Statistics {
    /// Takes a sample: its number, `None` where it is invalid, and its time on the monotonic time line.
    pub fn add(&mut self, value: Option<f64>, at: Duration) {
        self.first.get_or_insert(at);
        if let Some(last) = self.last {
            self.longest = self.longest.max(at.saturating_sub(last));
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
        let before = value - self.mean;
        self.mean += before / self.valid as f64;
        self.squares += before * (value - self.mean);
    }

    /// Samples, valid and invalid.
    pub fn count(&self) -> u64 {
        self.valid + self.invalid
    }

    /// Samples without a value.
    pub fn invalid(&self) -> u64 {
        self.invalid
    }

    /// Least value.
    pub fn min(&self) -> Option<f64> {
        (self.valid > 0).then_some(self.min)
    }

    /// Greatest value.
    pub fn max(&self) -> Option<f64> {
        (self.valid > 0).then_some(self.max)
    }

    /// Arithmetic mean.
    pub fn mean(&self) -> Option<f64> {
        (self.valid > 0).then_some(self.mean)
    }

    /// Standard deviation of a sample (n - 1); `None` for fewer than two values.
    pub fn deviation(&self) -> Option<f64> {
        (self.valid > 1).then(|| (self.squares / (self.valid - 1) as f64).sqrt())
    }

    /// Samples a second between the first and the last one.
    pub fn rate(&self) -> Option<f64> {
        let span = self.last?.checked_sub(self.first?)?.as_secs_f64();
        (self.count() > 1 && span > 0.0).then(|| (self.count() - 1) as f64 / span)
    }

    /// The longest time between two samples.
    pub fn longest_interval(&self) -> Duration {
        self.longest
    }

    /// When the last sample came.
    pub fn last(&self) -> Option<Duration> {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_deviation_of_a_far_off_signal() {
        // A naive sum of squares loses everything here.
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

    #[test]
    fn invalid_samples_count_and_say_nothing_else() {
        let mut statistics = Statistics::default();
        assert_eq!((statistics.mean(), statistics.rate(), statistics.min()), (None, None, None));
        statistics.add(None, Duration::ZERO);
        assert_eq!((statistics.count(), statistics.invalid(), statistics.mean()), (1, 1, None));
        statistics.add(Some(-3.0), Duration::from_secs(1));
        assert_eq!((statistics.max(), statistics.deviation(), statistics.rate()), (Some(-3.0), None, Some(1.0)));
    }
}
