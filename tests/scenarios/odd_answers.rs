//! Answers of the wrong length, and more than one answer to a request.

use super::RecordedRows;
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{DownloadSize, Note, Violation};
use cangauge::canopen::value::{DataType, Value};
use cangauge::device::catalog::by_name;
use cangauge::master::{Answer, Blocks, Error, Master, OnTwoDevices, Operation, Request, SdoError, SdoFailure, Timing};
use cangauge::measure::sample::Doubt;
use cangauge::node::survey::{identify, survey_each};
use cangauge::node::{self, Node, Overrides, write};
use cangauge::sim::{Device, Setup};
use cangauge::tasks::log::{LogOptions, Mode, log};
use cangauge::tasks::pdo::show;
use cangauge::tasks::read::{Readings, read as read_signals};
use cangauge::tasks::{Failure, Kind, settings};
use std::time::Duration;

const NAME: ObjectId = ObjectId::new(0x1008, 0);
const SERIAL: ObjectId = ObjectId::new(0x1018, 4);
const HEARTBEAT: ObjectId = ObjectId::new(0x1017, 0);

/// A device that does not answer the requests for some objects.
pub(super) struct PartlySilent {
    device: Device,
    silent: Vec<u16>,
    silent_object: Option<ObjectId>,
}

impl PartlySilent {
    pub(super) fn new(kind: &str, silent: &[u16]) -> PartlySilent {
        let device = Device::new(Setup::new(by_name(kind).expect("a kind"), node())).expect("a device");
        PartlySilent { device, silent: silent.to_vec(), silent_object: None }
    }
}

impl Station for PartlySilent {
    fn power_on(&mut self, now: Mono, out: &mut Outbox) {
        self.device.power_on(now, out);
    }

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        match *frame.data() {
            [0x40, low, high, ..] if self.silent.contains(&u16::from_le_bytes([low, high])) => {}
            [0x40, a, b, c, ..] if self.silent_object == Some(ObjectId::from_multiplexer([a, b, c])) => {}
            _ => self.device.receive(now, frame, out),
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        self.device.wake(now, out);
    }

    fn next_wake(&self) -> Option<Mono> {
        self.device.next_wake()
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.device.sent(now, frame);
    }
}

/// Runs `work` with a device that does not answer for some objects.
fn with_partly_silent<T>(kind: &str, silent: &[u16], work: impl FnOnce(&mut Master<'_>) -> T) -> T {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    bus.attach(PartlySilent::new(kind, silent));
    work(&mut Master::new(&mut bus, Timing::default()))
}

/// The start of a request, and the answers to it.
type Step = (&'static str, &'static [&'static str]);

/// A server that answers by a list. A step is used once, except the last one for a request.
struct Script(Vec<Step>);

impl Station for Script {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        let text = frame.to_string();
        let Some(at) = self.0.iter().position(|(request, _)| text.starts_with(request)) else { return };
        let (request, answers) = self.0[at];
        if self.0[at + 1..].iter().any(|(other, _)| *other == request) {
            self.0.remove(at);
        }
        for answer in answers {
            out.send(answer.parse().expect("a frame"));
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

fn node() -> NodeId {
    NodeId::new(5).expect("a node-ID")
}

/// Runs `work` with a server.
fn with<T>(steps: &[Step], work: impl FnOnce(&mut Master<'_>) -> T) -> T {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    bus.attach(Script(steps.to_vec()));
    let timing = Timing { timeout: Duration::from_millis(100), retries: 0 };
    let mut master = Master::new(&mut bus, timing);
    work(&mut master)
}

fn read(steps: &[Step], request: Request) -> Result<Answer, SdoError> {
    with(steps, |master| master.transfer_one(request).expect("the bus works"))
}

fn value(answer: &Answer, data_type: Option<DataType>) -> Result<(Value, Option<Note>), SdoError> {
    answer.value(node(), NAME, data_type)
}

const ASK_NAME: &str = "605#400810";
const FIRST: &str = "605#60";
const ABC: &[&str] = &["585#0941424300000000"];

#[test]
fn shorter_than_announced_is_accepted_if_read_twice_alike() {
    let steps: [Step; 2] = [(ASK_NAME, &["585#4108100064000000"]), (FIRST, ABC)];
    let answer = read(&steps, Request::read(node(), NAME)).expect("the same bytes come twice");
    let expected = (Value::Text("ABC".to_owned()), Some(Note::Announced { announced: 100, found: 3 }));
    assert_eq!(value(&answer, Some(DataType::VisibleString)), Ok(expected));
    // A number with missing bytes has no value.
    assert!(value(&answer, Some(DataType::Unsigned(4))).is_err());
    // A value that is shorter than announced is never written to a file.
    let error = read(&steps, Request::read(node(), NAME).exact(true)).expect_err("3 of 100 bytes");
    let frame = ABC[0].parse().expect("a frame");
    assert_eq!(error.failure, SdoFailure::WrongLength { announced: Some(100), delivered: 3, frame });
}

#[test]
fn different_bytes_in_the_second_read_are_an_error() {
    for (first, second) in [(ABC, &["585#0941424400000000"] as &[&str]), (&["585#0741424344000000"], ABC)] {
        let steps: [Step; 3] = [(ASK_NAME, &["585#4108100064000000"]), (FIRST, first), (FIRST, second)];
        let error = read(&steps, Request::read(node(), NAME)).expect_err("the bytes differ");
        assert!(matches!(error.failure, SdoFailure::WrongLength { announced: Some(100), .. }), "{error}");
    }
}

#[test]
fn short_segment_in_the_middle_is_read_again() {
    let steps: [Step; 3] = [
        (ASK_NAME, &["585#4008100000000000"]),
        (FIRST, &["585#0841424300000000"]),
        ("605#70", &["585#1944454600000000"]),
    ];
    let answer = read(&steps, Request::read(node(), NAME)).expect("the same bytes come twice");
    let expected = (Value::Text("ABCDEF".to_owned()), Some(Note::ShortSegment));
    assert_eq!(value(&answer, Some(DataType::VisibleString)), Ok(expected));
}

#[test]
fn frame_with_fewer_bytes_than_it_declares_is_no_value() {
    let initiate: Step = (ASK_NAME, &["585#4108100008000000"]);
    for steps in [
        vec![initiate, (FIRST, &["585#004D482D"])],
        vec![initiate, (FIRST, &["585#01414243444546"])],
        vec![initiate, (FIRST, &["585#"]), ("605#70", ABC)],
        vec![(ASK_NAME, &["585#41081000"]), (FIRST, ABC)],
        vec![(ASK_NAME, &["585#4108100008"]), (FIRST, ABC)],
    ] {
        let error = read(&steps, Request::read(node(), NAME)).expect_err("bytes are missing");
        let is_short = matches!(error.failure, SdoFailure::Violation(Violation::Short, _));
        let is_empty = matches!(error.failure, SdoFailure::NoAnswer { .. });
        assert!(is_short || is_empty, "{error}");
    }
    // Without padding, and complete.
    let steps: [Step; 2] = [(ASK_NAME, &["585#4108100003000000"]), (FIRST, &["585#09414243"])];
    let answer = read(&steps, Request::read(node(), NAME)).expect("complete");
    assert_eq!(value(&answer, None), Ok((Value::Bytes(b"ABC".to_vec()), None)));
    let answer = read(&[("605#401710", &["585#4B171000E803"])], Request::read(node(), HEARTBEAT)).expect("complete");
    assert_eq!(value(&answer, None), Ok((Value::Bytes(vec![0xe8, 3]), None)));
}

#[test]
fn block_of_another_length_than_announced_is_read_again() {
    const LAST: &str = "585#8141424344454647";
    let steps: [Step; 4] = [
        ("605#A40810", &["585#C208100064000000"]),
        ("605#A3", &[LAST]),
        ("605#A2", &["585#C100000000000000"]),
        ("605#A2", &["585#C500000000000000"]),
    ];
    let request = || Request::read(node(), NAME).blocks(Blocks::Only);
    let error = read(&steps, request()).expect_err("7 bytes, then 6");
    assert!(matches!(error.failure, SdoFailure::WrongLength { announced: Some(100), delivered: 6, .. }), "{error}");
    assert!(read(&steps[..3], request()).is_ok_and(|answer| answer.uploaded.is_some_and(|read| read.bytes.len() == 7)));
}

const TWICE_SERIAL: &[&str] = &["585#4318100434120000", "585#4318100434120000"];
const TWO_SERIALS: &[&str] = &["585#4318100434120000", "585#4318100499880000"];
const ACKNOWLEDGED_TWICE: &[&str] = &["585#6017100000000000", "585#6017100000000000"];
const WRITES: &str = "605#2B171000";

#[test]
fn duplicate_answers_are_ignored() {
    let steps: [Step; 5] = [
        ("605#40181004", TWICE_SERIAL),
        (ASK_NAME, &["585#410810000A000000", "585#410810000A000000"]),
        (FIRST, &["585#0041424344454647", "585#0041424344454647"]),
        ("605#70", &["585#1941424300000000", "585#1941424300000000"]),
        (WRITES, ACKNOWLEDGED_TWICE),
    ];
    let steps = [&steps[..], &[("605#401710", &["585#4B171000F4010000", "585#4B171000F4010000"] as &[&str])]].concat();
    with(&steps, |master| {
        let bytes = |answer: Answer| answer.uploaded.map(|read| read.bytes).unwrap_or_default();
        let read = |master: &mut Master<'_>, object| master.transfer_one(Request::read(node(), object)).expect("bus");
        assert_eq!(read(master, NAME).map(bytes).as_deref(), Ok(b"ABCDEFGABC" as &[u8]));
        let written = write::write_and_verify(master, &Node::new(node()), HEARTBEAT, &[0xf4, 1], DataType::Unsigned(2));
        assert!(written.is_ok(), "{written:?}");
        assert_eq!(read(master, SERIAL).map(bytes).as_deref(), Ok(b"\x34\x12\0\0" as &[u8]));
        let found = master.second_answers();
        assert!(matches!(found[..], [(_, answers)] if !answers.differs()), "{found:?}");
    });
}

#[test]
fn nothing_is_written_if_two_devices_answer() {
    // The first request of the command is the write; the serial numbers are compared before it.
    let steps: [Step; 2] = [("605#40181004", TWO_SERIALS), (WRITES, ACKNOWLEDGED_TWICE)];
    with(&steps, |master| {
        master.set_on_two_devices(OnTwoDevices::RefuseWrites);
        match write::write(master, &Node::new(node()), HEARTBEAT, &[0xf4, 1]) {
            Err(node::Error::Sdo(error)) => assert!(matches!(error.failure, SdoFailure::NotWritten(_)), "{error}"),
            other => panic!("{other:?}"),
        }
        let error = master.transfer_one(Request::write(node(), HEARTBEAT, vec![1, 0], DownloadSize::Indicated));
        assert!(error.expect("the bus works").is_err());
    });
}

#[test]
fn differing_answers_are_no_value_in_any_transfer() {
    for answers in [
        TWO_SERIALS,
        &["585#4318100434120000", "585#8018100411000906"],
        &["585#4218100401000000", "585#4218100402000000"],
    ] {
        let error = read(&[("605#40181004", answers)], Request::read(node(), SERIAL)).expect_err("two devices");
        assert!(matches!(error.failure, SdoFailure::TwoDevices(Some(_))), "{error}");
    }
    // Two names: the segments of both devices arrive.
    let steps: [Step; 3] = [
        (ASK_NAME, &["585#4108100008000000", "585#4108100003000000"]),
        (FIRST, &["585#0041424344454647", "585#0958595A00000000"]),
        ("605#70", &["585#0D41000000000000"]),
    ];
    let error = read(&steps, Request::read(node(), NAME)).expect_err("two devices");
    assert!(matches!(error.failure, SdoFailure::TwoDevices(_)), "{error}");
}

/// The identity of a device that answers 1000h, vendor, product, revision and name, except for the steps in `odd`.
fn identity_with(odd: &[Step]) -> Result<Vec<Node>, Error> {
    let steps: [Step; 7] = [
        ("605#40001000", &["585#4300100094010200"]),
        ("605#40181001", &["585#4318100199090000"]),
        ("605#40181002", &["585#4318100202000000"]),
        ("605#40181003", &["585#4318100303000000"]),
        ("605#40181004", &["585#4318100404000000"]),
        (ASK_NAME, &["585#4108100003000000"]),
        (FIRST, ABC),
    ];
    let is_odd = |step: &&Step| odd.iter().any(|(request, _)| *request == step.0);
    let steps: Vec<Step> = odd.iter().chain(steps.iter().filter(|step| !is_odd(step))).copied().collect();
    with(&steps, |master| identify(master, &[node()], &Overrides::new()))
}

#[test]
fn silent_object_does_not_stop_the_survey() {
    for silent in [
        &[0x1000][..],
        &[0x1017, 0x1014, 0x1005, 0x1019],
        &[0x6131],
        &[0x6131, 0x6132],
        &[0x1801, 0x1802, 0x1803, 0x1804],
        &[0x1A00],
    ] {
        for kind in ["mh4", "dps"] {
            let (node, unknown) = with_partly_silent(kind, silent, |master| {
                let surveyed = survey_each(master, &[node()], &Overrides::new()).expect("the bus works").remove(0);
                (surveyed.unwrap_or_else(|error| panic!("{kind} {silent:x?}: {error}")), master.unknown_objects())
            });
            assert!(!node.signals.is_empty(), "{kind} {silent:x?}");
            let unknown: Vec<ObjectId> = unknown.into_values().flatten().collect();
            assert!(unknown.iter().all(|object| silent.contains(&object.index)), "{kind} {silent:x?}");
            assert_eq!(unknown.is_empty(), kind == "dps" && silent[0] == 0x1801, "{kind} {silent:x?}");
        }
    }
}

#[test]
fn node_that_answers_only_its_device_type_is_given_up_soon() {
    let silent: Vec<u16> = (0x1001..=0x9fff).collect();
    with_partly_silent("mh4", &silent, |master| {
        let error = survey_each(master, &[node()], &Overrides::new()).expect("the bus works").remove(0);
        assert!(matches!(error, Err(SdoError { failure: SdoFailure::NoAnswer { .. }, .. })), "{error:?}");
        assert!(master.now().since_start() < Duration::from_secs(10), "{:?}", master.now().since_start());
    });
}

/// The readings of an MH-4.
fn readings(kind: &str, silent: &[u16]) -> Result<Readings, Failure> {
    with_partly_silent(kind, silent, |master| {
        read_signals(master, &[node()], &[], &Overrides::new()).expect("the bus works").remove(0)
    })
}

#[test]
fn silent_status_object_is_an_unknown_status() {
    let readings_of = |kind, silent| readings(kind, silent).expect("the values answer");
    for (kind, silent) in [("mh4", &[0x6150][..]), ("dps", &[0x1001])] {
        let (_, sample) = &readings_of(kind, silent)[0];
        assert_eq!((sample.value.is_some(), sample.status), (true, None), "{kind}");
        assert_eq!(sample.doubt, Some(Doubt::UnknownStatus), "{kind}");
        assert_eq!(readings_of(kind, &[])[0].1.doubt, None, "{kind}");
    }
    assert_eq!(readings("mh4", &[0x6130]).expect_err("the value does not answer").kind(), Kind::NoAnswer);
}

fn polling() -> LogOptions {
    LogOptions {
        nodes: vec![node()],
        wanted: Vec::new(),
        mode: Mode::Poll(Duration::from_millis(100)),
        duration: Some(Duration::from_secs(10)),
        count: None,
        nmt: true,
        start_all: false,
        max_gap: None,
        overrides: Overrides::new(),
    }
}

#[test]
fn silent_status_object_does_not_slow_polling_down() {
    for (kind, silent, signals) in [("mh4", &[0x6150][..], 2), ("dps", &[0x1001], 1)] {
        let options = polling();
        let mut kept = RecordedRows::default();
        with_partly_silent(kind, silent, |master| log(master, &options, &mut kept)).expect("the values answer");
        assert!(kept.rows.len() > 75 * signals, "{kind}: {}", kept.rows.len());
        assert!(kept.rows.iter().all(|row| !row.contains(",ok,")), "{kind}: {:?}", kept.rows);
    }
}

#[test]
fn pages_show_the_objects_that_answer() {
    // No built-in description has 1800h:3, which is read in the same way.
    let timer = ObjectId::new(0x1800, 5);
    for kind in ["mh4", "dps"] {
        let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
        bus.attach(PartlySilent { silent_object: Some(timer), ..PartlySilent::new(kind, &[]) });
        let mut master = Master::new(&mut bus, Timing::default());
        let tpdos = show(&mut master, node(), None, &Overrides::new()).expect("the others answer");
        assert!(!tpdos[0].settings.mapping.is_empty() && tpdos[0].settings.event_timer_ms.is_none(), "{kind}");
        assert_eq!(master.unknown_objects()[&node()], [timer], "{kind}");
    }
    for (silent, register) in [(0x1003, Some(0)), (0x1001, None)] {
        with_partly_silent("mh4", &[silent], |master| {
            let device = settings::open(master, node(), &Overrides::new()).expect("answers");
            let errors = settings::errors::read(master, &device).expect("the other object answers");
            assert_eq!((errors.register, errors.count.is_some()), (register, silent == 0x1001));
            assert_eq!(master.unknown_objects()[&node()], [ObjectId::new(silent, 0)]);
            assert!(settings::info::read(master, node(), &Overrides::new()).is_ok());
        });
    }
    with_partly_silent("dps", &[0x1001, 0x1003], |master| {
        let device = settings::open(master, node(), &Overrides::new()).expect("answers");
        let failure = settings::errors::read(master, &device).expect_err("neither answers");
        assert_eq!(failure.kind(), Kind::NoAnswer);
        let info = settings::info::read(master, node(), &Overrides::new()).expect("the other objects answer");
        assert!(info.errors.is_none() && !info.channels.is_empty());
    });
}

/// A second device with the node-ID: from this moment it answers reads of the pressure with another value.
struct JoiningDevice(Mono);

impl Station for JoiningDevice {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        if now >= self.0 && frame.data().starts_with(&[0x40, 0x30, 0x61, 1]) {
            out.send("585#433061010000F040".parse().expect("a frame"));
        }
    }

    fn wake(&mut self, _: Mono, _: &mut Outbox) {}

    fn next_wake(&self) -> Option<Mono> {
        None
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn second_device_that_joins_ends_polling() {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    bus.attach(PartlySilent::new("mh4", &[]));
    bus.attach(JoiningDevice(Mono::START + Duration::from_secs(2)));
    let options = LogOptions { duration: None, ..polling() };
    let mut kept = RecordedRows::default();
    let report = log(&mut Master::new(&mut bus, Timing::default()), &options, &mut kept).expect("rows");
    assert_eq!(report.two_devices.iter().map(Failure::kind).collect::<Vec<_>>(), [Kind::Unexpected]);
    assert!(kept.rows.iter().all(|row| !row.contains("7.5")), "{:?}", kept.rows);
}

#[test]
fn integer_without_an_answer_for_its_digits_has_no_value() {
    for kind in ["mc1609", "dps"] {
        let found = readings(kind, &[0x6132]).expect("values");
        assert!(!found.is_empty());
        for (_, sample) in &found {
            assert_eq!((sample.value, sample.doubt), (None, Some(Doubt::UnreadScale)), "{kind}");
        }
    }
}

#[test]
fn error_of_two_devices_names_the_request_with_two_answers() {
    let steps: [Step; 2] = [("605#40181004", TWO_SERIALS), ("605#401710", &["585#4B171000F4010000"])];
    for request in
        [Request::read(node(), HEARTBEAT), Request::write(node(), HEARTBEAT, vec![1, 0], DownloadSize::Indicated)]
    {
        with(&steps, |master| {
            master.transfer_one(Request::read(node(), SERIAL)).expect("the bus works").expect_err("two devices");
            let error = master.transfer_one(request).expect("the bus works").expect_err("two devices");
            assert_eq!((error.object, error.operation), (SERIAL, Operation::Read));
        });
    }
}

#[test]
fn optional_object_that_fails_is_unknown() {
    let name: &[Step] = &[(ASK_NAME, &[])];
    let toggled: &[Step] = &[(FIRST, &["585#1141424344454600"])];
    let product: &[Step] = &[("605#40181002", &[])];
    let refused: &[Step] = &[("605#40181002", &["585#8018100211000906"])];
    let short: &[Step] = &[("605#40181002", &["585#43181002"])];
    for (odd, has_name, has_product) in [
        (name, false, true),
        (toggled, false, true),
        (product, true, false),
        (refused, true, false),
        (short, true, false),
    ] {
        let node = identity_with(odd).expect("one object stops nothing").pop().expect("a node");
        let identity = &node.identity;
        assert_eq!((identity.device_type, identity.vendor), (Some(0x0002_0194), Some(0x999)), "{odd:?}");
        // After a sub-index without an answer, the following ones are not read.
        let is_silent = odd == product;
        assert_eq!(identity.revision.is_none() && identity.serial.is_none(), is_silent, "{odd:?}");
        assert_eq!((identity.name.is_some(), identity.product.is_some()), (has_name, has_product), "{odd:?}");
    }
    let dead: Vec<Step> = (1..=4).map(|_| ("605#401810", &[] as &[&str])).collect();
    let node = identity_with(&dead).expect("1018h is optional").pop().expect("a node");
    assert_eq!((node.identity.vendor, node.identity.serial), (None, None));
}
