//! A program that did not run for some time (Ctrl-Z, a suspended laptop, a busy host). It reads the frames that the
//! kernel kept, and does not send the SYNCs that it missed.

use super::RecordedRows;
use super::answers::Slow;
use super::log_goes_on::Other;
use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::time::Mono;
use cangauge::bus::{Bus, BusError, Event};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::DownloadSize;
use cangauge::canopen::value::{DataType, Value};
use cangauge::device::catalog;
use cangauge::master::{Master, MasterEvent, MissedAnswer, OnTwoDevices, Request, SdoError, SdoFailure, Timing};
use cangauge::sim::Bench;
use cangauge::tasks::log::{LogOptions, Mode, Remark, log};
use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

/// A bus whose reader does not run from `from` until `until`. Frames wait for it, as in the kernel.
struct Stalled {
    inner: MemoryBus,
    from: Mono,
    until: Mono,
    waiting: VecDeque<Event>,
    /// The user presses Ctrl-C during the stall; the frames have later times than that.
    stopped: bool,
    /// How long the program does not run after each sent frame.
    after_send: Duration,
    /// The times at which SYNC was sent.
    syncs: Vec<Mono>,
    /// The sent frames.
    sent: Vec<String>,
}

impl Stalled {
    fn sleep(&mut self) -> Result<(), BusError> {
        while self.inner.now().mono < self.until {
            match self.inner.receive(self.until)? {
                Event::Timeout => break,
                Event::Frame(mut received) if self.stopped => {
                    received.at.mono = received.at.mono.max(self.until + Duration::from_millis(100));
                    self.waiting.push_back(Event::Frame(received));
                }
                event => self.waiting.push_back(event),
            }
        }
        if self.stopped {
            self.waiting.push_front(Event::Interrupted);
        }
        Ok(())
    }
}

impl cangauge::bus::BitRateControl for Stalled {
    cangauge::bus::delegate_bus!(self, self.inner => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl Bus for Stalled {
    cangauge::bus::delegate_bus!(self, self.inner => name timestamps is_live waits now mono listen receive_buffer unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        if frame.to_string() == "080#" {
            self.syncs.push(self.inner.now().mono);
        }
        self.sent.push(frame.to_string());
        self.inner.send(frame)?;
        if !self.after_send.is_zero() {
            self.until = self.inner.now().mono + self.after_send;
            self.sleep()?;
        }
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        if (self.from..self.until).contains(&self.inner.now().mono) {
            self.sleep()?;
        }
        match self.waiting.pop_front() {
            Some(event) => Ok(event),
            None => self.inner.receive(deadline),
        }
    }
}

fn stalled(text: &str, milliseconds: Range<u64>, stopped: bool) -> Stalled {
    let inner = Bench::from_toml(text, Path::new("")).expect("a bench").open().expect("a bus");
    stall(inner, milliseconds, stopped)
}

fn stall(inner: MemoryBus, milliseconds: Range<u64>, stopped: bool) -> Stalled {
    let at = |milliseconds| Mono::at(Duration::from_millis(milliseconds));
    let (from, until) = (at(milliseconds.start), at(milliseconds.end));
    let (waiting, syncs, sent, after_send) = (VecDeque::new(), Vec::new(), Vec::new(), Duration::ZERO);
    Stalled { inner, from, until, waiting, stopped, after_send, syncs, sent }
}

fn plan(mode: Mode, duration: Duration) -> LogOptions {
    LogOptions {
        nodes: vec![NodeId::new(5).expect("a node-ID")],
        wanted: Vec::new(),
        mode,
        duration: Some(duration),
        count: None,
        nmt: true,
        start_all: true,
        max_gap: None,
        overrides: BTreeMap::new(),
    }
}

#[test]
fn missed_syncs_are_omitted() {
    let text = "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let mut bus = stalled(text, 1000..1503, false);
    let period = Duration::from_millis(10);
    let plan = plan(Mode::Sync(period), Duration::from_secs(2));
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut kept).expect("a recording");
    let syncs = bus.syncs;
    let begin = syncs[0];
    let gaps: Vec<Duration> = syncs.windows(2).map(|pair| pair[1].since(pair[0])).collect();
    assert!(gaps.iter().all(|gap| *gap >= period / 2), "an interval is shorter than half a period: {gaps:?}");
    assert_eq!(gaps.iter().filter(|gap| **gap > period * 2).count(), 1, "one pause");
    // After the pause, SYNC keeps its old phase.
    let off = syncs.iter().filter(|sync| sync.since(begin).as_nanos() % period.as_nanos() != 0).count();
    assert!(off <= 1, "{syncs:?}");
    assert!((149..=151).contains(&syncs.len()), "{}", syncs.len());
    assert_eq!((outcome.syncs.sent, outcome.rows), (syncs.len() as u64, syncs.len() as u64));
    let omitted = outcome.remarks.iter().filter(|remark| matches!(remark, Remark::SyncsOmittedTooSlow(_)));
    assert_eq!(omitted.count(), 1, "{:?}", outcome.remarks);
}

#[test]
fn answer_that_arrives_before_the_clock_is_read_is_used() {
    let text = "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let mut bus = stalled(text, 0..0, false);
    bus.after_send = Duration::from_millis(30);
    let node = NodeId::new(5).expect("a node-ID");
    let mut master = Master::new(&mut bus, Timing::default());
    master.set_on_two_devices(OnTwoDevices::RefuseWrites);
    let name = master.read(node, ObjectId::new(0x1008, 0), DataType::VisibleString).expect("the bus works");
    assert_eq!(name, Ok(Value::Text("MH-4-CAN".into())));
    let write = Request::write(node, ObjectId::new(0x1017, 0), vec![100, 0], DownloadSize::Indicated);
    master.transfer_one(write).expect("the bus works").expect("written");
    assert_eq!(master.second_answers(), []);
    let initiates: Vec<&str> =
        bus.sent.iter().map(String::as_str).filter(|frame| frame.starts_with("605#40")).collect();
    assert_eq!(initiates, ["605#4008100000000000"], "{:?}", bus.sent);
    assert!(bus.inner.now().mono < Mono::at(Duration::from_secs(1)), "no time-out");
}

#[test]
fn frames_received_before_ctrl_c_are_recorded() {
    let text = "clock = \"virtual\"\n[[device]]\nkind = \"dps\"\nnode = 5\n";
    let mut bus = stalled(text, 1000..1503, true);
    let plan = plan(Mode::AsSent, Duration::from_secs(60));
    let mut kept = RecordedRows::default();
    let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut kept).expect("a recording");
    assert!(outcome.interrupted);
    assert_eq!(bus.waiting.len(), 0);
    // The device sends five times in half a second.
    let late = kept.rows.iter().filter(|row| row.starts_with("1603000,"));
    assert!((5..=6).contains(&late.count()), "{:?}", kept.rows);
    assert!(bus.inner.now().mono < Mono::at(Duration::from_millis(1700)), "the recording ends without waiting");
}

/// All rows may have been received before the recording starts. The recording ends with its last row, so no
/// node is reported as lost.
#[test]
fn recording_with_a_count_ends_with_its_last_row() {
    let text = "clock = \"virtual\"\n[[device]]\nkind = \"dps\"\nnode = 5\nstart = true\n";
    for (milliseconds, count) in [(0..5000, 10), (0..5000, 40), (0..900, 5)] {
        let mut bus = stalled(text, milliseconds, false);
        bus.sleep().expect("the bus works");
        let node = NodeId::new(5).expect("a node-ID");
        let overrides = BTreeMap::from([(node, catalog::by_name("dps").expect("built in"))]);
        let plan = LogOptions { count: Some(count), overrides, ..plan(Mode::Passive, Duration::from_secs(60)) };
        let outcome = log(&mut Master::new(&mut bus, Timing::default()), &plan, &mut RecordedRows::default());
        let outcome = outcome.expect("a recording");
        assert_eq!((outcome.rows, outcome.lost), (count, Vec::new()));
        assert!(outcome.length <= Duration::from_millis(100) * u32::try_from(count).expect("small"));
    }
}

/// Reads object 2000h of node 5.
fn read(master: &mut Master<'_>) -> Result<Option<u64>, SdoError> {
    let node = NodeId::new(5).expect("a node-ID");
    let value = master.read(node, ObjectId::new(0x2000, 0), DataType::Unsigned(4)).expect("the bus works");
    value.as_ref().map(Value::as_u64).map_err(Clone::clone)
}

#[test]
fn frame_received_before_the_request_is_not_its_answer() {
    let mut inner = MemoryBus::new(Clock::Virtual);
    inner.attach(Slow::new(&[1]));
    inner.attach(Other::new(&[(20, "705#05"), (30, "585#4300200063000000")]));
    let mut bus = stall(inner, 0..500, false);
    let mut master = Master::new(&mut bus, Timing::default());
    let first = master.next(Mono::at(Duration::from_secs(1))).expect("the bus works");
    assert!(matches!(first, MasterEvent::Frame(_)), "{first:?}: the answer still waits");
    assert_eq!(read(&mut master).expect("an answer"), Some(1), "99 is the old frame");
}

#[test]
fn late_answer_is_rejected_after_a_pause_of_the_program() {
    let mut inner = MemoryBus::new(Clock::Virtual);
    inner.attach(Slow::new(&[150]));
    let mut bus = stall(inner, 0..500, false);
    let timeout = Duration::from_millis(100);
    let error = read(&mut Master::new(&mut bus, Timing { timeout, retries: 0 })).expect_err("no answer in time");
    assert_eq!(
        error.failure,
        SdoFailure::NoAnswer { waited: timeout, started: false, missed: MissedAnswer::default() }
    );
}
