//! Records measurements: TPDOs as the nodes send them, TPDOs on SYNC or on remote request, or values polled by SDO.
//!
//! Samples and events go to an [`Observer`]; nothing is printed or written here. At its end, even after a failure, the
//! recording restores the previous NMT states of the nodes it started.

mod changes;
mod checks;
mod events;
mod failure;
mod heartbeats;
mod passive;
mod poll;
mod producer;
mod recording;
mod remark;
mod rereads;
mod silence;
mod states;

pub use failure::LogFailure;

use crate::bus::{Fault, Filters, ReceiveBuffer, Stamp, TimestampSource};
use crate::canopen::emcy::Emergency;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::master::{Error, Master, Request, SdoError, SdoFailure};
use crate::measure::decode::Wanted;
use crate::measure::expression::evaluator::Evaluator;
use crate::measure::sample::{Sample, Source};
use crate::measure::statistics::Statistics;
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::{SETUP_TIMEOUT, survey_each};
use crate::tasks::Failure;
pub(super) use changes::changes;
pub use changes::{Change, TpdoChange};
use checks::{check_wanted, refuse_second_sync, sync_share};
pub use events::EventCounts;
pub(super) use passive::{SetupListener, is_constant};
use poll::Poll;
pub use producer::SyncStatistics;
use recording::Recording;
pub use remark::Remark;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Duration;

/// The options of a recording.
#[derive(Clone, Debug)]
pub struct LogOptions {
    /// The nodes. Each must send values, except in a passive recording of all node-IDs.
    pub nodes: Vec<NodeId>,
    /// The signals; empty for all.
    pub wanted: Vec<Wanted>,
    /// The source of the values.
    pub mode: Mode,
    /// The recording ends after this time.
    pub duration: Option<Duration>,
    /// The recording ends after this many values.
    pub count: Option<u64>,
    /// Whether nodes may be started. If another NMT master is seen, they are started only with `start_all`.
    pub nmt: bool,
    /// Whether devices that are not sensors (profiles 401, 402 and others) are started too.
    pub start_all: bool,
    /// Longer intervals are gaps; `None` for three times the usual interval.
    pub max_gap: Option<Duration>,
    /// Descriptions chosen by the user.
    pub overrides: Overrides,
}

/// The source of the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// TPDOs as the nodes send them.
    AsSent,
    /// TPDOs on SYNC, which the program sends at this interval.
    Sync(Duration),
    /// SDO reads at this interval.
    Poll(Duration),
    /// TPDOs on remote request (RTR) at this interval. Type 252 needs a SYNC before each request.
    Request(Duration),
    /// TPDOs as the nodes send them. The program sends nothing.
    Passive,
}

/// An event during a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum LogEvent {
    /// An observation that is also in the summary.
    Remark(Remark),
    /// A node sent an emergency message with this meaning.
    Emergency(NodeId, Emergency, String),
    /// The bus load (0 to 1) of SYNC at this interval and of the TPDOs that answer it.
    Share(Duration, f64),
    /// A node restarted.
    Restarted(NodeId),
    /// The setup of a node was read again, and has these changes. Its next frames are decoded with the new setup.
    ReadAgain(NodeId, Vec<Change>),
    /// The setup of a node could not be read again. The program repeats the attempt. Until it succeeds, frames of the
    /// node are ignored.
    Unreadable(NodeId, Box<Failure>),
    /// The heartbeat of a node stopped this long ago.
    HeartbeatLost(NodeId, Duration),
    /// The heartbeat of a node is back.
    HeartbeatBack(NodeId),
    /// The heartbeat of a node shows another state than OPERATIONAL.
    State(NodeId, NmtState),
    /// The interval before a TPDO or polled value of the node was longer than [`LogOptions::max_gap`].
    Gap(NodeId, Duration),
    /// The node has sent no samples for this time.
    Silent(NodeId, Duration),
    /// The node sends samples again.
    Back(NodeId),
    /// The length of a TPDO differs from its mapping: mapped and received length in bytes. The TPDO is ignored.
    WrongLength(NodeId, usize, usize),
    /// A TPDO of the node is always longer than its mapping: mapped and received length in bytes. The mapped bytes are
    /// used.
    LongerTpdo(NodeId, usize, usize),
    /// The heartbeats of the node have this many bytes, not one.
    HeartbeatLength(NodeId, usize),
    /// A node repeated this emergency with this meaning, this many times.
    EmergencyRepeated(NodeId, Emergency, String, u64),
    /// The controller reports a fault.
    Fault(Fault),
    /// The controller reported this fault again, this many times.
    FaultRepeated(Fault, u64),
    /// The receive buffer of the kernel.
    Buffer(ReceiveBuffer),
    /// The kernel dropped this many frames.
    Dropped(u32),
    /// The interface went down (`false`) or came back.
    Link(bool),
}

/// Receives samples and events. `Break` ends the recording.
pub trait Observer {
    /// Called before [`Observer::begin`] if the setup of nodes could not be read. The other nodes are recorded. A
    /// passive recording does not call it.
    fn failed(&mut self, _failures: &[Failure]) {}

    /// Called with the nodes to be recorded, before anything is changed. A passive recording does not call it.
    ///
    /// # Errors
    /// The recording must not start.
    fn begin(&mut self, _nodes: &[Node]) -> Result<(), Failure> {
        Ok(())
    }

    /// Called with the sources to be recorded, in the order of their numbers, before anything is changed. More sources
    /// may follow later. A passive recording does not call it.
    ///
    /// # Errors
    /// The recording must not start.
    fn sources(&mut self, _sources: &[Source]) -> Result<(), Failure> {
        Ok(())
    }

    /// Called when a cycle of SYNC or polling starts. Numbers may be skipped.
    fn cycle(&mut self, _number: u64, _at: Stamp) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called with samples that were requested in this cycle. This cycle may be earlier than the present cycle.
    fn polled(&mut self, _cycle: u64, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.samples(samples, sources)
    }

    /// Called with samples that were received together, in the order of the mapping.
    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()>;

    /// Called with an event.
    fn event(&mut self, event: &LogEvent, at: Stamp);

    /// Called with the present state of the expressions, as often as [`Observer::tick`].
    fn evaluated(&mut self, _evaluator: &Evaluator, _at: Stamp) {}

    /// Called ten times a second.
    fn tick(&mut self, at: Stamp, rows: u64) -> ControlFlow<()>;
}

/// The result of a recording.
#[derive(Clone, Debug)]
pub struct RecordingReport {
    /// The number of recorded values.
    pub rows: u64,
    /// The time between the first value and the end.
    pub length: Duration,
    /// The statistics of each source.
    pub statistics: Vec<(Source, Statistics)>,
    /// Nodes whose setup could not be read, and which were not recorded. In a passive recording: requested signals that
    /// were not recorded.
    pub failed: Vec<Failure>,
    /// Nodes with a TPDO that two devices send. After the detection, these TPDOs were ignored.
    pub two_devices: Vec<Failure>,
    /// Nodes that were replaced by other devices.
    pub replaced: Vec<Failure>,
    /// Nodes that sent no samples, or stopped before the end.
    pub lost: Vec<NodeId>,
    /// Why there are no values.
    pub nothing: Option<Failure>,
    /// Frames dropped by the kernel.
    pub dropped: u64,
    /// Emergency messages.
    pub emergencies: u64,
    /// Intervals longer than [`LogOptions::max_gap`].
    pub gaps: u64,
    /// Polls that were not sent because the previous poll was not finished.
    pub skipped: u64,
    /// Other events.
    pub events: EventCounts,
    /// SYNC messages sent.
    pub syncs: SyncStatistics,
    /// The receive buffer of the kernel, if it is known.
    pub receive_buffer: Option<ReceiveBuffer>,
    /// The source of the time stamps.
    pub timestamps: TimestampSource,
    /// Further observations.
    pub remarks: Vec<Remark>,
    /// Whether the user ended the recording.
    pub interrupted: bool,
}

/// Without a sample, the recording ends after this time and reports why.
const FIRST_SAMPLE_TIMEOUT: Duration = Duration::from_secs(5);

/// The interval of [`Observer::tick`].
const TICK_INTERVAL: Duration = Duration::from_millis(100);

/// Records until the duration, the count, Ctrl-C or the observer ends the recording.
///
/// # Errors
/// The recording fails before its first value. After the first value, Ctrl-C returns a [`RecordingReport`].
pub fn log(
    master: &mut Master<'_>,
    options: &LogOptions,
    observer: &mut dyn Observer,
) -> Result<RecordingReport, Failure> {
    if options.mode == Mode::Passive {
        return record_passively(master, options, observer);
    }
    master.listen_to(&options.nodes)?;
    master.limit_transfers(options.duration.map(|duration| duration.saturating_add(SETUP_TIMEOUT)));
    let surveyed = survey(master, options, observer);
    master.limit_transfers(None);
    let (nodes, failed) = surveyed?;
    observer.begin(&nodes)?;
    check_wanted(&nodes, options)?;
    let mut recording = Recording::new(nodes, options, master.bus());
    match options.mode {
        Mode::Poll(period) => {
            let poll = Poll::new(&recording.nodes, &options.wanted, &mut recording.decoder, period)?;
            recording.poll = Some(poll);
        }
        _ => recording.nodes.iter().for_each(|node| {
            recording.decoder.add(node.layout(), &node.all_wanted(&options.wanted));
        }),
    }
    recording.refuse_without_rtr()?;
    recording.adopt_overloads();
    recording.update_sources();
    recording.ignore_nodes_without_signals();
    observer.sources(recording.decoder.sources())?;
    recording.report_shared_cob_ids(master.bus().now(), observer);
    if recording.poll.is_none() {
        recording.report_setup(master.bus().now(), observer);
    }
    master.listen(&recording.filters())?;
    // Nodes may restart between their survey and the recording.
    let mut restarted = BTreeSet::new();
    if let Some(period) = recording.sync_interval() {
        refuse_second_sync(master, &recording.nodes, period, &mut restarted)?;
        if let (Mode::Sync(_), Some(share)) = (options.mode, sync_share(master, &recording.nodes, period)) {
            observer.event(&LogEvent::Share(period, share), master.bus().now());
        }
    }
    let result = start_nodes(&mut recording, master, &mut restarted, observer).and_then(|()| {
        master.set_tolerates_outages(true);
        recording.restarted_before_start(&restarted, master, observer);
        recording.run(master, observer)
    });
    master.set_tolerates_outages(false);
    if result.is_ok() {
        recording.ask_silent_nodes(master);
    }
    Ok(RecordingReport { failed, ..restore_states(recording, master, result)? })
}

/// Reads the setup of the nodes. Returns the nodes, and the failures of the other nodes.
fn survey(
    master: &mut Master<'_>,
    options: &LogOptions,
    observer: &mut dyn Observer,
) -> Result<(Vec<Node>, Vec<Failure>), Failure> {
    let (mut nodes, mut failed) = (Vec::new(), Vec::new());
    for result in survey_each(master, &options.nodes, &options.overrides)? {
        match result {
            Ok(node) => match compare_values(master, &node)? {
                Ok(()) => nodes.push(node),
                Err(error) => failed.push(Failure::from(error)),
            },
            Err(error) => failed.push(Failure::from(error)),
        }
    }
    match failed.first() {
        Some(first) if nodes.is_empty() => return Err(first.clone()),
        Some(_) => observer.failed(&failed),
        None => {}
    }
    Ok((nodes, failed))
}

/// Starts the nodes. Adds nodes that restart during this time to `restarted`.
fn start_nodes(
    recording: &mut Recording<'_>,
    master: &mut Master<'_>,
    restarted: &mut BTreeSet<NodeId>,
    observer: &mut dyn Observer,
) -> Result<(), Error> {
    if let Some(remark) = recording.states.start(master, &recording.nodes, recording.options, restarted)? {
        recording.remark(remark, master.bus().now(), observer);
    }
    Ok(())
}

/// If the answers of a node arrive twice, compares its mapped values. Two devices of one type may differ only in these
/// values.
pub(super) fn compare_values(master: &mut Master<'_>, node: &Node) -> Result<Result<(), SdoError>, Error> {
    if !master.second_answers().iter().any(|&(twice, _)| twice == node.id) {
        return Ok(Ok(()));
    }
    let entries = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).flat_map(|tpdo| &tpdo.mapping);
    let requests: Vec<Request> = entries.map(|entry| Request::read(node.id, entry.object)).collect();
    for result in master.transfer(requests, &mut |_| {})? {
        // A value that cannot be read is not evidence.
        if let Err(error @ SdoError { failure: SdoFailure::TwoDevices(_), .. }) = result {
            return Ok(Err(error));
        }
    }
    Ok(Ok(()))
}

fn record_passively(
    master: &mut Master<'_>,
    options: &LogOptions,
    observer: &mut dyn Observer,
) -> Result<RecordingReport, Failure> {
    let mut recording = Recording::new(Vec::new(), options, master.bus());
    let mut listener = SetupListener::new(&options.nodes, &options.overrides, &options.wanted);
    listener.apply_overrides(&mut recording.decoder);
    recording.watch_emergencies(options.nodes.iter().map(|&node| listener.known_node(node)));
    recording.watch_syncs(options.nodes.iter().map(|&node| listener.known_node(node)));
    recording.listener = Some(listener);
    recording.update_sources();
    master.listen(&Filters::All)?;
    let result = recording.run(master, observer);
    finish(recording, result)
}

/// Restores the nodes' states and creates the report.
fn restore_states(
    mut recording: Recording<'_>,
    master: &mut Master<'_>,
    result: Result<(), Error>,
) -> Result<RecordingReport, Failure> {
    let restored = recording.states.restore(master);
    let states = recording.states.effects(restored.is_ok());
    recording.remarks.extend(recording.states.remarks());
    if let Err(error) = restored {
        recording.remarks.push(Remark::StatesNotRestored(Box::new(error)));
    }
    // A failure is shown without the remarks, so it must contain the states.
    let with_states = |mut failure: Failure| {
        failure.effects.extend(states.iter().cloned());
        failure
    };
    let report = finish(recording, result).map_err(with_states)?;
    Ok(RecordingReport { nothing: report.nothing.map(with_states), ..report })
}

/// Creates the report. If at least one value was recorded, Ctrl-C is not a failure.
fn finish(mut recording: Recording<'_>, result: Result<(), Error>) -> Result<RecordingReport, Failure> {
    match result {
        Ok(()) => {}
        Err(Error::Interrupted) if recording.rows() > 0 => recording.set_interrupted(),
        Err(error) => return Err(error.into()),
    }
    Ok(recording.report())
}

/// Returns `period` times `n`, exact to the nanosecond. Saturates.
fn multiply(period: Duration, n: u64) -> Duration {
    let nanoseconds = period.as_nanos().saturating_mul(u128::from(n));
    Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
}
