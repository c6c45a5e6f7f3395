//! Drives the protocol state machines over a [`Bus`]: one deadline per exchange, retries, matching of answers, many
//! exchanges in parallel.
//!
//! [`Master::next`] is the only loop. It sends waiting frames, receives one event, passes the event to the SDO client
//! and returns the result. All blocking functions use it.

mod active;
mod foreign_traffic;
pub mod lss;
mod machine;
mod missed_answer;
mod parallel;
mod raw;
mod receive;
mod receive_times;
mod request;
mod sdo;
mod second_answer;
mod send;
mod transcript;
pub mod transfer;

pub use lss::{Lss, LssError};
pub use missed_answer::MissedAnswer;
pub use request::{Answer, NUMBER_LIMIT, Operation, Request, SdoError, SdoFailure, TEXT_LIMIT, Ticket};
pub use second_answer::{Answers, OnTwoDevices, SecondAnswer};
pub use transcript::{RecordedFrame, Transcript};
pub use transfer::{BlockMode, Blocks, LARGE, Moved, SMALL, TransferKind, read_object, write_object};

use crate::bus::{Bus, BusError, Event, Fault, Filters, Mono, Received, Stamp};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtCommand;
use crate::canopen::object::ObjectId;
use crate::device::quirk::Quirk;
use sdo::SdoClient;
use send::Outgoing;
use std::time::Duration;

/// How long [`Master::drain`] accepts frames after `stop`.
const DRAIN_LIMIT: Duration = Duration::from_secs(1);

const SERIAL_NUMBER: ObjectId = ObjectId::new(0x1018, 4);

/// Time-out and retries of requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// The longest wait for one answer.
    pub timeout: Duration,
    /// How often a request without an answer is repeated.
    pub retries: u32,
}

impl Default for Timing {
    fn default() -> Timing {
        Timing { timeout: Duration::from_millis(500), retries: 1 }
    }
}

/// Why an operation of the master failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A transfer with one device failed.
    #[error("node {}: {}", .0.node, .0)]
    Sdo(SdoError),
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}

impl From<SdoError> for Error {
    fn from(error: SdoError) -> Error {
        Error::Sdo(error)
    }
}

/// An event that [`Master::next`] returns.
#[derive(Debug)]
pub enum MasterEvent {
    /// A frame that does not belong to our SDO transfers.
    Frame(Received),
    /// An SDO transfer has ended.
    Sdo(Ticket, Result<Answer, SdoError>),
    /// The controller reports a fault.
    Fault(Fault, Stamp),
    /// The kernel dropped frames.
    Dropped(u32),
    /// The interface went down (`false`) or came up (`true`).
    Link(bool),
    /// The deadline was reached.
    Deadline,
    /// The replayed recording has ended.
    Ended,
    /// The user asked to stop (Ctrl-C, SIGTERM).
    Interrupted,
}

/// A CANopen master on a bus.
pub struct Master<'bus> {
    bus: &'bus mut dyn Bus,
    timing: Timing,
    sdo: SdoClient,
    filters: Filters,
    /// Whether the bus delivers all frames, independently of the filters.
    receives_all: bool,
    /// Whether answers to our transfers are returned as frames too.
    delivers_answers: bool,
    /// Whether received frames are not passed to the SDO client. See [`Master::exchange`].
    bypasses_sdo: bool,
    outgoing: Outgoing,
    /// A frame that was received after the deadline. It is handled next.
    pending: Option<Received>,
    /// The last NMT command of another master.
    foreign_nmt: Option<(NmtCommand, Option<NodeId>)>,
    /// The latest known moment, stored to read the clock less often.
    seen: Mono,
}

impl<'bus> Master<'bus> {
    /// Creates a master on `bus`.
    pub fn new(bus: &'bus mut dyn Bus, timing: Timing) -> Master<'bus> {
        let (sdo, filters, outgoing) = (SdoClient::default(), Filters::All, Outgoing::new());
        let (receives_all, delivers_answers, bypasses_sdo) = (false, false, false);
        let (pending, foreign_nmt, seen) = (None, None, Mono::START);
        Master {
            bus,
            timing,
            sdo,
            filters,
            receives_all,
            delivers_answers,
            bypasses_sdo,
            outgoing,
            pending,
            foreign_nmt,
            seen,
        }
    }

    /// Sets the host's interface to another bit rate in bit/s. Transfers in progress end, and waiting frames are lost.
    ///
    /// # Errors
    /// The interface rejects the bit rate. It may then be down.
    pub fn set_bit_rate(&mut self, bit_rate: u32) -> Result<(), BusError> {
        self.sdo.cancel(&mut Vec::new());
        self.outgoing.reset();
        self.pending = None;
        self.bus.set_bit_rate(bit_rate, crate::bus::Mode::Normal)
    }

    /// The bus.
    pub fn bus(&self) -> &dyn Bus {
        &*self.bus
    }

    /// The time-out and retries of this master.
    pub fn timing(&self) -> Timing {
        self.timing
    }

    /// The present moment.
    pub fn now(&self) -> Mono {
        self.bus.mono()
    }

    /// Sets which frames the bus delivers.
    ///
    /// # Errors
    /// The bus rejects the filters.
    pub fn listen(&mut self, filters: &Filters) -> Result<(), Error> {
        self.filters = filters.clone();
        if !self.receives_all {
            self.bus.listen(filters)?;
        }
        Ok(())
    }

    /// The last NMT command of another master, and its node (`None`: all nodes).
    pub fn foreign_nmt(&self) -> Option<(NmtCommand, Option<NodeId>)> {
        self.foreign_nmt
    }

    /// Receives only NMT commands, LSS answers, and the SDO channels and the heartbeats of these nodes. On a busy bus,
    /// other frames cost time and may fill the receive buffer.
    ///
    /// # Errors
    /// The bus rejects the filters.
    pub fn listen_to(&mut self, nodes: &[NodeId]) -> Result<(), Error> {
        let ids = |&node| [CanId::sdo_response(node), CanId::sdo_request(node), CanId::heartbeat(node)];
        self.listen(&Filters::Only(nodes.iter().flat_map(ids).chain([CanId::NMT, CanId::LSS_SLAVE]).collect()))
    }

    /// Also returns the answers to our own transfers as [`MasterEvent::Frame`].
    pub fn deliver_own_answers(&mut self) {
        self.delivers_answers = true;
    }

    /// Queues a frame for sending, after all waiting frames.
    pub fn send(&mut self, frame: Frame) {
        self.outgoing.push(frame, None);
    }

    /// Queues a frame before all waiting frames, so that a SYNC does not wait for SDO requests. Returns `false` and
    /// queues nothing if an equal frame is already the next one.
    pub fn send_first(&mut self, frame: Frame) -> bool {
        self.outgoing.push_first(frame)
    }

    /// Returns the time at which the bus accepted the frame of [`Master::send_first`], and clears the time. `None` if
    /// the frame still waits or was dropped.
    pub fn take_first_at(&mut self) -> Option<Mono> {
        self.outgoing.take_first_at()
    }

    /// Removes the frame of [`Master::send_first`] from the queue. Returns `true` if it was not sent yet.
    pub fn remove_first(&mut self) -> bool {
        self.outgoing.remove_first()
    }

    /// Returns the number of frames that the kernel dropped and that no event reported. See [`Bus::unreported_drops`].
    pub fn unreported_drops(&mut self) -> u32 {
        self.bus.unreported_drops()
    }

    /// Sets whether an interface that is down and a bus without acknowledgement are tolerated. If so, frames that
    /// cannot be sent are dropped. If not, both are errors, which is the default.
    pub fn set_tolerates_outages(&mut self, tolerates_outages: bool) {
        self.outgoing.set_tolerates_outages(tolerates_outages);
    }

    /// Starts an SDO transfer. Its result comes as [`MasterEvent::Sdo`] with the returned ticket. Each node has one
    /// transfer at a time; further transfers wait.
    pub fn start(&mut self, request: Request) -> Ticket {
        self.sdo.submit(request)
    }

    /// Sets how a node's SDO server deviates from the standard.
    pub fn set_quirks(&mut self, node: NodeId, quirks: &[Quirk]) {
        self.sdo.accept_60(node, quirks.contains(&Quirk::UploadAnswered60));
    }

    /// Returns the nodes that sent heartbeats of a length other than one byte, and the length of the first of these.
    pub fn unusual_heartbeats(&self) -> impl Iterator<Item = (NodeId, usize)> {
        self.sdo.unusual_heartbeats()
    }

    /// Makes sure, before the first write to a node, that no two devices have its node-ID.
    ///
    /// # Errors
    /// Outer: the bus failed or the user interrupted. Inner: two devices answer.
    pub fn ensure_single(&mut self, node: NodeId) -> Result<Result<(), SdoError>, Error> {
        if self.sdo.take_check(node) {
            // The result is ignored: an abort is an answer too. If the device is silent, the write fails.
            self.transfer_one(Request::read(node, SERIAL_NUMBER).once())?.ok();
        }
        let error = |failure| Err(SdoError::two_devices(node, SERIAL_NUMBER, Operation::Write, failure));
        Ok(self.sdo.failure_of(node, SERIAL_NUMBER).map_or(Ok(()), error))
    }

    /// Waits until no second answer can arrive. Frames go to `watch`. Waits only after the first answer of a node.
    pub(super) fn await_second_answers(&mut self, watch: &mut dyn FnMut(&Received)) -> Result<(), Error> {
        while let Some(until) = self.sdo.second_answer_until() {
            match self.next(until)? {
                MasterEvent::Frame(received) => watch(&received),
                MasterEvent::Deadline => self.sdo.on_waited(until),
                MasterEvent::Interrupted => return Err(Error::Interrupted),
                MasterEvent::Link(false) => return Err(Error::Bus(BusError::Down(self.bus.name().to_owned()))),
                MasterEvent::Ended => return Ok(()),
                MasterEvent::Sdo(..) | MasterEvent::Fault(..) | MasterEvent::Dropped(_) | MasterEvent::Link(true) => {}
            }
        }
        Ok(())
    }

    /// Limits the total time of all transfers from now on. `None`: no limit.
    pub fn limit_transfers(&mut self, time: Option<Duration>) {
        let now = self.now();
        self.sdo.limit(time.map(|time| (now + time, time)));
    }

    /// Whether an SDO transfer is in progress or waiting.
    pub fn is_busy(&self) -> bool {
        self.sdo.is_busy()
    }

    /// Whether frames wait to be sent.
    pub fn is_sending(&self) -> bool {
        !self.outgoing.is_empty()
    }

    /// Drops transfers without an abort, for example at the end of a scan. Their answers are ignored.
    pub fn forget(&mut self, tickets: impl Iterator<Item = Ticket>) {
        for ticket in tickets {
            self.sdo.forget(ticket);
            self.outgoing.drop_ticket(ticket);
        }
    }

    /// Ends all SDO transfers. Servers that had answered get an abort.
    pub fn cancel(&mut self) {
        let mut out = Vec::new();
        self.sdo.cancel(&mut out);
        self.outgoing.drop_requests();
        for frame in out {
            self.outgoing.push(frame, None);
        }
        let now = self.now();
        // If the bus has failed, the aborts are lost.
        let _ = self.outgoing.flush(self.bus, now, self.timing.timeout, &mut |_, _| {});
    }

    /// Sends the waiting frames, for example an abort or an NMT command that restores a state. Takes at most 1 s.
    pub fn settle(&mut self) {
        if !self.is_sending() {
            return;
        }
        let until = self.now() + Duration::from_secs(1);
        while self.is_sending() && self.now() < until {
            let step = self.now() + Duration::from_millis(1);
            if self.next(step).is_err() {
                return;
            }
        }
    }

    /// Waits for the next event. Returns [`MasterEvent::Deadline`] when `until` is reached.
    ///
    /// The receive time of a frame decides whether it is in time. So traffic never extends a deadline, and a slow
    /// program never shortens one.
    ///
    /// # Errors
    /// The bus failed.
    pub fn next(&mut self, until: Mono) -> Result<MasterEvent, Error> {
        self.next_or(until, until)
    }

    /// Returns the next event that was received by the moment `stop`, without waiting. Returns
    /// [`MasterEvent::Deadline`] if there is none.
    ///
    /// Frames are accepted up to `DRAIN_LIMIT` after `stop`: receive times are inaccurate on a busy machine.
    ///
    /// # Errors
    /// The bus failed.
    pub fn drain(&mut self, stop: Mono) -> Result<MasterEvent, Error> {
        self.next_or(stop, stop + DRAIN_LIMIT)
    }

    /// Waits until `until`. Frames received up to `last` count as received before `until`.
    fn next_or(&mut self, until: Mono, last: Mono) -> Result<MasterEvent, Error> {
        loop {
            if let Some((ticket, result)) = self.sdo.pop_finished() {
                return Ok(MasterEvent::Sdo(ticket, result));
            }
            let retry_at = self.send_waiting()?;
            // A transfer to a node-ID with two devices ends before its request is sent.
            if self.sdo.has_finished() {
                continue;
            }
            if self.sdo.wants_all_frames() != self.receives_all {
                self.receives_all = !self.receives_all;
                let filters = if self.receives_all { &Filters::All } else { &self.filters };
                self.bus.listen(filters)?;
            }
            let Some((event, deadline)) = self.receive(until.min(retry_at.unwrap_or(until)))? else { continue };
            match event {
                Event::Frame(received) => {
                    let at = received.at.mono;
                    self.seen = self.seen.max(at);
                    if at > last {
                        self.pending = Some(received);
                        return Ok(MasterEvent::Deadline);
                    }
                    if let Some(transcript) = &mut self.outgoing.transcript {
                        transcript.push(at, false, received.frame);
                    }
                    if self.sdo.needs_clock(at) {
                        self.start_timeouts();
                    }
                    self.sdo.on_time(at, &self.timing, &mut self.outgoing);
                    if self.bypasses_sdo || !self.sdo.on_frame(&received, &self.timing, &mut self.outgoing) {
                        self.sdo.on_other_frame(&received.frame);
                        self.foreign_nmt = NmtCommand::parse(&received.frame).or(self.foreign_nmt);
                        return Ok(MasterEvent::Frame(received));
                    }
                    if self.delivers_answers {
                        return Ok(MasterEvent::Frame(received));
                    }
                }
                Event::Fault(fault, at) => return Ok(MasterEvent::Fault(fault, at)),
                Event::Dropped(count) => return Ok(MasterEvent::Dropped(count)),
                Event::Link(up) => return Ok(MasterEvent::Link(up)),
                Event::Interrupted => return Ok(MasterEvent::Interrupted),
                Event::Ended => return Ok(MasterEvent::Ended),
                Event::Timeout => {
                    self.sdo.on_time(deadline, &self.timing, &mut self.outgoing);
                    if deadline >= until && !self.sdo.has_finished() {
                        return Ok(MasterEvent::Deadline);
                    }
                }
            }
        }
    }

    /// Sends the frames that can be sent now. Returns when to try again. The clock is read only if there is something
    /// to send, because on some machines each reading needs a system call.
    fn send_waiting(&mut self) -> Result<Option<Mono>, Error> {
        if !self.sdo.can_start() && self.outgoing.is_empty() {
            return Ok(None);
        }
        let now = if self.sdo.can_start() || self.outgoing.needs_time() { self.now() } else { self.seen };
        self.seen = now;
        self.sdo.advance(&self.timing, now, &mut self.outgoing);
        let (sdo, timing) = (&mut self.sdo, &self.timing);
        let retry_at = self.outgoing.flush(self.bus, now, timing.timeout, &mut |ticket, time| {
            sdo.on_sent(ticket, time, timing);
        })?;
        Ok(retry_at)
    }

    /// Carries out transfers in parallel. The results have the order of the requests. Other frames go to `watch`. After
    /// a missing answer, further requests to this node are cancelled.
    ///
    /// # Errors
    /// The bus failed or the user interrupted. Failures of one device are in its result.
    pub fn transfer(
        &mut self,
        requests: Vec<Request>,
        watch: &mut dyn FnMut(&Received),
    ) -> Result<Vec<Result<Answer, SdoError>>, Error> {
        let targets: Vec<_> = requests.iter().map(|item| (item.node, item.object, item.operation())).collect();
        let tickets: Vec<Ticket> = requests.into_iter().map(|request| self.start(request)).collect();
        let mut results: Vec<Option<Result<Answer, SdoError>>> = tickets.iter().map(|_| None).collect();
        let far = Mono::at(Duration::MAX);
        while results.iter().any(Option::is_none) {
            match self.next(far)? {
                MasterEvent::Sdo(ticket, result) => {
                    let Some(index) = tickets.iter().position(|&own| own == ticket) else { continue };
                    let silent =
                        result.as_ref().err().filter(|error| matches!(error.failure, SdoFailure::NoAnswer { .. }));
                    if let Some(silent) = silent.map(|error| error.node) {
                        for (other, &(node, object, operation)) in targets.iter().enumerate() {
                            if node == silent && other != index && results[other].is_none() {
                                self.forget(std::iter::once(tickets[other]));
                                let failure = SdoFailure::Cancelled;
                                results[other] = Some(Err(SdoError { node, object, operation, failure }));
                            }
                        }
                    }
                    results[index] = Some(result);
                }
                MasterEvent::Frame(received) => watch(&received),
                MasterEvent::Interrupted => {
                    self.cancel();
                    return Err(Error::Interrupted);
                }
                MasterEvent::Link(false) => {
                    self.cancel();
                    return Err(Error::Bus(BusError::Down(self.bus.name().to_owned())));
                }
                MasterEvent::Fault(..)
                | MasterEvent::Dropped(_)
                | MasterEvent::Link(true)
                | MasterEvent::Ended
                | MasterEvent::Deadline => {}
            }
        }
        if targets.iter().any(|(_, _, operation)| *operation == Operation::Read) {
            self.await_second_answers(watch)?;
        }
        for (result, &(node, object, operation)) in results.iter_mut().zip(&targets) {
            if let (Some(Ok(_)), Some(failure)) = (&result, self.sdo.failure_of(node, object)) {
                *result = Some(Err(SdoError::two_devices(node, object, operation, failure)));
            }
        }
        Ok(results.into_iter().flatten().collect())
    }
}
