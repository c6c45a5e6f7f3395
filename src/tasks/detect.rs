//! Finds the bit rate of a running bus by listening, or by sending requests to a single device.

mod failure;

pub use failure::DetectFailure;

use super::Failure;
use super::host::{HostAction, not_set};
use crate::bus::{Bus, BusError, Event, Fault, Filters, Mode};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::master::{Error, Master, MasterEvent, Request, SdoFailure, Ticket, Timing};
use crate::node::wait::{Policy, wait};
use crate::tasks::note::Effect;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

/// The bit rates of CiA 301 in bit/s, and 100k, which many sensors offer. The most frequent bit rates come first.
pub const RATES: [u32; 9] = [250_000, 125_000, 500_000, 1_000_000, 100_000, 50_000, 20_000, 10_000, 800_000];

/// This many valid frames prove a bit rate.
const ENOUGH_FRAMES: u32 = 3;

/// A bit rate is rejected after this many errors without a valid frame.
const ENOUGH_ERRORS: u32 = 50;

/// The maximum number of bits of a request on the bus, with bit stuffing.
const REQUEST_BITS: u64 = 135;

/// How a bit rate was tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By listening: no frame, no acknowledgement and no error flag was sent.
    Listening,
    /// By reading the device type of each node-ID.
    Asking,
}

/// The result for one bit rate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RateResult {
    /// The bit rate in bit/s.
    pub bit_rate: u32,
    /// How the bit rate was tried.
    pub how: Method,
    /// The valid frames that were received.
    pub frames: u32,
    /// The errors that the controller reported.
    pub errors: u32,
    /// Whether all requests were sent without an error. Another node has then acknowledged them.
    pub acknowledged: bool,
    /// Why the interface cannot be set to this bit rate; `None` if it can.
    pub impossible: Option<String>,
}

impl RateResult {
    fn new(bit_rate: u32, how: Method) -> RateResult {
        RateResult { bit_rate, how, frames: 0, errors: 0, acknowledged: false, impossible: None }
    }

    /// Whether this is the bit rate of the bus.
    fn is_found(&self) -> bool {
        self.frames > self.errors
    }

    /// Whether more time would not change the result.
    fn is_decided(&self) -> bool {
        self.frames >= ENOUGH_FRAMES && self.is_found() || self.frames == 0 && self.errors >= ENOUGH_ERRORS
    }
}

/// The evidence for a bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// Valid frames.
    Frames,
    /// Requests were acknowledged only at this bit rate, but no node answered.
    Acknowledge,
}

/// The result of a detection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Detection {
    /// The bit rate of the bus in bit/s and its evidence; `None` if it was not found.
    pub found: Option<(u32, Evidence)>,
    /// The bit rates that were tried, in this order.
    pub tried: Vec<RateResult>,
}

/// Tries the usual bit rates, the present one first, each for `time_per_rate`. Then restores the interface.
///
/// First it only listens. If `ask` is set and no frame is received, it sends requests. They disturb a bus that has
/// another bit rate. `on_tried` receives the result of each try.
///
/// # Errors
/// The interface cannot be set or restored; Ctrl-C.
pub fn detect(
    bus: &mut dyn Bus,
    ask: bool,
    time_per_rate: Duration,
    on_tried: &mut dyn FnMut(&RateResult),
) -> Result<Detection, Failure> {
    bus.can_set_bit_rate().map_err(|error| to_failure(error, bus.name()))?;
    let bit_rate = bus.bit_rate();
    let result =
        bus.listen(&Filters::All).map_err(Error::from).and_then(|()| try_all(bus, ask, time_per_rate, on_tried));
    let restored = bus.restore_bit_rate();
    let result = result.map_err(|error| match error {
        Error::Bus(error) => to_failure(error, bus.name()),
        error => error.into(),
    });
    let interface = bus.name().to_owned();
    match (result, restored) {
        (result, Ok(())) => result,
        (Ok(Detection { found, .. }), Err(error)) => {
            let found = found.map(|(bit_rate, _)| bit_rate);
            Err(Failure::general(DetectFailure::NotRestored { interface, found, error: Arc::new(error) }))
        }
        (Err(mut failure), Err(error)) => {
            failure.effects.push(Effect::InterfaceNotRestored { interface, bit_rate, reason: error.to_string() });
            Err(failure)
        }
    }
}

fn to_failure(error: BusError, name: &str) -> Failure {
    not_set(error, HostAction::Detect { interface: name.to_owned() })
}

fn try_all(
    bus: &mut dyn Bus,
    ask: bool,
    time_per_rate: Duration,
    on_tried: &mut dyn FnMut(&RateResult),
) -> Result<Detection, Error> {
    let first = bus.bit_rate();
    let rates: Vec<u32> = first.into_iter().chain(RATES.into_iter().filter(|&rate| Some(rate) != first)).collect();
    let mut tried: Vec<RateResult> = Vec::new();
    for &bit_rate in &rates {
        let one = match listen(bus, bit_rate, time_per_rate) {
            // Without a listen-only mode, only requests can be tried.
            Err(Error::Bus(BusError::Unsupported(_))) if ask && tried.is_empty() => break,
            one => one?,
        };
        on_tried(&one);
        let found = one.is_found();
        tried.push(one);
        if found {
            return Ok(Detection { found: Some((bit_rate, Evidence::Frames)), tried });
        }
    }
    for &bit_rate in rates.iter().filter(|_| ask) {
        let one = ask_all(bus, bit_rate, time_per_rate)?;
        on_tried(&one);
        let found = one.is_found();
        tried.push(one);
        if found {
            return Ok(Detection { found: Some((bit_rate, Evidence::Frames)), tried });
        }
    }
    let mut acknowledged = tried.iter().filter(|one| one.acknowledged).map(|one| one.bit_rate);
    let found = acknowledged.next().filter(|_| acknowledged.next().is_none());
    Ok(Detection { found: found.map(|bit_rate| (bit_rate, Evidence::Acknowledge)), tried })
}

/// Sets a bit rate. If the interface does not support the bit rate, returns false and records the reason.
fn try_set(bus: &mut dyn Bus, mode: Mode, tried: &mut RateResult) -> Result<bool, BusError> {
    match bus.set_bit_rate(tried.bit_rate, mode) {
        Ok(()) => Ok(true),
        Err(BusError::BitRate { why, .. }) => {
            tried.impossible = Some(why);
            Ok(false)
        }
        Err(error) => Err(error),
    }
}

fn listen(bus: &mut dyn Bus, bit_rate: u32, time_per_rate: Duration) -> Result<RateResult, Error> {
    let mut tried = RateResult::new(bit_rate, Method::Listening);
    if !try_set(bus, Mode::ListenOnly, &mut tried)? {
        return Ok(tried);
    }
    let until = bus.mono() + time_per_rate;
    while !tried.is_decided() {
        match bus.receive(until)? {
            Event::Frame(_) => tried.frames += 1,
            Event::Fault(fault, _) => tried.errors += u32::from(is_error(fault)),
            Event::Timeout | Event::Ended => break,
            Event::Interrupted => return Err(Error::Interrupted),
            Event::Link(false) => return Err(BusError::Down(bus.name().to_owned()).into()),
            Event::Link(true) | Event::Dropped(_) => {}
        }
    }
    Ok(tried)
}

fn ask_all(bus: &mut dyn Bus, bit_rate: u32, time_per_rate: Duration) -> Result<RateResult, Error> {
    let mut tried = RateResult::new(bit_rate, Method::Asking);
    if !try_set(bus, Mode::Normal, &mut tried)? {
        return Ok(tried);
    }
    let mut master = Master::new(bus, Timing { timeout: time_per_rate, retries: 0 });
    let mut pending: BTreeSet<Ticket> = NodeId::all()
        .map(|node| master.start(Request::read(node, ObjectId::DEVICE_TYPE).once().within(time_per_rate)))
        .collect();
    // On a slow bus, the requests take longer than the answers.
    let requests = u64::try_from(pending.len()).unwrap_or(0);
    let on_the_wire = REQUEST_BITS * requests * 1_000_000 / u64::from(bit_rate.max(1));
    let until = master.now() + time_per_rate + Duration::from_micros(on_the_wire);
    let waited = wait(&mut master, until, Policy::Reconnect, |_, event| {
        match event {
            MasterEvent::Frame(_) => tried.frames += 1,
            MasterEvent::Sdo(ticket, result) => {
                pending.remove(&ticket);
                let is_silent = |failure| matches!(failure, SdoFailure::NoAnswer { .. } | SdoFailure::Cancelled);
                tried.frames += u32::from(result.map_or_else(|error| !is_silent(error.failure), |_| true));
            }
            MasterEvent::Fault(fault, _) => {
                tried.errors += u32::from(is_error(fault));
                if fault == Fault::BusOff {
                    return ControlFlow::Break(());
                }
            }
            _ => {}
        }
        if tried.is_found() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    // A full queue is expected at wrong bit rates, because no node acknowledges the requests.
    let is_full = matches!(waited, Err(Error::Bus(BusError::QueueFull)));
    tried.acknowledged = !is_full && !master.is_sending() && tried.errors == 0;
    master.forget(pending.into_iter());
    match waited {
        Err(error) if !is_full => Err(error),
        _ => Ok(tried),
    }
}

/// Whether a fault is evidence against a bit rate.
fn is_error(fault: Fault) -> bool {
    match fault {
        Fault::BusOff
        | Fault::ErrorPassive
        | Fault::ErrorWarning
        | Fault::NoAcknowledge
        | Fault::Protocol
        | Fault::TransmitTimeout => true,
        Fault::ErrorActive
        | Fault::Restarted
        | Fault::ControllerOverflow
        | Fault::Transceiver
        | Fault::Garbled
        | Fault::Other => false,
    }
}

#[cfg(test)]
mod tests;
