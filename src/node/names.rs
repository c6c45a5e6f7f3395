//! Names and types of a node's objects: from its description, else from the standard.

use super::error::{Error, NameError};
use super::{Node, survey};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::Transmission;
use crate::canopen::value::{DataType, Value};
use crate::device::description::{ObjectEntry, Signature};
use crate::device::dictionary::{self, Entry};
use crate::device::nearest::distance;
use crate::device::profiles::MEASURING;
use crate::device::{sensor, standard};
use crate::master::{Master, Request, SdoError, SdoFailure};
use crate::measure::decode::Wanted;
use crate::measure::layout::{PROCESS_VALUES, Signal};
use std::collections::BTreeSet;

impl Node {
    /// The error register (1001h).
    pub const ERROR_REGISTER: ObjectId = ObjectId::new(0x1001, 0);

    /// The bits of the error register that mean an overload, if the node has a signal without its own status.
    pub fn overload_register(&self) -> Option<u8> {
        let needs_it = self.signals.iter().any(|signal| !signal.has_status()) && self.may_have(Node::ERROR_REGISTER);
        self.model.as_ref().filter(|_| needs_it)?.description.overload_register()
    }

    /// Returns the entry of an object, from the description or the standard. Sends no request.
    pub fn entry(&self, object: ObjectId) -> Option<Entry> {
        let described = self.model.as_ref().and_then(|model| model.dictionary.get(object).cloned());
        described.or_else(|| standard::entry(object))
    }

    /// Returns the entry with this name, from the description or the standard. Sends no request.
    pub fn entry_by_name(&self, name: &str) -> Option<Entry> {
        let described = self.model.as_ref().and_then(|model| model.dictionary.find(name).cloned());
        let spelled = || dictionary::spellings(name).iter().find_map(|name| standard::find(name));
        described.or_else(|| standard::find(name)).or_else(spelled)
    }

    /// Returns the entry of an object in the device description, with limits and meanings.
    pub fn described(&self, object: ObjectId) -> Option<&ObjectEntry> {
        self.model.as_ref()?.description.object(object)
    }

    /// Returns the name of an object; its address if it has none.
    pub fn name_of(&self, object: ObjectId) -> String {
        self.entry(object).map_or_else(|| object.to_string(), |entry| entry.full_name())
    }

    /// Whether the node can have an object. Without a description every object is possible.
    pub fn may_have(&self, object: ObjectId) -> bool {
        let model = self.model.as_ref();
        model.is_none_or(|model| model.dictionary.is_empty() || model.dictionary.get(object).is_some())
    }

    /// Whether an object is read-only according to the description.
    pub fn is_read_only(&self, object: ObjectId) -> bool {
        let described = self.model.as_ref().and_then(|model| model.dictionary.get(object));
        described.is_some_and(|entry| !entry.access.is_writable())
    }

    /// Returns the type of an object, from the description or the standard; `None` if it is unknown or missing in the
    /// description.
    pub fn known_type(&self, object: ObjectId) -> Option<DataType> {
        let is_untyped = self.model.as_ref().is_some_and(|model| model.untyped.contains(&object));
        self.entry(object).filter(|_| !is_untyped).map(|entry| entry.data_type)
    }

    /// Returns the type of an object for a setting: as [`Layout::data_type`], else by the index (CiA 404), else
    /// UNSIGNED32. Do not use it for measured values.
    ///
    /// [`Layout::data_type`]: crate::measure::layout::Layout::data_type
    pub fn data_type(&self, object: ObjectId) -> DataType {
        if let Some(data_type) = self.layout().data_type(object) {
            return data_type;
        }
        let family = PROCESS_VALUES.iter().find(|(index, _)| index >> 12 == object.index >> 12);
        family.map_or(DataType::Unsigned(4), |&(_, data_type)| data_type)
    }

    /// Returns the object of a signal in the family of its process value. `low` is the index without its first digit.
    pub fn object_in_family(&self, signal: &Signal, low: u16) -> ObjectId {
        ObjectId::new(signal.value_object.0.index & 0xf000 | low, signal.channel)
    }

    /// Finds the object of a signal by `name:channel`, or by `name` alone if the node has a single signal.
    pub fn object_of(&self, signal: &Signal, name: &str) -> Option<ObjectId> {
        let dictionary = &self.model.as_ref()?.dictionary;
        let numbered = dictionary.find(&format!("{name}:{}", signal.channel));
        let single = || dictionary.find(name).filter(|_| self.signals.len() == 1);
        numbered.or_else(single).map(|entry| entry.object)
    }

    /// Resolves a requested value on this node. A name means a signal if there is one, else an object.
    pub fn wanted(&self, item: &Wanted) -> Wanted {
        self.layout().resolve(item)
    }

    /// Returns the objects that share this name in the EDS, else the objects with similar names, the nearest first.
    pub fn objects_like(&self, name: &str) -> Vec<String> {
        let Some(model) = &self.model else { return nearest(name, standard::names()) };
        match model.dictionary.namesakes(name) {
            shared if shared.is_empty() => nearest(name, model.dictionary.iter().map(Entry::full_name)),
            shared => shared,
        }
    }

    /// Returns the similar names of objects, then the names of all signals.
    pub fn names_like(&self, name: &str) -> Vec<String> {
        let mut names = self.objects_like(name);
        names.extend(self.signals.iter().map(|signal| signal.name.clone()));
        let mut seen = BTreeSet::new();
        names.retain(|name| seen.insert(name.clone()));
        names
    }

    /// Resolves every requested value: see [`Node::wanted`].
    pub fn all_wanted(&self, items: &[Wanted]) -> Vec<Wanted> {
        items.iter().map(|item| self.wanted(item)).collect()
    }

    /// The signals that are channels of CiA 404: unit, filter, limits and autozero are objects of a channel.
    pub fn channels(&self) -> Vec<&Signal> {
        self.signals.iter().filter(|signal| signal.has_channel()).collect()
    }

    /// The event timer of a TPDO in ms; `None` if it is 0, or if the transmission type does not use it on this device.
    pub fn event_timer(&self, transmission: Option<Transmission>, event_timer_ms: Option<u16>) -> Option<u16> {
        let uses = |code| self.model.as_ref().is_none_or(|model| model.description.pdo.uses_timer(code));
        let is_used = match transmission {
            Some(Transmission::Manufacturer) => uses(254),
            Some(Transmission::Profile) => uses(255),
            _ => true,
        };
        event_timer_ms.filter(|&timer| timer > 0 && is_used)
    }

    /// Returns the signal with this name.
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.name == name)
    }
}

/// Returns the entry of an object. Reads the identity of the node if the object is not known without it.
///
/// # Errors
/// The node does not answer; bus errors and Ctrl-C.
pub fn entry(master: &mut Master<'_>, node: &mut Node, object: ObjectId) -> Result<Option<Entry>, Error> {
    if node.entry(object).is_none() {
        survey::identify_late(master, node)?;
    }
    Ok(node.entry(object))
}

/// Finds the object with this name. Reads the identity of the node if the name is not known without it.
///
/// # Errors
/// [`Error::Name`] with similar names; the node does not answer; bus errors and Ctrl-C.
pub fn resolve(master: &mut Master<'_>, node: &mut Node, name: &str) -> Result<ObjectId, Error> {
    if let Some(entry) = node.entry_by_name(name) {
        return Ok(entry.object);
    }
    survey::identify_late(master, node)?;
    if let Some(entry) = node.entry_by_name(name) {
        return Ok(entry.object);
    }
    Err(Error::Name(NameError {
        node: node.id,
        name: name.to_owned(),
        title: node.model.as_ref().map(|model| model.description.title.clone()),
        is_shared: node.model.as_ref().is_some_and(|model| !model.dictionary.namesakes(name).is_empty()),
        nearest: node.objects_like(name),
    }))
}

/// Finds the type for writing `text` to an object, from the description or the standard. Otherwise an integer as wide
/// as the object, if the node indicates the size.
///
/// # Errors
/// [`Error::TypeUnknown`]; the node does not answer; bus errors and Ctrl-C.
pub fn type_for(master: &mut Master<'_>, node: &mut Node, object: ObjectId, text: &str) -> Result<DataType, Error> {
    entry(master, node, object)?;
    if let Some(data_type) = node.known_type(object) {
        return Ok(data_type);
    }
    let uploaded = match master.transfer_one(Request::read(node.id, object))? {
        Ok(answer) => answer.uploaded.filter(|uploaded| uploaded.indicated),
        Err(SdoError { failure: SdoFailure::Refused(_), .. }) => None,
        Err(error) => return Err(error.into()),
    };
    let is_integer = !text.contains(['.', 'e', 'E']) || text.starts_with("0x");
    match uploaded.and_then(|uploaded| u8::try_from(uploaded.bytes.len()).ok()) {
        Some(width @ 1..=8) if is_integer && text.starts_with('-') => Ok(DataType::Integer(width)),
        Some(width @ 1..=8) if is_integer => Ok(DataType::Unsigned(width)),
        _ => Err(Error::TypeUnknown { node: node.id, object }),
    }
}

/// Encodes a value. `text` is a number, text, the signature of the object (`save`), or a word that the description
/// explains (`Pt100`).
///
/// # Errors
/// [`Error::Value`] if it does not fit.
pub fn encode(node: &Node, object: ObjectId, data_type: DataType, text: &str) -> Result<Vec<u8>, Error> {
    let encoded = data_type.encode_text(text);
    encoded.or_else(|error| word(node, object, data_type, text).ok_or(Error::Value { node: node.id, object, error }))
}

/// Encodes a word instead of a number: a signature, a word of the description, or a sensor type (6110h).
pub fn word(node: &Node, object: ObjectId, data_type: DataType, text: &str) -> Option<Vec<u8>> {
    if !matches!(data_type, DataType::Unsigned(_) | DataType::Integer(_)) {
        return None;
    }
    let is_sensor = object.index == 0x6110 && object.sub > 0 && node.identity.profile() == Some(MEASURING);
    let is_match = |word: &str| word.eq_ignore_ascii_case(text) || is_sensor && sensor::is_same(word, text);
    let explained = || {
        let mut alike = node.described(object)?.values.iter().filter(|(_, word)| is_match(word));
        alike.next().filter(|_| alike.next().is_none()).map(|(code, _)| *code)
    };
    let standard = || sensor::code(text).filter(|_| is_sensor).map(u64::from);
    let number = || data_type.encode_text(&explained().or_else(standard)?.to_string()).ok();
    signature(node, object, text).or_else(number)
}

/// Returns the bytes of the signature of an object, if `text` is its word: `save`, `load`, `zero`, `tara`.
fn signature(node: &Node, object: ObjectId, text: &str) -> Option<Vec<u8>> {
    let standard = match object.index {
        0x1010 if object.sub > 0 => Some(Signature::Save),
        0x1011 if object.sub > 0 => Some(Signature::Load),
        0x6125 if object.sub > 0 => Some(Signature::Zero),
        0x6139 if object.sub > 0 => Some(Signature::Tare),
        _ => None,
    };
    let signature = node.described(object).and_then(|entry| entry.signature).or(standard)?;
    // The number of a node-ID or bit rate comes before "set".
    let is_complete = signature != Signature::Set;
    (is_complete && text.eq_ignore_ascii_case(signature.as_str())).then(|| signature.as_str().as_bytes().to_vec())
}

/// Returns the known names that are most similar to a word, at most three, the nearest first.
pub fn nearest(word: &str, known: impl Iterator<Item = String>) -> Vec<String> {
    let mut near: Vec<(usize, String)> = known
        .map(|known| (distance(word, &known), known))
        .filter(|(distance, _)| *distance <= word.len() / 2)
        .collect();
    near.sort();
    near.into_iter().take(3).map(|(_, name)| name).collect()
}

/// Decodes bytes as a value of a type. Returns the bytes if they do not fit.
pub fn value_of(data: &[u8], data_type: DataType) -> Value {
    super::error::shown(data, data_type)
}
