//! The bit rate of a running bus, found on a wire where everybody at another rate is deaf and mute.

use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::time::Mono;
use cangauge::bus::{BitRateControl, Bus, Event, Mode};
use cangauge::sim::Bench;
use cangauge::tasks::detect::{By, Detection, How, RATES, detect};
use cangauge::tasks::{Failure, Kind};
use std::path::Path;
use std::time::Duration;

const EACH: Duration = Duration::from_millis(1500);

/// Devices at this bit rate, each with its node-ID and the time of its heartbeat in milliseconds.
fn bench(bit_rate: u32, devices: &[(u8, u16)]) -> MemoryBus {
    let device = |(node, heartbeat): &(u8, u16)| {
        format!(
            "[[device]]\nkind = \"mh4\"\nnode = {node}\nbit_rate = {bit_rate}\nset = {{ \"0x1017\" = {heartbeat} }}\n"
        )
    };
    let devices: String = devices.iter().map(device).collect();
    Bench::from_toml(&format!("clock = \"virtual\"\n{devices}"), Path::new("")).unwrap().open().unwrap()
}

fn run(bus: &mut MemoryBus, ask: bool) -> Result<Detection, Failure> {
    detect(bus, ask, EACH, &mut |_| ())
}

/// That the program takes part at its old rate again.
fn assert_put_back(bus: &mut MemoryBus) {
    assert_eq!(bus.bit_rate(), Some(250_000));
    bus.send(&"701#05".parse().unwrap()).expect("not listen-only");
}

#[test]
fn a_bus_with_company_is_heard_at_every_rate() {
    for rate in RATES {
        let mut bus = bench(rate, &[(5, 1000), (6, 900)]);
        let found = run(&mut bus, false).unwrap();
        assert_eq!(found.found, Some((rate, By::Frames)), "{:?}", found.tried);
        assert!(found.tried.iter().all(|tried| tried.how == How::Listening));
        assert_put_back(&mut bus);
    }
}

#[test]
fn listening_disturbs_nobody() {
    let mut bus = bench(125_000, &[(5, 20), (6, 30)]);
    let mut undisturbed = bench(125_000, &[(5, 20), (6, 30)]);
    undisturbed.set_bit_rate(125_000, Mode::ListenOnly).unwrap();
    assert_eq!(run(&mut bus, false).unwrap().found, Some((125_000, By::Frames)));
    // Both go on to the very same moment: every heartbeat afterwards comes when it would have come.
    bus.set_bit_rate(125_000, Mode::ListenOnly).unwrap();
    let from = bus.now().mono;
    let heard = |bus: &mut MemoryBus| {
        let mut frames = Vec::new();
        let until = from + Duration::from_secs(1);
        loop {
            match bus.receive(until).unwrap() {
                Event::Frame(received) if received.at.mono > from => frames.push((received.frame, received.at.mono)),
                Event::Frame(_) => {}
                Event::Timeout => return frames,
                event => panic!("{event:?}"),
            }
        }
    };
    let frames = heard(&mut bus);
    assert!(frames.len() > 50, "{}", frames.len());
    assert_eq!(frames, heard(&mut undisturbed));
}

#[test]
fn one_sensor_alone_needs_somebody_who_acknowledges() {
    for heartbeat in [0, 100] {
        for rate in [50_000, 1_000_000] {
            let mut bus = bench(rate, &[(5, heartbeat)]);
            let found = run(&mut bus, false).unwrap();
            assert_eq!(found.found, None, "{:?}", found.tried);
            assert_put_back(&mut bus);

            let mut bus = bench(rate, &[(5, heartbeat)]);
            let found = run(&mut bus, true).unwrap();
            assert_eq!(found.found, Some((rate, By::Frames)), "{:?}", found.tried);
            assert_put_back(&mut bus);
        }
    }
}

#[test]
fn nobody_there_is_no_bit_rate() {
    for ask in [false, true] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        let found = run(&mut bus, ask).unwrap();
        assert_eq!(found.found, None, "{:?}", found.tried);
        assert_eq!(found.tried.len(), if ask { 2 * RATES.len() } else { RATES.len() });
    }
}

#[test]
fn interrupted_at_any_moment_the_old_rate_is_back() {
    let devices = || bench(83_333, &[(5, 700), (6, 0)]);
    let mut bus = devices();
    assert_eq!(run(&mut bus, true).unwrap().found, None);
    let end = bus.now().mono.since_start();
    for part in 0..16 {
        let moment = Mono::at(end * part / 16);
        let mut bus = devices();
        bus.interrupt_at(moment);
        assert_eq!(run(&mut bus, true).unwrap_err().kind(), Kind::Interrupted, "{moment:?}");
        assert_put_back(&mut bus);
    }
}

#[test]
fn where_the_rate_may_not_be_set_nothing_is_sent() {
    let text = "clock = \"virtual\"\nretime = false\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let mut bus = Bench::from_toml(text, Path::new("")).unwrap().open().unwrap();
    let failure = run(&mut bus, true).unwrap_err();
    assert_eq!(failure.kind(), Kind::Bus);
    assert_eq!(bus.now().mono, Mono::START);
}
