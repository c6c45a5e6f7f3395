//! The facts about a node for decoding: its signals and the layout of its TPDOs.

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber, Transmission};
use crate::canopen::value::{DataType, Value};
use crate::device::catalog::Model;
use crate::device::dictionary::spellings;
use crate::device::scale::{Markers, Scale, StatusBits};
use crate::device::unit::Unit;
use crate::device::{profiles, standard};
use crate::measure::sample::Number;

/// One measured signal of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// `pressure`, `temperature`, `ch1` …
    pub name: String,
    /// The CiA 404 channel, 1 to 199; any other number means none.
    pub channel: u8,
    /// The object that holds the process value, and its type; `None` if no source states the type.
    pub value_object: (ObjectId, Option<DataType>),
    /// Other objects that hold the same process value.
    pub other_objects: Vec<ObjectId>,
    /// The status object (6150h), if the node has one.
    pub status: Option<ObjectId>,
    /// Whether the smallest value of the type marks an overload.
    pub has_marker: bool,
    /// The physical unit (6131h); `None` if it is unknown.
    pub unit: Option<Unit>,
    /// The decimal digits (6132h); `None` if they are unknown.
    pub digits: Option<u8>,
    /// Whether the decimal digits or the resolution of the signal could not be read. Integers then cannot be scaled.
    pub lacks_scale: bool,
    /// Scaling and status of a signal that does not follow CiA 404.
    pub rules: Rules,
    /// The measuring range of the device.
    pub range: MeasuringRange,
}

/// How the number in an object becomes the value of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scaling {
    /// An integer has the decimal digits of its channel (CiA 404).
    #[default]
    Digits,
    /// The number is the value.
    Plain,
    /// The number is scaled by factor and offset.
    Fixed(Scale),
}

/// Scaling and status of a signal, if they differ from CiA 404.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rules {
    /// The scaling from the number to the value.
    pub scaling: Scaling,
    /// The bits of the status object.
    pub status_bits: StatusBits,
    /// Numbers that the device sends instead of the value.
    pub markers: Markers,
}

impl Default for Rules {
    fn default() -> Rules {
        Rules { scaling: Scaling::Digits, status_bits: StatusBits::CIA_404, markers: Markers::default() }
    }
}

impl Rules {
    /// The rules for a value without factor, offset and decimal digits.
    pub fn plain() -> Rules {
        Rules { scaling: Scaling::Plain, ..Rules::default() }
    }
}

/// The measuring range of a signal, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MeasuringRange {
    /// The range is unknown.
    #[default]
    Unknown,
    /// The limits are unknown, and the manual warns that integers of 8, 16 or 24 bits may be clipped.
    MayClip,
    /// The start and the end (6148h, 6149h), in the unit of the signal.
    Known(f64, f64),
}

impl Signal {
    /// Whether the device reports a status, by a status object or by a marker.
    pub fn has_status(&self) -> bool {
        self.status.is_some() || self.has_marker
    }

    /// Whether `object` holds the process value of this signal.
    ///
    /// True for the objects in the description of the signal. Also true for 6130h (REAL32), 7130h (INTEGER16), 8130h
    /// (INTEGER24) and 9130h (INTEGER32) with the channel as sub-index.
    pub fn is_value(&self, object: ObjectId) -> bool {
        object == self.value_object.0
            || self.other_objects.contains(&object)
            || self.has_channel()
                && object.sub == self.channel
                && PROCESS_VALUES.iter().any(|&(index, _)| index == object.index)
    }

    /// Scales a number: an integer has the decimal digits of the signal. `None` for text, and for an integer whose
    /// scale is unknown.
    pub fn number(&self, value: &Value) -> Option<Number> {
        let is_integer = matches!(value, Value::Integer(_) | Value::Unsigned(_));
        Number::from_value(value, self.digits.unwrap_or(0)).filter(|_| !(is_integer && self.lacks_scale))
    }

    /// Whether the signal is a CiA 404 channel.
    pub fn has_channel(&self) -> bool {
        is_channel(self.channel)
    }
}

/// Whether this is the number of a CiA 404 channel.
pub fn is_channel(number: u8) -> bool {
    (1..=199).contains(&number)
}

/// The process value objects of CiA 404 with the types that the standard gives them, the most precise first.
pub const PROCESS_VALUES: [(u16, DataType); 4] = [
    (0x6130, DataType::Real32),
    (0x9130, DataType::Integer(4)),
    (0x8130, DataType::Integer(3)),
    (0x7130, DataType::Integer(2)),
];

/// Parts of a signal with their own object (`pressure.net`): the name, and the lower three digits of the index.
pub const PARTS: [(&str, u16); 2] = [("field", 0x100), ("net", NET)];

/// The lower three digits of the index of a net value (6140h, 7140h, 8140h, 9140h).
const NET: u16 = 0x140;

/// The parameters and the mapping of a TPDO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tpdo {
    /// The number of the TPDO.
    pub number: TpdoNumber,
    /// The COB-ID (180xh:1).
    pub cob_id: CobId,
    /// The transmission type (180xh:2).
    pub transmission: Option<Transmission>,
    /// The event timer (180xh:5) in milliseconds.
    pub event_timer_ms: Option<u16>,
    /// The mapping (1Axxh).
    pub mapping: Vec<MappingEntry>,
}

/// Signals and TPDOs of one node, as far as decoding needs them.
#[derive(Clone, Copy, Debug)]
pub struct Layout<'a> {
    /// The node-ID.
    pub node: NodeId,
    /// The device profile, the lower word of 1000h; `None` if it is unknown.
    pub profile: Option<u32>,
    /// The device description, if the node was recognised or the user chose a description.
    pub model: Option<&'a Model>,
    /// The signals.
    pub signals: &'a [Signal],
    /// The TPDOs.
    pub tpdos: &'a [Tpdo],
}

impl Layout<'_> {
    /// Returns the type of an object: from the description or EDS file, else from the device profile, else from the
    /// standard. `None` if no source states it.
    pub fn data_type(&self, object: ObjectId) -> Option<DataType> {
        let described = self.model.and_then(|model| {
            let is_untyped = model.untyped.contains(&object);
            model.dictionary.get(object).filter(|_| !is_untyped).map(|entry| entry.data_type)
        });
        let of_profile = || self.profile.and_then(|profile| profiles::data_type(profile, object));
        let described = described.or_else(|| self.type_of_signal(object));
        let standard = || standard::entry(object).map(|entry| entry.data_type);
        described.or_else(of_profile).or_else(standard)
    }

    /// Returns the type that the description states for the value of a signal outside of CiA 404.
    fn type_of_signal(&self, object: ObjectId) -> Option<DataType> {
        let mut own = self.signals.iter().filter(|signal| !signal.has_channel());
        own.find(|signal| signal.value_object.0 == object)?.value_object.1
    }

    /// Returns the name of an object in the description, the EDS, the profile or the standard; else its address.
    pub fn name_of(&self, object: ObjectId) -> String {
        let described = self.model.and_then(|model| model.dictionary.get(object)).map(|entry| entry.full_name());
        let of_profile = || self.profile.and_then(|profile| profiles::name(profile, object));
        let standard = || standard::entry(object).map(|entry| entry.full_name());
        described.or_else(of_profile).or_else(standard).unwrap_or_else(|| object.to_string())
    }

    /// Finds the object with this name, in the form of [`Layout::name_of`] or of an EDS. Letter case is ignored.
    pub fn object(&self, name: &str) -> Option<ObjectId> {
        let described = self.model.and_then(|model| model.dictionary.find(name)).map(|entry| entry.object);
        let of_profile = |name: &str| profiles::find(self.profile?, name);
        let standard = |name: &str| standard::find(name).map(|entry| entry.object);
        let known = |name: &str| of_profile(name).or_else(|| standard(name));
        described.or_else(|| known(name)).or_else(|| spellings(name).iter().find_map(|name| known(name)))
    }

    /// Finds an object of a signal; `family_offset` is the index without its first digit. The family of the process
    /// value (6xxxh to 9xxxh) is searched first.
    pub fn find_in_family(&self, signal: &Signal, family_offset: u16) -> Option<ObjectId> {
        let own = signal.value_object.0.index & 0xf000;
        let families =
            [own, 0x6000, 0x9000, 0x8000, 0x7000].into_iter().filter(|family| (0x6000..=0x9000).contains(family));
        let mut objects = families.map(|family| ObjectId::new(family | family_offset, signal.channel));
        let known = self.model.map(|model| &model.dictionary).filter(|dictionary| !dictionary.is_empty());
        objects.find(|object| signal.has_channel() && known.is_none_or(|known| known.get(*object).is_some()))
    }

    /// Returns the object of a part of a signal: `pressure.field` (x100h), `pressure.net` (x140h).
    pub fn part(&self, name: &str) -> Option<ObjectId> {
        let (signal, part) = name.rsplit_once('.')?;
        let (_, family_offset) = PARTS.into_iter().find(|(known, _)| *known == part)?;
        self.find_in_family(self.signals.iter().find(|known| known.name == signal)?, family_offset)
    }

    /// Returns the unit of an object: the unit of its channel, else the fixed unit in the description.
    pub fn unit_of(&self, object: ObjectId) -> Option<Unit> {
        let fixed = || self.model?.description.object(object)?.unit.as_deref().and_then(Unit::from_symbol);
        let of_value = |signal: &&Signal| !signal.is_value(object) || signal.rules.scaling == Scaling::Digits;
        let signal = self.value_signal(object).or_else(|| self.signal_of(object)).filter(of_value);
        signal.and_then(|signal| signal.unit).or_else(fixed)
    }

    /// The type of a mapped object of `bits` bits. `None` if no source states it, or if the type has another width.
    pub fn mapped_type(&self, object: ObjectId, bits: u8) -> Option<DataType> {
        self.data_type(object).filter(|data_type| fits(*data_type, bits))
    }

    /// Returns the signal whose process value is in this object, in any of its types.
    pub fn value_signal(&self, object: ObjectId) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.is_value(object))
    }

    /// Returns the signal of a process value or net value that the user requested by its address. `None` for a signal
    /// with a fixed factor: its values are shown as sent.
    pub fn measured_signal(&self, object: ObjectId) -> Option<&Signal> {
        let is_net = object.index & 0xfff == NET;
        let signal = self.value_signal(object).or_else(|| self.signal_of(object).filter(|_| is_net))?;
        (signal.rules.scaling == Scaling::Digits).then_some(signal)
    }

    /// Returns the signal of a CiA 404 process value. The object has the unit and decimal digits of this signal.
    pub fn signal_of(&self, object: ObjectId) -> Option<&Signal> {
        let is_process_value = profiles::meaning(object) == Some(profiles::Meaning::Process);
        let is_404 = self.profile == Some(profiles::MEASURING) && is_process_value;
        self.signals.iter().find(|signal| is_404 && signal.channel == object.sub && object.sub > 0)
    }
}

/// A signal that is sent as an integer of at most 24 bits, whose limits are smaller than the measuring range.
#[derive(Clone, Debug, PartialEq)]
pub struct NarrowValue {
    /// The signal.
    pub signal: String,
    /// The object that contains the signal.
    pub object: ObjectId,
    /// The largest value of its type, in the unit of the signal.
    pub largest: f64,
    /// The unit.
    pub unit: Option<Unit>,
    /// The end of the measuring range that is farther from zero; `None` if it is unknown.
    pub range_end: Option<f64>,
}

impl Layout<'_> {
    /// Signals whose values in valid TPDOs may be clipped.
    pub fn narrow_values(&self) -> Vec<NarrowValue> {
        let valid = self.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
        let entries = valid.flat_map(|tpdo| &tpdo.mapping);
        let narrow = entries.filter_map(|entry| {
            let signal = self.signals.iter().find(|signal| signal.is_value(entry.object))?;
            signal.narrow_value(entry.object, self.mapped_type(entry.object, entry.bits)?)
        });
        narrow.collect()
    }
}

impl Signal {
    /// Returns the details if the limits of this type are smaller than the measuring range.
    pub fn narrow_value(&self, object: ObjectId, data_type: DataType) -> Option<NarrowValue> {
        let DataType::Integer(width @ 1..=3) = data_type else { return None };
        let digits = self.digits.unwrap_or(0).min(9);
        let largest = ((1i64 << (8 * u32::from(width) - 1)) - 1) as f64 / 10f64.powi(i32::from(digits));
        let range_end = match self.range {
            _ if self.rules.scaling != Scaling::Digits => return None,
            MeasuringRange::Unknown => return None,
            MeasuringRange::MayClip => None,
            MeasuringRange::Known(start, end) => Some(if start.abs() > end.abs() { start } else { end }),
        };
        let is_narrow = range_end.is_none_or(|end| end.abs() > largest);
        let (signal, unit) = (self.name.clone(), self.unit);
        is_narrow.then_some(NarrowValue { signal, object, largest, unit, range_end })
    }
}

/// Whether a mapped field of `bits` bits holds a value of this type. Boolean and unsigned fields may be up to 7 bits
/// shorter.
pub fn fits(data_type: DataType, bits: u8) -> bool {
    let width = data_type.width().map(|width| 8 * width);
    match data_type {
        DataType::Boolean | DataType::Unsigned(_) => {
            width.is_some_and(|width| (width - 7..=width).contains(&usize::from(bits)))
        }
        _ => width == Some(usize::from(bits)),
    }
}
