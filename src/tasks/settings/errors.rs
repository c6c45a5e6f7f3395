//! The error register (1001h) and the error history (1003h), explained by the device description.

use super::{SettingsFailure, read_each};
use crate::canopen::emcy::{Emergency, ErrorRegister};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::description::{EmergencyEntry, ErrorHistory};
use crate::master::Master;
use crate::node::Node;
use crate::node::read::Reader;
use crate::node::write::write;
use crate::tasks::Failure;
use std::collections::BTreeMap;

const REGISTER: ObjectId = ObjectId::new(0x1001, 0);
const HISTORY: ObjectId = ObjectId::new(0x1003, 0);

/// The errors of a node, and the number of errors deleted from its history.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorReport {
    /// The node.
    pub node: NodeId,
    /// Register and history, after a deletion.
    pub errors: Errors,
    /// The number of errors in the history before it was deleted; `None` if it was not deleted.
    pub cleared: Option<u64>,
}

/// The error register and the error history of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Errors {
    /// The error register (1001h); `None` if it cannot be read.
    pub register: Option<u8>,
    /// The names of its bits, or `no error`.
    pub register_text: String,
    /// The number of errors in the history; `None` if the device has no history.
    pub count: Option<u64>,
    /// The entries of the history that can be read, newest first.
    pub history: Vec<PastError>,
    /// The counters of errors in the description.
    pub counters: Vec<ErrorCounter>,
}

/// An object that counts errors (DPS 2004h, 2005h).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorCounter {
    /// The object.
    pub object: ObjectId,
    /// Its name in the description.
    pub name: String,
    /// The meaning of the counter.
    pub text: String,
    /// The count; `None` if it cannot be read.
    pub count: Option<u64>,
}

/// An entry of the error history.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PastError {
    /// The number in 1003h.
    pub raw: u32,
    /// The emergency code.
    pub code: u16,
    /// Its meaning, from the table of the device, else the class of CiA 301.
    pub text: String,
    /// The meaning of the other two bytes; empty if it is unknown.
    pub detail: String,
}

/// Reads register and history.
///
/// # Errors
/// No answer; [`SettingsFailure::NoErrorObjects`].
pub fn read(master: &mut Master<'_>, node: &Node) -> Result<Errors, Failure> {
    read_by(read_optional, master, node)
}

/// Reads values of a node: [`read_optional`], or [`read_each`], which fails without an answer.
type ReadValues = fn(&mut Master<'_>, &Node, &[ObjectId]) -> Result<Vec<Option<Value>>, Failure>;

fn read_by(values: ReadValues, master: &mut Master<'_>, node: &Node) -> Result<Errors, Failure> {
    let present: Vec<ObjectId> = [REGISTER, HISTORY].into_iter().filter(|&object| node.may_have(object)).collect();
    let found = present.iter().copied().zip(values(master, node, &present)?);
    let found: BTreeMap<ObjectId, u64> = found.filter_map(|(object, value)| Some((object, value?.as_u64()?))).collect();
    let (register, count) = (found.get(&REGISTER).copied(), found.get(&HISTORY).copied());
    let register = register.and_then(|bits| u8::try_from(bits).ok());
    if register.is_none() && count.is_none() {
        // Without an answer, it is unknown whether the node has these objects.
        read_each(master, node, &present)?;
        return Err(Failure::at(node.id, SettingsFailure::NoErrorObjects));
    }
    // CiA 301 allows 254 entries.
    let entries = count.and_then(|count| u8::try_from(count).ok()).unwrap_or(0).min(254);
    let objects: Vec<ObjectId> =
        (1..=entries).map(|sub| HISTORY.with_sub(sub)).filter(|&object| node.may_have(object)).collect();
    let history = values(master, node, &objects)?;
    let history = history.iter().flatten().filter_map(Value::as_u64).filter_map(|raw| u32::try_from(raw).ok());
    Ok(Errors {
        register,
        register_text: register.map(|bits| register_text(node, bits)).unwrap_or_default(),
        count,
        history: history.map(|raw| past_error(node, raw)).collect(),
        counters: counters(master, node)?,
    })
}

/// Reads the values of optional objects. Objects without a valid answer are recorded as unknown.
fn read_optional(master: &mut Master<'_>, node: &Node, objects: &[ObjectId]) -> Result<Vec<Option<Value>>, Failure> {
    let items: Vec<_> = objects.iter().map(|&object| (node.id, object, node.data_type(object))).collect();
    Ok(Reader::new(master).values(&items)?)
}

fn counters(master: &mut Master<'_>, node: &Node) -> Result<Vec<ErrorCounter>, Failure> {
    let objects = node.model.as_ref().map_or(&[][..], |model| &model.description.error_counters);
    let values = read_optional(master, node, objects)?;
    let counter = |(&object, value): (&ObjectId, &Option<Value>)| ErrorCounter {
        object,
        name: node.name_of(object),
        text: node.described(object).map(|entry| entry.text.clone()).unwrap_or_default(),
        count: value.as_ref().and_then(Value::as_u64),
    };
    Ok(objects.iter().zip(&values).map(counter).collect())
}

fn register_text(node: &Node, bits: u8) -> String {
    let description = node.model.as_ref().map(|model| &model.description);
    description.map_or_else(|| ErrorRegister(bits).to_string(), |description| description.register_text(bits))
}

fn past_error(node: &Node, raw: u32) -> PastError {
    let description = node.model.as_ref().map(|model| &model.description);
    let layout = description.map_or(ErrorHistory::default(), |description| description.error_history);
    let (code, bytes) = layout.read(raw);
    let described = description.and_then(|description| description.emergency(code));
    let text = described.map_or_else(|| Emergency::class(code).to_owned(), |entry| entry.text.clone());
    let detail = described.zip(bytes).map(|(entry, bytes)| detail(entry, bytes)).unwrap_or_default();
    PastError { raw, code, text, detail }
}

/// Returns the meaning of bytes 3 and 4 of an emergency: `channel 1, status 0x03`.
fn detail(entry: &EmergencyEntry, bytes: [u8; 2]) -> String {
    let parts = entry.bytes.iter().zip(bytes).filter_map(|(meaning, byte)| {
        let folded = meaning.to_lowercase();
        if folded.contains("channel") {
            Some(format!("channel {byte}"))
        } else if folded.contains("status") {
            Some(format!("status 0x{byte:02X}"))
        } else if let Some((name, words)) = meaning.split_once(": ") {
            // The name is followed by the meanings of the numbers: `CAN error state: 0 stopped, 1 sleep`.
            let mut words = words.split(", ").filter_map(|word| word.split_once(' '));
            let word = words.find(|(number, _)| number.parse() == Ok(byte)).map(|(_, word)| format!(" ({word})"));
            Some(format!("{name} {byte}{}", word.unwrap_or_default()))
        } else {
            // A byte with a constant value carries no information.
            meaning.parse::<u8>().is_err().then(|| format!("{meaning} {byte}"))
        }
    });
    parts.collect::<Vec<_>>().join(", ")
}

/// Deletes the history and reads it again. Returns the errors before and after. A pending error stays in the register,
/// and may be in the history again at once.
///
/// # Errors
/// The device has no history, rejects the write, does not answer, or keeps its history.
pub fn clear(master: &mut Master<'_>, node: &Node) -> Result<(Errors, Errors), Failure> {
    let before = read_by(read_each, master, node)?;
    let Some(count) = before.count else {
        return Err(Failure::at(node.id, SettingsFailure::NoErrorHistory));
    };
    let width = node.data_type(HISTORY).width().unwrap_or(1).min(4);
    write(master, node, HISTORY, &[0; 4][..width])?;
    let now = read_by(read_each, master, node)?;
    let left = now.count.unwrap_or(0);
    // If there are fewer or different errors, they are newer than the deletion.
    let are_new = left < count || now.history != before.history;
    if left > 0 && !are_new {
        let cause = SettingsFailure::HistoryNotCleared { count: left };
        return Err(Failure::at(node.id, cause).of_object(HISTORY));
    }
    Ok((before, now))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::catalog;

    #[test]
    fn the_other_bytes_of_an_error_are_explained() {
        let mh4 = catalog::by_name("mh4").expect("built in");
        let entry = |code| mh4.description.emergency(code).expect("described");
        let (code, bytes) = mh4.description.error_history.read(0x0103_f001);
        assert_eq!((code, bytes), (0xf001, Some([1, 3])));
        assert_eq!(detail(entry(0xf001), [1, 3]), "channel 1, status 0x03");
        assert_eq!(detail(entry(0x8110), [0, 0]), "");
        assert_eq!(detail(entry(0x8120), [4, 6]), "CAN error state 4 (error passive), CAN error type 6 (acknowledge)");
        assert_eq!(detail(entry(0x8100), [9, 0]), "CAN error state 9, CAN error type 0 (none)");
        let dps = catalog::by_name("dps").expect("built in");
        for (bits, text) in [
            (0x00, "no error"),
            (0x05, "overflow or underflow"),
            (0x07, "sensor failure, overflow or underflow"),
            (0x11, "CAN controller error passive or recovered from bus-off"),
            (0x81, "EEPROM error"),
            (0x0d, "overflow or underflow, temperature"),
            (0x01, "generic"),
        ] {
            assert_eq!(dps.description.register_text(bits), text);
        }
        assert_eq!(mh4.description.register_text(0x81), "generic, manufacturer");
        let jumo = catalog::by_name("jumo").expect("built in");
        assert_eq!(jumo.description.register_text(0x01), "sensor break or short circuit");
        assert_eq!(jumo.description.register_text(0x11), "generic, communication");
        assert_eq!(ErrorHistory::CodeHigh.read(0xff00_0102), (0xff00, None));
        assert_eq!(ErrorHistory::CodeLow.read(0x0102_8110), (0x8110, None));
    }
}
