//! Fastscan with slaves that are slow, that lose answers, or that send too many, and with several slaves.

use super::slave::Slave;
use super::{address, bus_of, configuring, ms};
use cangauge::bus::memory::MemoryBus;
use cangauge::bus::{Bus, Event, Mono};
use cangauge::canopen::id::NodeId;
use cangauge::canopen::lss::{FastscanError, LssAddress, Service};
use cangauge::master::{LssError, Master, Timing};
use cangauge::tasks::lss::{SearchTimes, scan as find};
use std::time::Duration;

const DPS: [u32; 4] = [0x362, 0x0044_3150, 0x0001_0000, 20002];

/// Runs a scan, and returns its result and the slaves that are then in configuration state.
fn scan(bus: &mut MemoryBus) -> (Result<Option<LssAddress>, LssError>, Vec<[u32; 4]>) {
    let mut master = Master::new(bus, Timing::default());
    let mut lss = master.lss();
    let found = lss.fastscan();
    let is_configuring = lss.is_configuring();
    // Without `drop`, which would switch the slaves to waiting state.
    std::mem::forget(lss);
    let configuring = configuring(bus);
    assert!(is_configuring || configuring.is_empty());
    (found, configuring)
}

#[test]
fn single_slave_is_found_within_a_second() {
    for identity in [DPS, [0; 4], [u32::MAX; 4], [0x1234_5678, 0x9abc_def0, 1, 0x8000_0000]] {
        for latency in [0, 100, 1000, 1500] {
            let mut bus = bus_of([Slave::new(identity, 0xff).slow(&[latency])]);
            let (found, configuring) = scan(&mut bus);
            assert_eq!(found.unwrap(), Some(address(identity)));
            assert_eq!(configuring, [identity]);
            assert!(bus.mono() < Mono::at(Duration::from_secs(1)), "{identity:?} {latency}: {:?}", bus.mono());
        }
    }
}

/// One answer of many is late, as on a busy host. Some slaves lose a frame that arrives before their answer.
#[test]
fn one_late_answer_costs_little_time() {
    for drops_while_busy in [false, true] {
        for late in [5_000, 10_000, 25_000] {
            for number in 0..160 {
                let mut latencies = vec![500; 1000];
                latencies[number] = late;
                let mut slave = Slave::new(DPS, 0xff).slow(&latencies);
                slave.drops_while_busy = drops_while_busy;
                let mut bus = bus_of([slave]);
                let (found, configuring) = scan(&mut bus);
                assert_eq!((found.unwrap(), configuring), (Some(address(DPS)), vec![DPS]), "{late} us at {number}");
                // Without a late answer 395 ms, of which 250 ms are the frames at 250 kbit/s.
                assert!(bus.mono() < ms(550), "{late} us at {number}: {:?}", bus.mono());
            }
        }
    }
}

/// The devices that `lss scan` finds, and the duration in milliseconds.
fn searched(slaves: impl IntoIterator<Item = Slave>, times: SearchTimes) -> (Vec<[u32; 4]>, u128) {
    let mut bus = bus_of(slaves);
    let found = find(&mut Master::new(&mut bus, Timing::default()), times, &mut |_| {}).unwrap();
    let found = found.into_iter().filter_map(|slave| slave.address).map(|address| address.parts()).collect();
    assert_eq!(configuring(&bus), [[0; 4]; 0]);
    (found, bus.mono().since(Mono::START).as_millis())
}

#[test]
fn search_without_devices_takes_half_a_second() {
    let (found, took) = searched([Slave::new(DPS, 5)], SearchTimes::default());
    assert_eq!(found.len(), 0);
    assert!((450..500).contains(&took), "{took} ms");
}

#[test]
fn search_for_one_device_takes_a_second() {
    // The DPS manual names no inquiries: the device is silent once it is selected.
    for silent in [&[][..], &[0x5a, 0x5b, 0x5c, 0x5d, 0x5e]] {
        for latencies in [&[200][..], &[1000, 1500, 200]] {
            let slave = Slave::new(DPS, 0xff).without(silent.iter().copied()).slow(latencies);
            let (found, took) = searched([slave], SearchTimes::default());
            assert_eq!(found, [DPS], "{silent:?}");
            // 65 ms of the requests of the scan, and 250 ms of fastscan, are the frames at 250 kbit/s.
            assert!(took < 1200, "{silent:?} {latencies:?}: {took} ms");
        }
    }
}

#[test]
fn search_finds_slow_devices_and_devices_that_need_pauses() {
    for (latency, pause, times) in [
        (400_000, 0, SearchTimes::default()),
        (950_000, 0, SearchTimes::patient(Duration::from_secs(1))),
        (300, 190, SearchTimes::default()),
        (300, 190, SearchTimes::patient(Duration::from_secs(1))),
    ] {
        let mut slave = Slave::new(DPS, 0xff).slow(&[latency]);
        slave.pause = Duration::from_millis(pause);
        let mut bus = bus_of([slave]);
        let timing = Timing { timeout: times.first, ..Timing::default() };
        let found = find(&mut Master::new(&mut bus, timing), times, &mut |_| {}).unwrap();
        assert_eq!(found.len(), 1, "{latency} us, {pause} ms, {times:?}");
    }
}

#[test]
fn search_finds_several_devices() {
    let identities = [DPS, [0x362, 0x0044_3150, 0x0001_0000, 20003], [0x47, 1, 0x0001_0007, 99]];
    for latencies in [[300, 300, 300], [200, 900, 1600], [100, 15_000, 200], [5000, 100, 100]] {
        let slaves = identities.iter().zip(latencies).map(|(&it, latency)| Slave::new(it, 0xff).slow(&[latency]));
        let (mut found, _) = searched(slaves, SearchTimes::default());
        found.sort();
        let mut expected = identities.to_vec();
        expected.sort();
        assert_eq!(found, expected, "{latencies:?}");
    }
}

#[test]
fn configured_slave_is_not_found() {
    let mut bus = bus_of([Slave::new(DPS, 5)]);
    let (found, configuring) = scan(&mut bus);
    assert_eq!((found.unwrap(), configuring.len()), (None, 0));
}

#[test]
fn slow_slaves_are_found() {
    for latencies in [&[20_000][..], &[100_000], &[100, 100, 9000], &[100, 20_000, 100], &[40_000, 100, 100, 100]] {
        let mut bus = bus_of([Slave::new(DPS, 0xff).slow(latencies)]);
        let (found, configuring) = scan(&mut bus);
        assert_eq!(found.unwrap(), Some(address(DPS)), "{latencies:?}");
        assert_eq!(configuring, [DPS]);
    }
}

#[test]
fn slaves_that_need_pauses_are_found() {
    for pause in [10, 50, 190] {
        let mut slave = Slave::new(DPS, 0xff);
        slave.pause = Duration::from_millis(pause);
        let mut bus = bus_of([slave]);
        let (found, configuring) = scan(&mut bus);
        assert_eq!((found.unwrap(), configuring), (Some(address(DPS)), vec![DPS]), "{pause} ms");
    }
}

#[test]
fn three_slaves_are_found_without_changing_them() {
    let identities = [DPS, [0x362, 0x0044_3150, 0x0001_0000, 20003], [0x47, 1, 0x0001_0007, 99]];
    for latencies in [[300, 300, 300], [200, 900, 1600], [100, 3000, 200], [5000, 100, 100]] {
        let slaves = identities.iter().zip(latencies).map(|(&it, latency)| Slave::new(it, 0xff).slow(&[latency]));
        let mut bus = bus_of(slaves.chain([Slave::new([0x47, 1, 1, 1], 5)]));
        let mut master = Master::new(&mut bus, Timing::default());
        let mut lss = master.lss();
        let mut found: Vec<LssAddress> = Vec::new();
        while let Some(address) = lss.fastscan_excluding(&found, None).unwrap() {
            assert!(!found.contains(&address), "{address} twice");
            found.push(address);
        }
        lss.leave().unwrap();
        drop(lss);
        drop(master);
        let mut expected = identities.map(address).to_vec();
        expected.sort_by_key(|it| it.parts());
        found.sort_by_key(|it| it.parts());
        assert_eq!(found, expected, "{latencies:?}");
        assert_eq!(bus.stations::<Slave>().map(|slave| slave.node).collect::<Vec<_>>(), [0xff, 0xff, 0xff, 5]);
        assert_eq!(configuring(&bus), [[0; 4]; 0], "all are in waiting state again");
    }
}

#[test]
fn three_slaves_are_configured_in_turn() {
    let identities = [DPS, [0x362, 0x0044_3150, 0x0001_0000, 20003], [0x47, 1, 0x0001_0007, 99]];
    for latencies in [[300, 300, 300], [200, 900, 1600], [100, 3000, 200], [5000, 100, 100]] {
        let slaves = identities.iter().zip(latencies).map(|(&it, latency)| Slave::new(it, 0xff).slow(&[latency]));
        let mut bus = bus_of(slaves);
        let mut master = Master::new(&mut bus, Timing::default());
        let mut lss = master.lss();
        let mut found = Vec::new();
        for node in 10.. {
            let Some(address) = lss.fastscan().unwrap() else { break };
            lss.configure_node_id(NodeId::new(node).ok()).unwrap();
            lss.leave().unwrap();
            found.push(address.parts());
        }
        drop(lss);
        drop(master);
        let nodes: Vec<u8> = found
            .iter()
            .map(|identity| bus.stations::<Slave>().find(|slave| slave.identity == *identity).unwrap().node)
            .collect();
        assert_eq!(nodes, [10, 11, 12], "{latencies:?}");
        assert!(bus.stations::<Slave>().all(|slave| slave.commands == 5), "one node-ID and four inquiries for each");
    }
}

#[test]
fn slave_that_answers_each_frame_is_an_error() {
    let mut slave = Slave::new(DPS, 0xff);
    slave.answers_all_fastscans = Some(false);
    let mut bus = bus_of([slave]);
    let (found, configuring) = scan(&mut bus);
    assert!(matches!(found, Err(LssError::Fastscan(FastscanError::AnswersEverything))), "{found:?}");
    assert_eq!(configuring.len(), 0);
}

#[test]
fn slave_that_answers_each_frame_in_configuration_state_is_switched_to_waiting() {
    let mut left_behind = Slave::new(DPS, 5);
    left_behind.answers_all_fastscans = Some(true);
    left_behind.is_configuring = true;
    let other = [0x47, 1, 0x0001_0007, 99];
    let mut bus = bus_of([left_behind, Slave::new(other, 0xff)]);
    let (found, configuring) = scan(&mut bus);
    assert_eq!((found.unwrap(), configuring), (Some(address(other)), vec![other]));
}

#[test]
fn two_slaves_with_one_identity_are_an_error() {
    let mut bus = bus_of([Slave::new(DPS, 0xff).slow(&[200]), Slave::new(DPS, 0xff).slow(&[800])]);
    let (found, _) = scan(&mut bus);
    assert!(matches!(found, Err(LssError::Several { service: Service::Inquire(_), .. })), "{found:?}");
}

#[test]
fn slave_without_inquiries_is_confirmed_by_its_address() {
    let mut bus = bus_of([Slave::new(DPS, 0xff).without(0x5a..=0x5e)]);
    let (found, configuring) = scan(&mut bus);
    assert_eq!((found.unwrap(), configuring), (Some(address(DPS)), vec![DPS]));
    let mut wrong = Slave::new(DPS, 0xff);
    wrong.answers.insert(0x5d, vec![0x5d, 1, 2, 3, 4, 0, 0, 0]);
    let (found, _) = scan(&mut bus_of([wrong]));
    assert!(matches!(found, Err(LssError::AddressMismatch { .. })), "{found:?}");
}

/// A slave that is found exists, and is the only one in configuration state.
#[test]
fn lost_answers_never_produce_a_wrong_address() {
    let (mut found, mut given_up) = (0, 0);
    for first in 0..150 {
        for more in [None, Some(first + 1), Some(first + 40)] {
            let mut slave = Slave::new(DPS, 0xff);
            slave.loses = more.into_iter().chain([first]).collect();
            let (end, configuring) = scan(&mut bus_of([slave]));
            match end {
                Ok(Some(address)) => {
                    assert_eq!((address.parts(), configuring), (DPS, vec![DPS]));
                    found += 1;
                }
                // The first frame is sent twice: both answers were lost.
                Ok(None) => assert_eq!((first, more), (0, Some(1))),
                Err(_) => given_up += 1,
            }
        }
    }
    assert!(given_up * 10 < found, "{found} found, {given_up} given up");
}

/// One to three slaves with random delays. A slave that is found exists, and is the only one in configuration state.
#[test]
fn random_delays_never_produce_a_wrong_address() {
    let (mut found, mut given_up) = (0, 0);
    let mut random = 1u64;
    let mut next = |below: u64| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % below
    };
    for run in 0..240u32 {
        let identities = [DPS, [0x362, 0x0044_3150, 0x0001_0000, run], [0x47, 1, 0x0001_0007, 99]];
        let slaves = &identities[..1 + run as usize % 3];
        let slaves: Vec<Slave> = slaves
            .iter()
            .map(|&identity| {
                // Mostly short delays, and some long ones.
                let latencies: Vec<u64> =
                    (0..97).map(|_| if next(30) == 0 { next(40_000) } else { next(1500) }).collect();
                Slave::new(identity, 0xff).slow(&latencies)
            })
            .collect();
        let (end, configuring) = scan(&mut bus_of(slaves));
        match end {
            Ok(Some(address)) => {
                assert_eq!(configuring, [address.parts()], "{run}");
                found += 1;
            }
            Ok(None) => panic!("{run}: no slave found"),
            Err(LssError::Fastscan(FastscanError::AnswersEverything)) => panic!("{run}: no slave answers each frame"),
            Err(_) => given_up += 1,
        }
    }
    assert!(given_up * 10 < found, "{found} found, {given_up} given up");
}

#[test]
fn ctrl_c_leaves_no_slave_in_configuration_state() {
    let mut interrupted = 0;
    for moment in (0..400).step_by(3) {
        let mut bus = bus_of([Slave::new(DPS, 0xff)]);
        bus.interrupt_at(ms(moment));
        let mut master = Master::new(&mut bus, Timing::default());
        let mut lss = master.lss();
        match lss.fastscan() {
            Ok(Some(_)) => {}
            Err(LssError::Master(cangauge::master::Error::Interrupted)) => interrupted += 1,
            other => panic!("{other:?}"),
        }
        drop(lss);
        drop(master);
        let until = bus.mono() + Duration::from_millis(10);
        while bus.receive(until).unwrap() != Event::Timeout {}
        assert_eq!(configuring(&bus).len(), 0, "{moment}");
    }
    assert!(interrupted > 50, "{interrupted}");
}
