//! The recording itself: frames in, samples out.

mod incidents;
mod outcome;

use super::events::Events;
use super::hearts::Hearts;
use super::passive::Learner;
use super::poll::Poll;
use super::producer::{Producer, Syncs};
use super::renewal::Renewals;
use super::rhythm::Rhythm;
use super::states::States;
use super::{Mode, Note, Observer, PATIENCE, Plan, TICK};
use crate::bus::{Bus, Filters, Mono, ReceiveBuffer, Received, TimestampSource};
use crate::canopen::emcy::Emergency;
use crate::canopen::id::{CanId, NodeId};
use crate::master::{Answer, Error, Happening, Master, SdoError, Ticket};
use crate::measure::decode::{Decoded, Decoder};
use crate::measure::sample::{Sample, Source};
use crate::measure::statistics::Statistics;
use crate::node::Node;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

pub(super) struct Recording {
    pub(super) instruments: Vec<Node>,
    pub(super) decoder: Decoder,
    pub(super) poll: Option<Poll>,
    pub(super) states: States,
    pub(super) learner: Option<Learner>,
    statistics: Vec<Statistics>,
    rhythms: Vec<Rhythm>,
    pulses: BTreeMap<NodeId, Rhythm>,
    hearts: Hearts,
    renewals: Renewals,
    emergencies_of: BTreeMap<CanId, NodeId>,
    /// What the descriptions say of each emergency code.
    meanings: BTreeMap<(NodeId, u16), String>,
    /// The last emergency of nodes that tell a pending one again and again ([`Quirk::EmergencyRepeats`]).
    ///
    /// [`Quirk::EmergencyRepeats`]: crate::device::quirk::Quirk::EmergencyRepeats
    repeating: BTreeMap<NodeId, Option<Emergency>>,
    timestamps: TimestampSource,
    receive_buffer: Option<ReceiveBuffer>,
    pub(super) rows: u64,
    first: Option<Mono>,
    end: Mono,
    dropped: u64,
    emergencies: u64,
    gaps: u64,
    events: Events,
    syncs: Syncs,
    skipped: u64,
    link_is_up: bool,
    wrong_length_said: BTreeSet<NodeId>,
    pub(super) remarks: Vec<String>,
    pub(super) interrupted: bool,
    samples: Vec<Sample>,
}

impl Recording {
    pub(super) fn new(instruments: Vec<Node>, plan: &Plan, bus: &dyn Bus) -> Recording {
        let mut recording = Recording {
            decoder: Decoder::default(),
            poll: None,
            states: States::default(),
            learner: None,
            statistics: Vec::new(),
            rhythms: Vec::new(),
            // Who only listens waits for nobody in particular.
            pulses: plan
                .nodes
                .iter()
                .filter(|_| plan.mode != Mode::Passive)
                .map(|&node| (node, Rhythm::default()))
                .collect(),
            hearts: Hearts::default(),
            renewals: Renewals::new(&plan.overrides),
            emergencies_of: BTreeMap::new(),
            meanings: BTreeMap::new(),
            repeating: BTreeMap::new(),
            timestamps: bus.timestamps(),
            receive_buffer: bus.receive_buffer(),
            rows: 0,
            first: None,
            end: Mono::START,
            dropped: 0,
            emergencies: 0,
            gaps: 0,
            events: Events::default(),
            syncs: Syncs::default(),
            skipped: 0,
            link_is_up: true,
            wrong_length_said: BTreeSet::new(),
            remarks: Vec::new(),
            interrupted: false,
            samples: Vec::new(),
            instruments: Vec::new(),
        };
        instruments.iter().for_each(|instrument| recording.know(instrument));
        recording.instruments = instruments;
        recording
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
        let sources = self.decoder.sources();
        for source in &sources[self.rhythms.len()..] {
            // A signal whose unit has changed goes on in its rhythm.
            let is_same =
                |(other, _): &(&Source, &Rhythm)| (other.node, &other.signal) == (source.node, &source.signal);
            let before = sources.iter().zip(&self.rhythms).rfind(is_same);
            self.rhythms.push(before.map(|(_, rhythm)| rhythm.clone()).unwrap_or_default());
        }
    }

    /// TPDOs, emergencies, heartbeats, SDO answers and SYNC of the nodes recorded, nothing else.
    pub(super) fn filters(&self) -> Filters {
        let mut ids: Vec<CanId> = self.decoder.can_ids().collect();
        for instrument in &self.instruments {
            let node = instrument.id;
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
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        if let Some(buffer) = self.receive_buffer {
            observer.note(&Note::Buffer(buffer), master.bus().now());
        }
        let begin = master.now();
        self.end = begin;
        for instrument in &self.instruments {
            self.hearts.expect(instrument, begin);
        }
        let mut producer = match plan.mode {
            Mode::Sync(period) => {
                let id = self.instruments.first().map_or(CanId::SYNC, |first| first.sync);
                Some(Producer::new(period, id, begin))
            }
            _ => None,
        };
        let result = self.go_on(begin, producer.as_mut(), master, plan, observer);
        self.timestamps = master.bus().timestamps();
        if let Some(producer) = &mut producer {
            self.syncs = producer.finish(master);
        }
        let late = master.late_drops();
        if late > 0 {
            self.dropped += u64::from(late);
            observer.note(&Note::Dropped(late), master.bus().now());
        }
        result
    }

    fn go_on(
        &mut self,
        begin: Mono,
        mut producer: Option<&mut Producer>,
        master: &mut Master<'_>,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        let end = plan.duration.map(|duration| begin + duration);
        // A recording may begin long before what is looked for in it, and it comes to an end.
        let is_live = master.bus().is_live();
        let patience = if is_live { PATIENCE } else { std::time::Duration::MAX };
        let give_up = begin + plan.duration.unwrap_or(patience).min(patience);
        let mut next_tick = begin + TICK;
        let mut stopped: Option<Mono> = None;
        loop {
            let mut until = next_tick;
            if self.rows == 0 {
                until = until.min(give_up);
            }
            let poll_due = self.poll.as_ref().map(|poll| poll.due(begin));
            let renewal_due = self.renewals.due().filter(|_| self.link_is_up);
            let sync_due = producer.as_ref().map(|producer| producer.due());
            for due in [end, sync_due, poll_due, renewal_due].into_iter().flatten() {
                until = until.min(due);
            }
            let happening = match stopped {
                Some(at) => master.drain(at)?,
                None => master.next(until)?,
            };
            if let Some(producer) = &mut producer {
                producer.look(master);
            }
            let flow = match happening {
                Happening::Frame(received) => self.frame(&received, plan, master, observer)?,
                Happening::Sdo(ticket, result) => self.answer(ticket, result, plan, master, observer)?,
                Happening::Deadline => {
                    if let Some(at) = stopped {
                        self.end = self.end.max(at);
                        return Ok(());
                    }
                    self.end = until;
                    if end.is_some_and(|end| until >= end) || self.rows == 0 && until >= give_up {
                        return Ok(());
                    }
                    if let Some(producer) = &mut producer
                        && until >= producer.due()
                    {
                        if observer.cycle(producer.slot(), master.bus().now()).is_break() {
                            return Ok(());
                        }
                        producer.send(master);
                    }
                    if let Some(poll) = &mut self.poll {
                        if poll.due(begin) <= until && observer.cycle(poll.next_cycle(), master.bus().now()).is_break()
                        {
                            return Ok(());
                        }
                        self.skipped += poll.start_due(begin, until, master);
                    }
                    if self.link_is_up {
                        self.renewals.start_due(until, master);
                        self.watch_pulses(until, master, observer);
                    }
                    if until >= next_tick {
                        next_tick = until + TICK;
                        observer.tick(master.bus().now(), self.rows)
                    } else {
                        ControlFlow::Continue(())
                    }
                }
                Happening::Fault(fault, at) => {
                    self.fault(fault, at, master, observer);
                    ControlFlow::Continue(())
                }
                Happening::Dropped(count) => {
                    self.dropped(count, master, observer);
                    ControlFlow::Continue(())
                }
                Happening::Link(up) => {
                    self.link(up, master, observer);
                    ControlFlow::Continue(())
                }
                Happening::Ended => return Ok(()),
                Happening::Interrupted if self.rows == 0 => {
                    self.interrupted = true;
                    return Err(Error::Interrupted);
                }
                Happening::Interrupted if self.interrupted || !is_live => {
                    self.interrupted = true;
                    return Ok(());
                }
                Happening::Interrupted => {
                    // What has been received by now is recorded; who asks twice does not wait for it.
                    self.interrupted = true;
                    stopped = Some(master.now());
                    ControlFlow::Continue(())
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
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<ControlFlow<()>, Error> {
        self.end = received.at.mono;
        self.samples.clear();
        if let Some(learner) = &mut self.learner {
            learner.take(received, &mut self.decoder);
            self.expect_sources();
        }
        match self.decoder.decode(received, &mut self.samples) {
            Decoded::Tpdo(_) => return Ok(self.take_samples(plan, None, observer)),
            Decoded::Held(node) => self.not_recorded(node, received.at.mono),
            Decoded::WrongLength(node) => self.wrong_length(node, received.at, master, observer),
            Decoded::NotOurs => self.other_frame(received, master, observer),
        }
        Ok(ControlFlow::Continue(()))
    }

    fn answer(
        &mut self,
        ticket: Ticket,
        result: Result<Answer, SdoError>,
        plan: &Plan,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<ControlFlow<()>, Error> {
        if self.renewals.has(ticket) {
            self.read_again(ticket, &result, plan, master, observer)?;
            return Ok(ControlFlow::Continue(()));
        }
        let Some(poll) = &mut self.poll else { return Ok(ControlFlow::Continue(())) };
        self.samples.clear();
        let cycle = poll.cycle_of(ticket);
        if let Some(note) = poll.answer(ticket, result, &mut self.samples) {
            observer.note(&note, master.bus().now());
        }
        Ok(self.take_samples(plan, cycle, observer))
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
        let first = self.samples.first();
        let gap = first.and_then(|first| self.rhythms[first.source].beat(at.mono, plan.max_gap));
        if let (Some(first), Some(length)) = (first, gap) {
            self.gaps += 1;
            observer.note(&Note::Gap(sources[first.source].node, length), at);
        }
        for sample in &self.samples {
            let statistics = &mut self.statistics[sample.source];
            statistics.add(sample.value.map(|value| value.as_f64()), sample.at.mono.since_start());
            if gap.is_some() {
                statistics.add_gap();
            }
            node = Some(sources[sample.source].node);
        }
        if let Some(node) = node {
            let pulse = self.pulses.entry(node).or_default();
            pulse.beat(at.mono, None);
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
}
