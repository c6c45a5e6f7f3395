//! Device and host change the bit rate together, and back.

use super::{Done, Wanted, all_snapshots, bus, run};
use cangauge::bus::BitRateControl;
use cangauge::bus::memory::MemoryBus;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::Device;
use cangauge::tasks::Kind;
use cangauge::tasks::lss::{Confirmed, RequestedRate, Via};

fn retimed(bus: &mut MemoryBus, target: &str) -> Done {
    run(bus, target, &Wanted { rate: Some(RequestedRate::Bits(500_000)), retime: true, ..Wanted::default() })
}

fn rates(bus: &MemoryBus) -> Vec<(Option<u32>, Option<u32>)> {
    bus.stations::<Device>().map(|device| (device.bit_rate(), device.stored().1)).collect()
}

const OLD: Option<u32> = Some(250_000);
const NEW: Option<u32> = Some(500_000);

#[test]
fn each_kind_and_the_host_go_together() {
    for kind in ["mh4", "d20", "mc1609", "dps"] {
        for target in ["5", "only"] {
            let mut bus = bus(&format!("device = [{{ kind = '{kind}', node = 5 }}]"));
            let done = retimed(&mut bus, target);
            let report = done.result.unwrap_or_else(|failure| panic!("{kind} {target}: {failure}"));
            assert_eq!((report.retimed, report.stored, report.confirmed), (true, true, Confirmed::Identity));
            assert_eq!((bus.bit_rate(), rates(&bus)), (NEW, vec![(NEW, NEW)]), "{kind} {target}");
        }
    }
}

#[test]
fn node_id_and_bit_rate_together() {
    for via in [Via::Lss, Via::Sdo] {
        let mut bus = bus("device = [{ kind = 'mh4', node = 5 }]");
        let wanted =
            Wanted { id: Some(12), rate: Some(RequestedRate::Bits(500_000)), retime: true, via, ..Wanted::default() };
        let done = run(&mut bus, "5", &wanted);
        assert_eq!(done.warns("cannot return to the old bit rate"), via == Via::Sdo, "{:?}", done.notes);
        let report = done.result.unwrap_or_else(|failure| panic!("{via:?}: {failure}"));
        assert!(report.retimed && report.confirmed != Confirmed::Acknowledge, "{via:?}");
        assert_eq!(all_snapshots(&bus), [(Some(12), NEW, Some(12), NEW)], "{via:?}");
        assert_eq!(bus.bit_rate(), NEW);
    }
}

#[test]
fn without_the_host_nothing_is_reset() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5 }, { kind = 'mh4', node = 6 }]");
    let wanted = Wanted { id: Some(12), rate: Some(RequestedRate::Bits(500_000)), ..Wanted::default() };
    let report = run(&mut bus, "5", &wanted).result.unwrap();
    assert_eq!((report.retimed, report.confirmed), (false, Confirmed::Acknowledge));
    assert_eq!(all_snapshots(&bus), [(Some(5), OLD, Some(12), NEW), (Some(6), OLD, Some(6), OLD)]);
}

#[test]
fn lost_device_returns_after_a_power_cycle() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5, offline_after = ['activate'] }]");
    let done = retimed(&mut bus, "5");
    assert_eq!(done.failure().0, Kind::NoAnswer);
    assert!(done.failure().1.contains("the host is back at 250k"), "{}", done.failure().1);
    assert!(ErrorMessage::of(&done.result.unwrap_err()).hint.unwrap().contains("off and on"));
    assert_eq!(bus.bit_rate(), OLD);
    bus.power_cycle();
    assert_eq!(rates(&bus), [(OLD, OLD)]);
}

#[test]
fn rejected_if_another_device_is_on_the_bus() {
    for other in [
        "{ kind = 'dps', node = 6 }",
        "{ kind = 'mh4' }",
        "{ kind = 'mh4', node = 6, start = true, set = { '0x1801:5' = 100 } }",
    ] {
        let mut bus = bus(&format!("device = [{{ kind = 'mh4', node = 5 }}, {other}]"));
        let before = all_snapshots(&bus);
        let done = retimed(&mut bus, "5");
        assert_eq!(done.failure().0, Kind::CheckFailed, "{other}");
        assert!(done.failure().1.contains("nothing was changed"), "{}", done.failure().1);
        assert_eq!((bus.bit_rate(), all_snapshots(&bus)), (OLD, before), "{other}");
    }
}

#[test]
fn without_the_privilege_nothing_is_changed() {
    let mut bus = bus("retime = false\ndevice = [{ kind = 'mh4', node = 5 }]");
    let before = all_snapshots(&bus);
    let done = retimed(&mut bus, "5");
    assert_eq!(done.failure().0, Kind::Bus, "{:?}", done.failure());
    assert_eq!(all_snapshots(&bus), before);
}

#[test]
fn failed_store_is_reported_and_lasts_until_power_off() {
    let mut bus = bus("device = [{ kind = 'mh4', node = 5, lss = { refuse = { '0x17' = 1 } } }]");
    let done = retimed(&mut bus, "5");
    assert_eq!(done.failure().0, Kind::Refused);
    assert!(done.failure().1.contains("not stored"), "{}", done.failure().1);
    assert_eq!((bus.bit_rate(), rates(&bus)), (NEW, vec![(NEW, OLD)]));
}
