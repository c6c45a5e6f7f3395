//! The program's end of the bus: records the frames, and ends a command that does not end by itself.

use cangauge::bus::{BitRateControl, Bus, BusError, Event, Fault, Mode, Mono};
use cangauge::canopen::frame::Frame;

/// The most calls of `receive` in one scenario.
const MOST_CALLS: u64 = 400_000;

#[derive(Clone, Copy, Debug)]
pub(crate) enum Passed {
    Sent(Frame),
    Received(Frame),
}

pub(crate) struct Tap<B> {
    pub(crate) bus: B,
    pub(crate) frames: Vec<(Mono, Passed)>,
    /// The command must have ended by then.
    pub(crate) deadline: Mono,
    pub(crate) overran: bool,
    calls: u64,
    /// The program is killed before it sends this frame, counted from 0.
    kill: Option<u64>,
    /// The frames that the bus has accepted.
    taken: u64,
    pub(crate) is_dead: bool,
    /// When the program was first interrupted.
    pub(crate) interrupted: Option<Mono>,
    /// Whether the program saw the interface down, and the controller bus-off.
    pub(crate) was_down: bool,
    pub(crate) was_off: bool,
}

impl<B: Bus> Tap<B> {
    pub(crate) fn new(bus: B, deadline: Mono, kill: Option<u64>) -> Tap<B> {
        Tap {
            bus,
            frames: Vec::new(),
            deadline,
            overran: false,
            calls: 0,
            kill,
            taken: 0,
            is_dead: false,
            interrupted: None,
            was_down: false,
            was_off: false,
        }
    }

    fn sent(&self) -> impl Iterator<Item = (Mono, Frame)> {
        self.frames.iter().filter_map(|(at, passed)| match passed {
            Passed::Sent(frame) => Some((*at, *frame)),
            Passed::Received(_) => None,
        })
    }

    /// The same bus for the second program, which is not killed.
    pub(crate) fn restarted(self, deadline: Mono) -> Tap<B> {
        Tap::new(self.bus, deadline, None)
    }

    /// An error if the program was killed: it neither sends nor receives.
    fn live(&self) -> Result<(), BusError> {
        if self.is_dead { Err(BusError::Unsupported("the program is gone".to_owned())) } else { Ok(()) }
    }

    pub(crate) fn all_sent(&self) -> Vec<(Mono, Frame)> {
        self.sent().collect()
    }
}

impl<B: Bus> BitRateControl for Tap<B> {
    cangauge::bus::delegate_bus!(self, self.bus => bit_rate can_set_bit_rate);

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        self.live()?;
        self.bus.set_bit_rate(bit_rate, mode)
    }

    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        self.live()?;
        self.bus.restore_bit_rate()
    }
}

impl<B: Bus> Bus for Tap<B> {
    cangauge::bus::delegate_bus!(self, self.bus => name timestamps is_live sends_remote_frames waits now mono listen receive_buffer
        unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.is_dead |= self.kill == Some(self.taken);
        self.live()?;
        let result = self.bus.send(frame);
        match &result {
            Ok(()) => {
                self.taken += 1;
                self.frames.push((self.bus.now().mono, Passed::Sent(*frame)));
            }
            Err(BusError::Down(_)) => self.was_down = true,
            Err(_) => {}
        }
        result
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        let now = self.bus.now().mono;
        self.calls += 1;
        if now > self.deadline || self.calls > MOST_CALLS {
            self.overran = true;
            assert!(self.calls < 2 * MOST_CALLS, "it never ends, at {now:?}");
            self.calls = self.calls.max(MOST_CALLS);
            return Err(BusError::Unsupported("the scenario is over".to_owned()));
        }
        self.live()?;
        // No wait is longer than the deadline of the scenario: nothing happens after it.
        let result = self.bus.receive(deadline.min(self.deadline + std::time::Duration::from_nanos(1)));
        match &result {
            Ok(Event::Frame(received)) => self.frames.push((received.at.mono, Passed::Received(received.frame))),
            Ok(Event::Interrupted) => self.interrupted = self.interrupted.or(Some(self.bus.now().mono)),
            Ok(Event::Link(false)) => self.was_down = true,
            Ok(Event::Fault(Fault::BusOff, _)) => self.was_off = true,
            Ok(_) | Err(_) => {}
        }
        result
    }
}
