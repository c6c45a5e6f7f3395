//! `elapsed_s`: the time since the first row in microsecond resolution.

use crate::bus::{Mono, Stamp};
use std::time::Duration;

/// If wall and monotonic time between two rows differ by more than this, the wall clock was set.
const CLOCK_STEP_US: i128 = 10_000;

/// Measures the time since the first row.
///
/// The time is computed from the wall times in the rows, so that a replayed recording has the same numbers. If the wall
/// clock was set, the interval comes from the monotonic clock.
#[derive(Debug, Default)]
pub(super) struct Elapsed {
    /// The wall time of the first row, shifted by every later clock step.
    start_us: i128,
    last: Option<(i128, Mono)>,
}

impl Elapsed {
    /// The elapsed time of a row. Rows come in order of time.
    pub(super) fn advance(&mut self, at: Stamp) -> Duration {
        let wall_us = micros(at.wall.since_epoch());
        match self.last {
            None => self.start_us = wall_us,
            Some((last_us, last)) => {
                let passed = micros(at.mono.since(last));
                let shift = wall_us - last_us - passed;
                if shift.abs() > CLOCK_STEP_US {
                    self.start_us += shift;
                }
            }
        }
        self.last = Some((wall_us, at.mono));
        let elapsed = u64::try_from(wall_us - self.start_us).unwrap_or(0);
        Duration::from_micros(elapsed)
    }

    /// The elapsed time of an event, which may be older than the last row.
    pub(super) fn at(&self, at: Stamp) -> Duration {
        let (last_us, last) = self.last.unwrap_or((self.start_us, at.mono));
        let mono_us = micros(at.mono.since(last)) - micros(last.since(at.mono));
        let wall_us = micros(at.wall.since_epoch()) - last_us;
        // The event is written with its wall time, so the elapsed time follows the wall time, unless the clock was set.
        let passed = if (wall_us - mono_us).abs() > CLOCK_STEP_US { mono_us } else { wall_us };
        Duration::from_micros(u64::try_from(last_us + passed - self.start_us).unwrap_or(0))
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
    fn elapsed_is_the_difference_of_the_row_times() {
        let mut elapsed = Elapsed::default();
        // In the rows, 1.000000999 s and 1.000001001 s are 1.000000 and 1.000001.
        assert_eq!(elapsed.advance(at(0, 1_000_000_999)), Duration::ZERO);
        assert_eq!(elapsed.advance(at(2, 1_000_001_001)), Duration::from_micros(1));
        assert_eq!(elapsed.advance(at(2_000_000, 1_002_000_000)), Duration::from_micros(2000));
    }

    #[test]
    fn setting_the_clock_does_not_change_elapsed() {
        for step in [-3_600_000_000_000i64, -20_000_000, 20_000_000, 3_600_000_000_000] {
            let mut elapsed = Elapsed::default();
            let wall = 1_700_000_000_000_000_000u64;
            assert_eq!(elapsed.advance(at(0, wall)), Duration::ZERO);
            assert_eq!(elapsed.advance(at(100_000_000, wall + 100_000_000)), Duration::from_millis(100));
            let set = (wall + 200_000_000).saturating_add_signed(step);
            assert_eq!(elapsed.advance(at(200_000_000, set)), Duration::from_millis(200), "{step}");
            assert_eq!(elapsed.advance(at(300_000_000, set + 100_000_000)), Duration::from_millis(300), "{step}");
        }
    }
}
