//! The usual interval of messages. It determines gaps, and the time after which a sender is silent.

use crate::bus::Mono;
use std::time::Duration;

/// Without `--max-gap`, an interval longer than this many usual intervals is a gap.
const GAP_FACTOR: u64 = 3;

/// A sender is silent after this many usual intervals.
const SILENCE_FACTOR: u32 = 5;

/// A sender is never silent before this time.
const MIN_SILENCE: Duration = Duration::from_secs(1);

/// The usual interval of a message, and the time of the last one.
#[derive(Clone, Debug, Default)]
pub struct IntervalTracker {
    last: Option<Mono>,
    /// In nanoseconds, because it is calculated again for every frame of a recording.
    usual: Option<u64>,
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

impl IntervalTracker {
    /// Adds a message received at `now`. Returns the interval since the last message if it is a gap. Without `max_gap`,
    /// a gap is longer than three usual intervals.
    pub fn add(&mut self, now: Mono, max_gap: Option<Duration>) -> Option<Duration> {
        let mut gap = None;
        if let Some(last) = self.last.filter(|&last| last < now) {
            let interval = nanoseconds(now.since(last));
            let longest = max_gap.map(nanoseconds).or(self.usual.map(|usual| usual.saturating_mul(GAP_FACTOR)));
            gap = longest.filter(|&longest| interval > longest).map(|_| Duration::from_nanos(interval));
            // For the average, an interval is limited to three usual intervals. So one gap does not hide the next gap.
            // If a sender becomes slower, the average follows within a few messages.
            self.usual = Some(match self.usual {
                Some(usual) => {
                    let interval = interval.min(usual.saturating_mul(GAP_FACTOR));
                    usual.saturating_mul(7).saturating_add(interval) / 8
                }
                None => interval,
            });
        }
        self.last = Some(now);
        gap
    }

    /// The usual interval; `None` before the second message.
    pub fn usual(&self) -> Option<Duration> {
        self.usual.map(Duration::from_nanos)
    }

    /// Whether a message was received so far.
    pub fn has_received(&self) -> bool {
        self.last.is_some()
    }

    /// Returns the time since the last message, if it is so long that the sender is silent.
    pub fn silence(&self, now: Mono) -> Option<Duration> {
        let limit = (self.usual().unwrap_or_default() * SILENCE_FACTOR).max(MIN_SILENCE);
        self.last.map(|last| now.since(last)).filter(|&silence| silence > limit)
    }

    /// Whether no message was received so far, or none for longer than usual.
    pub fn is_lost(&self, now: Mono) -> bool {
        self.last.is_none() || self.silence(now).is_some()
    }

    /// Measures silence from now on, because nothing could be received before.
    pub fn restart(&mut self, now: Mono) {
        self.last = self.last.map(|_| now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(milliseconds: u64) -> Option<Duration> {
        Some(Duration::from_millis(milliseconds))
    }

    fn gaps(at: &[u64], max_gap: Option<Duration>) -> Vec<Option<Duration>> {
        let mut tracker = IntervalTracker::default();
        let at = at.iter().map(|&milliseconds| Mono::at(Duration::from_millis(milliseconds)));
        at.map(|now| tracker.add(now, max_gap)).collect()
    }

    #[test]
    fn gap_is_longer_than_three_usual_intervals() {
        assert_eq!(gaps(&[0, 10, 20, 50], None), [None; 4]);
        assert_eq!(gaps(&[0, 10, 20, 51], None), [None, None, None, ms(31)]);
        assert_eq!(gaps(&[0, 10, 20, 30], Some(Duration::from_millis(9))), [None, ms(10), ms(10), ms(10)]);
        assert_eq!(gaps(&[0, 10, 1000], Some(Duration::from_secs(1))), [None; 3]);
    }

    #[test]
    fn second_gap_is_detected() {
        let gaps = gaps(&[0, 10, 20, 5020, 5030, 5040, 5090], None);
        assert_eq!(gaps, [None, None, None, ms(5000), None, None, ms(50)]);
    }

    #[test]
    fn slower_interval_becomes_the_usual_one() {
        let at: Vec<u64> = [0, 10, 20].into_iter().chain((1..20).map(|n| 20 + 100 * n)).collect();
        let gaps = gaps(&at, None);
        assert!(gaps.iter().flatten().count() <= 6 && gaps.last() == Some(&None), "{gaps:?}");
    }
}
