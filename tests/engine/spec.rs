//! What a seed stands for: a bench, what goes wrong, what is asked for, and when it is interrupted. Everything is
//! spelled out, so that it can be made smaller piece by piece.

use crate::random::Random;
use cangauge::canopen::nmt::NmtCommand;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::DataType;
use cangauge::device::catalog;
use cangauge::device::description::Access;
use cangauge::tasks::lss::Via;

#[derive(Clone, Debug)]
pub(crate) struct Spec {
    pub(crate) seed: u64,
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

const KINDS: [&str; 13] =
    ["mh4", "mh4", "mh4", "d20", "d20", "mc1609", "mc1609", "dps", "dps", "hydac", "jumo", "baumer", "hydac-old"];
const RATES: [u32; 4] = [125_000, 250_000, 500_000, 1_000_000];
const ABORTS: [u32; 6] = [0x0800_0000, 0x0602_0000, 0x0609_0011, 0x0601_0002, 0x0800_0022, 0x0606_0000];

impl Spec {
    pub(crate) fn of(seed: u64) -> Spec {
        let random = &mut Random::new(seed);
        let mut devices: Vec<DeviceSpec> =
            (0..*random.pick(&[1, 1, 2, 2, 3, 5])).map(|at| device(random, at)).collect();
        let last = devices.len() - 1;
        if last > 0 && random.percent(6) {
            devices[last].node = devices[0].node;
        }
        let timing = (*random.pick(&[50, 100, 500]), *random.pick(&[0, 1, 1, 2]));
        let command = command(random, &devices);
        let mut spec = Spec {
            seed,
            timeout_ms: timing.0,
            retries: timing.1,
            queue: *random.pick(&[10, 10, 10, 1, 2]),
            devices,
            others: Vec::new(),
            faults: Vec::new(),
            interrupts: Vec::new(),
            command,
        };
        // Each kind of trouble now and then, and a quarter of all runs without any.
        if random.percent(75) {
            spec.trouble(random);
        }
        spec
    }

    fn trouble(&mut self, random: &mut Random) {
        if random.percent(60) {
            for _ in 0..random.within(1..=3) {
                let fault = fault(random);
                self.faults.push(fault);
            }
        }
        if random.percent(45) {
            for _ in 0..random.within(1..=2) {
                let at = usize::try_from(random.next() % self.devices.len() as u64).expect("an index");
                let vagary = vagary(random);
                self.devices[at].vagaries.push(vagary);
            }
        }
        if random.percent(18) {
            let plan = (0..random.within(1..=8)).map(|_| (when(random), act(random, &self.devices))).collect();
            self.others.push(Other::Master { plan });
        }
        if random.percent(10) {
            let every_us = *random.pick(&[600, 2_000, 10_000, 100_000]);
            self.others.push(Other::Babbler { every_us, seed: random.next(), nasty: random.percent(30) });
        }
        if random.percent(25) {
            self.interrupts.push(when(random));
            if random.percent(20) {
                self.interrupts.push(when(random));
            }
        }
    }

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
        (0..self.faults.len()).for_each(|at| without(&|spec| drop(spec.faults.remove(at))));
        (0..self.interrupts.len()).for_each(|at| without(&|spec| drop(spec.interrupts.remove(at))));
        for (at, device) in self.devices.iter().enumerate() {
            for vagary in 0..device.vagaries.len() {
                without(&|spec| drop(spec.devices[at].vagaries.remove(vagary)));
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

fn device(random: &mut Random, at: u32) -> DeviceSpec {
    let node = *random.pick(&[Some(1), Some(5), Some(7), Some(33), Some(127)]);
    let node = node.map(|node: u8| (node + 11 * u8::try_from(at).expect("few devices") - 1) % 127 + 1);
    DeviceSpec {
        kind: *random.pick(&KINDS),
        node: node.filter(|_| !random.percent(6)),
        serial: 1000 + at,
        start: random.percent(25),
        heartbeat_ms: random.percent(45).then(|| *random.pick(&[50, 100, 200, 1000])),
        bit_rate: random.percent(2).then(|| *random.pick(&RATES)),
        latency_us: *random.pick(&[0, 0, 300, 2_000, 10_000, 45_000]),
        unsaved_heartbeat: random.percent(15).then_some(150),
        event_timer_ms: random.percent(30).then(|| *random.pick(&[10, 50, 100])),
        overload: random.percent(10),
        vagaries: Vec::new(),
    }
}

/// A moment in µs: early ones more often.
fn when(random: &mut Random) -> u64 {
    let most = *random.pick(&[2_000, 20_000, 100_000, 600_000, 4_000_000]);
    random.within(0..=most)
}

/// The number of a frame: early ones more often.
fn nth(random: &mut Random) -> u64 {
    let most = *random.pick(&[4, 15, 40, 100, 200]);
    random.within(0..=most)
}

fn fault(random: &mut Random) -> Fault {
    let number = nth(random);
    match random.within(0..=10) {
        0 | 1 => Fault::Lose(number),
        2 | 3 => Fault::LoseSent(number),
        4 => Fault::Duplicate(number),
        5 => Fault::Delay(number, *random.pick(&[1, 5, 30, 120, 700, 2_000])),
        6 => Fault::Garble(number, usize::from(random.byte(0..=7)), random.byte(1..=255)),
        7 => Fault::Truncate(number, usize::from(random.byte(0..=7))),
        8 => Fault::QueueFull(number),
        9 => Fault::Down { at_us: when(random), for_ms: random.percent(40).then(|| random.within(1..=500)) },
        _ if random.percent(50) => Fault::BusOff { at_us: when(random) },
        _ => Fault::Lose(number + 1),
    }
}

fn vagary(random: &mut Random) -> Vagary {
    let nth = nth(random);
    match random.within(0..=13) {
        0 => Vagary::ResetAt { ms: when(random) / 1000 },
        1 => Vagary::Hang { from_ms: when(random) / 1000, for_ms: *random.pick(&[20, 200, 2_000, 1_000_000]) },
        2 | 3 => {
            let index =
                [0x1000, 0x1017, 0x1018, 0x1008, 0x1010, 0x1011, 0x1800, 0x1a00, 0x6125, 0x6131, 0x61a0, 0x2320];
            Vagary::Refuse { index: *random.pick(&index), code: *random.pick(&ABORTS) }
        }
        4 | 5 => Vagary::Lose { nth },
        6 => Vagary::Late { nth, ms: *random.pick(&[20, 60, 120, 600, 3_500]) },
        7 => Vagary::Twice { nth },
        8 => Vagary::Garbled { nth, place: usize::from(random.byte(0..=7)), turned: random.byte(1..=255) },
        9 => Vagary::As { nth, node: *random.pick(&[1, 5, 12, 16, 127]) },
        10 => Vagary::LoseLss(*random.pick(&[0x11, 0x13, 0x17, 0x43, 0x4b, 0x5e, 0x5a])),
        11 => {
            Vagary::LateLss(*random.pick(&[0x11, 0x13, 0x17, 0x43, 0x5e]), *random.pick(&[60, 300, 700, 2_500, 4_000]))
        }
        12 => Vagary::RefuseLss(*random.pick(&[0x11, 0x13, 0x17])),
        _ if random.percent(50) => Vagary::GoneAfterReset,
        _ => Vagary::ScansForEver,
    }
}

fn act(random: &mut Random, devices: &[DeviceSpec]) -> Act {
    let node = random.pick(devices).node.unwrap_or(5);
    let (index, sub) =
        *random.pick(&[(0x1000, 0), (0x1008, 0), (0x1017, 0), (0x1018, 4), (0x6130, 1), (0x1a00, 0), (0x100a, 0)]);
    match random.within(0..=9) {
        0..=5 => Act::Read { node, index, sub },
        6 | 7 => Act::Write { node, index: 0x1017, sub: 0, value: *random.pick(&[0, 77, 500]), bytes: 2 },
        _ => {
            Act::Nmt { specifier: *random.pick(&[0x01, 0x02, 0x80, 0x81, 0x82]), node: *random.pick(&[node, node, 0]) }
        }
    }
}

/// A node that is there, or seldom one that is not.
fn node(random: &mut Random, devices: &[DeviceSpec]) -> u8 {
    let there = random.pick(devices).node;
    there.filter(|_| !random.percent(6)).unwrap_or_else(|| random.byte(1..=127))
}

fn nodes(random: &mut Random, devices: &[DeviceSpec]) -> Vec<u8> {
    let mut all: Vec<u8> = devices.iter().filter_map(|device| device.node).filter(|_| random.percent(70)).collect();
    if all.is_empty() || random.percent(5) {
        all.push(node(random, devices));
    }
    all.sort_unstable();
    all.dedup();
    all
}

fn target(random: &mut Random, devices: &[DeviceSpec]) -> Target {
    match random.within(0..=9) {
        0..=4 => Target::Node(node(random, devices)),
        5..=7 => Target::Identity(usize::try_from(random.next() % devices.len() as u64).expect("an index")),
        8 => Target::Only,
        _ => Target::Unconfigured,
    }
}

/// An object of the device at a node, what can be written to it among those that are plain memory.
fn object(random: &mut Random, devices: &[DeviceSpec], node: u8, write: bool) -> Option<(ObjectId, DataType)> {
    let kind = devices.iter().find(|device| device.node == Some(node))?.kind;
    let model = catalog::by_name(kind)?;
    let may = |object: ObjectId, access: Access, data_type: DataType| {
        if !write {
            return access != Access::Wo;
        }
        let acts = matches!(object.index, 0x1003 | 0x1010 | 0x1011 | 0x1800..=0x1bff | 0x2000..=0x5fff)
            || matches!(object.index & 0x0fff, 0x125 | 0x131 | 0x132);
        access == Access::Rw && !acts && matches!(data_type, DataType::Unsigned(1 | 2 | 4))
    };
    let all: Vec<(ObjectId, DataType)> = model
        .dictionary
        .iter()
        .filter(|entry| may(entry.object, entry.access, entry.data_type))
        .map(|entry| (entry.object, entry.data_type))
        .collect();
    (!all.is_empty()).then(|| *random.pick(&all))
}

fn command(random: &mut Random, devices: &[DeviceSpec]) -> Command {
    let one = node(random, devices);
    match random.within(0..=33) {
        0 if random.percent(20) => Command::Scan { nodes: (1..=127).collect() },
        0 | 1 => Command::Scan { nodes: nodes(random, devices) },
        2 | 3 => Command::Read { nodes: nodes(random, devices) },
        4 => Command::Info { node: one },
        5 => Command::PdoShow { node: one },
        6 | 7 => {
            let object = object(random, devices, one, false).map_or(ObjectId::new(0x1000, 0), |(object, _)| object);
            Command::SdoRead { node: one, object }
        }
        8 | 9 => {
            let (object, data_type) =
                object(random, devices, one, true).unwrap_or((ObjectId::new(0x1017, 0), DataType::Unsigned(2)));
            let value = *random.pick(&[0u32, 1, 2, 50, 100, 1000]);
            let bytes = value.to_le_bytes()[..data_type.width().unwrap_or(4)].to_vec();
            Command::SdoWrite { node: one, object, bytes }
        }
        10 | 11 => {
            let what = [
                NmtCommand::Start,
                NmtCommand::Stop,
                NmtCommand::EnterPreOperational,
                NmtCommand::ResetNode,
                NmtCommand::ResetCommunication,
            ];
            Command::Nmt { what: *random.pick(&what), nodes: nodes(random, devices), all: random.percent(10) }
        }
        12 => Command::NmtState { nodes: nodes(random, devices) },
        13 => Command::NmtProbe { node: one },
        14 => Command::Startup { node: one, auto: random.percent(50) },
        // What asks all 127 takes its time.
        15 if random.percent(15) => Command::LssScan,
        15 if random.percent(40) => Command::LssInquire { target: target(random, devices) },
        15 => Command::LssStore { target: target(random, devices) },
        16 => Command::SdoRead { node: one, object: ObjectId::new(0x1008, 0) },
        17 | 18 => Command::Assign {
            target: target(random, devices),
            id: random.percent(85).then(|| *random.pick(&[1, 2, 5, 12, 16, 55, 127])),
            rate: random.percent(25).then(|| *random.pick(&RATES)),
            store: random.percent(80),
            retime: random.percent(10),
            via: *random.pick(&[Via::Auto, Via::Auto, Via::Lss, Via::Sdo]),
        },
        19..=22 => Command::Map {
            node: one,
            number: *random.pick(&[1, 1, 2, 3]),
            items: random
                .pick(&[
                    &[][..],
                    &["pressure"],
                    &["pressure", "temperature"],
                    &["ch1"],
                    &["ch3", "ch1"],
                    &["pressure.status"],
                ])
                .to_vec(),
            code: random.percent(60).then(|| *random.pick(&[1, 2, 240, 254, 255])),
            timer_ms: random.percent(50).then(|| *random.pick(&[0, 10, 100, 1000])),
            cob_id: random.percent(20).then(|| *random.pick(&[0x191, 0x185, 0x281, 0x3ff])),
            keep: random.percent(30),
        },
        23 | 24 => Command::Autozero {
            node: one,
            channel: *random.pick(&[None, Some(1)]),
            force: random.percent(50),
            store: random.percent(50),
            dry_run: random.percent(15),
        },
        25 => Command::Store { node: one, group: random.byte(0..=2), verify: random.percent(50) },
        26 => Command::Restore { node: one, group: random.byte(0..=2), reset: random.percent(60) },
        27 => Command::Unit {
            node: one,
            signal: *random.pick(&[None, Some("pressure"), Some("temperature"), Some("ch1")]),
            unit: *random.pick(&[0x00ab_0000, 0x004e_0000, 0x0622_0000, 0x002d_0000, 0x00ac_0000]),
        },
        28 => Command::Filter {
            node: one,
            kind: random.byte(0..=3),
            constant: random.percent(60).then(|| *random.pick(&[1, 8, 50])),
        },
        29 => Command::Limits {
            node: one,
            lower: *random.pick(&[0.0, 1.5, -3.0]),
            upper: *random.pick(&[2.0, 9.0, 40.0]),
        },
        30 => Command::Errors { node: one, clear: random.percent(60) },
        31 => Command::Minmax { node: one },
        _ => {
            let how = random.within(0..=4);
            Command::Log {
                nodes: nodes(random, devices),
                sync_ms: (how == 0).then(|| *random.pick(&[10, 50])),
                poll_ms: (how == 1).then(|| *random.pick(&[20, 100])),
                duration_ms: *random.pick(&[100, 400, 1000]),
                count: random.percent(20).then(|| random.within(1..=30)),
                nmt: random.percent(85),
            }
        }
    }
}
