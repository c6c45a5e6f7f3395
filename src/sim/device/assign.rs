//! How a simulated device is given its node-ID and bit rate.

use super::{Device, Phase, RECONNECT};
use crate::bus::memory::Outbox;
use crate::bus::time::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::object::ObjectId;
use crate::sim::data::SimState;
use crate::sim::lss::Then;
use crate::sim::nmt::State;
use crate::sim::objects::Area;
use crate::sim::setup::GoneAfter;

impl Device {
    /// An answer goes out once it has been thought over.
    pub(super) fn answer(&mut self, frame: Frame, thought: Mono, now: Mono, out: &mut Outbox) {
        if thought <= now && self.thinking.is_empty() {
            out.send(frame);
        } else {
            let place = self.thinking.partition_point(|(due, _)| *due <= thought);
            self.thinking.insert(place, (thought, frame));
        }
    }

    /// Whether it listens to LSS in its present state.
    pub(super) fn hears_lss(&self) -> bool {
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

    /// A request of the LSS master.
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
                let thought = now + oddities.latency + late;
                self.answer(Frame::full(CanId::LSS_SLAVE, answer), thought, now, out);
            }
        }
        match reply.then {
            Then::Nothing => {}
            Then::Boot => {
                self.memory.settings.active.node = self.memory.settings.pending.node;
                self.restart(Area::Communication);
                self.phase = Phase::Starting(now + RECONNECT);
            }
            Then::Activate(delay) => {
                let after = self.state();
                self.fall_silent(out);
                self.phase = Phase::Retiming { after, switch: Some(now + delay), until: now + delay + delay };
            }
        }
    }

    /// The two delays of the activation of another bit rate.
    pub(super) fn retime(&mut self, now: Mono, out: &mut Outbox) {
        let Phase::Retiming { after, switch, until } = self.phase else { return };
        if switch.is_some_and(|switch| switch <= now) {
            self.memory.settings.active.rate = self.memory.settings.pending.rate;
            let is_gone = self.setup.oddities.gone_after.contains(&GoneAfter::Activate);
            self.phase = if is_gone { Phase::Off } else { Phase::Retiming { after, switch: None, until } };
        }
        if until <= now && self.phase != Phase::Off {
            self.phase = after.map_or(Phase::Unconfigured, Phase::Running);
            if after.is_some() {
                self.restart_heartbeat(now);
                self.look_for_overload(now);
                self.send_emergencies(now, out);
            }
            if self.is_operational() {
                self.start_tpdos(now);
            }
        }
    }
}
