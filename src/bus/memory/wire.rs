//! The bus line: arbitration, acknowledgement, errors, bit rates.

use super::controller::{Controller, Level, Outcome, PASSIVE_PAUSE};
use super::station::Tuning;
use super::{MemoryBus, Place};
use crate::bus::time::Mono;
use crate::bus::{Event, Fault, Mode, Received};
use crate::canopen::frame::Frame;
use crate::canopen::wire_length::{bit_time, frame_bits, priority};

/// The sender of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sender {
    Program,
    Station(usize),
}

/// The state of the bus line.
pub(super) enum Wire {
    /// Idle. From this moment on (end of intermission) a station may start to send.
    Free(Mono),
    Busy(Transmission),
}

/// A frame on the bus, or several colliding frames.
pub(super) struct Transmission {
    /// The senders and their frames. The frames are equal unless they collide.
    pub(super) senders: Vec<(Sender, Frame)>,
    pub(super) bit_rate: u32,
    pub(super) complete: Mono,
}

impl Transmission {
    /// Whether two senders send different frames.
    fn collides(&self) -> bool {
        self.senders.windows(2).any(|pair| pair[0].1 != pair[1].1)
    }

    fn has(&self, sender: Sender) -> bool {
        self.senders.iter().any(|(one, _)| *one == sender)
    }
}

impl MemoryBus {
    /// Returns the earliest start, the sender and the frame for each sender that has a frame to send.
    pub(super) fn contenders(&self) -> impl Iterator<Item = (Mono, Sender, Frame)> {
        let ready = |controller: &Controller| controller.waits_until.unwrap_or(Mono::START);
        let cannot_send = self.mode == Mode::ListenOnly || self.controller.level() == Level::Off;
        let program = self.queue.front().filter(|_| !cannot_send);
        let program = program.map(|frame| (ready(&self.controller), Sender::Program, *frame));
        let stations = self.places.iter().enumerate().filter_map(move |(index, place)| {
            let frame = *place.out.front()?;
            let is_on = place.station.tuning() != Tuning::Off;
            is_on.then(|| (ready(&place.controller), Sender::Station(index), frame))
        });
        program.into_iter().chain(stations)
    }

    /// The bit rate of a sender in bit/s.
    fn rate_of(&self, sender: Sender) -> u32 {
        match sender {
            Sender::Program => self.bit_rate,
            Sender::Station(index) => match self.places[index].station.tuning() {
                Tuning::At(rate) => rate.max(1),
                Tuning::Follows | Tuning::Off => self.heard_rate,
            },
        }
    }

    /// Starts the frame that wins the arbitration: the lowest identifier of all queues. Stations with the same
    /// identifier and bit rate start together.
    pub(super) fn begin(&mut self) {
        let now = self.now;
        let ready: Vec<(Sender, Frame)> =
            self.contenders().filter(|(from, ..)| *from <= now).map(|(_, sender, frame)| (sender, frame)).collect();
        let Some((first, frame)) = ready.iter().min_by_key(|(_, frame)| priority(frame)).copied() else { return };
        let bit_rate = self.rate_of(first);
        let (wanted, mut senders) = (priority(&frame), ready);
        senders.retain(|(sender, frame)| priority(frame) == wanted && self.rate_of(*sender) == bit_rate);
        for (sender, _) in &senders {
            match sender {
                Sender::Program => self.queue.pop_front(),
                Sender::Station(index) => self.places[*index].out.pop(),
            };
        }
        let bits = senders.iter().map(|(_, frame)| frame_bits(frame)).max().unwrap_or_default();
        self.wire = Wire::Busy(Transmission { senders, bit_rate, complete: now + bit_time(bits, bit_rate) });
    }

    /// Ends a transmission and decides its outcome.
    pub(super) fn conclude(&mut self, transmission: &Transmission) {
        let bit_rate = transmission.bit_rate;
        let is_listening = |place: &Place| match place.station.tuning() {
            Tuning::Follows => Some(true),
            Tuning::At(rate) => Some(rate == bit_rate),
            Tuning::Off => None,
        };
        // For each station that does not send: `true` if it receives at this bit rate, `false` if it disturbs.
        let receiving: Vec<Option<bool>> = self
            .places
            .iter()
            .enumerate()
            .map(|(index, place)| is_listening(place).filter(|_| !transmission.has(Sender::Station(index))))
            .collect();
        let takes_part = self.mode == Mode::Normal && self.controller.level() < Level::Off;
        let program = (!transmission.has(Sender::Program)).then_some(self.bit_rate == bit_rate);
        let acknowledged = program == Some(true) && takes_part || receiving.contains(&Some(true));
        let disturbed = transmission.collides()
            || program == Some(false) && takes_part && self.controller.disturbs()
            || self
                .places
                .iter()
                .zip(&receiving)
                .any(|(place, receives)| *receives == Some(false) && place.controller.disturbs());
        let outcome = match (acknowledged, disturbed) {
            (_, true) => Outcome::Disturbed,
            (false, false) => Outcome::Unacknowledged,
            (true, false) => Outcome::Delivered,
        };
        let before = self.controller.level();
        match program {
            Some(true) if outcome == Outcome::Delivered => self.controller.received(true),
            Some(_) if before < Level::Off => self.program_error(Fault::Protocol, |one| one.received(false)),
            None if outcome == Outcome::Unacknowledged => {
                self.program_error(Fault::NoAcknowledge, |one| one.transmitted(outcome));
            }
            None if outcome == Outcome::Disturbed => {
                self.program_error(Fault::Protocol, |one| one.transmitted(outcome));
            }
            Some(_) => {}
            None => self.controller.transmitted(outcome),
        }
        let after = self.controller.level();
        if after != before {
            self.inbox.push_back(Event::Fault(after.fault(), self.stamp(self.now)));
        }
        for (place, receives) in self.places.iter_mut().zip(&receiving) {
            if let Some(receives) = receives {
                place.controller.received(*receives && outcome == Outcome::Delivered);
            }
        }
        if outcome == Outcome::Delivered {
            self.heard_rate = bit_rate;
            self.deliver(transmission, &receiving);
        } else {
            self.requeue(transmission, outcome);
        }
    }

    /// Reports an error of the program's controller and counts it.
    fn program_error(&mut self, fault: Fault, count: impl FnOnce(&mut Controller)) {
        self.inbox.push_back(Event::Fault(fault, self.stamp(self.now)));
        count(&mut self.controller);
    }

    /// Delivers the frame to all receivers and reports it as sent to its senders.
    fn deliver(&mut self, transmission: &Transmission, receiving: &[Option<bool>]) {
        let Some((_, frame)) = transmission.senders.first() else { return };
        let is_heard = transmission.bit_rate == self.bit_rate && !transmission.has(Sender::Program);
        if is_heard && self.filters.wants(frame) {
            self.inbox.push_back(Event::Frame(Received { frame: *frame, at: self.stamp(self.now) }));
        }
        for (sender, _) in &transmission.senders {
            let controller = match sender {
                Sender::Program => &mut self.controller,
                Sender::Station(index) => &mut self.places[*index].controller,
            };
            controller.waits_until = None;
        }
        for (index, (place, receives)) in self.places.iter_mut().zip(receiving).enumerate() {
            if transmission.has(Sender::Station(index)) {
                place.controller.transmitted(Outcome::Delivered);
                place.station.sent(self.now, frame);
                place.update();
            } else if *receives == Some(true) {
                place.station.receive(self.now, frame, &mut place.out);
                place.update();
            }
        }
    }

    /// Queues a failed frame again. An error-passive sender waits first. The waits differ, so that two colliding
    /// stations do not collide repeatedly. A bus-off station drops its frames.
    fn requeue(&mut self, transmission: &Transmission, outcome: Outcome) {
        for (sender, frame) in &transmission.senders {
            match *sender {
                Sender::Program => {
                    self.queue.push_front(*frame);
                    let is_passive = self.controller.level() >= Level::Passive;
                    self.controller.waits_until = is_passive.then(|| self.now + PASSIVE_PAUSE);
                }
                Sender::Station(index) => {
                    let place = &mut self.places[index];
                    place.controller.transmitted(outcome);
                    place.out.put_back(*frame);
                    let turn = u32::try_from(index + 1).unwrap_or_default();
                    match place.controller.level() {
                        Level::Active | Level::Warning => place.controller.waits_until = None,
                        Level::Passive => {
                            let pause = PASSIVE_PAUSE + PASSIVE_PAUSE / 10 * turn;
                            place.controller.waits_until = Some(self.now + pause);
                        }
                        Level::Off => {
                            place.out.clear();
                            place.controller.switch_off(self.now, transmission.bit_rate);
                        }
                    }
                }
            }
        }
    }
}
