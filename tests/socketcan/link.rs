//! Missing and recreated interfaces, link changes, signals, deadlines.

use crate::{Can, ahead, assert_nothing_more, frame, next, next_frame, run};
use cangauge::bus::socketcan::SocketCan;
use cangauge::bus::{Bus, BusError, Event, Filters, Mono};
use cangauge::canopen::id::CanId;
use std::time::Duration;

fn refused(name: &str) -> BusError {
    match SocketCan::open(name) {
        Err(error) => error,
        Ok(_) => panic!("{name} could be opened"),
    }
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn errors_name_why_an_interface_cannot_be_opened() {
    let can = Can::get();
    for name in ["nosuchcan", "", "a-name-longer-than-any-interface", "a/b"] {
        assert!(matches!(refused(name), BusError::NoInterface(of) if of == name), "{name}");
    }
    assert!(matches!(refused("lo"), BusError::NotCan(of) if of == "lo"));
    can.switch("down");
    assert!(matches!(refused(&can.name), BusError::Down(of) if of == can.name));
    can.switch("up");
    can.open();
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn the_link_goes_down_and_comes_back() {
    let can = Can::get();
    let (mut bus, mut other) = (can.open(), can.open());
    can.switch("down");
    assert_eq!(next(&mut bus), Event::Link(false));
    assert_nothing_more(&mut bus);
    assert!(matches!(bus.send(&frame("000#8000")), Err(BusError::Down(of)) if of == can.name));
    // The first call to send gets the error; the link event is also reported.
    assert!(matches!(other.send(&frame("000#8000")), Err(BusError::Down(_))));
    assert_eq!(next(&mut other), Event::Link(false));
    can.switch("up");
    assert_eq!(next(&mut bus), Event::Link(true));
    other.send(&frame("181#01")).unwrap();
    assert_eq!(next_frame(&mut bus), "181#01");
    assert_nothing_more(&mut bus);
    bus.send(&frame("182#02")).unwrap();
    assert_eq!(next(&mut other), Event::Link(true));
    assert_eq!(next_frame(&mut other), "182#02");
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn down_and_up_between_two_calls_is_reported() {
    let can = Can::get();
    let (mut bus, mut other) = (can.open(), can.open());
    can.switch("down");
    can.switch("up");
    assert!(matches!(other.send(&frame("181#01")), Err(BusError::Down(_))), "the first call reports it");
    other.send(&frame("181#01")).unwrap();
    assert_eq!(next(&mut bus), Event::Link(false));
    assert_eq!(next(&mut bus), Event::Link(true));
    assert_eq!(next_frame(&mut bus), "181#01");
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_recreated_interface_is_opened_again() {
    let _can = Can::get();
    run("ip", &["link", "add", "dev", "gone0", "type", "vcan"]);
    run("ip", &["link", "set", "gone0", "up"]);
    let mut bus = SocketCan::open("gone0").unwrap();
    bus.listen(&Filters::Only(vec![CanId::Standard(0x181)])).unwrap();
    run("ip", &["link", "del", "gone0"]);
    assert_eq!(next(&mut bus), Event::Link(false));
    assert_nothing_more(&mut bus);
    assert!(matches!(bus.send(&frame("080#")), Err(BusError::NoInterface(of)) if of == "gone0"));
    assert_nothing_more(&mut bus);
    // A new interface of the same name is found: first down, then up.
    run("ip", &["link", "add", "dev", "gone0", "type", "vcan"]);
    let deadline = ahead(&bus, 500);
    assert_eq!(bus.receive(deadline).unwrap(), Event::Timeout);
    assert!(matches!(bus.send(&frame("080#")), Err(BusError::Down(_))));
    run("ip", &["link", "set", "gone0", "up"]);
    assert_eq!(next(&mut bus), Event::Link(true));
    let mut other = SocketCan::open("gone0").unwrap();
    other.send(&frame("182#02")).unwrap();
    other.send(&frame("181#01")).unwrap();
    assert_eq!(next_frame(&mut bus), "181#01", "the filters are unchanged");
    bus.send(&frame("183#03")).unwrap();
    assert_eq!(next_frame(&mut other), "183#03");
    run("ip", &["link", "del", "gone0"]);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_wait_never_ends_before_the_deadline() {
    let can = Can::get();
    let mut bus = can.open();
    for micros in [0, 1, 300, 900, 1000, 1700, 10_300, 50_000] {
        let deadline = bus.now().mono + Duration::from_micros(micros);
        assert_eq!(bus.receive(deadline).unwrap(), Event::Timeout);
        let late = bus.now().mono.since(deadline);
        assert!(bus.now().mono >= deadline);
        // Checks only that the wait is not rounded to seconds, because machines may be slow.
        assert!(late < Duration::from_secs(2), "{micros} µs became {late:?} more");
    }
    assert_eq!(bus.receive(Mono::START).unwrap(), Event::Timeout);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn waiting_frames_are_received_with_a_deadline_in_the_past() {
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    assert_nothing_more(&mut bus);
    sender.send(&frame("181#01")).unwrap();
    assert!(matches!(bus.receive(Mono::START).unwrap(), Event::Frame(_)));
    assert_eq!(bus.receive(Mono::START).unwrap(), Event::Timeout);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_signal_ends_a_wait_once() {
    let can = Can::get();
    let (mut bus, mut other) = (can.open(), can.open());
    let raise = || signal_hook::low_level::raise(signal_hook::consts::SIGINT);
    let raiser = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(50));
        raise()
    });
    assert_eq!(next(&mut bus), Event::Interrupted);
    raiser.join().unwrap().unwrap();
    assert_nothing_more(&mut bus);
    // The bus can still be used for cleaning up.
    bus.send(&frame("000#8000")).unwrap();
    raise().unwrap();
    assert_eq!(next(&mut bus), Event::Interrupted);
    assert_nothing_more(&mut bus);
    // Another bus of the same process also gets both signals.
    assert_eq!(next(&mut other), Event::Interrupted);
    assert_eq!(next(&mut other), Event::Interrupted);
    assert_eq!(next_frame(&mut other), "000#8000");
}
