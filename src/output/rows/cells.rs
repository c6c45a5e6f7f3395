//! Writes the cells of a CSV row: times, numbers and text, without allocations.

use crate::bus::time::Wall;
use crate::measure::sample::{Number, Raw};
use std::io::{self, Write};
use std::time::Duration;

/// The separators of CSV. Spreadsheets in different countries expect different separators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dialect {
    /// Separates two cells: one ASCII character.
    pub delimiter: u8,
    /// The decimal sign: `.` or `,`.
    pub decimal: u8,
    /// Whether a file starts with a byte order mark.
    pub bom: bool,
}

impl Default for Dialect {
    fn default() -> Dialect {
        Dialect { delimiter: b',', decimal: b'.', bom: false }
    }
}

/// The form of times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimeForm {
    /// `2023-11-14T22:13:21.010001Z`.
    #[default]
    Rfc3339,
    /// Seconds since 1970-01-01 UTC, with microseconds.
    Unix,
    /// Days since 1899-12-30 UTC, as in spreadsheets.
    Excel,
}

/// The UTF-8 byte order mark.
pub(super) const BOM: &[u8] = b"\xef\xbb\xbf";

/// Days from 1899-12-30 to 1970-01-01.
const DAYS_BEFORE_1970: u64 = 25_569;

/// Microseconds of a day.
const DAY_US: u128 = 86_400_000_000;

/// Decimal digits of a day, finer than a microsecond.
const DAY_DIGITS: usize = 11;

/// The bytes of a time without the microseconds: `2023-11-14T22:13:21.`.
const SECOND_BYTES: usize = 20;

/// Writes times. The text of a second is kept until the next second.
#[derive(Debug)]
pub(in crate::output) struct Times {
    form: TimeForm,
    second: Option<u64>,
    /// The last time in RFC 3339.
    text: [u8; 27],
}

impl Times {
    pub(in crate::output) fn new(form: TimeForm) -> Times {
        Times { form, second: None, text: *b"1970-01-01T00:00:00.000000Z" }
    }

    /// Sets the text to the second of `since`.
    fn start_second(&mut self, since: Duration) -> io::Result<()> {
        let wall = Wall::at(Duration::from_secs(since.as_secs()));
        // RFC 3339 and `system_time` do not allow years after 9999.
        if wall > Wall::LAST {
            return Err(io::Error::other("a time after the year 9999"));
        }
        let text = humantime::format_rfc3339_micros(wall.system_time()).to_string();
        self.text[..SECOND_BYTES].copy_from_slice(&text.as_bytes()[..SECOND_BYTES]);
        self.second = Some(since.as_secs());
        Ok(())
    }

    /// A time as a JSON value: text or a number.
    pub(in crate::output) fn json(&mut self, wall: Wall) -> io::Result<serde_json::Value> {
        let mut text = Vec::new();
        self.write(&mut text, wall, b'.')?;
        let text = String::from_utf8_lossy(&text);
        match self.form {
            TimeForm::Rfc3339 => Ok(text.into()),
            TimeForm::Unix | TimeForm::Excel => Ok(text.parse::<f64>().map_err(io::Error::other)?.into()),
        }
    }

    /// Writes a time.
    pub(in crate::output) fn write(&mut self, out: &mut Vec<u8>, wall: Wall, decimal: u8) -> io::Result<()> {
        let since = wall.since_epoch();
        match self.form {
            TimeForm::Rfc3339 => {
                if self.second != Some(since.as_secs()) {
                    self.start_second(since)?;
                }
                self.text[SECOND_BYTES..][..6].copy_from_slice(&six_digits(since.subsec_micros()));
                out.extend_from_slice(&self.text);
            }
            TimeForm::Unix => push_seconds(out, since, decimal),
            TimeForm::Excel => {
                let rest = since.as_micros() % DAY_US;
                let scale = 10u128.pow(11);
                // Half a unit is added for rounding. The result may be in the next day.
                let fraction = (rest * scale + DAY_US / 2) / DAY_US;
                let days = u64::try_from(since.as_micros() / DAY_US + fraction / scale).unwrap_or(u64::MAX);
                push_number(out, days.saturating_add(DAYS_BEFORE_1970));
                out.push(decimal);
                push_padded(out, u64::try_from(fraction % scale).unwrap_or(0), DAY_DIGITS);
            }
        }
        Ok(())
    }
}

/// Seconds with six decimals.
pub(in crate::output) fn push_seconds(out: &mut Vec<u8>, length: Duration, decimal: u8) {
    push_number(out, length.as_secs());
    let [a, b, c, d, e, f] = six_digits(length.subsec_micros());
    out.extend_from_slice(&[decimal, a, b, c, d, e, f]);
}

/// The last six decimal digits of a number.
fn six_digits(mut number: u32) -> [u8; 6] {
    let mut digits = [0; 6];
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (number % 10) as u8;
        number /= 10;
    }
    digits
}

/// An integer.
pub(in crate::output) fn push_number(out: &mut Vec<u8>, number: u64) {
    push_padded(out, number, 1);
}

/// An integer with leading zeros, at least `width` digits.
fn push_padded(out: &mut Vec<u8>, mut number: u64, width: usize) {
    let mut digits = [b'0'; 20];
    let mut at = digits.len();
    while number > 0 || digits.len() - at < width.min(digits.len()) {
        at -= 1;
        digits[at] = b'0' + (number % 10) as u8;
        number /= 10;
    }
    out.extend_from_slice(&digits[at..]);
}

/// 10⁰ to 10¹⁸.
const POWERS_OF_TEN: [u64; 19] = {
    let (mut powers, mut at) = ([1; 19], 1);
    while at < powers.len() {
        powers[at] = powers[at - 1] * 10;
        at += 1;
    }
    powers
};

/// Writes a measured number; writes nothing for `None`.
pub(super) fn push_value(out: &mut Vec<u8>, value: Option<Number>, decimal: u8) -> io::Result<()> {
    match value {
        None => {}
        Some(Number::Decimal { mantissa, digits: digits @ 0..=18 }) if i64::try_from(mantissa).is_ok() => {
            if mantissa < 0 {
                out.push(b'-');
            }
            let size = u64::try_from(mantissa.unsigned_abs()).unwrap_or(0);
            let power = POWERS_OF_TEN[usize::from(digits)];
            push_number(out, size / power);
            if digits > 0 {
                out.push(decimal);
                push_padded(out, size % power, usize::from(digits));
            }
        }
        Some(Number::Real32(real)) if push_short_real(out, real, decimal) => {}
        Some(number) => {
            let begin = out.len();
            write!(out, "{number}")?;
            if decimal != b'.' {
                out[begin..].iter_mut().filter(|byte| **byte == b'.').for_each(|byte| *byte = decimal);
            }
        }
    }
    Ok(())
}

/// Writes a REAL32 as its `Display` does, the shortest text that parses to the same number, but faster. Returns `false`
/// without writing if the number is very small or large, or if two texts are equally near.
fn push_short_real(out: &mut Vec<u8>, real: f32, decimal: u8) -> bool {
    if !(1e-4..1e12).contains(&real.abs()) {
        return false;
    }
    let mut buffer = ryu::Buffer::new();
    let text = buffer.format_finite(real);
    let text = text.strip_suffix(".0").unwrap_or(text);
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    // `ryu` rounds half of the last digit to an even digit, `Display` rounds it up. The product is exact.
    let halves = f64::from(real.abs()) * 10f64.powi(i32::try_from(fraction.len()).unwrap_or(i32::MAX)) * 2.0;
    if halves % 2.0 == 1.0 {
        return false;
    }
    out.extend_from_slice(whole.as_bytes());
    if !fraction.is_empty() {
        out.push(decimal);
        out.extend_from_slice(fraction.as_bytes());
    }
    true
}

/// Bytes in wire order, after `0x`.
pub(super) fn push_raw(out: &mut Vec<u8>, raw: &Raw) {
    const DIGITS: &[u8; 16] = b"0123456789ABCDEF";
    let (mut text, bytes) = (*b"0x0000000000000000", raw.bytes());
    for (digits, byte) in text[2..].chunks_exact_mut(2).zip(bytes) {
        (digits[0], digits[1]) = (DIGITS[usize::from(byte >> 4)], DIGITS[usize::from(byte & 15)]);
    }
    out.extend_from_slice(&text[..2 + 2 * bytes.len()]);
}

/// Text; in quotes if it contains a delimiter, a quote or a line end.
pub(in crate::output) fn push_text(out: &mut Vec<u8>, text: &str, delimiter: u8) {
    if text.bytes().any(|byte| byte == delimiter || matches!(byte, b'"' | b'\n' | b'\r')) {
        out.push(b'"');
        for byte in text.bytes() {
            out.extend_from_slice(if byte == b'"' { b"\"\"" } else { std::slice::from_ref(&byte) });
        }
        out.push(b'"');
    } else {
        out.extend_from_slice(text.as_bytes());
    }
}

/// A line of text cells.
pub(in crate::output) fn push_texts<'a>(out: &mut Vec<u8>, texts: impl IntoIterator<Item = &'a str>, delimiter: u8) {
    for (at, text) in texts.into_iter().enumerate() {
        if at > 0 {
            out.push(delimiter);
        }
        push_text(out, text, delimiter);
    }
    out.push(b'\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn time(form: TimeForm, since: Duration) -> String {
        let mut out = Vec::new();
        Times::new(form).write(&mut out, Wall::at(since), b'.').expect("a time");
        String::from_utf8(out).expect("text")
    }

    fn value(number: Number, decimal: u8) -> String {
        let mut out = Vec::new();
        push_value(&mut out, Some(number), decimal).expect("memory");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn times_in_three_forms() {
        let since = Duration::from_micros(1_700_000_001_010_001);
        assert_eq!(time(TimeForm::Rfc3339, since), "2023-11-14T22:13:21.010001Z");
        assert_eq!(time(TimeForm::Unix, since), "1700000001.010001");
        // 45244 is 2023-11-14; 22:13:21.010001 of 24 hours is 0.92593761575.
        assert_eq!(time(TimeForm::Excel, since), "45244.92593761575");
        assert_eq!(time(TimeForm::Excel, Duration::ZERO), "25569.00000000000");
        // Half a day, and the last microsecond of a day.
        assert_eq!(time(TimeForm::Excel, Duration::from_secs(43_200)), "25569.50000000000");
        assert_eq!(time(TimeForm::Excel, Duration::from_micros(86_399_999_999)), "25569.99999999999");
    }

    #[test]
    fn time_text_follows_the_second() {
        let mut times = Times::new(TimeForm::default());
        let mut out = Vec::new();
        for micros in [1_999_999, 2_000_000, 1_000_000] {
            times.write(&mut out, Wall::at(Duration::from_micros(micros)), b'.').expect("a time");
            out.push(b' ');
        }
        assert_eq!(
            String::from_utf8_lossy(&out),
            "1970-01-01T00:00:01.999999Z 1970-01-01T00:00:02.000000Z 1970-01-01T00:00:01.000000Z "
        );
        assert!(times.write(&mut out, Wall::at(Duration::from_secs(1 << 40)), b'.').is_err(), "the year 36812");
    }

    #[test]
    fn decimal_commas() {
        assert_eq!(value(Number::Decimal { mantissa: -50_001, digits: 3 }, b','), "-50,001");
        assert_eq!(value(Number::Real32(-1.5), b','), "-1,5");
        assert_eq!(value(Number::Real64(1.5e-300), b','), "1,5e-300");
    }

    #[test]
    fn text_is_quoted_if_necessary() {
        let line = |delimiter| {
            let mut out = Vec::new();
            push_texts(&mut out, ["a,b", "c;d", "e\"f", ""], delimiter);
            String::from_utf8(out).expect("text")
        };
        assert_eq!(line(b','), "\"a,b\",c;d,\"e\"\"f\",\n");
        assert_eq!(line(b';'), "a,b;\"c;d\";\"e\"\"f\";\n");
    }

    proptest! {
        #[test]
        fn reals_match_their_display(
            single: u32, double: u64, near in -1e13f32..1e13, eighths in -50_000_000i32..50_000_000,
        ) {
            for real in [f32::from_bits(single), near, near * 1e-10, near.trunc(), eighths as f32 / 8.0] {
                prop_assert_eq!(value(Number::Real32(real), b'.'), Number::Real32(real).to_string());
            }
            for real in [f64::from_bits(double), near.into()] {
                prop_assert_eq!(value(Number::Real64(real), b'.'), Number::Real64(real).to_string());
            }
        }

        #[test]
        fn numbers_and_times_match_their_display(
            mantissa in any::<i128>(), small in any::<i64>(), digits in 0u8..=38, since in 0u64..250_000_000_000_000_000,
        ) {
            for mantissa in [mantissa, i128::from(small), i128::from(small % 1000)] {
                let number = Number::Decimal { mantissa, digits };
                prop_assert_eq!(value(number, b'.'), number.to_string());
            }
            let since = Duration::from_micros(since);
            let own = humantime::format_rfc3339_micros(Wall::at(since).system_time()).to_string();
            prop_assert_eq!(time(TimeForm::Rfc3339, since), own);
        }
    }
}
