//! Vector ASC: `   0.016728 1  181             Rx   d 4 D2 04 00 00`.
//!
//! The header has the date and the number base. It also shows whether times count from the start or from the previous
//! event.

use super::date::date;
use super::text::{FrameOrFault, TimeZone, data_frame, digits, identifier, number, remote_frame, seconds};
use super::{Line, Parser};
use crate::bus::{Fault, Wall};
use crate::canopen::id::CanId;
use std::time::Duration;

/// If the first event of a trigger block with a date is before this time, the times start at the block. Otherwise they
/// start at the measurement.
const BLOCK_START: Duration = Duration::from_secs(1);

/// The flag of a CAN FD frame, and that of a remote frame.
const FD: u32 = 0x1000;
const REMOTE: u32 = 0x10;

pub(super) struct Asc {
    zone: TimeZone,
    base: u32,
    is_relative: bool,
    /// When the measurement started.
    start: Duration,
    /// The date of a trigger block without an event so far.
    block: Option<Duration>,
    /// The time of the last event after the start.
    last: Duration,
}

impl Asc {
    pub(super) fn new(zone: TimeZone) -> Asc {
        let zero = Duration::ZERO;
        Asc { zone, base: 16, is_relative: false, start: zero, block: None, last: zero }
    }

    /// Reads a line of the header, or between trigger blocks.
    fn header<'a>(&mut self, text: &str) -> Line<'a> {
        let text = text.to_ascii_lowercase();
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            ["date", ..] => self.start = date(&text["date".len()..], self.zone).unwrap_or_default(),
            ["base", base, ref rest @ ..] => {
                self.base = if base == "dec" { 10 } else { 16 };
                self.is_relative = rest.contains(&"relative");
            }
            ["begin", "triggerblock", ..] => self.block = date(&text["begin triggerblock".len()..], self.zone),
            ["end", "triggerblock", ..] | ["internal" | "no" | "previous", ..] => {}
            _ => return Line::Unknown,
        }
        Line::Ignored
    }

    /// The time of an event since 1970, or since the start if the file has no date.
    fn place(&mut self, time: Duration) -> Option<Wall> {
        if let Some(block) = self.block.take().filter(|_| time < BLOCK_START) {
            (self.start, self.last) = (block, Duration::ZERO);
        }
        self.last = if self.is_relative { self.last.checked_add(time)? } else { time };
        Some(Wall::at(self.start.checked_add(self.last)?))
    }

    /// An identifier: `181`, or `1890ABCDx` with 29 bits.
    fn identifier(&self, text: &str) -> Option<CanId> {
        match text.strip_suffix(['x', 'X']) {
            Some(text) => identifier(text, self.base, true),
            None => identifier(text, self.base, false),
        }
    }

    /// The identifier of a frame with a symbolic name, from the end of its line: `Length = 0 BitCount = 64 ID = 385`.
    fn named(words: &[&str]) -> Option<CanId> {
        let at = words.windows(2).position(|pair| pair == ["ID", "="])?;
        let text = words.get(at + 2)?;
        identifier(text.trim_end_matches('x'), 10, text.ends_with('x'))
    }

    /// Parses the text after the channel: `181 Rx d 2 01 02`, `181 Tx r 2`, `ErrorFrame`.
    fn event(&self, words: &[&str]) -> Option<Option<FrameOrFault>> {
        let (first, rest) = words.split_first()?;
        if first.eq_ignore_ascii_case("errorframe") {
            return Some(Some(Err(Fault::Protocol)));
        }
        let id = self.identifier(first);
        match rest {
            [direction, kind, rest @ ..] if is_direction(direction) => {
                let id = id.or_else(|| Asc::named(rest))?;
                let length = rest.first().copied();
                if kind.eq_ignore_ascii_case("r") {
                    let length = length.filter(|text| number(text).is_some_and(|it| it <= 8)).unwrap_or("0");
                    return Some(Some(Ok(remote_frame(id, length)?)));
                }
                // A data length code of 9 to 15 means 8 bytes.
                let length = digits(length?, self.base).filter(|&length| length < 16)?.min(8) as usize;
                Some(Some(Ok(data_frame(id, length, &rest[1..], self.base)?)))
            }
            // A request to send, a statistic, an event of another protocol.
            [direction, ..] if direction.eq_ignore_ascii_case("txrq") => Some(None),
            _ if id.is_none() => Some(None),
            _ => None,
        }
    }

    /// A frame on a channel of CAN FD, `1 Rx 181 Name 0 0 4 4 01 02 03 04 0 0 1000 …`. Classic frames are read.
    fn on_fd_channel(&self, words: &[&str]) -> Option<Option<FrameOrFault>> {
        let (direction, rest) = words.split_first()?;
        let (id, rest) = rest.split_first()?;
        if id.eq_ignore_ascii_case("errorframe") {
            return Some(Some(Err(Fault::Protocol)));
        }
        let id = self.identifier(id).filter(|_| is_direction(direction))?;
        let rest = if number(rest.first()?).is_some() { rest } else { &rest[1..] };
        let [_, _, code, length, data @ ..] = rest else { return None };
        let length = usize::try_from(number(length)?).ok()?;
        let flags = digits(data.get(length + 2)?, 16)?;
        if flags & FD != 0 || length > 8 {
            return Some(None);
        }
        Some(Some(Ok(if flags & REMOTE != 0 {
            remote_frame(id, code)?
        } else {
            data_frame(id, length, data, self.base)?
        })))
    }
}

fn is_direction(text: &str) -> bool {
    text.eq_ignore_ascii_case("rx") || text.eq_ignore_ascii_case("tx")
}

/// The state of a controller: `1 Status:chip status busoff`.
fn status(words: &[&str]) -> Option<FrameOrFault> {
    let text = words.concat().to_ascii_lowercase();
    let named = [
        ("busoff", Fault::BusOff),
        ("passive", Fault::ErrorPassive),
        ("warning", Fault::ErrorWarning),
        ("active", Fault::ErrorActive),
    ];
    let status = text.strip_prefix("status:")?;
    named.iter().find(|(name, _)| status.contains(name)).map(|(_, fault)| Err(*fault))
}

impl Parser for Asc {
    fn line<'a>(&mut self, text: &'a str) -> Line<'a> {
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let Some(time) = words.first().filter(|word| word.contains('.')).and_then(|word| seconds(word)) else {
            return self.header(text);
        };
        let Some(wall) = self.place(time) else { return Line::Unknown };
        let (channel, event) = match words[1..] {
            ["CANFD", channel, ref rest @ ..] => (channel, self.on_fd_channel(rest)),
            ["CAN", channel, ref rest @ ..] => (channel, Some(status(rest))),
            [channel, ref rest @ ..] if number(channel).is_some() => (channel, self.event(rest)),
            [_, ..] => return Line::Ignored,
            [] => return Line::Unknown,
        };
        Line::at(wall, channel, event)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::lines;
    use super::super::text::test_zone;
    use super::*;

    fn read(text: &str) -> Vec<String> {
        lines(&mut Asc::new(test_zone), text)
    }

    #[test]
    fn frames_in_both_number_bases() {
        let hex = "date Sat Jan 1 12:00:01.500 am 2000\nbase hex  timestamps absolute\ninternal events logged\n   \
                   0.250000 1  181             Rx   d 4 D2 04 00 FF  Length = 1 BitCount = 2 ID = 385\n   \
                   0.300000 2  1890ABCDx       Tx   d 0\n   0.310000 1  705             Rx   r\n   \
                   0.320000 1  705             Rx   r 1 Length = 0\n   0.330000 1  ErrorFrame\tECC: 10100010\n";
        assert_eq!(
            read(hex),
            ["1750 1 181#D20400FF", "1800 2 1890ABCD#", "1810 1 705#R", "1820 1 705#R1", "1830 1 Protocol"]
        );
        let dec = "base dec timestamps absolute\n0.25 1 385 Rx d 4 210 4 0 255\n0.3 1 412134349x Tx d 1 10\n";
        assert_eq!(read(dec), ["250 1 181#D20400FF", "300 1 1890ABCD#0A"]);
    }

    #[test]
    fn relative_times_are_added_up() {
        let text = "base hex timestamps relative\n0.5 1 181 Rx d 1 01\n0.25 1 Statistic: D 0 R 0 B 0.00%\n\
                    0.25 1 181 Rx d 1 02\n0.0 1 181 Rx d 1 03\n";
        assert_eq!(read(text), ["500 1 181#01", "1000 1 181#02", "1000 1 181#03"]);
    }

    #[test]
    fn date_of_a_trigger_block() {
        let text = "date Sat Jan 1 00:00:09 2000\nBegin Triggerblock Sat Jan 1 00:00:01 2000\n\
                    0.000000 Start of measurement\n0.5 1 181 Rx d 1 01\nEnd TriggerBlock\n";
        assert_eq!(read(text), ["1500 1 181#01"]);
        // The second block counts from the start of the measurement.
        let text = "date Sat Jan 1 00:00:01 2000\nBegin Triggerblock Sat Jan 1 00:00:31 2000\n30.5 1 181 Rx d 1 01\n";
        assert_eq!(read(text), ["31500 1 181#01"]);
    }

    #[test]
    fn other_events_are_ignored_and_states_are_faults() {
        let text = "0.1 CAN 1 Status:chip status error passive - TxErr: 132 RxErr: 0\n0.2 CAN 1 Status:chip status bus off\n\
                    0.3 1 J1939TP FEE3p 6 0 0 - Rx d 2 01 02\n0.4 1 181 TxRq d 1 01\n0.5 Li 1 x\n0.6 1 OverloadFrame\n\
                    0.7 1 Pressure Rx d 1 05 Length = 0 BitCount = 0 ID = 385\n";
        assert_eq!(read(text), ["100 1 ErrorPassive", "200 1 BusOff", "700 1 181#05"]);
    }

    #[test]
    fn classic_frames_of_an_fd_channel() {
        let text = "0.1 CANFD 1 Rx 181 Name 0 0 2 2 01 02 0 0 0 0 0 0 0 0\n0.2 CANFD 1 Rx 181 1 0 2 2 01 02 0 0 3000 0\n\
                    0.3 CANFD 2 Tx 705 0 0 1 0 0 0 10 0\n0.4 CANFD 1 Rx ErrorFrame\n";
        assert_eq!(read(text), ["100 1 181#0102", "300 2 705#R1", "400 1 Protocol"]);
    }

    #[test]
    fn broken_lines_are_unknown() {
        for text in [
            "0.1",
            "0.1 1",
            "0.1 1 18",
            "0.1 1 181 Rx",
            "0.1 1 181 Rx d",
            "0.1 1 181 Rx d 2 01",
            "0.1 1 181 Rx d 1 1",
            "nonsense",
            "0.1 1 181 Rx d 1 1FF",
            "0.1 1 181 Rx d 1 -1",
            "0.1 1 981 Rx d 1 01",
            "0.1 CANFD 1 Rx 181 0 0 2 2 01",
        ] {
            assert_eq!(read(text), ["Unknown"], "{text}");
        }
    }
}
