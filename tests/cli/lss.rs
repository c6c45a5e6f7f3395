//! `cangauge lss`: outputs, and the frames of the manuals.

use super::{ALL, Bench, Done};

/// A DPS, with other settings in `more`.
fn dps(node: u8, more: &str) -> Bench {
    Bench::described(&format!("bit_rate = 125000\n[[device]]\nkind = \"dps\"\nnode = {node}\n{more}"))
}

/// The frames of NMT, LSS and boot-up, starting with this one.
#[track_caller]
fn from<'a>(done: &'a Done, first: &str) -> Vec<&'a str> {
    let frames = done.frames.iter().map(String::as_str).skip_while(|frame| *frame != first);
    frames
        .filter(|frame| ["000#", "7E4#", "7E5#"].iter().any(|id| frame.starts_with(id)) || frame.ends_with("#00"))
        .collect()
}

#[test]
fn dps_table_3_a_node_id_point_to_point() {
    let done = dps(127, "").run("lss set-id only 126").exit(0);
    assert_eq!(
        from(&done, "000#807F"),
        [
            "000#807F",
            "7E5#0401000000000000",
            "7E5#117E000000000000",
            "7E4#1100000000000000",
            "7E5#1700000000000000",
            "7E4#1700000000000000",
            "7E5#0400000000000000",
            "000#817F",
            "77E#00",
        ]
    );
    assert_eq!(done.stdout, "126\n");
}

#[test]
fn dps_table_4_a_node_id_on_a_network() {
    let done = dps(126, "serial = 0x12345678\n").run("lss set-id 126 127").exit(0);
    assert_eq!(
        from(&done, "000#807E"),
        [
            "000#807E",
            "7E5#4062030000000000",
            "7E5#4150314400000000",
            "7E5#4200000100000000",
            "7E5#4378563412000000",
            "7E4#4400000000000000",
            "7E5#117F000000000000",
            "7E4#1100000000000000",
            "7E5#1700000000000000",
            "7E4#1700000000000000",
            "7E5#0400000000000000",
            "000#817E",
            "77F#00",
        ]
    );
}

#[test]
fn dps_table_5_a_bit_rate_point_to_point() {
    // The table ends with 000#0100, which would start every node. The command starts none.
    let done = dps(127, "").run("lss set-bitrate only 125k").exit(0);
    assert_eq!(
        from(&done, "000#807F"),
        [
            "000#807F",
            "7E5#0401000000000000",
            "7E5#1300040000000000",
            "7E4#1300000000000000",
            "7E5#1700000000000000",
            "7E4#1700000000000000",
            "7E5#0400000000000000",
        ]
    );
}

#[test]
fn dps_table_6_a_bit_rate_on_a_network() {
    let done = dps(126, "serial = 0x12345678\n").run("lss set-bitrate 126 125k").exit(0);
    assert_eq!(
        from(&done, "000#807E"),
        [
            "000#807E",
            "7E5#4062030000000000",
            "7E5#4150314400000000",
            "7E5#4200000100000000",
            "7E5#4378563412000000",
            "7E4#4400000000000000",
            "7E5#1300040000000000",
            "7E4#1300000000000000",
            "7E5#1700000000000000",
            "7E4#1700000000000000",
            "7E5#0400000000000000",
        ]
    );
}

#[test]
fn dps_table_8_activate_bit_timing() {
    let done = dps(127, "").run("--device dps sdo write 127 0x1017 100").exit(0);
    let written: Vec<&str> =
        done.frames.iter().map(String::as_str).filter(|frame| frame.contains("17100064")).collect();
    assert_eq!(written, ["67F#2217100064000000"]);
    assert!(done.frames.contains(&"5FF#6017100000000000".to_owned()), "{:?}", done.frames);
    // The heartbeat is 77Fh. The table prints 7FFh, which no node uses.
    let beating = || dps(127, "set = { \"0x1017\" = 100 }\n");
    let done = beating().run("lss set-bitrate only 125k --no-store").exit(0);
    assert_eq!(
        from(&done, "000#807F"),
        ["000#807F", "7E5#0401000000000000", "7E5#1300040000000000", "7E4#1300000000000000", "7E5#0400000000000000",]
    );
    assert!(done.frames_of("77F").contains(&"7F"), "{:?}", done.frames);
    let done = beating().run("lss activate only 1s").exit(0);
    assert_eq!(
        from(&done, "000#807F"),
        ["000#807F", "7E5#0401000000000000", "7E5#15E8030000000000", "7E5#0400000000000000"]
    );
}

#[test]
fn mh4_2320h_and_2321h() {
    let done = Bench::of("mh4@1,dps@127").run("lss set-id 1 3 --via sdo").exit(0);
    let writes: Vec<&str> = done.frames_of("601").into_iter().filter(|frame| frame.starts_with('2')).collect();
    assert_eq!(writes, ["2320230003736574", "2310100173617665"]);
    assert_eq!(
        (done.frames_of("000"), done.frames_of("703"), done.frames_of("7E5")),
        (vec!["8101"], vec!["00"], vec![])
    );
    assert!(done.stderr.contains("resets the COB-IDs of 1014h and 180xh:1 to their defaults"), "{}", done.stderr);
    let done = Bench::of("mh4@1,dps@127").run("lss set-bitrate 1 250k --via sdo").exit(0);
    let writes: Vec<&str> = done.frames_of("601").into_iter().filter(|frame| frame.starts_with('2')).collect();
    assert_eq!(writes, ["2321230003736574", "2310100173617665"]);
    assert_eq!(done.frames_of("000"), [""; 0]);
}

#[test]
fn nmt_goes_to_the_named_node_only() {
    for line in
        ["lss scan", "lss inquire 1", "lss identify 71:1:0-0xFFFFFFFF:0-0xFFFFFFFF", "lss store 1", "lss set-id 9 12"]
    {
        let done = Bench::of(ALL).run(line);
        assert_eq!(done.frames_of("000"), [""; 0], "{line}");
    }
    let done = Bench::of(ALL).run("lss set-id 1 12").exit(0);
    assert_eq!(done.frames_of("000"), ["8101"]);
}

#[test]
fn set_id_prints_steps_and_result() {
    let done = Bench::of(ALL).run("lss set-id 127 12").prints("12\n");
    let lines: Vec<&str> = done.stderr.lines().collect();
    assert_eq!(
        lines[..2],
        ["node 127: Honeywell DPS, serial 20002; node-ID 12 is free", "node 127: node-ID 12 configured, stored"]
    );
    assert!(
        lines[2].starts_with("boot-up of node 12 after ")
            && lines[2].ends_with("identity confirmed; TPDO1 has COB-ID 0x18C")
    );
    let done = Bench::of(ALL).run("lss set-id 1 12 -f json").prints(
        "{\"target\":\"1\",\"old\":1,\"new\":12,\"stored\":true,\"confirmed\":\"boot-up\",\"vendor\":71,\"vendor_name\":\"WIKA\",\
         \"product\":1,\"revision\":1,\"serial\":10001,\"device\":\"mh4\",\"bit_rate\":null,\"table_index\":null,\
         \"retimed\":false,\"stale\":[],\"notes\":[]}\n",
    );
    assert_eq!(done.json()[0]["new"], 12);
    let done = Bench::of(ALL).run("lss set-id only 12").exit(1);
    assert_eq!(
        done.stderr.lines().next(),
        Some("cangauge: several nodes are on the bus: 1, 2, 3, 127; nothing was changed")
    );
}

#[test]
fn set_bitrate_prints_steps_and_result() {
    let done = Bench::of(ALL).run("lss set-bitrate 1 500k -f json").exit(0);
    let report = &done.json()[0];
    assert_eq!((&report["bit_rate"], &report["table_index"]), (&500_000.into(), &2.into()));
    assert_eq!((&report["retimed"], &report["confirmed"]), (&false.into(), &"ack".into()));
    let done = Bench::of("mh4@1").run("lss set-bitrate 1 500k --retime").prints("500000\n");
    assert!(done.stderr.contains("node 1: it answers at 500k"), "{}", done.stderr);
    Bench::of(ALL).run("lss set-bitrate 1 auto").prints("auto\n");
    Bench::of(ALL).run("lss set-bitrate 2 --table-index 6").prints("index 6\n");
    let done = Bench::of(ALL).run("lss set-bitrate 127 800k").exit(2);
    assert_eq!(
        done.stderr,
        "cangauge: node 127: Honeywell DPS has no bit rate 800k; nothing was changed\n\
         hint: its table has 1M, 500k, 250k, 125k, 100k, 50k; for another rate: --table-index N\n"
    );
    Bench::of("mh4@1").run("lss set 1 --id 12 --bitrate 500k --retime").prints("12 500000\n");
}

#[test]
fn several_unconfigured_devices_get_ids_in_one_command() {
    let unconfigured = |serial: u32| format!("[[device]]\nkind = \"mh4\"\nserial = {serial}\n");
    let bench = Bench::described(&[30, 10, 20].map(unconfigured).concat());
    let done = bench.run("lss set-id unconfigured 12-14 -f json").exit(0);
    let assigned: Vec<_> =
        done.json().iter().map(|done| (done["new"].clone(), done["serial"].clone(), done["old"].clone())).collect();
    assert_eq!(
        assigned,
        [(12, 10), (13, 20), (14, 30)].map(|(new, serial)| (new.into(), serial.into(), serde_json::Value::Null))
    );
    let done = bench.run("lss set-id unconfigured 12-15").exit(7);
    assert_eq!(done.stdout, "12\n13\n14\n");
}

#[test]
fn scan_inquire_and_identify() {
    let bench = Bench::described("[[device]]\nkind = \"dps\"\nnode = 5\n[[device]]\nkind = \"mh4\"\nserial = 77\n");
    let done = bench.run("lss scan").exit(0);
    assert_eq!(
        done.stdout,
        "NODE  VENDOR     PRODUCT     REVISION    SERIAL  DEVICE\n   \
            5  Honeywell  0x00443150  0x00010000   20002  dps\n   \
            -  WIKA       0x00000001  0x00000001      77  -\n"
    );
    let done = bench.run("lss scan -f json").exit(0);
    assert_eq!(done.json()[1]["node"], serde_json::Value::Null);
    // A found device stays in configuration state during the next search. No device is changed.
    let several = [30, 10, 20].map(|serial| format!("[[device]]\nkind = \"mh4\"\nserial = {serial}\n")).concat();
    let done = Bench::described(&several).run("lss scan -f csv").exit(0);
    let serials: Vec<_> = done.stdout.lines().skip(1).map(|line| line.rsplit(',').nth(1).unwrap_or_default()).collect();
    assert_eq!((serials, done.stderr.as_str()), (vec!["10", "20", "30"], ""));
    let services: Vec<&str> = done.frames_of("7E5").into_iter().map(|frame| &frame[..2]).collect();
    assert!(!services.iter().any(|service| ["11", "13", "15", "17"].contains(service)), "{services:?}");
    assert_eq!(done.frames_of("7E5").last(), Some(&"0400000000000000"), "left again");
    // A device that also answers in configuration state hides the others: a warning.
    let hides = "[[device]]\nkind = \"mh4\"\nserial = 10\nlss = { endless_fastscan = true }\n";
    let done =
        Bench::described(&format!("{hides}[[device]]\nkind = \"mh4\"\nserial = 20\n")).run("lss scan -f json").exit(0);
    assert_eq!((done.json().len(), done.json()[0]["serial"].clone()), (1, 10.into()), "{}", done.stdout);
    assert!(done.stderr.contains("more devices than 0x47:0x1:0x1:10 may have no node-ID"), "{}", done.stderr);
    Bench::of(ALL).run("lss inquire 1").prints("0x47:0x1:0x1:10001  node 1\n");
    Bench::of(ALL).run("lss inquire 1 -f json").prints(
        "{\"target\":\"1\",\"node\":1,\"unconfigured\":false,\"vendor\":71,\"vendor_name\":\"WIKA\",\"product\":1,\"revision\":1,\"serial\":10001}\n",
    );
    Bench::of(ALL).run("lss identify 71:1:0-0xFFFFFFFF:10000-10002").prints("yes\n");
    let done = Bench::of(ALL).run("lss identify 71:1:0-0xFFFFFFFF:10002-10009").exit(3);
    assert!(done.stderr.contains("no LSS slave within 0x47:0x1:0x0-0xFFFFFFFF:10002-10009 answers"), "{}", done.stderr);
}

#[test]
fn wrong_arguments_are_rejected_before_the_bus_is_opened() {
    let bench = Bench::of(ALL);
    bench
        .run("lss set-id 0 12")
        .refuses("\"0\" is not a device (5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured)");
    bench
        .run("lss set-id 1:2:3 12")
        .refuses("\"1:2:3\" is not a device (5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured)");
    bench
        .run("lss set-id 1 12-14")
        .refuses("give one new node-ID; several are possible for the target \"unconfigured\" only");
    bench
        .run("lss set-id 1 all")
        .refuses("give one new node-ID; several are possible for the target \"unconfigured\" only");
    bench.run("lss set-bitrate 1 auto --table-index 3").refuses("use either auto or --table-index");
    bench.run("--device dps lss set-bitrate 1 800k").refuses("Honeywell DPS has no bit rate 800k");
    bench
        .run("lss activate all 66s")
        .refuses("the delay must be from 1ms to 65.535s (CiA 305 has 16 bits for milliseconds)");
}

#[test]
fn objects_require_a_store() {
    let cause = "its objects take effect only after they are stored (0x1010:1) and the device is reset";
    let hint = "hint: omit --no-store, or use LSS: --via lss\n";
    let done = Bench::of(ALL).run("lss set-id 1 12 --via sdo --no-store").exit(2);
    assert_eq!(done.stderr, format!("cangauge: node 1: {cause}; nothing was changed\n{hint}"));
    assert!(
        !done.frames_of("601").iter().any(|frame| frame.starts_with('2')),
        "only read: {:?}",
        done.frames_of("601")
    );
    assert_eq!((done.frames_of("000"), done.frames_of("7E5")), (vec![], vec![]));
    // With --device the bus is not opened.
    let done = Bench::of(ALL).run("lss set-bitrate 1 125k --via sdo --no-store --device mh4").exit(2);
    assert_eq!((done.stderr, done.frames.len()), (format!("cangauge: {cause}\n{hint}"), 0));
}
