//! `cangauge info`, and two devices that only a TOML file describes: HYDAC and JUMO.

use super::{ALL, Bench};
use serde_json::{Value, json};

/// The setting with this name.
fn named<'a>(list: &'a Value, name: &str) -> &'a Value {
    let list = list.as_array().expect("a list");
    list.iter().find(|item| item["name"] == name).unwrap_or_else(|| panic!("no {name} in {list:?}"))
}

#[test]
fn page_of_an_mh4() {
    let channel = |number: u8, base: f64| {
        format!("[[device.channel]]\nchannel = {number}\nbase = {base:?}\namplitude = 0.0\nnoise = 0.0\n")
    };
    let bench = Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nset = {{ \"0x1017\" = 1000, \"0x61A0:1\" = 1 }}\n{}{}",
        channel(1, 1.25),
        channel(2, 25.5)
    ));
    let page = bench.run("info 5").exit(0).stdout;
    for line in [
        "node 5: WIKA MH-4-CAN",
        "  revision     0x00000001 0.1",
        "  bit rate                 250 kbit/s",
        "  state                    pre-operational (heartbeat)",
        "  monitoring               heartbeat every 1000 ms",
        "  emcy-inhibit-time        0.0 ms",
        "  nmt-startup              0 the master starts the device",
        "  register  0x00 no error",
        "  history   empty",
        "  pressure     1.25 bar   ok  range 0 to 10 bar",
        "  temperature  25.5 degC  ok  range -40 to 125 degC",
        "                            pressure                temperature",
        "  ai-sensor-type            90 pressure transducer  100 temperature transducer",
        "  ai-operating-mode         1 normal operation      1 normal operation",
        "  ai-filter-type            1 moving average        -",
        "  ai-interrupt-upper-limit  10 bar                  125 degC",
        "  measuring-range-end       10 bar                  125 degC",
        "  original-unit             bar                     degC",
        "  minimum-pv                1.25 bar                25.5 degC",
        "  TPDO1  0x185  sync:1     pressure 0x6130:1/32, pressure.status 0x6150:1/8",
        "  TPDO2  0x285  timer off  temperature 0x6130:2/32, temperature.status 0x6150:2/8",
        "  bit-rate  3 250 kbit/s",
        "  group 2     communication: on command",
        "  not stored  original-unit",
    ] {
        assert!(page.lines().any(|found| found == line), "{line:?} is not in\n{page}");
    }
    assert!(page.lines().all(|line| line.chars().count() <= 100), "a line is too long:\n{page}");
}

#[test]
fn info_is_one_page_and_one_json_object() {
    let bench = Bench::of(&format!("{ALL},hydac@10,jumo@126"));
    for node in [1, 2, 3, 10, 126, 127] {
        let done = bench.run(&format!("info {node} -f json")).exit(0);
        let objects = done.json();
        assert_eq!((objects.len(), &objects[0]["node"]), (1, &json!(node)));
        assert_eq!(done.stderr, "");
        let csv = bench.run(&format!("info {node} -f csv")).exit(0).stdout;
        assert!(csv.starts_with("node,object,name,value,text\n") && csv.lines().count() > 5);
        assert_eq!(done.frames_of("000"), [""; 0], "no node is started");
        // A device recognised by its identity alone is not asked for objects that it does not have.
        if ![1, 2, 127].contains(&node) {
            continue;
        }
        let is_abort = |frame: &&&str| frame.starts_with("80");
        assert_eq!(done.frames_of(&format!("{:X}", 0x580 + node)).iter().filter(is_abort).count(), 0, "{node}");
    }
}

#[test]
fn state_is_shown_only_if_a_heartbeat_reports_it() {
    let line = |done: &super::Done| {
        let line = done.stdout.lines().find(|line| line.starts_with("  state ")).expect("a state");
        line.split_once(' ').map(|_| line.trim_start().trim_start_matches("state").trim().to_owned()).expect("text")
    };
    let bench = Bench::of(ALL);
    // A guarding request would show the state of a D-20-9, but could disturb a master that guards it.
    for node in [1, 2] {
        let done = bench.run(&format!("info {node}")).exit(0);
        assert_eq!(line(&done), format!("unknown (no heartbeat): cangauge nmt state {node} --probe"));
        assert!(!done.frames_of(&format!("{:X}", 0x700 + node)).iter().any(|frame| frame.starts_with('R')));
    }
    assert_eq!(bench.run("info 1 -f json").exit(0).json()[0]["state"], Value::Null);
    // The command does not wait a minute for a heartbeat.
    let device = |period: u32| {
        format!("[[device]]\nkind = \"d20\"\nnode = 5\nstart = true\nset = {{ \"0x1017\" = {period} }}\n")
    };
    let done = Bench::described(&device(60_000)).run("info 5 -f json").exit(0);
    assert_eq!(done.json()[0]["state"], Value::Null);
    let bench = Bench::described(&device(100));
    assert_eq!(line(&bench.run("info 5").exit(0)), "operational (heartbeat)");
    assert_eq!(bench.run("info 5 -f json").exit(0).json()[0]["state"], "operational");
}

#[test]
fn manufacturer_specific_settings() {
    let bench = Bench::of(ALL);
    let page = |node: u8| bench.run(&format!("info {node} -f json")).exit(0).json().remove(0);
    let dps = page(127);
    assert_eq!(dps["calibrated"], "2016-04-01");
    assert_eq!(named(&dps["own"], "span-overflow-count")["value"], 0);
    assert_eq!(named(&dps["own"], "span-underflow-count")["object"], "0x2005:0");
    assert_eq!(named(&dps["own"], "sensor-type")["text"], "2 gauge");
    assert_eq!(named(&dps["own"], "pressure-span")["text"], "100.000 psi");
    assert!(dps["store"]["not_kept"].as_array().expect("a list").contains(&json!("tpdo1-mapping")));
    let d20 = page(2);
    assert_eq!((&d20["calibrated"], &d20["produced"]), (&json!("2004-09-15"), &json!("2004-08-30")));
    assert_eq!(named(&d20["own"], "user-device-name")["value"], "D209");
    assert_eq!(named(&d20["communication"], "auto-operational")["text"], "0 the master starts the device");
    assert_eq!(named(&d20["communication"], "guard-time")["text"], "off");
    let settings = &d20["signals"][0]["settings"];
    for (name, text) in [
        ("ai-scaling-1-fv", "0"),
        ("ai-scaling-1-pv", "0 bar"),
        ("ai-scaling-2-fv", "10000"),
        ("ai-scaling-2-pv", "16 bar"),
        ("ai-input-offset", "0 bar"),
        ("ai-adc-sample-rate", "1000 us"),
    ] {
        assert_eq!(named(settings, name)["text"], text, "{name}");
    }
    let mc1609 = page(3);
    assert_eq!(mc1609["signals"].as_array().map(Vec::len), Some(16));
    assert_eq!(named(&mc1609["signals"][15]["settings"], "ai-filter-type")["text"], "0 repeating average");
}

#[test]
fn settings_of_many_channels_are_grouped_by_value() {
    let bench =
        Bench::described("[[device]]\nkind = \"mc1609\"\nnode = 3\nset = { \"0x6110:2\" = 1, \"0x6110:5\" = 1 }\n");
    let page = bench.run("info 3").exit(0).stdout;
    let line = page.lines().find(|line| line.contains("ai-sensor-type")).expect("a line");
    assert!(line.contains("2 thermocouple type K (ch1 ch3 ch4 ch6 "), "{line}");
    assert!(line.contains(", 1 thermocouple type J (ch2 ch5)") || line.contains("(ch2 ch5)"), "{line}");
    assert!(page.contains("ai-scaling-2-pv-i16   1372.0 degC\n"), "{page}");
}

#[test]
fn each_object_is_read_once() {
    let done = Bench::of("mc1609@3").run("info 3").exit(0);
    let mut reads: Vec<&str> = done.frames_of("603").into_iter().filter(|data| data.starts_with("40")).collect();
    let count = reads.len();
    reads.sort_unstable();
    reads.dedup();
    assert_eq!(reads.len(), count);
}

#[test]
fn node_guarding_is_shown_as_monitoring() {
    let bench = Bench::described("[[device]]\nkind = \"d20\"\nnode = 2\nset = { \"0x100C\" = 100, \"0x100D\" = 3 }\n");
    let page = bench.run("info 2 -f json").exit(0).json().remove(0);
    assert_eq!(page["monitoring"], "node guarding every 100 ms, life time 300 ms");
}

#[test]
fn missing_answer_is_an_error_and_rejection_is_not() {
    let bench = Bench::of("mh4@5");
    bench.run("info 9").exit(3);
    // With the description of another device, most objects do not exist.
    let done = bench.run("info 5 --device dps -f json").exit(0);
    assert_eq!(done.json()[0]["calibrated"], Value::Null);
    bench.run("info all").exit(2);
}

#[test]
fn hydac_and_jumo_are_described_by_toml_files() {
    let bench = Bench::of("hydac@1,jumo@126");
    let found = bench.run("scan -f json").exit(0).json();
    assert_eq!((&found[0]["device"], &found[1]["device"]), (&json!("hydac"), &json!("jumo")));
    let rows = bench.run("read all -f json").exit(0).json();
    let signals: Vec<&str> = rows.iter().filter_map(|row| row["signal"].as_str()).collect();
    assert_eq!(signals, ["pressure", "rest-lifetime", "operating-hours", "temperature", "ch1", "ch2"]);
    assert!(rows.iter().all(|row| row["status"] == "ok" || row["signal"] == "operating-hours"));
    let rows = bench.run("log 1,126 --duration 3s -f json").exit(0).json();
    let of = |node: u8, signal: &str| rows.iter().filter(|row| row["node"] == node && row["signal"] == signal).count();
    // HYDAC sends both TPDOs each second; JUMO has TPDO5 off by default.
    for signal in ["rest-lifetime", "operating-hours", "pressure"] {
        assert!((2..=3).contains(&of(1, signal)), "{signal} {}", of(1, signal));
    }
    assert!(of(126, "ch1") >= 28, "{}", of(126, "ch1"));
    assert_eq!(of(126, "ch2"), 0);
}

#[test]
fn hydac_boots_operational_and_stores_its_node_id_with_1010h_4() {
    let bench = Bench::of("hydac@1");
    let done = bench.run("log 1 --passive --device hydac --duration 3s -f json").exit(0);
    assert!(done.stdout.lines().count() >= 2, "it sends without an NMT start: {}", done.stderr);
    bench.run("nmt startup 1").prints("auto\n");
    let kept = Bench::described("[[device]]\nkind = \"hydac\"\nnode = 1\nset = { \"0x1F80\" = 8 }\n");
    kept.run("nmt startup 1").prints("wait\n");
    bench.run("sdo write 1 0x2003:2 9 --type u8").exit(0);
    bench.run("unit 1 psi").exit(0);
    bench.run("unit 1 kPa").fails(2, "cangauge: node 1: pressure accepts bar, psi, not kPa\n");
}

#[test]
fn jumo_sends_tpdo5() {
    let bench = Bench::described("[[device]]\nkind = \"jumo\"\nnode = 126\nset = { \"0x1804:1\" = 0x1FF }\n");
    let rows = bench.run("log 126 --duration 1s -f json").exit(0).json();
    assert!(rows.iter().filter(|row| row["signal"] == "ch2").count() >= 8);
    let done = bench.run("sdo write 126 0x1A00:1 0x91300220").exit(4);
    assert!(done.stderr.contains("0x06010002"), "its mapping is fixed: {}", done.stderr);
    let done = bench.run("sdo write 126 emcy-repeat-time 500 --verify").exit(0);
    assert!(done.frames_of("67E").contains(&"22022000F4010000"), "written with 22h: {:?}", done.frames_of("67E"));
}

#[test]
fn repeated_emergency_is_reported_once() {
    let overload = "[[device.overload]]\nchannel = 1\nfrom = \"1s\"\nuntil = \"6500ms\"\ndirection = \"high\"\n";
    let bench = Bench::described(&format!("[[device]]\nkind = \"jumo\"\nnode = 126\n{overload}"));
    let done = bench.run("log 126 --duration 9s -o run.csv").exit(0);
    let sent: Vec<&str> = done.frames_of("0FE");
    assert!((5..=7).contains(&sent.iter().filter(|frame| frame.starts_with("3050")).count()), "every second: {sent:?}");
    assert_eq!(sent.iter().filter(|frame| frame.starts_with("0000")).count(), 1, "{sent:?}");
    let reports = done.stderr.lines().filter(|line| line.contains("sensor break or short circuit")).count();
    assert_eq!(reports, 1, "{}", done.stderr);
}
