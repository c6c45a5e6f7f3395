//! `pdo map` with a fault at each frame that it sends. Afterwards the device has its old mapping or the new mapping,
//! and the report is correct.

use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::{Bus, BusError, Event, Mono, Received};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::pdo::TpdoNumber;
use cangauge::device::catalog::by_name;
use cangauge::device::scalar::Scalar;
use cangauge::master::{Master, Timing};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes::note;
use cangauge::sim::{Device, Setup, State};
use cangauge::tasks::journal::NoJournal;
use cangauge::tasks::pdo::{Item, MapReport, PdoRequest, Trigger, map};
use cangauge::tasks::{Failure, Kind};
use std::collections::VecDeque;
use std::time::Duration;

const NODE: u8 = 5;

const TIMEOUT: Duration = Duration::from_millis(500);

/// A fault at one frame that the program sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    None,
    /// The frame does not reach the device.
    LoseRequest,
    /// The next answer is lost.
    LoseAnswer,
    /// The device rejects the write.
    Refuse(u32),
    /// The device acknowledges the write without executing it.
    Pretend,
    /// The device rejects the write, and acknowledges all later writes without executing them.
    Stubborn(u32),
    /// Ctrl-C before the answer.
    Interrupt,
    /// Ctrl-C, and again at the next frame.
    InterruptTwice,
    /// Another master resets the device before the request.
    ResetBefore,
    /// Another master resets the device after its answer.
    ResetAfter,
    /// The wire is broken for this time.
    Away(Duration),
    /// The device stays off the bus.
    Gone,
}

/// A bus with a fault at the n-th frame that is sent.
pub(super) struct FaultyBus {
    pub(super) bus: MemoryBus,
    fault: Fault,
    at: usize,
    pub(super) sent: Vec<Frame>,
    events: VecDeque<Event>,
    lose_next: bool,
    reset_next: bool,
    away_until: Option<Mono>,
}

impl FaultyBus {
    /// A bus with a fault at the n-th frame sent.
    pub(super) fn new(bus: MemoryBus, fault: Fault, at: usize) -> FaultyBus {
        let (sent, events) = (Vec::new(), VecDeque::new());
        FaultyBus { bus, fault, at, sent, events, lose_next: false, reset_next: false, away_until: None }
    }

    fn is_away(&self) -> bool {
        self.away_until.is_some_and(|until| self.bus.now().mono < until)
    }

    /// Acknowledges a write and keeps it from the device.
    fn pretend(&mut self, frame: &Frame) -> Result<(), BusError> {
        let [_, a, b, c, ..] = *frame.data() else { return self.bus.send(frame) };
        let frame = format!("{:03X}#60{a:02X}{b:02X}{c:02X}00000000", 0x580 + u16::from(NODE)).parse().unwrap();
        self.events.push_back(Event::Frame(Received { frame, at: self.bus.now() }));
        Ok(())
    }

    fn reset(&mut self) -> Result<(), BusError> {
        self.bus.send(&format!("000#81{NODE:02X}").parse().unwrap())
    }
}

impl cangauge::bus::BitRateControl for FaultyBus {
    cangauge::bus::delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl Bus for FaultyBus {
    cangauge::bus::delegate_bus!(self, self.bus => name timestamps is_live waits now mono listen receive_buffer unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let number = self.sent.len();
        self.sent.push(*frame);
        let twice = self.fault == Fault::InterruptTwice && number == self.at + 1;
        if matches!(self.fault, Fault::Stubborn(_)) && number > self.at && is_write(frame) {
            return self.pretend(frame);
        }
        if number != self.at && !twice {
            return if self.is_away() { Ok(()) } else { self.bus.send(frame) };
        }
        match self.fault {
            Fault::None => {}
            Fault::LoseRequest => return Ok(()),
            Fault::LoseAnswer => self.lose_next = true,
            Fault::Refuse(code) | Fault::Stubborn(code) => {
                let [_, a, b, c, ..] = *frame.data() else { return self.bus.send(frame) };
                let [d, e, f, g] = code.to_le_bytes();
                let data = format!("80{a:02X}{b:02X}{c:02X}{d:02X}{e:02X}{f:02X}{g:02X}");
                let frame = format!("{:03X}#{data}", 0x580 + u16::from(NODE)).parse().unwrap();
                self.events.push_back(Event::Frame(Received { frame, at: self.bus.now() }));
                return Ok(());
            }
            Fault::Pretend => return self.pretend(frame),
            Fault::Interrupt | Fault::InterruptTwice => self.events.push_back(Event::Interrupted),
            Fault::ResetBefore => self.reset()?,
            Fault::ResetAfter => self.reset_next = true,
            Fault::Away(time) => {
                self.away_until = Some(self.bus.now().mono + time);
                return Ok(());
            }
            Fault::Gone => {
                self.away_until = Some(Mono::at(Duration::MAX));
                return Ok(());
            }
        }
        self.bus.send(frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            if let Some(event) = self.events.pop_front() {
                return Ok(event);
            }
            let event = self.bus.receive(deadline)?;
            let is_answer = |frame: &Frame| frame.id() == CanId::sdo_response(node());
            match &event {
                Event::Frame(_) if self.is_away() => {}
                Event::Frame(received) if self.lose_next && is_answer(&received.frame) => self.lose_next = false,
                Event::Frame(received) => {
                    if self.reset_next && is_answer(&received.frame) {
                        self.reset_next = false;
                        self.reset()?;
                    }
                    return Ok(event);
                }
                _ => return Ok(event),
            }
        }
    }
}

fn node() -> NodeId {
    NodeId::new(NODE).unwrap()
}

/// One device, the previous settings of its TPDO1, and the request.
#[derive(Clone, Copy)]
struct Case {
    device: &'static str,
    /// Set and saved before.
    set: &'static [(&'static str, i64)],
    items: &'static [&'static str],
    trigger: Option<Trigger>,
    event_timer_ms: Option<u16>,
    cob_id: Option<u16>,
}

const CASES: [Case; 6] = [
    Case {
        device: "mh4",
        set: &[],
        items: &["0x9130:1", "pressure.status", "temperature.status"],
        trigger: Some(Trigger::Timer),
        event_timer_ms: Some(50),
        cob_id: None,
    },
    Case {
        device: "d20",
        set: &[],
        items: &["pressure"],
        trigger: Some(Trigger::Timer),
        event_timer_ms: Some(200),
        cob_id: None,
    },
    Case {
        device: "mc1609",
        set: &[],
        items: &["ch16", "ch1"],
        trigger: Some(Trigger::Code(3)),
        event_timer_ms: Some(250),
        cob_id: None,
    },
    Case {
        device: "dps",
        set: &[],
        items: &["0x7100:1", "pressure"],
        trigger: Some(Trigger::Code(0)),
        event_timer_ms: Some(1000),
        cob_id: None,
    },
    // Only parameters.
    Case {
        device: "mh4",
        set: &[],
        items: &[],
        trigger: Some(Trigger::Code(0)),
        event_timer_ms: Some(7),
        cob_id: None,
    },
    // A TPDO that was off.
    Case {
        device: "mh4",
        set: &[("0x1800:1", 0xc000_0185)],
        items: &["temperature"],
        trigger: None,
        event_timer_ms: None,
        cob_id: None,
    },
];

impl Case {
    fn request(&self) -> PdoRequest {
        let item = |text: &&str| match text.parse() {
            Ok(object) => Item::Object(object, None),
            Err(_) => Item::Name((*text).to_owned(), None),
        };
        PdoRequest {
            node: node(),
            number: TpdoNumber::new(1).unwrap(),
            items: self.items.iter().map(item).collect(),
            trigger: self.trigger,
            event_timer_ms: self.event_timer_ms,
            inhibit_100us: None,
            cob_id: self.cob_id,
        }
    }

    fn bus(&self, start: bool) -> MemoryBus {
        let mut setup = Setup::new(by_name(self.device).unwrap(), node());
        setup.start = start;
        setup.set = self.set.iter().map(|(at, value)| (at.parse().unwrap(), Scalar::Integer(*value))).collect();
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Device::new(setup).unwrap());
        // Skip the boot-up message: it must not look like a restart.
        while bus.receive(Mono::at(Duration::from_millis(20))).unwrap() != Event::Timeout {}
        bus
    }

    /// Runs the request with a fault at the n-th frame.
    fn run(&self, start: bool, fault: Fault, at: usize) -> Outcome {
        let mut faulty = FaultyBus::new(self.bus(start), fault, at);
        let mut master = Master::new(&mut faulty, Timing::default());
        let result = map(&mut master, &self.request(), false, &Default::default(), &mut NoJournal);
        master.settle();
        let took = faulty.bus.now().mono.since_start();
        // Deliver the frames that are still on the wire.
        let soon = faulty.bus.now().mono + Duration::from_millis(200);
        while faulty.bus.receive(soon).unwrap() != Event::Timeout {}
        let state = faulty.bus.stations::<Device>().next().unwrap().state();
        Outcome { result, held: held(&mut faulty.bus), state, sent: faulty.sent, took }
    }
}

/// The end of a run.
struct Outcome {
    result: Result<MapReport, Failure>,
    held: Snapshot,
    state: Option<State>,
    sent: Vec<Frame>,
    took: Duration,
}

impl Outcome {
    fn writes(&self) -> usize {
        self.sent.iter().filter(|frame| is_write(frame)).count()
    }
}

pub(super) fn is_write(frame: &Frame) -> bool {
    frame.id() == CanId::sdo_request(node()) && frame.data().first().is_some_and(|command| command >> 5 == 1)
}

/// The settings in the memory of the device: COB-ID, transmission type, event timer, mapping.
#[derive(Debug, PartialEq, Eq)]
struct Snapshot(u32, u32, u32, Vec<u32>);

fn held(bus: &mut MemoryBus) -> Snapshot {
    let now = bus.now().mono;
    let device: &mut Device = bus.stations_mut().next().unwrap();
    let mut number = |index, sub| {
        let bytes = device.value(ObjectId::new(index, sub), now).unwrap();
        bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte))
    };
    let count = u8::try_from(number(0x1a00, 0)).unwrap();
    let mapping = (1..=count).map(|sub| number(0x1a00, sub)).collect();
    Snapshot(number(0x1800, 1), number(0x1800, 2), number(0x1800, 5), mapping)
}

/// Checks that the report agrees with the memory of the device.
fn check(case: &Case, start: bool, fault: Fault, at: usize, old: &Snapshot, well: &Outcome) {
    let outcome = case.run(start, fault, at);
    let (sent, took) = (outcome.writes(), outcome.took);
    let Outcome { result, held, state, .. } = outcome;
    let new = &well.held;
    let what = format!("{} (started: {start}), {fault:?} at {at}: {result:?}\n{held:X?}", case.device);
    match &result {
        Ok(_) => assert_eq!(&held, new, "{what}"),
        Err(failure) => {
            let message = &ErrorMessage::of(failure).message;
            let is_reported_partial =
                message.contains("is only partly changed") || message.contains("it is unknown whether");
            if is_reported_partial {
                assert!(matches!(fault, Fault::Gone | Fault::Stubborn(_)), "it could have been restored: {what}");
                let hint = ErrorMessage::of(failure).hint.unwrap_or_default();
                assert!(hint.starts_with("when it answers again: cangauge "), "{what}");
            } else {
                assert_eq!(&held, old, "{what}");
            }
            if matches!(fault, Fault::Interrupt | Fault::InterruptTwice) {
                assert_eq!(failure.kind(), Kind::Interrupted, "{what}");
            }
        }
    }
    // A segmented text is not read again, and an NMT command is not repeated.
    let can_repeat = at >= well.sent.iter().position(is_read_back).unwrap() && well.sent[at].id() != CanId::NMT;
    match fault {
        // A lost request or answer is repeated. A write that has arrived is not sent again.
        Fault::LoseRequest | Fault::LoseAnswer if !can_repeat => {}
        Fault::LoseRequest => assert!(result.is_ok(), "{what}"),
        Fault::LoseAnswer => assert_eq!((result.is_ok(), sent), (true, well.writes()), "{what}"),
        // Ctrl-C ends the command without further time-outs.
        Fault::Interrupt | Fault::InterruptTwice => assert!(took < well.took + TIMEOUT, "{took:?}: {what}"),
        _ => {}
    }
    // The recovery command starts a device that is only partly changed.
    let is_partial = matches!(fault, Fault::Gone | Fault::Stubborn(_));
    if !is_partial && !matches!(fault, Fault::ResetBefore | Fault::ResetAfter) {
        let before = if start { State::Operational } else { State::PreOperational };
        // If the state is unknown or the NMT command was lost, a note reports it.
        let words = ["previous state is unknown", "was operational before and is", "without confirmation"];
        let reports_state = |message: &String| words.iter().any(|words| message.contains(words));
        let has_note = match &result {
            Ok(mapped) => mapped.notes.iter().any(|fact| reports_state(&note(fact).message)),
            Err(failure) => reports_state(&ErrorMessage::of(failure).message),
        };
        assert!(has_note || state == Some(before), "{state:?}: {what}");
    }
}

/// A TPDO that moves to another identifier.
const MOVED: Case = Case { cob_id: Some(0x3a5), ..CASES[4] };

/// Runs each case with each fault at each write and NMT command. One run also has each fault at each read. The other
/// runs read the same objects, so each of them tests only one eighth of the reads.
fn at_each_frame(faults: &[Fault]) {
    for (number, case) in CASES.iter().chain([&MOVED]).enumerate() {
        let starts: &[bool] = if number < 2 { &[false, true] } else { &[true] };
        for &start in starts {
            let old = held(&mut case.bus(start));
            let well = case.run(start, Fault::None, 0);
            assert!(well.result.as_ref().is_ok_and(|mapped| mapped.writes > 0), "{}", case.device);
            assert_ne!(old, well.held);
            let is_first = number == 0 && start == starts[0];
            let is_read = |frame: &Frame| frame.id() == CanId::sdo_request(node()) && !is_write(frame);
            for &fault in faults {
                for at in 0..well.sent.len() {
                    if is_read(&well.sent[at]) && !is_first && at % 8 != number {
                        continue;
                    }
                    if matches!(fault, Fault::Pretend | Fault::Stubborn(_)) && !is_write(&well.sent[at]) {
                        continue;
                    }
                    // The scan for a free identifier repeats its request to each absent node anyway.
                    if case.cob_id.is_some() && is_scan(&well.sent[at]) {
                        continue;
                    }
                    // A reset after the last check is not noticed.
                    let last = well.sent.iter().rposition(is_read_back).unwrap();
                    if fault == Fault::ResetAfter && at >= last || fault == Fault::ResetBefore && at > last {
                        continue;
                    }
                    check(case, start, fault, at, &old, &well);
                }
            }
        }
    }
}

/// A read of the TPDO's parameters.
fn is_read_back(frame: &Frame) -> bool {
    frame.id() == CanId::sdo_request(node()) && matches!(frame.data(), [0x40, 0x00, 0x18 | 0x1a, ..])
}

fn is_scan(frame: &Frame) -> bool {
    frame.id().sdo_request_node().is_some_and(|asked| asked != node())
}

#[test]
fn lost_frame_at_each_step() {
    at_each_frame(&[Fault::LoseRequest, Fault::LoseAnswer]);
}

#[test]
fn rejection_at_each_step() {
    at_each_frame(&[Fault::Refuse(0x0800_0000), Fault::Refuse(0x0609_0030), Fault::Refuse(0x0800_0022)]);
}

#[test]
fn acknowledge_without_effect_at_each_step() {
    at_each_frame(&[Fault::Pretend, Fault::Stubborn(0x0609_0030)]);
}

#[test]
fn ctrl_c_at_each_step() {
    at_each_frame(&[Fault::Interrupt, Fault::InterruptTwice]);
}

#[test]
fn a_reset_at_every_step() {
    at_each_frame(&[Fault::ResetBefore, Fault::ResetAfter]);
}

#[test]
fn a_broken_wire_at_every_step() {
    at_each_frame(&[Fault::Away(Duration::from_millis(700)), Fault::Away(Duration::from_secs(4))]);
}

#[test]
fn device_disappears_at_every_step() {
    at_each_frame(&[Fault::Gone]);
}

#[test]
fn the_right_steps_in_the_right_order() {
    let writes = |case: &Case, start| {
        let sent = case.run(start, Fault::None, 0).sent;
        let is_step = |frame: &&Frame| is_write(frame) || frame.id() == CanId::NMT;
        sent.iter().filter(is_step).map(|frame| frame.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(
        writes(&CASES[0], true),
        [
            "605#23001801850100C0",
            "605#2F001A0000000000",
            "605#23001A0120013091",
            "605#23001A0208015061",
            "605#23001A0308025061",
            "605#2F001A0003000000",
            "605#2F001802FE000000",
            "605#2B00180532000000",
            "605#2300180185010040",
        ]
    );
    let count_only = [
        "605#22001A0000000000",
        "605#22001A0120013061",
        "605#22001A0001000000",
        "605#22001802FE000000",
        "605#22001805C8000000",
    ];
    assert_eq!(writes(&CASES[1], false), count_only);
    let started: Vec<&str> = ["000#8005"].into_iter().chain(count_only).chain(["000#0105"]).collect();
    assert_eq!(writes(&CASES[1], true), started);
    // A parameter that already has the requested value is not written.
    let bus = |case: &Case| {
        let mut bus = case.bus(false);
        let first = map(
            &mut Master::new(&mut bus, Timing::default()),
            &case.request(),
            false,
            &Default::default(),
            &mut NoJournal,
        );
        let again = map(
            &mut Master::new(&mut bus, Timing::default()),
            &case.request(),
            false,
            &Default::default(),
            &mut NoJournal,
        );
        (first.unwrap().writes, again.unwrap().writes)
    };
    for (case, writes) in CASES.iter().zip([9, 5, 8, 8, 2, 4]) {
        assert_eq!(bus(case), (writes, 0), "{}", case.device);
    }
}
