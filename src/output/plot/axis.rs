//! The ticks of the axes, at round numbers and round times.

/// The number of microseconds in a second.
const SECOND: i64 = 1_000_000;

/// The difference between local time and UTC at a given time, in microseconds.
pub(super) type Zone = fn(i64) -> i64;

/// The labels of the time axis.
#[derive(Clone, Copy, Debug)]
pub enum TimeAxis {
    /// The time of day in a time zone.
    Clock(Zone),
    /// The time since the start of the run.
    Elapsed,
}

/// The steps between ticks from 1 s to 1 day, in seconds.
const STEPS: [i64; 18] =
    [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10_800, 21_600, 43_200, 86_400];

/// Elapsed times of at least this length are labelled with hours and minutes.
const LONG_TIME: i64 = 120 * SECOND;

impl TimeAxis {
    fn utc_offset(self, at: i64) -> i64 {
        match self {
            TimeAxis::Clock(zone) => zone(at),
            TimeAxis::Elapsed => 0,
        }
    }

    /// Returns ticks with their labels. `room` is the share of the axis for a label of this number of characters.
    pub(super) fn ticks(self, span: (i64, i64), room: impl Fn(usize) -> f64) -> Vec<(i64, String)> {
        let steps = (0..6).flat_map(|power| [1, 2, 5].map(|digit| digit * 10i64.pow(power)));
        let steps = steps.chain(STEPS.map(|step| step * SECOND));
        let mut steps = steps.chain(
            (1..).flat_map(|power| [2, 5, 10].map(|days| days * 86_400 * SECOND * 10i64.pow(power - 1))).take(15),
        );
        let length = (span.1 - span.0) as f64;
        let fits = |step: &i64| *step as f64 / length >= room(self.label(span.0, *step, span).len());
        let step = steps.find(fits).unwrap_or(i64::MAX / 4);
        let utc_offset = self.utc_offset(span.0);
        let first = (span.0 + utc_offset).div_euclid(step) * step - utc_offset;
        let ticks = (0..).map(|count| first + count * step).skip_while(|at| *at < span.0);
        ticks.take_while(|at| *at <= span.1).map(|at| (at, self.label(at, step, span))).collect()
    }

    fn label(self, at: i64, step: i64, span: (i64, i64)) -> String {
        let local = at + self.utc_offset(at);
        if let (TimeAxis::Elapsed, true) = (self, span.1 < LONG_TIME) {
            let digits = (0..6).find(|digits| step % 10i64.pow(6 - digits) == 0).unwrap_or(6);
            return format!("{:.*}", digits as usize, local as f64 / 1e6);
        }
        let (seconds, part) = (local.div_euclid(SECOND), local.rem_euclid(SECOND));
        let (minute, hour) = (seconds.div_euclid(60), seconds.div_euclid(3600));
        let time = match step {
            ..1_000 => format!("{:02}:{:02}.{part:06}", minute.rem_euclid(60), seconds.rem_euclid(60)),
            1_000..SECOND => format!("{:02}:{:02}.{:03}", minute.rem_euclid(60), seconds.rem_euclid(60), part / 1000),
            _ if self.is_clock() && step % (60 * SECOND) == 0 => {
                format!("{:02}:{:02}", hour.rem_euclid(24), minute.rem_euclid(60))
            }
            _ => {
                let hour = if self.is_clock() { hour.rem_euclid(24) } else { hour };
                format!("{hour:02}:{:02}:{:02}", minute.rem_euclid(60), seconds.rem_euclid(60))
            }
        };
        let day = || date(local).get(5..).unwrap_or_default().to_owned();
        match self {
            TimeAxis::Clock(_) if step >= 86_400 * SECOND => day(),
            TimeAxis::Clock(_) if span.1 - span.0 > 86_400 * SECOND => format!("{} {time}", day()),
            _ => time,
        }
    }

    fn is_clock(self) -> bool {
        matches!(self, TimeAxis::Clock(_))
    }

    /// The line below the axis: the date and the time zone, or the unit of the elapsed time.
    pub(super) fn caption(self, span: (i64, i64)) -> String {
        let TimeAxis::Clock(_) = self else {
            return if span.1 < LONG_TIME { "elapsed [s]" } else { "elapsed [h:min:s]" }.to_owned();
        };
        let utc_offset = self.utc_offset(span.0);
        let minutes = utc_offset.abs() / SECOND / 60;
        let sign = if utc_offset < 0 { '-' } else { '+' };
        let zone = match minutes {
            0 => "UTC".to_owned(),
            _ => format!("UTC{sign}{:02}:{:02}", minutes / 60, minutes % 60),
        };
        let local = span.0 + utc_offset;
        // Labels with fractions of a second have no hours.
        let hour = if span.1 - span.0 < 10 * SECOND { hour(local) } else { String::new() };
        format!("{}{hour}, {zone}", date(local))
    }
}

fn moment(local: i64) -> String {
    let since = std::time::Duration::from_micros(u64::try_from(local).unwrap_or(0));
    humantime::format_rfc3339_seconds(crate::bus::Wall::at(since).system_time()).to_string()
}

/// `2023-11-14`.
fn date(local: i64) -> String {
    moment(local).get(..10).unwrap_or_default().to_owned()
}

/// ` 22 h`.
fn hour(local: i64) -> String {
    format!(" {} h", moment(local).get(11..13).unwrap_or_default())
}

/// Adds space above and below a range.
pub(super) fn with_margins((low, high): (f64, f64)) -> (f64, f64) {
    let margin = match high - low {
        0.0 if low == 0.0 => 1.0,
        0.0 => low.abs() * 0.05,
        size => size * 0.05,
    };
    // If the values are close to the largest number, the margins would be infinite.
    let range = (low - margin, high + margin);
    if (range.1 - range.0).is_finite() { range } else { (f64::MIN / 4.0, f64::MAX / 4.0) }
}

/// Returns ticks with their labels, with at most `max_intervals` intervals between the ticks.
pub(super) fn value_ticks((low, high): (f64, f64), max_intervals: usize) -> Vec<(f64, String)> {
    let rough = (high - low) / max_intervals.max(1) as f64;
    let power = rough.log10().floor();
    let step = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * 10f64.powf(power)).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(rough);
    let magnitude = step.log10().floor();
    let first = (low / step).ceil();
    let ticks = (0..=max_intervals).map(|count| (first + count as f64) * step).take_while(|value| *value <= high);
    let label = |value: f64| {
        // Prints 0 instead of -0.
        let value = if value.abs() < step / 2.0 { 0.0 } else { value };
        match magnitude {
            ..-6.0 => format!("{value:.3e}"),
            ..0.0 => {
                format!("{value:.*}", (1..=6u8).find(|digits| f64::from(*digits) >= -magnitude).map_or(6, usize::from))
            }
            _ if value.abs() >= 1e9 => format!("{value:.3e}"),
            _ => format!("{value:.0}"),
        }
    };
    ticks.map(|value| (value, label(value))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: TimeAxis, span: (i64, i64)) -> Vec<String> {
        axis.ticks(span, |characters| (characters + 15) as f64 / 100.0).into_iter().map(|(_, label)| label).collect()
    }

    fn values(low: f64, high: f64) -> Vec<String> {
        value_ticks((low, high), 5).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn round_values() {
        assert_eq!(values(0.0, 10.0), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(values(1.2291, 1.2380), ["1.230", "1.232", "1.234", "1.236", "1.238"]);
        assert_eq!(values(-0.4, 0.4), ["-0.4", "-0.2", "0.0", "0.2", "0.4"]);
        assert_eq!(values(1e6, 1.2e6), ["1000000", "1050000", "1100000", "1150000", "1200000"]);
        assert_eq!(values(0.0, 5e-9), ["0.000e0", "1.000e-9", "2.000e-9", "3.000e-9", "4.000e-9", "5.000e-9"]);
        assert!(!values(with_margins((f64::MIN, f64::MAX)).0, f64::MAX / 4.0).is_empty());
        for one in [0.0, 25.0, -1e-30, 1e300] {
            let (low, high) = with_margins((one, one));
            assert!(low < one && one < high && values(low, high).len() > 1, "{one}");
        }
    }

    #[test]
    fn round_times() {
        let (start, hour) = (1_700_000_000 * SECOND, 3600 * SECOND);
        let utc_offset: Zone = |_| 3600 * SECOND + 1800 * SECOND;
        assert_eq!(labels(TimeAxis::Clock(|_| 0), (start, start + hour)), ["22:15", "22:30", "22:45", "23:00"]);
        assert_eq!(labels(TimeAxis::Clock(utc_offset), (start, start + hour))[0], "23:45");
        assert_eq!(TimeAxis::Clock(utc_offset).caption((start, start + hour)), "2023-11-14, UTC+01:30");
        let week = labels(TimeAxis::Clock(|_| 0), (start, start + 7 * 24 * hour));
        assert_eq!(week, ["11-15", "11-17", "11-19", "11-21"]);
        let days = labels(TimeAxis::Clock(|_| 0), (start, start + 30 * hour));
        assert_eq!(days, ["11-15 00:00", "11-15 12:00", "11-16 00:00"]);
        let short = labels(TimeAxis::Clock(|_| 0), (start, start + SECOND / 2));
        assert_eq!(short, ["13:20.000", "13:20.200", "13:20.400"]);
        assert_eq!(labels(TimeAxis::Elapsed, (0, 10 * SECOND)), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels(TimeAxis::Elapsed, (0, SECOND))[..2], ["0.0", "0.2"]);
        assert_eq!(labels(TimeAxis::Elapsed, (0, 30 * hour)), ["00:00:00", "12:00:00", "24:00:00"]);
    }
}
