//! The values of an EDS file (CiA 306, clause 4.3): numbers, access types, and defaults by data type.

use super::ini::without_comment;
use super::text::quoted;
use crate::canopen::id::NodeId;
use crate::canopen::value::{DataType, ValueError, parse_hex};
use crate::device::description::Access;
use crate::device::scalar::Scalar;

/// A value, and the reason if it is doubtful.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reading<T> {
    pub(super) value: T,
    pub(super) doubt: Option<String>,
}

impl<T> Reading<T> {
    fn sure(value: T) -> Reading<T> {
        Reading { value, doubt: None }
    }
}

/// Parses a value. If that fails, parses it without a comment after it, or without quotes around it. CiA 306 allows
/// neither, but real files contain them.
fn tolerant<T>(text: &str, parse: impl Fn(&str) -> Option<T>) -> Option<T> {
    let plain = |text: &str| parse(text).or_else(|| parse(text.strip_prefix('"')?.strip_suffix('"')?.trim()));
    plain(text).or_else(|| without_comment(text).and_then(plain))
}

/// Parses the code of a data type: a number, or hexadecimal digits without `0x` (`1B`, `0003h`).
pub(super) fn type_code(text: &str) -> Option<Reading<i128>> {
    let hex = |text: &str| {
        let value = plain_integer(&format!("0x{}", text.strip_suffix(['h', 'H']).unwrap_or(text)))?.value;
        Some(Reading { value, doubt: Some(format!("{} is read as 0x{value:04X}", quoted(text))) })
    };
    integer(text).or_else(|| tolerant(text, hex))
}

/// Parses an integer: decimal, `0x…`, `…h`, or octal with a leading zero. A comment after it is ignored.
pub(super) fn integer(text: &str) -> Option<Reading<i128>> {
    tolerant(text, plain_integer)
}

fn plain_integer(text: &str) -> Option<Reading<i128>> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let sign = if negative { -1 } else { 1 };
    let radix = |digits: &str, radix: u32| {
        let is_valid = !digits.is_empty() && digits.chars().all(|digit| digit.is_digit(radix));
        is_valid.then(|| i128::from_str_radix(digits, radix).ok()?.checked_mul(sign)).flatten()
    };
    if let Some(hex) = hexadecimal(digits) {
        return radix(hex, 16).map(Reading::sure);
    }
    if let Some(value) = with_h(digits).and_then(|hex| radix(hex, 16)) {
        return Some(Reading { value, doubt: Some(format!("{} is read as 0x{value:04X}", quoted(text))) });
    }
    let decimal = radix(digits, 10)?;
    if !digits.starts_with('0') {
        return Some(Reading::sure(decimal));
    }
    Some(match radix(digits, 8) {
        Some(octal) if octal == decimal => Reading::sure(octal),
        Some(octal) => Reading {
            value: octal,
            doubt: Some(format!("{} begins with 0 and is octal by CiA 306, so {octal}", quoted(text))),
        },
        None => Reading {
            value: decimal,
            doubt: Some(format!("{} begins with 0, but is not octal; read as {decimal}", quoted(text))),
        },
    })
}

fn hexadecimal(text: &str) -> Option<&str> {
    text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"))
}

/// Returns the digits of `180h`, a form that CiA 306 does not allow.
fn with_h(text: &str) -> Option<&str> {
    text.strip_suffix(['h', 'H'])
}

/// Parses a switch: `0`, `1`, or a word.
pub(super) fn switch(text: &str) -> Option<bool> {
    tolerant(text, |text| match text.to_ascii_lowercase().as_str() {
        "true" | "yes" => Some(true),
        "false" | "no" => Some(false),
        _ => plain_integer(text).map(|number| number.value != 0),
    })
}

/// Parses an access type in any letter case. `rwr` and `rww` differ from `rw` only for PDOs.
pub(super) fn access(text: &str) -> Option<Access> {
    tolerant(text, |text| match text.to_ascii_lowercase().as_str() {
        "ro" | "r" => Some(Access::Ro),
        "wo" | "w" => Some(Access::Wo),
        "rw" | "rwr" | "rww" | "wr" | "r/w" => Some(Access::Rw),
        "const" | "c" => Some(Access::Const),
        _ => None,
    })
}

/// Parses a default, limit or parameter value of a type for [`Scalar::encode`]. `None` for an empty value.
///
/// # Errors
/// The reason why the text is not a value of the type.
pub(super) fn scalar(text: &str, data_type: DataType) -> Result<Option<Reading<Scalar>>, String> {
    let text = text.trim();
    let is_text = matches!(data_type, DataType::VisibleString | DataType::UnicodeString);
    if text.is_empty() || (!is_text && without_comment(text) == Some("")) {
        return Ok(None);
    }
    let form = || format!("{} is not a value of type {data_type}", quoted(text));
    let reading = match data_type {
        DataType::VisibleString | DataType::UnicodeString => Some(Reading::sure(Scalar::Text(text.to_owned()))),
        DataType::Boolean => tolerant(text, boolean),
        DataType::Unsigned(_) => tolerant(text, |text| number(text, None)),
        DataType::Integer(bytes) => tolerant(text, |text| number(text, Some(bytes))),
        DataType::Real32 => tolerant(text, |text| real(text, 8)),
        DataType::Real64 => tolerant(text, |text| real(text, 16)),
        DataType::OctetString | DataType::Domain => {
            tolerant(text, |text| parse_hex(text).map(|_| Reading::sure(Scalar::Text(text.to_owned()))))
        }
        DataType::TimeOfDay | DataType::TimeDifference => tolerant(text, |text| time(text, data_type)),
    };
    let reading = reading.ok_or_else(form)?;
    // The encoder checks the range. A formula must fit every node-ID, so the highest one is used.
    match reading.value.encode(data_type, NodeId::MAX) {
        Ok(_) => Ok(Some(reading)),
        Err(ValueError::Range { low, high, .. }) => {
            Err(format!("{} does not fit {data_type} ({low} to {high})", quoted(text)))
        }
        Err(ValueError::Form { .. }) => Err(form()),
    }
}

fn boolean(text: &str) -> Option<Reading<Scalar>> {
    let bit = match text.to_ascii_lowercase().as_str() {
        "true" => 1,
        "false" => 0,
        _ => return number(text, None),
    };
    Some(Reading::sure(Scalar::Integer(bit)))
}

/// Parses an integer, a formula with `$NODEID`, or a number with only zeros after the point. `signed` is the width of a
/// signed type in bytes: a hexadecimal number is then a bit pattern and can be negative.
fn number(text: &str, signed: Option<u8>) -> Option<Reading<Scalar>> {
    if text.to_ascii_uppercase().contains(NODE_ID) {
        return formula(text);
    }
    if let Some(Reading { value, doubt }) = plain_integer(text) {
        let value = match signed {
            Some(bytes) if hexadecimal(text).or_else(|| with_h(text)).is_some() => from_bit_pattern(value, bytes),
            _ => value,
        };
        return Some(Reading { value: integer_scalar(value), doubt });
    }
    let real: f64 = text.parse().ok()?;
    // Above 2^53, a REAL64 cannot represent every integer.
    if real.fract() != 0.0 || real.abs() >= 9_007_199_254_740_992.0 {
        return None;
    }
    let value = format!("{real:.0}").parse().ok()?;
    let doubt = format!("{} is not an integer; read as {value}", quoted(text));
    Some(Reading { value: integer_scalar(value), doubt: Some(doubt) })
}

fn integer_scalar(value: i128) -> Scalar {
    i64::try_from(value).map_or_else(|_| Scalar::Text(value.to_string()), Scalar::Integer)
}

fn from_bit_pattern(value: i128, bytes: u8) -> i128 {
    let bits = 8 * u32::from(bytes.clamp(1, 8));
    let (half, whole) = (1i128 << (bits - 1), 1i128 << bits);
    if (half..whole).contains(&value) { value - whole } else { value }
}

const NODE_ID: &str = "$NODEID";

/// Parses `$NODEID+0x180`, with the terms in any order.
fn formula(text: &str) -> Option<Reading<Scalar>> {
    let mut nodes = 0;
    let mut sum: i128 = 0;
    let mut doubt = None;
    for term in text.split('+').map(str::trim) {
        if term.eq_ignore_ascii_case(NODE_ID) {
            nodes += 1;
        } else {
            let number = plain_integer(term).filter(|number| number.value >= 0)?;
            sum = sum.checked_add(number.value)?;
            doubt = number.doubt.or(doubt);
        }
    }
    // Objects with `$NODEID` have at most 32 bits.
    let sum = u32::try_from(sum).ok().filter(|_| nodes == 1)?;
    Some(Reading { value: Scalar::NodeIdPlus(sum), doubt })
}

/// Parses a REAL: `1.5`, `1e3`, with a decimal comma, or hexadecimal. A hexadecimal number with `digits` digits is a
/// bit pattern: 3F800000h is 1.0.
fn real(text: &str, digits: usize) -> Option<Reading<Scalar>> {
    if let Ok(number) = text.parse::<f64>() {
        return Some(Reading::sure(Scalar::Real(number)));
    }
    let Some(hex) = hexadecimal(text) else {
        let number: f64 = (text.matches(',').count() == 1).then(|| text.replace(',', ".").parse().ok()).flatten()?;
        let doubt = format!("{} has a decimal comma; read as {number}", quoted(text));
        return Some(Reading { value: Scalar::Real(number), doubt: Some(doubt) });
    };
    let value = u64::try_from(plain_integer(text)?.value).ok()?;
    if value == 0 {
        return Some(Reading::sure(Scalar::Real(0.0)));
    }
    let number = match (hex.len() == digits, u32::try_from(value)) {
        (true, Ok(bits)) if digits == 8 => f64::from(f32::from_bits(bits)),
        (true, _) => f64::from_bits(value),
        (false, _) => value.to_string().parse().ok()?,
    };
    let how = if hex.len() == digits { "is read as the bit pattern of" } else { "is read as" };
    Some(Reading { value: Scalar::Real(number), doubt: Some(format!("{} {how} {number}", quoted(text))) })
}

/// Parses a time as a 48-bit number, the only form in CiA 306.
fn time(text: &str, data_type: DataType) -> Option<Reading<Scalar>> {
    let number = u64::try_from(plain_integer(text)?.value).ok()?;
    let bytes = number.to_le_bytes();
    let text = data_type.decode(&bytes[..6]).ok()?.to_string();
    let is_valid = data_type.encode_text(&text).is_ok_and(|back| back == bytes[..6]) && bytes[6..] == [0, 0];
    is_valid.then(|| Reading::sure(Scalar::Text(text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const U8: DataType = DataType::Unsigned(1);
    const U32: DataType = DataType::Unsigned(4);
    const I16: DataType = DataType::Integer(2);

    fn value(text: &str, data_type: DataType) -> Option<(Scalar, bool)> {
        let reading = scalar(text, data_type).expect("a value")?;
        Some((reading.value, reading.doubt.is_some()))
    }

    #[test]
    fn integers() {
        for (text, expected) in [("0", 0), ("255", 255), ("0x1F", 31), ("0XfF", 255), ("-5", -5), ("+5", 5), ("007", 7)]
        {
            assert_eq!(integer(text), Some(Reading::sure(expected)), "{text}");
        }
        for (text, expected) in [("0x7 ; VAR", 7), ("5//five", 5), ("10 # ten", 10), ("0x0005;UNSIGNED8", 5)] {
            assert_eq!(integer(text), Some(Reading::sure(expected)), "{text}");
        }
        assert_eq!(integer("180h").map(|it| (it.value, it.doubt.is_some())), Some((0x180, true)));
        assert_eq!(value("$NODEID+180h", U32), Some((Scalar::NodeIdPlus(0x180), true)));
        assert_eq!(value("FFFFh", I16), Some((Scalar::Integer(-1), true)));
        for wrong in [
            "",
            "-",
            "0x",
            "h",
            "0x180h",
            "16#180",
            "0x-1",
            "x",
            "1.0",
            "1 2",
            "١",
            "0x1_0",
            "99999999999999999999999999999999999999999",
        ] {
            assert_eq!(integer(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn leading_zero_is_octal_with_a_warning() {
        let octal = integer("0100").expect("octal");
        assert_eq!(
            (octal.value, octal.doubt.as_deref()),
            (64, Some("\"0100\" begins with 0 and is octal by CiA 306, so 64"))
        );
        let not = integer("089").expect("decimal");
        assert_eq!(
            (not.value, not.doubt.as_deref()),
            (89, Some("\"089\" begins with 0, but is not octal; read as 89"))
        );
    }

    #[test]
    fn values_of_integer_types() {
        assert_eq!(value("", U32), None);
        assert_eq!(value("; none", U32), None);
        assert_eq!(value("0x80", U32), Some((Scalar::Integer(0x80), false)));
        assert_eq!(value("0.0", U32), Some((Scalar::Integer(0), true)));
        assert_eq!(value("-3.00", I16), Some((Scalar::Integer(-3), true)));
        assert_eq!(value("0x8000", I16), Some((Scalar::Integer(-32768), false)));
        assert_eq!(value("0xFFFF;all", I16), Some((Scalar::Integer(-1), false)));
        assert_eq!(value("0xFFFFFFFFFFFFFFFF", DataType::Integer(8)), Some((Scalar::Integer(-1), false)));
        let most = "18446744073709551615";
        assert_eq!(value(most, DataType::Unsigned(8)), Some((Scalar::Text(most.to_owned()), false)));
        assert_eq!(value("TRUE", DataType::Boolean), Some((Scalar::Integer(1), false)));
        assert_eq!(value("0x01", DataType::Boolean), Some((Scalar::Integer(1), false)));
        for (wrong, data_type) in [
            ("256", U8),
            ("-1", U32),
            ("1.5", U8),
            ("1e30", U8),
            ("abc", U8),
            ("nan", U8),
            ("0x10000", I16),
            ("2", DataType::Boolean),
        ] {
            assert!(scalar(wrong, data_type).is_err(), "{wrong}");
        }
        assert_eq!(scalar("256", U8), Err("\"256\" does not fit u8 (0 to 255)".to_owned()));
    }

    #[test]
    fn formula_terms_can_have_any_order() {
        for text in ["$NODEID+0x180", "0x180+$NODEID", "$nodeid + 384", "0x100 + $NodeID + 0x80", "$NODEID+0x180;TPDO1"]
        {
            assert_eq!(value(text, U32), Some((Scalar::NodeIdPlus(0x180), false)), "{text}");
        }
        assert_eq!(value("$NODEID", U8), Some((Scalar::NodeIdPlus(0), false)));
        assert_eq!(value("0600+$NODEID", U32), Some((Scalar::NodeIdPlus(0x180), true)));
        for wrong in ["$NODEID+", "$NODEID-1", "$NODEID+$NODEID", "$NODEID+x", "$NODEID+0x1FFFFFFFF", "$NODEID+-1"] {
            assert!(scalar(wrong, U32).is_err(), "{wrong}");
        }
        assert!(scalar("$NODEID+0x180", U8).is_err());
        let reading = scalar("0x180 + $NODEID", U32).expect("a formula").expect("not empty");
        let node = NodeId::new(5).expect("a node-ID");
        assert_eq!(reading.value.encode(U32, node), Ok(vec![0x85, 1, 0, 0]));
    }

    #[test]
    fn values_of_real_types() {
        let real = DataType::Real32;
        assert_eq!(value("1.5", real), Some((Scalar::Real(1.5), false)));
        assert_eq!(value("-1E-3 ; min", real), Some((Scalar::Real(-0.001), false)));
        assert_eq!(value("0x00000000", real), Some((Scalar::Real(0.0), false)));
        assert_eq!(value("0x3F800000", real), Some((Scalar::Real(1.0), true)));
        assert_eq!(value("0x10", real), Some((Scalar::Real(16.0), true)));
        assert_eq!(value("0x3FF0000000000000", DataType::Real64), Some((Scalar::Real(1.0), true)));
        assert_eq!(value("1,5", real), Some((Scalar::Real(1.5), true)));
        for wrong in ["1,000,000", "1e39", "one", "0x", "0x123456789012345678"] {
            assert!(scalar(wrong, real).is_err(), "{wrong}");
        }
    }

    #[test]
    fn values_of_other_types() {
        let text = |text: &str| Some((Scalar::Text(text.to_owned()), false));
        assert_eq!(value("P;1 # mm", DataType::VisibleString), text("P;1 # mm"));
        assert_eq!(value("01a1053c", DataType::OctetString), text("01a1053c"));
        assert_eq!(value("01 A1 ; two bytes", DataType::Domain), text("01 A1"));
        assert!(scalar("0", DataType::Domain).is_err());
        assert!(scalar("firmware.bin", DataType::Domain).is_err());
        assert!(scalar("\u{20ac}", DataType::VisibleString).is_err());
        assert_eq!(value("0", DataType::TimeDifference), text("0s"));
        assert_eq!(value("0x0001000003E8", DataType::TimeOfDay), text("1984-01-02T00:00:01.000Z"));
        for wrong in ["12:00", "0x1000000000000", "0xF0000000", "-1"] {
            assert!(scalar(wrong, DataType::TimeOfDay).is_err(), "{wrong}");
        }
    }

    #[test]
    fn access_types() {
        for (text, expected) in [
            ("ro", Access::Ro),
            ("R", Access::Ro),
            ("wo", Access::Wo),
            ("W", Access::Wo),
            ("RW", Access::Rw),
            ("rwr", Access::Rw),
            ("rww ; RPDO", Access::Rw),
            ("Const", Access::Const),
        ] {
            assert_eq!(access(text), Some(expected), "{text}");
        }
        assert_eq!(access("rx"), None);
        assert_eq!(access(""), None);
    }

    #[test]
    fn switches() {
        for (text, expected) in
            [("0", Some(false)), ("1", Some(true)), ("0x1", Some(true)), ("True ; yes", Some(true)), ("maybe", None)]
        {
            assert_eq!(switch(text), expected, "{text}");
        }
    }
}
