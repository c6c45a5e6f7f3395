//! Replays a candump recording as a bus.
//!
//! The time is that of the recording. It passes as fast as the program reads; nothing waits.

mod error;
mod line;
#[cfg(test)]
mod tests;

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

/// The first bytes of a file, which show its format, and the rest of their last line.
const START_LENGTH: usize = 512;

/// Lines that are read ahead to see whether times without a date increase.
const LINES_AHEAD: usize = 1000;

/// Times before this moment (March 1973) have no date: they count from the start of the recording.
const FIRST_DATE: Duration = Duration::from_secs(100_000_000);

/// A longer time between two lines is a step of the clock, from 1970 to the present for example.
const LONGEST_PAUSE: Duration = Duration::from_secs(24 * 3600);

/// A line may be earlier than the one before by this time: interrupts of two controllers are not in order.
const DISORDER: Duration = Duration::from_millis(10);

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
    /// The file ends in the middle of its last line, which has this number and was skipped.
    CutOff(u64),
    /// The clock was set during the recording. These steps count as no time.
    ClockSet {
        /// How many steps.
        count: u64,
        /// The line of the first one, counted from 1.
        line: u64,
        /// Its size.
        by: Duration,
        /// Whether it leads back.
        is_backwards: bool,
    },
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
    /// The time of the last line that was read.
    last: Option<Stamp>,
    /// The time before the last step backwards, and the size of that step.
    before_step: Option<(Stamp, Duration)>,
    /// The time of the last event that was delivered.
    delivered: Stamp,
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
    /// The number of the last line, if it is not complete.
    cut_off: Option<u64>,
    has_no_date: bool,
    clock_set: Option<ReplayNote>,
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
            last: None,
            before_step: None,
            delivered: Stamp::default(),
            now: Mono::START,
            next: None,
            state: State::Reading,
            filters: Filters::All,
            start: Vec::new(),
            is_recording: false,
            skipped: None,
            cut_off: None,
            has_no_date: false,
            clock_set: None,
            report,
        }
    }

    fn stamp(&self, mono: Mono) -> Stamp {
        Stamp { mono, wall: self.delivered.wall + mono.since(self.delivered.mono) }
    }

    /// The time of a line. The first line starts the monotonic time line. If the clock was set, no time passes.
    fn place(&mut self, number: u64, wall: Wall) -> Stamp {
        let Some(last) = self.last else {
            let first = Stamp { mono: self.now, wall };
            (self.last, self.delivered) = (Some(first), first);
            return first;
        };
        let (now, before) = (wall.since_epoch(), last.wall.since_epoch());
        let (forwards, backwards) = (now.saturating_sub(before), before.saturating_sub(now));
        if let Some((earlier, _)) = self.before_step.take_if(|(_, size)| forwards >= *size) {
            // Only single lines were early.
            let mono = earlier.mono + now.saturating_sub(earlier.wall.since_epoch());
            self.last = Some(Stamp { mono, wall });
            return Stamp { mono: mono.max(self.now), wall };
        }
        let is_step = forwards > LONGEST_PAUSE || backwards > DISORDER;
        if is_step {
            self.note_step(number, forwards.max(backwards), !backwards.is_zero());
            self.before_step = (!backwards.is_zero()).then_some((last, backwards));
        }
        let mono = if is_step { last.mono } else { last.mono + forwards };
        // A frame that is slightly too early moves nothing.
        if is_step || backwards.is_zero() {
            self.last = Some(Stamp { mono, wall });
        }
        Stamp { mono: mono.max(self.now), wall }
    }

    fn note_step(&mut self, number: u64, size: Duration, back: bool) {
        let first = ReplayNote::ClockSet { count: 0, line: number, by: size, is_backwards: back };
        if let ReplayNote::ClockSet { count, .. } = self.clock_set.get_or_insert(first) {
            *count += 1;
        }
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
        if self.start.len() < START_LENGTH {
            self.start.extend_from_slice(&line);
        }
        if self.number == 1 && line.starts_with(BYTE_ORDER_MARK) {
            line.drain(..BYTE_ORDER_MARK.len());
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
                Line::WithoutTime | Line::Unknown if !bytes.ends_with(b"\n") && self.is_recording => {
                    self.cut_off = Some(number);
                }
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
        let at = self.place(number, wall);
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
        if let Some(line) = self.cut_off {
            (self.report)(&ReplayNote::CutOff(line));
        }
        if let Some(note) = &self.clock_set {
            (self.report)(note);
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
            self.delivered = at;
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
