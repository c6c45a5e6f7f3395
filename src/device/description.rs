//! Device descriptions as data: what one TOML file in `devices/` says about one kind of device.
//!
//! Unknown keys are errors, so that a typing error in a description is never silently ignored.

use super::assign::AssignEntry;
use crate::canopen::id::{NodeId, parse_u32};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Everything that is known of one kind of device.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// The short name for `--device`, `sim:` and the DEVICE column: `mh4`.
    pub name: String,
    /// The name on the label: `WIKA MH-4-CAN`.
    pub title: String,
    /// Who makes it: `WIKA`.
    pub vendor: String,
    /// Where the facts come from.
    pub source: String,
    /// What the device must answer to be recognised as this kind.
    pub identify: Identify,
    /// As delivered.
    #[serde(default)]
    pub factory: Factory,
    /// How its SDO server behaves.
    #[serde(default)]
    pub sdo: SdoStyle,
    /// How its PDOs are configured.
    #[serde(default)]
    pub pdo: PdoStyle,
    /// Deviations from the standard that code has to know about.
    #[serde(default)]
    pub quirks: Vec<super::quirk::Quirk>,
    /// How an entry of its error history (1003h) is laid out.
    #[serde(default)]
    pub error_history: ErrorHistory,
    /// Index of the LSS bit rate table to bit rate in bit/s.
    #[serde(default)]
    pub bit_rates: BTreeMap<String, u32>,
    /// Index that stands for automatic bit rate detection, if the device has one.
    pub auto_bit_rate: Option<u8>,
    /// The ways to a new node-ID and bit rate, the one to take first.
    #[serde(default)]
    pub assign: Vec<AssignEntry>,
    /// Which object decides who starts it after power on.
    pub startup: Option<Startup>,
    /// How its channels are set to zero; none that are not named.
    #[serde(default)]
    pub autozero: Vec<Autozero>,
    /// What it measures.
    #[serde(default, rename = "signal")]
    pub signals: Vec<SignalEntry>,
    /// The object dictionary.
    #[serde(default, rename = "object")]
    pub objects: Vec<ObjectEntry>,
    /// What its emergency codes mean.
    #[serde(default, rename = "emcy")]
    pub emergencies: Vec<EmergencyEntry>,
    /// What the simulator needs beyond the manual.
    #[serde(default)]
    pub sim: SimEntry,
}

/// Which object decides who starts the device after power on.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Startup {
    /// Where it stands, an UNSIGNED32.
    pub object: ObjectId,
    /// The device waits for the master.
    pub wait: u32,
    /// The device starts itself.
    pub auto: u32,
    /// What the manual contradicts or leaves open.
    #[serde(default)]
    pub doubt: String,
}

/// How an entry of the error history (1003h:1 …) holds an emergency.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorHistory {
    /// CiA 301, 7.5.2.5: the code in bits 0 to 15; what the upper half says is the manufacturer's secret.
    #[default]
    CodeLow,
    /// The code in bits 0 to 15, byte 4 of the emergency in 16 to 23 and byte 3 in 24 to 31 (MH-4).
    CodeLowBytesSwapped,
    /// The code in bits 16 to 31 (HYDAC).
    CodeHigh,
}

impl ErrorHistory {
    /// The emergency code of an entry, and bytes 3 and 4 of the emergency where the entry holds them.
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
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Autozero {
    /// CiA 404 channel.
    pub channel: u8,
    /// Where the signature is written.
    pub object: ObjectId,
    /// The bytes of the signature in the order in which they go over the wire; "zero" by CiA 404.
    #[serde(default = "zero")]
    pub signature: String,
    /// Where the offset then stands, in the unit of the process value.
    pub offset: Option<ObjectId>,
    /// What tells whether the sensor measures against vacuum, where a zero is no vented line.
    pub absolute: Option<Absolute>,
    /// The measuring range as it was built, where the device has it beside its span, which can be set.
    pub range: Option<Range>,
}

/// What tells that a sensor measures absolute pressure.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Absolute {
    /// The kind of the sensor.
    pub object: ObjectId,
    /// Its number for absolute pressure.
    pub value: u32,
}

/// Where a measuring range stands.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Its start.
    pub start: ObjectId,
    /// Its end.
    pub end: ObjectId,
    /// The unit of both.
    pub unit: ObjectId,
}

fn zero() -> String {
    "zero".to_owned()
}

/// What a device answers that tells its kind; everything given must agree. Where nothing is given nothing is
/// recognised: such a description is taken only when it is named.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identify {
    /// 1000h, all 32 bits.
    pub device_type: Option<u32>,
    /// 1018h:1.
    pub vendor_id: Option<u32>,
    /// 1018h:2.
    pub product_code: Option<u32>,
    /// 1008h.
    pub device_name: Option<String>,
    /// Objects to read where all of the above is not proof enough, and what they must hold.
    #[serde(default)]
    pub confirm: BTreeMap<ObjectId, Scalar>,
}

impl Identify {
    /// Whether nothing is given: then nothing is recognised.
    pub fn is_empty(&self) -> bool {
        let Identify { device_type, vendor_id, product_code, device_name, confirm } = self;
        let numbers = [device_type, vendor_id, product_code];
        numbers.iter().all(|number| number.is_none()) && device_name.is_none() && confirm.is_empty()
    }
}

/// The settings of a new device.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factory {
    /// Node-ID as delivered, where the manual says.
    pub node_id: Option<NodeId>,
    /// Bit rate as delivered in bit/s, where the manual says.
    pub bit_rate: Option<u32>,
}

/// How an SDO server behaves.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SdoStyle {
    /// Whether it indicates sizes (43h, 4Bh …) or omits them (42h).
    #[serde(default)]
    pub size: SizeIndication,
    /// Whether it has no segmented transfer, so that strings have at most four characters.
    #[serde(default)]
    pub expedited_only: bool,
    /// Whether it knows block transfer.
    #[serde(default)]
    pub block: bool,
    /// The abort codes that its manual lists; empty where none are printed.
    #[serde(default)]
    pub aborts: Vec<u32>,
}

/// Whether the command specifier of an expedited transfer tells the size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SizeIndication {
    /// s = 1.
    #[default]
    Indicated,
    /// s = 0: 22h to write, 42h as the answer to a read.
    Omitted,
}

/// How PDOs are configured.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PdoStyle {
    /// What has to be done before the mapping can be changed.
    #[serde(default)]
    pub remap: Remap,
    /// The transmission type by which the event timer sends, 254 or 255; 254 where the description does not say.
    pub timer: Option<u8>,
}

/// What has to be done before a mapping can be changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Remap {
    /// CiA 301: bit 31 of the COB-ID set, then the number of entries 0.
    #[default]
    Invalidate,
    /// The number of entries 0, in PRE-OPERATIONAL; meanwhile the PDO has no bytes. Bit 31 is not needed.
    CountOnly,
}

/// One measured quantity.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalEntry {
    /// `pressure`, `temperature`, `ch1` …; with `channels`, `ch{n}` stands for each of them.
    pub name: String,
    /// CiA 404 channel (the sub-index), 1 to 199.
    pub channel: u8,
    /// The object that is read by SDO when no PDO decides.
    pub value: ObjectId,
    /// The same quantity under other indices than x130h: D-20-9's 2090h.
    #[serde(default)]
    pub also: Vec<ObjectId>,
    /// Where the physical unit stands (6131h).
    pub unit: Option<ObjectId>,
    /// Where the decimal digits of integer values stand (6132h).
    pub digits: Option<ObjectId>,
    /// Where the status stands (6150h), if the device has one.
    pub status: Option<ObjectId>,
    /// Whether an overload shows in the value itself (REAL32 NaN, smallest integer).
    #[serde(default)]
    pub marker: bool,
    /// Measuring range start (6148h), if the device has it.
    pub span_start: Option<ObjectId>,
    /// Measuring range end (6149h), if the device has it.
    pub span_end: Option<ObjectId>,
}

/// One entry of the object dictionary, or a run of sub-indices alike.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectEntry {
    /// `0x1000`, `0x1018:1`, or `0x6130:1-16` for a run.
    pub at: String,
    /// In lower case with hyphens: `producer-heartbeat-time`.
    pub name: String,
    /// Data type, in the names of CiA 309-3.
    #[serde(rename = "type", deserialize_with = "from_text")]
    pub data_type: DataType,
    /// Access by SDO.
    pub access: Access,
    /// Value as delivered: a number, text, or `$NODEID+0x180`.
    pub default: Option<Scalar>,
    /// Lowest value allowed.
    pub low: Option<Scalar>,
    /// Highest value allowed.
    pub high: Option<Scalar>,
    /// Values and ranges allowed, where they are not one range: `["0-240", "254", "0x004E0000"]`.
    #[serde(default)]
    pub allow: Vec<String>,
    /// What numbers mean, in decimal or hexadecimal: `{ "0" = "none", "0x004E0000" = "bar" }`.
    #[serde(default)]
    pub values: BTreeMap<String, String>,
    /// The signature that must be written: `save`, `load`, `zero`, `set`.
    pub signature: Option<String>,
    /// Objects that must all be 0 before this one can be written with anything else: heartbeat and node
    /// guarding exclude each other on some devices.
    #[serde(default)]
    pub only_if_zero: Vec<ObjectId>,
    /// Whether a TPDO may carry it.
    #[serde(default)]
    pub pdo: bool,
    /// Unit of the number, where it is fixed: `ms`, `100us`.
    pub unit: Option<String>,
    /// The channel whose physical unit (6131h) its number is in, for objects of which CiA 404 does not say so.
    pub follows_unit: Option<u8>,
    /// The object that holds the code of its unit (as 6131h), where that is not the channel's present one.
    pub unit_at: Option<ObjectId>,
    /// Which store group keeps it: `comm`, `app`, `all`; absent when 1010h does not.
    pub stored: Option<String>,
    /// What it is and does, in one or two sentences.
    #[serde(default)]
    pub text: String,
    /// Page or table of the manual.
    #[serde(default)]
    pub page: String,
    /// What the manual contradicts or leaves open.
    #[serde(default)]
    pub doubt: String,
}

impl Description {
    /// The entry that describes `object`, be it of a run.
    pub fn object(&self, object: ObjectId) -> Option<&ObjectEntry> {
        self.objects.iter().find(|entry| entry.objects().is_ok_and(|mut objects| objects.any(|other| other == object)))
    }

    /// What an emergency code means on this device.
    pub fn emergency(&self, code: u16) -> Option<&EmergencyEntry> {
        self.emergencies.iter().find(|entry| entry.code == code)
    }
}

impl ObjectEntry {
    /// The object that the entry stands for, or every one of a run of sub-indices.
    ///
    /// # Errors
    /// An address that is none, in words.
    pub fn objects(&self) -> Result<impl Iterator<Item = ObjectId>, String> {
        let run = self.at.split_once(':').and_then(|(_, subs)| subs.split_once('-'));
        let (first, last) = match run {
            Some((_, last)) => {
                let start = self.at.rsplit_once('-').map_or("", |(start, _)| start);
                let last: u8 = last.parse().map_err(|_| format!("\"{}\" is not an object or a run", self.at))?;
                (start, Some(last))
            }
            None => (self.at.as_str(), None),
        };
        let first: ObjectId = first.parse().map_err(|error| format!("{error}"))?;
        Ok((first.sub..=last.unwrap_or(first.sub)).map(move |sub| first.with_sub(sub)))
    }

    /// Whether the entry stands for a run of sub-indices, be it of one.
    pub fn is_run(&self) -> bool {
        self.at.split_once(':').is_some_and(|(_, subs)| subs.contains('-'))
    }

    /// What a number in this object means, where the description says.
    pub fn meaning(&self, number: u64) -> Option<&str> {
        let is = |key: &str| parse_u32(key).is_some_and(|key| u64::from(key) == number);
        self.values.iter().find(|(key, _)| is(key)).map(|(_, meaning)| meaning.as_str())
    }

    /// Whether `number` lies within the limits and, where values are listed, is one of them.
    pub fn allows(&self, number: f64) -> bool {
        let limit = |scalar: &Option<Scalar>| match scalar {
            Some(Scalar::Integer(limit)) => Some(*limit as f64),
            Some(Scalar::Real(limit)) => Some(*limit),
            Some(Scalar::Text(_)) | None => None,
        };
        limit(&self.low).is_none_or(|low| low <= number)
            && limit(&self.high).is_none_or(|high| number <= high)
            && (self.allow.is_empty()
                || self.allow.iter().any(|listed| {
                    parse_range(listed).is_some_and(|(low, high)| f64::from(low) <= number && number <= f64::from(high))
                }))
    }
}

/// `254` or `0-240`: the lowest and the highest number of one part of `allow`.
pub(crate) fn parse_range(text: &str) -> Option<(u32, u32)> {
    let (low, high) = text.split_once('-').unwrap_or((text, text));
    let (low, high) = (parse_u32(low)?, parse_u32(high)?);
    (low <= high).then_some((low, high))
}

/// How an entry can be accessed by SDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Access {
    /// Read only.
    Ro,
    /// Write only.
    Wo,
    /// Read and write.
    Rw,
    /// Read only, and never changes.
    Const,
}

impl Access {
    /// Whether an SDO upload is allowed.
    pub fn is_readable(self) -> bool {
        self != Access::Wo
    }

    /// Whether an SDO download is allowed.
    pub fn is_writable(self) -> bool {
        matches!(self, Access::Rw | Access::Wo)
    }
}

/// A number or text in a description.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Scalar {
    /// An integer.
    Integer(i64),
    /// A number with a fraction.
    Real(f64),
    /// Text, or a `$NODEID` formula.
    Text(String),
}

/// What one emergency code of a device means.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EmergencyEntry {
    /// The emergency error code, bytes 0 and 1.
    pub code: u16,
    /// In words.
    pub text: String,
    /// The bit of 1001h that goes with it, 0 to 7.
    pub register_bit: Option<u8>,
    /// The whole register as the manual prints it.
    pub register: Option<u8>,
    /// What bytes 3 to 7 hold.
    #[serde(default)]
    pub bytes: Vec<String>,
}

/// What the simulator needs beyond the manual: numbers that a real device has and no manual prints.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimEntry {
    /// 1018h:4 of the first device; the next ones count up.
    #[serde(default)]
    pub serial: u32,
    /// How often a new value is there, in microseconds; 1 ms if the manual does not say.
    pub sample_us: Option<u32>,
    /// Whether a repeating average is that of the samples since the last PDO, instead of 61A1h samples.
    #[serde(default)]
    pub mean_until_pdo: bool,
    /// How far beyond the measuring range an overload begins, in percent of the range.
    #[serde(default)]
    pub overload_percent: f64,
    /// The emergency of an overload, if it raises one.
    pub overload_emcy: Option<u16>,
    /// What its LSS slave knows.
    #[serde(default)]
    pub lss: SimLss,
    /// The measured quantities, one per signal.
    #[serde(default, rename = "channel")]
    pub channels: Vec<SimChannel>,
}

/// What the LSS slave of a simulated device knows.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimLss {
    /// The services, by the command specifier of the request; all of CiA 305 if there are none.
    #[serde(default)]
    pub services: Vec<u8>,
    /// The NMT states in which it listens to LSS; all if there are none.
    #[serde(default)]
    pub states: Vec<SimState>,
    /// Whether the answer to the selective switch tells the mode (44h 01h) instead of nothing.
    #[serde(default)]
    pub tells_mode: bool,
}

/// An NMT state of a simulated device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SimState {
    /// STOPPED.
    Stopped,
    /// PRE-OPERATIONAL.
    PreOperational,
    /// OPERATIONAL.
    Operational,
}

/// How a simulated quantity moves: a slow sine with noise.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimChannel {
    /// The CiA 404 channel.
    pub channel: u8,
    /// Unit code of `base`, `amplitude`, `noise`, `start` and `end` (6131h).
    pub unit: u32,
    /// The middle.
    pub base: f64,
    /// The swing to both sides.
    pub amplitude: f64,
    /// Length of one swing in seconds.
    pub period_s: f64,
    /// Width of the noise to both sides.
    pub noise: f64,
    /// Start of the measuring range.
    pub start: f64,
    /// End of the measuring range.
    pub end: f64,
    /// The field value (x100h) at the start and at the end of the range; CiA 404's 0 and 10000 else.
    pub field: Option<[f64; 2]>,
}

pub(super) fn from_text<'de, D, T>(deserializer: D) -> Result<T, D::Error>
where
    D: serde::Deserializer<'de>,
    T: std::str::FromStr,
    T::Err: std::fmt::Display,
{
    let text = String::deserialize(deserializer)?;
    text.parse().map_err(serde::de::Error::custom)
}

impl<'de> Deserialize<'de> for NodeId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<NodeId, D::Error> {
        NodeId::new(u8::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}

impl<'de> Deserialize<'de> for ObjectId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<ObjectId, D::Error> {
        from_text(deserializer)
    }
}
