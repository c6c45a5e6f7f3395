//! Another node sends SYNC or NMT commands already. A second SYNC producer would double every synchronous TPDO.

use super::RecordedRows;
use cangauge::bus::memory::{MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::master::{Master, Timing};
use cangauge::output::events::remark_text;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Bench, Device, State};
use cangauge::tasks::log::{LogEvent, LogOptions, Mode, log};
use cangauge::tasks::pdo::{WatchEvent, watch};
use cangauge::tasks::{Failure, Kind};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(50);

/// A controller that sends a frame, SYNC for example.
struct Controller {
    next: Mono,
    frame: &'static str,
}

impl Station for Controller {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        out.send(self.frame.parse().expect("a frame"));
        self.next = now + PERIOD;
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.next)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

fn record(mode: Mode) -> (MemoryBus, RecordedRows, Result<u64, Failure>) {
    record_beside(Controller { next: Mono::START + PERIOD, frame: "080#" }, mode, true)
}

/// A bus with node 5 and this controller.
fn beside(controller: Controller) -> MemoryBus {
    let text = "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let mut bus = Bench::from_toml(text, Path::new("")).expect("a bench").open().expect("a bus");
    bus.attach(controller);
    bus
}

fn options(mode: Mode, start_all: bool) -> LogOptions {
    LogOptions {
        nodes: vec![NodeId::new(5).expect("a node-ID")],
        wanted: Vec::new(),
        mode,
        duration: Some(Duration::from_secs(1)),
        count: None,
        nmt: true,
        start_all,
        max_gap: None,
        overrides: BTreeMap::new(),
    }
}

fn record_beside(
    controller: Controller,
    mode: Mode,
    start_all: bool,
) -> (MemoryBus, RecordedRows, Result<u64, Failure>) {
    let mut bus = beside(controller);
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &options(mode, start_all), &mut kept);
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

/// Repeats each TPDO of node 5 after 1 ms.
#[derive(Default)]
struct Bridge(Option<(Mono, Frame)>);

impl Station for Bridge {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        if frame.id().to_string() == "185" {
            self.0 = Some((now + Duration::from_millis(1), *frame));
        }
    }

    fn wake(&mut self, _: Mono, out: &mut Outbox) {
        out.send(self.0.take().expect("a frame").1);
    }

    fn next_wake(&self) -> Option<Mono> {
        self.0.map(|(at, _)| at)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// Watches a node on a bus with SYNC, and a second sender of its TPDO: a device, else a bridge.
fn watched(second: Option<f64>) -> (Vec<String>, Vec<Kind>) {
    let device = |(node, pressure): (u8, f64)| {
        format!(
            "[[device]]\nkind = \"mh4\"\nnode = {node}\nstart = true\nset = {{ \"0x1800:1\" = 0x40000185 }}\n\
             [[device.channel]]\nchannel = 1\nbase = {pressure:?}\namplitude = 0.0\nnoise = 0.0\n"
        )
    };
    let devices = [Some((5, 1.25)), second.map(|pressure| (6, pressure))];
    let text = format!("clock = \"virtual\"\n{}", devices.into_iter().flatten().map(device).collect::<String>());
    let mut bus = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    if second.is_none() {
        bus.attach(Bridge::default());
    }
    bus.attach(Controller { next: Mono::START + PERIOD, frame: "080#" });
    let mut events = Vec::new();
    let mut on_event = |event: &WatchEvent<'_>| {
        events.push(match event {
            WatchEvent::Tpdo { .. } => "value".to_owned(),
            other => format!("{other:?}").chars().take(8).collect(),
        });
        ControlFlow::Continue(())
    };
    let nodes = [NodeId::new(5).expect("a node-ID")];
    let mut master = Master::new(&mut bus, Timing::default());
    let failures = watch(&mut master, &nodes, &BTreeMap::new(), Some(Duration::from_secs(1)), &mut on_event);
    (events, failures.expect("watched").iter().map(Failure::kind).collect())
}

#[test]
fn second_sender_of_a_watched_tpdo_is_found() {
    let (events, failures) = watched(Some(2.5));
    assert_eq!((events.last().map(String::as_str), failures), (Some("Failed(F"), vec![Kind::Unexpected]));
    let (events, failures) = watched(None);
    assert_eq!((events.iter().filter(|event| event.starts_with("Repeated")).count(), failures.len()), (1, 0));
    assert!((18..24).contains(&events.iter().filter(|event| *event == "value").count()), "{events:?}");
}

/// Answers each SYNC like node 5, with other values.
struct SecondSender(Option<Mono>);

impl Station for SecondSender {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        if frame.id() == CanId::SYNC {
            self.0 = Some(now + Duration::from_millis(2));
        }
    }

    fn wake(&mut self, _: Mono, out: &mut Outbox) {
        self.0 = None;
        out.send("185#0000E84000".parse().expect("a frame"));
    }

    fn next_wake(&self) -> Option<Mono> {
        self.0
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn second_sender_at_the_sync_of_another_producer_gives_no_rows() {
    let (mut bus, options) =
        (beside(Controller { next: Mono::START + PERIOD, frame: "080#" }), options(Mode::AsSent, false));
    bus.attach(SecondSender(None));
    let mut kept = RecordedRows::default();
    let report = log(&mut Master::new(&mut bus, Timing::default()), &options, &mut kept).expect("the bus works");
    assert_eq!(report.two_devices.iter().map(Failure::kind).collect::<Vec<_>>(), [Kind::Unexpected]);
    assert_eq!(kept.rows.len(), 0);
}

#[test]
fn sync_of_another_producer_is_recorded() {
    let (_, kept, outcome) = record(Mode::AsSent);
    assert_eq!(outcome.unwrap() / 20, 1, "one every 50 ms for a second");
    assert!((19..=21).contains(&kept.rows.len()), "{}", kept.rows.len());
}

#[test]
fn nodes_are_not_started_beside_another_nmt_master() {
    let beside = |frame, mode, start_all| {
        let (bus, kept, outcome) = record_beside(Controller { next: Mono::START, frame }, mode, start_all);
        let state = bus.stations::<Device>().next().and_then(Device::state);
        let remark = |event: &LogEvent| match event {
            LogEvent::Remark(remark) => Some(remark_text(remark)),
            _ => None,
        };
        (kept.notes.iter().filter_map(remark).collect::<Vec<_>>(), state, outcome.is_ok_and(|rows| rows > 0))
    };
    let sync = Mode::Sync(Duration::from_millis(10));
    for (frame, sent, mode) in [
        ("000#0109", "\"start\" to node 9", sync),
        ("000#8000", "\"enter pre-operational\" to all nodes", Mode::AsSent),
    ] {
        let note = format!("node 5 was not started: another NMT master sent {sent}; start all nodes: log --start");
        assert_eq!(beside(frame, mode, false), (vec![note], Some(State::PreOperational), false), "{frame}");
    }
    assert!(beside("000#0109", sync, true).2, "--start");
    assert_eq!(beside("000#01", sync, false), (Vec::new(), Some(State::Operational), true), "not a command");
}
