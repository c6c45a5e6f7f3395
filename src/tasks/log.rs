//! Records measurements: TPDOs as they are sent, on SYNC, or values polled by SDO.
//!
//! What is recorded goes to an [`Observer`]; nothing is printed or written here. What the recording
//! switched on the way is put back at its end, on every way out.

mod passive;
mod poll;
mod states;

use crate::bus::{BusError, Fault, Filters, Mono, Received, Stamp, TimestampSource};
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::Life;
use crate::master::{Error, Happening, Master};
use crate::measure::decode::{Decoded, Decoder, Wanted};
use crate::measure::instrument::{Instrument, Tpdo};
use crate::measure::sample::{Sample, Source};
use crate::measure::statistics::Statistics;
use crate::measure::survey::{Overrides, instruments};
use crate::tasks::{Failure, Kind};
use passive::Learner;
use poll::Poll;
use states::States;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;

/// What is to be recorded, and how.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Of which nodes.
    pub nodes: Vec<NodeId>,
    /// Which signals; none means all.
    pub wanted: Vec<Wanted>,
    /// How the values come.
    pub mode: Mode,
    /// For how long.
    pub duration: Option<Duration>,
    /// At most this many rows.
    pub count: Option<u64>,
    /// Whether NMT may be used.
    pub nmt: bool,
    /// Descriptions named by the user.
    pub overrides: Overrides,
}

/// How the values come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// As the devices send them.
    AsSent,
    /// With SYNC produced here, at this interval.
    Sync(Duration),
    /// Read by SDO, at this interval.
    Poll(Duration),
    /// Sending nothing at all.
    Passive,
}

/// What happens on the way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Note {
    /// Something to say that concerns no node.
    Remark(String),
    /// A node sent an emergency message.
    Emergency(NodeId, Emergency),
    /// A node restarted.
    Restarted(NodeId),
    /// Nothing has come from the node for a while.
    Silent(NodeId, Duration),
    /// The node is back.
    Back(NodeId),
    /// A TPDO has not the length of its mapping.
    WrongLength(NodeId),
    /// The controller reports trouble.
    Fault(Fault),
    /// The kernel dropped frames.
    Dropped(u32),
    /// The interface went down or came back.
    Link(bool),
}

/// Takes what is recorded. Breaking ends the recording; the reason is the observer's own.
pub trait Observer {
    /// Samples that came together, in the order of their bytes; at most as many as may be counted.
    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()>;

    /// Something happened.
    fn note(&mut self, note: &Note, at: Stamp);

    /// Time passes: called at least ten times a second while nothing comes.
    fn tick(&mut self, at: Stamp, rows: u64) -> ControlFlow<()>;
}

/// How a recording ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Rows recorded.
    pub rows: u64,
    /// From the first row to the end.
    pub length: Duration,
    /// What each source gave.
    pub statistics: Vec<(Source, Statistics)>,
    /// Nodes that gave nothing, or nothing any more, at the end.
    pub lost: Vec<NodeId>,
    /// Why nothing came, if nothing came.
    pub nothing: Option<Failure>,
    /// Frames that the kernel had to drop.
    pub dropped: u64,
    /// Emergency messages.
    pub emergencies: u64,
    /// Intervals longer than three times the usual one.
    pub gaps: u64,
    /// Polls that could not be sent because the one before was not finished.
    pub skipped: u64,
    /// SYNC messages sent.
    pub syncs: u64,
    /// Where the time stamps come from.
    pub timestamps: TimestampSource,
    /// What was switched and not put back, in words.
    pub remarks: Vec<String>,
    /// Whether the user ended it.
    pub interrupted: bool,
}

/// When nothing comes for this long after the start, it is said why.
const PATIENCE: Duration = Duration::from_secs(5);

/// How often time is told to the observer when nothing comes.
const TICK: Duration = Duration::from_millis(100);

/// Records.
///
/// # Errors
/// What stops it before the first row; from then on every end is an [`Outcome`].
pub fn log(master: &mut Master<'_>, plan: &Plan, observer: &mut dyn Observer) -> Result<Outcome, Failure> {
    if plan.mode == Mode::Passive {
        return record_passively(master, plan, observer);
    }
    let instruments = instruments(master, &plan.nodes, &plan.overrides)?;
    check_wanted(&instruments, plan)?;
    let mut recording = Recording::new(&instruments, plan, master.bus().timestamps());
    let mut states = States::default();
    let mut poll = match plan.mode {
        Mode::Poll(period) => Some(Poll::new(&instruments, &plan.wanted, &mut recording.decoder, period)?),
        _ => {
            instruments.iter().for_each(|instrument| recording.decoder.add(instrument, &plan.wanted));
            None
        }
    };
    recording.expect_sources();
    master.listen(&recording.filters(&instruments))?;
    if let Mode::Sync(period) = plan.mode {
        refuse_second_sync(master, &instruments, period)?;
    }
    let result = match states.start(master, &instruments, plan) {
        Ok(()) => recording.run(master, plan, &instruments, &mut states, poll.as_mut(), observer),
        Err(error) => Err(error),
    };
    let restored = states.restore(master);
    recording.remarks.extend(states.remarks());
    match result {
        Ok(()) => {}
        Err(Error::Interrupted) if recording.rows > 0 => recording.interrupted = true,
        Err(error) => return Err(error.into()),
    }
    if let Err(error) = restored {
        recording.remarks.push(format!("the nodes' states were not put back: {error}"));
    }
    Ok(recording.outcome(&instruments, plan))
}

fn record_passively(master: &mut Master<'_>, plan: &Plan, observer: &mut dyn Observer) -> Result<Outcome, Failure> {
    let mut recording = Recording::new(&[], plan, master.bus().timestamps());
    let mut learner = Learner::new(&plan.nodes, &plan.overrides, &plan.wanted);
    learner.begin(&mut recording.decoder);
    recording.learner = Some(learner);
    recording.expect_sources();
    master.listen(&Filters::All)?;
    match recording.run(master, plan, &[], &mut States::default(), None, observer) {
        Ok(()) => {}
        Err(Error::Interrupted) if recording.rows > 0 => recording.interrupted = true,
        Err(error) => return Err(error.into()),
    }
    Ok(recording.outcome(&[], plan))
}

/// Everything asked for must be in a TPDO, or nothing will ever come of it.
fn check_wanted(instruments: &[Instrument], plan: &Plan) -> Result<(), Failure> {
    let polled = matches!(plan.mode, Mode::Poll(_));
    for item in &plan.wanted {
        let carried = |instrument: &Instrument| {
            let entries = || {
                let valid = instrument.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
                valid.flat_map(|tpdo| &tpdo.mapping)
            };
            match item {
                Wanted::Signal(name) => instrument.mapped_signals().any(|signal| signal.name == *name),
                Wanted::Object(object) => entries().any(|entry| entry.object == *object),
                Wanted::Status(name) => instrument
                    .signals
                    .iter()
                    .filter(|signal| signal.name == *name)
                    .any(|signal| entries().any(|entry| Some(entry.object) == signal.status)),
            }
        };
        if !instruments.iter().any(carried) {
            let (known, name) = match item {
                Wanted::Signal(name) | Wanted::Status(name) => (
                    instruments.iter().any(|instrument| instrument.signals.iter().any(|signal| signal.name == *name)),
                    name.clone(),
                ),
                Wanted::Object(object) => (true, object.to_string()),
            };
            if !known {
                let mut names: Vec<&str> = instruments
                    .iter()
                    .flat_map(|instrument| instrument.signals.iter().map(|signal| signal.name.as_str()))
                    .collect();
                names.dedup();
                return Err(Failure::new(Kind::Usage, format!("no node has a signal \"{name}\""))
                    .hint(format!("there are: {}", names.join(", "))));
            }
            if polled {
                continue;
            }
            return Err(Failure::new(Kind::Unexpected, format!("no TPDO carries {name}"))
                .hint("read it by SDO instead: add --poll 100ms"));
        }
    }
    Ok(())
}

/// Two SYNC producers would double every synchronous TPDO.
fn refuse_second_sync(master: &mut Master<'_>, instruments: &[Instrument], period: Duration) -> Result<(), Failure> {
    let ids: BTreeSet<CanId> = instruments.iter().map(|instrument| instrument.sync).collect();
    if ids.len() > 1 {
        return Err(Failure::new(Kind::CheckFailed, "the nodes listen to different SYNC identifiers (1005h)"));
    }
    let length = (period * 3).clamp(Duration::from_millis(200), Duration::from_secs(2));
    let until = master.now() + length;
    loop {
        match master.next(until)? {
            Happening::Frame(received) if ids.contains(&received.frame.id()) && !received.frame.is_remote() => {
                return Err(Failure::new(
                    Kind::CheckFailed,
                    "somebody else sends SYNC on this bus: nothing was started",
                )
                .hint("leave --sync out: the nodes send on the SYNC that is there"));
            }
            Happening::Deadline => return Ok(()),
            Happening::Interrupted => return Err(Error::Interrupted.into()),
            Happening::Link(false) => return Err(BusError::Down(master.bus().name().to_owned()).into()),
            _ => {}
        }
    }
}

/// When a node last gave something, and how often it does.
#[derive(Clone, Debug, Default)]
struct Pulse {
    last: Option<Mono>,
    interval: Option<Duration>,
    silent: bool,
}

struct Recording {
    decoder: Decoder,
    statistics: Vec<Statistics>,
    pulses: BTreeMap<NodeId, Pulse>,
    emergencies_of: BTreeMap<CanId, NodeId>,
    timestamps: TimestampSource,
    rows: u64,
    first: Option<Mono>,
    end: Mono,
    dropped: u64,
    emergencies: u64,
    gaps: u64,
    syncs: u64,
    skipped: u64,
    wrong_length_said: BTreeSet<NodeId>,
    remarks: Vec<String>,
    interrupted: bool,
    samples: Vec<Sample>,
    learner: Option<Learner>,
}

impl Recording {
    fn new(instruments: &[Instrument], plan: &Plan, timestamps: TimestampSource) -> Recording {
        Recording {
            decoder: Decoder::default(),
            statistics: Vec::new(),
            // Who only listens waits for nobody in particular.
            pulses: plan
                .nodes
                .iter()
                .filter(|_| plan.mode != Mode::Passive)
                .map(|&node| (node, Pulse::default()))
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
            skipped: 0,
            wrong_length_said: BTreeSet::new(),
            remarks: Vec::new(),
            interrupted: false,
            samples: Vec::new(),
            learner: None,
        }
    }

    fn expect_sources(&mut self) {
        self.statistics.resize(self.decoder.sources().len(), Statistics::default());
    }

    /// TPDOs, emergencies, heartbeats, SDO answers and SYNC of the nodes recorded, nothing else.
    fn filters(&self, instruments: &[Instrument]) -> Filters {
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

    fn run(
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
        let give_up = begin + plan.duration.unwrap_or(PATIENCE).min(PATIENCE);
        let sync = match plan.mode {
            Mode::Sync(period) => Some((period, instruments.first().map_or(CanId::SYNC, |first| first.sync))),
            _ => None,
        };
        let mut next_tick = begin + TICK;
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
                until = until.min(begin + nth(period, self.syncs));
            }
            if let Some(poll) = &poll {
                until = until.min(poll.due(begin));
            }
            let flow = match master.next(until)? {
                Happening::Frame(received) => self.frame(&received, plan, states, master, observer),
                Happening::Sdo(ticket, result) => match &mut poll {
                    Some(poll) => {
                        self.samples.clear();
                        if let Some(note) = poll.answer(ticket, result, &mut self.samples) {
                            observer.note(&note, master.bus().now());
                        }
                        self.take_samples(plan, observer)
                    }
                    None => ControlFlow::Continue(()),
                },
                Happening::Deadline => {
                    self.end = until;
                    if let Some((period, id)) = sync
                        && until >= begin + nth(period, self.syncs)
                    {
                        master.send_first(Frame::empty(id));
                        self.syncs += 1;
                    }
                    if let Some(poll) = &mut poll {
                        self.skipped += poll.start_due(begin, until, master);
                    }
                    if stop.is_some_and(|stop| until >= stop) || self.rows == 0 && until >= give_up {
                        return Ok(());
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
            Decoded::Tpdo(_) => return self.take_samples(plan, observer),
            Decoded::WrongLength(node) => {
                if self.wrong_length_said.insert(node) {
                    observer.note(&Note::WrongLength(node), received.at);
                }
            }
            Decoded::NotOurs => {
                let frame = &received.frame;
                if let (Some(&node), Some(emergency)) = (self.emergencies_of.get(&frame.id()), Emergency::parse(frame))
                {
                    self.emergencies += 1;
                    observer.note(&Note::Emergency(node, emergency), received.at);
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

    fn take_samples(&mut self, plan: &Plan, observer: &mut dyn Observer) -> ControlFlow<()> {
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
        for sample in &self.samples {
            self.statistics[sample.source].add(sample.value.map(|value| value.as_f64()), sample.at.mono.since_start());
            node = Some(sources[sample.source].node);
        }
        if let Some(node) = node {
            let pulse = self.pulses.entry(node).or_default();
            if let Some(last) = pulse.last.filter(|&last| last < at.mono) {
                let interval = at.mono.since(last);
                if pulse.interval.is_some_and(|usual| interval > usual * 3 && interval > Duration::from_millis(1)) {
                    self.gaps += 1;
                }
                pulse.interval = Some(pulse.interval.map_or(interval, |usual| (usual * 7 + interval) / 8));
            }
            pulse.last = Some(at.mono);
            if std::mem::take(&mut pulse.silent) {
                observer.note(&Note::Back(node), at);
            }
        }
        self.rows += self.samples.len() as u64;
        observer.samples(&self.samples, sources)?;
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

    fn outcome(mut self, instruments: &[Instrument], plan: &Plan) -> Outcome {
        let lost: Vec<NodeId> = self
            .pulses
            .iter()
            .filter(|(_, pulse)| pulse.last.is_none_or(|last| self.end.since(last) > patience(pulse)))
            .map(|(&node, _)| node)
            .collect();
        let nothing = (self.rows == 0).then(|| why_nothing(instruments, plan, &self));
        for &node in lost.iter().filter(|_| self.rows > 0) {
            if let Some(instrument) = instruments.iter().find(|instrument| instrument.node == node)
                && self.pulses[&node].last.is_none()
            {
                let (why, _) = why_silent(instrument, plan.mode);
                self.remarks.push(format!("node {node}: no measurements: {why}"));
            }
        }
        Outcome {
            rows: self.rows,
            length: self.first.map_or(Duration::ZERO, |first| self.end.since(first)),
            statistics: self.decoder.sources().iter().cloned().zip(self.statistics).collect(),
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

/// How long a node may be silent: five of its usual intervals, at least a second.
fn patience(pulse: &Pulse) -> Duration {
    (pulse.interval.unwrap_or_default() * 5).max(Duration::from_secs(1))
}

/// `period` times `n`, to the nanosecond, for as many as there may be.
fn nth(period: Duration, n: u64) -> Duration {
    let nanoseconds = period.as_nanos().saturating_mul(u128::from(n));
    Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
}

fn why_nothing(instruments: &[Instrument], plan: &Plan, recording: &Recording) -> Failure {
    let waited = plan.duration.unwrap_or(PATIENCE).min(PATIENCE);
    let within = crate::bus::time::spoken(waited);
    if let Some(node) = recording.learner.as_ref().and_then(|learner| learner.not_understood.first()) {
        let message = "its TPDOs come, and nothing told their mapping: no guess is made";
        return Failure::of_node(Kind::Usage, *node, message).hint(format!(
            "name the device: --device {node}=mh4 (or a file), or record from the start of a log that reads it"
        ));
    }
    let Some(first) = instruments.first() else {
        return Failure::new(Kind::NoAnswer, format!("no measurements within {within}"));
    };
    let (why, hint) = match recording.decoder.wrong_lengths(first.node) {
        0 => why_silent(first, plan.mode),
        _ => ("its TPDOs have not the length of their mapping".to_owned(), None),
    };
    let message = format!("no measurements within {within}: {why}");
    let failure = match instruments {
        [only] => Failure::of_node(Kind::NoAnswer, only.node, message),
        _ => Failure::new(
            Kind::NoAnswer,
            format!("no measurements from any node within {within}; node {}: {why}", first.node),
        ),
    };
    match hint {
        Some(hint) => failure.hint(hint),
        None => failure,
    }
}

/// Why a node that is set up as it is sends nothing, and what helps.
fn why_silent(instrument: &Instrument, mode: Mode) -> (String, Option<String>) {
    let node = instrument.node;
    if matches!(mode, Mode::Poll(_)) {
        return ("it does not answer".to_owned(), None);
    }
    let poll = || Some("read by SDO instead: add --poll 100ms".to_owned());
    let valid: Vec<&Tpdo> = instrument.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).collect();
    if instrument.tpdos.is_empty() {
        return ("it has no TPDO".to_owned(), poll());
    }
    if valid.is_empty() {
        return ("all its TPDOs are switched off (bit 31 of 1800h:1)".to_owned(), poll());
    }
    if valid.iter().all(|tpdo| tpdo.mapping.is_empty()) {
        return ("nothing is mapped into its TPDOs".to_owned(), poll());
    }
    if let Some(tpdo) = valid.iter().find(|tpdo| tpdo.transmission.is_some_and(|kind| kind.needs_sync()))
        && !matches!(mode, Mode::Sync(_))
    {
        let why = format!("{} waits for SYNC and nobody sends it", tpdo.number);
        return (why, Some(format!("add --sync 100ms, or read by SDO: --poll 100ms (node {node})")));
    }
    if let Some(tpdo) = valid.iter().find(|tpdo| tpdo.event_timer_ms == Some(0)) {
        return (
            format!("{} has no event timer (1800h:5 is 0) and its value does not change enough", tpdo.number),
            poll(),
        );
    }
    ("its TPDOs should be coming; is it started?".to_owned(), Some(format!("cangauge nmt state {node}")))
}
