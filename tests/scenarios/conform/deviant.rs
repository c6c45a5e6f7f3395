//! A simulated device that deviates from the standard in one point.

use cangauge::bus::Mono;
use cangauge::bus::memory::{Outbox, Station, Tuning};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use cangauge::device::catalog::Model;
use cangauge::sim::Device;
use cangauge::tasks::conform::{Input, Stimulus, StimulusFailure};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// The node-ID of the device.
pub(super) const NODE: u8 = 5;

/// The code of the bit rate of the bus, 250 kbit/s.
const RATE_CODE: u8 = 3;

/// The facts that a deviation may depend on.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    /// The last SDO request, before the present one.
    pub(super) last: Option<[u8; 8]>,
    /// The present SDO request.
    pub(super) request: Option<[u8; 8]>,
    /// The command of the last block initiate.
    pub(super) initiate: u8,
    /// The bytes of the last block segment.
    pub(super) segment: [u8; 2],
    /// The last two NMT commands to this node.
    pub(super) nmt: [u8; 2],
    /// When the last boot-up message was sent.
    pub(super) booted: Option<Duration>,
    /// The last values written to 1017h, the newest first.
    pub(super) periods: [u16; 2],
    /// The last value written to each object, and the value before it.
    pub(super) values: BTreeMap<[u8; 3], [u32; 2]>,
    /// The last LSS request.
    pub(super) lss: [u8; 8],
    /// Whether the last LSS switch was to configuration state.
    pub(super) is_configuring: bool,
    /// The node-ID that the device has accepted by LSS, 0 if none.
    node_id: u8,
    /// The code of the bit rate that the device has accepted by LSS.
    bit_rate: Option<u8>,
    /// Counts for the deviation itself.
    pub(super) count: u32,
}

impl Memory {
    /// The last value written to an object, 0 if none.
    pub(super) fn written(&self, object: [u8; 3]) -> u32 {
        self.values.get(&object).map_or(0, |values| values[0])
    }

    pub(super) fn was_written(&self, object: [u8; 3]) -> bool {
        self.values.contains_key(&object)
    }

    /// The value written to an object before the present request.
    pub(super) fn before(&self, object: [u8; 3]) -> u32 {
        self.values.get(&object).map_or(0, |values| values[1])
    }
}

/// A deviation. Each function gets what the device has received or sends.
#[derive(Clone, Copy)]
pub(super) enum Deviation {
    /// Answers an SDO request in place of the device; `None`: the device answers.
    Answers(fn(&mut Memory, [u8; 8]) -> Option<[u8; 8]>),
    /// Ignores a received frame.
    Ignores(fn(&mut Memory, Duration, &Frame) -> bool),
    /// Takes a received frame for another one.
    Takes(fn(&mut Memory, &Frame) -> Frame),
    /// Changes a frame that it sends.
    Sends(fn(&mut Memory, Frame) -> Vec<Frame>),
    /// Answers an LSS request in addition to the device.
    Lss(fn(&mut Memory, [u8; 8]) -> Option<[u8; 8]>),
    /// Behaves as if another frame followed a received one.
    Adds(fn(&mut Memory, &Frame) -> Option<Frame>),
    /// Both: takes a frame for another one, and changes what it sends.
    Both(fn(&mut Memory, &Frame) -> Frame, fn(&mut Memory, Frame) -> Vec<Frame>),
}

/// A device with a deviation.
pub(super) struct Deviant {
    pub(super) model: Arc<Model>,
    pub(super) device: Device,
    deviation: Option<Deviation>,
    memory: Memory,
    /// The input that the device has; `None` until the switch has set one.
    input: Option<Input>,
    /// When the input is compared with that of the switch.
    next_look: Mono,
}

thread_local! {
    /// The input of the devices of this test; `None` until the switch has set one.
    static INPUT: Cell<Option<Input>> = const { Cell::new(None) };
}

/// Changes the input of the device.
pub(super) struct Switch;

impl Switch {
    pub(super) fn reset() {
        INPUT.set(None);
    }

    pub(super) fn input() -> Input {
        INPUT.get().unwrap_or(Input::Normal)
    }
}

impl Stimulus for Switch {
    fn set(&mut self, input: Input) -> Result<(), StimulusFailure> {
        INPUT.set(Some(input));
        Ok(())
    }
}

/// The time between two looks at the switch.
const LOOK: Duration = Duration::from_millis(10);

impl Deviant {
    pub(super) fn new(model: Arc<Model>, device: Device, deviation: Option<Deviation>) -> Deviant {
        Deviant { model, device, deviation, memory: Memory::default(), input: None, next_look: Mono::START }
    }

    /// Sets the process value of the input that the test has chosen.
    fn look(&mut self, now: Mono, out: &mut Outbox) {
        self.next_look = now + LOOK;
        let Some(input) = INPUT.get() else { return };
        if self.input.replace(input) == Some(input) {
            return;
        }
        let (signal, normal, step, overload) = match self.model.description.name.as_str() {
            "mh4" => ("pressure", "1.2bar", "4bar", Some(["20bar", "-5bar"])),
            "d20" => ("pressure", "5bar", "9bar", None),
            "dps" => ("pressure", "17psi", "25psi", Some(["200psi", "-50psi"])),
            "mc1609" => ("ch1", "25degC", "200degC", None),
            "hydac" => ("pressure", "120bar", "250bar", Some(["600bar", "-90bar"])),
            other => panic!("the input of {other} is not known"),
        };
        let value = match input {
            Input::Normal => normal,
            Input::Step => step,
            Input::OverloadHigh => overload.expect("an overload")[0],
            Input::OverloadLow => overload.expect("an overload")[1],
        };
        let mut inner = Outbox::default();
        self.device.hold(signal, value, now, &mut inner).expect("a value");
        self.send(now, &mut inner, out);
    }

    fn note(&mut self, frame: &Frame) {
        let memory = &mut self.memory;
        if frame.id().number() == 0x600 + u32::from(NODE)
            && let Some(request) = frame.as_eight_bytes()
        {
            memory.last = memory.request.replace(request);
            if let [0x22..=0x2f, a, b, c, value @ ..] = request {
                let before = memory.written([a, b, c]);
                memory.values.insert([a, b, c], [u32::from_le_bytes(value), before]);
            }
            match request {
                [command @ (0xa0 | 0xa4 | 0xc2 | 0xc6), ..] => memory.initiate = command,
                [0x81, a, b, ..] => memory.segment = [a, b],
                [0x22 | 0x2b, 0x17, 0x10, 0, low, high, ..] | [0x0b, low, high, ..] => {
                    memory.periods = [u16::from_le_bytes([low, high]), memory.periods[0]];
                    memory.count = 0;
                }
                _ => {}
            }
        }
        if let (CanId::LSS_MASTER, Some(request)) = (frame.id(), frame.as_eight_bytes()) {
            memory.lss = request;
            match request {
                [0x04, mode, ..] => memory.is_configuring = mode == 1,
                [0x43, ..] => memory.is_configuring = true,
                _ => {}
            }
        }
        self.check_lss(frame);
        let memory = &mut self.memory;
        if let (CanId::NMT, [command, NODE]) = (frame.id(), frame.data()) {
            memory.nmt = [*command, memory.nmt[0]];
        }
    }

    /// Whether the device has accepted no other node-ID or bit rate by LSS.
    pub(super) fn has_old_address(&self) -> bool {
        self.memory.bit_rate.is_none_or(|code| code == RATE_CODE) && [0, NODE].contains(&self.memory.node_id)
    }

    /// No bit rate is activated, and no other node-ID or bit rate is stored, or active after a reset.
    fn check_lss(&self, frame: &Frame) {
        match (frame.id(), frame.data()) {
            (CanId::LSS_MASTER, [0x15, ..]) => panic!("the bit rate is activated"),
            (CanId::LSS_MASTER, [0x17, ..]) | (CanId::NMT, [0x81 | 0x82, ..]) => {
                assert!(self.has_old_address(), "{frame}: {:?}", self.memory);
            }
            _ => {}
        }
    }

    /// Notes the node-ID or the bit rate that the device has accepted.
    fn note_accepted(&mut self, frame: &Frame) {
        if frame.id() == CanId::LSS_SLAVE && frame.data().get(1) == Some(&0) {
            match frame.data()[0] {
                0x11 => self.memory.node_id = self.memory.lss[1],
                0x13 => self.memory.bit_rate = Some(self.memory.lss[2]),
                _ => {}
            }
        }
    }

    /// Passes the frames of the device to the bus.
    fn send(&mut self, now: Mono, inner: &mut Outbox, out: &mut Outbox) {
        while let Some(frame) = inner.pop() {
            self.note_accepted(&frame);
            if frame.id().number() == 0x700 + u32::from(NODE) && frame.data() == [0] {
                self.memory.booted = Some(now.since_start());
            }
            match self.deviation {
                Some(Deviation::Sends(change) | Deviation::Both(_, change)) => {
                    change(&mut self.memory, frame).into_iter().for_each(|frame| out.send(frame));
                }
                _ => out.send(frame),
            }
        }
    }
}

impl Station for Deviant {
    fn power_on(&mut self, now: Mono, out: &mut Outbox) {
        let mut inner = Outbox::default();
        self.device.power_on(now, &mut inner);
        self.send(now, &mut inner, out);
    }

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        let mut frame = *frame;
        self.note(&frame);
        let request = frame.as_eight_bytes().filter(|_| frame.id().number() == 0x600 + u32::from(NODE));
        match (self.deviation, request) {
            (Some(Deviation::Answers(answer)), Some(request)) => {
                if let Some(answer) = answer(&mut self.memory, request) {
                    let id = CanId::standard(0x580 + u16::from(NODE)).expect("an identifier");
                    out.send(Frame::full(id, answer));
                    return;
                }
            }
            (Some(Deviation::Ignores(ignores)), _) if ignores(&mut self.memory, now.since_start(), &frame) => return,
            (Some(Deviation::Takes(take) | Deviation::Both(take, _)), _) => frame = take(&mut self.memory, &frame),
            _ => {}
        }
        let mut inner = Outbox::default();
        self.device.receive(now, &frame, &mut inner);
        self.send(now, &mut inner, out);
        if let (Some(Deviation::Lss(answer)), CanId::LSS_MASTER, Some(request)) =
            (self.deviation, frame.id(), frame.as_eight_bytes())
            && let Some(answer) = answer(&mut self.memory, request)
        {
            out.send(Frame::full(CanId::LSS_SLAVE, answer));
        }
        if let Some(Deviation::Adds(add)) = self.deviation
            && let Some(further) = add(&mut self.memory, &frame)
        {
            let mut inner = Outbox::default();
            self.device.receive(now, &further, &mut inner);
            self.send(now, &mut inner, out);
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if self.next_look <= now {
            self.look(now, out);
        }
        if self.device.next_wake().is_some_and(|due| due <= now) {
            let mut inner = Outbox::default();
            self.device.wake(now, &mut inner);
            self.send(now, &mut inner, out);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.device.next_wake().into_iter().chain([self.next_look]).min()
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.device.sent(now, frame);
    }

    fn tuning(&self) -> Tuning {
        self.device.tuning()
    }

    fn on_bus_bit_rate(&mut self, bit_rate: u32) {
        self.device.on_bus_bit_rate(bit_rate);
    }
}
