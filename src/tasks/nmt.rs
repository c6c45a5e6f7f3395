//! NMT commands and states, with proof where there is one.
//!
//! Proof is a boot-up message, a heartbeat, the answer to node guarding, or what SDO shows: a stopped node
//! has no SDO, so its silence after an answer proves `stopped`, and an answer proves no more than the
//! contrary.

mod probe;
mod startup;
mod watch;

pub use probe::{Probe, probe};
pub use startup::{Starts, StartupReport, startup};
pub use watch::{Change, Seen, watch};

use crate::bus::{BusError, Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::{Life, NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Error, Happening, Master, Request, SdoFailure};
use crate::node::read::read_values;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

const HEARTBEAT: ObjectId = ObjectId::new(0x1017, 0);
const GUARD_TIME: ObjectId = ObjectId::new(0x100c, 0);
const LIFE_TIME_FACTOR: ObjectId = ObjectId::new(0x100d, 0);

/// How long is listened for somebody else who guards.
const OTHERS: Duration = Duration::from_millis(200);

/// The longest wait for a boot-up message: no manual gives a time; storing may go before it.
const BOOT_TIME: Duration = Duration::from_secs(3);

/// What told a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// A heartbeat.
    Heartbeat,
    /// A boot-up message: the node is in PRE-OPERATIONAL, unless it starts by itself.
    BootUp,
    /// The answer to node guarding.
    Guarding,
    /// An SDO that is answered no longer.
    Sdo,
    /// Nothing.
    None,
}

impl By {
    /// As it stands in the output.
    pub fn as_str(self) -> &'static str {
        match self {
            By::Heartbeat => "heartbeat",
            By::BootUp => "boot-up",
            By::Guarding => "guarding",
            By::Sdo => "sdo",
            By::None => "none",
        }
    }
}

/// The state of a node, and what told it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Report {
    /// The node.
    pub node: NodeId,
    /// Its state, `None` where nothing tells it.
    pub state: Option<NmtState>,
    /// What told it.
    pub by: By,
    /// Whether the node showed itself at all.
    pub present: bool,
}

/// How a node can be asked for its state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Means {
    answers_sdo: bool,
    heartbeat: Option<Duration>,
    /// 100Ch and 100Dh were read as 0: a guarding request arms nothing.
    may_guard: bool,
}

/// What has been seen while waiting.
#[derive(Default)]
struct Watch {
    lives: BTreeMap<NodeId, Life>,
    guarded_by_others: BTreeSet<NodeId>,
}

impl Watch {
    fn take(&mut self, received: &Received) {
        if let Some((node, life)) = Life::parse(&received.frame) {
            self.lives.insert(node, life);
        } else if let (Some(node), true) = (received.frame.id().heartbeat_node(), received.frame.is_remote()) {
            self.guarded_by_others.insert(node);
        }
    }

    /// Waits until `enough` or `until`.
    fn wait(&mut self, master: &mut Master<'_>, until: Mono, enough: &dyn Fn(&Watch) -> bool) -> Result<(), Error> {
        while !enough(self) {
            match master.next(until)? {
                Happening::Frame(received) => self.take(&received),
                Happening::Deadline => break,
                Happening::Interrupted => return Err(Error::Interrupted),
                Happening::Link(false) => return Err(Error::Bus(BusError::Down(master.bus().name().to_owned()))),
                Happening::Sdo(..)
                | Happening::Fault(..)
                | Happening::Dropped(_)
                | Happening::Link(true)
                | Happening::Ended => {}
            }
        }
        Ok(())
    }
}

/// Finds out how the nodes can be asked. Silence is no failure here: a stopped node has no SDO.
fn means(master: &mut Master<'_>, nodes: &[NodeId]) -> Result<BTreeMap<NodeId, Means>, Error> {
    let objects = [
        (HEARTBEAT, DataType::Unsigned(2)),
        (GUARD_TIME, DataType::Unsigned(2)),
        (LIFE_TIME_FACTOR, DataType::Unsigned(1)),
    ];
    let mut found: BTreeMap<NodeId, Means> = BTreeMap::new();
    // The heartbeat first: a node that is silent here is not asked twice more.
    let items: Vec<_> = nodes.iter().map(|&node| (node, objects[0].0, objects[0].1)).collect();
    for (&node, value) in nodes.iter().zip(read_values(master, &items)?) {
        let mut means = Means { answers_sdo: true, ..Means::default() };
        match value {
            Ok(value) => means.heartbeat = value.as_u64().filter(|&time| time > 0).map(Duration::from_millis),
            Err(error) => means.answers_sdo = !matches!(error.failure, SdoFailure::NoAnswer { .. }),
        }
        found.insert(node, means);
    }
    let answering: Vec<NodeId> = nodes.iter().copied().filter(|node| found[node].answers_sdo).collect();
    let items: Vec<_> = answering
        .iter()
        .flat_map(|&node| objects[1..].iter().map(move |&(object, kind)| (node, object, kind)))
        .collect();
    let values = read_values(master, &items)?;
    for (node, values) in answering.iter().zip(values.chunks(2)) {
        let zero = |at: usize| values[at].as_ref().is_ok_and(|value| value.as_u64() == Some(0));
        if let Some(means) = found.get_mut(node) {
            means.may_guard = zero(0) && zero(1);
        }
    }
    Ok(found)
}

/// The states of the nodes.
///
/// # Errors
/// What stops everything. A node that shows nothing is `present: false`.
pub fn states(master: &mut Master<'_>, nodes: &[NodeId]) -> Result<Vec<Report>, Error> {
    let mut watch = Watch::default();
    let means = means(master, nodes)?;
    let patience = master.timing().timeout;
    let wait = nodes.iter().filter_map(|node| means[node].heartbeat).max().unwrap_or(Duration::ZERO);
    // A stopped node may send heartbeats that 1017h could not be asked about: one timeout for those.
    let silent = nodes.iter().any(|node| !means[node].answers_sdo);
    let until = master.now() + wait + if wait.is_zero() && !silent { Duration::ZERO } else { patience };
    let expected: Vec<NodeId> =
        nodes.iter().copied().filter(|node| means[node].heartbeat.is_some() || !means[node].answers_sdo).collect();
    watch.wait(master, until, &|watch| expected.iter().all(|node| watch.lives.contains_key(node)))?;
    let guarded = guard(master, nodes, &means, &mut watch)?;
    Ok(nodes
        .iter()
        .map(|&node| {
            let present = means[&node].answers_sdo || watch.lives.contains_key(&node);
            match (watch.lives.get(&node), guarded.get(&node)) {
                (_, Some(&state)) => Report { node, state: Some(state), by: By::Guarding, present: true },
                (Some(Life::State(state)), None) => {
                    Report { node, state: Some(*state), by: By::Heartbeat, present: true }
                }
                (Some(Life::BootUp), None) => {
                    Report { node, state: Some(NmtState::PreOperational), by: By::BootUp, present: true }
                }
                (None, None) => Report { node, state: None, by: By::None, present },
            }
        })
        .collect())
}

/// The state that the heartbeat of a node tells, whose period (1017h) is known. Sends nothing.
///
/// # Errors
/// What stops everything.
pub(super) fn by_heartbeat(master: &mut Master<'_>, node: NodeId, period: Duration) -> Result<Option<NmtState>, Error> {
    let mut watch = Watch::default();
    let until = master.now() + period + master.timing().timeout;
    watch.wait(master, until, &|watch| matches!(watch.lives.get(&node), Some(Life::State(_))))?;
    Ok(match watch.lives.get(&node) {
        Some(Life::State(state)) => Some(*state),
        Some(Life::BootUp) | None => None,
    })
}

/// Asks by node guarding where that is harmless: no heartbeat, no life guarding, nobody else guards.
fn guard(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    means: &BTreeMap<NodeId, Means>,
    watch: &mut Watch,
) -> Result<BTreeMap<NodeId, NmtState>, Error> {
    let asked: Vec<NodeId> =
        nodes.iter().copied().filter(|node| means[node].may_guard && means[node].heartbeat.is_none()).collect();
    let mut told = BTreeMap::new();
    if asked.is_empty() {
        return Ok(told);
    }
    // Asked by two, a node answers each with the toggle bit that the other one waits for.
    let until = master.now() + OTHERS.min(master.timing().timeout);
    let is_told = |watch: &Watch, node| watch.guarded_by_others.contains(node) && watch.lives.contains_key(node);
    watch.wait(master, until, &|watch| asked.iter().all(|node| is_told(watch, node)))?;
    let asked: Vec<NodeId> = asked.into_iter().filter(|node| !watch.guarded_by_others.contains(node)).collect();
    if asked.is_empty() {
        return Ok(told);
    }
    for node in &asked {
        watch.lives.remove(node);
        if let Ok(request) = Frame::remote(CanId::heartbeat(*node), 1) {
            master.send(request);
        }
    }
    let until = master.now() + master.timing().timeout;
    watch.wait(master, until, &|watch| asked.iter().all(|node| watch.lives.contains_key(node)))?;
    for node in asked {
        if let Some(Life::State(state)) = watch.lives.get(&node) {
            told.insert(node, *state);
        }
    }
    Ok(told)
}

/// Sends a command to each of the nodes, or with `broadcast` once to all, and finds out what came of it.
///
/// # Errors
/// What stops everything.
pub fn command(
    master: &mut Master<'_>,
    command: NmtCommand,
    nodes: &[NodeId],
    broadcast: bool,
) -> Result<Vec<Report>, Error> {
    let mut watch = Watch::default();
    let before = means(master, nodes)?;
    if broadcast {
        master.send(command.frame(None));
    } else {
        nodes.iter().for_each(|&node| master.send(command.frame(Some(node))));
    }
    let patience = master.timing().timeout;
    let sent = master.now();
    if command.is_reset() {
        let booted = |watch: &Watch| nodes.iter().all(|node| watch.lives.get(node) == Some(&Life::BootUp));
        let resettable = nodes.iter().any(|node| before[node].answers_sdo) || broadcast;
        let wait = if resettable { BOOT_TIME.max(patience) } else { patience.max(BOOT_TIME) };
        watch.wait(master, sent + wait, &booted)?;
        return Ok(nodes
            .iter()
            .map(|&node| match watch.lives.get(&node) {
                Some(Life::BootUp) => {
                    Report { node, state: Some(NmtState::PreOperational), by: By::BootUp, present: true }
                }
                // A heartbeat without a boot-up before it is the node as it was.
                other => {
                    Report { node, state: None, by: By::None, present: before[&node].answers_sdo || other.is_some() }
                }
            })
            .collect());
    }
    let longest = nodes.iter().filter_map(|node| before[node].heartbeat).max();
    let target = command.target();
    let settled = |watch: &Watch| {
        nodes.iter().all(|node| {
            let expects = before[node].heartbeat.is_some() || !before[node].answers_sdo;
            !expects || watch.lives.get(node) == Some(&Life::State(target))
        })
    };
    let expects = longest.is_some() || nodes.iter().any(|node| !before[node].answers_sdo);
    let until = sent + if expects { longest.unwrap_or_default() + patience } else { Duration::ZERO };
    watch.wait(master, until, &settled)?;
    let guarded = guard(master, nodes, &before, &mut watch)?;
    let silent: Vec<NodeId> =
        nodes.iter().copied().filter(|node| !watch.lives.contains_key(node) && !guarded.contains_key(node)).collect();
    let asked = silent.iter().map(|&node| Request::read(node, HEARTBEAT)).collect();
    // Meanwhile others may tell that they have changed.
    let answers = master.transfer(asked, &mut |received| watch.take(received))?;
    let no_longer: BTreeSet<NodeId> = silent
        .iter()
        .zip(&answers)
        .filter(|(_, answer)| matches!(answer, Err(error) if matches!(error.failure, SdoFailure::NoAnswer { .. })))
        .map(|(&node, _)| node)
        .collect();
    Ok(nodes
        .iter()
        .map(|&node| {
            let life = watch.lives.get(&node).copied();
            if let Some(&state) = guarded.get(&node) {
                return Report { node, state: Some(state), by: By::Guarding, present: true };
            }
            match life {
                Some(Life::State(state)) => Report { node, state: Some(state), by: By::Heartbeat, present: true },
                Some(Life::BootUp) => {
                    Report { node, state: Some(NmtState::PreOperational), by: By::BootUp, present: true }
                }
                None => {
                    let answered = before[&node].answers_sdo;
                    let gone = no_longer.contains(&node);
                    if command == NmtCommand::Stop && answered && gone {
                        Report { node, state: Some(NmtState::Stopped), by: By::Sdo, present: true }
                    } else {
                        Report { node, state: None, by: By::None, present: answered || !gone }
                    }
                }
            }
        })
        .collect())
}
