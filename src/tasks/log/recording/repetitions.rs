//! Limits how often equal events are reported.

use crate::bus::Mono;
use std::time::Duration;

/// The first of equal events is reported at once. Then their number is reported at this interval.
const REPEAT_INTERVAL: Duration = Duration::from_secs(1);

/// The events that were reported less than [`REPEAT_INTERVAL`] ago.
#[derive(Debug)]
pub(super) struct Repetitions<T> {
    recent: Vec<Recent<T>>,
}

/// An event that was reported.
#[derive(Debug)]
struct Recent<T> {
    event: T,
    reported: Mono,
    /// The number of equal events since then.
    count: u64,
}

impl<T> Default for Repetitions<T> {
    fn default() -> Self {
        Repetitions { recent: Vec::new() }
    }
}

impl<T: Copy> Repetitions<T> {
    /// Handles an event. Returns whether to report it now; if not, it is counted.
    pub(super) fn is_new(&mut self, event: T, is_same: impl Fn(&T) -> bool, now: Mono) -> bool {
        if let Some(recent) = self.recent.iter_mut().find(|recent| is_same(&recent.event)) {
            recent.count += 1;
            return false;
        }
        self.recent.push(Recent { event, reported: now, count: 0 });
        true
    }

    /// Returns an event that was repeated, and the number of repetitions since its last report. With `at_end`, the
    /// interval need not be over.
    pub(super) fn next(&mut self, now: Mono, at_end: bool) -> Option<(T, u64)> {
        let is_over = |recent: &Recent<T>| at_end || now.since(recent.reported) >= REPEAT_INTERVAL;
        self.recent.retain(|recent| recent.count > 0 || !is_over(recent));
        let recent = self.recent.iter_mut().find(|recent| is_over(recent))?;
        recent.reported = now;
        Some((recent.event, std::mem::take(&mut recent.count)))
    }
}
