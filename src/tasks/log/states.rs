//! The NMT states that a recording changes and restores.

use super::{LogOptions, Mode, Remark};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand, NmtState, booted};
use crate::device::profiles;
use crate::master::{Error, Master, MasterEvent};
use crate::node::Node;
use crate::node::wait::{Policy, wait};
use crate::tasks::nmt::NmtFailure;
use crate::tasks::note::StateEffect;
use crate::tasks::{Effect, Failure};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;

/// The profiles of sensors.
const SENSOR_PROFILES: [u32; 3] = [profiles::MEASURING, profiles::ENCODER, profiles::INCLINOMETER];

/// If the heartbeat period of a node is longer, its state is treated as unknown.
const MAX_HEARTBEAT_PERIOD: Duration = Duration::from_secs(2);

/// The interval at which the program checks whether the last commands were sent.
const SEND_INTERVAL: Duration = Duration::from_millis(10);

/// The waiting time for heartbeats that confirm the previous states.
const CONFIRMATION_TIMEOUT: Duration = Duration::from_millis(500);

/// The nodes that were started, and their previous states.
#[derive(Debug, Default)]
pub(super) struct NmtStates {
    started: BTreeMap<NodeId, Option<NmtState>>,
    /// The nodes that are not sensors, and were not started.
    not_started: Vec<NodeId>,
}

impl NmtStates {
    /// Starts the nodes that are not known to be operational. Adds nodes that restart during this time to `restarted`.
    ///
    /// If another NMT master was seen, it starts nodes only with `start_all`. Otherwise, it returns a remark.
    pub(super) fn start(
        &mut self,
        master: &mut Master<'_>,
        nodes: &[Node],
        options: &LogOptions,
        restarted: &mut BTreeSet<NodeId>,
    ) -> Result<Option<Remark>, Error> {
        if !options.nmt || matches!(options.mode, Mode::Poll(_) | Mode::Passive) {
            return Ok(None);
        }
        let known = heartbeats(master, nodes, restarted)?;
        let other_master = master.foreign_nmt().filter(|_| !options.start_all);
        let mut left = Vec::new();
        for node in nodes {
            let before = known.get(&node.id).copied();
            if before == Some(NmtState::Operational) {
                continue;
            }
            if other_master.is_some() {
                left.push(node.id);
            } else if !options.start_all && !is_sensor(node) {
                self.not_started.push(node.id);
            } else {
                self.started.insert(node.id, before);
                master.send(NmtCommand::Start.frame(Some(node.id)));
            }
        }
        let other_master = other_master.filter(|_| !left.is_empty());
        Ok(other_master.map(|(command, target)| Remark::OtherNmtMaster(left, command, target)))
    }

    /// Starts a node again if this recording had started it.
    pub(super) fn start_again(&self, node: NodeId, master: &mut Master<'_>) {
        if self.started.contains_key(&node) {
            master.send(NmtCommand::Start.frame(Some(node)));
        }
    }

    /// Whether this recording has started a node.
    pub(super) fn has_started(&self, node: NodeId) -> bool {
        self.started.contains_key(&node)
    }

    /// Restores the previous state of each node, if known. If the heartbeat then shows another state, the command is
    /// sent once more.
    ///
    /// # Errors
    /// Bus errors; a node that is still in another state.
    pub(super) fn restore(&mut self, master: &mut Master<'_>) -> Result<(), Failure> {
        master.cancel();
        let command = |before: Option<NmtState>| match before {
            Some(NmtState::PreOperational) => Some(NmtCommand::EnterPreOperational),
            Some(NmtState::Stopped) => Some(NmtCommand::Stop),
            _ => None,
        };
        let started = self.started.iter();
        let mut unconfirmed: BTreeMap<_, _> =
            started.filter_map(|(&node, &before)| Some((node, command(before)?))).collect();
        for (&node, command) in &unconfirmed {
            master.send(command.frame(Some(node)));
        }
        while master.is_sending() {
            // Ctrl-C does not interrupt this wait.
            let until = master.now() + SEND_INTERVAL;
            wait(master, until, Policy::Observe, |_, _| ControlFlow::<()>::Continue(()))?;
        }
        if unconfirmed.is_empty() {
            return Ok(());
        }
        let (mut asked_again, mut other_states) = (BTreeSet::new(), BTreeMap::new());
        let until = master.now() + CONFIRMATION_TIMEOUT;
        wait(master, until, Policy::Observe, |master, event| {
            if let MasterEvent::Frame(received) = event
                && let Some((node, ErrorControlMessage::State(state))) = ErrorControlMessage::parse(&received.frame)
                && let Some(&command) = unconfirmed.get(&node)
            {
                if state == command.target() {
                    unconfirmed.remove(&node);
                    other_states.remove(&node);
                } else if asked_again.insert(node) {
                    master.send(command.frame(Some(node)));
                } else {
                    other_states.insert(node, (state, command.target()));
                }
            }
            if unconfirmed.is_empty() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        match other_states.pop_first() {
            Some((node, (state, wanted))) => Err(Failure::at(node, NmtFailure::OtherState { state, wanted })),
            None => Ok(()),
        }
    }

    /// Returns remarks about the nodes that stay operational because their previous state is unknown, and about the
    /// nodes that were not started.
    pub(super) fn remarks(&self) -> impl Iterator<Item = Remark> + use<> {
        let remarks = [Remark::LeftOperational(self.left_operational()), Remark::NotStarted(self.not_started.clone())];
        remarks.into_iter().filter(
            |remark| !matches!(remark, Remark::LeftOperational(nodes) | Remark::NotStarted(nodes) if nodes.is_empty()),
        )
    }

    /// Returns effects about the nodes that may not be in their previous state.
    pub(super) fn effects(&self, is_restored: bool) -> Vec<Effect> {
        let left = Some(self.left_operational()).filter(|nodes| !nodes.is_empty());
        let failed = (!is_restored).then_some(Effect::State(StateEffect::NotRestored));
        left.map(Effect::LeftOperational).into_iter().chain(failed).collect()
    }

    /// Returns the started nodes that stay operational because their previous state is unknown.
    fn left_operational(&self) -> Vec<NodeId> {
        self.started.iter().filter(|(_, before)| before.is_none()).map(|(&node, _)| node).collect()
    }
}

/// Whether a recording may start the node: its description has signals, or its profile is a profile of sensors. Other
/// devices, such as drives, may move something. A device without a profile is treated as a sensor.
fn is_sensor(node: &Node) -> bool {
    let is_described = node.model.as_ref().is_some_and(|model| !model.description.signals.is_empty());
    let profile = node.identity.profile().filter(|&profile| profile != 0);
    is_described || profile.is_none_or(|profile| SENSOR_PROFILES.contains(&profile))
}

/// Returns the states in the heartbeats of the nodes. Waits as long as the slowest heartbeat needs.
fn heartbeats(
    master: &mut Master<'_>,
    nodes: &[Node],
    restarted: &mut BTreeSet<NodeId>,
) -> Result<BTreeMap<NodeId, NmtState>, Error> {
    let period = |node: &Node| {
        let period = Duration::from_millis(u64::from(node.heartbeat_ms?));
        (!period.is_zero() && period <= MAX_HEARTBEAT_PERIOD).then_some(period)
    };
    let expected: BTreeMap<NodeId, Duration> = nodes.iter().filter_map(|node| Some((node.id, period(node)?))).collect();
    let mut known = BTreeMap::new();
    let Some(longest) = expected.values().max() else { return Ok(known) };
    let until = master.now() + *longest * 3 / 2;
    wait(master, until, Policy::Command, |_, event| {
        if let MasterEvent::Frame(received) = event {
            restarted.extend(booted(&received.frame));
            if let Some((node, ErrorControlMessage::State(state))) = ErrorControlMessage::parse(&received.frame)
                && expected.contains_key(&node)
            {
                known.insert(node, state);
            }
        }
        if known.len() == expected.len() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok(known)
}
