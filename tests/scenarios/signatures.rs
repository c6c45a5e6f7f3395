//! "zero", "save" and "load" with a fault at each sent frame: the request or its answer is lost, Ctrl-C, the device
//! restarts. No signature is sent twice, and the reported result matches the device.

use cangauge::bus::memory::MemoryBus;
use cangauge::bus::time::Mono;
use cangauge::bus::{Bus, BusError, Event, Received};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::master::{Master, Timing};
use cangauge::node::write::write;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Bench, Device, State};
use cangauge::tasks::Fact;
use cangauge::tasks::autozero::AutozeroFact;
use cangauge::tasks::autozero::{AutozeroReport, Limit, Options, ZeroTarget, autozero};
use cangauge::tasks::store::{self, Group, StoreReport, Verified};
use cangauge::tasks::{Failure, Kind, restore};
use std::path::Path;
use std::time::Duration;

/// The fault at one sent frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    LoseRequest,
    LoseAnswer,
    Interrupt,
    /// The device restarts as soon as it has answered.
    Restart,
    /// The device restarted before, and the program missed its boot-up.
    Restarted,
    /// The device rejects the request with this abort code.
    Refuse(u32),
    /// The device acknowledges it and does nothing.
    Pretend,
}

const FAULTS: [Fault; 5] = [Fault::LoseRequest, Fault::LoseAnswer, Fault::Interrupt, Fault::Restart, Fault::Restarted];

/// A bus with a fault at the frame of the given number.
struct FaultyBus {
    inner: MemoryBus,
    at: Option<(usize, Fault)>,
    sent: Vec<String>,
    /// Abort code that replaces the next answer.
    refusal: Option<u32>,
    /// A request that is acknowledged and not delivered.
    pretended: Option<Frame>,
    /// Number of answers still to lose.
    deaf: bool,
    interrupted: bool,
    restarts: bool,
}

impl FaultyBus {
    fn of(kind: &str, settings: &str, at: Option<(usize, Fault)>) -> FaultyBus {
        let bench = format!("clock = \"virtual\"\n[[device]]\nkind = \"{kind}\"\nnode = 5\n{settings}");
        let inner = Bench::from_toml(&bench, Path::new("")).expect("a bench").open().expect("a bus");
        let (sent, refusal, pretended) = (Vec::new(), None, None);
        FaultyBus { inner, at, sent, refusal, pretended, deaf: false, interrupted: false, restarts: false }
    }

    /// How many sent frames end with this text.
    fn count(&self, frame: &str) -> usize {
        self.sent.iter().filter(|sent| sent.ends_with(frame)).count()
    }

    /// Lets the bus run idle, then returns the object's bytes in the device.
    fn look(&mut self, object: &str) -> Vec<u8> {
        self.run_on();
        let now = self.inner.now().mono;
        let object: ObjectId = object.parse().expect("an object");
        let device = self.inner.stations_mut::<Device>().next().expect("the device");
        device.value(object, now).expect("it has the object")
    }

    fn run_on(&mut self) {
        let until = self.inner.now().mono + Duration::from_secs(1);
        while !matches!(self.inner.receive(until).expect("the bus works"), Event::Timeout) {}
    }

    fn state(&mut self) -> Option<State> {
        self.run_on();
        self.inner.stations::<Device>().next().expect("the device").state()
    }

    /// Resets the device; for stored values this equals a power cycle.
    fn reset(&mut self) {
        self.inner.send(&"000#8105".parse().expect("a frame")).expect("sent");
        self.run_on();
    }
}

impl cangauge::bus::BitRateControl for FaultyBus {
    cangauge::bus::delegate_bus!(self, self.inner => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl Bus for FaultyBus {
    cangauge::bus::delegate_bus!(self, self.inner => name timestamps is_live waits now mono listen receive_buffer unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let number = self.sent.len();
        self.sent.push(frame.to_string());
        match self.at {
            Some((at, fault)) if at == number => match fault {
                Fault::LoseRequest => return Ok(()),
                Fault::LoseAnswer => self.deaf = true,
                Fault::Interrupt => self.interrupted = true,
                Fault::Restart => self.restarts = true,
                Fault::Restarted => self.reset(),
                Fault::Refuse(code) => self.refusal = Some(code),
                Fault::Pretend => {
                    // Reading 1000h produces an answer.
                    self.pretended = Some(*frame);
                    return self.inner.send(&"605#4000100000000000".parse().expect("a frame"));
                }
            },
            _ => {}
        }
        self.inner.send(frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            let event = self.inner.receive(deadline)?;
            if let Event::Frame(received) = &event
                && received.frame.id() == CanId::sdo_response(node())
            {
                if std::mem::take(&mut self.restarts) {
                    self.inner.send(&"000#8105".parse().expect("a frame"))?;
                }
                if let Some(code) = self.refusal.take() {
                    let [_, a, b, c, ..] = *received.frame.data() else { panic!("an answer has eight bytes") };
                    let bytes = [&[0x80, a, b, c], code.to_le_bytes().as_slice()].concat();
                    let frame = Frame::new(received.frame.id(), &bytes).expect("a frame");
                    return Ok(Event::Frame(Received { frame, at: received.at }));
                }
                if let Some([_, a, b, c, ..]) = self.pretended.take().as_ref().map(Frame::data) {
                    let frame = Frame::new(received.frame.id(), &[0x60, *a, *b, *c, 0, 0, 0, 0]).expect("a frame");
                    return Ok(Event::Frame(Received { frame, at: received.at }));
                }
                if std::mem::take(&mut self.deaf) {
                    continue;
                }
                if std::mem::take(&mut self.interrupted) {
                    return Ok(Event::Interrupted);
                }
            }
            return Ok(event);
        }
    }
}

fn node() -> NodeId {
    NodeId::new(5).expect("a node-ID")
}

fn with<T>(bus: &mut FaultyBus, work: impl FnOnce(&mut Master<'_>) -> T) -> T {
    let mut master = Master::new(bus, Timing::default());
    let result = work(&mut master);
    master.settle();
    result
}

/// Number of frames sent without a fault.
fn frames(run: impl Fn(&mut FaultyBus), kind: &str, settings: &str) -> usize {
    let mut bus = FaultyBus::of(kind, settings, None);
    run(&mut bus);
    bus.sent.len()
}

const CONSTANT_VALUE: &str = "[[device.channel]]\nchannel = 1\nbase = 0.0625\namplitude = 0.0\nnoise = 0.0\n";

fn zero(bus: &mut FaultyBus, store: bool) -> Result<AutozeroReport, Failure> {
    let options = Options {
        target: ZeroTarget::Autozero,
        channel: None,
        limit: Limit::Default,
        samples: 2,
        force: false,
        store,
        dry_run: false,
    };
    with(bus, |master| autozero(master, node(), &Default::default(), &options))
}

#[test]
fn reported_zero_matches_the_device() {
    for (kind, offset, new) in [
        ("mh4", "0x6127:1", (-0.0625f32).to_le_bytes()),
        ("d20", "0x6124:1", (-0.0625f32).to_le_bytes()),
        ("dps", "0x6124:1", (-63i32).to_le_bytes()),
    ] {
        let count = frames(|bus| drop(zero(bus, false)), kind, CONSTANT_VALUE);
        let mut acted_without_answer = 0;
        // The identification is the same for all kinds: it is tested once.
        let first = if kind == "mh4" { 0 } else { count.saturating_sub(20) };
        for (at, fault) in (first..count).flat_map(|at| FAULTS.map(|fault| (at, fault))) {
            let mut bus = FaultyBus::of(kind, CONSTANT_VALUE, Some((at, fault)));
            let result = zero(&mut bus, false);
            let sent_count = bus.count("2561017A65726F");
            let place = format!("{kind}: {fault:?} at {}: {result:?}", bus.sent[at.min(bus.sent.len() - 1)]);
            assert!(sent_count <= 1, "{place}");
            let last = at + 1 == bus.sent.len();
            let holds = bus.look(offset);
            match result {
                Ok(report) => {
                    // If the device restarts after the last answer, the command has already reported its result.
                    assert!(holds == new || fault == Fault::Restart && last, "{place}");
                    assert!(report.after.expect("measured").abs() <= 0.001 && !report.stored, "{place}");
                    assert_ne!(fault, Fault::Interrupt, "{place}");
                    let silent = matches!(report.notes[0].fact, Fact::Autozero(AutozeroFact::ProvedBy { .. }));
                    acted_without_answer += usize::from(silent && fault == Fault::LoseAnswer);
                }
                Err(failure) => {
                    let nothing = ErrorMessage::of(&failure).message.contains("nothing was changed");
                    assert!(!nothing || sent_count == 0, "{place}");
                    assert!(nothing || sent_count == 1 || fault != Fault::Interrupt, "{place}");
                    assert!(!nothing || holds == [0; 4], "{place}");
                    if sent_count > 0 && ErrorMessage::of(&failure).message.contains("the offset is unchanged") {
                        assert_eq!(holds, [0; 4], "{place}");
                    }
                    assert_eq!(failure.kind() == Kind::Interrupted, fault == Fault::Interrupt, "{place}");
                }
            }
        }
        assert_eq!(acted_without_answer, 1, "{kind}");
    }
}

#[test]
fn zero_reported_as_stored_survives_a_reset() {
    for (kind, offset, new) in
        [("mh4", "0x6127:1", (-0.0625f32).to_le_bytes()), ("dps", "0x6124:1", (-63i32).to_le_bytes())]
    {
        let count = frames(|bus| drop(zero(bus, true)), kind, CONSTANT_VALUE);
        // The steps before the store are tested without storing.
        for (at, fault) in (count.saturating_sub(25)..count).flat_map(|at| FAULTS.map(|fault| (at, fault))) {
            let mut bus = FaultyBus::of(kind, CONSTANT_VALUE, Some((at, fault)));
            let result = zero(&mut bus, true);
            let place = format!("{kind}: {fault:?} at {}: {result:?}", bus.sent[at.min(bus.sent.len() - 1)]);
            assert!(bus.count("73617665") <= 1 && bus.count("2561017A65726F") <= 1, "{place}");
            if let Ok(report) = result {
                bus.reset();
                assert!(report.stored && bus.look(offset) == new, "{place}");
            }
        }
    }
}

/// OPERATIONAL with a heartbeat. The unit differs from the stored one.
const RUNS: &str = "start = true\nset = { \"0x1017\" = 100, \"0x6131:1\" = 0xAB0000 }\n";

fn save(bus: &mut FaultyBus, verify: bool) -> Result<StoreReport, Failure> {
    with(bus, |master| {
        let device = store::device(master, node(), &Default::default())?;
        store::store(master, &device, Group::All, verify)
    })
}

/// Writes a setting without storing it.
fn set(bus: &mut FaultyBus) {
    let request = "605#2F32610101000000";
    bus.inner.send(&request.parse().expect("a frame")).expect("sent");
    bus.run_on();
    assert_eq!(bus.look("0x6132:1"), [1], "the setting was not taken");
}

#[test]
fn settings_reported_as_stored_survive_a_reset() {
    for verify in [false, true] {
        let run = |bus: &mut FaultyBus| {
            set(bus);
            drop(save(bus, verify));
        };
        let count = frames(run, "mh4", RUNS);
        // The steps before the check are the same with and without it.
        let first = if verify { 0 } else { count.saturating_sub(20) };
        for (at, fault) in (first..count).flat_map(|at| FAULTS.map(|fault| (at, fault))) {
            let mut bus = FaultyBus::of("mh4", RUNS, Some((at, fault)));
            set(&mut bus);
            let result = save(&mut bus, verify);
            let place = format!("verify {verify}: {fault:?} at {}: {result:?}", bus.sent[at.min(bus.sent.len() - 1)]);
            assert!(bus.count("73617665") <= 1, "{place}");
            assert!(bus.state().is_some_and(|state| state == State::Operational), "{place}");
            match result {
                Ok(done) => {
                    assert_eq!(done.verified, if verify { Verified::Reset } else { Verified::Ack });
                    bus.reset();
                    // A restart before the store loses the setting. Only a value that was read before
                    // the restart is proven.
                    let read = bus.sent.iter().position(|sent| sent.ends_with("#4032610100000000"));
                    let proven = read.is_some_and(|read| read < at);
                    let restarts = matches!(fault, Fault::Restart | Fault::Restarted) && !proven;
                    assert!(bus.look("0x6132:1") == [1] || restarts, "{place}");
                }
                Err(failure) => {
                    let texts = ["it is unknown whether the settings were stored", "the result was not verified"];
                    let is_reported = texts.iter().any(|text| ErrorMessage::of(&failure).message.contains(text));
                    assert_eq!(is_reported, bus.count("73617665") == 1, "{place}");
                }
            }
        }
    }
}

fn load(bus: &mut FaultyBus) -> Result<StoreReport, Failure> {
    with(bus, |master| {
        let device = store::device(master, node(), &Default::default())?;
        restore::restore(master, &device, Group::All, true)
    })
}

#[test]
fn acknowledged_signature_without_effect_is_detected() {
    let mut bus = FaultyBus::of("mh4", RUNS, None);
    load(&mut bus).expect("restored");
    let at = bus.sent.iter().position(|frame| frame.ends_with("6C6F6164")).expect("\"load\"");
    let failure = load(&mut FaultyBus::of("mh4", RUNS, Some((at, Fault::Pretend)))).expect_err("nothing was restored");
    assert_eq!(failure.kind(), Kind::Unexpected);
    assert!(ErrorMessage::of(&failure).message.contains("restored and reset, but not at the defaults"), "{failure}");
    let mut bus = FaultyBus::of("mh4", CONSTANT_VALUE, None);
    zero(&mut bus, false).expect("zero");
    let at = bus.sent.iter().position(|frame| frame.ends_with("7A65726F")).expect("\"zero\"");
    let failure =
        zero(&mut FaultyBus::of("mh4", CONSTANT_VALUE, Some((at, Fault::Pretend))), false).expect_err("no zero");
    assert_eq!(failure.kind(), Kind::Unexpected);
    assert!(
        ErrorMessage::of(&failure).message.contains("the device accepted the signature, and nothing has changed"),
        "{failure}"
    );
}

#[test]
fn values_reported_as_restored_are_factory_defaults() {
    let count = frames(|bus| drop(load(bus)), "mh4", RUNS);
    for (at, fault) in (0..count).flat_map(|at| FAULTS.map(|fault| (at, fault))) {
        let mut bus = FaultyBus::of("mh4", RUNS, Some((at, fault)));
        let result = load(&mut bus);
        let place = format!("{fault:?} at {}: {result:?}", bus.sent[at.min(bus.sent.len() - 1)]);
        assert!(bus.count("6C6F6164") <= 1, "{place}");
        match result {
            Ok(done) => {
                // Without an identity the defaults are unknown, and nothing is compared.
                let is_identity = |frame: &String| frame.contains("#40081000") || frame.contains("#401810");
                let may_be_unknown = bus.sent.get(at).is_some_and(is_identity);
                assert!(done.verified == Verified::Reset || may_be_unknown, "{place}");
                assert_eq!(bus.look("0x6131:1"), 0x4E_0000u32.to_le_bytes(), "{place}");
                assert_eq!(bus.look("0x1017"), [0, 0], "{place}");
            }
            Err(failure) => {
                let texts = ["whether the next reset sets the defaults", "the result was not verified"];
                let is_reported = texts.iter().any(|text| ErrorMessage::of(&failure).message.contains(text));
                assert_eq!(is_reported, bus.count("6C6F6164") == 1, "{place}");
            }
        }
    }
}

#[test]
fn rejection_is_reported_and_only_the_form_is_retried() {
    let place = |verify: bool| {
        let mut usual = FaultyBus::of("d20", "", None);
        save(&mut usual, verify).expect("stored");
        usual.sent.iter().position(|sent| sent.ends_with("2210100173617665")).expect("the signature")
    };
    // Page 12: "If the storing failed": 06060000h; a wrong signature: 0800002xh.
    for (code, words) in [
        (0x0606_0000, "access failed because of a hardware error"),
        (0x0800_0020, "data cannot be transferred or stored"),
    ] {
        let mut bus = FaultyBus::of("d20", "", Some((place(true), Fault::Refuse(code))));
        let failure = save(&mut bus, true).expect_err("refused");
        assert_eq!((failure.kind(), failure.abort().map(|abort| abort.0)), (Kind::Refused, Some(code)));
        assert!(ErrorMessage::of(&failure).message.contains(words), "{failure}");
        assert_eq!((bus.count("73617665"), bus.count("000#8105")), (1, 0), "neither repeated nor reset");
    }
    // A device that rejects the form of the size has not executed the request.
    let mut bus = FaultyBus::of("d20", "", Some((place(false), Fault::Refuse(0x0504_0001))));
    save(&mut bus, false).expect("stored");
    assert_eq!((bus.count("2210100173617665"), bus.count("2310100173617665")), (1, 1));
}

#[test]
fn rejected_command_of_a_plain_value_is_repeated_once() {
    let write = |bus: &mut FaultyBus| {
        with(bus, |master| {
            let device = store::device(master, node(), &Default::default())?;
            Ok::<_, Failure>(write(master, &device, ObjectId::new(0x1017, 0), &[0xf4, 0x01])?)
        })
    };
    let mut usual = FaultyBus::of("d20", "", None);
    write(&mut usual).expect("written");
    let at = usual.sent.iter().position(|sent| sent.ends_with("22171000F4010000")).expect("the write");
    let mut bus = FaultyBus::of("d20", "", Some((at, Fault::Refuse(0x0504_0001))));
    write(&mut bus).expect("written");
    // The same form again: an unfinished transfer of another master was the reason. The other form is not needed.
    assert_eq!((bus.count("22171000F4010000"), bus.count("2B171000F4010000")), (2, 0));
    let mut bus = FaultyBus::of("d20", "", Some((at, Fault::Refuse(0x0607_0010))));
    write(&mut bus).expect("written");
    assert_eq!((bus.count("22171000F4010000"), bus.count("2B171000F4010000")), (1, 1), "a wrong length is the form");
}
