//! Text for people.

use crate::bus::Stamp;
use std::fmt::Write;

/// Makes text from a device safe for a terminal: control characters, invisible characters and characters that change the
/// writing direction are replaced by escapes such as `\x1B`.
pub fn safe(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        if is_unsafe(character) {
            // Writing to a String cannot fail.
            let _ = if character.is_ascii() || u32::from(character) < 0x100 {
                write!(safe, "\\x{:02X}", u32::from(character))
            } else {
                write!(safe, "\\u{{{:X}}}", u32::from(character))
            };
        } else {
            safe.push(character);
        }
    }
    safe
}

/// Whether a terminal does not simply show this character.
pub(super) fn is_unsafe(character: char) -> bool {
    let hidden =
        matches!(character, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
    character.is_control() || hidden
}

/// A moment as RFC 3339 in UTC with microseconds.
pub fn utc(at: Stamp) -> String {
    humantime::format_rfc3339_micros(at.wall.system_time()).to_string()
}

/// A count with separated thousands: `124,310`.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number with `digits` significant digits. Very large and very small numbers have an exponent.
pub fn significant(number: f64, digits: usize) -> String {
    if number == 0.0 || !number.is_finite() {
        return number.to_string();
    }
    let magnitude = number.abs().log10().floor();
    if !(-6.0..=15.0).contains(&magnitude) {
        return format!("{number:.*e}", digits.saturating_sub(1));
    }
    let digits = i32::try_from(digits).unwrap_or(i32::MAX);
    // The range check above keeps the magnitude small.
    let decimals = f64::from(digits) - 1.0 - magnitude;
    let decimals = (0..=21).rev().find(|&count| f64::from(count) <= decimals).unwrap_or(0);
    format!("{number:.*}", usize::try_from(decimals).unwrap_or(0))
}

/// Bytes in wire order: `0x47000000`.
pub fn wire_bytes(bytes: &[u8]) -> String {
    bytes.iter().fold("0x".to_owned(), |text, byte| text + &format!("{byte:02X}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_a_device_cannot_control_a_terminal() {
        assert_eq!(safe("MH-4-CAN"), "MH-4-CAN");
        assert_eq!(safe("\x1b[2J\r\n\x07"), "\\x1B[2J\\x0D\\x0A\\x07");
        assert_eq!(safe("\u{9b}31m"), "\\x9B31m");
        assert_eq!(safe("a\u{202e}b"), "a\\u{202E}b");
        assert_eq!(safe("D\u{fc}se"), "D\u{fc}se");
    }

    #[test]
    fn numbers_for_people() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(124_310), "124,310");
        assert_eq!(significant(1.234_023_6, 5), "1.2340");
        assert_eq!(significant(-0.001_234, 3), "-0.00123");
        assert_eq!(significant(123_456.7, 3), "123457");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(significant(1e-9, 3), "1.00e-9");
    }
}
