//! Device descriptions: the contents of one TOML file in `devices/`, as checked types.
//!
//! `load.rs` parses addresses, ranges and values once, and reports each mistake with its line. Other code does not
//! parse.

mod check;
mod load;
mod object;
mod table;
#[cfg(test)]
mod tests;

pub(super) use load::read_identify;
pub use load::{read, read_with_notes};
pub use object::{Access, ObjectEntry, ObjectRun, Signature, StoreGroup};

use super::assign::AssignEntry;
use super::config_file::Place;
use super::quirk::Quirk;
use super::scalar::Scalar;
use super::scale::{Markers, Scale, StatusBits};
use super::unit::Unit;
use crate::canopen::emcy::{Emergency, ErrorRegister};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use std::collections::{BTreeMap, BTreeSet};

/// A mistake in a description.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {message}")]
pub struct DescriptionError {
    /// The place in the text.
    pub place: Place,
    /// The mistake, in one line of text.
    pub message: String,
}

impl DescriptionError {
    /// Formats the mistake with its place: `x.toml:6:1: unknown key "signals" (known: …)`.
    pub fn in_file(&self, file: &str) -> String {
        format!("{file}:{}: {}", self.place, self.message)
    }
}

/// Everything known about one kind of device.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// The short name for `--device`, `sim:` and the DEVICE column: `mh4`.
    pub name: String,
    /// The name on the label: `WIKA MH-4-CAN`.
    pub title: String,
    /// The manufacturer: `WIKA`.
    pub vendor: String,
    /// The documents on which the description is based.
    pub source: String,
    /// Whether no manual confirms the description. The description then allows only reading. To store, or to set a
    /// zero, a node-ID or a bit rate, the user must name the description.
    pub unconfirmed: bool,
    /// The answers by which the device is recognised.
    pub identify: Identify,
    /// Node-ID and bit rate of a new device.
    pub factory: Factory,
    /// How the SDO server of the device behaves.
    pub sdo: SdoStyle,
    /// How the PDOs of the device are configured.
    pub pdo: PdoStyle,
    /// Deviations from the standard that need their own code.
    pub quirks: Vec<Quirk>,
    /// The layout of the entries of the error history (1003h).
    pub error_history: ErrorHistory,
    /// Objects that count errors, shown with the error history.
    pub error_counters: Vec<ObjectId>,
    /// The longest time in ms for the repeating average (61A0h). With a longer time, the device uses the moving
    /// average.
    pub repeating_average_ms: Option<u16>,
    /// The device's own table of bit rates: index to bit rate in bit/s.
    pub bit_rates: BTreeMap<u8, u32>,
    /// The index of automatic bit rate detection, if the device has it.
    pub auto_bit_rate: Option<u8>,
    /// How to set node-ID and bit rate; the preferred method first.
    pub assign: Vec<AssignEntry>,
    /// The object that decides how the device starts after power-on.
    pub startup: Option<Startup>,
    /// The channels that can be set to zero.
    pub autozero: Vec<Autozero>,
    /// The measured signals.
    pub signals: Vec<SignalEntry>,
    /// The object dictionary.
    pub objects: Vec<ObjectEntry>,
    /// The meanings of the emergency codes of the device.
    pub emergencies: Vec<EmergencyEntry>,
    /// The deviations from the standard that the manual states.
    pub deviations: Vec<Deviation>,
}

/// A deviation from the standard that the manual of a device states.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Deviation {
    /// The case of `conform` that finds the deviation: `SDO-07`.
    pub case: String,
    /// The objects with this deviation; empty for all objects.
    pub objects: Vec<ObjectId>,
    /// What the manual states.
    pub text: String,
    /// Page or section of the manual.
    pub page: String,
}

/// The object that decides how the device starts after power-on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Startup {
    /// An object of type UNSIGNED32.
    pub object: ObjectId,
    /// The value of the object if the device waits for the master.
    pub wait: u32,
    /// The value of the object if the device starts by itself.
    pub auto: u32,
    /// Contradictions and gaps in the manual.
    pub doubt: String,
}

/// The layout of an emergency in an entry of the error history (1003h:1 …).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ErrorHistory {
    /// CiA 301, 7.5.2.5: the code in bits 0 to 15; the upper half is manufacturer-specific.
    #[default]
    CodeLow,
    /// The code in bits 0 to 15, byte 4 of the emergency in bits 16 to 23, byte 3 in bits 24 to 31 (MH-4).
    CodeLowBytesSwapped,
    /// The code in bits 16 to 31 (HYDAC).
    CodeHigh,
}

impl ErrorHistory {
    /// Returns the emergency code of an entry, and bytes 3 and 4 of the emergency if the entry contains them.
    pub fn read(self, entry: u32) -> (u16, Option<[u8; 2]>) {
        let [a, b, c, d] = entry.to_le_bytes();
        match self {
            ErrorHistory::CodeLow => (u16::from_le_bytes([a, b]), None),
            ErrorHistory::CodeLowBytesSwapped => (u16::from_le_bytes([a, b]), Some([d, c])),
            ErrorHistory::CodeHigh => (u16::from_le_bytes([c, d]), None),
        }
    }
}

/// How a channel is set to zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Autozero {
    /// CiA 404 channel.
    pub channel: u8,
    /// The object to which the signature is written.
    pub object: ObjectId,
    /// The signature in wire order; "zero" in CiA 404.
    pub signature: Vec<u8>,
    /// The object that contains the resulting offset, in the unit of the process value.
    pub offset: Option<ObjectId>,
    /// How to recognise a sensor for absolute pressure, which reads 0 in a vacuum and not with a vented line.
    pub absolute: Option<Absolute>,
    /// The measuring range of the sensor, if it differs from the adjustable span.
    pub range: Option<Range>,
}

/// How to recognise a sensor that measures absolute pressure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Absolute {
    /// The object with the kind of the sensor.
    pub object: ObjectId,
    /// Its value for absolute pressure.
    pub value: u32,
}

/// The objects that contain a measuring range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Range {
    /// The object with the start of the range.
    pub start: ObjectId,
    /// The object with the end of the range.
    pub end: ObjectId,
    /// The object with the unit of start and end.
    pub unit: ObjectId,
}

/// The answers that identify a device. Each value that is given must agree. A description without values is used only
/// if the user names it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identify {
    /// 1000h, all 32 bits.
    pub device_type: Option<u32>,
    /// 1018h:1.
    pub vendor_id: Option<u32>,
    /// 1018h:2.
    pub product_code: Option<u32>,
    /// 1008h.
    pub device_name: Option<String>,
    /// Objects to read if the identity is not sufficient, and the values that they must have.
    pub confirm: BTreeMap<ObjectId, Scalar>,
}

impl Identify {
    /// Whether no value is given. The description then recognises no device.
    pub fn is_empty(&self) -> bool {
        self.identity_count() == 0 && self.confirm.is_empty()
    }

    /// The number of given values among device type, vendor-ID, product code and device name.
    pub fn identity_count(&self) -> usize {
        let numbers = [self.device_type, self.vendor_id, self.product_code];
        numbers.iter().flatten().count() + usize::from(self.device_name.is_some())
    }
}

/// Node-ID and bit rate of a new device.
#[derive(Clone, Debug, Default)]
pub struct Factory {
    /// Factory node-ID, if the manual gives it.
    pub node_id: Option<NodeId>,
    /// Factory bit rate in bit/s, if the manual gives it.
    pub bit_rate: Option<u32>,
}

/// How an SDO server behaves.
#[derive(Clone, Debug, Default)]
pub struct SdoStyle {
    /// Whether the server indicates sizes (43h, 4Bh …) or omits them (42h).
    pub size: SizeIndication,
    /// Whether the server supports expedited transfers only. Its strings then have at most four characters.
    pub expedited_only: bool,
    /// Whether the server supports block transfer.
    pub block: bool,
    /// The abort codes that the manual lists; empty if it lists none.
    pub aborts: Vec<u32>,
}

/// Whether the command specifier of an expedited transfer indicates the size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SizeIndication {
    /// The size is indicated (s = 1).
    #[default]
    Indicated,
    /// The size is omitted (s = 0): 22h in a download, 42h in the answer to an upload.
    Omitted,
}

/// How PDOs are configured.
#[derive(Clone, Copy, Debug, Default)]
pub struct PdoStyle {
    /// The step before the mapping can be changed.
    pub remap: Remap,
    /// The transmission type that uses the event timer, 254 or 255; `None` means that both use it.
    pub timer: Option<u8>,
}

impl PdoStyle {
    /// Whether a TPDO of this transmission type is sent by the event timer.
    pub fn uses_timer(&self, transmission: u8) -> bool {
        matches!(transmission, 254 | 255) && self.timer.is_none_or(|timer| timer == transmission)
    }
}

/// The step before a mapping can be changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Remap {
    /// CiA 301: set bit 31 of the COB-ID, then the number of entries to 0.
    #[default]
    Invalidate,
    /// In PRE-OPERATIONAL, set the number of entries to 0. Bit 31 is not needed, because the PDO is then empty.
    CountOnly,
}

/// One measured signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignalEntry {
    /// `pressure`, `temperature`, `ch1` …
    pub name: String,
    /// CiA 404 channel (the sub-index), 1 to 199. Signals without a channel are numbered from 200.
    pub channel: u8,
    /// The object that is read by SDO if no PDO contains the signal.
    pub value: ObjectId,
    /// The type of the value, if no `[[object]]` states it.
    pub data_type: Option<DataType>,
    /// Objects at other indices with the same quantity: 2090h of the D-20-9.
    pub also: Vec<ObjectId>,
    /// The object with the physical unit (6131h).
    pub unit: Option<ObjectId>,
    /// The unit, if it is fixed.
    pub fixed_unit: Option<Unit>,
    /// Factor and offset, if the description states them.
    pub scale: Option<Scale>,
    /// The object with the decimal digits of integer values (6132h).
    pub digits: Option<ObjectId>,
    /// The object with the status (6150h), if the device has one.
    pub status: Option<ObjectId>,
    /// The meanings of the bits of the status object, if they differ from 6150h.
    pub status_bits: Option<StatusBits>,
    /// Whether the device sends a marker instead of the value during an overload (REAL32 NaN, smallest integer).
    pub marker: bool,
    /// Other numbers that the device sends instead of a value.
    pub markers: Markers,
    /// Whether the manual warns that integers of 8, 16 or 24 bits may be clipped. Their largest number is then not a
    /// valid value.
    pub may_clip: bool,
    /// The object with the start of the measuring range (6148h), if the device has it.
    pub span_start: Option<ObjectId>,
    /// The object with the end of the measuring range (6149h), if the device has it.
    pub span_end: Option<ObjectId>,
}

impl SignalEntry {
    /// Every object that belongs to the signal, with its key in the description.
    pub fn objects(&self) -> impl Iterator<Item = (&'static str, ObjectId)> + '_ {
        let optional = [
            ("unit", self.unit),
            ("digits", self.digits),
            ("status", self.status),
            ("span_start", self.span_start),
            ("span_end", self.span_end),
        ];
        let optional = optional.into_iter().filter_map(|(key, object)| Some((key, object?)));
        [("value", self.value)].into_iter().chain(self.also.iter().map(|object| ("also", *object))).chain(optional)
    }
}

/// The meaning of one emergency code of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmergencyEntry {
    /// The emergency error code, bytes 0 and 1.
    pub code: u16,
    /// Its meaning.
    pub text: String,
    /// The bit of 1001h that is set by the error, 0 to 7.
    pub register_bit: Option<u8>,
    /// The whole error register (1001h), as printed in the manual.
    pub register: Option<u8>,
    /// The contents of bytes 3 to 7.
    pub bytes: Vec<String>,
    /// Whether the code reports a value outside the measuring range. Used as the status of signals without a status
    /// object.
    pub overload: bool,
}

impl EmergencyEntry {
    /// The value of the error register that identifies this error, if it is not 0.
    fn whole_register(&self) -> Option<u8> {
        self.register.filter(|&register| register != 0)
    }

    /// Returns the channel from bytes 3 to 7 of an emergency, if the description states which byte is the channel.
    pub fn channel(&self, bytes: [u8; 5]) -> Option<u8> {
        let mut meanings = self.bytes.iter().zip(bytes);
        meanings.find(|(meaning, _)| meaning.to_lowercase().contains("channel")).map(|(_, byte)| byte)
    }
}

impl Description {
    /// Returns the entry that describes `object`.
    pub fn object(&self, object: ObjectId) -> Option<&ObjectEntry> {
        self.objects.iter().find(|entry| entry.at.contains(object))
    }

    /// Returns the meaning of an emergency code on this device.
    pub fn emergency(&self, code: u16) -> Option<&EmergencyEntry> {
        self.emergencies.iter().find(|entry| entry.code == code)
    }

    /// The error register (1001h) during an overload, if no other error has the same register.
    pub fn overload_register(&self) -> Option<u8> {
        let register = self.emergencies.iter().find(|entry| entry.overload)?.register?;
        (self.emergencies.iter().filter(|entry| entry.register == Some(register)).count() == 1).then_some(register)
    }

    /// Returns the text for an error register: from the description if possible, otherwise the bit names of CiA 301.
    pub fn register_text(&self, bits: u8) -> String {
        let has_all = |register: u8| register != 0 && bits & register == register;
        // Every error sets bit 0. The error whose register is 1 is reported only if no other bit is set.
        let is_reported = |register: u8| has_all(register) && (register != 1 || bits == 1);
        let (mut texts, mut covered): (Vec<String>, u8) = (Vec::new(), 0);
        let registers: BTreeSet<u8> = self.emergencies.iter().filter_map(EmergencyEntry::whole_register).collect();
        for register in registers.into_iter().filter(|&register| is_reported(register)) {
            let with = self.emergencies.iter().filter(|entry| entry.whole_register() == Some(register));
            texts.push(with.map(|entry| entry.text.as_str()).collect::<Vec<_>>().join(" or "));
            covered |= register | 1;
        }
        if bits & !covered != 0 || bits == 0 {
            texts.push(ErrorRegister(bits & !covered).to_string());
        }
        texts.join(", ")
    }
}

/// Returns the text of an emergency: the meaning of its code, and the set bits of its error register. The bits are
/// omitted if the device always sends the same register with this code.
pub fn emergency_text(description: Option<&Description>, emergency: Emergency) -> String {
    let described = description.and_then(|description| description.emergency(emergency.code));
    let text = described.map_or_else(|| Emergency::class(emergency.code), |entry| &entry.text).to_owned();
    if described.is_some_and(|entry| entry.register.is_some()) {
        return text;
    }
    let register_text = |register: ErrorRegister| {
        description.map_or_else(|| register.to_string(), |description| description.register_text(register.0))
    };
    emergency.register.map(register_text).map_or(text.clone(), |bits| format!("{text}, {bits}"))
}
