//! Causes of silence on the simulated bus, each with the reason that is printed. No reason may be false.

use super::RecordedRows;
use super::log_goes_on::Other;
use cangauge::bus::memory::MemoryBus;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::master::{Master, Timing};
use cangauge::measure::decode::Wanted;
use cangauge::output::events::{event_text, remark_text};
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::Bench;
use cangauge::tasks::Kind;
use cangauge::tasks::log::{LogEvent, LogOptions, Mode, RecordingReport, log};
use cangauge::tasks::pdo::{WatchEvent, watch};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

/// A device of CiA 401: two analogue inputs in TPDO1, sent on change, with an inhibit time.
const INPUTS: &str = r#"
name = "inputs"
title = "Inputs"
vendor = "Maker"
source = "a test"
[identify]
[sdo]
size = "indicated"
"#;

/// The objects of [`INPUTS`]: address, name, type, default, and whether it can be mapped.
const OBJECTS: &[(&str, &str, &str, &str, bool)] = &[
    ("0x1000", "device-type", "u32", "0x00040191", false),
    ("0x1001", "error-register", "u8", "0", false),
    ("0x1017", "producer-heartbeat-time", "u16", "0", false),
    ("0x1018:1", "vendor-id", "u32", "9", false),
    ("0x1018:2", "product-code", "u32", "7", false),
    ("0x1018:4", "serial-number", "u32", "1", false),
    ("0x1800:0", "tpdo-1-entries", "u8", "5", false),
    ("0x1800:1", "tpdo-1-cob-id", "u32", "0x40000185", false),
    ("0x1800:2", "tpdo-1-transmission", "u8", "255", false),
    ("0x1800:3", "tpdo-1-inhibit", "u16", "0", false),
    ("0x1800:5", "tpdo-1-event-timer", "u16", "0", false),
    ("0x1800:6", "tpdo-1-sync-start", "u8", "0", false),
    ("0x1A00:0", "tpdo-1-count", "u8", "1", false),
    ("0x1A00:1", "tpdo-1-map-1", "u32", "0x64010110", false),
    ("0x6401:1", "input-1", "i16", "1000", true),
    ("0x6423", "interrupt-enable", "u8", "0", false),
];

fn description() -> String {
    let object = |&(at, name, data_type, default, is_mappable): &(&str, &str, &str, &str, bool)| {
        let pdo = if is_mappable { "pdo = true\n" } else { "" };
        format!(
            "[[object]]\nat = \"{at}\"\nname = \"{name}\"\ntype = \"{data_type}\"\naccess = \"rw\"\ndefault = {default}\n{pdo}"
        )
    };
    format!("{INPUTS}{}", OBJECTS.iter().map(object).collect::<String>())
}

fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node-ID")
}

/// One cause of silence.
#[derive(Default)]
struct Case {
    /// The bench, without the clock.
    bench: String,
    /// Frames of other stations, with their times in milliseconds.
    others: Vec<(u64, &'static str)>,
    sync: Option<u64>,
    poll: bool,
    nodes: Vec<u8>,
    wanted: Vec<Wanted>,
    no_nmt: bool,
    seconds: Option<u64>,
}

impl Case {
    /// An MH-4 with node-ID 5, and these stored values.
    fn mh4(set: &str) -> Case {
        Case { bench: format!("[[device]]\nkind = \"mh4\"\nnode = 5\nset = {{ {set} }}\n"), ..Case::default() }
    }

    fn of(bench: &str) -> Case {
        Case { bench: bench.to_owned(), ..Case::default() }
    }

    fn sync(self, milliseconds: u64) -> Case {
        Case { sync: Some(milliseconds), ..self }
    }

    fn with_other_frames(self, others: &[(u64, &'static str)]) -> Case {
        Case { others: others.to_vec(), ..self }
    }

    fn run(&self) -> (Result<RecordingReport, String>, RecordedRows) {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("inputs.toml"), description()).expect("a file");
        let bench = Bench::from_toml(&format!("clock = \"virtual\"\n{}", self.bench), folder.path());
        let mut bus: MemoryBus = bench.expect("a bench").open().expect("a bus");
        bus.attach(Other::new(&self.others));
        let mode = match (self.sync, self.poll) {
            (Some(interval), _) => Mode::Sync(Duration::from_millis(interval)),
            (None, true) => Mode::Poll(Duration::from_millis(100)),
            (None, false) => Mode::AsSent,
        };
        let nodes = if self.nodes.is_empty() { vec![5] } else { self.nodes.clone() };
        let options = LogOptions {
            nodes: nodes.into_iter().map(node).collect(),
            wanted: self.wanted.clone(),
            mode,
            duration: Some(Duration::from_secs(self.seconds.unwrap_or(3600))),
            count: None,
            nmt: !self.no_nmt,
            start_all: true,
            max_gap: None,
            overrides: BTreeMap::new(),
        };
        let mut kept = RecordedRows::default();
        let result = log(&mut Master::new(&mut bus, Timing::default()), &options, &mut kept);
        (result.map_err(|failure| ErrorMessage::of(&failure).message), kept)
    }

    /// The message for a recording without a value, with its hint.
    fn message(&self) -> (String, Option<String>) {
        match self.run().0 {
            Ok(report) => {
                let Some(failure) = report.nothing else { return (format!("{} rows", report.rows), None) };
                let message = ErrorMessage::of(&failure);
                (message.message, message.hint)
            }
            Err(message) => (message, None),
        }
    }
}

/// Heartbeats of node 5 with this state, every 200 ms.
fn heartbeats(state: &'static str) -> Vec<(u64, &'static str)> {
    (1..60).map(|step| (step * 200, state)).collect()
}

const BOTH_OFF: &str = "\"0x1800:1\" = 0xC0000185, \"0x1801:1\" = 0xC0000285";
const WITH_HEARTBEAT: &str = "\"0x1017\" = 100";

#[test]
fn node_that_left_operational_is_named_at_the_end() {
    let remarks = |case: Case, others: &[(u64, &'static str)]| -> Vec<String> {
        let report = Case { seconds: Some(4), ..case }.with_other_frames(others).run().0.expect("a report");
        assert!(report.rows > 0);
        report.remarks.iter().map(remark_text).filter(|text| text.contains("no longer operational")).collect()
    };
    let synced = || Case::mh4(WITH_HEARTBEAT).sync(100);
    let preop = [(2000, "000#8005"), (2010, "085#3081110000000000")];
    assert_eq!(
        remarks(synced(), &preop),
        ["node 5 is no longer operational: it is pre-operational again after the start, emergency 8130h"]
    );
    assert_eq!(
        remarks(synced(), &[(2000, "000#0205")]),
        ["node 5 is no longer operational: it is stopped after the start"]
    );
    assert_eq!(remarks(synced(), &[(2000, "000#8005"), (2500, "000#0105")]), [""; 0], "it is operational again");
    // A polled node has values in each state.
    let polled = || Case { poll: true, ..Case::mh4(WITH_HEARTBEAT) };
    assert_eq!(remarks(polled(), &[]), [""; 0], "it was never operational");
    assert_eq!(
        remarks(polled(), &[(500, "000#0105"), (2000, "000#8005")]),
        ["node 5 is no longer operational: it is pre-operational"]
    );
}

#[test]
fn emergency_about_the_length_of_sync_is_the_reason() {
    let rejected = [(3000, "085#4082110000000000"), (3500, "085#4082110000000000")];
    let case = Case::mh4("\"0x1800:2\" = 240, \"0x1801:2\" = 240").sync(100).with_other_frames(&rejected);
    let (message, hint) = case.message();
    assert!(
        message.contains("TPDO1 waits for SYNC, and the node rejects the length of SYNC, emergency 8240h"),
        "{message}"
    );
    assert!(hint.expect("a hint").contains("cangauge sdo read 5 0x1019"));
    // A TPDO that does not depend on SYNC has another reason.
    let case = Case::mh4("\"0x1800:2\" = 254, \"0x1801:1\" = 0xC0000285").sync(100).with_other_frames(&rejected);
    assert!(!case.message().0.contains("rejects"), "{}", case.message().0);
}

#[test]
fn each_cause_has_its_reason() {
    let inputs = |more: &str| Case::of(&format!("[[device]]\nkind = \"inputs.toml\"\nnode = 5\n{more}"));
    let event = "\"0x1800:2\" = 255, \"0x1801:1\" = 0xC0000285, \"0x6134:1\" = 0.0, \"0x6135:1\" = 0.0";
    let timer = "\"0x1800:1\" = 0xC0000185, \"0x1801:5\" = 100";
    let offline = "[[device]]\nkind = \"mh4\"\nnode = 5\noffline_after = [\"reset\"]\n";
    let cases: Vec<(&str, Case, &str)> = vec![
        ("no SYNC", Case::mh4(""), "TPDO1 waits for SYNC, and no node sends SYNC"),
        (
            "no SYNC with the COB-ID of 1005h",
            Case::mh4("\"0x1005\" = 0x81").with_other_frames(&[(3000, "080#"), (3100, "080#")]),
            "TPDO1 waits for SYNC with COB-ID 081 (1005h), and no node sends it",
        ),
        (
            "too few SYNC",
            Case::mh4("\"0x1800:2\" = 240").sync(100),
            "TPDO1 is sent at every 240th SYNC (1800h:2), and 50 SYNC were sent",
        ),
        (
            "too few SYNC of another node",
            Case::mh4("\"0x1800:2\" = 3").with_other_frames(&[(1000, "080#"), (2000, "080#")]),
            "TPDO1 is sent at every 3th SYNC (1800h:2), and 2 SYNC were sent",
        ),
        ("on request", Case::mh4("\"0x1800:2\" = 253"), "TPDO1 is sent on remote request only (1800h:2 is 253)"),
        ("disabled", Case::mh4(BOTH_OFF), "its TPDOs are disabled (bit 31 of 1800h:1)"),
        (
            "nothing mapped",
            Case::mh4("\"0x1A00:0\" = 0, \"0x1801:1\" = 0xC0000285"),
            "nothing is mapped to TPDO1 (1A00h:0 is 0)",
        ),
        (
            "multiplexed PDO, destination mode",
            Case::mh4("\"0x1A00:0\" = 254, \"0x1801:1\" = 0xC0000285"),
            "TPDO1 is a multiplexed PDO (1A00h:0 is FEh), which cannot be decoded",
        ),
        (
            "multiplexed PDO, source mode, TPDO2",
            Case::mh4("\"0x1A01:0\" = 255, \"0x1800:1\" = 0xC0000185"),
            "TPDO2 is a multiplexed PDO (1A01h:0 is FFh), which cannot be decoded",
        ),
        (
            "slow event timer",
            Case::mh4("\"0x1800:1\" = 0xC0000185, \"0x1801:5\" = 10000"),
            "the event timer of TPDO2 is longer than the wait (1801h:5 is 10000 ms)",
        ),
        (
            "no trigger",
            Case::mh4(event),
            "TPDO1 has no event timer (1800h:2 and :5), and delta and limits are 0 (0x6133:1 to 0x6135:1)",
        ),
        (
            "steady value",
            Case::mh4(&format!("{event}, {WITH_HEARTBEAT}, \"0x6133:1\" = 1000.0")),
            "TPDO1 has no event timer (1800h:2 and :5), and its value does not change enough",
        ),
        (
            "event timer of another transmission type",
            Case::mh4(&format!("{event}, {WITH_HEARTBEAT}, \"0x1800:5\" = 100, \"0x6133:1\" = 1000.0")),
            "TPDO1 has no event timer (1800h:2 and :5), and its value does not change enough",
        ),
        (
            "steady value or not operational",
            Case { no_nmt: true, ..Case::mh4(&format!("{event}, \"0x6133:1\" = 1000.0")) },
            "its value does not change enough, or the node is not operational",
        ),
        ("channel off", Case::mh4(&format!("{event}, \"0x6112:1\" = 0")), "its channel is off (0x6112:1 is 0)"),
        (
            "stopped, with heartbeat",
            Case::mh4(WITH_HEARTBEAT).with_other_frames(&[(1000, "000#0205")]),
            "it is stopped after the start",
        ),
        (
            "stopped by another master, without heartbeat",
            Case::mh4("").with_other_frames(&[(1000, "000#0205")]),
            "it is stopped after the start (NMT command)",
        ),
        (
            "all are set to pre-operational by another master, without heartbeat",
            Case::mh4("").with_other_frames(&[(1000, "000#8000")]),
            "it is pre-operational again after the start (NMT command)",
        ),
        (
            "stopped by another master, and started again",
            Case::mh4("").with_other_frames(&[(1000, "000#0205"), (1100, "000#0105")]),
            "TPDO1 waits for SYNC, and no node sends SYNC",
        ),
        (
            "pre-operational again, by guarding",
            Case { nodes: vec![2], ..Case::of("[[device]]\nkind = \"d20\"\nnode = 2\n") }
                .with_other_frames(&[(120, "000#8002")]),
            "it is pre-operational again after the start (node guarding)",
        ),
        (
            "falls back after an emergency",
            Case::mh4("")
                .with_other_frames(&[&[(150, "085#00FF810000000000")][..], &heartbeats("705#7F")[1..]].concat()),
            "it is pre-operational again after the start, emergency FF00h",
        ),
        (
            "no power, with heartbeat",
            Case::of(&format!("{offline}set = {{ {WITH_HEARTBEAT} }}\n")).with_other_frames(&[(1000, "000#8105")]),
            "its heartbeat stopped, and it does not answer: it has no power or cable",
        ),
        (
            "no power, without heartbeat",
            Case::of(offline).with_other_frames(&[(1000, "000#8105")]),
            "it does not answer: it is stopped, or has no power or cable",
        ),
        (
            "restarted, and not started by this program",
            Case { no_nmt: true, ..Case::mh4("") }.with_other_frames(&[(1000, "000#8105")]),
            "it restarted, and has sent no heartbeat since",
        ),
        (
            "event timer, not operational",
            Case { no_nmt: true, ..Case::mh4(timer) },
            "TPDO2 is due every 100 ms (1801h:5), and no TPDO2 was received: the node answers SDO, and is probably not operational",
        ),
        (
            "SYNC, not operational",
            Case { no_nmt: true, ..Case::mh4("").sync(100) },
            "TPDO1 is due at SYNC, and SYNC was sent, and no TPDO1 was received: the node answers SDO, and is probably not operational",
        ),
        (
            "SYNC start value, and SYNC without a counter",
            Case { no_nmt: true, ..inputs("set = { \"0x1800:2\" = 1, \"0x1800:6\" = 5 }\n").sync(100) },
            "TPDO1 starts at the SYNC with counter 5 (1800h:6), and the counter never has this value (1019h), or the node is not operational",
        ),
        (
            "another COB-ID than in 1800h:1, at SYNC",
            Case { no_nmt: true, ..Case::mh4("").sync(100) }
                .with_other_frames(&[(2000, "1C5#0000A03F00"), (2100, "1C5#0000A03F00")]),
            "no TPDO1 was received (frames were received with COB-ID 1C5, which no TPDO of the node uses): \
             the node is not operational, or sends with another COB-ID",
        ),
        (
            "another COB-ID than in 1801h:1, by timer",
            Case { no_nmt: true, ..Case::mh4(timer) }.with_other_frames(&[(2100, "3A5#00"), (2200, "745#05")]),
            "no TPDO2 was received (frames were received with COB-ID 3A5",
        ),
        (
            "TPDO of another node with a heartbeat",
            Case { no_nmt: true, ..Case::mh4("").sync(100) }
                .with_other_frames(&[(1500, "745#05"), (2000, "1C5#0000A03F00")]),
            "no TPDO1 was received: the node answers SDO, and is probably not operational",
        ),
        (
            "two TPDOs with one COB-ID",
            Case::mh4("\"0x1801:1\" = 0x40000185").sync(100),
            "its TPDO1 and TPDO2 have the same COB-ID 185",
        ),
        (
            "wrong length",
            Case::mh4("").with_other_frames(&[(1000, "185#0102"), (2000, "185#0102")]),
            "its TPDOs have 2 bytes, but their mapping has 5",
        ),
        (
            "another node has the COB-ID",
            Case {
                nodes: vec![5, 6],
                wanted: vec![Wanted::Signal("pressure".to_owned())],
                ..Case::of(
                    "[[device]]\nkind = \"mh4\"\nnode = 5\n\
                     [[device]]\nkind = \"mh4\"\nnode = 6\nset = { \"0x1800:1\" = 0x40000185 }\n",
                )
                .sync(100)
            },
            "node 5: node 6 sends TPDOs with the same COB-ID 185",
        ),
        (
            "interrupts of CiA 401",
            inputs(""),
            "its analogue inputs are not sent on change (0x6423:0 is 0), and TPDO1 has no event timer",
        ),
        (
            "inhibit time",
            inputs("set = { \"0x6423\" = 1, \"0x1800:3\" = 60000 }\n"),
            "the inhibit time of TPDO1 is longer than the wait (1800h:3 is 6 s)",
        ),
        (
            "event timer behind an inhibit time",
            Case { no_nmt: true, ..inputs("set = { \"0x1800:5\" = 100, \"0x1800:3\" = 60000 }\n") },
            "the inhibit time of TPDO1 is longer than the wait (1800h:3 is 6 s)",
        ),
        (
            "polled object is write-only",
            Case { poll: true, wanted: vec![Wanted::Object(ObjectId::new(0x6125, 1), None)], ..Case::mh4("") },
            "read 0x6125:1: refused by the device",
        ),
    ];
    let wrong: Vec<String> = cases
        .iter()
        .filter_map(|(name, case, expected)| {
            let (message, hint) = case.message();
            (!message.ends_with(expected) && !message.contains(expected))
                .then(|| format!("{name}:\n  {message}\n  hint: {hint:?}\n  expected: {expected}"))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {} reasons are wrong\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// The texts of the remarks during a recording.
fn remarks(kept: &RecordedRows) -> Vec<String> {
    let is_remark = |note: &&LogEvent| matches!(note, LogEvent::Remark(_));
    kept.notes.iter().filter(is_remark).map(|note| event_text(note).text).collect()
}

#[test]
fn signal_without_values_has_its_reason_after_five_seconds_and_at_the_end() {
    let case =
        Case { seconds: Some(7), ..Case::mh4("\"0x1801:2\" = 255, \"0x6134:2\" = 0.0, \"0x6135:2\" = 0.0").sync(100) };
    let (result, kept) = case.run();
    let report = result.expect("a recording");
    let reason = "node 5: no measurements of temperature: TPDO2 has no event timer (1801h:2 and :5), and delta and \
                  limits are 0 (0x6133:2 to 0x6135:2)";
    assert!(report.rows > 0 && report.nothing.is_none());
    assert_eq!(remarks(&kept), [reason]);
    let at_end: Vec<String> = report.remarks.iter().map(cangauge::output::events::remark_text).collect();
    assert!(at_end.iter().any(|text| text == reason), "{at_end:?}");
}

#[test]
fn sync_messages_are_counted_while_they_are_sent() {
    let case = Case { seconds: Some(7), ..Case::mh4("\"0x1801:2\" = 240").sync(100) };
    let remarks = remarks(&case.run().1);
    assert_eq!(remarks.len(), 1, "{remarks:?}");
    let reason = "node 5: no measurements of temperature: TPDO2 is sent at every 240th SYNC (1801h:2), and 5";
    assert!(remarks[0].starts_with(reason), "{remarks:?}");
}

#[test]
fn multiplexed_tpdo_beside_another_one_is_reported_once() {
    for (set, text) in [
        ("\"0x1A01:0\" = 255", "node 5: TPDO2 is a multiplexed PDO (1A01h:0 is FFh), which cannot be decoded"),
        (
            "\"0x1A00:0\" = 254, \"0x1801:5\" = 100",
            "node 5: TPDO1 is a multiplexed PDO (1A00h:0 is FEh), which cannot be decoded",
        ),
    ] {
        let (result, kept) = Case { seconds: Some(7), ..Case::mh4(set).sync(100) }.run();
        assert!(result.expect("a recording").rows > 0);
        assert_eq!(remarks(&kept), [text]);
    }
}

#[test]
fn device_that_was_replaced_is_an_event_and_a_failure() {
    let inputs = "[[device]]\nkind = \"inputs.toml\"\nnode = 5\nset = { \"0x1800:5\" = 100 }\n";
    for (write, text) in [
        ("605#2318100402000000", "it is another device: serial 2, before 1"),
        ("605#2318100263000000", "it is another device"),
    ] {
        // After the wrong length, the program reads the node again.
        let case =
            Case { seconds: Some(6), ..Case::of(inputs) }.with_other_frames(&[(2000, write), (2500, "185#0102030405")]);
        let (result, kept) = case.run();
        let report = result.expect("a recording");
        assert_eq!(report.replaced.len(), 1);
        assert_eq!(report.replaced[0].kind(), Kind::Unexpected);
        let events: Vec<_> =
            kept.notes.iter().map(event_text).filter(|event| event.event == Some("replaced")).collect();
        assert!(matches!(events.as_slice(), [event] if event.text.ends_with(text)), "{events:?}");
    }
}

/// The TPDOs of node 5 that are shown, and the reports of wrong lengths, while another station sends `others`.
fn watched(set: &str, others: &[(u64, &'static str)]) -> (usize, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = format!("clock = \"virtual\"\n{}", Case::mh4(set).bench);
    let mut bus = Bench::from_toml(&bench, folder.path()).expect("a bench").open().expect("a bus");
    bus.attach(Other::new(others));
    let (mut shown, mut reports) = (0, Vec::new());
    let mut on_event = |event: &WatchEvent<'_>| {
        match event {
            WatchEvent::Tpdo { .. } => shown += 1,
            WatchEvent::WrongLength { number, mapped, length, is_used, .. } => {
                reports.push(format!("{number} {length} of {mapped}{}", if *is_used { ", used" } else { "" }));
            }
            WatchEvent::WrongLengths(_, count) => reports.push(format!("{count} in total")),
            _ => {}
        }
        ControlFlow::Continue(())
    };
    let duration = Some(Duration::from_secs(6));
    let master = &mut Master::new(&mut bus, Timing::default());
    watch(master, &[node(5)], &BTreeMap::new(), duration, &mut on_event).expect("TPDOs");
    (shown, reports)
}

#[test]
fn watched_tpdo_of_another_length_is_reported_once_and_used_if_it_is_longer() {
    let longer = "185#0000A03F000000";
    let frames: Vec<_> = (1..9).map(|step| (step * 500, longer)).collect();
    let (shown, reports) = watched("", &frames);
    assert_eq!(reports, ["TPDO1 7 of 5, used", "8 in total"]);
    assert_eq!(shown, 7, "all but the first one, after which the mapping is read again");
    let frames: Vec<_> = (1..9).map(|step| (step * 500, "185#0000")).collect();
    assert_eq!(watched("", &frames), (0, vec!["TPDO1 2 of 5".to_owned(), "8 in total".to_owned()]));
    // Two producers.
    let frames: Vec<_> =
        (1..9).map(|step| (step * 500, if step % 2 == 0 { "185#0000A03F00" } else { longer })).collect();
    let (shown, reports) = watched("", &frames);
    assert_eq!((shown, reports.join("; ").as_str()), (4, "TPDO1 7 of 5, used; TPDO1 7 of 5; 4 in total"));
}

#[test]
fn node_without_values_has_its_reason_after_five_seconds() {
    let bench = "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1800:1\" = 0xC0000185, \"0x1801:1\" = 0xC0000285 }\n\
                 [[device]]\nkind = \"dps\"\nnode = 127\n";
    let (result, kept) = Case { nodes: vec![5, 127], seconds: Some(7), ..Case::of(bench) }.run();
    assert!(result.expect("a recording").rows > 0);
    assert_eq!(remarks(&kept), ["node 5: no measurements: its TPDOs are disabled (bit 31 of 1800h:1)"]);
}

#[test]
fn short_recording_has_no_remarks_on_single_signals() {
    let case = Case::mh4("").sync(10);
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!("clock = \"virtual\"\n{}", case.bench);
    let mut bus = Bench::from_toml(&text, folder.path()).expect("a bench").open().expect("a bus");
    let options = LogOptions {
        nodes: vec![node(5)],
        wanted: Vec::new(),
        mode: Mode::Sync(Duration::from_millis(10)),
        duration: None,
        count: Some(5),
        nmt: true,
        start_all: true,
        max_gap: None,
        overrides: BTreeMap::new(),
    };
    let report =
        log(&mut Master::new(&mut bus, Timing::default()), &options, &mut RecordedRows::default()).expect("rows");
    assert!(
        report.remarks.iter().all(|remark| !cangauge::output::events::remark_text(remark).contains("no measurements"))
    );
}
