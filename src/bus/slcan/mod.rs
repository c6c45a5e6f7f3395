//! Serial adapters with the LAWICEL protocol (slcan): CANable, CANtact, USBtin, CAN232, WiFi bridges.
//!
//! The adapters differ. Some answer each command, and some answer none. Some start two seconds after the port is
//! opened. Many lose commands that arrive before the previous answer, so the next command waits for the answer. To an
//! adapter that does not answer, frames are sent no faster than the bit rate allows.

mod clock;
mod firmware;
mod text;

use super::own_clock::InterfaceClock;
use super::stream::{Output, Protocol};
use super::{BusError, Event, Fault, Mode, Mono, Received, Stamp, TimestampSource};
use crate::canopen::frame::Frame;
use crate::canopen::wire_length::frame_time;
use clock::MinuteClock;
use firmware::{Firmware, ListenOnly, Rate};
use std::collections::VecDeque;
use std::time::Duration;
use text::Answer;
pub(super) use text::{Lines, command};

/// The longest wait for the first answer. Some adapters restart when the port is opened.
const WAKE_TIMEOUT: Duration = Duration::from_millis(2500);
/// The interval between attempts to get a first answer.
const WAKE_INTERVAL: Duration = Duration::from_millis(250);
/// After the first answer, answers to earlier attempts may follow within this time.
const QUIET_TIME: Duration = Duration::from_millis(60);
/// The longest wait for an answer to a command.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(300);
/// The time between commands to an adapter that does not answer.
const UNANSWERED_COMMAND_INTERVAL: Duration = Duration::from_millis(30);
/// The interval between attempts to send a rejected frame.
const RETRY_INTERVAL: Duration = Duration::from_millis(5);
/// A frame is dropped after this number of rejections.
const MAX_TRIES: u32 = 40;
/// The largest number of frames that wait for the adapter.
const MAX_QUEUED: usize = 64;
/// The interval at which the error flags are read.
const FLAGS_INTERVAL: Duration = Duration::from_secs(1);

/// A step of the set-up of the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Close,
    Version,
    Detail,
    Serial,
    /// Checks whether the adapter supports the requested channel.
    Decide,
    Rate(Rate),
    Timestamps,
    Silent(bool),
    Open,
    Listen,
    Flags,
}

impl Step {
    fn command(self) -> String {
        match self {
            Step::Close => "C".to_owned(),
            Step::Version => "V".to_owned(),
            Step::Detail => "v".to_owned(),
            Step::Serial => "N".to_owned(),
            Step::Decide => String::new(),
            Step::Rate(rate) => rate.to_string(),
            Step::Timestamps => "Z1".to_owned(),
            Step::Silent(on) => format!("M{}", u8::from(on)),
            Step::Open => "O".to_owned(),
            Step::Listen => "L".to_owned(),
            Step::Flags => "F".to_owned(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Waiting for a first answer, until this moment.
    Waking(Mono),
    /// Waiting for the end of the answers to the first attempts.
    Settling,
    Working,
}

/// The command that waits for its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pending {
    Step(Step),
    Frame,
}

/// The host side of the LAWICEL protocol.
#[derive(Debug)]
pub(super) struct Slcan {
    /// The bit rate in bit/s and the mode of the channel; `None` if it is closed.
    channel: Option<(u32, Mode)>,
    /// The bit rate to use when the channel is opened.
    bit_rate: u32,
    stage: Stage,
    steps: VecDeque<Step>,
    pending: Option<Pending>,
    /// The time-out of the present wait.
    due: Option<Mono>,
    /// The earliest moment for the next frame.
    not_before: Mono,
    /// The time of the next read of the error flags.
    next_flags: Mono,
    lines: Lines,
    firmware: Firmware,
    /// Whether the adapter answers commands.
    answers_commands: bool,
    /// Whether the adapter answers frames; `None` if still unknown.
    answers_frames: Option<bool>,
    has_timestamps: bool,
    /// The error flags, if the adapter reports them.
    flags: Option<u8>,
    queue: VecDeque<Frame>,
    tries: u32,
    /// Whether the channel is being changed. A rejected bit rate then does not end the connection.
    is_retiming: bool,
    refusal: Option<String>,
    clock: MinuteClock,
    own_clock: InterfaceClock,
}

impl Slcan {
    /// Creates the host side. If `mode` is `None`, the channel stays closed.
    pub(super) fn new(bit_rate: u32, mode: Option<Mode>) -> Slcan {
        Slcan {
            channel: mode.map(|mode| (bit_rate, mode)),
            bit_rate,
            stage: Stage::Waking(Mono::START),
            steps: VecDeque::new(),
            pending: None,
            due: None,
            not_before: Mono::START,
            next_flags: Mono::START,
            lines: Lines::default(),
            firmware: Firmware::default(),
            answers_commands: false,
            answers_frames: None,
            has_timestamps: false,
            flags: None,
            queue: VecDeque::new(),
            tries: 0,
            is_retiming: false,
            refusal: None,
            clock: MinuteClock::default(),
            own_clock: InterfaceClock::default(),
        }
    }

    /// Returns the commands that open the channel, or the reason why this is not possible.
    fn opening_steps(&self) -> Result<Vec<Step>, String> {
        let Some((bit_rate, mode)) = self.channel else { return Ok(Vec::new()) };
        let rate = self.firmware.rate(bit_rate).ok_or_else(|| {
            let adapter = &self.firmware;
            format!(
                "cannot confirm that {adapter} supports {bit_rate} bit/s (every adapter supports 10k, 20k, 50k, 100k, 125k, \
                 250k, 500k, 1M)"
            )
        })?;
        let mut steps = vec![Step::Rate(rate), Step::Timestamps];
        let listen_only = self.firmware.listen_only();
        if listen_only == Some(ListenOnly::SilentMode) {
            steps.push(Step::Silent(mode == Mode::ListenOnly));
        }
        steps.push(match (mode, listen_only) {
            (Mode::Normal, _) | (Mode::ListenOnly, Some(ListenOnly::SilentMode)) => Step::Open,
            (Mode::ListenOnly, Some(ListenOnly::OtherOpen)) => Step::Listen,
            (Mode::ListenOnly, None) => {
                return Err(format!("cannot confirm that {} supports listen-only mode", self.firmware));
            }
        });
        steps.push(Step::Flags);
        Ok(steps)
    }

    /// Starts the set-up commands after the first answer, or after the time-out if there is none.
    fn set_up(&mut self) {
        self.stage = Stage::Working;
        self.due = None;
        let questions = [Step::Version, Step::Detail, Step::Serial];
        self.steps = questions.into_iter().filter(|_| self.answers_commands).chain([Step::Decide]).collect();
    }

    /// Handles the answer to a step; `None` after the time-out.
    fn finish(&mut self, step: Step, answer: Option<Answer>) -> Result<(), String> {
        let text = match &answer {
            Some(Answer::Text(text)) => Some(text.clone()),
            _ => None,
        };
        let is_rejected = answer == Some(Answer::Rejected);
        match step {
            Step::Version => self.firmware.version = text,
            Step::Detail => self.firmware.detail = text,
            Step::Serial => self.firmware.serial = text,
            Step::Timestamps => self.has_timestamps = answer == Some(Answer::Done),
            Step::Flags => self.flags = text.as_deref().and_then(flags),
            Step::Rate(_) | Step::Open | Step::Listen | Step::Silent(_) if is_rejected => {
                let what = match (step, self.channel) {
                    (Step::Rate(_), Some((bit_rate, _))) => format!("the bit rate {bit_rate}"),
                    (Step::Silent(_) | Step::Listen, _) => "the listen-only mode".to_owned(),
                    _ => "the command to open the channel".to_owned(),
                };
                let why = format!("{} rejects {what}", self.firmware);
                if !self.is_retiming {
                    return Err(why);
                }
                self.refusal = Some(why);
                self.steps.clear();
            }
            Step::Close | Step::Decide | Step::Rate(_) | Step::Open | Step::Listen | Step::Silent(_) => {}
        }
        Ok(())
    }

    /// Sends the next command or frame, unless an answer is pending.
    fn advance(&mut self, now: Stamp, out: &mut Output) -> Result<(), String> {
        while self.stage == Stage::Working && self.pending.is_none() && self.due.is_none_or(|due| due <= now.mono) {
            self.due = None;
            if let Some(step) = self.steps.pop_front() {
                if step == Step::Decide {
                    self.steps = self.opening_steps()?.into();
                    continue;
                }
                if step == Step::Flags {
                    self.next_flags = now.mono + FLAGS_INTERVAL;
                }
                self.pending = Some(Pending::Step(step));
                self.write(&step.command(), out);
                self.due =
                    Some(now.mono + if self.answers_commands { ANSWER_TIMEOUT } else { UNANSWERED_COMMAND_INTERVAL });
            } else if self.flags.is_some() && self.next_flags <= now.mono {
                self.steps.push_back(Step::Flags);
            } else if let Some(frame) = self.queue.front().copied() {
                if now.mono < self.not_before {
                    self.due = Some(self.not_before);
                    return Ok(());
                }
                self.write(&command(&frame), out);
                // Adapters that do not answer lose frames that are sent faster than the bus carries them.
                let pace = frame_time(&frame, self.bit_rate).max(Duration::from_millis(1));
                if self.answers_frames == Some(false) {
                    self.queue.pop_front();
                    self.not_before = now.mono + pace;
                } else {
                    self.pending = Some(Pending::Frame);
                    self.due = Some(now.mono + if self.answers_commands { ANSWER_TIMEOUT } else { pace });
                }
            } else {
                self.is_retiming = false;
                self.due = self.flags.map(|_| self.next_flags);
                return Ok(());
            }
        }
        Ok(())
    }

    fn write(&mut self, text: &str, out: &mut Output) {
        out.bytes.extend(text.bytes());
        out.bytes.push(b'\r');
    }

    fn process(&mut self, answer: Answer, now: Stamp, out: &mut Output) -> Result<(), String> {
        match answer {
            Answer::Frame(frame, time) => {
                let at = match time {
                    Some(time) => {
                        let own = self.clock.continued(time, now.mono);
                        self.own_clock.place(own, now)
                    }
                    None => {
                        self.own_clock.pass(now);
                        now
                    }
                };
                if self.is_open() && self.channel.is_some() {
                    out.events.push_back(Event::Frame(Received { frame, at }));
                }
            }
            // Consecutive invalid bytes are one event.
            Answer::Garbage if self.is_open() => out.events.push_back(Event::Fault(Fault::Garbled, now)),
            Answer::Garbage => {}
            _ if self.stage != Stage::Working => {
                self.answers_commands = true;
                self.stage = Stage::Settling;
                self.due = Some(now.mono + QUIET_TIME);
            }
            answer => match self.pending.take() {
                Some(Pending::Step(step)) => {
                    self.due = None;
                    let before = self.flags;
                    self.finish(step, Some(answer))?;
                    self.report_flags(before, now, out);
                }
                Some(Pending::Frame) if matches!(answer, Answer::Text(_)) => self.pending = Some(Pending::Frame),
                Some(Pending::Frame) => self.frame_answered(&answer, now, out),
                None if matches!(answer, Answer::Text(_)) => out.events.push_back(Event::Fault(Fault::Garbled, now)),
                // A late answer.
                None => {}
            },
        }
        Ok(())
    }

    fn frame_answered(&mut self, answer: &Answer, now: Stamp, out: &mut Output) {
        self.answers_frames = Some(true);
        self.due = None;
        if *answer == Answer::Done {
            self.tries = 0;
            self.queue.pop_front();
            return;
        }
        self.tries += 1;
        self.not_before = now.mono + RETRY_INTERVAL;
        if self.tries >= MAX_TRIES {
            self.tries = 0;
            self.queue.pop_front();
            out.events.push_back(Event::Fault(Fault::TransmitTimeout, now));
        }
    }

    /// Reports the error flags that were read: errors after each read, controller states only if they are new.
    fn report_flags(&mut self, before: Option<u8>, now: Stamp, out: &mut Output) {
        let Some(flags) = self.flags else { return };
        let new = flags & !before.unwrap_or(0);
        let faults = [
            (0x80 & flags, Fault::Protocol),
            (0x09 & flags, Fault::ControllerOverflow),
            (0x20 & new, Fault::ErrorPassive),
            (0x04 & new, Fault::ErrorWarning),
        ];
        if before.is_some() {
            let found = faults.into_iter().filter(|(bits, _)| *bits != 0);
            out.events.extend(found.map(|(_, fault)| Event::Fault(fault, now)));
        }
    }
}

/// Parses the answer to `F`: `F04`.
fn flags(text: &str) -> Option<u8> {
    let digits = text.strip_prefix('F').filter(|digits| digits.len() == 2 && !digits.starts_with('+'))?;
    u8::from_str_radix(digits, 16).ok()
}

impl Protocol for Slcan {
    fn start(&mut self, now: Stamp, out: &mut Output) {
        let mode = self.channel.map(|(_, mode)| mode);
        *self = Slcan::new(self.bit_rate, mode);
        self.stage = Stage::Waking(now.mono + WAKE_TIMEOUT);
        self.due = Some(now.mono + WAKE_INTERVAL);
        // The first end of line completes an unfinished command of an earlier program.
        out.bytes.extend(b"\rC\r");
    }

    fn receive(&mut self, bytes: &[u8], now: Stamp, out: &mut Output) -> Result<(), String> {
        let mut lines = std::mem::take(&mut self.lines);
        let mut result = Ok(());
        lines.feed(bytes, |answer| {
            if result.is_ok() {
                result = self.process(answer, now, out);
            }
        });
        self.lines = lines;
        result?;
        // Some firmware answers with more than one character. So the next command is sent only after all received
        // characters are processed.
        self.advance(now, out)
    }

    fn next_wake(&self) -> Option<Mono> {
        self.due
    }

    fn wake(&mut self, now: Stamp, out: &mut Output) -> Result<(), String> {
        match (self.stage, self.pending.take()) {
            (Stage::Waking(until), _) if now.mono < until => {
                self.due = Some(now.mono + WAKE_INTERVAL);
                out.bytes.extend(b"C\r");
            }
            (Stage::Waking(_) | Stage::Settling, _) => self.set_up(),
            (Stage::Working, Some(Pending::Step(step))) => self.finish(step, None)?,
            (Stage::Working, Some(Pending::Frame)) => {
                self.answers_frames.get_or_insert(false);
                self.queue.pop_front();
            }
            (Stage::Working, None) => {}
        }
        if self.stage == Stage::Working {
            self.due = None;
        }
        self.advance(now, out)
    }

    fn send(&mut self, frame: &Frame, now: Stamp, out: &mut Output) -> Result<(), BusError> {
        if !matches!(self.channel, Some((_, Mode::Normal))) {
            return Err(BusError::ReceiveOnly("the adapter in listen-only mode".to_owned()));
        }
        if self.queue.len() >= MAX_QUEUED {
            return Err(BusError::QueueFull);
        }
        self.queue.push_back(*frame);
        if self.pending.is_none() {
            // The next read of the flags must not delay a frame.
            self.due = None;
        }
        self.advance(now, out).map_err(BusError::Unsupported)
    }

    fn is_open(&self) -> bool {
        let is_setting_up = matches!(self.pending, Some(Pending::Step(step)) if step != Step::Flags);
        self.stage == Stage::Working && !is_setting_up && self.steps.iter().all(|step| *step == Step::Flags)
    }

    fn is_busy(&self) -> bool {
        !self.queue.is_empty()
    }

    fn close(&mut self, out: &mut Output) {
        out.bytes.extend(b"C\r");
    }

    fn timestamps(&self) -> TimestampSource {
        if self.has_timestamps { TimestampSource::Hardware } else { TimestampSource::Program }
    }

    fn bit_rate(&self) -> Option<u32> {
        Some(self.channel.map_or(self.bit_rate, |(bit_rate, _)| bit_rate))
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        if self.answers_commands {
            return Ok(());
        }
        Err(BusError::Unsupported("this adapter confirms nothing, so its bit rate cannot be set safely".to_owned()))
    }

    fn set_channel(&mut self, to: Option<(u32, Mode)>, now: Stamp, out: &mut Output) -> Result<(), BusError> {
        self.can_set_bit_rate()?;
        let before = std::mem::replace(&mut self.channel, to);
        let opening = self.opening_steps().map_err(|why| match to {
            Some((_, Mode::ListenOnly)) if self.firmware.listen_only().is_none() => BusError::Unsupported(why),
            _ => {
                let bit_rate = to.map_or(self.bit_rate, |(bit_rate, _)| bit_rate);
                BusError::BitRate { name: "the adapter".to_owned(), bit_rate, why }
            }
        });
        let opening = match opening {
            Ok(opening) => opening,
            Err(error) => {
                self.channel = before;
                return Err(error);
            }
        };
        self.bit_rate = to.map_or(self.bit_rate, |(bit_rate, _)| bit_rate);
        self.steps = [Step::Close].into_iter().chain(opening).collect();
        (self.pending, self.due, self.is_retiming) = (None, None, true);
        self.queue.clear();
        self.advance(now, out).map_err(BusError::Unsupported)
    }

    fn channel(&self) -> Option<(u32, Mode)> {
        self.channel
    }

    fn take_refusal(&mut self) -> Option<String> {
        self.refusal.take()
    }
}

#[cfg(test)]
mod tests;
