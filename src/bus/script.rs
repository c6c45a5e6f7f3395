//! A bus for the tests of the wrappers. It delivers given frames at given times, on a virtual clock.

use super::{BitRateControl, Bus, BusError, Event, Filters, Mono, Received, Stamp, TimestampSource, Wall};
use crate::canopen::frame::Frame;
use std::collections::VecDeque;
use std::time::Duration;

/// The wall time at which the scripted bus was opened.
const OPENED: Duration = Duration::from_secs(1_436_509_052);

/// Events to deliver, in order of time, and the frames that were sent.
#[derive(Default)]
pub(super) struct Script {
    now: Mono,
    pending: VecDeque<(Mono, Event)>,
    pub(super) sent: Vec<String>,
}

impl Script {
    pub(super) fn new() -> Script {
        Script::default()
    }

    /// Delivers this frame at `at`.
    pub(super) fn frame(mut self, at: Mono, text: &str) -> Script {
        let frame = text.parse().unwrap();
        self.pending.push_back((at, Event::Frame(Received { frame, at: stamp(at) })));
        self
    }
}

fn stamp(mono: Mono) -> Stamp {
    Stamp { mono, wall: Wall::at(OPENED) + mono.since_start() }
}

impl BitRateControl for Script {}

impl Bus for Script {
    fn name(&self) -> &str {
        "script"
    }

    fn timestamps(&self) -> TimestampSource {
        TimestampSource::Simulated
    }

    fn now(&self) -> Stamp {
        stamp(self.now)
    }

    fn listen(&mut self, _: &Filters) -> Result<(), BusError> {
        Ok(())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.sent.push(frame.to_string());
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        match self.pending.front() {
            Some((at, _)) if *at <= deadline => {
                self.now = self.now.max(*at);
                Ok(self.pending.pop_front().unwrap().1)
            }
            _ => {
                self.now = self.now.max(deadline);
                Ok(Event::Timeout)
            }
        }
    }
}
