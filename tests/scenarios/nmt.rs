//! NMT commands to nodes that obey late or not at all.

use super::log_goes_on::Other;
use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::{Bus, BusError, Event, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::nmt::{NmtCommand, NmtState};
use cangauge::master::{Master, Timing};
use cangauge::sim::Bench;
use cangauge::tasks::nmt::{Proof, StateReport, command, states};
use std::path::Path;
use std::time::Duration;

/// A node in OPERATIONAL with a heartbeat every 100 ms. It obeys only the frame `obeys`, after 250 ms.
struct Slow {
    obeys: Option<Frame>,
    beat: Mono,
    stops: Option<Mono>,
}

const PERIOD: Duration = Duration::from_millis(100);

impl Station for Slow {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        match frame.data() {
            [0x40, 0x17, 0x10, ..] => out.send("585#4B17100064000000".parse().unwrap()),
            [0x40, a, b, c, ..] => out.send(format!("585#80{a:02X}{b:02X}{c:02X}00000206").parse().unwrap()),
            _ if self.obeys == Some(*frame) => self.stops = Some(now + Duration::from_millis(250)),
            _ => {}
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if self.beat <= now {
            let has_stopped = self.stops.is_some_and(|at| at <= now);
            out.send(if has_stopped { "705#04" } else { "705#05" }.parse().unwrap());
            self.beat = now + PERIOD;
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.beat)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

fn node() -> NodeId {
    NodeId::new(5).unwrap()
}

/// Sends a command to a node that obeys only `obeys`. Returns the reported state.
fn report_after(what: NmtCommand, obeys: Option<&str>) -> StateReport {
    let mut bus = MemoryBus::new(Clock::Virtual);
    let obeys = obeys.map(|text| text.parse().unwrap());
    bus.attach(Slow { obeys, beat: Mono::START + PERIOD, stops: None });
    let mut master = Master::new(&mut bus, Timing::default());
    command(&mut master, what, &[node()], false).unwrap()[0]
}

#[test]
fn heartbeat_with_the_old_state_confirms_nothing() {
    for reset in [NmtCommand::ResetNode, NmtCommand::ResetCommunication] {
        assert_eq!(
            report_after(reset, None),
            StateReport { node: node(), state: None, by: Proof::None, is_present: true }
        );
    }
    let operational = Some(NmtState::Operational);
    let still = StateReport { node: node(), state: operational, by: Proof::Heartbeat, is_present: true };
    assert_eq!(report_after(NmtCommand::Stop, None), still);
}

#[test]
fn heartbeat_during_the_check_of_another_node_counts() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    let obeys = Some("000#0205".parse().unwrap());
    bus.attach(Slow { obeys, beat: Mono::START + PERIOD, stops: None });
    let mut master = Master::new(&mut bus, Timing { timeout: PERIOD, retries: 1 });
    // The node obeys after its waiting time, during the SDO check of the other node.
    let silent = NodeId::new(44).unwrap();
    let reports = command(&mut master, NmtCommand::Stop, &[silent, node()], false).unwrap();
    assert_eq!((reports[1].state, reports[1].by), (Some(NmtState::Stopped), Proof::Heartbeat));
}

#[test]
fn heartbeats_before_the_state_change_are_skipped() {
    let report = report_after(NmtCommand::Stop, Some("000#0205"));
    let stopped = Some(NmtState::Stopped);
    assert_eq!(report, StateReport { node: node(), state: stopped, by: Proof::Heartbeat, is_present: true });
}

#[test]
fn absent_node_is_not_reported_as_stopped() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    // Another node acknowledges frames.
    bus.attach(Slow { obeys: None, beat: Mono::START + PERIOD, stops: None });
    let other = NodeId::new(9).unwrap();
    let mut master = Master::new(&mut bus, Timing::default());
    let reports = command(&mut master, NmtCommand::Stop, &[other], false).unwrap();
    assert_eq!(reports, [StateReport { node: other, state: None, by: Proof::None, is_present: false }]);
}

#[test]
fn node_guarded_by_another_master_is_not_guarded() {
    let bench = "clock = 'virtual'\n[[device]]\nkind = 'd20'\nnode = 5\n";
    for period in [None, Some(10), Some(150)] {
        let mut bus = Bench::from_toml(bench, Path::new("")).unwrap().open().unwrap();
        let asks: Vec<(u64, &str)> = (0..1000).filter_map(|n| Some((period? * n + 1, "705#R1"))).collect();
        bus.attach(Other::new(&asks));
        let mut bus = Counting { bus, asked: 0 };
        let mut master = Master::new(&mut bus, Timing::default());
        let state = states(&mut master, &[node()]).unwrap()[0].state;
        assert_eq!(state, Some(NmtState::PreOperational), "{period:?}");
        assert_eq!(bus.asked, u32::from(period.is_none()), "{period:?}");
    }
}

/// The first guarding request arms life guarding: the device then reports 8130h when the requests end.
#[test]
fn life_guarding_is_not_armed() {
    for kind in ["d20", "mc1609"] {
        let bench = format!(
            "clock = 'virtual'\n[[device]]\nkind = '{kind}'\nnode = 5\nset = {{ \"0x100C\" = 100, \"0x100D\" = 3 }}\n"
        );
        let mut bus = Bench::from_toml(&bench, Path::new("")).unwrap().open().unwrap();
        let mut master = Master::new(&mut bus, Timing::default());
        states(&mut master, &[node()]).unwrap();
        command(&mut master, NmtCommand::Start, &[node()], false).unwrap();
        assert_eq!(guarding_failures(&mut bus), 0, "{kind}");
        bus.send(&"705#R1".parse().unwrap()).unwrap();
        assert_eq!(guarding_failures(&mut bus), 1, "{kind}: a request does arm it");
    }
}

/// The emergencies 8130h within two seconds.
fn guarding_failures(bus: &mut MemoryBus) -> usize {
    let until = bus.now().mono + Duration::from_secs(2);
    let mut failures = 0;
    loop {
        match bus.receive(until).unwrap() {
            Event::Frame(received) => failures += usize::from(received.frame.to_string().starts_with("085#3081")),
            Event::Timeout => return failures,
            _ => {}
        }
    }
}

/// Counts the remote frames that are sent.
struct Counting {
    bus: MemoryBus,
    asked: u32,
}

impl cangauge::bus::BitRateControl for Counting {
    cangauge::bus::delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl Bus for Counting {
    cangauge::bus::delegate_bus!(self, self.bus => name timestamps is_live waits now mono listen receive_buffer unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.asked += u32::from(frame.is_remote());
        self.bus.send(frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        self.bus.receive(deadline)
    }
}
