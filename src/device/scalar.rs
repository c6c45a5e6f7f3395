//! Numbers and texts that a description or an EDS file gives for an object.

use crate::canopen::id::{NodeId, parse_u32};
use crate::canopen::value::{DataType, ValueError};
use std::fmt;

/// A default, a limit or a value to set, before it is encoded in the type of its object.
#[derive(Clone, Debug, PartialEq)]
pub enum Scalar {
    /// An integer.
    Integer(i64),
    /// A number with a fraction.
    Real(f64),
    /// Text, bytes in hexadecimal, a time, or an integer above 2^63 - 1, as `DataType::encode_text` reads them.
    Text(String),
    /// The sum of the node-ID and this number: `$NODEID+0x180`.
    NodeIdPlus(u32),
}

impl From<&str> for Scalar {
    /// Reads a formula with `$NODEID`, else plain text.
    fn from(text: &str) -> Scalar {
        node_formula(text).map_or_else(|| Scalar::Text(text.to_owned()), Scalar::NodeIdPlus)
    }
}

impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Scalar::Integer(number) => write!(f, "{number}"),
            Scalar::Real(number) => write!(f, "{number:?}"),
            Scalar::Text(text) => f.write_str(text),
            Scalar::NodeIdPlus(0) => f.write_str("$NODEID"),
            Scalar::NodeIdPlus(number) => write!(f, "$NODEID+0x{number:X}"),
        }
    }
}

impl Scalar {
    /// Encodes this value in `data_type`, in wire order. `node` is the node-ID in `$NODEID`.
    ///
    /// # Errors
    /// The value is out of the range of the type, or has another form.
    pub fn encode(&self, data_type: DataType, node: NodeId) -> Result<Vec<u8>, ValueError> {
        match self {
            Scalar::Integer(number) => encode_integer(*number, data_type),
            Scalar::Real(number) => data_type.encode_text(&number.to_string()),
            Scalar::Text(text) => data_type.encode_text(text),
            Scalar::NodeIdPlus(number) => encode_integer(i64::from(*number) + i64::from(node.get()), data_type),
        }
    }

    /// The number; `None` for text and for a formula.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Scalar::Integer(number) => Some(*number as f64),
            Scalar::Real(number) => Some(*number),
            Scalar::Text(_) | Scalar::NodeIdPlus(_) => None,
        }
    }
}

fn encode_integer(number: i64, data_type: DataType) -> Result<Vec<u8>, ValueError> {
    if let DataType::Unsigned(width @ 1..=8) | DataType::Integer(width @ 1..=8) = data_type {
        let bits = 8 * u32::from(width) - u32::from(matches!(data_type, DataType::Integer(_)));
        let high = (1i128 << bits) - 1;
        let low = if matches!(data_type, DataType::Integer(_)) { -high - 1 } else { 0 };
        if (low..=high).contains(&i128::from(number)) {
            return Ok(number.to_le_bytes()[..usize::from(width)].to_vec());
        }
    }
    data_type.encode_text(&number.to_string())
}

/// Returns the number that is added to the node-ID in `$NODEID+0x180`. The terms may have either order: CiA 306
/// requires `$NODEID` first, but real files deviate.
fn node_formula(text: &str) -> Option<u32> {
    let folded = text.to_ascii_uppercase().replace(' ', "");
    if folded == "$NODEID" {
        return Some(0);
    }
    let number = folded.strip_prefix("$NODEID+").or_else(|| folded.strip_suffix("+$NODEID"))?;
    parse_u32(&number.replace("0X", "0x"))
}

/// One number or a range of numbers that an object accepts: `254`, `0-240`, `0x004E0000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberRange {
    /// The lowest number.
    pub low: u32,
    /// The highest number.
    pub high: u32,
}

impl NumberRange {
    /// Whether `number` is in the range.
    pub fn contains(&self, number: f64) -> bool {
        f64::from(self.low) <= number && number <= f64::from(self.high)
    }
}

impl std::str::FromStr for NumberRange {
    type Err = String;

    fn from_str(text: &str) -> Result<NumberRange, String> {
        let (low, high) = text.split_once('-').unwrap_or((text, text));
        match (parse_u32(low), parse_u32(high)) {
            (Some(low), Some(high)) if low <= high => Ok(NumberRange { low, high }),
            _ => Err(format!("\"{text}\" is not a number or a range (254, 0-240, 0x004E0000)")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const U8: DataType = DataType::Unsigned(1);
    const U32: DataType = DataType::Unsigned(4);

    #[test]
    fn node_id_formula_accepts_both_orders() {
        for text in ["$NODEID+0x180", "0x180+$NODEID", "$nodeid + 384", "384 + $NODEID"] {
            assert_eq!(Scalar::from(text), Scalar::NodeIdPlus(0x180), "{text}");
        }
        assert_eq!(Scalar::from("$NODEID"), Scalar::NodeIdPlus(0));
        for text in ["MH-4-CAN", "$NODEID+x"] {
            assert_eq!(Scalar::from(text), Scalar::Text(text.to_owned()));
        }
        let node = NodeId::new(5).expect("a node-ID");
        assert_eq!(Scalar::NodeIdPlus(0x180).encode(U32, node), Ok(vec![0x85, 1, 0, 0]));
        assert!(Scalar::NodeIdPlus(0x180).encode(U8, node).is_err());
    }

    #[test]
    fn integers_are_encoded_within_the_range_of_their_type() {
        let encode = |number, data_type| Scalar::Integer(number).encode(data_type, NodeId::MIN).ok();
        assert_eq!(encode(255, U8), Some(vec![255]));
        assert_eq!((encode(256, U8), encode(-1, U8)), (None, None));
        assert_eq!(encode(-2, DataType::Integer(2)), Some(vec![0xfe, 0xff]));
        assert_eq!(encode(-129, DataType::Integer(1)), None);
        assert_eq!(encode(i64::MAX, DataType::Unsigned(8)).map(|bytes| bytes.len()), Some(8));
        assert_eq!(encode(2, DataType::Real32), Some(2f32.to_le_bytes().to_vec()));
        assert_eq!(encode(2, DataType::Boolean), None);
    }

    #[test]
    fn ranges_read_decimal_and_hexadecimal() {
        assert_eq!("0-240".parse(), Ok(NumberRange { low: 0, high: 240 }));
        assert_eq!("0x10".parse(), Ok(NumberRange { low: 16, high: 16 }));
        assert!("5-3".parse::<NumberRange>().is_err() && "x".parse::<NumberRange>().is_err());
    }
}
