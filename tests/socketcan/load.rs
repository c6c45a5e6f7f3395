//! Too many frames: for the receive buffer, for the transmit queue, for a deadline.

use crate::{Can, ahead, assert_nothing_more, frame, run};
use cangauge::bus::{Bus, BusError, Event, Filters};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A frame that contains a number.
fn numbered(id: u16, number: u32) -> Frame {
    Frame::new(CanId::Standard(id), &number.to_le_bytes()).unwrap()
}

/// Sends a frame, and waits while the queue is full.
fn send(bus: &mut dyn Bus, frame: &Frame) {
    while let Err(error) = bus.send(frame) {
        assert!(matches!(error, BusError::QueueFull), "{error:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Receives all frames. Returns their numbers, and the reported number of lost frames.
fn drain(bus: &mut dyn Bus) -> (Vec<u32>, u32) {
    let (mut numbers, mut lost) = (Vec::new(), 0);
    loop {
        let deadline = ahead(bus, 30);
        match bus.receive(deadline).unwrap() {
            Event::Frame(received) => numbers.push(u32::from_le_bytes(received.frame.data().try_into().unwrap())),
            Event::Dropped(more) => lost += more,
            Event::Timeout => return (numbers, lost),
            event => panic!("{event:?}"),
        }
    }
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn every_lost_frame_is_counted() {
    const COUNT: u32 = 100_000;
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    bus.listen(&Filters::Only(vec![CanId::Standard(0x181)])).unwrap();
    let mut sent = 0;
    let mut known = (0, 0);
    for burst in [COUNT, 10, 1000] {
        for number in 0..burst {
            send(&mut sender, &numbered(0x181, sent + number));
            // Frames that do not match the filters are not counted.
            send(&mut sender, &numbered(0x182, number));
        }
        sent += burst;
        let (numbers, lost) = drain(&mut bus);
        assert!(numbers.is_sorted_by(|a, b| a < b));
        known = (known.0 + u32::try_from(numbers.len()).unwrap(), known.1 + lost);
    }
    assert!(known.1 > 0, "nothing was lost: the buffer held {COUNT} frames");
    assert!(known.0 > 10_000, "only {} frames found room in the buffer", known.0);
    assert_eq!(known.0 + known.1, sent, "{known:?}");
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn drops_after_the_last_frame_are_counted_on_request() {
    const COUNT: u32 = 100_000;
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    sender.listen(&Filters::Only(Vec::new())).unwrap();
    assert_eq!(bus.unreported_drops(), 0);
    let buffer = bus.receive_buffer().expect("the kernel reports it");
    assert!(!buffer.is_small(), "root gets the requested size: {buffer:?}");
    for number in 0..COUNT {
        send(&mut sender, &numbered(0x181, number));
    }
    // No frame arrives after the lost ones, so no event reports them.
    let (numbers, reported) = drain(&mut bus);
    let late = bus.unreported_drops();
    assert!(late > 0, "nothing was lost: the buffer held {COUNT} frames");
    assert_eq!((u32::try_from(numbers.len()).unwrap() + reported + late, bus.unreported_drops()), (COUNT, 0));
    // Later frames do not report them again.
    send(&mut sender, &numbered(0x181, COUNT));
    assert_eq!(drain(&mut bus), (vec![COUNT], 0));
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_full_transmit_queue_is_reported_and_empties() {
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    // 32 kbit/s and a short queue, as on a slow bus.
    let queue = ["qdisc", "replace", "dev", &can.name, "root", "tbf", "rate", "32kbit", "burst", "100", "limit", "160"];
    run("tc", &queue);
    let mut refused = 0;
    for number in 0..100 {
        while let Err(error) = sender.send(&numbered(0x181, number)) {
            assert!(matches!(error, BusError::QueueFull), "{error:?}");
            refused += 1;
            std::thread::sleep(Duration::from_millis(1));
        }
    }
    assert!(refused > 0);
    std::thread::sleep(Duration::from_millis(200));
    let (numbers, lost) = drain(&mut bus);
    run("tc", &["qdisc", "del", "dev", &can.name, "root"]);
    assert_eq!((numbers, lost), ((0..100).collect(), 0));
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn filtered_traffic_does_not_delay_a_deadline() {
    let can = Can::get();
    let stop = Arc::new(AtomicBool::new(false));
    let mut bus = can.open();
    // More filters than the kernel accepts, so the program discards the other frames.
    bus.listen(&Filters::Only((0x200..=0x200 + 600).map(CanId::Standard).collect())).unwrap();
    let (mut sender, stopped) = (can.open(), Arc::clone(&stop));
    let flood = std::thread::spawn(move || {
        while !stopped.load(Ordering::Relaxed) {
            send(&mut sender, &frame("181#0102030405060708"));
        }
    });
    for _ in 0..20 {
        let deadline = ahead(&bus, 5);
        let event = bus.receive(deadline).unwrap();
        // Drops may occur under this load.
        assert!(matches!(event, Event::Timeout | Event::Dropped(_)), "{event:?}");
        let late = bus.now().mono.since(deadline);
        assert!(late < Duration::from_secs(2), "{late:?} late");
    }
    stop.store(true, Ordering::Relaxed);
    flood.join().unwrap();
    while bus.receive(ahead(&bus, 30)).unwrap() != Event::Timeout {}
    assert_nothing_more(&mut bus);
}
