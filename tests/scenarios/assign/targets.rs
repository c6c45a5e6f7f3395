//! The named device is changed, and no other.

use super::{Wanted, all_snapshots, bus, id, node, run};
use cangauge::bus::Bus;
use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::device::assign::short_bit_rate;
use cangauge::master::{Master, Timing};
use cangauge::node::Overrides;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Device, State};
use cangauge::tasks::Kind;
use cangauge::tasks::lss::{Confirmed, Descriptions, Job, RequestedRate, Target, Via, assign, store};
use std::collections::BTreeSet;
use std::time::Duration;

const ALL: &str = "device = [
    { kind = 'mh4', node = 1 }, { kind = 'd20', node = 2 }, { kind = 'mc1609', node = 3 }, { kind = 'dps', node = 127 },
]";

const DUPLICATES: &str = "device = [
    { kind = 'dps', node = 5, serial = 100, duplicate_id = true }, { kind = 'dps', node = 5, serial = 200, duplicate_id = true },
    { kind = 'mh4', node = 6 },
]";

#[test]
fn each_kind_by_its_node_id_among_all() {
    for (place, old) in [(0, 1), (1, 2), (2, 3), (3, 127)] {
        let mut bus = bus(ALL);
        let mut expected = all_snapshots(&bus);
        let done = run(&mut bus, &old.to_string(), &id(20));
        let report = done.result.unwrap();
        assert_eq!((report.confirmed, report.stored), (Confirmed::BootUp, true), "{old}");
        (expected[place].0, expected[place].2) = (Some(20), Some(20));
        assert_eq!(all_snapshots(&bus), expected, "{old}");
    }
}

#[test]
fn each_kind_by_its_identity_among_all() {
    for (place, old) in [(0, 1), (1, 2), (2, 3), (3, 127)] {
        let mut bus = bus(ALL);
        let mut expected = all_snapshots(&bus);
        let address = run(&mut bus, &old.to_string(), &id(old)).result.unwrap().address.unwrap();
        let done = run(&mut bus, &address.to_string(), &id(20));
        let report = done.result.unwrap_or_else(|failure| panic!("{old}: {failure}"));
        assert_eq!((report.confirmed, report.old.map(|old| old.get())), (Confirmed::BootUp, Some(old)));
        (expected[place].0, expected[place].2) = (Some(20), Some(20));
        assert_eq!(all_snapshots(&bus), expected, "{old}");
    }
}

#[test]
fn taken_node_id_is_rejected() {
    let mut bus = bus(ALL);
    let before = all_snapshots(&bus);
    for target in ["1", "0x362:0x443150:0x10000:20002"] {
        let done = run(&mut bus, target, &id(3));
        assert_eq!(done.failure().0, Kind::CheckFailed, "{target}");
        assert!(done.failure().1.contains("node-ID 3 is taken"), "{}", done.failure().1);
    }
    assert_eq!(all_snapshots(&bus), before);
}

#[test]
fn lost_frame_does_not_make_a_node_id_free() {
    let bench = "device = [{ kind = 'mh4', node = 5 }, { kind = 'dps', node = 12 }]";
    let overrides = Overrides::new();
    let job = Job {
        target: "5".parse().unwrap(),
        id: Some(node(12)),
        rate: None,
        store: true,
        retime: false,
        via: Via::Auto,
        force: false,
        descriptions: Descriptions { overrides: &overrides, given: None },
    };
    // More than the frames of the whole job.
    for lost in 0..150 {
        let mut bus = Faulty::new(bus(bench), FaultPlan { lose: BTreeSet::from([lost]), ..FaultPlan::default() });
        let before = all_snapshots(bus.inner());
        let result = assign(&mut Master::new(&mut bus, Timing::default()), &job, &mut |_| {});
        assert!(result.is_err(), "{lost}");
        assert_eq!(all_snapshots(bus.inner()), before, "{lost}");
    }
}

/// Two devices with one node-ID that answer alternately, with different serial numbers.
#[derive(Default)]
struct AlternatingDevices {
    reads: u8,
}

impl Station for AlternatingDevices {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        if let ("605", [0x40, a, b, sub, ..]) = (&*frame.id().to_string(), frame.data()) {
            self.reads += u8::from(*sub == 4);
            let number = if *sub == 4 { self.reads } else { *sub };
            out.send(format!("585#43{a:02X}{b:02X}{sub:02X}{number:02X}000000").parse().unwrap());
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn answers_that_differ_show_two_devices() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 6 }]");
    bus.attach(AlternatingDevices::default());
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::CheckFailed);
    assert!(done.failure().1.contains("its answers to the same request differ"), "{}", done.failure().1);
}

/// Another master reads node 5: these frames are sent from 20 ms on, one every millisecond.
struct OtherMaster(&'static [&'static str], u64);

impl Station for OtherMaster {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, _: Mono, out: &mut Outbox) {
        out.send(self.0[0].parse().unwrap());
        (self.0, self.1) = (&self.0[1..], self.1 + 1);
    }

    fn next_wake(&self) -> Option<Mono> {
        (!self.0.is_empty()).then(|| Mono::at(Duration::from_millis(self.1)))
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn traffic_of_another_master_is_no_second_device() {
    // Its answers alone (its requests were sent before) prove nothing; its requests are reported.
    for (frames, expected) in [
        (&["585#4B17100000000000"][..], None),
        (&["585#4300200012345678", "585#0000000000000000"], None),
        (&["605#4017100000000000"], Some("another master sends requests to it")),
        (&["605#4018100100000000"], Some("another master sends requests to it")),
    ] {
        let mut bus = bus("device = [{ kind = 'mh4', node = 5 }]");
        bus.attach(OtherMaster(frames, 20));
        let done = run(&mut bus, "5", &id(12));
        let message = done.result.as_ref().err().map(|failure| ErrorMessage::of(failure).message).unwrap_or_default();
        assert!(!message.contains("several devices"), "{frames:?}: {message}");
        assert!(expected.is_none_or(|text| message.contains(text)), "{frames:?}: {message}");
    }
}

#[test]
fn node_id_of_a_stopped_node_with_heartbeat_is_taken() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 1 }, { kind = 'mh4', node = 7, set = { '0x1017' = 1000 } }]");
    let mut master = cangauge::master::Master::new(&mut bus, cangauge::master::Timing::default());
    master.send("000#0207".parse().unwrap());
    master.settle();
    drop(master);
    let done = run(&mut bus, "1", &id(7));
    assert!(done.failure().1.contains("(a node sends heartbeats)"), "{:?}", done.failure());
}

#[test]
fn two_devices_with_one_node_id() {
    let mut bus = bus(DUPLICATES);
    let before = all_snapshots(&bus);
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::CheckFailed);
    assert!(done.failure().1.contains("several devices probably have this node-ID"), "{}", done.failure().1);
    assert!(ErrorMessage::of(&done.result.unwrap_err()).hint.unwrap().contains("VENDOR:PRODUCT:REVISION:SERIAL"));
    assert_eq!(all_snapshots(&bus), before);
    // One of them is addressed by its identity. It is not reset, so this is not a success yet.
    let done = run(&mut bus, "0x362:0x443150:0x10000:200", &id(12));
    assert_eq!(done.failure().0, Kind::Unexpected);
    assert!(done.failure().1.contains("not reset") && done.failure().1.contains("stored"), "{}", done.failure().1);
    let mut expected = before;
    expected[1].2 = Some(12);
    assert_eq!(all_snapshots(&bus), expected);
    bus.power_cycle();
    expected[1].0 = Some(12);
    assert_eq!(all_snapshots(&bus), expected);
}

#[test]
fn one_of_two_with_one_node_id_is_not_reset() {
    let twins = "device = [
        { kind = 'mh4', node = 5, serial = 100, duplicate_id = true }, { kind = 'mh4', node = 5, serial = 200, duplicate_id = true },
    ]";
    let mut bus = bus(twins);
    let mut expected = all_snapshots(&bus);
    let done = run(&mut bus, "0x47:1:1:200", &id(12));
    assert_eq!(done.failure().0, Kind::Unexpected);
    assert!(done.failure().1.contains("another device also has node-ID 5"), "{}", done.failure().1);
    assert!(done.warns("so it is not sent"), "{:?}", done.notes);
    // A reset would restart the other device as well.
    expected[1].2 = Some(12);
    assert_eq!(all_snapshots(&bus), expected);
}

#[test]
fn unconfigured_devices_one_after_the_other() {
    let mut bus =
        bus("device = [{ kind = 'mh4', serial = 9 }, { kind = 'mh4', node = 6 }, { kind = 'mh4', serial = 4 }]");
    let mut expected = all_snapshots(&bus);
    for (place, new) in [(2, 20), (0, 21)] {
        let done = run(&mut bus, "unconfigured", &id(new));
        let report = done.result.unwrap_or_else(|failure| panic!("{new}: {failure}"));
        assert_eq!((report.confirmed, report.old), (Confirmed::BootUp, None));
        (expected[place].0, expected[place].2) = (Some(new), Some(new));
        assert_eq!(all_snapshots(&bus), expected);
    }
    let done = run(&mut bus, "unconfigured", &id(22));
    assert_eq!(done.failure().0, Kind::NoAnswer);
    assert_eq!(all_snapshots(&bus), expected);
}

#[test]
fn only_changes_the_sole_device() {
    for kind in ["mh4", "d20", "mc1609", "dps"] {
        let mut bus = bus(&format!("device = [{{ kind = '{kind}', node = 5 }}]"));
        let done = run(&mut bus, "only", &id(12));
        // DPS supports neither inquiry nor identify; D-20-9 answers in STOPPED only.
        assert_eq!(done.warns("does not support"), matches!(kind, "dps" | "d20"), "{kind} {:?}", done.notes);
        let report = done.result.unwrap_or_else(|failure| panic!("{kind}: {failure}"));
        assert_eq!(report.confirmed, Confirmed::BootUp, "{kind}");
        assert_eq!(all_snapshots(&bus)[0].2, Some(12), "{kind}");
    }
}

#[test]
fn only_is_rejected_if_another_device_is_found() {
    let two = [
        "device = [{ kind = 'mh4', node = 5 }, { kind = 'dps', node = 6 }]",
        "device = [{ kind = 'mh4', node = 5 }, { kind = 'mh4' }]",
        "device = [{ kind = 'mh4' }, { kind = 'mh4' }]",
        "device = [{ kind = 'mh4', node = 5, duplicate_id = true }, { kind = 'mh4', node = 5, duplicate_id = true }]",
        "device = [{ kind = 'dps', node = 5 }, { kind = 'mh4' }]",
    ];
    for bench in two {
        let mut bus = bus(bench);
        let before = all_snapshots(&bus);
        let done = run(&mut bus, "only", &id(12));
        assert_eq!(done.failure().0, Kind::CheckFailed, "{bench}");
        assert!(done.failure().1.ends_with("nothing was changed"), "{}", done.failure().1);
        assert_eq!(all_snapshots(&bus), before, "{bench}");
    }
}

#[test]
fn only_works_without_a_node_id() {
    let mut bus = bus("device = [{ kind = 'mh4' }]");
    let report = run(&mut bus, "only", &id(12)).result.unwrap();
    assert_eq!((report.confirmed, all_snapshots(&bus)[0].2), (Confirmed::BootUp, Some(12)));
}

#[test]
fn forced_only_with_several_devices_is_no_success() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5 }, { kind = 'mh4', node = 6 }]");
    let done = run(&mut bus, "only", &Wanted { force: true, ..id(12) });
    assert_eq!(done.failure().0, Kind::Unexpected, "{:?}", done.failure());
    assert!(done.warns("all of them accept the change"), "{:?}", done.notes);
    assert_eq!(
        all_snapshots(&bus).iter().map(|held| (held.0, held.2)).collect::<Vec<_>>(),
        [(Some(5), Some(12)), (Some(6), Some(12))]
    );
}

#[test]
fn forced_store_accepts_several_answers() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5 }, { kind = 'mh4', node = 6, latency = '1ms' }]");
    let overrides = Overrides::new();
    let mut master = Master::new(&mut bus, Timing::default());
    let mut stored = |force| {
        store(&mut master, &Target::Only, &Descriptions { overrides: &overrides, given: None }, force, &mut |_| {})
    };
    assert_eq!(stored(false).expect_err("two are there").kind(), Kind::CheckFailed);
    stored(true).unwrap();
}

#[test]
fn absent_device_is_no_answer() {
    for target in ["9", "1:2:3:4", "unconfigured"] {
        let mut bus = bus(ALL);
        let before = all_snapshots(&bus);
        assert_eq!(run(&mut bus, target, &id(12)).failure().0, Kind::NoAnswer, "{target}");
        assert_eq!(all_snapshots(&bus), before);
    }
}

#[test]
fn device_without_serial_number_is_rejected() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5, serial = 0 }]");
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::CheckFailed);
    assert!(done.failure().1.contains("no serial number"), "{}", done.failure().1);
}

#[test]
fn two_devices_with_one_identity() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5, serial = 7 }, { kind = 'mh4', node = 6, serial = 7 }]");
    let before = all_snapshots(&bus);
    for target in ["5", "6", "0x47:1:1:7"] {
        let done = run(&mut bus, target, &id(12));
        assert_eq!(done.failure().0, Kind::CheckFailed, "{target}: {:?}", done.failure());
        assert!(done.failure().1.ends_with("nothing was changed"), "{}", done.failure().1);
    }
    assert_eq!(all_snapshots(&bus), before);
    // Devices without 5Eh.
    for kind in ["dps", "d20"] {
        let device = |node: u8| format!("{{ kind = '{kind}', node = {node}, serial = 7 }}");
        let mut bus = super::bus(&format!("device = [{}, {}]", device(5), device(6)));
        let before = all_snapshots(&bus);
        assert_eq!(run(&mut bus, "5", &id(12)).failure().0, Kind::CheckFailed, "{kind}");
        assert_eq!(all_snapshots(&bus), before, "{kind}");
    }
    // One of them has no node-ID, so SDO does not show it. Both answer to the identity.
    let mut bus = super::bus("device = [{ kind = 'mh4', node = 5, serial = 7 }, { kind = 'mh4', serial = 7 }]");
    let before = all_snapshots(&bus);
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::CheckFailed, "{:?}", done.failure());
    assert_eq!(all_snapshots(&bus), before);
}

#[test]
fn assignment_by_manufacturer_objects() {
    let cases = [("mh4", None), ("baumer", None)];
    for (kind, device) in cases {
        // Baumer's code is known for this bit rate only.
        let mut bus = bus(&format!(
            "bit_rate = 500000\ndevice = [{{ kind = '{kind}', node = 5 }}, {{ kind = 'dps', node = 6 }}]"
        ));
        let mut expected = all_snapshots(&bus);
        let done = run(&mut bus, "5", &Wanted { via: Via::Sdo, device, ..id(12) });
        assert_eq!(done.warns("COB-IDs"), kind == "mh4", "{:?}", done.notes);
        let report = done.result.unwrap_or_else(|failure| panic!("{kind}: {failure}"));
        assert_eq!(report.confirmed, Confirmed::BootUp, "{kind}");
        (expected[0].0, expected[0].2) = (Some(12), Some(12));
        assert_eq!(all_snapshots(&bus), expected, "{kind}");
    }
    let mut bus = bus("device = [{ kind = 'dps', node = 6 }]");
    let done = run(&mut bus, "6", &Wanted { via: Via::Sdo, ..id(12) });
    assert!(
        done.failure().1.contains("the objects that set its node-ID and bit rate are unknown"),
        "{:?}",
        done.failure()
    );
}

#[test]
fn objects_that_need_a_store_are_not_written_without_one() {
    // MH-4: effective "after 1010h and a reset". An old HYDAC stores the written values.
    for (kind, device, why) in [
        ("mh4", None, "after they are stored (0x1010:1)"),
        ("hydac", None, "after they are stored (0x1010:4)"),
        ("hydac-old", Some("hydac-old"), "as soon as they are written"),
    ] {
        let mut bus = bus(&format!("device = [{{ kind = '{kind}', node = 5 }}]"));
        let expected = all_snapshots(&bus);
        let done = run(&mut bus, "5", &Wanted { via: Via::Sdo, no_store: true, device, ..id(12) });
        let (failure, message) = done.failure();
        assert!(message.contains(why) && message.contains("nothing was changed"), "{failure:?} {message}");
        assert_eq!(all_snapshots(&bus), expected);
        assert!(!done.warns("1010h:1"), "{:?}", done.notes);
    }
}

#[test]
fn nmt_state_changed_for_lss_is_restored() {
    // The DPS takes part in PRE-OPERATIONAL, the D-20-9 in STOPPED; a bit rate alone ends in no reset.
    for kind in ["dps", "d20"] {
        let device = format!("{{ kind = '{kind}', node = 5, start = true, set = {{ '0x1017' = 100 }} }}");
        let mut bus = bus(&format!("device = [{device}]"));
        let wanted = Wanted { rate: Some(RequestedRate::Bits(500_000)), ..Wanted::default() };
        run(&mut bus, "5", &wanted).result.unwrap();
        let device: &Device = bus.stations().next().unwrap();
        assert_eq!(device.state(), Some(State::Operational), "{kind}");
    }
}

#[test]
fn values_that_are_not_stored_are_lost_at_power_off() {
    let mut bus = bus(ALL);
    let expected = all_snapshots(&bus);
    let report = run(&mut bus, "1", &Wanted { no_store: true, ..id(12) }).result.unwrap();
    assert_eq!((report.stored, all_snapshots(&bus)[0].0, all_snapshots(&bus)[0].2), (false, Some(12), Some(1)));
    bus.power_cycle();
    assert_eq!(all_snapshots(&bus), expected);
}

#[test]
fn stale_cob_ids_are_reported() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5, set = { '0x1800:1' = 0x40000185 } }]");
    let report = run(&mut bus, "5", &id(12)).result.unwrap();
    let ids = report.cob_ids.unwrap();
    let stale: Vec<String> = ids.stale.iter().map(|stale| stale.object.to_string()).collect();
    let moved: Vec<String> = ids.tpdos.iter().map(|(number, id)| format!("{number} {id}")).collect();
    // Either the COB-ID followed the node-ID, or it is reported as stale.
    assert_eq!(stale.is_empty(), moved[0] == "1 18C", "{stale:?} {moved:?}");
}

#[test]
fn unsupported_bit_rate_is_rejected_with_the_list() {
    let mut bus = bus(ALL);
    let before = all_snapshots(&bus);
    for (target, rate, list) in [
        ("127", RequestedRate::Bits(800_000), "1M, 500k, 250k, 125k, 100k, 50k"),
        ("127", RequestedRate::Auto, "1M, 500k, 250k, 125k, 100k, 50k"),
        ("1", RequestedRate::Bits(100_000), "1M, 800k, 500k, 250k, 125k, 50k, 20k, auto"),
    ] {
        let done = run(&mut bus, target, &Wanted { rate: Some(rate), ..Wanted::default() });
        assert_eq!(done.failure().0, Kind::Usage);
        let hint = ErrorMessage::of(&done.result.unwrap_err()).hint.unwrap();
        assert!(hint.contains(list), "{hint}");
    }
    assert_eq!(all_snapshots(&bus), before);
    // Its own table: 5 is 100k.
    let done = run(&mut bus, "127", &Wanted { rate: Some(RequestedRate::Bits(100_000)), ..Wanted::default() });
    let report = done.result.unwrap();
    assert_eq!(
        (report.rate.map(|rate| (rate.bits, rate.index)), report.confirmed),
        (Some((Some(100_000), 5)), Confirmed::Acknowledge)
    );
    let stored = bus.stations::<Device>().map(|device| device.stored().1).collect::<Vec<_>>();
    assert_eq!(stored[3].map(short_bit_rate).as_deref(), Some("100k"));
    assert_eq!(all_snapshots(&bus)[..3], before[..3]);
}

#[test]
fn heartbeat_of_the_new_node_id_is_noticed_in_each_step() {
    for millis in (20..1100).step_by(90) {
        let mut bus = bus("device = [{ kind = 'mh4', node = 1 }]");
        bus.attach(OneHeartbeat(Mono::at(Duration::from_millis(millis))));
        let done = run(&mut bus, "1", &id(7));
        assert!(done.failure().1.contains("(a node sends heartbeats)"), "{millis} ms: {:?}", done.failure());
    }
}

/// A stopped node 7 that sends one heartbeat.
struct OneHeartbeat(Mono);

impl Station for OneHeartbeat {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, _: Mono, out: &mut Outbox) {
        self.0 = Mono::at(Duration::MAX);
        out.send("707#04".parse().expect("a frame"));
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.0)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn setting_a_node_id_takes_less_than_two_seconds() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 1 }, { kind = 'dps', node = 3 }]");
    let start = bus.mono();
    let done = run(&mut bus, "1", &id(7));
    assert_eq!(done.result.expect("done").confirmed, Confirmed::BootUp);
    let took = bus.mono().since(start);
    assert!(took < Duration::from_millis(1800), "{took:?}");
}
