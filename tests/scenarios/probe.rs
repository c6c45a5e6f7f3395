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
use cangauge::tasks::journal::{Journal, JournalError, NoJournal, TemporaryWrite, Undone};
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
    let result = probe(&mut master, &Node::new(node), &mut NoJournal);
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
    // A request and its answer take 42 ms. A second answer is awaited once, for 20 ms. After the heartbeat, the probe
    // cannot be interrupted any more.
    for at in 1..200 {
        assert_eq!(after_probe(&[at]), (vec![0, 0], at < 162), "interrupted at {at} ms");
        assert_eq!(after_probe(&[at, at + 9, at + 30]).0, [0, 0], "three times from {at} ms");
    }
    assert_eq!(after_probe(&[]), (vec![0, 0], false));
    // The node already has a heartbeat, but it is too slow to wait for.
    assert_eq!(after_probe_with(10_000, &[]), (10_000u16.to_le_bytes().to_vec(), false));
}

/// A journal that is kept after its program has ended, with the number of frames that were sent before each record.
#[derive(Default)]
pub(super) struct KeptJournal(pub(super) Vec<TemporaryWrite>);

impl Journal for KeptJournal {
    fn record(&mut self, write: &TemporaryWrite) -> Result<(), JournalError> {
        self.0.push(write.clone());
        Ok(())
    }

    fn remove(&mut self, write: &TemporaryWrite) {
        self.0.retain(|kept| kept != write);
    }
}

/// A disk that is full.
struct Full;

impl Journal for Full {
    fn record(&mut self, _: &TemporaryWrite) -> Result<(), JournalError> {
        Err(JournalError { file: "x.undo".to_owned(), reason: "No space left on device".to_owned() })
    }

    fn remove(&mut self, _: &TemporaryWrite) {}
}

fn bus_of(kind: &str, heartbeat: i64) -> MemoryBus {
    let mut setup = Setup::new(catalog::by_name(kind).expect("built in"), NodeId::new(5).expect("a node-ID"));
    setup.set.push((ObjectId::new(0x1017, 0), Scalar::Integer(heartbeat)));
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Device::new(setup).expect("a device"));
    bus
}

fn heartbeat_time(bus: &mut MemoryBus) -> u16 {
    let now = cangauge::bus::Bus::now(bus).mono;
    let device = bus.stations_mut::<Device>().next().expect("the device");
    let value = device.value(ObjectId::new(0x1017, 0), now).expect("1017h");
    u16::from_le_bytes([value[0], value[1]])
}

#[test]
fn probe_keeps_a_record_until_the_heartbeat_is_restored() {
    let node = NodeId::new(5).expect("a node-ID");
    let mut bus = bus_of("mh4", 0);
    let mut journal = KeptJournal::default();
    let mut master = Master::new(&mut bus, Timing::default());
    probe(&mut master, &Node::new(node), &mut journal).expect("the bus works");
    assert_eq!(journal.0, []);
    // Without a record nothing is written.
    let probed = probe(&mut master, &Node::new(node), &mut Full).expect("the bus works");
    assert!(probed.failure.is_some());
    drop(master);
    assert_eq!(heartbeat_time(&mut bus), 0);
}

#[test]
fn next_run_restores_changes_of_a_killed_one() {
    let node = NodeId::new(5).expect("a node-ID");
    let object = ObjectId::new(0x1017, 0);
    let left = |identity| {
        let (before, written) = (500u16.to_le_bytes().to_vec(), 100u16.to_le_bytes().to_vec());
        TemporaryWrite { node, identity, object, before, written }
    };
    let undo = |kind: &str, heartbeat: i64, write: TemporaryWrite| {
        let mut bus = bus_of(kind, heartbeat);
        let undone = write.undo(&mut Master::new(&mut bus, Timing::default())).expect("the bus works");
        (undone, heartbeat_time(&mut bus))
    };
    for kind in ["mh4", "dps"] {
        assert_eq!(undo(kind, 100, left([None; 4])), (Undone::Restored, 500), "{kind}");
        assert_eq!(undo(kind, 200, left([None; 4])), (Undone::ChangedSince, 200), "{kind}");
        assert_eq!(undo(kind, 100, left([Some(1), None, None, None])), (Undone::OtherDevice, 100), "{kind}");
    }
    let absent = TemporaryWrite { node: NodeId::new(9).expect("a node-ID"), ..left([None; 4]) };
    assert_eq!(undo("mh4", 100, absent), (Undone::NotRestored, 100));
}
