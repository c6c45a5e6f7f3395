//! The duration of a scan, and the nodes that it finds.

use super::odd_answers::PartlySilent;
use cangauge::bus::Bus;
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::nmt::NmtState;
use cangauge::device::catalog::by_name;
use cangauge::master::{Master, OnTwoDevices, Timing};
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Bench, Device, Setup};
use cangauge::tasks::scan::{Found, scan};
use std::collections::VecDeque;
use std::path::Path;
use std::time::Duration;

const WAIT: Duration = Duration::from_millis(200);

/// The time to read the identity of one device.
const READING: Duration = Duration::from_millis(30);

fn ids(nodes: impl IntoIterator<Item = u8>) -> Vec<NodeId> {
    nodes.into_iter().map(|node| NodeId::new(node).unwrap()).collect()
}

/// The nodes found, and the duration.
fn scanned(bus: &mut MemoryBus, nodes: &[NodeId], wait: Duration) -> (Vec<Found>, Duration) {
    let start = bus.now().mono;
    let found = scan(&mut Master::new(bus, Timing::default()), nodes, wait, 2, &Default::default()).unwrap();
    (found, bus.now().mono.since(start))
}

fn bench(devices: &str) -> MemoryBus {
    Bench::from_toml(&format!("clock = \"virtual\"\n{devices}"), Path::new("")).unwrap().open().unwrap()
}

#[test]
fn scan_ends_when_all_requested_nodes_have_answered() {
    let mut bus = bench("[[device]]\nkind = \"mh4\"\nnode = 5\n");
    for wait in [WAIT, Duration::from_secs(60)] {
        let (found, took) = scanned(&mut bus, &ids([5]), wait);
        assert_eq!(found.len(), 1);
        assert!(took < Duration::from_millis(300), "{took:?}");
    }
    // Silent nodes are asked twice. Both rounds share one wait, after the 127 requests of the first one.
    let (found, took) = scanned(&mut bus, &ids(1..=127), WAIT);
    assert_eq!(found.len(), 1);
    let sending = Duration::from_millis(65);
    assert!((WAIT..WAIT + sending + READING).contains(&took), "{took:?}");
}

#[test]
fn state_comes_from_the_heartbeat() {
    let mut bus = bench("[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 150 }\n");
    let (found, took) = scanned(&mut bus, &ids([5]), WAIT);
    assert_eq!(found[0].state, Some(NmtState::PreOperational));
    assert!(took < Duration::from_millis(300), "{took:?}");
}

#[test]
fn node_without_answer_for_1000h_is_found() {
    for nodes in [ids([5]), ids(1..=127)] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(PartlySilent::new("mh4", &[0x1000]));
        let (found, _) = scanned(&mut bus, &nodes, WAIT);
        let names: Vec<_> = found.iter().map(|found| found.device.identity.name.as_deref()).collect();
        assert_eq!(names, [Some("MH-4-CAN")]);
        assert_eq!((found[0].device.identity.device_type, &found[0].failure), (None, &None));
    }
}

/// A server that answers each read with these frames: COB-ID and value.
struct Answering(&'static [(u16, u8)]);

impl Station for Answering {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        let [0x40, a, b, c, ..] = *frame.data() else { return };
        if frame.id().number() != 0x605 {
            return;
        }
        for (id, value) in self.0 {
            out.send(format!("{id:03X}#43{a:02X}{b:02X}{c:02X}{value:02X}010200").parse().expect("a frame"));
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn answer_with_another_cob_id_is_reported_with_the_channel() {
    for (cob_id, channel) in [(0x5c5, "--sdo 5=0x605:0x5C5"), (0x6e5, "--sdo 5=0x605:0x6E5")] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Answering(Box::leak(Box::new([(cob_id, 0x94)]))));
        let (found, _) = scanned(&mut bus, &ids([5]), WAIT);
        let failure = found[0].failure.as_ref().expect("no answer with its own COB-ID");
        let text = ErrorMessage::from(failure);
        assert!(text.hint.is_some_and(|hint| hint.contains(channel)), "{}", text.message);
        assert!(text.message.contains(&format!("received {cob_id:03X}#43")), "{}", text.message);
    }
}

#[test]
fn two_devices_are_one_row_without_a_failure() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Answering(&[(0x585, 0x94), (0x585, 0x96)]));
    let mut master = Master::new(&mut bus, Timing::default());
    master.set_on_two_devices(OnTwoDevices::Report);
    let found = scan(&mut master, &ids([5]), WAIT, 2, &Default::default()).unwrap();
    assert_eq!((found.len(), found[0].failure.as_ref()), (1, None));
    assert!(matches!(master.second_answers()[..], [(_, answers)] if answers.differs()));
}

/// A device that is switched on later than the others.
struct Late {
    device: Device,
    at: Mono,
    is_on: bool,
}

impl Station for Late {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        if self.is_on {
            self.device.receive(now, frame, out);
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if self.is_on {
            self.device.wake(now, out);
        } else {
            self.is_on = true;
            self.device.power_on(now, out);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        if self.is_on { self.device.next_wake() } else { Some(self.at) }
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.device.sent(now, frame);
    }
}

#[test]
fn node_switched_on_during_the_scan_is_found() {
    for millis in [1, 30, 100, 150, 199] {
        let device = Device::new(Setup::new(by_name("mh4").unwrap(), NodeId::new(5).unwrap())).unwrap();
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Late { device, at: Mono::at(Duration::from_millis(millis)), is_on: false });
        let (found, _) = scanned(&mut bus, &ids(1..=127), WAIT);
        let names: Vec<_> = found.iter().map(|found| found.device.identity.name.as_deref()).collect();
        assert_eq!(names, [Some("MH-4-CAN")], "switched on after {millis} ms");
    }
}

/// A device that answers each request after a fixed time.
struct Slow {
    device: Device,
    delay: Duration,
    requests: VecDeque<(Mono, Frame)>,
}

impl Station for Slow {
    fn power_on(&mut self, now: Mono, out: &mut Outbox) {
        self.device.power_on(now, out);
    }

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        self.requests.push_back((now + self.delay, *frame));
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        while let Some(&(at, frame)) = self.requests.front()
            && at <= now
        {
            self.requests.pop_front();
            self.device.receive(now, &frame, out);
        }
        self.device.wake(now, out);
    }

    fn next_wake(&self) -> Option<Mono> {
        self.requests.front().map(|(at, _)| *at).into_iter().chain(self.device.next_wake()).min()
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.device.sent(now, frame);
    }
}

#[test]
fn slow_nodes_are_found_in_the_same_wait() {
    for delay in [1, 49, 51, 100, 150, 190] {
        for node in [1, 60, 127] {
            let device = Device::new(Setup::new(by_name("dps").unwrap(), NodeId::new(node).unwrap())).unwrap();
            let mut bus = MemoryBus::new(Clock::Virtual);
            bus.attach(Slow { device, delay: Duration::from_millis(delay), requests: VecDeque::new() });
            let (found, _) = scanned(&mut bus, &ids(1..=127), WAIT);
            let names: Vec<_> = found.iter().map(|found| found.device.identity.name.as_deref()).collect();
            assert_eq!(names, [Some("DPS")], "node {node}, {delay} ms");
        }
    }
}

#[test]
fn none_of_127_nodes_is_missed() {
    let devices: String = (1..=127).map(|node| format!("[[device]]\nkind = \"dps\"\nnode = {node}\n")).collect();
    let (found, _) = scanned(&mut bench(&devices), &ids(1..=127), WAIT);
    assert_eq!(found.iter().filter(|found| found.device.identity.serial.is_some()).count(), 127);
}
