//! Finds the nodes on the bus.

use super::overheard::Overheard;
use super::wait::{Policy, wait};
use crate::bus::{Fault, Filters, Mono, Received};
use crate::canopen::emcy::Emergency;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::{ErrorControlMessage, NmtState};
use crate::canopen::object::ObjectId;
use crate::master::{Answer, Error, Master, MasterEvent, Request, SdoError, SdoFailure, Ticket};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;

/// The bits of a full transmit queue: 10 requests and their answers, 135 bits each.
const FULL_QUEUE_BITS: u64 = 10 * 2 * 135;

const VENDOR: ObjectId = ObjectId::new(0x1018, 1);

/// The time from the last request of a round to the next round. After the last round, the scan waits at least this time
/// for answers.
const REPEAT_INTERVAL: Duration = Duration::from_millis(50);

/// The interval at which the scan checks whether all requests were sent.
const SENDING_STEP: Duration = Duration::from_millis(2);

/// How long to wait for heartbeats after the first requests.
const HEARTBEAT_TIMEOUT: Duration = Duration::from_millis(200);

/// The nodes that were detected on the bus.
#[derive(Default)]
pub struct Presence {
    /// Nodes that answered an SDO request.
    pub answered: BTreeSet<NodeId>,
    /// Nodes that were detected by a frame other than an SDO answer, with their state if a heartbeat showed it.
    pub states: BTreeMap<NodeId, Option<NmtState>>,
    /// The COB-IDs of received TPDOs, by their node in the predefined connection set.
    pub tpdos: BTreeMap<NodeId, BTreeSet<CanId>>,
    /// The failed request of the only node that was asked, if a frame with another COB-ID looks like its answer.
    pub other_channel: Option<SdoError>,
    /// The objects that other masters read and wrote, in a passive scan.
    pub overheard: Overheard,
    booted: BTreeSet<NodeId>,
    /// The faults that the controller reported meanwhile, each once.
    pub faults: Vec<Fault>,
}

impl Presence {
    /// Every node that answered or sent a frame, except nodes detected only by a TPDO.
    pub fn nodes(&self) -> BTreeSet<NodeId> {
        self.answered.iter().chain(self.states.keys()).copied().collect()
    }

    /// Returns the state of a node, if a heartbeat showed it.
    pub fn state(&self, node: NodeId) -> Option<NmtState> {
        self.states.get(&node).copied().flatten()
    }

    fn on_event(&mut self, event: &MasterEvent) {
        match event {
            MasterEvent::Frame(received) => self.on_frame(received),
            MasterEvent::Fault(fault, _) => self.on_fault(*fault),
            _ => {}
        }
    }

    /// Handles the result of a request to this node.
    fn on_result(&mut self, result: Result<Answer, SdoError>, node: Option<NodeId>, is_only: bool) {
        let has_answered = result.as_ref().map_or_else(
            |error| !matches!(error.failure, SdoFailure::NoAnswer { .. } | SdoFailure::Cancelled),
            |_| true,
        );
        self.answered.extend(node.filter(|_| has_answered));
        let has_frame = |error: &SdoError| match error.failure {
            SdoFailure::NoAnswer { missed, .. } => is_only && missed.frame.is_some(),
            _ => false,
        };
        self.other_channel = result.err().filter(has_frame);
    }

    /// Adds a fault of the controller.
    pub fn on_fault(&mut self, fault: Fault) {
        if fault != Fault::ErrorActive && !self.faults.contains(&fault) {
            self.faults.push(fault);
        }
    }

    fn on_frame(&mut self, received: &Received) {
        match ErrorControlMessage::parse(&received.frame) {
            Some((node, ErrorControlMessage::State(state))) => {
                self.states.insert(node, Some(state));
            }
            Some((node, ErrorControlMessage::BootUp)) => {
                self.states.entry(node).or_insert(None);
                self.booted.insert(node);
            }
            None if received.frame.is_remote() => {}
            None => {
                // This can be a late answer to a cancelled request.
                self.answered.extend(received.frame.id().sdo_response_node());
                if let Some(node) = tpdo_node(received.frame.id()) {
                    self.tpdos.entry(node).or_default().insert(received.frame.id());
                }
            }
        }
    }

    /// Handles a frame, and also detects nodes by emergencies and TPDOs of the predefined connection set.
    fn on_any_frame(&mut self, received: &Received) {
        self.on_frame(received);
        let frame = &received.frame;
        self.overheard.take(received);
        let emergency = frame.id().emergency_node().filter(|_| Emergency::parse(frame).is_some());
        if let (Some(node), false) = (emergency.or(tpdo_node(frame.id())), frame.is_remote()) {
            self.states.entry(node).or_insert(None);
        }
    }
}

/// Returns the node that sends a TPDO with this identifier in the predefined connection set (CiA 301, 7.3.5).
fn tpdo_node(id: CanId) -> Option<NodeId> {
    match id {
        CanId::Standard(number) if matches!(number & 0x780, 0x180 | 0x280 | 0x380 | 0x480) => {
            u8::try_from(number & 0x7f).ok().and_then(|number| NodeId::new(number).ok())
        }
        _ => None,
    }
}

/// Reads the device type (1000h) of every node, all in parallel, and from the second round on the vendor (1018h:1),
/// because some devices do not answer one of them.
///
/// A heartbeat, a boot-up message or a late answer also detects a node. Nodes without an answer are asked `rounds`
/// times. All rounds share one wait, which ends `timeout` after the last request of the first round. If states are
/// unknown, waits for heartbeats until 200 ms after this request, or until `timeout` if it is shorter.
///
/// The caller sets the filters: with [`Master::listen_to`] no TPDOs are received.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn find(master: &mut Master<'_>, nodes: &[NodeId], timeout: Duration, rounds: u32) -> Result<Presence, Error> {
    // On a slow bus a request may stay in the queue for longer than the time-out.
    let bit_rate = master.bus().bit_rate().filter(|&rate| rate > 0);
    let queue = Duration::from_micros(bit_rate.map_or(0, |rate| FULL_QUEUE_BITS * 1_000_000 / u64::from(rate)));
    let timeout = timeout + queue;
    let mut presence = Presence::default();
    let rounds = rounds.max(1);
    let asked_at = ask(master, (nodes, ObjectId::DEVICE_TYPE), timeout, &mut presence, |asked_at| match rounds {
        1 => asked_at + timeout,
        _ => asked_at + REPEAT_INTERVAL,
    })?;
    let end = asked_at + timeout;
    for round in 1..rounds {
        let missing = without_answer(nodes, &presence, |_| true);
        let within = end.since(master.now()).max(REPEAT_INTERVAL + queue);
        ask(master, (&missing, VENDOR), within, &mut presence, |asked_at| match round + 1 < rounds {
            true => asked_at + REPEAT_INTERVAL,
            false => end.max(asked_at + REPEAT_INTERVAL + queue),
        })?;
    }
    // Asks once more the nodes that were booting and missed the requests.
    let booted = without_answer(nodes, &presence, |node| presence.booted.contains(&node));
    ask(master, (&booted, VENDOR), timeout, &mut presence, |asked_at| asked_at + timeout)?;
    wait_for_states(master, asked_at + timeout.min(HEARTBEAT_TIMEOUT), &mut presence)?;
    Ok(presence)
}

fn without_answer(nodes: &[NodeId], presence: &Presence, is_wanted: impl Fn(NodeId) -> bool) -> Vec<NodeId> {
    nodes.iter().copied().filter(|&node| !presence.answered.contains(&node) && is_wanted(node)).collect()
}

/// Asks nodes once, and waits for their answers until `end(t)`. `t` is the time when the last request was sent. Returns
/// `t`.
fn ask(
    master: &mut Master<'_>,
    (nodes, object): (&[NodeId], ObjectId),
    timeout: Duration,
    presence: &mut Presence,
    end: impl Fn(Mono) -> Mono,
) -> Result<Mono, Error> {
    let mut asked_at = master.now();
    let mut pending: BTreeMap<Ticket, NodeId> = BTreeMap::new();
    for &node in nodes {
        pending.insert(master.start(Request::read(node, object).once().within(timeout)), node);
    }
    let (mut is_sending, mut until) = (true, asked_at);
    while !pending.is_empty() {
        let step = if is_sending { master.now() + SENDING_STEP } else { until };
        let waited = wait(master, step, Policy::Command, |master, event| {
            match event {
                MasterEvent::Sdo(ticket, result) => {
                    presence.on_result(result, pending.remove(&ticket), nodes.len() == 1)
                }
                event => presence.on_event(&event),
            }
            let is_sent = is_sending && !master.is_sending();
            if pending.is_empty() || is_sent { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        if is_sending {
            asked_at = master.now();
            is_sending = master.is_sending();
            // With one node, waits until its request times out: the error contains a frame that looks like its answer.
            until = if nodes.len() == 1 { end(asked_at) + SENDING_STEP } else { end(asked_at) };
        } else if waited.done().is_none() {
            break;
        }
    }
    master.forget(pending.keys().copied());
    Ok(asked_at)
}

/// Waits for the heartbeats of the nodes that answered.
fn wait_for_states(master: &mut Master<'_>, until: Mono, presence: &mut Presence) -> Result<(), Error> {
    let is_complete = |presence: &Presence| presence.answered.iter().all(|&node| presence.state(node).is_some());
    if is_complete(presence) {
        return Ok(());
    }
    wait(master, until, Policy::Command, |_, event| {
        presence.on_event(&event);
        if is_complete(presence) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok(())
}

/// Listens for `duration` without sending anything.
///
/// # Errors
/// Bus errors. Ctrl-C ends it early.
pub fn listen(master: &mut Master<'_>, duration: Duration) -> Result<Presence, Error> {
    master.listen(&Filters::All)?;
    let mut presence = Presence::default();
    let until = master.now() + duration;
    wait(master, until, Policy::Observe, |_, event| {
        match event {
            MasterEvent::Frame(received) => presence.on_any_frame(&received),
            event => presence.on_event(&event),
        }
        ControlFlow::<()>::Continue(())
    })?;
    Ok(presence)
}
