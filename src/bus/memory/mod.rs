//! A simulated CAN bus inside the process, with arbitration and bit rates. The clock is real for interactive use, or
//! virtual for tests. The simulated devices are stations on the bus.

mod clock;
mod controller;
mod station;
mod wire;

use super::time::{Mono, Stamp};
use super::{BitRateControl, Bus, BusError, Event, Filters, Mode, TimestampSource};
use crate::canopen::frame::Frame;
use crate::canopen::wire_length::{INTERMISSION, bit_time};
use clock::TimeLine;
pub use clock::{Clock, Sleeper, Uninterrupted, VIRTUAL_EPOCH};
use controller::Controller;
pub use station::{Outbox, Station, Tuning};
use std::any::Any;
use std::collections::{BTreeSet, VecDeque};
use wire::{Sender, Wire};

/// The length of the transmit queue of the program, the default `txqueuelen` of a Linux CAN interface. If it is full,
/// [`Bus::send`] returns [`BusError::QueueFull`].
pub const QUEUE_LENGTH: usize = 10;

/// The default bit rate in bit/s.
pub const BIT_RATE: u32 = 250_000;

/// A simulated CAN bus, and the connection of the program to it.
///
/// The program is one station. As on SocketCAN, it receives the frames of other stations, but not its own. All events
/// are processed in [`Bus::receive`] and [`Bus::send`]; there is no thread. With the real clock, events that became due
/// between two calls are processed in the next call, each with its own time.
///
/// Each station has a bit rate. A frame is delivered if a station with the same bit rate acknowledges it and no station
/// destroys it. A station at a different bit rate receives only errors, and destroys frames until it is error-passive.
/// If two frames with the same identifier start together, equal frames merge, and different frames destroy each other.
/// A failed frame is sent again. The program receives all errors on the bus and the states of its controller as events.
/// Only [`BitRateControl::set_bit_rate`] ends bus-off.
pub struct MemoryBus {
    name: String,
    bit_rate: u32,
    mode: Mode,
    /// The bit rate and mode from before the program changed them.
    original_rate: Option<(u32, Mode)>,
    /// Whether the program may change the bit rate.
    can_retime: bool,
    queue_length: usize,
    time_line: TimeLine,
    /// The time up to which the bus was simulated.
    now: Mono,
    places: Vec<Place>,
    queue: VecDeque<Frame>,
    controller: Controller,
    inbox: VecDeque<Event>,
    filters: Filters,
    wire: Wire,
    /// The bit rate of the last delivered frame, used by stations with [`Tuning::Follows`].
    heard_rate: u32,
    interrupts: BTreeSet<Mono>,
    sleeper: Box<dyn Sleeper>,
}

/// A station and its waiting frames.
struct Place {
    station: Box<dyn Station>,
    out: Outbox,
    controller: Controller,
    /// The result of [`Station::next_wake`], or an earlier moment. Updated after each call of the station, because
    /// asking 127 stations at every step would be slow.
    next_wake: Option<Mono>,
}

impl Place {
    fn update(&mut self) {
        self.next_wake = self.station.next_wake();
    }

    fn is_due(&self, moment: Mono) -> bool {
        self.next_wake.is_some_and(|due| due <= moment)
    }
}

impl MemoryBus {
    /// Creates a bus without stations, with this clock.
    pub fn new(clock: Clock) -> MemoryBus {
        MemoryBus {
            name: "sim".to_owned(),
            bit_rate: BIT_RATE,
            mode: Mode::Normal,
            original_rate: None,
            can_retime: true,
            queue_length: QUEUE_LENGTH,
            time_line: TimeLine::open(clock),
            now: Mono::START,
            places: Vec::new(),
            queue: VecDeque::new(),
            controller: Controller::default(),
            inbox: VecDeque::new(),
            filters: Filters::All,
            wire: Wire::Free(Mono::START),
            heard_rate: BIT_RATE,
            interrupts: BTreeSet::new(),
            sleeper: Box::new(Uninterrupted),
        }
    }

    /// Sets the bit rate, in bit/s.
    pub fn with_bit_rate(mut self, bit_rate: u32) -> MemoryBus {
        self.bit_rate = bit_rate.max(1);
        self.heard_rate = self.bit_rate;
        self
    }

    /// Sets whether the program may change the bit rate.
    pub fn with_bit_rate_changes(mut self, allowed: bool) -> MemoryBus {
        self.can_retime = allowed;
        self
    }

    /// Sets the length of the transmit queue of the program, in frames.
    pub fn with_queue_length(mut self, length: usize) -> MemoryBus {
        self.queue_length = length;
        self
    }

    /// Sets how to wait on the real clock, so that the user can interrupt.
    pub fn with_sleeper(mut self, sleeper: Box<dyn Sleeper>) -> MemoryBus {
        self.sleeper = sleeper;
        self
    }

    /// Connects a station and switches its power on.
    pub fn attach(&mut self, station: impl Station) {
        let (out, controller) = (Outbox::default(), Controller::default());
        let mut place = Place { station: Box::new(station), out, controller, next_wake: None };
        place.station.on_bus_bit_rate(self.bit_rate);
        place.station.power_on(self.now, &mut place.out);
        place.update();
        self.places.push(place);
    }

    /// Switches the power of all stations off and on.
    pub fn power_cycle(&mut self) {
        for place in &mut self.places {
            place.out.clear();
            place.controller = Controller::default();
            place.station.power_on(self.now, &mut place.out);
            place.update();
        }
    }

    /// The stations of type `S`, in the order of attachment.
    pub fn stations<S: Station>(&self) -> impl Iterator<Item = &S> {
        self.places.iter().filter_map(|place| {
            let station: &dyn Any = &*place.station;
            station.downcast_ref()
        })
    }

    /// The stations of type `S`, mutable.
    pub fn stations_mut<S: Station>(&mut self) -> impl Iterator<Item = &mut S> {
        self.places.iter_mut().filter_map(|place| {
            // The caller may change the next wake time.
            place.next_wake = Some(Mono::START);
            let station: &mut dyn Any = &mut *place.station;
            station.downcast_mut()
        })
    }

    /// Simulates an interrupt by the user at `moment`: [`Event::Interrupted`], once.
    pub fn interrupt_at(&mut self, moment: Mono) {
        self.interrupts.insert(moment);
    }

    /// Returns the time of the next event, or the present time if the event is overdue.
    fn next_event_time(&self) -> Option<Mono> {
        let wire = match &self.wire {
            Wire::Busy(transmission) => Some(transmission.complete),
            Wire::Free(from) => self.contenders().map(|(ready, ..)| ready.max(*from)).min(),
        };
        let mut next = Mono::earlier(wire, self.interrupts.first().copied());
        for place in &self.places {
            next = Mono::earlier(next, place.next_wake);
        }
        next.map(|moment| moment.max(self.now))
    }

    /// Processes the next event if it happens no later than `limit`. Returns `false` if there was no such event: then
    /// the time does not advance.
    fn step(&mut self, limit: Mono) -> bool {
        let Some(moment) = self.next_event_time().filter(|moment| *moment <= limit) else { return false };
        self.now = moment;
        if self.interrupts.first().is_some_and(|due| *due <= moment) {
            self.interrupts.pop_first();
            self.inbox.push_back(Event::Interrupted);
            return true;
        }
        // A complete frame is delivered before stations wake. All stations that wake at the same moment take part in
        // the next arbitration.
        if let Wire::Busy(transmission) = &self.wire
            && transmission.complete <= moment
        {
            let free = Wire::Free(moment + bit_time(INTERMISSION, transmission.bit_rate));
            if let Wire::Busy(transmission) = std::mem::replace(&mut self.wire, free) {
                self.conclude(&transmission);
            }
            return true;
        }
        let mut any_due = false;
        for place in self.places.iter_mut().filter(|place| place.is_due(moment)) {
            any_due = true;
            place.update();
            if place.is_due(moment) {
                place.station.wake(moment, &mut place.out);
                place.update();
            }
        }
        if !any_due {
            self.begin();
        }
        true
    }

    /// On the real clock, processes all events that are due. Returns the time of the host.
    fn catch_up(&mut self) -> Option<Mono> {
        let host_now = self.time_line.host_now()?;
        while self.step(host_now) {}
        self.now = self.now.max(host_now);
        Some(host_now)
    }

    fn stamp(&self, mono: Mono) -> Stamp {
        Stamp { mono, wall: self.time_line.wall(mono) }
    }
}

impl BitRateControl for MemoryBus {
    fn bit_rate(&self) -> Option<u32> {
        Some(self.bit_rate)
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        let what = || format!("change the bit rate of {}", self.name);
        if self.can_retime { Ok(()) } else { Err(BusError::Permission(what())) }
    }

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        self.can_set_bit_rate()?;
        self.catch_up();
        self.original_rate.get_or_insert((self.bit_rate, self.mode));
        self.queue.clear();
        self.inbox.retain(|event| *event == Event::Interrupted);
        if let Wire::Busy(transmission) = &mut self.wire {
            transmission.senders.retain(|(sender, _)| *sender != Sender::Program);
            if transmission.senders.is_empty() {
                self.wire = Wire::Free(self.now);
            }
        }
        self.controller = Controller::default();
        self.bit_rate = bit_rate.max(1);
        self.mode = mode;
        for place in &mut self.places {
            place.station.on_bus_bit_rate(bit_rate);
            place.update();
        }
        Ok(())
    }

    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        let Some((bit_rate, mode)) = self.original_rate else { return Ok(()) };
        self.set_bit_rate(bit_rate, mode)?;
        self.original_rate = None;
        Ok(())
    }
}

impl Bus for MemoryBus {
    fn name(&self) -> &str {
        &self.name
    }

    fn timestamps(&self) -> TimestampSource {
        TimestampSource::Simulated
    }

    fn waits(&self) -> bool {
        self.time_line.host_now().is_none()
    }

    fn now(&self) -> Stamp {
        self.stamp(self.time_line.host_now().unwrap_or(self.now).max(self.now))
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        // The old filters still apply to frames that are already complete.
        self.catch_up();
        self.filters = filters.clone();
        Ok(())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        if self.mode == Mode::ListenOnly {
            return Err(BusError::ReceiveOnly(self.name.clone()));
        }
        self.catch_up();
        if self.queue.len() >= self.queue_length {
            return Err(BusError::QueueFull);
        }
        self.queue.push_back(*frame);
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        if self.sleeper.sleep(std::time::Duration::ZERO) {
            return Ok(Event::Interrupted);
        }
        loop {
            let host_now = self.catch_up();
            if let Some(event) = self.inbox.pop_front() {
                return Ok(event);
            }
            let next = self.next_event_time().filter(|moment| *moment <= deadline);
            match (host_now, next) {
                (None, Some(_)) => {
                    self.step(deadline);
                }
                (None, None) => {
                    self.now = self.now.max(deadline);
                    return Ok(Event::Timeout);
                }
                (Some(host_now), next) => {
                    if host_now >= deadline {
                        return Ok(Event::Timeout);
                    }
                    if self.sleeper.sleep(next.unwrap_or(deadline).since(host_now)) {
                        return Ok(Event::Interrupted);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
