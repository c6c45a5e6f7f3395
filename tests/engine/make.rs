//! Makes a [`Spec`] from a seed.

mod commands;

use crate::command::Command;
use crate::kinds::LARGE_KIND;
use crate::random::Random;
use crate::spec::{Act, DeviceFault, DeviceSpec, Fault, Kill, Other, Spec};
use cangauge::bus::coded::Codec;
use commands::command;

// Without baumer: its signal has no model.
const KINDS: [&str; 14] = [
    "mh4",
    "mh4",
    "mh4",
    "d20",
    "d20",
    "mc1609",
    "mc1609",
    "dps",
    "dps",
    "hydac",
    "jumo",
    "jumo",
    "hydac-old",
    LARGE_KIND,
];
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
            codec: [None, None, Some(Codec::Slcan), Some(Codec::Socketcand)][(seed % 4) as usize]
                .map(|codec| (codec, seed)),
            devices,
            others: Vec::new(),
            faults: Vec::new(),
            interrupts: Vec::new(),
            kill: None,
            command,
        };
        if let Command::Detect { .. } = spec.command {
            let rate = *random.pick(&[20_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000]);
            spec.devices.iter_mut().for_each(|device| device.bit_rate = Some(rate));
        }
        // A quarter of the scenarios runs without any fault.
        match random.within(0..=99) {
            0..=69 => spec.add_faults(random),
            70..=75 => spec.kill = Some(kill(random)),
            _ => {}
        }
        if random.percent(15) {
            spec.add_deviation(random);
            // The rules for devices with a deviation need the exact times of the bus.
            spec.codec = None;
        }
        spec
    }

    fn add_faults(&mut self, random: &mut Random) {
        if random.percent(15) {
            self.faults = disturbed_wire(random);
        } else if random.percent(60) {
            for _ in 0..random.within(1..=3) {
                let fault = fault(random);
                self.faults.push(fault);
            }
        }
        if random.percent(45) {
            for _ in 0..random.within(1..=2) {
                let at = usize::try_from(random.next() % self.devices.len() as u64).expect("an index");
                let (device_fault, device) = (device_fault(random), &mut self.devices[at]);
                if matches!(device_fault, DeviceFault::Hang { .. } | DeviceFault::Late { .. }) {
                    device.unsaved_heartbeat = None;
                }
                device.device_faults.push(device_fault);
            }
        }
        if random.percent(18) {
            let plan = (0..random.within(1..=8)).map(|_| (when(random), act(random, &self.devices))).collect();
            self.others.push(Other::Master { plan });
        }
        if random.percent(10) {
            let every_us = *random.pick(&[600, 2_000, 10_000, 100_000]);
            self.others.push(Other::NoiseSender {
                every_us,
                seed: random.next(),
                uses_canopen_ids: random.percent(30),
            });
        }
        if random.percent(25) {
            self.interrupts.push(when(random));
            if random.percent(20) {
                self.interrupts.push(when(random));
            }
        }
        if random.percent(15) {
            self.kill = Some(kill(random));
        }
    }
}

fn device(random: &mut Random, at: u32) -> DeviceSpec {
    let node = *random.pick(&[Some(1), Some(5), Some(7), Some(33), Some(127)]);
    let node = node.map(|node: u8| (node + 11 * u8::try_from(at).expect("few devices") - 1) % 127 + 1);
    let latency_us = *random.pick(&[0, 0, 300, 2_000, 10_000, 45_000]);
    DeviceSpec {
        kind: random.pick::<&str>(&KINDS),
        node: node.filter(|_| !random.percent(6)),
        serial: 1000 + at,
        start: random.percent(25),
        heartbeat_ms: random.percent(45).then(|| *random.pick(&[50, 100, 200, 1000])),
        bit_rate: random.percent(2).then(|| *random.pick(&RATES)),
        latency_us,
        // The program cannot distinguish the answer to this write from an answer to its own requests. So the answer
        // must arrive before the program starts, and a slow device gets no write.
        unsaved_heartbeat: (latency_us < 20_000 && random.percent(15)).then_some(150),
        event_timer_ms: random.percent(30).then(|| *random.pick(&[10, 50, 100])),
        overload: random.percent(10),
        device_faults: Vec::new(),
        deviation: None,
    }
}

/// A moment in µs. Early ones are more frequent.
fn when(random: &mut Random) -> u64 {
    let most = *random.pick(&[2_000, 20_000, 100_000, 600_000, 4_000_000]);
    random.within(0..=most)
}

/// The number of a frame. Small ones are more frequent.
fn nth(random: &mut Random) -> u64 {
    let most = *random.pick(&[4, 15, 40, 100, 200]);
    random.within(0..=most)
}

fn kill(random: &mut Random) -> Kill {
    Kill { before: nth(random), again_ms: *random.pick(&[0, 5, 100, 700, 3_000]) }
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
        8 if random.percent(30) => Fault::Full { at_us: when(random), for_ms: *random.pick(&[20, 400, 3_000]) },
        8 => Fault::QueueFull(number),
        9 => Fault::Down { at_us: when(random), for_ms: random.percent(40).then(|| random.within(1..=500)) },
        _ if random.percent(50) => {
            Fault::BusOff { at_us: when(random), for_ms: random.percent(50).then(|| random.within(1..=700)) }
        }
        _ => Fault::Lose(number + 1),
    }
}

/// A wire that loses, doubles, delays or changes 2 to 6 % of the frames.
fn disturbed_wire(random: &mut Random) -> Vec<Fault> {
    let (share, changes_bytes) = (random.within(2..=6), random.percent(30));
    let mut faults = Vec::new();
    for number in (0..400).filter(|_| random.percent(share)).collect::<Vec<u64>>() {
        faults.push(match random.within(0..=4) {
            0 => Fault::Lose(number),
            1 => Fault::LoseSent(number),
            2 => Fault::Duplicate(number),
            3 if changes_bytes => Fault::Garble(number, usize::from(random.byte(0..=7)), 1 << random.byte(0..=7)),
            _ => Fault::Delay(number, *random.pick(&[1, 5, 20])),
        });
    }
    faults
}

fn device_fault(random: &mut Random) -> DeviceFault {
    let nth = nth(random);
    match random.within(0..=14) {
        0 => DeviceFault::ResetAt { ms: when(random) / 1000 },
        1 => DeviceFault::Hang { from_ms: when(random) / 1000, for_ms: *random.pick(&[20, 200, 2_000, 1_000_000]) },
        2 | 3 => {
            let index =
                [0x1000, 0x1017, 0x1018, 0x1008, 0x1010, 0x1011, 0x1800, 0x1a00, 0x6125, 0x6131, 0x61a0, 0x2320];
            DeviceFault::Refuse { index: *random.pick(&index), code: *random.pick(&ABORTS) }
        }
        4 | 5 => DeviceFault::Lose { nth },
        6 => DeviceFault::Late { nth, ms: *random.pick(&[20, 60, 120, 600, 3_500]) },
        7 => DeviceFault::Twice { nth },
        8 => DeviceFault::Garbled { nth, place: usize::from(random.byte(0..=7)), turned: random.byte(1..=255) },
        9 => DeviceFault::As { nth, node: *random.pick(&[1, 5, 12, 16, 127]) },
        10 => DeviceFault::LoseLss(*random.pick(&[0x11, 0x13, 0x17, 0x43, 0x4b, 0x5e, 0x5a])),
        11 => DeviceFault::LateLss(
            *random.pick(&[0x11, 0x13, 0x17, 0x43, 0x5e]),
            *random.pick(&[60, 300, 700, 2_500, 4_000]),
        ),
        12 => DeviceFault::RefuseLss(*random.pick(&[0x11, 0x13, 0x17])),
        13 => DeviceFault::SendsEmergencies {
            from_ms: when(random) / 1000,
            for_ms: *random.pick(&[20, 500, 10_000]),
            every_us: *random.pick(&[550, 2_000, 20_000]),
        },
        _ if random.percent(50) => DeviceFault::OfflineAfterReset,
        _ => DeviceFault::EndlessFastscan,
    }
}

fn act(random: &mut Random, devices: &[DeviceSpec]) -> Act {
    let node = random.pick(devices).node.unwrap_or(5);
    let (index, sub) =
        *random.pick(&[(0x1000, 0), (0x1008, 0), (0x1017, 0), (0x1018, 4), (0x6130, 1), (0x1a00, 0), (0x100a, 0)]);
    match random.within(0..=10) {
        0..=5 => Act::Read { node, index, sub },
        6 if random.percent(25) => Act::LssWait,
        6 | 7 => Act::Write { node, index: 0x1017, sub: 0, value: *random.pick(&[0, 77, 500]), bytes: 2 },
        _ => {
            Act::Nmt { specifier: *random.pick(&[0x01, 0x02, 0x80, 0x81, 0x82]), node: *random.pick(&[node, node, 0]) }
        }
    }
}
