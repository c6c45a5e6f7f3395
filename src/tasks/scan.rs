//! Finds who is on the bus.

mod failure;

pub use failure::ScanFailure;

use crate::bus::{Filters, Mono, Received};
use crate::canopen::emcy::Emergency;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::{Life, NmtState};
use crate::canopen::object::ObjectId;
use crate::master::{Error, Happening, Master, Request, SdoFailure, Ticket};
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::identify;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// A node that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Its node-ID.
    pub node: NodeId,
    /// Its state, where a heartbeat told it.
    pub state: Option<NmtState>,
    /// What it says of itself, as far as it was asked, and its description.
    pub instrument: Node,
    /// Why its identity could not be read.
    pub failure: Option<crate::tasks::Failure>,
}

const DEVICE_TYPE: ObjectId = ObjectId::new(0x1000, 0);

/// What the usual transmit queue of 10 frames takes on the wire at the most, each with its answer, in bits.
const FULL_QUEUE_BITS: u64 = 10 * 2 * 135;

/// How long after the first round of requests the silent nodes are asked once more.
const SECOND_ROUND: Duration = Duration::from_millis(50);

/// How long after the last request heartbeats are waited for that tell the states of those that answered.
const STATES: Duration = Duration::from_millis(200);

/// Asks every node for its device type, all side by side, and reads the identity of those that answer.
///
/// A heartbeat or boot-up shows a node too, one that cannot answer (stopped) included. The silent ones are
/// asked `rounds` times in all; the wait after the last request is `wait`.
///
/// # Errors
/// What stops everything. Nobody there is an empty list.
pub fn scan(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    wait: Duration,
    rounds: u32,
    overrides: &Overrides,
) -> Result<Vec<Found>, Error> {
    master.listen_to(nodes)?;
    // On the slowest of buses a request may stand in the queue for longer than others wait for an answer.
    let queue = master.bus().bit_rate().filter(|&rate| rate > 0);
    let queue = queue.map_or(0, |rate| FULL_QUEUE_BITS * 1_000_000 / u64::from(rate));
    let wait = wait + Duration::from_micros(queue);
    let mut seen = Seen::default();
    let mut open: BTreeMap<Ticket, NodeId> = BTreeMap::new();
    let mut asked_at = master.now();
    // One round more is for those who were switched on in the middle and have missed the question.
    for round in 0..=rounds.max(1) {
        let last = round + 1 >= rounds.max(1);
        let missed = |node: &&NodeId| round < rounds.max(1) || seen.booted.contains(node);
        for &node in nodes.iter().filter(|node| !seen.answered.contains(node)).filter(missed) {
            let request = Request::read(node, DEVICE_TYPE).once().within(wait);
            open.insert(master.start(request), node);
        }
        if open.is_empty() {
            continue;
        }
        asked_at = master.now();
        let mut until = asked_at + SECOND_ROUND;
        while !open.is_empty() {
            let far = until + wait * 10 + Duration::from_secs(10);
            match master.next(if last { far } else { until })? {
                Happening::Sdo(ticket, result) => {
                    let answered = match &result {
                        Ok(_) => true,
                        Err(error) => !matches!(error.failure, SdoFailure::NoAnswer { .. } | SdoFailure::Cancelled),
                    };
                    if let Some(node) = open.remove(&ticket)
                        && answered
                    {
                        seen.answered.insert(node);
                    }
                }
                Happening::Frame(received) => seen.take(&received),
                Happening::Deadline => {
                    // The first round's requests may still be going out on a slow bus.
                    if master.is_sending() {
                        until = until + SECOND_ROUND;
                        continue;
                    }
                    break;
                }
                Happening::Interrupted => return Err(Error::Interrupted),
                Happening::Link(false) => {
                    return Err(Error::Bus(crate::bus::BusError::Down(master.bus().name().to_owned())));
                }
                Happening::Fault(..) | Happening::Dropped(_) | Happening::Link(true) | Happening::Ended => {}
            }
        }
        master.forget(open.keys().copied());
        open.clear();
    }
    seen.listen_for_states(master, asked_at + wait.min(STATES))?;
    let wanted: BTreeSet<NodeId> = nodes.iter().copied().collect();
    describe(master, &seen, &wanted, overrides)
}

fn describe(
    master: &mut Master<'_>,
    seen: &Seen,
    wanted: &BTreeSet<NodeId>,
    overrides: &Overrides,
) -> Result<Vec<Found>, Error> {
    let present: BTreeSet<NodeId> = seen.answered.iter().chain(seen.states.keys()).copied().collect();
    let mut found = Vec::new();
    let answering: Vec<NodeId> = seen.answered.iter().copied().filter(|node| wanted.contains(node)).collect();
    let mut instruments: BTreeMap<NodeId, Result<Node, crate::tasks::Failure>> = BTreeMap::new();
    match identify(master, &answering, overrides) {
        Ok(all) => instruments.extend(all.into_iter().map(|instrument| (instrument.id, Ok(instrument)))),
        Err(Error::Sdo(_)) => {
            // One of them falls silent in the middle: each for itself, so that the others are described.
            for &node in &answering {
                let alone = match identify(master, &[node], overrides) {
                    Ok(mut all) => all.pop().ok_or_else(|| unreadable(node)),
                    Err(Error::Sdo(error)) => Err(error.into()),
                    Err(error) => return Err(error),
                };
                instruments.insert(node, alone);
            }
        }
        Err(error) => return Err(error),
    }
    for node in present.into_iter().filter(|node| wanted.contains(node)) {
        let (instrument, failure) = match instruments.remove(&node) {
            Some(Ok(instrument)) => (instrument, None),
            Some(Err(failure)) => (Node::new(node), Some(failure)),
            None => (Node::new(node), None),
        };
        found.push(Found { node, state: seen.states.get(&node).copied().flatten(), instrument, failure });
    }
    Ok(found)
}

fn unreadable(node: NodeId) -> crate::tasks::Failure {
    crate::tasks::Failure::of_node(crate::tasks::Kind::Unexpected, node, "its identity could not be read")
}

/// Listens for `length` without sending anything.
///
/// # Errors
/// What stops everything.
pub fn listen(master: &mut Master<'_>, nodes: &[NodeId], length: Duration) -> Result<Vec<Found>, Error> {
    master.listen(&Filters::All)?;
    let wanted: BTreeSet<NodeId> = nodes.iter().copied().collect();
    let mut seen = Seen::default();
    let until = master.now() + length;
    loop {
        match master.next(until)? {
            Happening::Frame(received) => seen.take_any(&received),
            Happening::Deadline | Happening::Interrupted | Happening::Ended => break,
            Happening::Link(false) => {
                return Err(Error::Bus(crate::bus::BusError::Down(master.bus().name().to_owned())));
            }
            Happening::Sdo(..) | Happening::Fault(..) | Happening::Dropped(_) | Happening::Link(true) => {}
        }
    }
    let present: BTreeSet<NodeId> = seen.answered.iter().chain(seen.states.keys()).copied().collect();
    Ok(present
        .into_iter()
        .filter(|node| wanted.contains(node))
        .map(|node| Found {
            node,
            state: seen.states.get(&node).copied().flatten(),
            instrument: Node::new(node),
            failure: None,
        })
        .collect())
}

#[derive(Default)]
struct Seen {
    answered: BTreeSet<NodeId>,
    booted: BTreeSet<NodeId>,
    /// Who showed itself by heartbeat or boot-up, and in which state.
    states: BTreeMap<NodeId, Option<NmtState>>,
}

impl Seen {
    fn take(&mut self, received: &Received) {
        match Life::parse(&received.frame) {
            Some((node, Life::State(state))) => {
                self.states.insert(node, Some(state));
            }
            Some((node, Life::BootUp)) => {
                self.states.entry(node).or_insert(None);
                self.booted.insert(node);
            }
            None => {}
        }
    }

    /// Waits for the heartbeats of those that answered.
    fn listen_for_states(&mut self, master: &mut Master<'_>, until: Mono) -> Result<(), Error> {
        while !self.answered.iter().all(|node| self.states.get(node).is_some_and(Option::is_some)) {
            match master.next(until)? {
                Happening::Frame(received) => self.take(&received),
                Happening::Deadline => break,
                Happening::Interrupted => return Err(Error::Interrupted),
                Happening::Link(false) => {
                    return Err(Error::Bus(crate::bus::BusError::Down(master.bus().name().to_owned())));
                }
                Happening::Sdo(..)
                | Happening::Fault(..)
                | Happening::Dropped(_)
                | Happening::Link(true)
                | Happening::Ended => {}
            }
        }
        Ok(())
    }

    /// Everything that shows a node, by the predefined connection set: who only listens has nothing better.
    fn take_any(&mut self, received: &Received) {
        self.take(received);
        let frame = &received.frame;
        let id = frame.id();
        let emergency = id.emergency_node().filter(|_| Emergency::parse(frame).is_some());
        let tpdo = match id {
            CanId::Standard(number) if matches!(number & 0x780, 0x180 | 0x280 | 0x380 | 0x480) => {
                NodeId::new((number & 0x7f) as u8).ok()
            }
            _ => None,
        };
        if let (Some(node), false) = (id.sdo_response_node().or(emergency).or(tpdo), frame.is_remote()) {
            self.states.entry(node).or_insert(None);
        }
    }
}
