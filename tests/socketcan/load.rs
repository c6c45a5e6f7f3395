//! More frames than fit: in the receive buffer, in the send queue, in the time until a deadline.

use crate::{Can, ahead, assert_nothing_more, frame, run};
use cangauge::bus::{Bus, BusError, Event, Filters};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A frame that carries a number.
fn numbered(id: u16, number: u32) -> Frame {
    Frame::new(CanId::Standard(id), &number.to_le_bytes()).unwrap()
}

/// Sends, waiting while the queue is full.
fn send(bus: &mut dyn Bus, frame: &Frame) {
    while let Err(error) = bus.send(frame) {
        assert!(matches!(error, BusError::QueueFull), "{error:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The numbers received and the count of those said to be lost, until nothing more is there.
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
            // Frames that are not wanted do not count, lost or not.
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
fn frames_that_were_lost_last_are_counted_when_asked() {
    const COUNT: u32 = 100_000;
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    sender.listen(&Filters::Only(Vec::new())).unwrap();
    assert_eq!(bus.late_drops(), 0);
    let buffer = bus.receive_buffer().expect("the kernel tells it");
    assert!(!buffer.is_small(), "root may have what it wants: {buffer:?}");
    for number in 0..COUNT {
        send(&mut sender, &numbered(0x181, number));
    }
    // No frame comes after those that were lost, and so nothing tells of them.
    let (numbers, told) = drain(&mut bus);
    let late = bus.late_drops();
    assert!(late > 0, "nothing was lost: the buffer held {COUNT} frames");
    assert_eq!((u32::try_from(numbers.len()).unwrap() + told + late, bus.late_drops()), (COUNT, 0));
    // What comes later does not tell them again.
    send(&mut sender, &numbered(0x181, COUNT));
    assert_eq!(drain(&mut bus), (vec![COUNT], 0));
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_full_send_queue_says_so_and_empties() {
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    // 32 kbit/s and a queue of a few frames, as a slow bus has.
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
fn traffic_that_nobody_wants_extends_no_deadline() {
    let can = Can::get();
    let stop = Arc::new(AtomicBool::new(false));
    let mut bus = can.open();
    // More than the kernel takes, so that the program has to throw the rest away.
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
        // A drop is no wonder under such load.
        assert!(matches!(event, Event::Timeout | Event::Dropped(_)), "{event:?}");
        let late = bus.now().mono.since(deadline);
        assert!(late < Duration::from_secs(2), "{late:?} late");
    }
    stop.store(true, Ordering::Relaxed);
    flood.join().unwrap();
    while bus.receive(ahead(&bus, 30)).unwrap() != Event::Timeout {}
    assert_nothing_more(&mut bus);
}
