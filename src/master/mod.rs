//! Drives the protocol machines over a [`Bus`]: one deadline an exchange, retries, matching, many
//! exchanges side by side.
//!
//! [`Master::next`] is the one loop: it sends what waits, receives one thing, lets the SDO client see it
//! and says what happened. Everything that blocks is built on it.

mod company;
pub mod lss;
mod machine;
mod request;
mod sdo;
mod send;
pub mod transfer;

pub use lss::{Lss, LssError};
pub use request::{Answer, Operation, Request, SdoError, SdoFailure, Ticket};
pub use transfer::{BlockMode, Blocks, LARGE, Moved, SMALL, Way, read_object, write_object};

use crate::bus::{Bus, BusError, Event, Fault, Filters, Mono, Received, Stamp};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{FitError, Note, Uploaded, fit};
use crate::canopen::value::{DataType, Value};
use crate::device::quirk::Quirk;
use sdo::SdoClient;
use send::Outgoing;
use std::time::Duration;

/// How much later than the end of a recording a frame may be said to have come that was there already.
const DRAIN: Duration = Duration::from_secs(1);

/// How long to wait and how often to ask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// The longest wait for one answer.
    pub timeout: Duration,
    /// How often a request that got no answer is repeated.
    pub retries: u32,
}

impl Default for Timing {
    fn default() -> Timing {
        Timing { timeout: Duration::from_millis(500), retries: 1 }
    }
}

/// Why something could not be done.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The bus fails.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// One device stands in the way.
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

/// Something that happened while waiting.
#[derive(Debug)]
pub enum Happening {
    /// A frame that is no part of our SDO transfers.
    Frame(Received),
    /// An SDO transfer has ended.
    Sdo(Ticket, Result<Answer, SdoError>),
    /// The controller reports trouble.
    Fault(Fault, Stamp),
    /// The kernel dropped frames.
    Dropped(u32),
    /// The interface went down or came back.
    Link(bool),
    /// The moment waited for is there.
    Deadline,
    /// The recording that is played again is over.
    Ended,
    /// The user asked to stop.
    Interrupted,
}

/// A CANopen master on a bus.
pub struct Master<'bus> {
    bus: &'bus mut dyn Bus,
    timing: Timing,
    sdo: SdoClient,
    outgoing: Outgoing,
    /// A frame that came after the moment waited for.
    put_back: Option<Received>,
    /// The latest moment known without looking at the clock again.
    seen: Mono,
}

impl<'bus> Master<'bus> {
    /// A master on `bus`.
    pub fn new(bus: &'bus mut dyn Bus, timing: Timing) -> Master<'bus> {
        let outgoing = Outgoing::new();
        Master { bus, timing, sdo: SdoClient::default(), outgoing, put_back: None, seen: Mono::START }
    }

    /// Takes this side of the bus to another bit rate in bit/s. Transfers under way end, and what waits to be sent is
    /// lost.
    ///
    /// # Errors
    /// What the interface says; it may then be down.
    pub fn set_bit_rate(&mut self, bit_rate: u32) -> Result<(), BusError> {
        self.sdo.cancel(&mut Vec::new());
        self.outgoing.begin_anew();
        self.put_back = None;
        self.bus.set_bit_rate(bit_rate, crate::bus::Mode::Normal)
    }

    /// The bus.
    pub fn bus(&self) -> &dyn Bus {
        &*self.bus
    }

    /// The time-outs in force.
    pub fn timing(&self) -> Timing {
        self.timing
    }

    /// The present moment.
    pub fn now(&self) -> Mono {
        self.bus.mono()
    }

    /// Tells the bus which frames are wanted.
    pub fn listen(&mut self, filters: &Filters) -> Result<(), Error> {
        Ok(self.bus.listen(filters)?)
    }

    /// Wants nothing but the SDO channels and the signs of life of these nodes. On a bus full of other traffic
    /// all of that would have to be read and thrown away, and an answer might find no room among it.
    pub fn listen_to(&mut self, nodes: &[NodeId]) -> Result<(), Error> {
        let ids = |&node| [CanId::sdo_response(node), CanId::sdo_request(node), CanId::heartbeat(node)];
        self.listen(&Filters::Only(nodes.iter().flat_map(ids).collect()))
    }

    /// Puts a frame behind those already waiting to be sent.
    pub fn send(&mut self, frame: Frame) {
        self.outgoing.push(frame, None);
    }

    /// Puts a frame before all that wait: a SYNC must not stand behind SDO requests. `false` where the one
    /// before has not even been sent: two of them in a row are one too many.
    pub fn send_first(&mut self, frame: Frame) -> bool {
        self.outgoing.push_first(frame)
    }

    /// When the bus took the frame that was last put before all others, told once; nothing while it waits, and
    /// where it was lost.
    pub fn take_first_at(&mut self) -> Option<Mono> {
        self.outgoing.take_first_at()
    }

    /// Takes back the frame that was last put before all others; `true` if it had not been sent.
    pub fn take_back_first(&mut self) -> bool {
        self.outgoing.take_back_first()
    }

    /// How many frames the kernel dropped that nothing has told of yet.
    pub fn late_drops(&mut self) -> u32 {
        self.bus.late_drops()
    }

    /// From now on an interface that is down, and a bus on which nobody acknowledges, are ridden out: what
    /// cannot be sent is lost, as any frame may be, and the work goes on. Otherwise they are errors.
    pub fn ride_out(&mut self, rides_out: bool) {
        self.outgoing.ride_out(rides_out);
    }

    /// Starts an SDO transfer; its end comes as [`Happening::Sdo`] with the ticket returned. One transfer a
    /// node at a time; others of the same node wait their turn.
    pub fn start(&mut self, request: Request) -> Ticket {
        self.sdo.submit(request)
    }

    /// Tells how a node's SDO server deviates from the standard.
    pub fn set_quirks(&mut self, node: NodeId, quirks: &[Quirk]) {
        self.sdo.accept_60(node, quirks.contains(&Quirk::UploadAnswered60));
    }

    /// Whether an SDO transfer is under way or waiting.
    pub fn is_busy(&self) -> bool {
        self.sdo.is_busy()
    }

    /// Whether frames still wait to be sent.
    pub fn is_sending(&self) -> bool {
        !self.outgoing.is_empty()
    }

    /// Drops transfers whose end no longer matters: a scan's. Nobody is told; their answers are ignored.
    pub fn forget(&mut self, tickets: impl Iterator<Item = Ticket>) {
        for ticket in tickets {
            self.sdo.forget(ticket);
            self.outgoing.drop_ticket(ticket);
        }
    }

    /// Ends every SDO transfer; servers that had begun are told.
    pub fn cancel(&mut self) {
        let mut out = Vec::new();
        self.sdo.cancel(&mut out);
        self.outgoing.drop_requests();
        for frame in out {
            self.outgoing.push(frame, None);
        }
        let now = self.now();
        // The bus may be gone; then there is nobody to tell.
        let _ = self.outgoing.flush(self.bus, now, self.timing.timeout, &mut |_, _| {});
    }

    /// Sends what still waits, within a second at most: an abort, a state put back.
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

    /// The next thing that happens, at the latest [`Happening::Deadline`] once `until` is reached.
    ///
    /// Time is told by what is received, so that traffic never extends a deadline and a slow program never
    /// shortens one: a frame that came after a deadline is looked at after the deadline.
    pub fn next(&mut self, until: Mono) -> Result<Happening, Error> {
        self.next_or(until, until)
    }

    /// The next thing that had been received by the moment `stop`, without waiting for more; at the end
    /// [`Happening::Deadline`]. A frame counts as received by then as long as nothing says how long it lay
    /// there: on a busy machine the times of frames are off by what the clocks were read apart. On a bus that
    /// is never silent `DRAIN` ends it.
    pub fn drain(&mut self, stop: Mono) -> Result<Happening, Error> {
        self.next_or(stop, stop + DRAIN)
    }

    /// Waits until `until`, and takes frames for earlier than that up to `last`.
    fn next_or(&mut self, until: Mono, last: Mono) -> Result<Happening, Error> {
        loop {
            if let Some((ticket, result)) = self.sdo.pop_finished() {
                return Ok(Happening::Sdo(ticket, result));
            }
            let retry_at = self.send_what_waits()?;
            let mut deadline = until;
            for other in [retry_at, self.sdo.next_deadline()].into_iter().flatten() {
                deadline = deadline.min(other);
            }
            let event = match self.put_back.take() {
                Some(received) => Event::Frame(received),
                None => self.bus.receive(deadline)?,
            };
            match event {
                Event::Frame(received) => {
                    let at = received.at.mono;
                    self.seen = self.seen.max(at);
                    if at > last {
                        self.put_back = Some(received);
                        return Ok(Happening::Deadline);
                    }
                    self.sdo.on_time(at, &self.timing, &mut self.outgoing);
                    if !self.sdo.on_frame(&received, &self.timing, &mut self.outgoing) {
                        return Ok(Happening::Frame(received));
                    }
                }
                Event::Fault(fault, at) => return Ok(Happening::Fault(fault, at)),
                Event::Dropped(count) => return Ok(Happening::Dropped(count)),
                Event::Link(up) => return Ok(Happening::Link(up)),
                Event::Interrupted => return Ok(Happening::Interrupted),
                Event::Ended => return Ok(Happening::Ended),
                Event::Timeout => {
                    self.sdo.on_time(deadline, &self.timing, &mut self.outgoing);
                    if deadline >= until && !self.sdo.has_finished() {
                        return Ok(Happening::Deadline);
                    }
                }
            }
        }
    }

    /// Reads the clock only when there is something to send: on some machines that is a system call.
    fn send_what_waits(&mut self) -> Result<Option<Mono>, Error> {
        if !self.sdo.can_start() && self.outgoing.is_empty() {
            return Ok(None);
        }
        let now = self.now();
        self.seen = now;
        self.sdo.advance(&self.timing, now, &mut self.outgoing);
        let (sdo, timing) = (&mut self.sdo, &self.timing);
        let retry_at = self.outgoing.flush(self.bus, now, timing.timeout, &mut |ticket, sent_at| {
            sdo.on_sent(ticket, sent_at, timing);
        })?;
        Ok(retry_at)
    }

    /// Carries out transfers side by side and returns their results in the order of the requests. Frames
    /// that are no part of them go to `watch`. A node that was silent to one request is not asked the rest:
    /// those end as cancelled.
    ///
    /// # Errors
    /// Only what stops everything; what one device does is in its result.
    pub fn transfer(
        &mut self,
        requests: Vec<Request>,
        watch: &mut dyn FnMut(&Received),
    ) -> Result<Vec<Result<Answer, SdoError>>, Error> {
        let what: Vec<_> = requests.iter().map(|item| (item.node, item.object, item.operation())).collect();
        let tickets: Vec<Ticket> = requests.into_iter().map(|request| self.start(request)).collect();
        let mut results: Vec<Option<Result<Answer, SdoError>>> = tickets.iter().map(|_| None).collect();
        let far = Mono::at(Duration::MAX);
        while results.iter().any(Option::is_none) {
            match self.next(far)? {
                Happening::Sdo(ticket, result) => {
                    let Some(at) = tickets.iter().position(|&mine| mine == ticket) else { continue };
                    let silent =
                        result.as_ref().err().filter(|error| matches!(error.failure, SdoFailure::NoAnswer { .. }));
                    if let Some(silent) = silent.map(|error| error.node) {
                        for (rest, &(node, object, operation)) in what.iter().enumerate() {
                            if node == silent && rest != at && results[rest].is_none() {
                                self.forget(std::iter::once(tickets[rest]));
                                let failure = SdoFailure::Cancelled;
                                results[rest] = Some(Err(SdoError { node, object, operation, failure }));
                            }
                        }
                    }
                    results[at] = Some(result);
                }
                Happening::Frame(received) => watch(&received),
                Happening::Interrupted => {
                    self.cancel();
                    return Err(Error::Interrupted);
                }
                Happening::Link(false) => {
                    self.cancel();
                    return Err(Error::Bus(BusError::Down(self.bus.name().to_owned())));
                }
                Happening::Fault(..)
                | Happening::Dropped(_)
                | Happening::Link(true)
                | Happening::Ended
                | Happening::Deadline => {}
            }
        }
        Ok(results.into_iter().flatten().collect())
    }

    /// One transfer.
    pub fn transfer_one(&mut self, request: Request) -> Result<Result<Answer, SdoError>, Error> {
        let (node, object, operation) = (request.node, request.object, request.operation());
        let result = self.transfer(vec![request], &mut |_| {})?.pop();
        Ok(result.unwrap_or(Err(SdoError { node, object, operation, failure: SdoFailure::Cancelled })))
    }

    /// Reads a value of a known type.
    pub fn read(
        &mut self,
        node: NodeId,
        object: ObjectId,
        data_type: DataType,
    ) -> Result<Result<Value, SdoError>, Error> {
        let answer = self.transfer_one(Request::read(node, object))?;
        Ok(answer.and_then(|answer| answer.value(node, object, Some(data_type)).map(|(value, _)| value)))
    }
}

impl Answer {
    /// The value read, and what was odd about how it came.
    ///
    /// # Errors
    /// Bytes that make no value of the type.
    pub fn value(
        &self,
        node: NodeId,
        object: ObjectId,
        data_type: Option<DataType>,
    ) -> Result<(Value, Option<Note>), SdoError> {
        let empty = Uploaded { bytes: Vec::new(), indicated: true, announced: None, misnamed_end: false };
        let uploaded = self.uploaded.as_ref().unwrap_or(&empty);
        fit(data_type, uploaded).map(|fitted| (fitted.value, fitted.note)).map_err(|error: FitError| SdoError {
            node,
            object,
            operation: Operation::Read,
            failure: SdoFailure::Fit(error),
        })
    }
}
