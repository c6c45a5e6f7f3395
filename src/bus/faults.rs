//! A wrapper around a bus that injects faults, for tests.

use super::{BitRateControl, Bus, BusError, Event, Fault, Mono, Received, delegate_bus};
use crate::canopen::frame::Frame;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// The faults to inject. Frames are counted from 0, separately for each direction.
#[derive(Clone, Debug, Default)]
pub struct FaultPlan {
    /// Calls of `send` that find the transmit queue full.
    pub queue_full: BTreeSet<u64>,
    /// Sent frames that are lost although `send` succeeds.
    pub lose_sent: BTreeSet<u64>,
    /// Received frames that are lost.
    pub lose: BTreeSet<u64>,
    /// Received frames that arrive twice.
    pub duplicate: BTreeSet<u64>,
    /// Received frames that are delayed, so that later frames can overtake them.
    pub delay: BTreeMap<u64, Duration>,
    /// Received frames with one changed byte: its index (modulo the length) and the bits to invert.
    pub garble: BTreeMap<u64, (usize, u8)>,
    /// Received frames that are cut to this number of bytes.
    pub truncate: BTreeMap<u64, usize>,
    /// When the interface goes down, and for how long; `None`: it stays down.
    pub down: Option<(Mono, Option<Duration>)>,
    /// When no node acknowledges and the transmit queue is full, and for how long.
    pub full: Option<(Mono, Duration)>,
    /// When the controller goes bus-off. Frames sent after that wait until the queue is full.
    pub bus_off: Option<Mono>,
    /// The time after which the controller restarts and sends the waiting frames; `None`: never.
    pub restart_after: Option<Duration>,
}

/// The number of frames that can wait in a controller that is bus-off.
const BUS_OFF_QUEUE_LENGTH: usize = 10;

/// A bus that follows a [`FaultPlan`].
pub struct Faulty<B> {
    bus: B,
    plan: FaultPlan,
    sends: u64,
    received: u64,
    /// Received frames to deliver, in order of their time.
    pending: VecDeque<Received>,
    /// Whether the interface was up in the last report.
    is_up: bool,
    is_bus_off: bool,
    /// Frames that wait in a controller that is bus-off.
    waiting: VecDeque<Frame>,
}

impl<B: Bus> Faulty<B> {
    /// Injects the faults of `plan` into `bus`.
    pub fn new(bus: B, plan: FaultPlan) -> Faulty<B> {
        let (pending, waiting) = (VecDeque::new(), VecDeque::new());
        Faulty { bus, plan, sends: 0, received: 0, pending, is_up: true, is_bus_off: false, waiting }
    }

    /// The inner bus.
    pub fn inner(&self) -> &B {
        &self.bus
    }

    /// The inner bus, mutable.
    pub fn inner_mut(&mut self) -> &mut B {
        &mut self.bus
    }

    /// Whether the interface is up at `now`.
    fn is_up_at(&self, now: Mono) -> bool {
        match self.plan.down {
            Some((from, length)) => now < from || length.is_some_and(|length| now >= from + length),
            None => true,
        }
    }

    fn is_bus_off_at(&self, now: Mono) -> bool {
        self.plan.bus_off.is_some_and(|from| from <= now) && self.restart_time().is_none_or(|at| now < at)
    }

    /// Returns the time at which the bus-off controller restarts.
    fn restart_time(&self) -> Option<Mono> {
        self.plan.bus_off.zip(self.plan.restart_after).map(|(from, length)| from + length)
    }

    /// Returns the time of the next change of the interface after `now`.
    fn next_change(&self, now: Mono) -> Option<Mono> {
        let down =
            self.plan.down.into_iter().flat_map(|(from, length)| [Some(from), length.map(|length| from + length)]);
        down.flatten().chain(self.plan.bus_off).chain(self.restart_time()).filter(|moment| *moment > now).min()
    }

    /// Returns a change of the interface that was not reported yet.
    fn unreported_change(&mut self) -> Option<Event> {
        let now = self.bus.now();
        if self.is_up_at(now.mono) != self.is_up {
            self.is_up = !self.is_up;
            return Some(Event::Link(self.is_up));
        }
        if self.is_bus_off_at(now.mono) != self.is_bus_off {
            self.is_bus_off = !self.is_bus_off;
            let fault = if self.is_bus_off { Fault::BusOff } else { Fault::Restarted };
            return Some(Event::Fault(fault, now));
        }
        None
    }

    /// After a restart, sends the waiting frames until the queue of the inner bus is full.
    fn send_waiting(&mut self) -> Result<(), BusError> {
        while !self.is_bus_off_at(self.bus.now().mono)
            && let Some(frame) = self.waiting.front()
        {
            match self.bus.send(frame) {
                Err(BusError::QueueFull) => return Ok(()),
                result => result?,
            }
            self.waiting.pop_front();
        }
        Ok(())
    }

    fn add_pending(&mut self, received: Received) {
        let place = self.pending.partition_point(|other| other.at.mono <= received.at.mono);
        self.pending.insert(place, received);
    }

    /// Returns a received frame after garbling and truncation.
    fn altered(&self, number: u64, frame: Frame) -> Frame {
        let mut data = frame.data().to_vec();
        if let Some(&(index, inverted_bits)) = self.plan.garble.get(&number)
            && let Some(index) = index.checked_rem(data.len())
        {
            data[index] ^= inverted_bits;
        }
        data.truncate(self.plan.truncate.get(&number).copied().unwrap_or(usize::MAX));
        // A remote frame has no data bytes.
        if frame.is_remote() { frame } else { Frame::new(frame.id(), &data).unwrap_or(frame) }
    }

    /// Applies the plan to a received frame, and queues the result.
    fn take_in(&mut self, mut received: Received) {
        let number = self.received;
        self.received += 1;
        let now = self.bus.now().mono;
        if self.plan.lose.contains(&number) || !self.is_up_at(now) || self.is_bus_off_at(now) {
            return;
        }
        received.frame = self.altered(number, received.frame);
        if let Some(&delay) = self.plan.delay.get(&number) {
            received.at.mono = received.at.mono + delay;
            received.at.wall = received.at.wall + delay;
        }
        if self.plan.duplicate.contains(&number) {
            self.add_pending(received);
        }
        self.add_pending(received);
    }
}

impl<B: Bus> BitRateControl for Faulty<B> {
    delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl<B: Bus> Bus for Faulty<B> {
    delegate_bus!(self, self.bus => name timestamps is_live sends_remote_frames waits now mono listen receive_buffer unreported_drops finish);

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let number = self.sends;
        self.sends += 1;
        let now = self.bus.now().mono;
        if !self.is_up_at(now) {
            return Err(BusError::Down(self.bus.name().to_owned()));
        }
        self.send_waiting()?;
        if self.is_bus_off_at(now) || !self.waiting.is_empty() {
            if self.waiting.len() >= BUS_OFF_QUEUE_LENGTH {
                return Err(BusError::QueueFull);
            }
            self.waiting.push_back(*frame);
            return Ok(());
        }
        let is_full = self.plan.full.is_some_and(|(from, length)| (from..from + length).contains(&now));
        if is_full || self.plan.queue_full.contains(&number) {
            return Err(BusError::QueueFull);
        }
        if self.plan.lose_sent.contains(&number) {
            return Ok(());
        }
        self.bus.send(frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            self.send_waiting()?;
            if let Some(change) = self.unreported_change() {
                return Ok(change);
            }
            let due = self.pending.front().map(|first| first.at.mono);
            let now = self.bus.now().mono;
            if let Some(due) = due
                && due <= now
                && let Some(first) = self.pending.pop_front()
            {
                return Ok(Event::Frame(first));
            }
            let until =
                [due, self.next_change(now)].into_iter().flatten().min().map_or(deadline, |at| at.min(deadline));
            match self.bus.receive(until)? {
                Event::Frame(received) => self.take_in(received),
                Event::Timeout if until < deadline => {}
                event => return Ok(event),
            }
        }
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

    fn received(bus: &mut dyn Bus, until: Mono) -> Result<Vec<(Mono, String)>, BusError> {
        let mut frames = Vec::new();
        while let Event::Frame(Received { frame, at }) = bus.receive(until)? {
            assert_eq!(bus.now().mono, at.mono);
            frames.push((at.mono, frame.to_string()));
        }
        Ok(frames)
    }

    #[test]
    fn received_frames_are_lost_duplicated_and_delayed() -> Result<(), BusError> {
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
        assert_eq!(received(&mut bus, at(100))?, expected.map(|(ms, text)| (at(ms), text.to_owned())));
        assert_eq!(bus.now().mono, at(100));
        assert_eq!(received(&mut bus, at(200))?, [(at(140), "185#".to_owned())]);
        Ok(())
    }

    #[test]
    fn received_frames_are_garbled_and_cut_short() -> Result<(), BusError> {
        let script = (0..4u64).fold(Script::new(), |script, n| script.frame(at(10 * n), "185#0102030405"));
        let plan = FaultPlan {
            garble: [(0, (1, 0xff)), (1, (7, 0x10))].into(),
            truncate: [(2, 3), (3, 8)].into(),
            ..FaultPlan::default()
        };
        let mut bus = Faulty::new(script, plan);
        let texts: Vec<String> = received(&mut bus, at(100))?.into_iter().map(|(_, text)| text).collect();
        assert_eq!(texts, ["185#01FD030405", "185#0102130405", "185#010203", "185#0102030405"]);
        Ok(())
    }

    #[test]
    fn an_interface_goes_down_and_comes_back() -> Result<(), BusError> {
        let script = (0..4u64).fold(Script::new(), |script, n| script.frame(at(10 * n), &format!("18{n}#")));
        let down = Some((at(5), Some(Duration::from_millis(20))));
        let mut bus = Faulty::new(script, FaultPlan { down, ..FaultPlan::default() });
        let mut events = Vec::new();
        loop {
            let event = bus.receive(at(100))?;
            let may_send = bus.send(&Frame::empty(CanId::SYNC)).is_ok();
            match event {
                Event::Frame(received) => events.push((received.frame.to_string(), may_send)),
                Event::Link(up) => events.push((up.to_string(), may_send)),
                _ => break,
            }
        }
        let expected = [("180#", true), ("false", false), ("true", true), ("183#", true)];
        assert_eq!(events, expected.map(|(what, may_send)| (what.to_owned(), may_send)));
        Ok(())
    }

    #[test]
    fn a_bus_off_controller_queues_frames_and_receives_none() -> Result<(), BusError> {
        let script = Script::new().frame(at(10), "181#");
        let mut bus = Faulty::new(script, FaultPlan { bus_off: Some(at(5)), ..FaultPlan::default() });
        assert!(matches!(bus.receive(at(100))?, Event::Fault(Fault::BusOff, _)));
        assert!(received(&mut bus, at(100))?.is_empty());
        let taken = (0..20u8).filter(|n| bus.send(&Frame::byte(CanId::NMT, *n)).is_ok()).count();
        assert_eq!((taken, bus.inner().sent.len()), (10, 0));
        Ok(())
    }

    #[test]
    fn a_restarted_controller_sends_the_waiting_frames() -> Result<(), BusError> {
        let (bus_off, restart_after) = (Some(at(5)), Some(Duration::from_millis(10)));
        let script = Script::new().frame(at(10), "181#").frame(at(20), "182#");
        let mut bus = Faulty::new(script, FaultPlan { bus_off, restart_after, ..FaultPlan::default() });
        assert!(matches!(bus.receive(at(100))?, Event::Fault(Fault::BusOff, _)));
        bus.send(&Frame::byte(CanId::NMT, 1))?;
        assert!(bus.inner().sent.is_empty());
        assert!(matches!(bus.receive(at(100))?, Event::Fault(Fault::Restarted, _)));
        assert_eq!(bus.inner().sent, ["000#01"]);
        assert_eq!(received(&mut bus, at(100))?, [(at(20), "182#".to_owned())]);
        Ok(())
    }

    #[test]
    fn a_queue_is_full_for_a_while() -> Result<(), BusError> {
        let full = Some((at(5), Duration::from_millis(10)));
        let mut bus = Faulty::new(Script::new(), FaultPlan { full, ..FaultPlan::default() });
        let mut taken = Vec::new();
        for moment in [0, 5, 14, 15] {
            bus.receive(at(moment))?;
            taken.push(bus.send(&Frame::empty(CanId::SYNC)).is_ok());
        }
        assert_eq!(taken, [true, false, false, true]);
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
