//! A requested change of a TPDO, and the resulting settings.

use super::failure::{Parameter, PdoFact, PdoFailure};
use super::session::Session;
use super::settings::Settings;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{MappingEntry, TpdoNumber};
use crate::canopen::value::DataType;
use crate::device::standard;
use crate::master::Request;
use crate::measure::layout::{PROCESS_VALUES, Signal};
use crate::node::Node;
use crate::node::names::nearest;
use crate::tasks::read::ReadFailure;
use crate::tasks::{Failure, Note};
use std::str::FromStr;

/// The transmission type for the event timer, unless the description states another type.
const TIMER_TRANSMISSION: u8 = 254;

/// The data bits of a classic CAN frame.
const MAX_BITS: u32 = 64;

/// A signal or an object to map, with its number of bits if the user gave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Item {
    /// `0x9130:1/32`.
    Object(ObjectId, Option<u8>),
    /// `pressure`, `pressure.status`, `ai-input-pv:1`.
    Name(String, Option<u8>),
}

/// The trigger of the TPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// A transmission type (180xh:2).
    Code(u8),
    /// The transmission type that the device uses for the event timer.
    Timer,
}

/// A requested change of a TPDO. A setting that is `None` is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PdoRequest {
    /// The node.
    pub node: NodeId,
    /// The TPDO.
    pub number: TpdoNumber,
    /// The new mapping; empty to keep the mapping.
    pub items: Vec<Item>,
    /// The trigger of the TPDO.
    pub trigger: Option<Trigger>,
    /// The event timer (180xh:5) in ms.
    pub event_timer_ms: Option<u16>,
    /// The inhibit time (180xh:3) in 100 µs.
    pub inhibit_100us: Option<u16>,
    /// The CAN identifier, 11 bits.
    pub cob_id: Option<u16>,
}

impl PdoRequest {
    /// Checks the identifier, and the length if the items contain their number of bits. Needs no bus.
    ///
    /// # Errors
    /// [`PdoFailure::TooLong`], [`PdoFailure::Restricted`].
    pub fn check(&self) -> Result<(), Failure> {
        let bits = |item: &Item| match item {
            Item::Object(_, bits) | Item::Name(_, bits) => bits.map_or(0, u32::from),
        };
        check_length(self.node, self.items.iter().map(bits).sum())?;
        match self.cob_id.and_then(CanId::standard) {
            Some(id) if id.is_restricted() => Err(Failure::general(PdoFailure::Restricted { id })),
            _ => Ok(()),
        }
    }

    /// Returns the requested mapping (`None` keeps the mapping), and notes about it.
    ///
    /// # Errors
    /// Unknown names, objects of unknown width, more than 64 bits.
    pub(super) fn mapping(
        &self,
        session: &mut Session<'_, '_>,
    ) -> Result<(Option<Vec<MappingEntry>>, Vec<Note>), Failure> {
        let (mut entries, mut notes) = (Vec::new(), Vec::new());
        let node = session.node;
        for item in &self.items {
            let (object, bits) = match item {
                Item::Object(object, bits) => (*object, *bits),
                Item::Name(name, bits) => (object_by_name(node, name)?, *bits),
            };
            let bits = match bits.or_else(|| width(node, object)) {
                Some(bits) => bits,
                None => read_width(session, object)?,
            };
            let known = node.model.as_ref().and_then(|model| model.dictionary.get(object));
            let is_mapped = node.tpdos.iter().flat_map(|tpdo| &tpdo.mapping).any(|entry| entry.object == object);
            if known.is_some_and(|entry| !entry.pdo) && !is_mapped {
                notes.push(Note::of_node(self.node, PdoFact::MaybeNotMappable { object }));
            }
            entries.push(MappingEntry { object, bits });
        }
        check_length(self.node, entries.iter().map(|entry| u32::from(entry.bits)).sum())?;
        Ok((Some(entries).filter(|entries| !entries.is_empty()), notes))
    }

    /// Returns the requested settings. A new mapping or identifier switches the TPDO on.
    ///
    /// # Errors
    /// [`PdoFailure::NoParameter`], [`PdoFailure::NoIdentifier`].
    pub(super) fn settings(
        &self,
        old: &Settings,
        mapping: Option<Vec<MappingEntry>>,
        node: &Node,
    ) -> Result<Settings, Failure> {
        let mut wanted = old.clone();
        if mapping.is_some() || self.cob_id.is_some() {
            wanted.cob_id = wanted.cob_id.switched_on();
        }
        if let Some(id) = self.cob_id {
            wanted.cob_id = wanted.cob_id.with_standard(id.into()).unwrap_or(wanted.cob_id);
        }
        let id = wanted.cob_id.can_id();
        if wanted.cob_id.is_valid() && !old.cob_id.is_valid() && id.is_restricted() {
            return Err(Failure::at(self.node, PdoFailure::NoIdentifier { number: old.number, id }));
        }
        wanted.mapping = mapping.unwrap_or(wanted.mapping);
        if let Some(trigger) = self.trigger {
            let timer = node.model.as_ref().and_then(|model| model.description.pdo.timer);
            wanted.transmission = match trigger {
                Trigger::Code(code) => code,
                Trigger::Timer => timer.unwrap_or(TIMER_TRANSMISSION),
            };
        }
        let missing = |parameter: Parameter| {
            let cause = PdoFailure::NoParameter { number: old.number, parameter };
            Failure::at(self.node, cause).of_object(parameter.object(old.number))
        };
        if let Some(timer) = self.event_timer_ms {
            old.event_timer_ms.ok_or_else(|| missing(Parameter::EventTimer))?;
            wanted.event_timer_ms = Some(timer);
        }
        if let Some(inhibit) = self.inhibit_100us {
            old.inhibit_100us.ok_or_else(|| missing(Parameter::InhibitTime))?;
            wanted.inhibit_100us = Some(inhibit);
        }
        Ok(wanted)
    }
}

fn check_length(node: NodeId, bits: u32) -> Result<(), Failure> {
    if bits <= MAX_BITS { Ok(()) } else { Err(Failure::at(node, PdoFailure::TooLong { bits })) }
}

impl FromStr for Item {
    type Err = String;

    fn from_str(text: &str) -> Result<Item, String> {
        let text = text.trim();
        let (what, bits) = match text.rsplit_once('/') {
            Some((what, bits)) if what.parse::<ObjectId>().is_ok() || bits.parse::<u64>().is_ok() => (what, Some(bits)),
            _ => (text, None),
        };
        let number = |bits: &str| {
            let number = bits.parse().ok().filter(|bits| (1..=64).contains(bits));
            number.ok_or_else(|| format!("\"{text}\": \"{bits}\" is not a number of bits (1 to 64)"))
        };
        let bits = bits.map(number).transpose()?;
        match what.parse() {
            Ok(object) => Ok(Item::Object(object, bits)),
            Err(_) if !what.is_empty() && !ObjectId::looks_like_address(what) => Ok(Item::Name(what.to_owned(), bits)),
            Err(_) => Err(format!(
                "\"{text}\" is neither a signal (pressure, ch1, pressure.status) nor an object (0x6130:1, 0x9130:1/32)"
            )),
        }
    }
}

/// Finds the object with this name: a signal, the status of a signal, or an object of the description or the standard.
fn object_by_name(node: &Node, name: &str) -> Result<ObjectId, Failure> {
    if let Some(signal) = node.signal(name) {
        return Ok(value_object(node, signal));
    }
    if let Some(signal) = name.strip_suffix(".status").and_then(|name| node.signal(name)) {
        let no_status = || Failure::at(node.id, ReadFailure::NoStatus { signal: signal.name.clone() });
        return signal.status.ok_or_else(no_status);
    }
    match node.layout().object(name) {
        Some(object) => Ok(object),
        None => Err(Failure::at(node.id, unknown_name(node, name))),
    }
}

/// Parses the mapping entry in an item of `pdo map` or of a file: `pressure`, `pressure.status`, `0x9130:1/32`. Needs
/// no bus.
///
/// # Errors
/// Unknown names, wrong numbers of bits, objects of unknown width.
pub(in crate::tasks) fn entry_of(node: &Node, text: &str) -> Result<MappingEntry, Failure> {
    let (object, bits) = match text.parse() {
        Ok(Item::Object(object, bits)) => (object, bits),
        Ok(Item::Name(name, bits)) => (object_by_name(node, &name)?, bits),
        Err(_) => return Err(Failure::at(node.id, unknown_name(node, text))),
    };
    match bits.or_else(|| width(node, object)) {
        Some(bits) => Ok(MappingEntry { object, bits }),
        None => Err(Failure::at(node.id, PdoFailure::WidthUnknown { object })),
    }
}

/// Returns a text that [`entry_of`] converts to this entry, if possible the name of a signal.
pub(in crate::tasks) fn text_of(node: &Node, entry: MappingEntry) -> String {
    let signals = node.signals.iter().flat_map(|signal| [signal.name.clone(), format!("{}.status", signal.name)]);
    let texts = signals.chain([node.name_of(entry.object), entry.object.to_string()]);
    let mut fitting = texts.filter(|text| entry_of(node, text).is_ok_and(|found| found == entry));
    fitting.next().unwrap_or_else(|| format!("{}/{}", entry.object, entry.bits))
}

fn unknown_name(node: &Node, name: &str) -> PdoFailure {
    let signals: Vec<String> = node.signals.iter().map(|signal| signal.name.clone()).collect();
    let with_status = node.signals.iter().filter(|signal| signal.status.is_some());
    let objects = node.model.iter().flat_map(|model| model.dictionary.iter());
    let known = signals
        .iter()
        .cloned()
        .chain(with_status.map(|signal| format!("{}.status", signal.name)))
        .chain(objects.map(|entry| entry.full_name()));
    let shared = node.model.as_ref().map(|model| model.dictionary.namesakes(name)).unwrap_or_default();
    let nearest = if shared.is_empty() { nearest(name, known) } else { shared };
    PdoFailure::UnknownName { name: name.to_owned(), nearest, signals }
}

/// Returns the object to map for a signal: its process value. If the description does not allow this, returns another
/// object with the same value.
fn value_object(node: &Node, signal: &Signal) -> ObjectId {
    let value = signal.value_object.0;
    let Some(model) = &node.model else { return value };
    let mappable = |object: &ObjectId| model.dictionary.get(*object).is_some_and(|entry| entry.pdo);
    let families = PROCESS_VALUES.iter().map(|&(index, _)| ObjectId::new(index, signal.channel));
    let others = signal.other_objects.iter().copied().chain(families);
    match model.dictionary.get(value) {
        Some(entry) if !entry.pdo => others.into_iter().find(mappable).unwrap_or(value),
        _ => value,
    }
}

/// Returns the number of bits of an object, if its type is known from the description or the standard.
fn width(node: &Node, object: ObjectId) -> Option<u8> {
    let model = node.model.as_ref();
    let described = model.and_then(|model| {
        let entry = model.dictionary.get(object)?;
        (!model.untyped.contains(&object)).then_some(entry.data_type)
    });
    let family = PROCESS_VALUES.iter().find(|&&(index, _)| index == object.index).map(|&(_, data_type)| data_type);
    let family = family.or_else(|| node.layout().data_type(object));
    let standard = || standard::entry(object).map(|entry| entry.data_type);
    // Indices below 20h are data types, which are mapped as dummies.
    let dummy = || DataType::from_code(object.index).filter(|_| object.sub == 0 && object.index < 0x20);
    match described.or(family).or_else(standard).or_else(dummy)? {
        DataType::Boolean => Some(1),
        data_type => u8::try_from(8 * data_type.width()?).ok(),
    }
}

/// Reads an object, and returns the number of its bits from the size that the device indicates.
fn read_width(session: &mut Session<'_, '_>, object: ObjectId) -> Result<u8, Failure> {
    let node = session.node.id;
    let answer = session.master.transfer_one(Request::read(node, object))??;
    let uploaded = answer.uploaded.filter(|uploaded| uploaded.indicated && (1..=8).contains(&uploaded.bytes.len()));
    let bits = uploaded.and_then(|uploaded| u8::try_from(8 * uploaded.bytes.len()).ok());
    bits.ok_or_else(|| Failure::at(node, PdoFailure::WidthUnknown { object }))
}
