//! The physical unit of a signal (6131h), and what a new one rescales.

use super::{Device, Quantity};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::unit::Unit;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::measure::sample::Number;
use crate::tasks::{Failure, Kind};

/// The unit of a signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitOf {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `ch1` …
    pub signal: String,
    /// As the device tells it.
    pub unit: Unit,
    /// What the device takes, where its description says.
    pub takes: Vec<Unit>,
    /// Whether it cannot be changed.
    pub fixed: bool,
}

/// A unit that was set.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitChange {
    /// The unit before; the same as the new one where nothing had to be done.
    pub before: Unit,
    /// The unit now, read back.
    pub now: UnitOf,
    /// What is kept in this unit, before and after.
    pub rescaled: Vec<Rescaled>,
}

/// An object in the unit of a signal, before and after the unit was changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Rescaled {
    /// Which one.
    pub object: ObjectId,
    /// Its name.
    pub name: String,
    /// Its value in the old unit.
    pub before: Option<Quantity>,
    /// Its value in the new unit.
    pub after: Option<Quantity>,
    /// The device left the number as it was, though it means something else now.
    pub stale: bool,
}

/// How a number in the unit of a signal changes with the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scale {
    /// The measured value, which moves by itself.
    Moving,
    /// A point on the scale.
    Point,
    /// A distance on the scale.
    Distance,
}

/// What CiA 404 keeps in the unit of 6131h, as indices without the first digit.
const IN_UNIT: [(u16, Scale); 10] = [
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

/// The units of the signals asked for.
///
/// # Errors
/// Signals that the device has not, and devices that tell no unit.
pub fn show(device: &Device, signal: Option<&str>) -> Result<Vec<UnitOf>, Failure> {
    let signals: Vec<&Signal> = match signal {
        Some(name) => vec![device.signal(Some(name))?],
        None => device.instrument.signals.iter().collect(),
    };
    let told: Vec<UnitOf> = signals.iter().filter_map(|signal| unit_of(device, signal)).collect();
    if told.is_empty() {
        return Err(Failure::of_node(Kind::Unexpected, device.node(), "it tells no unit (6131h)"));
    }
    Ok(told)
}

fn unit_of(device: &Device, signal: &Signal) -> Option<UnitOf> {
    let object = ObjectId::new(0x6131, signal.channel);
    let allowed = device.described(object).map_or(&[][..], |entry| &entry.allow);
    Some(UnitOf {
        node: device.node(),
        signal: signal.name.clone(),
        unit: signal.unit?,
        takes: allowed.iter().map(|code| Unit(code.low)).collect(),
        fixed: device.is_fixed(object),
    })
}

/// Sets the unit of a signal, or of the only one that can have it; reads it back, and everything that it
/// rescales.
///
/// # Errors
/// Units that the device does not take by its description, refusals, silence, and a device that keeps
/// another one.
pub fn set(
    master: &mut Master<'_>,
    device: &mut Device,
    signal: Option<&str>,
    unit: Unit,
) -> Result<UnitChange, Failure> {
    let signal = choose(device, signal, unit)?.clone();
    let node = device.node();
    let object = ObjectId::new(0x6131, signal.channel);
    let Some(old) = unit_of(device, &signal) else {
        let message = format!("{} tells no unit (6131h)", signal.name);
        return Err(Failure::of_node(Kind::Unexpected, node, message));
    };
    if old.unit == unit {
        return Ok(UnitChange { before: unit, now: old, rescaled: Vec::new() });
    }
    let refused = |message: String| Failure { object: Some(object), ..Failure::of_node(Kind::Usage, node, message) };
    if old.fixed {
        return Err(refused(format!("{} is in {}, and this device cannot change it", signal.name, old.unit)));
    }
    if !old.takes.is_empty() && !old.takes.contains(&unit) {
        let failure = refused(format!("{} takes {}, not {unit}", signal.name, list(&old.takes)));
        let swapped = Unit(unit.0.swap_bytes());
        let turned = old.takes.contains(&swapped).then(|| {
            format!("0x{:08X} is {swapped} in the order of the bytes on the bus: 0x{:08X}", unit.0, swapped.0)
        });
        return Err(match turned {
            Some(hint) => failure.hint(hint),
            None => failure,
        });
    }
    let objects = in_unit(device, &signal);
    let addresses: Vec<ObjectId> = objects.iter().map(|&(object, _)| object).collect();
    let before = device.read_each(master, &addresses)?;
    device.set(master, object, &unit.0.to_le_bytes())?;
    // The digits may follow the unit.
    let digits = ObjectId::new(0x6132, signal.channel);
    let told = if device.may_have(digits) { device.read_each(master, &[digits])?.pop().flatten() } else { None };
    let mut renewed = Signal { unit: Some(unit), ..signal.clone() };
    renewed.digits =
        told.as_ref().and_then(Value::as_u64).and_then(|number| u8::try_from(number).ok()).or(signal.digits);
    let after = device.read_each(master, &addresses)?;
    let rescaled = objects
        .iter()
        .zip(before.iter().zip(&after))
        .filter(|(_, (before, after))| before.is_some() || after.is_some())
        .map(|(&(object, scale), (before, after))| {
            let before = before.as_ref().and_then(|value| device.measured(&signal, object, value));
            let after = after.as_ref().and_then(|value| device.measured(&renewed, object, value));
            let stale = before.zip(after).is_some_and(|(before, after)| is_stale(before, after, scale));
            let name = device.name(object);
            Rescaled { object, name, before, after, stale }
        })
        .collect();
    if let Some(kept) = device.instrument.signals.iter_mut().find(|kept| kept.name == signal.name) {
        *kept = renewed;
    }
    Ok(UnitChange { before: old.unit, now: UnitOf { unit, ..old }, rescaled })
}

/// `bar, psi, MPa`.
pub fn list(units: &[Unit]) -> String {
    units.iter().map(Unit::to_string).collect::<Vec<_>>().join(", ")
}

/// The signal named, or the only one that is in a unit of the same quantity.
fn choose<'a>(device: &'a Device, name: Option<&str>, unit: Unit) -> Result<&'a Signal, Failure> {
    if name.is_none() {
        let like = |signal: &&Signal| signal.unit.is_some_and(|present| present.convert(0.0, unit).is_some());
        let mut alike = device.instrument.signals.iter().filter(like);
        if let (Some(only), None) = (alike.next(), alike.next()) {
            return Ok(only);
        }
    }
    device.signal(name)
}

/// What a device keeps in the unit of a signal.
fn in_unit(device: &Device, signal: &Signal) -> Vec<(ObjectId, Scale)> {
    let channel = signal.channel;
    let has_description = device.model().is_some_and(|model| !model.dictionary.is_empty());
    // Of a device that nothing describes only the family that it measures in is asked for.
    let own = signal.value.0.index & 0xf000;
    let families = [0x6000, 0x7000, 0x8000, 0x9000].into_iter().filter(|&family| has_description || family == own);
    let standard = IN_UNIT.into_iter().flat_map(move |(low, scale)| {
        families.clone().map(move |family| (ObjectId::new(family | low, channel), scale))
    });
    let also = signal.also.iter().map(|&object| (object, Scale::Moving));
    let offset = std::iter::once((ObjectId::new(0x6127, channel), Scale::Distance));
    let described = device.model().map_or(&[][..], |model| &model.description.objects).iter();
    let described = described.filter(|entry| entry.follows_unit == Some(channel));
    let described = described.flat_map(|entry| entry.objects());
    let named = ["minimum-pv", "maximum-pv"].into_iter().filter_map(|name| device.of_signal(signal, name));
    let mut all: Vec<(ObjectId, Scale)> = standard
        .chain(offset)
        .chain(also)
        .chain(named.map(|object| (object, Scale::Moving)))
        .chain(described.map(|object| (object, Scale::Distance)))
        .filter(|&(object, _)| device.may_have(object))
        .collect();
    all.sort_by_key(|&(object, _)| object);
    all.dedup_by_key(|&mut (object, _)| object);
    all
}

/// Whether a number stayed what it was where the new unit makes another one of it.
fn is_stale(before: Quantity, after: Quantity, scale: Scale) -> bool {
    let (Some(from), Some(to)) = (before.unit, after.unit) else { return false };
    let (was, is) = (before.number.as_f64(), after.number.as_f64());
    let Some((point, zero)) = from.convert(was, to).zip(from.convert(0.0, to)) else { return false };
    let expected = match scale {
        Scale::Moving => return false,
        Scale::Point => point,
        Scale::Distance => point - zero,
    };
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

    fn quantity(number: f64, unit: Unit) -> Quantity {
        Quantity { number: Number::Real64(number), unit: Some(unit) }
    }

    #[test]
    fn a_number_that_stayed_is_noticed() {
        let stale = |was, is, scale| is_stale(quantity(was, PSI), quantity(is, BAR), scale);
        assert!(!stale(100.0, 6.894_757, Scale::Point));
        assert!(stale(100.0, 100.0, Scale::Point));
        assert!(!stale(0.0, 0.0, Scale::Point));
        assert!(!stale(100.0, 100.0, Scale::Moving));
        let (celsius, kelvin) = (Unit(0x002d_0000), Unit(0x0005_0000));
        let kept = |scale| is_stale(quantity(0.5, celsius), quantity(0.5, kelvin), scale);
        assert!(kept(Scale::Point));
        assert!(!kept(Scale::Distance), "a difference of 0.5 degC is one of 0.5 K");
    }
}
