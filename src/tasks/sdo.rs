//! Reads and writes objects: types from the standard, a description, or the object itself.

mod failure;

pub use failure::ObjectFailure;

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize, Note, Uploaded};
use crate::canopen::value::{DataType, Value};
use crate::device::catalog::Model;
use crate::device::description::SizeIndication;
use crate::device::dictionary::Entry;
use crate::device::nearest::distance;
use crate::device::standard;
use crate::master::transfer::{BlockMode, Moved, read_object};
use crate::master::{Error, Master, Request, SdoError, SdoFailure};
use crate::node::Overrides;
use crate::node::survey::identify;
use crate::tasks::{Failure, Kind};
use std::sync::Arc;

/// What is known of one node's objects, found out as far as it is needed.
#[derive(Clone, Debug)]
pub struct Knowledge {
    node: NodeId,
    overrides: Overrides,
    /// Looked for once; `None` inside: not a device that is known.
    model: Option<Option<Arc<Model>>>,
}

/// How bytes travel, and who hears of it.
pub struct Options<'a> {
    /// When block transfer is used.
    pub blocks: BlockMode,
    /// Whether writes say how many bytes they carry.
    pub size: SizeMode,
    /// Hears every 100 ms of bytes moved, and of how many there are where that is known.
    pub progress: &'a mut dyn FnMut(Moved),
}

/// A value read.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadValue {
    /// Where it stands.
    pub object: ObjectId,
    /// Its name, where one is known.
    pub name: Option<String>,
    /// Its type, where it is known.
    pub data_type: Option<DataType>,
    /// The value; bytes where the type is not known.
    pub value: Value,
    /// The bytes in wire order.
    pub raw: Vec<u8>,
    /// What was odd about how it came.
    pub note: Option<Note>,
}

impl Knowledge {
    /// Nothing but what the user named.
    pub fn new(node: NodeId, overrides: &Overrides) -> Knowledge {
        let model = overrides.get(&node).map(|model| Some(Arc::clone(model)));
        Knowledge { node, overrides: overrides.clone(), model }
    }

    /// The entry as far as it is known without asking the device.
    pub fn offline(&self, object: ObjectId) -> Option<Entry> {
        let described = match &self.model {
            Some(Some(model)) => model.dictionary.get(object).cloned(),
            _ => None,
        };
        described.or_else(|| standard::entry(object))
    }

    /// The entry of a name as far as it is known without asking the device.
    pub fn offline_name(&self, name: &str) -> Option<Entry> {
        let described = match &self.model {
            Some(Some(model)) => model.dictionary.find(name).cloned(),
            _ => None,
        };
        described.or_else(|| standard::find(name))
    }

    /// The description of the device, read from it at the first time.
    fn model(&mut self, master: &mut Master<'_>) -> Result<Option<Arc<Model>>, Error> {
        if let Some(model) = &self.model {
            return Ok(model.clone());
        }
        let found = identify(master, &[self.node], &self.overrides)?;
        let model = found.into_iter().next().and_then(|instrument| instrument.model);
        self.model = Some(model.clone());
        Ok(model)
    }

    /// The entry at `object`, from the standard or the device's description.
    pub fn entry(&mut self, master: &mut Master<'_>, object: ObjectId) -> Result<Option<Entry>, Error> {
        if let Some(entry) = self.offline(object) {
            return Ok(Some(entry));
        }
        Ok(self.model(master)?.and_then(|model| model.dictionary.get(object).cloned()))
    }

    /// The type of an entry, where its description does not leave it open.
    fn type_of(&self, entry: Option<&Entry>) -> Option<DataType> {
        let open = |entry: &&Entry| match &self.model {
            Some(Some(model)) => model.untyped.contains(&entry.object),
            _ => false,
        };
        entry.filter(|entry| !open(entry)).map(|entry| entry.data_type)
    }

    /// The object of a name.
    ///
    /// # Errors
    /// A name that neither the standard nor the device's description has, with the nearest ones.
    pub fn resolve(&mut self, master: &mut Master<'_>, name: &str) -> Result<ObjectId, Failure> {
        if let Some(entry) = self.offline_name(name) {
            return Ok(entry.object);
        }
        let model = self.model(master)?;
        if let Some(entry) = model.as_ref().and_then(|model| model.dictionary.find(name)) {
            return Ok(entry.object);
        }
        let known: Vec<String> = match &model {
            Some(model) => model.dictionary.iter().map(Entry::full_name).collect(),
            None => standard::names().collect(),
        };
        let what = model.as_ref().map_or_else(|| "the standard".to_owned(), |model| model.description.title.clone());
        let near = nearest(name, known.into_iter());
        let failure = Failure::of_node(Kind::Usage, self.node, format!("{what} has no object \"{name}\""));
        Err(if near.is_empty() { failure } else { failure.hint(format!("nearest: {}", near.join(", "))) })
    }
}

/// The known names that are nearest to a word, at most three.
pub(super) fn nearest(word: &str, known: impl Iterator<Item = String>) -> Vec<String> {
    let mut near: Vec<(usize, String)> = known
        .map(|known| (distance(word, &known), known))
        .filter(|(distance, _)| *distance <= word.len() / 2)
        .collect();
    near.sort();
    near.into_iter().take(3).map(|(_, name)| name).collect()
}

/// Reads an object.
///
/// # Errors
/// The device's refusal, silence or breach of the protocol, and bytes that make no value of the type.
pub fn read(
    master: &mut Master<'_>,
    knowledge: &mut Knowledge,
    object: ObjectId,
    data_type: Option<DataType>,
    options: &mut Options<'_>,
) -> Result<ReadValue, Failure> {
    let node = knowledge.node;
    let expected = data_type.or_else(|| knowledge.type_of(knowledge.offline(object).as_ref()));
    let answer = read_object(master, (node, object), expected, options.blocks, options.progress)??;
    let entry = match data_type {
        Some(_) => knowledge.offline(object),
        None => knowledge.entry(master, object)?,
    };
    let data_type = data_type.or(knowledge.type_of(entry.as_ref()));
    let (value, note) = answer.value(node, object, data_type)?;
    let raw = answer.uploaded.map(|uploaded| uploaded.bytes).unwrap_or_default();
    let raw = match data_type.and_then(DataType::width) {
        Some(width) if raw.len() > width => raw[..width].to_vec(),
        _ => raw,
    };
    Ok(ReadValue { object, name: entry.map(|entry| entry.full_name()), data_type, value, raw, note })
}

/// The bytes of a value for an object: the type from the user, the standard, the description, or from how
/// many bytes the object has.
///
/// # Errors
/// A value that does not fit the type, and an object whose type nothing tells.
pub fn encode(
    master: &mut Master<'_>,
    knowledge: &mut Knowledge,
    object: ObjectId,
    data_type: Option<DataType>,
    text: &str,
) -> Result<(Vec<u8>, DataType), Failure> {
    let node = knowledge.node;
    let usage = |error: String| Failure::of_node(Kind::Usage, node, format!("write {object}: {error}"));
    let known = match data_type {
        Some(data_type) => Some(data_type),
        None => {
            let entry = knowledge.entry(master, object)?;
            knowledge.type_of(entry.as_ref())
        }
    };
    if let Some(data_type) = known {
        return Ok((data_type.encode_text(text).map_err(|error| usage(error.to_string()))?, data_type));
    }
    let answer = master.transfer_one(Request::read(knowledge.node, object))?;
    let width = match &answer {
        Ok(answer) => answer
            .uploaded
            .as_ref()
            .filter(|uploaded| uploaded.indicated)
            .map(|uploaded: &Uploaded| uploaded.bytes.len()),
        Err(SdoError { failure: SdoFailure::Refused(_), .. }) => None,
        Err(error) => return Err(error.clone().into()),
    };
    let width = width.and_then(|width| u8::try_from(width).ok()).filter(|width| (1..=8).contains(width));
    let integer = !text.contains(['.', 'e', 'E']) || text.starts_with("0x");
    match width {
        Some(width) if integer => {
            let data_type = if text.starts_with('-') { DataType::Integer(width) } else { DataType::Unsigned(width) };
            Ok((data_type.encode_text(text).map_err(|error| usage(error.to_string()))?, data_type))
        }
        _ => Err(usage("its type is not known".to_owned()).hint(format!(
            "say it: cangauge sdo write {} {object} {text} --type u32 (or i16, r32, vs)",
            knowledge.node
        ))),
    }
}

/// Whether writes say how many bytes they carry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SizeMode {
    /// They do.
    Indicated,
    /// They do not (22h).
    Omitted,
    /// As the description says, else they do; and once the other way where the device takes that amiss.
    #[default]
    Auto,
}

/// Writes bytes to an object. With [`SizeMode::Auto`] sizes are indicated unless the description says that the device omits them;
/// a device that takes the command specifier or the length amiss is asked once more the other way.
///
/// # Errors
/// The device's refusal, silence or breach of the protocol.
pub fn write(
    master: &mut Master<'_>,
    knowledge: &Knowledge,
    object: ObjectId,
    data: &[u8],
    options: &mut Options<'_>,
) -> Result<(), Failure> {
    let mode = options.size;
    let omits = matches!(&knowledge.model, Some(Some(model)) if model.description.sdo.size == SizeIndication::Omitted);
    let sizes = if omits && mode == SizeMode::Auto || mode == SizeMode::Omitted {
        [DownloadSize::Omitted, DownloadSize::Indicated]
    } else {
        [DownloadSize::Indicated, DownloadSize::Omitted]
    };
    let node = knowledge.node;
    let request = |size| {
        let request = Request::write(node, object, data.to_vec(), size).blocks(options.blocks.for_write(data.len()));
        // A signature acts: sent twice it may act twice.
        if is_signature(data) { request.once() } else { request }
    };
    let first = master.carry_out(request(sizes[0]), options.progress)?;
    // A refused block transfer was not refused for its size.
    let expedited = (1..=4).contains(&data.len()) && options.blocks != BlockMode::Always;
    match first {
        Err(SdoError {
            failure: SdoFailure::Refused(code @ (AbortCode::COMMAND_SPECIFIER | AbortCode::LENGTH)),
            ..
        }) if mode == SizeMode::Auto && expedited => {
            if code == AbortCode::LENGTH && has_another_width(master, node, object, data.len())? {
                return Err(first.err().map_or_else(|| Failure::new(Kind::Refused, "refused"), Failure::from));
            }
            // If the other way is refused too, the first refusal is the one that counts.
            match master.transfer_one(request(sizes[1]))? {
                Ok(_) => Ok(()),
                Err(_) => Err(first.err().map_or_else(|| Failure::new(Kind::Refused, "refused"), Failure::from)),
            }
        }
        Err(error) => Err(error.into()),
        Ok(_) => Ok(()),
    }
}

/// Whether an object says that it has another number of bytes. Written without a size, fewer bytes than it has
/// would be filled up with whatever stands behind them: -5 as i16 would become 65531 in an i32.
fn has_another_width(master: &mut Master<'_>, node: NodeId, object: ObjectId, width: usize) -> Result<bool, Failure> {
    let answer = master.transfer_one(Request::read(node, object))?;
    let uploaded = answer.ok().and_then(|answer| answer.uploaded);
    Ok(uploaded.is_some_and(|uploaded| uploaded.indicated && uploaded.bytes.len() != width))
}

/// Whether these bytes are a signature (save, load, zero, or a number with "set"): it acts, and what is
/// read back is something else (2321h, for example, the detected bit rate).
pub fn is_signature(data: &[u8]) -> bool {
    data == b"save" || data == b"load" || data == b"zero" || data.len() == 4 && data[1..] == *b"set"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_names() {
        assert_eq!(distance("vendor-id", "vendor-id"), 0);
        assert_eq!(distance("vender-id", "vendor-id"), 1);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("abc", ""), 3);
        assert_eq!(distance("heartbeat", "haertbeat"), 2);
    }

    #[test]
    fn signatures_are_told_from_plain_values() {
        for signature in [&b"save"[..], b"load", b"zero", b"\x03set"] {
            assert!(is_signature(signature));
        }
        for plain in [&b"sav"[..], b"evas", &[1, 2, 3, 4], b"set"] {
            assert!(!is_signature(plain));
        }
    }
}
