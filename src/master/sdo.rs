//! The SDO client: one transfer a node at a time, many nodes side by side, retries, and the rule that a
//! late answer never becomes the next reading.

use super::Timing;
use super::company::Company;
use super::machine::Machine;
use super::request::{Answer, Operation, Request, SdoError, SdoFailure, Ticket};
use super::send::Outgoing;
use super::transfer::{Blocks, Way, names_the_object};
use crate::bus::{Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, Progress, TransferError, Uploaded};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// A transfer under way.
#[derive(Debug)]
struct Active {
    ticket: Ticket,
    request: Request,
    machine: Machine,
    /// Set when the last frame went out, never renewed by other traffic.
    deadline: Option<Mono>,
    /// Frames given out that are not on their way yet.
    unsent: usize,
    attempts_left: u32,
    /// When the first request went out: what came before is no answer to it.
    asked_at: Option<Mono>,
    company: Company,
    /// The user's transfer that waits while this one makes sure that no old answer is still under way.
    behind: Option<(Ticket, Request)>,
    /// Another client writes the same object: whose acknowledge comes cannot be told.
    ambiguous: bool,
}

/// A request that got no answer, whose answer may still come.
#[derive(Clone, Copy, Debug)]
struct Ghost {
    object: ObjectId,
    until: Mono,
}

#[derive(Debug, Default)]
struct Node {
    waiting: VecDeque<(Ticket, Request)>,
    active: Option<Active>,
    ghosts: Vec<Ghost>,
    /// [`crate::device::quirk::Quirk::UploadAnswered60`] acts here.
    accept_60: bool,
}

/// How long an answer may be late. Nothing in the standard bounds it; storing takes the longest.
const GHOST_LIFE: Duration = Duration::from_secs(10);

/// How exactly the moments of sending and receiving can be compared.
const SLACK: Duration = Duration::from_millis(5);

/// The client's side of every SDO channel.
#[derive(Debug, Default)]
pub(super) struct SdoClient {
    nodes: BTreeMap<NodeId, Node>,
    finished: VecDeque<(Ticket, Result<Answer, SdoError>)>,
    next_ticket: u64,
    /// Not after the first deadline of those under way: a frame must not cost a look at every node.
    due: Option<Mono>,
    /// Whether a node has a transfer that waits and none under way.
    can_start: bool,
}

impl Active {
    fn new(ticket: Ticket, request: Request, accept_60: bool, timing: &Timing) -> Active {
        // A server that does not answer a request for blocks is asked in the usual way next.
        let attempts = if request.falls_back() { 0 } else { timing.retries };
        let attempts_left = if request.repeatable { attempts } else { 0 };
        let machine = request.machine(accept_60);
        let (deadline, asked_at, behind) = (None, None, None);
        let company = Company::default();
        Active {
            ticket,
            request,
            machine,
            deadline,
            unsent: 0,
            attempts_left,
            asked_at,
            company,
            behind,
            ambiguous: false,
        }
    }

    /// Hands frames to the queue, in place of those that are still in it.
    fn give(&mut self, frames: Vec<Frame>, outgoing: &mut Outgoing) {
        if self.unsent > 0 {
            outgoing.drop_ticket(self.ticket);
        }
        self.unsent = frames.len();
        self.deadline = None;
        for frame in frames {
            outgoing.push(frame, Some(self.ticket));
        }
    }

    /// Whether a frame seems to answer a segment that still waits to be sent: it is that of another device with this
    /// node-ID. A request that waits may be the repetition of one that is answered, and a server may give up any time.
    fn owes_what_is_answered(&self, frame: &Frame) -> bool {
        let in_segments = self.machine.has_begun() && !self.machine.is_in_blocks();
        self.unsent > 0 && in_segments && frame.data().first() != Some(&0x80)
    }

    /// Another master has got in the way: begins anew when it is done, if that may be. The server is told
    /// nothing, since the transfer that it has now is not ours.
    fn stand_back(&mut self, accept_60: bool, now: Mono, timing: &Timing, outgoing: &mut Outgoing) -> bool {
        let patience = self.waited(timing) * (1 + timing.retries);
        if !self.request.repeatable || !self.company.stand_back(now, patience) {
            return false;
        }
        self.give(Vec::new(), outgoing);
        self.machine = self.request.machine(accept_60);
        self.asked_at = None;
        self.deadline = self.company.back_until();
        true
    }

    /// Takes a frame that is no answer to us. Whether the transfer can go on.
    fn overhear(&mut self, accept_60: bool, received: &Received, timing: &Timing, outgoing: &mut Outgoing) -> bool {
        let now = received.at.mono;
        self.company.hear(&received.frame, now);
        if let Some(until) = self.company.back_until() {
            self.deadline = Some(until);
            return true;
        }
        let in_segments = self.machine.has_begun() && !self.machine.is_in_blocks();
        !in_segments || !self.company.is_in_the_way() || self.stand_back(accept_60, now, timing, outgoing)
    }

    /// Whether what has just come to its end in segments may not be ours alone.
    fn is_doubtful(&self, uploaded: Option<&Uploaded>) -> bool {
        let in_segments = self.machine.has_begun() && !self.machine.is_in_blocks();
        let delivered = uploaded.map_or(0, |uploaded| uploaded.bytes.len());
        in_segments && self.company.casts_doubt(uploaded.and_then(|uploaded| uploaded.announced), delivered)
    }

    /// A read turns out to be of a large object: it is asked for in blocks, from the start.
    fn turn_to_blocks(&mut self, accept_60: bool, out: &mut Vec<Frame>) {
        out.clear();
        self.machine.abort(AbortCode::GENERAL, out);
        self.request.blocks = Blocks::First { threshold: 0 };
        self.attempts_left = 0;
        self.machine = self.request.machine(accept_60);
        out.push(self.machine.request());
    }

    /// Whether the transfer has just failed only because the server does not do blocks.
    fn is_refused_for_blocks(&self, error: TransferError) -> bool {
        // What the device says of the object itself it would say again. A write that was answered with
        // something unheard of may have done something.
        let refused = match error {
            TransferError::Aborted(code) => !names_the_object(code),
            TransferError::Violation(..) => self.request.operation() == Operation::Read,
            TransferError::NoAnswer => false,
        };
        refused && self.request.falls_back() && !self.machine.has_begun()
    }

    fn way(&self) -> Way {
        if self.machine.is_in_blocks() {
            Way::Blocks
        } else if self.request.refused_blocks {
            Way::PlainAfterAll
        } else {
            Way::Plain
        }
    }

    fn waited(&self, timing: &Timing) -> Duration {
        self.request.timeout.unwrap_or(timing.timeout)
    }

    fn error(&self, failure: SdoFailure) -> SdoError {
        SdoError { node: self.request.node, object: self.request.object, operation: self.request.operation(), failure }
    }

    /// Takes a request of another client: the acknowledges of two writes of one object cannot be told apart.
    fn hear_request(&mut self, frame: &Frame) {
        if let [command, a, b, c, ..] = frame.data() {
            let same = ObjectId::from_multiplexer([*a, *b, *c]) == self.request.object;
            self.ambiguous |= same && command >> 5 == 1 && self.request.operation() == Operation::Write;
        }
    }
}

impl SdoClient {
    pub(super) fn submit(&mut self, request: Request) -> Ticket {
        let ticket = Ticket { number: self.next_ticket, node: request.node };
        self.next_ticket += 1;
        let node = self.nodes.entry(request.node).or_default();
        node.waiting.push_back((ticket, request));
        self.can_start |= node.active.is_none();
        ticket
    }

    pub(super) fn accept_60(&mut self, node: NodeId, accept: bool) {
        self.nodes.entry(node).or_default().accept_60 = accept;
    }

    pub(super) fn is_busy(&self) -> bool {
        self.has_finished() || self.nodes.values().any(|node| node.active.is_some() || !node.waiting.is_empty())
    }

    /// Whether [`SdoClient::advance`] would start something.
    pub(super) fn can_start(&self) -> bool {
        self.can_start
    }

    pub(super) fn has_finished(&self) -> bool {
        !self.finished.is_empty()
    }

    pub(super) fn pop_finished(&mut self) -> Option<(Ticket, Result<Answer, SdoError>)> {
        self.finished.pop_front()
    }

    /// Starts what can start: the next transfer of every node that has none under way.
    pub(super) fn advance(&mut self, timing: &Timing, now: Mono, outgoing: &mut Outgoing) {
        if !std::mem::take(&mut self.can_start) {
            return;
        }
        for node in self.nodes.values_mut() {
            if node.active.is_some() {
                continue;
            }
            let Some((ticket, request)) = node.waiting.pop_front() else { continue };
            node.ghosts.retain(|ghost| ghost.until > now);
            // A server answers in order. While an answer for this very object may still be under way, a read
            // of another object comes first: once that is answered, nothing older can come.
            let haunted = node.ghosts.iter().any(|ghost| ghost.object == request.object);
            let mut active = if haunted {
                let other = node.barrier(request.object);
                let barrier = Request::read(request.node, other).patient_as(&request);
                Active { behind: Some((ticket, request)), ..Active::new(ticket, barrier, node.accept_60, timing) }
            } else {
                Active::new(ticket, request, node.accept_60, timing)
            };
            active.give(vec![active.machine.request()], outgoing);
            node.active = Some(active);
        }
    }

    /// A frame of a transfer is on its way: once the last of those given out is, its answer is waited for.
    pub(super) fn on_sent(&mut self, ticket: Ticket, now: Mono, timing: &Timing) {
        let active = self.nodes.get_mut(&ticket.node).and_then(|node| node.active.as_mut());
        if let Some(active) = active.filter(|active| active.ticket == ticket) {
            active.machine.on_sent();
            active.asked_at.get_or_insert(now);
            active.unsent = active.unsent.saturating_sub(1);
            if active.unsent == 0 {
                active.deadline = Some(now + active.waited(timing));
                self.due = earlier(self.due, active.deadline);
            }
        }
    }

    /// Bytes transferred so far and bytes in all, where known; `None` of a transfer that is not under way.
    pub(super) fn moved(&self, ticket: Ticket) -> Option<(usize, Option<usize>)> {
        let active = self.nodes.get(&ticket.node)?.active.as_ref();
        let active = active.filter(|active| active.ticket == ticket && active.behind.is_none())?;
        Some(active.machine.moved())
    }

    /// When a transfer's time may be over, and not later than it is.
    pub(super) fn next_deadline(&self) -> Option<Mono> {
        self.due
    }

    /// Takes a frame; `false` if it is no SDO frame of a node that we deal with.
    pub(super) fn on_frame(&mut self, received: &Received, timing: &Timing, outgoing: &mut Outgoing) -> bool {
        let id = received.frame.id();
        let Some(number) = id.sdo_response_node().or_else(|| id.sdo_request_node()) else { return false };
        let is_ours = self.on_frame_of(number, received, timing, outgoing);
        if let Some(node) = self.nodes.get(&number) {
            self.due = earlier(self.due, node.active.as_ref().and_then(|active| active.deadline));
            self.can_start |= node.active.is_none() && !node.waiting.is_empty();
        }
        is_ours
    }

    fn on_frame_of(&mut self, number: NodeId, received: &Received, timing: &Timing, outgoing: &mut Outgoing) -> bool {
        let id = received.frame.id();
        let Some(node) = self.nodes.get_mut(&number) else { return false };
        let Some(active) = &mut node.active else {
            node.settle(&received.frame);
            return false;
        };
        let mut out = Vec::new();
        let at = received.at.mono;
        let progress = match active.asked_at {
            Some(asked_at) if at + SLACK >= asked_at && !active.owes_what_is_answered(&received.frame) => {
                active.machine.on_frame(&received.frame, &mut out)
            }
            _ => Progress::NotOurs,
        };
        let result = match progress {
            Progress::NotOurs => {
                if id.sdo_request_node().is_some() {
                    active.hear_request(&received.frame);
                }
                if !active.overhear(node.accept_60, received, timing, outgoing) {
                    let error = active.error(SdoFailure::Disturbed);
                    self.finished.push_back((active.ticket, Err(error)));
                    outgoing.drop_ticket(active.ticket);
                    node.active = None;
                }
                node.settle(&received.frame);
                return false;
            }
            Progress::Continue if out.is_empty() => {
                // A part of a sub-block: the next one has its own time.
                if active.unsent == 0 {
                    active.deadline = Some(received.at.mono + active.waited(timing));
                }
                return true;
            }
            Progress::Continue => {
                if active.request.blocks == Blocks::WhenLarge && active.machine.is_worth_blocks() {
                    active.turn_to_blocks(node.accept_60, &mut out);
                }
                active.give(out, outgoing);
                return true;
            }
            Progress::Done(_) if active.ambiguous => Err(active.error(SdoFailure::Ambiguous)),
            Progress::Done(uploaded) if active.is_doubtful(uploaded.as_ref()) => {
                if active.stand_back(node.accept_60, at, timing, outgoing) {
                    return true;
                }
                Err(active.error(SdoFailure::Disturbed))
            }
            Progress::Done(uploaded) => Ok(Answer { uploaded, at: received.at, way: active.way() }),
            Progress::Failed(error) if active.company.explains(error) => {
                if active.stand_back(node.accept_60, at, timing, outgoing) {
                    return true;
                }
                // An abort would hit their transfer.
                out.clear();
                Err(active.error(SdoFailure::Disturbed))
            }
            Progress::Failed(error) => {
                if active.is_refused_for_blocks(error) {
                    active.request.fall_back();
                    *active = Active::new(active.ticket, active.request.clone(), node.accept_60, timing);
                    active.give(vec![active.machine.request()], outgoing);
                    return true;
                }
                Err(active.error(match error {
                    TransferError::Aborted(code) => SdoFailure::Refused(code),
                    TransferError::Violation(violation, frame) => SdoFailure::Violation(violation, frame),
                    TransferError::NoAnswer => SdoFailure::Cancelled,
                }))
            }
        };
        for frame in out {
            outgoing.push(frame, None);
        }
        if let Some(active) = node.active.take() {
            outgoing.drop_ticket(active.ticket);
            match active.behind {
                // Refused or answered: either way everything older has been answered before, and to its own
                // repetitions an answer comes before that to what waits behind.
                Some(behind) => {
                    node.ghosts.clear();
                    node.waiting.push_front(behind);
                }
                None => self.finished.push_back((active.ticket, result)),
            }
        }
        true
    }

    /// Looks for transfers whose time is over.
    pub(super) fn on_time(&mut self, now: Mono, timing: &Timing, outgoing: &mut Outgoing) {
        if self.due.is_none_or(|due| now < due) {
            return;
        }
        self.end_what_is_over(now, timing, outgoing);
        self.due = self.nodes.values().filter_map(|node| node.active.as_ref()?.deadline).min();
        self.can_start = self.nodes.values().any(|node| node.active.is_none() && !node.waiting.is_empty());
    }

    fn end_what_is_over(&mut self, now: Mono, timing: &Timing, outgoing: &mut Outgoing) {
        for node in self.nodes.values_mut() {
            let Some(active) = node.active.as_mut().filter(|active| active.deadline.is_some_and(|at| at <= now)) else {
                continue;
            };
            if active.company.back_until().is_some() {
                active.company.begin();
                active.give(vec![active.machine.request()], outgoing);
                continue;
            }
            let begun = active.machine.has_begun();
            let explained = begun && active.company.explains(TransferError::NoAnswer);
            if explained && active.stand_back(node.accept_60, now, timing, outgoing) {
                continue;
            }
            let mut out = Vec::new();
            if active.machine.on_timeout(&mut out).is_none() {
                active.give(out, outgoing);
                continue;
            }
            if !begun {
                node.ghosts.push(Ghost { object: active.request.object, until: now + GHOST_LIFE });
                if active.attempts_left > 0 {
                    active.attempts_left -= 1;
                    out.push(active.machine.request());
                    active.give(out, outgoing);
                    continue;
                }
            }
            let Some(mut active) = node.active.take() else { continue };
            for frame in out {
                outgoing.push(frame, None);
            }
            if !begun && active.request.repeatable && active.request.falls_back() {
                // Some servers do not even refuse what they do not know.
                active.request.fall_back();
                node.waiting.push_front((active.ticket, active.request));
                continue;
            }
            let waited = active.waited(timing);
            let mut error = active.error(SdoFailure::NoAnswer { waited, begun });
            // A write that waited behind it and was never sent, not even as a question for blocks, must not be said to
            // have been.
            let asked = |request: &Request| request.operation() == Operation::Read || request.refused_blocks;
            if let Some((_, request)) = active.behind.as_ref().filter(|(_, request)| asked(request)) {
                (error.object, error.operation) = (request.object, request.operation());
            }
            self.finished.push_back((active.ticket, Err(error)));
        }
    }

    /// Drops one transfer without telling its server.
    pub(super) fn forget(&mut self, ticket: Ticket) {
        let Some(node) = self.nodes.get_mut(&ticket.node) else { return };
        node.waiting.retain(|(waiting, _)| *waiting != ticket);
        if node.active.as_ref().is_some_and(|active| active.ticket == ticket) {
            node.active = None;
        }
        self.can_start |= node.active.is_none() && !node.waiting.is_empty();
    }

    /// Ends everything; what is to be told to servers goes to `out`.
    pub(super) fn cancel(&mut self, out: &mut Vec<Frame>) {
        for node in self.nodes.values_mut() {
            if let Some(mut active) = node.active.take() {
                active.machine.abort(AbortCode::TIMEOUT, out);
            }
            node.waiting.clear();
        }
        self.finished.clear();
        (self.due, self.can_start) = (None, false);
    }
}

fn earlier(one: Option<Mono>, other: Option<Mono>) -> Option<Mono> {
    one.into_iter().chain(other).min()
}

impl Node {
    /// An object other than `object` of which no answer is under way either: an old one would prove nothing.
    fn barrier(&self, object: ObjectId) -> ObjectId {
        let is_fresh = |other: &ObjectId| *other != object && !self.ghosts.iter().any(|ghost| ghost.object == *other);
        let fallback = if object == DEVICE_TYPE { ERROR_REGISTER } else { DEVICE_TYPE };
        [DEVICE_TYPE, ERROR_REGISTER, IDENTITY].into_iter().find(is_fresh).unwrap_or(fallback)
    }

    /// An answer that nobody waits for: it is that of a request given up.
    fn settle(&mut self, frame: &Frame) {
        if let (Some(_), [_, a, b, c, ..]) = (frame.id().sdo_response_node(), frame.data()) {
            let object = ObjectId::from_multiplexer([*a, *b, *c]);
            if let Some(at) = self.ghosts.iter().position(|ghost| ghost.object == object) {
                self.ghosts.remove(at);
            }
        }
    }
}

const DEVICE_TYPE: ObjectId = ObjectId::new(0x1000, 0);
const ERROR_REGISTER: ObjectId = ObjectId::new(0x1001, 0);
const IDENTITY: ObjectId = ObjectId::new(0x1018, 0);
