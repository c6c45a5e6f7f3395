//! Polling by SDO: every signal of every node once a period, side by side.

use super::{Note, nth};
use crate::bus::Mono;
use crate::master::{Answer, Master, SdoError, Ticket};
use crate::measure::decode::{Decoder, Wanted};
use crate::measure::instrument::Instrument;
use crate::measure::sample::Sample;
use crate::tasks::Failure;
use crate::tasks::read::{Target, requests, sample, targets};
use std::collections::BTreeMap;
use std::time::Duration;

/// What is polled, and what is under way.
pub(super) struct Poll {
    period: Duration,
    cycles: u64,
    targets: Vec<Target>,
    open: BTreeMap<Ticket, (usize, Part)>,
    answers: Vec<Parts>,
    failing: Vec<bool>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Value,
    Status,
}

#[derive(Default)]
struct Parts {
    under_way: usize,
    cycle: u64,
    value: Option<Result<Answer, SdoError>>,
    status: Option<Result<Answer, SdoError>>,
}

impl Poll {
    pub(super) fn new(
        instruments: &[Instrument],
        wanted: &[Wanted],
        decoder: &mut Decoder,
        period: Duration,
    ) -> Result<Poll, Failure> {
        let mut all: Vec<Target> = Vec::new();
        for instrument in instruments {
            let mut number = 0;
            // Of several nodes each gives what it has; that somebody has it was checked before.
            let has = |item: &&Wanted| match item {
                Wanted::Signal(name) | Wanted::Status(name) => {
                    instrument.signals.iter().any(|signal| signal.name == *name)
                }
                Wanted::Object(_) => true,
            };
            let own: Vec<Wanted> = wanted.iter().filter(has).cloned().collect();
            if own.is_empty() && !wanted.is_empty() {
                continue;
            }
            for mut target in targets(instrument, &own, &mut number)? {
                target.reading.source = decoder.add_source(target.source.clone());
                all.push(target);
            }
        }
        let answers = all.iter().map(|_| Parts::default()).collect();
        let failing = vec![false; all.len()];
        Ok(Poll { period, cycles: 0, targets: all, open: BTreeMap::new(), answers, failing })
    }

    /// When the next cycle begins, counted from `begin`.
    pub(super) fn due(&self, begin: Mono) -> Mono {
        begin + nth(self.period, self.cycles)
    }

    /// The number of the next cycle.
    pub(super) fn next_cycle(&self) -> u64 {
        self.cycles
    }

    /// The cycle in which the request of this ticket was begun.
    pub(super) fn cycle_of(&self, ticket: Ticket) -> Option<u64> {
        self.open.get(&ticket).map(|&(at, _)| self.answers[at].cycle)
    }

    /// Begins the cycles that are due. What the cycle before has not finished is skipped, and counted.
    pub(super) fn start_due(&mut self, begin: Mono, now: Mono, master: &mut Master<'_>) -> u64 {
        let mut skipped = 0;
        while self.due(begin) <= now {
            self.cycles += 1;
            for (at, target) in self.targets.iter().enumerate() {
                let parts = &mut self.answers[at];
                if parts.under_way > 0 {
                    skipped += 1;
                    continue;
                }
                parts.cycle = self.cycles - 1;
                // The value last: when it comes the sample is complete, so that rows stand in order of time.
                for (request, part) in requests(target).into_iter().zip([Part::Value, Part::Status]).rev() {
                    self.open.insert(master.start(request), (at, part));
                    parts.under_way += 1;
                }
            }
        }
        skipped
    }

    /// Takes an answer; a complete one becomes a sample. A target that begins to fail is said once.
    pub(super) fn answer(
        &mut self,
        ticket: Ticket,
        result: Result<Answer, SdoError>,
        samples: &mut Vec<Sample>,
    ) -> Option<Note> {
        let (at, part) = self.open.remove(&ticket)?;
        let parts = &mut self.answers[at];
        parts.under_way -= 1;
        match part {
            Part::Value => parts.value = Some(result),
            Part::Status => parts.status = Some(result),
        }
        if parts.under_way > 0 {
            return None;
        }
        let parts = std::mem::take(parts);
        match sample(&self.targets[at], parts.value?, parts.status) {
            Ok(sample) => {
                samples.push(sample);
                self.failing[at] = false;
                None
            }
            Err(error) => {
                let first = !std::mem::replace(&mut self.failing[at], true);
                first.then(|| Note::Remark(format!("node {}: {error}", error.node)))
            }
        }
    }
}
