use super::*;
use crate::bus::memory::{Clock, MemoryBus};
use crate::bus::{Bus, Event};
use crate::device::catalog;
use crate::device::catalog::Model;
use crate::device::scalar::Scalar;
use crate::sim::Direction;
use crate::sim::model::Overload;
use std::sync::Arc;

mod filter;
mod garbage;
mod lss;
mod record;
mod stored;
mod tpdo;

fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node-ID")
}

fn id(text: &str) -> ObjectId {
    text.parse().expect("an object")
}

fn ms(milliseconds: u64) -> Mono {
    Mono::at(Duration::from_millis(milliseconds))
}

/// Creates a built-in device whose channels are constant at `base`.
fn constant(kind: &str, node_id: u8, base: f64) -> Setup {
    let mut setup = Setup::new(catalog::by_name(kind).expect("built in"), node(node_id));
    for channel in &mut setup.channels {
        (channel.base, channel.amplitude, channel.noise) = (base, 0.0, 0.0);
    }
    setup
}

fn bus(setups: impl IntoIterator<Item = Setup>) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual);
    setups.into_iter().for_each(|setup| bus.attach(Device::new(setup).expect("a device")));
    bus
}

/// Receives the frames up to `until`.
fn receive(bus: &mut MemoryBus, until: Mono) -> Vec<String> {
    timed(bus, until).into_iter().map(|(_, frame)| frame).collect()
}

/// Receives the frames up to `until`, each with the millisecond of its end. Bus errors are ignored.
fn timed(bus: &mut MemoryBus, until: Mono) -> Vec<(u128, String)> {
    let mut frames = Vec::new();
    loop {
        match bus.receive(until).expect("a memory bus never fails") {
            Event::Frame(received) => {
                frames.push((received.at.mono.since_start().as_millis(), received.frame.to_string()));
            }
            Event::Timeout => return frames,
            Event::Fault(..) => {}
            other => panic!("{other:?}"),
        }
    }
}

/// Sends a frame and returns the frames of the next 5 ms.
fn ask(bus: &mut MemoryBus, frame: &str) -> Vec<String> {
    bus.send(&frame.parse().expect("a frame")).expect("room");
    let until = bus.now().mono + Duration::from_millis(5);
    receive(bus, until)
}

/// Sends frames and checks all answers of the next 5 ms; `-` means none.
fn play(bus: &mut MemoryBus, lines: &[(&str, &str)]) {
    for (sent, expected) in lines {
        let received = ask(bus, sent).join(" ");
        assert_eq!(if received.is_empty() { "-" } else { &received }, *expected, "after {sent}");
    }
}

fn device(bus: &mut MemoryBus) -> &mut Device {
    bus.stations_mut().next().expect("a device")
}

fn state(bus: &mut MemoryBus) -> Option<State> {
    device(bus).state()
}

#[test]
fn each_device_boots_to_pre_operational_and_stays_silent() {
    for kind in ["mh4", "d20", "dps", "mc1609"] {
        let mut bus = bus([Setup::new(catalog::by_name(kind).expect("built in"), node(1))]);
        assert_eq!(receive(&mut bus, ms(60_000)), ["701#00"], "{kind}");
        assert_eq!(state(&mut bus), Some(State::PreOperational), "{kind}");
    }
}

#[test]
fn nmt_states_allow_their_services_only() {
    let mut bus = bus([constant("mh4", 5, 5.0)]);
    play(
        &mut bus,
        &[
            // The boot-up message was already being sent.
            ("000#0106", "705#00"),
            ("080#", "-"),
            ("605#4000100000000000", "585#4300100094018200"),
            ("000#0105", "-"),
            ("080#", "185#0000A04000"),
            ("605#4000100000000000", "585#4300100094018200"),
            ("000#0205", "-"),
            ("080#", "-"),
            ("605#4000100000000000", "-"),
            ("000#0105", "-"),
            ("080#", "185#0000A04000"),
            ("000#8000", "-"),
            ("080#", "-"),
            ("000#0100", "-"),
            ("080#", "185#0000A04000"),
            // An unknown command, a command for another node, and a frame that is too short.
            ("000#0305", "-"),
            ("000#0206", "-"),
            ("000#02", "-"),
            ("080#", "185#0000A04000"),
        ],
    );
}

#[test]
fn nmt_frame_without_data_is_ignored() {
    for kind in ["mh4", "d20", "dps", "mc1609"] {
        let mut bus = bus([constant(kind, 5, 5.0)]);
        play(&mut bus, &[("000#", "705#00"), ("000#0105", "-"), ("000#", "-")]);
        assert_eq!(state(&mut bus), Some(State::Operational), "{kind}");
    }
}

#[test]
fn resets_end_with_a_boot_up() {
    let mut bus = bus([constant("mh4", 5, 5.0)]);
    play(
        &mut bus,
        &[
            ("605#2B171000F4010000", "705#00 585#6017100000000000 705#7F"),
            ("605#233161010000AB00", "585#6031610100000000"),
            ("000#8105", "-"),
            // During the reset it answers neither SDO nor NMT.
            ("605#4017100000000000", "-"),
            ("000#0105", "-"),
        ],
    );
    assert_eq!(receive(&mut bus, ms(500)), ["705#00"]);
    play(
        &mut bus,
        &[
            ("605#4017100000000000", "585#4B17100000000000"),
            ("605#4031610100000000", "585#4331610100004E00"),
            ("605#2B171000D0070000", "585#6017100000000000 705#7F"),
            ("605#233161010000AB00", "585#6031610100000000"),
            // Only the communication restarts.
            ("000#8205", "-"),
        ],
    );
    let until = bus.now().mono + Duration::from_millis(20);
    assert_eq!(receive(&mut bus, until), ["705#00"]);
    play(
        &mut bus,
        &[("605#4017100000000000", "585#4B17100000000000"), ("605#4031610100000000", "585#433161010000AB00")],
    );
}

#[test]
fn heartbeat_without_drift() {
    let mut bus = bus([constant("dps", 127, 5.0)]);
    play(&mut bus, &[("67F#2217100064000000", "77F#00 5FF#6017100000000000 77F#7F")]);
    let beats: Vec<u128> = timed(&mut bus, ms(1010)).into_iter().map(|(at, _)| at).collect();
    assert_eq!(beats, [100, 200, 300, 400, 500, 600, 700, 800, 900, 1000]);
    // 05 when started, 04 when stopped, nothing when switched off.
    bus.send(&"000#027F".parse().expect("a frame")).expect("room");
    assert_eq!(receive(&mut bus, ms(1110)), ["77F#04"]);
    bus.send(&"000#807F".parse().expect("a frame")).expect("room");
    play(&mut bus, &[("67F#2217100000000000", "5FF#6017100000000000")]);
    assert_eq!(receive(&mut bus, ms(5000)), Vec::<String>::new());
}

#[test]
fn guarding_answers_toggle_if_guarding_is_supported() {
    let mut d20 = bus([constant("d20", 2, 5.0)]);
    play(
        &mut d20,
        &[
            ("702#R1", "702#00 702#7F"),
            ("702#R1", "702#FF"),
            ("000#0102", "-"),
            ("702#R1", "702#05"),
            ("702#R1", "702#85"),
            ("703#R1", "-"),
            // Heartbeat and guarding exclude each other.
            ("602#220C100032000000", "582#600C100000000000"),
            ("602#2217100064000000", "582#8017100020000008"),
            ("602#220C100000000000", "582#600C100000000000"),
            ("602#22171000D0070000", "582#6017100000000000 702#05"),
            ("602#220C100032000000", "582#800C100020000008"),
            ("602#220D100001000000", "582#800D100020000008"),
            ("702#R1", "-"),
        ],
    );
    // The toggle bit restarts with the communication.
    play(&mut d20, &[("602#2217100000000000", "582#6017100000000000"), ("702#R1", "702#05")]);
    play(&mut d20, &[("000#8202", "-")]);
    let until = d20.now().mono + Duration::from_millis(20);
    assert_eq!(receive(&mut d20, until), ["702#00"]);
    play(&mut d20, &[("702#R1", "702#7F"), ("702#R1", "702#FF")]);
    let mut mh4 = bus([constant("mh4", 5, 5.0)]);
    play(&mut mh4, &[("705#R1", "705#00"), ("705#R1", "-")]);
}

#[test]
fn first_guarding_request_arms_life_guarding() {
    for (kind, failed, answers) in [("d20", "0130", "22"), ("mc1609", "1130", "23")] {
        let failed = format!("082#3081{}0000000000", &failed[..2]);
        let mut bus = bus([constant(kind, 2, 5.0)]);
        receive(&mut bus, ms(5));
        // Guard time 100 ms, life time factor 3, without PDOs.
        ask(&mut bus, &format!("602#{answers}0C100064000000").replace("#230C", "#2B0C"));
        ask(&mut bus, &format!("602#{answers}0D100003000000").replace("#230D", "#2F0D"));
        (0x1800..0x1804).for_each(|index: u16| {
            let [low, high] = index.to_le_bytes();
            ask(&mut bus, &format!("602#{answers}{low:02X}{high:02X}0182{:02X}0080", low + 1));
        });
        ask(&mut bus, "000#0102");
        assert_eq!(receive(&mut bus, ms(2000)), Vec::<String>::new(), "{kind}: not armed");
        assert_eq!(ask(&mut bus, "702#R1"), ["702#05"]);
        let before = bus.now().mono.since_start().as_millis();
        let received = timed(&mut bus, ms(5000));
        let [(at, frame)] = &received[..] else { panic!("{kind}: {received:?}") };
        assert_eq!((frame, at - before), (&failed, 295), "{kind}: once, after the life time");
        assert_eq!(state(&mut bus), Some(State::PreOperational), "{kind}");
        play(&mut bus, &[("702#R1", "702#FF 082#0000000000000000")]);
        // Requests in time prevent the failure; a guard time of 0 stops life guarding.
        for _ in 0..3 {
            let until = bus.now().mono + Duration::from_millis(200);
            assert_eq!(receive(&mut bus, until), Vec::<String>::new());
            assert_eq!(ask(&mut bus, "702#R1").len(), 1);
        }
        ask(&mut bus, &format!("602#{answers}0D100000000000").replace("#230D", "#2F0D"));
        let until = bus.now().mono + Duration::from_secs(2);
        assert_eq!(receive(&mut bus, until), Vec::<String>::new(), "{kind}");
    }
}

#[test]
fn overload_sets_status_value_and_emergency() {
    let overload = |from, until, direction| {
        (1, Overload { from: Duration::from_millis(from), until: Duration::from_millis(until), direction })
    };
    let mut setup = constant("mh4", 5, 5.0);
    setup.overloads = vec![overload(1000, 2000, Direction::High), overload(3000, 4000, Direction::Low)];
    let mut bus = bus([setup]);
    let received = timed(&mut bus, ms(5000));
    let expected = [
        (0, "705#00"),
        (1000, "085#01F0810103000000"),
        (2000, "085#0000000000000000"),
        (3000, "085#01F0810105000000"),
        (4000, "085#0000000000000000"),
    ];
    assert_eq!(received.len(), expected.len(), "{received:?}");
    for ((at, frame), (expected_at, expected)) in received.iter().zip(expected) {
        assert_eq!(frame, expected);
        assert!((expected_at..=expected_at + 1).contains(at), "{at} {frame}");
    }
    play(
        &mut bus,
        &[
            ("605#4001100000000000", "585#4F01100000000000"),
            ("605#4003100000000000", "585#4F03100002000000"),
            ("605#4003100100000000", "585#4303100101F00501"),
            ("605#4003100200000000", "585#4303100201F00301"),
            ("605#2F03100001000000", "585#8003100030000906"),
            ("605#2F03100000000000", "585#6003100000000000"),
            ("605#4003100100000000", "585#4303100100000000"),
        ],
    );
}

#[test]
fn overload_during_operation() {
    let mut setup = constant("mh4", 5, 5.0);
    let half = Duration::from_millis(500);
    setup.overloads = vec![(1, Overload { from: half, until: Duration::MAX, direction: Direction::High })];
    setup.start = true;
    let mut bus = bus([setup]);
    play(&mut bus, &[("080#", "705#00 185#0000A04000")]);
    assert_eq!(receive(&mut bus, ms(600)), ["085#01F0810103000000"]);
    play(
        &mut bus,
        &[
            ("080#", "185#0000C07F03"),
            ("605#4050610100000000", "585#4F50610103000000"),
            ("605#4030710100000000", "585#4B30710100800000"),
            ("605#4001100000000000", "585#4F01100081000000"),
            // The communication restarts. The error is still pending, so no emergency is sent.
            ("000#8205", "-"),
        ],
    );
    assert_eq!(receive(&mut bus, ms(700)), ["705#00"]);
    // After a reset of the node, the emergency is sent again.
    play(&mut bus, &[("605#4001100000000000", "585#4F01100081000000"), ("000#8105", "-")]);
    assert_eq!(receive(&mut bus, ms(1000)), ["705#00", "085#01F0810103000000"]);
}

#[test]
fn dps_has_its_emergency_and_no_status() {
    let mut setup = constant("dps", 127, 50.0);
    setup.overloads =
        vec![(1, Overload { from: Duration::from_millis(500), until: Duration::MAX, direction: Direction::Low })];
    let mut bus = bus([setup]);
    assert_eq!(receive(&mut bus, ms(600)), ["77F#00", "0FF#0132050000000000"]);
    play(
        &mut bus,
        // -5 psi: without a marker, the value is sent.
        &[("67F#4030610100000000", "5FF#4230610178ECFFFF"), ("67F#4050610100000000", "5FF#8050610100000206")],
    );
}

#[test]
fn dps_counts_overloads_by_direction() {
    let mut setup = constant("dps", 127, 50.0);
    let overload = |from, until, direction| {
        (1, Overload { from: Duration::from_millis(from), until: Duration::from_millis(until), direction })
    };
    setup.overloads = vec![
        overload(100, 200, Direction::High),
        overload(300, 400, Direction::Low),
        overload(500, 600, Direction::High),
    ];
    let mut bus = bus([setup]);
    receive(&mut bus, ms(700));
    // 2004h: above the span twice; 2005h: below it once; 1003h:0: three errors.
    play(
        &mut bus,
        &[
            ("67F#4004200000000000", "5FF#4204200002000000"),
            ("67F#4005200000000000", "5FF#4205200001000000"),
            ("67F#4003100000000000", "5FF#4203100003000000"),
        ],
    );
}

#[test]
fn mc1609_sends_16_temperatures_in_four_tpdos() {
    let mut setup = constant("mc1609", 3, 0.0);
    for channel in &mut setup.channels {
        channel.base = f64::from(channel.channel) * 10.0;
    }
    let mut bus = bus([setup]);
    assert_eq!(ask(&mut bus, "000#0103"), ["703#00"]);
    let once = ["183#6400C8002C019001", "283#F4015802BC022003", "383#8403E8034C04B004", "483#14057805DC054006"];
    assert_eq!(receive(&mut bus, ms(150)), once);
    assert_eq!(receive(&mut bus, ms(250)), once);
    for pdo in 0..4 {
        assert_eq!(ask(&mut bus, &format!("603#2F0{pdo}180201000000")), [format!("583#600{pdo}180200000000")]);
    }
    assert_eq!(receive(&mut bus, ms(1000)), Vec::<String>::new());
    assert_eq!(ask(&mut bus, "080#"), once);
    // The device accepts 255 with an event timer of at least 100 ms. It rejects 254.
    play(
        &mut bus,
        &[
            ("603#2F001802FE000000", "583#8000180230000906"),
            ("603#2F001802FF000000", "583#6000180200000000"),
            ("603#2B00180563000000", "583#8000180532000906"),
        ],
    );
}

#[test]
fn strings_are_segmented_or_expedited() {
    let mut setups = vec![constant("mh4", 1, 5.0), constant("d20", 2, 5.0), constant("dps", 127, 5.0)];
    setups.iter_mut().for_each(|setup| setup.serial = 0x01020304);
    let mut bus = bus(setups);
    receive(&mut bus, ms(5));
    play(
        &mut bus,
        &[
            ("601#4008100000000000", "581#4108100008000000"),
            ("601#6000000000000000", "581#004D482D342D4341"),
            ("601#7000000000000000", "581#1D4E000000000000"),
            // "4208100044325839" of the D-20-9 manual.
            ("602#4008100000000000", "582#4208100044325839"),
            ("67F#4008100000000000", "5FF#4208100044505300"),
            ("601#4018100400000000", "581#4318100404030201"),
            ("602#4018100400000000", "582#4218100404030201"),
        ],
    );
    // Each segment has its own time limit of one second.
    play(&mut bus, &[("601#4008100000000000", "581#4108100008000000")]);
    let later = |bus: &mut MemoryBus| {
        let until = bus.now().mono + Duration::from_millis(700);
        receive(bus, until)
    };
    assert_eq!(later(&mut bus), Vec::<String>::new());
    play(&mut bus, &[("601#6000000000000000", "581#004D482D342D4341")]);
    assert_eq!(later(&mut bus), Vec::<String>::new());
    play(&mut bus, &[("601#7000000000000000", "581#1D4E000000000000")]);
    // A stop ends the transfer.
    play(
        &mut bus,
        &[
            ("601#4008100000000000", "581#4108100008000000"),
            ("000#0201", "-"),
            ("000#8001", "-"),
            ("601#6000000000000000", "581#8000000001000405"),
        ],
    );
    // A transfer without requests is aborted after a second.
    play(&mut bus, &[("601#4008100000000000", "581#4108100008000000")]);
    let until = bus.now().mono + Duration::from_secs(5);
    assert_eq!(receive(&mut bus, until), ["581#8008100000000405"]);
}

#[test]
fn autonomous_start() {
    let mut setup = constant("mh4", 5, 5.0);
    setup.set = vec![(id("1F80"), Scalar::Integer(8))];
    let mut autonomous = bus([setup]);
    play(&mut autonomous, &[("080#", "705#00 185#0000A04000")]);
    let mut setup = constant("dps", 127, 5.0);
    setup.start = true;
    let mut started = bus([setup]);
    assert_eq!(receive(&mut started, ms(250)), ["77F#00", "1FF#88130000", "1FF#88130000"]);
}

#[test]
fn objects_that_cannot_be_set_give_an_error() {
    let mut setup = constant("mh4", 5, 5.0);
    setup.set = vec![(id("5000"), Scalar::Integer(1))];
    assert_eq!(Device::new(setup).err().as_deref(), Some("mh4 has no object 0x5000:0"));
    let mut setup = constant("mh4", 5, 5.0);
    setup.set = vec![(id("1017"), Scalar::Integer(70_000))];
    assert_eq!(Device::new(setup).err().as_deref(), Some("0x1017:0: 70000 does not fit u16 (0 to 65535)"));
}

#[test]
fn the_seed_decides_the_frames() {
    let run = |seed| {
        let mut setups = Vec::new();
        for (kind, id) in [("mh4", 1), ("d20", 2), ("mc1609", 3), ("dps", 127)] {
            let mut setup = Setup::new(catalog::by_name(kind).expect("built in"), node(id));
            (setup.seed, setup.start) = (seed, true);
            setups.push(setup);
        }
        let mut bus = bus(setups);
        let mut received = Vec::new();
        for round in 1..=50 {
            bus.send(&"080#".parse().expect("a frame")).expect("room");
            received.extend(timed(&mut bus, ms(round * 10)));
        }
        received
    };
    let first = run(1);
    // 4 boot-ups, 2 TPDOs after each of 50 SYNCs, 4 rounds of 4 + 1 TPDOs by event timers. The TPDOs at 500 ms are not
    // complete yet.
    assert_eq!(first.len(), 4 + 100 + 20);
    assert_eq!(first, run(1));
    assert_ne!(first, run(2));
}

#[test]
fn periods_do_not_drift_and_missed_ones_are_skipped() {
    let second = Duration::from_secs(1);
    assert_eq!(next_due(ms(1000), second, ms(1000)), ms(2000));
    assert_eq!(next_due(ms(1000), second, ms(1999)), ms(2000));
    assert_eq!(next_due(ms(1000), second, ms(2000)), ms(3000));
    assert_eq!(next_due(ms(1000), second, ms(90_500)), ms(91_500));
}
