//! Devices and the program at different bit rates: received frames, bus errors, and the return to one bit rate.

use cangauge::bus::memory::MemoryBus;
use cangauge::bus::{BitRateControl, Bus, Event, Fault, Mode};
use cangauge::sim::{Bench, Device};
use std::path::Path;
use std::time::Duration;

fn bench(devices: &str) -> MemoryBus {
    Bench::from_toml(&format!("clock = \"virtual\"\n{devices}"), Path::new("")).unwrap().open().unwrap()
}

/// The frames and bus faults within `wait`.
fn events(bus: &mut MemoryBus, wait: Duration) -> (Vec<String>, Vec<Fault>) {
    let until = bus.now().mono + wait;
    let (mut frames, mut faults) = (Vec::new(), Vec::new());
    loop {
        match bus.receive(until).unwrap() {
            Event::Frame(received) => frames.push(received.frame.to_string()),
            Event::Fault(fault, _) => faults.push(fault),
            Event::Timeout => return (frames, faults),
            other => panic!("{other:?}"),
        }
    }
}

/// Sends a frame. Returns the frames and bus faults within 100 ms.
fn exchange(bus: &mut MemoryBus, frame: &str) -> (Vec<String>, Vec<Fault>) {
    bus.send(&frame.parse().unwrap()).unwrap();
    events(bus, Duration::from_millis(100))
}

fn ok(bus: &mut MemoryBus, frame: &str, answer: &str) {
    let (frames, faults) = exchange(bus, frame);
    assert_eq!((frames.join(" "), faults), (answer.to_owned(), vec![]), "after {frame}");
}

const IDENTITY: (&str, &str) = ("605#4018100100000000", "585#4318100147000000");

/// Configures 125 kbit/s and activates it with a delay of one second.
fn activate(bus: &mut MemoryBus) {
    ok(bus, "7E5#0401000000000000", "");
    ok(bus, "7E5#1300040000000000", "7E4#1300000000000000");
    ok(bus, "7E5#15E8030000000000", "");
}

#[test]
fn bit_rate_survives_a_power_cycle_only_if_stored() {
    for stores in [false, true] {
        let mut bus = bench("[[device]]\nkind = \"mh4\"\nnode = 5\n");
        events(&mut bus, Duration::from_millis(100));
        activate(&mut bus);
        // During the first delay the device acknowledges frames and sends none.
        ok(&mut bus, IDENTITY.0, "");
        let (frames, faults) = events(&mut bus, Duration::from_secs(2));
        assert_eq!((frames.len(), faults.len()), (0, 0));
        // At the old bit rate there is no device.
        let (frames, faults) = exchange(&mut bus, IDENTITY.0);
        assert_eq!(frames.len(), 0);
        assert!(faults.contains(&Fault::Protocol) && faults.contains(&Fault::ErrorPassive), "{faults:?}");
        bus.set_bit_rate(125_000, Mode::Normal).unwrap();
        ok(&mut bus, IDENTITY.0, IDENTITY.1);
        if stores {
            ok(&mut bus, "7E5#1700000000000000", "7E4#1700000000000000");
        }
        ok(&mut bus, "7E5#0400000000000000", "");
        bus.power_cycle();
        let kept = if stores { 125_000 } else { 250_000 };
        assert_eq!(bus.stations::<Device>().next().unwrap().bit_rate(), Some(kept));
        bus.set_bit_rate(kept, Mode::Normal).unwrap();
        let (frames, _) = exchange(&mut bus, IDENTITY.0);
        assert_eq!(frames, ["705#00", IDENTITY.1]);
    }
}

#[test]
fn offline_device_acknowledges_nothing() {
    let mut bus = bench("[[device]]\nkind = \"mh4\"\nnode = 5\noffline_after = [\"activate\"]\n");
    events(&mut bus, Duration::from_millis(100));
    activate(&mut bus);
    events(&mut bus, Duration::from_secs(2));
    for rate in [125_000, 250_000] {
        bus.set_bit_rate(rate, Mode::Normal).unwrap();
        let (frames, faults) = exchange(&mut bus, IDENTITY.0);
        assert_eq!(frames.len(), 0);
        assert!(faults.contains(&Fault::NoAcknowledge) && !faults.contains(&Fault::Protocol), "{faults:?}");
    }
    bus.power_cycle();
    let (frames, _) = exchange(&mut bus, "080#");
    assert!(frames.contains(&"705#00".to_owned()), "{frames:?}");
}

#[test]
fn listening_receives_only_at_the_bus_rate_and_does_not_disturb() {
    let device = |node: u8| {
        format!("[[device]]\nkind = \"mh4\"\nnode = {node}\nbit_rate = 500000\nset = {{ \"0x1017\" = 100 }}\n")
    };
    // Two devices acknowledge each other's frames. A listen-only interface acknowledges none.
    for (nodes, is_received) in [(&[1, 2][..], true), (&[1], false)] {
        let mut bus = bench(&nodes.iter().map(|&node| device(node)).collect::<String>());
        for rate in [1_000_000, 800_000, 500_000, 250_000, 125_000, 50_000] {
            bus.set_bit_rate(rate, Mode::ListenOnly).unwrap();
            let (frames, faults) = events(&mut bus, Duration::from_millis(500));
            assert_eq!(!frames.is_empty(), is_received && rate == 500_000, "{rate}: {frames:?}");
            assert_eq!(faults.contains(&Fault::Protocol), !(is_received && rate == 500_000), "{rate}");
        }
        // No frame was disturbed: each device has received all frames of the other one.
        bus.set_bit_rate(500_000, Mode::Normal).unwrap();
        let (frames, faults) = events(&mut bus, Duration::from_secs(1));
        assert!(frames.len() >= 9 * nodes.len(), "{frames:?}");
        assert_eq!(faults, []);
    }
}

#[test]
fn simultaneous_answers_with_different_serial_numbers_collide() {
    let mut bus =
        bench("[[device]]\nkind = \"mh4\"\nnode = 5\n[[device]]\nkind = \"mh4\"\nnode = 5\nduplicate_id = true\n");
    // Identical frames at the same time appear once, as on a real bus.
    let (frames, faults) = events(&mut bus, Duration::from_millis(100));
    assert_eq!((frames, faults), (vec!["705#00".to_owned()], vec![]));
    ok(&mut bus, IDENTITY.0, IDENTITY.1);
    let (frames, faults) = exchange(&mut bus, "605#4018100400000000");
    assert_eq!(frames, ["585#4318100411270000", "585#4318100412270000"]);
    assert!(faults.contains(&Fault::Protocol), "{faults:?}");
}
