//! Ctrl-C at any moment.

use super::{Wanted, all_held, bus, id, run};
use cangauge::bus::{Bus, Mono};
use cangauge::tasks::Kind;
use cangauge::tasks::lss::{Rate, Via};
use std::time::Duration;

/// Interrupts a job at every moment of its run, and looks at what is left behind.
fn at_every_step(bench: &str, target: &str, wanted: &Wanted, step: Duration) {
    let length = {
        let mut bus = bus(bench);
        run(&mut bus, target, wanted).result.unwrap();
        bus.mono().since_start()
    };
    let mut interrupted = 0;
    let mut moment = Duration::from_millis(1);
    while moment < length {
        let mut bus = bus(bench);
        let before = all_held(&bus);
        let rate = bus.bit_rate();
        bus.interrupt_at(Mono::at(moment));
        let done = run(&mut bus, target, wanted);
        let after = all_held(&bus);
        assert_eq!(before[1..], after[1..], "{moment:?}: somebody who was not meant");
        match &done.result {
            Ok(_) => {}
            Err(failure) => {
                assert_eq!(failure.kind, Kind::Interrupted, "{moment:?}: {failure}");
                interrupted += 1;
                assert!(bus.bit_rate() == rate || failure.message.contains("configured"), "{moment:?}: {failure}");
                if failure.message.contains("nothing was changed") {
                    let mut master = cangauge::master::Master::new(&mut bus, cangauge::master::Timing::default());
                    master.send("000#8105".parse().unwrap());
                    let until = master.now() + Duration::from_millis(500);
                    while !matches!(master.next(until), Ok(cangauge::master::Happening::Deadline)) {}
                    drop(master);
                    assert_eq!(all_held(&bus)[0], before[0], "{moment:?}: {failure}");
                }
            }
        }
        moment += step;
    }
    assert!(interrupted > 20, "{interrupted}");
}

const MH4: &str =
    "device = [{ kind = 'mh4', node = 5, latency = '1ms' }, { kind = 'mh4', node = 6 }, { kind = 'mh4' }]";

#[test]
fn by_lss() {
    at_every_step(MH4, "5", &id(12), Duration::from_micros(4_300));
}

#[test]
fn by_lss_to_one_that_wants_another_state() {
    let bench = "device = [{ kind = 'd20', node = 5, latency = '1ms' }, { kind = 'dps', node = 6 }]";
    at_every_step(bench, "5", &id(12), Duration::from_micros(9_700));
}

#[test]
fn by_objects() {
    at_every_step(MH4, "5", &Wanted { via: Via::Sdo, ..id(12) }, Duration::from_micros(6_100));
}

#[test]
fn the_bit_rate() {
    let wanted = Wanted { rate: Some(Rate::Bits(500_000)), ..Wanted::default() };
    at_every_step(MH4, "5", &wanted, Duration::from_micros(3_700));
}

#[test]
fn device_and_host_together() {
    let alone = "device = [{ kind = 'mh4', node = 5, latency = '1ms' }]";
    let wanted = Wanted { rate: Some(Rate::Bits(500_000)), retime: true, ..Wanted::default() };
    at_every_step(alone, "5", &wanted, Duration::from_micros(31_000));
}

#[test]
fn only() {
    at_every_step(
        "device = [{ kind = 'mh4', node = 5, latency = '1ms' }]",
        "only",
        &id(12),
        Duration::from_micros(23_000),
    );
}
