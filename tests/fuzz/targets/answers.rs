//! Complete tasks with a device that answers SDO requests with arbitrary bytes. The tasks end, access no other node,
//! write nothing, and print no control characters.
#![no_main]

use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use cangauge::master::{Master, Timing};
use cangauge::node::Overrides;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::report::{Format, render};
use cangauge::tasks::scan::scan;
use cangauge::tasks::settings::info::read;
use cangauge_fuzz::{Bytes, node};
use libfuzzer_sys::fuzz_target;
use std::time::Duration;

/// The largest number of segments of one object. The limit of the client, 64 MiB, takes too long here.
const SEGMENTS: usize = 20;

struct Answerer {
    script: Vec<u8>,
    at: usize,
    segments: usize,
}

impl Station for Answerer {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        // There is no other participant: all received frames are from the program.
        assert_eq!(frame.id(), CanId::sdo_request(node()), "{frame} is not for this node");
        let request = frame.as_eight_bytes().expect("eight bytes");
        assert!(matches!(request[0] >> 5, 2 | 3 | 4 | 5), "{frame} is no part of a read");
        let mut bytes = Bytes(self.script.get(self.at..).unwrap_or_default());
        let before = bytes.0.len();
        let head = bytes.byte();
        let response = CanId::sdo_response(node());
        let mut data = [0; 8];
        if request[0] >> 5 == 2 {
            self.segments = 0;
            data[1..4].copy_from_slice(&request[1..4]);
            data[0] = [0x43, 0x4b, 0x4f, 0x42, 0x41, 0x40, 0x80, 0xc6][usize::from(head & 7)];
            data[4..].copy_from_slice(&bytes.long().to_le_bytes());
        } else {
            self.segments += 1;
            data[0] = (request[0] & 0x10) | head & 0xf | u8::from(self.segments > SEGMENTS);
            let taken = bytes.take(7);
            data[1..=taken.len()].copy_from_slice(taken);
        }
        match head >> 4 {
            0 => {}
            1 => out.send(bytes.frame(response)),
            2 => {
                out.send(Frame::full(response, data));
                out.send(bytes.frame(response));
            }
            _ => out.send(Frame::full(response, data)),
        }
        self.at += before - bytes.0.len();
        // The script repeats after its end. An empty script means no answers.
        if self.at >= self.script.len() {
            self.at = 0;
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// Checks printed text: no control characters except line ends, and no change of the writing direction.
fn assert_harmless(text: &[u8]) {
    let text = std::str::from_utf8(text).expect("text");
    let steers =
        |c: char| c.is_control() && c != '\n' || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    assert!(!text.contains(steers), "{text:?}");
}

const FORMATS: [Format; 3] = [Format::Text, Format::Json, Format::Csv];

fuzz_target!(|data: &[u8]| {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Answerer { script: data.to_vec(), at: 0, segments: 0 });
    let timing = Timing { timeout: Duration::from_millis(20), retries: 0 };
    let mut master = Master::new(&mut bus, timing);
    let mut text = Vec::new();
    let overrides = Overrides::new();
    if let Ok(found) = scan(&mut master, &[node()], timing.timeout, 1, &overrides) {
        assert!(found.len() <= 1);
        for format in FORMATS {
            render(&found, format, &mut text).expect("memory");
        }
    }
    match read(&mut master, node(), &overrides) {
        Ok(page) => {
            for format in FORMATS {
                render(std::slice::from_ref(&page), format, &mut text).expect("memory");
            }
        }
        Err(failure) => {
            assert_eq!(failure.node, Some(node()), "{}", ErrorMessage::of(&failure).message);
            ErrorMessage::of(&failure).json(&mut text, 1).expect("memory");
        }
    }
    assert_harmless(&text);
});
