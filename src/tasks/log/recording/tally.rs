//! Counts and statistics of a recording.

use super::super::events::EventCounts;
use super::super::producer::SyncStatistics;
use crate::bus::Mono;
use crate::measure::interval::IntervalTracker;
use crate::measure::sample::{Sample, Source};
use crate::measure::statistics::Statistics;
use std::time::Duration;

/// The counts of a recording so far.
#[derive(Debug)]
pub(super) struct Tally {
    /// The statistics per source.
    statistics: Vec<Statistics>,
    /// The intervals per source. Gaps are counted at the first value of a TPDO or poll.
    intervals: Vec<IntervalTracker>,
    /// Values recorded.
    pub(super) rows: u64,
    first: Option<Mono>,
    end: Mono,
    /// Frames dropped by the kernel.
    pub(super) dropped: u64,
    /// Emergency messages.
    pub(super) emergencies: u64,
    /// Intervals that were too long.
    pub(super) gaps: u64,
    /// Polls that were not sent because the previous poll was not finished.
    pub(super) skipped: u64,
    /// Other events.
    pub(super) events: EventCounts,
    /// SYNC messages sent.
    pub(super) syncs: SyncStatistics,
}

impl Tally {
    pub(super) fn new() -> Tally {
        Tally {
            statistics: Vec::new(),
            intervals: Vec::new(),
            rows: 0,
            first: None,
            end: Mono::START,
            dropped: 0,
            emergencies: 0,
            gaps: 0,
            skipped: 0,
            events: EventCounts::default(),
            syncs: SyncStatistics::default(),
        }
    }

    /// Adds entries for all sources. A signal with a new unit keeps its usual interval.
    pub(super) fn set_sources(&mut self, sources: &[Source]) {
        self.statistics.resize(sources.len(), Statistics::default());
        for source in sources.iter().skip(self.intervals.len()) {
            let same = sources.iter().zip(&self.intervals).rfind(|(other, _)| is_same_signal(other, source));
            self.intervals.push(same.map(|(_, intervals)| intervals.clone()).unwrap_or_default());
        }
    }

    /// Counts samples that were received together. Returns the interval before them if it was a gap.
    pub(super) fn add(&mut self, samples: &[Sample], max_gap: Option<Duration>) -> Option<Duration> {
        let (first, last) = (samples.first()?, samples.last()?);
        self.first.get_or_insert(first.at.mono);
        self.extend_to(last.at.mono);
        let gap = self.intervals[first.source].add(last.at.mono, max_gap);
        self.gaps += u64::from(gap.is_some());
        for sample in samples {
            let statistics = &mut self.statistics[sample.source];
            statistics.add(sample.value.map(|value| value.as_f64()), sample.at.mono.since_start());
            if gap.is_some() {
                statistics.add_gap();
            }
        }
        self.rows += samples.len() as u64;
        gap
    }

    /// Returns the number of values of a source.
    pub(super) fn count(&self, source: usize) -> u64 {
        self.statistics.get(source).map_or(0, Statistics::count)
    }

    /// Moves the end of the recording to this time, but never back.
    pub(super) fn extend_to(&mut self, at: Mono) {
        self.end = self.end.max(at);
    }

    /// Sets the end to the last row. This may be before the start, if all rows come from frames received earlier.
    pub(super) fn end_at(&mut self, at: Mono) {
        self.end = at;
    }

    /// Returns the end of the recording.
    pub(super) fn end(&self) -> Mono {
        self.end
    }

    /// Returns the time between the first row and the end.
    pub(super) fn length(&self) -> Duration {
        self.first.map_or(Duration::ZERO, |first| self.end.since(first))
    }

    /// Returns the statistics of each source. A source without samples is omitted if its signal has a later source,
    /// because its unit was unknown at first.
    pub(super) fn into_statistics(self, sources: &[Source]) -> Vec<(Source, Statistics)> {
        let is_replaced = |at: usize| sources[at + 1..].iter().any(|later| is_same_signal(later, &sources[at]));
        let counted = self.statistics.into_iter().zip(sources).enumerate();
        counted
            .filter(|(at, (statistics, _))| statistics.count() > 0 || !is_replaced(*at))
            .map(|(_, (statistics, source))| (source.clone(), statistics))
            .collect()
    }
}

fn is_same_signal(one: &Source, other: &Source) -> bool {
    (one.node, &one.signal) == (other.node, &other.signal)
}
