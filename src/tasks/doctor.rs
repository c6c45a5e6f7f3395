//! Finds out why a node or the whole bus is silent. Changes nothing on the nodes.
//!
//! Silent signals are diagnosed as in `log` and `check`, from a recording without NMT commands.

use crate::bus::{Fault, Filters, Stamp};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::master::{Error, Master, MasterEvent, MissedAnswer, Request, SdoError, SdoFailure};
use crate::measure::decode::Wanted;
use crate::measure::sample::{Sample, Source, Status};
use crate::node::scan::{self, Presence};
use crate::node::state::Proof;
use crate::node::wait::{Policy, wait};
use crate::node::{Node, Overrides};
use crate::tasks::diagnosis::{Running, Silence, SilenceCause, TpdoCause};
use crate::tasks::failure::Cause;
use crate::tasks::log::{LogEvent, LogFailure, LogOptions, Mode, Observer, Remark, log};
use crate::tasks::read::read;
use crate::tasks::settings::errors;
use crate::tasks::{Failure, Kind};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Duration;

/// The time to listen for nodes before the observation, if nothing may be sent.
const LISTEN_TIME: Duration = Duration::from_secs(3);

/// The time to observe heartbeats and TPDOs. `log` reports the reasons of silent nodes after the same time.
const OBSERVATION_TIME: Duration = Duration::from_secs(5);

/// The options of an examination.
#[derive(Clone, Debug)]
pub struct DoctorOptions {
    /// Examine only this node.
    pub node: Option<NodeId>,
    /// Whether nothing may be sent.
    pub passive: bool,
    /// Whether the bus may be searched for devices without a node-ID by LSS, if no node answers.
    pub lss: bool,
    /// The waiting time after the last request of the scan.
    pub timeout: Duration,
    /// The number of requests to a node that does not answer.
    pub rounds: u32,
    /// Descriptions chosen by the user.
    pub overrides: Overrides,
}

/// A problem that was found.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The node; `None` for the bus.
    pub node: Option<NodeId>,
    /// The signal, if the node sends other signals.
    pub signal: Option<String>,
    /// The problem.
    pub cause: FindingCause,
}

/// The problem.
#[derive(Clone, Debug)]
pub enum FindingCause {
    /// A request failed.
    Failed(Box<Failure>),
    /// The node or the signal sends no measurements for this reason.
    Silent(Box<Silence>),
    /// No frame was received within this time.
    NoFrame(Duration),
    /// The node sends frames but no TPDO, and the program sent no request.
    NoTpdo,
    /// Frames are received, but none from a CANopen node.
    NoNode,
    /// No node answers, but a device without a node-ID does (LSS).
    Unconfigured,
    /// The node sends nothing and does not answer. The list contains the nodes that are on the bus.
    Absent(Vec<NodeId>),
    /// The node sends heartbeats with this state, but does not answer SDO requests.
    OnlyHeartbeat(NmtState),
    /// The controller reported this fault. The flag is `true` if a node answered: the bit rate is then right.
    Fault(Fault, bool),
    /// A value has this status.
    Status(Status),
    /// The set bits of the error register.
    Register(String),
    /// An observation of the recording.
    Remark(Remark),
}

/// The result.
#[derive(Clone, Debug, Default)]
pub struct Examination {
    /// The nodes that were found.
    pub nodes: Vec<NodeId>,
    /// The problems, those of the bus first.
    pub findings: Vec<Finding>,
}

impl Examination {
    fn add(&mut self, node: Option<NodeId>, cause: FindingCause) {
        self.findings.push(Finding { node, signal: None, cause });
    }

    /// Adds the failure of a request. Each failure is listed once.
    fn failed(&mut self, failure: Failure) {
        let silent = match &failure.cause {
            Cause::Log(LogFailure::NoMeasurements { nodes, .. }) => nodes.clone(),
            Cause::Sdo(error) if is_stopped(error) => vec![(error.node, not_operational(NmtState::Stopped))],
            _ => Vec::new(),
        };
        if silent.is_empty() {
            self.add(failure.node, FindingCause::Failed(Box::new(failure)));
        }
        for (node, silence) in silent {
            self.silent(node, None, silence);
        }
    }

    fn silent(&mut self, node: NodeId, signal: Option<String>, silence: Silence) {
        // If a value does not change, its TPDO is not sent. This is not a problem if the node sends other signals.
        let is_normal = signal.is_some()
            && silence.running == Running::Operational
            && matches!(
                silence.cause,
                SilenceCause::Tpdo(
                    _,
                    TpdoCause::SendsOnChange | TpdoCause::SteadyAtSync | TpdoCause::SlowEventTimer(_)
                )
            );
        if !is_normal {
            self.findings.push(Finding { node: Some(node), signal, cause: FindingCause::Silent(Box::new(silence)) });
        }
    }
}

/// Examines a node, or every node of the bus.
///
/// # Errors
/// Ctrl-C. Any other failure is a finding.
pub fn examine(master: &mut Master<'_>, options: &DoctorOptions) -> Result<Examination, Failure> {
    let mut examination = Examination::default();
    match examine_bus(master, options, &mut examination) {
        Ok(()) => Ok(examination),
        Err(failure) if failure.kind() == Kind::Interrupted => Err(failure),
        Err(failure) => {
            examination.failed(failure);
            Ok(examination)
        }
    }
}

fn examine_bus(master: &mut Master<'_>, options: &DoctorOptions, examination: &mut Examination) -> Result<(), Failure> {
    let asked: Vec<NodeId> = options.node.map_or_else(|| NodeId::all().collect(), |node| vec![node]);
    master.listen(&Filters::All)?;
    let mut presence = if options.passive {
        scan::listen(master, LISTEN_TIME)?
    } else {
        scan::find(master, &asked, options.timeout, options.rounds)?
    };
    let found: Vec<NodeId> = presence.nodes().into_iter().filter(|node| asked.contains(node)).collect();
    if found.is_empty() {
        return why_absent(master, options, presence, examination);
    }
    let (answering, silent): (Vec<NodeId>, Vec<NodeId>) =
        found.iter().partition(|&node| options.passive || presence.answered.contains(node));
    for node in silent {
        examination.add(Some(node), only_heartbeat(presence.state(node)));
    }
    examination.nodes = found;
    if answering.is_empty() {
        return Ok(());
    }
    record(master, options, &answering, &mut presence, examination)?;
    if options.passive { Ok(()) } else { read_values(master, options, &answering, examination) }
}

/// Returns the problem of a node that sends frames but does not answer.
fn only_heartbeat(state: Option<NmtState>) -> FindingCause {
    match state {
        Some(NmtState::Stopped) => FindingCause::Silent(Box::new(not_operational(NmtState::Stopped))),
        Some(state) => FindingCause::OnlyHeartbeat(state),
        None => FindingCause::Absent(Vec::new()),
    }
}

/// Returns the problem of a node whose heartbeat shows this state (not OPERATIONAL).
fn not_operational(state: NmtState) -> Silence {
    let cause = SilenceCause::NotOperational { state, by: Proof::Heartbeat, was_started: false };
    Silence::of(cause)
}

/// Whether a node answered before, and its heartbeat now shows STOPPED.
fn is_stopped(error: &SdoError) -> bool {
    matches!(error.failure, SdoFailure::NoAnswer { missed: MissedAnswer { state: Some(NmtState::Stopped), .. }, .. })
}

/// Finds out why nothing was received from the requested nodes.
fn why_absent(
    master: &mut Master<'_>,
    options: &DoctorOptions,
    mut presence: Presence,
    examination: &mut Examination,
) -> Result<(), Failure> {
    let mut others = presence.nodes();
    let frames = observe(master, Duration::from_secs(1), &mut presence)?;
    let faults = presence.faults;
    let is_alone = others.is_empty() && frames == 0;
    faults.iter().for_each(|&fault| examination.add(None, FindingCause::Fault(fault, false)));
    if let Some(node) = options.node.filter(|_| !options.passive) {
        // The request is repeated, because its failure contains the frames received instead of an answer.
        master.listen_to(&[node])?;
        match master.transfer_one(Request::read(node, ObjectId::DEVICE_TYPE))? {
            Err(error) if matches!(error.failure, SdoFailure::NoAnswer { missed, .. } if missed.frame.is_none()) => {}
            Err(error) => {
                examination.failed(error.into());
                return Ok(());
            }
            Ok(_) => return Ok(()),
        }
        let everyone: Vec<NodeId> = NodeId::all().collect();
        others.extend(scan::find(master, &everyone, options.timeout, 1)?.nodes());
    }
    let is_unconfigured = options.lss && is_alone && master.lss().identify_unconfigured()?;
    match options.node {
        _ if is_unconfigured => examination.add(None, FindingCause::Unconfigured),
        Some(node) if !others.is_empty() => {
            examination.add(Some(node), FindingCause::Absent(others.into_iter().collect()));
        }
        _ if !faults.is_empty() => {}
        _ if is_alone => examination.add(None, FindingCause::NoFrame(OBSERVATION_TIME)),
        _ => examination.add(None, FindingCause::NoNode),
    }
    Ok(())
}

/// Counts frames and collects the faults of the controller.
fn observe(master: &mut Master<'_>, duration: Duration, presence: &mut Presence) -> Result<u64, Error> {
    master.listen(&Filters::All)?;
    let mut frames = 0;
    let until = master.now() + duration;
    wait(master, until, Policy::Observe, |_, event| {
        match event {
            MasterEvent::Frame(_) => frames += 1,
            MasterEvent::Fault(fault, _) => presence.on_fault(fault),
            _ => {}
        }
        ControlFlow::<()>::Continue(())
    })?;
    Ok(frames)
}

/// Records the TPDOs of the nodes until each signal has a value.
fn record(
    master: &mut Master<'_>,
    options: &DoctorOptions,
    nodes: &[NodeId],
    presence: &mut Presence,
    examination: &mut Examination,
) -> Result<(), Failure> {
    let recording = LogOptions {
        nodes: nodes.to_vec(),
        wanted: Vec::<Wanted>::new(),
        mode: if options.passive { Mode::Passive } else { Mode::AsSent },
        duration: Some(OBSERVATION_TIME),
        count: None,
        nmt: false,
        start_all: false,
        max_gap: None,
        overrides: options.overrides.clone(),
    };
    let mut watch = Watch::default();
    let report = match log(master, &recording, &mut watch) {
        Ok(report) => report,
        Err(failure) if failure.kind() == Kind::Interrupted || matches!(failure.cause, Cause::Bus(_)) => {
            return Err(failure);
        }
        Err(failure) => {
            examination.failed(failure);
            return Ok(());
        }
    };
    // The nodes have sent frames before. So a recording without TPDOs only means that no TPDO was received.
    let nothing = report.nothing.filter(|failure| {
        let received_nothing = matches!(failure.cause, Cause::Log(LogFailure::NothingReceived { .. }));
        for &node in nodes.iter().filter(|_| received_nothing) {
            let state = presence.state(node).filter(|&state| state != NmtState::Operational);
            examination.add(
                Some(node),
                state.map_or(FindingCause::NoTpdo, |state| FindingCause::Silent(Box::new(not_operational(state)))),
            );
        }
        !received_nothing
    });
    if report.interrupted {
        return Err(Error::Interrupted.into());
    }
    watch.faults.into_iter().for_each(|fault| presence.on_fault(fault));
    presence.faults.iter().for_each(|&fault| examination.add(None, FindingCause::Fault(fault, true)));
    report.failed.into_iter().chain(nothing).for_each(|failure| examination.failed(failure));
    for remark in report.remarks {
        match remark {
            Remark::NoMeasurements(node, signal, silence) => examination.silent(node, signal, *silence),
            Remark::MayClip(node, _) | Remark::Doubt(node, ..) => {
                examination.add(Some(node), FindingCause::Remark(remark));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Reads the values with their status, and the error registers.
fn read_values(
    master: &mut Master<'_>,
    options: &DoctorOptions,
    nodes: &[NodeId],
    examination: &mut Examination,
) -> Result<(), Failure> {
    // The recording has already reported nodes that cannot be read.
    for readings in read(master, nodes, &[], &options.overrides)?.into_iter().flatten() {
        for (target, sample) in readings {
            let bad = sample.status.filter(|&status| status != Status::Ok);
            examination.findings.extend(bad.map(|status| Finding {
                node: Some(target.source.node),
                signal: Some(target.source.signal.to_string()),
                cause: FindingCause::Status(status),
            }));
        }
    }
    let surveyed = crate::node::survey::survey_each(master, nodes, &options.overrides)?;
    for node in surveyed.into_iter().flatten() {
        match errors::read(master, &node) {
            Ok(errors) if errors.register.is_some_and(|bits| bits != 0) => {
                examination.add(Some(node.id), FindingCause::Register(errors.register_text));
            }
            Err(failure) if failure.kind() == Kind::Interrupted => return Err(failure),
            _ => {}
        }
    }
    Ok(())
}

/// Ends the recording when every source has a value.
#[derive(Default)]
struct Watch {
    sources: BTreeSet<usize>,
    seen: BTreeSet<usize>,
    faults: Vec<Fault>,
}

impl Observer for Watch {
    fn begin(&mut self, _nodes: &[Node]) -> Result<(), Failure> {
        Ok(())
    }

    fn sources(&mut self, sources: &[Source]) -> Result<(), Failure> {
        self.sources = (0..sources.len()).collect();
        Ok(())
    }

    fn samples(&mut self, samples: &[Sample], _sources: &[Source]) -> ControlFlow<()> {
        self.seen.extend(samples.iter().map(|sample| sample.source));
        if !self.sources.is_empty() && self.sources.is_subset(&self.seen) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    fn event(&mut self, event: &LogEvent, _at: Stamp) {
        if let LogEvent::Fault(fault) = *event {
            self.faults.push(fault);
        }
    }

    fn tick(&mut self, _at: Stamp, _rows: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
