//! NMT states and commands, confirmed if possible.
//!
//! A state is confirmed by a boot-up message, a heartbeat, the answer to node guarding, or SDO. A stopped node has no
//! SDO: if it answered before the command and does not answer after it, it is stopped. An SDO answer proves only that a
//! node is not stopped.

use super::error::Error;
use super::read::read_values;
use super::wait::{Policy, wait};
use crate::bus::{Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Error as MasterError, Master, MasterEvent, Request, SdoFailure};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;

/// The producer heartbeat time.
pub const HEARTBEAT_TIME: ObjectId = ObjectId::new(0x1017, 0);
const GUARD_TIME: ObjectId = ObjectId::new(0x100c, 0);
const LIFE_TIME_FACTOR: ObjectId = ObjectId::new(0x100d, 0);

/// How long to listen for the guarding requests of another master.
const OTHER_GUARD_TIMEOUT: Duration = Duration::from_millis(200);

/// The longest wait for a boot-up message. No manual gives a time. A device may first write its
/// non-volatile memory.
pub const BOOT_TIMEOUT: Duration = Duration::from_secs(3);

/// The evidence for a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// A heartbeat.
    Heartbeat,
    /// A boot-up message proves a restart. It shows no state: a device that starts by itself is operational soon after.
    BootUp,
    /// The answer to node guarding.
    Guarding,
    /// The NMT command of another master. The state is not confirmed.
    Command,
    /// The node no longer answers SDO requests, so it is stopped.
    Sdo,
    /// No evidence.
    None,
}

impl Proof {
    /// The word in JSON and tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Proof::Heartbeat => "heartbeat",
            Proof::BootUp => "boot-up",
            Proof::Guarding => "guarding",
            Proof::Command => "command",
            Proof::Sdo => "sdo",
            Proof::None => "none",
        }
    }
}

/// The state of a node, and the evidence for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateReport {
    /// The node.
    pub node: NodeId,
    /// The state; `None` if it is unknown.
    pub state: Option<NmtState>,
    /// The evidence for the state.
    pub by: Proof,
    /// Whether the node sent or answered anything.
    pub is_present: bool,
}

impl StateReport {
    /// Creates the report of a node in a known state.
    pub fn known(node: NodeId, state: NmtState, by: Proof) -> StateReport {
        StateReport { node, state: Some(state), by, is_present: true }
    }

    /// Creates the report of a node in an unknown state.
    pub fn unknown(node: NodeId, is_present: bool) -> StateReport {
        StateReport { node, state: None, by: Proof::None, is_present }
    }

    fn of_life(node: NodeId, life: ErrorControlMessage) -> StateReport {
        match life {
            ErrorControlMessage::State(state) => StateReport::known(node, state, Proof::Heartbeat),
            ErrorControlMessage::BootUp => StateReport { node, state: None, by: Proof::BootUp, is_present: true },
        }
    }
}

/// The sources from which the state of a node can be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct StateSources {
    answers_sdo: bool,
    heartbeat: Option<Duration>,
    /// Whether 100Ch and 100Dh were read as 0. A guarding request then does not start life guarding.
    may_guard: bool,
}

impl StateSources {
    /// Whether the node may send a heartbeat. 1017h of a stopped node cannot be read.
    fn may_send_heartbeat(&self) -> bool {
        self.heartbeat.is_some() || !self.answers_sdo
    }
}

/// Heartbeats, boot-ups and guarding requests received while waiting.
#[derive(Default)]
pub struct ErrorControlWatch {
    /// The last heartbeat or boot-up message of each node.
    pub lives: BTreeMap<NodeId, ErrorControlMessage>,
    booted: BTreeSet<NodeId>,
    guarded_by_others: BTreeSet<NodeId>,
}

impl ErrorControlWatch {
    /// Handles a received frame.
    pub fn on_frame(&mut self, received: &Received) {
        if let Some((node, life)) = ErrorControlMessage::parse(&received.frame) {
            self.lives.insert(node, life);
            if life == ErrorControlMessage::BootUp {
                self.booted.insert(node);
            }
        } else if let (Some(node), true) = (received.frame.id().heartbeat_node(), received.frame.is_remote()) {
            self.guarded_by_others.insert(node);
        }
    }

    /// Returns the state that the last heartbeat of a node showed.
    pub fn state(&self, node: NodeId) -> Option<NmtState> {
        match self.lives.get(&node) {
            Some(ErrorControlMessage::State(state)) => Some(*state),
            Some(ErrorControlMessage::BootUp) | None => None,
        }
    }

    /// Receives until `is_enough` or `until`.
    ///
    /// # Errors
    /// Bus errors and Ctrl-C.
    pub fn wait(
        &mut self,
        master: &mut Master<'_>,
        until: Mono,
        is_enough: &dyn Fn(&ErrorControlWatch) -> bool,
    ) -> Result<(), MasterError> {
        if is_enough(self) {
            return Ok(());
        }
        wait(master, until, Policy::Command, |_, event| {
            if let MasterEvent::Frame(received) = event {
                self.on_frame(&received);
                if is_enough(self) {
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(())
        })?;
        Ok(())
    }
}

/// Finds the sources from which the state of each node can be read. A missing answer is not an error, because the node
/// may be stopped.
fn sources(master: &mut Master<'_>, nodes: &[NodeId]) -> Result<BTreeMap<NodeId, StateSources>, MasterError> {
    let mut found: BTreeMap<NodeId, StateSources> = BTreeMap::new();
    // The heartbeat time is read first: if a node does not answer, its other objects are not read.
    let items: Vec<_> = nodes.iter().map(|&node| (node, HEARTBEAT_TIME, DataType::Unsigned(2))).collect();
    for (&node, value) in nodes.iter().zip(read_values(master, &items)?) {
        let mut sources = StateSources { answers_sdo: true, ..StateSources::default() };
        match value {
            Ok(value) => sources.heartbeat = value.as_u64().filter(|&time| time > 0).map(Duration::from_millis),
            Err(error) => sources.answers_sdo = !matches!(error.failure, SdoFailure::NoAnswer { .. }),
        }
        found.insert(node, sources);
    }
    let answering: Vec<NodeId> = nodes.iter().copied().filter(|node| found[node].answers_sdo).collect();
    let guarding = [(GUARD_TIME, DataType::Unsigned(2)), (LIFE_TIME_FACTOR, DataType::Unsigned(1))];
    let items: Vec<_> = answering
        .iter()
        .flat_map(|&node| guarding.iter().map(move |&(object, data_type)| (node, object, data_type)))
        .collect();
    let values = read_values(master, &items)?;
    for (node, values) in answering.iter().zip(values.chunks(guarding.len())) {
        if let Some(sources) = found.get_mut(node) {
            sources.may_guard = values.iter().all(|value| value.as_ref().is_ok_and(|value| value.as_u64() == Some(0)));
        }
    }
    Ok(found)
}

/// Finds the states of nodes. Returns one report for each node, in their order.
///
/// # Errors
/// Bus errors and Ctrl-C. A node that sends and answers nothing has `is_present: false`.
pub fn states(master: &mut Master<'_>, nodes: &[NodeId]) -> Result<Vec<StateReport>, MasterError> {
    let mut watch = ErrorControlWatch::default();
    let sources = sources(master, nodes)?;
    let timeout = master.timing().timeout;
    let longest = nodes.iter().filter_map(|node| sources[node].heartbeat).max();
    let expected: Vec<NodeId> = nodes.iter().copied().filter(|node| sources[node].may_send_heartbeat()).collect();
    let wait = if expected.is_empty() { Duration::ZERO } else { longest.unwrap_or_default() + timeout };
    let until = master.now() + wait;
    watch.wait(master, until, &|watch| expected.iter().all(|node| watch.lives.contains_key(node)))?;
    let guarded = guard(master, nodes, &sources, &mut watch)?;
    let report = |&node: &NodeId| match (guarded.get(&node), watch.lives.get(&node)) {
        (Some(&state), _) => StateReport::known(node, state, Proof::Guarding),
        (None, Some(&life)) => StateReport::of_life(node, life),
        (None, None) => StateReport::unknown(node, sources[&node].answers_sdo),
    };
    Ok(nodes.iter().map(report).collect())
}

/// Finds the state of one node; `None` if it is unknown.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn state(master: &mut Master<'_>, node: NodeId) -> Result<Option<NmtState>, MasterError> {
    Ok(states(master, &[node])?.first().and_then(|report| report.state))
}

/// Waits for the next heartbeat of a node and returns its state. `period` is the heartbeat time (1017h). Sends nothing.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn by_heartbeat(master: &mut Master<'_>, node: NodeId, period: Duration) -> Result<Option<NmtState>, MasterError> {
    let mut watch = ErrorControlWatch::default();
    let until = master.now() + period + master.timing().timeout;
    watch.wait(master, until, &|watch| watch.state(node).is_some())?;
    Ok(watch.state(node))
}

/// Reads states by node guarding if this is harmless: no heartbeat, no life guarding, no other guarding master.
fn guard(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    sources: &BTreeMap<NodeId, StateSources>,
    watch: &mut ErrorControlWatch,
) -> Result<BTreeMap<NodeId, NmtState>, MasterError> {
    let may_guard = |node: &NodeId| sources[node].may_guard && sources[node].heartbeat.is_none();
    let asked: Vec<NodeId> = nodes.iter().copied().filter(may_guard).collect();
    let mut states = BTreeMap::new();
    if asked.is_empty() || !master.bus().sends_remote_frames() {
        return Ok(states);
    }
    // With two masters, each would get an answer with the toggle bit that the other master expects.
    let until = master.now() + OTHER_GUARD_TIMEOUT.min(master.timing().timeout);
    let is_known =
        |watch: &ErrorControlWatch, node| watch.guarded_by_others.contains(node) && watch.lives.contains_key(node);
    watch.wait(master, until, &|watch| asked.iter().all(|node| is_known(watch, node)))?;
    let asked: Vec<NodeId> = asked.into_iter().filter(|node| !watch.guarded_by_others.contains(node)).collect();
    for node in &asked {
        watch.lives.remove(node);
        if let Ok(request) = Frame::remote(CanId::heartbeat(*node), 1) {
            master.send(request);
        }
    }
    let until = master.now() + master.timing().timeout;
    watch.wait(master, until, &|watch| asked.iter().all(|node| watch.lives.contains_key(node)))?;
    states.extend(asked.into_iter().filter_map(|node| Some((node, watch.state(node)?))));
    Ok(states)
}

/// Sends a command to each of the nodes, or once to all nodes with `broadcast`, and finds out the resulting states.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn command(
    master: &mut Master<'_>,
    command: NmtCommand,
    nodes: &[NodeId],
    broadcast: bool,
) -> Result<Vec<StateReport>, MasterError> {
    let mut watch = ErrorControlWatch::default();
    let before = sources(master, nodes)?;
    if broadcast {
        master.send(command.frame(None));
    } else {
        nodes.iter().for_each(|&node| master.send(command.frame(Some(node))));
    }
    if command.is_reset() {
        wait_for_boot_ups(master, nodes, &mut watch)?;
        after_reset(master, nodes, &before, &mut watch)
    } else {
        after_change(master, command, nodes, &before, &mut watch)
    }
}

/// Waits for the boot-up messages after a reset.
fn wait_for_boot_ups(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    watch: &mut ErrorControlWatch,
) -> Result<(), MasterError> {
    let until = master.now() + BOOT_TIMEOUT.max(master.timing().timeout);
    watch.wait(master, until, &|watch| nodes.iter().all(|node| watch.booted.contains(node)))
}

/// Finds out the states after the boot-up messages, from the next heartbeats.
fn after_reset(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    before: &BTreeMap<NodeId, StateSources>,
    watch: &mut ErrorControlWatch,
) -> Result<Vec<StateReport>, MasterError> {
    let expected: Vec<NodeId> = nodes.iter().copied().filter(|node| watch.booted.contains(node)).collect();
    if let Some(longest) = expected.iter().filter_map(|node| before[node].heartbeat).max() {
        let has_state =
            |watch: &ErrorControlWatch, node: &NodeId| before[node].heartbeat.is_none() || watch.state(*node).is_some();
        let until = master.now() + longest + master.timing().timeout;
        watch.wait(master, until, &|watch| expected.iter().all(|node| has_state(watch, node)))?;
    }
    let report = |&node: &NodeId| match watch.lives.get(&node) {
        Some(&life) if watch.booted.contains(&node) => StateReport::of_life(node, life),
        // A heartbeat without a boot-up comes from a node that did not restart.
        Some(_) => StateReport::unknown(node, true),
        None => StateReport::unknown(node, before[&node].answers_sdo),
    };
    Ok(nodes.iter().map(report).collect())
}

/// Finds out the states after start, stop or enter PRE-OPERATIONAL.
fn after_change(
    master: &mut Master<'_>,
    command: NmtCommand,
    nodes: &[NodeId],
    before: &BTreeMap<NodeId, StateSources>,
    watch: &mut ErrorControlWatch,
) -> Result<Vec<StateReport>, MasterError> {
    let sent = master.now();
    let target = ErrorControlMessage::State(command.target());
    let expected: Vec<NodeId> = nodes.iter().copied().filter(|node| before[node].may_send_heartbeat()).collect();
    if !expected.is_empty() {
        let longest = nodes.iter().filter_map(|node| before[node].heartbeat).max().unwrap_or_default();
        let until = sent + longest + master.timing().timeout;
        watch.wait(master, until, &|watch| expected.iter().all(|node| watch.lives.get(node) == Some(&target)))?;
    }
    let guarded = guard(master, nodes, before, watch)?;
    let is_unknown = |node: &NodeId| !watch.lives.contains_key(node) && !guarded.contains_key(node);
    let silent: Vec<NodeId> = nodes.iter().copied().filter(is_unknown).collect();
    let requests = silent.iter().map(|&node| Request::read(node, HEARTBEAT_TIME)).collect();
    // Heartbeats that arrive in this time are also used.
    let answers = master.transfer(requests, &mut |received| watch.on_frame(received))?;
    let has_no_answer = |answer: &Result<_, crate::master::SdoError>| {
        answer.as_ref().is_err_and(|error| matches!(error.failure, SdoFailure::NoAnswer { .. }))
    };
    let without_sdo: BTreeSet<NodeId> =
        silent.iter().zip(&answers).filter(|(_, answer)| has_no_answer(answer)).map(|(&node, _)| node).collect();
    let report = |&node: &NodeId| {
        if let Some(&state) = guarded.get(&node) {
            return StateReport::known(node, state, Proof::Guarding);
        }
        if let Some(&life) = watch.lives.get(&node) {
            return StateReport::of_life(node, life);
        }
        let (answered, lost) = (before[&node].answers_sdo, without_sdo.contains(&node));
        if command == NmtCommand::Stop && answered && lost {
            return StateReport::known(node, NmtState::Stopped, Proof::Sdo);
        }
        StateReport::unknown(node, answered || !lost)
    };
    Ok(nodes.iter().map(report).collect())
}

/// Resets a node and waits for its boot-up message.
///
/// # Errors
/// [`Error::NoBootUp`]; bus errors and Ctrl-C.
pub fn reset(master: &mut Master<'_>, node: NodeId) -> Result<(), Error> {
    let mut watch = ErrorControlWatch::default();
    master.send(NmtCommand::ResetNode.frame(Some(node)));
    wait_for_boot_ups(master, &[node], &mut watch)?;
    if watch.booted.contains(&node) { Ok(()) } else { Err(Error::NoBootUp(node)) }
}
