//! A wrapper for tests that encodes every frame as the text of a remote transport and decodes it again. The text
//! arrives in pieces that are cut at any byte.

use super::socketcand::{self, Messages};
use super::{BitRateControl, Bus, BusError, Event, Fault, Mono, Received, Stamp, delegate_bus, slcan};
use crate::canopen::frame::Frame;
use std::collections::VecDeque;
use std::time::Duration;

/// The interval between two pieces of text.
const PIECE_INTERVAL: Duration = Duration::from_micros(150);

/// The text format of a transport.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Codec {
    /// The lines of a serial adapter.
    Slcan,
    /// The messages of socketcand, which has no remote frames.
    Socketcand,
}

/// A bus whose frames pass through the text format of a transport.
pub struct TextRoundTrip<B> {
    bus: B,
    codec: Option<Codec>,
    /// The state of the random numbers that choose the cuts.
    seed: u64,
    lines: slcan::Lines,
    messages: Messages,
    /// The text that has not arrived yet, and the times of its frames.
    text: Vec<u8>,
    times: VecDeque<Stamp>,
    arrived: VecDeque<Event>,
}

impl<B: Bus> TextRoundTrip<B> {
    /// Wraps a bus. The seed chooses the cuts. Without a codec, nothing changes.
    pub fn new(bus: B, codec: Option<(Codec, u64)>) -> TextRoundTrip<B> {
        let (codec, seed) = codec.unzip();
        let (lines, messages, seed) = (slcan::Lines::default(), Messages::default(), seed.unwrap_or(0));
        TextRoundTrip {
            bus,
            codec,
            seed,
            lines,
            messages,
            text: Vec::new(),
            times: VecDeque::new(),
            arrived: VecDeque::new(),
        }
    }

    /// The inner bus.
    pub fn inner(&self) -> &B {
        &self.bus
    }

    /// The inner bus, mutable.
    pub fn inner_mut(&mut self) -> &mut B {
        &mut self.bus
    }

    /// Returns a random number from 0 to `max`.
    fn random(&mut self, max: usize) -> usize {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.seed >> 33).unwrap_or(0) % (max + 1)
    }

    /// Encodes a received frame, and decodes the waiting text up to a random cut.
    fn encode_received(&mut self, received: &Received, codec: Codec) {
        let text = match codec {
            Codec::Slcan => slcan::command(&received.frame) + "\r",
            Codec::Socketcand if received.frame.is_remote() => return,
            Codec::Socketcand => socketcand::frame_message(&received.frame, received.at),
        };
        self.text.extend(text.bytes());
        self.times.push_back(received.at);
        let cut = self.random(self.text.len());
        self.decode_waiting(cut, codec);
    }

    /// Decodes the first `count` bytes of the waiting text.
    fn decode_waiting(&mut self, count: usize, codec: Codec) {
        let piece: Vec<u8> = self.text.drain(..count).collect();
        let (times, arrived, now) = (&mut self.times, &mut self.arrived, self.bus.now());
        let mut push = |frame: Option<Frame>| {
            arrived.push_back(match (frame, times.pop_front()) {
                (Some(frame), Some(at)) => Event::Frame(Received { frame, at }),
                _ => Event::Fault(Fault::Garbled, now),
            });
        };
        match codec {
            Codec::Slcan => self.lines.feed(&piece, |answer| push(answer.frame())),
            Codec::Socketcand => self.messages.feed(&piece, |text| push(text.and_then(socketcand::received_frame))),
        }
    }

    /// Encodes a frame as text, and returns the decoded frame.
    fn round_trip(&mut self, frame: &Frame, codec: Codec) -> Result<Frame, BusError> {
        let text = match codec {
            Codec::Slcan => slcan::command(frame) + "\r",
            Codec::Socketcand => socketcand::send_message(frame)?,
        };
        let (first, rest) = text.as_bytes().split_at(self.random(text.len()));
        let mut found = None;
        let (mut lines, mut messages) = (slcan::Lines::default(), Messages::default());
        for piece in [first, rest] {
            match codec {
                Codec::Slcan => lines.feed(piece, |answer| found = answer.frame()),
                Codec::Socketcand => messages.feed(piece, |text| {
                    found = text.and_then(|text| socketcand::sent_frame(text.split_ascii_whitespace().skip(1)));
                }),
            }
        }
        found.ok_or_else(|| BusError::Unsupported(format!("{frame} as text: {text}")))
    }
}

impl<B: Bus> BitRateControl for TextRoundTrip<B> {
    delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl<B: Bus> Bus for TextRoundTrip<B> {
    delegate_bus!(self, self.bus => name timestamps is_live waits now mono listen receive_buffer unreported_drops finish);

    fn sends_remote_frames(&self) -> bool {
        self.codec != Some(Codec::Socketcand) && self.bus.sends_remote_frames()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let Some(codec) = self.codec else { return self.bus.send(frame) };
        let frame = self.round_trip(frame, codec)?;
        self.bus.send(&frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        let Some(codec) = self.codec else { return self.bus.receive(deadline) };
        loop {
            if let Some(event) = self.arrived.pop_front() {
                return Ok(event);
            }
            let due = (!self.text.is_empty()).then(|| self.bus.mono() + PIECE_INTERVAL);
            match self.bus.receive(due.map_or(deadline, |due| due.min(deadline)))? {
                Event::Frame(received) => self.encode_received(&received, codec),
                Event::Timeout if due.is_some() => self.decode_waiting(self.text.len(), codec),
                event => return Ok(event),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::script::Script;

    #[test]
    fn frames_are_the_same_wherever_their_text_is_cut() {
        let texts = ["181#", "60A#0102", "18FF0001#0102030405060708", "701#R", "7FF#AA"];
        let timed = || (0u64..).map(|at| Mono::at(Duration::from_micros(100 * at))).zip(texts);
        for (codec, seed) in (0..100).map(|seed| ([Codec::Slcan, Codec::Socketcand][usize::from(seed < 50)], seed)) {
            let script = timed().fold(Script::new(), |script, (at, text)| script.frame(at, text));
            let mut bus = TextRoundTrip::new(script, Some((codec, seed)));
            let mut received = Vec::new();
            while let Ok(Event::Frame(Received { frame, at })) = bus.receive(Mono::at(Duration::from_secs(1))) {
                received.push((at.mono, frame.to_string()));
            }
            let is_carried = |text: &str| codec == Codec::Slcan || !text.contains('R');
            let expected = timed().filter(|(_, text)| is_carried(text)).map(|(at, text)| (at, text.to_owned()));
            assert_eq!(received, expected.collect::<Vec<_>>(), "{codec:?} {seed}");
            for text in texts {
                let frame = text.parse().expect("a frame");
                assert_eq!(bus.round_trip(&frame, codec).ok(), is_carried(text).then_some(frame), "{codec:?} {seed}");
            }
        }
    }
}
