//! Every transfer ends, and a read that fails in the middle starts again.

use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::DownloadSize;
use cangauge::canopen::value::{DataType, Value};
use cangauge::device::catalog;
use cangauge::master::{Master, Request, SdoFailure, Timing};
use cangauge::node::Node;
use cangauge::node::survey::Overrides;
use cangauge::node::write::write_and_verify;
use cangauge::sim::{Bench, Device, Setup};
use cangauge::tasks::read::read;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_millis(100);

fn node() -> NodeId {
    NodeId::new(5).expect("a node-ID")
}

/// A server with an interrupted transfer: it rejects the first request of any kind.
struct Interrupted {
    rejections: u32,
}

impl Station for Interrupted {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        let [0x40, a, b, c, ..] = *frame.data() else { return };
        let answer = if self.rejections > 0 {
            self.rejections -= 1;
            format!("585#80{a:02X}{b:02X}{c:02X}01000405")
        } else {
            format!("585#43{a:02X}{b:02X}{c:02X}07000000")
        };
        out.send(answer.parse().expect("a frame"));
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn read_is_repeated_once_if_the_server_was_in_another_transfer() {
    for (rejections, retries, value) in [(1, 1, Some(7)), (1, 0, Some(7)), (2, 1, None)] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Interrupted { rejections });
        let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries });
        let read = master.read(node(), ObjectId::new(0x1000, 0), DataType::Unsigned(4)).expect("the bus works");
        assert_eq!(read.ok().as_ref().and_then(Value::as_u64), value, "{rejections} rejections");
    }
}

/// A server that starts a block transfer after its first request, as if a bit of the request was flipped. It then ignores
/// all requests until an abort.
#[derive(Default)]
struct Misread {
    answer: u8,
    is_in_blocks: Option<bool>,
    written: Option<u8>,
}

impl Station for Misread {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        let [command, a, b, c, value, ..] = *frame.data() else { return };
        let answer = match (self.is_in_blocks, command) {
            (None, _) => {
                self.is_in_blocks = Some(true);
                format!("{:02X}{a:02X}{b:02X}{c:02X}0A000000", self.answer)
            }
            (Some(true), 0x80) => {
                self.is_in_blocks = Some(false);
                return;
            }
            (Some(false), 0x40) => format!("43{a:02X}{b:02X}{c:02X}07000000"),
            (Some(false), _) => {
                self.written = Some(value);
                format!("60{a:02X}{b:02X}{c:02X}00000000")
            }
            (Some(true), _) => return,
        };
        out.send(format!("585#{answer}").parse().expect("a frame"));
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn block_transfer_that_was_not_requested_is_aborted() {
    let (object, number) = (ObjectId::new(0x1000, 0), DataType::Unsigned(4));
    for answer in [0xa0, 0xa4, 0xc0, 0xc6] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Misread { answer, ..Misread::default() });
        let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 1 });
        let read = master.read(node(), object, number).expect("the bus works");
        assert_eq!(read.ok().as_ref().and_then(Value::as_u64), Some(7), "{answer:02X}");
        // A write is not repeated, because its answer does not show whether it had an effect. The next one arrives.
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Misread { answer, ..Misread::default() });
        let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 1 });
        let write = |master: &mut Master<'_>, value| {
            let request = Request::write(node(), ObjectId::new(0x1017, 0), vec![value, 0], DownloadSize::Indicated);
            master.transfer_one(request).expect("the bus works").is_ok()
        };
        assert!(!write(&mut master, 1), "{answer:02X}");
        assert!(write(&mut master, 2), "{answer:02X}");
        drop(master);
        assert_eq!(bus.stations::<Misread>().next().expect("the server").written, Some(2));
    }
}

/// Reads the name of a transmitter, three segments, with these faults.
fn name_with(plan: FaultPlan, retries: u32) -> Result<Value, SdoFailure> {
    let setup = Setup::new(catalog::by_name("mh4").expect("built in"), node());
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Device::new(setup).expect("a device"));
    let mut bus = Faulty::new(bus, plan);
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries });
    let name = master.read(node(), ObjectId::new(0x1008, 0), DataType::VisibleString).expect("the bus works");
    name.map_err(|error| error.failure)
}

#[test]
fn segmented_read_starts_again_after_a_lost_frame() {
    let name = Ok(Value::Text("MH-4-CAN".to_owned()));
    for lost in 0..3 {
        let sent = || FaultPlan { lose_sent: [lost].into(), ..FaultPlan::default() };
        // The first received frame is the boot-up message.
        let received = || FaultPlan { lose: [lost + 1].into(), ..FaultPlan::default() };
        assert_eq!((name_with(sent(), 1), name_with(received(), 1)), (name.clone(), name.clone()), "frame {lost}");
        assert!(name_with(sent(), 0).is_err() && name_with(received(), 0).is_err(), "without --retries, frame {lost}");
    }
    // A changed toggle bit.
    let garbled = || FaultPlan { garble: [(2, (0, 0x10))].into(), ..FaultPlan::default() };
    assert_eq!(name_with(garbled(), 1), name);
    assert!(name_with(garbled(), 0).is_err());
}

/// A server whose upload has no last segment: segments of `length` bytes at this interval.
struct Endless {
    length: u8,
    interval: Duration,
    toggle: bool,
    due: Option<(Mono, Frame)>,
}

impl Station for Endless {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        match *frame.data() {
            [0x40, a, b, c, ..] => {
                self.toggle = false;
                out.send(format!("585#40{a:02X}{b:02X}{c:02X}00000000").parse().expect("a frame"));
            }
            [0x60 | 0x70, ..] => {
                let command = u8::from(self.toggle) << 4 | (7 - self.length) << 1;
                self.toggle = !self.toggle;
                self.due =
                    Some((now + self.interval, format!("585#{command:02X}41414141414141").parse().expect("a frame")));
            }
            _ => self.due = None,
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if let Some((_, frame)) = self.due.take_if(|(due, _)| *due <= now) {
            out.send(frame);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.due.as_ref().map(|(due, _)| *due)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn upload_without_an_end_ends() {
    let slow = Duration::from_millis(90);
    for (index, length, interval, seconds) in [
        (0x1000, 7, slow, 1),
        (0x6130, 1, slow, 3),
        (0x6130, 0, slow, 3),
        (0x1008, 7, slow, 5),
        (0x2000, 7, Duration::from_millis(1), 5),
        // Each segment is in time.
        (0x1008, 1, Duration::from_millis(400), 6),
        (0x2000, 7, Duration::from_millis(400), 12),
        (0x6130, 0, Duration::from_millis(400), 6),
    ] {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Endless { length, interval, toggle: false, due: None });
        let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT.max(interval * 5 / 4), retries: 1 });
        let result = master.transfer_one(Request::read(node(), ObjectId::new(index, 0))).expect("the bus works");
        assert!(result.is_err(), "{index:04X}h");
        let took = master.now().since_start();
        assert!(took < Duration::from_secs(seconds), "{index:04X}h with {length} bytes took {took:?}");
    }
}

#[test]
fn all_transfers_together_end_with_their_time() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Endless { length: 7, interval: Duration::from_millis(90), toggle: false, due: None });
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 1 });
    let time = Duration::from_millis(500);
    master.limit_transfers(Some(time));
    let requests = [0x2000, 0x2001].map(|index| Request::read(node(), ObjectId::new(index, 0))).to_vec();
    for result in master.transfer(requests, &mut |_| {}).expect("the bus works") {
        assert_eq!(result.expect_err("too slow").failure, SdoFailure::TimeLimit(time));
    }
    assert!(master.now().since_start() < Duration::from_millis(600));
}

/// A wire that loses, doubles and delays 3 of 100 frames.
fn bad_wire(seed: u64) -> FaultPlan {
    let mut state = (seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut some = || -> BTreeSet<u64> {
        let mut is_chosen = |_: &u64| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state % 100 < 3
        };
        (0..1000).filter(|number| is_chosen(number)).collect()
    };
    let (lose_sent, lose, duplicate, late) = (some(), some(), some(), some());
    let delay = late.into_iter().map(|number| (number, Duration::from_millis(30))).collect();
    FaultPlan { lose_sent, lose, duplicate, delay, ..FaultPlan::default() }
}

#[test]
fn few_operations_fail_on_a_wire_that_loses_three_of_a_hundred_frames() {
    const RUNS: u64 = 300;
    let bench = "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 5\n[[device.channel]]\nchannel = 1\n\
                 base = 5.0\namplitude = 0.0\nnoise = 0.0\n";
    let mut failed = [0; 3];
    for seed in 0..RUNS {
        let bus = Bench::from_toml(bench, Path::new("")).expect("a bench").open().expect("a bus");
        let mut bus = Faulty::new(bus, bad_wire(seed));
        let mut master = Master::new(&mut bus, Timing::default());
        match master.read(node(), ObjectId::new(0x1008, 0), DataType::VisibleString).expect("the bus works") {
            Ok(name) => assert_eq!(name, Value::Text("MH-4-CAN".to_owned()), "seed {seed}"),
            Err(_) => failed[0] += 1,
        }
        let readings = read(&mut master, &[node()], &[], &Overrides::new()).expect("the bus works");
        match readings[0].as_ref().ok().and_then(|all| all.first()?.1.value) {
            Some(value) => assert_eq!(value.to_string(), "5", "seed {seed}"),
            None => failed[1] += 1,
        }
        let (object, bytes) = (ObjectId::new(0x1017, 0), [seed.to_le_bytes()[0], 1]);
        let written = write_and_verify(&mut master, &Node::new(node()), object, &bytes, DataType::Unsigned(2));
        failed[2] += u64::from(written.is_err());
    }
    assert!(failed.iter().all(|&count| count * 10 <= RUNS), "{failed:?} of {RUNS}");
}
