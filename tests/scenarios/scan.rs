//! The duration of a scan, and the nodes that it finds.

use cangauge::bus::Bus;
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::nmt::NmtState;
use cangauge::device::catalog::by_name;
use cangauge::master::{Master, Timing};
use cangauge::sim::{Bench, Device, Setup};
use cangauge::tasks::scan::{Found, scan};
use std::path::Path;
use std::time::Duration;

const WAIT: Duration = Duration::from_millis(200);

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
    // Silent nodes are asked twice: the first wait is short, the second is the time-out.
    let (found, took) = scanned(&mut bus, &ids(1..=127), WAIT);
    assert_eq!(found.len(), 1);
    assert!((WAIT..WAIT * 3).contains(&took), "{took:?}");
}

#[test]
fn state_comes_from_the_heartbeat() {
    let mut bus = bench("[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 150 }\n");
    let (found, took) = scanned(&mut bus, &ids([5]), WAIT);
    assert_eq!(found[0].state, Some(NmtState::PreOperational));
    assert!(took < Duration::from_millis(300), "{took:?}");
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
    for millis in [1, 30, 100, 200, 240] {
        let device = Device::new(Setup::new(by_name("mh4").unwrap(), NodeId::new(5).unwrap())).unwrap();
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Late { device, at: Mono::at(Duration::from_millis(millis)), is_on: false });
        let (found, _) = scanned(&mut bus, &ids(1..=127), WAIT);
        let names: Vec<_> = found.iter().map(|found| found.device.identity.name.as_deref()).collect();
        assert_eq!(names, [Some("MH-4-CAN")], "switched on after {millis} ms");
    }
}
