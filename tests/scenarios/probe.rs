//! `nmt state --probe` switches the heartbeat on for a moment. Ctrl-C at any time restores 1017h.

use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::{BitRateControl, Bus, BusError, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::device::catalog;
use cangauge::device::scalar::Scalar;
use cangauge::master::{Error, Master, Timing};
use cangauge::node::Node;
use cangauge::sim::{Device, Setup};
use cangauge::tasks::journal::{Journal, JournalError, NoJournal, TemporaryWrite, UndoResult};
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
    // cannot be interrupted any more: 1017h is written and read back.
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

/// Sets bit 4 of the heartbeat time in the writes with these numbers, as a disturbed wire does.
struct Flipping<B> {
    bus: B,
    writes: u32,
    flipped: std::ops::Range<u32>,
}

impl<B: Bus> Bus for Flipping<B> {
    cangauge::bus::delegate_bus!(self, self.bus => name timestamps is_live sends_remote_frames waits now mono listen receive
        receive_buffer unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let mut data = frame.data().to_vec();
        if let [0x20..0x40, 0x17, 0x10, 0, low, ..] = &mut data[..] {
            *low |= if self.flipped.contains(&self.writes) { 0x10 } else { 0 };
            self.writes += 1;
        }
        self.bus.send(&Frame::new(frame.id(), &data).expect("a frame"))
    }
}

impl<B: Bus> BitRateControl for Flipping<B> {
    cangauge::bus::delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

/// The first write sets the heartbeat of the probe, the following ones restore it.
#[test]
fn heartbeat_is_restored_again_after_a_wrong_write() {
    let node = NodeId::new(5).expect("a node-ID");
    for (flipped, left) in [(1..2, None), (1..6, None), (1..99, Some((16, true)))] {
        let mut bus = Flipping { bus: bus_of("mh4", 0), writes: 0, flipped: flipped.clone() };
        let mut journal = KeptJournal::default();
        let probed =
            probe(&mut Master::new(&mut bus, Timing::default()), &Node::new(node), &mut journal).expect("a bus");
        assert_eq!(probed.left.map(|left| (left.milliseconds, left.is_certain)), left, "{flipped:?}");
        assert_eq!((probed.failure.is_some(), journal.0.len()), (left.is_some(), usize::from(left.is_some())));
        assert_eq!(heartbeat_time(&mut bus.bus), left.map_or(0, |(left, _)| left), "{flipped:?}");
    }
    // The restore by the next run is read back, too.
    let write = TemporaryWrite {
        node,
        identity: [None; 4],
        object: ObjectId::new(0x1017, 0),
        before: vec![0, 0],
        written: vec![100, 0],
    };
    for (flipped, expected) in [(1..1, UndoResult::Restored), (0..1, UndoResult::NotRestored)] {
        let mut bus = Flipping { bus: bus_of("mh4", 100), writes: 0, flipped };
        assert_eq!(write.undo(&mut Master::new(&mut bus, Timing::default())).expect("a bus"), expected);
    }
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
        assert_eq!(undo(kind, 100, left([None; 4])), (UndoResult::Restored, 500), "{kind}");
        assert_eq!(undo(kind, 200, left([None; 4])), (UndoResult::ChangedSince, 200), "{kind}");
        assert_eq!(undo(kind, 100, left([Some(1), None, None, None])), (UndoResult::OtherDevice, 100), "{kind}");
    }
    let absent = TemporaryWrite { node: NodeId::new(9).expect("a node-ID"), ..left([None; 4]) };
    assert_eq!(undo("mh4", 100, absent), (UndoResult::NotRestored, 100));
}
