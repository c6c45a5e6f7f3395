//! Polls by SDO: every signal of every node once per interval, all nodes in parallel.

use super::multiply;
use super::silence::Silent;
use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::master::{Answer, Master, Request, SdoError, Ticket};
use crate::measure::decode::{Decoder, Wanted};
use crate::measure::sample::{Doubt, Sample};
use crate::node::Node;
use crate::tasks::Failure;
use crate::tasks::read::{Target, objects, sample, targets};
use std::collections::BTreeMap;
use std::time::Duration;

/// The polled objects, and the requests in progress.
pub(super) struct Poll {
    period: Duration,
    cycles: u64,
    targets: Vec<Target>,
    /// Whether each target is polled at present.
    is_polled: Vec<bool>,
    requests: BTreeMap<Ticket, (usize, Part)>,
    answers: Vec<Parts>,
    /// The last answer of each target, if it was an error.
    errors: Vec<Option<SdoError>>,
    /// Whether a status of each target was received; `None` before the first answer. A status object that does not
    /// answer the first request is not requested again.
    has_status: Vec<Option<bool>>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Value,
    Status,
}

#[derive(Default)]
struct Parts {
    open_requests: usize,
    cycle: u64,
    value: Option<Result<Answer, SdoError>>,
    status: Option<Result<Answer, SdoError>>,
}

impl Poll {
    pub(super) fn new(
        nodes: &[Node],
        wanted: &[Wanted],
        decoder: &mut Decoder,
        period: Duration,
    ) -> Result<Poll, Failure> {
        let mut poll = Poll {
            period,
            cycles: 0,
            targets: Vec::new(),
            is_polled: Vec::new(),
            requests: BTreeMap::new(),
            answers: Vec::new(),
            errors: Vec::new(),
            has_status: Vec::new(),
        };
        for node in nodes {
            poll.set_node(node, wanted, decoder)?;
        }
        Ok(poll)
    }

    /// Polls a node from now on. A node that was polled before must be paused first.
    ///
    /// # Errors
    /// A requested signal cannot be read.
    pub(super) fn set_node(&mut self, node: &Node, wanted: &[Wanted], decoder: &mut Decoder) -> Result<(), Failure> {
        let mut number = 0;
        // If a node lacks a requested signal, only its other signals are polled. `check_wanted` ensures that at least
        // one node has the signal.
        let has = |item: &Wanted| match item {
            Wanted::Signal(name) | Wanted::Status(name) => node.signals.iter().any(|signal| signal.name == *name),
            Wanted::Object(..) | Wanted::Named(..) => true,
        };
        let own: Vec<Wanted> = wanted.iter().map(|item| node.wanted(item)).filter(has).collect();
        if own.is_empty() && !wanted.is_empty() {
            return Ok(());
        }
        for mut target in targets(node, &own, &mut number)? {
            target.reading.source = decoder.add_source(target.source.clone());
            // Reuse the entries of earlier targets of this node.
            let is_free = |&at: &usize| {
                !self.is_polled[at] && self.answers[at].open_requests == 0 && self.targets[at].source.node == node.id
            };
            match (0..self.targets.len()).find(is_free) {
                Some(at) => {
                    (self.targets[at], self.is_polled[at], self.errors[at]) = (target, true, None);
                    self.has_status[at] = None;
                }
                None => {
                    self.targets.push(target);
                    self.is_polled.push(true);
                    self.answers.push(Parts::default());
                    self.errors.push(None);
                    self.has_status.push(None);
                }
            }
        }
        Ok(())
    }

    /// Returns the error of the last poll of a silent node or source.
    pub(super) fn error(&self, silent: Silent) -> Option<&SdoError> {
        let is_silent = |target: &Target| match silent {
            Silent::Node(node) => target.source.node == node,
            Silent::Source(_, source) => target.reading.source == source,
        };
        self.targets
            .iter()
            .zip(&self.errors)
            .filter(|(target, _)| is_silent(target))
            .find_map(|(_, error)| error.as_ref())
    }

    /// Stops polling a node. Pending answers are ignored.
    pub(super) fn pause(&mut self, node: NodeId) {
        for (target, is_polled) in self.targets.iter().zip(&mut self.is_polled) {
            *is_polled &= target.source.node != node;
        }
    }

    /// Returns when the next cycle starts. The first cycle starts at `start`.
    pub(super) fn due(&self, start: Mono) -> Mono {
        start + multiply(self.period, self.cycles)
    }

    /// Returns the number of the next cycle.
    pub(super) fn next_cycle(&self) -> u64 {
        self.cycles
    }

    /// Returns the cycle in which this request was sent.
    pub(super) fn cycle_of(&self, ticket: Ticket) -> Option<u64> {
        self.requests.get(&ticket).map(|&(at, _)| self.answers[at].cycle)
    }

    /// Returns the number of cycles that start until `now`.
    fn cycles_until(&self, start: Mono, now: Mono) -> u64 {
        if now < start {
            return 0;
        }
        let cycles = now.since(start).as_nanos() / self.period.as_nanos().max(1) + 1;
        u64::try_from(cycles).unwrap_or(u64::MAX)
    }

    /// Starts the cycles that are due. Returns how many polls were skipped because the previous poll was not finished.
    pub(super) fn start_due(&mut self, start: Mono, now: Mono, master: &mut Master<'_>) -> u64 {
        let cycles = self.cycles_until(start, now);
        let cycle = self.cycles;
        if cycles <= cycle {
            return 0;
        }
        self.cycles = cycles;
        // If several cycles are due, only the first one is started.
        let late = cycles - cycle - 1;
        let mut skipped = 0u64;
        for (at, target) in self.targets.iter().enumerate() {
            if !self.is_polled[at] {
                continue;
            }
            skipped = skipped.saturating_add(late);
            let parts = &mut self.answers[at];
            if parts.open_requests > 0 {
                skipped = skipped.saturating_add(1);
                continue;
            }
            parts.cycle = cycle;
            // The value is requested last, because its answer completes the sample. So rows are in order of time.
            let parts_asked = if self.has_status[at] == Some(false) { 1 } else { 2 };
            let asked: Vec<_> = objects(target).zip([Part::Value, Part::Status]).take(parts_asked).collect();
            for ((node, object), part) in asked.into_iter().rev() {
                self.requests.insert(master.start(Request::read(node, object)), (at, part));
                parts.open_requests += 1;
            }
        }
        skipped
    }

    /// Handles an answer. If all answers for a target were received, adds a sample. Of several consecutive failures,
    /// only the first is returned.
    pub(super) fn on_answer(
        &mut self,
        ticket: Ticket,
        result: Result<Answer, SdoError>,
        decoder: &Decoder,
        samples: &mut Vec<Sample>,
    ) -> Option<SdoError> {
        let (at, part) = self.requests.remove(&ticket)?;
        let parts = &mut self.answers[at];
        parts.open_requests -= 1;
        match part {
            Part::Value => parts.value = Some(result),
            Part::Status => parts.status = Some(result),
        }
        if parts.open_requests > 0 {
            return None;
        }
        let parts = std::mem::take(parts);
        if !self.is_polled[at] {
            return None;
        }
        let target = &self.targets[at];
        match sample(target, parts.value?, parts.status) {
            Ok(mut sample) => {
                decoder.report_overloads(target.source.node, &target.reading, &mut sample);
                self.has_status[at].get_or_insert(sample.doubt != Some(Doubt::UnknownStatus));
                samples.push(sample);
                self.errors[at] = None;
                None
            }
            Err(error) => self.errors[at].replace(error.clone()).is_none().then_some(error),
        }
    }
}
