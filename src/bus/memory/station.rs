//! What can be on a bus beside the program: a station, which is driven by frames and time.

use crate::bus::time::Mono;
use crate::canopen::frame::Frame;
use std::any::Any;
use std::collections::VecDeque;

/// A participant on a bus that is driven by frames and time: a simulated device.
///
/// It never waits and has no clock: whoever runs it says when it is. `Any`, so that a test can look into a
/// station that it has handed over.
pub trait Station: Any + Send {
    /// Power comes on at `now`.
    fn power_on(&mut self, now: Mono, out: &mut Outbox);

    /// A frame of another participant has just been received.
    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox);

    /// The moment asked for by [`Station::next_wake`] has come.
    fn wake(&mut self, now: Mono, out: &mut Outbox);

    /// When the station wants to be woken next, if nothing else happens before. After [`Station::wake`] at
    /// `now` this must be later than `now`, or time would stand still. It changes only in the other functions of
    /// this trait, and while the station is lent by [`super::MemoryBus::stations_mut`].
    fn next_wake(&self) -> Option<Mono>;

    /// A frame from this station's outbox has left it and is complete on the wire.
    fn sent(&mut self, now: Mono, frame: &Frame);

    /// At which bit rate it takes part.
    fn tuning(&self) -> Tuning {
        Tuning::Follows
    }

    /// The bit rate of the bus, in bit/s: before [`Station::power_on`], and whenever the program changes it.
    fn told_bit_rate(&mut self, _bit_rate: u32) {}
}

/// At which bit rate a station takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tuning {
    /// Whatever rate the others have.
    Follows,
    /// This one, in bit/s.
    At(u32),
    /// It takes no part: no power, or its controller is off.
    Off,
}

/// Frames that a station wants to send, in order.
#[derive(Debug, Default)]
pub struct Outbox {
    frames: VecDeque<Frame>,
}

impl Outbox {
    /// Puts a frame behind those already waiting.
    pub fn send(&mut self, frame: Frame) {
        self.frames.push_back(frame);
    }

    /// Puts back a frame that has to be sent again.
    pub(super) fn put_back(&mut self, frame: Frame) {
        self.frames.push_front(frame);
    }

    /// The next frame to send, left in place.
    pub fn front(&self) -> Option<&Frame> {
        self.frames.front()
    }

    /// Takes the next frame.
    pub fn pop(&mut self) -> Option<Frame> {
        self.frames.pop_front()
    }

    /// Forgets the waiting frames that `keep` does not want.
    pub fn retain(&mut self, keep: impl FnMut(&Frame) -> bool) {
        self.frames.retain(keep);
    }

    /// Forgets every waiting frame, as a reset does.
    pub fn clear(&mut self) {
        self.frames.clear();
    }
}
