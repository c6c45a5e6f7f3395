//! One measured value as the device sent it.

use crate::bus::Stamp;
use crate::canopen::id::NodeId;
use crate::canopen::value::Value;
use crate::device::scale::Scale;
use std::fmt;
use std::sync::Arc;

/// A measured number, exactly as it was sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// An integer divided by ten to the power of the device's decimal digits.
    Decimal {
        /// The integer on the wire.
        mantissa: i128,
        /// 6132h, 0 to 38.
        digits: u8,
    },
    /// A REAL32.
    Real32(f32),
    /// A REAL64.
    Real64(f64),
}

/// 10⁰ to 10²², which are exact.
const POWERS_OF_TEN: [f64; 23] = {
    let (mut powers, mut at) = ([1.0; 23], 1);
    while at < powers.len() {
        powers[at] = powers[at - 1] * 10.0;
        at += 1;
    }
    powers
};

impl Number {
    /// Converts a decoded value. Integers get the device's decimal digits. Text and bytes are not numbers.
    pub fn from_value(value: &Value, digits: u8) -> Option<Number> {
        let decimal = |mantissa| Some(Number::Decimal { mantissa, digits: digits.min(38) });
        match value {
            Value::Bool(bit) => decimal(i128::from(*bit)),
            Value::Unsigned(number) => decimal(i128::from(*number)),
            Value::Integer(number) => decimal(i128::from(*number)),
            Value::Real32(number) => Some(Number::Real32(*number)),
            Value::Real64(number) => Some(Number::Real64(*number)),
            Value::Text(_) | Value::Bytes(_) | Value::TimeOfDay(_) | Value::TimeDifference(_) => None,
        }
    }

    /// Multiplies the number by a factor and adds an offset. Integers stay exact. `None` if the result is too large.
    pub fn scaled(self, scale: Scale) -> Option<Number> {
        let Scale { factor, offset } = scale;
        match self {
            Number::Decimal { mantissa, digits } => {
                let product_digits = digits.checked_add(factor.digits)?;
                let digits = product_digits.max(offset.digits);
                let power = |from: u8| 10i128.checked_pow(u32::from(digits - from));
                let product = mantissa.checked_mul(factor.mantissa.into())?.checked_mul(power(product_digits)?)?;
                let offset = i128::from(offset.mantissa).checked_mul(power(offset.digits)?)?;
                Some(Number::Decimal { mantissa: product.checked_add(offset)?, digits })
            }
            number => Some(Number::Real64(number.as_f64() * factor.as_f64() + offset.as_f64())),
        }
    }

    /// The nearest REAL64, equal to the parsed text.
    pub fn as_f64(self) -> f64 {
        match self {
            // Up to 2^53 and 22 digits both numbers are exact, so their quotient is the nearest one. Otherwise the text
            // is parsed.
            Number::Decimal { mantissa, digits } => {
                match (i64::try_from(mantissa), POWERS_OF_TEN.get(usize::from(digits))) {
                    (Ok(mantissa), Some(power)) if mantissa.unsigned_abs() < 1 << 53 => mantissa as f64 / power,
                    _ => self.to_string().parse().unwrap_or(f64::NAN),
                }
            }
            Number::Real32(number) => f64::from(number),
            Number::Real64(number) => number,
        }
    }

    /// Whether the number is neither infinite nor NaN.
    pub fn is_finite(self) -> bool {
        match self {
            Number::Decimal { .. } => true,
            Number::Real32(number) => number.is_finite(),
            Number::Real64(number) => number.is_finite(),
        }
    }
}

impl fmt::Display for Number {
    /// Integers with the device's digits (`50.000`), REAL32 as the shortest text that parses to the same number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Number::Decimal { mantissa, digits: 0 } => write!(f, "{mantissa}"),
            Number::Decimal { mantissa, digits } => {
                let power = 10u128.pow(u32::from(digits.min(38)));
                let sign = if mantissa < 0 { "-" } else { "" };
                let size = mantissa.unsigned_abs();
                write!(f, "{sign}{}.{:0width$}", size / power, size % power, width = usize::from(digits))
            }
            Number::Real32(number) => Value::Real32(number).fmt(f),
            Number::Real64(number) => Value::Real64(number).fmt(f),
        }
    }
}

/// The status that a device reports for a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// Valid.
    Ok,
    /// Not valid.
    Invalid,
    /// Above the measuring range.
    OverloadHigh,
    /// Below the measuring range.
    OverloadLow,
    /// The value is the limit of its integer type, and the measuring range is larger.
    Clipped,
}

impl Status {
    /// Converts the bits of 6150h (CiA 404): bit 0 not valid, bit 1 positive overload, bit 2 negative overload. The
    /// second result is whether the value is valid.
    pub fn from_bits(bits: u64) -> (Status, bool) {
        let valid = bits & 1 == 0;
        let status = match bits & 0b110 {
            0b010 => Status::OverloadHigh,
            0b100 => Status::OverloadLow,
            0 if valid => Status::Ok,
            _ => Status::Invalid,
        };
        (status, valid && bits & 0b110 != 0b110)
    }

    /// Whether the value is outside the measuring range.
    pub fn is_overload(self) -> bool {
        matches!(self, Status::OverloadHigh | Status::OverloadLow)
    }

    /// The word in files and tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::Invalid => "invalid",
            Status::OverloadHigh => "overload-high",
            Status::OverloadLow => "overload-low",
            Status::Clipped => "clipped",
        }
    }
}

/// The bytes of a value in wire order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Raw {
    bytes: [u8; 8],
    len: u8,
}

impl Raw {
    /// Keeps at most the first eight bytes.
    pub fn new(bytes: &[u8]) -> Raw {
        let len = bytes.len().min(8);
        let mut raw = Raw { bytes: [0; 8], len: len.to_le_bytes()[0] };
        raw.bytes[..len].copy_from_slice(&bytes[..len]);
        raw
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.len)]
    }
}

impl fmt::Display for Raw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("0x")?;
        self.bytes().iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

/// The source of samples: one signal of one node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `ch1`, `pressure.status` or an object.
    pub signal: Arc<str>,
    /// The unit in ASCII; empty if it is unknown.
    pub unit: Arc<str>,
}

/// One measured value.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The time when the sample was received.
    pub at: Stamp,
    /// The number of the source.
    pub source: usize,
    /// The number; `None` if it is invalid.
    pub value: Option<Number>,
    /// The status; `None` if the device reports none.
    pub status: Option<Status>,
    /// The bytes in wire order.
    pub raw: Raw,
    /// Why the value is missing or may be wrong.
    pub doubt: Option<Doubt>,
}

/// Why a value is missing or may be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Doubt {
    /// No source states the type of the object. There is no value.
    UnknownType,
    /// The object is text or bytes. There is no value.
    NotNumber,
    /// The decimal digits (6132h) are above 9. There is no value.
    ImpossibleDigits(u8),
    /// The decimal digits (6132h) are unknown. The value is the integer.
    UnknownDigits,
    /// The object with the decimal digits, or with the step, gave no valid answer. There is no value.
    UnreadScale,
    /// The bytes are a REAL32 close to zero, and are probably an integer. There is no value.
    LooksLikeInteger,
    /// The value is the limit of its integer type, and the measuring range is unknown. The value is kept.
    EndOfType,
    /// The status object has no valid answer. The value is kept.
    UnknownStatus,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn decimal(mantissa: i128, digits: u8) -> String {
        Number::Decimal { mantissa, digits }.to_string()
    }

    #[test]
    fn integers_with_the_devices_digits() {
        // DPS, table 19; MH-4, 6132h: 924 @2, 284 @1; MC1609: 7985 @1.
        assert_eq!(decimal(50_000, 3), "50.000");
        assert_eq!(decimal(924, 2), "9.24");
        assert_eq!(decimal(284, 1), "28.4");
        assert_eq!(decimal(7985, 1), "798.5");
        assert_eq!(decimal(-5, 3), "-0.005");
        assert_eq!(decimal(0, 2), "0.00");
        assert_eq!(decimal(-7, 0), "-7");
        assert_eq!(decimal(i128::from(i64::MIN), 5), "-92233720368547.75808");
    }

    #[test]
    fn status_bits() {
        assert_eq!(Status::from_bits(0), (Status::Ok, true));
        assert_eq!(Status::from_bits(1), (Status::Invalid, false));
        assert_eq!(Status::from_bits(3), (Status::OverloadHigh, false));
        assert_eq!(Status::from_bits(5), (Status::OverloadLow, false));
        // Outside the range, but marked as valid: the value is kept.
        assert_eq!(Status::from_bits(2), (Status::OverloadHigh, true));
        assert_eq!(Status::from_bits(6), (Status::Invalid, false));
        assert_eq!(Status::from_bits(7), (Status::Invalid, false));
        assert_eq!(Status::from_bits(0xf8), (Status::Ok, true));
    }

    #[test]
    fn raw_is_in_wire_order() {
        assert_eq!(Raw::new(&[0x50, 0xc3, 0, 0]).to_string(), "0x50C30000");
        assert_eq!(Raw::new(&[]).to_string(), "0x");
        assert_eq!(Raw::new(&[1; 9]).bytes().len(), 8);
    }

    proptest! {
        #[test]
        fn number_equals_its_parsed_text(mantissa in any::<i32>(), digits in 0u8..=9) {
            let number = Number::Decimal { mantissa: i128::from(mantissa), digits };
            prop_assert_eq!(number.as_f64(), number.to_string().parse::<f64>().expect("a number"));
        }
    }
}
