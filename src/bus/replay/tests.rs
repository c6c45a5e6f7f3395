//! Tests of recordings in all formats, and of other files.

use super::*;
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::{Arc, Mutex};

const START: Mono = Mono::START;

/// The events of a text in one format: milliseconds, channel and frame.
pub(super) fn lines(parser: &mut dyn Parser, text: &str) -> Vec<String> {
    let event = |line: &str| match parser.line(line.trim()) {
        Line::Event(wall, channel, event) => {
            let event = event.map_or_else(|fault| format!("{fault:?}"), |frame| frame.to_string());
            Some(format!("{} {channel} {event}", wall.since_epoch().as_millis()))
        }
        Line::Ignored => None,
        line => Some(format!("{line:?}")),
    };
    text.lines().filter_map(event).collect()
}

fn replay_of(bytes: &'static [u8], report: Report) -> Replay {
    Replay::new("x.log", Lines::new(Box::new(bytes)).expect("readable"), report)
}

fn replay(text: &'static str) -> Replay {
    replay_of(text.as_bytes(), Box::new(|_| {}))
}

/// The notes about a recording that is replayed to its end.
fn notes(text: &'static str) -> Vec<ReplayNote> {
    let notes = Rc::new(RefCell::new(Vec::new()));
    let sink = Rc::clone(&notes);
    let report = move |note: &ReplayNote| sink.borrow_mut().push(note.clone());
    let mut bus = replay_of(text.as_bytes(), Box::new(report));
    while let Ok(Event::Frame(_)) = bus.receive(START + Duration::from_secs(3600)) {}
    drop(bus);
    notes.take()
}

fn all(text: &'static str) -> Vec<String> {
    events(replay(text))
}

fn events(mut bus: Replay) -> Vec<String> {
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
    assert_eq!(
        notes(text),
        [ReplayNote::NoDate, ReplayNote::Skipped { format: RecordingFormat::Candump, count: 3, first: 2 }]
    );
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
    let unknown = "not a recording in a known format (candump, Vector ASC, PEAK TRC, CSV of python-can)";
    for (text, message) in [
        ("", "the file is empty"),
        (" \n\n", "the file is empty"),
        ("# a comment\n", "the file is empty"),
        ("nonsense\nmore\n", unknown),
        ("\x7fELF\x02\x01\x01\0\0\0", unknown),
        (
            "date Mon Jan 1 10:00:00 2024\nbase hex  timestamps absolute\n",
            "this is a Vector ASC file without classic CAN frames",
        ),
        (";$FILEVERSION=2.1\n;\n", "this is a PEAK TRC file without classic CAN frames"),
        ("; exported\n;$FILEVERSION=1.1\n;\n", "this is a PEAK TRC file without classic CAN frames"),
        ("timestamp,arbitration_id,extended\n", "this is a CSV file of python-can without classic CAN frames"),
    ] {
        assert_eq!(all(text), [format!("replay x.log: {message}")], "{text}");
    }
    let cut = "replay x.log:1: this looks like a candump log, but none of its lines could be read";
    assert_eq!(all("(1.5) can0 181\n"), [cut]);
    for (text, name) in [
        ("time,elapsed_s,node,signal,value,unit,status,raw\n", "a CSV file of measurements"),
        ("Time Stamp,ID,Extended,Dir,Bus,LEN,D1\n", "a CSV file of SavvyCAN"),
        ("***BUSMASTER Ver 3.2.2***\n", "a BUSMASTER log"),
        ("Chn Identifier Flg   DLC\n", "a text file of Kvaser"),
        ("\"ASCII Trace IXXAT minimon V3.5\"\n", "a trace of the IXXAT analyser"),
        ("Line,Abs Time(Sec),Rel Time (Sec)\n", "a CSV file of Vehicle Spy"),
        ("TimestampEpoch;BusChannel;ID\n", "a CSV file of the CANedge"),
        ("Timestamp: 1.0 ID: 0181\n", "the screen output of python-can"),
        ("<?xml version=\"1.0\"?>\n", "an XML file"),
        ("LOGG\x01\x02", "a Vector BLF file"),
        ("\n\r\r\n\x1c\0\0\0", "a Wireshark capture"),
        ("UnFinMF 4.10", "an MDF file"),
        ("SQLite format 3\0 ", "an SQLite database"),
        ("PK\x03\x04", "a zip archive"),
        ("BZh91AY", "a bzip2 file"),
    ] {
        let expected = format!("replay x.log: this is {name}, which cannot be replayed");
        assert_eq!(all(text), [expected], "{text}");
    }
}

/// Two frames, 250 ms apart, in every format.
const FORMS: [&str; 6] = [
    "(1700000000.000000) 1 181#01\n(1700000000.250000) 1 01890ABC#\n",
    "date Tue Nov 14 2023 10:00:00\nbase hex timestamps absolute\n0.0 1 181 Rx d 1 01\n0.25 1 1890ABCx Tx d 0\n",
    "0.5 1 181 Rx d 1 01\n0.75 1 1890ABCx Tx d 0\n",
    ";$FILEVERSION=1.1\n;$STARTTIME=45244.5\n1) 0.0 Rx 0181 1 01\n2) 250.0 Rx 01890ABC 0\n",
    "1) 0 0181 1 01\n2) 250 01890ABC 0\n",
    "timestamp,arbitration_id,extended,remote,error,dlc,data\n1.7e9,0x181,0,0,0,1,AQ==\n1700000000.25,0x1890abc,1,0,0,0,\n",
];

#[test]
fn all_formats_alike() {
    let expected = ["0 181#01", "250000 01890ABC#", "end"];
    let packed = |text: &str| {
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        io::Write::write_all(&mut packed, text.as_bytes()).expect("packed");
        packed.finish().expect("packed")
    };
    let leak = |bytes: Vec<u8>| replay_of(bytes.leak(), Box::new(|_| {}));
    for text in FORMS {
        let broken = text.replacen('\n', "\n\u{1}broken\n# comment\n\n", text.matches('\n').count() - 1);
        for text in [text.to_owned(), text.replace('\n', "\r\n"), format!("\u{feff}{text}"), broken] {
            assert_eq!(events(leak(packed(&text))), expected, "packed {text}");
            assert_eq!(events(leak(text.clone().into_bytes())), expected, "{text}");
        }
        // A cut-off file has fewer frames, never wrong ones. Only a log of candump does not show that data is missing.
        for length in 0..text.len() {
            let mut seen = all(&text[..length]);
            let end = seen.pop();
            assert!(end.is_some_and(|end| end == "end" || end.starts_with("replay")), "{text}");
            assert!(seen.iter().zip(expected).all(|(seen, frame)| frame.starts_with(seen.as_str())), "{seen:?}");
        }
        let packed = packed(&text.repeat(50));
        for length in [packed.len() - 1, packed.len() - 9, 20, 10, 3] {
            let seen = events(leak(packed[..length].to_vec()));
            assert!(
                seen.last().is_some_and(|end| end == "end" || end.contains("cut off")) || seen.len() == 20,
                "{seen:?}"
            );
        }
    }
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
fn channel_is_chosen() {
    let channel = |text, channel: &str| events(replay(text).of_channel(channel));
    for (text, [one, two]) in [
        ("(1.5) can0 181#01\n(1.6) can1 181#02\n", ["can0", "can1"]),
        ("0.5 1 181 Rx d 1 01\n0.6 2 181 Rx d 1 02\n", ["1", "2"]),
        (";$COLUMNS=N,O,T,B,I,d,R,L,D\n1 0.0 DT 1 0181 Rx - 1 01\n2 100.0 DT 2 0181 Rx - 1 02\n", ["1", "2"]),
    ] {
        assert_eq!(channel(text, one), ["0 181#01", "end"]);
        assert_eq!(channel(text, two), ["100000 181#02", "end"]);
        let line = text.lines().count();
        let several = format!("replay x.log:{line}: frames of {one} and of {two}: choose one of them");
        assert_eq!(all(text)[1], several);
        assert_eq!(channel(text, "can7"), [format!("replay x.log: no frames of channel can7 (found: {one}, {two})")]);
    }
    let none = "replay x.log: no frames of channel can0 (the file names no channels)";
    assert_eq!(channel(FORMS[5], "can0"), [none]);
}

#[test]
fn real_time_waits_for_each_event() {
    struct Log(Arc<Mutex<Vec<Duration>>>);
    impl Sleeper for Log {
        fn sleep(&mut self, length: Duration) -> bool {
            self.0.lock().expect("no panic").push(length);
            false
        }
    }
    let slept = Arc::default();
    let bus = replay("(1.0) c 181#01\n(61.0) c 181#02\n").in_real_time(Box::new(Log(Arc::clone(&slept))));
    assert_eq!(events(bus).len(), 3);
    let minutes: Vec<u64> = slept.lock().expect("no panic").iter().map(|it| it.as_secs().div_ceil(60)).collect();
    assert_eq!(minutes[..2], [0, 1]);
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
    // The clock is set back twice. A frame that is slightly too early does not count as a step.
    let log = "(1700000010.000000) can0 181#01\n(1700000009.995000) can0 181#02\n(1700000005.000000) can0 181#03\n\
               (1700000006.000000) can0 181#04\n(1700000001.000000) can0 181#05\n(1700000001.250000) can0 181#06\n";
    let times = ["0 181#01", "0 181#02", "0 181#03", "1000000 181#04", "1000000 181#05", "1250000 181#06", "end"];
    assert_eq!(all(log), times);
    let by = Duration::from_secs(5);
    assert_eq!(notes(log), [ReplayNote::ClockSet { count: 2, line: 3, by, is_backwards: true }]);
    // A quiet weekend is a pause, not a step of the clock.
    assert_eq!(notes("(1700000000.000000) can0 181#01\n(1700050000.000000) can0 181#02\n"), []);
}
