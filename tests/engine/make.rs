//! From a seed to a [`Spec`].

use crate::random::Random;
use crate::spec::{Act, Command, DeviceSpec, Fault, Other, Spec, Target, Vagary};
use cangauge::canopen::nmt::NmtCommand;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::DataType;
use cangauge::device::catalog;
use cangauge::device::description::Access;
use cangauge::tasks::lss::Via;

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
}

fn device(random: &mut Random, at: u32) -> DeviceSpec {
    let node = *random.pick(&[Some(1), Some(5), Some(7), Some(33), Some(127)]);
    let node = node.map(|node: u8| (node + 11 * u8::try_from(at).expect("few devices") - 1) % 127 + 1);
    DeviceSpec {
        kind: random.pick::<&str>(&KINDS),
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
