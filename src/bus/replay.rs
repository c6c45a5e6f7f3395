//! Replays a `candump -L` log as a bus.
//!
//! The time is that of the log. It passes as fast as the program reads; nothing waits.

use super::{BitRateControl, Bus, BusError, Event, Fault, Filters, Mono, Received, Stamp, TimestampSource, Wall};
use crate::canopen::frame::Frame;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::time::Duration;

/// The flag of an error frame in an identifier of a log (`CAN_ERR_FLAG`).
const ERROR_FRAME: u32 = 0x2000_0000;

/// The longest valid line in bytes.
const MAX_LINE: u64 = 4096;

/// A `candump -L` log as a bus that only receives.
pub struct Replay {
    file: String,
    lines: Box<dyn BufRead>,
    line: String,
    number: u64,
    /// The interface in the log.
    interface: String,
    /// The wall time of the first line. It is the start of the monotonic time line.
    begin: Option<Wall>,
    now: Mono,
    /// The next event.
    next: Option<(Stamp, Event)>,
    state: State,
    filters: Filters,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Reading,
    /// The last line was read.
    AtEnd,
    /// The end was reported.
    EndReported,
}

/// One line of a log.
enum Line<'a> {
    Frame(Wall, &'a str, Frame),
    Fault(Wall, &'a str, Fault),
    /// An empty line, or a CAN FD frame, which CANopen does not use.
    Ignored,
}

impl Replay {
    /// Opens the log `file`; `-` is standard input.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(file: &str) -> io::Result<Replay> {
        if file == "-" {
            return Ok(Replay::new("standard input", Box::new(BufReader::new(io::stdin()))));
        }
        Ok(Replay::new(file, Box::new(BufReader::with_capacity(1 << 16, File::open(file)?))))
    }

    fn new(file: &str, lines: Box<dyn BufRead>) -> Replay {
        Replay {
            file: file.to_owned(),
            lines,
            line: String::new(),
            number: 0,
            interface: String::new(),
            begin: None,
            now: Mono::START,
            next: None,
            state: State::Reading,
            filters: Filters::All,
        }
    }

    fn stamp(&self, mono: Mono) -> Stamp {
        Stamp { mono, wall: self.begin.unwrap_or_default() + mono.since_start() }
    }

    fn wrong(&self, what: &str) -> BusError {
        let source = io::Error::new(io::ErrorKind::InvalidData, what.to_owned());
        BusError::File { what: format!("replay {}:{}", self.file, self.number), source }
    }

    /// Reads the next event of the log.
    fn fetch(&mut self) -> Result<(), BusError> {
        while self.next.is_none() && self.state == State::Reading {
            self.line.clear();
            let read = (&mut self.lines).take(MAX_LINE).read_line(&mut self.line);
            let length = read.map_err(|source| BusError::File { what: format!("replay {}", self.file), source })?;
            if length == 0 {
                self.state = State::AtEnd;
                return Ok(());
            }
            self.number += 1;
            let whole = self.line.ends_with('\n');
            let (wall, interface, event) = match line(self.line.trim()) {
                Some(Line::Ignored) => continue,
                Some(Line::Frame(wall, interface, frame)) => (wall, interface, Ok(frame)),
                Some(Line::Fault(wall, interface, fault)) => (wall, interface, Err(fault)),
                // The recording was stopped in the middle of a line.
                None if !whole => continue,
                None => return Err(self.wrong("not a line of a candump log (record with candump -L)")),
            };
            if self.interface.is_empty() {
                interface.clone_into(&mut self.interface);
            } else if self.interface != interface {
                let what = format!("frames of {interface} and of {}: select one interface (grep)", self.interface);
                return Err(self.wrong(&what));
            }
            let begin = self.begin.get_or_insert(wall).since_epoch();
            // If the clock was set back during the recording, the order of the frames stays.
            let mono = Mono::at(wall.since_epoch().saturating_sub(begin)).max(self.now);
            let at = Stamp { mono, wall };
            self.next = match event {
                Ok(frame) if !self.filters.wants(&frame) => None,
                Ok(frame) => Some((at, Event::Frame(Received { frame, at }))),
                Err(fault) => Some((at, Event::Fault(fault, at))),
            };
        }
        Ok(())
    }
}

/// Parses `(1436509053.249713) can0 123#1122`, with or without a direction at the end.
fn line(text: &str) -> Option<Line<'_>> {
    if text.is_empty() {
        return Some(Line::Ignored);
    }
    let (seconds, rest) = text.strip_prefix('(')?.split_once(") ")?;
    let (seconds, fraction) = seconds.split_once('.')?;
    let digits = u32::try_from(fraction.len()).ok().filter(|digits| (1..=9).contains(digits))?;
    let fraction = number(fraction)?.checked_mul(10u64.pow(9 - digits))?;
    let wall = Wall::at(Duration::new(number(seconds)?, u32::try_from(fraction).ok()?));
    let mut words = rest.split_ascii_whitespace();
    let (interface, frame) = (words.next()?, words.next()?);
    if frame.contains("##") {
        return Some(Line::Ignored);
    }
    if let Ok(frame) = frame.parse() {
        return Some(Line::Frame(wall, interface, frame));
    }
    let (id, _) = frame.split_once('#')?;
    let id = u32::from_str_radix(id, 16).ok().filter(|id| id & ERROR_FRAME != 0)?;
    Some(Line::Fault(wall, interface, fault(id)))
}

/// Parses digits only: `parse` would also accept a sign.
fn number(text: &str) -> Option<u64> {
    if text.bytes().all(|byte| byte.is_ascii_digit()) { text.parse().ok() } else { None }
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

impl BitRateControl for Replay {}

impl Bus for Replay {
    fn name(&self) -> &str {
        if self.interface.is_empty() { &self.file } else { &self.interface }
    }

    fn timestamps(&self) -> TimestampSource {
        TimestampSource::Recorded
    }

    fn is_live(&self) -> bool {
        false
    }

    fn now(&self) -> Stamp {
        self.stamp(self.now)
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        self.filters = filters.clone();
        if let Some((_, Event::Frame(Received { frame, .. }))) = &self.next
            && !self.filters.wants(frame)
        {
            self.next = None;
        }
        Ok(())
    }

    fn send(&mut self, _: &Frame) -> Result<(), BusError> {
        Err(BusError::ReceiveOnly(format!("the recording {}", self.file)))
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        self.fetch()?;
        if let Some((at, event)) = self.next.take_if(|(at, _)| at.mono <= deadline) {
            self.now = self.now.max(at.mono);
            return Ok(event);
        }
        if self.state == State::AtEnd {
            self.state = State::EndReported;
            return Ok(Event::Ended);
        }
        self.now = self.now.max(deadline);
        Ok(Event::Timeout)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Mono = Mono::START;

    fn replay(text: &'static str) -> Replay {
        Replay::new("x.log", Box::new(text.as_bytes()))
    }

    fn all(text: &'static str) -> Vec<String> {
        let mut bus = replay(text);
        let mut seen = Vec::new();
        for _ in 0..20 {
            let event = bus.receive(START + Duration::from_secs(3600));
            seen.push(match event {
                Ok(Event::Frame(received)) => {
                    format!("{} {}", received.at.mono.since_start().as_micros(), received.frame)
                }
                Ok(Event::Fault(fault, at)) => format!("{} {fault:?}", at.mono.since_start().as_micros()),
                Ok(Event::Ended) => {
                    seen.push("end".to_owned());
                    return seen;
                }
                Ok(event) => format!("{event:?}"),
                Err(error) => {
                    seen.push(error.to_string());
                    return seen;
                }
            });
        }
        seen
    }

    #[test]
    fn frames_at_their_times() {
        assert_eq!(
            all(
                "(1700000000.000100) can0 181#0102\n\n(1700000000.250100) can0 080#\n(1700000001.0001) can0 705#R1 R\n"
            ),
            ["0 181#0102", "250000 080#", "1000000 705#R1", "end"]
        );
    }

    #[test]
    fn error_frames_are_faults_and_fd_frames_are_ignored() {
        assert_eq!(
            all("(1.0) can0 20000040#0000000000000000\n(2.0) can0 123##1AABB\n(3.0) can0 200000A8#00\n"),
            ["0 BusOff", "2000000 NoAcknowledge", "end"]
        );
    }

    #[test]
    fn a_truncated_last_line_is_ignored() {
        assert_eq!(all("(1.5) can0 181#01\n(2.5) can0 18"), ["0 181#01", "end"]);
    }

    #[test]
    fn a_line_that_is_not_a_log_line_is_named_by_number() {
        assert_eq!(
            all("(1.5) can0 181#01\n  can0  181   [1]  01\n(3.0) can0 181#02\n").last().map(String::as_str),
            Some("replay x.log:2: not a line of a candump log (record with candump -L)")
        );
        for wrong in ["(1.5 can0 181#01\n", "(+1.5) can0 181#01\n", "(1.5) can0 181\n", "(1.5) can0 999#01\n"] {
            assert!(all(wrong)[0].contains("not a line of a candump log"), "{wrong}");
        }
    }

    #[test]
    fn two_interfaces_are_an_error() {
        let seen = all("(1.5) can0 181#01\n(1.6) can1 181#02\n");
        assert_eq!(seen[1], "replay x.log:2: frames of can1 and of can0: select one interface (grep)");
    }

    #[test]
    fn a_clock_that_is_set_back_keeps_the_order() {
        assert_eq!(
            all("(9.0) c 181#01\n(9.5) c 181#02\n(3.0) c 181#03\n(9.7) c 181#04\n"),
            ["0 181#01", "500000 181#02", "500000 181#03", "700000 181#04", "end"]
        );
    }

    #[test]
    fn time_passes_up_to_the_deadline_and_the_end_is_reported_once() -> Result<(), BusError> {
        let mut bus = replay("(1.0) c 181#01\n(3.0) c 181#02\n");
        assert!(matches!(bus.receive(START)?, Event::Frame(_)));
        let (deadline, later) = (START + Duration::from_secs(1), START + Duration::from_secs(9));
        assert_eq!(bus.receive(deadline)?, Event::Timeout);
        assert_eq!(bus.now(), Stamp { mono: deadline, wall: Wall::at(Duration::from_secs(2)) });
        assert!(matches!(bus.receive(later)?, Event::Frame(_)));
        assert_eq!(bus.receive(later)?, Event::Ended);
        assert_eq!(bus.receive(later)?, Event::Timeout);
        assert!(matches!(bus.send(&Frame::empty(crate::canopen::id::CanId::SYNC)), Err(BusError::ReceiveOnly(_))));
        Ok(())
    }
}
