//! `cangauge unit`, `filter`, `limits`, `minmax`, `errors`.

use super::Bench;
use serde_json::json;
use std::fs;
use std::path::Path;

/// Devices with constant values: a DPS at 50 psi, an MH-4 at 1.25 bar and 25.5 degC, an MC1609.
fn constant() -> Bench {
    Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n{}{}[[device]]\nkind = \"dps\"\nnode = 127\n{}\
         [[device]]\nkind = \"mc1609\"\nnode = 3\n[[device]]\nkind = \"d20\"\nnode = 2\n{}",
        channel(1, 1.25),
        channel(2, 25.5),
        channel(1, 50.0),
        channel(1, 4.0)
    ))
}

fn channel(number: u8, base: f64) -> String {
    format!("[[device.channel]]\nchannel = {number}\nbase = {base:?}\namplitude = 0.0\nnoise = 0.0\n")
}

const STORE: &str = "not stored: the node loses the new values at power off; to keep them: cangauge store";

fn kept(node: u8) -> serde_json::Value {
    json!({"code": "kept-until-power-off", "message": "not stored: the node loses the new values at power off",
        "command": format!("cangauge store {node}")})
}

#[test]
fn unit_of_one_signal_is_bare_text() {
    let bench = constant();
    bench.run("unit 127").prints("psi\n");
    bench.run("unit 5 temperature").prints("degC\n");
    bench
        .run("unit 5")
        .prints("pressure     bar   (accepts bar, psi, MPa)\ntemperature  degC  (accepts degC, degF, K)\n");
    let done = bench.run("unit 5 pressure -f json").exit(0);
    assert_eq!(
        done.json(),
        [json!({"node": 5, "signal": "pressure", "unit": "bar", "code": "0x004E0000",
            "takes": ["bar", "psi", "MPa"], "fixed": false})]
    );
    bench.run("unit 127 -f csv").prints("node,signal,unit,code\n127,pressure,psi,0x00AB0000\n");
}

/// DPS manual, table 19: from psi to bar; the pressure is 50.000 psi, then 3.447 bar (3.448 in print).
#[test]
fn new_unit_rescales_other_values() {
    let done = constant().run("unit 127 bar").exit(0);
    assert_eq!(
        done.stdout,
        "pressure           psi          ->  bar\n\
         pressure-span      100.000 psi  ->  6.895 bar\n\
         ai-input-offset:1  0.000 psi    ->  0.000 bar\n\
         ai-input-pv:1      50.000 psi   ->  3.447 bar\n\
         ai-span-start:1    0.000 psi    ->  0.000 bar\n\
         ai-span-end:1      100.000 psi  ->  6.895 bar\n"
    );
    assert_eq!(done.stderr, format!("node 127: {STORE} 127\n"));
    let writes: Vec<&str> = done.frames_of("67F").into_iter().filter(|frame| frame.starts_with("22")).collect();
    assert_eq!(writes, ["2231610100004E00"], "one write, as printed");
    let answers = done.frames_of("5FF");
    assert!(answers.contains(&"4230610150C30000"), "50.000 psi: {answers:?}");
    // The values after the write are read after it.
    let at = answers.iter().position(|frame| *frame == "6031610100000000").expect("acknowledged");
    assert_eq!(answers[at + 1], "4231610100004E00", "read back first");
    assert!(answers[at + 1..].contains(&"42306101770D0000"), "{answers:?}");
}

/// HYDAC VFL, 3.5.2.4: the unit of the device temperature is in 4617h:1; there is no channel 2 of CiA 404.
#[test]
fn unit_is_written_to_the_object_of_the_description() {
    let bench = Bench::of("hydac@1");
    let fixed =
        bench.run("unit 1 degF").fails(2, "cangauge: node 1: temperature is in degC, which the device cannot change\n");
    assert_eq!(fixed.frames_of("601").iter().filter(|frame| frame.starts_with('2')).count(), 0);
    let description = bench.run("devices show hydac").exit(0).stdout;
    let at = description.find("at = \"0x4617:1-1\"").expect("the object");
    let writable = description[at..].replacen("\"ro\"", "\"rw\"", 1);
    fs::write(bench.path("rw.toml"), format!("{}{writable}", &description[..at])).expect("a description");
    fs::write(bench.path("bench.toml"), "clock = \"virtual\"\n[[device]]\nkind = \"rw.toml\"\nnode = 1\n")
        .expect("a bench");
    let done = bench.run("unit 1 temperature degF --device rw.toml").exit(0);
    assert!(done.stdout.starts_with("temperature  degC  ->  degF\n"), "{}", done.stdout);
    let writes = done.frames_of("601").into_iter().filter(|frame| frame.starts_with('2'));
    assert_eq!(writes.collect::<Vec<_>>(), ["231746010000AC00"]);
    bench.run("unit 1 degC --device rw.toml").exit(0);
}

/// MH-4, 4.2.15: NaN, -32768 and -2147483648 mean "no value" in every unit.
#[test]
fn an_invalid_value_is_not_converted() {
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n\
         [[device.overload]]\nchannel = 1\nfrom = \"0ms\"\nuntil = \"900s\"\ndirection = \"low\"\n",
    );
    let done = bench.run("unit 5 pressure psi").exit(0);
    for name in ["ai-input-pv:1", "ai-input-pv-i16:1", "ai-input-pv-i32:1"] {
        let words = done.stdout.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        assert!(words.into_iter().any(|words| words == [name, "-", "->", "-"]), "{name} in {}", done.stdout);
    }
    assert!(done.stdout.contains("ai-span-end:1                   10 bar       ->  145.03773 psi"), "{}", done.stdout);
    let done = bench.run("unit 5 pressure psi -f json").exit(0);
    let rescaled = done.json()[0]["rescaled"].as_array().expect("a list").clone();
    let pressure = rescaled.iter().find(|item| item["object"] == "0x9130:1").expect("the process value");
    assert_eq!((&pressure["before"], &pressure["after"]), (&json!(null), &json!(null)));
}

/// The same with answers as printed in the table: reads are answered with 60h.
#[test]
fn table_19_with_its_60h() {
    let devices = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/device/devices/dps.toml");
    let text = fs::read_to_string(devices).expect("the description");
    let text = text.replacen("name = \"dps\"", "name = \"dps60\"\nquirks = [\"upload-answered60\"]", 1);
    let bench = Bench::described(&format!("[[device]]\nkind = \"dps60.toml\"\nnode = 127\n{}", channel(1, 50.0)));
    fs::write(bench.path("dps60.toml"), text).expect("written");
    let done = bench.run("unit 127 bar --device dps60.toml -f json").exit(0);
    let change = &done.json()[0];
    assert_eq!((&change["before"], &change["after"]), (&json!("psi"), &json!("bar")));
    let pressure = change["rescaled"].as_array().expect("a list").iter().find(|item| item["object"] == "0x6130:1");
    let pressure = pressure.expect("the process value");
    assert_eq!((&pressure["before"], &pressure["after"]), (&json!(50.0), &json!(3.447)));
    let answers = done.frames_of("5FF");
    for printed in ["603161010000AB00", "6030610150C30000", "6031610100000000", "6031610100004E00"] {
        assert!(answers.contains(&printed), "{printed}");
    }
    // Without the quirk the device is recognised by its answer to 1000h, which cannot be written.
    bench.run("read 127 pressure").prints("50.000\n");
    let done = bench.run("sdo read 127 0x6131:1").exit(6);
    assert!(done.stderr.contains("cangauge sdo read 127 0x1000 0x6131:1"), "{}", done.stderr);
    bench.run("sdo read 127 0x1000 0x6131:1").exit(0);
}

/// MC1609 without its description: CiA 404 gives the codes of 6110h.
#[test]
fn sensor_types_have_words() {
    let devices = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/device/devices/mc1609.toml");
    let text = fs::read_to_string(devices).expect("the description");
    let text = text.replacen("name = \"mc1609\"", "name = \"other\"", 1).replace("13720", "13000");
    let bench = Bench::described(
        "[[device]]\nkind = \"other.toml\"\nnode = 4\n[[device]]\nkind = \"mc1609\"\nnode = 3\n\
         [[device]]\nkind = \"inclinometer.toml\"\nnode = 6\n",
    );
    fs::write(bench.path("other.toml"), text).expect("written");
    let inclinometer = "name = \"inclinometer\"\ntitle = \"-\"\nvendor = \"-\"\n[identify]\n\
                        device_type = 0x0002019A\n[[object]]\nat = \"0x1000\"\nname = \"device-type\"\ntype = \"u32\"\n\
                        access = \"ro\"\ndefault = 0x0002019A\n[[object]]\nat = \"0x6110\"\nname = \"slope\"\n\
                        type = \"i32\"\naccess = \"rw\"\ndefault = 0\n";
    fs::write(bench.path("inclinometer.toml"), inclinometer).expect("written");
    for (line, id, frame) in [
        ("sdo write 4 0x6110:1 J", "604", "2B10610101000000"),
        ("sdo write 4 0x6110:2 pt100", "604", "2B1061021E000000"),
        ("sdo write 3 0x6110:1 \"type K\"", "603", "2B10610102000000"),
        ("sdo write 3 0x6110:16 T", "603", "2B10611007000000"),
    ] {
        let words = super::examples::words(&line.replace('"', "'"));
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let done = bench.run_words(&words).exit(0);
        assert!(done.frames_of(id).contains(&frame), "{line}: {:?}", done.frames);
    }
    bench.run("sdo write 4 0x6110:1 Pt10").exit(2);
    bench.run("sdo write 6 0x6110 J").exit(2);
    fs::write(bench.path("sensor.toml"), "[signal.ch1]\nsensor-type = \"Pt100\"\n").expect("written");
    let done = bench.run("config apply 3 sensor.toml").exit(0);
    assert!(done.frames_of("603").contains(&"2B1061011E000000"), "{:?}", done.frames);
}

#[test]
fn one_command_sets_several_channels() {
    let bench = Bench::described("[[device]]\nkind = \"mc1609\"\nnode = 3\n[[device]]\nkind = \"mh4\"\nnode = 5\n");
    let signals = |done: &super::Done| -> Vec<String> {
        done.json().iter().map(|report| report["signal"].as_str().expect("a name").to_owned()).collect()
    };
    for (line, expected) in [
        ("filter 3 ch2-ch4 --type moving --constant 5 -f json", &["ch2", "ch3", "ch4"][..]),
        ("filter 3 ch15-16,ch1,ch15 -f json", &["ch15", "ch16", "ch1"]),
        ("unit 5 all psi -f json", &["pressure"]),
        ("unit 5 all -f json", &["pressure", "temperature"]),
        ("unit 3 ch1-ch3 -f json", &["ch1", "ch2", "ch3"]),
        ("limits 5 all --delta 0.5 -f json", &["pressure", "temperature"]),
        ("filter 5 all --type moving -f json", &["pressure"]),
    ] {
        assert_eq!(signals(&bench.run(line).exit(0)), expected, "{line}");
    }
    let done = bench.run("filter 3 all --type moving --constant 5 -f json").exit(0);
    assert_eq!((done.json().len(), done.stderr.lines().count()), (16, 1), "{}", done.stderr);
    let done = bench.run("limits 5 pressure,temperature").exit(0);
    assert!(done.stdout.starts_with("pressure     delta       0 bar     (0x6133:1)\n"), "{}", done.stdout);
    // A wrong channel or a wrong request changes nothing, and is reported once.
    for line in [
        "filter 3 ch1-ch40 --type moving",
        "filter 3 ch1,ch17 --type moving",
        "filter 3 all --type none",
        "unit 3 ch1-ch4 degF",
    ] {
        let done = bench.run(line).exit(2);
        assert_eq!(done.stderr.matches("cangauge:").count(), 1, "{}", done.stderr);
        assert!(done.frames_of("603").iter().all(|frame| frame.starts_with("40")), "{:?}", done.frames);
    }
    // One of two channels has no filter.
    let done = bench.run("filter 5 pressure,temperature --type moving").exit(7);
    assert_eq!(done.stdout, "pressure  moving average (1)  constant 1\n");
    assert!(done.stderr.contains("temperature has no filter"), "{}", done.stderr);
}

#[test]
fn filter_of_the_mc1609_has_its_limits() {
    let bench = |more: &str| Bench::described(&format!("[[device]]\nkind = \"mc1609\"\nnode = 3\n{more}"));
    let constant = "filter constant 0: its effect is not printed in the manual";
    let done = bench("").run("filter 3 ch1 --type moving").exit(0);
    assert!(done.stderr.contains(constant), "{}", done.stderr);
    let done = bench("").run("filter 3 ch1 --type moving --constant 3").exit(0);
    assert!(!done.stderr.contains("filter constant"), "{}", done.stderr);
    // The repeating average is formed between two TPDOs, for 1000 ms at most; it ignores the constant.
    let timer = |ms: u16| format!("set = {{ \"0x1800:2\" = 255, \"0x1800:5\" = {ms} }}\n");
    let done = bench(&timer(2000)).run("filter 3 ch1").exit(0);
    let text = "TPDO1 is sent every 2000 ms: after 1000 ms the device changes to the moving average";
    assert!(done.stderr.contains(text) && !done.stderr.contains("filter constant"), "{}", done.stderr);
    assert_eq!(bench(&timer(1000)).run("filter 3 ch1").exit(0).stderr, "");
    let done = bench("set = { \"0x1800:2\" = 10 }\n").run("filter 3 ch1 --type repeating").exit(0);
    assert!(done.stderr.contains("TPDO1 is sent on SYNC: if its interval is longer than 1000 ms"), "{}", done.stderr);
}

#[test]
fn words_of_signatures_and_of_the_description_are_values() {
    let bench = constant();
    for (line, id, frame) in [
        ("sdo write 5 0x1010:1 save", "605", "2310100173617665"),
        ("sdo write 5 0x1011:1 LOAD", "605", "231110016C6F6164"),
        ("sdo write 127 0x6125:1 zero", "67F", "222561017A65726F"),
    ] {
        let done = bench.run(line).exit(0);
        assert!(done.frames_of(id).contains(&frame), "{line}: {:?}", done.frames);
    }
    let done = bench.run("sdo write 127 0x6131:1 bar").exit(0);
    assert!(done.frames_of("67F").contains(&"2231610100004E00"), "{:?}", done.frames);
    bench.run("sdo write 5 0x1017 save").exit(2);
    bench.run("sdo write 5 0x1010:1 load").exit(2);
}

#[test]
fn too_narrow_integer_is_a_warning_before_it_clips() {
    let mapped = |set: &str| {
        Bench::described(&format!("[[device]]\nkind = \"mh4\"\nnode = 5\nset = {{ {set} }}\n{}", channel(1, 1.25)))
    };
    let narrow = "\"0x1A00:1\" = 0x71300110, \"0x1A00:0\" = 1";
    for (set, line) in [(narrow, "unit 5 pressure psi"), (narrow, "sdo write 5 0x6131:1 0x00AB0000")] {
        let done = mapped(set).run(line).exit(0);
        let warning = "warning: node 5: pressure: the largest value of 0x7130:1 is 32.767 psi";
        assert!(done.stderr.contains(warning) && done.stderr.contains("0x9130:1"), "{line}: {}", done.stderr);
    }
    // The mapping itself narrows the value.
    for line in ["pdo map 5 1 0x7130:1", "pdo map 5 2 0x7130:1 pressure.status"] {
        let done = mapped("\"0x6131:1\" = 0x00AB0000, \"0x6149:1\" = 145.0").run(line).exit(0);
        let warning = "warning: node 5: pressure: the largest value of 0x7130:1 is 32.767 psi";
        assert!(done.stderr.contains(warning) && done.stderr.contains("0x9130:1"), "{line}: {}", done.stderr);
    }
    let done = mapped("\"0x1017\" = 0").run("pdo map 5 1 0x7130:1").exit(0);
    assert!(!done.stderr.contains("clipped"), "10 bar fit: {}", done.stderr);
}

#[test]
fn a_unit_that_the_device_does_not_accept_is_rejected_with_the_list() {
    let bench = constant();
    let written = |done: &super::Done, id: &str| done.frames_of(id).iter().any(|frame| frame.starts_with('2'));
    let done = bench.run("unit 5 pressure kPa").exit(2);
    assert_eq!(done.stderr, "cangauge: node 5: pressure accepts bar, psi, MPa, not kPa\n");
    assert!(!written(&done, "605"));
    let done = bench.run("unit 5 degF").exit(0);
    assert!(done.stdout.starts_with("temperature "), "the only signal that is a temperature: {}", done.stdout);
    // Table 20 of the DPS manual prints the codes in wire order.
    let done = bench.run("unit 127 0x0000AB00").exit(2);
    assert_eq!(
        done.stderr,
        "cangauge: node 127: pressure accepts psi, bar, kPa, not 0x0000AB00\n\
         hint: 0x0000AB00 is psi in wire order: use 0x00AB0000\n"
    );
    bench.run("unit 3 ch4 K").fails(2, "cangauge: node 3: ch4 is in degC, which the device cannot change\n");
    bench.run("unit 5 pressure furlong").exit(2);
    bench.run("unit 5 pressure bar psi").exit(2);
    let done = bench.run("unit 127 psi").exit(0);
    assert_eq!(done.stderr, "node 127: pressure is already in psi\n");
    assert!(!written(&done, "67F"));
    // By its code.
    bench.run("unit 5 pressure 0x00AB0000").exit(0);
}

#[test]
fn filters() {
    let bench = constant();
    bench.run("filter 5").prints("pressure  none (0)  constant 1\n");
    bench.run("filter 5 temperature").fails(4, "cangauge: node 5: temperature has no filter (61A0h, 61A1h)\n");
    let done = bench.run("filter 5 --type moving --constant 8 -f json").exit(0);
    assert_eq!(
        done.json(),
        [json!({"node": 5, "signal": "pressure", "code": 1, "type": "moving average", "constant": 8,
            "damping_shown": null, "notes": [kept(5)]})]
    );
    // A damping is written; the constant shows its effect.
    let done = bench.run("filter 5 --type moving --damping 100ms -f json").exit(0);
    let filter = &done.json()[0];
    assert_eq!((&filter["constant"], &filter["damping_shown"]), (&json!(34), &json!(true)));
    assert!(done.frames_of("605").contains(&"2B23200164000000"), "{:?}", done.frames_of("605"));
    let done = bench.run("filter 5 --damping 100ms").exit(2);
    assert_eq!(
        done.stderr,
        "cangauge: node 5: pressure: a damping needs the moving average (the filter is: none)\nhint: add --type moving\n"
    );
    // A damping that results in the same constant cannot be confirmed.
    let done = bench.run("filter 5 --type moving --damping 1ms").exit(0);
    assert!(
        done.stderr
            .starts_with("warning: node 5: it acknowledged the damping, but the filter constant did not change (1)")
    );
    // 0 is not "no filter" on the MC1609, although one table of its manual states it.
    let done = bench.run("filter 3 ch1 --type none").exit(2);
    assert_eq!(
        done.stderr.lines().next(),
        Some(
            "cangauge: node 3: ch1 has no filter type \"none\" (it has: repeating average (0), moving average (1), \
             repeating average (2))"
        )
    );
    bench.run("filter 3 ch1").prints("ch1  repeating average (0)  constant 0\n");
    bench.run("filter 3 ch1 --type repeating").prints("ch1  repeating average (2)  constant 0\n");
    bench.run("filter 3 --type moving").exit(2);
    bench.run("filter 127").fails(4, "cangauge: node 127: it has no filter (61A0h, 61A1h)\n");
}

#[test]
fn limits() {
    let bench = constant();
    bench.run("limits 5 pressure").prints(
        "delta       0 bar   (0x6133:1)\nlower       0 bar   (0x6134:1)\n\
         upper       10 bar  (0x6135:1)\nhysteresis  0 bar   (0x6136:1)\n",
    );
    let done = bench.run("limits 5 temperature").exit(0);
    assert_eq!(
        done.stderr,
        "warning: node 5: TPDO2 is sent on events, and its event timer and the delta are 0: it may never be sent\n"
    );
    let done = bench.run("limits 5 temperature --delta 0.5 --lower -20 --upper 80 --hysteresis 1 -f json").exit(0);
    assert_eq!(
        done.json(),
        [json!({"node": 5, "signal": "temperature", "delta": 0.5, "lower": -20.0, "upper": 80.0, "hysteresis": 1.0,
            "unit": "degC", "silent": [], "notes": [kept(5)]})]
    );
    assert_eq!(done.stderr, format!("node 5: {STORE} 5\n"));
    bench
        .run("limits 5 pressure --lower 11")
        .fails(2, "cangauge: node 5: pressure: the lower limit 11 is above the upper limit 10\n");
    bench.run("limits 5 pressure --delta -1").refuses("delta must not be negative: -1");
    bench.run("limits 5 pressure --delta x").refuses("\"x\" is not a number (0.5, -20)");
    bench.run("limits 5 pressure --delta inf").exit(2);
    // Rising limits start with the upper one.
    let done = bench.run("limits 5 pressure --lower 12 --upper 14").exit(0);
    let writes: Vec<String> = done
        .frames_of("605")
        .iter()
        .filter(|frame| frame.starts_with("23"))
        .map(|frame| frame[2..8].to_owned())
        .collect();
    assert_eq!(writes, ["356101", "346101"]);
    bench
        .run("limits 127 pressure")
        .fails(4, "cangauge: node 127: pressure has no delta and no limits (0x6133:1 to 0x6136:1)\n");
    bench.run("limits 5").exit(2);
}

#[test]
fn minimum_and_maximum() {
    // The pressure changes, so that there is something to reset.
    let bench = Bench::of("mh4@5");
    let done = bench.run("minmax 5 -f json").exit(0);
    let rows = done.json();
    assert_eq!((rows[0]["signal"].as_str(), rows[1]["signal"].as_str()), (Some("pressure"), Some("temperature")));
    assert!(rows[0]["min"].as_f64() <= rows[0]["max"].as_f64());
    let done = bench.run("minmax 5 --reset -f json").exit(0);
    assert_eq!(done.frames_of("605").iter().filter(|frame| frame.starts_with("232220")).count(), 2, "once a channel");
    assert!(done.json()[0]["before"]["min"].is_number());
    let still = constant();
    still
        .run("minmax 5")
        .prints("pressure     min 1.25 bar   max 1.25 bar\ntemperature  min 25.5 degC  max 25.5 degC\n");
    still.run("minmax 2").prints("pressure  min 4.000 bar  max 4.000 bar\n");
    still
        .run("minmax 2 --reset")
        .fails(4, "cangauge: node 2: no object that resets minimum and maximum of pressure is known for this device\n");
    still
        .run("minmax 127")
        .fails(4, "cangauge: node 127: no object with minimum and maximum is known for this device\n");
}

#[test]
fn errors_are_explained_by_the_description() {
    let overload = "[[device.overload]]\nchannel = 1\nfrom = \"0s\"\ndirection = \"high\"\n";
    let bench = Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n{overload}[[device]]\nkind = \"dps\"\nnode = 127\n{overload}\
         [[device]]\nkind = \"d20\"\nnode = 2\n"
    ));
    bench.run("errors 5").prints(
        "register  0x81 generic, manufacturer\n\
         history   1 error\n\
         \u{20}         0xF001 user input overload: pressure outside the range by more than 3.125 %; check the system: the accuracy is no longer guaranteed, also after the overload (channel 1, status 0x03)\n",
    );
    let done = bench.run("errors 5 -f json").exit(0);
    let object = &done.json()[0];
    assert_eq!((&object["register"], &object["count"]), (&json!("0x81"), &json!(1)));
    assert_eq!(object["history"][0]["raw"], "0x0103F001", "byte 4 before byte 3");
    let done = bench.run("errors 5 --clear").exit(0);
    assert_eq!(done.stdout, "register  0x81 generic, manufacturer\nhistory   empty\n");
    assert_eq!(
        done.stderr,
        "node 5: 1 error deleted from the history\nnode 5: an error is still pending: generic, manufacturer\n"
    );
    assert!(done.frames_of("605").contains(&"2F03100000000000"));
    // The DPS counts its errors; the entries cannot be read.
    bench.run("errors 127").prints(
        "register              0x05 overflow or underflow\n\
         history               1 error\n\
         span-overflow-count   1 (number of times the pressure crosses the maximum span)\n\
         span-underflow-count  0 (number of times the pressure crosses the minimum span)\n",
    );
    let counters = &bench.run("errors 127 -f json").exit(0).json()[0]["counters"];
    assert_eq!((&counters[0]["object"], &counters[0]["count"]), (&json!("0x2004:0"), &json!(1)));
    assert_eq!(bench.run("errors 5 -f json").exit(0).json()[0]["counters"], json!([]));
    bench.run("errors 2").prints("register  0x00 no error\nhistory   not supported\n");
    bench.run("errors 2 --clear").fails(4, "cangauge: node 2: it has no error history (1003h)\n");
    let done = bench.run("errors 9").exit(3);
    assert!(done.stdout.is_empty());
}

/// A CiA 404 device without a description is used by the standard, and rejects values itself.
#[test]
fn a_device_without_a_description() {
    let devices = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/device/devices/mh4.toml");
    let text = fs::read_to_string(devices).expect("the description");
    let text = text.replacen("name = \"mh4\"", "name = \"other\"", 1);
    let text = text.replacen("default = \"MH-4-CAN\"", "default = \"OTHER\"", 1);
    let bench = Bench::described(&format!(
        "[[device]]\nkind = \"other.toml\"\nnode = 5\n{}{}",
        channel(1, 1.25),
        channel(2, 25.5)
    ));
    fs::write(bench.path("other.toml"), text).expect("written");
    bench.run("unit 5").prints("ch1  bar\nch2  degC\n");
    let done = bench.run("unit 5 psi").exit(0);
    assert!(done.stdout.starts_with("ch1       bar       ->  psi\n"), "{}", done.stdout);
    assert!(done.stdout.contains("0x6149:1  10 bar    ->  145.03773 psi"), "{}", done.stdout);
    let done = bench.run("unit 5 ch1 kPa").exit(4);
    assert!(done.stderr.contains("0x06090030"), "{}", done.stderr);
    bench.run("limits 5 ch2 --delta 0.5 -f csv").prints(
        "node,signal,limit,value,unit\n5,ch2,delta,0.5,degC\n5,ch2,lower,-40,degC\n5,ch2,upper,125,degC\n\
         5,ch2,hysteresis,0,degC\n",
    );
    bench.run("filter 5 ch1 --type moving").prints("ch1  moving average (1)  constant 1\n");
    let done = bench.run("filter 5 ch1 --type repeating --constant 3 -f csv").exit(0);
    assert_eq!(done.stdout, "node,signal,code,type,constant\n5,ch1,2,repeating average,3\n");
    let page = bench.run("info 5").exit(0).stdout;
    assert!(page.starts_with("node 5: unknown device\n"), "{page}");
    for part in ["ai-sensor-type        90 pressure transducer", "range 0 to 10", "  stored   unknown"] {
        assert!(page.contains(part), "{part:?} is not in\n{page}");
    }
}

#[test]
fn a_rejected_limit_restores_the_limits_before_it() {
    let devices = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/device/devices/mh4.toml");
    let text = fs::read_to_string(devices).expect("the description");
    let at = text.find("at = \"0x6134:1-1\"").expect("the lower limit");
    let (head, tail) = text.split_at(at);
    let tail = tail.replacen("default = 0.0\n", "default = 0.0\nhigh = 5.0\n", 1);
    let bench = Bench::described("[[device]]\nkind = \"strict.toml\"\nnode = 5\n");
    let text = format!("{}{tail}", head.replacen("name = \"mh4\"", "name = \"strict\"", 1));
    fs::write(bench.path("strict.toml"), text).expect("written");
    let done = bench.run("limits 5 pressure --lower 6 --upper 14").exit(4);
    assert_eq!(
        done.stderr,
        "cangauge: node 5: write 0x6134:1: refused by the device (0x06090031, value too high); the previous limits were restored\n\
         hint: show the limits: cangauge limits 5 pressure\n"
    );
    let writes: Vec<&str> = done.frames_of("605").into_iter().filter(|frame| frame.starts_with("23")).collect();
    assert_eq!(writes, ["2335610100006041", "233461010000C040", "2335610100002041"], "14, 6, and 10 again");
}
