//! Replays a recording.
#![no_main]

use cangauge::bus::replay::Replay;
use cangauge::bus::time::Mono;
use cangauge::bus::{Bus, Event};
use libfuzzer_sys::fuzz_target;
use std::path::PathBuf;
use std::sync::LazyLock;
use std::time::Duration;

static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = if PathBuf::from("/dev/shm").is_dir() { "/dev/shm".into() } else { std::env::temp_dir() };
    folder.join(format!("cangauge-fuzz-{}.log", std::process::id()))
});

fuzz_target!(|data: &[u8]| {
    std::fs::write(&*FILE, data).expect("a place for the log");
    let opened = Replay::open(&FILE.display().to_string(), Box::new(|_| {}));
    // The open file is enough.
    std::fs::remove_file(&*FILE).expect("it is ours");
    let Ok(mut bus) = opened else {
        assert!(data.starts_with(b"\x1f\x8b"), "only a gzip header can be wrong");
        return;
    };
    let lines = data.split(|byte| *byte == b'\n').count();
    let (mut last, mut events) = (Mono::START, 0);
    while let Ok(event) = bus.receive(Mono::at(Duration::MAX)) {
        let at = match event {
            Event::Frame(received) => received.at,
            Event::Fault(_, at) => at,
            _ => break,
        };
        assert!(at.mono >= last, "time goes back");
        (last, events) = (at.mono, events + 1);
        // Compressed data may have more lines than it shows.
        assert!(events <= lines || data.starts_with(b"\x1f\x8b"), "more than there is");
    }
});
