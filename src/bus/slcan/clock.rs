//! The clock of an adapter: milliseconds that restart at 0 each minute.

use crate::bus::Mono;
use std::time::Duration;

/// Converts the milliseconds of an adapter to a time that does not restart.
#[derive(Debug)]
pub(super) struct MinuteClock {
    /// The number of milliseconds after which the clock restarts.
    period: u32,
    /// The last reading, its receive time, and the time since the first reading.
    last: Option<(u32, Mono, Duration)>,
}

impl Default for MinuteClock {
    fn default() -> MinuteClock {
        MinuteClock { period: 60_000, last: None }
    }
}

impl MinuteClock {
    /// Returns the time from the first reading to `reading`, which was received at `now`.
    pub(super) fn continued(&mut self, reading: u16, now: Mono) -> Duration {
        let reading = u32::from(reading);
        if reading >= self.period {
            // In some firmware the clock restarts only after 65 536 ms (16 bits).
            *self = MinuteClock { period: 0x1_0000, last: None };
        }
        let time = match self.last {
            None => Duration::ZERO,
            Some((last_reading, received_at, time)) => {
                let period = Duration::from_millis(u64::from(self.period));
                let step = Duration::from_millis(u64::from((reading + self.period - last_reading) % self.period));
                // A frame may arrive up to half a minute late, so the number of minutes is rounded.
                let minutes = (now.since(received_at) + period / 2).saturating_sub(step).as_nanos() / period.as_nanos();
                time + step + period * u32::try_from(minutes).unwrap_or(u32::MAX)
            }
        };
        self.last = Some((reading, now, time));
        time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(readings: &[(u64, u16)]) -> Vec<u128> {
        let mut clock = MinuteClock::default();
        readings
            .iter()
            .map(|&(now, reading)| clock.continued(reading, Mono::at(Duration::from_millis(now))).as_millis())
            .collect()
    }

    #[test]
    fn minutes_are_continued() {
        assert_eq!(times(&[(0, 59_990), (25, 5), (60_030, 15), (250_000, 10_000)]), [0, 15, 60_025, 250_010]);
        // A late frame, followed by an early one.
        assert_eq!(times(&[(0, 100), (900, 200), (900, 950), (1000, 1000)]), [0, 100, 850, 900]);
    }

    #[test]
    fn sixteen_bits_are_recognised() {
        assert_eq!(times(&[(0, 59_000), (3000, 62_000), (7000, 464), (72_536, 464)]), [0, 0, 4000, 69_536]);
    }
}
