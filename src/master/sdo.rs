//! The SDO client: one transfer per node at a time, many nodes in parallel, with retries.
//!
//! A late answer never becomes the result of a later request: see [`StaleRequest`].

mod receive;

use super::Timing;
use super::active::ActiveTransfer;
use super::missed_answer::MissedAnswers;
use super::receive::CLOCK_DELAY;
use super::receive_times::ReceiveTimes;
use super::request::{Answer, Operation, Request, SdoError, SdoFailure, Ticket};
use super::second_answer::{Answers, OnTwoDevices, SecondAnswer};
use super::send::{Outgoing, SendTime};
use crate::bus::{Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::ErrorControlMessage;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, TransferError, proves_upload_answer_60};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// A request whose answer was not received in time. The answer may still come.
#[derive(Clone, Copy, Debug)]
struct StaleRequest {
    object: ObjectId,
    until: Mono,
}

#[derive(Debug, Default)]
pub(super) struct Node {
    waiting: VecDeque<(Ticket, Request)>,
    pub(super) active: Option<ActiveTransfer>,
    stale: Vec<StaleRequest>,
    answers: Answers,
    /// Whether a write was acknowledged.
    is_written: bool,
    /// Whether the node has [`crate::device::quirk::Quirk::UploadAnswered60`].
    accept_60: bool,
}

/// The longest delay of an answer. CiA 301 states no limit; storing takes the longest time.
const STALE_LIFETIME: Duration = Duration::from_secs(10);

/// The results of the transfers that have ended.
type Finished = VecDeque<(Ticket, Result<Answer, SdoError>)>;

/// The client side of all SDO channels.
#[derive(Debug, Default)]
pub(super) struct SdoClient {
    pub(super) nodes: BTreeMap<NodeId, Node>,
    /// Contains each node with a transfer in progress or waiting. A node without one is removed later. After a scan most
    /// nodes have no transfer: they are not searched for each frame.
    pub(super) open: BTreeSet<NodeId>,
    /// The nodes that have answered.
    answered: BTreeSet<NodeId>,
    finished: Finished,
    next_ticket: u64,
    /// A lower bound of the next deadline. It avoids a search through all nodes for each frame.
    due: Option<Mono>,
    /// Whether [`ActiveTransfer::read_clock_at`] may be set for a transfer in progress.
    pub(super) awaits_clock: bool,
    /// When all transfers together must have ended, and the time that they had.
    limit: Option<(Mono, Duration)>,
    /// Whether a node has a waiting transfer and none in progress.
    can_start: bool,
    pub(super) on_two_devices: OnTwoDevices,
    pub(super) missed_answers: MissedAnswers,
    pub(super) receive_times: ReceiveTimes,
    /// The length of the first heartbeat of each node whose length is not one byte.
    unusual_heartbeats: BTreeMap<NodeId, usize>,
}

impl SdoClient {
    /// Records a heartbeat of another length than one byte.
    pub(super) fn on_other_frame(&mut self, frame: &Frame) {
        if let Some((node, length)) = ErrorControlMessage::unusual_length(frame) {
            self.unusual_heartbeats.entry(node).or_insert(length);
        }
    }

    pub(super) fn unusual_heartbeats(&self) -> impl Iterator<Item = (NodeId, usize)> {
        self.unusual_heartbeats.iter().map(|(&node, &length)| (node, length))
    }

    pub(super) fn submit(&mut self, request: Request) -> Ticket {
        let ticket = Ticket { number: self.next_ticket, node: request.node };
        self.next_ticket += 1;
        let node = self.nodes.entry(request.node).or_default();
        self.open.insert(request.node);
        node.waiting.push_back((ticket, request));
        self.can_start |= node.active.is_none();
        ticket
    }

    pub(super) fn accept_60(&mut self, node: NodeId, accept: bool) {
        self.nodes.entry(node).or_default().accept_60 |= accept;
    }

    pub(super) fn is_busy(&self) -> bool {
        self.has_finished() || self.open_nodes().any(Node::is_open)
    }

    fn open_nodes(&self) -> impl Iterator<Item = &Node> {
        self.open.iter().filter_map(|number| self.nodes.get(number))
    }

    /// Whether [`SdoClient::advance`] would start something.
    pub(super) fn can_start(&self) -> bool {
        self.can_start
    }

    /// Whether frames with COB-IDs other than those of the nodes are needed.
    pub(super) fn wants_all_frames(&self) -> bool {
        self.missed_answers.wants_all_frames()
    }

    pub(super) fn has_finished(&self) -> bool {
        !self.finished.is_empty()
    }

    pub(super) fn pop_finished(&mut self) -> Option<(Ticket, Result<Answer, SdoError>)> {
        self.finished.pop_front()
    }

    /// Starts the next transfer of each node that has none in progress.
    pub(super) fn advance(&mut self, timing: &Timing, now: Mono, outgoing: &mut Outgoing) {
        if !std::mem::take(&mut self.can_start) {
            return;
        }
        let on_two_devices = self.on_two_devices;
        self.open.retain(|number| self.nodes.get(number).is_some_and(Node::is_open));
        for number in &self.open {
            let Some(node) = self.nodes.get_mut(number) else { continue };
            if node.active.is_some() {
                continue;
            }
            if let Some(failure) = node.refusal(on_two_devices) {
                for (ticket, request) in node.waiting.drain(..) {
                    let (node, object, operation) = (request.node, request.object, request.operation());
                    let error = SdoError::two_devices(node, object, operation, failure.clone());
                    self.finished.push_back((ticket, Err(error)));
                }
                continue;
            }
            let Some((ticket, request)) = node.waiting.pop_front() else { continue };
            node.stale.retain(|request| request.until > now);
            // A server answers in order. If a stale answer for this object may come, another object is read first
            // (barrier read). After the answer to the barrier read, no older answer can come.
            let has_stale_request = node.stale.iter().any(|stale| stale.object == request.object);
            let mut active = if has_stale_request {
                let other = node.barrier(request.object);
                let barrier = Request::read(request.node, other).with_timing_of(&request);
                ActiveTransfer {
                    deferred: Some((ticket, request)),
                    ..ActiveTransfer::new(ticket, barrier, node.accept_60, timing)
                }
            } else {
                ActiveTransfer::new(ticket, request, node.accept_60, timing)
            };
            active.enqueue(vec![active.machine.request()], outgoing);
            node.active = Some(active);
        }
    }

    /// The bus has accepted a frame of a transfer. The time-out starts after the last queued frame. An answer can be
    /// older than the moment after sending, if the program was interrupted.
    pub(super) fn on_sent(&mut self, ticket: Ticket, SendTime { before, after }: SendTime, timing: &Timing) {
        let active = self.nodes.get_mut(&ticket.node).and_then(|node| node.active.as_mut());
        if let Some(active) = active.filter(|active| active.ticket == ticket) {
            active.machine.on_sent();
            if active.asked_at.replace(active.asked_at.unwrap_or(before)).is_none() {
                self.missed_answers.on_request(ticket.node, active.request.object);
                self.receive_times.on_request(ticket.node, before);
            }
            active.unsent = active.unsent.saturating_sub(1);
            if active.unsent == 0 {
                match after {
                    Some(after) => active.start_timeout(after, timing),
                    None => {
                        active.read_clock_at = Some(before + CLOCK_DELAY);
                        self.awaits_clock = true;
                    }
                }
                self.due = Mono::earlier(self.due, active.due());
            }
        }
    }

    pub(super) fn active_transfers(&self) -> impl Iterator<Item = &ActiveTransfer> {
        self.open_nodes().filter_map(|node| node.active.as_ref())
    }

    /// Computes the next deadline from all transfers.
    pub(super) fn update_due(&mut self) {
        self.due = self.active_transfers().filter_map(ActiveTransfer::due).min();
    }

    /// Bytes transferred so far and in total, if known; `None` if the transfer is not in progress.
    pub(super) fn moved(&self, ticket: Ticket) -> Option<(usize, Option<usize>)> {
        let active = self.nodes.get(&ticket.node)?.active.as_ref();
        let active = active.filter(|active| active.ticket == ticket && active.deferred.is_none())?;
        Some(active.machine.moved())
    }

    /// A moment not later than the next time-out of a transfer.
    pub(super) fn next_deadline(&self) -> Option<Mono> {
        let limit = self.limit.filter(|_| self.is_busy()).map(|(until, _)| until);
        Mono::earlier(self.due, limit)
    }

    /// Sets when all transfers together must have ended, and the time that they have.
    pub(super) fn limit(&mut self, limit: Option<(Mono, Duration)>) {
        self.limit = limit;
    }

    /// Ends all transfers if their common time limit has passed.
    fn end_after_limit(&mut self, now: Mono, outgoing: &mut Outgoing) {
        let Some((_, time)) = self.limit.filter(|&(until, _)| now >= until) else { return };
        for node in self.nodes.values_mut() {
            let mut out = Vec::new();
            if let Some(mut active) = node.active.take() {
                active.machine.abort(AbortCode::TIMEOUT, &mut out);
                node.answers.on_repeated(active.request.object);
                outgoing.drop_ticket(active.ticket);
                node.waiting.push_front(active.deferred.unwrap_or((active.ticket, active.request)));
            }
            out.into_iter().for_each(|frame| outgoing.push(frame, None));
            for (ticket, request) in node.waiting.drain(..) {
                self.finished.push_back((ticket, Err(request.error(SdoFailure::TimeLimit(time)))));
            }
        }
        (self.due, self.can_start) = (None, false);
    }

    /// Handles a received frame; `false` if it does not belong to one of our transfers.
    pub(super) fn on_frame(&mut self, received: &Received, timing: &Timing, outgoing: &mut Outgoing) -> bool {
        let id = received.frame.id();
        // Most frames of a bus are PDOs. They can only be answers with a wrong COB-ID.
        if id.is_predefined_pdo() && !self.missed_answers.has_open() {
            return false;
        }
        self.receive_times.on_frame(received);
        let known = id.sdo_response_node().or_else(|| id.sdo_request_node());
        let Some(number) = known.filter(|node| self.nodes.contains_key(node)) else {
            self.missed_answers.on_other_cob_id(&received.frame, received.at.mono);
            return false;
        };
        let Some(node) = self.nodes.get_mut(&number) else { return false };
        let is_stale = node.has_stale(&received.frame);
        let is_ours = node.on_frame(received, timing, outgoing, &mut self.finished);
        if is_ours {
            self.answered.insert(number);
            self.missed_answers.on_answer(number);
        } else if !is_stale {
            self.missed_answers.on_channel(number, &received.frame, received.at.mono);
        }
        node.accept_60 |= is_ours && proves_upload_answer_60(&received.frame);
        self.due = Mono::earlier(self.due, node.active.as_ref().and_then(|active| active.deadline));
        self.can_start |= node.active.is_none() && !node.waiting.is_empty();
        is_ours
    }

    /// Handles the transfers whose deadline has passed.
    pub(super) fn on_time(&mut self, now: Mono, timing: &Timing, outgoing: &mut Outgoing) {
        self.end_after_limit(now, outgoing);
        if self.due.is_none_or(|due| now < due) {
            return;
        }
        self.handle_timeouts(now, timing, outgoing);
        self.update_due();
        let can_start = self.open_nodes().any(|node| node.active.is_none() && !node.waiting.is_empty());
        self.can_start = can_start;
    }

    fn handle_timeouts(&mut self, now: Mono, timing: &Timing, outgoing: &mut Outgoing) {
        for node in self.nodes.values_mut() {
            let Some(active) = node.active.as_mut().filter(|active| active.deadline.is_some_and(|at| at <= now)) else {
                continue;
            };
            if active.foreign.back_off_until().is_some() {
                active.foreign.restart();
                active.enqueue(vec![active.machine.request()], outgoing);
                continue;
            }
            let has_begun = active.machine.has_begun();
            let is_explained = has_begun && active.foreign.explains(TransferError::NoAnswer);
            let is_over = active.is_over(now, timing);
            if !is_over && is_explained && active.back_off(node.accept_60, now, timing, outgoing) {
                continue;
            }
            let mut out = Vec::new();
            if is_over {
                active.machine.abort(AbortCode::TIMEOUT, &mut out);
            } else if active.machine.on_timeout(&mut out).is_none() {
                active.enqueue(out, outgoing);
                continue;
            }
            if !is_over && active.restart(TransferError::NoAnswer, node.accept_60, &mut out, outgoing) {
                node.answers.on_repeated(active.request.object);
                continue;
            }
            if !has_begun {
                node.stale.push(StaleRequest { object: active.request.object, until: now + STALE_LIFETIME });
                node.answers.on_repeated(active.request.object);
                let may_repeat = active.request.repeatable && timing.retries > 0;
                let is_starting =
                    may_repeat && self.missed_answers.is_starting(active.request.node, active.asked_at, now);
                if active.attempts_left > 0 || is_starting {
                    active.is_repeated = true;
                    active.attempts_left = active.attempts_left.saturating_sub(1);
                    self.missed_answers.on_repeat(active.request.node);
                    out.push(active.machine.request());
                    active.enqueue(out, outgoing);
                    continue;
                }
            }
            let Some(mut active) = node.active.take() else { continue };
            out.into_iter().for_each(|frame| outgoing.push(frame, None));
            if !has_begun && active.request.repeatable && active.request.falls_back() {
                // Some servers do not answer unknown requests.
                active.request.fall_back();
                node.waiting.push_front((active.ticket, active.request));
                continue;
            }
            self.missed_answers.add_time_without_answer(active.time_after_retries(now, timing));
            let missed = self.missed_answers.end(active.request.node);
            let failure = match active.request.operation() {
                _ if is_over => SdoFailure::TimeLimit(active.time(timing)),
                Operation::Read if active.foreign.is_served() => active.disturbance(),
                _ => SdoFailure::NoAnswer { waited: active.timeout(timing), started: has_begun, missed },
            };
            self.finished.push_back((active.ticket, Err(active.error_of_sent(failure))));
        }
    }

    /// Drops one transfer without an abort.
    pub(super) fn forget(&mut self, ticket: Ticket) {
        let Some(node) = self.nodes.get_mut(&ticket.node) else { return };
        node.waiting.retain(|(waiting, _)| *waiting != ticket);
        if let Some(active) = node.active.take_if(|active| active.ticket == ticket) {
            node.answers.on_repeated(active.request.object);
            self.missed_answers.end(ticket.node);
        }
        self.can_start |= node.active.is_none() && !node.waiting.is_empty();
    }

    pub(super) fn on_two_devices(&self) -> OnTwoDevices {
        self.on_two_devices
    }

    /// Takes over what another client found out about its nodes.
    pub(super) fn merge(&mut self, other: SdoClient) {
        self.unusual_heartbeats.extend(other.unusual_heartbeats);
        self.answered.extend(other.answered);
        for (id, other) in other.nodes {
            let node = self.nodes.entry(id).or_default();
            node.answers = other.answers;
            node.is_written |= other.is_written;
            node.stale.extend(other.stale);
        }
    }

    /// The nodes with second answers.
    pub(super) fn second_answers(&self) -> impl Iterator<Item = (NodeId, SecondAnswer)> {
        self.nodes.iter().filter_map(|(&id, node)| Some((id, node.answers.finding()?)))
    }

    /// The failure of a transfer that is complete, if two devices answer it.
    pub(super) fn failure_of(&self, node: NodeId, object: ObjectId) -> Option<SdoFailure> {
        let node = self.nodes.get(&node)?;
        let has_two = node.answers.differing().filter(|answers| answers.object() == Some(object));
        node.refusal(self.on_two_devices).or(has_two.map(|answers| SdoFailure::TwoDevices(Some(answers))))
    }

    /// Whether the serial number of a node must be read before the first write.
    pub(super) fn take_check(&mut self, node: NodeId) -> bool {
        self.nodes.entry(node).or_default().answers.take_check()
    }

    /// The end of the time in which second answers may arrive. `None` if no node needs this time, or if a transfer is
    /// in progress.
    pub(super) fn second_answer_until(&self) -> Option<Mono> {
        if self.is_busy() {
            return None;
        }
        let answered = self.answered.iter().filter_map(|number| self.nodes.get(number));
        answered.filter_map(|node| node.answers.wait_until()).max()
    }

    /// Records that the master has waited for second answers until `now`.
    pub(super) fn on_waited(&mut self, now: Mono) {
        self.nodes.values_mut().for_each(|node| node.answers.on_waited(now));
    }

    /// Ends all transfers. The aborts for the servers go to `out`.
    pub(super) fn cancel(&mut self, out: &mut Vec<Frame>) {
        for node in self.nodes.values_mut() {
            if let Some(mut active) = node.active.take() {
                active.machine.abort(AbortCode::TIMEOUT, out);
                // Its answer may still arrive.
                node.answers.on_repeated(active.request.object);
            }
            node.waiting.clear();
        }
        self.finished.clear();
        self.missed_answers.cancel();
        (self.due, self.can_start) = (None, false);
    }
}

impl Node {
    /// Whether a transfer is in progress or waiting.
    fn is_open(&self) -> bool {
        self.active.is_some() || !self.waiting.is_empty()
    }

    /// The object for a barrier read: not `object`, and without a stale request.
    fn barrier(&self, object: ObjectId) -> ObjectId {
        let is_fresh =
            |other: &ObjectId| *other != object && !self.stale.iter().any(|request| request.object == *other);
        let fallback = if object == ObjectId::DEVICE_TYPE { ERROR_REGISTER } else { ObjectId::DEVICE_TYPE };
        [ObjectId::DEVICE_TYPE, ERROR_REGISTER, IDENTITY].into_iter().find(is_fresh).unwrap_or(fallback)
    }

    /// Why transfers with this node are rejected; `None` if they are allowed.
    fn refusal(&self, reaction: OnTwoDevices) -> Option<SdoFailure> {
        let answers = self.answers.differing()?;
        match reaction {
            OnTwoDevices::RefuseWrites if !self.is_written => Some(SdoFailure::NotWritten(answers)),
            OnTwoDevices::Fail | OnTwoDevices::RefuseWrites => Some(SdoFailure::TwoDevices(Some(answers))),
            OnTwoDevices::Report => None,
        }
    }

    fn has_stale(&self, frame: &Frame) -> bool {
        matches!(frame.data(), [_, a, b, c, ..]
            if self.stale.iter().any(|request| request.object == ObjectId::from_multiplexer([*a, *b, *c])))
    }

    /// Removes the stale request that this frame answers, if any.
    fn remove_stale(&mut self, frame: &Frame) {
        if let (Some(_), [_, a, b, c, ..]) = (frame.id().sdo_response_node(), frame.data()) {
            let object = ObjectId::from_multiplexer([*a, *b, *c]);
            if let Some(at) = self.stale.iter().position(|request| request.object == object) {
                self.stale.remove(at);
            }
        }
    }
}

const ERROR_REGISTER: ObjectId = ObjectId::new(0x1001, 0);
const IDENTITY: ObjectId = ObjectId::new(0x1018, 0);
