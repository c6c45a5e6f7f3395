//! What a seed stands for: a bench, what goes wrong, what is asked for, and when it is interrupted. Everything is
//! spelled out, so that it can be made smaller piece by piece.

use cangauge::canopen::nmt::NmtCommand;
use cangauge::canopen::object::ObjectId;
use cangauge::tasks::lss::Via;

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
    pub(crate) command: Command,
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
    ScansForEver,
    GoneAfterReset,
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
    Read { node: u8, index: u16, sub: u8 },
    Write { node: u8, index: u16, sub: u8, value: u32, bytes: u8 },
    Nmt { specifier: u8, node: u8 },
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
    Down { at_us: u64, for_ms: Option<u64> },
    BusOff { at_us: u64 },
}

#[derive(Clone, Debug)]
pub(crate) enum Target {
    Node(u8),
    /// That of the device at this place.
    Identity(usize),
    Only,
    Unconfigured,
}

#[derive(Clone, Debug)]
pub(crate) enum Command {
    Scan {
        nodes: Vec<u8>,
    },
    Read {
        nodes: Vec<u8>,
    },
    Info {
        node: u8,
    },
    PdoShow {
        node: u8,
    },
    SdoRead {
        node: u8,
        object: ObjectId,
    },
    SdoWrite {
        node: u8,
        object: ObjectId,
        bytes: Vec<u8>,
    },
    Nmt {
        what: NmtCommand,
        nodes: Vec<u8>,
        all: bool,
    },
    NmtState {
        nodes: Vec<u8>,
    },
    NmtProbe {
        node: u8,
    },
    Startup {
        node: u8,
        auto: bool,
    },
    LssScan,
    LssInquire {
        target: Target,
    },
    LssStore {
        target: Target,
    },
    Assign {
        target: Target,
        id: Option<u8>,
        rate: Option<u32>,
        store: bool,
        retime: bool,
        via: Via,
    },
    Map {
        node: u8,
        number: u16,
        items: Vec<&'static str>,
        code: Option<u8>,
        timer_ms: Option<u16>,
        cob_id: Option<u16>,
        keep: bool,
    },
    Autozero {
        node: u8,
        channel: Option<u8>,
        force: bool,
        store: bool,
        dry_run: bool,
    },
    Store {
        node: u8,
        group: u8,
        verify: bool,
    },
    Restore {
        node: u8,
        group: u8,
        reset: bool,
    },
    Unit {
        node: u8,
        signal: Option<&'static str>,
        unit: u32,
    },
    Filter {
        node: u8,
        kind: u8,
        constant: Option<u16>,
    },
    Limits {
        node: u8,
        lower: f64,
        upper: f64,
    },
    Errors {
        node: u8,
        clear: bool,
    },
    Minmax {
        node: u8,
    },
    Log {
        nodes: Vec<u8>,
        sync_ms: Option<u64>,
        poll_ms: Option<u64>,
        duration_ms: u64,
        count: Option<u64>,
        nmt: bool,
    },
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
            || self.vagaries().any(|vagary| matches!(vagary, Vagary::ResetAt { .. } | Vagary::GoneAfterReset))
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
        self.faults.iter().any(|fault| matches!(fault, Fault::LoseSent(_) | Fault::Down { .. } | Fault::BusOff { .. }))
    }

    /// Nothing goes wrong at all.
    pub(crate) fn is_clean(&self) -> bool {
        self.faults.is_empty()
            && self.others.is_empty()
            && self.interrupts.is_empty()
            && self.vagaries().next().is_none()
            && !self.shares_node_ids()
            && self.devices.iter().all(|device| device.bit_rate.is_none() && device.latency_us < 20_000)
    }

    /// Nothing but faults between program and wire goes wrong.
    pub(crate) fn is_clean_but_for_faults(&self) -> bool {
        Spec { faults: Vec::new(), interrupts: Vec::new(), ..self.clone() }.is_clean()
    }

    /// Everything that is left of it when one piece is taken away.
    pub(crate) fn smaller(&self) -> Vec<Spec> {
        let mut all = Vec::new();
        let mut without = |change: &dyn Fn(&mut Spec)| {
            let mut spec = self.clone();
            change(&mut spec);
            all.push(spec);
        };
        (0..self.others.len()).for_each(|at| without(&|spec| drop(spec.others.remove(at))));
        (0..self.faults.len()).for_each(|at| without(&|spec| _ = spec.faults.remove(at)));
        (0..self.interrupts.len()).for_each(|at| without(&|spec| _ = spec.interrupts.remove(at)));
        for (at, device) in self.devices.iter().enumerate() {
            for vagary in 0..device.vagaries.len() {
                without(&|spec| _ = spec.devices[at].vagaries.remove(vagary));
            }
            if device.latency_us > 0 {
                without(&|spec| spec.devices[at].latency_us = 0);
            }
            if device.unsaved_heartbeat.is_some() {
                without(&|spec| spec.devices[at].unsaved_heartbeat = None);
            }
            if device.heartbeat_ms.is_some() {
                without(&|spec| spec.devices[at].heartbeat_ms = None);
            }
            if device.event_timer_ms.is_some() {
                without(&|spec| spec.devices[at].event_timer_ms = None);
            }
            if device.overload {
                without(&|spec| spec.devices[at].overload = false);
            }
        }
        for (at, other) in self.others.iter().enumerate() {
            let Other::Master { plan } = other else { continue };
            for act in 0..plan.len() {
                without(&|spec| {
                    if let Other::Master { plan } = &mut spec.others[at] {
                        plan.remove(act);
                    }
                });
            }
        }
        // The command names devices by their place, so only the last one can go.
        if self.devices.len() > 1 && !matches!(self.command, Command::Assign { target: Target::Identity(_), .. }) {
            without(&|spec| drop(spec.devices.pop()));
            without(&|spec| drop(spec.devices.remove(0)));
        }
        if self.queue < 10 {
            without(&|spec| spec.queue = 10);
        }
        all
    }
}
