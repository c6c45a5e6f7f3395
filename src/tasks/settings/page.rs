//! How the objects of the info page read: values with unit and meaning, dates, ranges, what is stored.

use super::info::{Store, filter_text};
use super::{Device, Quantity};
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::description::{Access, Signature};
use crate::device::sensor;
use crate::device::unit::Unit;
use crate::measure::layout::Signal;
use std::collections::BTreeMap;

/// Names of the objects that make the date of the last calibration.
pub(super) const CALIBRATED: [&str; 3] = ["calibration-year", "calibration-month", "calibration-day"];
/// Names of the objects that make the date of production.
pub(super) const PRODUCED: [&str; 3] = ["production-year", "production-month", "production-day"];

/// Whether an object is the manufacturer's.
pub(super) fn is_own(object: ObjectId) -> bool {
    (0x2000..0x6000).contains(&object.index)
}

/// What is kept in the unit of a signal, as indices without the first digit.
const IN_UNIT: [u16; 9] = [0x121, 0x123, 0x124, 0x133, 0x134, 0x135, 0x136, 0x148, 0x149];

/// A value with unit and meaning.
pub(super) fn text(
    device: &Device,
    values: &BTreeMap<ObjectId, Value>,
    signal: Option<&Signal>,
    object: ObjectId,
    value: &Value,
) -> String {
    let described = device.described(object);
    let number = value.as_u64();
    if let Some(signal) = signal.filter(|signal| is_in_unit(device, signal, object)) {
        return device.quantity(signal, value).map_or_else(|| value.to_string(), |quantity| quantity.to_string());
    }
    if let Some(unit) = described.and_then(|entry| entry.unit_at).and_then(|at| values.get(&at)?.as_u64()) {
        let unit = u32::try_from(unit).map(Unit).map(|unit| unit.to_string()).unwrap_or_default();
        return format!("{value} {unit}");
    }
    let codes =
        device.model().is_some_and(|model| model.description.objects.iter().any(|entry| entry.unit_at == Some(object)));
    if let Some(code) = number.filter(|_| codes).and_then(|code| u32::try_from(code).ok()) {
        return Unit(code).to_string();
    }
    match (object.index, number) {
        (0x1005 | 0x1014, Some(number)) => format!("0x{number:X}"),
        (0x100c | 0x1017, Some(0)) => "off".to_owned(),
        (0x1006, Some(number)) => format!("{number} us"),
        (0x100c | 0x1017, Some(number)) => format!("{number} ms"),
        (0x1015, Some(number)) => format!("{}.{} ms", number / 10, number % 10),
        (0x6110, Some(number)) => {
            let standard = || u16::try_from(number).ok().and_then(sensor::kind);
            let kind = described.and_then(|entry| entry.meaning(number)).or_else(standard);
            kind.map_or_else(|| number.to_string(), |kind| format!("{number} {kind}"))
        }
        (0x6112, Some(number)) if described.is_none() => match number {
            0 => "0 off".to_owned(),
            1 => "1 normal operation".to_owned(),
            _ => number.to_string(),
        },
        (0x61a0, Some(number)) => match signal {
            Some(signal) => format!("{number} {}", filter_text(device, signal, number)),
            None => number.to_string(),
        },
        _ => {
            let meaning = number.and_then(|number| described?.meaning(number));
            let unit = described.and_then(|entry| entry.unit.as_deref());
            match (meaning, unit) {
                (Some(meaning), _) => format!("{value} {meaning}"),
                (None, Some(unit)) => format!("{value} {unit}"),
                (None, None) => value.to_string(),
            }
        }
    }
}

fn is_in_unit(device: &Device, signal: &Signal, object: ObjectId) -> bool {
    let standard = object.index >= 0x6000 && object.sub == signal.channel;
    let standard = standard && (IN_UNIT.contains(&(object.index & 0x0fff)) || object.index == 0x6127);
    let described = device.described(object).is_some_and(|entry| entry.follows_unit == Some(signal.channel));
    let named = ["minimum-pv", "maximum-pv"].iter().any(|name| device.of_signal(signal, name) == Some(object));
    standard || described || named
}

/// The objects of a date, where a description has all three.
pub(super) fn date_objects(device: &Device, names: [&str; 3]) -> Option<[ObjectId; 3]> {
    let dictionary = &device.model()?.dictionary;
    let [year, month, day] = names.map(|name| dictionary.find(name).map(|entry| entry.object));
    Some([year?, month?, day?])
}

/// `2016-04-01`; numbers that make no date as they are.
pub(super) fn date(values: &BTreeMap<ObjectId, Value>, objects: [ObjectId; 3]) -> Option<String> {
    let [year, month, day] = objects.map(|object| values.get(&object));
    let (year, month, day) = (year?, month?, day?);
    match (year.as_u64(), month.as_u64(), day.as_u64()) {
        (Some(year @ 1980..=2200), Some(month @ 1..=12), Some(day @ 1..=31)) => {
            Some(format!("{year}-{month:02}-{day:02}"))
        }
        _ => Some(format!("year {year}, month {month}, day {day}")),
    }
}

/// Start and end of the measuring range.
pub(super) fn range(
    device: &Device,
    values: &BTreeMap<ObjectId, Value>,
    signal: &Signal,
    [start, end]: [ObjectId; 2],
) -> Option<(Quantity, Quantity)> {
    let quantity = |object| device.quantity(signal, values.get(&object)?);
    Some((quantity(start)?, quantity(end)?))
}

/// The bit rate that the device is set to, where an object tells its code (MH-4 2321h).
pub(super) fn bit_rate(device: &Device, values: &BTreeMap<ObjectId, Value>) -> Option<u32> {
    let model = device.model()?;
    let code = values.get(&model.dictionary.find("bit-rate")?.object)?.as_u64()?;
    model.description.bit_rates.get(&u8::try_from(code).ok()?).copied()
}

/// What 1010h can do, and which settings it keeps.
pub(super) fn store(device: &Device, values: &BTreeMap<ObjectId, Value>, at: ObjectId) -> Store {
    let groups = (1..=4).filter_map(|sub| {
        let capability = values.get(&at.with_sub(sub))?.as_u64()?;
        Some((sub, u32::try_from(capability).ok()?))
    });
    let mut store = Store { groups: groups.collect(), ..Store::default() };
    let objects = device.model().map_or(&[][..], |model| &model.description.objects);
    if objects.iter().all(|entry| entry.stored.is_none()) {
        return store;
    }
    let settings = objects.iter().filter(|entry| {
        let acts = entry.signature.is_some_and(|signature| signature != Signature::Set);
        entry.access == Access::Rw && !acts && entry.at.first.index != 0x1003
    });
    // Node-ID and bit rate have a way of their own.
    let ways = device.model().map_or(&[][..], |model| &model.description.assign);
    let assigned = ways.iter().flat_map(|way| [way.node_id, way.bit_rate]).flatten().map(|place| place.object);
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

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let unit = self.unit.map(|unit| unit.to_string()).filter(|unit| !unit.is_empty());
        match unit {
            Some(unit) => write!(f, "{} {unit}", self.number),
            None => write!(f, "{}", self.number),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates() {
        let objects = [0x2007, 0x2008, 0x2009].map(|index| ObjectId::new(index, 0));
        let told = |numbers: [u64; 3]| {
            let values = objects.into_iter().zip(numbers.map(Value::Unsigned)).collect();
            date(&values, objects)
        };
        assert_eq!(told([2016, 4, 1]).as_deref(), Some("2016-04-01"));
        assert_eq!(told([16, 4, 1]).as_deref(), Some("year 16, month 4, day 1"));
        assert_eq!(date(&BTreeMap::new(), objects), None);
    }
}
