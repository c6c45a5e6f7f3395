//! The two time lines of a bus: a monotonic one for waiting and measuring, and the wall clock for files.

use std::ops::{Add, Sub};
use std::time::{Duration, Instant, SystemTime};

/// A moment on the monotonic time line of a bus: the time since the bus was opened.
///
/// This is not a [`std::time::Instant`], because a simulated bus has a virtual clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mono(Duration);

impl Mono {
    /// The moment the bus was opened.
    pub const START: Mono = Mono(Duration::ZERO);

    /// The moment `since_start` after the bus was opened.
    pub fn at(since_start: Duration) -> Mono {
        Mono(since_start)
    }

    /// The time since the bus was opened.
    pub fn since_start(self) -> Duration {
        self.0
    }

    /// The time from `earlier` to `self`; zero if `self` is not later.
    pub fn since(self, earlier: Mono) -> Duration {
        self.0.saturating_sub(earlier.0)
    }

    /// Returns the earlier of two moments, or the only one.
    pub fn earlier(one: Option<Mono>, other: Option<Mono>) -> Option<Mono> {
        match (one, other) {
            (Some(one), Some(other)) => Some(if other < one { other } else { one }),
            (one, None) => one,
            (None, other) => other,
        }
    }
}

/// Saturates at the last moment of the type.
impl Add<Duration> for Mono {
    type Output = Mono;

    fn add(self, by: Duration) -> Mono {
        Mono(self.0.saturating_add(by))
    }
}

/// Saturates at [`Mono::START`].
impl Sub<Duration> for Mono {
    type Output = Mono;

    fn sub(self, by: Duration) -> Mono {
        Mono(self.0.saturating_sub(by))
    }
}

/// A moment on the wall clock: time since 1970-01-01 00:00 UTC.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Wall(Duration);

impl Wall {
    /// The end of the year 9999, the last moment that RFC 3339 can write.
    pub const LAST: Wall = Wall(Duration::new(253_402_300_799, 999_999_999));

    /// The moment `since_epoch` after 1970-01-01 00:00 UTC.
    pub const fn at(since_epoch: Duration) -> Wall {
        Wall(since_epoch)
    }

    /// The present time of the clock of the host; 1970 if the clock is earlier.
    pub fn now() -> Wall {
        Wall(SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default())
    }

    /// Time since 1970-01-01 00:00 UTC.
    pub fn since_epoch(self) -> Duration {
        self.0
    }

    /// Converts to the type of the standard library; at most [`Wall::LAST`].
    pub fn system_time(self) -> SystemTime {
        SystemTime::UNIX_EPOCH + self.0.min(Wall::LAST.0)
    }
}

/// Saturates at the last moment of the type.
impl Add<Duration> for Wall {
    type Output = Wall;

    fn add(self, by: Duration) -> Wall {
        Wall(self.0.saturating_add(by))
    }
}

/// A moment on both time lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// The time for intervals and deadlines.
    pub mono: Mono,
    /// The time for users and files.
    pub wall: Wall,
}

/// The two clocks of the host, for a program without a bus.
#[derive(Clone, Copy, Debug)]
pub struct HostClock(Instant);

impl HostClock {
    /// Creates a clock whose monotonic time starts now.
    #[expect(clippy::new_without_default, reason = "it reads a clock")]
    pub fn new() -> HostClock {
        HostClock(Instant::now())
    }

    /// The present moment.
    pub fn now(&self) -> Stamp {
        Stamp { mono: Mono::at(self.0.elapsed()), wall: Wall::now() }
    }
}

/// Returns how far the local time of the host is ahead of UTC at the moment `at`; 0 if unknown. Both values are in
/// microseconds, and `at` counts from 1970.
#[cfg(unix)]
#[allow(unsafe_code)]
pub fn ahead_of_utc(at: i64) -> i64 {
    #[allow(clippy::cast_possible_truncation, clippy::unnecessary_cast)]
    let seconds = at.div_euclid(1_000_000) as libc::time_t;
    // SAFETY: `tm` is a plain C structure for which zero is a valid value in every field.
    let mut fields: libc::tm = unsafe { std::mem::zeroed() };
    // SAFETY: `localtime_r` reads and writes only the values that it is given.
    let is_known = unsafe { !libc::localtime_r(&raw const seconds, &raw mut fields).is_null() };
    // `tm_gmtoff` has another type on some systems.
    #[allow(clippy::useless_conversion)]
    let seconds = i64::from(fields.tm_gmtoff);
    if is_known { seconds * 1_000_000 } else { 0 }
}

/// Returns 0, because time zones are unknown on this system.
#[cfg(not(unix))]
pub fn ahead_of_utc(_: i64) -> i64 {
    0
}

/// Formats a duration for users: `500 ms`, `5 s`, `2.5 s`, `1h 30m`.
pub fn format_duration(length: Duration) -> String {
    let milliseconds = length.as_millis();
    if length >= Duration::from_secs(60) {
        humantime::format_duration(Duration::from_secs(length.as_secs())).to_string()
    } else if milliseconds >= 1000 {
        format!("{} s", (length.as_secs_f64() * 1000.0).round() / 1000.0)
    } else if milliseconds >= 1 {
        format!("{} ms", (length.as_secs_f64() * 1e6).round() / 1000.0)
    } else {
        format!("{} us", length.as_micros())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_moments_saturate() {
        let last = Mono::at(Duration::MAX);
        assert_eq!(last + Duration::from_nanos(1), last);
        assert_eq!(Mono::at(Duration::from_secs(1)) + Duration::MAX, last);
        assert_eq!(Mono::at(Duration::from_secs(1)) - Duration::MAX, Mono::START);
        assert_eq!((Mono::START.since(last), last.since(Mono::START)), (Duration::ZERO, Duration::MAX));
        assert_eq!(Wall::now() + Duration::MAX, Wall::at(Duration::MAX));
    }

    #[test]
    fn a_wall_time_beyond_the_year_9999_is_capped_for_the_standard_library() {
        assert_eq!(Wall::at(Duration::MAX).system_time(), Wall::LAST.system_time());
        assert_eq!(humantime::format_rfc3339_millis(Wall::LAST.system_time()).to_string(), "9999-12-31T23:59:59.999Z");
    }

    #[test]
    fn lengths_in_words() {
        for (length, words) in [
            (Duration::from_millis(500), "500 ms"),
            (Duration::from_secs(5), "5 s"),
            (Duration::from_millis(2500), "2.5 s"),
            (Duration::from_micros(1500), "1.5 ms"),
            (Duration::from_micros(80), "80 us"),
            (Duration::from_secs(5400), "1h 30m"),
        ] {
            assert_eq!(format_duration(length), words);
        }
    }
}
