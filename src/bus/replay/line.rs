//! The lines of a candump recording.
//!
//! `candump -L` writes `(1436509053.249713) can0 123#1122`. On a screen, candump writes
//! `(1436509053.249713)  can0  123   [2]  11 22`, and with `-tA` a date in place of the seconds. Without `-t` the screen
//! form has no times.

use crate::bus::{Fault, Wall};
use crate::canopen::frame::Frame;
use std::borrow::Cow;
use std::time::Duration;

/// The flag of an error frame in an identifier (`CAN_ERR_FLAG`).
const ERROR_FRAME: u32 = 0x2000_0000;

/// One line of a recording.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Line {
    /// A frame or a fault, on this interface.
    Event(Wall, String, Result<Frame, Fault>),
    /// A frame without a time.
    WithoutTime,
    /// An empty line, a comment, or a CAN FD frame, which CANopen does not use.
    Ignored,
    /// Something else.
    Unknown,
}

/// Reads a line. `local` turns a date and time of this machine's time zone into seconds.
pub(super) fn parse(text: &str, local: fn([i32; 6]) -> Option<u64>) -> Line {
    let text = without_colours(text.trim());
    if text.is_empty() || text.starts_with(['#', ';']) || text.starts_with("//") {
        return Line::Ignored;
    }
    let Some((time, rest)) = text.strip_prefix('(').and_then(|text| text.split_once(')')) else {
        return if screen_frame(&text).is_some() { Line::WithoutTime } else { Line::Unknown };
    };
    // RFC 3339 has no years beyond 9999.
    let wall = seconds(time).or_else(|| date(time, local)).filter(|&wall| wall <= Wall::LAST);
    let Some(wall) = wall else { return Line::Unknown };
    let mut words = rest.split_ascii_whitespace();
    let (Some(interface), Some(frame)) = (words.next(), words.next()) else { return Line::Unknown };
    let event = if frame.contains('#') { log_frame(frame) } else { screen_frame(rest) };
    match event {
        Some(Some(event)) => Line::Event(wall, interface.to_owned(), event),
        Some(None) => Line::Ignored,
        None => Line::Unknown,
    }
}

/// The frame of `candump -L`; `None` inside for CAN FD.
fn log_frame(text: &str) -> Option<Option<Result<Frame, Fault>>> {
    if text.contains("##") {
        return Some(None);
    }
    if let Ok(frame) = text.parse() {
        return Some(Some(Ok(frame)));
    }
    let (id, _) = text.split_once('#')?;
    let id = u32::from_str_radix(id, 16).ok().filter(|id| id & ERROR_FRAME != 0)?;
    Some(Some(Err(fault(id))))
}

/// The frame of the screen form, `can0  123   [2]  11 22`, with or without direction and ASCII column.
fn screen_frame(text: &str) -> Option<Option<Result<Frame, Fault>>> {
    let mut words = text.split_ascii_whitespace().skip(1).peekable();
    let mut id = words.next()?;
    // `candump -x` writes the direction before the identifier.
    while words.peek().is_some_and(|word| !word.starts_with('[')) {
        id = words.next()?;
    }
    let length = words.next()?.strip_prefix('[')?.strip_suffix(']')?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let is_id = matches!(id.len(), 3 | 8) && id.bytes().all(|byte| byte.is_ascii_hexdigit());
    if !is_id || !is_number(length) {
        return None;
    }
    if length.len() > 1 {
        return Some(None);
    }
    let number = u32::from_str_radix(id, 16).ok()?;
    if id.len() == 8 && number & ERROR_FRAME != 0 {
        return Some(Some(Err(fault(number))));
    }
    let length: usize = length.parse().ok()?;
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
fn date(text: &str, local: fn([i32; 6]) -> Option<u64>) -> Option<Wall> {
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
    Some(Wall::at(Duration::new(local(fields)?, nanoseconds(fraction)?)))
}

fn nanoseconds(fraction: &str) -> Option<u32> {
    let digits = u32::try_from(fraction.len()).ok().filter(|digits| (1..=9).contains(digits))?;
    u32::try_from(number(fraction)?.checked_mul(10u64.pow(9 - digits))?).ok()
}

/// Parses digits only: `parse` would also accept a sign.
fn number(text: &str) -> Option<u64> {
    if text.bytes().all(|byte| byte.is_ascii_digit()) { text.parse().ok() } else { None }
}

/// Removes the escape sequences of `candump -c`.
fn without_colours(text: &str) -> Cow<'_, str> {
    if !text.contains('\x1b') {
        return Cow::Borrowed(text);
    }
    let mut parts = text.split('\x1b');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain.push_str(part.split_once('m').map_or(part, |(_, rest)| rest));
    }
    Cow::Owned(plain.trim().to_owned())
}

/// The fault of an error frame by the class in its identifier (linux/can/error.h).
fn fault(classes: u32) -> Fault {
    let named = [
        (0x040, Fault::BusOff),
        (0x100, Fault::Restarted),
        (0x020, Fault::NoAcknowledge),
        (0x008, Fault::Protocol),
        (0x080, Fault::Protocol),
        (0x010, Fault::Transceiver),
        (0x001, Fault::TransmitTimeout),
    ];
    named.iter().find(|(class, _)| classes & class != 0).map_or(Fault::Other, |(_, fault)| *fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Days of 24 hours from 2000-01-01, months of 31 days.
    fn local([year, month, day, hour, minute, second]: [i32; 6]) -> Option<u64> {
        let days = ((year - 2000) * 12 + month - 1) * 31 + day - 1;
        u64::try_from(days * 86_400 + hour * 3_600 + minute * 60 + second).ok()
    }

    fn frame(text: &str) -> Option<(Duration, String)> {
        match parse(text, local) {
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
            " (1436509053.249713)  can0  123   [2]  11 22",
            " (1436509053.249713)  can0  RX - -  123   [2]  11 22   '.\"'",
            "\x1b[34m (1436509053.249713)  can0  123   [2]  11 22\x1b[0m",
        ] {
            assert_eq!(frame(text), Some((at, "can0 123#1122".to_owned())), "{text}");
        }
        let text = " (2000-01-02 00:00:01.500000)  vcan1  00000123   [0]  remote request";
        assert_eq!(frame(text), Some((Duration::new(86_401, 500_000_000), "vcan1 00000123#R".to_owned())));
        assert_eq!(frame("(1.5) can0  080   [0]").map(|(_, frame)| frame), Some("can0 080#".to_owned()));
    }

    #[test]
    fn the_screen_form_without_times_is_recognised() {
        for text in
            ["  can0  605   [8]  40 00 10 00 00 00 00 00", "vcan0  00000123   [0]", "can0  TX B E  605   [1]  40"]
        {
            assert_eq!(parse(text, local), Line::WithoutTime, "{text}");
        }
    }

    #[test]
    fn comments_and_can_fd_are_ignored() {
        for text in ["", "# bench 2", "; x", "// y", "(1.5) can0 123##1AABB", "(1.5)  can0  123  [12]  00 11"] {
            assert_eq!(parse(text, local), Line::Ignored, "{text}");
        }
    }

    #[test]
    fn error_frames_are_faults() {
        for text in [
            "(1.5) can0 20000040#0000000000000000",
            "(1.5)  can0  20000040   [8]  00 00 00 00 00 00 00 00   ERRORFRAME",
        ] {
            assert_eq!(
                parse(text, local),
                Line::Event(Wall::at(Duration::from_millis(1500)), "can0".into(), Err(Fault::BusOff))
            );
        }
    }

    #[test]
    fn other_lines_are_unknown() {
        for text in [
            "nonsense",
            "(1.5 can0 181#01",
            "(+1.5) can0 181#01",
            "(1.5) can0 181",
            "(253402300800.000000) can0 181#01",
            "(18446744073709551615.999999999) can0 181#01",
            "(18446744073709551616.0) can0 181#01",
            "(1.5) can0 999#01",
            "(1.5) c",
            "(1.5)",
            "(1.5)  can0  123   [2]  11",
            "(1.5)  can0  123   [2]  00010001 00100010",
            "(2000-01-02 00:00.5) can0 181#01",
        ] {
            assert_eq!(parse(text, local), Line::Unknown, "{text}");
        }
    }
}
