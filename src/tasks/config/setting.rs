//! The settings of a device: one table, which `dump`, `diff` and `apply` use.
//!
//! A setting has a key, an object, the form of its values, and the stage in which it is written.

use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::value::DataType;
use crate::device::description::Signature;
use crate::device::dictionary::Entry;
use crate::device::{profiles, standard};
use crate::measure::layout::Signal;
use crate::node::Node;
use crate::tasks::settings::filter;
use std::collections::BTreeSet;

/// One setting of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The path in files and reports: `tpdo.1.event-timer`.
    pub key: String,
    /// The object that contains the value.
    pub object: ObjectId,
    /// The type of the object.
    pub data_type: DataType,
    /// How the values are written in a file.
    pub form: Form,
    /// The stage in which the setting is written.
    pub stage: Stage,
    /// Whether the object can be written.
    pub is_writable: bool,
}

/// How the values of a setting are written in a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// As a value of the type of the object.
    Plain,
    /// A hexadecimal integer.
    Hex,
    /// A duration; the step of the object is this many microseconds.
    Duration(u32),
    /// The unit (`"bar"`) of the signal with this index; `None` if it belongs to no signal.
    Unit(Option<usize>),
    /// A number in the unit of the signal with this index.
    Quantity(usize, Scale),
    /// A word, if the number has one.
    Words(Vec<(u64, String)>),
    /// The transmission type of a TPDO. The number is the type for the event timer.
    Transmission(u8),
    /// The identifier of a COB-ID, and its default for the node-ID.
    CobId(u16),
    /// One bit of a COB-ID; the flag is the bit value that means `true`.
    Bit(u8, bool),
    /// The mapping of a TPDO.
    Signals(TpdoNumber),
    /// The node-ID.
    NodeId,
    /// The bit rate.
    BitRate,
}

/// How a number is converted if the unit of its signal changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// A point on the scale.
    Point,
    /// A distance on the scale.
    Distance,
}

/// The order in which settings are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Settings on which all others depend: sensor type, operating mode.
    Sensor,
    /// The unit.
    Unit,
    /// The decimal digits.
    Digits,
    /// Filters.
    Filter,
    /// Limits and spans.
    Limits,
    /// All other objects, in the section `[object]`.
    Object,
    /// Values that belong to one device only.
    Calibration,
    /// Guarding, heartbeat and start-up.
    Node,
    /// A TPDO, as one transaction.
    Tpdo(TpdoNumber),
    /// COB-IDs of SYNC and emergencies.
    Service,
    /// Node-ID and bit rate.
    Address,
}

/// Objects of CiA 404 that belong to a channel: the index without its first digit, the name, and the stage.
const CHANNEL_OBJECTS: [(u16, &str, Stage); 20] = [
    (0x110, "sensor-type", Stage::Sensor),
    (0x112, "operating-mode", Stage::Sensor),
    (0x131, "unit", Stage::Unit),
    (0x132, "digits", Stage::Digits),
    (0x114, "sample-rate", Stage::Filter),
    (0x1a0, "filter", Stage::Filter),
    (0x1a1, "filter-constant", Stage::Filter),
    (0x148, "span-start", Stage::Limits),
    (0x149, "span-end", Stage::Limits),
    (0x133, "delta", Stage::Limits),
    (0x134, "lower", Stage::Limits),
    (0x135, "upper", Stage::Limits),
    (0x136, "hysteresis", Stage::Limits),
    (0x120, "scaling-1-field", Stage::Calibration),
    (0x121, "scaling-1", Stage::Calibration),
    (0x122, "scaling-2-field", Stage::Calibration),
    (0x123, "scaling-2", Stage::Calibration),
    (0x124, "offset", Stage::Calibration),
    (0x126, "scaling-factor", Stage::Calibration),
    (0x127, "scaling-offset", Stage::Calibration),
];

/// Objects of CiA 301 that a device without a description may have.
const COMMUNICATION_OBJECTS: [u16; 9] = [0x1005, 0x1006, 0x100c, 0x100d, 0x1014, 0x1015, 0x1017, 0x1019, 0x1f80];

/// Returns the settings that a node can have, in the order of a file.
pub fn settings(node: &Node) -> Vec<Setting> {
    let entries = candidates(node);
    let present: BTreeSet<ObjectId> = entries.iter().map(|entry| entry.object).collect();
    let catalog = Catalog { node, present };
    let mut all = vec![catalog.address("node-id", Form::NodeId), catalog.address("bit-rate", Form::BitRate)];
    all.extend(entries.iter().flat_map(|entry| catalog.of_entry(entry)));
    let numbers: Vec<TpdoNumber> = node.tpdos.iter().map(|tpdo| tpdo.number).collect();
    all.extend(numbers.into_iter().flat_map(|number| catalog.of_tpdo(number)));
    let mut ranked: Vec<(usize, Setting)> = all.into_iter().map(|setting| (catalog.rank(&setting), setting)).collect();
    ranked.sort_by_key(|(rank, _)| *rank);
    ranked.into_iter().map(|(_, setting)| setting).collect()
}

/// Returns the entries that may be settings: from the description or EDS, else from the standards.
fn candidates(node: &Node) -> Vec<Entry> {
    if let Some(model) = node.model.as_ref().filter(|model| !model.dictionary.is_empty()) {
        return model.dictionary.iter().cloned().collect();
    }
    let communication = COMMUNICATION_OBJECTS.iter().map(|&index| ObjectId::new(index, 0));
    let family = |signal: &Signal, low: u16| match low {
        0x110..=0x114 | 0x131 | 0x132 | 0x1a0 | 0x1a1 => ObjectId::new(0x6000 | low, signal.channel),
        _ => node.object_in_family(signal, low),
    };
    let channel = node.signals.iter().flat_map(|signal| CHANNEL_OBJECTS.map(|(low, ..)| family(signal, low)));
    let entry = |object: ObjectId| {
        standard::entry(object).or_else(|| {
            Some(Entry {
                object,
                name: object.to_string(),
                numbered: false,
                data_type: node.layout().data_type(object)?,
                access: crate::device::description::Access::Rw,
                default: None,
                low: None,
                high: None,
                pdo: false,
            })
        })
    };
    communication.chain(channel).filter_map(entry).collect()
}

struct Catalog<'a> {
    node: &'a Node,
    present: BTreeSet<ObjectId>,
}

impl Catalog<'_> {
    fn address(&self, name: &str, form: Form) -> Setting {
        let (object, data_type) = (ObjectId::new(0, 0), DataType::Unsigned(4));
        Setting { key: format!("address.{name}"), object, data_type, form, stage: Stage::Address, is_writable: true }
    }

    fn setting(&self, entry: &Entry, key: String, form: Form, stage: Stage) -> Setting {
        let data_type = self.node.known_type(entry.object).unwrap_or(DataType::OctetString);
        let is_writable = entry.access.is_writable();
        Setting { key, object: entry.object, data_type, form, stage, is_writable }
    }

    fn of_entry(&self, entry: &Entry) -> Vec<Setting> {
        if let Some((signal, name, stage)) = self.channel(entry.object) {
            let is_shown = entry.access.is_writable() || matches!(stage, Stage::Unit | Stage::Digits);
            let setting = || self.of_channel(entry, signal, name, stage);
            return if is_shown && entry.access.is_readable() { vec![setting()] } else { Vec::new() };
        }
        if !self.is_setting(entry) || self.is_in_other_family(entry.object) {
            return Vec::new();
        }
        let one = |key: &str, form: Form, stage: Stage| vec![self.setting(entry, key.to_owned(), form, stage)];
        let startup = self.node.model.as_ref().and_then(|model| model.description.startup.as_ref());
        if let Some(startup) = startup.filter(|startup| startup.object == entry.object) {
            let words = vec![(startup.wait.into(), "wait".to_owned()), (startup.auto.into(), "auto".to_owned())];
            return one("node.startup", Form::Words(words), Stage::Node);
        }
        match (entry.object.index, entry.object.sub) {
            (0x1005, 0) => vec![
                self.setting(entry, "address.sync-cob-id".to_owned(), Form::CobId(0x80), Stage::Service),
                self.setting(entry, "address.sync-producer".to_owned(), Form::Bit(30, true), Stage::Service),
            ],
            (0x1006, 0) => one("address.sync-period", Form::Duration(1), Stage::Service),
            (0x100c, 0) => one("node.guard-time", Form::Duration(1000), Stage::Node),
            (0x100d, 0) => one("node.life-time-factor", Form::Plain, Stage::Node),
            (0x1014, 0) => {
                let default = 0x80 + u16::from(self.node.id.get());
                one("node.emcy-cob-id", Form::CobId(default), Stage::Service)
            }
            (0x1015, 0) => one("node.emcy-inhibit-time", Form::Duration(100), Stage::Node),
            (0x1017, 0) => one("node.heartbeat", Form::Duration(1000), Stage::Node),
            (0x1012, 0) => one("address.time-cob-id", Form::Hex, Stage::Service),
            _ => vec![self.of_object(entry)],
        }
    }

    /// Whether an entry of the dictionary is a setting: readable, writable, and neither a command nor a process value.
    fn is_setting(&self, entry: &Entry) -> bool {
        let object = entry.object;
        let described = self.node.described(object);
        let has_signature = described.is_some_and(|entry| entry.signature.is_some());
        let methods = self.node.model.as_ref().map_or(&[][..], |model| &model.description.assign);
        let assigned = |place: Option<crate::device::assign::AssignObject>| {
            place.is_some_and(|place| place.object.index == object.index)
        };
        let is_assigned = methods.iter().any(|method| assigned(method.node_id) || assigned(method.bit_rate));
        let is_elsewhere = matches!(
            object.index,
            0x1003 | 0x1010 | 0x1011 | 0x1013 | 0x1020 | 0x1021..=0x1023 | 0x1200..=0x1bff | 0x1f50..=0x1f5f
        );
        let sets = described.and_then(|entry| entry.signature) == Some(Signature::Set);
        entry.access.is_readable()
            && entry.access.is_writable()
            && !(has_signature || sets || is_assigned || is_elsewhere || entry.pdo)
            && entry.data_type != DataType::Domain
    }

    fn of_object(&self, entry: &Entry) -> Setting {
        let described = self.node.described(entry.object);
        let follows = described.and_then(|entry| entry.follows_unit);
        let signal = follows.and_then(|channel| self.node.signals.iter().position(|signal| signal.channel == channel));
        let tick = described.and_then(|entry| entry.unit.as_deref()).and_then(tick);
        let entries = self.node.model.as_ref().map_or(&[][..], |model| &model.description.objects);
        let is_unit = entries.iter().any(|other| other.unit_at == Some(entry.object));
        let form = match (signal, tick) {
            _ if is_unit => Form::Unit(None),
            (Some(signal), _) => Form::Quantity(signal, Scale::Point),
            (None, Some(tick)) if matches!(entry.data_type, DataType::Unsigned(1..=4)) => Form::Duration(tick),
            _ => Form::Plain,
        };
        let name = entry.full_name();
        let is_unique = self.node.entry_by_name(&name).is_some_and(|found| found.object == entry.object);
        let name = if is_unique { name } else { entry.object.to_string() };
        self.setting(entry, format!("object.{name}"), form, Stage::Object)
    }

    /// Returns the signal of a CiA 404 object, with the name and stage of the setting. Returns `None` if an object of
    /// another family contains the same setting.
    fn channel(&self, object: ObjectId) -> Option<(usize, &'static str, Stage)> {
        let low = object.index & 0x0fff;
        let &(_, name, stage) = CHANNEL_OBJECTS.iter().find(|(known, ..)| *known == low)?;
        let is_404 = self.node.identity.profile().is_none_or(|profile| profile == profiles::MEASURING);
        let signal = self.node.signals.iter().position(|signal| signal.channel == object.sub)?;
        if !is_404 || !(0x6000..0xa000).contains(&object.index) {
            return None;
        }
        let own = self.node.signals[signal].value_object.0.index & 0xf000;
        let families = [own, 0x6000, 0x9000, 0x8000, 0x7000];
        let first = families.into_iter().find(|family| self.present.contains(&ObjectId::new(family | low, object.sub)));
        (first == Some(object.index & 0xf000)).then_some((signal, name, stage))
    }

    /// Whether an object of CiA 404 is the same setting as an object of another family.
    fn is_in_other_family(&self, object: ObjectId) -> bool {
        let low = object.index & 0x0fff;
        let families = [0x6000, 0x7000, 0x8000, 0x9000];
        let is_known =
            families.contains(&(object.index & 0xf000)) && CHANNEL_OBJECTS.iter().any(|(known, ..)| *known == low);
        is_known && families.iter().any(|family| self.channel(ObjectId::new(family | low, object.sub)).is_some())
    }

    fn of_channel(&self, entry: &Entry, at: usize, name: &str, stage: Stage) -> Setting {
        let signal = &self.node.signals[at];
        let autozero = self.node.model.iter().flat_map(|model| &model.description.autozero);
        let is_zero = autozero.into_iter().any(|zero| zero.offset == Some(entry.object));
        let name = if is_zero { "offset" } else { name };
        let form = match entry.object.index & 0x0fff {
            0x131 => Form::Unit(Some(at)),
            0x114 => Form::Duration(1),
            0x1a0 => Form::Words(filter_words(self.node, signal)),
            0x121 | 0x123 | 0x134 | 0x135 | 0x148 | 0x149 => Form::Quantity(at, Scale::Point),
            0x124 | 0x127 | 0x133 | 0x136 => Form::Quantity(at, Scale::Distance),
            _ => Form::Plain,
        };
        let section = if stage == Stage::Calibration { "calibration" } else { "signal" };
        self.setting(entry, format!("{section}.{}.{name}", signal.name), form, stage)
    }

    fn of_tpdo(&self, number: TpdoNumber) -> Vec<Setting> {
        let communication = |sub| number.communication(sub);
        let model = self.node.model.as_ref();
        let timer = model.and_then(|model| model.description.pdo.timer).unwrap_or(254);
        let rows = [
            ("enabled", communication(1), 4, Form::Bit(31, false)),
            ("cob-id", communication(1), 4, Form::CobId(default_id(self.node, number))),
            ("signals", number.mapping(0), 1, Form::Signals(number)),
            ("transmission", communication(2), 1, Form::Transmission(timer)),
            ("event-timer", communication(5), 2, Form::Duration(1000)),
            ("inhibit-time", communication(3), 2, Form::Duration(100)),
        ];
        let setting = |(name, object, width, form): (&str, ObjectId, u8, Form)| Setting {
            key: format!("tpdo.{}.{name}", number.get()),
            object,
            data_type: DataType::Unsigned(width),
            is_writable: !self.node.is_read_only(object),
            form,
            stage: Stage::Tpdo(number),
        };
        rows.into_iter().filter(|(_, object, ..)| self.node.may_have(*object)).map(setting).collect()
    }

    /// Returns the position of a setting in a file: by section, then within the section.
    fn rank(&self, setting: &Setting) -> usize {
        let section = setting.key.split('.').next().unwrap_or_default();
        let sections = ["address", "node", "signal", "tpdo", "object", "calibration"];
        let section = sections.iter().position(|known| *known == section).unwrap_or(sections.len());
        let channel = match section {
            2 | 5 => {
                let low = setting.object.index & 0x0fff;
                let order = CHANNEL_OBJECTS.iter().position(|(known, ..)| *known == low).unwrap_or(0);
                usize::from(setting.object.sub) * CHANNEL_OBJECTS.len() + order
            }
            _ => 0,
        };
        section * 100_000 + channel
    }
}

/// Returns the default identifier of a TPDO: from the description, else from the predefined connection set.
pub(super) fn default_id(node: &Node, number: TpdoNumber) -> u16 {
    let entry = node.model.as_ref().and_then(|model| model.dictionary.get(number.communication(1)));
    let word = entry.and_then(|entry| entry.default_bytes(node.id)).and_then(|bytes| bytes.try_into().ok());
    let described = word.map(|bytes| CobId(u32::from_le_bytes(bytes)).without_rtr() & 0x7ff);
    let predefined = match number.get() {
        number @ 1..=4 => 0x80 + 0x100 * u32::from(number) + u32::from(node.id.get()),
        _ => 0,
    };
    u16::try_from(described.unwrap_or(predefined)).unwrap_or(0)
}

/// Returns the microseconds of a unit of time.
fn tick(unit: &str) -> Option<u32> {
    match unit {
        "us" => Some(1),
        "100us" => Some(100),
        "ms" => Some(1000),
        "s" => Some(1_000_000),
        _ => None,
    }
}

/// Returns the words for filter types: the first word of each meaning, if no other filter type has it.
fn filter_words(node: &Node, signal: &Signal) -> Vec<(u64, String)> {
    let described = node.described(ObjectId::new(0x61a0, signal.channel)).map(|entry| &entry.values);
    let codes: Vec<u64> = match described.filter(|values| !values.is_empty()) {
        Some(values) => values.keys().copied().collect(),
        None => (0..=4).collect(),
    };
    let word = |code: &u64| {
        let meaning = filter::meaning(node, signal, *code);
        meaning.split_whitespace().next().unwrap_or_default().to_lowercase()
    };
    let words: Vec<(u64, String)> = codes.iter().map(|code| (*code, word(code))).collect();
    let is_unique = |word: &String| words.iter().filter(|(_, other)| other == word).count() == 1;
    words.iter().filter(|(_, word)| is_unique(word)).cloned().collect()
}
