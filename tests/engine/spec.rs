//! A scenario: the bench, the faults, the command, and the interruptions. Every part is a plain value, so that a
//! failing scenario can be reduced piece by piece.

use crate::command::Command;
use crate::deviation::Deviation;
use cangauge::bus::coded::Codec;

#[derive(Clone, Debug)]
pub(crate) struct Spec {
    pub(crate) timeout_ms: u64,
    pub(crate) retries: u32,
    pub(crate) queue: usize,
    /// The text between the program and the bus.
    pub(crate) codec: Option<(Codec, u64)>,
    pub(crate) devices: Vec<DeviceSpec>,
    pub(crate) others: Vec<Other>,
    pub(crate) faults: Vec<Fault>,
    /// In µs.
    pub(crate) interrupts: Vec<u64>,
    pub(crate) kill: Option<Kill>,
    pub(crate) command: Command,
}

/// The program is killed, and the same command is run again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kill {
    /// The first frame that is not sent, counted from 0.
    pub(crate) before: u64,
    pub(crate) again_ms: u64,
}

#[derive(Clone, Debug)]
pub(crate) struct DeviceSpec {
    pub(crate) kind: &'static str,
    pub(crate) node: Option<u8>,
    pub(crate) serial: u32,
    pub(crate) start: bool,
    pub(crate) heartbeat_ms: Option<u16>,
    /// At a bit rate other than that of the bus the device neither receives nor sends.
    pub(crate) bit_rate: Option<u32>,
    pub(crate) latency_us: u64,
    /// Written to 1017h before the command, and not saved.
    pub(crate) unsaved_heartbeat: Option<u16>,
    pub(crate) event_timer_ms: Option<u16>,
    pub(crate) overload: bool,
    pub(crate) device_faults: Vec<DeviceFault>,
    pub(crate) deviation: Option<Deviation>,
}

/// A fault of a device.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DeviceFault {
    /// A short power failure.
    ResetAt {
        ms: u64,
    },
    Hang {
        from_ms: u64,
        for_ms: u64,
    },
    /// The device rejects every SDO request for this index.
    Refuse {
        index: u16,
        code: u32,
    },
    /// The n-th SDO answer is not sent.
    Lose {
        nth: u64,
    },
    Late {
        nth: u64,
        ms: u64,
    },
    Twice {
        nth: u64,
    },
    Garbled {
        nth: u64,
        place: usize,
        turned: u8,
    },
    /// The n-th SDO answer has the COB-ID of another node.
    As {
        nth: u64,
        node: u8,
    },
    LoseLss(u8),
    LateLss(u8, u64),
    RefuseLss(u8),
    EndlessFastscan,
    OfflineAfterReset,
    /// The device sends emergencies with an unknown code, periodically.
    SendsEmergencies {
        from_ms: u64,
        for_ms: u64,
        every_us: u64,
    },
}

/// Another participant on the bus.
#[derive(Clone, Debug)]
pub(crate) enum Other {
    /// A second master: its frames with their moments in µs. It also requests the segments of strings.
    Master { plan: Vec<(u64, Act)> },
    /// Sends meaningless frames with this period in µs.
    NoiseSender { every_us: u64, seed: u64, uses_canopen_ids: bool },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Act {
    Read {
        node: u8,
        index: u16,
        sub: u8,
    },
    Write {
        node: u8,
        index: u16,
        sub: u8,
        value: u32,
        bytes: u8,
    },
    Nmt {
        specifier: u8,
        node: u8,
    },
    /// Switches all LSS slaves to waiting state.
    LssWait,
    Sync,
}

/// A fault between the program and the bus. Frames are counted separately for each direction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Fault {
    Lose(u64),
    LoseSent(u64),
    Duplicate(u64),
    Delay(u64, u64),
    Garble(u64, usize, u8),
    Truncate(u64, usize),
    QueueFull(u64),
    Full { at_us: u64, for_ms: u64 },
    Down { at_us: u64, for_ms: Option<u64> },
    BusOff { at_us: u64, for_ms: Option<u64> },
}

impl Spec {
    /// Whether frames change on the way or are sent under a false identifier: values then prove nothing.
    pub(crate) fn falsifies_data(&self) -> bool {
        let faults = self.faults.iter().any(|fault| matches!(fault, Fault::Garble(..) | Fault::Truncate(..)));
        let uses_canopen_ids =
            self.others.iter().any(|other| matches!(other, Other::NoiseSender { uses_canopen_ids: true, .. }));
        faults
            || uses_canopen_ids
            || self
                .device_faults()
                .any(|device_fault| matches!(device_fault, DeviceFault::Garbled { .. } | DeviceFault::As { .. }))
    }

    pub(crate) fn device_faults(&self) -> impl Iterator<Item = &DeviceFault> {
        self.devices.iter().flat_map(|device| &device.device_faults)
    }

    pub(crate) fn acts(&self) -> impl Iterator<Item = &Act> {
        self.others
            .iter()
            .flat_map(|other| match other {
                Other::Master { plan } => plan.as_slice(),
                Other::NoiseSender { .. } => &[],
            })
            .map(|(_, act)| act)
    }

    /// Whether anything but the program changes a device.
    pub(crate) fn is_changed_by_others(&self) -> bool {
        self.acts().any(|act| !matches!(act, Act::Read { .. }))
            || self.device_faults().any(|device_fault| {
                matches!(device_fault, DeviceFault::ResetAt { .. } | DeviceFault::OfflineAfterReset)
            })
    }

    pub(crate) fn shares_node_ids(&self) -> bool {
        let nodes: Vec<u8> = self.devices.iter().filter_map(|device| device.node).collect();
        (1..nodes.len()).any(|at| nodes[..at].contains(&nodes[at]))
    }

    /// Whether frames are late, repeated or reordered.
    pub(crate) fn is_disordered(&self) -> bool {
        self.faults.iter().any(|fault| matches!(fault, Fault::Duplicate(_) | Fault::Delay(..)))
            || self.device_faults().any(|device_fault| {
                matches!(device_fault, DeviceFault::Late { .. } | DeviceFault::Twice { .. } | DeviceFault::LateLss(..))
            })
    }

    pub(crate) fn loses_sent(&self) -> bool {
        self.faults.iter().any(|fault| {
            matches!(fault, Fault::LoseSent(_) | Fault::Full { .. } | Fault::Down { .. } | Fault::BusOff { .. })
        })
    }

    /// Whether the scenario has no fault at all.
    pub(crate) fn is_clean(&self) -> bool {
        self.faults.is_empty()
            && self.others.is_empty()
            && self.interrupts.is_empty()
            && self.kill.is_none()
            && self.device_faults().next().is_none()
            && !self.shares_node_ids()
            && self
                .devices
                .iter()
                .all(|device| device.bit_rate.is_none() && device.latency_us < 20_000 && device.deviation.is_none())
    }

    /// Whether all faults are between the program and the bus.
    pub(crate) fn has_only_bus_faults(&self) -> bool {
        Spec { faults: Vec::new(), interrupts: Vec::new(), kill: None, ..self.clone() }.is_clean()
    }
}
