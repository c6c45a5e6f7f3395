//! The reactions of a simulated device to frames, time and power.

use super::*;
use crate::bus::memory::{Station, Tuning};

impl Station for Device {
    fn power_on(&mut self, now: Mono, out: &mut Outbox) {
        self.drop_pending(out);
        if !self.is_connected {
            self.phase = Phase::Off;
            return;
        }
        self.memory.emergencies.forget();
        self.memory.settings.power_on();
        self.restart(Area::All);
        self.boot(now, out);
    }

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        self.process(now, frame, out);
        self.remember();
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if self.connections.front().is_some_and(|due| *due <= now) {
            self.connections.pop_front();
            self.is_connected = !self.is_connected;
            return self.power_on(now, out);
        }
        self.work(now, out);
        self.remember();
    }

    fn next_wake(&self) -> Option<Mono> {
        let own = match self.phase {
            Phase::Off => None,
            Phase::Starting(until) => Some(until),
            Phase::Unconfigured => self.delayed.front().map(|(due, _)| *due),
            Phase::Retiming { switch, until, .. } => Some(switch.unwrap_or(until)),
            Phase::Running(_) => {
                let mut next = self.heartbeat;
                let mut add = |moment: Option<Mono>| next = Mono::earlier(next, moment);
                add(self.sdo.deadline());
                add(self.life_end());
                add(self.next_overload_change);
                add(self.memory.emergencies.next_wake());
                add(self.delayed.front().map(|(due, _)| *due));
                self.tpdos.iter().for_each(|tpdo| add(tpdo.next_wake()));
                next
            }
        };
        Mono::earlier(self.connections.front().copied(), own)
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        if frame.id() == CanId::sdo_response(self.memory.node) {
            self.sdo.sent(now);
        }
        let Some(recorder) = &self.recorder else { return };
        // Earlier frames were dropped when the controller was switched off.
        if let Some(place) = self.in_transit.iter().position(|(waiting, _)| waiting == frame) {
            self.in_transit.drain(..place);
            if let Some((_, lines)) = self.in_transit.pop_front() {
                lines.iter().for_each(|line| recorder.write(now, line));
            }
        }
    }

    fn tuning(&self) -> Tuning {
        match self.memory.settings.active.rate {
            _ if self.phase == Phase::Off || self.is_silent => Tuning::Off,
            BitRate::At(rate) => Tuning::At(rate),
            BitRate::Auto => Tuning::Follows,
        }
    }

    fn on_bus_bit_rate(&mut self, bit_rate: u32) {
        let settings = &mut self.memory.settings;
        settings.set_bus_bit_rate(bit_rate, self.setup.bit_rate.is_some());
    }
}

impl Device {
    fn process(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        if frame.id() == CanId::LSS_MASTER
            && !frame.is_remote()
            && let Some(request) = frame.as_eight_bytes()
        {
            // While a device changes its bit rate, it accepts only the return to waiting state.
            let is_retiming = matches!(self.phase, Phase::Retiming { .. });
            if self.accepts_lss() || is_retiming && request[0] == 0x04 {
                self.configure(request, now, out);
            }
            return;
        }
        let Phase::Running(state) = self.phase else { return };
        if let Some(command) = Command::for_node(self.memory.node, frame) {
            self.execute(command, now, out);
        } else if frame.is_remote() {
            if frame.id() == CanId::heartbeat(self.memory.node) {
                self.guard(state, now, out);
            } else {
                self.answer_remote(frame.id(), now, out);
            }
        } else if self.is_sync(frame) {
            if state != State::Stopped {
                self.sync(frame, now, out);
            }
        } else if frame.id() == CanId::sdo_request(self.memory.node)
            && state != State::Stopped
            && let Some(request) = frame.as_eight_bytes()
        {
            self.serve(request, now, out);
        }
    }

    fn work(&mut self, now: Mono, out: &mut Outbox) {
        if let Phase::Starting(until) = self.phase {
            if until <= now {
                self.boot(now, out);
            }
            return;
        }
        self.retime(now, out);
        let due_time = self.delayed.partition_point(|(due, _)| *due <= now);
        self.delayed.drain(..due_time).for_each(|(_, frame)| out.send(frame));
        let Phase::Running(state) = self.phase else { return };
        if let Some(due) = self.heartbeat.filter(|due| *due <= now) {
            out.send(Frame::byte(CanId::heartbeat(self.memory.node), state.code()));
            self.heartbeat = self.heartbeat_period().map(|period| next_due(due, period, now));
        }
        if self.sdo.deadline().is_some_and(|deadline| deadline <= now)
            && let Some(abort) = self.sdo.give_up()
        {
            out.send(Frame::full(CanId::sdo_response(self.memory.node), abort));
        }
        if self.life_end().is_some_and(|due| due <= now) {
            self.end_guarding(now);
        }
        if self.next_overload_change.is_some_and(|due| due <= now) {
            self.update_overloads(now);
        }
        self.send_emergencies(now, out);
        if self.is_operational() {
            for index in 0..self.tpdos.len() {
                if let Some(cause) = self.tpdos[index].wake(&self.memory.objects, &mut self.memory.channels, now) {
                    self.transmit(index, cause, now, out);
                }
            }
        }
    }
}
