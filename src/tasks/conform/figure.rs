//! Figures of measured times.

use std::time::Duration;

/// What a figure describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    /// The shortest time.
    Min,
    /// Half of the times are shorter.
    Median,
    /// The arithmetic mean.
    Mean,
    /// The standard deviation.
    Jitter,
    /// 99 % of the times are not longer.
    P99,
    /// The longest time.
    Max,
}

impl Statistic {
    /// All figures.
    pub const ALL: [Statistic; 6] =
        [Statistic::Min, Statistic::Median, Statistic::Mean, Statistic::Jitter, Statistic::P99, Statistic::Max];

    /// The name in data.
    pub fn name(self) -> &'static str {
        match self {
            Statistic::Min => "min",
            Statistic::Median => "median",
            Statistic::Mean => "mean",
            Statistic::Jitter => "jitter",
            Statistic::P99 => "p99",
            Statistic::Max => "max",
        }
    }
}

/// One figure of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figure {
    /// What it describes.
    pub statistic: Statistic,
    /// The time.
    pub time: Duration,
}

impl Figure {
    /// A figure of these times; 0 if there are none.
    pub(super) fn of(statistic: Statistic, times: &[Duration]) -> Figure {
        let mut sorted = times.to_vec();
        sorted.sort_unstable();
        let at = |percent: usize| {
            let rank = (sorted.len() * percent).div_ceil(100).max(1);
            sorted.get(rank - 1).copied().unwrap_or_default()
        };
        let time = match statistic {
            Statistic::Min => at(0),
            Statistic::Median => at(50),
            Statistic::Mean => mean(times),
            Statistic::Jitter => deviation(times),
            Statistic::P99 => at(99),
            Statistic::Max => at(100),
        };
        Figure { statistic, time }
    }
}

fn mean(times: &[Duration]) -> Duration {
    let count = u32::try_from(times.len().max(1)).unwrap_or(u32::MAX);
    times.iter().sum::<Duration>() / count
}

/// The standard deviation of the times.
fn deviation(times: &[Duration]) -> Duration {
    let mean = mean(times);
    let squares: f64 = times.iter().map(|time| time.abs_diff(mean).as_secs_f64().powi(2)).sum();
    let count = f64::from(u32::try_from(times.len().max(1)).unwrap_or(u32::MAX));
    Duration::from_secs_f64((squares / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_a_hundred_and_one_times() {
        let times: Vec<Duration> = (0..=100).rev().map(Duration::from_millis).collect();
        let of = |statistic| Figure::of(statistic, &times).time.as_millis();
        assert_eq!(Statistic::ALL.map(of), [0, 50, 50, 29, 99, 100]);
        assert_eq!(Figure::of(Statistic::P99, &times[..1]).time, Duration::from_millis(100));
        assert_eq!(Figure::of(Statistic::Max, &[]).time, Duration::ZERO);
    }
}
