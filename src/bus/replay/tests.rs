//! Recordings in all forms, and files that are none.

use super::*;
use std::cell::RefCell;
use std::rc::Rc;

const START: Mono = Mono::START;

fn replay(text: &'static str) -> Replay {
    Replay::new("x.log", Box::new(text.as_bytes()), Box::new(|_| {}))
}

/// The notes about a recording that is replayed to its end.
fn notes(text: &'static str) -> Vec<ReplayNote> {
    let notes = Rc::new(RefCell::new(Vec::new()));
    let sink = Rc::clone(&notes);
    let mut bus = Replay::new(
        "x.log",
        Box::new(text.as_bytes()),
        Box::new(move |note: &ReplayNote| sink.borrow_mut().push(note.clone())),
    );
    while let Ok(Event::Frame(_)) = bus.receive(START + Duration::from_secs(3600)) {}
    drop(bus);
    notes.take()
}

fn all(text: &'static str) -> Vec<String> {
    let mut bus = replay(text);
    let mut seen = Vec::new();
    for _ in 0..20 {
        let event = bus.receive(START + Duration::from_secs(3600));
        seen.push(match event {
            Ok(Event::Frame(received)) => {
                format!("{} {}", received.at.mono.since_start().as_micros(), received.frame)
            }
            Ok(Event::Fault(fault, at)) => format!("{} {fault:?}", at.mono.since_start().as_micros()),
            Ok(Event::Ended) => {
                seen.push("end".to_owned());
                return seen;
            }
            Ok(event) => format!("{event:?}"),
            Err(error) => {
                seen.push(error.to_string());
                return seen;
            }
        });
    }
    seen
}

#[test]
fn frames_at_their_times() {
    assert_eq!(
        all("(1700000000.000100) can0 181#0102\n\n(1700000000.250100) can0 080#\n(1700000001.0001) can0 705#R1 R\n"),
        ["0 181#0102", "250000 080#", "1000000 705#R1", "end"]
    );
}

#[test]
fn error_frames_are_faults_and_fd_frames_are_ignored() {
    assert_eq!(
        all("(1.0) can0 20000040#0000000000000000\n(2.0) can0 123##1AABB\n(3.0) can0 200000A8#00\n"),
        ["0 BusOff", "2000000 NoAcknowledge", "end"]
    );
}

#[test]
fn a_truncated_last_line_is_skipped_and_reported() {
    let text = "(1700000001.5) can0 181#01\n(1700000002.5) can0 18";
    assert_eq!(all(text), ["0 181#01", "end"]);
    assert_eq!(notes(text), [ReplayNote::CutOff(2)]);
}

#[test]
fn broken_lines_are_skipped_and_counted() {
    let text = "(1.5) can0 181#01\n(2.0) c\n  can0  181   [1]  01\n\u{fffd}\n(3.0) can0 181#02\n";
    assert_eq!(all(text), ["0 181#01", "1500000 181#02", "end"]);
    assert_eq!(notes(text), [ReplayNote::NoDate, ReplayNote::Skipped { count: 3, first: 2 }]);
    assert_eq!(notes("(1700000000.1) c 181#01\n"), []);
}

#[test]
fn a_line_that_is_too_long_is_one_line() {
    let text: String = format!("(1.5) c 181#01\n{} (2.0) c 181#02\n(3.0) c 181#03\n", "x".repeat(5000));
    assert_eq!(all(text.leak()), ["0 181#01", "1500000 181#03", "end"]);
}

#[test]
fn byte_order_mark_comments_and_other_line_ends() {
    let frames = ["0 181#01", "1000000 181#02", "end"];
    for text in [
        "\u{feff}(1700000000.0) can0 181#01\n(1700000001.0) can0 181#02\n",
        "# bench 2\n; and more\n(1700000000.0) can0 181#01\n(1700000001.0) can0 181#02\n",
        "\u{feff}# bench 2\r\n(1700000000.0) can0 181#01\r\n(1700000001.0) can0 181#02\r\n",
        " (1700000000.000000)  can0  181   [1]  01\n (1700000001.000000)  can0  181   [1]  02\n",
    ] {
        assert_eq!(all(text), frames, "{text}");
    }
}

#[test]
fn files_that_are_no_recordings_are_named() {
    for (text, message) in [
        ("", "the file is empty"),
        (" \n\n", "the file is empty"),
        ("nonsense\nmore\n", "not a candump log: no line has a time, an interface and a frame"),
        ("(1.5) can0 181\n", "not a candump log: no line has a time, an interface and a frame"),
        (
            "date Mon Jan 1 10:00:00 2024\nbase hex  timestamps absolute\n",
            "this is a Vector ASC file, not a candump log",
        ),
        (";$FILEVERSION=2.1\n;\n", "this is a PEAK TRC file, not a candump log"),
        ("timestamp,arbitration_id,extended\n", "this is a CSV file of python-can, not a candump log"),
        ("time,elapsed_s,node,signal,value,unit,status,raw\n", "this is a CSV file of measurements, not a candump log"),
        ("; exported\n;$FILEVERSION=1.1\n;\n", "this is a PEAK TRC file, not a candump log"),
        ("LOGG\x01\x02", "this is a Vector BLF file, not a candump log"),
        ("\n\r\r\n\x1c\0\0\0", "this is a Wireshark capture, not a candump log"),
        ("UnFinMF 4.10", "this is an MDF file, not a candump log"),
    ] {
        assert_eq!(all(text), [format!("replay x.log: {message}")], "{text}");
    }
    assert_eq!(FileFormat::of(b"\x1f\x8b\x08"), Some(FileFormat::Gzip));
}

#[test]
fn frames_without_times_are_an_error() {
    let text = "# x\n  can0  181   [1]  01\n  can0  181   [1]  02\n";
    assert_eq!(all(text), ["replay x.log:2: the frames have no times"]);
}

#[test]
fn intervals_are_no_times() {
    let error =
        "replay x.log:1: the times do not increase: they seem to be intervals from frame to frame (candump -td)";
    for text in [
        "(0.000000) c 181#01\n(0.001000) c 181#01\n(0.001000) c 181#01\n",
        "(0.000000) c 181#01\n(0.100000) c 181#01\n(0.086000) c 181#01\n(0.101000) c 181#01\n",
        " (000.000000)  c  181   [1]  01\n (000.002000)  c  181   [1]  01\n (000.001000)  c  181   [1]  01\n",
    ] {
        assert_eq!(all(text), [error], "{text}");
    }
    // Counted from the start of the recording.
    assert_eq!(all("(0.0) c 181#01\n(0.1) c 181#02\n(0.3) c 181#03\n").len(), 4);
}

#[test]
fn two_interfaces_are_an_error() {
    let seen = all("(1.5) can0 181#01\n(1.6) can1 181#02\n");
    assert_eq!(seen[1], "replay x.log:2: frames of can1 and of can0: select one interface (grep)");
}

#[test]
fn a_clock_that_is_set_back_keeps_the_order() {
    assert_eq!(
        all("(1700000009.0) c 181#01\n(1700000009.5) c 181#02\n(1700000003.0) c 181#03\n(1700000009.7) c 181#04\n"),
        ["0 181#01", "500000 181#02", "500000 181#03", "700000 181#04", "end"]
    );
}

#[test]
fn time_passes_up_to_the_deadline_and_the_end_is_reported_once() -> Result<(), BusError> {
    let mut bus = replay("(1.0) c 181#01\n(3.0) c 181#02\n");
    assert!(matches!(bus.receive(START)?, Event::Frame(_)));
    let (deadline, later) = (START + Duration::from_secs(1), START + Duration::from_secs(9));
    assert_eq!(bus.receive(deadline)?, Event::Timeout);
    assert_eq!(bus.now(), Stamp { mono: deadline, wall: Wall::at(Duration::from_secs(2)) });
    assert!(matches!(bus.receive(later)?, Event::Frame(_)));
    assert_eq!(bus.receive(later)?, Event::Ended);
    assert_eq!(bus.receive(later)?, Event::Timeout);
    assert!(matches!(bus.send(&Frame::empty(crate::canopen::id::CanId::SYNC)), Err(BusError::ReceiveOnly(_))));
    Ok(())
}

#[test]
fn step_of_the_clock_takes_no_time_and_is_reported() {
    // The clock of a computer without a battery: 1970 until NTP answers.
    let log = "(100.000000) can0 181#01\n(101.000000) can0 181#02\n(1735689600.000000) can0 181#03\n\
               (1735689601.500000) can0 181#04\n";
    assert_eq!(all(log), ["0 181#01", "1000000 181#02", "1000000 181#03", "2500000 181#04", "end"]);
    let by = Duration::from_secs(1_735_689_600 - 101);
    let noted = notes(log);
    assert!(noted.contains(&ReplayNote::ClockSet { count: 1, line: 3, by, is_backwards: false }), "{noted:?}");
    // Set back twice. A frame that is a little too early is none.
    let log = "(1700000010.000000) can0 181#01\n(1700000009.995000) can0 181#02\n(1700000005.000000) can0 181#03\n\
               (1700000006.000000) can0 181#04\n(1700000001.000000) can0 181#05\n(1700000001.250000) can0 181#06\n";
    let times = ["0 181#01", "0 181#02", "0 181#03", "1000000 181#04", "1000000 181#05", "1250000 181#06", "end"];
    assert_eq!(all(log), times);
    let by = Duration::from_secs(5);
    assert_eq!(notes(log), [ReplayNote::ClockSet { count: 2, line: 3, by, is_backwards: true }]);
    // A quiet weekend is a pause, hour for hour; the wall time goes with it.
    assert_eq!(notes("(1700000000.000000) can0 181#01\n(1700050000.000000) can0 181#02\n"), []);
}
