//! Functions for text output.

use crate::bus::Stamp;
use std::fmt::Write;

/// Makes text from a device safe for a terminal. Control characters, invisible characters and changes of the writing
/// direction become escapes such as `\x1B`.
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

/// Whether this character may control a terminal or is invisible.
pub(super) fn is_unsafe(character: char) -> bool {
    let hidden =
        matches!(character, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
    character.is_control() || hidden
}

/// The longest line of an error in characters.
const LONGEST_LINE: usize = 200;

/// Converts a message to one line of at most 200 characters. Of a longer message, the middle is omitted, because the
/// cause is at the end.
pub fn one_line(text: &str) -> String {
    let joined = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
    let letters: Vec<char> = joined.chars().collect();
    if letters.len() <= LONGEST_LINE {
        return joined;
    }
    let half = (LONGEST_LINE - 3) / 2;
    let part = |letters: &[char]| letters.iter().collect::<String>();
    format!("{} … {}", part(&letters[..half]), part(&letters[letters.len() - half..]))
}

/// Breaks a line at spaces into lines of at most `width` characters. All lines but the first are indented.
pub fn folded(line: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in line.split(' ') {
        match lines.last_mut() {
            Some(last) if last.chars().count().saturating_add(1 + word.chars().count()) <= width => {
                last.push(' ');
                last.push_str(word);
            }
            Some(_) => lines.push(format!("  {word}")),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Returns the part of a long input around the character number `before`, and the number of this character in the part.
/// Both numbers count from 0.
pub fn around(text: &str, before: usize) -> (String, usize) {
    let letters: Vec<char> = text.chars().collect();
    let from = if letters.len() <= LONGEST_LINE { 0 } else { before.saturating_sub(LONGEST_LINE / 2) };
    let to = letters.len().min(from + LONGEST_LINE);
    let from = from.min(to);
    (letters[from..to].iter().collect(), before.saturating_sub(from))
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

/// Bytes in wire order for messages: `47 00 00 00`. A number after 0x would look like a value.
pub fn spaced_bytes(bytes: &[u8]) -> String {
    let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    bytes.join(" ")
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
    fn long_text_becomes_one_line() {
        assert_eq!(one_line("TOML parse error\n  |\n1 | x\n"), "TOML parse error | 1 | x");
        let long = one_line(&format!("\"{}\" is not a node-ID", "ä".repeat(10_000)));
        assert_eq!(long.chars().count(), 199);
        assert!(long.starts_with("\"ä") && long.ends_with("ä\" is not a node-ID"), "{long}");
        assert_eq!(one_line(&"x".repeat(200)).len(), 200);
    }

    #[test]
    fn long_input_is_shown_around_the_place() {
        let input = format!("{}!{}", "a".repeat(5000), "b".repeat(5000));
        let (part, before) = around(&input, 5000);
        assert_eq!((part.chars().count(), part.chars().nth(before)), (200, Some('!')));
        assert_eq!(around("a < b", 2), ("a < b".to_owned(), 2));
        assert_eq!(around(&input, 10_001).0.chars().count(), 101 - 1);
    }

    #[test]
    fn lines_are_folded_at_spaces() {
        assert_eq!(folded("20 rows in 1.9 s, 0 gaps", 16), ["20 rows in 1.9", "  s, 0 gaps"]);
        assert_eq!(folded("a  b", usize::MAX), ["a  b"]);
        assert_eq!(folded("abcdef gh", 3), ["abcdef", "  gh"]);
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
