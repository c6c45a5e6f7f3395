//! The recording itself: frames in, samples out, and what is known of each node's silence.

use super::passive::Learner;
use super::poll::Poll;
use super::silence::{why_nothing, why_silent};
use super::states::States;
use super::{Mode, Note, Observer, Outcome, PATIENCE, Plan, TICK, nth};
use crate::bus::{Filters, Mono, Received, TimestampSource};
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::Life;
use crate::device::quirk::Quirk;
use crate::master::{Error, Happening, Master};
use crate::measure::decode::{Decoded, Decoder};
use crate::measure::instrument::Instrument;
use crate::measure::sample::{Sample, Source};
use crate::measure::statistics::Statistics;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;

/// When a node last gave something, and how often it does.
#[derive(Clone, Debug, Default)]
struct Pulse {
    last: Option<Mono>,
    interval: Option<Duration>,
    silent: bool,
}

impl Pulse {
    /// Something came: how long after the last time, if that is more than three of the usual intervals.
    fn beat(&mut self, now: Mono) -> Option<Duration> {
        let mut gap = None;
        if let Some(last) = self.last.filter(|&last| last < now) {
            let interval = now.since(last);
            gap = self.interval.filter(|&usual| interval > usual * 3).map(|_| interval);
            self.interval = Some(self.interval.map_or(interval, |usual| (usual * 7 + interval) / 8));
        }
        self.last = Some(now);
        gap
    }
}

pub(super) struct Recording {
    pub(super) decoder: Decoder,
    statistics: Vec<Statistics>,
    rhythms: Vec<Pulse>,
    pulses: BTreeMap<NodeId, Pulse>,
    emergencies_of: BTreeMap<CanId, NodeId>,
    /// What the descriptions say of each emergency code.
    meanings: BTreeMap<(NodeId, u16), String>,
    /// The last emergency of nodes that tell a pending one again and again ([`Quirk::EmergencyRepeats`]).
    repeating: BTreeMap<NodeId, Option<Emergency>>,
    timestamps: TimestampSource,
    pub(super) rows: u64,
    first: Option<Mono>,
    end: Mono,
    dropped: u64,
    emergencies: u64,
    gaps: u64,
    syncs: u64,
    /// SYNCs whose time had passed.
    left_out: u64,
    skipped: u64,
    wrong_length_said: BTreeSet<NodeId>,
    pub(super) remarks: Vec<String>,
    pub(super) interrupted: bool,
    samples: Vec<Sample>,
    pub(super) learner: Option<Learner>,
}

impl Recording {
    pub(super) fn new(instruments: &[Instrument], plan: &Plan, timestamps: TimestampSource) -> Recording {
        Recording {
            decoder: Decoder::default(),
            statistics: Vec::new(),
            rhythms: Vec::new(),
            // Who only listens waits for nobody in particular.
            pulses: plan
                .nodes
                .iter()
                .filter(|_| plan.mode != Mode::Passive)
                .map(|&node| (node, Pulse::default()))
                .collect(),
            meanings: instruments.iter().flat_map(meanings).collect(),
            repeating: instruments
                .iter()
                .filter(|instrument| repeats(instrument))
                .map(|instrument| (instrument.node, None))
                .collect(),
            emergencies_of: instruments.iter().map(|instrument| (instrument.emergency, instrument.node)).collect(),
            timestamps,
            rows: 0,
            first: None,
            end: Mono::START,
            dropped: 0,
            emergencies: 0,
            gaps: 0,
            syncs: 0,
            left_out: 0,
            skipped: 0,
            wrong_length_said: BTreeSet::new(),
            remarks: Vec::new(),
            interrupted: false,
            samples: Vec::new(),
            learner: None,
        }
    }

    /// Of several nodes each gives what it has of what is wanted; who has nothing of it is not waited for.
    pub(super) fn excuse(&mut self, plan: &Plan) {
        if plan.wanted.is_empty() {
            return;
        }
        let sources = self.decoder.sources();
        let (giving, others): (Vec<NodeId>, Vec<NodeId>) =
            self.pulses.keys().copied().partition(|node| sources.iter().any(|source| source.node == *node));
        if giving.is_empty() {
            return;
        }
        for node in others {
            self.pulses.remove(&node);
            self.remarks.push(format!("node {node} gives nothing of what is wanted"));
        }
    }

    pub(super) fn expect_sources(&mut self) {
        self.statistics.resize(self.decoder.sources().len(), Statistics::default());
        self.rhythms.resize(self.decoder.sources().len(), Pulse::default());
    }

    /// TPDOs, emergencies, heartbeats, SDO answers and SYNC of the nodes recorded, nothing else.
    pub(super) fn filters(&self, instruments: &[Instrument]) -> Filters {
        let mut ids: Vec<CanId> = self.decoder.can_ids().collect();
        for instrument in instruments {
            let node = instrument.node;
            ids.extend([instrument.emergency, instrument.sync, CanId::heartbeat(node)]);
            ids.extend([CanId::sdo_response(node), CanId::sdo_request(node)]);
        }
        ids.sort_unstable();
        ids.dedup();
        Filters::Only(ids)
    }

    pub(super) fn run(
        &mut self,
        master: &mut Master<'_>,
        plan: &Plan,
        instruments: &[Instrument],
        states: &mut States,
        mut poll: Option<&mut Poll>,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        let begin = master.now();
        self.end = begin;
        let stop = plan.duration.map(|duration| begin + duration);
        // A recording may begin long before what is looked for in it, and it comes to an end.
        let patience = if master.bus().is_live() { PATIENCE } else { Duration::MAX };
        let give_up = begin + plan.duration.unwrap_or(patience).min(patience);
        let sync = match plan.mode {
            Mode::Sync(period) => Some((period, instruments.first().map_or(CanId::SYNC, |first| first.sync))),
            _ => None,
        };
        let mut next_tick = begin + TICK;
        let mut slot = 0;
        loop {
            let mut until = next_tick;
            if self.rows == 0 {
                until = until.min(give_up);
            }
            if let Some(stop) = stop {
                until = until.min(stop);
            }
            // Computed from the beginning, never from the last one: no drift.
            if let Some((period, _)) = sync {
                until = until.min(begin + nth(period, slot));
            }
            if let Some(poll) = &poll {
                until = until.min(poll.due(begin));
            }
            let flow = match master.next(until)? {
                Happening::Frame(received) => self.frame(&received, plan, states, master, observer),
                Happening::Sdo(ticket, result) => match &mut poll {
                    Some(poll) => {
                        self.samples.clear();
                        let cycle = poll.cycle_of(ticket);
                        if let Some(note) = poll.answer(ticket, result, &mut self.samples) {
                            observer.note(&note, master.bus().now());
                        }
                        self.take_samples(plan, cycle, observer)
                    }
                    None => ControlFlow::Continue(()),
                },
                Happening::Deadline => {
                    self.end = until;
                    if stop.is_some_and(|stop| until >= stop) || self.rows == 0 && until >= give_up {
                        return Ok(());
                    }
                    if let Some((period, id)) = sync
                        && until >= begin + nth(period, slot)
                    {
                        if observer.cycle(slot, master.bus().now()).is_break() {
                            return Ok(());
                        }
                        let is_sent = master.send_first(Frame::empty(id));
                        self.syncs += u64::from(is_sent);
                        let next = next_slot(begin, master.now(), period, slot);
                        self.left_out += next - slot - u64::from(is_sent);
                        slot = next;
                    }
                    if let Some(poll) = &mut poll {
                        if poll.due(begin) <= until && observer.cycle(poll.next_cycle(), master.bus().now()).is_break()
                        {
                            return Ok(());
                        }
                        self.skipped += poll.start_due(begin, until, master);
                    }
                    self.watch_pulses(until, master, observer);
                    if until >= next_tick {
                        next_tick = until + TICK;
                        observer.tick(master.bus().now(), self.rows)
                    } else {
                        ControlFlow::Continue(())
                    }
                }
                Happening::Fault(fault, at) => {
                    observer.note(&Note::Fault(fault), at);
                    ControlFlow::Continue(())
                }
                Happening::Dropped(count) => {
                    self.dropped += u64::from(count);
                    observer.note(&Note::Dropped(count), master.bus().now());
                    ControlFlow::Continue(())
                }
                Happening::Link(up) => {
                    observer.note(&Note::Link(up), master.bus().now());
                    ControlFlow::Continue(())
                }
                Happening::Ended => return Ok(()),
                Happening::Interrupted => {
                    self.interrupted = true;
                    if self.rows == 0 {
                        return Err(Error::Interrupted);
                    }
                    return Ok(());
                }
            };
            if flow.is_break() {
                return Ok(());
            }
        }
    }

    fn frame(
        &mut self,
        received: &Received,
        plan: &Plan,
        states: &mut States,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> ControlFlow<()> {
        self.end = received.at.mono;
        self.samples.clear();
        if let Some(learner) = &mut self.learner {
            learner.take(received, &mut self.decoder);
            self.expect_sources();
        }
        match self.decoder.decode(received, &mut self.samples) {
            Decoded::Tpdo(_) => return self.take_samples(plan, None, observer),
            Decoded::WrongLength(node) => {
                if self.wrong_length_said.insert(node) {
                    observer.note(&Note::WrongLength(node), received.at);
                }
            }
            Decoded::NotOurs => {
                let frame = &received.frame;
                if let (Some(&node), Some(emergency)) = (self.emergencies_of.get(&frame.id()), Emergency::parse(frame))
                {
                    if self.repeating.get_mut(&node).is_some_and(|last| last.replace(emergency) == Some(emergency)) {
                        return ControlFlow::Continue(());
                    }
                    self.emergencies += 1;
                    let meaning = self.meanings.get(&(node, emergency.code));
                    let meaning = meaning.map_or_else(|| Emergency::class(emergency.code), String::as_str);
                    observer.note(&Note::Emergency(node, emergency, meaning.to_owned()), received.at);
                } else if let Some((node, life)) = Life::parse(frame)
                    && self.pulses.contains_key(&node)
                    && states.take(node, life, master)
                {
                    observer.note(&Note::Restarted(node), received.at);
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Hands the samples on; `cycle` is that of the poll which they answer.
    fn take_samples(&mut self, plan: &Plan, cycle: Option<u64>, observer: &mut dyn Observer) -> ControlFlow<()> {
        let Some(last) = self.samples.last() else { return ControlFlow::Continue(()) };
        let at = last.at;
        if let Some(count) = plan.count {
            let left = usize::try_from(count - self.rows).unwrap_or(usize::MAX);
            self.samples.truncate(left);
        }
        self.first.get_or_insert(self.samples.first().map_or(at.mono, |sample| sample.at.mono));
        self.end = self.end.max(at.mono);
        let sources = self.decoder.sources();
        let mut node = None;
        // A gap is one of a TPDO or a poll, and so of the first of the values that come together.
        if let Some(first) = self.samples.first()
            && let Some(length) = self.rhythms[first.source].beat(at.mono)
        {
            self.gaps += 1;
            observer.note(&Note::Gap(sources[first.source].node, length), at);
        }
        for sample in &self.samples {
            self.statistics[sample.source].add(sample.value.map(|value| value.as_f64()), sample.at.mono.since_start());
            node = Some(sources[sample.source].node);
        }
        if let Some(node) = node {
            let pulse = self.pulses.entry(node).or_default();
            pulse.beat(at.mono);
            if std::mem::take(&mut pulse.silent) {
                observer.note(&Note::Back(node), at);
            }
        }
        self.rows += self.samples.len() as u64;
        match cycle {
            Some(cycle) => observer.polled(cycle, &self.samples, sources)?,
            None => observer.samples(&self.samples, sources)?,
        }
        match plan.count {
            Some(count) if self.rows >= count => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    }

    /// Says once when a node that used to give something gives nothing any more.
    fn watch_pulses(&mut self, now: Mono, master: &Master<'_>, observer: &mut dyn Observer) {
        for (&node, pulse) in &mut self.pulses {
            if let (Some(last), false) = (pulse.last, pulse.silent)
                && now.since(last) > patience(pulse)
            {
                pulse.silent = true;
                observer.note(&Note::Silent(node, now.since(last)), master.bus().now());
            }
        }
    }

    pub(super) fn outcome(mut self, instruments: &[Instrument], plan: &Plan) -> Outcome {
        let lost: Vec<NodeId> = self
            .pulses
            .iter()
            .filter(|(_, pulse)| pulse.last.is_none_or(|last| self.end.since(last) > patience(pulse)))
            .map(|(&node, _)| node)
            .collect();
        if self.left_out > 0 {
            self.remarks.push(format!("{} SYNC left out: the program was stopped or too slow", self.left_out));
        }
        let nothing = (self.rows == 0).then(|| why_nothing(instruments, plan, &self));
        for &node in lost.iter().filter(|_| self.rows > 0) {
            if let Some(instrument) = instruments.iter().find(|instrument| instrument.node == node)
                && self.pulses[&node].last.is_none()
            {
                let (why, _) = why_silent(instrument, plan.mode);
                self.remarks.push(format!("node {node}: no measurements: {why}"));
            }
        }
        // A unit or a mapping that was learned on the way replaces what was known before; what gave nothing
        // under its old name is no source of its own.
        let statistics: Vec<(Source, Statistics)> =
            self.decoder.sources().iter().cloned().zip(self.statistics).collect();
        let named_again = |at: usize, source: &Source| {
            let others = statistics.iter().enumerate().filter(|&(other, _)| other > at);
            others.into_iter().any(|(_, (other, _))| (other.node, &other.signal) == (source.node, &source.signal))
        };
        let kept = |(at, (source, statistics)): (usize, &(Source, Statistics))| {
            let empty = statistics.count() == 0 && statistics.invalid() == 0;
            (!(empty && named_again(at, source))).then(|| (source.clone(), statistics.clone()))
        };
        let statistics = statistics.iter().enumerate().filter_map(kept).collect();
        Outcome {
            rows: self.rows,
            length: self.first.map_or(Duration::ZERO, |first| self.end.since(first)),
            statistics,
            lost,
            nothing,
            dropped: self.dropped,
            emergencies: self.emergencies,
            gaps: self.gaps,
            skipped: self.skipped,
            syncs: self.syncs,
            timestamps: self.timestamps,
            remarks: self.remarks,
            interrupted: self.interrupted,
        }
    }
}

/// When the next SYNC is due after that of `slot`. A program that was stopped makes up for none: a burst would
/// be no rhythm, and two would be closer together than anybody asked for.
fn next_slot(begin: Mono, now: Mono, period: Duration, slot: u64) -> u64 {
    let passed = now.since(begin).as_nanos() / period.as_nanos().max(1);
    let passed = u64::try_from(passed).unwrap_or(u64::MAX - 2);
    if passed <= slot {
        return slot + 1;
    }
    let next = begin + nth(period, passed + 1);
    if next.since(now) * 2 < period { passed + 2 } else { passed + 1 }
}

/// How long a node may be silent: five of its usual intervals, at least a second.
fn patience(pulse: &Pulse) -> Duration {
    (pulse.interval.unwrap_or_default() * 5).max(Duration::from_secs(1))
}

fn repeats(instrument: &Instrument) -> bool {
    instrument.model.as_ref().is_some_and(|model| model.description.quirks.contains(&Quirk::EmergencyRepeats))
}

fn meanings(instrument: &Instrument) -> impl Iterator<Item = ((NodeId, u16), String)> {
    let described = instrument.model.as_ref().map_or(&[][..], |model| &model.description.emergencies);
    described.iter().map(|entry| ((instrument.node, entry.code), entry.text.clone()))
}
