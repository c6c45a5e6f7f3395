//! Tests of stored values: store, restore, node-ID, autozero.

use super::*;

#[test]
fn store_restore_and_reset() {
    let mut bus = bus([constant("mh4", 5, 5.0)]);
    let reset = |bus: &mut MemoryBus| {
        ask(bus, "000#8105");
        let until = bus.now().mono + Duration::from_millis(150);
        receive(bus, until)
    };
    play(
        &mut bus,
        &[
            ("605#233161010000AB00", "705#00 585#6031610100000000"),
            ("605#2B17100060EA0000", "585#6017100000000000 705#7F"),
            ("605#2310100365766173", "585#8010100320000008"),
            ("605#2310100373617665", "585#6010100300000000"),
        ],
    );
    assert_eq!(reset(&mut bus), ["705#00"]);
    play(
        &mut bus,
        &[
            ("605#4031610100000000", "585#433161010000AB00"),
            ("605#4017100000000000", "585#4B17100000000000"),
            // Restored after the reset, not before.
            ("605#231110016C6F6164", "585#6011100100000000"),
            ("605#4031610100000000", "585#433161010000AB00"),
        ],
    );
    assert_eq!(reset(&mut bus), ["705#00"]);
    play(&mut bus, &[("605#4031610100000000", "585#4331610100004E00")]);
}

/// The reason for the warning after a restore without a reset: no object shows the restore, and a store cancels it.
#[test]
fn a_store_between_restore_and_reset_keeps_the_old_values() {
    for (kind, answers) in [("mh4", "43"), ("d20", "42"), ("dps", "42")] {
        let mut bus = bus([constant(kind, 5, 5.0)]);
        receive(&mut bus, ms(1));
        let kpa = if kind == "dps" { "00002203" } else { "0000AB00" };
        let [unit, save, load] =
            [format!("605#22316101{kpa}"), "605#2210100173617665".into(), "605#221110016C6F6164".into()];
        let read = |bus: &mut MemoryBus| ask(bus, "605#4031610100000000").pop().expect("an answer");
        let factory_value = read(&mut bus);
        for frame in [unit, save, load] {
            let answer = ask(&mut bus, &frame).pop().expect("an answer");
            assert!(answer.starts_with("585#60"), "{kind}: {answer}");
        }
        assert_eq!(read(&mut bus), format!("585#{answers}316101{kpa}"), "{kind}: unchanged until the reset");
        ask(&mut bus, "605#2210100173617665");
        assert_eq!(reset(&mut bus, "000#8105"), ["705#00"]);
        assert_eq!(read(&mut bus), format!("585#{answers}316101{kpa}"), "{kind}: the store cancels the restore");
        // Without the store, the restore is effective.
        ask(&mut bus, "605#221110016C6F6164");
        assert_eq!(reset(&mut bus, "000#8105"), ["705#00"]);
        assert_eq!(read(&mut bus), factory_value, "{kind}");
    }
}

#[test]
fn mh4_store_all_resets_the_cob_ids() {
    for (sub, after) in [("01", "4300180185010040"), ("02", "43001801AA010040")] {
        let mut bus = bus([constant("mh4", 5, 5.0)]);
        ask(&mut bus, "605#23001801850100C0");
        ask(&mut bus, "605#23001801AA010040");
        assert_eq!(ask(&mut bus, &format!("605#231010{sub}73617665")), [format!("585#601010{sub}00000000")]);
        assert_eq!(ask(&mut bus, "605#4000180100000000"), ["585#43001801AA010040"], "unchanged until the reset");
        ask(&mut bus, "000#8105");
        let until = bus.now().mono + Duration::from_millis(150);
        receive(&mut bus, until);
        assert_eq!(ask(&mut bus, "605#4000180100000000"), [format!("585#{after}")]);
    }
}

/// MC1609, 2.3: "After changing the Node-ID the COB-IDs of EMCY, SDO, TPDO1 … will be adjusted". The MH-4 keeps its
/// COB-IDs.
#[test]
fn new_node_id_resets_the_cob_ids_of_the_mc1609() {
    for (kind, tpdo, emcy) in
        [("mc1609", "430018018C010000", "431410008C000000"), ("mh4", "43001801AA010040", "431410008C000000")]
    {
        let mut bus = bus([constant(kind, 5, 5.0)]);
        ask(&mut bus, "605#23001801850100C0");
        ask(&mut bus, "605#23001801AA010040");
        ask(&mut bus, "605#2314100090000000");
        assert_eq!(ask(&mut bus, if kind == "mh4" { "605#2310100273617665" } else { "605#2310100173617665" }).len(), 1);
        // A reset with the same node-ID does not change the COB-IDs.
        assert_eq!(reset(&mut bus, "000#8105"), ["705#00"]);
        assert_eq!(ask(&mut bus, "605#4000180100000000"), ["585#43001801AA010040"], "{kind}");
        play(
            &mut bus,
            &[
                ("7E5#0401000000000000", "-"),
                ("7E5#110C000000000000", "7E4#1100000000000000"),
                ("7E5#1700000000000000", "7E4#1700000000000000"),
                ("7E5#0400000000000000", "-"),
            ],
        );
        assert_eq!(reset(&mut bus, "000#8105"), ["70C#00"]);
        play(
            &mut bus,
            &[("60C#4000180100000000", &format!("58C#{tpdo}")), ("60C#4014100000000000", &format!("58C#{emcy}"))],
        );
    }
}

#[test]
fn signed_node_id_is_active_after_store_and_reset() {
    let mut bus = bus([constant("mh4", 5, 5.0)]);
    play(
        &mut bus,
        &[
            ("605#2320230003000000", "705#00 585#8020230020000008"),
            ("605#2320230003736574", "585#6020230000000000"),
            ("605#2310100173617665", "585#6010100100000000"),
            ("000#8105", "-"),
        ],
    );
    assert_eq!(receive(&mut bus, ms(300)), ["703#00"]);
    assert_eq!(device(&mut bus).node(), Some(node(3)));
    play(
        &mut bus,
        &[
            ("605#4000100000000000", "-"),
            ("603#4000100000000000", "583#4300100094018200"),
            ("603#4000180100000000", "583#4300180183010040"),
        ],
    );
    // D-20-9: only the names of these objects are known. The simulator treats them as those of the MH-4.
    let mut d20 = self::bus([constant("d20", 2, 5.0)]);
    play(
        &mut d20,
        &[
            ("602#2220230009000000", "702#00 582#8020230020000008"),
            ("602#2220230009736574", "582#6020230000000000"),
            ("602#2221230002736574", "582#6021230000000000"),
            ("602#2210100173617665", "582#6010100100000000"),
        ],
    );
    assert_eq!(device(&mut d20).stored(), (Some(node(9)), Some(500_000)));
    assert_eq!(reset(&mut d20, "000#8102"), Vec::<String>::new(), "it is at another bit rate");
}

#[test]
fn autozero_and_the_extremes() {
    let mut bus = bus([constant("mh4", 5, 0.25)]);
    play(
        &mut bus,
        &[
            ("605#4020200100000000", "705#00 585#432020010000803E"),
            ("605#236561017A65726F", "585#8065610100000206"),
            ("605#232561017A65726F", "585#6025610100000000"),
            ("605#4025610100000000", "585#8025610101000106"),
            ("605#4027610100000000", "585#43276101000080BE"),
            ("605#4030610100000000", "585#4330610100000000"),
            ("605#232220017A65726F", "585#6022200100000000"),
            ("605#4020200100000000", "585#4320200100000000"),
        ],
    );
}

#[test]
fn scaling_factor_is_applied() {
    let mut bus = bus([constant("mh4", 5, 1.5)]);
    play(
        &mut bus,
        &[
            ("605#2326610100000040", "705#00 585#6026610100000000"),
            ("605#4030610100000000", "585#4330610100004040"),
            ("605#2326610200000040", "585#8026610202000106"),
        ],
    );
}

/// Resets the device and returns the frames from the boot-up on.
fn reset(bus: &mut MemoryBus, command: &str) -> Vec<String> {
    ask(bus, command);
    let until = bus.now().mono + Duration::from_millis(150);
    receive(bus, until)
}

#[test]
fn d20_stores_and_restores_as_on_pages_12_and_13() {
    let mut bus = bus([constant("d20", 1, 0.5)]);
    play(
        &mut bus,
        &[
            ("601#4010100100000000", "701#00 581#4210100101000000"),
            ("601#4010100200000000", "581#8010100211000906"),
            ("601#2217100064000000", "581#6017100000000000 701#7F"),
            ("601#2210100165766173", "581#8010100120000008"),
            ("601#2210100173617665", "581#6010100100000000"),
            ("601#2217100000000000", "581#6017100000000000"),
        ],
    );
    assert_eq!(reset(&mut bus, "000#8101"), ["701#00"]);
    play(
        &mut bus,
        &[
            ("601#4017100000000000", "581#4217100064000000"),
            ("601#2211100173617665", "581#8011100120000008"),
            ("601#221110016C6F6164", "581#6011100100000000"),
            // "The default values are set valid after the device is reset."
            ("601#4017100000000000", "581#4217100064000000"),
        ],
    );
    assert_eq!(reset(&mut bus, "000#8101"), ["701#00"]);
    play(&mut bus, &[("601#4017100000000000", "581#4217100000000000")]);
}

#[test]
fn dps_autozero_follows_table_30_and_pdo_settings_are_not_stored() {
    let mut bus = bus([constant("dps", 127, 0.5)]);
    play(
        &mut bus,
        &[
            ("67F#4030610100000000", "77F#00 5FF#42306101F4010000"),
            ("67F#222561017A65726F", "5FF#6025610100000000"),
            ("67F#4030610100000000", "5FF#4230610100000000"),
            ("67F#4024610100000000", "5FF#422461010CFEFFFF"),
            ("67F#22001805E8030000", "5FF#6000180500000000"),
            ("67F#2210100173617665", "5FF#6010100100000000"),
        ],
    );
    assert_eq!(reset(&mut bus, "000#817F"), ["77F#00"]);
    play(
        &mut bus,
        &[
            ("67F#4030610100000000", "5FF#4230610100000000"),
            ("67F#4000180500000000", "5FF#4200180564000000"),
            ("67F#221110016C6F6164", "5FF#6011100100000000"),
        ],
    );
    assert_eq!(reset(&mut bus, "000#817F"), ["77F#00"]);
    play(&mut bus, &[("67F#4030610100000000", "5FF#42306101F4010000")]);
}
