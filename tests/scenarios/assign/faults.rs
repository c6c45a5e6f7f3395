//! Devices that lose answers, reject requests, and do not come back.

use super::{Snapshot, Wanted, all_snapshots, bus, id, run};
use cangauge::bus::memory::{Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::Kind;
use cangauge::tasks::lss::{RequestedRate, Via};

/// A device with these oddities at node 5, and two other devices: one of the same kind, one without a node-ID.
fn bench(kind: &str, oddities: &str) -> String {
    format!(
        "device = [{{ kind = '{kind}', node = 5, serial = 100 {oddities} }}, {{ kind = '{kind}', node = 6, serial = 200 }}, \
         {{ kind = 'mh4', serial = 300 }}]"
    )
}

/// Checks the devices after a run.
#[track_caller]
fn check(before: &[Snapshot], after: &[Snapshot], succeeded: bool, new: u8) {
    assert_eq!(before[1..], after[1..], "another device was changed");
    if succeeded {
        assert_eq!((after[0].0, after[0].2), (Some(new), Some(new)), "a success is the real state of the device");
    }
}

#[test]
fn every_fault_of_one_service() {
    let faults = [
        ", lss = { lose = [0x11] }",
        ", lss = { lose = [0x17] }",
        ", lss = { lose = [0x43] }",
        ", lss = { lose = [0x11, 0x17, 0x43] }",
        ", lss = { late = { '0x11' = '700ms' } }",
        ", lss = { late = { '0x17' = '2s' } }",
        ", lss = { late = { '0x17' = '5s' } }",
        ", lss = { refuse = { '0x11' = 1 } }",
        ", lss = { refuse = { '0x17' = 1 } }",
        ", lss = { refuse = { '0x17' = 2 } }",
        ", offline_after = ['reset']",
        ", latency = '90ms'",
    ];
    for kind in ["mh4", "dps", "d20", "mc1609"] {
        for fault in faults {
            for target in ["5", "identity"] {
                let mut bus = bus(&bench(kind, fault));
                let before = all_snapshots(&bus);
                let target = match target {
                    "5" => "5".to_owned(),
                    _ => identity(kind),
                };
                let done = run(&mut bus, &target, &id(12));
                let after = all_snapshots(&bus);
                check(&before, &after, done.result.is_ok(), 12);
                if let Err(failure) = &done.result {
                    let says_all = failure.kind() == Kind::Refused;
                    assert!(says_all || ErrorMessage::of(failure).hint.is_some(), "{kind}{fault}: {failure}");
                    // "nothing was changed" holds even after a power cycle.
                    if ErrorMessage::of(failure).message.contains("nothing was changed") {
                        bus.power_cycle();
                        assert_eq!(all_snapshots(&bus)[0], before[0], "{kind}{fault}: {failure}");
                    }
                }
            }
        }
    }
}

fn identity(kind: &str) -> String {
    let mut bus = bus(&bench(kind, ""));
    run(&mut bus, "5", &id(5)).result.unwrap().address.unwrap().to_string()
}

#[test]
fn rejected_store_is_reverted_and_no_success() {
    let mut bus = bus(&bench("mh4", ", lss = { refuse = { '0x17' = 1 } }"));
    let before = all_snapshots(&bus);
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::Refused);
    assert!(done.failure().1.contains("storing not supported"), "{}", done.failure().1);
    assert!(done.failure().1.contains("nothing was changed"), "{}", done.failure().1);
    assert!(ErrorMessage::of(&done.result.unwrap_err()).hint.unwrap().contains("--via sdo"));
    assert_eq!(all_snapshots(&bus), before);
    // No value is left pending: a reset changes nothing.
    let mut master = cangauge::master::Master::new(&mut bus, cangauge::master::Timing::default());
    master.send("000#8105".parse().unwrap());
    let until = master.now() + std::time::Duration::from_millis(500);
    while !matches!(master.next(until), Ok(cangauge::master::MasterEvent::Deadline)) {}
    drop(master);
    assert_eq!(all_snapshots(&bus), before);
    // The device's objects work.
    run(&mut bus, "5", &Wanted { via: Via::Sdo, ..id(12) }).result.unwrap();
    assert_eq!(all_snapshots(&bus)[0].2, Some(12));
}

#[test]
fn silent_lss_uses_the_objects_of_the_description() {
    let silent = format!(", lss = {{ lose = {:?} }}", [0x43; 16]);
    let mut bus = bus(&bench("mh4", &silent));
    let done = run(&mut bus, "5", &id(12));
    assert!(done.warns("its objects are used instead"), "{:?}", done.notes);
    done.result.unwrap();
    assert_eq!(all_snapshots(&bus)[0].2, Some(12));
    // Not if the user chose LSS. The hint contains the identity.
    let mut bus = super::bus(&bench("mh4", &silent));
    let done = run(&mut bus, "5", &Wanted { via: Via::Lss, ..id(12) });
    assert_eq!(done.failure().0, Kind::NoAnswer);
    let hint = ErrorMessage::of(&done.result.unwrap_err()).hint.unwrap();
    assert!(hint.contains("cangauge nmt stop 5 && cangauge lss inquire 0x47:0x1:0x1:100"), "{hint}");
}

#[test]
fn lost_acknowledgement_of_a_store_is_no_success() {
    let mut bus = bus(&bench("mh4", ", lss = { lose = [0x17] }"));
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::NoAnswer);
    assert!(done.failure().1.contains("unknown whether it is stored"), "{}", done.failure().1);
}

#[test]
fn device_that_does_not_come_back() {
    let mut bus = bus(&bench("mh4", ", offline_after = ['reset']"));
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::NoAnswer);
    assert!(done.failure().1.contains("node-ID 12 configured, stored"), "{}", done.failure().1);
    let hint = ErrorMessage::of(&done.result.unwrap_err()).hint.unwrap();
    assert!(hint.contains("power it off and on"), "{hint}");
}

/// A device with node-ID 12 that sends a boot-up message at the reset of node 5.
struct Newcomer {
    awake: bool,
}

impl Station for Newcomer {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        if frame.to_string() == "000#8105" {
            self.awake = true;
            out.send("70C#00".parse().unwrap());
        }
        if let ("60C", [0x40, a, b, sub, ..], true) = (&*frame.id().to_string(), frame.data(), self.awake) {
            out.send(format!("58C#43{a:02X}{b:02X}{sub:02X}0{sub}000000").parse().unwrap());
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn another_device_under_the_new_node_id() {
    let mut bus = bus(&bench("mh4", ", offline_after = ['reset']"));
    bus.attach(Newcomer { awake: false });
    let done = run(&mut bus, "5", &id(12));
    assert_eq!(done.failure().0, Kind::Unexpected);
    assert!(
        done.failure().1.contains("another device answers under the new node-ID: 0x1:0x2:0x3:4"),
        "{}",
        done.failure().1
    );
}

#[test]
fn rejected_bit_rate_changes_nothing() {
    let mut bus = bus(&bench("mh4", ", lss = { refuse = { '0x13' = 1 } }"));
    let before = all_snapshots(&bus);
    let wanted = Wanted { rate: Some(RequestedRate::Bits(500_000)), ..id(12) };
    let done = run(&mut bus, "5", &wanted);
    assert_eq!(done.failure().0, Kind::Refused);
    assert!(
        done.failure().1.contains("nothing was changed") || done.failure().1.contains("restored"),
        "{}",
        done.failure().1
    );
    assert_eq!(all_snapshots(&bus), before);
}
