//! LSS over a bus: node-ID and bit rate (CiA 305).
//!
//! A slave that is left in configuration state takes the next command that is meant for another one. So an
//! [`Lss`] keeps in mind whether there may be one, and sends everybody back to waiting state at the latest when
//! it is dropped, after Ctrl-C too.

mod error;
mod scan;

pub use error::LssError;

use super::{Error, Happening, Master};
use crate::bus::{BusError, Fault, Filters, Mono, Received, Stamp};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss::{Answer, Exchange, ExchangeError, LssAddress, LssRange, Mode, Part, Request, Service};
use crate::canopen::nmt::Life;
use std::collections::BTreeMap;
use std::time::Duration;

/// The shortest wait for the answer to a store: no manual gives a time, and flash memory is slow.
pub const STORE_TIME: Duration = Duration::from_secs(3);

/// Between two frames of which the first is not answered: some slaves have room for one only.
const PAUSE: Duration = Duration::from_millis(2);

/// The same when an address has had no answer: python-canopen's pause is 200 ms.
const LONG_PAUSE: Duration = Duration::from_millis(50);

/// How long after the answer of the one slave that is meant another one is waited for.
const LINGER: Duration = Duration::from_millis(20);

/// More faults than this say nothing more.
const FAULTS: usize = 64;

/// When an exchange is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Until {
    /// Shortly after the first answer.
    Answer,
    /// When the time is over: everybody shall have his say.
    Over,
}

/// What everybody in configuration state answered to one question.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gathered<T> {
    /// The different answers, in the order in which they came.
    pub answers: Vec<T>,
    /// Certainly more than one slave answered: answers differ, or more came than were asked for.
    pub crowded: bool,
    /// Trouble on the wire meanwhile: slaves that send different answers at the same time.
    pub faults: Vec<Fault>,
}

impl<T> Gathered<T> {
    /// Whether nothing speaks for a second slave.
    pub fn is_one(&self) -> bool {
        self.answers.len() == 1 && !self.crowded && !self.faults.iter().any(|fault| is_collision(*fault))
    }
}

/// Whether there are others of a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Others {
    /// The slave knows the question, and no other one answers it.
    None,
    /// Somebody within this range answers.
    Within(LssRange),
    /// The slave itself does not answer the question, so silence proves nothing.
    Unproven,
}

/// LSS services of a master.
pub struct Lss<'master, 'bus> {
    master: &'master mut Master<'bus>,
    /// A slave may be in configuration state.
    is_configuring: bool,
    boot_ups: BTreeMap<NodeId, Stamp>,
    faults: Vec<Fault>,
}

impl<'bus> Master<'bus> {
    /// The LSS services.
    pub fn lss(&mut self) -> Lss<'_, 'bus> {
        Lss { master: self, is_configuring: false, boot_ups: BTreeMap::new(), faults: Vec::new() }
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
    /// The master, for what is done in between: SDO, NMT.
    pub fn master(&mut self) -> &mut Master<'bus> {
        self.master
    }

    /// Wants nothing but LSS and signs of life: on a bus full of other traffic all of that would have to be read
    /// and thrown away, and a fastscan waits for little else than the clock. SDO answers are wanted no longer.
    ///
    /// # Errors
    /// The bus's own.
    pub fn listen(&mut self) -> Result<(), LssError> {
        let lives = NodeId::all().map(CanId::heartbeat);
        let ids = [CanId::LSS_SLAVE, CanId::LSS_MASTER].into_iter().chain(lives).collect();
        Ok(self.master.listen(&Filters::Only(ids))?)
    }

    /// Whether a slave may be in configuration state.
    pub fn is_configuring(&self) -> bool {
        self.is_configuring
    }

    /// The boot-up messages seen while waiting for answers: a slave that had no node-ID boots when it is sent
    /// back to waiting state.
    pub fn boot_ups(&self) -> &BTreeMap<NodeId, Stamp> {
        &self.boot_ups
    }

    /// 04h: everybody to the state. Nobody answers.
    ///
    /// # Errors
    /// Only what stops everything.
    pub fn switch_global(&mut self, mode: Mode) -> Result<(), LssError> {
        if mode == Mode::Configuration {
            self.is_configuring = true;
        }
        self.put_out(Request::SwitchGlobal(mode).frame())?;
        if mode == Mode::Waiting {
            self.is_configuring = false;
        }
        self.pause(PAUSE)
    }

    /// Sends everybody back to waiting state, if there may be somebody who is not. The work may have been
    /// interrupted before.
    ///
    /// # Errors
    /// Only what stops everything: the slave may then still be in configuration state.
    pub fn leave(&mut self) -> Result<(), LssError> {
        if self.is_configuring { self.switch_global(Mode::Waiting) } else { Ok(()) }
    }

    /// 40h to 43h: the slave with this address to configuration state. Whoever is in that state already stays
    /// there and says nothing: see [`Lss::switch_global`]. So everybody is sent to waiting state before the
    /// address is repeated.
    ///
    /// # Errors
    /// No slave has the address, or more than one.
    pub fn switch_selective(&mut self, address: &LssAddress) -> Result<(), LssError> {
        self.is_configuring = true;
        self.one(Exchange::select(address), self.master.timing.retries).map(|_| ())
    }

    /// 5Ah to 5Dh: a number of everybody's address.
    ///
    /// # Errors
    /// No answer, or one against the protocol.
    pub fn inquire(&mut self, part: Part) -> Result<Gathered<u32>, LssError> {
        self.gather(Request::Inquire(part), |answer| match answer {
            Answer::Number(number) => Some(number),
            _ => None,
        })
    }

    /// 5Eh: everybody's node-ID; `None` of a slave that has none.
    ///
    /// # Errors
    /// No answer, or one against the protocol.
    pub fn inquire_node_id(&mut self) -> Result<Gathered<Option<NodeId>>, LssError> {
        self.gather(Request::InquireNodeId, |answer| match answer {
            Answer::NodeId(node) => Some(node),
            _ => None,
        })
    }

    /// 5Ah to 5Dh: the address of the one slave in configuration state.
    ///
    /// # Errors
    /// No answer, several, or one against the protocol.
    pub fn inquire_address(&mut self) -> Result<LssAddress, LssError> {
        let mut numbers = [0; 4];
        for (number, part) in numbers.iter_mut().zip(Part::ALL) {
            if let Answer::Number(told) = self.one(Exchange::new(Request::Inquire(part)), self.master.timing.retries)? {
                *number = told;
            }
        }
        Ok(LssAddress::new(numbers))
    }

    /// 11h: the node-ID of the slave in configuration state; `None` takes it away. It is in force after a reset,
    /// and of a slave that had none when it is sent back to waiting state.
    ///
    /// # Errors
    /// The slave says no, or nothing; several answer.
    pub fn configure_node_id(&mut self, node: Option<NodeId>) -> Result<(), LssError> {
        self.one(Exchange::new(Request::ConfigureNodeId(node)), self.master.timing.retries).map(|_| ())
    }

    /// 13h: the bit rate of the slave in configuration state, by an entry of a table, 0 for that of CiA 305. It
    /// is in force after [`Lss::activate`] or a reset.
    ///
    /// # Errors
    /// The slave says no, or nothing; several answer.
    pub fn configure_bit_timing(&mut self, table: u8, index: u8) -> Result<(), LssError> {
        let request = Request::ConfigureBitTiming { table, index };
        self.one(Exchange::new(request), self.master.timing.retries).map(|_| ())
    }

    /// 15h: the slaves in configuration state are silent for this many milliseconds, then change the bit rate,
    /// and are silent as long again. Nobody answers. The way back to waiting state is then at the new rate.
    ///
    /// # Errors
    /// Only what stops everything.
    pub fn activate(&mut self, delay_ms: u16) -> Result<(), LssError> {
        self.put_out(Request::ActivateBitTiming { delay_ms }.frame()).map(|_| ())
    }

    /// 17h: node-ID and bit rate of the slave in configuration state for ever. Asked for once, and waited for
    /// for [`STORE_TIME`] at least.
    ///
    /// # Errors
    /// The slave says no, or nothing; several answer.
    pub fn store(&mut self) -> Result<(), LssError> {
        self.one(Exchange::new(Request::Store), 0).map(|_| ())
    }

    /// 46h to 4Bh: whether there are slaves within a range.
    ///
    /// # Errors
    /// Only what stops everything, and an answer against the protocol.
    pub fn identify(&mut self, range: &LssRange) -> Result<bool, LssError> {
        self.ask_around(Exchange::identify(range)).map(|exchange| exchange.has_answer())
    }

    /// 4Ch: whether there are slaves without a node-ID.
    ///
    /// # Errors
    /// Only what stops everything, and an answer against the protocol.
    pub fn identify_unconfigured(&mut self) -> Result<bool, LssError> {
        self.ask_around(Exchange::new(Request::IdentifyUnconfigured)).map(|exchange| exchange.has_answer())
    }

    /// 46h to 4Bh: whether there are slaves of the same vendor and product as this one.
    ///
    /// # Errors
    /// Only what stops everything, and an answer against the protocol.
    pub fn others(&mut self, address: &LssAddress) -> Result<Others, LssError> {
        let same = LssRange::from(*address);
        let exchange = self.ask_around(Exchange::identify(&same))?;
        if !exchange.has_answer() {
            return Ok(Others::Unproven);
        }
        if exchange.is_crowded() {
            return Ok(Others::Within(same));
        }
        for range in address.neighbours().into_iter().chain(address.revisions()).flatten() {
            if self.identify(&range)? {
                return Ok(Others::Within(range));
            }
        }
        Ok(Others::None)
    }

    /// A question that everybody who is meant answers alike. Silence is an answer.
    fn ask_around(&mut self, mut exchange: Exchange) -> Result<Exchange, LssError> {
        self.carry_out(&mut exchange, Until::Answer, self.master.timing.retries)?;
        Ok(exchange)
    }

    /// A service that one slave shall carry out.
    fn one(&mut self, mut exchange: Exchange, retries: u32) -> Result<Answer, LssError> {
        self.carry_out(&mut exchange, Until::Answer, retries)?;
        exchange.one().map_err(|error| self.error(&exchange, error))
    }

    /// A question to everybody in configuration state.
    fn gather<T>(&mut self, request: Request, read: impl Fn(Answer) -> Option<T>) -> Result<Gathered<T>, LssError> {
        let mut exchange = Exchange::new(request);
        self.carry_out(&mut exchange, Until::Over, self.master.timing.retries)?;
        let mut answers = Vec::new();
        for &(frame, answer) in exchange.answers() {
            let violation = |violation| self.error(&exchange, ExchangeError::Violation(violation, frame));
            answers.extend(read(answer.map_err(violation)?));
        }
        if answers.is_empty() && !self.faults.iter().any(|fault| is_collision(*fault)) {
            return Err(self.error(&exchange, ExchangeError::NoAnswer));
        }
        Ok(Gathered { answers, crowded: exchange.is_crowded(), faults: std::mem::take(&mut self.faults) })
    }

    fn error(&self, exchange: &Exchange, error: ExchangeError) -> LssError {
        let service = exchange.service();
        match error {
            ExchangeError::NoAnswer => LssError::NoAnswer { service, waited: self.patience(exchange) },
            ExchangeError::Several(frames) => LssError::Several { service, frames },
            ExchangeError::Refused(code) => LssError::Refused { service, code },
            ExchangeError::Violation(violation, frame) => LssError::Violation { service, violation, frame },
        }
    }

    /// The longest wait for one answer.
    fn patience(&self, exchange: &Exchange) -> Duration {
        let timeout = self.master.timing.timeout;
        if exchange.service() == Service::Store { timeout.max(STORE_TIME) } else { timeout }
    }

    /// Asks, and again where nobody answers.
    fn carry_out(&mut self, exchange: &mut Exchange, until: Until, retries: u32) -> Result<(), LssError> {
        // What came before the question is no answer to it.
        self.pass_by()?;
        self.faults.clear();
        let patience = self.patience(exchange);
        for attempt in 0..=retries {
            // A slave whose answer was lost is in configuration state, where an address says nothing to it.
            if attempt > 0 && exchange.service() == Service::SwitchSelective {
                self.put_out(Request::SwitchGlobal(Mode::Waiting).frame())?;
                self.pause(LONG_PAUSE)?;
            }
            let mut sent = Mono::START;
            for (index, frame) in exchange.ask().into_iter().enumerate() {
                if index > 0 {
                    self.pause(if attempt == 0 { PAUSE } else { LONG_PAUSE })?;
                }
                sent = self.put_out(frame)?;
            }
            let mut deadline = sent + patience;
            while let Some(received) = self.next(deadline)? {
                let is_first = !exchange.has_answer();
                if exchange.on_frame(&received.frame) && is_first && until == Until::Answer {
                    deadline = deadline.min(received.at.mono + LINGER);
                }
            }
            if exchange.has_answer() {
                break;
            }
        }
        Ok(())
    }

    /// Sends a frame. Returns the moment just before.
    fn put_out(&mut self, frame: Frame) -> Result<Mono, LssError> {
        self.master.send(frame);
        loop {
            let step = match self.master.send_what_waits() {
                Ok(None) => return Ok(self.master.seen),
                Ok(Some(retry_at)) => self.next(retry_at),
                Err(error) => Err(error.into()),
            };
            match step {
                // It has gone out while waiting, and this may be the answer.
                Ok(Some(received)) if !self.master.is_sending() => self.master.put_back = Some(received),
                Ok(_) => {}
                Err(error) => {
                    // Given up, it must not go out later.
                    self.master.outgoing.take_back(&frame);
                    return Err(error);
                }
            }
        }
    }

    /// Lets time pass.
    fn pause(&mut self, length: Duration) -> Result<(), LssError> {
        let until = self.master.now() + length;
        while self.next(until)?.is_some() {}
        Ok(())
    }

    /// Takes in what is there already.
    fn pass_by(&mut self) -> Result<(), LssError> {
        let now = self.master.now();
        loop {
            match self.next(now) {
                Ok(Some(_)) | Err(LssError::Disturbed(_)) => {}
                Ok(None) => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }

    /// The next frame of a slave, `None` when the moment is there.
    fn next(&mut self, until: Mono) -> Result<Option<Received>, LssError> {
        loop {
            match self.master.next(until)? {
                Happening::Frame(received) => {
                    let id = received.frame.id();
                    if id == CanId::LSS_SLAVE && !received.frame.is_remote() {
                        return Ok(Some(received));
                    }
                    if id == CanId::LSS_MASTER && !received.frame.is_remote() {
                        return Err(LssError::Disturbed(received.frame));
                    }
                    if let Some((node, Life::BootUp)) = Life::parse(&received.frame) {
                        self.boot_ups.insert(node, received.at);
                    }
                }
                Happening::Deadline => return Ok(None),
                Happening::Fault(fault, _) if self.faults.len() < FAULTS => self.faults.push(fault),
                Happening::Interrupted => return Err(Error::Interrupted.into()),
                Happening::Link(false) => return Err(BusError::Down(self.master.bus.name().to_owned()).into()),
                Happening::Sdo(..)
                | Happening::Fault(..)
                | Happening::Dropped(_)
                | Happening::Link(true)
                | Happening::Ended => {}
            }
        }
    }
}

/// Whether it can come from two slaves that send at the same time.
fn is_collision(fault: Fault) -> bool {
    matches!(fault, Fault::Protocol | Fault::ErrorWarning | Fault::ErrorPassive | Fault::BusOff | Fault::Other)
}
