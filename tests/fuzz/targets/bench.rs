//! The text after `sim:` and bench files: each accepted bench runs.
#![no_main]

use cangauge::bus::Bus;
use cangauge::sim::Bench;
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use std::time::Duration;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    // This target reads and writes no files.
    if text.contains("record") || text.contains(".toml") {
        return;
    }
    let bench = match text.strip_prefix("sim:") {
        Some(spec) => Bench::parse(spec),
        None => Bench::from_toml(&format!("clock = \"virtual\"\n{text}"), Path::new("/nonexistent")),
    };
    let Ok(bench) = bench else { return };
    if text.starts_with("sim:") {
        return;
    }
    let mut bus = bench.open().expect("nothing is written");
    let until = bus.mono() + Duration::from_millis(50);
    for _ in 0..1000 {
        if bus.receive(until).is_err() || bus.mono() >= until {
            break;
        }
    }
});
