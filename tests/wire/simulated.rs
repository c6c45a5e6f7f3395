//! The same transcripts with simulated devices: the test sends the frames of the master and checks the answers.
//!
//! `device KIND@NODE` starts a device on a separate bus, up to the next such line or the end of the file. `device none`
//! removes it. Its quantities are constant at `base=VALUE`, or vary by `amplitude=` with a period of `period=` seconds.
//! `quirk=` adds a deviation. A `<` may give the time since the previous frame: `+100ms` (within 2 ms), or `+<100ms`
//! for a maximum; the default maximum is 5 ms. Between the cases, the device must be silent for 1 ms.

use super::files;
use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::time::Mono;
use cangauge::bus::{Bus, Event};
use cangauge::canopen::frame::Frame;
use cangauge::device::catalog::Model;
use cangauge::sim::{Device, Setup};
use std::sync::Arc;
use std::time::Duration;

/// A device, and the time of the last frame.
struct Played {
    bus: MemoryBus,
    last: Duration,
    /// Whether a case has ended.
    is_over: bool,
}

impl Played {
    /// Starts the device of a `device` line; `None` for `device none`.
    fn new(line: &str) -> Option<Played> {
        let mut words = line.split_whitespace();
        let (kind, node) = words.next().filter(|word| *word != "none")?.split_once('@').expect("KIND@NODE");
        let keys: Vec<(&str, &str)> = words.map(|word| word.split_once('=').expect("KEY=VALUE")).collect();
        let path = format!("{}/src/device/devices/{kind}.toml", env!("CARGO_MANIFEST_DIR"));
        let mut text = std::fs::read_to_string(path).expect("a description");
        if let Some((_, quirk)) = keys.iter().find(|(key, _)| *key == "quirk") {
            assert!(!text.contains("\nquirks ="), "one list of quirks");
            text = text.replacen("\nname", &format!("\nquirks = [\"{quirk}\"]\nname"), 1);
        }
        let model = Model::from_toml(&text).expect("a description");
        let mut bus =
            MemoryBus::new(Clock::Virtual).with_bit_rate(model.description.factory.bit_rate.unwrap_or(125_000));
        let mut setup = Setup::new(Arc::new(model), node.parse().expect("a node-ID"));
        setup.channels.iter_mut().for_each(|channel| (channel.amplitude, channel.noise) = (0.0, 0.0));
        for (key, value) in keys {
            let number = || -> f64 { value.parse().expect("a number") };
            match key {
                "base" => setup.channels.iter_mut().for_each(|channel| channel.base = number()),
                "amplitude" => setup.channels.iter_mut().for_each(|channel| channel.amplitude = number()),
                "period" => setup.channels.iter_mut().for_each(|channel| channel.period_s = number()),
                "quirk" => {}
                other => panic!("no such key: {other}"),
            }
        }
        bus.attach(Device::new(setup).expect("a device"));
        Some(Played { bus, last: Duration::ZERO, is_over: false })
    }

    /// The next frame, received up to `until`.
    fn next_frame(&mut self, until: Duration) -> Option<(Duration, Frame)> {
        loop {
            match self.bus.receive(Mono::at(until)).expect("a memory bus never fails") {
                Event::Frame(received) => return Some((received.at.mono.since_start(), received.frame)),
                Event::Timeout => return None,
                _ => {}
            }
        }
    }

    fn now(&self) -> Duration {
        self.bus.now().mono.since_start()
    }

    /// After a case, checks that no frame arrives for 1 ms, unless the next case starts with a frame of the device.
    fn expect_silence(&mut self, place: &str) {
        if std::mem::take(&mut self.is_over) {
            let received = self.next_frame(self.now() + Duration::from_millis(1));
            assert_eq!(received, None, "{place}: unexpected frame before this line");
        }
    }

    fn line(&mut self, mark: &str, rest: &str, place: &str) {
        match mark {
            ">" => {
                self.expect_silence(place);
                let frame = rest.split_whitespace().next().unwrap_or_default();
                self.bus.send(&frame.parse().expect("a frame")).expect("room");
                self.last = self.now();
            }
            "<" => {
                self.is_over = false;
                let (frame, after) = rest.split_once(" +").unwrap_or((rest, "<5ms"));
                let (within, after) = after.strip_prefix('<').map_or((false, after), |after| (true, after));
                let (after, tolerance) = (duration(after), Duration::from_millis(2));
                let until = self.last.max(self.now()) + after + tolerance;
                let (at, received) = self.next_frame(until).unwrap_or_else(|| panic!("{place}: silence"));
                assert_eq!(received.to_string(), frame, "{place}: sent by the device");
                let waited = at - self.last;
                assert!(within || waited + tolerance >= after, "{place}: after {waited:?} already");
                self.last = at;
            }
            ":" => {
                let received = self.next_frame(duration(rest));
                assert_eq!(received, None, "{place}: silent until then");
                self.last = self.now();
            }
            "=" => self.is_over = true,
            "!" | "~" => panic!("{place}: not with a device"),
            _ => {}
        }
    }
}

fn duration(text: &str) -> Duration {
    let milliseconds = match text.strip_suffix("ms") {
        Some(number) => number.parse().expect("a number"),
        None => 1000 * text.strip_suffix('s').expect("ms or s").parse::<u64>().expect("a number"),
    };
    Duration::from_millis(milliseconds)
}

#[test]
fn simulated_devices_follow_the_transcripts() {
    let mut answers = 0;
    for path in files() {
        let text = std::fs::read_to_string(&path).expect("a transcript");
        let mut played = None;
        for (number, line) in text.lines().enumerate() {
            let place = format!("{}:{}", path.display(), number + 1);
            if let Some(spec) = line.strip_prefix("device ") {
                played.iter_mut().for_each(|played: &mut Played| played.expect_silence(&place));
                played = Played::new(spec);
            } else if let Some(played) = &mut played {
                let (mark, rest) = line.split_at(line.len().min(1));
                played.line(mark, rest.trim(), &place);
                answers += usize::from(mark == "<");
            }
        }
    }
    assert!(answers > 60, "only {answers} answers were compared");
}
