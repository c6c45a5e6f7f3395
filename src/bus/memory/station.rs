//! A station on the simulated bus, driven by frames and time.

use crate::bus::time::Mono;
use crate::canopen::frame::Frame;
use std::any::Any;
use std::collections::VecDeque;

/// A simulated device on a bus, driven by frames and time.
///
/// A station never waits and has no clock: the caller passes the time. `Any` allows a test to inspect an attached
/// station.
pub trait Station: Any + Send {
    /// Starts the device: the power is switched on at `now`.
    fn power_on(&mut self, now: Mono, out: &mut Outbox);

    /// Handles a frame of another station, received at `now`.
    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox);

    /// Does what is due at `now`, the moment of [`Station::next_wake`].
    fn wake(&mut self, now: Mono, out: &mut Outbox);

    /// Returns when the station must be woken next. After [`Station::wake`] at `now`, this must be later than `now`;
    /// otherwise time would stop. The value may change only in the other functions of this trait, or through
    /// [`super::MemoryBus::stations_mut`].
    fn next_wake(&self) -> Option<Mono>;

    /// Handles the end of a transmission: the frame of this station was sent completely at `now`.
    fn sent(&mut self, now: Mono, frame: &Frame);

    /// The bit rate of the station.
    fn tuning(&self) -> Tuning {
        Tuning::Follows
    }

    /// Receives the bit rate of the bus in bit/s. Called before [`Station::power_on`], and when the program changes the
    /// bit rate.
    fn on_bus_bit_rate(&mut self, _bit_rate: u32) {}
}

/// The bit rate of a station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tuning {
    /// The bit rate of the other stations.
    Follows,
    /// This bit rate, in bit/s.
    At(u32),
    /// No bit rate: the station has no power, or its controller is off.
    Off,
}

/// The frames that a station has to send, in order.
#[derive(Debug, Default)]
pub struct Outbox {
    frames: VecDeque<Frame>,
}

impl Outbox {
    /// Adds a frame after the waiting frames.
    pub fn send(&mut self, frame: Frame) {
        self.frames.push_back(frame);
    }

    /// Puts a failed frame back to the front, because it must be sent again.
    pub(super) fn put_back(&mut self, frame: Frame) {
        self.frames.push_front(frame);
    }

    /// The next frame to send.
    pub fn front(&self) -> Option<&Frame> {
        self.frames.front()
    }

    /// Removes the next frame.
    pub fn pop(&mut self) -> Option<Frame> {
        self.frames.pop_front()
    }

    /// Removes the frames for which `keep` is false.
    pub fn retain(&mut self, keep: impl FnMut(&Frame) -> bool) {
        self.frames.retain(keep);
    }

    /// Removes all frames, as a reset does.
    pub fn clear(&mut self) {
        self.frames.clear();
    }
}
