//! Late answers, and the answers that another client's requests bring: none may become ours.

use cangauge::bus::Bus;
use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::DownloadSize;
use cangauge::canopen::value::{DataType, Value};
use cangauge::master::{Blocks, Master, Operation, Request, SdoFailure, Timing};
use std::collections::VecDeque;
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_millis(100);

/// A server that answers every read with a number that counts up, the n-th after its own delay.
pub(super) struct Slow {
    delays: VecDeque<u64>,
    due: VecDeque<(Mono, Frame)>,
    answered: u8,
}

impl Slow {
    pub(super) fn new(delays: &[u64]) -> Slow {
        Slow { delays: delays.iter().copied().collect(), due: VecDeque::new(), answered: 0 }
    }
}

impl Station for Slow {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        let [0x40, a, b, c, ..] = *frame.data() else { return };
        self.answered += 1;
        let answer = format!("585#43{a:02X}{b:02X}{c:02X}{:02X}000000", self.answered);
        // A server answers in order: no answer before an earlier one.
        let earliest = self.due.back().map_or(now, |(due, _)| *due);
        let due = earliest.max(now + Duration::from_millis(self.delays.pop_front().unwrap_or(1)));
        self.due.push_back((due, answer.parse().expect("a frame")));
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        while self.due.front().is_some_and(|(due, _)| *due <= now) {
            out.send(self.due.pop_front().expect("there is one").1);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.due.front().map(|(due, _)| *due)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

fn node() -> NodeId {
    NodeId::new(5).expect("a node-ID")
}

/// What reads of the objects give, one after the other, with answers that come after `delays` ms each.
fn reads(objects: &[u16], retries: u32, delays: &[u64]) -> Vec<Option<u64>> {
    reads_without(objects, retries, delays, &[])
}

/// The same where some of the frames that are sent, counted from 0, get lost.
fn reads_without(objects: &[u16], retries: u32, delays: &[u64], lost: &[u64]) -> Vec<Option<u64>> {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    bus.attach(Slow::new(delays));
    let mut bus = Faulty::new(bus, FaultPlan { lose_sent: lost.iter().copied().collect(), ..FaultPlan::default() });
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries });
    objects
        .iter()
        .map(|&index| {
            let value = master.read(node(), ObjectId::new(index, 0), DataType::Unsigned(4)).expect("the bus works");
            value.ok().as_ref().and_then(Value::as_u64)
        })
        .collect()
}

#[test]
fn a_late_answer_is_not_the_next_reading_of_another_object() {
    assert_eq!(reads(&[0x2000, 0x2001], 0, &[150, 1]), [None, Some(2)]);
}

#[test]
fn a_late_answer_is_not_the_next_reading_of_the_same_object() {
    // The second reading waits behind a read of 1000h (answer 2), which proves that the first one's answer
    // can come no more; its own is the third.
    assert_eq!(reads(&[0x2000, 0x2000, 0x2000], 0, &[150, 1, 1, 1]), [None, Some(3), Some(4)]);
    // After a repeat two answers are under way for one reading.
    assert_eq!(reads(&[0x2000, 0x2000], 1, &[150, 1, 1, 1]), [Some(1), Some(4)]);
    // An answer that came in the meantime, to nobody, needs no such care.
    assert_eq!(reads(&[0x2000, 0x2001, 0x2000], 0, &[120, 50, 1, 1]), [None, Some(2), Some(3)]);
}

#[test]
fn what_makes_sure_of_that_is_itself_no_object_that_an_old_answer_may_come_of() {
    // 1000h is answered late, and so is 2000h: to read 1000h once more would prove nothing.
    assert_eq!(reads(&[0x1000, 0x2000, 0x2000], 0, &[250, 1, 1, 1]), [None, None, Some(4)]);
}

#[test]
fn a_write_that_waits_behind_it_is_not_said_to_have_been_sent() {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    bus.attach(Slow::new(&[250]));
    let mut bus = Faulty::new(bus, FaultPlan { lose_sent: [1].into(), ..FaultPlan::default() });
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
    let object = ObjectId::new(0x2000, 0);
    master.read(node(), object, DataType::Unsigned(4)).expect("the bus works").expect_err("late");
    let write = Request::write(node(), object, vec![1], DownloadSize::Indicated);
    let error = master.transfer_one(write).expect("the bus works").expect_err("lost");
    assert_eq!((error.operation, error.object), (Operation::Read, ObjectId::new(0x1000, 0)));
}

#[test]
fn a_write_that_asked_for_blocks_in_vain_is_what_got_no_answer() {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
    let object = ObjectId::new(0x2000, 0);
    let write = Request::write(node(), object, vec![0; 50], DownloadSize::Indicated);
    let write = write.blocks(Blocks::First { threshold: 0 });
    let error = master.transfer_one(write).expect("the bus works").expect_err("nobody is there");
    assert_eq!((error.operation, error.object), (Operation::Write, object));
}

#[test]
fn what_makes_sure_of_that_is_repeated_as_the_reading_itself() {
    assert_eq!(reads_without(&[0x2000, 0x2000], 1, &[150], &[2]), [Some(1), Some(4)]);
    // An answer to its repetition is none to a reading of the same object.
    assert_eq!(reads(&[0x2000, 0x2000, 0x1000], 1, &[150, 1, 101, 1]), [Some(1), Some(5), Some(6)]);
}

#[test]
fn a_server_that_stays_silent_is_no_answer_however_often_it_is_asked() {
    assert_eq!(reads(&[0x2000, 0x2000], 1, &[10_000]), [None, None]);
}

/// A server for writes that acknowledges the other client's write and refuses ours.
struct Torn {
    ours: bool,
}

impl Station for Torn {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        if frame.data().first() == Some(&0x2f) && !self.ours {
            self.ours = true;
            // The other client's request was on the wire just before, and its acknowledge comes first.
            for text in ["605#2F00200007000000", "585#6000200000000000", "585#8000200030000906"] {
                out.send(text.parse().expect("a frame"));
            }
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn the_acknowledge_of_another_clients_write_is_no_success_of_ours() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Torn { ours: false });
    let mut master = Master::new(&mut bus, Timing::default());
    let request = Request::write(node(), ObjectId::new(0x2000, 0), vec![5], DownloadSize::Indicated);
    let error = master.transfer_one(request).expect("the bus works").expect_err("no success");
    assert_eq!(error.failure, SdoFailure::Ambiguous);
}

/// A server that begins a transfer in segments and falls silent, and what it hears.
#[derive(Default)]
struct Begun {
    heard: Vec<String>,
}

impl Station for Begun {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        self.heard.push(frame.to_string());
        if frame.data().first() == Some(&0x40) {
            out.send("585#4100200064000000".parse().expect("a frame"));
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// What a server that has begun hears last, of a read that ends at this time at the latest.
fn last_heard(interrupt: Option<Duration>) -> String {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Begun::default());
    if let Some(moment) = interrupt {
        bus.interrupt_at(Mono::START + moment);
    }
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
    let ended = master.transfer_one(Request::read(node(), ObjectId::new(0x2000, 0)));
    assert_eq!(ended.is_err(), interrupt.is_some());
    master.settle();
    // What has just been sent takes its time on the wire.
    let _ = bus.receive(bus.now().mono + Duration::from_millis(10)).expect("the bus works");
    let server = bus.stations::<Begun>().next().expect("it is there");
    server.heard.last().expect("a request").clone()
}

#[test]
fn a_server_that_has_begun_is_told_of_the_end() {
    for interrupt in [None, Some(TIMEOUT / 2)] {
        assert_eq!(last_heard(interrupt), "605#8000200000000405", "{interrupt:?}");
    }
}

/// Somebody who sends one frame every 10 ms for two seconds.
struct Chatter(Frame, Mono);

impl Station for Chatter {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if self.1 <= now {
            out.send(self.0);
            self.1 = now + Duration::from_millis(10);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.1).filter(|at| at.since_start() < Duration::from_secs(2))
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn no_other_frame_extends_the_wait() {
    // TPDOs, heartbeats, requests of another client, and the answers to them.
    for text in ["185#0000803F00", "705#05", "605#4001200000000000", "585#4301200001000000", "585#60012000"] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Chatter(text.parse().expect("a frame"), Mono::START + Duration::from_millis(1)));
        let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
        let error = master.transfer_one(Request::read(node(), ObjectId::new(0x2000, 0))).expect("the bus works");
        let failure = error.expect_err("nobody answers").failure;
        assert_eq!(failure, SdoFailure::NoAnswer { waited: TIMEOUT, started: false }, "{text}");
        assert!(master.now().since_start() < TIMEOUT + Duration::from_millis(20), "{text}: {:?}", master.now());
    }
}
