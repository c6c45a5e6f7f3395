//! How often something comes, when it is a gap, and when a node counts as silent.

use crate::bus::Mono;
use std::time::Duration;

/// A gap is longer than this many usual intervals, where the user has not said what one is.
const GAP: u32 = 3;

/// When something last came, and how often it usually does.
#[derive(Clone, Debug, Default)]
pub(super) struct Rhythm {
    pub(super) last: Option<Mono>,
    usual: Option<Duration>,
    /// Told to be silent, until something comes.
    pub(super) silent: bool,
}

impl Rhythm {
    /// Something came: how long after the last time, if that is more than `max_gap`, or else than three of the
    /// usual intervals.
    pub(super) fn beat(&mut self, now: Mono, max_gap: Option<Duration>) -> Option<Duration> {
        let mut gap = None;
        if let Some(last) = self.last.filter(|&last| last < now) {
            let interval = now.since(last);
            let longest = max_gap.or(self.usual.map(|usual| usual * GAP));
            gap = longest.filter(|&longest| interval > longest).map(|_| interval);
            // A gap is nothing usual, so it counts for no more than the longest interval that is none: the next one
            // is found as well, and who has become slower for good is believed after a few.
            self.usual = Some(match self.usual {
                Some(usual) => (usual * 7 + interval.min(usual * GAP)) / 8,
                None => interval,
            });
        }
        self.last = Some(now);
        gap
    }

    /// How long it may be silent: five of the usual intervals, at least a second.
    fn patience(&self) -> Duration {
        (self.usual.unwrap_or_default() * 5).max(Duration::from_secs(1))
    }

    /// For how long nothing has come, if that is longer than what is usual.
    pub(super) fn silence(&self, now: Mono) -> Option<Duration> {
        self.last.map(|last| now.since(last)).filter(|&silence| silence > self.patience())
    }

    /// Whether nothing has ever come, or nothing any more.
    pub(super) fn is_lost(&self, now: Mono) -> bool {
        self.last.is_none() || self.silence(now).is_some()
    }

    /// Time begins anew: nobody could have been heard until now.
    pub(super) fn excuse(&mut self, now: Mono) {
        self.last = self.last.map(|_| now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(milliseconds: u64) -> Option<Duration> {
        Some(Duration::from_millis(milliseconds))
    }

    fn beats(at: &[u64], max_gap: Option<Duration>) -> Vec<Option<Duration>> {
        let mut rhythm = Rhythm::default();
        let at = at.iter().map(|&milliseconds| Mono::at(Duration::from_millis(milliseconds)));
        at.map(|now| rhythm.beat(now, max_gap)).collect()
    }

    #[test]
    fn a_gap_is_longer_than_three_usual_intervals() {
        assert_eq!(beats(&[0, 10, 20, 50], None), [None; 4]);
        assert_eq!(beats(&[0, 10, 20, 51], None), [None, None, None, ms(31)]);
        assert_eq!(beats(&[0, 10, 20, 30], Some(Duration::from_millis(9))), [None, ms(10), ms(10), ms(10)]);
        assert_eq!(beats(&[0, 10, 1000], Some(Duration::from_secs(1))), [None; 3]);
    }

    #[test]
    fn the_second_gap_is_one_as_well() {
        let gaps = beats(&[0, 10, 20, 5020, 5030, 5040, 5090], None);
        assert_eq!(gaps, [None, None, None, ms(5000), None, None, ms(50)]);
    }

    #[test]
    fn who_has_become_slower_is_believed() {
        let at: Vec<u64> = [0, 10, 20].into_iter().chain((1..20).map(|n| 20 + 100 * n)).collect();
        let gaps = beats(&at, None);
        assert!(gaps.iter().flatten().count() <= 6 && gaps.last() == Some(&None), "{gaps:?}");
    }
}
