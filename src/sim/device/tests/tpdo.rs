//! Tests of the causes and contents of TPDOs.

use super::*;

#[test]
fn mh4_is_silent_without_sync() {
    let mut bus = bus([Setup::new(catalog::by_name("mh4").expect("built in"), node(5))]);
    assert_eq!(ask(&mut bus, "000#0105"), ["705#00"]);
    assert_eq!(receive(&mut bus, ms(60_000)), Vec::<String>::new());
    let answer = ask(&mut bus, "080#");
    assert_eq!(answer.len(), 1);
    assert!(answer[0].starts_with("185#") && answer[0].ends_with("00") && answer[0].len() == 14, "{answer:?}");
}

#[test]
fn dps_sends_psi_every_100_ms() {
    let mut bus = bus([constant("dps", 127, 17.898)]);
    assert_eq!(ask(&mut bus, "000#017F"), ["77F#00"]);
    let received = timed(&mut bus, ms(1005));
    assert_eq!(
        received.iter().map(|(at, _)| *at).collect::<Vec<_>>(),
        (1..=10).map(|n| n * 100).collect::<Vec<u128>>()
    );
    // 17898 = 45EAh.
    assert!(received.iter().all(|(_, frame)| frame == "1FF#EA450000"), "{received:?}");
    // Table 29: 1800h:5 to 1000 ms.
    play(&mut bus, &[("67F#22001805E8030000", "5FF#6000180500000000")]);
    let received = timed(&mut bus, ms(4100));
    assert_eq!(received.len(), 3);
    assert_eq!(received[1].0 - received[0].0, 1000);
}

#[test]
fn dps_remaps_as_its_table_26_prints() {
    let mut bus = bus([constant("dps", 127, 50.0)]);
    play(
        &mut bus,
        &[
            ("67F#22001801FF0100C0", "77F#00 5FF#6000180100000000"),
            ("67F#22001A0000000000", "5FF#60001A0000000000"),
            ("67F#22001A0110010071", "5FF#60001A0100000000"),
            ("67F#2F001A0001000000", "5FF#60001A0000000000"),
            ("67F#22001801FF010040", "5FF#6000180100000000"),
            ("67F#2200180200000000", "5FF#6000180200000000"),
            ("000#017F", "-"),
            // Table 27: on SYNC, if changed. 50 of 100 psi are 2047.5 of 4095 counts.
            ("080#", "1FF#0008"),
            ("080#", "-"),
            // Table 28: every third.
            ("67F#2200180203000000", "5FF#6000180200000000"),
            ("080#", "-"),
            ("080#", "-"),
            ("080#", "1FF#0008"),
            ("080#", "-"),
        ],
    );
}

#[test]
fn d20_mapping_needs_only_the_count_at_zero() {
    let mut bus = bus([constant("d20", 2, 5.0)]);
    play(
        &mut bus,
        &[
            ("000#0102", "702#00"),
            ("080#", "182#88130000"),
            ("602#22001A0000000000", "582#80001A0020000008"),
            ("000#8002", "-"),
            ("602#22001A0120013061", "582#80001A0120000008"),
            ("602#22001A0000000000", "582#60001A0000000000"),
            ("000#0102", "-"),
            // "PDO does not supply any data; DLC = 0".
            ("080#", "182#"),
            ("000#8002", "-"),
            ("602#22001A0120013161", "582#80001A0130000906"),
            ("602#22001A0120013061", "582#60001A0100000000"),
            ("602#22001A0001000000", "582#60001A0000000000"),
            ("000#0102", "-"),
            ("080#", "182#0000A040"),
        ],
    );
}

#[test]
fn mh4_mapping_needs_an_invalid_pdo() {
    let mut bus = bus([constant("mh4", 1, 5.0)]);
    play(
        &mut bus,
        &[
            // The steps of 3.4.2; before each step, a step in the wrong order.
            ("601#2F001A0000000000", "701#00 581#80001A0000000106"),
            ("601#2300180182010040", "581#8000180130000906"),
            ("601#23001801810100C0", "581#6000180100000000"),
            ("601#23001A0120013061", "581#80001A0100000106"),
            ("601#2F001A0000000000", "581#60001A0000000000"),
            ("601#23001A0120001061", "581#80001A0141000406"),
            ("601#23001A0110013061", "581#80001A0141000406"),
            ("601#23001A0120013061", "581#60001A0100000000"),
            ("601#23001A0220013091", "581#60001A0200000000"),
            ("601#23001A0308015061", "581#60001A0300000000"),
            ("601#2F001A0003000000", "581#80001A0042000406"),
            ("601#2F001A0002000000", "581#60001A0000000000"),
            ("601#2300180180010040", "581#8000180130000906"),
            ("601#2300180185010040", "581#6000180100000000"),
            ("000#0101", "-"),
            ("080#", "185#0000A04088130000"),
        ],
    );
}

#[test]
fn every_nth_sync_and_if_changed() {
    let mut moving = Setup::new(catalog::by_name("mh4").expect("built in"), node(5));
    moving.channels[0].noise = 0.0;
    moving.channels[0].period_s = 1.0;
    let mut bus = bus([moving]);
    play(
        &mut bus,
        &[("605#2F00180204000000", "705#00 585#6000180200000000"), ("605#2F00180105000000", "585#8000180110000706")],
    );
    assert_eq!(ask(&mut bus, "000#0105"), Vec::<String>::new());
    let answers: Vec<usize> = (0..9).map(|_| ask(&mut bus, "080#").len()).collect();
    assert_eq!(answers, [0, 0, 0, 1, 0, 0, 0, 1, 0]);
    // After a restart the count restarts.
    ask(&mut bus, "000#8005");
    ask(&mut bus, "000#0105");
    let answers: Vec<usize> = (0..4).map(|_| ask(&mut bus, "080#").len()).collect();
    assert_eq!(answers, [0, 0, 0, 1]);
    play(&mut bus, &[("605#2F00180200000000", "585#6000180200000000")]);
    // A moving value changes with every SYNC, except between two SYNCs within one sample of 640 us.
    assert_eq!(ask(&mut bus, "080#").len(), 1);
    assert_eq!(ask(&mut bus, "080#").len(), 1);
    for _ in 0..3 {
        bus.send(&"080#".parse().expect("a frame")).expect("room");
    }
    let until = bus.now().mono + Duration::from_millis(5);
    let changed = receive(&mut bus, until).len();
    assert!(changed < 3, "{changed}");
    // Types that CiA reserves, and types that this device does not support.
    for kind in ["F1", "FB", "FC", "FD"] {
        assert_eq!(ask(&mut bus, &format!("605#2F001802{kind}000000")), ["585#8000180230000906"]);
    }
}

/// MH-4, 2.3: 254 is the event timer. DPS, 10.4: 254 and 255 are the same. MC1609, 2.1.4: 255 is the event timer.
#[test]
fn event_timer_belongs_to_the_transmission_types_of_the_manual() {
    for (kind, transmission, sends) in
        [("mh4", "FE", 10), ("mh4", "FF", 0), ("dps", "FE", 10), ("dps", "FF", 10), ("mc1609", "FF", 40)]
    {
        let mut bus = bus([constant(kind, 5, 5.0)]);
        ask(&mut bus, &format!("605#22001802{transmission}000000"));
        ask(&mut bus, "605#2200180564000000");
        assert_eq!(ask(&mut bus, "000#0105"), Vec::<String>::new(), "{kind}");
        let until = bus.now().mono + Duration::from_millis(1004);
        let received = timed(&mut bus, until);
        assert_eq!(received.len(), sends, "{kind} {transmission} {received:?}");
        let ours: Vec<_> = received.iter().filter(|(_, frame)| frame.starts_with("185#")).collect();
        assert!(ours.windows(2).all(|pair| pair[1].0 - pair[0].0 == 100), "{received:?}");
        assert_eq!(ask(&mut bus, "080#").len(), 0, "not on SYNC");
    }
}

#[test]
fn remote_request_is_answered_if_bit_30_allows_it() {
    let mut d20 = bus([constant("d20", 2, 5.0)]);
    play(
        &mut d20,
        &[
            ("182#R4", "702#00"),
            // Every second SYNC: a remote request does not count as one.
            ("602#2200180202000000", "582#6000180200000000"),
            ("000#0102", "-"),
            ("080#", "-"),
            ("182#R4", "182#88130000"),
            ("183#R4", "-"),
            ("080#", "182#88130000"),
            ("602#2200180182010040", "582#6000180100000000"),
            ("182#R4", "-"),
            ("602#2200180182010080", "582#6000180100000000"),
            ("182#R4", "-"),
        ],
    );
    let mut mc1609 = bus([constant("mc1609", 5, 25.0)]);
    play(
        &mut mc1609,
        &[("000#0105", "705#00"), ("285#R8", "285#FA00FA00FA00FA00"), ("485#R8", "485#FA00FA00FA00FA00")],
    );
    // MH-4 and DPS set bit 30.
    let mut others = bus([constant("mh4", 1, 5.0), constant("dps", 127, 5.0)]);
    play(&mut others, &[("000#0100", "701#00 77F#00"), ("181#R5", "-"), ("1FF#R4", "-")]);
    play(
        &mut others,
        &[("601#23001801810100C0", "581#6000180100000000"), ("601#2300180181010000", "581#6000180100000000")],
    );
    play(&mut others, &[("181#R5", "181#0000A04000")]);
}

/// CiA 301, table of restricted CAN-IDs.
#[test]
fn restricted_identifiers_of_sync_and_emergency_are_refused() {
    let mut bus = bus([constant("mc1609", 5, 25.0), constant("mh4", 1, 5.0)]);
    receive(&mut bus, ms(5));
    for restricted in
        [0u32, 1, 0x7f, 0x101, 0x180, 0x581, 0x5ff, 0x601, 0x67f, 0x6e0, 0x6ff, 0x701, 0x77f, 0x780, 0x7ff, 0x2000_0080]
    {
        let hex: String = restricted.to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
        assert_eq!(ask(&mut bus, &format!("605#23051000{hex}")), ["585#8005100030000906"], "{restricted:X}");
        assert_eq!(ask(&mut bus, &format!("605#23141000{hex}")), ["585#8014100030000906"], "{restricted:X}");
        assert_eq!(ask(&mut bus, &format!("601#23051000{hex}")), ["581#8005100030000906"], "{restricted:X}");
    }
    play(
        &mut bus,
        &[
            ("605#2305100081000000", "585#6005100000000000"),
            ("605#2314100000010000", "585#6014100000000000"),
            // An emergency that is switched off has no identifier.
            ("605#2314100000000080", "585#6014100000000000"),
            // No simulated device produces SYNC (bit 30).
            ("605#2305100080000040", "585#8005100030000906"),
            ("601#2305100080000040", "581#8005100030000906"),
        ],
    );
}

#[test]
fn a_change_by_delta_sends() {
    // 5 ± 1.05 within a second, delta 0.5.
    let mut setup = constant("mh4", 5, 5.0);
    setup.channels[0].amplitude = 1.05;
    setup.channels[0].period_s = 1.0;
    setup.set = vec![(id("1800:2"), Scalar::Integer(255)), (id("6133:1"), Scalar::Real(0.5))];
    setup.start = true;
    let mut bus = bus([setup]);
    let received: Vec<f32> = receive(&mut bus, ms(1000)).iter().skip(1).map(|frame| pressure(frame)).collect();
    assert_eq!(received.len(), 7, "{received:?}");
    for (value, expected) in received.iter().zip([5.5, 6.0, 5.5, 5.0, 4.5, 4.0, 4.5]) {
        assert!((value - expected).abs() < 0.02, "{received:?}");
    }
}

/// Returns the REAL32 in the first four bytes.
fn pressure(frame: &str) -> f32 {
    let frame: Frame = frame.parse().expect("a frame");
    f32::from_le_bytes(frame.data()[..4].try_into().expect("four bytes"))
}

#[test]
fn passing_a_limit_sends_once() {
    let mut setup = constant("mh4", 5, 5.0);
    setup.channels[0].amplitude = 1.0;
    setup.channels[0].period_s = 1.0;
    setup.set = vec![
        (id("1800:2"), Scalar::Integer(254)),
        (id("6134:1"), Scalar::Real(4.2)),
        (id("6135:1"), Scalar::Real(5.8)),
        (id("6136:1"), Scalar::Real(0.1)),
    ];
    setup.start = true;
    let mut bus = bus([setup]);
    let received: Vec<f32> = receive(&mut bus, ms(2000)).iter().skip(1).map(|frame| pressure(frame)).collect();
    assert_eq!(received.len(), 4, "{received:?}");
    for (value, limit) in received.iter().zip([5.8, 4.2, 5.8, 4.2]) {
        assert!((value - limit).abs() < 0.01, "{received:?}");
    }
}

#[test]
fn hysteresis_prevents_repeated_events() {
    // The value (5 ± 1) never returns by the hysteresis of 2, so each limit is passed only once.
    let mut setup = constant("mh4", 5, 5.0);
    setup.channels[0].amplitude = 1.0;
    setup.channels[0].period_s = 1.0;
    setup.set = vec![
        (id("1800:2"), Scalar::Integer(254)),
        (id("6134:1"), Scalar::Real(4.5)),
        (id("6135:1"), Scalar::Real(5.5)),
        (id("6136:1"), Scalar::Real(2.0)),
    ];
    setup.start = true;
    let mut bus = bus([setup]);
    assert_eq!(receive(&mut bus, ms(5000)).len(), 1 + 2);
}

#[test]
fn event_causes_can_change_while_operational() {
    let mut setup = constant("mh4", 5, 5.0);
    setup.channels[0].amplitude = 1.05;
    setup.channels[0].period_s = 1.0;
    setup.set = vec![(id("1800:2"), Scalar::Integer(255))];
    setup.start = true;
    let mut bus = bus([setup]);
    assert_eq!(receive(&mut bus, ms(1000)), ["705#00"]);
    // 6133h:1 = 0.5.
    play(&mut bus, &[("605#233361010000003F", "585#6033610100000000")]);
    assert_eq!(receive(&mut bus, ms(2000)).len(), 7);
}

/// A device with an inhibit time; no built-in device has one.
const INHIBITED: &str = r#"
    name = "inhibited"
    title = ""
    vendor = ""
    source = ""
    [identify]
    [[signal]]
    name = "pressure"
    channel = 1
    value = "0x6130:1"
    [[object]]
    at = "0x1800:1"
    name = "cob-id"
    type = "u32"
    access = "rw"
    default = "$NODEID+0x180"
    [[object]]
    at = "0x1800:2"
    name = "transmission-type"
    type = "u8"
    access = "rw"
    default = 255
    [[object]]
    at = "0x1800:3"
    name = "inhibit-time"
    type = "u16"
    access = "rw"
    default = 2000
    [[object]]
    at = "0x1A00:0"
    name = "mapping-entries"
    type = "u8"
    access = "rw"
    default = 1
    [[object]]
    at = "0x1A00:1"
    name = "mapping"
    type = "u32"
    access = "rw"
    default = 0x61300120
    [[object]]
    at = "0x6130:1"
    name = "ai-input-pv"
    type = "r32"
    access = "ro"
    pdo = true
    [[object]]
    at = "0x6133:1"
    name = "delta"
    type = "r32"
    access = "rw"
    default = 0.1
"#;

#[test]
fn inhibit_time_separates_events() {
    let run = |inhibit: i64| {
        let model = Arc::new(Model::from_toml(INHIBITED).expect("a description"));
        let mut setup = Setup::new(model, node(5));
        let [channel] = &mut setup.channels[..] else { panic!("one channel") };
        (channel.base, channel.amplitude, channel.period_s, channel.noise) = (5.0, 1.0, 1.0, 0.0);
        setup.set = vec![(id("1800:3"), Scalar::Integer(inhibit))];
        setup.start = true;
        bus([setup])
    };
    // Without the inhibit time: 4 / 0.1 = 40 events in a second, the fastest after 16 ms.
    let mut uninhibited = run(0);
    assert!((36..=40).contains(&timed(&mut uninhibited, ms(1000)).len()));
    let mut inhibited = run(2000);
    let received = timed(&mut inhibited, ms(2000));
    let gaps: Vec<u128> = received[1..].windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    assert!(received.len() > 8 && gaps.iter().all(|gap| *gap >= 200), "{gaps:?}");
    assert!(gaps.contains(&200), "what was held back is sent as soon as it may: {gaps:?}");
    // The inhibit time can be changed only while the PDO is not valid.
    play(&mut inhibited, &[("605#2B00180300000000", "585#8000180330000906")]);
    ask(&mut inhibited, "605#2300180185010080");
    assert!(ask(&mut inhibited, "605#2B00180300000000").contains(&"585#6000180300000000".to_owned()));
}

#[test]
fn invalid_pdo_is_not_sent_and_a_new_cob_id_is_used() {
    let mut bus = bus([constant("mh4", 5, 5.0)]);
    play(
        &mut bus,
        &[
            ("000#0105", "705#00"),
            ("605#23001801850100C0", "585#6000180100000000"),
            ("080#", "-"),
            ("605#23001801AA010040", "585#6000180100000000"),
            ("080#", "1AA#0000A04000"),
            // Restricted, 29 bits, and a mapping entry by mistake.
            ("605#23001801AA0100C0", "585#6000180100000000"),
            ("605#2300180181050040", "585#8000180130000906"),
            ("605#2300180185010060", "585#8000180130000906"),
            ("605#2300180120013061", "585#8000180130000906"),
            ("605#4000180100000000", "585#43001801AA0100C0"),
        ],
    );
}

#[test]
fn sync_on_another_identifier() {
    let mut bus = bus([constant("mh4", 5, 5.0)]);
    play(
        &mut bus,
        &[
            ("605#2305100081000000", "705#00 585#6005100000000000"),
            ("000#0105", "-"),
            ("080#", "-"),
            ("081#", "185#0000A04000"),
            ("081#R", "-"),
            ("00000081#", "-"),
        ],
    );
}

#[test]
fn a_sync_with_bytes_is_an_emergency_on_mh4() {
    let mut bus = bus([constant("mh4", 5, 5.0)]);
    play(
        &mut bus,
        &[
            ("000#0105", "705#00"),
            ("080#01", "085#4082110000000000 185#0000A04000"),
            ("080#02", "185#0000A04000"),
            ("080#", "085#0000000000000000 185#0000A04000"),
        ],
    );
    let mut d20 = self::bus([constant("d20", 2, 5.0)]);
    play(&mut d20, &[("000#0102", "702#00"), ("080#01", "182#88130000")]);
}
