//! Frames of every function code and length during a recording: they change no row and do not end it.

use super::RecordedRows;
use cangauge::bus::memory::{Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::master::{Master, Timing};
use cangauge::sim::Bench;
use cangauge::tasks::log::{LogOptions, Mode, log};
use std::collections::BTreeMap;
use std::time::Duration;

const NODES: [u8; 4] = [1, 2, 3, 127];

const BENCH: &str = "clock = \"virtual\"\nbit_rate = 1000000\nseed = 3\nrecord = \"truth.csv\"\n\
    [[device]]\nkind = \"mh4\"\nnode = 1\n[[device]]\nkind = \"d20\"\nnode = 2\n\
    [[device]]\nkind = \"mc1609\"\nnode = 3\n[[device]]\nkind = \"dps\"\nnode = 127\n";

/// The TPDOs that the devices send, with their lengths. Such frames are not sent as garbage, because they are valid
/// measurements.
const TPDOS: [(u16, usize); 8] =
    [(0x181, 5), (0x281, 5), (0x182, 4), (0x183, 8), (0x283, 8), (0x383, 8), (0x483, 8), (0x1ff, 4)];

/// Another station that sends meaningless frames. It sends no NMT command, SYNC, boot-up or SDO request:
/// these would change the devices or their state.
struct GarbageSender {
    frames: std::iter::Cycle<std::vec::IntoIter<Frame>>,
    next: Mono,
    sent: usize,
}

fn frame(id: u16, data: &[u8]) -> Frame {
    let bytes: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("{id:03X}#{bytes}").parse().expect("a frame")
}

impl GarbageSender {
    fn new() -> GarbageSender {
        let mut frames = Vec::new();
        for function in 0..16u16 {
            for low in (0..=16).chain([0x40, 0x7e, 0x7f]) {
                let id = function << 7 | low;
                for length in 0..=8usize {
                    // 03h is not an NMT command, 00h in a heartbeat is a boot-up, E0h is not an SDO command.
                    let data = [[0x03, 0xe0, 0xff, 0x7e][usize::from(low % 4)]; 8];
                    let harmless = match function {
                        0 => low == 0 && data[0] == 0x03,
                        // Without data this is the boot-up of a device before CiA 301 V4.
                        1 => low != 0 && length > 0,
                        0xc => false,
                        _ => !TPDOS.contains(&(id, length)),
                    };
                    if harmless {
                        frames.push(frame(id, &data[..length]));
                    }
                }
                if function != 0xe && function != 0xc {
                    frames.push(format!("{id:03X}#R").parse().expect("a remote frame"));
                }
                frames.push(format!("{:08X}#0102030405", u32::from(id)).parse().expect("an extended frame"));
            }
        }
        GarbageSender { frames: frames.into_iter().cycle(), next: Mono::START, sent: 0 }
    }
}

impl Station for GarbageSender {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if let (None, Some(frame)) = (out.front(), self.frames.next()) {
            out.send(frame);
        }
        self.next = now + Duration::from_micros(300);
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.next)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {
        self.sent += 1;
    }
}

#[test]
fn garbage_does_not_change_rows_or_end_the_recording() {
    for mode in [Mode::Sync(Duration::from_millis(10)), Mode::AsSent] {
        let folder = tempfile::tempdir().expect("a folder");
        let mut bus = Bench::from_toml(BENCH, folder.path()).expect("a bench").open().expect("a bus");
        bus.attach(GarbageSender::new());
        let plan = LogOptions {
            nodes: NODES.iter().map(|&id| NodeId::new(id).expect("a node-ID")).collect(),
            wanted: Vec::new(),
            mode,
            duration: Some(Duration::from_secs(4)),
            count: None,
            nmt: true,
            start_all: true,
            max_gap: None,
            overrides: BTreeMap::new(),
        };
        let mut kept = RecordedRows::default();
        let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut kept).expect("a recording");
        let garbage_frames = bus.stations::<GarbageSender>().next().expect("the sender").sent;
        assert!(garbage_frames > 10_000, "{garbage_frames} frames in 4 s, each at least three times");
        drop(bus);
        let truth = std::fs::read_to_string(folder.path().join("truth.csv")).expect("the record");
        let at = |line: &str| line.split(',').next().and_then(|time| time.parse::<u64>().ok()).expect("a time");
        let (first, last) = (at(&kept.rows[0]), at(kept.rows.last().expect("rows")));
        let sent: Vec<&str> = truth.lines().skip(1).filter(|line| (first..=last).contains(&at(line))).collect();
        assert_eq!(kept.rows, sent);
        assert!(kept.rows.len() > 600, "{}", kept.rows.len());
        assert!(last - first > 3_800_000, "it ran to its end");
        assert_eq!(outcome.rows, kept.rows.len() as u64);
    }
}
