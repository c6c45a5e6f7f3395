//! The protocol of socketcand in raw mode: the client, and the common messages of client and server.
//!
//! Each message is enclosed in `<` and `>`. After `< hi >` the client sends `< open can0 >` and `< rawmode >`. The
//! server answers each one with `< ok >`. Received frames are `< frame 1A4 1436509052.249713 0011AA >`, sent frames are
//! `< send 1A4 3 0 11 aa >`. The protocol does not support remote frames.

use super::own_clock::InterfaceClock;
use super::stream::{Output, Protocol};
use super::{BusError, Event, Fault, Mono, Received, Stamp, TimestampSource};
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use std::time::Duration;

/// The longest wait for an answer while the bus is opened.
const OPEN_TIMEOUT: Duration = Duration::from_secs(5);
/// The longest message. Longer ones are discarded.
const MAX_MESSAGE: usize = 256;
/// The number of bytes of an unknown greeting that are shown.
const MAX_GREETING: usize = 40;

/// Splits a byte stream into messages. The bytes may arrive in pieces.
#[derive(Debug, Default)]
pub(super) struct Messages {
    /// The bytes of an unfinished message; `None` between messages.
    text: Option<Vec<u8>>,
    /// The first bytes outside of messages.
    noise: Vec<u8>,
}

impl Messages {
    /// Passes each complete message to `found`, without brackets and outer blanks. `None` means bytes that are not a
    /// message.
    pub(super) fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Option<&str>)) {
        for &byte in bytes {
            match (byte, &mut self.text) {
                (b'<', text) => {
                    if text.take().is_some() {
                        found(None);
                    }
                    self.text = Some(Vec::new());
                    self.noise.clear();
                }
                (b'>', text @ Some(_)) => {
                    let text = text.take().unwrap_or_default();
                    found(std::str::from_utf8(&text).ok().map(str::trim));
                }
                (byte, Some(text)) if text.len() < MAX_MESSAGE => text.push(byte),
                (_, text @ Some(_)) => {
                    *text = None;
                    found(None);
                }
                (byte, None) => {
                    if self.noise.len() < MAX_GREETING && !byte.is_ascii_whitespace() {
                        if self.noise.is_empty() {
                            found(None);
                        }
                        self.noise.push(byte);
                    }
                }
            }
        }
    }
}

/// Parses an identifier: three digits, or eight digits for 29 bits.
fn parse_identifier(text: &str) -> Option<CanId> {
    let number = parse_hexadecimal(text)?;
    match text.len() {
        3 => CanId::standard(u16::try_from(number).ok()?),
        8 => CanId::extended(number),
        _ => None,
    }
}

/// Parses hexadecimal digits. Rejects a sign, which `u32::from_str_radix` accepts.
fn parse_hexadecimal(text: &str) -> Option<u32> {
    let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(text, 16).ok().filter(|_| digits)
}

/// Parses a time: `1436509052.249713`.
fn parse_time(text: &str) -> Option<Duration> {
    let (seconds, micros) = text.split_once('.')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !digits(seconds) || !digits(micros) || micros.len() > 6 {
        return None;
    }
    let scale = 10u32.pow(6 - u32::try_from(micros.len()).ok()?);
    Some(Duration::new(seconds.parse().ok()?, micros.parse::<u32>().ok()? * scale * 1000))
}

/// Parses `ID TIME DATA`, the words after `frame` in a message of the server.
fn parse_frame<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<(Frame, Duration)> {
    let (id, at) = (parse_identifier(words.next()?)?, parse_time(words.next()?)?);
    let words: Vec<&str> = words.collect();
    let mut data = Vec::with_capacity(8);
    match words.as_slice() {
        [] => {}
        [text] if text.len() % 2 == 0 && text.len() <= 16 && text.is_ascii() => {
            for place in (0..text.len()).step_by(2) {
                data.push(u8::try_from(parse_hexadecimal(&text[place..place + 2])?).ok()?);
            }
        }
        // One word for each byte, as in the protocol document.
        words => data.extend(parse_bytes(words)?),
    }
    Some((Frame::new(id, &data).ok()?, at))
}

fn parse_bytes(words: &[&str]) -> Option<Vec<u8>> {
    words.iter().map(|word| parse_hexadecimal(word).and_then(|number| u8::try_from(number).ok())).collect()
}

/// Parses `ID LENGTH BYTES`, the words after `send` in a message of a client.
pub(super) fn sent_frame<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Frame> {
    let (id, length) = (parse_identifier(words.next()?)?, parse_hexadecimal(words.next()?)?);
    let data = parse_bytes(&words.collect::<Vec<_>>())?;
    (u32::try_from(data.len()) == Ok(length)).then(|| Frame::new(id, &data).ok()).flatten()
}

/// Returns the message with which a server delivers a frame.
pub(super) fn frame_message(frame: &Frame, at: Stamp) -> String {
    let at = at.wall.since_epoch();
    let data: String = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
    format!("< frame {} {}.{:06} {data} >", frame.id(), at.as_secs(), at.subsec_micros())
}

/// Parses a message with which a server delivers a frame.
pub(super) fn received_frame(message: &str) -> Option<Frame> {
    let mut words = message.split_ascii_whitespace();
    words.next().filter(|word| *word == "frame")?;
    Some(parse_frame(words)?.0)
}

/// Returns the message with which a client sends a frame.
pub(super) fn send_message(frame: &Frame) -> Result<String, BusError> {
    if frame.is_remote() {
        return Err(BusError::NoRemoteFrames);
    }
    let data: String = frame.data().iter().map(|byte| format!("{byte:X} ")).collect();
    Ok(format!("< send {} {} {data}>", frame.id(), frame.len()))
}

/// Returns the faults for the classes of an error frame (linux/can/error.h). The protocol has no details.
fn faults(classes: u32) -> impl Iterator<Item = Fault> {
    const CLASSES: [(u32, Fault); 7] = [
        (0x001, Fault::TransmitTimeout),
        (0x008 | 0x080, Fault::Protocol),
        (0x004, Fault::Other),
        (0x010, Fault::Transceiver),
        (0x020, Fault::NoAcknowledge),
        (0x040, Fault::BusOff),
        (0x100, Fault::Restarted),
    ];
    CLASSES.into_iter().filter(move |(class, _)| classes & class != 0).map(|(_, fault)| fault)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Waiting for `< hi >`.
    Greeting,
    /// Waiting for the answer to `< open … >`.
    Opening,
    /// Waiting for the answer to `< rawmode >`.
    Switching,
    Open,
}

/// A client in raw mode.
#[derive(Debug)]
pub(super) struct Client {
    /// The name of the bus on the server.
    bus: String,
    stage: Stage,
    deadline: Mono,
    messages: Messages,
    clock: InterfaceClock,
}

impl Client {
    pub(super) fn new(bus: &str) -> Client {
        Client {
            bus: bus.to_owned(),
            stage: Stage::Greeting,
            deadline: Mono::START,
            messages: Messages::default(),
            clock: InterfaceClock::default(),
        }
    }

    fn process(&mut self, message: &str, now: Stamp, out: &mut Output) -> Result<(), String> {
        let mut words = message.split_ascii_whitespace();
        match (words.next().unwrap_or_default(), self.stage) {
            ("hi", Stage::Greeting) => self.ask(Stage::Opening, &format!("< open {} >", self.bus), now, out),
            ("ok", Stage::Opening) => self.ask(Stage::Switching, "< rawmode >", now, out),
            ("ok", Stage::Switching) => self.stage = Stage::Open,
            ("frame", Stage::Open) => match parse_frame(words) {
                Some((frame, own)) => {
                    let at = self.clock.place(own, now);
                    out.events.push_back(Event::Frame(Received { frame, at }));
                }
                None => out.events.push_back(Event::Fault(Fault::Garbled, now)),
            },
            ("error", Stage::Open) => {
                match (words.next().and_then(parse_hexadecimal), words.next().and_then(parse_time)) {
                    (Some(classes), Some(own)) => {
                        let at = self.clock.place(own, now);
                        out.events.extend(faults(classes).map(|fault| Event::Fault(fault, at)));
                    }
                    _ => out.events.push_back(Event::Fault(Fault::Other, now)),
                }
            }
            ("error", stage) => {
                let why = super::stream::printable(message.trim_start_matches("error").trim());
                return Err(match stage {
                    Stage::Switching => format!("the server refuses the raw mode: {why}"),
                    _ => format!("the server refuses the bus \"{}\": {why}", self.bus),
                });
            }
            // Other messages of the server, for example statistics, are ignored.
            _ => {}
        }
        Ok(())
    }

    fn ask(&mut self, stage: Stage, message: &str, now: Stamp, out: &mut Output) {
        self.stage = stage;
        self.deadline = now.mono + OPEN_TIMEOUT;
        out.bytes.extend(message.bytes());
    }
}

impl Protocol for Client {
    fn start(&mut self, now: Stamp, _: &mut Output) {
        *self = Client { deadline: now.mono + OPEN_TIMEOUT, ..Client::new(&self.bus) };
    }

    fn receive(&mut self, bytes: &[u8], now: Stamp, out: &mut Output) -> Result<(), String> {
        let mut messages = std::mem::take(&mut self.messages);
        let mut result = Ok(());
        messages.feed(bytes, |message| match message {
            Some(message) if result.is_ok() => result = self.process(message, now, out),
            None if self.stage == Stage::Open => out.events.push_back(Event::Fault(Fault::Garbled, now)),
            _ => {}
        });
        if self.stage == Stage::Greeting && messages.noise.len() >= 4 {
            let greeting = super::stream::printable(&String::from_utf8_lossy(&messages.noise));
            result = Err(format!("this is not a socketcand server: it sends \"{greeting}\""));
        }
        self.messages = messages;
        result
    }

    fn next_wake(&self) -> Option<Mono> {
        (self.stage != Stage::Open).then_some(self.deadline)
    }

    fn wake(&mut self, _: Stamp, _: &mut Output) -> Result<(), String> {
        Err(match self.stage {
            Stage::Greeting => "the server does not greet (< hi >): is it socketcand?".to_owned(),
            Stage::Opening => format!("the server does not answer the request for the bus \"{}\"", self.bus),
            Stage::Switching | Stage::Open => "the server does not answer the request for the raw mode".to_owned(),
        })
    }

    fn send(&mut self, frame: &Frame, _: Stamp, out: &mut Output) -> Result<(), BusError> {
        out.bytes.extend(send_message(frame)?.bytes());
        Ok(())
    }

    fn is_open(&self) -> bool {
        self.stage == Stage::Open
    }

    fn timestamps(&self) -> TimestampSource {
        TimestampSource::Server
    }

    fn sends_remote_frames(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests;
