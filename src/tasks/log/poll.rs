//! Polling by SDO: every signal of every node once a period, side by side.

use super::{Note, nth};
use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::master::{Answer, Master, SdoError, Ticket};
use crate::measure::decode::{Decoder, Wanted};
use crate::measure::sample::Sample;
use crate::node::Node;
use crate::tasks::Failure;
use crate::tasks::read::{Target, requests, sample, targets};
use std::collections::BTreeMap;
use std::time::Duration;

/// What is polled, and what is under way.
pub(super) struct Poll {
    period: Duration,
    cycles: u64,
    targets: Vec<Target>,
    /// Which of them are read at the moment.
    live: Vec<bool>,
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
        instruments: &[Node],
        wanted: &[Wanted],
        decoder: &mut Decoder,
        period: Duration,
    ) -> Result<Poll, Failure> {
        let mut poll = Poll {
            period,
            cycles: 0,
            targets: Vec::new(),
            live: Vec::new(),
            open: BTreeMap::new(),
            answers: Vec::new(),
            failing: Vec::new(),
        };
        for instrument in instruments {
            poll.renew(instrument, wanted, decoder)?;
        }
        Ok(poll)
    }

    /// What is read of a node from now on. It must have been held before if it was read.
    ///
    /// # Errors
    /// Why nothing can be read of it.
    pub(super) fn renew(&mut self, instrument: &Node, wanted: &[Wanted], decoder: &mut Decoder) -> Result<(), Failure> {
        let mut number = 0;
        // Of several nodes each gives what it has; that somebody has it was checked before.
        let has = |item: &&Wanted| match item {
            Wanted::Signal(name) | Wanted::Status(name) => instrument.signals.iter().any(|signal| signal.name == *name),
            Wanted::Object(_) => true,
        };
        let own: Vec<Wanted> = wanted.iter().filter(has).cloned().collect();
        if own.is_empty() && !wanted.is_empty() {
            return Ok(());
        }
        for mut target in targets(instrument, &own, &mut number)? {
            target.reading.source = decoder.add_source(target.source.clone());
            // The places of what was read of the node before are free by now: a node has one request at a time.
            let is_free = |&at: &usize| {
                !self.live[at] && self.answers[at].under_way == 0 && self.targets[at].source.node == instrument.id
            };
            match (0..self.targets.len()).find(is_free) {
                Some(at) => (self.targets[at], self.live[at], self.failing[at]) = (target, true, false),
                None => {
                    self.targets.push(target);
                    self.live.push(true);
                    self.answers.push(Parts::default());
                    self.failing.push(false);
                }
            }
        }
        Ok(())
    }

    /// Nothing is read of a node any more, and what is under way is thrown away when it comes.
    pub(super) fn hold(&mut self, node: NodeId) {
        for (target, live) in self.targets.iter().zip(&mut self.live) {
            *live &= target.source.node != node;
        }
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
                if !self.live[at] {
                    continue;
                }
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
        if !self.live[at] {
            return None;
        }
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
