//! The measuring channels of a simulated device: the quantity of each, and the objects that contain its value (CiA 404:
//! x100h, x130h, 6150h and related objects).

mod filters;

use super::abort::Abort;
use super::filter::Filter;
use super::model::{Direction, Quantity};
use super::number;
use super::objects::Objects;
use super::setup::Setup;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::device::description::SignalEntry;
use crate::device::unit::Unit;
use std::collections::BTreeMap;
use std::time::Duration;

/// The first digit of an index: REAL32, INTEGER16, INTEGER24, INTEGER32.
const FAMILIES: [u16; 4] = [0x6000, 0x7000, 0x8000, 0x9000];

/// The value of a channel that an object contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ObjectContent {
    Value,
    Net,
    Field,
    Status,
    Lowest,
    Highest,
}

/// How a number is converted if the unit of its channel changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A point on the scale: limits, start and end of the range.
    Point,
    /// A distance on the scale: offsets, deltas, hysteresis.
    Distance,
}

/// The objects of CiA 404 in the unit of 6131h, besides the value itself.
const IN_PV_UNIT: [(u16, Kind); 10] = [
    (0x121, Kind::Point),
    (0x123, Kind::Point),
    (0x124, Kind::Distance),
    (0x133, Kind::Distance),
    (0x134, Kind::Point),
    (0x135, Kind::Point),
    (0x136, Kind::Distance),
    (0x138, Kind::Distance),
    (0x148, Kind::Point),
    (0x149, Kind::Point),
];

/// All channels of one device.
#[derive(Clone, Debug)]
pub(super) struct Channels {
    list: Vec<Channel>,
    contents: BTreeMap<ObjectId, (usize, ObjectContent)>,
}

#[derive(Clone, Debug)]
struct Channel {
    signal: SignalEntry,
    quantity: Quantity,
    filter: Filter,
    /// The lowest and highest value so far.
    seen: Option<(f64, f64)>,
    /// Other objects in the unit of the channel.
    follows: Vec<(ObjectId, Kind)>,
    /// Their numbers at the last change of the unit.
    converted: BTreeMap<ObjectId, Converted>,
}

/// A number before and after a change of the unit. If the old unit is set again, the number has no rounding error.
#[derive(Clone, Debug)]
struct Converted {
    from: Unit,
    before: Vec<u8>,
    after: Vec<u8>,
}

/// One measured value as sent.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reading {
    pub(super) signal: String,
    pub(super) unit: Unit,
    /// The object with the status of the value.
    pub(super) status: Option<ObjectId>,
    /// Decimal digits of an integer; `None` for a real number.
    pub(super) digits: Option<u32>,
    pub(super) overload: Option<Direction>,
    /// Whether the device sends a marker instead of the value during an overload.
    pub(super) marker: bool,
}

impl Channels {
    pub(super) fn new(setup: &Setup, objects: &Objects) -> Channels {
        let Setup { model, sim, channels, overloads, seed, serial, .. } = setup;
        let sample = Duration::from_micros(u64::from(sim.sample_us.unwrap_or(1000)));
        let list = model.description.signals.iter().filter_map(|signal| {
            let channel = channels.iter().find(|channel| channel.channel == signal.channel)?.clone();
            let mine = overloads.iter().filter(|(number, _)| *number == signal.channel);
            let mine = mine.map(|(_, overload)| *overload).collect();
            let quantity = Quantity::new(channel, sample, sim.overload_percent, mine, *seed, *serial);
            let filter = Filter::new(&model.description, signal.channel, sim.mean_until_pdo);
            Some(Channel::new(signal, quantity, filter, model, objects))
        });
        let list: Vec<Channel> = list.collect();
        let mut contents = BTreeMap::new();
        for (index, channel) in list.iter().enumerate() {
            channel.contents(objects, list.len() == 1).into_iter().for_each(|(object, content)| {
                contents.insert(object, (index, content));
            });
        }
        Channels { list, contents }
    }

    /// Sets a signal to a constant value from now on: `pressure`, `5.2bar`.
    pub(super) fn hold(&mut self, signal: &str, value: &str, time: Duration) -> Result<(), String> {
        let names: Vec<&str> = self.list.iter().map(|channel| channel.signal.name.as_str()).collect();
        let Some(place) = names.iter().position(|name| *name == signal) else {
            return Err(format!("no signal \"{signal}\" (it has: {})", names.join(", ")));
        };
        // Adds the earlier samples, which have the old value, to the filter.
        self.list[place].filtered(time);
        let quantity = &mut self.list[place].quantity;
        let value = super::bench::value_in(value, Unit(quantity.channel().unit))
            .ok_or_else(|| format!("\"{value}\" is not a value with a unit of the signal"))?;
        quantity.hold(value);
        Ok(())
    }

    /// Encodes the object with a measurement at `time`; `None` for any other object.
    pub(super) fn read(&mut self, objects: &Objects, object: ObjectId, time: Duration) -> Option<Vec<u8>> {
        let (index, content) = *self.contents.get(&object)?;
        let data_type = objects.spec(object)?.data_type;
        let channel = self.list.get_mut(index)?;
        Some(channel.read(objects, content, data_type, time))
    }

    /// Returns the meaning of a mapped object, if it is a measured value.
    pub(super) fn reading(&self, objects: &Objects, object: ObjectId, time: Duration) -> Option<Reading> {
        let (index, ObjectContent::Value) = *self.contents.get(&object)? else { return None };
        let channel = self.list.get(index)?;
        let integer = matches!(objects.spec(object)?.data_type, DataType::Integer(_) | DataType::Unsigned(_));
        Some(Reading {
            signal: channel.signal.name.clone(),
            unit: channel.unit(objects),
            status: channel.signal.status,
            digits: integer.then(|| channel.digits(objects)),
            overload: channel.quantity.overload(time),
            marker: channel.signal.marker,
        })
    }

    /// Whether an object contains the status of a channel.
    pub(super) fn is_status(&self, object: ObjectId) -> bool {
        self.contents.get(&object).is_some_and(|(_, content)| *content == ObjectContent::Status)
    }

    /// Returns the measured value at `time` as the number in the object, without marker and rounding. For an integer,
    /// the value is multiplied by its power of ten.
    pub(super) fn number(&mut self, objects: &Objects, object: ObjectId, time: Duration) -> Option<f64> {
        let (index, ObjectContent::Value) = *self.contents.get(&object)? else { return None };
        let channel = self.list.get_mut(index)?;
        let data_type = objects.spec(object)?.data_type;
        let raw = channel.filtered(time);
        Some(channel.scaled(objects, data_type, channel.value(objects, raw)))
    }

    /// Returns the lowest and highest possible number of [`Channels::number`].
    pub(super) fn reach(&self, objects: &Objects, object: ObjectId) -> Option<(f64, f64)> {
        let (channel, data_type) = self.value_of(objects, object)?;
        let (low, high) = channel.quantity.reach();
        let [a, b] = [low, high].map(|raw| channel.scaled(objects, data_type, channel.value(objects, raw)));
        Some((a.min(b), a.max(b)))
    }

    /// Returns the time of the next sample of an object.
    pub(super) fn next_sample(&self, objects: &Objects, object: ObjectId, time: Duration) -> Option<Duration> {
        let (channel, _) = self.value_of(objects, object)?;
        Some(channel.quantity.next_sample(time))
    }

    fn value_of(&self, objects: &Objects, object: ObjectId) -> Option<(&Channel, DataType)> {
        let (index, ObjectContent::Value) = *self.contents.get(&object)? else { return None };
        Some((self.list.get(index)?, objects.spec(object)?.data_type))
    }

    /// Returns every channel with the direction of its overload at `time`.
    pub(super) fn overloads(&self, time: Duration) -> impl Iterator<Item = (u8, Option<Direction>)> {
        self.list.iter().map(move |channel| (channel.signal.channel, channel.quantity.overload(time)))
    }

    /// Returns the time of the next change in [`Channels::overloads`].
    pub(super) fn next_overload_change(&self, time: Duration) -> Option<Duration> {
        self.list.iter().filter_map(|channel| channel.quantity.next_change(time)).min()
    }

    /// Sets the present value to zero through the offset. `false` if the channel has no offset.
    pub(super) fn autozero(&mut self, objects: &mut Objects, number: u8, time: Duration) -> bool {
        let Some(channel) = self.list.iter_mut().find(|channel| channel.signal.channel == number) else { return false };
        let Some(object) = channel.offset_object(objects) else { return false };
        let offset = channel.pv(objects, object).unwrap_or(0.0);
        let raw = channel.filtered(time);
        channel.put_pv(objects, object, offset - channel.value(objects, raw));
        true
    }

    /// Sets the tare zero (x138h) to the present value.
    pub(super) fn tare(&mut self, objects: &mut Objects, number: u8, time: Duration) -> Result<(), Abort> {
        let channel = self.list.iter_mut().find(|channel| channel.signal.channel == number).ok_or(Abort::NOT_STORED)?;
        let object = channel.tare_object(objects).ok_or(Abort::NOT_STORED)?;
        let raw = channel.filtered(time);
        channel.put_pv(objects, object, channel.value(objects, raw));
        Ok(())
    }

    /// Resets minimum and maximum.
    pub(super) fn reset_extremes(&mut self, number: u8) {
        self.list.iter_mut().filter(|channel| channel.signal.channel == number).for_each(|channel| channel.seen = None);
    }

    /// Whether an object contains the unit of a channel.
    pub(super) fn is_unit(&self, object: ObjectId) -> bool {
        self.list.iter().any(|channel| channel.signal.unit == Some(object))
    }

    /// Changes the unit of a channel and converts every object in this unit. `false` if the value cannot be converted.
    pub(super) fn change_unit(&mut self, objects: &mut Objects, object: ObjectId, to: Unit) -> bool {
        let Some(channel) = self.list.iter_mut().find(|channel| channel.signal.unit == Some(object)) else {
            return false;
        };
        let from = channel.unit(objects);
        let (Some(_), Some(zero)) = (Unit(channel.quantity.channel().unit).convert(0.0, to), from.convert(0.0, to))
        else {
            return false;
        };
        for (kept, kind) in channel.follows.clone() {
            let Some(before) = objects.bytes(kept).map(<[u8]>::to_vec) else { continue };
            match channel.converted.get(&kept) {
                Some(last) if last.from == to && last.after == before => objects.put(kept, last.before.clone()),
                _ => {
                    let Some(point) = channel.pv(objects, kept).and_then(|old| from.convert(old, to)) else { continue };
                    channel.put_pv(objects, kept, if kind == Kind::Point { point } else { point - zero });
                }
            }
            let after = objects.bytes(kept).map(<[u8]>::to_vec).unwrap_or_default();
            channel.converted.insert(kept, Converted { from, before, after });
        }
        objects.put(object, to.0.to_le_bytes().to_vec());
        true
    }

    /// Copies a written limit to its other types, because it is one quantity. A change of the decimal digits also
    /// changes the integers of all limits.
    pub(super) fn share(&self, objects: &mut Objects, written: ObjectId) {
        for channel in &self.list {
            let is_in_unit = channel.follows.iter().any(|(object, _)| *object == written);
            if let Some(value) = channel.pv(objects, written).filter(|_| is_in_unit) {
                channel.put_pv(objects, real_form(written), value);
            }
            if is_in_unit || [channel.signal.digits, channel.signal.unit].contains(&Some(written)) {
                channel.align(objects, Some(written));
            }
        }
    }

    fn by_number(&self, number: u8) -> Option<&Channel> {
        self.list.iter().find(|channel| channel.signal.channel == number)
    }
}

impl Channel {
    fn new(signal: &SignalEntry, quantity: Quantity, filter: Filter, model: &Model, objects: &Objects) -> Channel {
        let sub = signal.channel;
        let object_in_family =
            |(low, kind): (u16, Kind)| FAMILIES.iter().map(move |family| (ObjectId::new(family | low, sub), kind));
        let offset = (ObjectId::new(0x6127, sub), Kind::Distance);
        let described = model.description.objects.iter().filter(|entry| entry.follows_unit == Some(sub));
        let described = described.flat_map(|entry| entry.objects());
        let mut follows: Vec<(ObjectId, Kind)> = IN_PV_UNIT
            .into_iter()
            .flat_map(object_in_family)
            .chain([offset])
            .chain(described.map(|object| (object, Kind::Distance)))
            .filter(|(object, _)| objects.has(*object))
            .collect();
        // A description may also state the objects of CiA 404.
        follows.sort_by_key(|(object, _)| *object);
        follows.dedup_by_key(|(object, _)| *object);
        Channel { signal: signal.clone(), quantity, filter, seen: None, follows, converted: BTreeMap::new() }
    }

    /// Returns the objects that contain a value of this channel.
    fn contents(&self, objects: &Objects, alone: bool) -> Vec<(ObjectId, ObjectContent)> {
        let sub = self.signal.channel;
        let mut contents: Vec<(ObjectId, ObjectContent)> = Vec::new();
        for family in FAMILIES {
            contents.push((ObjectId::new(family | 0x130, sub), ObjectContent::Value));
            contents.push((ObjectId::new(family | 0x140, sub), ObjectContent::Net));
            contents.push((ObjectId::new(family | 0x100, sub), ObjectContent::Field));
        }
        contents.push((self.signal.value, ObjectContent::Value));
        contents.extend(self.signal.also.iter().map(|object| (*object, ObjectContent::Value)));
        contents.extend(self.signal.status.map(|object| (object, ObjectContent::Status)));
        // These two objects are manufacturer-specific: they have fixed names, but no fixed indices. A device with one
        // channel may have them without sub-indices.
        let mine = |object: &ObjectId| object.sub == sub || (object.sub == 0 && alone);
        contents.extend(objects.specs().filter(|(object, _)| mine(object)).filter_map(|(object, spec)| {
            match spec.name.as_str() {
                "minimum-pv" => Some((object, ObjectContent::Lowest)),
                "maximum-pv" => Some((object, ObjectContent::Highest)),
                _ => None,
            }
        }));
        contents.retain(|(object, _)| objects.has(*object));
        contents
    }

    fn read(&mut self, objects: &Objects, content: ObjectContent, data_type: DataType, time: Duration) -> Vec<u8> {
        let raw = self.filtered(time);
        let (low, high) = self.seen.unwrap_or((raw, raw));
        let (low, high) = (low.min(raw), high.max(raw));
        self.seen = Some((low, high));
        let overload = self.quantity.overload(time);
        match content {
            ObjectContent::Value if overload.is_some() && self.signal.marker => marker(data_type),
            ObjectContent::Value => self.encode(objects, data_type, raw),
            ObjectContent::Net => {
                let tare = self.tare_object(objects).and_then(|object| self.pv(objects, object)).unwrap_or(0.0);
                number::to_bytes(self.scaled(objects, data_type, self.value(objects, raw) - tare), data_type)
            }
            ObjectContent::Lowest => self.encode(objects, data_type, low),
            ObjectContent::Highest => self.encode(objects, data_type, high),
            ObjectContent::Status => number::to_bytes(self.status(overload), data_type),
            ObjectContent::Field => {
                let channel = self.quantity.channel();
                let [start, end] = channel.field.unwrap_or([0.0, 10_000.0]);
                let part = (self.quantity.at(time) - channel.start) / (channel.end - channel.start);
                number::to_bytes(start + part * (end - start), data_type)
            }
        }
    }

    /// Returns the measured quantity at `time` after the filter.
    fn filtered(&mut self, time: Duration) -> f64 {
        self.filter.value(&self.quantity, time)
    }

    /// Converts a measured quantity to the present unit, with factor and offset.
    fn value(&self, objects: &Objects, raw: f64) -> f64 {
        let converted = Unit(self.quantity.channel().unit).convert(raw, self.unit(objects)).unwrap_or(raw);
        let factor = objects.real(ObjectId::new(0x6126, self.signal.channel)).unwrap_or(1.0);
        let offset = self.offset_object(objects).and_then(|object| self.pv(objects, object)).unwrap_or(0.0);
        converted * factor + offset
    }

    /// Returns the object with the offset: 6127h with a factor, else x124h.
    fn offset_object(&self, objects: &Objects) -> Option<ObjectId> {
        let sub = self.signal.channel;
        let candidates = [0x6127, 0x6124, 0x7124, 0x8124, 0x9124];
        candidates.into_iter().map(|index| ObjectId::new(index, sub)).find(|object| objects.has(*object))
    }

    /// Returns the object with the tare zero.
    fn tare_object(&self, objects: &Objects) -> Option<ObjectId> {
        let candidates = FAMILIES.map(|family| ObjectId::new(family | 0x138, self.signal.channel));
        candidates.into_iter().find(|object| objects.has(*object))
    }

    fn encode(&self, objects: &Objects, data_type: DataType, raw: f64) -> Vec<u8> {
        number::to_bytes(self.scaled(objects, data_type, self.value(objects, raw)), data_type)
    }

    /// Converts a value to the number in a type: for an integer, it is multiplied by its power of ten.
    fn scaled(&self, objects: &Objects, data_type: DataType, value: f64) -> f64 {
        if let Some(scale) = self.signal.scale {
            return (value - scale.offset.as_f64()) / scale.factor.as_f64();
        }
        match data_type {
            DataType::Real32 | DataType::Real64 => value,
            _ => value * self.power(objects),
        }
    }

    /// Returns the number in the status object.
    fn status(&self, overload: Option<Direction>) -> f64 {
        let bits = status(overload);
        let Some(own) = &self.signal.status_bits else { return f64::from(bits) };
        let masks = [(0b001, own.invalid), (0b010, own.high), (0b100, own.low)];
        let own = masks.into_iter().filter(|(bit, _)| bits & bit != 0).fold(0, |number, (_, mask)| number | mask);
        own as f64
    }

    fn digits(&self, objects: &Objects) -> u32 {
        self.signal.digits.map_or(0, |object| objects.number(object)).min(9)
    }

    fn power(&self, objects: &Objects) -> f64 {
        (0..self.digits(objects)).fold(1.0, |power, _| power * 10.0)
    }

    fn unit(&self, objects: &Objects) -> Unit {
        let object = self.signal.unit.filter(|object| objects.has(*object));
        Unit(object.map_or(self.quantity.channel().unit, |object| objects.number(object)))
    }

    /// Returns the value of an object in the unit of the channel.
    fn pv(&self, objects: &Objects, object: ObjectId) -> Option<f64> {
        let number = objects.real(object)?;
        Some(match objects.spec(object)?.data_type {
            DataType::Real32 | DataType::Real64 => number,
            _ => number / self.power(objects),
        })
    }

    /// Computes the integer forms of every limit from the REAL32 form, except the object `exact`.
    fn align(&self, objects: &mut Objects, exact: Option<ObjectId>) {
        for (object, _) in self.follows.iter().filter(|(object, _)| Some(*object) != exact) {
            let Some((own, real)) = self.pv(objects, *object).zip(self.pv(objects, real_form(*object))) else {
                continue;
            };
            // Small differences are kept, because a REAL32 has fewer digits than an INTEGER32.
            if (own - real).abs() > real.abs() * f64::from(f32::EPSILON) {
                self.put_pv(objects, *object, real);
            }
        }
    }

    fn put_pv(&self, objects: &mut Objects, object: ObjectId, value: f64) {
        if let Some(data_type) = objects.spec(object).map(|spec| spec.data_type) {
            let bytes = number::to_bytes(self.scaled(objects, data_type, value), data_type);
            objects.put(object, bytes);
        }
    }
}

/// Returns the REAL32 form of an object of CiA 404.
fn real_form(object: ObjectId) -> ObjectId {
    ObjectId::new(0x6000 | object.index & 0x0fff, object.sub)
}

/// Returns the bits of 6150h: bit 0 invalid, bit 1 positive, bit 2 negative overload.
pub(super) fn status(overload: Option<Direction>) -> u8 {
    match overload {
        None => 0b000,
        Some(Direction::High) => 0b011,
        Some(Direction::Low) => 0b101,
    }
}

/// Returns the bytes that are sent instead of an invalid value (MH-4, 4.2.15): NaN, or the smallest integer.
fn marker(data_type: DataType) -> Vec<u8> {
    match data_type {
        DataType::Integer(_) => number::to_bytes(f64::NEG_INFINITY, data_type),
        _ => number::to_bytes(f64::NAN, data_type),
    }
}

#[cfg(test)]
mod tests;
