//! `nmt state --probe` switches the heartbeat on for a moment. Ctrl-C at any time restores 1017h.

use cangauge::bus::Mono;
use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::device::catalog;
use cangauge::device::scalar::Scalar;
use cangauge::master::{Error, Master, Timing};
use cangauge::node::Node;
use cangauge::sim::{Device, Setup};
use cangauge::tasks::nmt::probe;
use std::time::Duration;

/// The heartbeat time after a probe with Ctrl-C at these times in ms, and whether the probe was interrupted.
fn after_probe(interrupts: &[u64]) -> (Vec<u8>, bool) {
    after_probe_with(0, interrupts)
}

fn after_probe_with(before: i64, interrupts: &[u64]) -> (Vec<u8>, bool) {
    let node = NodeId::new(5).expect("a node-ID");
    let mut setup = Setup::new(catalog::by_name("mh4").expect("built in"), node);
    setup.oddities.latency = Duration::from_millis(40);
    setup.set.push((ObjectId::new(0x1017, 0), Scalar::Integer(before)));
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Device::new(setup).expect("a device"));
    interrupts.iter().for_each(|at| bus.interrupt_at(Mono::at(Duration::from_millis(*at))));
    let mut master = Master::new(&mut bus, Timing::default());
    let result = probe(&mut master, &Node::new(node));
    master.settle();
    let late = master.now() + Duration::from_millis(500);
    while master.now() < late {
        master.next(late).expect("the bus works");
    }
    drop(master);
    let device = bus.stations_mut::<Device>().next().expect("the device");
    let period = device.value(ObjectId::new(0x1017, 0), late).expect("1017h");
    (period, matches!(result, Err(Error::Interrupted)))
}

#[test]
fn ctrl_c_at_any_time_restores_the_heartbeat() {
    // A request and its answer take 42 ms. A second answer is awaited once, for 20 ms. After the heartbeat, the probe cannot be interrupted any more.
    for at in 1..200 {
        assert_eq!(after_probe(&[at]), (vec![0, 0], at < 162), "interrupted at {at} ms");
        assert_eq!(after_probe(&[at, at + 9, at + 30]).0, [0, 0], "three times from {at} ms");
    }
    assert_eq!(after_probe(&[]), (vec![0, 0], false));
    // The node already has a heartbeat, but it is too slow to wait for.
    assert_eq!(after_probe_with(10_000, &[]), (10_000u16.to_le_bytes().to_vec(), false));
}
