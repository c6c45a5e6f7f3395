//! `doctor` reports the cause of prepared faults, and nothing else. Without a fault, it reports nothing.

use super::log_goes_on::Other;
use cangauge::bus::Mono;
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::master::{Master, Timing};
use cangauge::output::doctor::FindingReport;
use cangauge::output::report::{Format, render};
use cangauge::sim::Bench;
use cangauge::tasks::doctor::{DoctorOptions, examine};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// A prepared bus.
#[derive(Default)]
struct Case {
    /// The bench, without the clock.
    bench: String,
    /// Frames of other stations, with their times in milliseconds.
    others: Vec<(u64, &'static str)>,
    node: Option<u8>,
    passive: bool,
    lss: bool,
}

impl Case {
    fn of(bench: &str) -> Case {
        Case { bench: bench.to_owned(), ..Case::default() }
    }

    /// An MH-4 with node-ID 5 that enters OPERATIONAL by itself and sends each TPDO every 100 ms, with these other
    /// values.
    fn sending(set: &str) -> Case {
        let timers = ["\"0x1800:2\" = 254", "\"0x1800:5\" = 100", "\"0x1801:5\" = 100"];
        let timers = timers.iter().filter(|timer| !set.contains(timer.split(' ').next().unwrap_or_default()));
        let set: Vec<&str> = timers.copied().chain([set]).filter(|part| !part.is_empty()).collect();
        Case::of(&format!("[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\nset = {{ {} }}\n", set.join(", ")))
    }

    fn with_other_frames(self, others: &[(u64, &'static str)]) -> Case {
        Case { others: others.to_vec(), ..self }
    }

    fn with(self, more: &str) -> Case {
        Case { bench: format!("{}{more}", self.bench), ..self }
    }

    fn node(self, node: u8) -> Case {
        Case { node: Some(node), ..self }
    }

    fn open(&self) -> MemoryBus {
        let bench = Bench::from_toml(&format!("clock = \"virtual\"\n{}", self.bench), Path::new("."));
        let mut bus = match self.bench.as_str() {
            "" => MemoryBus::new(Clock::Virtual),
            _ => bench.expect("a bench").open().expect("a bus"),
        };
        bus.attach(Other::new(&self.others));
        bus
    }

    fn options(&self) -> DoctorOptions {
        DoctorOptions {
            node: self.node.map(|node| NodeId::new(node).expect("a node-ID")),
            passive: self.passive,
            lss: self.lss,
            timeout: Duration::from_millis(200),
            rounds: 2,
            overrides: BTreeMap::new(),
        }
    }

    /// The findings: node, signal and word, with the text.
    fn findings(&self) -> Vec<(String, String)> {
        let (mut bus, options) = (self.open(), self.options());
        let mut master = Master::new(&mut bus, Timing::default());
        let examination = examine(&mut master, &options).expect("no Ctrl-C");
        let line = |finding| {
            let report = FindingReport::new(finding, "can0");
            let mut text = Vec::new();
            render(&[report], Format::Csv, &mut text).expect("a line");
            let text = String::from_utf8(text).expect("text");
            let row = text.lines().nth(1).unwrap_or_default().to_owned();
            let cells: Vec<&str> = row.splitn(4, ',').take(3).filter(|cell| !cell.is_empty()).collect();
            (cells.join(" "), row.clone())
        };
        examination.findings.iter().map(line).collect()
    }
}

#[test]
fn each_fault_has_its_finding() {
    let sending = Case::sending;
    let offline = "[[device]]\nkind = \"mh4\"\nnode = 5\noffline_after = [\"reset\"]\nset = { \"0x1017\" = 100 }\n";
    let silent = "\"0x1801:1\" = 0xC0000285";
    let twin = |serial: u32| format!("[[device]]\nkind = \"mh4\"\nnode = 5\nduplicate_id = true\nserial = {serial}\n");
    let other_channel: Vec<(u64, &str)> = (0..400).map(|at| (at * 10, "5C5#4300100094018200")).collect();
    let cases: Vec<(&str, Case, &[&str])> = vec![
        ("no device", Case::of(""), &["no-frame"]),
        ("no device, node named", Case::of("").node(5), &["no-frame"]),
        ("another node only", sending("").node(9), &["9 absent"]),
        ("no node-ID", Case { lss: true, ..Case::of("[[device]]\nkind = \"mh4\"\n") }, &["unconfigured"]),
        ("no node-ID, without LSS", Case::of("[[device]]\nkind = \"mh4\"\n"), &["no-frame"]),
        (
            "frames of no CANopen node",
            Case::of("").with_other_frames(&[(1000, "7E0#01"), (1500, "7E0#01")]),
            &["no-node"],
        ),
        ("stopped", sending("\"0x1017\" = 100").with_other_frames(&[(5, "000#0205")]), &["5 stopped"]),
        ("pre-operational", Case::of("[[device]]\nkind = \"d20\"\nnode = 5\n"), &["5 not-operational"]),
        (
            "pre-operational by heartbeat",
            sending("\"0x1017\" = 100").with_other_frames(&[(5, "000#8005")]),
            &["5 not-operational"],
        ),
        ("no power after a reset", Case::of(offline).with_other_frames(&[(1000, "000#8105")]), &["5 unreachable"]),
        ("disabled", sending("\"0x1800:1\" = 0xC0000185, \"0x1801:1\" = 0xC0000285"), &["5 tpdo-disabled"]),
        ("waits for SYNC", sending(&format!("\"0x1800:2\" = 1, {silent}")), &["5 waits-for-sync"]),
        ("on request only", sending(&format!("\"0x1800:2\" = 253, {silent}")), &["5 only-on-request"]),
        ("nothing mapped", sending(&format!("\"0x1A00:0\" = 0, {silent}")), &["5 nothing-mapped"]),
        ("multiplexed", sending(&format!("\"0x1A00:0\" = 254, {silent}")), &["5 multiplexed-pdo"]),
        (
            "timer 0",
            sending(&format!("\"0x1800:2\" = 255, \"0x1800:5\" = 0, \"0x6133:1\" = 1000.0, {silent}")),
            &["5 steady"],
        ),
        (
            "no trigger",
            sending(&format!("\"0x1800:2\" = 255, \"0x1800:5\" = 0, \"0x6134:1\" = 0.0, \"0x6135:1\" = 0.0, {silent}")),
            &["5 no-trigger"],
        ),
        ("slow timer", sending(&format!("\"0x1800:5\" = 20000, {silent}")), &["5 slow-event-timer"]),
        (
            "channel off",
            sending(&format!("\"0x1800:2\" = 255, \"0x1800:5\" = 0, \"0x6112:1\" = 0, {silent}")),
            &["5 channel-off"],
        ),
        ("one TPDO waits for SYNC", sending("\"0x1800:2\" = 1"), &["5 pressure waits-for-sync"]),
        (
            "overload",
            sending("")
                .with("[[device.overload]]\nchannel = 1\nfrom = \"0s\"\nuntil = \"60s\"\ndirection = \"high\"\n"),
            &["5 pressure status", "5 error-register"],
        ),
        (
            "same COB-ID",
            sending("").with(
                "[[device]]\nkind = \"mh4\"\nnode = 6\nstart = true\n\
                 set = { \"0x1800:1\" = 0x40000185, \"0x1800:2\" = 254, \"0x1800:5\" = 100, \"0x1801:5\" = 100 }\n",
            ),
            &["bus-errors", "5 pressure shared-cob-id", "6 pressure shared-cob-id"],
        ),
        ("two devices with one node-ID", Case::of(&(twin(11) + &twin(22))), &["5 unexpected"]),
        ("answers on another channel", Case::of("").with_other_frames(&other_channel).node(5), &["5 no-answer"]),
        (
            "wrong length",
            sending(&format!("\"0x1800:5\" = 0, \"0x1800:2\" = 1, {silent}")).with_other_frames(&[(1000, "185#0102")]),
            &["5 wrong-length"],
        ),
        (
            "passive, pre-operational",
            Case { passive: true, ..sending("\"0x1017\" = 100").with_other_frames(&[(5, "000#8005")]) },
            &["5 not-operational"],
        ),
        ("passive, no frame", Case { passive: true, ..Case::of("") }, &["no-frame"]),
        (
            "passive, no TPDO",
            Case { passive: true, ..sending("\"0x1017\" = 100, \"0x1800:1\" = 0xC0000185, \"0x1801:1\" = 0xC0000285") },
            &["5 no-tpdo-received"],
        ),
    ];
    let mut wrong = Vec::new();
    for (name, case, expected) in &cases {
        let findings = case.findings();
        let words: Vec<&str> = findings.iter().map(|(word, _)| word.as_str()).collect();
        if words != *expected {
            let rows: Vec<&str> = findings.iter().map(|(_, row)| row.as_str()).collect();
            wrong.push(format!("{name}: {words:?}, expected {expected:?}\n  {}", rows.join("\n  ")));
        }
    }
    assert!(wrong.is_empty(), "{} of {} are wrong\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

#[test]
fn bus_without_faults_yields_no_findings() {
    let device = |kind: &str, node: u8, set: &str| {
        format!("[[device]]\nkind = \"{kind}\"\nnode = {node}\nstart = true\nset = {{ {set} }}\n")
    };
    let timers = "\"0x1800:2\" = 254, \"0x1800:5\" = 100, \"0x1801:5\" = 100";
    let benches = [
        device("mh4", 5, timers),
        device("mh4", 5, &format!("{timers}, \"0x1017\" = 100")),
        // One value is steady: TPDO2 is sent on change only.
        device("mh4", 5, "\"0x1800:2\" = 254, \"0x1800:5\" = 100, \"0x1017\" = 100"),
        device("dps", 127, ""),
        device("d20", 2, "\"0x1800:2\" = 254, \"0x1800:5\" = 100"),
        device("mh4", 5, timers) + &device("dps", 9, "") + &device("mh4", 6, timers),
    ];
    for bench in benches {
        let findings = Case::of(&bench).findings();
        assert!(findings.is_empty(), "{bench}\n{findings:#?}");
    }
}

/// Keeps the commands on the bus: NMT, LSS and SDO requests that are not reads.
#[derive(Default)]
struct Commands(Vec<String>);

impl Station for Commands {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, _: &mut Outbox) {
        let is_read = frame.data().first().is_some_and(|first| matches!(first >> 5, 2 | 3));
        let is_command = match frame.id() {
            CanId::Standard(0 | 0x7e5) => true,
            id => id.sdo_request_node().is_some() && !is_read,
        };
        if is_command {
            self.0.push(frame.to_string());
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn doctor_sends_no_writes_or_commands() {
    for bench in ["[[device]]\nkind = \"mh4\"\nnode = 5\n", "[[device]]\nkind = \"mc1609\"\nnode = 5\n", ""] {
        let mut bus = Case::of(bench).open();
        bus.attach(Commands::default());
        let options = Case::of(bench).options();
        examine(&mut Master::new(&mut bus, Timing::default()), &options).expect("no Ctrl-C");
        let commands: Vec<&String> = bus.stations::<Commands>().flat_map(|station| &station.0).collect();
        assert!(commands.is_empty(), "{commands:?}");
    }
}
