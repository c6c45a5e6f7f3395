//! A recording continues by itself after changes of nodes, mapping and interface. Each row is decoded with the mapping,
//! unit and decimal digits that the device had when it sent the frame.

use super::RecordedRows;
use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{MemoryBus, Outbox, Station};
use cangauge::bus::time::{Mono, Stamp};
use cangauge::bus::{Bus, BusError, Event, Fault, Received};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::nmt::NmtState;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::DownloadSize;
use cangauge::device::catalog;
use cangauge::device::unit::Unit;
use cangauge::master::{Master, Request, Timing};
use cangauge::sim::Bench;
use cangauge::tasks::Effect;
use cangauge::tasks::log::{Change, LogEvent, LogOptions, Mode, RecordingReport, Remark, TpdoChange, log};
use cangauge::tasks::note::StateEffect;
use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::time::Duration;

fn at(milliseconds: u64) -> Mono {
    Mono::at(Duration::from_millis(milliseconds))
}

fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node-ID")
}

/// Another station on the bus: it sends given frames and ignores all others.
pub(super) struct Other {
    frames: VecDeque<(Mono, Frame)>,
}

impl Other {
    /// Frames with their times in milliseconds, in order.
    pub(super) fn new(frames: &[(u64, &str)]) -> Other {
        let frames = frames.iter().map(|(time, text)| (at(*time), text.parse().expect("a frame")));
        Other { frames: frames.collect() }
    }
}

impl Station for Other {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        while let Some(&(_, frame)) = self.frames.front().filter(|(time, _)| *time <= now) {
            self.frames.pop_front();
            out.send(frame);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.frames.front().map(|(time, _)| *time)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// A recording, and the simulator's record of the sent values.
struct Run {
    kept: RecordedRows,
    outcome: RecordingReport,
    /// The lines of the simulator from the first row to the last.
    sent: Vec<String>,
    /// All NMT commands on the bus.
    commands: Vec<String>,
}

impl Run {
    /// Compares the rows with the lines of the simulator. Returns how many of its lines have no row.
    #[track_caller]
    fn missing(&self) -> usize {
        let mut sent = self.sent.iter();
        for row in &self.kept.rows {
            assert!(sent.any(|line| line == row), "{row} was not sent");
        }
        self.sent.len() - self.kept.rows.len()
    }

    fn has(&self, note: &LogEvent) -> bool {
        self.kept.notes.contains(note)
    }

    /// The reported changes of the node.
    fn changes(&self) -> Vec<&[Change]> {
        let changes = self.kept.notes.iter().filter_map(|note| match note {
            LogEvent::ReadAgain(_, changes) => Some(changes.as_slice()),
            _ => None,
        });
        changes.collect()
    }

    /// The units of the rows, without repetitions.
    fn units(&self) -> Vec<&str> {
        let mut units: Vec<&str> = self.kept.rows.iter().filter_map(|row| row.split(',').nth(4)).collect();
        units.dedup();
        units
    }
}

const SECONDS: u64 = 5;

/// Records a bench with another station for five seconds. `before` runs first.
fn record(devices: &str, mode: Mode, others: &[(u64, &str)], before: &dyn Fn(&mut Master<'_>)) -> Run {
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!("clock = \"virtual\"\nrecord = \"truth.csv\"\n{devices}");
    let mut bus = Bench::from_toml(&text, folder.path()).expect("a bench").open().expect("a bus");
    bus.attach(Other::new(others));
    bus.attach(NmtRecorder::default());
    before(&mut Master::new(&mut bus, Timing::default()));
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan(mode), &mut kept).expect("a recording");
    let commands = bus.stations::<NmtRecorder>().flat_map(|ear| ear.commands.clone()).collect();
    drop(bus);
    let truth = std::fs::read_to_string(folder.path().join("truth.csv")).expect("the record");
    let time = |line: &str| line.split(',').next().and_then(|time| time.parse::<u64>().ok()).expect("a time");
    let (first, last) = (time(&kept.rows[0]), time(kept.rows.last().expect("rows")));
    let sent = truth.lines().skip(1).filter(|line| (first..=last).contains(&time(line)));
    Run { sent: sent.map(str::to_owned).collect(), kept, outcome, commands }
}

fn plan(mode: Mode) -> LogOptions {
    LogOptions {
        nodes: vec![node(5)],
        wanted: Vec::new(),
        mode,
        duration: Some(Duration::from_secs(SECONDS)),
        count: None,
        nmt: true,
        start_all: true,
        max_gap: None,
        overrides: BTreeMap::new(),
    }
}

/// Records the NMT commands on the bus.
#[derive(Default)]
struct NmtRecorder {
    commands: Vec<String>,
    /// The number of frames from a master before each command.
    places: Vec<u64>,
    sent: u64,
}

impl Station for NmtRecorder {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, _: &mut Outbox) {
        let text = frame.to_string();
        if text.starts_with("000#") {
            self.places.push(self.sent);
            self.commands.push(text.clone());
        }
        self.sent += u64::from(text.starts_with("000#") || text.starts_with("605#"));
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

fn write(master: &mut Master<'_>, object: ObjectId, bytes: &[u8]) {
    let write = Request::write(node(5), object, bytes.to_vec(), DownloadSize::Indicated);
    master.transfer_one(write).expect("a bus").expect("written");
}

const DPS: &str = "[[device]]\nkind = \"dps\"\nnode = 5\n";
const MH4: &str = "[[device]]\nkind = \"mh4\"\nnode = 5\n";
const SYNC: Mode = Mode::Sync(Duration::from_millis(10));
/// 6131h:1, and its value for bar.
const UNIT: ObjectId = ObjectId::new(0x6131, 1);
const BAR: [u8; 4] = [0x00, 0x00, 0x4e, 0x00];

fn nothing(_: &mut Master<'_>) {}

#[test]
fn restarted_node_is_started_again() {
    let run = record(DPS, Mode::AsSent, &[(2000, "000#8105")], &nothing);
    assert_eq!(run.missing(), 0);
    assert!(run.has(&LogEvent::Restarted(node(5))));
    assert_eq!(run.changes(), [[] as [Change; 0]], "the setup is unchanged");
    assert_eq!(run.commands, ["000#0105", "000#8105", "000#0105"]);
    assert_eq!((run.outcome.events.restarts, run.outcome.events.changes), (1, 0));
    let after = run.kept.rows.iter().filter(|row| row.split(',').next().is_some_and(|time| time > "2500000")).count();
    assert!(after > 20, "rows continue: {after}");
}

/// A recording while these sent frames are lost: the NMT commands, their places among the sent frames, and the report.
fn record_while_lost(device: &str, lost: &[u64]) -> (Vec<String>, Vec<u64>, RecordingReport) {
    let devices = format!("clock = \"virtual\"\n{device}set = {{ \"0x1017\" = 100 }}\n");
    let mut bus = Bench::from_toml(&devices, Path::new("")).expect("a bench").open().expect("a bus");
    bus.attach(NmtRecorder::default());
    let plan = FaultPlan { lose_sent: lost.iter().copied().collect(), ..FaultPlan::default() };
    let (mut bus, mut kept) = (Faulty::new(bus, plan), RecordedRows::default());
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &self::plan(Mode::AsSent), &mut kept);
    let recorder = bus.inner().stations::<NmtRecorder>().next().expect("attached");
    (recorder.commands.clone(), recorder.places.clone(), outcome.expect("a report"))
}

/// The command that returns the node to its previous state is lost. After the first loss it is sent again; the second
/// loss is reported.
#[test]
fn lost_return_to_the_previous_state_is_noticed() {
    let run = |lost: &[u64]| {
        let (commands, places, report) = record_while_lost(DPS, lost);
        let is_reported = report.remarks.iter().any(|remark| matches!(remark, Remark::StatesNotRestored(_)));
        (commands, places, is_reported)
    };
    let (commands, places, is_reported) = run(&[]);
    assert_eq!((commands, is_reported), (["000#0105", "000#8005"].map(str::to_owned).to_vec(), false));
    let (commands, _, is_reported) = run(&places[1..]);
    assert_eq!((commands, is_reported), (["000#0105", "000#8005"].map(str::to_owned).to_vec(), false));
    let (commands, _, is_reported) = run(&[places[1], places[1] + 1]);
    assert_eq!((commands, is_reported), (["000#0105"].map(str::to_owned).to_vec(), true));
}

/// An MH-4 sends no value without SYNC, so the recording has no summary, and its failure names the state.
#[test]
fn failure_without_rows_names_a_state_that_was_not_restored() {
    let effects = |lost: &[u64]| {
        let (_, places, report) = record_while_lost(MH4, lost);
        (places, report.nothing.expect("a failure").effects)
    };
    let (places, before) = effects(&[]);
    assert_eq!(before, []);
    let (_, after) = effects(&[places[1], places[1] + 1]);
    assert_eq!(after, [Effect::State(StateEffect::NotRestored)]);
}

/// After a restart, the answers with the vendor are lost until 4 s: the program does not report another
/// device.
#[test]
fn restarted_node_is_read_again_until_it_answers_completely() {
    let text = format!("clock = \"virtual\"\n{DPS}");
    let mut inner = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    inner.attach(Other::new(&[(2000, "000#8105")]));
    let is_lost = |received: &Received| {
        let is_vendor = received.frame.data().get(1..4) == Some(&[0x18, 0x10, 1]);
        is_vendor && (at(2000)..at(4000)).contains(&received.at.mono)
    };
    let mut bus = UnstableBus { is_lost, ..UnstableBus::new(inner, &[]) };
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan(Mode::AsSent), &mut kept);
    let mut signals: Vec<&str> = kept.rows.iter().filter_map(|row| row.split(',').nth(2)).collect();
    signals.dedup();
    assert_eq!(signals, ["pressure"]);
    let has = |wanted: fn(&LogEvent) -> bool| kept.notes.iter().filter(|note| wanted(note)).count();
    assert_eq!(has(|note| matches!(note, LogEvent::Unreadable(..))), 1, "{:?}", kept.notes);
    assert_eq!(has(|note| *note == LogEvent::ReadAgain(node(5), Vec::new())), 1, "{:?}", kept.notes);
    let seconds: Vec<u64> = kept
        .rows
        .iter()
        .filter_map(|row| row.split(',').next()?.parse::<u64>().ok())
        .map(|time| time / 1_000_000)
        .collect();
    assert!(seconds.contains(&1) && !seconds.contains(&3) && seconds.contains(&4), "{seconds:?}");
    assert_eq!(outcome.expect("a recording").events.changes, 0);
}

/// The serial number could not be read at first. After a restart it is read: it is not another device.
#[test]
fn serial_number_that_is_read_only_after_a_restart_shows_no_other_device() {
    let text = format!("clock = \"virtual\"\n{DPS}");
    let mut inner = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    inner.attach(Other::new(&[(3000, "000#8105")]));
    let is_lost =
        |received: &Received| received.frame.data().get(1..4) == Some(&[0x18, 0x10, 4]) && received.at.mono < at(3000);
    let mut bus = UnstableBus { is_lost, ..UnstableBus::new(inner, &[]) };
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan(Mode::AsSent), &mut kept);
    let outcome = outcome.expect("a recording");
    assert!(kept.notes.contains(&LogEvent::ReadAgain(node(5), Vec::new())), "{:?}", kept.notes);
    assert_eq!((outcome.replaced.len(), outcome.events.changes), (0, 0));
}

#[test]
fn unit_that_was_not_stored_is_not_used_after_a_restart() {
    // Set to bar without storing: after a restart the unit is psi.
    let before = |master: &mut Master<'_>| write(master, UNIT, &BAR);
    for mode in [Mode::AsSent, Mode::Poll(Duration::from_millis(20))] {
        let run = record(DPS, mode, &[(2000, "000#8105")], &before);
        assert_eq!(run.units(), ["bar", "psi"], "{mode:?}");
        if mode == Mode::AsSent {
            assert_eq!(run.missing(), 0);
        }
        // 25 bar are 362.6 psi: a value from before the restart must not get the new unit.
        for row in &run.kept.rows {
            let value: f64 = row.split(',').nth(3).and_then(|value| value.parse().ok()).expect(row);
            let first: f64 = run.kept.rows[0].split(',').nth(3).and_then(|value| value.parse().ok()).expect("a value");
            let factor = if row.contains(",psi,") { 14.5 } else { 1.0 };
            assert!((0.5..2.0).contains(&(value / first / factor)), "{row} after {}", run.kept.rows[0]);
        }
        assert_eq!(run.outcome.events.changes, 1);
        let unit = Change::Unit("pressure".to_owned(), Some(Unit(0x004e_0000)), Some(Unit(0x00ab_0000)));
        assert_eq!(run.changes(), [[unit]]);
        // Each unit has its own statistics.
        let units: Vec<_> = run.outcome.statistics.iter().map(|(source, _)| source.unit.to_string()).collect();
        assert_eq!(units, ["bar", "psi"]);
    }
}

#[test]
fn node_that_starts_by_itself_is_read_before_it_is_recorded() {
    let devices = format!("{MH4}start = true\n");
    let run = record(&devices, SYNC, &[(2000, "000#8105"), (2030, "000#0105")], &nothing);
    assert!(run.missing() > 0 && run.outcome.events.not_recorded > 0, "{:?}", run.outcome.events);
    assert_eq!(run.missing() as u64, run.outcome.events.not_recorded, "missing rows are counted");
}

#[test]
fn mapping_changed_by_another_master() {
    // The sequence of CiA 301: disable, clear, map status and pressure, set two entries, enable.
    let writes = [
        (2000, "605#23001801850100C0"),
        (2020, "605#2F001A0000000000"),
        (2040, "605#23001A0108015061"),
        (2060, "605#23001A0220013061"),
        (2080, "605#2F001A0002000000"),
        (2100, "605#2300180185010040"),
    ];
    let run = record(MH4, SYNC, &writes, &nothing);
    let missing = run.missing();
    assert!(missing > 0 && missing as u64 == run.outcome.events.not_recorded, "{missing}: {:?}", run.outcome.events);
    assert!(run.outcome.events.changes == 1 && run.outcome.events.wrong_lengths == 0, "{:?}", run.outcome.events);
    let mapping = TpdoChange::Mapping(vec!["0x6150:1".to_owned(), "pressure".to_owned()]);
    let [[Change::Tpdo(_, parts)]] = run.changes()[..] else { panic!("{:?}", run.changes()) };
    assert!(parts.contains(&mapping), "{parts:?}");
    let last = run.kept.rows.last().expect("rows");
    assert!(last.contains(",pressure,") && last.contains(",ok,"), "{last}");
    let time: u64 = last.split(',').next().and_then(|time| time.parse().ok()).expect("a time");
    assert!(time > 4_500_000, "it runs to its end");
    assert_eq!(run.commands, ["000#0105"], "only a restarted node is started");
}

#[test]
fn unit_changed_by_another_master() {
    let run = record(DPS, Mode::AsSent, &[(2000, "605#2331610100004E00")], &nothing);
    assert_eq!(run.units(), ["psi", "bar"]);
    assert_eq!(run.missing() as u64, run.outcome.events.not_recorded);
    assert!(run.outcome.events.not_recorded < 10, "read half a second later: {:?}", run.outcome.events);
}

#[test]
fn node_is_read_again_after_a_wrong_length() {
    // The frame is shorter than the mapping. The node is read again once; nothing has changed.
    let others = [(2000, "185#01"), (2200, "185#01"), (2400, "185#01")];
    let run = record(MH4, SYNC, &others, &nothing);
    assert_eq!(run.changes(), [[] as [Change; 0]], "read once");
    let events = &run.outcome.events;
    assert_eq!((events.wrong_lengths, run.missing()), (3, 0), "{events:?}");
}

#[test]
fn passive_recording_uses_no_old_mapping() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!("clock = \"virtual\"\nrecord = \"truth.csv\"\n{DPS}");
    let mut bus = Bench::from_toml(&text, folder.path()).expect("a bench").open().expect("a bus");
    // The node is started, set to bar, restarted and started again. Then its unit is psi.
    let unit = "605#2331610100004E00";
    bus.attach(Other::new(&[(100, "000#0105"), (1000, unit), (2000, "000#8105"), (2500, "000#0105")]));
    let dps = catalog::by_name("dps").expect("a description");
    let plan = LogOptions { overrides: [(node(5), dps)].into(), ..plan(Mode::Passive) };
    let mut kept = RecordedRows::default();
    log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut kept).expect("a recording");
    drop(bus);
    let truth = std::fs::read_to_string(folder.path().join("truth.csv")).expect("the record");
    assert_eq!(kept.rows, truth.lines().skip(1).collect::<Vec<_>>());
    let mut units: Vec<&str> = kept.rows.iter().filter_map(|row| row.split(',').nth(4)).collect();
    units.dedup();
    assert_eq!(units, ["psi", "bar", "psi"]);
    assert!(kept.notes.contains(&LogEvent::Restarted(node(5))));
}

#[test]
fn lost_heartbeat_and_changed_state_are_reported() {
    let devices = format!("{MH4}set = {{ \"0x1017\" = 100 }}\n");
    let run = record(&devices, SYNC, &[(2000, "000#8005"), (2600, "000#0105")], &nothing);
    assert!(run.has(&LogEvent::State(node(5), NmtState::PreOperational)), "{:?}", run.kept.notes);
    assert_eq!((run.missing(), run.outcome.events.heartbeat_losses), (0, 0));
    let text = format!("clock = \"virtual\"\n{devices}");
    let inner = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    let is_lost = |received: &Received| {
        received.frame.id() == CanId::heartbeat(node(5)) && (at(2000)..at(3000)).contains(&received.at.mono)
    };
    let mut bus = UnstableBus { is_lost, ..UnstableBus::new(inner, &[]) };
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan(SYNC), &mut kept).expect("a recording");
    let lost = kept
        .notes
        .iter()
        .filter(|note| matches!(note, LogEvent::HeartbeatLost(_, silence) if silence.as_millis() < 400));
    assert_eq!((lost.count(), outcome.events.heartbeat_losses), (1, 1), "{:?}", kept.notes);
    assert!(kept.notes.contains(&LogEvent::HeartbeatBack(node(5))));
    assert!(kept.notes.contains(&LogEvent::ReadAgain(node(5), Vec::new())), "a boot-up may have been missed");
}

/// A busy device: its heartbeats pause again and again, and a survey takes longer than the time between two pauses.
#[test]
fn heartbeats_that_pause_often_do_not_end_the_rows() {
    let text = format!("clock = \"virtual\"\n{MH4}latency = \"40ms\"\nset = {{ \"0x1017\" = 50 }}\n");
    let inner = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    let is_lost = |received: &Received| {
        let millis = received.at.mono.since_start().as_millis();
        received.frame.id() == CanId::heartbeat(node(5)) && millis > 2000 && millis % 400 > 100
    };
    let mut bus = UnstableBus { is_lost, ..UnstableBus::new(inner, &[]) };
    let mut kept = RecordedRows::default();
    let mode = Mode::Poll(Duration::from_millis(100));
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan(mode), &mut kept).expect("a recording");
    assert!(outcome.events.heartbeat_losses > 3, "{:?}", outcome.events);
    let time = |row: &String| row.split(',').next().and_then(|time| time.parse::<u64>().ok()).expect("a time");
    assert!(kept.rows.iter().any(|row| time(row) > 3_000_000), "{:#?}", kept.rows);
}

/// A bus whose interface reports the given events at the given times.
struct UnstableBus {
    inner: MemoryBus,
    /// Events with their times. While the link is down no frame passes.
    events: VecDeque<(Mono, Event)>,
    up: bool,
    /// The frames that are lost.
    is_lost: fn(&Received) -> bool,
}

impl UnstableBus {
    fn new(inner: MemoryBus, events: &[(u64, Event)]) -> UnstableBus {
        let events = events.iter().map(|(time, event)| (at(*time), *event)).collect();
        UnstableBus { inner, events, up: true, is_lost: |_| false }
    }
}

impl cangauge::bus::BitRateControl for UnstableBus {
    cangauge::bus::delegate_bus!(self, self.inner => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl Bus for UnstableBus {
    cangauge::bus::delegate_bus!(self, self.inner => name timestamps is_live waits now mono listen receive_buffer finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        if self.up { self.inner.send(frame) } else { Err(BusError::Down(self.name().to_owned())) }
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            let due = self.events.front().map(|(time, _)| *time);
            if due.is_some_and(|due| due <= self.inner.now().mono)
                && let Some((_, event)) = self.events.pop_front()
            {
                match event {
                    Event::Link(up) => self.up = up,
                    Event::Fault(Fault::BusOff, _) => self.up = false,
                    Event::Fault(Fault::Restarted, _) => self.up = true,
                    _ => {}
                }
                return Ok(event);
            }
            let until = due.map_or(deadline, |due| due.min(deadline));
            match self.inner.receive(until)? {
                Event::Timeout if until < deadline => {}
                Event::Frame(_) if !self.up => {}
                Event::Frame(received) if (self.is_lost)(&received) => {}
                event => return Ok(event),
            }
        }
    }

    fn unreported_drops(&mut self) -> u32 {
        7
    }
}

/// Records with interface events. The node restarts at 2.2 s, and its boot-up is lost.
fn record_with_events(events: &[(u64, Event)]) -> (RecordedRows, RecordingReport) {
    let text = format!("clock = \"virtual\"\n{DPS}");
    let mut inner = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    inner.attach(Other::new(&[(2200, "000#8105")]));
    write(&mut Master::new(&mut inner, Timing::default()), UNIT, &BAR);
    let is_lost = |received: &Received| {
        received.frame.id() == CanId::heartbeat(node(5)) && (at(2100)..at(2400)).contains(&received.at.mono)
    };
    let mut bus = UnstableBus { is_lost, ..UnstableBus::new(inner, events) };
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan(Mode::AsSent), &mut kept);
    (kept, outcome.expect("a recording"))
}

#[test]
fn interface_goes_down_and_comes_back() {
    let (kept, outcome) = record_with_events(&[(2000, Event::Link(false)), (3000, Event::Link(true))]);
    assert_eq!((outcome.events.link_losses, outcome.events.changes, outcome.gaps), (1, 1, 1));
    assert!(
        outcome.lost.is_empty() && outcome.events.silences == 0,
        "an interface failure is not reported as a lost node"
    );
    let rows = |unit: &str| kept.rows.iter().filter(|row| row.contains(unit)).count();
    assert!(rows(",bar,") > 15 && rows(",psi,") > 15, "after the restart the node is started and read again");
    let links: Vec<_> = kept.notes.iter().filter(|note| matches!(note, LogEvent::Link(_))).collect();
    assert_eq!(links, [&LogEvent::Link(false), &LogEvent::Link(true)]);
    assert_eq!(outcome.dropped, 7, "the last losses are counted at the end");
}

#[test]
fn dropped_frames_are_counted() {
    let (kept, outcome) = record_with_events(&[(1500, Event::Dropped(5)), (2500, Event::Dropped(30))]);
    assert_eq!(outcome.dropped, 5 + 30 + 7);
    let drops: Vec<_> = kept.notes.iter().filter(|note| matches!(note, LogEvent::Dropped(_))).collect();
    assert_eq!(drops, [&LogEvent::Dropped(5), &LogEvent::Dropped(30), &LogEvent::Dropped(7)]);
}

#[test]
fn bus_off_controller_is_restarted() {
    let fault = |fault, time| (time, Event::Fault(fault, Stamp { mono: at(time), ..Stamp::default() }));
    let (kept, outcome) = record_with_events(&[fault(Fault::BusOff, 2000), fault(Fault::Restarted, 2500)]);
    assert_eq!((outcome.events.bus_offs, outcome.events.changes), (1, 1));
    let rows = |unit: &str| kept.rows.iter().filter(|row| row.contains(unit)).count();
    assert!(rows(",bar,") > 15 && rows(",psi,") > 15, "{:?}", kept.notes);
}

#[test]
fn sixteen_nodes_are_polled_in_parallel() {
    let devices: String = (1..=16).map(|id| format!("[[device]]\nkind = \"mh4\"\nnode = {id}\n")).collect();
    let text = format!("clock = \"virtual\"\nbit_rate = 1000000\n{devices}");
    let mut bus = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    let mut plan = plan(Mode::Poll(Duration::from_millis(100)));
    plan.nodes = (1..=16).map(node).collect();
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut kept).expect("a recording");
    assert_eq!(outcome.skipped, 0);
    assert_eq!(outcome.statistics.len(), 32, "pressure and temperature of each");
    for (source, statistics) in &outcome.statistics {
        assert!((49..=51).contains(&statistics.count()), "{source:?}: {}", statistics.count());
        assert!(statistics.jitter().is_some_and(|jitter| jitter.max < Duration::from_millis(10)));
    }
}

#[test]
fn sync_delays_are_measured() {
    let run = record(MH4, SYNC, &[], &nothing);
    let syncs = &run.outcome.syncs;
    assert_eq!((syncs.sent, syncs.left_out, syncs.delays.count()), (SECONDS * 100, 0, SECONDS * 100));
    assert!(syncs.delays.longest() < Some(Duration::from_millis(1)), "{:?}", syncs.delays.longest());
    assert_eq!(run.outcome.rows, SECONDS * 100);
    // While the interface is down no SYNC is sent or counted as sent.
    let text = format!("clock = \"virtual\"\n{MH4}");
    let inner = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
    let mut bus = UnstableBus::new(inner, &[(2000, Event::Link(false)), (3000, Event::Link(true))]);
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan(SYNC), &mut kept).expect("a recording");
    assert_eq!(outcome.syncs.sent + outcome.syncs.left_out, SECONDS * 100);
    assert!((99..=101).contains(&outcome.syncs.left_out), "{:?}", outcome.syncs.left_out);
}

#[test]
fn longer_intervals_than_max_gap_are_gaps() {
    for (longest, gaps) in [(99, 1), (200, 0)] {
        let text = format!("clock = \"virtual\"\n{MH4}");
        let inner = Bench::from_toml(&text, Path::new("")).expect("a bench").open().expect("a bus");
        let mut bus = UnstableBus::new(inner, &[(2000, Event::Link(false)), (2120, Event::Link(true))]);
        let plan = LogOptions { max_gap: Some(Duration::from_millis(longest)), ..plan(SYNC) };
        let mut kept = RecordedRows::default();
        let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut kept).expect("a recording");
        assert_eq!(outcome.gaps, gaps, "{longest}");
        assert_eq!(outcome.statistics[0].1.gaps(), gaps);
    }
}

#[test]
fn restart_among_lost_frames_is_detected() {
    let dropped = [(2400, Event::Dropped(30)), (2500, Event::Dropped(3)), (3500, Event::Dropped(1))];
    let (kept, outcome) = record_with_events(&dropped);
    assert_eq!((outcome.dropped, outcome.events.changes, outcome.events.silences), (34 + 7, 1, 0));
    let units: Vec<&str> = kept.rows.iter().filter_map(|row| row.split(',').nth(4)).collect();
    let psi = units.iter().filter(|unit| **unit == "psi").count();
    assert!(psi > 15, "started and read again: {units:?}");
    let read = kept.notes.iter().filter(|note| matches!(note, LogEvent::ReadAgain(..)));
    assert_eq!(read.count(), 1, "once a minute is enough: {:?}", kept.notes);
    let has = |wanted: fn(&Remark) -> bool| outcome.remarks.iter().any(wanted);
    assert!(has(|remark| matches!(remark, Remark::ChangedWhileFramesLost(..))), "{:?}", outcome.remarks);
    assert!(!has(|remark| matches!(remark, Remark::NotReadAgain(_))), "{:?}", outcome.remarks);
}
