//! Node-ID and bit rate. After any fault no other device is changed, a reported success is the real state of the
//! device, and no device stays in configuration state.

mod faults;
mod interrupted;
mod retime;
mod targets;

use cangauge::bus::memory::MemoryBus;
use cangauge::canopen::id::NodeId;
use cangauge::master::{Master, OnTwoDevices, Timing};
use cangauge::node::Overrides;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes;
use cangauge::sim::{Bench, Device};
use cangauge::tasks::lss::{Assigned, Descriptions, Job, RequestedRate, Via, assign};
use cangauge::tasks::{Failure, Kind, Note};
use std::path::Path;

fn bus(toml: &str) -> MemoryBus {
    Bench::from_toml(&format!("clock = \"virtual\"\n{toml}"), Path::new("")).unwrap().open().unwrap()
}

fn node(id: u8) -> NodeId {
    NodeId::new(id).unwrap()
}

/// Node-ID and bit rate of a device, now and after a power cycle.
type Snapshot = (Option<u8>, Option<u32>, Option<u8>, Option<u32>);

fn snapshot(device: &Device) -> Snapshot {
    let number = |node: Option<NodeId>| node.map(NodeId::get);
    let (stored, rate) = device.stored();
    (number(device.node()), device.bit_rate(), number(stored), rate)
}

fn all_snapshots(bus: &MemoryBus) -> Vec<Snapshot> {
    bus.stations::<Device>().map(snapshot).collect()
}

/// The result of a job, and its notes.
struct Done {
    result: Result<Assigned, Failure>,
    notes: Vec<Note>,
}

impl Done {
    #[track_caller]
    fn failure(&self) -> (Kind, String) {
        let failure = self.result.as_ref().expect_err("it succeeded");
        (failure.kind(), ErrorMessage::of(failure).message)
    }

    fn warns(&self, of: &str) -> bool {
        self.notes.iter().any(|note| note.fact.is_warning() && notes::note(note).message.contains(of))
    }
}

#[derive(Default)]
struct Wanted {
    id: Option<u8>,
    rate: Option<RequestedRate>,
    retime: bool,
    no_store: bool,
    force: bool,
    via: Via,
    device: Option<&'static str>,
}

#[track_caller]
fn run(bus: &mut MemoryBus, target: &str, wanted: &Wanted) -> Done {
    let overrides = Overrides::new();
    let given = wanted.device.map(|name| cangauge::device::catalog::by_name(name).unwrap());
    let job = Job {
        target: target.parse().unwrap(),
        id: wanted.id.map(node),
        rate: wanted.rate,
        store: !wanted.no_store,
        retime: wanted.retime,
        via: wanted.via,
        force: wanted.force,
        descriptions: Descriptions { overrides: &overrides, given: given.as_ref() },
    };
    let mut notes = Vec::new();
    let mut master = Master::new(bus, Timing::default());
    master.set_on_two_devices(OnTwoDevices::RefuseWrites);
    let result = assign(&mut master, &job, &mut |note| notes.push(note));
    master.settle();
    // The last frames arrive.
    let until = master.now() + std::time::Duration::from_millis(20);
    while !matches!(master.next(until), Ok(cangauge::master::MasterEvent::Deadline) | Err(_)) {}
    drop(master);
    assert!(!bus.stations::<Device>().any(Device::is_configuring), "left in configuration state: {result:?}");
    Done { result, notes }
}

fn id(id: u8) -> Wanted {
    Wanted { id: Some(id), ..Wanted::default() }
}
