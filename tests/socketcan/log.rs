//! `cangauge log` on a kernel's CAN: whatever happens on the way, the file holds what was sent. What happens to files
//! and pipes is in `log_files`.
//!
//! The frames carry numbers, so that every row that is missing, doubled or out of order shows.

use crate::program::command;
use crate::{Can, run};
use cangauge::bus::Bus;
use cangauge::bus::socketcan::SocketCan;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use serde_json::Value;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// However slow the machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Sends numbered TPDOs of a DPS: 6130h:1, an i32.
struct Sender {
    bus: SocketCan,
    node: u16,
    next: u32,
}

impl Sender {
    fn new(interface: &str, node: u16) -> Sender {
        Sender { bus: SocketCan::open(interface).unwrap(), node, next: 0 }
    }

    /// Sends the next number; `false` where the interface does not take it.
    fn send(&mut self) -> bool {
        let frame = Frame::new(CanId::Standard(0x180 + self.node), &self.next.to_le_bytes()).unwrap();
        let is_sent = self.bus.send(&frame).is_ok();
        self.next += u32::from(is_sent);
        is_sent
    }

    /// A thousand a second for this long.
    fn send_for(&mut self, length: Duration) {
        let until = Instant::now() + length;
        while Instant::now() < until {
            self.send();
            sleep(Duration::from_millis(1));
        }
    }

    /// As fast as the interface takes them.
    fn send_many(&mut self, count: u32) {
        let end = self.next + count;
        while self.next < end {
            if !self.send() {
                sleep(Duration::from_millis(1));
            }
        }
    }
}

/// A recording of the DPS with some node-IDs, which sends nothing itself.
struct Log {
    child: Child,
    folder: TempDir,
    file: PathBuf,
}

/// How a recording ended.
struct Ended {
    code: Option<i32>,
    stderr: String,
    summary: Value,
    text: String,
}

impl Log {
    fn start(interface: &str, nodes: &str) -> Log {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run.csv");
        let summary = folder.path().join("summary.json");
        let (file_name, summary) = (file.display(), summary.display());
        let line = format!("-b {interface} log {nodes} --passive --device dps -o {file_name} --summary {summary}");
        let child = command(&line).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        Log { child, folder, file }
    }

    /// Sends until the file has a row: from then on nothing may be missing.
    fn warm_up(&self, sender: &mut Sender) {
        let begun = Instant::now();
        while read(&self.file).lines().count() < 2 {
            assert!(begun.elapsed() < PATIENCE, "no row");
            sender.send();
            sleep(Duration::from_millis(5));
        }
    }

    fn signal(&self, name: &str) {
        run("kill", &[&format!("-{name}"), &self.child.id().to_string()]);
    }

    fn end(self) -> Ended {
        let output = self.child.wait_with_output().unwrap();
        let summary = serde_json::from_str(&read(&self.folder.path().join("summary.json"))).unwrap_or(Value::Null);
        let stderr = String::from_utf8(output.stderr).unwrap();
        Ended { code: output.status.code(), stderr, summary, text: read(&self.file) }
    }
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

/// The rows of a file that is whole: all their cells.
#[track_caller]
fn rows(text: &str) -> Vec<Vec<&str>> {
    assert!(text.ends_with('\n'), "a last row without its end");
    whole_rows(text)
}

/// The rows of a file of which the last may have been cut off.
#[track_caller]
fn whole_rows(text: &str) -> Vec<Vec<&str>> {
    let end = text.rfind('\n').map_or(0, |end| end + 1);
    let mut lines = text[..end].lines();
    assert_eq!(lines.next(), Some("time,elapsed_s,node,signal,value,unit,status,raw"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert!(rows.iter().all(|row| row.len() == 8 && row[7].len() == 10), "every row is whole");
    rows
}

/// The numbers that the rows of a node carry.
fn numbers(rows: &[Vec<&str>], node: u16) -> Vec<u32> {
    let node = node.to_string();
    let own = rows.iter().filter(|row| row[2] == node);
    own.map(|row| u32::from_str_radix(&row[7][2..], 16).unwrap().swap_bytes()).collect()
}

/// What is missing in numbers that must rise.
#[track_caller]
fn holes(numbers: &[u32]) -> Vec<Range<u32>> {
    assert!(numbers.is_sorted_by(|a, b| a < b), "doubled, or out of order");
    let pairs = numbers.windows(2).filter(|pair| pair[1] != pair[0] + 1);
    pairs.map(|pair| pair[0] + 1..pair[1]).collect()
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_signal_ends_the_file_with_the_last_frame_that_came() {
    let can = Can::get();
    for name in ["INT", "TERM"] {
        let log = Log::start(&can.name, "5");
        let mut sender = Sender::new(&can.name, 5);
        log.warm_up(&mut sender);
        sender.send_many(5000);
        log.signal(name);
        let ended = log.end();
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let numbers = numbers(&rows(&ended.text), 5);
        assert_eq!((holes(&numbers), numbers.last()), (vec![], Some(&(sender.next - 1))));
        assert_eq!(ended.summary["timestamps"], "kernel");
        assert_eq!((&ended.summary["dropped"], &ended.summary["rows"]), (&0.into(), &numbers.len().into()));
    }
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn the_link_goes_down_and_up_in_the_middle() {
    let can = Can::get();
    let log = Log::start(&can.name, "5");
    let mut sender = Sender::new(&can.name, 5);
    log.warm_up(&mut sender);
    for _ in 0..2 {
        sender.send_for(Duration::from_millis(300));
        can.switch("down");
        // The news of the link is one error, which a call of the sender gets.
        while sender.send() {}
        sender.send_for(Duration::from_millis(300));
        can.switch("up");
        sender.send_for(Duration::from_millis(500));
    }
    log.signal("INT");
    let ended = log.end();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let numbers = numbers(&rows(&ended.text), 5);
    assert_eq!((holes(&numbers), numbers.last()), (vec![], Some(&(sender.next - 1))));
    assert_eq!(ended.summary["link_losses"], 2, "{}", ended.stderr);
    let said = ["the interface went down; waiting", "the interface is up again"];
    assert!(said.iter().all(|said| ended.stderr.matches(said).count() == 2), "{}", ended.stderr);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn the_interface_is_deleted_and_made_again() {
    let _can = Can::get();
    let make = || {
        run("ip", &["link", "add", "dev", "log0", "type", "vcan"]);
        run("ip", &["link", "set", "log0", "up"]);
    };
    make();
    let log = Log::start("log0", "5");
    let mut sender = Sender::new("log0", 5);
    log.warm_up(&mut sender);
    sender.send_for(Duration::from_millis(300));
    run("ip", &["link", "del", "log0"]);
    let last = sender.next - 1;
    sleep(Duration::from_millis(300));
    make();
    let mut sender = Sender { next: sender.next + 1000, ..Sender::new("log0", 5) };
    // It is looked for five times a second.
    let begun = Instant::now();
    let rows_before = read(&log.file).lines().count();
    while read(&log.file).lines().count() <= rows_before + usize::try_from(last).unwrap() / 1000 {
        assert!(begun.elapsed() < PATIENCE, "it does not come back");
        sender.send_for(Duration::from_millis(50));
    }
    sender.send_for(Duration::from_millis(500));
    log.signal("INT");
    let ended = log.end();
    run("ip", &["link", "del", "log0"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let numbers = numbers(&rows(&ended.text), 5);
    let holes = holes(&numbers);
    assert!(holes.len() == 1 && holes[0].start == last + 1, "{holes:?}, and {last} was the last one before");
    assert_eq!((numbers.last(), &ended.summary["link_losses"]), (Some(&(sender.next - 1)), &1.into()));
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn the_wall_clock_is_set_back() {
    let can = Can::get();
    let log = Log::start(&can.name, "5");
    let mut sender = Sender::new(&can.name, 5);
    log.warm_up(&mut sender);
    for step in ["-1 hour", "+1 hour"] {
        sender.send_for(Duration::from_millis(300));
        run("date", &["-s", step]);
    }
    sender.send_for(Duration::from_millis(300));
    log.signal("INT");
    let ended = log.end();
    let rows = rows(&ended.text);
    let numbers = numbers(&rows, 5);
    assert_eq!((holes(&numbers), numbers.last()), (vec![], Some(&(sender.next - 1))));
    assert!(rows.windows(2).any(|pair| pair[1][0] < pair[0][0]), "the column time tells the wall clock");
    let elapsed: Vec<f64> = rows.iter().map(|row| row[1].parse().unwrap()).collect();
    let longest = elapsed.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    assert!(elapsed.is_sorted() && longest < 10.0, "{longest} s from one row to the next");
    assert!(ended.summary["length_s"].as_f64().is_some_and(|length| length < 60.0), "{}", ended.summary);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn bus_off_and_the_restart_are_told_and_rows_go_on() {
    let can = Can::get();
    let log = Log::start(&can.name, "5");
    let mut sender = Sender::new(&can.name, 5);
    log.warm_up(&mut sender);
    // As drivers tell it; a virtual interface has no controller of its own.
    for error in ["20000040#0000000000000000", "20000100#0000000000000000"] {
        can.cansend(error);
        sender.send_for(Duration::from_millis(300));
    }
    log.signal("INT");
    let ended = log.end();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let numbers = numbers(&rows(&ended.text), 5);
    assert_eq!((holes(&numbers), numbers.last()), (vec![], Some(&(sender.next - 1))));
    assert_eq!(ended.summary["bus_offs"], 1, "{}", ended.stderr);
    assert!(ended.stderr.contains("bus-off"), "{}", ended.stderr);
}

/// A hundred recordings, twenty at a time.
#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn killed_at_any_moment() {
    let can = Can::get();
    let mut sender = Sender::new(&can.name, 5);
    let mut random = u64::from(std::process::id()) | 1;
    for _ in 0..5 {
        let mut logs: Vec<Log> = (0..20).map(|_| Log::start(&can.name, "5")).collect();
        logs.iter().for_each(|log| log.warm_up(&mut sender));
        // When which number had been sent.
        let mut sent = Vec::new();
        while let Some(log) = logs.pop() {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let until = Instant::now() + Duration::from_millis(random >> 32 & 0xff);
            while Instant::now() < until {
                sender.send();
                sent.push((Instant::now(), sender.next - 1));
                sleep(Duration::from_millis(2));
            }
            killed(log, &sent);
        }
    }
}

/// Kills a recording and looks at what it leaves: what was `sent` more than a second before.
#[track_caller]
fn killed(mut log: Log, sent: &[(Instant, u32)]) {
    log.child.kill().unwrap();
    let killed = Instant::now();
    log.child.wait().unwrap();
    let text = read(&log.file);
    let numbers = numbers(&whole_rows(&text), 5);
    assert_eq!(holes(&numbers), []);
    // A second by the contract, and half a one for a machine with one CPU and all these programs.
    let due = sent.iter().rev().find(|(at, _)| killed.duration_since(*at) > Duration::from_millis(1500));
    let last = *numbers.last().expect("rows");
    assert!(due.is_none_or(|&(_, due)| last >= due), "{last} is the last row, and {due:?} was long ago");
}

/// 8,000 frames a second of sixteen nodes, which is a full bus at 1 Mbit/s.
#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_full_bus_for_twenty_seconds() {
    const NODES: u16 = 16;
    const PER_SECOND: u32 = 8000;
    const SECONDS: u32 = 20;
    let can = Can::get();
    let log = Log::start(&can.name, "1-16");
    let mut senders: Vec<Sender> = (1..=NODES).map(|node| Sender::new(&can.name, node)).collect();
    senders.iter_mut().for_each(|sender| sender.bus.listen(&cangauge::bus::Filters::Only(Vec::new())).unwrap());
    log.warm_up(&mut senders[0]);
    let begun = Instant::now();
    for slot in 0..PER_SECOND * SECONDS / u32::from(NODES) {
        for sender in &mut senders {
            sender.send_many(1);
        }
        let due = begun + Duration::from_secs(u64::from(slot) * u64::from(NODES)) / PER_SECOND;
        sleep(due.saturating_duration_since(Instant::now()));
    }
    let length = begun.elapsed();
    let memory = peak_memory_kb(log.child.id());
    log.signal("INT");
    let ended = log.end();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let rows = rows(&ended.text);
    for sender in &senders {
        let numbers = numbers(&rows, sender.node);
        // Of the first node, those before the program was there are missing.
        let first = if sender.node == 1 { numbers[0] } else { 0 };
        assert_eq!((numbers[0], holes(&numbers), numbers.last()), (first, vec![], Some(&(sender.next - 1))));
    }
    assert_eq!(ended.summary["dropped"], 0);
    assert!(memory < 20 << 10, "{memory} kB for {} rows, sent in {length:?}", rows.len());
}

/// The most memory that a process had at once.
fn peak_memory_kb(id: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

/// A SYNC every 10 ms: as many as are counted are on the bus.
#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn syncs_on_the_bus_are_those_that_are_counted() {
    let can = Can::get();
    let mut ear = can.open();
    ear.listen(&cangauge::bus::Filters::Only(vec![CanId::SYNC])).unwrap();
    let mut device = command(&format!("-b {} sim mh4@5", can.name)).stderr(Stdio::null()).spawn().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let summary = folder.path().join("summary.json");
    // The device needs its time to begin.
    let line = format!("-b {} log 5 --sync 10ms --duration 5s --retries 20 --summary {}", can.name, summary.display());
    let output = command(&line).stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap();
    run("kill", &["-INT", &device.id().to_string()]);
    device.wait().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let mut syncs = 0u64;
    while let cangauge::bus::Event::Frame(_) = ear.receive(crate::ahead(&ear, 30)).unwrap() {
        syncs += 1;
    }
    let summary: Value = serde_json::from_str(&read(&summary)).unwrap();
    assert_eq!(summary["syncs"], syncs);
    assert_eq!(summary["syncs"].as_u64().unwrap() + summary["syncs_left_out"].as_u64().unwrap(), 500);
    let delay = |key: &str| summary["sync_delay_s"][key].as_f64().unwrap();
    assert!(delay("min") <= delay("p50") && delay("p50") <= delay("p99") && delay("p99") <= delay("max"));
}
