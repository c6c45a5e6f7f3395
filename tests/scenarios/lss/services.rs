//! Single LSS services: which slaves answer, how often, in time or late, and which slaves are changed.

use super::slave::Slave;
use super::{address, bus_of, configuring, ms};
use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{MemoryBus, Outbox, Station};
use cangauge::bus::{Bus, BusError, Event, Fault, Mono, Received};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::lss::{ErrorCode, LssRange, Mode, Part, Service, Violation};
use cangauge::master::lss::{GatheredAnswers, Others};
use cangauge::master::{Error, Lss, LssError, Master, Timing};
use cangauge::node::Overrides;
use cangauge::tasks::Note;
use cangauge::tasks::failure::{Failure, Kind};
use cangauge::tasks::lss::{Descriptions, Target, inquire};
use std::time::Duration;

const ONE: [u32; 4] = [0x362, 0x0044_3150, 0x0001_0000, 20002];
const OTHER: [u32; 4] = [0x362, 0x0044_3150, 0x0001_0000, 20003];

fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

/// Runs services. Afterwards no slave may be in configuration state.
fn run<T>(bus: &mut MemoryBus, services: impl FnOnce(&mut Lss) -> Result<T, LssError>) -> Result<T, LssError> {
    let mut master = Master::new(bus, Timing::default());
    let mut lss = master.lss();
    let result = services(&mut lss);
    drop(lss);
    drop(master);
    let until = bus.mono() + Duration::from_millis(10);
    while bus.receive(until).unwrap() != Event::Timeout {}
    assert_eq!(configuring(bus).len(), 0, "left in configuration state");
    result
}

#[test]
fn inquiry_reports_an_answer_with_another_specifier() {
    for (service, answer) in [(0x5e, vec![0x5d, 5, 0, 0, 0, 0, 0, 0]), (0x5a, vec![0x5b, 0x62, 3, 0, 0, 0, 0, 0])] {
        let mut slave = Slave::new(ONE, 5);
        slave.answers.insert(service, answer);
        let (mut bus, overrides, mut notes) = (bus_of([slave]), Overrides::new(), Vec::new());
        let target = Target::Address(address(ONE));
        let named = Descriptions { overrides: &overrides, given: None };
        let mut master = Master::new(&mut bus, Timing::default());
        let found =
            inquire(&mut master, &target, &named, &mut |note| notes.push(note)).expect("one inquiry is answered");
        assert_eq!((found.address.is_some(), found.node.is_some()), (service == 0x5e, service == 0x5a));
        let is_reported = |note: &Note| format!("{:?}", note.fact).contains("OtherAnswer");
        assert_eq!(notes.iter().filter(|note| is_reported(note)).count(), 1, "{notes:?}");
    }
}

/// Sets the node-ID of the slave with this address, as the task does.
fn assign(lss: &mut Lss, identity: [u32; 4], to: NodeId) -> Result<(), LssError> {
    lss.switch_global(Mode::Waiting)?;
    lss.switch_selective(&address(identity))?;
    lss.configure_node_id(Some(to))?;
    lss.store()
}

#[test]
fn only_the_addressed_slave_receives_commands() {
    for order in [[ONE, OTHER], [OTHER, ONE]] {
        let mut bus = bus_of(order.map(|identity| Slave::new(identity, 5)));
        // Another master has left all slaves in configuration state.
        bus.stations_mut::<Slave>().for_each(|slave| slave.is_configuring = true);
        run(&mut bus, |lss| assign(lss, ONE, node(12))).unwrap();
        for slave in bus.stations::<Slave>() {
            let expected = if slave.identity == ONE { (12, Some(12), 2) } else { (5, None, 0) };
            assert_eq!((slave.node, slave.stored, slave.commands), expected);
        }
    }
}

#[test]
fn address_is_repeated_from_its_first_part() {
    let mut slave = Slave::new(ONE, 5);
    slave.loses = [0].into();
    let mut bus = bus_of([slave, Slave::new(OTHER, 6)]);
    run(&mut bus, |lss| assign(lss, ONE, node(12))).unwrap();
    assert_eq!(bus.stations::<Slave>().map(|slave| slave.node).collect::<Vec<_>>(), [12, 6]);
    let mut bus = bus_of([Slave::new(OTHER, 6)]);
    let error = run(&mut bus, |lss| assign(lss, ONE, node(12))).unwrap_err();
    assert_eq!(error.to_string(), "LSS switch state selective: no answer within 500 ms");
    assert_eq!(bus.stations::<Slave>().map(|slave| slave.commands).sum::<usize>(), 0);
}

#[test]
fn address_is_repeated_with_pauses() {
    for pause in [10, 190] {
        let mut slave = Slave::new(ONE, 5);
        slave.pause = Duration::from_millis(pause);
        let mut bus = bus_of([slave]);
        let mut master = Master::new(&mut bus, Timing::default());
        let selected = master.lss().switch_selective(&address(ONE));
        assert_eq!(selected.map_err(|error| error.to_string()), Ok(()), "{pause} ms");
    }
}

#[test]
fn store_has_a_long_timeout_and_is_sent_once() {
    let mut bus = bus_of([Slave::new(ONE, 5).slow(&[300, 300, 2_900_000])]);
    run(&mut bus, |lss| assign(lss, ONE, node(12))).unwrap();
    let mut slave = Slave::new(ONE, 5);
    slave.answers.insert(0x17, vec![]);
    let mut bus = bus_of([slave]);
    let error = run(&mut bus, |lss| assign(lss, ONE, node(12))).unwrap_err();
    assert_eq!(error.to_string(), "LSS store configuration: no answer within 3 s");
    assert_eq!(bus.stations::<Slave>().map(|slave| slave.commands).sum::<usize>(), 2);
}

#[test]
fn answer_to_store_is_reported() {
    for (answer, expected, kind) in [
        (&[0x17, 0, 0, 0, 0, 0, 0, 0][..], "", None),
        (&[0x17, 0], "", None),
        (
            &[0x17, 1, 0, 0, 0, 0, 0, 0],
            "LSS store configuration: refused by the device (error 1, storing not supported)",
            Some(Kind::Refused),
        ),
        (
            &[0x17, 0xff, 7, 0, 0, 0, 0, 0],
            "LSS store configuration: refused by the device (error 255, manufacturer-specific error: 7)",
            Some(Kind::Refused),
        ),
        (&[0x17], "LSS store configuration: frame too short: 7E4#17", Some(Kind::Unexpected)),
        // The answer to another service is ignored.
        (
            &[0x11, 0, 0, 0, 0, 0, 0, 0],
            "LSS store configuration: no answer within 3 s; received 7E4#1100000000000000",
            Some(Kind::NoAnswer),
        ),
        (
            &[0x44, 0, 0, 0, 0, 0, 0, 0],
            "LSS store configuration: no answer within 3 s; received 7E4#4400000000000000",
            Some(Kind::NoAnswer),
        ),
    ] {
        let mut slave = Slave::new(ONE, 5);
        slave.answers.insert(0x17, answer.to_vec());
        let result = run(&mut bus_of([slave]), |lss| assign(lss, ONE, node(12)));
        assert_eq!(result.as_ref().err().map(ToString::to_string).unwrap_or_default(), expected);
        assert_eq!(result.err().map(|error| Failure::from(error).kind()), kind, "{answer:X?}");
    }
    let code = ErrorCode { code: 1, specific: 0 };
    let mut slave = Slave::new(ONE, 5);
    slave.answers.insert(0x13, vec![0x13, 1, 0, 0, 0, 0, 0, 0]);
    let refused = run(&mut bus_of([slave]), |lss| {
        lss.switch_global(Mode::Configuration)?;
        lss.configure_bit_timing(0, 5)
    });
    let service = Service::ConfigureBitTiming;
    assert!(matches!(refused, Err(LssError::Refused { service: s, code: c }) if (s, c) == (service, code)));
}

#[test]
fn several_slaves_in_configuration_state_are_detected() {
    let all = |bus: &mut MemoryBus| {
        run(bus, |lss| {
            lss.switch_global(Mode::Configuration)?;
            Ok((lss.inquire(Part::Serial)?, lss.inquire(Part::Vendor)?, lss.inquire_node_id()?))
        })
    };
    let (serial, vendor, id) = all(&mut bus_of([Slave::new(ONE, 5)])).unwrap();
    assert_eq!((serial.is_one(), vendor.is_one(), id.is_one()), (true, true, true));
    assert_eq!((serial.answers, vendor.answers, id.answers), (vec![20002], vec![0x362], vec![Some(node(5))]));
    // The second answer may be late.
    for latency in [2000, 20_000, 400_000] {
        let (serial, vendor, id) =
            all(&mut bus_of([Slave::new(ONE, 5), Slave::new(OTHER, 5).slow(&[latency])])).unwrap();
        assert_eq!(serial.answers, [20002, 20003]);
        assert_eq!((serial.is_one(), vendor.is_one(), id.is_one()), (false, false, false), "{latency}");
        assert_eq!((vendor.answers, id.answers), (vec![0x362], vec![Some(node(5))]));
    }
    // Simultaneous answers merge into one frame if they are equal; otherwise there is an error frame, then both are
    // sent.
    let (serial, vendor, _) = all(&mut bus_of([Slave::new(ONE, 5), Slave::new(OTHER, 5)])).unwrap();
    assert_eq!((serial.is_one(), vendor.is_one()), (false, true));
    // Two slaves executed a service for one slave: an error.
    let mut bus = bus_of([Slave::new(ONE, 5), Slave::new(OTHER, 5).slow(&[2000])]);
    let both = run(&mut bus, |lss| {
        lss.switch_global(Mode::Configuration)?;
        lss.configure_node_id(Some(node(12)))
    });
    assert!(matches!(both, Err(LssError::Several { service: Service::ConfigureNodeId, .. })));
}

#[test]
fn other_slaves_of_the_same_product_are_found() {
    let others = |more: Vec<Slave>| {
        let slaves = [Slave::new(ONE, 5)].into_iter().chain(more);
        run(&mut bus_of(slaves), |lss| lss.others(&address(ONE))).unwrap()
    };
    let range = |text: &str| Others::Within(text.parse::<LssRange>().unwrap());
    assert_eq!(others(vec![]), Others::None);
    assert_eq!(others(vec![Slave::new([1, 2, 3, 4], 5)]), Others::None);
    assert_eq!(others(vec![Slave::new(OTHER, 5)]), range("0x362:0x443150:0-0xFFFFFFFF:20003-0xFFFFFFFF"));
    let older = [ONE[0], ONE[1], 1, 7];
    assert_eq!(others(vec![Slave::new(older, 5)]), range("0x362:0x443150:0-0xFFFFFFFF:0-20001"));
    let newer = [ONE[0], ONE[1], 0x0001_0001, ONE[3]];
    assert_eq!(others(vec![Slave::new(newer, 5)]), range("0x362:0x443150:0x10001-0xFFFFFFFF:20002"));
    // Two slaves with the same identity, if they do not answer simultaneously.
    assert_eq!(others(vec![Slave::new(ONE, 5).slow(&[900])]), range("0x362:0x443150:0x10000:20002"));
    let mut bus = bus_of([Slave::new(ONE, 5).without(0x46..=0x4b)]);
    assert_eq!(run(&mut bus, |lss| lss.others(&address(ONE))).unwrap(), Others::Unproven);
}

#[test]
fn slave_without_node_id_is_identified() {
    for (id, expected) in [(5, false), (0xff, true)] {
        let mut bus = bus_of([Slave::new(ONE, id)]);
        assert_eq!(run(&mut bus, |lss| lss.identify_unconfigured()).unwrap(), expected);
    }
}

#[test]
fn ctrl_c_ends_in_waiting_state_without_further_changes() {
    let mut interrupted = 0;
    for moment in 0..60 {
        let mut bus = bus_of([Slave::new(ONE, 5), Slave::new(OTHER, 6)]);
        bus.interrupt_at(ms(moment));
        match run(&mut bus, |lss| assign(lss, ONE, node(12))) {
            Ok(()) => {}
            Err(LssError::Master(Error::Interrupted)) => interrupted += 1,
            Err(other) => panic!("{other}"),
        }
        let other = bus.stations::<Slave>().find(|slave| slave.identity == OTHER).unwrap();
        assert_eq!((other.node, other.stored, other.commands), (6, None, 0));
    }
    assert!(interrupted > 20, "{interrupted}");
}

/// Another LSS master that sends one global command.
struct Rival(Option<Mono>);

impl Station for Rival {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, _: Mono, out: &mut Outbox) {
        self.0 = None;
        out.send("7E5#0401000000000000".parse().unwrap());
    }

    fn next_wake(&self) -> Option<Mono> {
        self.0
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

#[test]
fn command_of_another_master_is_an_error() {
    let mut bus = bus_of([Slave::new(ONE, 5), Slave::new(OTHER, 6)]);
    bus.attach(Rival(Some(ms(9))));
    let error = run(&mut bus, |lss| assign(lss, ONE, node(12))).unwrap_err();
    assert_eq!(error.to_string(), "another LSS master sends at the same time: 7E5#0401000000000000");
    assert_eq!(bus.stations::<Slave>().filter(|slave| slave.node == 12).count(), 0);
    // A command before the first service is ignored.
    let mut bus = bus_of([Slave::new(ONE, 5), Slave::new(OTHER, 6)]);
    bus.attach(Rival(Some(ms(9))));
    while bus.receive(ms(10)).unwrap() != Event::Timeout {}
    run(&mut bus, |lss| assign(lss, ONE, node(12))).unwrap();
}

/// A bus that destroys answers, or that has an answer before the request.
struct OddBus {
    bus: MemoryBus,
    /// Answers become error frames.
    collides: bool,
    /// An answer that was received before the request.
    stale: Option<Frame>,
}

impl cangauge::bus::BitRateControl for OddBus {
    cangauge::bus::delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl Bus for OddBus {
    cangauge::bus::delegate_bus!(self, self.bus => name timestamps is_live waits now mono listen receive_buffer unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        if let Some(frame) = self.stale.take() {
            return Ok(Event::Frame(Received { frame, at: self.now() }));
        }
        match self.bus.receive(deadline)? {
            Event::Frame(received) if self.collides && received.frame.id() == CanId::LSS_SLAVE => {
                Ok(Event::Fault(Fault::Protocol, received.at))
            }
            event => Ok(event),
        }
    }
}

#[test]
fn colliding_answers_are_not_silence() {
    let bus = bus_of([Slave::new(ONE, 5), Slave::new(OTHER, 6)]);
    let mut bus = OddBus { bus, collides: true, stale: None };
    let mut master = Master::new(&mut bus, Timing::default());
    let mut lss = master.lss();
    lss.switch_global(Mode::Configuration).unwrap();
    let serial = lss.inquire(Part::Serial).unwrap();
    assert!(
        matches!(&serial, GatheredAnswers { answers, faults, .. } if answers.is_empty() && faults[0] == Fault::Protocol)
    );
    assert!(!serial.is_one());
}

#[test]
fn answer_before_the_request_is_ignored() {
    let stale = "7E4#1700000000000000".parse().ok();
    let mut bus = OddBus { bus: bus_of([]), collides: false, stale };
    let mut master = Master::new(&mut bus, Timing::default());
    assert!(matches!(master.lss().store(), Err(LssError::NoAnswer { service: Service::Store, .. })));
}

#[test]
fn request_waiting_for_the_queue_is_dropped_at_ctrl_c() {
    let mut slave = Slave::new(ONE, 5);
    slave.is_configuring = true;
    let mut bus = bus_of([slave]);
    bus.interrupt_at(ms(3));
    let plan = FaultPlan { queue_full: (0..20).collect(), ..FaultPlan::default() };
    let mut bus = Faulty::new(bus, plan);
    let mut master = Master::new(&mut bus, Timing::default());
    assert!(matches!(master.lss().store(), Err(LssError::Master(Error::Interrupted))));
    master.lss().switch_global(Mode::Waiting).unwrap();
    drop(master);
    let slave = bus.inner().stations::<Slave>().next().unwrap();
    assert_eq!((slave.is_configuring, slave.commands), (false, 0));
}

#[test]
fn immediate_answer_is_received_after_a_full_queue() {
    for full in 0..12 {
        let mut slave = Slave::new(ONE, 5).slow(&[0]);
        slave.is_configuring = true;
        let bus = bus_of([slave]).with_bit_rate(1_000_000);
        let plan = FaultPlan { queue_full: (0..full).collect(), ..FaultPlan::default() };
        let mut bus = Faulty::new(bus, plan);
        Master::new(&mut bus, Timing::default()).lss().store().unwrap();
    }
}

#[test]
fn short_inquiry_answer_is_a_violation() {
    let mut slave = Slave::new(ONE, 5);
    slave.answers.insert(0x5d, vec![0x5d, 0x22, 0x4e]);
    let result = run(&mut bus_of([slave]), |lss| {
        lss.switch_global(Mode::Configuration)?;
        lss.inquire(Part::Serial)
    });
    assert!(matches!(result, Err(LssError::Violation { violation: Violation::Short, .. })));
}

#[test]
fn answer_with_a_bus_error_may_be_several() {
    let gathered =
        |faults: &[Fault]| GatheredAnswers { answers: vec![1], has_several_slaves: false, faults: faults.to_vec() };
    assert!(gathered(&[]).is_one() && gathered(&[Fault::NoAcknowledge]).is_one());
    for fault in [Fault::Protocol, Fault::ErrorWarning, Fault::ErrorPassive, Fault::BusOff, Fault::Other] {
        assert!(!gathered(&[fault]).is_one(), "{fault:?}");
    }
}
