//! A simulated device: NMT, heartbeat, guarding, and the events that cause frames.

mod assign;
mod console;
mod station;

use super::channels::{Channels, status};
use super::emergency::Emergencies;
use super::lss::Slave;
use super::memory::Memory;
use super::model::Direction;
use super::nmt::{Command, State};
use super::objects::{Area, Objects};
use super::record::{Line, Recorder, line, plain};
use super::sdo_server::SdoServer;
use super::settings::{BitRate, Pair, Settings};
use super::setup::{OfflineAfter, SERIAL_NUMBER, Setup};
use super::tpdo::{Cause, Tpdo};
use crate::bus::memory::Outbox;
use crate::bus::time::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::device::quirk::Quirk;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Duration of a reset of the node.
const NODE_RESET_TIME: Duration = Duration::from_millis(100);
/// Duration of a reset of the communication.
const COMMUNICATION_RESET_TIME: Duration = Duration::from_millis(10);

const COB_ID_SYNC: ObjectId = ObjectId::new(0x1005, 0);
const GUARD_TIME: ObjectId = ObjectId::new(0x100c, 0);
const LIFE_TIME_FACTOR: ObjectId = ObjectId::new(0x100d, 0);
const HEARTBEAT_TIME: ObjectId = ObjectId::new(0x1017, 0);
const NMT_STARTUP: ObjectId = ObjectId::new(0x1f80, 0);
/// Emergency code for a SYNC of unexpected length (CiA 301).
const SYNC_LENGTH: u16 = 0x8240;
/// Emergency code for a failure of life guarding (CiA 301).
const GUARDING_FAILED: u16 = 0x8130;

/// The operating phase of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Off,
    /// Initialising until this time.
    Starting(Mono),
    /// The device has no node-ID and answers LSS only.
    Unconfigured,
    Running(State),
    /// The device changes its bit rate at `switch`, is silent until `until`, and then has the state `after`.
    Retiming {
        after: Option<State>,
        switch: Option<Mono>,
        until: Mono,
    },
}

/// A simulated device.
pub struct Device {
    setup: Setup,
    memory: Memory,
    sdo: SdoServer,
    lss: Slave,
    tpdos: Vec<Tpdo>,
    phase: Phase,
    heartbeat: Option<Mono>,
    /// Toggle bit of the next guarding answer.
    toggle: bool,
    /// The time of the last guarding request. The first request starts life guarding.
    guarded: Option<Mono>,
    /// The next time at which an overload may begin or end.
    next_overload_change: Option<Mono>,
    /// Channels that are overloaded, with the direction.
    overloaded: BTreeMap<u8, Direction>,
    /// Answers that are not due yet.
    delayed: VecDeque<(Mono, Frame)>,
    /// The times at which the device is plugged in or unplugged next.
    connections: VecDeque<Mono>,
    is_connected: bool,
    recorder: Option<Recorder>,
    remembered: Option<console::Remembered>,
    /// Whether the user silenced the device: it neither receives nor sends.
    is_silent: bool,
    /// TPDOs that wait for the bus, with their lines for the record.
    in_transit: VecDeque<(Frame, Vec<Line>)>,
}

impl Device {
    /// Creates a device that is switched off.
    ///
    /// # Errors
    /// An object of `setup.set` does not exist or cannot hold the value.
    pub fn new(setup: Setup) -> Result<Device, String> {
        let model = &setup.model;
        let description = &model.description;
        let node = setup.node.unwrap_or(NodeId::MIN);
        let mut objects = Objects::new(model, node);
        objects.preset(SERIAL_NUMBER, setup.serial.to_le_bytes().to_vec());
        for (object, value) in &setup.set {
            let bytes = objects
                .spec(*object)
                .ok_or_else(|| format!("{} has no object {object}", description.name))?
                .encode(value, node)
                .map_err(|error| format!("{object}: {error}"))?;
            objects.preset(*object, bytes);
        }
        let channels = Channels::new(&setup, &objects);
        let tpdos = Tpdo::all(&objects, description.pdo);
        let answers_60 = description.quirks.contains(&Quirk::UploadAnswered60);
        let sdo = SdoServer::new(description.sdo.clone(), answers_60);
        let emergencies = Emergencies::new(description);
        let pair = Pair { node: setup.node, rate: setup.bit_rate.map_or(BitRate::Auto, BitRate::At) };
        let settings = Settings::new(description, &objects, pair);
        let memory = Memory { node, settings, objects, channels, emergencies, remap: description.pdo.remap };
        let oddities = &setup.oddities;
        let connected = oddities.connected.iter().flat_map(|connected| [connected.start, connected.end]);
        let is_end = |moment: &Duration| *moment == Duration::MAX;
        let connections: VecDeque<Mono> = connected.filter(|moment| !is_end(moment)).map(Mono::at).collect();
        let lss = Slave::new(setup.sim.lss.clone(), oddities.refuse.clone(), oddities.endless_fastscan);
        Ok(Device {
            setup,
            memory,
            sdo,
            lss,
            tpdos,
            phase: Phase::Off,
            heartbeat: None,
            toggle: false,
            guarded: None,
            next_overload_change: None,
            overloaded: BTreeMap::new(),
            delayed: VecDeque::new(),
            is_connected: connections.is_empty(),
            connections,
            recorder: None,
            remembered: None,
            is_silent: false,
            in_transit: VecDeque::new(),
        })
    }

    /// Adds a recorder for the sent values.
    pub fn recording(mut self, recorder: Recorder) -> Device {
        self.recorder = Some(recorder);
        self
    }

    /// The present node-ID; `None` if the device is unconfigured.
    pub fn node(&self) -> Option<NodeId> {
        self.memory.settings.active.node
    }

    /// The present bit rate in bit/s; `None` if the device uses the bit rate of the bus.
    pub fn bit_rate(&self) -> Option<u32> {
        fixed(self.memory.settings.active.rate)
    }

    /// The node-ID and the bit rate in bit/s after the next power-on.
    pub fn stored(&self) -> (Option<NodeId>, Option<u32>) {
        let Pair { node, rate } = self.memory.settings.persistent;
        (node, fixed(rate))
    }

    /// Whether the device is in LSS configuration state.
    pub fn is_configuring(&self) -> bool {
        self.lss.is_configuring()
    }

    /// The NMT state; `None` while the device is off or initialising.
    pub fn state(&self) -> Option<State> {
        match self.phase {
            Phase::Running(state) => Some(state),
            Phase::Retiming { after, .. } => after,
            Phase::Off | Phase::Starting(_) | Phase::Unconfigured => None,
        }
    }

    /// Returns the bytes of an object at `now`, independent of its access; `None` if it does not exist.
    pub fn value(&mut self, object: ObjectId, now: Mono) -> Option<Vec<u8>> {
        self.memory.value(object, now.since_start())
    }

    fn is_operational(&self) -> bool {
        self.phase == Phase::Running(State::Operational)
    }

    /// Ends the initialisation: boot-up, then PRE-OPERATIONAL or OPERATIONAL.
    fn boot(&mut self, now: Mono, out: &mut Outbox) {
        if self.node().is_none() {
            self.phase = Phase::Unconfigured;
            return;
        }
        out.send(Frame::byte(CanId::heartbeat(self.memory.node), 0x00));
        self.toggle = false;
        self.restart_heartbeat(now + self.heartbeat_period().unwrap_or_default());
        let number = |object| self.memory.objects.number(object);
        let autonomous = match &self.setup.model.description.startup {
            Some(startup) => number(startup.object) == startup.auto,
            // CiA 302-2: the device starts by itself if bit 3 is set and bit 2 is clear.
            None => number(NMT_STARTUP) & 0b1100 == 0b1000,
        };
        let starts = self.setup.start || autonomous;
        self.enter(if starts { State::Operational } else { State::PreOperational }, now);
        self.memory.channels.begin(&mut self.memory.objects, now.since_start());
        self.memory.emergencies.publish(&mut self.memory.objects);
        self.update_overloads(now);
        self.send_emergencies(now, out);
    }

    fn enter(&mut self, state: State, now: Mono) {
        let before = std::mem::replace(&mut self.phase, Phase::Running(state));
        match state {
            State::Operational if before != self.phase => self.start_tpdos(now),
            State::Operational => {}
            _ => self.tpdos.iter_mut().for_each(Tpdo::stop),
        }
        if state == State::Stopped {
            self.sdo.forget();
            self.memory.emergencies.drop_waiting();
        }
    }

    fn start_tpdos(&mut self, now: Mono) {
        for tpdo in &mut self.tpdos {
            tpdo.start(&self.memory.objects, &mut self.memory.channels, now);
        }
    }

    /// Resets the device: drops pending frames, and starts the initialisation.
    fn reset(&mut self, area: Area, now: Mono, out: &mut Outbox) {
        self.drop_pending(out);
        if area == Area::All {
            self.memory.emergencies.forget();
        }
        self.memory.settings.reset();
        self.restart(area);
        let goes_offline = self.setup.oddities.offline_after.contains(&OfflineAfter::Reset);
        let reset_time = if area == Area::All { NODE_RESET_TIME } else { COMMUNICATION_RESET_TIME };
        self.phase = if goes_offline { Phase::Off } else { Phase::Starting(now + reset_time) };
    }

    /// Drops the pending frames, and stops timers and transfers that would send more.
    fn drop_pending(&mut self, out: &mut Outbox) {
        // A frame that is already being transmitted still arrives and is recorded.
        let mut dropped: Vec<Frame> = std::iter::from_fn(|| out.pop()).collect();
        while let Some(frame) = dropped.pop() {
            if self.in_transit.back().is_some_and(|(waiting, _)| *waiting == frame) {
                self.in_transit.pop_back();
            }
        }
        self.delayed.clear();
        self.sdo.forget();
        self.tpdos.iter_mut().for_each(Tpdo::stop);
        self.heartbeat = None;
        self.guarded = None;
        self.next_overload_change = None;
        self.memory.emergencies.drop_waiting();
    }

    /// Loads the stored values, with the node-ID that is now active.
    fn restart(&mut self, area: Area) {
        let Memory { node, settings, objects, .. } = &mut self.memory;
        let before = std::mem::replace(node, settings.active.node.unwrap_or(NodeId::MIN));
        if self.setup.sim.cob_ids_follow_node_id && before != *node {
            objects.forget_cob_ids();
        }
        objects.reset(area, *node);
        settings.show(objects);
        self.lss.reset();
    }

    fn heartbeat_period(&self) -> Option<Duration> {
        let milliseconds = self.memory.objects.number(HEARTBEAT_TIME);
        (milliseconds > 0).then(|| Duration::from_millis(milliseconds.into()))
    }

    fn restart_heartbeat(&mut self, first: Mono) {
        self.heartbeat = self.heartbeat_period().map(|_| first);
    }

    fn execute(&mut self, command: Command, now: Mono, out: &mut Outbox) {
        match command {
            Command::ResetNode => self.reset(Area::All, now, out),
            Command::ResetCommunication => self.reset(Area::Communication, now, out),
            Command::Enter(state) => self.enter(state, now),
        }
    }

    /// Answers node guarding, if the device supports it and has no heartbeat.
    fn guard(&mut self, state: State, now: Mono, out: &mut Outbox) {
        if !self.memory.objects.has(GUARD_TIME) || self.heartbeat_period().is_some() {
            return;
        }
        let toggle = if self.toggle { 0x80 } else { 0x00 };
        out.send(Frame::byte(CanId::heartbeat(self.memory.node), state.code() | toggle));
        self.toggle = !self.toggle;
        self.guarded = Some(now);
        self.memory.emergencies.clear(&mut self.memory.objects, GUARDING_FAILED, 0);
        self.send_emergencies(now, out);
    }

    /// The time at which life guarding fails: guard time × life time factor after the last request.
    fn life_end(&self) -> Option<Mono> {
        let guarded = self.guarded.filter(|_| self.heartbeat.is_none())?;
        let objects = &self.memory.objects;
        let life_time = objects.number(GUARD_TIME) * objects.number(LIFE_TIME_FACTOR);
        (life_time > 0).then(|| guarded + Duration::from_millis(life_time.into()))
    }

    /// Ends life guarding without requests: OPERATIONAL is left (CiA 301, 1029h). The next request restarts guarding.
    fn end_guarding(&mut self, now: Mono) {
        self.guarded = None;
        if self.memory.emergencies.knows(GUARDING_FAILED) {
            self.memory.emergencies.raise(&mut self.memory.objects, GUARDING_FAILED, 0, 0);
        }
        if self.is_operational() {
            self.enter(State::PreOperational, now);
        }
    }

    /// Answers a remote request for a TPDO.
    fn answer_remote(&mut self, id: CanId, now: Mono, out: &mut Outbox) {
        for index in 0..self.tpdos.len() {
            if self.is_operational() && self.tpdos[index].answers(&self.memory.objects, id) {
                self.transmit(index, Cause::Requested, now, out);
            }
        }
    }

    fn serve(&mut self, request: [u8; 8], now: Mono, out: &mut Outbox) {
        let object = ObjectId::from_multiplexer([request[1], request[2], request[3]]);
        let answered = &self.setup.oddities.answers_only;
        if !answered.is_empty() && !answered.contains(&object) {
            return;
        }
        let pre_operational = self.phase == Phase::Running(State::PreOperational);
        let mut access = self.memory.at(now.since_start(), pre_operational);
        let was_sending_block = self.sdo.is_sending_block();
        let answers = self.sdo.request(now, request, &mut access);
        let written = access.written;
        let id = CanId::sdo_response(self.memory.node);
        if was_sending_block {
            // The client sent a request, so the device drops the remaining segments of the sub-block.
            out.retain(|frame| frame.id() != id);
        }
        let due_time = now + self.setup.oddities.latency;
        answers.into_iter().for_each(|answer| self.answer(Frame::full(id, answer), due_time, now, out));
        match written {
            // "The heartbeat protocol begins immediately" (CiA 301, 7.5.2.14).
            Some(HEARTBEAT_TIME) => self.restart_heartbeat(now),
            Some(object) if self.is_operational() => self.apply(object, now),
            _ => {}
        }
    }

    /// Applies a parameter that was written while PDOs are active.
    fn apply(&mut self, object: ObjectId, now: Mono) {
        let measuring = object.index >= 0x6000;
        for tpdo in &mut self.tpdos {
            if tpdo.is_configured_by(object.index) {
                tpdo.start(&self.memory.objects, &mut self.memory.channels, now);
            } else if measuring {
                // A new limit is compared with later values. A new unit or offset changes the value itself.
                let keeps = !matches!(object.index & 0x0fff, 0x133..=0x136);
                tpdo.watch(&self.memory.objects, &mut self.memory.channels, now, keeps);
            }
        }
    }

    fn is_sync(&self, frame: &Frame) -> bool {
        let objects = &self.memory.objects;
        let id = match objects.number(COB_ID_SYNC) {
            0 if !objects.has(COB_ID_SYNC) => CanId::SYNC.number(),
            cob_id => cob_id & 0x7ff,
        };
        !frame.is_remote() && matches!(frame.id(), CanId::Standard(found) if u32::from(found) == id)
    }

    fn sync(&mut self, frame: &Frame, now: Mono, out: &mut Outbox) {
        let Memory { objects, emergencies, .. } = &mut self.memory;
        if emergencies.knows(SYNC_LENGTH) {
            if frame.is_empty() {
                emergencies.clear(objects, SYNC_LENGTH, 0);
            } else {
                emergencies.raise(objects, SYNC_LENGTH, 0, 0);
            }
        }
        self.send_emergencies(now, out);
        if self.is_operational() {
            for index in 0..self.tpdos.len() {
                if let Some(cause) = self.tpdos[index].sync(&self.memory.objects) {
                    self.transmit(index, cause, now, out);
                }
            }
        }
    }

    fn transmit(&mut self, index: usize, cause: Cause, now: Mono, out: &mut Outbox) {
        let tpdo = &mut self.tpdos[index];
        let Some(id) = tpdo.cob_id(&self.memory.objects) else { return };
        let mapping = tpdo.mapping(&self.memory.objects);
        if mapping.is_empty() && !self.memory.sends_empty_pdo() {
            return;
        }
        let time = now.since_start();
        let values: Vec<(ObjectId, Vec<u8>)> =
            mapping.iter().filter_map(|object| Some((*object, self.memory.value(*object, time)?))).collect();
        let data: Vec<u8> = values.iter().flat_map(|(_, bytes)| bytes.iter().copied()).collect();
        let Ok(frame) = Frame::new(id, &data) else { return };
        if !tpdo.note(cause, &data, &self.memory.objects, &mut self.memory.channels, now) {
            return;
        }
        self.memory.channels.sent(&mapping);
        out.send(frame);
        if self.recorder.is_some() {
            self.in_transit.push_back((frame, self.lines(&values, time)));
        }
    }

    /// Returns the lines of the record for a TPDO.
    fn lines(&self, values: &[(ObjectId, Vec<u8>)], time: Duration) -> Vec<Line> {
        let Memory { objects, channels, node, .. } = &self.memory;
        let mapped: Vec<ObjectId> = values.iter().map(|(object, _)| *object).collect();
        let described = |(object, bytes): &(ObjectId, Vec<u8>)| {
            if channels.is_status(*object) {
                return None;
            }
            let Some(reading) = channels.reading(objects, *object, time) else {
                return Some(plain(*node, *object, objects.spec(*object)?.data_type, bytes));
            };
            let has_status = reading.status.is_some_and(|status| mapped.contains(&status));
            Some(line(*node, &reading, bytes, has_status))
        };
        values.iter().filter_map(described).collect()
    }

    fn update_overloads(&mut self, now: Mono) {
        let time = now.since_start();
        self.next_overload_change = self.memory.channels.next_overload_change(time).map(Mono::at);
        let Memory { objects, channels, emergencies, .. } = &mut self.memory;
        for (channel, overload) in channels.overloads(time) {
            let before = match overload {
                Some(direction) => self.overloaded.insert(channel, direction),
                None => self.overloaded.remove(&channel),
            };
            if let Some(direction) = overload.filter(|_| overload != before) {
                objects.count(counter(direction));
            }
            match (self.setup.sim.overload_emcy, overload) {
                (Some(code), Some(_)) => emergencies.raise(objects, code, channel, status(overload)),
                (Some(code), None) => emergencies.clear(objects, code, channel),
                (None, _) => {}
            }
        }
    }

    fn send_emergencies(&mut self, now: Mono, out: &mut Outbox) {
        self.memory.emergencies.repeat(&self.memory.objects, now);
        if matches!(self.phase, Phase::Running(State::Stopped)) {
            self.memory.emergencies.drop_waiting();
        }
        while let Some(frame) = self.memory.emergencies.next_frame(&self.memory.objects, self.memory.node, now) {
            out.send(frame);
        }
    }
}

/// Returns the next due time: one period after `due`, to avoid drift. If that time has passed, one period after `now`.
pub(super) fn next_due(due: Mono, period: Duration, now: Mono) -> Mono {
    let next = due + period;
    if next > now { next } else { now + period }
}

/// Returns the name of the object that counts the overloads of a direction (DPS 2004h and 2005h).
fn counter(direction: Direction) -> &'static str {
    match direction {
        Direction::High => "span-overflow-count",
        Direction::Low => "span-underflow-count",
    }
}

fn fixed(rate: BitRate) -> Option<u32> {
    match rate {
        BitRate::At(rate) => Some(rate),
        BitRate::Auto => None,
    }
}

#[cfg(test)]
mod tests;
