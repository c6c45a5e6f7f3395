//! Another node sends SYNC already. A second SYNC producer would double every synchronous TPDO.

use super::Kept;
use cangauge::bus::memory::{MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::master::{Master, Timing};
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Bench, Device, State};
use cangauge::tasks::log::{LogOptions, Mode, log};
use cangauge::tasks::{Failure, Kind};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(50);

/// A controller that sends SYNC.
struct Controller {
    next: Mono,
}

impl Station for Controller {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        out.send("080#".parse().expect("a frame"));
        self.next = now + PERIOD;
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.next)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

fn record(mode: Mode) -> (MemoryBus, Kept, Result<u64, Failure>) {
    let text = "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let mut bus = Bench::from_toml(text, Path::new("")).expect("a bench").open().expect("a bus");
    bus.attach(Controller { next: Mono::START + PERIOD });
    let plan = LogOptions {
        nodes: vec![NodeId::new(5).expect("a node-ID")],
        wanted: Vec::new(),
        mode,
        duration: Some(Duration::from_secs(1)),
        count: None,
        nmt: true,
        max_gap: None,
        overrides: BTreeMap::new(),
    };
    let mut kept = Kept::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut kept);
    (bus, kept, outcome.map(|outcome| outcome.rows))
}

#[test]
fn second_sync_producer_is_refused_before_any_node_is_started() {
    let (bus, kept, outcome) = record(Mode::Sync(Duration::from_millis(10)));
    let failure = outcome.expect_err("refused");
    assert_eq!(failure.kind(), Kind::CheckFailed);
    assert_eq!(ErrorMessage::of(&failure).message, "another node sends SYNC on this bus: nothing was started");
    assert!(ErrorMessage::of(&failure).hint.is_some_and(|hint| hint.starts_with("omit --sync")));
    assert_eq!(kept.rows, [""; 0]);
    let state = bus.stations::<Device>().next().and_then(Device::state);
    assert_eq!(state, Some(State::PreOperational));
}

#[test]
fn sync_of_another_producer_is_recorded() {
    let (_, kept, outcome) = record(Mode::AsSent);
    assert_eq!(outcome.unwrap() / 20, 1, "one every 50 ms for a second");
    assert!((19..=21).contains(&kept.rows.len()), "{}", kept.rows.len());
}
