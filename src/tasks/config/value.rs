//! Converts values of settings between the form of the device and the form of a file.

use super::problem::Problem;
use super::setting::{Form, Scale, Setting};
use crate::canopen::id::{CanId, NodeId, bit_rate};
use crate::canopen::pdo::{MappingEntry, Transmission};
use crate::canopen::value::{DataType, Value};
use crate::device::config_file::Item;
use crate::device::unit::Unit;
use crate::measure::sample::Number;
use crate::node::{Node, names};
use crate::tasks::pdo::{entry_of, text_of};
use crate::tasks::settings::{QuantityError, encode_quantity};

/// The value of a setting in the form of the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Content {
    /// The bytes of the object.
    Bytes(Vec<u8>),
    /// A part of an object, or a number without an object: identifier, flag, node-ID, bit rate.
    Number(u32),
    /// A mapping.
    Mapping(Vec<MappingEntry>),
}

/// The unit and the decimal digits of each signal, as far as known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scales {
    /// Units and digits in the order of the signals.
    pub signals: Vec<SignalScale>,
}

/// The unit and the decimal digits of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SignalScale {
    /// The unit; `None` if it is not known yet.
    pub unit: Option<Unit>,
    /// The decimal digits; `None` if they are not known yet.
    pub digits: Option<u8>,
    /// Whether the file sets the unit. A number without a unit is then in this unit.
    pub is_in_file: bool,
}

impl Scales {
    /// Returns the present units and digits of a node.
    pub fn of(node: &Node) -> Scales {
        let scale = |signal: &crate::measure::layout::Signal| SignalScale {
            unit: signal.unit,
            digits: signal.digits,
            is_in_file: false,
        };
        Scales { signals: node.signals.iter().map(scale).collect() }
    }

    fn get(&self, signal: usize) -> SignalScale {
        self.signals.get(signal).copied().unwrap_or_default()
    }
}

impl Setting {
    /// Converts a value to the form of a file.
    pub fn show(&self, node: &Node, scales: &Scales, content: &Content) -> Item {
        let number = match content {
            Content::Number(number) => u64::from(*number),
            Content::Mapping(entries) => {
                return Item::List(entries.iter().map(|&entry| text_of(node, entry)).collect());
            }
            Content::Bytes(bytes) => match self.decode(bytes).as_ref().and_then(Value::as_u64) {
                Some(number) if !matches!(self.form, Form::Plain | Form::Quantity(..)) => number,
                _ => return self.show_bytes(scales, bytes),
            },
        };
        let text = |text: String| Item::Text(text);
        match &self.form {
            Form::Hex => text(format!("0x{number:X}")),
            Form::Duration(tick) => text(duration_text(number, *tick)),
            Form::Unit(_) => {
                text(u32::try_from(number).map_or_else(|_| number.to_string(), |code| unit_text(Unit(code))))
            }
            Form::Words(words) => match words.iter().find(|(code, _)| *code == number) {
                Some((_, word)) => text(word.clone()),
                None => Item::Integer(number.into()),
            },
            Form::Transmission(timer) => match u8::try_from(number) {
                Ok(code) if code == *timer => text("timer".to_owned()),
                Ok(code @ 0..=240) => text(Transmission::from_code(code).to_string()),
                Ok(255) => text("event".to_owned()),
                _ => Item::Integer(number.into()),
            },
            Form::CobId(default) if number == u64::from(*default) => text("default".to_owned()),
            Form::CobId(_) => text(format!("0x{number:X}")),
            Form::Bit(..) => Item::Flag(number != 0),
            Form::BitRate if number.is_multiple_of(1000) => text(format!("{}k", number / 1000)),
            Form::Plain | Form::Quantity(..) | Form::Signals(_) | Form::NodeId | Form::BitRate => {
                Item::Integer(number.into())
            }
        }
    }

    fn decode(&self, bytes: &[u8]) -> Option<Value> {
        self.data_type.decode(bytes).ok()
    }

    fn show_bytes(&self, scales: &Scales, bytes: &[u8]) -> Item {
        let hex = || Item::Text(bytes.iter().fold("0x".to_owned(), |text, byte| format!("{text}{byte:02X}")));
        let Some(value) = self.decode(bytes) else { return hex() };
        if let Form::Quantity(signal, _) = self.form {
            let scale = scales.get(signal);
            let number = Number::from_value(&value, scale.digits.unwrap_or(0)).filter(|number| number.is_finite());
            if let Some(number) = number {
                let unit = scale.unit.map(unit_text).filter(|unit| !unit.is_empty());
                return Item::Text(unit.map_or_else(|| number.to_string(), |unit| format!("{number} {unit}")));
            }
        }
        match value {
            Value::Bool(bit) => Item::Flag(bit),
            Value::Unsigned(number) => Item::Integer(number.into()),
            Value::Integer(number) => Item::Integer(number.into()),
            // The shortest text that parses to the same REAL32.
            Value::Real32(number) => Item::Real(number.to_string().parse().unwrap_or(f64::from(number))),
            Value::Real64(number) => Item::Real(number),
            Value::Bytes(_) => hex(),
            value => Item::Text(value.to_string()),
        }
    }

    /// Converts a value of a file to the form of the device. Returns `None` if the unit or digits it depends on are
    /// unknown.
    ///
    /// # Errors
    /// The value has another form, does not fit, or its unit cannot be converted.
    pub fn read(&self, node: &Node, scales: &Scales, item: &Item) -> Result<Option<Content>, Problem> {
        let wrong = |expected: &'static str| Problem::Type { expected, found: item.kind() };
        match &self.form {
            Form::Plain => self.read_plain(node, item).map(Some),
            Form::Quantity(signal, scale) => self.read_quantity(scales.get(*signal), *scale, item),
            Form::Hex => self.encode_integer(number_of(item).ok_or_else(|| wrong("a number (0x180)"))?).map(Some),
            Form::Duration(tick) => {
                let Item::Text(text) = item else { return Err(wrong("a duration in quotes (\"100ms\")")) };
                self.encode_integer(parse_ticks(text, *tick)?).map(Some)
            }
            Form::Unit(signal) => {
                let Item::Text(text) = item else { return Err(wrong("a unit in quotes (\"bar\")")) };
                let unit = Unit::from_symbol(text).filter(|_| !text.is_empty());
                let unit = unit.ok_or_else(|| Problem::UnknownUnit { text: text.clone() })?;
                let present = signal.and_then(|signal| node.signals.get(signal)?.unit);
                self.encode_integer(present.map_or(unit, |present| unit.beside(present)).0.into()).map(Some)
            }
            Form::Words(words) => self.read_word(words, item).map(Some),
            Form::Transmission(timer) => self.encode_integer(parse_transmission(item, *timer)?.into()).map(Some),
            Form::CobId(default) => parse_cob_id(item, *default).map(|id| Some(Content::Number(id))),
            Form::Bit(..) => match item {
                Item::Flag(flag) => Ok(Some(Content::Number(u32::from(*flag)))),
                _ => Err(wrong("true or false")),
            },
            Form::Signals(_) => parse_mapping(node, item).map(Some),
            Form::NodeId => {
                let number = number_of(item).ok_or_else(|| wrong("a node-ID (1 to 127)"))?;
                let node = u8::try_from(number).ok().and_then(|number| NodeId::new(number).ok());
                let node = node.ok_or(Problem::Range { low: "1".to_owned(), high: "127".to_owned() })?;
                Ok(Some(Content::Number(node.get().into())))
            }
            Form::BitRate => {
                let Item::Text(text) = item else { return Err(wrong("a bit rate in quotes (\"250k\")")) };
                let rate = bit_rate(text).map_err(|_| Problem::NotABitRate { text: text.clone() })?;
                Ok(Some(Content::Number(rate)))
            }
        }
    }

    fn read_plain(&self, node: &Node, item: &Item) -> Result<Content, Problem> {
        let wrong = |expected: &'static str| Problem::Type { expected, found: item.kind() };
        let text = match (self.data_type, item) {
            (DataType::Boolean, Item::Flag(flag)) => flag.to_string(),
            (DataType::Boolean, _) => return Err(wrong("true or false")),
            (DataType::Unsigned(_) | DataType::Integer(_), Item::Integer(number)) => {
                return self.encode_integer(*number);
            }
            (DataType::Unsigned(_) | DataType::Integer(_), Item::Text(text)) if text.starts_with("0x") => text.clone(),
            (DataType::Unsigned(_) | DataType::Integer(_), Item::Text(text)) => {
                let word = names::word(node, self.object, self.data_type, text);
                return word.map(Content::Bytes).ok_or_else(|| wrong("an integer"));
            }
            (DataType::Unsigned(_) | DataType::Integer(_), _) => return Err(wrong("an integer")),
            (DataType::Real32 | DataType::Real64, Item::Integer(number)) => number.to_string(),
            (DataType::Real32 | DataType::Real64, Item::Real(number)) => number.to_string(),
            (DataType::Real32 | DataType::Real64, _) => return Err(wrong("a number")),
            (_, Item::Text(text)) => text.clone(),
            _ => return Err(wrong("text in quotes")),
        };
        self.data_type.encode_text(&text).map(Content::Bytes).map_err(Problem::Value)
    }

    fn encode_integer(&self, number: i128) -> Result<Content, Problem> {
        self.data_type.encode_text(&number.to_string()).map(Content::Bytes).map_err(Problem::Value)
    }

    fn read_word(&self, words: &[(u64, String)], item: &Item) -> Result<Content, Problem> {
        match item {
            Item::Text(text) => match words.iter().find(|(_, word)| word == text) {
                Some((code, _)) => self.encode_integer((*code).into()),
                None => {
                    let known = words.iter().map(|(_, word)| word.clone()).collect();
                    Err(Problem::Word { text: text.clone(), known })
                }
            },
            Item::Integer(number) => self.encode_integer(*number),
            _ => Err(Problem::Type { expected: "a word in quotes", found: item.kind() }),
        }
    }

    fn read_quantity(&self, target: SignalScale, scale: Scale, item: &Item) -> Result<Option<Content>, Problem> {
        let (number, unit) = match item {
            Item::Integer(number) => (number.to_string(), None),
            Item::Real(number) => (number.to_string(), None),
            Item::Text(text) => match text.split_once(' ') {
                None => (text.clone(), None),
                Some((number, unit)) => (number.to_owned(), Some(unit.trim())),
            },
            _ => {
                return Err(Problem::Type {
                    expected: "a number with unit in quotes (\"3.2 bar\")",
                    found: item.kind(),
                });
            }
        };
        let written: f64 = number.parse().map_err(|_| Problem::NotAQuantity { text: item.to_string() })?;
        if !written.is_finite() {
            return Err(Problem::NotAQuantity { text: item.to_string() });
        }
        let unit = match unit {
            None => None,
            Some(text) => Some(Unit::from_symbol(text).ok_or_else(|| Problem::UnknownUnit { text: text.to_owned() })?),
        };
        let is_integer = !matches!(self.data_type, DataType::Real32 | DataType::Real64);
        let Some(present) = target.unit else {
            let is_bare = unit.is_none() && !target.is_in_file;
            return if is_bare { Err(Problem::NoUnit) } else { Ok(None) };
        };
        let (number, is_converted) = match unit {
            Some(unit) if unit.beside(present) == present => (written, false),
            Some(unit) => {
                let unit = unit.beside(present);
                let zeros = if scale == Scale::Point { 1.0 } else { 0.0 };
                let number = unit.convert_with_zeros(written, present, zeros);
                (number.ok_or(Problem::OtherQuantity { from: unit, to: present })?, true)
            }
            None if target.is_in_file || present == Unit::NONE => (written, false),
            None => return Err(Problem::NoUnit),
        };
        let digits = match target.digits {
            None if is_integer => return Ok(None),
            digits => digits.unwrap_or(0),
        };
        // A converted number is rounded to the last digit of the device.
        let power = 10f64.powi(i32::from(digits));
        let number = if is_integer && is_converted { (number * power).round() / power } else { number };
        let bytes = encode_quantity(number, self.data_type, digits);
        bytes.map(|bytes| Some(Content::Bytes(bytes))).map_err(|error| match error {
            QuantityError::TooFine { digits, .. } => Problem::TooFine { digits },
            QuantityError::Value(error) => Problem::Value(error),
        })
    }
}

/// Returns the symbol of a unit, or its code if it has no symbol.
fn unit_text(unit: Unit) -> String {
    unit.to_string()
}

/// Parses a number that is written as an integer or as text.
fn number_of(item: &Item) -> Option<i128> {
    match item {
        Item::Integer(number) => Some(*number),
        Item::Text(text) => match text.strip_prefix("0x") {
            Some(digits) => i128::from_str_radix(digits, 16).ok(),
            None => text.parse().ok(),
        },
        _ => None,
    }
}

/// Formats a number of ticks as a duration. A tick is `tick` microseconds.
fn duration_text(count: u64, tick: u32) -> String {
    let microseconds = u128::from(count) * u128::from(tick);
    match microseconds {
        whole if whole.is_multiple_of(1000) => format!("{}ms", whole / 1000),
        part => format!("{part}us"),
    }
}

/// Parses a duration, and returns the number of ticks. A tick is `tick` microseconds.
fn parse_ticks(text: &str, tick: u32) -> Result<i128, Problem> {
    let duration = humantime::parse_duration(text).map_err(|_| Problem::NotADuration { text: text.to_owned() })?;
    let tick_nanos = 1000 * u128::from(tick);
    if !duration.as_nanos().is_multiple_of(tick_nanos) {
        return Err(Problem::DurationStep { tick });
    }
    i128::try_from(duration.as_nanos() / tick_nanos).map_err(|_| Problem::NotADuration { text: text.to_owned() })
}

fn parse_transmission(item: &Item, timer: u8) -> Result<u8, Problem> {
    let wrong = || Problem::Transmission { text: item.to_string() };
    match item {
        Item::Integer(number) => u8::try_from(*number).map_err(|_| wrong()),
        Item::Text(text) => match text.as_str() {
            "acyclic" => Ok(0),
            "event" => Ok(255),
            "timer" => Ok(timer),
            text => {
                let every = text.strip_prefix("sync:").and_then(|every| every.parse().ok());
                every.filter(|every| (1..=240).contains(every)).ok_or_else(wrong)
            }
        },
        _ => Err(wrong()),
    }
}

fn parse_cob_id(item: &Item, default: u16) -> Result<u32, Problem> {
    if *item == Item::Text("default".to_owned()) {
        return Ok(default.into());
    }
    let wrong = || Problem::NotACobId { text: item.to_string() };
    let id = number_of(item).and_then(|number| u16::try_from(number).ok()).filter(|id| *id <= 0x7ff);
    let id = id.ok_or_else(wrong)?;
    match CanId::standard(id) {
        Some(can) if can.is_restricted() && id != 0x80 => Err(Problem::Restricted { id }),
        _ => Ok(id.into()),
    }
}

fn parse_mapping(node: &Node, item: &Item) -> Result<Content, Problem> {
    let list = match item {
        Item::List(list) => list.as_slice(),
        Item::Text(text) => std::slice::from_ref(text),
        _ => {
            let expected = "a list of signals ([\"pressure\", \"pressure.status\"])";
            return Err(Problem::Type { expected, found: item.kind() });
        }
    };
    let entry = |text: &String| entry_of(node, text).map_err(|cause| Problem::Mapping(Box::new(cause)));
    let entries: Vec<MappingEntry> = list.iter().map(entry).collect::<Result<_, _>>()?;
    let bits: u32 = entries.iter().map(|entry| u32::from(entry.bits)).sum();
    if bits > 64 { Err(Problem::Bits { bits }) } else { Ok(Content::Mapping(entries)) }
}
