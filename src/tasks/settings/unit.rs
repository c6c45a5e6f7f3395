//! Shows or sets the physical unit of a signal (6131h, or the object in the description), and lists the objects that
//! are converted to a new unit.

use super::{SettingsFact, SettingsFailure, ValueWithUnit, find_signal, measured_quantity, read_each, set_object};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::unit::Unit;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::measure::sample::Number;
use crate::node::Node;
use crate::node::signals::{unit_and_digits, unit_object};
use crate::node::survey::narrow_values;
use crate::tasks::read::find;
use crate::tasks::{Fact, Failure, Note};

/// The unit of a signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignalUnit {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `ch1` …
    pub signal: String,
    /// The unit, read from the device.
    pub unit: Unit,
    /// The units that the device accepts, from its description; empty if unknown.
    pub takes: Vec<Unit>,
    /// Whether the unit cannot be changed.
    pub fixed: bool,
}

/// A change of the unit.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitChange {
    /// The unit before; equal to the new unit if nothing was written.
    pub before: Unit,
    /// The unit now, read back.
    pub now: SignalUnit,
    /// The objects in this unit, before and after.
    pub rescaled: Vec<Rescaled>,
    /// Further notes.
    pub notes: Vec<Note>,
}

/// An object in the unit of a signal, before and after the unit was changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Rescaled {
    /// The object.
    pub object: ObjectId,
    /// Its name.
    pub name: String,
    /// Its value in the old unit.
    pub before: Option<ValueWithUnit>,
    /// Its value in the new unit.
    pub after: Option<ValueWithUnit>,
    /// Whether the device kept the number, so that its meaning has changed.
    pub stale: bool,
}

/// How a number is converted if the unit of its signal changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::tasks) enum Scale {
    /// A measured value, which changes by itself.
    Moving,
    /// A point on the scale.
    Point,
    /// A distance on the scale.
    Distance,
}

impl Scale {
    /// A number of this kind in another unit. `None` if it changes by itself, or if the quantities differ.
    pub(in crate::tasks) fn convert(self, number: f64, from: Unit, to: Unit) -> Option<f64> {
        match self {
            Scale::Moving => None,
            Scale::Point => from.convert(number, to),
            Scale::Distance => Some(from.convert(number, to)? - from.convert(0.0, to)?),
        }
    }
}

/// The objects of CiA 404 in the unit of 6131h, as indices without the first digit.
const OBJECTS_IN_UNIT: [(u16, Scale); 10] = [
    (0x121, Scale::Point),
    (0x123, Scale::Point),
    (0x148, Scale::Point),
    (0x149, Scale::Point),
    (0x124, Scale::Distance),
    (0x130, Scale::Moving),
    (0x133, Scale::Distance),
    (0x134, Scale::Point),
    (0x135, Scale::Point),
    (0x136, Scale::Distance),
];

/// Returns the unit of one signal, or of every signal with a unit.
///
/// # Errors
/// No such signal; [`SettingsFailure::NoUnit`].
pub fn show(node: &Node, signal: Option<&str>) -> Result<Vec<SignalUnit>, Failure> {
    let signals: Vec<&Signal> = match signal {
        Some(name) => vec![find(node, name)?],
        None => node.signals.iter().filter(|signal| unit_object(node, signal).is_some()).collect(),
    };
    let units: Vec<SignalUnit> = signals.iter().filter_map(|signal| unit_of(node, signal)).collect();
    if units.is_empty() {
        return Err(Failure::at(node.id, SettingsFailure::NoUnit { signal: None }));
    }
    Ok(units)
}

fn unit_of(node: &Node, signal: &Signal) -> Option<SignalUnit> {
    let object = unit_object(node, signal);
    let allowed = object.and_then(|object| node.described(object)).map_or(&[][..], |entry| &entry.allow);
    Some(SignalUnit {
        node: node.id,
        signal: signal.name.clone(),
        unit: signal.unit?,
        takes: allowed.iter().map(|code| Unit(code.low)).collect(),
        fixed: object.is_none_or(|object| node.is_read_only(object)),
    })
}

/// Sets the unit of a signal, or of the only suitable signal. Reads back the unit and all converted objects.
///
/// # Errors
/// The device does not accept the unit (according to its description or its answer), does not answer, or keeps another
/// unit.
pub fn set(master: &mut Master<'_>, node: &mut Node, signal: Option<&str>, unit: Unit) -> Result<UnitChange, Failure> {
    let signal = choose_signal(node, signal, unit)?.clone();
    let Some(old) = unit_of(node, &signal) else {
        return Err(Failure::at(node.id, SettingsFailure::NoUnit { signal: Some(signal.name) }));
    };
    let unit = unit.beside(old.unit);
    if old.unit == unit {
        let fact = SettingsFact::AlreadyInUnit { signal: signal.name, unit };
        let notes = vec![Note::of_node(node.id, fact)];
        return Ok(UnitChange { before: unit, now: old, rescaled: Vec::new(), notes });
    }
    let object = check_accepted(node, &signal, &old, unit)?;
    let objects = in_unit(node, &signal);
    let addresses: Vec<ObjectId> = objects.iter().map(|&(object, _)| object).collect();
    let before = read_each(master, node, &addresses)?;
    set_object(master, node, object, &unit.0.to_le_bytes())?;
    let renewed = Signal { unit: Some(unit), digits: read_digits(master, node, &signal)?, ..signal.clone() };
    let after = read_each(master, node, &addresses)?;
    let mut rescaled = Vec::new();
    for (&(object, scale), (before, after)) in objects.iter().zip(before.iter().zip(&after)) {
        if before.is_none() && after.is_none() {
            continue;
        }
        let before = before.as_ref().and_then(|value| measured_quantity(node, &signal, object, value));
        let after = after.as_ref().and_then(|value| measured_quantity(node, &renewed, object, value));
        let stale = before.zip(after).is_some_and(|(before, after)| is_stale(before, after, scale));
        rescaled.push(Rescaled { object, name: node.name_of(object), before, after, stale });
    }
    let stale = rescaled.iter().filter(|item| item.stale);
    let facts = stale.map(|item| SettingsFact::NotConverted { name: item.name.clone(), now: item.after });
    let mut notes: Vec<Note> = facts.map(|fact| Note::of_node(node.id, fact)).collect();
    notes.push(Note::of_node(node.id, Fact::KeptUntilPowerOff));
    if let Some(kept) = node.signals.iter_mut().find(|kept| kept.name == signal.name) {
        *kept = renewed;
    }
    // The new unit is set, so a failure to get these warnings is ignored.
    notes.extend(Note::may_clip(node.id, narrow_values(master, node).unwrap_or_default()));
    Ok(UnitChange { before: old.unit, now: SignalUnit { unit, ..old }, rescaled, notes })
}

/// Checks that the description allows the new unit. Returns the object to write.
fn check_accepted(node: &Node, signal: &Signal, old: &SignalUnit, unit: Unit) -> Result<ObjectId, Failure> {
    let name = old.signal.clone();
    let fixed = SettingsFailure::UnitFixed { signal: name.clone(), unit: old.unit };
    let Some(object) = unit_object(node, signal) else { return Err(Failure::at(node.id, fixed)) };
    if old.fixed {
        return Err(Failure::at(node.id, fixed).of_object(object));
    }
    if !old.takes.is_empty() && !old.takes.contains(&unit) {
        let failure = SettingsFailure::UnitNotAccepted { signal: name, unit, accepted: old.takes.clone() };
        return Err(Failure::at(node.id, failure).of_object(object));
    }
    Ok(object)
}

/// Reads the decimal digits again, because they may change with the unit.
fn read_digits(master: &mut Master<'_>, node: &Node, signal: &Signal) -> Result<Option<u8>, Failure> {
    let [_, object] = unit_and_digits(node, signal);
    let value = match object.filter(|&object| node.may_have(object)) {
        Some(object) => read_each(master, node, &[object])?.pop().flatten(),
        None => None,
    };
    let digits = value.as_ref().and_then(Value::as_u64).and_then(|number| u8::try_from(number).ok());
    Ok(digits.or(signal.digits))
}

/// Formats units as a list: `bar, psi, MPa`.
pub fn list(units: &[Unit]) -> String {
    units.iter().map(Unit::to_string).collect::<Vec<_>>().join(", ")
}

/// Whether the unit of a signal and `unit` are units of the same quantity.
pub fn is_alike(signal: &Signal, unit: Unit) -> bool {
    signal.unit.is_some_and(|present| present.convert(0.0, unit.beside(present)).is_some())
}

/// Returns the signal with this name; without a name, the only signal with a unit of the same quantity.
fn choose_signal<'a>(node: &'a Node, name: Option<&str>, unit: Unit) -> Result<&'a Signal, Failure> {
    let mut alike = node.signals.iter().filter(|signal| is_alike(signal, unit));
    match (name, alike.next(), alike.next()) {
        (Some(name), ..) => find(node, name),
        (None, Some(only), None) => Ok(only),
        (None, ..) => find_signal(node, None),
    }
}

/// The objects in the unit of a signal.
pub(in crate::tasks) fn in_unit(node: &Node, signal: &Signal) -> Vec<(ObjectId, Scale)> {
    let channel = signal.channel;
    let has_description = node.model.as_ref().is_some_and(|model| !model.dictionary.is_empty());
    // Without a description, only the family of the process value is read.
    let own = signal.value_object.0.index & 0xf000;
    let families = [0x6000, 0x7000, 0x8000, 0x9000].into_iter().filter(|&family| has_description || family == own);
    let in_unit = OBJECTS_IN_UNIT.into_iter().filter(|_| signal.has_channel());
    let standard = in_unit.flat_map(move |(low, scale)| {
        families.clone().map(move |family| (ObjectId::new(family | low, channel), scale))
    });
    let other_values = signal.other_objects.iter().map(|&object| (object, Scale::Moving));
    let offset = signal.has_channel().then(|| (ObjectId::new(0x6127, channel), Scale::Distance));
    let described = node.model.as_ref().map_or(&[][..], |model| &model.description.objects).iter();
    let described = described.filter(|entry| entry.follows_unit == Some(channel));
    let described = described.flat_map(|entry| entry.objects());
    let named = ["minimum-pv", "maximum-pv"].into_iter().filter_map(|name| node.object_of(signal, name));
    let mut all: Vec<(ObjectId, Scale)> = standard
        .chain(offset)
        .chain(other_values)
        .chain(named.map(|object| (object, Scale::Moving)))
        .chain(described.map(|object| (object, Scale::Distance)))
        .filter(|&(object, _)| node.may_have(object))
        .collect();
    all.sort_by_key(|&(object, _)| object);
    all.dedup_by_key(|&mut (object, _)| object);
    all
}

/// Whether a number is unchanged, although the new unit requires another number.
fn is_stale(before: ValueWithUnit, after: ValueWithUnit, scale: Scale) -> bool {
    let (Some(from), Some(to)) = (before.unit, after.unit) else { return false };
    let (was, is) = (before.number.as_f64(), after.number.as_f64());
    let Some(expected) = scale.convert(was, from, to) else { return false };
    let step = match after.number {
        Number::Decimal { digits, .. } => 10f64.powi(-i32::from(digits)),
        Number::Real32(_) | Number::Real64(_) => 0.0,
    };
    was == is && (expected - is).abs() > step + 1e-6 * expected.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PSI: Unit = Unit(0x00ab_0000);
    const BAR: Unit = Unit(0x004e_0000);

    fn quantity(number: f64, unit: Unit) -> ValueWithUnit {
        ValueWithUnit { number: Number::Real64(number), unit: Some(unit) }
    }

    #[test]
    fn an_unconverted_number_is_noticed() {
        let stale = |was, is, scale| is_stale(quantity(was, PSI), quantity(is, BAR), scale);
        assert!(!stale(100.0, 6.894_757, Scale::Point));
        assert!(stale(100.0, 100.0, Scale::Point));
        assert!(!stale(0.0, 0.0, Scale::Point));
        assert!(!stale(100.0, 100.0, Scale::Moving));
        let (celsius, kelvin) = (Unit(0x002d_0000), Unit(0x0005_0000));
        let kept = |scale| is_stale(quantity(0.5, celsius), quantity(0.5, kelvin), scale);
        assert!(kept(Scale::Point));
        assert!(!kept(Scale::Distance), "a difference of 0.5 degC is 0.5 K");
    }
}
