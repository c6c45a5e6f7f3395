//! The choice between blocks and segments, pacing and time-outs: the master on the simulated bus with simulated devices
//! that support block transfer, reject it, or ignore it.

use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::{Bus, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{BlockUpload, DownloadSize, Progress, TransferError};
use cangauge::canopen::value::DataType;
use cangauge::canopen::wire_length::frame_time;
use cangauge::device::catalog::Model;
use cangauge::master::{
    Answer, BlockMode, Blocks, Error, Master, Request, SdoError, SdoFailure, Timing, TransferKind, read_object,
    write_object,
};
use cangauge::sim::{Device, Setup};
use std::sync::Arc;
use std::time::Duration;

const DOMAIN: ObjectId = ObjectId::new(0x2100, 0);
const TEXT: ObjectId = ObjectId::new(0x2101, 0);
const SETTING: ObjectId = ObjectId::new(0x2102, 0);
const MISSING: ObjectId = ObjectId::new(0x2103, 0);

fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

fn device(number: u8, block: bool) -> Device {
    let description = format!(
        r#"
        name = "blocks"
        title = "a device of the tests"
        vendor = "test"
        source = "none"
        identify = {{ device_type = 0x00020194 }}
        sdo = {{ block = {block} }}
        object = [
            {{ at = "0x1000", name = "device-type", type = "u32", access = "ro", default = 0x00020194 }},
            {{ at = "0x1001", name = "error-register", type = "u8", access = "ro", default = 0 }},
            {{ at = "0x2100", name = "data", type = "d", access = "rw" }},
            {{ at = "0x2101", name = "text", type = "vs", access = "rw" }},
            {{ at = "0x2102", name = "setting", type = "u32", access = "rw", default = 7 }},
        ]"#
    );
    Device::new(Setup::new(Arc::new(Model::from_toml(&description).unwrap()), node(number))).unwrap()
}

/// Records all frames on the bus.
#[derive(Default)]
struct Tap(Vec<(Mono, Frame)>);

impl Station for Tap {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}
    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        self.0.push((now, *frame));
    }
    fn wake(&mut self, _: Mono, _: &mut Outbox) {}
    fn next_wake(&self) -> Option<Mono> {
        None
    }
    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// A device that ignores block requests.
struct IgnoresBlocks(Device);

impl Station for IgnoresBlocks {
    fn power_on(&mut self, now: Mono, out: &mut Outbox) {
        self.0.power_on(now, out);
    }
    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        if !matches!(frame.data().first(), Some(0xa4 | 0xc6)) {
            self.0.receive(now, frame, out);
        }
    }
    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        self.0.wake(now, out);
    }
    fn next_wake(&self) -> Option<Mono> {
        self.0.next_wake()
    }
    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.0.sent(now, frame);
    }
}

fn bus(bit_rate: u32, stations: impl IntoIterator<Item = impl Station>) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(bit_rate);
    bus.attach(Tap::default());
    stations.into_iter().for_each(|station| bus.attach(station));
    // The devices start up.
    while !matches!(bus.receive(Mono::at(Duration::from_secs(5))).unwrap(), cangauge::bus::Event::Timeout) {}
    for tap in bus.stations_mut::<Tap>() {
        tap.0.clear();
    }
    bus
}

fn wire(bus: &MemoryBus) -> Vec<String> {
    bus.stations::<Tap>().flat_map(|tap| &tap.0).map(|(_, frame)| frame.to_string()).collect()
}

fn content(length: usize) -> Vec<u8> {
    let mut state = 1u32;
    let next = |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()[0]
    };
    (0..length).map(next).collect()
}

type Outcome = Result<Answer, SdoError>;

fn write(bus: &mut dyn Bus, object: ObjectId, data: &[u8], mode: BlockMode) -> Outcome {
    let mut master = Master::new(bus, Timing::default());
    let size = DownloadSize::Indicated;
    let outcome = write_object(&mut master, (node(5), object), data.to_vec(), size, mode, &mut |_| {}).unwrap();
    master.settle();
    outcome
}

fn read(bus: &mut dyn Bus, object: ObjectId, data_type: Option<DataType>, mode: BlockMode) -> Outcome {
    let mut master = Master::new(bus, Timing::default());
    let outcome = read_object(&mut master, (node(5), object), data_type, (mode, usize::MAX), &mut |_| {}).unwrap();
    master.settle();
    outcome
}

fn kind(outcome: &Outcome) -> TransferKind {
    outcome.as_ref().unwrap().kind
}

fn bytes(outcome: Outcome) -> Vec<u8> {
    outcome.unwrap().uploaded.unwrap().bytes
}

/// The abort code of a rejected transfer.
fn refusal(outcome: Outcome) -> u32 {
    match outcome.unwrap_err().failure {
        SdoFailure::Refused(code) => code.0,
        other => panic!("{other}"),
    }
}

#[test]
fn each_size_is_transferred_in_each_mode() {
    for block in [true, false] {
        let mut bus = bus(1_000_000, [device(5, block)]);
        for length in [0, 1, 4, 5, 7, 8, 28, 29, 888, 889, 890, 1778, 1779, 5000] {
            let data = content(length);
            for mode in [BlockMode::Auto, BlockMode::Always, BlockMode::Never] {
                let written = write(&mut bus, DOMAIN, &data, mode);
                if mode == BlockMode::Always && !block {
                    assert_eq!(refusal(written), 0x0504_0001);
                    assert_eq!(refusal(read(&mut bus, DOMAIN, None, mode)), 0x0504_0001);
                    continue;
                }
                let in_blocks = mode == BlockMode::Always || mode == BlockMode::Auto && length > 28;
                let kind_in = match (in_blocks, block) {
                    (true, true) => TransferKind::Blocks,
                    (true, false) => TransferKind::PlainFallback,
                    (false, _) => TransferKind::Plain,
                };
                assert_eq!(kind(&written), kind_in, "write {length} {mode:?} {block}");
                let found = read(&mut bus, DOMAIN, Some(DataType::Domain), mode);
                // A device rejects block transfer before it checks the length.
                let kind_out = if mode == BlockMode::Auto && !block { TransferKind::PlainFallback } else { kind_in };
                assert_eq!(kind(&found), kind_out, "read {length} {mode:?} {block}");
                assert_eq!(bytes(found), data);
            }
            // Text and unknown types are read in blocks only if they are large.
            for data_type in [None, Some(DataType::VisibleString)] {
                let found = read(&mut bus, DOMAIN, data_type, BlockMode::Auto);
                let expected = match length {
                    ..889 => TransferKind::Plain,
                    _ if block => TransferKind::Blocks,
                    _ => TransferKind::PlainFallback,
                };
                assert_eq!(kind(&found), expected, "read {length} {data_type:?} {block}");
                assert_eq!(bytes(found), data);
            }
        }
    }
}

#[test]
fn a_rejected_block_transfer_costs_two_frames() {
    let mut bus = bus(250_000, [device(5, false)]);
    assert_eq!(kind(&write(&mut bus, TEXT, &[b'x'; 29], BlockMode::Auto)), TransferKind::PlainFallback);
    assert_eq!(bytes(read(&mut bus, TEXT, Some(DataType::Domain), BlockMode::Auto)), [b'x'; 29]);
    let frames = wire(&bus);
    assert_eq!(
        frames[..5],
        [
            "605#C60121001D000000",
            "585#8001210001000405",
            "605#210121001D000000",
            "585#6001210000000000",
            "605#0078787878787878",
        ]
    );
    assert_eq!(
        frames[14..18],
        ["605#A40121007F1C0000", "585#8001210001000405", "605#4001210000000000", "585#410121001D000000"]
    );
    assert_eq!(frames.len(), 28);
}

#[test]
fn the_read_of_a_large_object_restarts_in_blocks() {
    for (block, answers) in [
        (true, &["585#C60121007D030000", "605#A300000000000000"]),
        (false, &["585#8001210001000405", "605#4001210000000000"]),
    ] {
        let mut bus = bus(250_000, [device(5, block)]);
        write(&mut bus, TEXT, &[b'x'; 893], BlockMode::Never).unwrap();
        let before = wire(&bus).len();
        assert_eq!(bytes(read(&mut bus, TEXT, None, BlockMode::Auto)), [b'x'; 893]);
        let start = ["605#4001210000000000", "585#410121007D030000", "605#8001210000000008", "605#A40121007F000000"];
        let frames = wire(&bus).split_off(before);
        assert_eq!(frames[..4], start);
        assert_eq!(frames[4..6], *answers);
    }
}

#[test]
fn an_abort_about_the_object_is_not_retried() {
    let mut bus = bus(250_000, [device(5, true)]);
    assert_eq!(refusal(read(&mut bus, MISSING, Some(DataType::Domain), BlockMode::Auto)), 0x0602_0000);
    assert_eq!(wire(&bus), ["605#A40321007F1C0000", "585#8003210000000206"]);
}

#[test]
fn a_device_that_ignores_blocks_is_read_in_segments() {
    let mut bus = bus(250_000, [IgnoresBlocks(device(5, true))]);
    let start = bus.now().mono;
    assert_eq!(kind(&write(&mut bus, TEXT, &[b'x'; 40], BlockMode::Auto)), TransferKind::PlainFallback);
    let found = read(&mut bus, TEXT, Some(DataType::Domain), BlockMode::Auto);
    assert_eq!(kind(&found), TransferKind::PlainFallback);
    assert_eq!(bytes(found), [b'x'; 40]);
    let waited = bus.now().mono.since(start);
    assert!(waited < Duration::from_millis(1_100), "one time-out each, not {waited:?}");
    // A missing device: the same time-out as for any other read.
    let start = bus.now().mono;
    let mut master = Master::new(&mut bus, Timing::default());
    let outcome =
        read_object(&mut master, (node(9), TEXT), Some(DataType::Domain), (BlockMode::Auto, usize::MAX), &mut |_| {});
    assert!(matches!(outcome.unwrap().unwrap_err().failure, SdoFailure::NoAnswer { started: false, .. }));
    let waited = master.now().since(start);
    assert!(waited < Duration::from_millis(1_100), "{waited:?}");
}

/// The bus is never idle while there are frames to send, for any number of stuff bits, and although a sub-block takes
/// longer than the time-out (1.7 s at 10 kbit/s).
#[test]
fn block_transfers_keep_the_bus_busy() {
    for (bit_rate, length) in [(1_000_000, 100_000), (125_000, 20_000), (10_000, 2_000)] {
        for data in [content(length), vec![0x55; length], vec![0; length]] {
            let mut bus = bus(bit_rate, [device(5, true)]);
            for writes in [true, false] {
                let start = bus.now().mono;
                bus.stations_mut::<Tap>().for_each(|tap| tap.0.clear());
                let outcome = if writes {
                    write(&mut bus, DOMAIN, &data, BlockMode::Always)
                } else {
                    read(&mut bus, DOMAIN, None, BlockMode::Always)
                };
                let took = outcome.as_ref().unwrap().at.mono.since(start);
                if !writes {
                    assert_eq!(bytes(outcome), data);
                }
                let frames: Vec<Frame> =
                    bus.stations::<Tap>().flat_map(|tap| &tap.0).map(|(_, frame)| *frame).collect();
                let least: Duration = frames.iter().map(|frame| frame_time(frame, bit_rate)).sum();
                assert!(took <= least * 105 / 100, "{bit_rate} bit/s: {took:?} for {least:?}");
                let segments = length.div_ceil(7);
                assert!(frames.len() <= segments + segments / 127 + 6, "{} frames", frames.len());
            }
        }
    }
}

/// Reads the object after the fault. The device answers from any state; the fault may hit the first of these reads.
fn in_the_end(bus: &mut dyn Bus) -> Vec<u8> {
    let found = read(bus, DOMAIN, None, BlockMode::Never);
    bytes(found.or_else(|_| read(bus, DOMAIN, None, BlockMode::Never)))
}

/// Each frame of a transfer is lost in turn, from the client or from the device.
#[test]
fn one_lost_frame_never_causes_a_false_success() {
    let data = content(7 * 130);
    let mut recovered = 0;
    for lost in 0..136 {
        for (sent, received) in [(true, false), (false, true)] {
            let mut inner = bus(250_000, [device(5, true)]);
            write(&mut inner, DOMAIN, b"before", BlockMode::Never).unwrap();
            let plan = FaultPlan {
                lose_sent: sent.then_some(lost).into_iter().collect(),
                lose: received.then_some(lost).into_iter().collect(),
                ..FaultPlan::default()
            };
            let mut faulty = Faulty::new(inner, plan);
            let written = write(&mut faulty, DOMAIN, &data, BlockMode::Always);
            let found = in_the_end(&mut faulty);
            written.unwrap_or_else(|error| panic!("frame {lost}: {error}"));
            assert_eq!(found, data);

            let mut inner = bus(250_000, [device(5, true)]);
            write(&mut inner, DOMAIN, &data, BlockMode::Never).unwrap();
            let plan = FaultPlan {
                lose_sent: sent.then_some(lost).into_iter().collect(),
                lose: received.then_some(lost).into_iter().collect(),
                ..FaultPlan::default()
            };
            let mut faulty = Faulty::new(inner, plan);
            let found = read(&mut faulty, DOMAIN, None, BlockMode::Always);
            if found.is_ok() {
                recovered += 1;
                assert_eq!(bytes(found), data);
            }
            assert_eq!(in_the_end(&mut faulty), data);
        }
    }
    // Segments within a sub-block. A frame lost at its ends may end an upload; a download starts again.
    assert!(recovered >= 2 * 136 - 10, "{recovered}");
}

/// A lost frame in the middle of a segmented download. Without --retries, and for programs, it ends the transfer.
#[test]
fn a_download_starts_again_from_its_initiate() {
    let data = content(30);
    for lost in 1..6 {
        for retries in [1, 0] {
            let inner = bus(250_000, [device(5, true)]);
            let mut faulty = Faulty::new(inner, FaultPlan { lose_sent: [lost].into(), ..FaultPlan::default() });
            let mut master = Master::new(&mut faulty, Timing { retries, ..Timing::default() });
            let (size, mode) = (DownloadSize::Indicated, BlockMode::Never);
            let written = write_object(&mut master, (node(5), DOMAIN), data.clone(), size, mode, &mut |_| {}).unwrap();
            assert_eq!(written.is_ok(), retries == 1, "frame {lost}");
            drop(master);
            assert_eq!(in_the_end(&mut faulty) == data, retries == 1, "frame {lost}");
        }
    }
}

#[test]
fn a_lost_last_segment_costs_one_time_out() {
    let data = content(100);
    let mut inner = bus(250_000, [device(5, true)]);
    write(&mut inner, DOMAIN, &data, BlockMode::Never).unwrap();
    let start = inner.now().mono;
    // The answer to the request, then 15 segments.
    let mut faulty = Faulty::new(inner, FaultPlan { lose: [15].into(), ..FaultPlan::default() });
    assert_eq!(bytes(read(&mut faulty, DOMAIN, None, BlockMode::Always)), data);
    let waited = faulty.now().mono.since(start);
    assert!(waited > Duration::from_millis(500) && waited < Duration::from_millis(550), "{waited:?}");
    let frames = wire(faulty.inner());
    assert!(frames.contains(&"605#A20E7F0000000000".to_owned()));
}

#[test]
fn ctrl_c_within_a_sub_block_aborts_the_transfer() {
    for reads in [true, false] {
        let data = content(5_000);
        let mut bus = bus(125_000, [device(5, true)]);
        write(&mut bus, DOMAIN, &data, BlockMode::Never).unwrap();
        bus.interrupt_at(bus.now().mono + Duration::from_millis(300));
        let mut master = Master::new(&mut bus, Timing::default());
        let request = if reads {
            Request::read(node(5), DOMAIN).up_to(5_000)
        } else {
            Request::write(node(5), DOMAIN, vec![0; 5_000], DownloadSize::Indicated)
        };
        let mut reports = Vec::new();
        let outcome = master.carry_out(request.blocks(Blocks::Only), &mut |moved| reports.push(moved));
        assert!(matches!(outcome, Err(Error::Interrupted)));
        master.settle();
        assert!(matches!(reports[..], [(moved, Some(5_000)), ..] if moved > 0 && moved < 5_000), "{reports:?}");
        // The segments have priority over the abort. After it the device sends no more.
        let until = bus.now().mono + Duration::from_millis(300);
        while !matches!(bus.receive(until).unwrap(), cangauge::bus::Event::Timeout) {}
        assert_eq!(wire(&bus).last().unwrap(), "605#8000210000000405");
        assert_eq!(bytes(read(&mut bus, DOMAIN, None, BlockMode::Always)), data);
    }
}

#[test]
fn two_devices_are_transferred_in_parallel() {
    let data = content(3_000);
    let mut bus = bus(500_000, [device(5, true), device(6, true)]);
    let mut master = Master::new(&mut bus, Timing::default());
    let write = |number| {
        let request = Request::write(node(number), DOMAIN, content(3_000), DownloadSize::Indicated);
        request.blocks(Blocks::First { threshold: 0 })
    };
    let results = master.transfer(vec![write(5), write(6), Request::read(node(5), SETTING)], &mut |_| {}).unwrap();
    assert!(results.iter().all(Result::is_ok), "{results:?}");
    let read = |number| Request::read(node(number), DOMAIN).blocks(Blocks::Only).up_to(4096);
    let results = master.transfer(vec![read(5), read(6)], &mut |_| {}).unwrap();
    for result in results {
        assert_eq!(bytes(result), data);
    }
}

#[test]
fn a_megabyte_is_transferred_in_both_directions() {
    let data = content(1 << 20);
    let mut bus = bus(1_000_000, [device(5, true)]);
    assert_eq!(kind(&write(&mut bus, DOMAIN, &data, BlockMode::Auto)), TransferKind::Blocks);
    let found = read(&mut bus, DOMAIN, None, BlockMode::Auto);
    assert_eq!(kind(&found), TransferKind::Blocks);
    assert!(bytes(found) == data);
}

/// One changed bit makes an expedited answer without a size (46h) of the start of a block transfer (C6h).
#[test]
fn changed_answer_to_a_block_request_is_no_value() {
    for command in [0x46, 0x4a, 0x4e] {
        let object = ObjectId::new(0x2000, 0);
        let (mut upload, mut frames) = (BlockUpload::new(node(5), object, 28, false), Vec::new());
        let answer = Frame::full(CanId::sdo_response(node(5)), [command, 0, 0x20, 0, 4, 0, 0, 0]);
        let progress = upload.on_frame(&answer, &mut frames);
        assert!(matches!(progress, Progress::Failed(TransferError::Violation(..))), "{command:x}: {progress:?}");
        assert_eq!(frames.last().map(|frame| frame.data()[0]), Some(0x80), "aborted");
    }
}
