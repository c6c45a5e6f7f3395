//! Addresses in the object dictionary.

use super::id::parse_u32;
use std::fmt;
use std::str::FromStr;

/// The address of an object in the object dictionary: index and sub-index (CiA 301, 7.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId {
    /// 0000h to FFFFh.
    pub index: u16,
    /// 0 to 255.
    pub sub: u8,
}

/// Text that is not an object address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is not an object (0x6130:1, 6130:1, 6130h:1 or 6130.1; the index is hexadecimal)")]
pub struct ObjectIdError(String);

impl ObjectId {
    /// The device type (1000h), which every device has (CiA 301, 7.5.2.1).
    pub const DEVICE_TYPE: ObjectId = ObjectId::new(0x1000, 0);

    /// The object at `index` and `sub`.
    pub const fn new(index: u16, sub: u8) -> ObjectId {
        ObjectId { index, sub }
    }

    /// The multiplexer: bytes 1 to 3 of an SDO frame (CiA 301, 7.2.4.3.3).
    pub fn multiplexer(self) -> [u8; 3] {
        let [low, high] = self.index.to_le_bytes();
        [low, high, self.sub]
    }

    /// The object with this multiplexer (bytes 1 to 3 of an SDO frame).
    pub fn from_multiplexer(bytes: [u8; 3]) -> ObjectId {
        ObjectId { index: u16::from_le_bytes([bytes[0], bytes[1]]), sub: bytes[2] }
    }

    /// Whether a text is an address, or a wrong address (`12345`, `6130:300`), and therefore not a name.
    pub fn looks_like_address(text: &str) -> bool {
        let is_part = |character: char| character.is_ascii_hexdigit() || "xXhH:.".contains(character);
        let index = text.split([':', '.']).next().unwrap_or(text);
        let is_long = index.len() >= 4 || index.starts_with("0x") || index.starts_with("0X");
        let has_first_digit = text.starts_with(|first: char| first.is_ascii_digit());
        text.chars().all(is_part) && (has_first_digit && is_long || text.parse::<ObjectId>().is_ok())
    }

    /// The object at the same index and another sub-index.
    pub fn with_sub(self, sub: u8) -> ObjectId {
        ObjectId { sub, ..self }
    }
}

impl fmt::Display for ObjectId {
    /// `0x6130:1`: hexadecimal index, decimal sub-index.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:04X}:{}", self.index, self.sub)
    }
}

impl FromStr for ObjectId {
    type Err = ObjectIdError;

    fn from_str(text: &str) -> Result<ObjectId, ObjectIdError> {
        let parse = || {
            let (index, sub) = match text.split_once([':', '.']) {
                Some((index, sub)) => (index, Some(sub)),
                None => (text, None),
            };
            let sub = match sub {
                None => 0,
                Some(sub) => match sub.strip_suffix(['h', 'H']) {
                    Some(hex) => parse_u32(&format!("0x{hex}"))?,
                    None => parse_u32(sub)?,
                },
            };
            let hex = index.strip_prefix("0x").or_else(|| index.strip_prefix("0X"));
            let digits = hex.unwrap_or(index);
            let digits = digits.strip_suffix(['h', 'H']).unwrap_or(digits);
            // Without 0x, short numbers and words are names: `100`, `7F`, `Face`.
            let is_word = digits == index && !digits.contains(|digit: char| digit.is_ascii_digit());
            if hex.is_none() && (digits.len() != 4 || is_word) {
                return None;
            }
            let index = parse_u32(&format!("0x{digits}"))?;
            Some(ObjectId { index: u16::try_from(index).ok()?, sub: u8::try_from(sub).ok()? })
        };
        parse().ok_or_else(|| ObjectIdError(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_write_an_object() {
        let pressure = ObjectId::new(0x6130, 1);
        for text in ["0x6130:1", "6130:1", "6130h:1", "6130.1", "0X6130:0x01", "6130H.01h", "0x6130:1h"] {
            assert_eq!(text.parse(), Ok(pressure), "{text}");
        }
        assert_eq!("1000".parse(), Ok(ObjectId::new(0x1000, 0)));
        assert_eq!("1A03:16".parse(), Ok(ObjectId::new(0x1a03, 16)));
        assert_eq!("1A03:10h".parse(), Ok(ObjectId::new(0x1a03, 16)));
        for text in ["", "0x", "h", "12345", "6130:256", "6130:", "6130:x", "6130:1:2", "+130", "6130:+1", "6130:-1"] {
            assert!(text.parse::<ObjectId>().is_err(), "{text}");
        }
    }

    #[test]
    fn text_and_wire_form() {
        let object = ObjectId::new(0x6130, 1);
        assert_eq!(object.to_string(), "0x6130:1");
        assert_eq!(object.multiplexer(), [0x30, 0x61, 0x01]);
        assert_eq!(ObjectId::from_multiplexer(object.multiplexer()), object);
    }
}
