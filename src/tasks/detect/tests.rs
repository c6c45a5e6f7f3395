//! Tests on a simulated wire: at a wrong bit rate, only errors are received.

use super::*;
use crate::bus::{BitRateControl, Mono, Received, Stamp, TimestampSource, Wall};
use crate::canopen::frame::Frame;
use crate::tasks::Kind;
use crate::tasks::failure::Cause;
use crate::tasks::host::HostFailure;
use std::collections::VecDeque;

const TIME_PER_RATE: Duration = Duration::from_millis(1500);

/// An interface, and one device with one heartbeat per second.
struct Wire {
    now: Mono,
    /// The bit rate of the device.
    device: u32,
    /// Whether the device sends a heartbeat.
    heartbeat: bool,
    /// Whether the device answers SDO requests.
    answers: bool,
    /// Whether a third node is connected, which acknowledges frames.
    third_node: bool,
    /// A bit rate that the interface cannot be set to.
    impossible: Option<u32>,
    /// Whether the interface has a listen-only mode.
    listens: bool,
    /// The error if the interface cannot be set at all.
    refusal: Option<fn() -> BusError>,
    interrupt: Option<Mono>,
    set: Option<(u32, Mode)>,
    pending_events: VecDeque<Event>,
    sent: Vec<(u32, Frame)>,
    log: Vec<String>,
}

impl Wire {
    fn at(device: u32) -> Wire {
        Wire {
            now: Mono::START,
            device,
            heartbeat: true,
            answers: true,
            third_node: true,
            impossible: None,
            listens: true,
            refusal: None,
            interrupt: None,
            set: None,
            pending_events: VecDeque::new(),
            sent: Vec::new(),
            log: Vec::new(),
        }
    }

    fn stamp(&self) -> Stamp {
        Stamp { mono: self.now, wall: Wall::at(self.now.since_start()) }
    }

    fn matches(&self) -> bool {
        self.set.is_some_and(|(rate, _)| rate == self.device)
    }
}

impl BitRateControl for Wire {
    fn bit_rate(&self) -> Option<u32> {
        Some(self.set.map_or(500_000, |(rate, _)| rate))
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        self.refusal.map_or(Ok(()), |refusal| Err(refusal()))
    }

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        if self.impossible == Some(bit_rate) {
            return Err(BusError::BitRate { name: "can9".into(), bit_rate, why: "no".into() });
        }
        if mode == Mode::ListenOnly && !self.listens {
            return Err(BusError::Unsupported("can9 has no listen-only mode".into()));
        }
        self.set = Some((bit_rate, mode));
        self.pending_events.clear();
        self.log.push(format!("{bit_rate} {mode:?}"));
        Ok(())
    }

    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        self.set = None;
        self.log.push("back".into());
        Ok(())
    }
}

impl Bus for Wire {
    fn name(&self) -> &str {
        "can9"
    }

    fn timestamps(&self) -> TimestampSource {
        TimestampSource::Simulated
    }

    fn now(&self) -> Stamp {
        self.stamp()
    }

    fn listen(&mut self, _: &Filters) -> Result<(), BusError> {
        Ok(())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        assert_eq!(self.set.map(|(_, mode)| mode), Some(Mode::Normal), "{frame} in listen-only mode");
        if !self.matches() {
            return Err(BusError::QueueFull);
        }
        self.sent.push((self.device, *frame));
        let answer = "585#4300100094010200".parse().unwrap();
        if self.answers && frame.to_string().starts_with("605#") {
            self.pending_events.push_back(Event::Frame(Received { frame: answer, at: self.stamp() }));
        }
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        if let Some(event) = self.pending_events.pop_front() {
            return Ok(event);
        }
        let second = Duration::from_secs(1);
        let next = Mono::at(second * u32::try_from(self.now.since_start().as_secs() + 1).unwrap());
        if let Some(moment) = self.interrupt.filter(|moment| *moment <= deadline.min(next)) {
            self.interrupt = None;
            self.now = self.now.max(moment);
            return Ok(Event::Interrupted);
        }
        if next > deadline || !self.heartbeat {
            self.now = self.now.max(deadline);
            return Ok(Event::Timeout);
        }
        self.now = next;
        // A frame without an acknowledgement is an error for all nodes.
        let normal = self.set.is_some_and(|(_, mode)| mode == Mode::Normal);
        if self.matches() && (self.third_node || normal) {
            return Ok(Event::Frame(Received { frame: "705#7F".parse().unwrap(), at: self.stamp() }));
        }
        Ok(Event::Fault(Fault::Protocol, self.stamp()))
    }
}

fn run(wire: &mut Wire, ask: bool) -> Result<Detection, Failure> {
    detect(wire, ask, TIME_PER_RATE, &mut |_| ())
}

#[test]
fn listening_finds_the_bit_rate_and_restores_the_interface() {
    for rate in RATES {
        let mut wire = Wire::at(rate);
        let found = run(&mut wire, false).unwrap();
        assert_eq!(found.found, Some((rate, Evidence::Frames)));
        assert!(found.tried.iter().all(|tried| tried.how == Method::Listening));
        assert_eq!(wire.log.first().map(String::as_str), Some("500000 ListenOnly"), "the present bit rate comes first");
        assert_eq!(wire.log.last().map(String::as_str), Some("back"));
        assert!(wire.sent.is_empty());
    }
}

#[test]
fn no_bit_rate_without_evidence() {
    // An unusual bit rate; a silent device; a lone device, whose frames no node acknowledges.
    let mut unusual = Wire::at(83_333);
    let mut silent = Wire { heartbeat: false, ..Wire::at(125_000) };
    let mut alone = Wire { third_node: false, ..Wire::at(125_000) };
    for (wire, errors) in [(&mut unusual, true), (&mut silent, false), (&mut alone, true)] {
        let found = run(wire, false).unwrap();
        assert_eq!((found.found, found.tried.len()), (None, RATES.len()));
        assert_eq!(found.tried.iter().any(|tried| tried.errors > 0), errors);
        assert_eq!(wire.log.last().map(String::as_str), Some("back"));
    }
}

#[test]
fn lone_device_is_asked_after_listening() {
    let mut wire = Wire { third_node: false, heartbeat: false, ..Wire::at(125_000) };
    let found = run(&mut wire, true).unwrap();
    assert_eq!(found.found, Some((125_000, Evidence::Frames)));
    let how: Vec<Method> = found.tried.iter().map(|tried| tried.how).collect();
    assert_eq!(how[..RATES.len()], [Method::Listening; RATES.len()]);
    assert!(how[RATES.len()..].iter().all(|&how| how == Method::Asking));
    assert!(wire.sent.iter().all(|(_, frame)| frame.to_string().ends_with("#4000100000000000")));
    assert_eq!(wire.log.last().map(String::as_str), Some("back"));
}

#[test]
fn acknowledge_alone_is_evidence() {
    let mut wire = Wire { third_node: false, heartbeat: false, answers: false, ..Wire::at(100_000) };
    assert_eq!(run(&mut wire, true).unwrap().found, Some((100_000, Evidence::Acknowledge)));
}

#[test]
fn device_that_sends_is_not_asked() {
    let mut wire = Wire::at(10_000);
    assert_eq!(run(&mut wire, true).unwrap().found, Some((10_000, Evidence::Frames)));
    assert!(wire.sent.is_empty());
}

#[test]
fn unsupported_bit_rates_and_modes() {
    let mut wire = Wire { impossible: Some(500_000), ..Wire::at(100_000) };
    let found = run(&mut wire, false).unwrap();
    assert_eq!(found.found, Some((100_000, Evidence::Frames)));
    assert_eq!(found.tried[0].impossible.as_deref(), Some("no"));

    let mut no_listen_only = Wire { listens: false, ..Wire::at(100_000) };
    let failure = run(&mut no_listen_only, false).unwrap_err();
    let action = HostAction::Detect { interface: "can9".into() };
    let expected = HostFailure::Unsupported { reason: "can9 has no listen-only mode".into(), action };
    assert!(matches!(&failure.cause, Cause::Host(cause) if *cause == expected), "{failure:?}");
    assert_eq!(no_listen_only.log, ["back"]);
    assert_eq!(run(&mut no_listen_only, true).unwrap().found, Some((100_000, Evidence::Frames)));
}

#[test]
fn missing_permission_changes_nothing() {
    let refusal: fn() -> BusError = || BusError::Permission("set the bit rate of can9".into());
    let mut wire = Wire { refusal: Some(refusal), ..Wire::at(100_000) };
    let failure = run(&mut wire, true).unwrap_err();
    let action = HostAction::Detect { interface: "can9".into() };
    let expected = HostFailure::NotPermitted { what: "set the bit rate of can9".into(), action };
    assert!(matches!(&failure.cause, Cause::Host(cause) if *cause == expected), "{failure:?}");
    assert!(wire.log.is_empty());
}

#[test]
fn interface_is_restored_after_ctrl_c_at_any_time() {
    // Listening takes 13.5 s, and the requests take another 13.5 s.
    for millis in (0..27_000).step_by(1900) {
        let mut wire = Wire { heartbeat: false, answers: false, ..Wire::at(83_333) };
        wire.interrupt = Some(Mono::at(Duration::from_millis(millis)));
        assert_eq!(run(&mut wire, true).unwrap_err().kind(), Kind::Interrupted, "{millis} ms");
        assert_eq!(wire.log.last().map(String::as_str), Some("back"));
        assert_eq!(wire.log.iter().filter(|line| *line == "back").count(), 1);
    }
}
