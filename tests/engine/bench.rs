//! Builds the bench of a [`Spec`].

use crate::carry_out::node;
use crate::command::Command;
use crate::kinds::{LARGE_KIND, LARGE_OBJECTS, filler, model};
use crate::spec::{DeviceFault, DeviceSpec, Fault, Other, Spec};
use crate::station::{FaultyDevice, NoiseSender, SecondMaster, write};
use cangauge::bus::Mono;
use cangauge::bus::faults::FaultPlan;
use cangauge::bus::memory::{BIT_RATE, Clock, MemoryBus};
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::DataType;
use cangauge::device::catalog::Model;
use cangauge::device::scalar::Scalar;
use cangauge::sim::{Device, Direction, OfflineAfter, Overload, Recorder, Setup, State};
use cangauge::tasks::lss::LssAddress;
use std::sync::Arc;
use std::time::Duration;

/// The state of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct DeviceState {
    pub(crate) node: Option<u8>,
    pub(crate) bit_rate: Option<u32>,
    pub(crate) stored: (Option<u8>, Option<u32>),
    pub(crate) state: Option<State>,
    pub(crate) configuring: bool,
}

pub(crate) fn device_state(device: &Device) -> DeviceState {
    let number = |node: Option<NodeId>| node.map(NodeId::get);
    let (node, rate) = device.stored();
    DeviceState {
        node: number(device.node()),
        bit_rate: device.bit_rate(),
        stored: (number(node), rate),
        state: device.state(),
        configuring: device.is_configuring(),
    }
}

fn setup(spec: &DeviceSpec) -> Setup {
    let model = model(spec.kind);
    let mut setup = Setup::new(Arc::clone(&model), node(spec.node.unwrap_or(1)));
    setup.node = spec.node.map(node);
    setup.serial = spec.serial;
    setup.start = spec.start;
    setup.bit_rate = spec.bit_rate;
    setup.seed = u64::from(spec.serial);
    let mut set = |object: ObjectId, value: Option<u16>| {
        let writable = model.dictionary.get(object).is_some_and(|entry| entry.access.is_writable());
        setup.set.extend(value.filter(|_| writable).map(|value| (object, Scalar::Integer(value.into()))));
    };
    set(ObjectId::new(0x1017, 0), spec.heartbeat_ms);
    set(ObjectId::new(0x1800, 5), spec.event_timer_ms);
    if spec.overload {
        let (from, until) = (Duration::from_millis(5), Duration::from_millis(400));
        let channel = setup.channels.first().map_or(1, |channel| channel.channel);
        setup.overloads = vec![(channel, Overload { from, until, direction: Direction::High })];
    }
    if spec.kind == LARGE_KIND {
        let kept = LARGE_OBJECTS.map(|(object, length)| (object, filler(length, spec.serial.into())));
        setup.set.extend(kept.map(|(object, bytes)| (object, Scalar::Text(as_text(&model, object, &bytes)))));
    }
    setup.oddities.latency = Duration::from_micros(spec.latency_us);
    for device_fault in &spec.device_faults {
        match device_fault {
            DeviceFault::LoseLss(service) => setup.oddities.lose.push(*service),
            DeviceFault::LateLss(service, ms) => drop(setup.oddities.late.insert(*service, Duration::from_millis(*ms))),
            DeviceFault::RefuseLss(service) => drop(setup.oddities.refuse.insert(*service, 1)),
            DeviceFault::EndlessFastscan => setup.oddities.endless_fastscan = true,
            DeviceFault::OfflineAfterReset => setup.oddities.offline_after.push(OfflineAfter::Reset),
            _ => {}
        }
    }
    setup
}

/// Bytes in the notation of a description.
fn as_text(model: &Model, object: ObjectId, bytes: &[u8]) -> String {
    match model.dictionary.get(object).map(|entry| entry.data_type) {
        Some(DataType::VisibleString) => String::from_utf8_lossy(bytes).into_owned(),
        _ => bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
    }
}

pub(crate) fn plan(faults: &[Fault]) -> FaultPlan {
    let mut plan = FaultPlan::default();
    for fault in faults {
        match *fault {
            Fault::Lose(number) => drop(plan.lose.insert(number)),
            Fault::LoseSent(number) => drop(plan.lose_sent.insert(number)),
            Fault::Duplicate(number) => drop(plan.duplicate.insert(number)),
            Fault::Delay(number, late) => drop(plan.delay.insert(number, Duration::from_millis(late))),
            Fault::Garble(number, place, turned) => drop(plan.garble.insert(number, (place, turned))),
            Fault::Truncate(number, length) => drop(plan.truncate.insert(number, length)),
            Fault::QueueFull(number) => drop(plan.queue_full.insert(number)),
            Fault::Down { at_us, for_ms } => {
                plan.down = Some((Mono::at(Duration::from_micros(at_us)), for_ms.map(Duration::from_millis)));
            }
            Fault::Full { at_us, for_ms } => {
                plan.full = Some((Mono::at(Duration::from_micros(at_us)), Duration::from_millis(for_ms)));
            }
            Fault::BusOff { at_us, for_ms } => {
                plan.bus_off = Some(Mono::at(Duration::from_micros(at_us)));
                plan.restart_after = for_ms.map(Duration::from_millis);
            }
        }
    }
    plan
}

/// The LSS address of a device, from its own dictionary.
pub(crate) fn identity(spec: &DeviceSpec) -> LssAddress {
    let mut device = Device::new(setup(spec)).expect("a device");
    let mut part = |sub| {
        let bytes = device.value(ObjectId::new(0x1018, sub), Mono::START).unwrap_or_default();
        bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte))
    };
    LssAddress::new([part(1), part(2), part(3), part(4)])
}

/// The bus with all participants, switched on.
pub(crate) fn bench(spec: &Spec, recorder: &Recorder) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(BIT_RATE).with_queue_length(spec.queue);
    for (place, device) in spec.devices.iter().enumerate() {
        let made = Device::new(setup(device)).expect("a device").recording(recorder.clone());
        let unsaved = device.node.zip(device.unsaved_heartbeat).map(|(id, time)| write(id, 0x1017, 0, time.into(), 2));
        let mut station = FaultyDevice::new(made, place, device, unsaved);
        if let Command::SdoWrite { node, object, .. } = &spec.command {
            station.watched = (device.node == Some(*node)).then_some(*object);
        }
        bus.attach(station);
    }
    for other in &spec.others {
        match other {
            Other::Master { plan } => bus.attach(SecondMaster::new(plan)),
            Other::NoiseSender { every_us, seed, uses_canopen_ids } => {
                bus.attach(NoiseSender::new(*every_us, *seed, *uses_canopen_ids))
            }
        }
    }
    bus
}
