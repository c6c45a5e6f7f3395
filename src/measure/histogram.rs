//! The distribution of times, in memory that does not grow with their number.
//!
//! Times are counted in buckets. Up to 8.192 us, a bucket is one nanosecond wide; above, its width is less than 0.025 %
//! of the time. A quantile is the middle of its bucket, so its error is at most 0.0125 %. The shortest and the longest
//! time are exact. Buckets are allocated in pages at first use, so similar times need few pages. A bucket counts up to
//! four billion.

use std::time::Duration;

/// Each power of two is divided into 2^12 buckets.
const FINE_BITS: u32 = 12;
/// Buckets in a page.
const PAGE: usize = 64;
/// The upper limit for buckets: 39 hours. All longer times are in one bucket.
const LONGEST_NS: u64 = (1 << 47) - 1;

/// Counts of times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    pages: Vec<Option<Box<[u32; PAGE]>>>,
    count: u64,
    shortest: Option<Duration>,
    longest: Option<Duration>,
}

impl Histogram {
    /// Counts a time.
    pub fn add(&mut self, time: Duration) {
        let bucket = bucket(nanoseconds(time));
        let (page, place) = (bucket / PAGE, bucket % PAGE);
        if self.pages.len() <= page {
            self.pages.resize(page + 1, None);
        }
        let counted = &mut self.pages[page].get_or_insert_with(|| Box::new([0; PAGE]))[place];
        *counted = counted.saturating_add(1);
        self.count += 1;
        self.shortest = Some(self.shortest.map_or(time, |shortest| shortest.min(time)));
        self.longest = Some(self.longest.map_or(time, |longest| longest.max(time)));
    }

    /// Times counted.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The shortest time, exact.
    pub fn shortest(&self) -> Option<Duration> {
        self.shortest
    }

    /// The longest time, exact.
    pub fn longest(&self) -> Option<Duration> {
        self.longest
    }

    /// Returns the time that a `share` (0 to 1) of all times does not exceed. The error is at most 0.0125 %.
    pub fn quantile(&self, share: f64) -> Option<Duration> {
        self.clamped_rank(share, self.buckets())
    }

    /// Returns the distance from `centre` that a `share` (0 to 1) of all times does not exceed. The error is at most
    /// 0.0125 % of the time.
    pub fn distance(&self, centre: Duration, share: f64) -> Option<Duration> {
        // The middle of a bucket may be later than all times in the bucket.
        let farthest = self.farthest(centre)?;
        let centre = nanoseconds(centre);
        let mut distances: Vec<(u64, u64)> =
            self.buckets().map(|(time, count)| (time.abs_diff(centre), count)).collect();
        distances.sort_unstable();
        self.rank(share, distances.into_iter()).map(|distance| distance.min(farthest))
    }

    /// Returns the greatest distance from `centre`, exact.
    pub fn farthest(&self, centre: Duration) -> Option<Duration> {
        Some(centre.abs_diff(self.shortest?).max(centre.abs_diff(self.longest?)))
    }

    /// The middles of the buckets in nanoseconds with their counts, in ascending order.
    fn buckets(&self) -> impl Iterator<Item = (u64, u64)> + '_ {
        let pages = self.pages.iter().enumerate().filter_map(|(at, page)| Some((at, page.as_deref()?)));
        pages.flat_map(|(at, page)| {
            let places = page.iter().enumerate().filter(|(_, count)| **count > 0);
            places.map(move |(place, &count)| (middle(at * PAGE + place), u64::from(count)))
        })
    }

    fn clamped_rank(&self, share: f64, buckets: impl Iterator<Item = (u64, u64)>) -> Option<Duration> {
        let time = self.rank(share, buckets)?;
        // The middle of a bucket may be outside the range of the counted times.
        Some(time.clamp(self.shortest?, self.longest?))
    }

    fn rank(&self, share: f64, buckets: impl Iterator<Item = (u64, u64)>) -> Option<Duration> {
        let wanted = share.clamp(0.0, 1.0) * self.count as f64;
        let mut passed = 0;
        for (time, count) in buckets {
            passed += count;
            if passed as f64 >= wanted {
                return Some(Duration::from_nanos(time));
            }
        }
        None
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(LONGEST_NS).min(LONGEST_NS)
}

/// Returns the bucket of a time: its power of two above 2^13 ns, and the twelve bits after the leading one.
fn bucket(time: u64) -> usize {
    let power = (u64::BITS - time.leading_zeros()).saturating_sub(FINE_BITS + 1);
    usize::try_from((u64::from(power) << FINE_BITS) + (time >> power)).unwrap_or(usize::MAX)
}

/// Returns the time in the middle of a bucket.
fn middle(bucket: usize) -> u64 {
    let bucket = bucket as u64;
    let power = (bucket >> FINE_BITS).saturating_sub(1);
    let low = (bucket - (power << FINE_BITS)) << power;
    low + (1 << power) / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_is_in_its_bucket() {
        let mut time = 0;
        while time < LONGEST_NS {
            for time in [time, time + 1, time.saturating_sub(1)] {
                let middle = middle(bucket(time));
                assert!(middle.abs_diff(time) * 8000 <= time, "{time} became {middle}");
            }
            time = time * 33 / 32 + 1;
        }
        assert_eq!((bucket(8191), bucket(8192), bucket(8193), bucket(8194)), (8191, 8192, 8192, 8193));
    }

    #[test]
    fn quantiles_of_known_times() {
        let mut histogram = Histogram::default();
        assert_eq!((histogram.quantile(0.5), histogram.distance(Duration::ZERO, 0.5)), (None, None));
        for n in 1..=10_000 {
            histogram.add(Duration::from_micros(n));
        }
        let near = |time: Option<Duration>, micros: f64| {
            let time = time.expect("a time").as_secs_f64() * 1e6;
            assert!((time - micros).abs() <= micros * 0.0003, "{time} for {micros}");
        };
        near(histogram.quantile(0.5), 5000.0);
        near(histogram.quantile(0.99), 9900.0);
        near(histogram.quantile(0.0), 1.0);
        near(histogram.quantile(1.0), 10_000.0);
        assert!(histogram.quantile(1.0) <= histogram.longest());
        assert_eq!(histogram.longest(), Some(Duration::from_millis(10)));
        let centre = Duration::from_millis(5);
        let distance = histogram.distance(centre, 0.5).expect("a distance").as_secs_f64();
        assert!((distance - 0.0025).abs() < 0.000_01, "{distance}");
        assert_eq!(histogram.farthest(centre), Some(Duration::from_millis(5)));
    }

    #[test]
    fn distance_of_a_share_is_at_most_the_greatest() {
        for micros in (99_000..101_000).step_by(7) {
            let mut histogram = Histogram::default();
            histogram.add(Duration::from_micros(micros));
            histogram.add(Duration::from_micros(micros + 16));
            let centre = histogram.quantile(0.5).expect("a median");
            assert!(histogram.distance(centre, 0.99) <= histogram.farthest(centre), "{micros}");
        }
    }

    #[test]
    fn memory_depends_on_the_spread_not_on_the_number() {
        let mut histogram = Histogram::default();
        for n in 0..1_000_000u64 {
            histogram.add(Duration::from_nanos(10_000_000 + n * 7919 % 200_000));
        }
        assert!(histogram.pages.iter().flatten().count() <= 4);
        for power in 0..64 {
            histogram.add(Duration::from_nanos(1 << power));
        }
        histogram.add(Duration::MAX);
        assert!(histogram.pages.len() <= 38 * (1 << FINE_BITS) / PAGE);
        assert_eq!((histogram.count(), histogram.longest()), (1_000_065, Some(Duration::MAX)));
    }
}
