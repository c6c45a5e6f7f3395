//! The participants on the bus: devices with faults, which record the frames they sent, and other participants.

use crate::deviation::{Deviation, TpdoFault};
use crate::random::Random;
use crate::spec::{Act, DeviceFault, DeviceSpec};
use cangauge::bus::Mono;
use cangauge::bus::memory::{Outbox, Station, Tuning};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::node::write::is_signature;
use cangauge::sim::{Device, State};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

pub(crate) fn ms(milliseconds: u64) -> Mono {
    Mono::at(Duration::from_millis(milliseconds))
}

/// A device with faults.
pub(crate) struct FaultyDevice {
    pub(crate) device: Device,
    /// Its place on the bench.
    pub(crate) place: usize,
    device_faults: Vec<DeviceFault>,
    deviation: Option<Deviation>,
    /// Whether it has its deviation: a device may reject the setting.
    pub(crate) has_deviation: bool,
    /// The lengths of frames before the deviation changed them.
    lengths: BTreeMap<CanId, usize>,
    resets: VecDeque<Mono>,
    hangs: Vec<(Mono, Mono)>,
    /// The device hangs until then: it is not woken before.
    hung_until: Mono,
    /// The SDO answers so far.
    answers: u64,
    late: Vec<(Mono, Frame)>,
    /// The next emergency without meaning, the end of the series, and its period.
    unknown_emergencies: Option<(Mono, Mono, Duration)>,
    unsaved: Option<Frame>,
    /// Every frame that it sent, with the moment of its end.
    pub(crate) sent: Vec<(Mono, Frame)>,
    /// The objects to which a signature was written.
    pub(crate) signed: Vec<ObjectId>,
    /// The object under observation, and every value that it had.
    pub(crate) watched: Option<ObjectId>,
    pub(crate) held: BTreeSet<Vec<u8>>,
}

impl FaultyDevice {
    pub(crate) fn new(device: Device, place: usize, spec: &DeviceSpec, unsaved: Option<Frame>) -> FaultyDevice {
        let mut resets: Vec<Mono> = Vec::new();
        let mut hangs = Vec::new();
        let mut unknown_emergencies = None;
        for device_fault in &spec.device_faults {
            match device_fault {
                DeviceFault::ResetAt { ms: at } => resets.push(ms(*at)),
                DeviceFault::Hang { from_ms, for_ms } => hangs.push((ms(*from_ms), ms(from_ms + for_ms))),
                DeviceFault::SendsEmergencies { from_ms, for_ms, every_us } => {
                    unknown_emergencies = Some((ms(*from_ms), ms(from_ms + for_ms), Duration::from_micros(*every_us)));
                }
                _ => {}
            }
        }
        resets.sort();
        FaultyDevice {
            device,
            place,
            device_faults: spec.device_faults.clone(),
            deviation: spec.deviation,
            has_deviation: true,
            lengths: BTreeMap::new(),
            resets: resets.into(),
            hangs,
            hung_until: Mono::START,
            answers: 0,
            late: Vec::new(),
            unknown_emergencies,
            unsaved,
            sent: Vec::new(),
            signed: Vec::new(),
            watched: None,
            held: BTreeSet::new(),
        }
    }

    /// Removes all faults.
    pub(crate) fn remove_faults(&mut self) {
        self.device_faults.clear();
        self.deviation = None;
        self.resets.clear();
        self.hangs.clear();
        self.late.clear();
        self.unknown_emergencies = None;
        self.hung_until = Mono::START;
    }

    /// Sends an emergency with an unknown code, if one is due and the previous one was sent.
    fn send_unknown_emergency(&mut self, now: Mono, out: &mut Outbox) {
        let Some((due, until, every)) = self.unknown_emergencies.filter(|(due, ..)| *due <= now) else { return };
        self.unknown_emergencies = (due < until).then_some((now + every, until, every));
        if let (Some(node), Some(_), None) = (self.device.node(), self.device.state(), out.front()) {
            out.send(Frame::full(CanId::emergency(node), [0xff, 0xff, 0, 0, 0, 0, 0, 0]));
        }
    }

    fn hung_until(&self, now: Mono) -> Option<Mono> {
        self.hangs.iter().filter(|(from, until)| *from <= now && now < *until).map(|(_, until)| *until).max()
    }

    fn look(&mut self, now: Mono) {
        if let Some(object) = self.watched
            && let Some(value) = self.device.value(object, now)
        {
            self.held.insert(value);
        }
    }

    /// Lets the device act, and applies its faults to the answers that it then sends.
    fn act(&mut self, now: Mono, out: &mut Outbox, act: impl FnOnce(&mut Device, &mut Outbox)) {
        let answers = |out: &mut Outbox| {
            let mut count = 0;
            out.retain(|frame| {
                count += usize::from(frame.id().sdo_response_node().is_some());
                true
            });
            count
        };
        let before = answers(out);
        act(&mut self.device, out);
        let mut old = answers(out).min(before);
        if answers(out) > old && (!self.device_faults.is_empty() || self.deviation == Some(Deviation::Twice)) {
            let all: Vec<Frame> = std::iter::from_fn(|| out.pop()).collect();
            for frame in all {
                let is_answer = frame.id().sdo_response_node().is_some();
                if !is_answer || old > 0 {
                    old -= usize::from(is_answer);
                    out.send(frame);
                } else {
                    self.answer(frame, now, out);
                }
            }
        }
        if let Some(deviation) = self.deviation {
            let all: Vec<Frame> = std::iter::from_fn(|| out.pop()).collect();
            for frame in all.into_iter().filter(|frame| !deviation.drops(frame)) {
                let changed = deviation.changed(frame);
                if changed != frame {
                    self.lengths.insert(frame.id(), frame.data().len());
                }
                out.send(changed);
            }
        }
        self.look(now);
    }

    fn answer(&mut self, mut frame: Frame, now: Mono, out: &mut Outbox) {
        let number = self.answers;
        self.answers += 1;
        let (mut copies, mut late) = (if self.deviation == Some(Deviation::Twice) { 2 } else { 1 }, None);
        for device_fault in &self.device_faults {
            match *device_fault {
                DeviceFault::Lose { nth } if nth == number => copies = 0,
                DeviceFault::Twice { nth } if nth == number => copies = 2,
                DeviceFault::Late { nth, ms } if nth == number => late = Some(now + Duration::from_millis(ms)),
                DeviceFault::Garbled { nth, place, turned } if nth == number => {
                    let mut data = frame.data().to_vec();
                    if let Some(byte) = data.get_mut(place) {
                        *byte ^= turned;
                    }
                    frame = Frame::new(frame.id(), &data).unwrap_or(frame);
                }
                DeviceFault::As { nth, node } if nth == number => {
                    let id = CanId::sdo_response(NodeId::new(node).expect("a node-ID"));
                    frame = Frame::new(id, frame.data()).unwrap_or(frame);
                }
                _ => {}
            }
        }
        for _ in 0..copies {
            match late {
                Some(due) => self.late.push((due, frame)),
                None => out.send(frame),
            }
        }
    }

    fn refusal(&self, frame: &Frame) -> Option<Frame> {
        let node = self.device.node()?;
        let data = frame.as_eight_bytes().filter(|_| frame.id() == CanId::sdo_request(node))?;
        let index = u16::from_le_bytes([data[1], data[2]]);
        let begins = matches!(data[0] >> 5, 1 | 2)
            || data[0] >> 5 == 6 && data[0] & 1 == 0
            || data[0] >> 5 == 5 && data[0] & 3 == 0;
        let code = self.device_faults.iter().find_map(|device_fault| match device_fault {
            DeviceFault::Refuse { index: refused, code } if *refused == index && begins => Some(code.to_le_bytes()),
            _ => None,
        })?;
        let answer = [0x80, data[1], data[2], data[3], code[0], code[1], code[2], code[3]];
        Some(Frame::full(CanId::sdo_response(node), answer))
    }
}

impl Station for FaultyDevice {
    fn power_on(&mut self, now: Mono, out: &mut Outbox) {
        self.device.power_on(now, out);
        if let Some(write) = self.unsaved.take() {
            let mut nowhere = Outbox::default();
            self.device.receive(now, &write, &mut nowhere);
        }
        if let Some(deviation) = self.deviation {
            self.has_deviation = deviation.power_on(&mut self.device, now);
        }
    }

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        if self.hung_until(now).is_some() || self.deviation.is_some_and(|deviation| deviation.ignores(frame)) {
            return;
        }
        if let (Some(node), Some(data)) = (frame.id().sdo_request_node(), frame.as_eight_bytes())
            && self.device.node() == Some(node)
            && data[0] >> 5 == 1
            && is_signature(&data[4..])
        {
            self.signed.push(ObjectId::from_multiplexer([data[1], data[2], data[3]]));
        }
        match self.refusal(frame) {
            Some(refusal) if self.device.state().is_some_and(|state| state != State::Stopped) => out.send(refusal),
            _ => self.act(now, out, |device, out| device.receive(now, frame, out)),
        }
        if let (Some(deviation), Some(node), Some(State::Operational), CanId::NMT) =
            (self.deviation, self.device.node(), self.device.state(), frame.id())
        {
            if matches!(deviation, Deviation::NoTpdo(TpdoFault::Offline | TpdoFault::OfflineWithoutHeartbeat)) {
                out.clear();
                self.hangs.push((now, ms(1_000_000)));
            }
            let Some((command, emergency)) = deviation.own_command(node) else { return };
            self.act(now, out, |device, out| device.receive(now, &command, out));
            emergency.into_iter().for_each(|frame| out.send(frame));
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if self.resets.front().is_some_and(|due| *due <= now) {
            self.resets.pop_front();
            self.late.clear();
            self.act(now, out, |device, out| device.power_on(now, out));
            return;
        }
        if let Some(until) = self.hung_until(now) {
            self.hung_until = until;
            return;
        }
        self.send_unknown_emergency(now, out);
        for (_, frame) in self.late.extract_if(.., |(due, _)| *due <= now) {
            out.send(frame);
        }
        if self.device.next_wake().is_some_and(|due| due <= now) {
            self.act(now, out, |device, out| device.wake(now, out));
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        let late = self.late.iter().map(|(due, _)| *due);
        // A device that hangs is not woken before the end.
        let unknown_emergencies = self.unknown_emergencies.map(|(due, ..)| due);
        let own =
            late.chain(self.device.next_wake()).chain(unknown_emergencies).min().map(|due| due.max(self.hung_until));
        own.into_iter().chain(self.resets.front().copied()).min()
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.sent.push((now, *frame));
        // The simulated device records only frames of its own lengths.
        let own = self.lengths.get(&frame.id()).and_then(|length| frame.data().get(..*length));
        let own = own.filter(|_| matches!(self.deviation, Some(Deviation::Pdo(_))));
        let own = own.and_then(|data| Frame::new(frame.id(), data).ok());
        self.device.sent(now, &own.unwrap_or(*frame));
    }

    fn tuning(&self) -> Tuning {
        self.device.tuning()
    }

    fn on_bus_bit_rate(&mut self, bit_rate: u32) {
        self.device.on_bus_bit_rate(bit_rate);
    }
}

/// A second master with a fixed plan.
pub(crate) struct SecondMaster {
    plan: VecDeque<(Mono, Act)>,
    fetching: Option<(u8, u8)>,
}

impl SecondMaster {
    pub(crate) fn new(plan: &[(u64, Act)]) -> SecondMaster {
        let mut plan: Vec<(Mono, Act)> =
            plan.iter().map(|(at, act)| (Mono::at(Duration::from_micros(*at)), *act)).collect();
        plan.sort_by_key(|(at, _)| *at);
        SecondMaster { plan: plan.into(), fetching: None }
    }
}

fn request(node: u8, data: [u8; 8]) -> Frame {
    Frame::full(CanId::sdo_request(NodeId::new(node).expect("a node-ID")), data)
}

/// The frame of an expedited write of `bytes` bytes.
pub(crate) fn write(node: u8, index: u16, sub: u8, value: u32, bytes: u8) -> Frame {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    request(node, [0x23 | (4 - bytes) << 2, low, high, sub, a, b, c, d])
}

impl Station for SecondMaster {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
        let Some((node, toggle)) = self.fetching else { return };
        if frame.id().sdo_response_node().map(NodeId::get) != Some(node) {
            return;
        }
        let Some(data) = frame.as_eight_bytes() else { return };
        match data[0] >> 5 {
            2 if data[0] & 2 == 0 => out.send(request(node, [0x60, 0, 0, 0, 0, 0, 0, 0])),
            0 if data[0] & 1 == 0 => {
                self.fetching = Some((node, toggle ^ 0x10));
                out.send(request(node, [0x60 | toggle ^ 0x10, 0, 0, 0, 0, 0, 0, 0]));
            }
            _ => self.fetching = None,
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        while self.next_wake().is_some_and(|due| due <= now) {
            let Some((_, act)) = self.plan.pop_front() else { return };
            out.send(match act {
                Act::Read { node, index, sub } => {
                    self.fetching = Some((node, 0));
                    let [low, high] = index.to_le_bytes();
                    request(node, [0x40, low, high, sub, 0, 0, 0, 0])
                }
                Act::Write { node, index, sub, value, bytes } => write(node, index, sub, value, bytes),
                Act::Nmt { specifier, node } => Frame::pair(CanId::NMT, specifier, node),
                Act::Sync => Frame::empty(CanId::SYNC),
                Act::LssWait => Frame::full(CanId::LSS_MASTER, [0x04, 0, 0, 0, 0, 0, 0, 0]),
            });
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.plan.front().map(|(due, _)| *due)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// Sends meaningless frames. A `uses_canopen_ids` one uses identifiers of CANopen services.
pub(crate) struct NoiseSender {
    every: Duration,
    next: Mono,
    random: Random,
    uses_canopen_ids: bool,
}

impl NoiseSender {
    pub(crate) fn new(every_us: u64, seed: u64, uses_canopen_ids: bool) -> NoiseSender {
        NoiseSender {
            every: Duration::from_micros(every_us),
            next: Mono::START,
            random: Random::new(seed),
            uses_canopen_ids,
        }
    }
}

impl Station for NoiseSender {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, _: Mono, _: &Frame, _: &mut Outbox) {}

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        self.next = now + self.every;
        if out.front().is_some() {
            return;
        }
        let random = &mut self.random;
        let node = u16::from(random.byte(1..=127));
        let (id, least) = match random.within(0..=7) {
            _ if !self.uses_canopen_ids => (*random.pick(&[0x7ff, 0x010, 0x7f0, 0x679]), 0),
            0 => (0x080 + node, 8),
            // The program would accept a frame that looks like an acknowledgement, so its first byte is changed below.
            1..=3 => (0x580 + node, 0),
            4 => (0x700 + node, 0),
            5 => (0x7e4, 0),
            _ => (0x180 + node, 0),
        };
        let length = usize::from(random.byte(least..=8));
        let mut data: Vec<u8> = (0..length).map(|_| random.byte(0..=255)).collect();
        if (0x580..0x600).contains(&id) && data.first().is_some_and(|first| matches!(first >> 5, 1 | 3 | 5)) {
            data[0] = 0xe0;
        }
        if id == 0x7e4 && data.first().is_some_and(|first| *first < 0x80) {
            data[0] = 0xf0;
        }
        let id = if random.percent(10) && !self.uses_canopen_ids {
            CanId::extended(0x1800_0000 + u32::from(id))
        } else {
            CanId::standard(id)
        };
        if let Some(frame) = id.and_then(|id| Frame::new(id, &data).ok()) {
            out.send(frame);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.next)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}
