//! Chooses a command for a bench.

use crate::command::{Command, Expected, How, Measuring, Target};
use crate::kinds::{LARGE_KIND, LARGE_OBJECTS, filler, model};
use crate::make::RATES;
use crate::random::Random;
use crate::spec::DeviceSpec;
use cangauge::canopen::nmt::NmtCommand;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::DataType;
use cangauge::device::description::Access;
use cangauge::master::BlockMode;
use cangauge::tasks::lss::Via;

/// A node of the bench, or sometimes an absent one.
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

/// An object of the device at a node. For writing only objects that have no effect besides their value.
fn object(random: &mut Random, devices: &[DeviceSpec], node: u8, write: bool) -> Option<(ObjectId, DataType)> {
    let model = model(devices.iter().find(|device| device.node == Some(node))?.kind);
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

pub(super) fn command(random: &mut Random, devices: &[DeviceSpec]) -> Command {
    let one = node(random, devices);
    match random.within(0..=47) {
        0 if random.percent(20) => Command::Scan { nodes: (1..=127).collect() },
        0 | 1 => Command::Scan { nodes: nodes(random, devices) },
        2 | 3 => Command::Read { nodes: nodes(random, devices) },
        4 => Command::Info { node: one },
        5 => Command::PdoShow { node: one },
        6 | 7 => {
            let object = object(random, devices, one, false).map_or(ObjectId::new(0x1000, 0), |(object, _)| object);
            Command::SdoRead { node: one, object, how: how(random) }
        }
        8 | 9 => {
            let (object, data_type) =
                object(random, devices, one, true).unwrap_or((ObjectId::new(0x1017, 0), DataType::Unsigned(2)));
            let value = *random.pick(&[0u32, 1, 2, 50, 100, 1000]);
            let bytes = value.to_le_bytes()[..data_type.width().unwrap_or(4)].to_vec();
            Command::SdoWrite { node: one, object, bytes, how: how(random) }
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
        // A request to all 127 nodes takes long: choose it rarely.
        15 if random.percent(15) => Command::LssScan,
        15 if random.percent(40) => Command::LssInquire { target: target(random, devices) },
        15 => Command::LssStore { target: target(random, devices), force: random.percent(40) },
        16 => Command::SdoRead { node: one, object: ObjectId::new(0x1008, 0), how: how(random) },
        17 | 18 => Command::Assign {
            target: target(random, devices),
            id: random.percent(85).then(|| *random.pick(&[1, 2, 5, 12, 16, 55, 127])),
            rate: random.percent(25).then(|| *random.pick(&RATES)),
            store: random.percent(80),
            retime: random.percent(10),
            via: *random.pick(&[Via::Auto, Via::Auto, Via::Lss, Via::Sdo]),
            force: random.percent(30),
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
        32..=34 => large(random, devices),
        35 => Command::LssActivate {
            target: (!random.percent(30)).then(|| target(random, devices)),
            delay_ms: *random.pick(&[1, 50, 1000]),
            force: random.percent(50),
        },
        36 => Command::LssIdentify {
            place: usize::try_from(random.next() % devices.len() as u64).expect("an index"),
            around: *random.pick(&[0, 1, u32::MAX]),
        },
        37 | 38 => Command::NmtWatch {
            nodes: nodes(random, devices),
            ask: random.percent(50),
            for_ms: *random.pick(&[100, 700, 2_500]),
        },
        39 | 40 => Command::PdoWatch { nodes: nodes(random, devices), for_ms: *random.pick(&[50, 300, 1_000]) },
        41 if random.percent(30) => Command::Detect { ask: random.percent(50), each_ms: *random.pick(&[20, 150, 600]) },
        41..=43 => check(random, devices),
        44 | 45 => Command::Configure {
            node: one,
            heartbeat_ms: *random.pick(&[0, 100, 500]),
            timer_ms: random.percent(70).then(|| *random.pick(&[10, 100, 1000])),
            digits: random.percent(30).then(|| random.byte(0..=3)),
        },
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

fn how(random: &mut Random) -> How {
    let blocks = *random.pick(&[BlockMode::Auto, BlockMode::Auto, BlockMode::Always, BlockMode::Never]);
    How { blocks, described: random.percent(50) }
}

/// A transfer of a large object, from a device that has one if possible.
fn large(random: &mut Random, devices: &[DeviceSpec]) -> Command {
    let keeps = devices.iter().find(|device| device.kind == LARGE_KIND && device.node.is_some());
    let node = keeps.and_then(|device| device.node).unwrap_or_else(|| node(random, devices));
    let (object, _) = *random.pick(&LARGE_OBJECTS);
    let how = how(random);
    if random.percent(50) {
        return Command::SdoRead { node, object, how };
    }
    let length = *random.pick(&[0, 1, 7, 8, 28, 29, 300, 888, 889, 890, 2_500]);
    Command::SdoWrite { node, object, bytes: filler(length, random.next()), how }
}

fn check(random: &mut Random, devices: &[DeviceSpec]) -> Command {
    let limits = [(-1e9, 1e9), (-1e9, 1e9), (1e8, 1e9), (0.0, 2.0), (1.0, 30.0), (-5.0, 0.0)];
    let expected = (0..*random.pick(&[1, 1, 2])).map(|_| {
        let (low, high) = *random.pick(&limits);
        Expected { signal: random.pick::<&str>(&["pressure", "pressure", "temperature", "ch1"]), low, high }
    });
    let expected = expected.collect();
    let for_ms = *random.pick(&[100, 400, 1_000]);
    let how = match random.within(0..=5) {
        0..=2 => Measuring::Once,
        3 => Measuring::AsSent { for_ms },
        4 => Measuring::Sync { ms: *random.pick(&[10, 50]), for_ms },
        _ => Measuring::Poll { ms: *random.pick(&[20, 100]), for_ms },
    };
    Command::Check { nodes: nodes(random, devices), expected, how, excuse: random.percent(30) }
}
