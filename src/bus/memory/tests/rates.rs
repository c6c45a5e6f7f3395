//! Tests of bit rates: the frames and errors that each station receives.

use super::*;
use crate::bus::{BitRateControl, Fault, Mode};

fn seconds(seconds: u64) -> Mono {
    Mono::at(Duration::from_secs(seconds))
}

/// A script with its own bit rate.
struct Tuned {
    script: Script,
    tuning: Tuning,
    bus_rates: Vec<u32>,
}

impl Station for Tuned {
    fn power_on(&mut self, now: Mono, out: &mut Outbox) {
        self.script.power_on(now, out);
    }

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        self.script.receive(now, frame, out);
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        self.script.wake(now, out);
    }

    fn next_wake(&self) -> Option<Mono> {
        self.script.next_wake()
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.script.sent(now, frame);
    }

    fn tuning(&self) -> Tuning {
        self.tuning
    }

    fn on_bus_bit_rate(&mut self, bit_rate: u32) {
        self.bus_rates.push(bit_rate);
    }
}

fn tuned(tuning: Tuning, frames: &[(u64, &str)]) -> Tuned {
    Tuned { script: script(frames), tuning, bus_rates: Vec::new() }
}

fn bus(stations: impl IntoIterator<Item = Tuned>) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual);
    stations.into_iter().for_each(|station| bus.attach(station));
    bus
}

/// Receives frames and faults up to `until`, and counts equal ones in succession.
fn events_until(bus: &mut MemoryBus, until: Mono) -> Vec<(String, u32)> {
    let mut seen: Vec<(String, u32)> = Vec::new();
    loop {
        let text = match bus.receive(until).expect("a memory bus never fails") {
            Event::Frame(received) => received.frame.to_string(),
            Event::Fault(fault, _) => format!("{fault:?}"),
            Event::Timeout => return seen,
            other => panic!("{other:?}"),
        };
        match seen.last_mut() {
            Some((last, times)) if *last == text => *times += 1,
            _ => seen.push((text, 1)),
        }
    }
}

fn received(bus: &MemoryBus, index: usize) -> usize {
    bus.stations::<Tuned>().nth(index).map_or(0, |station| station.script.received.len())
}

fn counted(text: &str, times: u32) -> (String, u32) {
    (text.to_owned(), times)
}

#[test]
fn without_a_receiver_no_frame_is_acknowledged() {
    // No station at all, and a station without power.
    for stations in [vec![], vec![tuned(Tuning::Off, &[(10, "701#00")])]] {
        let mut bus = bus(stations);
        bus.send(&frame("080#")).expect("room");
        let events = events_until(&mut bus, us(100_000));
        assert_eq!(
            events[..4],
            [
                counted("NoAcknowledge", 12),
                counted("ErrorWarning", 1),
                counted("NoAcknowledge", 4),
                counted("ErrorPassive", 1)
            ]
        );
        // The retries continue, but the state does not get worse.
        assert_eq!(events.len(), 5);
        assert_eq!(events[4].0, "NoAcknowledge");
        (0..QUEUE_LENGTH).for_each(|_| _ = bus.send(&frame("080#")));
        assert!(matches!(bus.send(&frame("080#")), Err(BusError::QueueFull)));
        // As soon as a station acknowledges, all frames are sent.
        bus.attach(tuned(Tuning::At(BIT_RATE), &[]));
        events_until(&mut bus, seconds(1));
        assert_eq!(received(&bus, bus.stations::<Tuned>().count() - 1), QUEUE_LENGTH);
    }
}

#[test]
fn a_device_at_a_different_bit_rate_receives_nothing_and_makes_the_program_bus_off() {
    let mut bus = bus([tuned(Tuning::At(125_000), &[])]);
    bus.send(&frame("080#")).expect("room");
    let events = events_until(&mut bus, seconds(1));
    assert_eq!(
        events,
        [
            counted("Protocol", 12),
            counted("ErrorWarning", 1),
            counted("Protocol", 4),
            counted("ErrorPassive", 1),
            counted("Protocol", 16),
            counted("BusOff", 1)
        ]
    );
    assert_eq!(received(&bus, 0), 0);
    // Bus-off lasts until the interface is set up again. The other stations have no influence.
    bus.attach(tuned(Tuning::At(BIT_RATE), &[(2_000_000, "701#00")]));
    assert_eq!(events_until(&mut bus, seconds(3)), []);
    bus.stations_mut::<Tuned>().skip(1).for_each(|station| station.tuning = Tuning::Off);
    bus.set_bit_rate(125_000, Mode::Normal).expect("allowed");
    bus.send(&frame("081#")).expect("room");
    events_until(&mut bus, seconds(4));
    assert_eq!((received(&bus, 0), bus.bit_rate()), (1, Some(125_000)));
    assert_eq!(bus.stations::<Tuned>().next().map(|station| station.bus_rates.clone()), Some(vec![250_000, 125_000]));
}

#[test]
fn frames_of_a_device_at_a_different_bit_rate_are_errors_for_the_others() {
    let mut bus =
        bus([tuned(Tuning::At(125_000), &[(0, "701#00")]), tuned(Tuning::At(BIT_RATE), &[(1_000_000, "702#00")])]);
    let events = events_until(&mut bus, us(900_000));
    assert_eq!(events, [counted("Protocol", 32)], "until the one that is alone with its rate is bus-off");
    assert_eq!(received(&bus, 1), 0);
    // Frames of the other station do not arrive.
    assert_eq!(events_until(&mut bus, seconds(2)), [counted("Protocol", 32)]);
    // After 128 errors a station is error-passive and no longer disturbs the frames of the others.
    for round in 0..4 {
        bus.set_bit_rate(BIT_RATE, Mode::Normal).expect("allowed");
        bus.send(&frame("080#")).expect("room");
        let until = bus.now().mono + Duration::from_secs(1);
        let is_off = events_until(&mut bus, until).contains(&counted("BusOff", 1));
        assert_eq!((is_off, received(&bus, 1)), (round < 3, usize::from(round == 3)), "round {round}");
    }
}

#[test]
fn stations_at_one_bit_rate_communicate_and_listen_only_disturbs_none() {
    let mut bus = bus([
        tuned(Tuning::At(125_000), &[(0, "701#00"), (500_000, "702#00"), (1_500_000, "703#00")]),
        tuned(Tuning::At(125_000), &[]),
    ]);
    bus.set_bit_rate(500_000, Mode::ListenOnly).expect("allowed");
    assert!(matches!(bus.send(&frame("080#")), Err(BusError::ReceiveOnly(_))));
    assert_eq!(events_until(&mut bus, us(400_000)), [counted("Protocol", 1)]);
    assert_eq!(received(&bus, 1), 1);
    bus.set_bit_rate(125_000, Mode::ListenOnly).expect("allowed");
    assert_eq!(events_until(&mut bus, seconds(1)), [counted("702#00", 1)]);
    // A station at the wrong rate that is not listen-only disturbs the frames.
    bus.set_bit_rate(500_000, Mode::Normal).expect("allowed");
    assert_eq!(events_until(&mut bus, seconds(2)), [counted("Protocol", 32)]);
}

#[test]
fn listen_only_receives_no_valid_frame_of_a_single_sender() {
    let mut bus = bus([tuned(Tuning::At(125_000), &[(0, "701#00")])]);
    bus.set_bit_rate(125_000, Mode::ListenOnly).expect("allowed");
    let events = events_until(&mut bus, us(100_000));
    assert!(events.iter().all(|(text, _)| text != "701#00") && events[0].0 == "Protocol", "{events:?}");
    // The sender still retries; a station that acknowledges receives the frame.
    bus.set_bit_rate(125_000, Mode::Normal).expect("allowed");
    assert_eq!(events_until(&mut bus, seconds(1)), [counted("701#00", 1)]);
}

#[test]
fn stations_that_follow_the_bit_rate_receive_all_frames() {
    let mut bus = bus([tuned(Tuning::Follows, &[(500_000, "701#00")]), tuned(Tuning::At(125_000), &[])]);
    bus.set_bit_rate(125_000, Mode::Normal).expect("allowed");
    bus.send(&frame("080#")).expect("room");
    assert_eq!(events_until(&mut bus, seconds(1)), [counted("701#00", 1)]);
    assert_eq!((received(&bus, 0), received(&bus, 1)), (1, 2));
}

#[test]
fn simultaneous_frames_merge_if_equal_and_collide_if_not() {
    let mut bus = bus([
        tuned(Tuning::Follows, &[(0, "7E4#44"), (1000, "585#01"), (500_000, "181#")]),
        tuned(Tuning::Follows, &[(0, "7E4#44"), (1000, "585#02")]),
    ]);
    let events = events_until(&mut bus, us(400_000));
    let frames: Vec<&(String, u32)> = events.iter().filter(|(text, _)| text.contains('#')).collect();
    assert_eq!(frames, [&counted("7E4#44", 1), &counted("585#01", 1), &counted("585#02", 1)], "{events:?}");
    assert_eq!(events[1], counted("Protocol", 16), "as long as both are error-active");
    let sent = bus.stations::<Tuned>().map(|station| station.script.sent.len());
    assert_eq!(sent.collect::<Vec<_>>(), [2, 2]);
}

#[test]
fn setting_the_bit_rate_can_be_forbidden() {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate_changes(false);
    assert!(matches!(bus.can_set_bit_rate(), Err(BusError::Permission(_))));
    assert!(matches!(bus.set_bit_rate(125_000, Mode::Normal), Err(BusError::Permission(_))));
    assert_eq!(bus.bit_rate(), Some(BIT_RATE));
    assert_eq!(Fault::NoAcknowledge.to_string(), "no acknowledgement: no other node at this bit rate");
}
