//! What a seed stands for: a bench, what goes wrong, what is asked for, and when it is interrupted. Everything is
//! spelled out, so that it can be made smaller piece by piece.

use crate::command::Command;

#[derive(Clone, Debug)]
pub(crate) struct Spec {
    pub(crate) timeout_ms: u64,
    pub(crate) retries: u32,
    pub(crate) queue: usize,
    pub(crate) devices: Vec<DeviceSpec>,
    pub(crate) others: Vec<Other>,
    pub(crate) faults: Vec<Fault>,
    /// In µs.
    pub(crate) interrupts: Vec<u64>,
    pub(crate) kill: Option<Kill>,
    pub(crate) command: Command,
}

/// The program vanishes, and the same command is typed once more.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kill {
    /// The first frame that it does not send, counted from 0.
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
    /// At another one than the bus's it is deaf and mute.
    pub(crate) bit_rate: Option<u32>,
    pub(crate) latency_us: u64,
    /// Written to 1017h before the command, and not saved.
    pub(crate) unsaved_heartbeat: Option<u16>,
    pub(crate) event_timer_ms: Option<u16>,
    pub(crate) overload: bool,
    pub(crate) vagaries: Vec<Vagary>,
}

/// What a device does that it should not.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Vagary {
    /// Its power fails for a moment.
    ResetAt {
        ms: u64,
    },
    Hang {
        from_ms: u64,
        for_ms: u64,
    },
    /// Every SDO request for this index is refused.
    Refuse {
        index: u16,
        code: u32,
    },
    /// The n-th SDO answer never comes.
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
    /// The n-th SDO answer comes under another node-ID.
    As {
        nth: u64,
        node: u8,
    },
    LoseLss(u8),
    LateLss(u8, u64),
    RefuseLss(u8),
    EndlessFastscan,
    OfflineAfterReset,
    /// It sends emergencies that mean nothing, again and again.
    Babbles {
        from_ms: u64,
        for_ms: u64,
        every_us: u64,
    },
}

/// Somebody else on the bus.
#[derive(Clone, Debug)]
pub(crate) enum Other {
    /// A second master: frames at moments in µs; segments of strings are fetched.
    Master { plan: Vec<(u64, Act)> },
    /// Frames that mean nothing to anybody, every so many µs.
    Babbler { every_us: u64, seed: u64, nasty: bool },
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
    /// Everybody back to the waiting state of LSS.
    LssWait,
}

/// What goes wrong between the program and the wire. Frames are counted, each direction for itself.
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
    /// Whether the bytes of frames change on the way, or somebody speaks for a device: then values mean nothing.
    pub(crate) fn lies(&self) -> bool {
        let faults = self.faults.iter().any(|fault| matches!(fault, Fault::Garble(..) | Fault::Truncate(..)));
        let nasty = self.others.iter().any(|other| matches!(other, Other::Babbler { nasty: true, .. }));
        faults || nasty || self.vagaries().any(|vagary| matches!(vagary, Vagary::Garbled { .. } | Vagary::As { .. }))
    }

    pub(crate) fn vagaries(&self) -> impl Iterator<Item = &Vagary> {
        self.devices.iter().flat_map(|device| &device.vagaries)
    }

    pub(crate) fn acts(&self) -> impl Iterator<Item = &Act> {
        self.others
            .iter()
            .flat_map(|other| match other {
                Other::Master { plan } => plan.as_slice(),
                Other::Babbler { .. } => &[],
            })
            .map(|(_, act)| act)
    }

    /// Whether anybody but the program changes what a device holds or does.
    pub(crate) fn is_meddled_with(&self) -> bool {
        self.acts().any(|act| !matches!(act, Act::Read { .. }))
            || self.vagaries().any(|vagary| matches!(vagary, Vagary::ResetAt { .. } | Vagary::OfflineAfterReset))
    }

    pub(crate) fn shares_node_ids(&self) -> bool {
        let nodes: Vec<u8> = self.devices.iter().filter_map(|device| device.node).collect();
        (1..nodes.len()).any(|at| nodes[..at].contains(&nodes[at]))
    }

    /// Frames come late, twice or in another order.
    pub(crate) fn is_disordered(&self) -> bool {
        self.faults.iter().any(|fault| matches!(fault, Fault::Duplicate(_) | Fault::Delay(..)))
            || self
                .vagaries()
                .any(|vagary| matches!(vagary, Vagary::Late { .. } | Vagary::Twice { .. } | Vagary::LateLss(..)))
    }

    pub(crate) fn loses_sent(&self) -> bool {
        self.faults.iter().any(|fault| {
            matches!(fault, Fault::LoseSent(_) | Fault::Full { .. } | Fault::Down { .. } | Fault::BusOff { .. })
        })
    }

    /// Nothing goes wrong at all.
    pub(crate) fn is_clean(&self) -> bool {
        self.faults.is_empty()
            && self.others.is_empty()
            && self.interrupts.is_empty()
            && self.kill.is_none()
            && self.vagaries().next().is_none()
            && !self.shares_node_ids()
            && self.devices.iter().all(|device| device.bit_rate.is_none() && device.latency_us < 20_000)
    }

    /// Nothing but faults between program and wire goes wrong.
    pub(crate) fn is_clean_but_for_faults(&self) -> bool {
        Spec { faults: Vec::new(), interrupts: Vec::new(), kill: None, ..self.clone() }.is_clean()
    }
}
