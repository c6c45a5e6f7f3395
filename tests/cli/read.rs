//! `cangauge read`.

use super::{ALL, Bench};
use serde_json::json;

/// Devices with constant values.
fn constant() -> Bench {
    Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n\
         [[device.channel]]\nchannel = 1\nbase = 1.25\namplitude = 0.0\nnoise = 0.0\n\
         [[device.channel]]\nchannel = 2\nbase = 25.5\namplitude = 0.0\nnoise = 0.0\n\
         [[device]]\nkind = \"dps\"\nnode = 127\n\
         [[device.channel]]\nchannel = 1\nbase = 50.0\namplitude = 0.0\nnoise = 0.0\n",
    )
}

/// Devices in overload.
fn overloaded() -> Bench {
    let overload = "[[device.overload]]\nchannel = 1\nfrom = \"0s\"\n";
    Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n{overload}direction = \"high\"\n\
         [[device]]\nkind = \"mh4\"\nnode = 6\n{overload}direction = \"low\"\n",
    ))
}

const NO_ANSWER: &str = "cangauge: node 9: read 0x1000:0: no answer within 500 ms\nhint: check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor 9\n";

#[test]
fn one_signal_of_one_node_is_a_bare_number() {
    let bench = constant();
    let done = bench.run("read 5 pressure").prints("1.25\n");
    assert_eq!(done.stderr, "");
    bench.run("read 127 pressure").prints("50.000\n");
    bench.run("read 5 temperature").prints("25.5\n");
}

#[test]
fn several_signals_are_a_table_with_unit_and_status() {
    constant().run("read 5,127").prints(
        "5    pressure     1.25 bar    ok\n\
         5    temperature  25.5 degC   ok\n\
         127  pressure     50.000 psi  (no status)\n",
    );
}

#[test]
fn json_and_csv() {
    let bench = constant();
    let done = bench.run("read 5,127 -f json").prints(
        "{\"node\":5,\"signal\":\"pressure\",\"value\":1.25,\"unit\":\"bar\",\"status\":\"ok\"}\n\
         {\"node\":5,\"signal\":\"temperature\",\"value\":25.5,\"unit\":\"degC\",\"status\":\"ok\"}\n\
         {\"node\":127,\"signal\":\"pressure\",\"value\":50.0,\"unit\":\"psi\",\"status\":null}\n",
    );
    assert_eq!(done.json().len(), 3);
    bench.run("read 127 -f csv").prints("node,signal,value,unit,status\n127,pressure,50.000,psi,\n");
}

#[test]
fn values_are_converted_to_another_unit() {
    let bench = constant();
    // 50 psi = 50 * 0.0689475729 bar, with the number of digits that was sent.
    bench.run("read 127 pressure --in bar").prints("3.4474\n");
    bench.run("read 5 pressure --in mbar").prints("1250.000\n");
    bench
        .run("read 5 pressure --in degC")
        .fails(2, "cangauge: node 5: pressure is in bar, which does not convert to degC\n");
    bench
        .run("read 5 pressure --in furlong")
        .refuses("\"furlong\" is not a known unit (bar, mbar, kPa, MPa, psi, degC, degF, K, 0x4E0000)");
}

#[test]
fn units_are_found_in_another_case_and_c_means_degrees() {
    let bench = constant();
    bench.run("read 127 pressure --in BAR").prints("3.4474\n");
    let done = bench.run("read 5 temperature --in F -f csv").exit(0);
    assert!(done.stdout.contains(",degF,"), "{}", done.stdout);
    bench.run("read 5 pressure --in C").fails(2, "cangauge: node 5: pressure is in bar, which does not convert to C\n");
    bench.run("read 5 pressure --in MBAR").refuses("the unit \"MBAR\" is ambiguous: Mbar or mbar");
    bench.run("unit 5 temperature f").exit(0);
    bench.run("unit 5 pressure PSI").exit(0);
}

#[test]
fn signals_of_another_quantity_keep_their_unit() {
    let bench = constant();
    let done = bench.run("read 5 --in psi -f csv").exit(0);
    assert!(done.stdout.contains("5,pressure,18.12972,psi,") && done.stdout.contains(",degC,"), "{}", done.stdout);
    assert_eq!(done.stderr, "node 5: temperature is not converted (degC)\n");
    bench.run("read 5 pressure temperature --in psi").exit(2);
    // Nothing converts.
    bench.run("read 5 --in mV").exit(2);
}

#[test]
fn objects_and_status_objects() {
    let bench = constant();
    bench.run("read 5 0x6130:1").prints("1.25\n");
    bench.run("read 5 pressure.status").prints("0\n");
    bench.run("read 127 pressure.status").fails(2, "cangauge: node 127: pressure has no status object\n");
    overloaded().run("read 5 pressure.status").prints("3\n");
    overloaded().run("read 6 pressure.status").prints("5\n");
}

#[test]
fn invalid_value_has_no_number() {
    let bench = overloaded();
    let done = bench.run("read 5 pressure").exit(6);
    assert_eq!(
        (done.stdout.as_str(), done.stderr.as_str()),
        ("", "cangauge: node 5: pressure has no valid value: overload-high\n")
    );
    let rows = bench.run("read 5-6 pressure -f json").exit(0).json();
    assert_eq!(
        rows,
        [
            json!({"node": 5, "signal": "pressure", "value": null, "unit": "bar", "status": "overload-high"}),
            json!({"node": 6, "signal": "pressure", "value": null, "unit": "bar", "status": "overload-low"}),
        ]
    );
    bench.run("read 5-6 pressure").prints("5  pressure  -  overload-high\n6  pressure  -  overload-low\n");
}

#[test]
fn absent_node_is_exit_3() {
    let done = constant().run("read 9 pressure").fails(3, NO_ANSWER);
    let asked = done.frames_of("609");
    let two = ["4000100000000000", "4018100100000000"];
    assert_eq!(asked, [two[0], two[0], two[1], two[1]], "one retry each; a device may lack 1000h");
    let done = constant().run("read 9 -t 50ms --retries 0").exit(3);
    assert!(done.stderr.contains("no answer within 50 ms"), "{}", done.stderr);
    assert_eq!(done.frames_of("609"), two);
}

#[test]
fn values_of_answering_nodes_are_printed() {
    let bench = constant();
    let done = bench.run("read 9,127").exit(7);
    assert_eq!(done.stdout, "127  pressure  50.000 psi  (no status)\n");
    assert_eq!(done.stderr, NO_ANSWER);
    let done = bench.run("read 9,10").exit(3);
    assert_eq!(done.stdout, "");
    assert_eq!(done.stderr, format!("{NO_ANSWER}{}", NO_ANSWER.replace('9', "10")), "each is named");
    let done = bench.run("read 9 -f json").exit(3);
    assert_eq!(
        done.error(),
        json!({"error": {"kind": "no-answer", "exit": 3, "message": "node 9: read 0x1000:0: no answer within 500 ms",
            "node": 9, "object": "0x1000:0", "abort": null, "hint": "check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor 9"}})
    );
}

#[test]
fn rejected_read_is_exit_4() {
    let bench = constant();
    bench
        .run("read 5 0x5000:1")
        .fails(4, "cangauge: node 5: read 0x5000:1: refused by the device (0x06020000, the object does not exist)\n");
    let error = bench.run("read 5 0x5000:1 -f json").exit(4).error();
    assert_eq!(
        (&error["error"]["kind"], &error["error"]["abort"], &error["error"]["object"]),
        (&json!("refused"), &json!("0x06020000"), &json!("0x5000:1"))
    );
}

#[test]
fn unknown_signal_is_a_usage_error() {
    constant()
        .run("read 5 presure")
        .fails(2, "cangauge: node 5: no signal \"presure\" (it has: pressure, temperature)\n");
}

#[test]
fn all_means_the_nodes_that_answer() {
    let done = Bench::of(ALL).run("read all -f json").exit(0);
    let rows = done.json();
    let of = |node: u8| rows.iter().filter(|row| row["node"] == node).count();
    assert_eq!((of(1), of(2), of(3), of(127), rows.len()), (2, 1, 16, 1, 20));
    assert_eq!(done.frames_of("000"), [""; 0], "reading sends no NMT");
}

#[test]
fn user_can_choose_the_description() {
    let bench = constant();
    // With the description of a DPS, its REAL32 is read as an INTEGER32 with 3 digits.
    bench.run("read 5 pressure --device 5=dps").prints("1067450.368\n");
    bench.run("read 5 pressure --device 6=dps").prints("1.25\n");
    bench.run("read 5 --device mh5").refuses("no built-in device \"mh5\"");
    bench
        .run("read 5 --device none.toml")
        .fails(8, "cangauge: read none.toml: No such file or directory (os error 2)\n");
}

#[test]
fn error_in_a_description_names_its_line() {
    let bench = constant();
    let head = "name = \"mine\"\ntitle = \"Transmitter\"\nvendor = \"Maker\"\n\n";
    let signal = |name: &str| format!("[[signal]]\nname = \"{name}\"\nchannel = 1\nvalue = \"0x6130:1\"\n\n");
    let refuses = |text: String, message: &str| {
        std::fs::write(bench.path("mine.toml"), text).expect("written");
        bench.run("read 5 --device mine.toml").refuses(message);
        bench.finish(&mut bench.command(&["-b", "sim:mine.toml@5", "read", "5"])).refuses(message);
    };
    let two = head.to_owned() + &signal("pressure") + &signal("temperature");
    refuses(two, "mine.toml:12:11: channel: two signals have the channel 1");
    let again = head.to_owned() + &signal("pressure") + &signal("pressure").replace("= 1", "= 2");
    refuses(again, "mine.toml:11:8: name: two signals have the name \"pressure\"");
    let none = head.to_owned() + &signal("pressure").replace("= 1", "= 0");
    refuses(none, "mine.toml:7:11: channel: 0 is not in the range 1 to 199");
    let unknown = head.to_owned() + "[sdo]\nsizes = \"omitted\"\n";
    refuses(unknown, "mine.toml:6:1: unknown key \"sizes\" (known: size, expedited_only, block, aborts)");
}

#[test]
fn all_skips_nodes_without_the_signal() {
    let done = Bench::of("mh4@1,mc1609@3").run("read all pressure -f json").exit(0);
    assert_eq!(done.stdout.lines().count(), 1, "{}", done.stdout);
    assert!(done.stderr.starts_with("node 3: no signal \"pressure\" (it has: ch1, "), "{}", done.stderr);
    Bench::of("mh4@1,mc1609@3").run("read 1,3 pressure").exit(7);
    Bench::of("mh4@1,mc1609@3").run("read all humidity").exit(2);
}

#[test]
fn user_can_state_the_type_of_an_object() {
    let bench = Bench::of("mh4@1");
    bench.run("read 1 0x1008/i16").fails(
        6,
        "cangauge: node 1: read 0x1008:0: the device delivered 8 bytes, but i16 has 2\nhint: show its bytes: cangauge \
         sdo read 1 0x1008:0 --type hex\n",
    );
    bench.run("read 1 0x7130:1/u16").exit(0);
    bench.run("read 1 0x6130:1/vs").exit(2);
    bench.run("check 1 0x1017:0/u16<1").exit(0);
}

#[test]
fn each_json_error_of_several_nodes_keeps_its_own_kind() {
    let done = constant().run("read 5,9 -f json").exit(7);
    assert_eq!(done.stdout.lines().count(), 2, "{}", done.stdout);
    let errors: Vec<serde_json::Value> = done.stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [error] = &errors[..] else { panic!("one error: {}", done.stderr) };
    assert_eq!(error["error"]["kind"], "no-answer");
    assert_eq!(error["error"]["exit"], 3);
    assert_eq!(error["error"]["node"], 9);
}
