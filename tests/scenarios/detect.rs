//! Finding the bit rate of a running bus. A device at a different bit rate neither receives nor sends.

use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::time::Mono;
use cangauge::bus::{BitRateControl, Bus, Event, Mode};
use cangauge::sim::Bench;
use cangauge::tasks::detect::{Detection, Evidence, Method, RATES, detect};
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

/// Checks that the interface has its old bit rate, and can send.
fn assert_restored(bus: &mut MemoryBus) {
    assert_eq!(bus.bit_rate(), Some(250_000));
    bus.send(&"701#05".parse().unwrap()).expect("not listen-only");
}

#[test]
fn listening_finds_each_bit_rate_of_two_devices() {
    for rate in RATES {
        let mut bus = bench(rate, &[(5, 1000), (6, 900)]);
        let found = run(&mut bus, false).unwrap();
        assert_eq!(found.found, Some((rate, Evidence::Frames)), "{:?}", found.tried);
        assert!(found.tried.iter().all(|tried| tried.how == Method::Listening));
        assert_restored(&mut bus);
    }
}

#[test]
fn listening_does_not_disturb_the_bus() {
    let mut bus = bench(125_000, &[(5, 20), (6, 30)]);
    let mut undisturbed = bench(125_000, &[(5, 20), (6, 30)]);
    undisturbed.set_bit_rate(125_000, Mode::ListenOnly).unwrap();
    assert_eq!(run(&mut bus, false).unwrap().found, Some((125_000, Evidence::Frames)));
    // Afterwards each heartbeat has the same time as on the undisturbed bus.
    bus.set_bit_rate(125_000, Mode::ListenOnly).unwrap();
    let from = bus.now().mono;
    let received = |bus: &mut MemoryBus| {
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
    let frames = received(&mut bus);
    assert!(frames.len() > 50, "{}", frames.len());
    assert_eq!(frames, received(&mut undisturbed));
}

#[test]
fn single_sensor_needs_an_acknowledge() {
    for heartbeat in [0, 100] {
        for rate in [50_000, 1_000_000] {
            let mut bus = bench(rate, &[(5, heartbeat)]);
            let found = run(&mut bus, false).unwrap();
            assert_eq!(found.found, None, "{:?}", found.tried);
            assert_restored(&mut bus);

            let mut bus = bench(rate, &[(5, heartbeat)]);
            let found = run(&mut bus, true).unwrap();
            assert_eq!(found.found, Some((rate, Evidence::Frames)), "{:?}", found.tried);
            assert_restored(&mut bus);
        }
    }
}

#[test]
fn empty_bus_has_no_bit_rate() {
    for ask in [false, true] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        let found = run(&mut bus, ask).unwrap();
        assert_eq!(found.found, None, "{:?}", found.tried);
        assert_eq!(found.tried.len(), if ask { 2 * RATES.len() } else { RATES.len() });
    }
}

#[test]
fn ctrl_c_at_any_time_restores_the_bit_rate() {
    let devices = || bench(83_333, &[(5, 700), (6, 0)]);
    let mut bus = devices();
    assert_eq!(run(&mut bus, true).unwrap().found, None);
    let end = bus.now().mono.since_start();
    for part in 0..16 {
        let moment = Mono::at(end * part / 16);
        let mut bus = devices();
        bus.interrupt_at(moment);
        assert_eq!(run(&mut bus, true).unwrap_err().kind(), Kind::Interrupted, "{moment:?}");
        assert_restored(&mut bus);
    }
}

#[test]
fn nothing_is_sent_without_permission_to_set_the_bit_rate() {
    let text = "clock = \"virtual\"\nretime = false\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let mut bus = Bench::from_toml(text, Path::new("")).unwrap().open().unwrap();
    let failure = run(&mut bus, true).unwrap_err();
    assert_eq!(failure.kind(), Kind::Bus);
    assert_eq!(bus.now().mono, Mono::START);
}
