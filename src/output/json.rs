//! JSON Lines: one object on each line.

use super::text::is_unsafe;
use crate::measure::sample::Number;
use serde::Serialize;
use serde_json::ser::Formatter;
use std::io::{self, Write};

pub(super) fn line<T: Serialize>(out: &mut dyn Write, object: &T) -> io::Result<()> {
    object.serialize(&mut serde_json::Serializer::with_formatter(&mut *out, Safe))?;
    out.write_all(b"\n")
}

/// Escapes more characters than JSON requires, because JSON Lines are also shown in terminals. For example, the
/// character 9Bh starts a control sequence.
struct Safe;

impl Formatter for Safe {
    fn write_string_fragment<W: ?Sized + Write>(&mut self, out: &mut W, fragment: &str) -> io::Result<()> {
        for part in fragment.split_inclusive(is_unsafe) {
            match part.char_indices().next_back() {
                Some((at, last)) if is_unsafe(last) => {
                    out.write_all(&part.as_bytes()[..at])?;
                    write!(out, "\\u{:04x}", u32::from(last))?;
                }
                _ => out.write_all(part.as_bytes())?,
            }
        }
        Ok(())
    }
}

/// A number in JSON. Decimals keep their digits; a number that is not finite is null.
pub(super) struct JsonNumber(pub(super) Option<Number>);

impl Serialize for JsonNumber {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Some(Number::Real32(number)) if number.is_finite() => serializer.serialize_f32(number),
            Some(Number::Decimal { mantissa, digits: 0 }) => match i64::try_from(mantissa) {
                Ok(number) => serializer.serialize_i64(number),
                Err(_) => serializer.serialize_f64(Number::Decimal { mantissa, digits: 0 }.as_f64()),
            },
            Some(number) if number.is_finite() => serializer.serialize_f64(number.as_f64()),
            _ => serializer.serialize_none(),
        }
    }
}

/// A value of the object dictionary in JSON: numbers as numbers, all other types as text.
pub fn value(value: &crate::canopen::value::Value) -> serde_json::Value {
    use crate::canopen::value::Value;
    match value {
        Value::Bool(bit) => (*bit).into(),
        Value::Unsigned(number) => (*number).into(),
        Value::Integer(number) => (*number).into(),
        Value::Real32(number) if number.is_finite() => {
            // Converted through its text, so that 1.1 stays 1.1.
            number.to_string().parse::<f64>().map_or(serde_json::Value::Null, Into::into)
        }
        Value::Real64(number) if number.is_finite() => (*number).into(),
        Value::Real32(_) | Value::Real64(_) => serde_json::Value::Null,
        other => other.to_string().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_and_read_back() {
        let text = "MH\x1b[2J\u{9b}31m\u{7f}\u{202e}\n\"D\u{fc}se\" \u{1f600}";
        let mut out = Vec::new();
        line(&mut out, &[text]).expect("memory");
        let out = String::from_utf8(out).expect("text");
        assert_eq!(out, "[\"MH\\u001b[2J\\u009b31m\\u007f\\u202e\\n\\\"D\u{fc}se\\\" \u{1f600}\"]\n");
        assert_eq!(serde_json::from_str::<[String; 1]>(&out).expect("JSON"), [text]);
    }
}
