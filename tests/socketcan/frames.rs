//! Which frames arrive, with which times.

use crate::{Can, ahead, assert_nothing_more, frame, next, next_frame};
use cangauge::bus::socketcan::{Interface, interfaces};
use cangauge::bus::trace::Traced;
use cangauge::bus::{BitRateControl, Bus, Event, Fault, Filters, Received, TimestampSource};
use cangauge::canopen::id::CanId;
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn frames_arrive_as_sent_and_in_order() {
    let can = Can::get();
    let (mut here, mut there) = (can.open(), can.open());
    let texts = ["000#8001", "080#", "181#0102030405060708", "7FF#FF", "1FFFFFFF#A0", "00000181#01", "701#R", "705#R1"];
    for text in texts {
        here.send(&frame(text)).unwrap();
    }
    for text in texts {
        assert_eq!(next_frame(&mut there), text);
    }
    assert_nothing_more(&mut there);
    // A socket does not receive its own frames.
    assert_nothing_more(&mut here);
    there.send(&frame("601#40")).unwrap();
    assert_eq!(next_frame(&mut here), "601#40");
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn the_interface_is_described() {
    let can = Can::get();
    let bus = can.open();
    assert_eq!(bus.name(), can.name);
    assert_eq!(bus.bit_rate(), None, "a virtual bus has no bit rate");
    assert_eq!(bus.timestamps(), TimestampSource::Kernel);
    let own = Interface { name: can.name.clone(), up: true, driver: None };
    assert!(interfaces().contains(&own), "{:?}", interfaces());
    assert!(interfaces().iter().all(|interface| interface.name != "lo"));
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn both_times_are_arrival_times() {
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    let mut moments = vec![bus.now()];
    for _ in 0..3 {
        sender.send(&frame("181#01")).unwrap();
        std::thread::sleep(Duration::from_millis(60));
        moments.push(bus.now());
    }
    // All three are read now, long after their arrival.
    for pair in moments.windows(2) {
        let Event::Frame(Received { at, .. }) = next(&mut bus) else { panic!("no frame") };
        assert!(pair[0].wall <= at.wall && at.wall <= pair[1].wall, "{at:?} not within {pair:?}");
        // The two clocks are read one after the other, so the monotonic time may differ by this time.
        let slack = Duration::from_millis(2);
        assert!(pair[0].mono - slack <= at.mono && at.mono <= pair[1].mono + slack, "{at:?} not within {pair:?}");
        assert!(pair[1].mono.since(at.mono) > Duration::from_millis(50), "{at:?}: the time of reading?");
    }
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn only_frames_that_match_the_filters_arrive() {
    let can = Can::get();
    let (mut sender, mut bus) = (can.open(), can.open());
    let mut texts_of = |filters: &Filters| {
        bus.listen(filters).unwrap();
        for text in ["181#01", "00000181#02", "181#R1", "182#03", "00000182#04", "1F000181#05"] {
            sender.send(&frame(text)).unwrap();
        }
        let mut texts = Vec::new();
        let deadline = ahead(&bus, 100);
        while let Event::Frame(received) = bus.receive(deadline).unwrap() {
            texts.push(received.frame.to_string());
        }
        texts
    };
    let (standard, extended) = (CanId::Standard(0x181), CanId::Extended(0x181));
    assert_eq!(texts_of(&Filters::Only(vec![standard])), ["181#01", "181#R1"]);
    assert_eq!(texts_of(&Filters::Only(vec![extended, extended])), ["00000181#02"]);
    assert_eq!(texts_of(&Filters::Only(vec![CanId::Standard(0x182), standard])), ["181#01", "181#R1", "182#03"]);
    assert_eq!(texts_of(&Filters::Only(vec![])), [""; 0]);
    // More filters than the kernel accepts.
    let many = (0x181..=0x181 + 1200u16).step_by(2).map(CanId::Standard).chain([extended]).collect();
    assert_eq!(texts_of(&Filters::Only(many)), ["181#01", "00000181#02", "181#R1"]);
    assert_eq!(texts_of(&Filters::All).len(), 6);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn can_fd_frames_have_no_effect() {
    let can = Can::get();
    let mut bus = can.open();
    can.cansend("123##1112233445566778899AABBCC");
    can.cansend("123##311");
    can.cansend("123#11");
    assert_eq!(next_frame(&mut bus), "123#11");
    assert_nothing_more(&mut bus);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn error_frames_are_faults_with_any_filter() {
    let can = Can::get();
    let mut bus = can.open();
    bus.listen(&Filters::Only(vec![CanId::SYNC])).unwrap();
    can.cansend("20000204#000C000000006064");
    can.cansend("20000044#0030000000000000");
    can.cansend("080#");
    for expected in [Fault::ErrorWarning, Fault::ErrorPassive, Fault::BusOff] {
        assert!(matches!(next(&mut bus), Event::Fault(fault, _) if fault == expected), "{expected}");
    }
    assert_eq!(next_frame(&mut bus), "080#");
    assert_nothing_more(&mut bus);
}

/// A file in memory.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, buf: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().write(buf)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_trace_equals_the_log_of_candump() {
    let can = Can::get();
    let mut sender = can.open();
    let file = Memory::default();
    let mut bus = Traced::new(can.open(), Box::new(file.clone()), "memory");
    let texts = ["000#8001", "181#0102030405060708", "1FFFFFFF#A0", "705#R1"];
    let count = texts.len().to_string();
    let mut candump =
        Command::new("candump").args(["-L", "-n", &count, &can.name]).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(candump.stdout.take().unwrap()).lines();
    // candump does not report when it listens, but the kernel does.
    let listeners = || {
        let list = std::fs::read_to_string("/proc/net/can/rcvlist_all").unwrap();
        list.lines().filter(|line| line.contains(&format!(" {} ", can.name)) && line.ends_with("raw")).count()
    };
    let deadline = ahead(&bus, 20_000);
    while listeners() < 3 {
        assert!(bus.now().mono < deadline, "candump does not listen");
        std::thread::sleep(Duration::from_millis(10));
    }
    for text in texts {
        sender.send(&frame(text)).unwrap();
    }
    let mut expected = String::new();
    for _ in texts {
        next_frame(&mut bus);
        expected += &lines.next().unwrap().unwrap();
        expected.push('\n');
    }
    assert!(candump.wait().unwrap().success());
    bus.finish().unwrap();
    assert_eq!(String::from_utf8_lossy(&file.0.lock().unwrap()), expected);
}
