//! `elapsed_s`: how long after the first row, to the microsecond.

use crate::bus::{Mono, Stamp};
use std::time::Duration;

/// The wall clock was set when it and the monotonic clock disagree by more than this from one row to the next.
const STEP_US: i128 = 10_000;

/// Counts from the first row.
///
/// By the same wall times that stand in the rows, so that a recording played again gives the same numbers;
/// where the wall clock was set on the way, the monotonic clock tells how much time has really passed.
#[derive(Debug, Default)]
pub(super) struct Elapsed {
    /// The wall time of the first row, as if the clock had been then as it is now.
    begin_us: i128,
    last: Option<(i128, Mono)>,
}

impl Elapsed {
    /// The time of a row that came at `at`; rows come in order of time.
    pub(super) fn take(&mut self, at: Stamp) -> Duration {
        let wall_us = micros(at.wall.since_epoch());
        match self.last {
            None => self.begin_us = wall_us,
            Some((last_us, last)) => {
                let passed = micros(at.mono.since(last));
                let shift = wall_us - last_us - passed;
                if shift.abs() > STEP_US {
                    self.begin_us += shift;
                }
            }
        }
        self.last = Some((wall_us, at.mono));
        let elapsed = u64::try_from(wall_us - self.begin_us).unwrap_or(0);
        Duration::from_micros(elapsed)
    }

    /// The time of something else than a row, which may come out of order: by the last row.
    pub(super) fn look(&self, at: Stamp) -> Duration {
        let (last_us, last) = self.last.unwrap_or((self.begin_us, at.mono));
        let since = micros(at.mono.since(last)) - micros(last.since(at.mono));
        let shown = micros(at.wall.since_epoch()) - last_us;
        // What stands beside it is a wall time, too.
        let passed = if (shown - since).abs() > STEP_US { since } else { shown };
        Duration::from_micros(u64::try_from(last_us + passed - self.begin_us).unwrap_or(0))
    }
}

fn micros(duration: Duration) -> i128 {
    i128::try_from(duration.as_micros()).unwrap_or(i128::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::Wall;

    fn at(mono_ns: u64, wall_ns: u64) -> Stamp {
        Stamp { mono: Mono::at(Duration::from_nanos(mono_ns)), wall: Wall::at(Duration::from_nanos(wall_ns)) }
    }

    #[test]
    fn the_difference_of_the_times_in_the_rows() {
        let mut elapsed = Elapsed::default();
        // 1.000000999 s and 1.000001001 s stand in the rows as 1.000000 and 1.000001.
        assert_eq!(elapsed.take(at(0, 1_000_000_999)), Duration::ZERO);
        assert_eq!(elapsed.take(at(2, 1_000_001_001)), Duration::from_micros(1));
        assert_eq!(elapsed.take(at(2_000_000, 1_002_000_000)), Duration::from_micros(2000));
    }

    #[test]
    fn a_clock_that_is_set_tears_nothing() {
        for step in [-3_600_000_000_000i64, -20_000_000, 20_000_000, 3_600_000_000_000] {
            let mut elapsed = Elapsed::default();
            let wall = 1_700_000_000_000_000_000u64;
            assert_eq!(elapsed.take(at(0, wall)), Duration::ZERO);
            assert_eq!(elapsed.take(at(100_000_000, wall + 100_000_000)), Duration::from_millis(100));
            let set = (wall + 200_000_000).saturating_add_signed(step);
            assert_eq!(elapsed.take(at(200_000_000, set)), Duration::from_millis(200), "{step}");
            assert_eq!(elapsed.take(at(300_000_000, set + 100_000_000)), Duration::from_millis(300), "{step}");
        }
    }
}
