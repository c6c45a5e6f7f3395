//! `config apply` on the four devices: there and back, and with a fault at every write.

use super::pdo_map::{Fault, FaultyBus, is_write};
use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::{Bus, Event, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::device::catalog::by_name;
use cangauge::device::config_file::Document;
use cangauge::device::scalar::Scalar;
use cangauge::master::{Master, Timing};
use cangauge::node::Overrides;
use cangauge::output::config::write_toml;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Device, Setup};
use cangauge::tasks::config::{ApplyReport, Arrivals, File, Journal, Options, Sections, Snapshot, apply, read, resume};
use cangauge::tasks::restore::restore;
use cangauge::tasks::store::Group;
use cangauge::tasks::{Failure, Kind};
use std::time::Duration;

/// The node of `FaultyBus`.
const NODE: u8 = 5;

/// A device, and a file that changes every kind of its settings.
const DEVICES: [(&str, &str); 4] = [
    (
        "mh4",
        "[node]\nheartbeat = \"500ms\"\nemcy-inhibit-time = \"5ms\"\nstartup = \"auto\"\n[signal.pressure]\nunit = \"psi\"\n\
         digits = 2\nfilter = \"moving\"\nfilter-constant = 8\nlower = \"20 psi\"\nupper = \"2 bar\"\ndelta = 0.5\n\
         [signal.temperature]\nunit = \"K\"\nlower = \"300 K\"\nupper = \"40 degC\"\n[tpdo.1]\n\
         signals = [\"pressure\", \"temperature\"]\ntransmission = \"timer\"\nevent-timer = \"100ms\"\n\
         [tpdo.2]\nenabled = false\n",
    ),
    (
        "d20",
        "[node]\nguard-time = \"0ms\"\nheartbeat = \"250ms\"\n[signal.pressure]\nfilter-constant = 5\ndigits = 2\n\
         [tpdo.1]\nsignals = [\"pressure\"]\ntransmission = \"timer\"\nevent-timer = \"20ms\"\n[object]\n\
         maximum-allowed-pressure = \"20.5 bar\"\n",
    ),
    (
        "mc1609",
        "[node]\nheartbeat = \"500ms\"\n[signal.ch2]\nfilter = \"moving\"\nfilter-constant = 9\n[tpdo.3]\n\
         signals = [\"ch16\", \"ch1\"]\ntransmission = \"sync:3\"\nevent-timer = \"250ms\"\n[tpdo.4]\nenabled = false\n",
    ),
    (
        "dps",
        "[node]\nheartbeat = \"500ms\"\n[signal.pressure]\nunit = \"bar\"\nspan-end = \"5 bar\"\nspan-start = 1\n\
         [tpdo.1]\nevent-timer = \"40ms\"\ntransmission = \"sync:2\"\n",
    ),
];

/// A journal that outlives its program: the text of the old settings.
#[derive(Default)]
struct KeptJournal(Option<String>);

impl Journal for KeptJournal {
    fn begin(&mut self, before: &Snapshot) -> Result<(), Failure> {
        self.0.get_or_insert_with(|| text(before));
        Ok(())
    }

    fn finish(&mut self) {
        self.0 = None;
    }
}

fn node(number: u8) -> NodeId {
    NodeId::new(number).expect("a node-ID")
}

fn attach(bus: &mut MemoryBus, device: &str, number: u8, set: &[(&str, Scalar)], serial: Option<u32>) {
    let mut setup = Setup::new(by_name(device).expect("built in"), node(number));
    setup.set = set.iter().map(|(at, value)| (at.parse().expect("an object"), value.clone())).collect();
    setup.serial = serial.unwrap_or(setup.serial);
    bus.attach(Device::new(setup).expect("a device"));
}

fn bus(device: &str) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual);
    attach(&mut bus, device, NODE, &[], None);
    while bus.receive(Mono::at(Duration::from_millis(20))).expect("the bus works") != Event::Timeout {}
    bus
}

fn snapshot(bus: &mut dyn Bus, number: u8) -> Result<Snapshot, Failure> {
    let mut master = Master::new(bus, Timing::default());
    read(&mut master, node(number), &Overrides::new(), None)
}

/// The complete dump.
fn text(snapshot: &Snapshot) -> String {
    let mut text = Vec::new();
    write_toml(&snapshot.dump(false), &mut text).expect("memory");
    String::from_utf8(text).expect("text")
}

/// The dump without `[calibration]` and without the values that differ between devices of one kind.
fn dump(bus: &mut dyn Bus, number: u8) -> String {
    let text = text(&snapshot(bus, number).expect("read"));
    let text = text.split("\n[calibration]").next().unwrap_or_default().to_owned();
    let is_own = |line: &&str| !line.starts_with("node-id") && !line.starts_with("# revision");
    text.lines().filter(is_own).collect::<Vec<_>>().join("\n")
}

fn set(bus: &mut dyn Bus, number: u8, file: &str, options: &Options) -> Result<ApplyReport, Failure> {
    set_with(bus, number, file, options, &mut KeptJournal::default())
}

fn set_with(
    bus: &mut dyn Bus,
    number: u8,
    file: &str,
    options: &Options,
    journal: &mut KeptJournal,
) -> Result<ApplyReport, Failure> {
    let mut document = Document::parse(file).expect("TOML");
    if let Some(before) = &journal.0 {
        resume(&mut document, &Document::parse(before).expect("TOML"));
    }
    let mut master = Master::new(bus, Timing { timeout: Duration::from_millis(100), retries: 1 });
    let now = read(&mut master, node(number), &Overrides::new(), Some(&File::Settings(document.clone())))?;
    let file = now.check(&document).unwrap_or_else(|mistakes| panic!("{mistakes:?}"));
    apply(&mut master, now, &file, options, &Overrides::new(), journal)
}

fn stored() -> Options {
    Options { store: true, reset: false, ..Options::default() }
}

#[test]
fn dump_defaults_apply_dump_is_the_same_file() {
    for (device, file) in DEVICES {
        let mut bus = bus(device);
        let delivered = dump(&mut bus, NODE);
        set(&mut bus, NODE, file, &stored()).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        let wanted = dump(&mut bus, NODE);
        assert_ne!(wanted, delivered, "{device}");
        let before = snapshot(&mut bus, NODE).expect("read").node;
        let mut master = Master::new(&mut bus, Timing::default());
        restore(&mut master, &before, Group::All, true).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        drop(master);
        assert_ne!(dump(&mut bus, NODE), wanted, "{device}");
        set(&mut bus, NODE, &wanted, &stored()).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        assert_eq!(dump(&mut bus, NODE), wanted, "{device}");
        let again = set(&mut bus, NODE, &wanted, &Options::default()).expect("nothing to do");
        assert_eq!(again.rows, [], "{device}");
    }
}

#[test]
fn a_replacement_gets_all_settings_except_the_calibration() {
    let offsets = [("mh4", "0x6127:1"), ("d20", "0x6124:1"), ("dps", "0x6124:1")];
    for (device, file) in DEVICES {
        let mut old = bus(device);
        set(&mut old, NODE, file, &stored()).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        let wanted = dump(&mut old, NODE);
        let mut new = MemoryBus::new(Clock::Virtual);
        let offset = offsets.iter().find(|(name, _)| *name == device);
        let value = if device == "dps" { Scalar::Integer(3) } else { Scalar::Real(0.25) };
        let values: Vec<(&str, Scalar)> = offset.map(|(_, object)| (*object, value)).into_iter().collect();
        attach(&mut new, device, 9, &values, Some(77));
        let before = snapshot(&mut new, 9).expect("read");
        set(&mut new, 9, &wanted, &stored()).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        assert_eq!(dump(&mut new, 9), wanted, "{device}");
        let after = snapshot(&mut new, 9).expect("read");
        let own = |snapshot: &Snapshot| -> Vec<_> {
            let rows = snapshot.dump(false).rows.into_iter();
            rows.filter(|row| row.key.ends_with(".offset") && device == "d20").map(|row| row.value).collect()
        };
        assert_eq!(own(&before), own(&after), "{device}: the offset is that of the new device");
    }
}

/// A fault at every write, three of seven kinds in turn. After a reported success the device has the wanted state.
/// After a failure the second run reaches it.
#[test]
fn an_interrupted_apply_is_completed_by_the_next_one() {
    let refusal = Fault::Refuse(0x0800_0000);
    let faults =
        [refusal, Fault::LoseRequest, Fault::LoseAnswer, Fault::Interrupt, Fault::ResetBefore, Fault::ResetAfter];
    let away = Fault::Away(Duration::from_secs(2));
    for (device, file) in DEVICES {
        let mut clean = FaultyBus::new(bus(device), Fault::None, 0);
        set(&mut clean, NODE, file, &Options::default()).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        let wanted = dump(&mut clean.bus, NODE);
        let writes: Vec<usize> = (0..clean.sent.len()).filter(|at| is_write(&clean.sent[*at])).collect();
        assert!(writes.len() > 3, "{device}");
        for (turn, at) in writes.into_iter().enumerate() {
            for fault in faults.into_iter().chain([away]).cycle().skip(3 * turn).take(3) {
                let case = format!("{device} {fault:?} at {at}: {}", clean.sent[at]);
                let mut faulty = FaultyBus::new(bus(device), fault, at);
                let result = set(&mut faulty, NODE, file, &Options::default());
                let mut bus = faulty.bus;
                // The device boots, and late answers arrive.
                let until = Mono::at(bus.now().mono.since_start() + Duration::from_secs(3));
                while bus.receive(until).expect("the bus works") != Event::Timeout {}
                match &result {
                    Ok(_) => assert_eq!(dump(&mut bus, NODE), wanted, "{case}: reported as done"),
                    Err(failure) => {
                        assert_ne!(failure.kind(), Kind::Usage, "{case}");
                        assert!(!ErrorMessage::of(failure).message.is_empty(), "{case}");
                    }
                }
                set(&mut bus, NODE, file, &Options::default()).unwrap_or_else(|failure| panic!("{case}: {failure}"));
                assert_eq!(dump(&mut bus, NODE), wanted, "{case}");
            }
        }
    }
}

/// The program is killed before each frame that changes the device. The next run reaches the wanted state, and a
/// rollback the old one.
#[test]
fn a_killed_apply_is_completed_or_rolled_back() {
    // A range is a condition, not a setting. The conversion to another unit and back may round it.
    let settings = |bus: &mut MemoryBus| dump(bus, NODE).split_once("\n[address]").map(|(_, text)| text.to_owned());
    let changes = |frame: &Frame| is_write(frame) || frame.id() == CanId::NMT;
    for (device, file) in DEVICES {
        // The DPS does not store its TPDO settings.
        for options in [Options::default(), Options { reset: device != "dps", ..stored() }] {
            let mut clean = FaultyBus::new(bus(device), Fault::None, 0);
            let old = settings(&mut clean.bus);
            set(&mut clean, NODE, file, &options).unwrap_or_else(|failure| panic!("{device}: {failure}"));
            let wanted = settings(&mut clean.bus);
            let frames = clean.sent.iter().enumerate().filter(|(_, frame)| changes(frame));
            let frames = frames.skip_while(|(_, frame)| !is_write(frame));
            // The frames before the store are those of the run without a store.
            let stores = |frame: &Frame| frame.data().starts_with(&[0x23, 0x10, 0x10]);
            for (at, frame) in frames.skip_while(|(_, frame)| options.store && !stores(frame)) {
                let case = format!("{device} killed before {at}: {frame}");
                // The MH-4 has every kind of setting. The other devices alternate.
                for rolls_back in [false, true].into_iter().filter(|back| device == "mh4" || *back == (at % 2 == 0)) {
                    let mut journal = KeptJournal::default();
                    let mut killed = FaultyBus::new(bus(device), Fault::Gone, at);
                    set_with(&mut killed, NODE, file, &options, &mut journal).expect_err(&case);
                    let mut bus = killed.bus;
                    if rolls_back {
                        let before = journal.0.clone().unwrap_or_else(|| panic!("{case}: no journal"));
                        let sections = Sections { address: false, calibration: true };
                        let options = Options { sections, ..options.clone() };
                        set_with(&mut bus, NODE, &before, &options, &mut journal)
                            .unwrap_or_else(|failure| panic!("{case}: rollback: {failure}"));
                        assert_eq!(settings(&mut bus), old, "{case}");
                    } else {
                        set_with(&mut bus, NODE, file, &options, &mut journal)
                            .unwrap_or_else(|failure| panic!("{case}: again: {failure}"));
                        assert_eq!(settings(&mut bus), wanted, "{case}");
                    }
                    assert_eq!(journal.0, None, "{case}: the journal is removed after success");
                }
            }
        }
    }
}

#[test]
fn an_address_is_set_last_and_confirmed() {
    for (device, new) in [("mh4", 12), ("dps", 13)] {
        let mut bus = bus(device);
        let file =
            format!("[address]\nnode-id = {new}\n[node]\nheartbeat = \"500ms\"\n[tpdo.1]\nevent-timer = \"60ms\"\n");
        let options =
            Options { sections: Sections { address: true, calibration: false }, store: true, ..Options::default() };
        let applied = set(&mut bus, NODE, &file, &options).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        assert_eq!(applied.after.node.id, node(new), "{device}");
        let again = set(&mut bus, new, &file, &options).unwrap_or_else(|failure| panic!("{device}: {failure}"));
        assert_eq!(again.rows, [], "{device}");
    }
}

/// Devices are connected one after the other. Only the new device is found. Two new devices are both reported.
#[test]
fn devices_that_are_plugged_in_are_found_one_by_one() {
    let mut bus = bus("d20");
    for (number, serial, from, until) in [(1, 71, 4, 8), (2, 72, 30, 60), (3, 73, 30, 45)] {
        let mut setup = Setup::new(by_name("mh4").expect("built in"), node(number));
        setup.serial = serial;
        setup.oddities.connected = Some(Duration::from_secs(from)..Duration::from_secs(until));
        bus.attach(Device::new(setup).expect("a device"));
    }
    let mut master = Master::new(&mut bus, Timing::default());
    let (mut arrivals, mut seen) = (Arrivals::default(), Vec::new());
    while master.now() < Mono::at(Duration::from_secs(80)) {
        let found = arrivals.search(&mut master).expect("the bus works");
        let serials: Vec<u32> = found.iter().filter_map(|one| Some(one.address?.serial)).collect();
        if seen.last() != Some(&serials) {
            seen.push(serials);
        }
        if let [only] = &found[..] {
            while !arrivals.is_unplugged(&mut master, only).expect("the bus works") {}
        }
    }
    assert_eq!(seen, [vec![], vec![71], vec![], vec![72, 73], vec![72], vec![]]);
}
