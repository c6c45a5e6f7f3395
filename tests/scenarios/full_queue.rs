//! A full transmit queue: no request is lost, and a scan finds all nodes.

use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{BIT_RATE, Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::bus::{Bus, Event};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::DownloadSize;
use cangauge::master::{Error, Master, Request, Timing};
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Device, Setup};
use cangauge::tasks::Kind;
use cangauge::tasks::scan::{Found, scan};
use std::time::Duration;

const WAIT: Duration = Duration::from_millis(200);

/// A bus with simulated devices on these nodes.
fn bus(nodes: &[u8]) -> MemoryBus {
    bus_at(BIT_RATE, nodes)
}

fn bus_at(bit_rate: u32, nodes: &[u8]) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(bit_rate);
    for (&node, model) in nodes.iter().zip(["mh4", "dps", "d20", "mc1609"].into_iter().cycle()) {
        let model = cangauge::device::catalog::by_name(model).unwrap();
        bus.attach(Device::new(Setup::new(model, NodeId::new(node).unwrap())).unwrap());
    }
    bus
}

fn scan_all(bus: &mut dyn Bus) -> Result<Vec<Found>, Error> {
    let nodes: Vec<NodeId> = NodeId::all().collect();
    scan(&mut Master::new(bus, Timing::default()), &nodes, WAIT, 2, &Default::default())
}

fn described(found: &[Found]) -> Vec<(u8, Option<u32>, Option<String>, String)> {
    let one = |found: &Found| {
        let device = &found.device;
        let model = device.model.as_ref().map(|model| model.description.name.clone()).unwrap_or_default();
        (found.node.get(), device.identity.serial, device.identity.name.clone(), model)
    };
    found.iter().map(one).collect()
}

#[test]
fn scan_finds_all_nodes_although_the_queue_is_full() {
    let all: Vec<u8> = (1..=127).collect();
    for present in [&[1, 64, 127][..], &all] {
        let expected = described(&scan_all(&mut bus(present)).unwrap());
        assert_eq!(expected.iter().map(|node| node.0).collect::<Vec<_>>(), present);
        assert!(expected.iter().all(|node| !node.3.is_empty()), "{expected:?}");
        // Full at each second call; in runs of 20 calls; at six of seven calls.
        let plans: [&dyn Fn(u64) -> bool; 3] =
            [&|call| call % 2 == 0, &|call| call / 20 % 2 == 0, &|call| call % 7 > 0];
        for is_full in plans {
            let queue_full = (0..100_000).filter(|&call| is_full(call)).collect();
            let mut faulty = Faulty::new(bus(present), FaultPlan { queue_full, ..FaultPlan::default() });
            assert_eq!(described(&scan_all(&mut faulty).unwrap()), expected);
        }
    }
}

#[test]
fn scan_waits_for_a_short_queue_on_a_slow_bus() {
    let present: Vec<u8> = (1..=127).collect();
    for queue_length in [1, 2, 10] {
        let mut slow = bus_at(10_000, &present).with_queue_length(queue_length);
        // Wait for the boot-up messages of all devices.
        let booted = slow.now().mono + Duration::from_secs(5);
        while slow.receive(booted).unwrap() != Event::Timeout {}
        let found = scan_all(&mut slow).unwrap();
        assert_eq!(found.iter().map(|found| found.node.get()).collect::<Vec<_>>(), present, "{queue_length}");
    }
}

#[test]
fn queue_that_stays_full_is_a_bus_error() {
    let plan = FaultPlan { queue_full: (3..100_000).collect(), ..FaultPlan::default() };
    let mut faulty = Faulty::new(bus(&[1]), plan);
    let start = faulty.now().mono;
    let failure = cangauge::tasks::Failure::from(scan_all(&mut faulty).unwrap_err());
    assert_eq!(failure.kind(), Kind::Bus);
    assert!(ErrorMessage::of(&failure).hint.unwrap().contains("terminators"));
    let took = faulty.now().mono.since(start);
    assert!((Duration::from_secs(1)..Duration::from_secs(2)).contains(&took), "{took:?}");
}

/// A server that acknowledges one segment before it has received it. This happens if two devices have the same node-ID
/// and one of them is slower.
#[derive(Default)]
struct EarlyServer {
    data: Vec<u8>,
    toggle: u8,
    segments: u32,
    due: Option<(Mono, Frame)>,
}

impl Station for EarlyServer {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        match *frame.data() {
            [0x21, a, b, c, ..] => {
                (self.data, self.toggle) = (Vec::new(), 0);
                out.send(format!("585#60{a:02X}{b:02X}{c:02X}00000000").parse().unwrap());
            }
            [command, ref bytes @ ..] if command & 0xe0 == 0 && command & 0x10 == self.toggle => {
                self.data.extend(&bytes[..7 - usize::from(command >> 1 & 7)]);
                let acknowledge = |toggle: u8| format!("585#{:02X}00000000000000", 0x20 | toggle).parse().unwrap();
                out.send(acknowledge(self.toggle));
                self.toggle ^= 0x10;
                self.segments += 1;
                if self.segments == 2 {
                    self.due = Some((now + Duration::from_micros(500), acknowledge(self.toggle)));
                }
            }
            _ => {}
        }
    }

    fn wake(&mut self, _: Mono, out: &mut Outbox) {
        self.due.take().into_iter().for_each(|(_, frame)| out.send(frame));
    }

    fn next_wake(&self) -> Option<Mono> {
        self.due.map(|(at, _)| at)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn early_acknowledge_does_not_skip_a_segment() {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(BIT_RATE);
    bus.attach(EarlyServer::default());
    // The third segment waits for the queue.
    let mut bus = Faulty::new(bus, FaultPlan { queue_full: (3..8).collect(), ..FaultPlan::default() });
    let data: Vec<u8> = (0..50).collect();
    let node = NodeId::new(5).unwrap();
    let write = Request::write(node, ObjectId::new(0x2000, 0), data.clone(), DownloadSize::Indicated);
    Master::new(&mut bus, Timing::default()).transfer_one(write).unwrap().unwrap();
    assert_eq!(bus.inner().stations::<EarlyServer>().next().unwrap().data, data);
}
