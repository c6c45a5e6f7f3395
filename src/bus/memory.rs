//! A CAN bus inside the process: a wire with arbitration and a bit rate, a clock that is real for
//! people and virtual for tests, and stations on it. The simulated devices are such stations.

use super::time::Mono;
use crate::canopen::frame::Frame;
use std::collections::VecDeque;

/// A participant on a bus that is driven by frames and time: a simulated device.
///
/// It never waits and has no clock: the bus says when it is.
pub trait Station {
    /// Power comes on at `now`.
    fn power_on(&mut self, now: Mono, out: &mut Outbox);

    /// A frame of another participant has just been received.
    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox);

    /// The moment asked for by [`Station::next_wake`] has come.
    fn wake(&mut self, now: Mono, out: &mut Outbox);

    /// When the station wants to be woken next, if nothing else happens before.
    fn next_wake(&self) -> Option<Mono>;

    /// A frame from this station's outbox has left it and is complete on the wire.
    fn sent(&mut self, now: Mono, frame: &Frame);
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

    /// The next frame to send, left in place.
    pub fn front(&self) -> Option<&Frame> {
        self.frames.front()
    }

    /// Takes the next frame.
    pub fn pop(&mut self) -> Option<Frame> {
        self.frames.pop_front()
    }

    /// Forgets every waiting frame, as a reset does.
    pub fn clear(&mut self) {
        self.frames.clear();
    }
}
