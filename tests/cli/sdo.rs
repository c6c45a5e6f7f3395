//! `cangauge sdo`.

use super::{ALL, Bench, Done};
use serde_json::json;
use std::fs;

#[test]
fn one_object_is_a_bare_value() {
    let bench = Bench::of(ALL);
    let done = bench.run("sdo read 1 0x1018:1").prints("71\n");
    assert_eq!(done.frames, ["601#4018100100000000", "701#00", "581#4318100147000000"]);
    for form in ["1018:1", "1018h:1", "1018.1", "0x1018:0x1", "1018:01h", "vendor-id", "Vendor-Id"] {
        bench.run(&format!("sdo read 1 {form}")).prints("71\n");
    }
    bench.run("sdo read 1 1008").prints("MH-4-CAN\n");
}

#[test]
fn several_objects_are_lines_of_object_and_value() {
    Bench::of(ALL)
        .run("sdo read 1 vendor-id 0x1018:4 1008h")
        .prints("vendor-id 71\n0x1018:4 10001\n0x1008:0 MH-4-CAN\n");
}

#[test]
fn json() {
    Bench::of(ALL).run("sdo read 1 0x1018:1 0x1008 0x6130:1 -f json").exit(0).json().iter().enumerate().for_each(
        |(at, found)| match at {
            0 => assert_eq!(
                *found,
                json!({"node": 1, "object": "0x1018:1", "name": "vendor-id", "type": "u32", "value": 71,
                    "raw": "0x47000000"})
            ),
            1 => assert_eq!(
                *found,
                json!({"node": 1, "object": "0x1008:0", "name": "device-name", "type": "vs", "value": "MH-4-CAN",
                    "raw": "0x4D482D342D43414E"})
            ),
            _ => assert!(found["type"] == "r32" && found["value"].is_f64(), "{found}"),
        },
    );
}

#[test]
fn user_can_state_the_type() {
    let bench = Bench::of(ALL);
    bench.run("sdo read 1 0x1018:1 --hex").prints("0x00000047\n");
    bench.run("sdo read 1 0x1018:1 --bytes").prints("47 00 00 00\n");
    bench.run("sdo read 1 0x1018:1 --type hex").prints("47 00 00 00\n");
    bench.run("sdo read 1 0x1008 --hex").prints("4D 48 2D 34 2D 43 41 4E\n");
    bench.run("sdo read 1 0x1017 --hex").prints("0x0000\n");
    // COB-IDs, mapping entries and unit codes are hexadecimal as in the manuals.
    bench.run("sdo read 1 0x1800:1").prints("0x40000181\n");
    bench.run("sdo read 1 0x1A00:1").prints("0x61300120\n");
    bench.run("sdo read 1 0x6131:1").prints("0x004E0000\n");
    bench.run("sdo read 1 0x1018:1 --type i32").prints("71\n");
    // The value is wider than the type, and the excess is not zero: the error names both widths.
    bench.run("sdo read 1 0x1008 --type u8").fails(
        6,
        "cangauge: node 1: read 0x1008:0: the device delivered 8 bytes, but u8 has 1\n\
         hint: show its bytes: cangauge sdo read 1 0x1008:0 --type hex\n",
    );
    let done = bench.run("sdo read 1 0x1017 --type u32").prints("0\n");
    assert_eq!(done.stderr, "warning: node 1: 0x1017:0: the device delivered 2 bytes for 4\n");
}

/// The requests to node 5 after its identity, which decides the form of the write.
fn after_identity(done: &Done) -> Vec<&str> {
    let requests = done.frames_of("605").into_iter();
    requests
        .skip_while(|request| request.starts_with('4') || request.ends_with("0000000000") && &request[..1] >= "6")
        .collect()
}

#[test]
fn value_is_written_with_the_width_of_its_type() {
    let bench = Bench::of("mh4@5");
    let done = bench.run("sdo write 5 0x1017 1000").prints("");
    assert_eq!((after_identity(&done), done.stderr.as_str()), (vec!["2B171000E8030000"], ""));
    let done = bench.run("sdo write 5 producer-heartbeat-time 0x3E8 --verify").prints("");
    assert_eq!(after_identity(&done), ["2B171000E8030000", "4017100000000000"], "written and read back");
    let done = bench.run("sdo write 5 0x1017=500 0x1800:5=100").prints("");
    assert_eq!(after_identity(&done), ["2B171000F4010000", "2B00180564000000"]);
    let done = bench.run("--verbose sdo write 5 0x1017 1000").prints("");
    assert_eq!(done.stderr, "node 5: 0x1017:0 written: E8 03\n");
}

#[test]
fn acknowledged_value_that_is_not_kept_is_exit_6() {
    // HYDAC: a COB-ID of 0 sets the default.
    let bench = Bench::of("hydac@5");
    let message = "the write of 0x1800:1 was acknowledged, but its value is 85 01 00 40 instead of 00 00 00 00";
    bench.run("sdo write 5 0x1800:1 0 --verify").fails(6, &format!("cangauge: node 5: {message}\n"));
}

#[test]
fn value_that_does_not_fit_is_not_sent() {
    let bench = Bench::of("mh4@5");
    for (value, why) in [
        ("70000", "70000 does not fit u16 (0 to 65535)"),
        ("65536", "65536 does not fit u16 (0 to 65535)"),
        ("-5", "-5 does not fit u16 (0 to 65535)"),
        ("1.5", "\"1.5\" is not a value of type u16"),
        ("abc", "\"abc\" is not a value of type u16"),
        ("0x10000", "0x10000 does not fit u16 (0 to 65535)"),
    ] {
        bench.run(&format!("sdo write 5 0x1017 {value}")).refuses(&format!("0x1017:0: {why}"));
    }
    bench.run_words(&["sdo", "write", "5", "0x1017", ""]).refuses("0x1017:0: \"\" is not a value of type u16");
    bench.run("sdo write 5 0x5000 300 --type u8").refuses("0x5000:0: 300 does not fit u8 (0 to 255)");
    bench
        .run("sdo write 5 0x5000 1e39 --type r32")
        .refuses("0x5000:0: 1e39 does not fit r32 (-3.4028235e38 to 3.4028235e38)");
    bench.run("sdo write 5 0x5000 xyz --type hex").refuses("0x5000:0: \"xyz\" is not a value of type os");
    // If one of several values does not fit, none is written.
    bench.run("sdo write 5 0x1017=500 0x1800:5=70000").refuses("0x1800:5: 70000 does not fit u16 (0 to 65535)");
    bench
        .run("sdo write 5 0x1017=500 0x1800:5")
        .refuses("\"0x1800:5\" has no value: give OBJECT VALUE, or OBJECT=VALUE for each");
}

#[test]
fn value_is_checked_against_the_description_before_the_write() {
    // 2023h is specific to the MH-4: only the requests for its identity are sent.
    let done = Bench::of("mh4@5").run("sdo write 5 0x2023:1 70000").exit(2);
    assert_eq!(done.stderr, "cangauge: node 5: write 0x2023:1: 70000 does not fit u16 (0 to 65535)\n");
    // 4xh starts a read, 6xh and 7xh continue it; 2xh would be a write.
    assert!(done.frames_of("605").iter().all(|request| request.starts_with(['4', '6', '7'])), "{:?}", done.frames);
}

#[test]
fn unknown_type_must_be_stated() {
    Bench::of("mh4@5").run("sdo write 5 0x5000 5").fails(
        2,
        "cangauge: node 5: write 0x5000:0: its type is unknown\n\
         hint: add the type: cangauge sdo write 5 0x5000:0 VALUE --type u32 (or i16, r32, vs)\n",
    );
}

#[test]
fn rejected_request_is_exit_4() {
    let bench = Bench::of("mh4@5");
    bench
        .run("sdo write 5 0x1018:1 5")
        .fails(4, "cangauge: node 5: write 0x1018:1: refused by the device (0x06010002, the object is read-only)\n");
    bench
        .run("sdo read 5 0x5000")
        .fails(4, "cangauge: node 5: read 0x5000:0: refused by the device (0x06020000, the object does not exist)\n");
    // The values read before are printed.
    let done = bench.run("sdo read 5 0x1018:1 0x5000 0x1018:4").exit(4);
    assert_eq!(done.stdout, "0x1018:1 71\n");
}

#[test]
fn absent_node_is_exit_3() {
    let bench = Bench::of("mh4@1");
    let hint =
        "hint: check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor 5\n";
    let done = bench
        .run("sdo read 5 0x6130:1")
        .fails(3, &format!("cangauge: node 5: read 0x6130:1: no answer within 500 ms\n{hint}"));
    assert_eq!(done.frames_of("605"), ["4030610100000000"; 2], "the server never answered: no abort is sent");
    assert!(done.times.last().is_some_and(|last| (500_000..520_000).contains(last)), "{:?}", done.times);
    bench
        .run("sdo write 5 0x1017 100")
        .fails(3, &format!("cangauge: node 5: write 0x1017:0: no answer within 500 ms\n{hint}"));
    let error = bench.run("sdo read 5 0x6130:1 -f json -t 2s").exit(3).error();
    assert_eq!(
        error,
        json!({"error": {"kind": "no-answer", "exit": 3, "message": "node 5: read 0x6130:1: no answer within 2 s",
            "node": 5, "object": "0x6130:1", "abort": null, "hint": "check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor 5"}})
    );
}

#[test]
fn unknown_names_are_refused() {
    let bench = Bench::of("mh4@5");
    bench
        .run("sdo read 5 vendor-di")
        .fails(2, "cangauge: node 5: WIKA MH-4-CAN has no object \"vendor-di\"\nhint: similar names: vendor-id\n");
    bench.run("sdo read 5 nonsense").fails(2, "cangauge: node 5: WIKA MH-4-CAN has no object \"nonsense\"\n");
    bench.run("sdo read 5 0x10180:1").exit(2);
    bench.run("sdo read 5 0x1018:256").exit(2);
    bench.run("sdo read 1-3 0x1018:1").refuses("\"1-3\" is not a node-ID (1 to 127)");
}

#[test]
fn bytes_to_and_from_files() {
    let bench = Bench::of("mh4@5");
    bench.run("sdo read 5 0x1008 --output name.bin").prints("");
    assert_eq!(fs::read(bench.path("name.bin")).expect("the file"), b"MH-4-CAN");
    bench.run("sdo read 5 0x1018:1 --output name.bin").refuses("name.bin exists");
    assert_eq!(fs::read(bench.path("name.bin")).expect("the file"), b"MH-4-CAN");
    bench.run("sdo read 5 0x1018:1 --output name.bin --force").prints("");
    assert_eq!(fs::read(bench.path("name.bin")).expect("the file"), [0x47, 0, 0, 0]);
    bench.run("sdo read 9 0x1008 --output other.bin").exit(3);
    assert_eq!(bench.files(), ["name.bin"], "a failed read leaves no file");
    bench.run("sdo read 5 0x1008 0x1018:1 --output other.bin").refuses("--output takes one object");

    fs::write(bench.path("time.bin"), [0xe8, 0x03]).expect("written");
    let done = bench.run("sdo write 5 0x1017 --input time.bin").prints("");
    assert_eq!(after_identity(&done), ["2B171000E8030000"]);
    bench
        .run("sdo write 5 0x1017 --input none.bin")
        .fails(8, "cangauge: read none.bin: No such file or directory (os error 2)\n");
    bench.run("sdo write 5 0x1017 5 --input time.bin").refuses("--input takes one object and no value");
}

#[test]
fn text_from_a_device_is_escaped() {
    let bench = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1008\" = \"a\\u001B[2Jb\" }\n");
    bench.run("sdo read 5 0x1008").prints("a\\x1B[2Jb\n");
    let done = bench.run("sdo read 5 0x1008 -f json").exit(0);
    assert_eq!(done.json()[0]["value"], "a\u{1b}[2Jb", "JSON has its own escapes");
    let table = bench.run("scan 5").exit(0).stdout;
    assert!(table.contains("a\\x1B[2Jb") && !table.contains('\u{1b}'), "{table}");
}

#[test]
fn another_sdo_channel_is_used_as_stated() {
    let bench = Bench::of("mh4@5");
    for option in ["--sdo 0x645:0x5C5", "--sdo 5=0x645:0x5C5"] {
        let done = bench.run(&format!("sdo read 5 0x1000 {option}")).exit(3);
        let sent = done.frames_of("645");
        assert!(sent.len() > 1 && sent.iter().all(|frame| *frame == "4000100000000000"), "605h only answers: {sent:?}");
        assert_eq!(done.frames_of("605"), [""; 0]);
    }
    bench.run("sdo read 5 0x1000 --sdo 6=0x645:0x5C5").exit(0);
    bench.run("scan --sdo 0x645:0x5C5").refuses("the node of --sdo is missing");
    bench.run("sdo read 5 0x1000 --sdo 0x645:0x645").exit(2);
    bench.run("sdo read 5 0x1000 --sdo 0x000:0x585").exit(2);
}

#[test]
fn stopped_node_is_named_in_the_error() {
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\nset = { \"0x1017\" = 100 }\nanswers_only = [\"0x1001\"]\n",
    );
    let done = bench.run("sdo read 5 0x1000").exit(3);
    assert!(done.stderr.contains("; its heartbeat shows operational"), "{}", done.stderr);
    let done = bench.run("sdo read 5 0x1001 0x1000").exit(3);
    assert!(
        done.stderr.contains("hint: the node answered before; find the cause: cangauge doctor 5; if it is only slow"),
        "{}",
        done.stderr
    );
}
