//! How a simulated device receives its node-ID and bit rate.

use super::{COMMUNICATION_RESET_TIME, Device, Phase};
use crate::bus::memory::Outbox;
use crate::bus::time::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::object::ObjectId;
use crate::sim::data::SimState;
use crate::sim::lss::DeviceAction;
use crate::sim::nmt::State;
use crate::sim::objects::Area;
use crate::sim::setup::OfflineAfter;

impl Device {
    /// Sends an answer after the response time.
    pub(super) fn answer(&mut self, frame: Frame, due_time: Mono, now: Mono, out: &mut Outbox) {
        if due_time <= now && self.delayed.is_empty() {
            out.send(frame);
        } else {
            let place = self.delayed.partition_point(|(due, _)| *due <= due_time);
            self.delayed.insert(place, (due_time, frame));
        }
    }

    /// Whether the device answers LSS in its present state.
    pub(super) fn accepts_lss(&self) -> bool {
        let state = match self.phase {
            Phase::Unconfigured => return true,
            Phase::Running(State::Stopped) => SimState::Stopped,
            Phase::Running(State::PreOperational) => SimState::PreOperational,
            Phase::Running(State::Operational) => SimState::Operational,
            Phase::Off | Phase::Starting(_) | Phase::Retiming { .. } => return false,
        };
        let states = &self.setup.sim.lss.states;
        states.is_empty() || states.contains(&state)
    }

    /// Handles a request of the LSS master.
    pub(super) fn configure(&mut self, request: [u8; 8], now: Mono, out: &mut Outbox) {
        let identity = [1, 2, 3, 4].map(|sub| self.memory.objects.number(ObjectId::new(0x1018, sub)));
        let reply = self.lss.request(request, identity, &mut self.memory.settings);
        if let Some(answer) = reply.answer {
            let service = request[0];
            let oddities = &mut self.setup.oddities;
            let late = oddities.late.remove(&service).unwrap_or_default();
            if let Some(lost) = oddities.lose.iter().position(|lost| *lost == service) {
                oddities.lose.remove(lost);
            } else {
                let due_time = now + oddities.latency + late;
                self.answer(Frame::full(CanId::LSS_SLAVE, answer), due_time, now, out);
            }
        }
        match reply.then {
            DeviceAction::Nothing => {}
            DeviceAction::Boot => {
                self.memory.settings.active.node = self.memory.settings.pending.node;
                self.restart(Area::Communication);
                self.phase = Phase::Starting(now + COMMUNICATION_RESET_TIME);
            }
            DeviceAction::Activate(delay) => {
                let after = self.state();
                self.drop_pending(out);
                self.phase = Phase::Retiming { after, switch: Some(now + delay), until: now + delay + delay };
            }
        }
    }

    /// Waits for the two delays of the LSS activation, and changes the bit rate between them.
    pub(super) fn retime(&mut self, now: Mono, out: &mut Outbox) {
        let Phase::Retiming { after, switch, until } = self.phase else { return };
        if switch.is_some_and(|switch| switch <= now) {
            self.memory.settings.active.rate = self.memory.settings.pending.rate;
            let is_gone = self.setup.oddities.offline_after.contains(&OfflineAfter::Activate);
            self.phase = if is_gone { Phase::Off } else { Phase::Retiming { after, switch: None, until } };
        }
        if until <= now && self.phase != Phase::Off {
            self.phase = after.map_or(Phase::Unconfigured, Phase::Running);
            if after.is_some() {
                self.restart_heartbeat(now);
                self.update_overloads(now);
                self.send_emergencies(now, out);
            }
            if self.is_operational() {
                self.start_tpdos(now);
            }
        }
    }
}
