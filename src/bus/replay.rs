//! Replays a recording as a bus: a log of candump, Vector ASC, PEAK TRC, or CSV of python-can, also compressed by gzip.
//!
//! Times are those of the recording. The recording is read at full speed or in real time. Each format has a `Parser`,
//! which converts a line to a frame with its time. Order, broken lines and channels are handled here.

mod asc;
mod candump;
mod channel;
mod date;
mod error;
mod format;
mod lines;
mod python_can;
#[cfg(test)]
mod tests;
mod text;
mod trc;
mod wanted;

use super::memory::Sleeper;
use super::{BitRateControl, Bus, BusError, Event, Filters, Mono, Received, Stamp, TimestampSource, Wall};
use crate::canopen::frame::Frame;
use channel::{Channel, MAX_CHANNELS};
pub use error::RecordingError;
pub use format::{FileFormat, RecordingFormat};
use lines::Lines;
use std::io;
use std::mem;
use std::time::{Duration, Instant};
use text::{FrameOrFault, text_of};
use wanted::Wanted;

/// A file is not a recording after this many lines of unknown format.
const MAX_UNKNOWN: u64 = 100;

/// The number of lines read ahead to check whether times without a date increase.
const LINES_AHEAD: usize = 1000;

/// Times before this moment (March 1973) have no date: they count from the start of the recording.
const FIRST_DATE: Duration = Duration::from_secs(100_000_000);

/// A longer time between two lines is a step of the clock, for example from 1970 to the present.
const LONGEST_PAUSE: Duration = Duration::from_secs(24 * 3600);

/// A line may be earlier than the previous line by this time. Interrupts of two controllers are not in order.
const DISORDER: Duration = Duration::from_millis(10);

/// Reads the lines of one format.
trait Parser {
    /// Reads a line without the blanks around it.
    fn line<'a>(&mut self, text: &'a str) -> Line<'a>;
}

/// One line of a recording.
#[derive(Debug, PartialEq, Eq)]
enum Line<'a> {
    /// A frame or a fault, on this channel. The time counts from 1970, or from the start if there is no date.
    Event(Wall, &'a str, FrameOrFault),
    /// A frame without a time.
    WithoutTime,
    /// A header, another event, or a CAN FD frame, which CANopen does not use.
    Ignored,
    /// Not a line of this format.
    Unknown,
}

impl<'a> Line<'a> {
    /// A line with a time. `event` is `None` for unknown text, and `Some(None)` if CANopen does not use the event.
    fn at(wall: Wall, channel: &'a str, event: Option<Option<FrameOrFault>>) -> Line<'a> {
        match event {
            Some(Some(event)) => Line::Event(wall, channel, event),
            Some(None) => Line::Ignored,
            None => Line::Unknown,
        }
    }
}

/// A note about a replayed recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplayNote {
    /// Lines that the format does not allow were skipped.
    Skipped {
        /// The format.
        format: RecordingFormat,
        /// The number of lines.
        count: u64,
        /// The first of these lines, counted from 1.
        first: u64,
    },
    /// The times count from the start of the recording; its date is unknown.
    NoDate,
    /// The file ends in the middle of its last line, which has this number and was skipped.
    CutOff(u64),
    /// The clock was set during the recording. These steps are ignored.
    ClockSet {
        /// The number of steps.
        count: u64,
        /// The line of the first step, counted from 1.
        line: u64,
        /// The size of the first step.
        by: Duration,
        /// Whether the first step is backwards.
        is_backwards: bool,
    },
}

/// A format, and its parser.
type KnownFormat = (RecordingFormat, Box<dyn Parser>);

/// A recording as a bus that only receives.
pub struct Replay {
    file: String,
    lines: Lines,
    /// The line that is being read.
    buffer: Vec<u8>,
    /// The format, once it is known.
    format: Option<KnownFormat>,
    /// The channel to replay; the only one if none is chosen.
    channel: Option<String>,
    /// The channels of the frames so far.
    channels: Vec<Channel>,
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
    wanted: Wanted,
    /// The start of a replay in real time, and the wait function.
    pace: Option<(Instant, Box<dyn Sleeper>)>,
    /// Whether any line was a frame.
    is_recording: bool,
    /// Skipped lines: their number, and the first one.
    skipped: Option<(u64, u64)>,
    /// The number of the last line, if it is not complete.
    cut_off: Option<u64>,
    has_no_date: bool,
    clock_set: Option<ReplayNote>,
    report: Report,
}

/// Receives notes about the recording, at the latest when the bus is dropped.
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
    /// Opens the recording `file`; `-` is standard input. `report` receives notes about it.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(file: &str, report: Report) -> io::Result<Replay> {
        let name = if file == "-" { "standard input" } else { file };
        Ok(Replay::new(name, Lines::open(file)?, report))
    }

    /// Replays only this channel. Without a channel, the recording must have only one.
    #[must_use]
    pub fn of_channel(mut self, channel: &str) -> Replay {
        self.channel = Some(channel.to_owned());
        self
    }

    /// Plays in real time. `sleeper` waits.
    #[must_use]
    pub fn in_real_time(mut self, sleeper: Box<dyn Sleeper>) -> Replay {
        self.pace = Some((Instant::now(), sleeper));
        self
    }

    fn new(file: &str, lines: Lines, report: Report) -> Replay {
        Replay {
            file: file.to_owned(),
            lines,
            buffer: Vec::new(),
            format: None,
            channel: None,
            channels: Vec::new(),
            last: None,
            before_step: None,
            delivered: Stamp::default(),
            now: Mono::START,
            next: None,
            state: State::Reading,
            wanted: Wanted::All,
            pace: None,
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
            // The clock was not set: only single lines were early.
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
        // A frame that is slightly too early does not change the time line.
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

    /// Reads the next event of the recording.
    fn fetch(&mut self) -> Result<(), BusError> {
        let mut bytes = mem::take(&mut self.buffer);
        let mut result = Ok(());
        while result.is_ok() && self.next.is_none() && self.state == State::Reading {
            if self.read_fixed() {
                continue;
            }
            result = match self.lines.next(&mut bytes) {
                Ok(Some(number)) => self.read(number, &bytes),
                Ok(None) => self.end(),
                Err(source) => Err(self.failed(source)),
            };
        }
        self.buffer = bytes;
        result
    }

    /// Reads the next line in the read buffer if it has the fixed form of candump, and its channel is known.
    fn read_fixed(&mut self) -> bool {
        let Some((RecordingFormat::Candump, _)) = self.format else { return false };
        let Some(line) = candump::fixed_line(self.lines.buffered(), &self.channels) else { return false };
        let number = self.lines.skip(line.length);
        self.deliver(number, line.wall, self.channels[line.channel].is_wanted, Ok(line.frame));
        true
    }

    fn read(&mut self, number: u64, bytes: &[u8]) -> Result<(), BusError> {
        let text = text_of(bytes);
        let text = text.trim();
        let is_cut = self.lines.is_cut;
        let Some((format, parser)) = self.format_by(text)? else { return self.skip(number, bytes, text) };
        // The last data of a cut file, or the last number of a decimal ASC line, may be incomplete.
        let is_complete = bytes.ends_with(b"\n") || (*format != RecordingFormat::Asc && !is_cut);
        match parser.line(text) {
            Line::Event(wall, channel, event) if wall <= Wall::LAST && is_complete => {
                self.take(number, wall, channel, event)
            }
            Line::Ignored => Ok(()),
            Line::WithoutTime if !self.is_recording => Err(self.wrong(Some(number), RecordingError::NoTimes)),
            // RFC 3339 does not allow years after 9999.
            Line::Event(..) | Line::WithoutTime | Line::Unknown => self.skip(number, bytes, text),
        }
    }

    /// The format and its parser. `text` is a line that may show the format.
    fn format_by(&mut self, text: &str) -> Result<Option<&mut KnownFormat>, BusError> {
        if self.format.is_none() {
            if let Some(format) = FileFormat::of(&self.lines.start) {
                return Err(self.wrong(None, RecordingError::OtherFormat(format)));
            }
            match RecordingFormat::of(text) {
                None => return Ok(None),
                Some(Ok(format)) => self.format = Some((format, format.parser())),
                Some(Err(format)) => return Err(self.wrong(None, RecordingError::OtherFormat(format))),
            }
        }
        Ok(self.format.as_mut())
    }

    /// Counts a line that is neither a frame nor a comment.
    fn skip(&mut self, number: u64, bytes: &[u8], text: &str) -> Result<(), BusError> {
        if text.is_empty() || text.starts_with(['#', ';']) || text.starts_with("//") {
            return Ok(());
        }
        if !bytes.ends_with(b"\n") && self.is_recording {
            // The recording was stopped in the middle of its last line.
            self.cut_off = Some(number);
            return Ok(());
        }
        let (count, _) = self.skipped.get_or_insert((0, number));
        *count += 1;
        if !self.is_recording && *count >= MAX_UNKNOWN { Err(self.not_a_recording()) } else { Ok(()) }
    }

    /// Handles an event of the recording.
    fn take(&mut self, number: u64, wall: Wall, channel: &str, event: FrameOrFault) -> Result<(), BusError> {
        if !self.is_recording {
            self.is_recording = true;
            if wall.since_epoch() < FIRST_DATE {
                self.look_ahead(number, wall)?;
                self.has_no_date = true;
            }
        }
        let is_wanted = self.channel.as_deref().is_none_or(|chosen| chosen == channel);
        if !self.channels.iter().any(|known| known.name == channel) {
            if let (None, Some(first)) = (&self.channel, self.channels.first()) {
                let error = RecordingError::SeveralChannels(first.name.clone(), channel.to_owned());
                return Err(self.wrong(Some(number), error));
            }
            if self.channels.len() < MAX_CHANNELS {
                self.channels.push(Channel { name: channel.to_owned(), is_wanted });
            }
        }
        self.deliver(number, wall, is_wanted, event);
        Ok(())
    }

    /// Makes an event the next one, unless its channel or its frame is not wanted.
    fn deliver(&mut self, number: u64, wall: Wall, is_wanted: bool, event: FrameOrFault) {
        let at = self.place(number, wall);
        self.next = match event {
            _ if !is_wanted => None,
            Ok(frame) if !self.wanted.has(frame.id()) => None,
            Ok(frame) => Some((at, Event::Frame(Received { frame, at }))),
            Err(fault) => Some((at, Event::Fault(fault, at))),
        };
    }

    /// Reads further lines of a candump log whose times have no date. If at least one of ten times is not later than
    /// the previous time, the times are probably intervals. The recording is then rejected. The intervals are not added
    /// up, because times of low resolution look the same.
    fn look_ahead(&mut self, first: u64, wall: Wall) -> Result<(), BusError> {
        let Some((RecordingFormat::Candump, parser)) = &mut self.format else { return Ok(()) };
        let (mut last, mut steps, mut not_later) = (wall, 0, 0);
        for _ in 0..LINES_AHEAD {
            let line = match self.lines.peek() {
                Ok(Some(line)) => line,
                Ok(None) => break,
                Err(source) => return Err(self.failed(source)),
            };
            if let Line::Event(wall, ..) = parser.line(text_of(line).trim()) {
                steps += 1;
                not_later += u32::from(wall <= last);
                last = wall;
            }
        }
        if not_later > 0 && not_later * 10 >= steps {
            return Err(self.wrong(Some(first), RecordingError::Intervals));
        }
        Ok(())
    }

    /// The last line was read.
    fn end(&mut self) -> Result<(), BusError> {
        self.state = State::AtEnd;
        if !self.is_recording {
            return Err(self.not_a_recording());
        }
        if self.lines.is_cut && self.cut_off.is_none() {
            self.cut_off = Some(self.lines.count() + 1);
        }
        match &self.channel {
            Some(chosen) if !self.channels.iter().any(|channel| channel.name == *chosen) => {
                let names = self.channels.iter().map(|channel| channel.name.clone());
                let channels = names.filter(|name| !name.is_empty()).collect();
                Err(self.wrong(None, RecordingError::NoChannel { chosen: chosen.clone(), channels }))
            }
            _ => Ok(()),
        }
    }

    fn not_a_recording(&self) -> BusError {
        let first = self.skipped.map(|(_, first)| first);
        match &self.format {
            _ if self.lines.is_cut => self.wrong(None, RecordingError::CutOff),
            Some((format, _)) if first.is_some() => self.wrong(first, RecordingError::NoneUnderstood(*format)),
            Some((format, _)) => self.wrong(None, RecordingError::NoFrames(*format)),
            None if first.is_none() => self.wrong(None, RecordingError::Empty),
            None => self.wrong(None, RecordingError::UnknownFormat),
        }
    }
}

impl Drop for Replay {
    fn drop(&mut self) {
        let Some((format, _)) = self.format.as_ref().filter(|_| self.is_recording) else { return };
        let format = *format;
        if self.has_no_date {
            (self.report)(&ReplayNote::NoDate);
        }
        if let Some((count, first)) = self.skipped {
            (self.report)(&ReplayNote::Skipped { format, count, first });
        }
        if let Some(line) = self.cut_off {
            (self.report)(&ReplayNote::CutOff(line));
        }
        if let Some(note) = &self.clock_set {
            (self.report)(note);
        }
    }
}

impl BitRateControl for Replay {}

impl Bus for Replay {
    fn name(&self) -> &str {
        let first = self.channels.first().map(|channel| &channel.name);
        self.channel.as_ref().or(first).filter(|name| !name.is_empty()).unwrap_or(&self.file)
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
        self.wanted = Wanted::new(filters);
        if let Some((_, Event::Frame(Received { frame, .. }))) = &self.next
            && !self.wanted.has(frame.id())
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
        let due = self.next.as_ref().map_or(Mono::START, |(at, _)| at.mono).min(deadline);
        if let Some((start, sleeper)) = &mut self.pace
            && sleeper.sleep(due.since_start().saturating_sub(start.elapsed()))
        {
            return Ok(Event::Interrupted);
        }
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
