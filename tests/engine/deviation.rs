//! Devices that always differ from the standard in one point. A scenario with such a device has no faults.

use crate::command::{Command, Expected, How, Measuring};
use crate::kinds::model;
use crate::random::Random;
use crate::spec::{DeviceSpec, Spec};
use crate::station::write;
use cangauge::bus::Mono;
use cangauge::bus::memory::{Outbox, Station};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::nmt::NmtCommand;
use cangauge::canopen::object::ObjectId;
use cangauge::master::BlockMode;
use cangauge::sim::Device;

/// A deviation from the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Deviation {
    /// Reads of this index are not answered.
    Silent(u16),
    /// The toggle bit of segments is always 1.
    WrongToggle,
    /// Every SDO answer is sent twice.
    Twice,
    /// Writes are acknowledged with index and sub-index 0.
    IndexZero,
    /// Heartbeats have this many bytes.
    Heartbeat(usize),
    /// TPDOs have this many bytes.
    Pdo(usize),
    /// It has neither a profile nor a known vendor. The types of its objects are then unknown.
    Unidentified,
    /// TPDO1 contains its pressure as INTEGER16 with too many decimal digits: the value is clipped.
    Clips,
    /// Another device has the same node-ID.
    DuplicateId,
    /// It sends no TPDO.
    NoTpdo(TpdoFault),
}

/// Why a device sends no TPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TpdoFault {
    Disabled,
    OnRequest,
    SlowTimer,
    WaitsForSync,
    FewSyncs,
    LeavesOperational,
    Stops,
    /// It stops, and has no heartbeat. Node guarding shows the state.
    StopsWithoutHeartbeat,
    /// It leaves OPERATIONAL and sends the emergency FF00h.
    Emergency,
    /// It neither receives nor sends after the start.
    Offline,
    /// The same, and it has no heartbeat.
    OfflineWithoutHeartbeat,
    NothingMapped,
    /// Its mapping is that of a multiplexed PDO (1A00h:0 is FEh).
    Multiplexed,
    /// Everything is set up, and it does not send.
    NotSent,
}

impl TpdoFault {
    /// The text that the failure of `log` must contain.
    pub(crate) fn reason(self) -> &'static str {
        match self {
            TpdoFault::Disabled => "(bit 31 of 1800h:1)",
            TpdoFault::OnRequest => "is sent on remote request only (1800h:2",
            TpdoFault::SlowTimer => "is longer than the wait (1800h:5 is 60000 ms)",
            TpdoFault::WaitsForSync => "waits for SYNC, and no node sends SYNC",
            TpdoFault::FewSyncs => "is sent at every 240th SYNC",
            TpdoFault::LeavesOperational => "it is pre-operational again after the start",
            TpdoFault::Stops => "it is stopped after the start",
            TpdoFault::StopsWithoutHeartbeat => "it is stopped",
            TpdoFault::Emergency => "it is pre-operational again after the start, emergency FF00h",
            TpdoFault::Offline => "its heartbeat stopped",
            TpdoFault::OfflineWithoutHeartbeat => "it does not answer: it is stopped, or has no power or cable",
            TpdoFault::NothingMapped => "nothing is mapped to TPDO1 (1A00h:0 is 0)",
            TpdoFault::Multiplexed => "is a multiplexed PDO (1A00h:0 is FEh)",
            TpdoFault::NotSent => "is due ",
        }
    }

    /// The writes to the parameters of a TPDO that cause this: sub-index, number of bytes, value.
    fn settings(self, device: &mut Device, index: u16) -> Vec<(u8, u8, u32)> {
        match self {
            TpdoFault::Disabled => {
                let bytes = device.value(ObjectId::new(index, 1), Mono::START).unwrap_or_default();
                let cob_id = bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte));
                vec![(1, 4, cob_id | 0x8000_0000)]
            }
            TpdoFault::OnRequest => vec![(2, 1, 253)],
            TpdoFault::SlowTimer => vec![(2, 1, 254), (5, 2, 60_000)],
            TpdoFault::WaitsForSync | TpdoFault::NotSent => vec![(2, 1, 1), (5, 2, 0)],
            TpdoFault::FewSyncs => vec![(2, 1, 240), (5, 2, 0)],
            _ => Vec::new(),
        }
    }

    /// Sets up the TPDOs. Returns whether the device accepts that.
    fn set_up(self, device: &mut Device, now: Mono, node: u8) -> bool {
        let mut accepted = true;
        for index in 0x1800..0x1810 {
            if device.value(ObjectId::new(index, 1), now).is_none() {
                continue;
            }
            for (sub, bytes, value) in self.settings(device, index) {
                device.receive(now, &write(node, index, sub, value, bytes), &mut Outbox::default());
                let held = device.value(ObjectId::new(index, sub), now);
                // A device without event timer cannot have a slow one.
                accepted &= value == 0 || held.as_deref() == Some(&value.to_le_bytes()[..usize::from(bytes)]);
            }
        }
        accepted
    }
}

impl Deviation {
    /// Changes the device after power-on. Returns whether it then has the deviation.
    pub(crate) fn power_on(self, device: &mut Device, now: Mono) -> bool {
        match (self, device.node()) {
            (Deviation::NoTpdo(fault), Some(node)) => fault.set_up(device, now, node.get()),
            (Deviation::Clips, Some(node)) => clip(device, now, node.get()),
            _ => true,
        }
    }

    /// Whether the device ignores a frame.
    pub(crate) fn ignores(self, frame: &Frame) -> bool {
        match (self, frame.data()) {
            (Deviation::Silent(index), [0x40, low, high, ..]) => {
                frame.id().sdo_request_node().is_some() && u16::from_le_bytes([*low, *high]) == index
            }
            _ => false,
        }
    }

    /// Whether the device does not send a frame.
    pub(crate) fn drops(self, frame: &Frame) -> bool {
        matches!(self, Deviation::NoTpdo(TpdoFault::Multiplexed | TpdoFault::NothingMapped | TpdoFault::NotSent))
            && is_tpdo(frame)
    }

    /// The NMT command that the device executes by itself when it becomes operational, and its emergency.
    pub(crate) fn own_command(self, node: NodeId) -> Option<(Frame, Option<Frame>)> {
        let specifier = match self {
            Deviation::NoTpdo(TpdoFault::LeavesOperational | TpdoFault::Emergency) => NmtCommand::EnterPreOperational,
            Deviation::NoTpdo(TpdoFault::Stops | TpdoFault::StopsWithoutHeartbeat) => NmtCommand::Stop,
            _ => return None,
        };
        let emergency = Frame::full(CanId::emergency(node), [0x00, 0xff, 0x81, 0, 0, 0, 0, 0]);
        let sends = self == Deviation::NoTpdo(TpdoFault::Emergency);
        Some((Frame::pair(CanId::NMT, specifier.specifier(), node.get()), sends.then_some(emergency)))
    }

    /// The frame as this device sends it. A frame that was changed before stays as it is.
    pub(crate) fn changed(self, frame: Frame) -> Frame {
        let mut data = frame.data().to_vec();
        let id = frame.id();
        match (self, id.sdo_response_node(), data.as_mut_slice()) {
            (Deviation::WrongToggle, Some(_), [first, ..]) if *first >> 5 == 0 => *first |= 0x10,
            (Deviation::IndexZero, Some(_), [0x60, rest @ ..]) => rest.fill(0),
            (Deviation::Unidentified, Some(_), [_, 0x00, 0x10, 0, value @ ..]) => value.fill(0),
            (Deviation::Unidentified, Some(_), [_, 0x18, 0x10, 1, value @ ..]) => {
                value.copy_from_slice(&[0x77, 0, 0, 0x7f])
            }
            (Deviation::NoTpdo(fault @ (TpdoFault::Multiplexed | TpdoFault::NothingMapped)), Some(_), answer) => {
                match answer {
                    [0x40..=0x4f, 0..=0x0f, 0x1a, 0, count, ..] => {
                        *count = if fault == TpdoFault::Multiplexed { 0xfe } else { 0 };
                    }
                    _ => return frame,
                }
            }
            (Deviation::Heartbeat(length), None, _) if id.heartbeat_node().is_some() => data.resize(length, 0),
            (Deviation::Pdo(length), None, _) if is_tpdo(&frame) => data.resize(length, 0),
            _ => return frame,
        }
        Frame::new(id, &data).unwrap_or(frame)
    }

    /// Whether the device changes its NMT state itself.
    pub(crate) fn has_own_state(self) -> bool {
        let faults = [
            TpdoFault::LeavesOperational,
            TpdoFault::Emergency,
            TpdoFault::Stops,
            TpdoFault::StopsWithoutHeartbeat,
            TpdoFault::Offline,
            TpdoFault::OfflineWithoutHeartbeat,
        ];
        faults.into_iter().any(|fault| self == Deviation::NoTpdo(fault))
    }

    /// Whether the deviation has no effect on the results of the program.
    pub(crate) fn is_harmless(self) -> bool {
        !matches!(
            self,
            Deviation::Unidentified
                | Deviation::Clips
                | Deviation::DuplicateId
                | Deviation::NoTpdo(_)
                | Deviation::Pdo(0..=7)
        )
    }
}

/// Maps 7130h:1 with five decimal digits. Returns whether its value is then clipped.
fn clip(device: &mut Device, now: Mono, node: u8) -> bool {
    let number = |bytes: Vec<u8>| bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte));
    let cob_id = device.value(ObjectId::new(0x1800, 1), now).map_or(0, number);
    let writes = [
        (0x1800, 1, cob_id | 0x8000_0000, 4),
        (0x1a00, 0, 0, 1),
        (0x1a00, 1, 0x7130_0110, 4),
        (0x1a00, 0, 1, 1),
        (0x1800, 2, 1, 1),
        (0x1800, 1, cob_id, 4),
        (0x6132, 1, 5, 1),
    ];
    for (index, sub, value, bytes) in writes {
        device.receive(now, &write(node, index, sub, value, bytes), &mut Outbox::default());
    }
    let is_mapped = device.value(ObjectId::new(0x1a00, 1), now).map(number) == Some(0x7130_0110);
    is_mapped && device.value(ObjectId::new(0x7130, 1), now) == Some(i16::MAX.to_le_bytes().to_vec())
}

fn is_tpdo(frame: &Frame) -> bool {
    (0x180..0x580).contains(&frame.id().number())
}

impl Spec {
    /// Gives one device a deviation, and chooses a command that is affected by it.
    pub(crate) fn add_deviation(&mut self, random: &mut Random) {
        let fits = |device: &&mut DeviceSpec| {
            device.node.is_some() && model(device.kind).dictionary.get(ObjectId::new(0x1800, 1)).is_some()
        };
        let Some(device) = self.devices.iter_mut().find(fits) else { return };
        let node = device.node.expect("it has one");
        let deviation = deviation(random);
        device.deviation = Some(deviation);
        device.start = false;
        if matches!(deviation, Deviation::Heartbeat(_) | Deviation::NoTpdo(_)) {
            let has_no_heartbeat = matches!(
                deviation,
                Deviation::NoTpdo(TpdoFault::StopsWithoutHeartbeat | TpdoFault::OfflineWithoutHeartbeat)
            );
            device.heartbeat_ms = (!has_no_heartbeat).then_some(100);
        }
        self.timeout_ms = 100;
        (self.others, self.faults, self.interrupts, self.kill) = Default::default();
        for device in &mut self.devices {
            device.device_faults.clear();
            device.bit_rate = None;
            device.latency_us = device.latency_us.min(2_000);
            device.unsaved_heartbeat = None;
        }
        self.command = command(deviation, node, random);
        let place = self.devices.iter().position(|device| device.deviation.is_some()).expect("it was chosen");
        if deviation == Deviation::Clips {
            self.devices[place].kind = "mh4";
        }
        if deviation == Deviation::DuplicateId {
            let kind = if random.percent(50) { self.devices[place].kind } else { *random.pick(&["mh4", "dps", "d20"]) };
            let serial = self.devices[place].serial + 50;
            self.devices.push(DeviceSpec { kind, serial, deviation: None, ..self.devices[place].clone() });
        }
    }
}

fn deviation(random: &mut Random) -> Deviation {
    let faults = [
        TpdoFault::Disabled,
        TpdoFault::OnRequest,
        TpdoFault::SlowTimer,
        TpdoFault::WaitsForSync,
        TpdoFault::FewSyncs,
        TpdoFault::LeavesOperational,
        TpdoFault::Stops,
        TpdoFault::StopsWithoutHeartbeat,
        TpdoFault::Emergency,
        TpdoFault::Offline,
        TpdoFault::OfflineWithoutHeartbeat,
        TpdoFault::NothingMapped,
        TpdoFault::Multiplexed,
        TpdoFault::NotSent,
    ];
    match random.within(0..=13) {
        11 => Deviation::Clips,
        12 | 13 => Deviation::DuplicateId,
        0 => Deviation::Silent(*random.pick(&[0x1008, 0x1009, 0x100a, 0x1018])),
        1 => Deviation::WrongToggle,
        2 => Deviation::Twice,
        3 => Deviation::IndexZero,
        4 => Deviation::Heartbeat(*random.pick(&[2, 3, 8])),
        5 => Deviation::Pdo(8),
        6 => Deviation::Pdo(*random.pick(&[0, 1])),
        7 => Deviation::Unidentified,
        _ => Deviation::NoTpdo(*random.pick(&faults)),
    }
}

/// A command that is affected by the deviation.
fn command(deviation: Deviation, node: u8, random: &mut Random) -> Command {
    let log = |sync_ms, poll_ms| Command::Log {
        nodes: vec![node],
        sync_ms,
        poll_ms,
        duration_ms: 2500,
        count: None,
        nmt: true,
    };
    let how = How { blocks: BlockMode::Auto, described: false };
    let heartbeat = ObjectId::new(0x1017, 0);
    let of_values = [
        Command::Read { nodes: vec![node] },
        Command::Scan { nodes: vec![node] },
        Command::Info { node },
        log(Some(50), None),
        log(None, Some(100)),
    ];
    let own = match deviation {
        Deviation::Silent(_) | Deviation::WrongToggle | Deviation::Unidentified => of_values.to_vec(),
        Deviation::Twice => [
            of_values.to_vec(),
            vec![
                Command::SdoRead { node, object: heartbeat, how },
                Command::Check {
                    nodes: vec![node],
                    expected: vec![Expected { signal: "ch1", low: -1e9, high: 1e9 }],
                    how: Measuring::Once,
                    excuse: false,
                },
            ],
        ]
        .concat(),
        Deviation::Clips => vec![
            log(Some(50), None),
            Command::PdoWatch { nodes: vec![node], for_ms: 500 },
            Command::Check {
                nodes: vec![node],
                expected: vec![Expected { signal: "pressure", low: -1e9, high: 1e9 }],
                how: Measuring::Sync { ms: 50, for_ms: 500 },
                excuse: false,
            },
        ],
        Deviation::DuplicateId => [
            of_values.to_vec(),
            vec![
                Command::SdoRead { node, object: ObjectId::new(0x1018, 4), how },
                Command::SdoWrite { node, object: heartbeat, bytes: vec![200, 0], how },
                Command::Check {
                    nodes: vec![node],
                    expected: vec![Expected { signal: "pressure", low: -1e9, high: 1e9 }],
                    how: Measuring::Once,
                    excuse: false,
                },
                Command::Unit { node, signal: None, unit: 0x00ab_0000 },
                Command::Store { node, group: 0, verify: false },
                Command::Limits { node, lower: 0.0, upper: 5.0 },
            ],
        ]
        .concat(),
        Deviation::IndexZero => vec![Command::SdoWrite { node, object: heartbeat, bytes: vec![200, 0], how }],
        Deviation::Heartbeat(_) => {
            let what = [NmtCommand::Start, NmtCommand::Stop, NmtCommand::EnterPreOperational];
            let what = *random.pick(&what);
            vec![
                Command::Nmt { what, nodes: vec![node], all: false },
                Command::NmtState { nodes: vec![node] },
                log(Some(50), None),
            ]
        }
        Deviation::NoTpdo(TpdoFault::WaitsForSync | TpdoFault::SlowTimer) => vec![log(None, None)],
        Deviation::NoTpdo(_) | Deviation::Pdo(_) => vec![log(Some(50), None)],
    };
    random.pick(&own).clone()
}
