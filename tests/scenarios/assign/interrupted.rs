//! Ctrl-C at every moment.

use super::{Wanted, all_snapshots, bus, id, run};
use cangauge::bus::memory::{Outbox, Station};
use cangauge::bus::{BitRateControl, Bus, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::Kind;
use cangauge::tasks::lss::{RequestedRate, Via};
use std::collections::BTreeSet;
use std::time::Duration;

/// Records the moments of changes: NMT, LSS services that configure, SDO writes.
#[derive(Default)]
struct ChangeRecorder {
    moments: Vec<Mono>,
}

impl Station for ChangeRecorder {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        let first = frame.data().first().copied().unwrap_or(0);
        let changes = match frame.id() {
            CanId::NMT => true,
            CanId::LSS_MASTER => matches!(first, 0x11..=0x17),
            id => id.sdo_request_node().is_some() && first >> 5 == 1,
        };
        if changes {
            self.moments.push(now);
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// Moments of a whole run, closer together around every frame that changes something.
fn moments(bench: &str, target: &str, wanted: &Wanted) -> BTreeSet<Duration> {
    let mut bus = bus(bench);
    bus.attach(ChangeRecorder::default());
    run(&mut bus, target, wanted).result.unwrap();
    let length = bus.mono().since_start();
    let coarse = (1..24).map(|part| length * part / 24);
    let changes: Vec<Mono> = bus.stations::<ChangeRecorder>().flat_map(|recorder| recorder.moments.clone()).collect();
    assert!(!changes.is_empty());
    let fine = changes.iter().flat_map(|at| {
        let steps = [-2_500, -1_500, -700, -300, 100, 600, 1_100, 1_700, 2_600, 4_500, 20_000_i64];
        steps.map(|step| shifted(*at, step))
    });
    coarse.chain(fine).filter(|moment| *moment < length).collect()
}

fn shifted(at: Mono, micros: i64) -> Duration {
    let step = Duration::from_micros(micros.unsigned_abs());
    if micros < 0 { at.since_start().saturating_sub(step) } else { at.since_start() + step }
}

/// Interrupts a job at many moments, and checks the devices.
fn at_every_step(bench: &str, target: &str, wanted: &Wanted) {
    let mut interrupted = 0;
    for moment in moments(bench, target, wanted) {
        let mut bus = bus(bench);
        let before = all_snapshots(&bus);
        let rate = bus.bit_rate();
        bus.interrupt_at(Mono::at(moment));
        let done = run(&mut bus, target, wanted);
        let after = all_snapshots(&bus);
        assert_eq!(before[1..], after[1..], "{moment:?}: another device was changed");
        match &done.result {
            Ok(_) => {}
            Err(failure) => {
                assert_eq!(failure.kind(), Kind::Interrupted, "{moment:?}: {failure}");
                interrupted += 1;
                assert!(
                    bus.bit_rate() == rate || ErrorMessage::of(failure).message.contains("configured"),
                    "{moment:?}: {failure}"
                );
                if ErrorMessage::of(failure).message.contains("not stored") {
                    assert_eq!((after[0].2, after[0].3), (before[0].2, before[0].3), "{moment:?}: {failure}");
                }
                if ErrorMessage::of(failure).message.contains("nothing was changed") {
                    let mut master = cangauge::master::Master::new(&mut bus, cangauge::master::Timing::default());
                    master.send("000#8105".parse().unwrap());
                    let until = master.now() + Duration::from_millis(500);
                    while !matches!(master.next(until), Ok(cangauge::master::MasterEvent::Deadline)) {}
                    drop(master);
                    assert_eq!(all_snapshots(&bus)[0], before[0], "{moment:?}: {failure}");
                }
            }
        }
    }
    assert!(interrupted > 12, "{interrupted}");
}

const MH4: &str =
    "device = [{ kind = 'mh4', node = 5, latency = '1ms' }, { kind = 'mh4', node = 6 }, { kind = 'mh4' }]";

#[test]
fn by_lss() {
    at_every_step(MH4, "5", &id(12));
}

#[test]
fn by_lss_with_a_required_nmt_state() {
    let bench = "device = [{ kind = 'd20', node = 5, latency = '1ms' }, { kind = 'dps', node = 6 }]";
    at_every_step(bench, "5", &id(12));
}

#[test]
fn by_objects() {
    at_every_step(MH4, "5", &Wanted { via: Via::Sdo, ..id(12) });
}

#[test]
fn the_bit_rate() {
    let wanted = Wanted { rate: Some(RequestedRate::Bits(500_000)), ..Wanted::default() };
    at_every_step(MH4, "5", &wanted);
}

#[test]
fn device_and_host_together() {
    let alone = "device = [{ kind = 'mh4', node = 5, latency = '1ms' }]";
    let wanted = Wanted { rate: Some(RequestedRate::Bits(500_000)), retime: true, ..Wanted::default() };
    at_every_step(alone, "5", &wanted);
}

#[test]
fn only() {
    at_every_step("device = [{ kind = 'mh4', node = 5, latency = '1ms' }]", "only", &id(12));
}
