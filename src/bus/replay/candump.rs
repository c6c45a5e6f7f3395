//! The lines of a candump recording.
//!
//! `candump -L` writes `(1436509053.249713) can0 123#1122`. On a screen, candump writes
//! `(1436509053.249713) can0 123 [2] 11 22`, and with `-tA` a date instead of the seconds. Without `-t` the screen form
//! has no times.

use super::text::{ERROR_FRAME, FrameOrFault, TimeZone, digits, fault, number};
use super::{Channel, Line, Parser};
use crate::bus::Wall;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use std::time::Duration;

pub(super) struct Candump {
    zone: TimeZone,
}

impl Candump {
    pub(super) fn new(zone: TimeZone) -> Candump {
        Candump { zone }
    }
}

impl Parser for Candump {
    fn line<'a>(&mut self, text: &'a str) -> Line<'a> {
        let Some((time, rest)) = text.strip_prefix('(').and_then(|text| text.split_once(')')) else {
            return if has_no_time(text) { Line::WithoutTime } else { Line::Unknown };
        };
        let Some(wall) = seconds(time).or_else(|| date(time, self.zone)) else { return Line::Unknown };
        let mut words = rest.split_ascii_whitespace();
        let (Some(interface), Some(frame)) = (words.next(), words.next()) else { return Line::Unknown };
        let event = if frame.contains('#') { log_frame(frame) } else { screen_frame(rest) };
        Line::at(wall, interface, event)
    }
}

/// A line in the fixed form.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct FixedLine {
    pub(super) wall: Wall,
    /// The position of its channel in the list of known channels.
    pub(super) channel: usize,
    pub(super) frame: Frame,
    /// The number of bytes, with the line end.
    pub(super) length: usize,
}

/// Reads the line at the start of `bytes` if it has the fixed form of `candump -L`, `(1436509053.249713) can0 123#1122`:
/// a data frame with an 11-bit identifier, on one of `channels`. `None` for every other line: the parser reads it. Most
/// recordings have millions of such lines.
pub(super) fn fixed_line(bytes: &[u8], channels: &[Channel]) -> Option<FixedLine> {
    let (b"(", rest) = bytes.split_first_chunk::<1>()? else { return None };
    let (seconds, rest) = rest.split_first_chunk::<10>()?;
    let (b".", rest) = rest.split_first_chunk::<1>()? else { return None };
    let (micros, rest) = rest.split_first_chunk::<6>()?;
    let rest = rest.strip_prefix(b") ")?;
    let after = |channel: &Channel| rest.strip_prefix(channel.name.as_bytes())?.strip_prefix(b" ");
    let (channel, rest) = channels.iter().enumerate().find_map(|(at, channel)| Some((at, after(channel)?)))?;
    let (&[first, second, third, b'#'], rest) = rest.split_first_chunk::<4>()? else { return None };
    let id = CanId::standard(u16::from(hex(b'0', first)?) << 8 | u16::from(hex(second, third)?))?;
    let (mut data, mut count) = ([0; 8], 0);
    let (pairs, _) = rest.as_chunks::<2>();
    for (place, &[high, low]) in data.iter_mut().zip(pairs) {
        let Some(byte) = hex(high, low) else { break };
        (*place, count) = (byte, count + 1);
    }
    let b'\n' = rest.get(2 * count)? else { return None };
    let wall = Wall::at(Duration::new(decimal(seconds)?, u32::try_from(decimal(micros)?).ok()? * 1000));
    let length = bytes.len() - rest.len() + 2 * count + 1;
    Some(FixedLine { wall, channel, frame: Frame::new(id, &data[..count]).ok()?, length })
}

fn decimal<const N: usize>(digits: &[u8; N]) -> Option<u64> {
    let is_number = digits.iter().fold(true, |all, digit| all & digit.is_ascii_digit());
    let number = digits.iter().fold(0, |number, digit| number * 10 + u64::from(digit & 0x0f));
    is_number.then_some(number)
}

/// The byte with these two digits.
fn hex(high: u8, low: u8) -> Option<u8> {
    let (high, low) = (HEX_DIGITS[usize::from(high)], HEX_DIGITS[usize::from(low)]);
    ((high | low) < 16).then_some(high << 4 | low)
}

/// The value of each hexadecimal digit; 255 for other bytes.
const HEX_DIGITS: [u8; 256] = {
    let (mut values, mut value) = ([u8::MAX; 256], 0);
    while value < 16 {
        let digit = b"0123456789abcdef"[value as usize];
        values[digit as usize] = value;
        values[digit.to_ascii_uppercase() as usize] = value;
        value += 1;
    }
    values
};

/// Whether a line has the screen form or the log form without time.
pub(super) fn has_no_time(text: &str) -> bool {
    let mut words = text.split_ascii_whitespace().skip(1);
    screen_frame(text).is_some() || words.next().is_some_and(|frame| log_frame(frame).is_some())
}

/// The frame of `candump -L`; `Some(None)` for CAN FD.
fn log_frame(text: &str) -> Option<Option<FrameOrFault>> {
    if text.contains("##") {
        return Some(None);
    }
    // `candump -8` adds the data length code to frames with eight bytes: `123#1122334455667788_C`.
    let is_code = |code: &str| matches!(code.as_bytes(), [b'9' | b'A'..=b'F' | b'a'..=b'f']);
    let text = text.rsplit_once('_').filter(|(_, code)| is_code(code)).map_or(text, |(frame, _)| frame);
    if let Ok(frame) = text.parse() {
        return Some(Some(Ok(frame)));
    }
    let (id, _) = text.split_once('#')?;
    let id = u32::from_str_radix(id, 16).ok().filter(|id| id & ERROR_FRAME != 0)?;
    Some(Some(Err(fault(id))))
}

/// The frame of the screen form, `can0  123   [2]  11 22`, with or without direction and ASCII column. `Some(None)` for
/// CAN FD.
fn screen_frame(text: &str) -> Option<Option<FrameOrFault>> {
    let mut words = text.split_ascii_whitespace().skip(1).peekable();
    let mut id = words.next()?;
    // `candump -x` writes the direction before the identifier.
    while words.peek().is_some_and(|word| !word.starts_with(['[', '{'])) {
        id = words.next()?;
    }
    let is_id = matches!(id.len(), 3 | 8) && id.bytes().all(|byte| byte.is_ascii_hexdigit());
    let length = words.next().filter(|_| is_id)?;
    let length = if let Some(code) = length.strip_prefix('{') {
        // `candump -8` writes the data length code. Codes above 8 mean eight bytes.
        digits(code.strip_suffix('}')?, 16)?.min(8) as usize
    } else {
        let length = length.strip_prefix('[')?.strip_suffix(']')?;
        let is_number = !length.is_empty() && length.bytes().all(|byte| byte.is_ascii_digit());
        match length.len() {
            1 if is_number => length.parse().ok()?,
            _ if is_number => return Some(None),
            _ => return None,
        }
    };
    let number = u32::from_str_radix(id, 16).ok()?;
    if id.len() == 8 && number & ERROR_FRAME != 0 {
        return Some(Some(Err(fault(number))));
    }
    if words.peek() == Some(&"remote") {
        return Some(Some(Ok(format!("{id}#R{length}").parse().ok()?)));
    }
    let bytes: Vec<&str> = words.take(length).collect();
    // `candump -i` writes bits, `candump -S` joins the bytes with "`".
    if bytes.len() != length || bytes.iter().any(|byte| byte.len() != 2) {
        return None;
    }
    Some(Some(Ok(format!("{id}#{}", bytes.concat()).parse().ok()?)))
}

/// `1436509053.249713`.
fn seconds(text: &str) -> Option<Wall> {
    let (seconds, fraction) = text.split_once('.')?;
    Some(Wall::at(Duration::new(number(seconds)?, nanoseconds(fraction)?)))
}

/// `2023-11-14 22:13:20.000000`, as candump writes it in the time zone of the machine.
fn date(text: &str, zone: TimeZone) -> Option<Wall> {
    let (text, fraction) = text.split_once('.')?;
    let (day, time) = text.split_once(' ')?;
    let mut parts =
        day.split('-').chain(time.split(':')).map(|part| number(part).and_then(|it| i32::try_from(it).ok()));
    let mut fields = [0; 6];
    for field in &mut fields {
        *field = parts.next()??;
    }
    if parts.next().is_some() {
        return None;
    }
    Some(Wall::at(Duration::new(zone(fields)?, nanoseconds(fraction)?)))
}

fn nanoseconds(fraction: &str) -> Option<u32> {
    let digits = u32::try_from(fraction.len()).ok().filter(|digits| (1..=9).contains(digits))?;
    u32::try_from(number(fraction)?.checked_mul(10u64.pow(9 - digits))?).ok()
}

#[cfg(test)]
mod tests {
    use super::super::text::test_zone;
    use super::*;
    use crate::bus::Fault;
    use proptest::prelude::*;

    fn parse(text: &str) -> Line<'_> {
        Candump::new(test_zone).line(text)
    }

    fn frame(text: &str) -> Option<(Duration, String)> {
        match parse(text) {
            Line::Event(wall, interface, Ok(frame)) => Some((wall.since_epoch(), format!("{interface} {frame}"))),
            _ => None,
        }
    }

    #[test]
    fn both_forms_with_absolute_times() {
        let at = Duration::new(1_436_509_053, 249_713_000);
        for text in [
            "(1436509053.249713) can0 123#1122",
            "(1436509053.249713) can0 123#1122 R",
            "(1436509053.249713)  can0  123   [2]  11 22",
            "(1436509053.249713)  can0  RX - -  123   [2]  11 22   '.\"'",
            "(1436509053.249713)  can0  123   {2}  11 22",
        ] {
            assert_eq!(frame(text), Some((at, "can0 123#1122".to_owned())), "{text}");
        }
        let text = "(2000-01-02 00:00:01.500000)  vcan1  00000123   [0]  remote request";
        assert_eq!(frame(text), Some((Duration::new(86_401, 500_000_000), "vcan1 00000123#R".to_owned())));
        assert_eq!(frame("(1.5) can0  080   [0]").map(|(_, frame)| frame), Some("can0 080#".to_owned()));
    }

    fn channels() -> [Channel; 2] {
        ["can", "can0"].map(|name| Channel { name: name.to_owned(), is_wanted: true })
    }

    #[test]
    fn fixed_line_ends_at_its_line_end() {
        let line = "(1436509053.249713) can0 123#1122\n";
        let at = Wall::at(Duration::new(1_436_509_053, 249_713_000));
        let frame = "123#1122".parse().expect("a frame");
        let expected = FixedLine { wall: at, channel: 1, frame, length: line.len() };
        for rest in ["", "x", "(1436509053.249713) can0 124#\n"] {
            let text = format!("{line}{rest}");
            assert_eq!(fixed_line(text.as_bytes(), &channels()).as_ref(), Some(&expected), "{text}");
        }
        for end in 0..line.len() {
            assert_eq!(fixed_line(&line.as_bytes()[..end], &channels()), None, "{end} bytes");
        }
        assert_eq!(fixed_line(line.as_bytes(), &channels()[..1]), None, "an unknown channel");
    }

    proptest! {
        /// A line is read in the fixed form only if the parser reads it, with the same result.
        #[test]
        fn fixed_form_agrees_with_the_parser(
            text in r"\(?[0-9]{9,11}[.][0-9:]{5,7}\) ?(can|can0|can00|vcan)? [0-9A-Fa-fg]{2,4}#{1,2}[0-9A-FR]{0,18} ?R?",
            end in "[ \r]?\n?",
        ) {
            let line = text.clone() + &end;
            let channels = channels();
            if let Some(fixed) = fixed_line(line.as_bytes(), &channels) {
                let name = &channels[fixed.channel].name;
                prop_assert_eq!(parse(line.trim()), Line::Event(fixed.wall, name, Ok(fixed.frame)));
                prop_assert_eq!(fixed.length, line.len());
            }
        }

        #[test]
        fn candump_writes_the_fixed_form(seconds in 0u64..9_999_999_999, micros in 0u32..1_000_000, id in 0u16..0x800, data: [u8; 8], length in 0usize..=8) {
            let frame = Frame::new(CanId::standard(id).expect("11 bits"), &data[..length]).expect("8 bytes");
            let line = format!("({seconds:010}.{micros:06}) can0 {frame}\n");
            let wall = Wall::at(Duration::new(seconds, micros * 1000));
            let expected = FixedLine { wall, channel: 1, frame, length: line.len() };
            prop_assert_eq!(fixed_line(line.as_bytes(), &channels()), Some(expected));
        }
    }

    #[test]
    fn data_length_codes_above_8_are_eight_bytes() {
        for text in ["(1.5) can0 123#1122334455667788_C", "(1.5)  can0  123   {C}  11 22 33 44 55 66 77 88"] {
            let expected = (Duration::from_millis(1500), "can0 123#1122334455667788".to_owned());
            assert_eq!(frame(text), Some(expected), "{text}");
        }
    }

    #[test]
    fn frames_without_times_are_recognised() {
        for text in [
            "can0  605   [8]  40 00 10 00 00 00 00 00",
            "vcan0  00000123   [0]",
            "can0  TX B E  605   [1]  40",
            "can0 605#4000100000000000",
        ] {
            assert_eq!(parse(text), Line::WithoutTime, "{text}");
        }
    }

    #[test]
    fn can_fd_is_ignored() {
        for text in ["(1.5) can0 123##1AABB", "(1.5)  can0  123  [12]  00 11"] {
            assert_eq!(parse(text), Line::Ignored, "{text}");
        }
    }

    #[test]
    fn error_frames_are_faults() {
        for text in [
            "(1.5) can0 20000040#0000000000000000",
            "(1.5)  can0  20000040   [8]  00 00 00 00 00 00 00 00   ERRORFRAME",
        ] {
            assert_eq!(parse(text), Line::Event(Wall::at(Duration::from_millis(1500)), "can0", Err(Fault::BusOff)));
        }
    }

    #[test]
    fn other_lines_are_unknown() {
        for text in [
            "nonsense",
            "(1.5 can0 181#01",
            "(+1.5) can0 181#01",
            "(1.5) can0 181",
            "(18446744073709551616.0) can0 181#01",
            "(1.5) can0 999#01",
            "(1.5) c",
            "(1.5)",
            "(1.5)  can0  123   [2]  11",
            "(1.5)  can0  123   {X}  11",
            "(1.5) can0 123#11_Z",
            "(1.5)  can0  123   [2]  00010001 00100010",
            "(2000-01-02 00:00.5) can0 181#01",
        ] {
            assert_eq!(parse(text), Line::Unknown, "{text}");
        }
    }
}
