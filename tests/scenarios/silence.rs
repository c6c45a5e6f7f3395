//! Causes of silence on the simulated bus, each with the reason that is printed. No reason may be false.

use super::Kept;
use super::log_goes_on::Other;
use cangauge::bus::memory::MemoryBus;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::master::{Master, Timing};
use cangauge::measure::decode::Wanted;
use cangauge::output::events::{event_text, remark_text};
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::Bench;
use cangauge::tasks::log::{LogEvent, LogOptions, Mode, RecordingReport, log};
use std::collections::BTreeMap;
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
    ("0x1800:0", "tpdo-1-entries", "u8", "5", false),
    ("0x1800:1", "tpdo-1-cob-id", "u32", "0x40000185", false),
    ("0x1800:2", "tpdo-1-transmission", "u8", "255", false),
    ("0x1800:3", "tpdo-1-inhibit", "u16", "0", false),
    ("0x1800:5", "tpdo-1-event-timer", "u16", "0", false),
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

    fn hears(self, others: &[(u64, &'static str)]) -> Case {
        Case { others: others.to_vec(), ..self }
    }

    fn run(&self) -> (Result<RecordingReport, String>, Kept) {
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
        let mut kept = Kept::default();
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
const ALIVE: &str = "\"0x1017\" = 100";

#[test]
fn node_that_left_operational_is_named_at_the_end() {
    let remarks = |case: Case, others: &[(u64, &'static str)]| -> Vec<String> {
        let report = Case { seconds: Some(4), ..case }.hears(others).run().0.expect("a report");
        assert!(report.rows > 0);
        report.remarks.iter().map(remark_text).filter(|text| text.contains("left operational")).collect()
    };
    let synced = || Case::mh4(ALIVE).sync(100);
    let preop = [(2000, "000#8005"), (2010, "085#3081110000000000")];
    assert_eq!(
        remarks(synced(), &preop),
        ["node 5 left operational: it is pre-operational again after the start, emergency 8130h"]
    );
    assert_eq!(remarks(synced(), &[(2000, "000#0205")]), ["node 5 left operational: it is stopped after the start"]);
    assert_eq!(remarks(synced(), &[(2000, "000#8005"), (2500, "000#0105")]), [""; 0], "it is operational again");
    // A polled node has values in each state.
    let polled = || Case { poll: true, ..Case::mh4(ALIVE) };
    assert_eq!(remarks(polled(), &[]), [""; 0], "it was never operational");
    assert_eq!(
        remarks(polled(), &[(500, "000#0105"), (2000, "000#8005")]),
        ["node 5 left operational: it is pre-operational"]
    );
}

#[test]
fn emergency_about_the_length_of_sync_is_the_reason() {
    let rejected = [(3000, "085#4082110000000000"), (3500, "085#4082110000000000")];
    let case = Case::mh4("\"0x1800:2\" = 240, \"0x1801:2\" = 240").sync(100).hears(&rejected);
    let (message, hint) = case.message();
    assert!(
        message.contains("TPDO1 waits for SYNC, and the node rejects the length of SYNC, emergency 8240h"),
        "{message}"
    );
    assert!(hint.expect("a hint").contains("cangauge sdo read 5 0x1019"));
    // A TPDO that does not depend on SYNC has another reason.
    let case = Case::mh4("\"0x1800:2\" = 254, \"0x1801:1\" = 0xC0000285").sync(100).hears(&rejected);
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
            Case::mh4("\"0x1005\" = 0x81").hears(&[(3000, "080#"), (3100, "080#")]),
            "TPDO1 waits for SYNC with COB-ID 081 (1005h), and no node sends it",
        ),
        (
            "too few SYNC",
            Case::mh4("\"0x1800:2\" = 240").sync(100),
            "TPDO1 is sent at every 240th SYNC (1800h:2), and 50 SYNC were sent",
        ),
        (
            "too few SYNC of another node",
            Case::mh4("\"0x1800:2\" = 3").hears(&[(1000, "080#"), (2000, "080#")]),
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
            "the event timer of TPDO2 is longer (1801h:5 is 10000 ms)",
        ),
        (
            "no trigger",
            Case::mh4(event),
            "TPDO1 has no event timer (1800h:2 and :5), and delta and limits are 0 (0x6133:1 to 0x6135:1)",
        ),
        (
            "steady value",
            Case::mh4(&format!("{event}, {ALIVE}, \"0x6133:1\" = 1000.0")),
            "TPDO1 has no event timer (1800h:2 and :5), and its value does not change enough",
        ),
        (
            "event timer of another transmission type",
            Case::mh4(&format!("{event}, {ALIVE}, \"0x1800:5\" = 100, \"0x6133:1\" = 1000.0")),
            "TPDO1 has no event timer (1800h:2 and :5), and its value does not change enough",
        ),
        (
            "steady value or not operational",
            Case { no_nmt: true, ..Case::mh4(&format!("{event}, \"0x6133:1\" = 1000.0")) },
            "its value does not change enough, or the node is not operational",
        ),
        ("channel off", Case::mh4(&format!("{event}, \"0x6112:1\" = 0")), "its channel is off (0x6112:1 is 0)"),
        ("stopped, with heartbeat", Case::mh4(ALIVE).hears(&[(1000, "000#0205")]), "it is stopped after the start"),
        (
            "stopped, without heartbeat",
            Case::mh4("").hears(&[(1000, "000#0205")]),
            "it does not answer: it is stopped, or has no power or cable",
        ),
        (
            "pre-operational again, by guarding",
            Case { nodes: vec![2], ..Case::of("[[device]]\nkind = \"d20\"\nnode = 2\n") }.hears(&[(120, "000#8002")]),
            "it is pre-operational again after the start (node guarding)",
        ),
        (
            "falls back after an emergency",
            Case::mh4("").hears(&[&[(150, "085#00FF810000000000")][..], &heartbeats("705#7F")[1..]].concat()),
            "it is pre-operational again after the start, emergency FF00h",
        ),
        (
            "no power, with heartbeat",
            Case::of(&format!("{offline}set = {{ {ALIVE} }}\n")).hears(&[(1000, "000#8105")]),
            "its heartbeat stopped, and it does not answer: it has no power or cable",
        ),
        (
            "no power, without heartbeat",
            Case::of(offline).hears(&[(1000, "000#8105")]),
            "it does not answer: it is stopped, or has no power or cable",
        ),
        (
            "restarted, and not started by this program",
            Case { no_nmt: true, ..Case::mh4("") }.hears(&[(1000, "000#8105")]),
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
            "wrong length",
            Case::mh4("").hears(&[(1000, "185#0102"), (2000, "185#0102")]),
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
            "the inhibit time of TPDO1 is longer (1800h:3 is 6 s)",
        ),
        (
            "event timer behind an inhibit time",
            inputs("set = { \"0x1800:5\" = 100, \"0x1800:3\" = 60000, \"0x1A00:0\" = 1 }\n")
                .hears(&[(100, "000#8005")]),
            "the inhibit time of TPDO1 is longer (1800h:3 is 6 s)",
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
fn remarks(kept: &Kept) -> Vec<String> {
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
fn node_without_values_has_its_reason_after_five_seconds() {
    let bench = "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1800:1\" = 0xC0000185, \"0x1801:1\" = 0xC0000285 }\n\
                 [[device]]\nkind = \"dps\"\nnode = 127\n";
    let (result, kept) = Case { nodes: vec![5, 127], seconds: Some(7), ..Case::of(bench) }.run();
    assert!(result.expect("a recording").rows > 0);
    assert_eq!(remarks(&kept), ["node 5: no measurements: its TPDOs are disabled (bit 31 of 1800h:1)"]);
}

#[test]
fn short_recording_says_nothing_of_single_signals() {
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
    let report = log(&mut Master::new(&mut bus, Timing::default()), &options, &mut Kept::default()).expect("rows");
    assert!(
        report.remarks.iter().all(|remark| !cangauge::output::events::remark_text(remark).contains("no measurements"))
    );
}
