//! Simulated devices with arbitrary frames: they answer only with their node-IDs, and become idle again.
#![no_main]

use cangauge::bus::{Bus, Event};
use cangauge::canopen::id::CanId;
use cangauge::sim::Bench;
use cangauge_fuzz::{Bytes, NODE, node};
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use std::time::Duration;

const KINDS: [&str; 4] = ["mh4", "d20", "dps", "mc1609"];

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let kind = KINDS[usize::from(bytes.byte() % 4)];
    let bench = format!("clock = \"virtual\"\nbit_rate = 1000000\n[[device]]\nkind = \"{kind}\"\nnode = {NODE}\n");
    let mut bus = Bench::from_toml(&bench, Path::new("")).expect("a bench").open().expect("a bus");
    let mut events = 0;
    for _ in 0..200 {
        if bytes.is_empty() {
            break;
        }
        // Most frames are SDO requests, some are LSS requests or NMT commands: a device reacts to these.
        let ours = match bytes.byte() >> 5 {
            0 => CanId::LSS_MASTER,
            1 => CanId::NMT,
            _ => CanId::sdo_request(node()),
        };
        if bus.send(&bytes.frame(ours)).is_err() {
            break;
        }
        let until = bus.mono() + Duration::from_millis(3);
        loop {
            events += 1;
            assert!(events < 100_000, "it never becomes idle");
            match bus.receive(until) {
                Ok(Event::Frame(received)) => assert!(received.frame.len() <= 8),
                Ok(Event::Timeout) | Err(_) => break,
                Ok(_) => {}
            }
        }
    }
});
