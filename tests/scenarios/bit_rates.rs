//! Devices and the program at different bit rates: who is heard, what errors come, and the way back.

use cangauge::bus::memory::MemoryBus;
use cangauge::bus::{BitRateControl, Bus, Event, Fault, Mode};
use cangauge::sim::{Bench, Device};
use std::path::Path;
use std::time::Duration;

fn bench(devices: &str) -> MemoryBus {
    Bench::from_toml(&format!("clock = \"virtual\"\n{devices}"), Path::new("")).unwrap().open().unwrap()
}

/// What comes within `wait`.
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

/// Sends, and gives what comes within 100 ms.
fn ask(bus: &mut MemoryBus, frame: &str) -> (Vec<String>, Vec<Fault>) {
    bus.send(&frame.parse().unwrap()).unwrap();
    events(bus, Duration::from_millis(100))
}

fn ok(bus: &mut MemoryBus, frame: &str, answer: &str) {
    let (frames, faults) = ask(bus, frame);
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
fn the_program_follows_a_device_and_the_rate_is_kept_only_when_it_is_stored() {
    for stores in [false, true] {
        let mut bus = bench("[[device]]\nkind = \"mh4\"\nnode = 5\n");
        events(&mut bus, Duration::from_millis(100));
        activate(&mut bus);
        // Within the first delay it still acknowledges, and is silent.
        ok(&mut bus, IDENTITY.0, "");
        let (frames, faults) = events(&mut bus, Duration::from_secs(2));
        assert_eq!((frames.len(), faults.len()), (0, 0));
        // At the old rate there is nobody any more.
        let (frames, faults) = ask(&mut bus, IDENTITY.0);
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
        let (frames, _) = ask(&mut bus, IDENTITY.0);
        assert_eq!(frames, ["705#00", IDENTITY.1]);
    }
}

#[test]
fn a_device_that_does_not_come_back_acknowledges_nothing() {
    let mut bus = bench("[[device]]\nkind = \"mh4\"\nnode = 5\noffline_after = [\"activate\"]\n");
    events(&mut bus, Duration::from_millis(100));
    activate(&mut bus);
    events(&mut bus, Duration::from_secs(2));
    for rate in [125_000, 250_000] {
        bus.set_bit_rate(rate, Mode::Normal).unwrap();
        let (frames, faults) = ask(&mut bus, IDENTITY.0);
        assert_eq!(frames.len(), 0);
        assert!(faults.contains(&Fault::NoAcknowledge) && !faults.contains(&Fault::Protocol), "{faults:?}");
    }
    bus.power_cycle();
    let (frames, _) = ask(&mut bus, "080#");
    assert!(frames.contains(&"705#00".to_owned()), "{frames:?}");
}

#[test]
fn a_running_bus_is_heard_at_its_own_rate_only_and_not_disturbed() {
    let device = |node: u8| {
        format!("[[device]]\nkind = \"mh4\"\nnode = {node}\nbit_rate = 500000\nset = {{ \"0x1017\" = 100 }}\n")
    };
    // Two acknowledge each other's frames; a single one is not acknowledged by somebody who only listens.
    for (nodes, is_heard) in [(&[1, 2][..], true), (&[1], false)] {
        let mut bus = bench(&nodes.iter().map(|&node| device(node)).collect::<String>());
        for rate in [1_000_000, 800_000, 500_000, 250_000, 125_000, 50_000] {
            bus.set_bit_rate(rate, Mode::ListenOnly).unwrap();
            let (frames, faults) = events(&mut bus, Duration::from_millis(500));
            assert_eq!(!frames.is_empty(), is_heard && rate == 500_000, "{rate}: {frames:?}");
            assert_eq!(faults.contains(&Fault::Protocol), !(is_heard && rate == 500_000), "{rate}");
        }
        // Nothing was disturbed: in its turn everybody has all that the others sent.
        bus.set_bit_rate(500_000, Mode::Normal).unwrap();
        let (frames, faults) = events(&mut bus, Duration::from_secs(1));
        assert!(frames.len() >= 9 * nodes.len(), "{frames:?}");
        assert_eq!(faults, []);
    }
}

#[test]
fn two_that_answer_together_with_different_serial_numbers_are_seen() {
    let mut bus =
        bench("[[device]]\nkind = \"mh4\"\nnode = 5\n[[device]]\nkind = \"mh4\"\nnode = 5\nduplicate_id = true\n");
    // What they say alike comes once, as on a wire.
    let (frames, faults) = events(&mut bus, Duration::from_millis(100));
    assert_eq!((frames, faults), (vec!["705#00".to_owned()], vec![]));
    ok(&mut bus, IDENTITY.0, IDENTITY.1);
    let (frames, faults) = ask(&mut bus, "605#4018100400000000");
    assert_eq!(frames, ["585#4318100411270000", "585#4318100412270000"]);
    assert!(faults.contains(&Fault::Protocol), "{faults:?}");
}
