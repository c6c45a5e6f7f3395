//! Finds the objects that set the zero of a channel: signature, offset, measuring range. They come from the description
//! or from CiA 404.

use super::ZeroTarget;
use super::failure::AutozeroFailure;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::{DataType, Value};
use crate::device::description::{Autozero, Range, Signature};
use crate::device::unit::Unit;
use crate::master::{Master, Request, SdoError, SdoFailure};
use crate::measure::layout::Signal;
use crate::measure::sample::Number;
use crate::node::Node;
use crate::tasks::Failure;
use crate::tasks::read::ReadFailure;

/// A channel whose zero can be set.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub(super) signal: Signal,
    /// The object to which the signature is written.
    pub(super) object: ObjectId,
    pub(super) signature: Vec<u8>,
    /// The objects that may contain the offset: one if the device is described, else those of CiA 404.
    pub(super) offsets: Vec<ObjectId>,
    /// Whether a description names the object of the offset.
    pub(super) is_described: bool,
    /// Whether the sensor measures absolute pressure; `None` if unknown.
    pub(super) absolute: Option<bool>,
    /// The width of the measuring range in the present unit.
    pub(super) range: Option<f64>,
}

/// An offset in the device.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Offset {
    pub(super) object: ObjectId,
    pub(super) data_type: DataType,
    /// The value of the object.
    pub(super) value: Value,
    /// The number in the present unit.
    pub(super) number: Number,
}

/// Finds the channel with a number, or the only channel.
///
/// # Errors
/// The device has no autozero, or not for this channel; several channels exist and none was chosen; no answer.
pub(super) fn find(master: &mut Master<'_>, device: &Node, number: Option<u8>) -> Result<Channel, Failure> {
    let fail = |cause| Failure::at(device.id, cause);
    let description = device.model.as_ref().map(|model| &model.description);
    let described = description.map_or(&[][..], |description| &description.autozero);
    let title = description.map_or_else(String::new, |description| description.title.clone());
    if described.is_empty() {
        let all_known = description.is_some_and(|description| !description.signals.is_empty());
        if all_known && device.model.as_ref().is_some_and(|model| !model.dictionary.has_index(0x6125)) {
            return Err(fail(AutozeroFailure::NoAutozero { title: title.clone() }));
        }
        return find_by_cia404(master, device, number);
    }
    let available = || described.iter().map(|entry| entry.channel).collect::<Vec<_>>();
    let entry = match (number, described) {
        (None, [only]) => only,
        (None, _) => {
            return Err(fail(AutozeroFailure::WhichChannel { target: ZeroTarget::Autozero, available: available() }));
        }
        (Some(number), _) => described.iter().find(|entry| entry.channel == number).ok_or_else(|| {
            fail(AutozeroFailure::NoSuchChannel { title: title.clone(), channel: number, available: available() })
        })?,
    };
    let signal = find_signal(device, entry.channel)?.clone();
    let absolute = read_absolute(master, device, entry)?;
    let range = read_range(master, device, &signal, entry.range.as_ref())?;
    let signature = entry.signature.clone();
    let offsets = entry.offset.into_iter().collect();
    let is_described = entry.offset.is_some();
    Ok(Channel { signal, object: entry.object, signature, offsets, is_described, absolute, range })
}

/// Finds the channel that has a tare: the description or EDS contains 6139h:n and the net value. The net value then
/// replaces the process value of the signal.
///
/// # Errors
/// This channel (or every channel) has no tare; several have a tare and none was chosen; no answer.
pub(super) fn find_tare(master: &mut Master<'_>, device: &mut Node, number: Option<u8>) -> Result<Channel, Failure> {
    let fail = |cause| Failure::at(device.id, cause);
    let layout = device.layout();
    let known = |object: &ObjectId| layout.model.is_some_and(|model| model.dictionary.get(*object).is_some());
    let object = |signal: &Signal| Some(ObjectId::new(0x6139, signal.channel)).filter(known);
    let net = |signal: &Signal| layout.find_in_family(signal, 0x140).filter(known);
    let candidates: Vec<(&Signal, ObjectId, ObjectId)> =
        device.channels().into_iter().filter_map(|signal| Some((signal, object(signal)?, net(signal)?))).collect();
    let available = candidates.iter().map(|(signal, ..)| signal.channel).collect();
    let (signal, object, net) = match (number, candidates.as_slice()) {
        (_, []) => return Err(fail(AutozeroFailure::NoTare)),
        (None, [only]) => *only,
        (None, _) => return Err(fail(AutozeroFailure::WhichChannel { target: ZeroTarget::Tare, available })),
        (Some(number), _) => {
            let found = candidates.iter().find(|(signal, ..)| signal.channel == number);
            *found.ok_or_else(|| fail(AutozeroFailure::NoTareOfChannel { channel: number, available }))?
        }
    };
    let signature = device.described(object).and_then(|entry| entry.signature).unwrap_or(Signature::Tare);
    let offsets: Vec<ObjectId> = layout.find_in_family(signal, 0x138).into_iter().collect();
    let signal = Signal { value_object: (net, layout.data_type(net)), ..signal.clone() };
    let range = read_range(master, device, &signal, None)?;
    device.signals.iter_mut().filter(|known| known.name == signal.name).for_each(|known| *known = signal.clone());
    Ok(Channel {
        signal,
        object,
        signature: signature.as_str().as_bytes().to_vec(),
        is_described: !offsets.is_empty(),
        offsets,
        absolute: None,
        range,
    })
}

/// Returns the channel with the autozero of CiA 404 (6125h:n), if the device has this object.
fn find_by_cia404(master: &mut Master<'_>, device: &Node, number: Option<u8>) -> Result<Channel, Failure> {
    let node = device.id;
    let signal = match (number, device.channels().as_slice()) {
        (Some(number), _) => find_signal(device, number)?,
        (None, [only]) => *only,
        (None, []) => return Err(Failure::at(node, ReadFailure::NoMeasuredValue)),
        (None, _) => {
            return Err(Failure::at(
                node,
                AutozeroFailure::WhichChannel { target: ZeroTarget::Autozero, available: Vec::new() },
            ));
        }
    }
    .clone();
    let object = ObjectId::new(0x6125, signal.channel);
    match master.transfer_one(Request::read(node, object))? {
        Err(SdoError {
            failure: SdoFailure::Refused(code @ (AbortCode::NO_OBJECT | AbortCode::NO_SUB_INDEX)), ..
        }) => {
            let cause = AutozeroFailure::NoObject { channel: signal.channel, object, code };
            return Err(Failure::at(node, cause).of_object(object));
        }
        // The object is write-only, as CiA 404 requires.
        Ok(_) | Err(SdoError { failure: SdoFailure::Refused(_), .. }) => {}
        Err(error) => return Err(error.into()),
    }
    let family = signal.value_object.0.index & 0xf000;
    let offsets = [0x6127, family | 0x124].map(|index| ObjectId::new(index, signal.channel)).to_vec();
    let range = read_range(master, device, &signal, None)?;
    let signature = b"zero".to_vec();
    Ok(Channel { signal, object, signature, offsets, is_described: false, absolute: None, range })
}

fn find_signal(device: &Node, channel: u8) -> Result<&Signal, Failure> {
    device
        .signals
        .iter()
        .find(|signal| signal.channel == channel)
        .ok_or_else(|| Failure::at(device.id, AutozeroFailure::NoMeasuredValueOnChannel { channel }))
}

fn read_absolute(master: &mut Master<'_>, device: &Node, entry: &Autozero) -> Result<Option<bool>, Failure> {
    let Some(absolute) = &entry.absolute else { return Ok(None) };
    match master.read(device.id, absolute.object, data_type(device, absolute.object, DataType::Unsigned(4)))? {
        Ok(kind) => Ok(kind.as_u64().map(|kind| kind == u64::from(absolute.value))),
        Err(SdoError { failure: SdoFailure::Refused(_), .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// Returns the data type of an object from the description, or `otherwise` if it is not described.
fn data_type(device: &Node, object: ObjectId, otherwise: DataType) -> DataType {
    let described = device.model.as_ref().and_then(|model| model.dictionary.get(object));
    described.map_or(otherwise, |entry| entry.data_type)
}

/// Returns the data type of a CiA 404 object: REAL32 for 6xxxh; integers for 7xxxh, 8xxxh and 9xxxh.
fn cia404_data_type(object: ObjectId) -> DataType {
    match object.index & 0xf000 {
        0x7000 => DataType::Integer(2),
        0x8000 => DataType::Integer(3),
        0x9000 => DataType::Integer(4),
        _ => DataType::Real32,
    }
}

/// Reads a number in the unit of the channel; `None` if the device rejects the request.
fn read_number(
    master: &mut Master<'_>,
    device: &Node,
    signal: &Signal,
    object: ObjectId,
) -> Result<Option<Offset>, Failure> {
    let data_type = data_type(device, object, cia404_data_type(object));
    match master.read(device.id, object, data_type)? {
        Ok(value) => {
            let number = signal.number(&value).filter(|number| number.is_finite());
            Ok(number.map(|number| Offset { object, data_type, value, number }))
        }
        Err(SdoError { failure: SdoFailure::Refused(_) | SdoFailure::Fit(_), .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// Reads the width of the measuring range in the present unit: the range of the sensor, else span start to span end.
fn read_range(
    master: &mut Master<'_>,
    device: &Node,
    signal: &Signal,
    sensor_range: Option<&Range>,
) -> Result<Option<f64>, Failure> {
    let width = |low: f64, high: f64| Some(high - low).filter(|width| width.is_finite() && *width > 0.0);
    if let (Some(range), Some(unit)) = (sensor_range, signal.unit) {
        let start = read_number(master, device, signal, range.start)?;
        let end = read_number(master, device, signal, range.end)?;
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
    let family = signal.value_object.0.index & 0xf000;
    let [start, end] = match entry {
        Some(entry) => [entry.span_start, entry.span_end],
        None => [0x148, 0x149].map(|index| Some(ObjectId::new(family | index, signal.channel))),
    };
    let (Some(start), Some(end)) = (start, end) else { return Ok(None) };
    let start = read_number(master, device, signal, start)?;
    let end = read_number(master, device, signal, end)?;
    Ok(start.zip(end).and_then(|(start, end)| width(start.number.as_f64(), end.number.as_f64())))
}

/// Reads the offsets. Offsets that the device does not have are omitted.
///
/// # Errors
/// No answer, a bus error, Ctrl-C.
pub(super) fn offsets(master: &mut Master<'_>, device: &Node, channel: &Channel) -> Result<Vec<Offset>, Failure> {
    let mut found = Vec::new();
    for &object in &channel.offsets {
        found.extend(read_number(master, device, &channel.signal, object)?);
    }
    Ok(found)
}
