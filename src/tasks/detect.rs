//! Finds the bit rate of a running bus: by listening, or on a bench with one device by asking.

mod failure;

pub use failure::DetectFailure;

use super::{Failure, Kind};
use crate::bus::{Bus, BusError, Event, Fault, Filters, Mode};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::master::{Error, Happening, Master, Request, SdoFailure, Ticket, Timing};
use std::collections::BTreeSet;
use std::time::Duration;

/// The bit rates of CiA 301 in bit/s, and 100k, which many sensors have; those met most first.
pub const RATES: [u32; 9] = [250_000, 125_000, 500_000, 1_000_000, 100_000, 50_000, 20_000, 10_000, 800_000];

/// So many valid frames are no accident.
const ENOUGH: u32 = 3;

/// So many errors without a valid frame, and it is not worth while to listen on.
const HOPELESS: u32 = 50;

/// What every device has: its type.
const DEVICE_TYPE: ObjectId = ObjectId::new(0x1000, 0);

/// The bits of a question at the most.
const QUESTION_BITS: u64 = 135;

/// How a rate was tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// By listening: nothing was sent, no frame acknowledged, no error signalled.
    Listening,
    /// By asking: every node-ID for its device type.
    Asking,
}

/// What came of one rate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tried {
    /// The rate in bit/s.
    pub bit_rate: u32,
    /// How it was tried.
    pub how: How,
    /// Valid frames heard.
    pub frames: u32,
    /// Errors that the controller reported.
    pub errors: u32,
    /// All that was asked went out without an error: somebody acknowledged.
    pub acknowledged: bool,
    /// Why the interface cannot do this rate.
    pub impossible: Option<String>,
}

impl Tried {
    fn new(bit_rate: u32, how: How) -> Tried {
        Tried { bit_rate, how, frames: 0, errors: 0, acknowledged: false, impossible: None }
    }

    /// Whether this is the rate of the bus.
    fn is_it(&self) -> bool {
        self.frames > self.errors
    }

    /// Whether listening on would tell nothing new.
    fn is_decided(&self) -> bool {
        self.frames >= ENOUGH && self.is_it() || self.frames == 0 && self.errors >= HOPELESS
    }
}

/// What tells the bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Valid frames.
    Frames,
    /// At this rate alone somebody acknowledged, who said nothing.
    Acknowledge,
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Detection {
    /// The bit rate of the bus in bit/s and what tells it; nothing where nothing told it.
    pub found: Option<(u32, By)>,
    /// What was tried, in this order.
    pub tried: Vec<Tried>,
}

/// Tries the usual bit rates one after the other, each for as long as `each`, the present one first, and puts
/// the interface back as it was. It listens; with `ask` and where nothing was heard, it asks too, which disturbs
/// a bus that runs at another rate than the one tried. Each try is told to `tell`.
///
/// # Errors
/// The interface cannot be set or put back, or the user asked to stop.
pub fn detect(
    bus: &mut dyn Bus,
    ask: bool,
    each: Duration,
    tell: &mut dyn FnMut(&Tried),
) -> Result<Detection, Failure> {
    bus.can_set_bit_rate().map_err(|error| refused(error, bus.name()))?;
    let result = bus.listen(&Filters::All).map_err(Error::from).and_then(|()| try_all(bus, ask, each, tell));
    let put_back = bus.restore_bit_rate();
    let result = result.map_err(|error| match error {
        Error::Bus(error) => refused(error, bus.name()),
        error => error.into(),
    });
    match (result, put_back) {
        (result, Ok(())) => result,
        (Ok(Detection { found: Some((bit_rate, _)), .. }), Err(error)) => {
            let heard = format!("the bus runs at {bit_rate} bit/s, but {} is not as it was: {error}", bus.name());
            Err(Failure::new(Kind::Bus, heard))
        }
        (Ok(_), Err(error)) => Err(Failure::new(Kind::Bus, format!("{} is not as it was: {error}", bus.name()))),
        (Err(failure), Err(error)) => Err(failure.and(format!("{} is not as it was: {error}", bus.name()))),
    }
}

fn refused(error: BusError, name: &str) -> Failure {
    super::host::not_set(error, &format!("sudo cangauge bus detect {name}"))
}

fn try_all(bus: &mut dyn Bus, ask: bool, each: Duration, tell: &mut dyn FnMut(&Tried)) -> Result<Detection, Error> {
    let first = bus.bit_rate();
    let rates: Vec<u32> = first.into_iter().chain(RATES.into_iter().filter(|&rate| Some(rate) != first)).collect();
    let mut tried: Vec<Tried> = Vec::new();
    for &bit_rate in &rates {
        let one = match listen(bus, bit_rate, each) {
            // A controller that cannot only listen leaves nothing but asking.
            Err(Error::Bus(BusError::Unsupported(_))) if ask && tried.is_empty() => break,
            one => one?,
        };
        tell(&one);
        let found = one.is_it();
        tried.push(one);
        if found {
            return Ok(Detection { found: Some((bit_rate, By::Frames)), tried });
        }
    }
    for &bit_rate in rates.iter().filter(|_| ask) {
        let one = question(bus, bit_rate, each)?;
        tell(&one);
        let found = one.is_it();
        tried.push(one);
        if found {
            return Ok(Detection { found: Some((bit_rate, By::Frames)), tried });
        }
    }
    let mut acknowledged = tried.iter().filter(|one| one.acknowledged).map(|one| one.bit_rate);
    let found = acknowledged.next().filter(|_| acknowledged.next().is_none());
    Ok(Detection { found: found.map(|bit_rate| (bit_rate, By::Acknowledge)), tried })
}

/// Goes to a rate. Nothing with the reason noted where the interface cannot do it.
fn go_to(bus: &mut dyn Bus, mode: Mode, tried: &mut Tried) -> Result<bool, BusError> {
    match bus.set_bit_rate(tried.bit_rate, mode) {
        Ok(()) => Ok(true),
        Err(BusError::BitRate { why, .. }) => {
            tried.impossible = Some(why);
            Ok(false)
        }
        Err(error) => Err(error),
    }
}

fn listen(bus: &mut dyn Bus, bit_rate: u32, each: Duration) -> Result<Tried, Error> {
    let mut tried = Tried::new(bit_rate, How::Listening);
    if !go_to(bus, Mode::ListenOnly, &mut tried)? {
        return Ok(tried);
    }
    let until = bus.mono() + each;
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

fn question(bus: &mut dyn Bus, bit_rate: u32, each: Duration) -> Result<Tried, Error> {
    let mut tried = Tried::new(bit_rate, How::Asking);
    if !go_to(bus, Mode::Normal, &mut tried)? {
        return Ok(tried);
    }
    let mut master = Master::new(bus, Timing { timeout: each, retries: 0 });
    let mut open: BTreeSet<Ticket> =
        NodeId::all().map(|node| master.start(Request::read(node, DEVICE_TYPE).once().within(each))).collect();
    // On a slow bus the questions alone take longer than the answers.
    let on_the_wire = QUESTION_BITS * u64::try_from(open.len()).unwrap_or(0) * 1_000_000 / u64::from(bit_rate.max(1));
    let until = master.now() + each + Duration::from_micros(on_the_wire);
    let mut full = false;
    let result = loop {
        match master.next(until) {
            Ok(Happening::Frame(_)) => tried.frames += 1,
            Ok(Happening::Sdo(ticket, result)) => {
                open.remove(&ticket);
                let silent = |failure| matches!(failure, SdoFailure::NoAnswer { .. } | SdoFailure::Cancelled);
                tried.frames += u32::from(result.map_or_else(|error| !silent(error.failure), |_| true));
            }
            Ok(Happening::Fault(fault, _)) => {
                tried.errors += u32::from(is_error(fault));
                if fault == Fault::BusOff {
                    break Ok(());
                }
            }
            Ok(Happening::Dropped(_) | Happening::Link(_)) => {}
            Ok(Happening::Deadline | Happening::Ended) => break Ok(()),
            Ok(Happening::Interrupted) => break Err(Error::Interrupted),
            // Nobody acknowledges: what is to be expected at all rates but one.
            Err(Error::Bus(BusError::QueueFull)) => {
                full = true;
                break Ok(());
            }
            Err(error) => break Err(error),
        }
        if tried.is_it() {
            break Ok(());
        }
    };
    tried.acknowledged = !full && !master.is_sending() && tried.errors == 0;
    master.forget(open.into_iter());
    result.map(|()| tried)
}

/// Whether a fault speaks against the rate.
fn is_error(fault: Fault) -> bool {
    match fault {
        Fault::BusOff
        | Fault::ErrorPassive
        | Fault::ErrorWarning
        | Fault::NoAcknowledge
        | Fault::Protocol
        | Fault::TransmitTimeout => true,
        Fault::ErrorActive | Fault::Restarted | Fault::ControllerOverflow | Fault::Transceiver | Fault::Other => false,
    }
}

#[cfg(test)]
mod tests;
