//! A wrapper around any bus that goes wrong on purpose, for tests.

use super::{Bus, BusError, Event, Filters, Mode, Mono, ReceiveBuffer, Received, Stamp, TimestampSource};
use crate::canopen::frame::Frame;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// What is to go wrong. Frames are counted from 0, each direction for itself.
#[derive(Clone, Debug, Default)]
pub struct FaultPlan {
    /// Calls of `send` that meet a full transmit queue.
    pub queue_full: BTreeSet<u64>,
    /// Sent frames that never reach the wire although the bus took them.
    pub lose_sent: BTreeSet<u64>,
    /// Received frames that are lost.
    pub lose: BTreeSet<u64>,
    /// Received frames that arrive twice.
    pub duplicate: BTreeSet<u64>,
    /// Received frames that arrive later, behind those that came in the meantime.
    pub delay: BTreeMap<u64, Duration>,
}

/// A bus that follows a [`FaultPlan`].
pub struct Faulty<B> {
    bus: B,
    plan: FaultPlan,
    sends: u64,
    received: u64,
    /// Frames held back, by the moment they are due; those due at once come first.
    held: VecDeque<Received>,
}

impl<B: Bus> Faulty<B> {
    /// Lets `plan` happen to `bus`.
    pub fn new(bus: B, plan: FaultPlan) -> Faulty<B> {
        Faulty { bus, plan, sends: 0, received: 0, held: VecDeque::new() }
    }

    /// The bus inside.
    pub fn inner(&self) -> &B {
        &self.bus
    }

    fn hold(&mut self, received: Received) {
        let place = self.held.partition_point(|other| other.at.mono <= received.at.mono);
        self.held.insert(place, received);
    }

    /// Notes a received frame; what the plan leaves of it is held until it is due.
    fn take_in(&mut self, mut received: Received) {
        let number = self.received;
        self.received += 1;
        if self.plan.lose.contains(&number) {
            return;
        }
        if let Some(&by) = self.plan.delay.get(&number) {
            received.at.mono = received.at.mono + by;
            received.at.wall = super::Wall::at(received.at.wall.since_epoch() + by);
        }
        if self.plan.duplicate.contains(&number) {
            self.hold(received);
        }
        self.hold(received);
    }
}

impl<B: Bus> Bus for Faulty<B> {
    fn name(&self) -> &str {
        self.bus.name()
    }

    fn bit_rate(&self) -> Option<u32> {
        self.bus.bit_rate()
    }

    fn timestamps(&self) -> TimestampSource {
        self.bus.timestamps()
    }

    fn is_live(&self) -> bool {
        self.bus.is_live()
    }

    fn waits(&self) -> bool {
        self.bus.waits()
    }

    fn receive_buffer(&self) -> Option<ReceiveBuffer> {
        self.bus.receive_buffer()
    }

    fn late_drops(&mut self) -> u32 {
        self.bus.late_drops()
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        self.bus.can_set_bit_rate()
    }

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        self.bus.set_bit_rate(bit_rate, mode)
    }

    fn put_back_bit_rate(&mut self) -> Result<(), BusError> {
        self.bus.put_back_bit_rate()
    }

    fn now(&self) -> Stamp {
        self.bus.now()
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        self.bus.listen(filters)
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let number = self.sends;
        self.sends += 1;
        if self.plan.queue_full.contains(&number) {
            return Err(BusError::QueueFull);
        }
        if self.plan.lose_sent.contains(&number) {
            return Ok(());
        }
        self.bus.send(frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            let due = self.held.front().map(|first| first.at.mono);
            let now = self.bus.now().mono;
            if let Some(due) = due
                && due <= now
                && let Some(first) = self.held.pop_front()
            {
                return Ok(Event::Frame(first));
            }
            let until = due.map_or(deadline, |due| due.min(deadline));
            match self.bus.receive(until)? {
                Event::Frame(received) => self.take_in(received),
                Event::Timeout if until < deadline => {}
                event => return Ok(event),
            }
        }
    }

    fn finish(&mut self) -> Result<(), BusError> {
        self.bus.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::script::Script;
    use crate::canopen::id::CanId;

    fn at(millis: u64) -> Mono {
        Mono::at(Duration::from_millis(millis))
    }

    fn heard(bus: &mut dyn Bus, until: Mono) -> Result<Vec<(Mono, String)>, BusError> {
        let mut frames = Vec::new();
        while let Event::Frame(Received { frame, at }) = bus.receive(until)? {
            assert_eq!(bus.now().mono, at.mono);
            frames.push((at.mono, frame.to_string()));
        }
        Ok(frames)
    }

    #[test]
    fn received_frames_are_lost_doubled_and_late() -> Result<(), BusError> {
        let script = (0..5u32)
            .fold(Script::new(), |script, n| script.frame(at(10 * u64::from(n)), &format!("{:03X}#", 0x181 + n)));
        let plan = FaultPlan {
            lose: [0].into(),
            duplicate: [1].into(),
            delay: [(2, Duration::from_millis(15)), (4, Duration::from_millis(100))].into(),
            ..FaultPlan::default()
        };
        let mut bus = Faulty::new(script, plan);
        let expected = [(10, "182#"), (10, "182#"), (30, "184#"), (35, "183#")];
        assert_eq!(heard(&mut bus, at(100))?, expected.map(|(ms, text)| (at(ms), text.to_owned())));
        assert_eq!(bus.now().mono, at(100));
        assert_eq!(heard(&mut bus, at(200))?, [(at(140), "185#".to_owned())]);
        Ok(())
    }

    #[test]
    fn a_full_queue_sends_nothing() -> Result<(), BusError> {
        let plan = FaultPlan { queue_full: [0, 2].into(), lose_sent: [3].into(), ..FaultPlan::default() };
        let mut bus = Faulty::new(Script::new(), plan);
        let outcome: Vec<bool> = (0..5u8).map(|n| bus.send(&Frame::byte(CanId::NMT, n)).is_ok()).collect();
        assert_eq!(outcome, [false, true, false, true, true]);
        assert_eq!(bus.inner().sent, ["000#01", "000#04"]);
        Ok(())
    }
}
