//! The signals of a node: from its description, the channels of CiA 404, the measured values of its profile, or the
//! contents of its TPDOs.

use super::Node;
use crate::canopen::object::ObjectId;
use crate::device::description::SignalEntry;
use crate::device::profiles::{self, Measured, Step};
use crate::device::scale::{Decimal, Scale};
use crate::device::unit::Unit;
use crate::measure::layout::{MeasuringRange, Rules, Scaling, Signal, is_channel};

/// Creates a signal from the description. Unit and digits in the device are not read yet.
pub(crate) fn described(node: &Node, entry: &SignalEntry) -> Signal {
    let has_digits = entry.digits.is_some() || entry.unit.is_some() || is_channel(entry.channel);
    let default_scaling = if has_digits { Scaling::Digits } else { Scaling::Plain };
    let scaling = entry.scale.map_or(default_scaling, Scaling::Fixed);
    let mut rules = Rules { scaling, markers: entry.markers.clone(), ..Rules::default() };
    if let Some(bits) = &entry.status_bits {
        rules.status_bits = bits.clone();
    }
    Signal {
        name: entry.name.clone(),
        channel: entry.channel,
        value_object: (entry.value, entry.data_type.or(node.layout().data_type(entry.value))),
        other_objects: entry.also.clone(),
        status: entry.status,
        has_marker: entry.marker,
        unit: entry.fixed_unit,
        digits: None,
        lacks_scale: false,
        rules,
        range: if entry.may_clip { MeasuringRange::MayClip } else { MeasuringRange::Unknown },
    }
}

/// Creates a signal for a CiA 404 channel of a device without a description. Unit and digits are not read yet.
pub(crate) fn channel(node: &Node, value: ObjectId) -> Signal {
    let mut signal = plain(node, value);
    (signal.name, signal.channel) = (format!("ch{}", value.sub), value.sub);
    (signal.status, signal.rules) = (Some(ObjectId::new(0x6150, value.sub)), Rules::default());
    signal
}

/// Creates a signal without scaling: an object of a profile, or the contents of a TPDO.
fn plain(node: &Node, object: ObjectId) -> Signal {
    let layout = node.layout();
    Signal {
        name: layout.name_of(object),
        channel: 0,
        value_object: (object, layout.data_type(object)),
        other_objects: Vec::new(),
        status: None,
        has_marker: false,
        unit: layout.unit_of(object),
        digits: None,
        lacks_scale: false,
        rules: Rules::plain(),
        range: MeasuringRange::Unknown,
    }
}

/// Creates the signals of a device without channels of CiA 404: `measured` objects of its profile, then all other
/// objects in its valid TPDOs.
pub(crate) fn objects(node: &Node, measured: impl IntoIterator<Item = ObjectId>) -> Vec<Signal> {
    let valid = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
    let mapped = valid.flat_map(|tpdo| &tpdo.mapping).map(|entry| entry.object).filter(|object| object.index >= 0x20);
    let mut signals: Vec<Signal> = Vec::new();
    for object in measured.into_iter().chain(mapped) {
        if !signals.iter().any(|signal| signal.value_object.0 == object) {
            signals.push(plain(node, object));
        }
    }
    signals
}

/// Whether a device can have channels of CiA 404: the other profiles use these objects for other purposes.
pub(crate) fn can_have_channels(node: &Node) -> bool {
    !matches!(
        node.identity.profile(),
        Some(profiles::GENERIC_IO | profiles::DRIVES | profiles::ENCODER | profiles::INCLINOMETER)
    )
}

/// Returns the measured values of the profile of a node, each with the object that shows whether the device has the
/// value: the count of an array, else the value itself.
pub(crate) fn profile_values(node: &Node) -> impl Iterator<Item = (Measured, ObjectId)> + use<> {
    let measured = node.identity.profile().map_or(&[][..], profiles::measured);
    let shown = node.model.clone().filter(|model| !model.dictionary.is_empty());
    let known = move |row: &Measured| shown.as_ref().is_none_or(|model| model.dictionary.has_index(row.index));
    measured.iter().copied().filter(known).map(|row| (row, ObjectId::new(row.index, 0)))
}

/// Returns the objects of a measured value. `number` is the value of the object from [`profile_values`].
pub(crate) fn values_of(row: Measured, number: Option<u64>) -> Vec<ObjectId> {
    let count = match (row.is_array, number) {
        (_, None) => return Vec::new(),
        (false, Some(_)) => return vec![ObjectId::new(row.index, 0)],
        (true, Some(count)) => u8::try_from(count).unwrap_or(254).min(254),
    };
    (1..=count).map(|sub| ObjectId::new(row.index, sub)).collect()
}

/// Returns the step of a signal of a profile; `None` if the description states another unit or factor.
pub(crate) fn step(node: &Node, signal: &Signal) -> Option<Step> {
    let is_plain = !signal.has_channel() && signal.rules.scaling == Scaling::Plain;
    let step = profiles::step(node.identity.device_type?, signal.value_object.0).filter(|_| is_plain)?;
    (signal.unit.is_none() || signal.unit == Unit::from_symbol(step.unit)).then_some(step)
}

/// Scales a signal by its step. `number` is the value of the step object, if the device has one.
pub(crate) fn set_step(signal: &mut Signal, step: Step, number: Option<u64>) {
    let Some(factor) = number.and_then(|number| i64::try_from(number).ok()).filter(|&number| number > 0) else {
        return;
    };
    let factor = Decimal::new(factor, step.digits);
    signal.rules.scaling = Scaling::Fixed(Scale { factor, offset: Decimal::ZERO });
    signal.unit = Unit::from_symbol(step.unit);
}

/// Returns the objects that unit and scaling of the signals depend on.
pub(crate) fn scaling_objects(node: &Node) -> Vec<ObjectId> {
    let of_signal = |signal: &Signal| {
        let step = node.identity.device_type.and_then(|device_type| profiles::step(device_type, signal.value_object.0));
        let [unit, digits] = unit_and_digits(node, signal);
        [unit, digits, step.map(|step| step.object)]
    };
    node.signals.iter().flat_map(of_signal).flatten().collect()
}

/// The objects with unit and digits of a signal. A description can name other objects than 6131h and 6132h.
pub(crate) fn unit_and_digits(node: &Node, signal: &Signal) -> [Option<ObjectId>; 2] {
    let of_channel = signal.has_channel().then(|| ObjectId::new(0x6132, signal.channel));
    let digits = entry(node, signal).and_then(|entry| entry.digits).or(of_channel);
    [unit_object(node, signal), digits.filter(|_| signal.rules.scaling == Scaling::Digits)]
}

/// Returns the object with the unit code of a signal: from its description, else 6131h of its channel. `None` if the
/// unit is fixed.
pub(crate) fn unit_object(node: &Node, signal: &Signal) -> Option<ObjectId> {
    let entry = entry(node, signal);
    let is_fixed = entry.is_some_and(|entry| entry.fixed_unit.is_some())
        || node.fixed_unit(signal.value_object.0).is_some()
        || !signal.has_channel();
    let of_channel = (!is_fixed).then(|| ObjectId::new(0x6131, signal.channel));
    entry.and_then(|entry| entry.unit).or(of_channel)
}

/// Finds the signal in the description of the node.
fn entry<'a>(node: &'a Node, signal: &Signal) -> Option<&'a SignalEntry> {
    let described = node.model.as_ref()?.description.signals.iter();
    described.into_iter().find(|entry| entry.name == signal.name && entry.value == signal.value_object.0)
}
