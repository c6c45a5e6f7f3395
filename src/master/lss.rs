//! LSS over a bus: sets node-ID and bit rate (CiA 305).
//!
//! A slave in configuration state also executes commands that are meant for another slave. So an [`Lss`] remembers
//! whether a slave may be in that state. When the [`Lss`] is dropped, also after Ctrl-C, it switches all slaves to
//! waiting state.

mod error;
mod scan;

pub use error::LssError;

use super::{Error, Master, MasterEvent};
use crate::bus::{BusError, Fault, Filters, Mono, Received, Stamp};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss::{Answer, Exchange, ExchangeError, LssAddress, LssRange, Mode, Part, Request, Service};
use crate::canopen::nmt::ErrorControlMessage;
use std::collections::BTreeMap;
use std::time::Duration;

/// The shortest wait for the answer to a store. No manual gives a time, and flash memory is slow.
pub const STORE_TIMEOUT: Duration = Duration::from_secs(3);

/// The pause after a frame without an answer. Some slaves can buffer only one frame.
const FRAME_PAUSE: Duration = Duration::from_millis(2);

/// The pause between repeated frames, for slow slaves. python-canopen uses the same pause.
const RETRY_PAUSE: Duration = Duration::from_millis(200);

/// The wait for answers from further slaves after the first answer.
const FURTHER_ANSWERS_TIMEOUT: Duration = Duration::from_millis(20);

/// The largest number of faults that are stored.
const MAX_FAULTS: usize = 64;

/// When an exchange ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EndOfExchange {
    /// Shortly after the first answer.
    Answer,
    /// At the time-out. All slaves have time to answer.
    Timeout,
}

/// The answers of all slaves in configuration state to one request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GatheredAnswers<T> {
    /// The different answers, in the order of arrival.
    pub answers: Vec<T>,
    /// Whether more than one slave answered: the answers differ, or there were more answers than requests.
    pub has_several_slaves: bool,
    /// Faults during the exchange. Slaves that send different answers at the same time cause such faults.
    pub faults: Vec<Fault>,
}

impl<T> GatheredAnswers<T> {
    /// Whether there is one answer and no sign of a second slave.
    pub fn is_one(&self) -> bool {
        self.answers.len() == 1 && !self.has_several_slaves && !self.faults.iter().any(|fault| is_collision(*fault))
    }
}

/// The search result for further slaves with the same vendor and product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Others {
    /// The slave supports the service, and no other slave answers.
    None,
    /// Another slave in this range answers.
    Within(LssRange),
    /// Unknown: the slave itself does not answer the service.
    Unproven,
}

/// The LSS services of a master.
pub struct Lss<'master, 'bus> {
    master: &'master mut Master<'bus>,
    /// Whether a slave may be in configuration state.
    is_configuring: bool,
    boot_ups: BTreeMap<NodeId, Stamp>,
    faults: Vec<Fault>,
    /// The first frame from a slave that was not an answer to the request.
    received: Option<Frame>,
}

impl<'bus> Master<'bus> {
    /// Returns the LSS services of this master.
    pub fn lss(&mut self) -> Lss<'_, 'bus> {
        Lss { master: self, is_configuring: false, boot_ups: BTreeMap::new(), faults: Vec::new(), received: None }
    }
}

impl Drop for Lss<'_, '_> {
    fn drop(&mut self) {
        if self.is_configuring {
            self.master.send(Request::SwitchGlobal(Mode::Waiting).frame());
            self.master.settle();
        }
    }
}

impl<'bus> Lss<'_, 'bus> {
    /// Returns the master, for SDO and NMT between LSS services.
    pub fn master(&mut self) -> &mut Master<'bus> {
        self.master
    }

    /// Receives only LSS frames and heartbeats, because other frames on a busy bus slow down a fastscan. SDO answers
    /// are no longer received.
    ///
    /// # Errors
    /// The bus rejects the filters.
    pub fn listen(&mut self) -> Result<(), LssError> {
        let heartbeats = NodeId::all().map(CanId::heartbeat);
        let ids = [CanId::LSS_SLAVE, CanId::LSS_MASTER].into_iter().chain(heartbeats).collect();
        Ok(self.master.listen(&Filters::Only(ids))?)
    }

    /// Whether a slave may be in configuration state.
    pub fn is_configuring(&self) -> bool {
        self.is_configuring
    }

    /// The boot-up messages received during LSS services. A slave without a node-ID boots when it is switched to
    /// waiting state.
    pub fn boot_ups(&self) -> &BTreeMap<NodeId, Stamp> {
        &self.boot_ups
    }

    /// Switches all slaves to this state (CiA 305, 04h). Slaves do not answer.
    ///
    /// # Errors
    /// The bus failed or the user interrupted.
    pub fn switch_global(&mut self, mode: Mode) -> Result<(), LssError> {
        if mode == Mode::Configuration {
            self.is_configuring = true;
        }
        self.send_now(Request::SwitchGlobal(mode).frame())?;
        if mode == Mode::Waiting {
            self.is_configuring = false;
        }
        self.pause(FRAME_PAUSE)
    }

    /// Switches all slaves to waiting state if one may be in configuration state. Also allowed after an interrupt.
    ///
    /// # Errors
    /// The bus failed. A slave may then still be in configuration state.
    pub fn leave(&mut self) -> Result<(), LssError> {
        if self.is_configuring { self.switch_global(Mode::Waiting) } else { Ok(()) }
    }

    /// Switches the slave with this address to configuration state (40h to 43h). A slave that is already in that state
    /// does not answer. So all slaves are switched to waiting state before the address is repeated.
    ///
    /// # Errors
    /// No slave answers, or several slaves answer.
    pub fn switch_selective(&mut self, address: &LssAddress) -> Result<(), LssError> {
        self.is_configuring = true;
        self.ask_one(Exchange::select(address), self.master.timing.retries).map(|_| ())
    }

    /// Reads one number of the LSS address of all slaves in configuration state (5Ah to 5Dh).
    ///
    /// # Errors
    /// No slave answers, or an answer violates the protocol.
    pub fn inquire(&mut self, part: Part) -> Result<GatheredAnswers<u32>, LssError> {
        self.gather(Request::Inquire(part), |answer| match answer {
            Answer::Number(number) => Some(number),
            _ => None,
        })
    }

    /// Reads the node-ID of all slaves in configuration state (5Eh); `None` for a slave without node-ID.
    ///
    /// # Errors
    /// No slave answers, or an answer violates the protocol.
    pub fn inquire_node_id(&mut self) -> Result<GatheredAnswers<Option<NodeId>>, LssError> {
        self.gather(Request::InquireNodeId, |answer| match answer {
            Answer::NodeId(node) => Some(node),
            _ => None,
        })
    }

    /// Reads the LSS address of the only slave in configuration state (5Ah to 5Dh).
    ///
    /// # Errors
    /// No slave answers, several slaves answer, or an answer violates the protocol.
    pub fn inquire_address(&mut self) -> Result<LssAddress, LssError> {
        self.inquire_address_within(self.master.timing.timeout, self.master.timing.retries)
    }

    fn inquire_address_within(&mut self, timeout: Duration, retries: u32) -> Result<LssAddress, LssError> {
        let mut numbers = [0; 4];
        for (number, part) in numbers.iter_mut().zip(Part::ALL) {
            if let Answer::Number(answer) =
                self.ask_one_within(Exchange::new(Request::Inquire(part)), timeout, retries)?
            {
                *number = answer;
            }
        }
        Ok(LssAddress::new(numbers))
    }

    /// Sets the node-ID of the slave in configuration state (11h); `None` removes it. The node-ID takes effect after a
    /// reset. For a slave without a node-ID, it takes effect when the slave is switched to waiting state.
    ///
    /// # Errors
    /// The slave rejects the request or does not answer, or several slaves answer.
    pub fn configure_node_id(&mut self, node: Option<NodeId>) -> Result<(), LssError> {
        self.ask_one(Exchange::new(Request::ConfigureNodeId(node)), self.master.timing.retries).map(|_| ())
    }

    /// Sets the bit rate of the slave in configuration state by a table index (13h). Table 0 is the table of CiA 305.
    /// The bit rate takes effect after [`Lss::activate`] or a reset.
    ///
    /// # Errors
    /// The slave rejects the request or does not answer, or several slaves answer.
    pub fn configure_bit_timing(&mut self, table: u8, index: u8) -> Result<(), LssError> {
        let request = Request::ConfigureBitTiming { table, index };
        self.ask_one(Exchange::new(request), self.master.timing.retries).map(|_| ())
    }

    /// Activates the new bit rate (15h). The slaves in configuration state stop sending for `delay_ms`, change the bit
    /// rate, and wait for `delay_ms` again. Slaves do not answer. The command that switches them back to waiting state
    /// must be sent at the new bit rate.
    ///
    /// # Errors
    /// The bus failed or the user interrupted.
    pub fn activate(&mut self, delay_ms: u16) -> Result<(), LssError> {
        self.send_now(Request::ActivateBitTiming { delay_ms }.frame()).map(|_| ())
    }

    /// Stores node-ID and bit rate of the slave in configuration state in non-volatile memory (17h). The request is
    /// sent once. The time-out is at least [`STORE_TIMEOUT`].
    ///
    /// # Errors
    /// The slave rejects the request or does not answer, or several slaves answer.
    pub fn store(&mut self) -> Result<(), LssError> {
        self.ask_one(Exchange::new(Request::Store), 0).map(|_| ())
    }

    /// Whether slaves with an address in this range answer (46h to 4Bh).
    ///
    /// # Errors
    /// The bus failed, the user interrupted, or an answer violates the protocol.
    pub fn identify(&mut self, range: &LssRange) -> Result<bool, LssError> {
        self.ask_all(Exchange::identify(range)).map(|exchange| exchange.has_answer())
    }

    /// Whether slaves without a node-ID answer (4Ch).
    ///
    /// # Errors
    /// The bus failed, the user interrupted, or an answer violates the protocol.
    pub fn identify_unconfigured(&mut self) -> Result<bool, LssError> {
        self.ask_all(Exchange::new(Request::IdentifyUnconfigured)).map(|exchange| exchange.has_answer())
    }

    /// Searches for other slaves with the same vendor and product as `address` (46h to 4Bh).
    ///
    /// # Errors
    /// The bus failed, the user interrupted, or an answer violates the protocol.
    pub fn others(&mut self, address: &LssAddress) -> Result<Others, LssError> {
        let same = LssRange::from(*address);
        let exchange = self.ask_all(Exchange::identify(&same))?;
        if !exchange.has_answer() {
            return Ok(Others::Unproven);
        }
        if exchange.has_several_slaves() {
            return Ok(Others::Within(same));
        }
        for range in address.neighbours().into_iter().chain(address.revisions()).flatten() {
            if self.identify(&range)? {
                return Ok(Others::Within(range));
            }
        }
        Ok(Others::None)
    }

    /// Carries out a service that all matching slaves answer in the same way. No answer is also a valid result.
    fn ask_all(&mut self, mut exchange: Exchange) -> Result<Exchange, LssError> {
        let timeout = self.timeout_of(&exchange);
        self.carry_out(&mut exchange, EndOfExchange::Answer, (timeout, self.master.timing.retries))?;
        Ok(exchange)
    }

    /// Carries out a service with one slave.
    fn ask_one(&mut self, exchange: Exchange, retries: u32) -> Result<Answer, LssError> {
        let timeout = self.timeout_of(&exchange);
        self.ask_one_within(exchange, timeout, retries)
    }

    /// Like [`Lss::ask_one`], with the given time-out.
    fn ask_one_within(&mut self, mut exchange: Exchange, timeout: Duration, retries: u32) -> Result<Answer, LssError> {
        self.carry_out(&mut exchange, EndOfExchange::Answer, (timeout, retries))?;
        exchange.one().map_err(|error| self.error(&exchange, error))
    }

    /// Carries out a service with all slaves in configuration state, and collects the different answers.
    fn gather<T>(
        &mut self,
        request: Request,
        read: impl Fn(Answer) -> Option<T>,
    ) -> Result<GatheredAnswers<T>, LssError> {
        let mut exchange = Exchange::new(request);
        let timeout = self.timeout_of(&exchange);
        self.carry_out(&mut exchange, EndOfExchange::Timeout, (timeout, self.master.timing.retries))?;
        let mut answers = Vec::new();
        for &(frame, answer) in exchange.answers() {
            let violation = |violation| self.error(&exchange, ExchangeError::Violation(violation, frame));
            answers.extend(read(answer.map_err(violation)?));
        }
        if answers.is_empty() && !self.faults.iter().any(|fault| is_collision(*fault)) {
            return Err(self.error(&exchange, ExchangeError::NoAnswer));
        }
        Ok(GatheredAnswers {
            answers,
            has_several_slaves: exchange.has_several_slaves(),
            faults: std::mem::take(&mut self.faults),
        })
    }

    fn error(&self, exchange: &Exchange, error: ExchangeError) -> LssError {
        let service = exchange.service();
        match error {
            ExchangeError::NoAnswer => {
                LssError::NoAnswer { service, waited: self.timeout_of(exchange), received: self.received }
            }
            ExchangeError::Several(frames) => LssError::Several { service, frames },
            ExchangeError::Refused(code) => LssError::Refused { service, code },
            ExchangeError::Violation(violation, frame) => LssError::Violation { service, violation, frame },
        }
    }

    /// The time-out of a service.
    fn timeout_of(&self, exchange: &Exchange) -> Duration {
        let timeout = self.master.timing.timeout;
        if exchange.service() == Service::Store { timeout.max(STORE_TIMEOUT) } else { timeout }
    }

    /// Sends a request and waits for answers. Repeats the request if there is no answer.
    fn carry_out(
        &mut self,
        exchange: &mut Exchange,
        until: EndOfExchange,
        (timeout, retries): (Duration, u32),
    ) -> Result<(), LssError> {
        // Frames that were received before the request cannot be answers to it.
        self.discard_received()?;
        self.faults.clear();
        self.received = None;
        for attempt in 0..=retries {
            // If only the answer was lost, the slave is in configuration state and ignores the address.
            if attempt > 0 && exchange.service() == Service::SwitchSelective {
                self.send_now(Request::SwitchGlobal(Mode::Waiting).frame())?;
                self.pause(RETRY_PAUSE)?;
            }
            let mut sent = Mono::START;
            for (index, frame) in exchange.ask().into_iter().enumerate() {
                if index > 0 {
                    self.pause(if attempt == 0 { FRAME_PAUSE } else { RETRY_PAUSE })?;
                }
                sent = self.send_now(frame)?;
            }
            let mut deadline = sent + timeout;
            while let Some(received) = self.next(deadline)? {
                let is_first = !exchange.has_answer();
                if !exchange.on_frame(&received.frame) {
                    self.received.get_or_insert(received.frame);
                } else if is_first && until == EndOfExchange::Answer {
                    deadline = deadline.min(received.at.mono + FURTHER_ANSWERS_TIMEOUT);
                }
            }
            if exchange.has_answer() {
                break;
            }
        }
        Ok(())
    }

    /// Sends a frame. Returns the moment just before the frame was sent.
    fn send_now(&mut self, frame: Frame) -> Result<Mono, LssError> {
        self.master.send(frame);
        loop {
            let step = match self.master.send_waiting() {
                Ok(None) => return Ok(self.master.seen),
                Ok(Some(retry_at)) => self.next(retry_at),
                Err(error) => Err(error.into()),
            };
            match step {
                // The frame was sent while waiting, so the received frame may be the answer.
                Ok(Some(received)) if !self.master.is_sending() => self.master.pending = Some(received),
                Ok(_) => {}
                Err(error) => {
                    // The frame must not be sent later.
                    self.master.outgoing.remove(&frame);
                    return Err(error);
                }
            }
        }
    }

    /// Waits for this time.
    fn pause(&mut self, length: Duration) -> Result<(), LssError> {
        let until = self.master.now() + length;
        while self.next(until)?.is_some() {}
        Ok(())
    }

    /// Discards the frames that were already received.
    fn discard_received(&mut self) -> Result<(), LssError> {
        let now = self.master.now();
        loop {
            match self.next(now) {
                Ok(Some(_)) | Err(LssError::Disturbed(_)) => {}
                Ok(None) => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }

    /// Returns the next frame from a slave; `None` when `until` is reached.
    fn next(&mut self, until: Mono) -> Result<Option<Received>, LssError> {
        loop {
            match self.master.next(until)? {
                MasterEvent::Frame(received) => {
                    let id = received.frame.id();
                    if id == CanId::LSS_SLAVE && !received.frame.is_remote() {
                        return Ok(Some(received));
                    }
                    if id == CanId::LSS_MASTER && !received.frame.is_remote() {
                        return Err(LssError::Disturbed(received.frame));
                    }
                    if let Some((node, ErrorControlMessage::BootUp)) = ErrorControlMessage::parse(&received.frame) {
                        self.boot_ups.insert(node, received.at);
                    }
                }
                MasterEvent::Deadline => return Ok(None),
                MasterEvent::Fault(fault, _) if self.faults.len() < MAX_FAULTS => self.faults.push(fault),
                MasterEvent::Interrupted => return Err(Error::Interrupted.into()),
                MasterEvent::Link(false) => return Err(BusError::Down(self.master.bus.name().to_owned()).into()),
                MasterEvent::Sdo(..)
                | MasterEvent::Fault(..)
                | MasterEvent::Dropped(_)
                | MasterEvent::Link(true)
                | MasterEvent::Ended => {}
            }
        }
    }
}

/// Whether two slaves that send at the same time can cause this fault.
fn is_collision(fault: Fault) -> bool {
    matches!(fault, Fault::Protocol | Fault::ErrorWarning | Fault::ErrorPassive | Fault::BusOff | Fault::Other)
}
