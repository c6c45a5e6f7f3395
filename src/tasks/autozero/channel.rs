//! What a channel's zero is set by: signature, offset, measuring range, from the description or the standard.

use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::{DataType, Value};
use crate::device::description::{Autozero, Range};
use crate::device::unit::Unit;
use crate::master::{Master, Request, SdoError, SdoFailure};
use crate::measure::layout::Signal;
use crate::measure::sample::Number;
use crate::node::Node;
use crate::tasks::{Failure, Kind};

/// A channel whose zero can be set.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub(super) signal: Signal,
    /// Where the signature goes.
    pub(super) object: ObjectId,
    pub(super) signature: Vec<u8>,
    /// Where the offset may stand: one object of a device that is known, else those of CiA 404.
    pub(super) offsets: Vec<ObjectId>,
    /// Whether a description says where the offset stands.
    pub(super) is_described: bool,
    /// Whether the sensor measures absolute pressure; `None` where nothing tells.
    pub(super) absolute: Option<bool>,
    /// The width of the measuring range in the present unit.
    pub(super) range: Option<f64>,
}

/// An offset as it stands in the device.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Offset {
    pub(super) object: ObjectId,
    pub(super) data_type: DataType,
    /// As it is written.
    pub(super) value: Value,
    /// In the present unit.
    pub(super) number: Number,
}

/// Finds the channel of a number, or the only one there is.
///
/// # Errors
/// A device without autozero, or without one of this channel; several channels and none chosen; silence.
pub(super) fn find(master: &mut Master<'_>, device: &Node, number: Option<u8>) -> Result<Channel, Failure> {
    let usage = |message: String| Failure::of_node(Kind::Usage, device.id, message);
    let description = device.model.as_ref().map(|model| &model.description);
    let described = description.map_or(&[][..], |description| &description.autozero);
    let title = description.map_or("it", |description| &description.title);
    if described.is_empty() {
        let all_known = description.is_some_and(|description| !description.signals.is_empty());
        if all_known && device.model.as_ref().is_some_and(|model| !model.dictionary.has_index(0x6125)) {
            return Err(usage(format!("{title} has no autozero")));
        }
        return by_the_standard(master, device, number);
    }
    let list = || described.iter().map(|entry| entry.channel.to_string()).collect::<Vec<_>>().join(", ");
    let entry = match (number, described) {
        (None, [only]) => only,
        (None, _) => return Err(usage("which channel?".to_owned()).hint(format!("--channel one of {}", list()))),
        (Some(number), _) => described.iter().find(|entry| entry.channel == number).ok_or_else(|| {
            usage(format!("{title} has no autozero of channel {number}")).hint(format!("it has one of: {}", list()))
        })?,
    };
    let signal = signal(device, entry.channel)?.clone();
    let absolute = absolute(master, device, entry)?;
    let range = range(master, device, &signal, entry.range.as_ref())?;
    let signature = entry.signature.clone();
    let offsets = entry.offset.into_iter().collect();
    let is_described = entry.offset.is_some();
    Ok(Channel { signal, object: entry.object, signature, offsets, is_described, absolute, range })
}

/// 6125h:n, where the device has it.
fn by_the_standard(master: &mut Master<'_>, device: &Node, number: Option<u8>) -> Result<Channel, Failure> {
    let node = device.id;
    let signal = match (number, device.signals.as_slice()) {
        (Some(number), _) => signal(device, number)?,
        (None, [only]) => only,
        (None, []) => return Err(Failure::of_node(Kind::Unexpected, node, "it has no measured value of CiA 404")),
        (None, _) => {
            return Err(Failure::of_node(Kind::Usage, node, "which channel? It has several")
                .hint(format!("cangauge autozero {node} --channel 1")));
        }
    }
    .clone();
    let object = ObjectId::new(0x6125, signal.channel);
    match master.transfer_one(Request::read(node, object))? {
        Err(SdoError {
            failure: SdoFailure::Refused(code @ (AbortCode::NO_OBJECT | AbortCode::NO_SUB_INDEX)), ..
        }) => {
            let message = format!("it has no autozero of channel {} (no {object})", signal.channel);
            let failure = Failure::of_node(Kind::Refused, node, message);
            return Err(failure.of_object(object).with_abort(Some(code)));
        }
        // Write-only, as it should be.
        Ok(_) | Err(SdoError { failure: SdoFailure::Refused(_), .. }) => {}
        Err(error) => return Err(error.into()),
    }
    let family = signal.value.0.index & 0xf000;
    let offsets = [0x6127, family | 0x124].map(|index| ObjectId::new(index, signal.channel)).to_vec();
    let range = range(master, device, &signal, None)?;
    let signature = b"zero".to_vec();
    Ok(Channel { signal, object, signature, offsets, is_described: false, absolute: None, range })
}

fn signal(device: &Node, channel: u8) -> Result<&Signal, Failure> {
    device
        .signals
        .iter()
        .find(|signal| signal.channel == channel)
        .ok_or_else(|| Failure::of_node(Kind::Usage, device.id, format!("it measures nothing on channel {channel}")))
}

fn absolute(master: &mut Master<'_>, device: &Node, entry: &Autozero) -> Result<Option<bool>, Failure> {
    let Some(absolute) = &entry.absolute else { return Ok(None) };
    match master.read(device.id, absolute.object, data_type(device, absolute.object, DataType::Unsigned(4)))? {
        Ok(kind) => Ok(kind.as_u64().map(|kind| kind == u64::from(absolute.value))),
        Err(SdoError { failure: SdoFailure::Refused(_), .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// The type of an object: from the description, else `otherwise`.
fn data_type(device: &Node, object: ObjectId, otherwise: DataType) -> DataType {
    let described = device.model.as_ref().and_then(|model| model.dictionary.get(object));
    described.map_or(otherwise, |entry| entry.data_type)
}

/// The type that CiA 404 gives the objects of a family: 6xxxh REAL32, 7xxxh, 8xxxh and 9xxxh integers.
fn of_family(object: ObjectId) -> DataType {
    match object.index & 0xf000 {
        0x7000 => DataType::Integer(2),
        0x8000 => DataType::Integer(3),
        0x9000 => DataType::Integer(4),
        _ => DataType::Real32,
    }
}

/// A number in the unit of the channel; `None` where the device refuses it.
fn number(
    master: &mut Master<'_>,
    device: &Node,
    signal: &Signal,
    object: ObjectId,
) -> Result<Option<Offset>, Failure> {
    let data_type = data_type(device, object, of_family(object));
    match master.read(device.id, object, data_type)? {
        Ok(value) => {
            let number = Number::from_value(&value, signal.digits.unwrap_or(0)).filter(|number| number.is_finite());
            Ok(number.map(|number| Offset { object, data_type, value, number }))
        }
        Err(SdoError { failure: SdoFailure::Refused(_) | SdoFailure::Fit(_), .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// The width of the measuring range in the present unit: as built, else from span start to span end.
fn range(
    master: &mut Master<'_>,
    device: &Node,
    signal: &Signal,
    built: Option<&Range>,
) -> Result<Option<f64>, Failure> {
    let width = |low: f64, high: f64| Some(high - low).filter(|width| width.is_finite() && *width > 0.0);
    if let (Some(range), Some(unit)) = (built, signal.unit) {
        let start = number(master, device, signal, range.start)?;
        let end = number(master, device, signal, range.end)?;
        let code = master.read(device.id, range.unit, DataType::Unsigned(4))?.ok().and_then(|code| code.as_u64());
        let from = code.and_then(|code| u32::try_from(code).ok()).map(Unit);
        let ends = start.zip(end).zip(from).and_then(|((start, end), from)| {
            let convert = |end: Offset| from.convert(end.number.as_f64(), unit);
            width(convert(start)?, convert(end)?)
        });
        if ends.is_some() {
            return Ok(ends);
        }
    }
    let description = device.model.as_ref().map(|model| &model.description);
    let entry = description.and_then(|known| known.signals.iter().find(|entry| entry.channel == signal.channel));
    let family = signal.value.0.index & 0xf000;
    let [start, end] = match entry {
        Some(entry) => [entry.span_start, entry.span_end],
        None => [0x148, 0x149].map(|index| Some(ObjectId::new(family | index, signal.channel))),
    };
    let (Some(start), Some(end)) = (start, end) else { return Ok(None) };
    let start = number(master, device, signal, start)?;
    let end = number(master, device, signal, end)?;
    Ok(start.zip(end).and_then(|(start, end)| width(start.number.as_f64(), end.number.as_f64())))
}

/// The offsets that can be read.
///
/// # Errors
/// Silence, and what stops everything.
pub(super) fn offsets(master: &mut Master<'_>, device: &Node, channel: &Channel) -> Result<Vec<Offset>, Failure> {
    let mut found = Vec::new();
    for &object in &channel.offsets {
        found.extend(number(master, device, &channel.signal, object)?);
    }
    Ok(found)
}
