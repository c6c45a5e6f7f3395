//! `pdo map` on devices that differ from the four simulated ones: bit 31 is rejected, the mapping is fixed, there is an
//! inhibit time, a TPDO has no identifier, the width of an object is unknown.

use super::pdo_map::{Fault, FaultyBus};
use super::probe::KeptJournal;
use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::pdo::TpdoNumber;
use cangauge::device::catalog::Model;
use cangauge::master::{Master, Timing};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes::note;
use cangauge::sim::{Device, Setup, State};
use cangauge::tasks::journal::{NoJournal, UndoResult};
use cangauge::tasks::pdo::{Item, MapReport, PdoRequest, Trigger, map};
use cangauge::tasks::{Failure, Kind};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A transmitter with one channel. `pdo` is its remapping method, `parameters` are its objects 1800h and 1A00h.
fn description(pdo: &str, parameters: &str) -> Arc<Model> {
    let text = format!(
        r#"
        name = "other"
        title = "a device of the tests"
        vendor = "none"
        source = "none"
        identify = {{ device_type = 0x00020194 }}
        {pdo}
        object = [
            {{ at = "0x1000", name = "device-type", type = "u32", access = "ro", default = 0x00020194 }},
            {{ at = "0x2000", name = "own", type = "u16", access = "ro", default = 7, pdo = true }},
            {{ at = "0x6130:0", name = "pv-entries", type = "u8", access = "ro", default = 1 }},
            {{ at = "0x6130:1-1", name = "pv", type = "r32", access = "ro", default = 1.0, pdo = true }},
            {{ at = "0x6150:1-1", name = "status", type = "u8", access = "ro", default = 0, pdo = true }},
            {parameters}
        ]
    "#
    );
    Arc::new(Model::from_toml(&text).unwrap())
}

fn parameter(at: &str, data_type: &str, more: &str) -> String {
    let name: String = at.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
    format!("{{ at = \"{at}\", name = \"p{name}\", type = \"{data_type}\", access = \"rw\", {more} }},\n")
}

/// The usual parameters. `cob_id` has the default and the limits of the COB-ID.
fn parameters(cob_id: &str) -> String {
    [
        parameter("0x1800:1", "u32", cob_id),
        parameter("0x1800:2", "u8", "default = 254"),
        parameter("0x1800:3", "u16", "default = 0"),
        parameter("0x1800:5", "u16", "default = 100"),
        parameter("0x1A00:0", "u8", "default = 1, high = 4"),
        parameter("0x1A00:1", "u32", "default = 0x61300120"),
        parameter("0x1A00:2", "u32", "default = 0"),
    ]
    .concat()
}

fn node() -> NodeId {
    NodeId::new(9).unwrap()
}

fn request(items: &[&str]) -> PdoRequest {
    let item = |text: &&str| match text.parse() {
        Ok(object) => Item::Object(object, None),
        Err(_) => Item::Name((*text).to_owned(), None),
    };
    PdoRequest {
        node: node(),
        number: TpdoNumber::new(1).unwrap(),
        items: items.iter().map(item).collect(),
        trigger: None,
        event_timer_ms: None,
        inhibit_100us: None,
        cob_id: None,
    }
}

struct Bench {
    bus: MemoryBus,
    model: Arc<Model>,
}

impl Bench {
    fn new(model: Arc<Model>) -> Bench {
        let mut setup = Setup::new(Arc::clone(&model), node());
        setup.start = true;
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Device::new(setup).unwrap());
        Bench { bus, model }
    }

    /// Maps, with or without the description.
    fn map(&mut self, request: &PdoRequest, described: bool) -> Result<MapReport, Failure> {
        let given = described.then(|| (node(), Arc::clone(&self.model)));
        let overrides: BTreeMap<_, _> = given.into_iter().collect();
        map(&mut Master::new(&mut self.bus, Timing::default()), request, false, &overrides, &mut NoJournal)
    }

    fn number(&mut self, object: &str) -> u32 {
        let object: ObjectId = object.parse().unwrap();
        let device: &mut Device = self.bus.stations_mut().next().unwrap();
        let bytes = device.value(object, cangauge::bus::Mono::START).unwrap();
        bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte))
    }

    fn state(&self) -> Option<State> {
        self.bus.stations::<Device>().next().unwrap().state()
    }
}

#[test]
fn device_that_rejects_bit_31_is_mapped_without_it() {
    let refuses_31 = parameters("default = \"$NODEID+0x180\", allow = [\"0-0x7FFFFFFF\"]");
    let mut bench = Bench::new(description("pdo = { remap = \"count-only\" }", &refuses_31));
    let mapped = bench.map(&request(&["ch1", "ch1.status"]), false).unwrap();
    assert_eq!(mapped.writes, 4);
    let warning = "write 0x1800:1: refused by the device (0x06090030, value outside its range): TPDO1 was changed while \
                   it was on";
    assert_eq!(note(&mapped.notes[0]).message, warning);
    // The device has neither heartbeat nor guarding, so its state is unknown and is not guessed.
    let message = note(&mapped.notes[1]).message;
    assert!(message.contains("stays there: its previous state is unknown"), "{message}");
    assert_eq!((bench.number("1A00:0"), bench.number("1A00:2")), (2, 0x6150_0108));
    assert_eq!(bench.state(), Some(State::PreOperational));
    // If the device accepts bit 31 according to its description, a rejection is an error.
    let mut bench = Bench::new(description("", &refuses_31));
    let failure = bench.map(&request(&["ch1", "ch1.status"]), true).unwrap_err();
    assert_eq!((failure.kind(), bench.number("1A00:0")), (Kind::Refused, 1));
    assert_eq!(bench.state(), Some(State::Operational));
}

#[test]
fn fixed_mapping_accepts_only_itself() {
    let fixed = parameters("default = \"$NODEID+0x40000180\"");
    let fixed = fixed
        .lines()
        .map(|line| if line.contains("1A00") { line.replace("\"rw\"", "\"const\"") } else { line.to_owned() })
        .collect::<Vec<_>>()
        .join("\n");
    for described in [true, false] {
        let mut bench = Bench::new(description("", &fixed));
        assert_eq!(bench.map(&request(&["0x6130:1"]), described).unwrap().writes, 0);
        let failure = bench.map(&request(&["0x6130:1", "0x6150:1"]), described).unwrap_err();
        assert_eq!(failure.kind(), Kind::Refused);
        if described {
            let message = "node 9: the mapping of TPDO1 is fixed (0x6130:1/32): nothing was changed";
            assert_eq!(ErrorMessage::of(&failure).message, message);
        } else {
            let message = "node 9: write 0x1A00:0 (0 entries): refused by the device (0x06010002, the object is \
                           read-only); TPDO1 has its old mapping and parameters";
            assert_eq!(ErrorMessage::of(&failure).message, message);
        }
        assert_eq!(bench.number("1800:1"), 0x4000_0189);
        // Parameters that are not fixed can still be set.
        let mapped = bench.map(&PdoRequest { trigger: Some(Trigger::Code(1)), ..request(&[]) }, described).unwrap();
        assert_eq!((mapped.writes, bench.number("1800:2")), (1, 1));
    }
}

#[test]
fn inhibit_time_is_written_while_the_pdo_is_off() {
    let mut bench = Bench::new(description("", &parameters("default = \"$NODEID+0x180\"")));
    let inhibited = PdoRequest { inhibit_100us: Some(25), ..request(&[]) };
    assert_eq!(bench.map(&inhibited, false).unwrap().writes, 3);
    assert_eq!((bench.number("1800:3"), bench.number("1800:1")), (25, 0x189));
    assert_eq!(bench.map(&inhibited, false).unwrap().writes, 0);
}

/// The program is killed at each write of `pdo map --inhibit`. The next command switches the TPDO on again.
#[test]
fn killed_change_of_the_inhibit_time_leaves_the_pdo_on() {
    let new = || Bench::new(description("", &parameters("default = \"$NODEID+0x180\"")));
    let inhibited = PdoRequest { inhibit_100us: Some(25), ..request(&[]) };
    let is_write = |frame: &&Frame| frame.id() == CanId::sdo_request(node()) && frame.data()[0] >> 5 == 1;
    let run = |bus: &mut FaultyBus, journal: &mut KeptJournal| {
        map(&mut Master::new(bus, Timing::default()), &inhibited, false, &BTreeMap::new(), journal)
    };
    let mut clean = FaultyBus::new(new().bus, Fault::None, 0);
    let mut kept = KeptJournal::default();
    assert_eq!((run(&mut clean, &mut kept).unwrap().writes, kept.0.len()), (3, 0));
    let writes = clean.sent.iter().enumerate().filter(|(_, frame)| is_write(frame)).map(|(at, _)| at);
    for (at, undone) in writes.zip([UndoResult::ChangedSince, UndoResult::Restored, UndoResult::Restored]) {
        let mut bench = new();
        let mut killed = FaultyBus::new(bench.bus, Fault::Gone, at);
        let mut kept = KeptJournal::default();
        run(&mut killed, &mut kept).expect_err("the device does not answer");
        bench.bus = killed.bus;
        let [write] = &kept.0[..] else { panic!("{} records", kept.0.len()) };
        assert_eq!(write.undo(&mut Master::new(&mut bench.bus, Timing::default())).unwrap(), undone, "at {at}");
        assert_eq!(bench.number("1800:1"), 0x189, "at {at}");
        bench.map(&inhibited, false).unwrap();
        assert_eq!((bench.number("1800:3"), bench.number("1800:1")), (25, 0x189));
    }
}

#[test]
fn tpdo_without_identifier_is_not_switched_on() {
    let mut bench = Bench::new(description("", &parameters("default = 0x80000000")));
    let failure = bench.map(&request(&["ch1.status"]), false).unwrap_err();
    assert_eq!(
        (failure.kind(), ErrorMessage::of(&failure).message.as_str()),
        (Kind::Usage, "node 9: TPDO1 has no identifier yet (0x000)")
    );
    assert_eq!((bench.number("1A00:1"), bench.number("1800:1")), (0x6130_0120, 0x8000_0000));
    // Parameters alone leave the TPDO off. With --cob-id it is switched on.
    bench.map(&PdoRequest { event_timer_ms: Some(20), ..request(&[]) }, false).unwrap();
    assert_eq!((bench.number("1800:5"), bench.number("1800:1")), (20, 0x8000_0000));
    let mapped = bench.map(&PdoRequest { cob_id: Some(0x3a5), ..request(&["ch1.status"]) }, false).unwrap();
    assert_eq!((mapped.shown.settings.cob_id.0, bench.number("1800:1")), (0x3a5, 0x3a5));
}

#[test]
fn unknown_width_is_read_from_the_device() {
    let mut bench = Bench::new(description("", &parameters("default = \"$NODEID+0x180\"")));
    bench.map(&request(&["0x2000", "ch1"]), false).unwrap();
    assert_eq!((bench.number("1A00:1"), bench.number("1A00:2")), (0x2000_0010, 0x6130_0120));
    let failure = bench.map(&request(&["0x3000"]), false).unwrap_err();
    assert_eq!(
        ErrorMessage::of(&failure).message,
        "node 9: read 0x3000:0: refused by the device (0x06020000, the object does not exist)"
    );
    let failure = bench.map(&request(&["ch1", "0x2000", "0x2000", "ch1.status"]), false).unwrap_err();
    assert_eq!(
        (failure.kind(), ErrorMessage::of(&failure).message.as_str()),
        (Kind::Usage, "node 9: the mapping has 9 bytes; a PDO has at most 8 bytes")
    );
    let failure = bench.map(&request(&["ch2"]), false).unwrap_err();
    assert_eq!(
        (failure.kind(), ErrorMessage::of(&failure).message.as_str()),
        (Kind::Usage, "node 9: no object or signal \"ch2\"")
    );
}
