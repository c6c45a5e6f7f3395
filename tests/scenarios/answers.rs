//! Late answers, and answers to another client's requests: the program accepts neither as its own.

use cangauge::bus::Bus;
use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::DownloadSize;
use cangauge::canopen::value::{DataType, Value};
use cangauge::master::{Blocks, Master, Operation, Request, SdoFailure, Timing};
use std::collections::VecDeque;
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_millis(100);

/// A server that answers each read with the next number. Each answer has its own delay.
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
        // A server answers in order.
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

/// Reads the objects in order; the answers arrive after `delays` (ms). Returns the values.
fn reads(objects: &[u16], retries: u32, delays: &[u64]) -> Vec<Option<u64>> {
    reads_without(objects, retries, delays, &[])
}

/// Like `reads`; the sent frames with the numbers in `lost` (from 0) are lost.
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
fn late_answer_is_not_used_for_another_object() {
    assert_eq!(reads(&[0x2000, 0x2001], 0, &[150, 1]), [None, Some(2)]);
}

#[test]
fn late_answer_is_not_used_for_the_next_read_of_the_same_object() {
    // Before the second read the client reads 1000h (answer 2). After that answer, the late one cannot arrive.
    // The second read gets answer 3.
    assert_eq!(reads(&[0x2000, 0x2000, 0x2000], 0, &[150, 1, 1, 1]), [None, Some(3), Some(4)]);
    // After a repeated request there are two answers to one read.
    assert_eq!(reads(&[0x2000, 0x2000], 1, &[150, 1, 1, 1]), [Some(1), Some(4)]);
    // If the late answer has arrived already, no read of 1000h is needed.
    assert_eq!(reads(&[0x2000, 0x2001, 0x2000], 0, &[120, 50, 1, 1]), [None, Some(2), Some(3)]);
}

#[test]
fn object_with_a_stale_request_is_not_used_for_the_barrier_read() {
    // The answers to 1000h and 2000h are both late: reading 1000h again proves nothing.
    assert_eq!(reads(&[0x1000, 0x2000, 0x2000], 0, &[250, 1, 1, 1]), [None, None, Some(4)]);
}

#[test]
fn failed_barrier_read_is_reported_instead_of_the_write() {
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
fn unanswered_block_request_is_reported_as_the_write() {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
    let object = ObjectId::new(0x2000, 0);
    let write = Request::write(node(), object, vec![0; 50], DownloadSize::Indicated);
    let write = write.blocks(Blocks::First { threshold: 0 });
    let error = master.transfer_one(write).expect("the bus works").expect_err("no device is there");
    assert_eq!((error.operation, error.object), (Operation::Write, object));
}

#[test]
fn barrier_read_is_repeated_like_any_read() {
    assert_eq!(reads_without(&[0x2000, 0x2000], 1, &[150], &[2]), [Some(1), Some(4)]);
    // The answer to the repeated barrier read is not used for a later read of 1000h.
    assert_eq!(reads(&[0x2000, 0x2000, 0x1000], 1, &[150, 1, 101, 1]), [Some(1), Some(5), Some(6)]);
}

#[test]
fn every_read_of_a_silent_server_fails() {
    assert_eq!(reads(&[0x2000, 0x2000], 1, &[10_000]), [None, None]);
}

/// A server that acknowledges the other client's write and rejects ours.
struct TwoClientServer {
    ours: bool,
}

impl Station for TwoClientServer {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        if frame.data().first() == Some(&0x2f) && !self.ours {
            self.ours = true;
            // The other client's request was sent first, so its acknowledgement comes first.
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
fn acknowledgement_for_another_client_is_ambiguous() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(TwoClientServer { ours: false });
    let mut master = Master::new(&mut bus, Timing::default());
    let request = Request::write(node(), ObjectId::new(0x2000, 0), vec![5], DownloadSize::Indicated);
    let error = master.transfer_one(request).expect("the bus works").expect_err("no success");
    assert_eq!(error.failure, SdoFailure::Ambiguous);
}

/// A server that starts a segmented transfer and then does not answer. It keeps the received frames.
#[derive(Default)]
struct StalledServer {
    received: Vec<String>,
}

impl Station for StalledServer {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        self.received.push(frame.to_string());
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

/// The last frame that the stalled server receives, for a read that ends at `interrupt` at the latest.
fn last_received(interrupt: Option<Duration>) -> String {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(StalledServer::default());
    if let Some(moment) = interrupt {
        bus.interrupt_at(Mono::START + moment);
    }
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
    let ended = master.transfer_one(Request::read(node(), ObjectId::new(0x2000, 0)));
    assert_eq!(ended.is_err(), interrupt.is_some());
    master.settle();
    // Frames sent just now need time on the bus.
    let _ = bus.receive(bus.now().mono + Duration::from_millis(10)).expect("the bus works");
    let server = bus.stations::<StalledServer>().next().expect("it is there");
    server.received.last().expect("a request").clone()
}

#[test]
fn started_transfer_is_aborted_on_timeout_and_interrupt() {
    for interrupt in [None, Some(TIMEOUT / 2)] {
        assert_eq!(last_received(interrupt), "605#8000200000000405", "{interrupt:?}");
    }
}

/// A station that sends one frame every 10 ms for two seconds.
struct PeriodicSender(Frame, Mono);

impl Station for PeriodicSender {
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
fn other_frames_do_not_extend_the_timeout() {
    // TPDOs, heartbeats, requests of another client, and the answers to them.
    for text in ["185#0000803F00", "705#05", "605#4001200000000000", "585#4301200001000000", "585#60012000"] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(PeriodicSender(text.parse().expect("a frame"), Mono::START + Duration::from_millis(1)));
        let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
        let error = master.transfer_one(Request::read(node(), ObjectId::new(0x2000, 0))).expect("the bus works");
        let failure = error.expect_err("no node answers").failure;
        assert!(matches!(failure, SdoFailure::NoAnswer { waited: TIMEOUT, started: false, .. }), "{text}: {failure}");
        assert!(master.now().since_start() < TIMEOUT + Duration::from_millis(20), "{text}: {:?}", master.now());
    }
}

/// A device of which node 5 reads 1000h and 1017h. It changes each answer.
struct OddServer(fn(Frame) -> Frame);

impl Station for OddServer {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        let [command, a, b, c, ..] = *frame.data() else { return };
        if frame.id() != CanId::sdo_request(node()) {
            return;
        }
        let answer = if command == 0x40 { [0x4b, a, b, c, 0xf4, 1, 0, 0] } else { [0x60, a, b, c, 0, 0, 0, 0] };
        out.send((self.0)(Frame::full(CanId::sdo_response(node()), answer)));
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

const HEARTBEAT: ObjectId = ObjectId::new(0x1017, 0);

/// Index and sub-index of an acknowledge are 0.
fn without_index(frame: Frame) -> Frame {
    match frame.data() {
        [0x60, ..] => Frame::full(frame.id(), [0x60, 0, 0, 0, 0, 0, 0, 0]),
        _ => frame,
    }
}

#[test]
fn write_acknowledged_with_index_0_is_read_back() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(OddServer(without_index));
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 1 });
    let target = cangauge::node::Node::new(node());
    let written = cangauge::node::write::write(&mut master, &target, HEARTBEAT, &[0xf4, 1]).expect("it is read back");
    let cangauge::node::Written::ReadBack(Some(received)) = written else { panic!("{written:?}") };
    assert_eq!(received.to_string(), "585#6000000000000000");
    let error = cangauge::node::write::write(&mut master, &target, HEARTBEAT, &[1, 0]).expect_err("another value");
    let cangauge::node::Error::Sdo(error) = error else { panic!("{error:?}") };
    assert!(error.to_string().ends_with("no answer within 100 ms; received 585#6000000000000000"), "{error}");
}

#[test]
fn answer_with_another_cob_id_is_reported() {
    fn elsewhere(frame: Frame) -> Frame {
        Frame::new(CanId::standard(0x5c5).expect("an identifier"), frame.data()).expect("a frame")
    }
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(OddServer(elsewhere));
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 1 });
    master.listen_to(&[node()]).expect("filters");
    let error = master.transfer_one(Request::read(node(), HEARTBEAT)).expect("the bus works").expect_err("no answer");
    assert!(error.to_string().ends_with("; received 5C5#4B171000F4010000"), "{error}");
    // The channel that the user states.
    let channel = cangauge::bus::channels::SdoChannel {
        node: node(),
        request: CanId::sdo_request(node()),
        response: CanId::standard(0x5c5).expect("an identifier"),
    };
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(OddServer(elsewhere));
    let mut bus = cangauge::bus::channels::SdoChannels::new(bus, &[channel]);
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
    master.listen_to(&[node()]).expect("filters");
    assert!(master.transfer_one(Request::read(node(), HEARTBEAT)).expect("the bus works").is_ok());
}

/// A device that sends its boot-up message and answers SDO only from a later moment on.
struct SlowStart {
    boots: Option<Mono>,
    answers_from: Mono,
}

impl Station for SlowStart {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        if now >= self.answers_from {
            OddServer(|answer| answer).receive(now, frame, out);
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if self.boots.take_if(|boots| *boots <= now).is_some() {
            out.send(Frame::byte(CanId::heartbeat(node()), 0));
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.boots
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn requests_are_repeated_for_five_seconds_after_a_boot_up() {
    let at = |milliseconds| Mono::START + Duration::from_millis(milliseconds);
    for (answers_from, has_answer) in [(2500, true), (4800, true), (9000, false)] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(SlowStart { boots: Some(at(10)), answers_from: at(answers_from) });
        let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 1 });
        master.listen_to(&[node()]).expect("filters");
        let result = master.transfer_one(Request::read(node(), HEARTBEAT)).expect("the bus works");
        assert_eq!(result.is_ok(), has_answer, "{answers_from} ms");
        assert!(master.now() < at(5300), "it ends 5 s after the boot-up: {:?}", master.now());
    }
    // Without a boot-up message, and for a request that must not be repeated, nothing changes.
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(SlowStart { boots: Some(at(10)), answers_from: at(2500) });
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 1 });
    assert!(master.transfer_one(Request::read(node(), HEARTBEAT).once()).expect("the bus works").is_err());
    assert!(master.now() < at(300), "{:?}", master.now());
}
