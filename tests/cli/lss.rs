//! `cangauge lss`: what it says, and the frames of the manuals.

use super::{ALL, Bench, Done};

/// A DPS as delivered, or at another node-ID.
fn dps(node: u8, more: &str) -> Bench {
    Bench::described(&format!("bit_rate = 125000\n[[device]]\nkind = \"dps\"\nnode = {node}\n{more}"))
}

/// The frames of NMT, LSS and boot-up from this one on.
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
    // The table ends with 000#0100, which starts every node; nobody was asked to be started.
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
    // Its heartbeat is 77Fh; the table prints 7FFh, which is nobody's.
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
    assert!(done.stderr.contains("puts the COB-IDs of 1014h and 180xh:1 to their defaults"), "{}", done.stderr);
    let done = Bench::of("mh4@1,dps@127").run("lss set-bitrate 1 250k --via sdo").exit(0);
    let writes: Vec<&str> = done.frames_of("601").into_iter().filter(|frame| frame.starts_with('2')).collect();
    assert_eq!(writes, ["2321230003736574", "2310100173617665"]);
    assert_eq!(done.frames_of("000"), [""; 0]);
}

#[test]
fn no_command_sends_nmt_to_anybody_else() {
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
fn what_set_id_says() {
    let done = Bench::of(ALL).run("lss set-id 127 12").prints("12\n");
    let lines: Vec<&str> = done.stderr.lines().collect();
    assert_eq!(lines[..2], ["node 127 is Honeywell DPS, serial 20002; 12 is free", "node-ID 12 configured, stored"]);
    assert!(
        lines[2].starts_with("boot-up from 12 after ") && lines[2].ends_with("identity confirmed; TPDO1 is at 0x18C")
    );
    let done = Bench::of(ALL).run("lss set-id 1 12 -f json").prints(
        "{\"target\":\"1\",\"old\":1,\"new\":12,\"stored\":true,\"confirmed\":\"boot-up\",\"vendor\":71,\"product\":1,\
         \"revision\":65543,\"serial\":10001,\"device\":\"mh4\",\"stale\":[]}\n",
    );
    assert_eq!(done.json()[0]["new"], 12);
    let done = Bench::of(ALL).run("lss set-id only 12").exit(1);
    assert_eq!(done.stderr.lines().next(), Some("cangauge: nodes 1, 2, 3, 127 are there: nothing was changed"));
}

#[test]
fn what_set_bitrate_says() {
    let done = Bench::of(ALL).run("lss set-bitrate 1 500k -f json").exit(0);
    let report = &done.json()[0];
    assert_eq!((&report["bit_rate"], &report["table_index"]), (&500_000.into(), &2.into()));
    assert_eq!((&report["retimed"], &report["confirmed"]), (&false.into(), &"ack".into()));
    let done = Bench::of("mh4@1").run("lss set-bitrate 1 500k --retime").prints("500000\n");
    assert!(done.stderr.contains("node 1 answers at 500k"), "{}", done.stderr);
    Bench::of(ALL).run("lss set-bitrate 1 auto").prints("auto\n");
    Bench::of(ALL).run("lss set-bitrate 2 --table-index 6").prints("50000\n");
    let done = Bench::of(ALL).run("lss set-bitrate 127 800k").exit(2);
    assert_eq!(
        done.stderr,
        "cangauge: Honeywell DPS has no bit rate 800k: nothing was changed\n\
         hint: its table has 1M, 500k, 250k, 125k, 100k, 50k; another by its index: --table-index N\n"
    );
    Bench::of("mh4@1").run("lss set 1 --id 12 --bitrate 500k --retime").prints("12 500000\n");
}

#[test]
fn several_without_a_node_id_in_one_line() {
    let unconfigured = |serial: u32| format!("[[device]]\nkind = \"mh4\"\nserial = {serial}\n");
    let bench = Bench::described(&[30, 10, 20].map(unconfigured).concat());
    let done = bench.run("lss set-id unconfigured 12-14 -f json").exit(0);
    let told: Vec<_> =
        done.json().iter().map(|done| (done["new"].clone(), done["serial"].clone(), done["old"].clone())).collect();
    assert_eq!(
        told,
        [(12, 10), (13, 20), (14, 30)].map(|(new, serial)| (new.into(), serial.into(), serde_json::Value::Null))
    );
    let done = bench.run("lss set-id unconfigured 12-15").exit(7);
    assert_eq!(done.stdout, "12\n13\n14\n");
}

#[test]
fn who_is_there_and_who_he_is() {
    let bench = Bench::described("[[device]]\nkind = \"dps\"\nnode = 5\n[[device]]\nkind = \"mh4\"\nserial = 77\n");
    let done = bench.run("lss scan").exit(0);
    assert_eq!(
        done.stdout,
        "NODE  DEVICE  VENDOR      PRODUCT     REVISION    SERIAL\n   \
            5  dps     0x00000362  0x00443150  0x00010000   20002\n   \
            -  -       0x00000047  0x00000001  0x00010007      77\n"
    );
    let done = bench.run("lss scan -f json").exit(0);
    assert_eq!(done.json()[1]["node"], serde_json::Value::Null);
    // Each is set aside while the next one is looked for, and nobody is changed by it.
    let several = [30, 10, 20].map(|serial| format!("[[device]]\nkind = \"mh4\"\nserial = {serial}\n")).concat();
    let done = Bench::described(&several).run("lss scan -f csv").exit(0);
    let serials: Vec<_> = done.stdout.lines().skip(1).map(|line| line.rsplit(',').next().unwrap_or_default()).collect();
    assert_eq!((serials, done.stderr.as_str()), (vec!["10", "20", "30"], ""));
    let services: Vec<&str> = done.frames_of("7E5").into_iter().map(|frame| &frame[..2]).collect();
    assert!(!services.iter().any(|service| ["11", "13", "15", "17"].contains(service)), "{services:?}");
    assert_eq!(done.frames_of("7E5").last(), Some(&"0400000000000000"), "left again");
    // One that takes part in configuration state, too, hides the others, which is said.
    let hides = "[[device]]\nkind = \"mh4\"\nserial = 10\nlss = { endless_fastscan = true }\n";
    let done =
        Bench::described(&format!("{hides}[[device]]\nkind = \"mh4\"\nserial = 20\n")).run("lss scan -f json").exit(0);
    assert_eq!((done.json().len(), done.json()[0]["serial"].clone()), (1, 10.into()), "{}", done.stdout);
    assert!(done.stderr.contains("whether there are more devices"), "{}", done.stderr);
    Bench::of(ALL).run("lss inquire 1").prints("0x47:0x1:0x10007:10001  node 1\n");
    Bench::of(ALL).run("lss inquire 1 -f json").prints(
        "{\"target\":\"1\",\"node\":1,\"unconfigured\":false,\"vendor\":71,\"product\":1,\"revision\":65543,\"serial\":10001}\n",
    );
    Bench::of(ALL).run("lss identify 71:1:0-0xFFFFFFFF:10000-10002").prints("yes\n");
    let done = Bench::of(ALL).run("lss identify 71:1:0-0xFFFFFFFF:10002-10009").exit(3);
    assert!(done.stderr.contains("no LSS slave within 0x47:0x1:0x0-0xFFFFFFFF:10002-10009 answers"), "{}", done.stderr);
}

#[test]
fn wrong_words_are_refused_before_the_bus_is_opened() {
    let bench = Bench::of(ALL);
    bench
        .run("lss set-id 0 12")
        .refuses("\"0\" names no device (5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured)");
    bench
        .run("lss set-id 1:2:3 12")
        .refuses("\"1:2:3\" names no device (5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured)");
    bench.run("lss set-id 1 12-14").refuses("one device takes one node-ID; several are for \"unconfigured\"");
    bench.run("lss set-id 1 all").refuses("one device takes one node-ID; several are for \"unconfigured\"");
    bench.run("lss set-bitrate 1 auto --table-index 3").refuses("auto and --table-index exclude each other");
    bench.run("--device dps lss set-bitrate 1 800k").refuses("Honeywell DPS has no bit rate 800k: nothing was changed");
    bench
        .run("lss activate all 66s")
        .refuses("the delay goes from 1ms to 65.535s (CiA 305 has 16 bits for milliseconds)");
}

#[test]
fn objects_are_not_set_without_storing_them() {
    let what = "what stands in its objects comes into force once it is stored (0x1010:1) and reset, so that --no-store \
                cannot be: nothing was changed\nhint: leave --no-store out, or by LSS where it has it: --via lss\n";
    let done = Bench::of(ALL).run("lss set-id 1 12 --via sdo --no-store").exit(2);
    assert_eq!(done.stderr, format!("cangauge: node 1: {what}"));
    assert!(
        !done.frames_of("601").iter().any(|frame| frame.starts_with('2')),
        "only read: {:?}",
        done.frames_of("601")
    );
    assert_eq!((done.frames_of("000"), done.frames_of("7E5")), (vec![], vec![]));
    // Where it is said what the device is, the bus is not opened for it.
    let done = Bench::of(ALL).run("lss set-bitrate 1 125k --via sdo --no-store --device mh4").exit(2);
    assert_eq!((done.stderr, done.frames.len()), (format!("cangauge: {what}"), 0));
}
