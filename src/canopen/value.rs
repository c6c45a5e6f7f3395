//! Data types of CiA 301 (7.1.6, 7.4.7) and their values: decoding bytes, parsing and formatting text.

use std::fmt;
use std::str::FromStr;

/// A data type of the object dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DataType {
    /// BOOLEAN: one byte in an SDO.
    Boolean,
    /// UNSIGNED8 to UNSIGNED64, with the size in bytes: 1 to 8.
    Unsigned(u8),
    /// INTEGER8 to INTEGER64, with the size in bytes: 1 to 8.
    Integer(u8),
    /// REAL32.
    Real32,
    /// REAL64.
    Real64,
    /// VISIBLE_STRING.
    VisibleString,
    /// OCTET_STRING.
    OctetString,
    /// UNICODE_STRING: UTF-16, little endian.
    UnicodeString,
    /// TIME_OF_DAY: milliseconds after midnight (28 bits), days since 1984-01-01 (16 bits).
    TimeOfDay,
    /// TIME_DIFFERENCE: milliseconds (28 bits), days (16 bits).
    TimeDifference,
    /// DOMAIN: any number of bytes.
    Domain,
}

impl DataType {
    /// The size of a value in bytes; `None` if the type has no fixed size.
    pub fn width(self) -> Option<usize> {
        match self {
            DataType::Boolean => Some(1),
            DataType::Unsigned(bytes) | DataType::Integer(bytes) => Some(usize::from(bytes)),
            DataType::Real32 => Some(4),
            DataType::Real64 => Some(8),
            DataType::TimeOfDay | DataType::TimeDifference => Some(6),
            DataType::VisibleString | DataType::OctetString | DataType::UnicodeString | DataType::Domain => None,
        }
    }

    /// Whether a value of this type is a number or a bit.
    pub fn is_number(self) -> bool {
        use DataType::{Boolean, Integer, Real32, Real64, Unsigned};
        matches!(self, Boolean | Unsigned(_) | Integer(_) | Real32 | Real64)
    }

    /// Returns the type with this code (CiA 301, table 44), as used in EDS files.
    pub fn from_code(code: u16) -> Option<DataType> {
        Some(match code {
            0x01 => DataType::Boolean,
            0x02 => DataType::Integer(1),
            0x03 => DataType::Integer(2),
            0x04 => DataType::Integer(4),
            0x05 => DataType::Unsigned(1),
            0x06 => DataType::Unsigned(2),
            0x07 => DataType::Unsigned(4),
            0x08 => DataType::Real32,
            0x09 => DataType::VisibleString,
            0x0a => DataType::OctetString,
            0x0b => DataType::UnicodeString,
            0x0c => DataType::TimeOfDay,
            0x0d => DataType::TimeDifference,
            0x0f => DataType::Domain,
            0x10 => DataType::Integer(3),
            0x11 => DataType::Real64,
            0x12 => DataType::Integer(5),
            0x13 => DataType::Integer(6),
            0x14 => DataType::Integer(7),
            0x15 => DataType::Integer(8),
            0x16 => DataType::Unsigned(3),
            0x18 => DataType::Unsigned(5),
            0x19 => DataType::Unsigned(6),
            0x1a => DataType::Unsigned(7),
            0x1b => DataType::Unsigned(8),
            _ => return None,
        })
    }

    /// Decodes a value of this type. `bytes` must contain the value and nothing else.
    ///
    /// # Errors
    /// The type has a fixed size, and the size of `bytes` is different.
    pub fn decode(self, bytes: &[u8]) -> Result<Value, WidthError> {
        if let Some(width) = self.width()
            && width != bytes.len()
        {
            return Err(WidthError { expected: width, found: bytes.len() });
        }
        let mut wide = [0u8; 8];
        if bytes.len() <= 8 {
            wide[..bytes.len()].copy_from_slice(bytes);
        }
        let unsigned = u64::from_le_bytes(wide);
        Ok(match self {
            DataType::Boolean => Value::Bool(unsigned != 0),
            DataType::Unsigned(_) => Value::Unsigned(unsigned),
            DataType::Integer(width) => Value::Integer(sign_extend(unsigned, width)),
            DataType::Real32 => Value::Real32(f32::from_le_bytes([wide[0], wide[1], wide[2], wide[3]])),
            DataType::Real64 => Value::Real64(f64::from_le_bytes(wide)),
            DataType::VisibleString => Value::Text(latin1(bytes)),
            DataType::UnicodeString => Value::Text(utf16(bytes)),
            DataType::OctetString | DataType::Domain => Value::Bytes(bytes.to_vec()),
            DataType::TimeOfDay => Value::TimeOfDay(CanTime::from_bytes(&wide)),
            DataType::TimeDifference => Value::TimeDifference(CanTime::from_bytes(&wide)),
        })
    }
}

/// Extends the sign of a two's complement number with `width` bytes.
fn sign_extend(unsigned: u64, width: u8) -> i64 {
    let unused = 64 - 8 * u32::from(width.clamp(1, 8));
    (unsigned << unused).cast_signed() >> unused
}

/// Decodes a VISIBLE_STRING. The standard requires ISO 646, but devices send Latin-1: each byte is a character.
/// Trailing zeros are removed: an expedited answer has four bytes even if the string is shorter.
fn latin1(bytes: &[u8]) -> String {
    let end = bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    bytes[..end].iter().map(|&byte| char::from(byte)).collect()
}

fn utf16(bytes: &[u8]) -> String {
    let units = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let text: String = char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    text.trim_end_matches('\0').to_owned()
}

impl fmt::Display for DataType {
    /// The name from CiA 309-3: `u8`, `i16`, `r32`, `vs` …
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DataType::Boolean => f.write_str("b"),
            DataType::Unsigned(bytes) => write!(f, "u{}", 8 * bytes),
            DataType::Integer(bytes) => write!(f, "i{}", 8 * bytes),
            DataType::Real32 => f.write_str("r32"),
            DataType::Real64 => f.write_str("r64"),
            DataType::VisibleString => f.write_str("vs"),
            DataType::OctetString => f.write_str("os"),
            DataType::UnicodeString => f.write_str("us"),
            DataType::TimeOfDay => f.write_str("t"),
            DataType::TimeDifference => f.write_str("td"),
            DataType::Domain => f.write_str("d"),
        }
    }
}

/// Text that is not the name of a data type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is not a type (b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex)")]
pub struct DataTypeError(String);

impl FromStr for DataType {
    type Err = DataTypeError;

    /// Parses the names of CiA 309-3 and the aliases `bool`, `f32`, `f64`, `str`, `hex`.
    fn from_str(text: &str) -> Result<DataType, DataTypeError> {
        Ok(match text {
            "b" | "bool" => DataType::Boolean,
            "r32" | "f32" => DataType::Real32,
            "r64" | "f64" => DataType::Real64,
            "vs" | "str" => DataType::VisibleString,
            "os" | "hex" => DataType::OctetString,
            "us" => DataType::UnicodeString,
            "t" => DataType::TimeOfDay,
            "td" => DataType::TimeDifference,
            "d" => DataType::Domain,
            _ => {
                let bytes = match text.get(1..) {
                    Some("8") => 1,
                    Some("16") => 2,
                    Some("24") => 3,
                    Some("32") => 4,
                    Some("40") => 5,
                    Some("48") => 6,
                    Some("56") => 7,
                    Some("64") => 8,
                    _ => return Err(DataTypeError(text.to_owned())),
                };
                match text.as_bytes().first() {
                    Some(b'u') => DataType::Unsigned(bytes),
                    Some(b'i') => DataType::Integer(bytes),
                    _ => return Err(DataTypeError(text.to_owned())),
                }
            }
        })
    }
}

/// TIME_OF_DAY or TIME_DIFFERENCE (CiA 301, 7.1.6.6 and 7.1.6.7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanTime {
    /// Milliseconds (28 bits) since midnight, or of a time difference.
    pub milliseconds: u32,
    /// Days since 1984-01-01, or of a time difference.
    pub days: u16,
}

impl CanTime {
    fn from_bytes(bytes: &[u8; 8]) -> CanTime {
        CanTime {
            milliseconds: u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) & 0x0fff_ffff,
            days: u16::from_le_bytes([bytes[4], bytes[5]]),
        }
    }

    fn to_bytes(self) -> [u8; 6] {
        let [a, b, c, d] = (self.milliseconds & 0x0fff_ffff).to_le_bytes();
        let [e, f] = self.days.to_le_bytes();
        [a, b, c, d, e, f]
    }
}

/// A value of the object dictionary.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// BOOLEAN.
    Bool(bool),
    /// UNSIGNED8 to UNSIGNED64.
    Unsigned(u64),
    /// INTEGER8 to INTEGER64.
    Integer(i64),
    /// REAL32.
    Real32(f32),
    /// REAL64.
    Real64(f64),
    /// VISIBLE_STRING or UNICODE_STRING.
    Text(String),
    /// OCTET_STRING or DOMAIN.
    Bytes(Vec<u8>),
    /// TIME_OF_DAY.
    TimeOfDay(CanTime),
    /// TIME_DIFFERENCE.
    TimeDifference(CanTime),
}

impl Value {
    /// Returns the number as a REAL64; `None` if the value is not a number. Integers above 2^53 are rounded.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Value::Unsigned(number) => Some(*number as f64),
            Value::Integer(number) => Some(*number as f64),
            Value::Real32(number) => Some(f64::from(*number)),
            Value::Real64(number) => Some(*number),
            _ => None,
        }
    }

    /// Returns the value as an unsigned integer; `None` if it is negative or not an integer. `true` is 1.
    pub fn as_u64(&self) -> Option<u64> {
        match self {
            Value::Bool(bit) => Some(u64::from(*bit)),
            Value::Unsigned(number) => Some(*number),
            Value::Integer(number) => u64::try_from(*number).ok(),
            _ => None,
        }
    }
}

impl fmt::Display for Value {
    /// Prints integers in decimal, bytes in hexadecimal, and text unchanged. A real is printed as the shortest text
    /// that parses to the same number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Bool(bit) => write!(f, "{}", u8::from(*bit)),
            Value::Unsigned(number) => write!(f, "{number}"),
            Value::Integer(number) => write!(f, "{number}"),
            Value::Real32(number) => {
                write_real(f, *number, number.abs() != 0.0 && !(1e-5..1e16).contains(&number.abs()))
            }
            Value::Real64(number) => {
                write_real(f, *number, number.abs() != 0.0 && !(1e-5..1e16).contains(&number.abs()))
            }
            Value::Text(text) => f.write_str(text),
            Value::Bytes(bytes) => bytes.iter().try_for_each(|byte| write!(f, "{byte:02X}")),
            Value::TimeOfDay(time) => {
                let days = u64::from(DAYS_1970_TO_1984) + u64::from(time.days);
                let since_epoch = std::time::Duration::from_secs(days * 86_400)
                    + std::time::Duration::from_millis(u64::from(time.milliseconds));
                let moment = std::time::SystemTime::UNIX_EPOCH + since_epoch;
                write!(f, "{}", humantime::format_rfc3339_millis(moment))
            }
            Value::TimeDifference(time) => {
                let length = std::time::Duration::from_secs(u64::from(time.days) * 86_400)
                    + std::time::Duration::from_millis(u64::from(time.milliseconds));
                write!(f, "{}", humantime::format_duration(length))
            }
        }
    }
}

/// Days between the Unix epoch and the CANopen epoch, 1984-01-01.
const DAYS_1970_TO_1984: u16 = 5113;

/// Writes very large and very small numbers in scientific notation.
fn write_real<T: fmt::Display + fmt::LowerExp>(f: &mut fmt::Formatter<'_>, number: T, scientific: bool) -> fmt::Result {
    let text = number.to_string();
    if scientific && text != "inf" && text != "-inf" && text != "NaN" {
        write!(f, "{number:e}")
    } else {
        f.write_str(&text)
    }
}

/// A value that does not have the width of its type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} bytes, but the type has {expected}")]
pub struct WidthError {
    /// Bytes of the type.
    pub expected: usize,
    /// Bytes found.
    pub found: usize,
}

/// Text that is not a value of the type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ValueError {
    /// The text does not have the form of the type.
    #[error("\"{text}\" is not a value of type {data_type}")]
    Form {
        /// The typed text.
        text: String,
        /// The requested type.
        data_type: DataType,
    },
    /// A number outside the type's range.
    #[error("{text} does not fit {data_type} ({low} to {high})")]
    Range {
        /// The typed text.
        text: String,
        /// The requested type.
        data_type: DataType,
        /// The lowest number of the type.
        low: String,
        /// The highest number of the type.
        high: String,
    },
}

impl DataType {
    /// Encodes a value that a user typed: decimal, `0x…` (for signed integers also the bit pattern), `-5`, `1.25e3`,
    /// text, hexadecimal bytes, RFC 3339 for times, `1h30m` for time differences.
    ///
    /// # Errors
    /// [`ValueError::Form`] if the text has another form, [`ValueError::Range`] if the type cannot hold the number.
    /// Values are never truncated.
    pub fn encode_text(self, text: &str) -> Result<Vec<u8>, ValueError> {
        let form = || ValueError::Form { text: text.to_owned(), data_type: self };
        match self {
            DataType::Boolean => match text {
                "0" | "false" => Ok(vec![0]),
                "1" | "true" => Ok(vec![1]),
                _ => Err(form()),
            },
            DataType::Unsigned(width) => {
                let high = u64::MAX >> (64 - 8 * u32::from(width));
                let number = parse_integer(text).ok_or_else(form)?;
                match u64::try_from(number) {
                    Ok(number) if number <= high => Ok(number.to_le_bytes()[..usize::from(width)].to_vec()),
                    _ => Err(self.range(text, 0, i128::from(high))),
                }
            }
            DataType::Integer(width) => {
                let high = i64::MAX >> (64 - 8 * u32::from(width));
                let low = -high - 1;
                let number = parse_integer(text).ok_or_else(form)?;
                let pattern_high = u64::MAX >> (64 - 8 * u32::from(width));
                if is_hexadecimal(text) && number > i128::from(high) && number <= i128::from(pattern_high) {
                    return Ok(number.to_le_bytes()[..usize::from(width)].to_vec());
                }
                match i64::try_from(number) {
                    Ok(number) if (low..=high).contains(&number) => {
                        Ok(number.to_le_bytes()[..usize::from(width)].to_vec())
                    }
                    _ => Err(self.range(text, i128::from(low), i128::from(high))),
                }
            }
            DataType::Real32 => {
                let wide: f64 = parse_real(text).ok_or_else(form)?;
                let number: f32 = text.parse().map_err(|_| form())?;
                if number.is_infinite() && wide.is_finite() {
                    return Err(ValueError::Range {
                        text: text.to_owned(),
                        data_type: self,
                        low: format!("{:e}", f32::MIN),
                        high: format!("{:e}", f32::MAX),
                    });
                }
                Ok(number.to_le_bytes().to_vec())
            }
            DataType::Real64 => Ok(parse_real(text).ok_or_else(form)?.to_le_bytes().to_vec()),
            DataType::VisibleString => {
                text.chars().map(|character| u8::try_from(u32::from(character)).map_err(|_| form())).collect()
            }
            DataType::UnicodeString => Ok(text.encode_utf16().flat_map(u16::to_le_bytes).collect()),
            DataType::OctetString | DataType::Domain => parse_hex(text).ok_or_else(form),
            DataType::TimeOfDay => {
                let moment = humantime::parse_rfc3339(text).map_err(|_| form())?;
                let since = moment.duration_since(std::time::SystemTime::UNIX_EPOCH).map_err(|_| form())?;
                let days = (since.as_secs() / 86_400).checked_sub(u64::from(DAYS_1970_TO_1984)).ok_or_else(form)?;
                let in_day = since - std::time::Duration::from_secs(since.as_secs() / 86_400 * 86_400);
                self.can_time(days, in_day.as_millis()).ok_or_else(form)
            }
            DataType::TimeDifference => {
                let length = humantime::parse_duration(text).map_err(|_| form())?;
                let days = length.as_secs() / 86_400;
                let rest = length - std::time::Duration::from_secs(days * 86_400);
                self.can_time(days, rest.as_millis()).ok_or_else(form)
            }
        }
    }

    fn can_time(self, days: u64, milliseconds: u128) -> Option<Vec<u8>> {
        let time = CanTime { milliseconds: u32::try_from(milliseconds).ok()?, days: u16::try_from(days).ok()? };
        Some(time.to_bytes().to_vec())
    }

    fn range(self, text: &str, low: i128, high: i128) -> ValueError {
        ValueError::Range { text: text.to_owned(), data_type: self, low: low.to_string(), high: high.to_string() }
    }
}

fn is_hexadecimal(text: &str) -> bool {
    text.starts_with("0x") || text.starts_with("0X")
}

fn parse_integer(text: &str) -> Option<i128> {
    if is_hexadecimal(text) {
        let digits = &text[2..];
        return (!digits.starts_with(['+', '-'])).then(|| i128::from_str_radix(digits, 16).ok()).flatten();
    }
    (!text.starts_with('+')).then(|| text.parse().ok()).flatten()
}

fn parse_real(text: &str) -> Option<f64> {
    text.parse().ok()
}

/// Parses bytes in hexadecimal, two digits each. A leading `0x` and spaces are optional. `None` for other text.
pub fn parse_hex(text: &str) -> Option<Vec<u8>> {
    let text = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).unwrap_or(text);
    let digits: Vec<u8> = text
        .chars()
        .filter(|character| !character.is_whitespace())
        .map(|character| character.to_digit(16).and_then(|digit| u8::try_from(digit).ok()))
        .collect::<Option<_>>()?;
    digits.len().is_multiple_of(2).then(|| digits.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect())
}

#[cfg(test)]
mod tests;
