//! Replays a candump recording as a bus.
//!
//! The time is that of the recording. It passes as fast as the program reads; nothing waits.

mod error;
mod line;

use super::{BitRateControl, Bus, BusError, Event, Filters, Mono, Received, Stamp, TimestampSource, Wall};
use crate::canopen::frame::Frame;
pub use error::{FileFormat, RecordingError};
use line::Line;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::time::Duration;

/// The longest valid line in bytes.
const MAX_LINE: u64 = 4096;

/// Lines without any valid one, after which the file is not a recording.
const MAX_UNKNOWN: u64 = 100;

/// Lines that are read ahead to see whether times without a date increase.
const LINES_AHEAD: usize = 1000;

/// Times before this moment (March 1973) have no date: they count from the start of the recording.
const FIRST_DATE: Duration = Duration::from_secs(100_000_000);

/// A mark that some editors write at the start of a UTF-8 file.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Something to know about a recording that is replayed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplayNote {
    /// Lines that are not lines of a recording were skipped.
    Skipped {
        /// How many.
        count: u64,
        /// The number of the first one, counted from 1.
        first: u64,
    },
    /// The times count from the start of the recording; its date is unknown.
    NoDate,
}

/// A candump recording as a bus that only receives.
pub struct Replay {
    file: String,
    lines: Box<dyn BufRead>,
    /// Lines that were read ahead, with their numbers.
    ahead: VecDeque<(u64, Vec<u8>)>,
    /// Lines read from the file.
    number: u64,
    /// The interface in the recording.
    interface: String,
    /// The wall time of the first line. It is the start of the monotonic time line.
    begin: Option<Wall>,
    now: Mono,
    /// The next event.
    next: Option<(Stamp, Event)>,
    state: State,
    filters: Filters,
    /// The first bytes of the file.
    start: Vec<u8>,
    /// Whether any line was valid.
    is_recording: bool,
    /// Skipped lines: their number, and the first one.
    skipped: Option<(u64, u64)>,
    has_no_date: bool,
    report: Report,
}

/// Takes notes about the recording, at the latest when the bus is dropped.
type Report = Box<dyn FnMut(&ReplayNote)>;

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Reading,
    /// The last line was read.
    AtEnd,
    /// The end was reported.
    EndReported,
}

impl Replay {
    /// Opens the recording `file`; `-` is standard input. `report` takes notes about it.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(file: &str, report: Report) -> io::Result<Replay> {
        if file == "-" {
            return Ok(Replay::new("standard input", Box::new(BufReader::new(io::stdin())), report));
        }
        Ok(Replay::new(file, Box::new(BufReader::with_capacity(1 << 16, File::open(file)?)), report))
    }

    fn new(file: &str, lines: Box<dyn BufRead>, report: Report) -> Replay {
        Replay {
            file: file.to_owned(),
            lines,
            ahead: VecDeque::new(),
            number: 0,
            interface: String::new(),
            begin: None,
            now: Mono::START,
            next: None,
            state: State::Reading,
            filters: Filters::All,
            start: Vec::new(),
            is_recording: false,
            skipped: None,
            has_no_date: false,
            report,
        }
    }

    fn stamp(&self, mono: Mono) -> Stamp {
        Stamp { mono, wall: self.begin.unwrap_or_default() + mono.since_start() }
    }

    fn wrong(&self, line: Option<u64>, error: RecordingError) -> BusError {
        BusError::Recording { file: self.file.clone(), line, error }
    }

    fn failed(&self, source: io::Error) -> BusError {
        BusError::File { what: format!("replay {}", self.file), source }
    }

    /// Reads a line from the file, with its number. A line that is too long is cut.
    fn read_line(&mut self) -> io::Result<Option<(u64, Vec<u8>)>> {
        let mut line = Vec::new();
        if (&mut self.lines).take(MAX_LINE).read_until(b'\n', &mut line)? == 0 {
            return Ok(None);
        }
        while !line.ends_with(b"\n") {
            let mut rest = Vec::new();
            if (&mut self.lines).take(MAX_LINE).read_until(b'\n', &mut rest)? == 0 {
                break;
            }
            if rest.ends_with(b"\n") {
                line.push(b'\n');
            }
        }
        self.number += 1;
        if self.number == 1 {
            self.start = line.clone();
            if line.starts_with(BYTE_ORDER_MARK) {
                line.drain(..BYTE_ORDER_MARK.len());
            }
        }
        Ok(Some((self.number, line)))
    }

    /// The next line: one that was read ahead, else one of the file.
    fn next_line(&mut self) -> io::Result<Option<(u64, Vec<u8>)>> {
        match self.ahead.pop_front() {
            Some(line) => Ok(Some(line)),
            None => self.read_line(),
        }
    }

    /// Reads the next event of the recording.
    fn fetch(&mut self) -> Result<(), BusError> {
        while self.next.is_none() && self.state == State::Reading {
            let Some((number, bytes)) = self.next_line().map_err(|source| self.failed(source))? else {
                self.state = State::AtEnd;
                return if self.is_recording { Ok(()) } else { Err(self.not_a_recording()) };
            };
            match line::parse(&String::from_utf8_lossy(&bytes), local_time) {
                Line::Ignored => {}
                Line::WithoutTime if !self.is_recording => {
                    return Err(self.wrong(Some(number), RecordingError::NoTimes));
                }
                // The recording was stopped in the middle of its last line.
                Line::WithoutTime | Line::Unknown if !bytes.ends_with(b"\n") && self.is_recording => {}
                Line::WithoutTime | Line::Unknown => {
                    let (count, _) = self.skipped.get_or_insert((0, number));
                    *count += 1;
                    if !self.is_recording && *count >= MAX_UNKNOWN {
                        return Err(self.not_a_recording());
                    }
                }
                Line::Event(wall, interface, event) => self.take(number, wall, interface, event)?,
            }
        }
        Ok(())
    }

    /// Takes an event of the recording.
    fn take(
        &mut self,
        number: u64,
        wall: Wall,
        interface: String,
        event: Result<Frame, super::Fault>,
    ) -> Result<(), BusError> {
        if !self.is_recording {
            self.is_recording = true;
            if wall.since_epoch() < FIRST_DATE {
                self.look_ahead(number, wall)?;
                self.has_no_date = true;
            }
        }
        if self.interface.is_empty() {
            self.interface = interface;
        } else if self.interface != interface {
            let error = RecordingError::SeveralInterfaces(interface, self.interface.clone());
            return Err(self.wrong(Some(number), error));
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
        Ok(())
    }

    /// Reads further lines of a recording whose times have no date. If one of ten times or more is not later than the
    /// time before, they are intervals: the sum is not taken, since a low resolution looks the same.
    fn look_ahead(&mut self, first: u64, wall: Wall) -> Result<(), BusError> {
        let (mut last, mut steps, mut not_later) = (wall, 0, 0);
        for _ in 0..LINES_AHEAD {
            let Some((number, bytes)) = self.read_line().map_err(|source| self.failed(source))? else { break };
            if let Line::Event(wall, ..) = line::parse(&String::from_utf8_lossy(&bytes), local_time) {
                steps += 1;
                not_later += u32::from(wall <= last);
                last = wall;
            }
            self.ahead.push_back((number, bytes));
        }
        if not_later > 0 && not_later * 10 >= steps {
            return Err(self.wrong(Some(first), RecordingError::Intervals));
        }
        Ok(())
    }

    fn not_a_recording(&self) -> BusError {
        let error = match FileFormat::of(&self.start) {
            Some(format) => RecordingError::OtherFormat(format),
            None if self.number == 0 || self.skipped.is_none() && self.start.trim_ascii().is_empty() => {
                RecordingError::Empty
            }
            None => RecordingError::NotALog,
        };
        self.wrong(None, error)
    }
}

impl Drop for Replay {
    fn drop(&mut self) {
        if !self.is_recording {
            return;
        }
        if self.has_no_date {
            (self.report)(&ReplayNote::NoDate);
        }
        if let Some((count, first)) = self.skipped {
            (self.report)(&ReplayNote::Skipped { count, first });
        }
    }
}

/// A date and time in the time zone of this machine as seconds since 1970.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library knows no time zones")]
fn local_time([year, month, day, hour, minute, second]: [i32; 6]) -> Option<u64> {
    // SAFETY: `tm` is a plain C structure for which zero is a valid value in every field.
    let mut fields: libc::tm = unsafe { std::mem::zeroed() };
    fields.tm_year = year.checked_sub(1900)?;
    fields.tm_mon = month.checked_sub(1)?;
    (fields.tm_mday, fields.tm_hour, fields.tm_min, fields.tm_sec) = (day, hour, minute, second);
    fields.tm_isdst = -1;
    // SAFETY: `mktime` reads and writes only the structure that it is given.
    let seconds = unsafe { libc::mktime(&raw mut fields) };
    u64::try_from(seconds).ok()
}

/// Time zones are unknown on this system.
#[cfg(not(unix))]
fn local_time(_: [i32; 6]) -> Option<u64> {
    None
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
    use std::cell::RefCell;
    use std::rc::Rc;

    const START: Mono = Mono::START;

    fn replay(text: &'static str) -> Replay {
        Replay::new("x.log", Box::new(text.as_bytes()), Box::new(|_| {}))
    }

    /// The notes about a recording that is replayed to its end.
    fn notes(text: &'static str) -> Vec<ReplayNote> {
        let notes = Rc::new(RefCell::new(Vec::new()));
        let sink = Rc::clone(&notes);
        let mut bus = Replay::new(
            "x.log",
            Box::new(text.as_bytes()),
            Box::new(move |note: &ReplayNote| sink.borrow_mut().push(note.clone())),
        );
        while let Ok(Event::Frame(_)) = bus.receive(START + Duration::from_secs(3600)) {}
        drop(bus);
        notes.take()
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
    fn broken_lines_are_skipped_and_counted() {
        let text = "(1.5) can0 181#01\n(2.0) c\n  can0  181   [1]  01\n\u{fffd}\n(3.0) can0 181#02\n";
        assert_eq!(all(text), ["0 181#01", "1500000 181#02", "end"]);
        assert_eq!(notes(text), [ReplayNote::NoDate, ReplayNote::Skipped { count: 3, first: 2 }]);
        assert_eq!(notes("(1700000000.1) c 181#01\n"), []);
    }

    #[test]
    fn a_line_that_is_too_long_is_one_line() {
        let text: String = format!("(1.5) c 181#01\n{} (2.0) c 181#02\n(3.0) c 181#03\n", "x".repeat(5000));
        assert_eq!(all(text.leak()), ["0 181#01", "1500000 181#03", "end"]);
    }

    #[test]
    fn byte_order_mark_comments_and_other_line_ends() {
        let frames = ["0 181#01", "1000000 181#02", "end"];
        for text in [
            "\u{feff}(1700000000.0) can0 181#01\n(1700000001.0) can0 181#02\n",
            "# bench 2\n; and more\n(1700000000.0) can0 181#01\n(1700000001.0) can0 181#02\n",
            "\u{feff}# bench 2\r\n(1700000000.0) can0 181#01\r\n(1700000001.0) can0 181#02\r\n",
            " (1700000000.000000)  can0  181   [1]  01\n (1700000001.000000)  can0  181   [1]  02\n",
        ] {
            assert_eq!(all(text), frames, "{text}");
        }
    }

    #[test]
    fn files_that_are_no_recordings_are_named() {
        for (text, message) in [
            ("", "the file is empty"),
            (" \n\n", "the file is empty"),
            ("nonsense\nmore\n", "not a candump log: no line has a time, an interface and a frame"),
            ("(1.5) can0 181\n", "not a candump log: no line has a time, an interface and a frame"),
            (
                "date Mon Jan 1 10:00:00 2024\nbase hex  timestamps absolute\n",
                "this is a Vector ASC file, not a candump log",
            ),
            (";$FILEVERSION=2.1\n;\n", "this is a PEAK TRC file, not a candump log"),
            ("timestamp,arbitration_id,extended\n", "this is a CSV file of python-can, not a candump log"),
            (
                "time,elapsed_s,node,signal,value,unit,status,raw\n",
                "this is a CSV file of measurements, not a candump log",
            ),
            ("LOGG\x01\x02", "this is a Vector BLF file, not a candump log"),
        ] {
            assert_eq!(all(text), [format!("replay x.log: {message}")], "{text}");
        }
        assert_eq!(FileFormat::of(b"\x1f\x8b\x08"), Some(FileFormat::Gzip));
    }

    #[test]
    fn frames_without_times_are_an_error() {
        let text = "# x\n  can0  181   [1]  01\n  can0  181   [1]  02\n";
        assert_eq!(all(text), ["replay x.log:2: the frames have no times"]);
    }

    #[test]
    fn intervals_are_no_times() {
        let error =
            "replay x.log:1: the times do not increase: they seem to be intervals from frame to frame (candump -td)";
        for text in [
            "(0.000000) c 181#01\n(0.001000) c 181#01\n(0.001000) c 181#01\n",
            "(0.000000) c 181#01\n(0.100000) c 181#01\n(0.086000) c 181#01\n(0.101000) c 181#01\n",
            " (000.000000)  c  181   [1]  01\n (000.002000)  c  181   [1]  01\n (000.001000)  c  181   [1]  01\n",
        ] {
            assert_eq!(all(text), [error], "{text}");
        }
        // Counted from the start of the recording.
        assert_eq!(all("(0.0) c 181#01\n(0.1) c 181#02\n(0.3) c 181#03\n").len(), 4);
    }

    #[test]
    fn two_interfaces_are_an_error() {
        let seen = all("(1.5) can0 181#01\n(1.6) can1 181#02\n");
        assert_eq!(seen[1], "replay x.log:2: frames of can1 and of can0: select one interface (grep)");
    }

    #[test]
    fn a_clock_that_is_set_back_keeps_the_order() {
        assert_eq!(
            all("(1700000009.0) c 181#01\n(1700000009.5) c 181#02\n(1700000003.0) c 181#03\n(1700000009.7) c 181#04\n"),
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
