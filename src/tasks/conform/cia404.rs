//! The analogue inputs of CiA 404: unit, decimal digits, process value, limits, filter and autozero.
//!
//! The public texts of CiA 404 have no clause numbers for these objects, so that the cases name the objects.

pub(super) mod autozero;
pub(super) mod digits;
pub(super) mod events;
pub(super) mod filter;
pub(super) mod overload;
pub(super) mod step;
pub(super) mod unit;
pub(super) mod values;

use super::finding::{Finding, Verdict, WhyNot};
use super::session::{Session, number};
use crate::bus::Mono;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::measure::layout::{PROCESS_VALUES, Scaling, Signal};
use crate::node::Error;
use crate::node::signals::unit_and_digits;
use crate::tasks::settings::unit::{Scale, in_unit};

/// The operating mode of a channel; 0 is off.
const OPERATING_MODE: u16 = 0x6112;

/// An analogue input.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    signal: Signal,
    /// The objects with the process value, the most precise first.
    values: Vec<(ObjectId, DataType)>,
    /// The object with the unit.
    unit: Option<ObjectId>,
    /// The object with the decimal digits.
    digits: Option<ObjectId>,
}

impl Channel {
    /// An object of the channel.
    fn object(&self, index: u16) -> ObjectId {
        ObjectId::new(index, self.signal.channel)
    }
}

/// The analogue inputs that are switched on.
fn channels(session: &mut Session<'_, '_>) -> Result<Vec<Channel>, Error> {
    let signals: Vec<Signal> = session.node.channels().into_iter().cloned().collect();
    let mut found = Vec::new();
    for signal in signals.into_iter().filter(|signal| signal.rules.scaling == Scaling::Digits) {
        let mode = ObjectId::new(OPERATING_MODE, signal.channel);
        if session.node.may_have(mode) && session.number(mode)? == Some(0) {
            continue;
        }
        let [unit, digits] = unit_and_digits(&session.node, &signal);
        let mut channel = Channel { signal, values: Vec::new(), unit, digits };
        let standard = PROCESS_VALUES.map(|(index, data_type)| (channel.object(index), data_type));
        let (value, data_type) = channel.signal.value_object;
        let also = channel.signal.other_objects.iter().map(|&object| (object, session.node.data_type(object)));
        let own = data_type.map(|data_type| (value, data_type));
        for (object, data_type) in standard.into_iter().chain(own).chain(also.collect::<Vec<_>>()) {
            let data_type = session.node.known_type(object).unwrap_or(data_type);
            let is_new = !channel.values.iter().any(|(known, _)| *known == object);
            if is_new && session.node.may_have(object) && session.read(object)?.is_some() {
                channel.values.push((object, data_type));
            }
        }
        if !channel.values.is_empty() {
            found.push(channel);
        }
    }
    Ok(found)
}

/// The number of readings of a process value.
const READINGS: u32 = 8;

/// The number of channels that are checked by a change of their settings. The other channels have the same software.
const CHANGED_CHANNELS: usize = 2;

/// The range of several readings.
#[derive(Clone, Copy, Debug)]
struct Readings {
    low: f64,
    high: f64,
    from: Mono,
    until: Mono,
}

impl Readings {
    fn middle(self) -> f64 {
        f64::midpoint(self.low, self.high)
    }

    fn spread(self) -> f64 {
        self.high - self.low
    }

    /// The fastest change, per second.
    fn rate(self) -> f64 {
        self.spread() / self.until.since(self.from).as_secs_f64().max(0.001)
    }

    /// The same readings after a conversion.
    fn map(self, convert: impl Fn(f64) -> Option<f64>) -> Option<Readings> {
        let (one, other) = (convert(self.low)?, convert(self.high)?);
        Some(Readings { low: one.min(other), high: one.max(other), ..self })
    }

    /// The difference that later readings of the same value may have, because the value moves.
    fn allowance(self, later: Readings) -> f64 {
        let elapsed = later.until.since(self.from).as_secs_f64();
        let moved = self.rate().max(later.rate()) * elapsed;
        2.0 * (self.spread() + later.spread()) + moved + 0.01 * self.middle().abs()
    }
}

/// A number in the unit of a channel, with its rounding error.
#[derive(Clone, Copy)]
struct Number {
    object: ObjectId,
    scale: Scale,
    value: f64,
    rounding: f64,
}

/// The settings in the unit of a channel.
fn numbers(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Vec<Number>, Error> {
    let digits = session.digits_of(channel)?;
    let mut found = Vec::new();
    for (object, scale) in in_unit(&session.node, &channel.signal) {
        let data_type = session.node.data_type(object);
        if scale == Scale::Moving {
            continue;
        }
        if let Some(value) = session.quantity(object, data_type, digits)? {
            found.push(Number { object, scale, value, rounding: rounding(data_type, digits, value) });
        }
    }
    Ok(found)
}

/// Notes that the settings in the unit of a channel may change.
fn touch_numbers(session: &mut Session<'_, '_>, channel: &Channel) -> Result<(), Error> {
    for (object, scale) in in_unit(&session.node, &channel.signal) {
        if scale != Scale::Moving {
            session.touch(object)?;
        }
    }
    Ok(())
}

/// The object with the offset of a channel, if it can be read and written.
fn offset_object(session: &Session<'_, '_>, channel: &Channel) -> Option<ObjectId> {
    let description = session.node.model.as_ref().map(|model| &model.description);
    let mut described = description.into_iter().flat_map(|description| &description.autozero);
    let described = described.find(|one| one.channel == channel.signal.channel).and_then(|one| one.offset);
    let standard = [0x6127, 0x6124, 0x7124, 0x8124, 0x9124].map(|index| channel.object(index));
    let mut candidates = described.into_iter().chain(standard);
    candidates.find(|object| session.settings.before(*object).is_some() && !session.node.is_read_only(*object))
}

/// A check of one channel.
type Check = fn(&mut Session<'_, '_>, &Channel) -> Result<Verdict, Error>;

/// Checks at most `most` channels. The verdict is that of the channels that could be judged, else of the first channel.
fn check_channels(session: &mut Session<'_, '_>, most: usize, check: Check) -> Result<Verdict, Error> {
    let mut findings: Vec<Finding> = Vec::new();
    let (mut is_judged, mut other) = (false, None);
    for channel in channels(session)?.iter().take(most) {
        match check(session, channel)? {
            Verdict::Pass => is_judged = true,
            Verdict::Deviates(more) => findings.extend(more),
            verdict => other = other.or(Some(verdict)),
        }
    }
    Ok(match other {
        _ if is_judged || !findings.is_empty() => Verdict::of(findings),
        Some(verdict) => verdict,
        None => Verdict::NotApplicable(WhyNot::NoChannel),
    })
}

impl Session<'_, '_> {
    /// The decimal digits of a channel; 0 if it has none.
    fn digits_of(&mut self, channel: &Channel) -> Result<u8, Error> {
        let Some(object) = channel.digits.filter(|&object| self.node.may_have(object)) else { return Ok(0) };
        Ok(self.number(object)?.and_then(|digits| u8::try_from(digits).ok()).unwrap_or(0))
    }

    /// A number in the unit of a channel. `None` if it is not valid, or at the end of its range.
    fn quantity(&mut self, object: ObjectId, data_type: DataType, digits: u8) -> Result<Option<f64>, Error> {
        let Some(bytes) = self.read(object)? else { return Ok(None) };
        let value = data_type.decode(&bytes).ok().and_then(|value| value.as_f64());
        let is_clipped = matches!(data_type, DataType::Integer(_)) && is_at_end(&bytes);
        Ok(value.filter(|value| value.is_finite() && !is_clipped).map(|value| value * step(data_type, digits)))
    }

    /// Reads a number several times. `None` if one of them is not valid, or at the end of its range.
    fn readings(&mut self, object: ObjectId, data_type: DataType, digits: u8) -> Result<Option<Readings>, Error> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let from = self.master.now();
        for _ in 0..READINGS {
            let Some(value) = self.quantity(object, data_type, digits)? else { return Ok(None) };
            (low, high) = (low.min(value), high.max(value));
        }
        Ok(Some(Readings { low, high, from, until: self.master.now() }))
    }
}

/// Whether a signed number is the lowest or the highest of its type.
fn is_at_end(bytes: &[u8]) -> bool {
    let Some(half) = u32::try_from(8 * bytes.len()).ok().and_then(|bits| 1u64.checked_shl(bits - 1)) else {
        return false;
    };
    [half, half - 1].contains(&number(bytes))
}

/// The value of the last digit of an integer. A REAL32 is the value itself.
fn step(data_type: DataType, digits: u8) -> f64 {
    match data_type {
        DataType::Real32 | DataType::Real64 => 1.0,
        _ => 10f64.powi(-i32::from(digits)),
    }
}

/// The rounding error of a number of this type.
fn rounding(data_type: DataType, digits: u8, value: f64) -> f64 {
    match data_type {
        DataType::Real32 | DataType::Real64 => value.abs() * 1e-6,
        _ => step(data_type, digits),
    }
}
