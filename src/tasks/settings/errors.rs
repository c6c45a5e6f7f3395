//! What is wrong with a device by its own account: the error register (1001h) and the history (1003h), in
//! the words of its description.

use super::Device;
use crate::canopen::emcy::{Emergency, ErrorRegister};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::description::{EmergencyEntry, ErrorHistory};
use crate::master::Master;
use crate::tasks::{Failure, Kind};

const REGISTER: ObjectId = ObjectId::new(0x1001, 0);
const HISTORY: ObjectId = ObjectId::new(0x1003, 0);

/// The errors of a node, and how many were deleted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorReport {
    /// The node.
    pub node: NodeId,
    /// Register and history, after a deletion.
    pub errors: Errors,
    /// How many errors the history held before it was deleted; `None` if it was not deleted.
    pub cleared: Option<u64>,
}

/// The error register and the error history of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Errors {
    /// 1001h, where the device tells it.
    pub register: Option<u8>,
    /// The names of its bits, or `no error`.
    pub register_text: String,
    /// How many errors the history holds; `None` where the device keeps none.
    pub count: Option<u64>,
    /// The history, newest first, as far as the device tells it.
    pub history: Vec<PastError>,
}

/// An entry of the error history.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PastError {
    /// As it stands in 1003h.
    pub raw: u32,
    /// The emergency code.
    pub code: u16,
    /// What it means: by the device's own table, else by the class of CiA 301.
    pub text: String,
    /// What the bytes say that came with it, where that is known.
    pub detail: String,
}

/// Reads register and history.
///
/// # Errors
/// Silence, and a device that has neither.
pub fn read(master: &mut Master<'_>, device: &Device) -> Result<Errors, Failure> {
    let mut number = |object: ObjectId| -> Result<Option<u64>, Failure> {
        if !device.may_have(object) {
            return Ok(None);
        }
        Ok(device.read_each(master, &[object])?.first().and_then(Option::as_ref).and_then(Value::as_u64))
    };
    let (register, count) = (number(REGISTER)?, number(HISTORY)?);
    let register = register.and_then(|bits| u8::try_from(bits).ok());
    if register.is_none() && count.is_none() {
        let message = "it has neither an error register (1001h) nor a history (1003h)";
        return Err(Failure::of_node(Kind::Unexpected, device.node(), message));
    }
    // CiA 301 has 254 entries at most.
    let entries = count.and_then(|count| u8::try_from(count).ok()).unwrap_or(0).min(254);
    let objects: Vec<ObjectId> =
        (1..=entries).map(|sub| HISTORY.with_sub(sub)).filter(|&object| device.may_have(object)).collect();
    let history = device.read_each(master, &objects)?;
    let history = history.iter().flatten().filter_map(Value::as_u64).filter_map(|raw| u32::try_from(raw).ok());
    Ok(Errors {
        register,
        register_text: register.map(|bits| ErrorRegister(bits).to_string()).unwrap_or_default(),
        count,
        history: history.map(|raw| past(device, raw)).collect(),
    })
}

fn past(device: &Device, raw: u32) -> PastError {
    let description = device.model().map(|model| &model.description);
    let layout = description.map_or(ErrorHistory::default(), |description| description.error_history);
    let (code, bytes) = layout.read(raw);
    let described = description.and_then(|description| description.emergency(code));
    let text = described.map_or_else(|| Emergency::class(code).to_owned(), |entry| entry.text.clone());
    let detail = described.zip(bytes).map(|(entry, bytes)| detail(entry, bytes)).unwrap_or_default();
    PastError { raw, code, text, detail }
}

/// What bytes 3 and 4 of an emergency say: `channel 1, status 0x03`.
fn detail(entry: &EmergencyEntry, bytes: [u8; 2]) -> String {
    let said = entry.bytes.iter().zip(bytes).filter_map(|(meaning, byte)| {
        let folded = meaning.to_lowercase();
        if folded.contains("channel") {
            Some(format!("channel {byte}"))
        } else if folded.contains("status") {
            Some(format!("status 0x{byte:02X}"))
        } else {
            // A byte that is always the same says nothing.
            meaning.parse::<u8>().is_err().then(|| format!("{meaning} {byte}"))
        }
    });
    said.collect::<Vec<_>>().join(", ")
}

/// Deletes the history and reads it again. What is pending stays in the register, and a new error may stand
/// in the history at once.
///
/// # Errors
/// A device without history, refusals, silence, a history that stays.
pub fn clear(master: &mut Master<'_>, device: &Device) -> Result<(Errors, Errors), Failure> {
    let before = read(master, device)?;
    let Some(count) = before.count else {
        return Err(Failure::of_node(Kind::Unexpected, device.node(), "it keeps no error history (1003h)"));
    };
    let width = device.data_type(HISTORY).width().unwrap_or(1).min(4);
    device.write(master, HISTORY, &[0; 4][..width])?;
    let now = read(master, device)?;
    let left = now.count.unwrap_or(0);
    // Fewer than before, or others than before: they have come since.
    let new = left < count || now.history != before.history;
    if left > 0 && !new {
        let message = format!("{HISTORY} was acknowledged, and the history still holds {left}");
        return Err(Failure { object: Some(HISTORY), ..Failure::of_node(Kind::Unexpected, device.node(), message) });
    }
    Ok((before, now))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::catalog;

    #[test]
    fn the_bytes_that_came_with_an_error() {
        let mh4 = catalog::by_name("mh4").expect("built in");
        let entry = |code| mh4.description.emergency(code).expect("described");
        let (code, bytes) = mh4.description.error_history.read(0x0103_f001);
        assert_eq!((code, bytes), (0xf001, Some([1, 3])));
        assert_eq!(detail(entry(0xf001), [1, 3]), "channel 1, status 0x03");
        assert_eq!(detail(entry(0x8110), [0, 0]), "");
        assert_eq!(detail(entry(0x8120), [4, 6]), "CAN error state 4, CAN error type 6");
        assert_eq!(ErrorHistory::CodeHigh.read(0xff00_0102), (0xff00, None));
        assert_eq!(ErrorHistory::CodeLow.read(0x0102_8110), (0x8110, None));
    }
}
