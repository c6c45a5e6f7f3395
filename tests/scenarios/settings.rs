//! Settings while single frames are lost, doubled or delayed. A change that is reported as done is in the device.

use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::time::Mono;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::{DataType, Value};
use cangauge::device::catalog;
use cangauge::device::unit::Unit;
use cangauge::master::{Master, Timing};
use cangauge::node::Node;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Device, Direction, Overload, Setup};
use cangauge::tasks::settings::filter::{FilterRequest, FilterType};
use cangauge::tasks::settings::limits::Limit;
use cangauge::tasks::settings::{self, errors, filter, limits, minmax, unit};
use cangauge::tasks::{Failure, Kind};
use std::collections::BTreeMap;
use std::time::Duration;

const PSI: Unit = Unit(0x00ab_0000);

fn node() -> NodeId {
    NodeId::new(5).expect("a node-ID")
}

/// A change of settings, and the values that the device must then have.
struct Change {
    name: &'static str,
    run: fn(&mut Master<'_>, &mut Node) -> Result<(), Failure>,
    held: &'static [(u16, u8, DataType, Value)],
}

const CHANGES: [Change; 4] = [
    Change {
        name: "unit",
        run: |master, device| unit::set(master, device, Some("pressure"), PSI).map(|_| ()),
        held: &[(0x6131, 1, DataType::Unsigned(4), Value::Unsigned(0x00ab_0000))],
    },
    Change {
        name: "filter",
        run: |master, device| {
            let wanted = FilterRequest { kind: Some(FilterType::Moving), constant: Some(8), damping: None };
            filter::set(master, device, None, wanted).map(|_| ())
        },
        held: &[
            (0x61a0, 1, DataType::Unsigned(1), Value::Unsigned(1)),
            (0x61a1, 1, DataType::Unsigned(2), Value::Unsigned(8)),
        ],
    },
    Change {
        name: "limits",
        run: |master, device| {
            let wanted = [(Limit::Lower, 12.0), (Limit::Upper, 14.0)];
            limits::set(master, device, "pressure", &wanted).map(|_| ())
        },
        held: &[(0x6134, 1, DataType::Real32, Value::Real32(12.0)), (0x6135, 1, DataType::Real32, Value::Real32(14.0))],
    },
    Change {
        name: "errors",
        run: |master, device| errors::clear(master, device).map(|_| ()),
        held: &[(0x1003, 0, DataType::Unsigned(1), Value::Unsigned(0))],
    },
];

/// An MH-4 with an error in its history, behind these faults.
fn bus(plan: FaultPlan) -> Faulty<MemoryBus> {
    let mut setup = Setup::new(catalog::by_name("mh4").expect("built in"), node());
    let (from, until) = (Duration::ZERO, Duration::from_millis(1));
    setup.overloads = vec![(1, Overload { from, until, direction: Direction::High })];
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(250_000);
    bus.attach(Device::new(setup).expect("a device"));
    Faulty::new(bus, plan)
}

/// Makes a change with these faults. If it succeeds, checks the values in the device.
fn run(change: &Change, plan: FaultPlan, retries: u32) -> Result<(), Failure> {
    let context = format!("{} {plan:?}", change.name);
    let mut bus = bus(plan);
    let mut master = Master::new(&mut bus, Timing { timeout: Duration::from_millis(100), retries });
    let result = settings::open(&mut master, node(), &BTreeMap::new())
        .and_then(|mut device| (change.run)(&mut master, &mut device));
    let late = master.now() + Duration::from_secs(2);
    while master.now() < late {
        master.next(late).expect("the bus works");
    }
    if result.is_ok() {
        for (index, sub, data_type, value) in change.held {
            let object = ObjectId::new(*index, *sub);
            let found = master.read(node(), object, *data_type).expect("the bus works");
            // A fault of the plan may hit this read: read again.
            let found = found.or_else(|_| master.read(node(), object, *data_type).expect("the bus works"));
            assert_eq!(found.as_ref(), Ok(value), "{context}: {object}");
        }
    }
    result
}

/// With one retry the change succeeds, unless the fault hits the device name: segments are not repeated.
fn succeeds(change: &Change, plan: FaultPlan) {
    if let Err(failure) = run(change, plan, 1) {
        assert!(in_the_name(&failure), "{}: {failure}", change.name);
    }
}

fn in_the_name(failure: &Failure) -> bool {
    failure.object == Some(ObjectId::new(0x1008, 0))
}

/// Runs each change with a fault at each frame in turn.
fn each(make: impl Fn(u64) -> FaultPlan, mut test: impl FnMut(&Change, FaultPlan)) {
    for change in &CHANGES {
        for number in 25..75 {
            test(change, make(number));
        }
    }
}

#[test]
fn changes_succeed_without_faults() {
    for change in &CHANGES {
        run(change, FaultPlan::default(), 0).expect(change.name);
    }
}

#[test]
fn lost_frame_is_requested_again() {
    each(|number| FaultPlan { lose: [number].into(), ..FaultPlan::default() }, succeeds);
    each(|number| FaultPlan { lose_sent: [number].into(), ..FaultPlan::default() }, succeeds);
}

#[test]
fn without_retries_a_lost_answer_is_an_error() {
    let mut failed = 0;
    each(
        |number| FaultPlan { lose: [number].into(), ..FaultPlan::default() },
        |change, plan| {
            if let Err(failure) = run(change, plan, 0) {
                assert_eq!(failure.kind(), Kind::NoAnswer, "{}: {failure}", change.name);
                failed += 1;
            }
        },
    );
    assert!(failed > 40, "{failed}");
}

#[test]
fn doubled_and_late_frames_do_not_answer_another_request() {
    each(
        |number| FaultPlan { duplicate: [number].into(), ..FaultPlan::default() },
        |change, plan| {
            // The second acknowledge of a write looks like a wrong answer to the next read.
            if let Err(failure) = run(change, plan, 1) {
                assert_eq!(failure.kind(), Kind::Unexpected, "{}: {failure}", change.name);
            }
        },
    );
    each(
        |number| FaultPlan { delay: [(number, Duration::from_millis(150))].into(), ..FaultPlan::default() },
        |change, plan| {
            if let Err(failure) = run(change, plan, 1)
                && !in_the_name(&failure)
            {
                assert_eq!(failure.kind(), Kind::NoAnswer, "{}: {failure}", change.name);
            }
        },
    );
}

#[test]
fn minmax_signature_is_sent_once_and_its_effect_is_read_back() {
    let reset = |plan: FaultPlan| {
        let mut bus = bus(plan);
        let mut master = Master::new(&mut bus, Timing { timeout: Duration::from_millis(100), retries: 1 });
        let device = settings::open(&mut master, node(), &BTreeMap::new())?;
        // Let the device measure a minimum and a maximum.
        for _ in 0..5 {
            minmax::show(&mut master, &device)?;
        }
        minmax::reset(&mut master, &device)
    };
    assert_eq!(reset(FaultPlan::default()).unwrap().len(), 2);
    let mut lost = 0;
    for number in 40..110 {
        // The answer is lost: the values that are read afterwards prove the reset.
        if let Err(failure) = reset(FaultPlan { lose: [number].into(), ..FaultPlan::default() }) {
            assert!(in_the_name(&failure), "answer {number}: {failure}");
        }
        // The request is lost: nothing was reset, which is an error.
        if let Err(failure) = reset(FaultPlan { lose_sent: [number].into(), ..FaultPlan::default() }) {
            assert_eq!(failure.kind(), Kind::NoAnswer, "request {number}: {failure}");
            assert!(in_the_name(&failure) || ErrorMessage::of(&failure).message.contains("write 0x2022"), "{failure}");
            lost += u32::from(!in_the_name(&failure));
        }
    }
    assert!((1..=2).contains(&lost), "one request for each channel: {lost}");
}

/// A device that acknowledges each write without executing it.
struct WriteIgnoring;

impl Station for WriteIgnoring {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        let [command, low, high, sub, ..] = *frame.data() else { return };
        let address = format!("{low:02X}{high:02X}{sub:02X}");
        let answer = match (command, address.as_str()) {
            (0x40, "001000") => format!("43{address}94010200"),
            (0x40, "306100") => format!("4F{address}01000000"),
            (0x40, "306101") => format!("43{address}0000803F"),
            (0x40, "316101") => format!("43{address}00004E00"),
            (0x40, "336101") => format!("43{address}00000000"),
            (0x40, "A06101") => format!("4F{address}00000000"),
            (0x40, "031000") => format!("4F{address}01000000"),
            (0x40, "031001") => format!("43{address}01F00000"),
            (0x40, _) => format!("80{address}00000206"),
            (0x20..=0x2f, _) => format!("60{address}00000000"),
            _ => return,
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
fn acknowledged_write_is_read_back() {
    let rejected = |change: fn(&mut Master<'_>, &mut Node) -> Result<(), Failure>| {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(WriteIgnoring);
        let mut master = Master::new(&mut bus, Timing::default());
        let mut device = settings::open(&mut master, node(), &BTreeMap::new()).expect("it answers");
        let failure = change(&mut master, &mut device).expect_err("the write has no effect");
        assert_eq!(failure.kind(), Kind::Unexpected, "{failure}");
        ErrorMessage::of(&failure).message
    };
    assert_eq!(
        rejected(|master, device| unit::set(master, device, None, PSI).map(|_| ())),
        "node 5: the write of 0x6131:1 was acknowledged, but its value is 5111808 instead of 11206656"
    );
    assert_eq!(
        rejected(|master, device| {
            let wanted = FilterRequest { kind: Some(FilterType::Moving), ..FilterRequest::default() };
            filter::set(master, device, None, wanted).map(|_| ())
        }),
        "node 5: the write of 0x61A0:1 was acknowledged, but its value is 0 instead of 1"
    );
    assert_eq!(
        rejected(|master, device| limits::set(master, device, "ch1", &[(Limit::Delta, 0.5)]).map(|_| ())),
        "node 5: the write of 0x6133:1 was acknowledged, but its value is 0 instead of 0.5; the previous limits were restored"
    );
    assert_eq!(
        rejected(|master, device| errors::clear(master, device).map(|_| ())),
        "node 5: it acknowledged the write of 0x1003:0, but the history still has 1 error"
    );
}
