//! Computes values for the page of `info`: meanings, dates, ranges, stored settings.

use super::info::{Date, Meaning, Store};
use super::{ValueWithUnit, filter, quantity};
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::assign::AssignKind;
use crate::device::description::{Access, Signature};
use crate::device::sensor;
use crate::device::unit::Unit;
use crate::measure::layout::Signal;
use crate::node::Node;
use std::collections::BTreeMap;

/// The names of the objects with the date of the last calibration.
pub(super) const CALIBRATED: [&str; 3] = ["calibration-year", "calibration-month", "calibration-day"];
/// The names of the objects with the date of production.
pub(super) const PRODUCED: [&str; 3] = ["production-year", "production-month", "production-day"];

/// Whether an object is manufacturer-specific.
pub(super) fn is_own(object: ObjectId) -> bool {
    (0x2000..0x6000).contains(&object.index)
}

/// The objects in the unit of a signal, as indices without the first digit.
const OBJECTS_IN_UNIT: [u16; 9] = [0x121, 0x123, 0x124, 0x133, 0x134, 0x135, 0x136, 0x148, 0x149];

/// Returns the meaning of a value.
pub(super) fn meaning(
    node: &Node,
    values: &BTreeMap<ObjectId, Value>,
    signal: Option<&Signal>,
    object: ObjectId,
    value: &Value,
) -> Meaning {
    let described = node.described(object);
    let number = value.as_u64();
    let as_unit = |number: u64| u32::try_from(number).ok().map(Unit);
    if let Some(signal) = signal.filter(|signal| is_in_unit(node, signal, object)) {
        return quantity(signal, value).map_or(Meaning::Plain, Meaning::Quantity);
    }
    if let Some(unit) = described.and_then(|entry| entry.unit_at).and_then(|at| values.get(&at)?.as_u64()) {
        return Meaning::Labelled(as_unit(unit).map(|unit| unit.to_string()).unwrap_or_default());
    }
    let objects = node.model.as_ref().map_or(&[][..], |model| &model.description.objects);
    let is_unit = objects.iter().any(|entry| entry.unit_at == Some(object));
    if let Some(unit) = number.filter(|_| is_unit).and_then(as_unit) {
        return Meaning::Unit(unit);
    }
    let word = || number.and_then(|number| described?.meaning(number));
    let label = |word: Option<&str>| word.map_or(Meaning::Plain, |word| Meaning::Labelled(word.to_owned()));
    match (object.index, number) {
        (0x1005 | 0x1014, Some(_)) => Meaning::CobId,
        (0x1006, Some(_)) => Meaning::Microseconds,
        (0x100c | 0x1017, Some(_)) => Meaning::Milliseconds,
        (0x1015, Some(_)) => Meaning::HundredMicroseconds,
        (0x6110, Some(number)) => label(word().or_else(|| u16::try_from(number).ok().and_then(sensor::kind))),
        (0x6112, Some(_)) if described.is_none() => Meaning::OperatingMode,
        (0x61a0, Some(number)) => match signal {
            Some(signal) => Meaning::Labelled(filter::meaning(node, signal, number)),
            None => Meaning::Plain,
        },
        _ => label(word().or_else(|| described?.unit.as_deref())),
    }
}

fn is_in_unit(node: &Node, signal: &Signal, object: ObjectId) -> bool {
    let standard = object.index >= 0x6000 && object.sub == signal.channel;
    let standard = standard && (OBJECTS_IN_UNIT.contains(&(object.index & 0x0fff)) || object.index == 0x6127);
    let described = node.described(object).is_some_and(|entry| entry.follows_unit == Some(signal.channel));
    let named = ["minimum-pv", "maximum-pv"].iter().any(|name| node.object_of(signal, name) == Some(object));
    standard || described || named
}

/// Returns the objects of a date, if the description has all three.
pub(super) fn date_objects(node: &Node, names: [&str; 3]) -> Option<[ObjectId; 3]> {
    let dictionary = &node.model.as_ref()?.dictionary;
    let [year, month, day] = names.map(|name| dictionary.find(name).map(|entry| entry.object));
    Some([year?, month?, day?])
}

/// Returns the date in three objects; `None` if one of them cannot be read.
pub(super) fn date(values: &BTreeMap<ObjectId, Value>, objects: [ObjectId; 3]) -> Option<Date> {
    let [year, month, day] = objects.map(|object| values.get(&object).cloned());
    Some(Date { parts: [year?, month?, day?] })
}

/// Returns the start and the end of the measuring range.
pub(super) fn range(
    values: &BTreeMap<ObjectId, Value>,
    signal: &Signal,
    [start, end]: [ObjectId; 2],
) -> Option<(ValueWithUnit, ValueWithUnit)> {
    let end_of_range = |object| quantity(signal, values.get(&object)?);
    Some((end_of_range(start)?, end_of_range(end)?))
}

/// Returns the bit rate setting of the device, if an object contains its code (MH-4 2321h).
pub(super) fn bit_rate(node: &Node, values: &BTreeMap<ObjectId, Value>) -> Option<u32> {
    let model = node.model.as_ref()?;
    let code = values.get(&model.dictionary.find("bit-rate")?.object)?.as_u64()?;
    model.description.bit_rates_of(AssignKind::Objects).get(&u8::try_from(code).ok()?).copied()
}

/// Returns the groups of 1010h, and the settings that the device stores.
pub(super) fn store(node: &Node, values: &BTreeMap<ObjectId, Value>, at: ObjectId) -> Store {
    let groups = (1..=4).filter_map(|sub| {
        let capability = values.get(&at.with_sub(sub))?.as_u64()?;
        Some((sub, u32::try_from(capability).ok()?))
    });
    let mut store = Store { groups: groups.collect(), ..Store::default() };
    let objects = node.model.as_ref().map_or(&[][..], |model| &model.description.objects);
    if objects.iter().all(|entry| entry.stored.is_none()) {
        return store;
    }
    let settings = objects.iter().filter(|entry| {
        let is_command = entry.signature.is_some_and(|signature| signature != Signature::Set);
        entry.access == Access::Rw && !is_command && entry.at.first.index != 0x1003
    });
    // Node-ID and bit rate are stored by another command.
    let methods = node.model.as_ref().map_or(&[][..], |model| &model.description.assign);
    let assigned =
        methods.iter().flat_map(|method| [method.node_id, method.bit_rate]).flatten().map(|place| place.object);
    let assigned: Vec<ObjectId> = assigned.collect();
    for entry in settings {
        let is_assigned = entry.objects().any(|object| assigned.contains(&object));
        let names = if entry.stored.is_some() || is_assigned { &mut store.kept } else { &mut store.lost };
        if !names.contains(&entry.name) {
            names.push(entry.name.clone());
        }
    }
    store
}

impl std::fmt::Display for ValueWithUnit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let unit = self.unit.map(|unit| unit.to_string()).filter(|unit| !unit.is_empty());
        match unit {
            Some(unit) => write!(f, "{} {unit}", self.number),
            None => write!(f, "{}", self.number),
        }
    }
}
