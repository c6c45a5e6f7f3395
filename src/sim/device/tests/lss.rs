//! Tests of node-ID and bit rate: accepted values, activation and storage.

use super::*;
use std::collections::BTreeMap;

const RESTART_TIME: Duration = Duration::from_millis(200);

/// Receives the frames until the device has booted again.
fn later(bus: &mut MemoryBus) -> Vec<String> {
    let until = bus.now().mono + RESTART_TIME;
    receive(bus, until)
}

fn unconfigured(kind: &str) -> Setup {
    Setup { node: None, ..constant(kind, 1, 0.0) }
}

#[test]
fn the_frames_of_a_dps_point_to_point() {
    let mut bus = bus([constant("dps", 127, 1.0)]);
    play(
        &mut bus,
        &[
            ("000#807F", "77F#00"),
            ("7E5#0401000000000000", "-"),
            ("7E5#117E000000000000", "7E4#1100000000000000"),
            ("7E5#1700000000000000", "7E4#1700000000000000"),
            ("7E5#0400000000000000", "-"),
            ("000#817F", "-"),
        ],
    );
    assert_eq!(later(&mut bus), ["77E#00"]);
    assert_eq!(device(&mut bus).stored().0, Some(node(126)));
    bus.power_cycle();
    assert_eq!(later(&mut bus), ["77E#00"]);
    play(&mut bus, &[("67E#4000180100000000", "5FE#42001801FE010040")]);
}

#[test]
fn the_frames_of_a_dps_on_a_network() {
    let mut bus = bus([constant("dps", 126, 1.0), constant("mh4", 1, 1.0)]);
    play(
        &mut bus,
        &[
            ("000#807E", "701#00 77E#00"),
            ("7E5#4062030000000000", "-"),
            ("7E5#4150314400000000", "-"),
            ("7E5#4200000100000000", "-"),
            ("7E5#43224E0000000000", "7E4#4400000000000000"),
            ("7E5#117F000000000000", "7E4#1100000000000000"),
            ("7E5#1700000000000000", "7E4#1700000000000000"),
            ("7E5#0400000000000000", "-"),
            ("000#817E", "-"),
        ],
    );
    assert_eq!(later(&mut bus), ["77F#00"]);
}

#[test]
fn bit_rate_changes_after_two_silent_delays() {
    let mut bus = bus([Setup { set: vec![(id("1017"), Scalar::Integer(100))], ..constant("mh4", 5, 1.0) }]);
    play(
        &mut bus,
        &[
            ("7E5#0401000000000000", "705#00"),
            ("7E5#1300030000000000", "7E4#1300000000000000"),
            ("7E5#15E8030000000000", "-"),
            ("7E5#0400000000000000", "-"),
            ("605#4000100000000000", "-"),
        ],
    );
    // Back to 250 kbit/s, so that its frames can be received.
    assert_eq!(timed(&mut bus, ms(2100)), [(2010, "705#7F".to_owned())]);
    assert!(!device(&mut bus).is_configuring());
    play(&mut bus, &[("605#4000100000000000", "585#4300100094018200")]);
}

#[test]
fn unstored_bit_rate_is_lost_at_power_off() {
    let mut bus = bus([constant("mh4", 5, 1.0)]);
    play(
        &mut bus,
        &[("7E5#0401", "705#00"), ("7E5#0401000000000000", "-"), ("7E5#1300040000000000", "7E4#1300000000000000")],
    );
    play(&mut bus, &[("7E5#150A000000000000", "-")]);
    receive(&mut bus, ms(100));
    assert_eq!((device(&mut bus).bit_rate(), device(&mut bus).stored().1), (Some(125_000), Some(250_000)));
    bus.power_cycle();
    assert_eq!(device(&mut bus).bit_rate(), Some(250_000));
}

#[test]
fn unstored_node_id_is_lost_at_power_off() {
    let mut bus = bus([constant("mh4", 5, 1.0)]);
    play(&mut bus, &[("7E5#0401000000000000", "705#00"), ("7E5#1107000000000000", "7E4#1100000000000000")]);
    // The old node-ID is active until the reset.
    play(&mut bus, &[("605#4020230000000000", "585#4320230005000000"), ("000#8205", "-")]);
    assert_eq!(later(&mut bus), ["707#00"]);
    assert!(!device(&mut bus).is_configuring(), "a reset ends the configuration state");
    play(&mut bus, &[("607#4020230000000000", "587#4320230007000000"), ("000#8107", "-")]);
    assert_eq!(later(&mut bus), ["707#00"]);
    bus.power_cycle();
    assert_eq!(later(&mut bus), ["705#00"]);
}

#[test]
fn unconfigured_device_answers_lss_only() {
    let mut bus = bus([unconfigured("mh4")]);
    assert_eq!(later(&mut bus), [""; 0]);
    assert_eq!((device(&mut bus).node(), device(&mut bus).state()), (None, None));
    play(
        &mut bus,
        &[
            ("000#0100", "-"),
            ("000#8100", "-"),
            ("601#4000100000000000", "-"),
            ("080#", "-"),
            ("7E5#4C00000000000000", "7E4#5000000000000000"),
            ("7E5#0401000000000000", "-"),
            ("7E5#5E00000000000000", "7E4#5EFF000000000000"),
            ("7E5#1109000000000000", "7E4#1100000000000000"),
            ("7E5#0400000000000000", "-"),
        ],
    );
    assert_eq!(later(&mut bus), ["709#00"]);
    play(&mut bus, &[("609#4000180100000000", "589#4300180189010040"), ("7E5#4C00000000000000", "-")]);
    // The node-ID was not stored.
    bus.power_cycle();
    assert_eq!(later(&mut bus), [""; 0]);
}

#[test]
fn node_id_can_be_removed() {
    let mut bus = bus([constant("mh4", 5, 1.0)]);
    play(&mut bus, &[("7E5#0401000000000000", "705#00"), ("7E5#11FF000000000000", "7E4#1100000000000000")]);
    play(&mut bus, &[("7E5#1700000000000000", "7E4#1700000000000000"), ("000#8205", "-")]);
    assert_eq!(later(&mut bus), [""; 0]);
    play(&mut bus, &[("7E5#4C00000000000000", "7E4#5000000000000000")]);
}

#[test]
fn lss_works_in_the_listed_states_only() {
    let mut bus = bus([constant("d20", 5, 1.0)]);
    let select = ["7E5#4047000000000000", "7E5#4100000000000000", "7E5#4200000000000000", "7E5#4333750000000000"];
    let identity =
        [2, 3].map(|sub| device(&mut bus).value(ObjectId::new(0x1018, sub), Mono::START).expect("an object"));
    let text = |service: &str, bytes: &[u8]| {
        format!("7E5#{service}{}000000", bytes.iter().map(|byte| format!("{byte:02X}")).collect::<String>())
    };
    let (product, revision) = (text("41", &identity[0]), text("42", &identity[1]));
    play(&mut bus, &[(select[0], "705#00"), (&product, "-"), (&revision, "-"), (select[3], "-"), ("000#0205", "-")]);
    play(&mut bus, &[(select[0], "-"), (&product, "-"), (&revision, "-"), (select[3], "7E4#4401000000000000")]);
}

/// Figure 3 and table 10 of the DPS manual: NMT and LSS are available in the stopped state.
#[test]
fn dps_answers_lss_in_pre_operational_and_stopped() {
    let mut bus = bus([constant("dps", 127, 1.0)]);
    let [vendor, product, revision, serial] =
        ["7E5#4062030000000000", "7E5#4150314400000000", "7E5#4200000100000000", "7E5#43224E0000000000"];
    play(&mut bus, &[(vendor, "77F#00"), (product, "-"), (revision, "-"), (serial, "7E4#4400000000000000")]);
    play(&mut bus, &[("7E5#0400000000000000", "-"), ("000#027F", "-")]);
    play(&mut bus, &[(vendor, "-"), (product, "-"), (revision, "-"), (serial, "7E4#4400000000000000")]);
    play(&mut bus, &[("7E5#0400000000000000", "-"), ("000#017F", "-")]);
    play(&mut bus, &[(vendor, "-"), (product, "-"), (revision, "-"), (serial, "-")]);
}

#[test]
fn a_bit_rate_by_object() {
    let mut bus = bus([constant("mh4", 5, 1.0)]);
    play(
        &mut bus,
        &[
            ("605#4021230000000000", "705#00 585#4321230003000000"),
            ("605#2321230005736574", "585#8021230030000906"),
            ("605#2320230080736574", "585#8020230030000906"),
            ("605#2321230004736574", "585#6021230000000000"),
            ("605#2310100173617665", "585#6010100100000000"),
        ],
    );
    assert_eq!((device(&mut bus).bit_rate(), device(&mut bus).stored().1), (Some(250_000), Some(125_000)));
    ask(&mut bus, "000#8105");
    assert_eq!(device(&mut bus).bit_rate(), Some(125_000));
}

#[test]
fn automatic_detection_reads_back_the_detected_rate() {
    let mut bus = bus([constant("mh4", 5, 1.0)]);
    play(&mut bus, &[("605#2321230009736574", "705#00 585#6021230000000000")]);
    play(&mut bus, &[("605#2310100173617665", "585#6010100100000000"), ("000#8105", "-")]);
    later(&mut bus);
    assert_eq!((device(&mut bus).bit_rate(), device(&mut bus).stored().1), (None, None));
    play(&mut bus, &[("605#4021230000000000", "585#4321230003000000")]);
    // Storing another group does not disable automatic detection.
    play(&mut bus, &[("605#2310100173617665", "585#6010100100000000")]);
    assert_eq!(device(&mut bus).stored().1, None);
}

#[test]
fn answers_can_be_lost_late_and_slow() {
    let mut setup = constant("mh4", 5, 1.0);
    setup.oddities.lose = vec![0x11];
    setup.oddities.late = BTreeMap::from([(0x17, Duration::from_millis(20))]);
    setup.oddities.latency = Duration::from_millis(1);
    let mut bus = bus([setup]);
    play(&mut bus, &[("7E5#0401000000000000", "705#00"), ("7E5#1107000000000000", "-")]);
    // Only the answer was lost.
    play(&mut bus, &[("7E5#1700000000000000", "-")]);
    assert_eq!(device(&mut bus).stored().0, Some(node(7)));
    assert_eq!(later(&mut bus), ["7E4#1700000000000000"]);
    play(&mut bus, &[("7E5#1107000000000000", "7E4#1100000000000000")]);
    let (sent, seen) = (bus.now().mono, ask(&mut bus, "605#4000100000000000"));
    assert_eq!(seen, ["585#4300100094018200"]);
    assert!(bus.now().mono.since(sent) >= Duration::from_millis(1));
}

#[test]
fn offline_after_a_reset_or_an_activation() {
    for (gone, last) in [(OfflineAfter::Reset, "000#8105"), (OfflineAfter::Activate, "7E5#1500000000000000")] {
        let mut setup = constant("mh4", 5, 1.0);
        setup.oddities.offline_after = vec![gone];
        let mut bus = bus([setup, constant("mh4", 6, 1.0)]);
        receive(&mut bus, ms(1));
        play(&mut bus, &[("7E5#0401000000000000", "-")]);
        ask(&mut bus, last);
        later(&mut bus);
        play(&mut bus, &[("605#4000100000000000", "-"), ("7E5#4C00000000000000", "-")]);
        assert_eq!(device(&mut bus).state(), None);
        bus.power_cycle();
        later(&mut bus);
        play(&mut bus, &[("605#4000100000000000", "585#4300100094018200")]);
    }
}

#[test]
fn devices_that_store_a_written_node_id_themselves() {
    let mut bus = bus([constant("hydac-old", 5, 1.0)]);
    ask(&mut bus, "605#2301200007736574");
    assert_eq!((device(&mut bus).node(), device(&mut bus).stored().0), (Some(node(5)), Some(node(7))));
    bus.power_cycle();
    assert_eq!(receive(&mut bus, ms(300)), ["707#00"]);
}

#[test]
fn devices_that_store_the_node_id_by_1010h() {
    let mut bus = bus([constant("baumer", 5, 1.0)]);
    play(
        &mut bus,
        &[
            ("605#2201210007000000", "705#00 585#6001210000000000"),
            ("605#2200210009000000", "585#8000210030000906"),
            ("605#2200210005000000", "585#6000210000000000"),
        ],
    );
    assert_eq!(device(&mut bus).stored(), (Some(node(5)), Some(250_000)));
    ask(&mut bus, "605#2210100173617665");
    assert_eq!(device(&mut bus).stored(), (Some(node(7)), Some(500_000)));
    ask(&mut bus, "000#8105");
    assert_eq!((device(&mut bus).node(), device(&mut bus).bit_rate()), (Some(node(7)), Some(500_000)));
}

#[test]
fn devices_that_store_the_node_id_by_their_own_sub_index() {
    let entry = |at: &str, name: &str, kind: &str, more: &str| {
        format!("[[object]]\nat = \"{at}\"\nname = \"{name}\"\ntype = \"{kind}\"\naccess = \"rw\"\n{more}\n")
    };
    let text = [
        "name = \"own\"\ntitle = \"\"\nvendor = \"\"\nsource = \"\"\n[identify]\n[bit_rates]\n3 = 250000\n4 = 125000\n",
        "[[assign]]\nway = \"objects\"\nstore = \"0x1010:4\"\n",
        "node_id = { object = \"0x2003:2\", type = \"u8\" }\nbit_rate = { object = \"0x2004:2\", type = \"u16\" }\n",
        &entry("0x1010:1", "store-all", "u32", "signature = \"save\""),
        &entry("0x1010:4", "store-lss", "u32", "signature = \"save\""),
        &entry("0x2003:2", "pending-node-id", "u8", ""),
        &entry("0x2004:2", "pending-bit-rate", "u16", ""),
    ]
    .concat();
    let model = Arc::new(Model::from_toml(&text).expect("a description"));
    let mut bus = bus([Setup::new(model, node(5))]);
    play(
        &mut bus,
        &[
            ("605#4003200200000000", "705#00 585#4F03200205000000"),
            ("605#4004200200000000", "585#4B04200203000000"),
            ("605#2F03200207000000", "585#6003200200000000"),
            ("605#2B04200204000000", "585#6004200200000000"),
            ("605#2310100173617665", "585#6010100100000000"),
        ],
    );
    assert_eq!(device(&mut bus).stored(), (Some(node(5)), Some(250_000)), "1010h:1 leaves them");
    play(&mut bus, &[("605#2310100473617665", "585#6010100400000000")]);
    assert_eq!(device(&mut bus).stored(), (Some(node(7)), Some(125_000)));
}
