//! `config dump`, `diff` and `apply`.

use super::{ALL, Bench};

const DPS: &str = r#"# Settings of Honeywell DPS, written by cangauge config dump.
# Set them again: cangauge config apply NODE FILE

[device]
kind = "dps"  # Honeywell DPS
vendor = "0x362"
product = "0x443150"
# revision 0x10000, serial number 20002
range.pressure = "100.000 psi"
reference = "gauge"

[address]
# Set only with --address.
node-id = 127
bit-rate = "250k"

[node]
heartbeat = "0ms"

[signal.pressure]
unit = "psi"
digits = 3  # fixed
span-start = "0.000 psi"
span-end = "100.000 psi"

[tpdo.1]
enabled = true
cob-id = "default"  # default
signals = ["pressure"]
transmission = "timer"
event-timer = "100ms"  # default

[calibration]
# Values of this one device: set only with --with-calibration.
# calibrated 2016-04-01
serial = 20002

[calibration.pressure]
offset = "0.000 psi"
"#;

#[test]
fn two_devices_with_one_node_id_get_no_settings() {
    let bench = Bench::described(
        "[[device]]\nkind = \"dps\"\nnode = 5\nserial = 1\nduplicate_id = true\n\
         [[device]]\nkind = \"dps\"\nnode = 5\nserial = 2\nduplicate_id = true\n",
    );
    std::fs::write(bench.path("c.toml"), "[node]\nheartbeat = \"500ms\"\n").expect("written");
    let done = bench.run("config apply 5 c.toml").exit(1);
    assert!(done.stderr.contains("nothing was written"), "{}", done.stderr);
    assert!(done.frames_of("605").iter().all(|data| data.starts_with("40")), "{:?}", done.frames);
}

#[test]
fn a_dump_has_every_setting_of_the_device_and_no_other() {
    let bench = Bench::of(ALL);
    bench.run("config dump 127").prints(DPS);
    let mh4 = bench.run("config dump 1").exit(0).stdout;
    for line in
        ["filter = \"none\"", "upper = \"10 bar\"", "range.pressure = \"0 bar to 10 bar\"", "startup = \"wait\""]
    {
        assert!(mh4.contains(line), "{line}: {mh4}");
    }
    assert!(!mh4.contains("-i16") && !mh4.contains("0x7"), "one family only: {mh4}");
    let mc1609 = bench.run("config dump 3").exit(0).stdout;
    assert!(
        mc1609.contains("[signal.ch16]\nsensor-type = 2  # thermocouple type K\nunit = \"degC\"  # fixed"),
        "{mc1609}"
    );
    assert_eq!(mc1609.matches("[tpdo.").count(), 4);
}

#[test]
fn a_dump_only_reads_and_is_the_same_each_time() {
    let bench = Bench::of(ALL);
    for node in ["1", "2", "3", "127"] {
        let first = bench.run(&format!("config dump {node}")).exit(0);
        let writes = writes(&first).len();
        assert_eq!(writes, 0);
        assert_eq!(bench.run(&format!("config dump {node}")).exit(0).stdout, first.stdout);
    }
}

#[test]
fn the_short_form_omits_defaults_and_json_has_rows() {
    let bench = Bench::described("[[device]]\nkind = \"d20\"\nnode = 2\nset = { \"0x1017\" = 500 }\n");
    let short = bench.run("config dump 2 --changed").exit(0).stdout;
    assert!(short.contains("heartbeat = \"500ms\"") && !short.contains("guard-time"), "{short}");
    let rows = bench.run("config dump 2 --format json").exit(0).json();
    let row = |key: &str| rows.iter().find(|row| row["setting"] == key).unwrap_or_else(|| panic!("{key}"));
    assert_eq!(row("node.heartbeat")["value"], "500ms");
    assert_eq!(
        (row("node.heartbeat")["default"].as_bool(), row("node.guard-time")["default"].as_bool()),
        (Some(false), Some(true))
    );
    assert_eq!(row("tpdo.1.signals")["value"], serde_json::json!(["process-value-integer"]));
}

/// A file for the MH-4 with one line more.
fn with(section: &str, line: &str) -> String {
    format!("[device]\nkind = \"mh4\"\n[{section}]\n{line}\n")
}

/// Section, line, place, and the message after the key.
const MISTAKES: [(&str, &str, &str); 34] = [
    ("node", "heartbeat = 500", "4:13: node.heartbeat: an integer instead of a duration in quotes (\"100ms\")"),
    ("node", "heartbeat = \"500\"", "4:13: node.heartbeat: \"500\" has no unit (100ms, 1s)"),
    ("node", "heartbeat = \"500us\"", "4:13: node.heartbeat: the device needs a multiple of 1ms"),
    ("node", "heartbeat = \"70s\"", "4:13: node.heartbeat: 70000 does not fit u16 (0 to 65535)"),
    ("node", "hearbeat = \"500ms\"", "4:1: node.hearbeat: WIKA MH-4-CAN has no such setting (similar: node.heartbeat)"),
    ("node", "startup = \"never\"", "4:11: node.startup: \"never\" is not one of: wait, auto"),
    ("node", "startup = 3", "4:11: node.startup: the device accepts only wait, auto"),
    (
        "nodes",
        "heartbeat = \"500ms\"",
        "4:1: nodes.heartbeat: WIKA MH-4-CAN has no such setting (similar: node.heartbeat)",
    ),
    (
        "signal.pressure",
        "unit = \"furlong\"",
        "4:8: signal.pressure.unit: \"furlong\" is not a known unit (bar, kPa, degC)",
    ),
    ("signal.pressure", "unit = \"kPa\"", "4:8: signal.pressure.unit: the device accepts only bar, psi, MPa"),
    ("signal.pressure", "unit = 5", "4:8: signal.pressure.unit: an integer instead of a unit in quotes (\"bar\")"),
    ("signal.pressure", "digits = 7", "4:10: signal.pressure.digits: not in the range 0 to 5"),
    ("signal.pressure", "digits = 1.5", "4:10: signal.pressure.digits: a number with a fraction instead of an integer"),
    (
        "signal.pressure",
        "filter = \"strong\"",
        "4:10: signal.pressure.filter: \"strong\" is not one of: none, moving, repeating",
    ),
    ("signal.pressure", "filter = 3", "4:10: signal.pressure.filter: not in the range none to repeating"),
    (
        "signal.pressure",
        "upper = 8",
        "4:9: signal.pressure.upper: a number without a unit, and the file sets no unit for this signal (\"3.2 bar\")",
    ),
    (
        "signal.pressure",
        "upper = \"8 degC\"\nunit = \"bar\"",
        "4:9: signal.pressure.upper: degC cannot be converted to bar, the unit of the signal",
    ),
    (
        "signal.pressure",
        "upper = \"much\"",
        "4:9: signal.pressure.upper: \"much\" is not a number with a unit (\"3.2 bar\")",
    ),
    (
        "signal.pressure",
        "upper = \"1 bar\"\nlower = \"2 bar\"\nunit = \"bar\"",
        "5:9: signal.pressure.lower: beyond signal.pressure.upper, which is 1 bar",
    ),
    (
        "signal.presure",
        "digits = 3",
        "4:1: signal.presure.digits: WIKA MH-4-CAN has no such setting (similar: signal.pressure.digits)",
    ),
    ("signal.pressure", "span-end = \"5 bar\"", "4:1: signal.pressure.span-end: WIKA MH-4-CAN has no such setting"),
    (
        "tpdo.1",
        "transmission = \"sync:0\"",
        "4:16: tpdo.1.transmission: \"sync:0\" is not a transmission type (acyclic, sync:1 to sync:240, event, timer, 0 to 255)",
    ),
    (
        "tpdo.1",
        "transmission = 245",
        "4:16: tpdo.1.transmission: the device accepts only acyclic to sync:240, timer, event",
    ),
    ("tpdo.1", "event-timer = \"90s\"", "4:15: tpdo.1.event-timer: 90000 does not fit u16 (0 to 65535)"),
    ("tpdo.1", "inhibit-time = \"5ms\"", "4:1: tpdo.1.inhibit-time: WIKA MH-4-CAN has no such setting"),
    ("tpdo.1", "signals = [\"pressure\", \"presure\"]", "4:11: tpdo.1.signals: no object or signal \"presure\""),
    (
        "tpdo.1",
        "signals = [\"pressure\", \"temperature\", \"0x9130:1/32\"]",
        "4:11: tpdo.1.signals: 96 bits: a TPDO has at most 64",
    ),
    (
        "tpdo.1",
        "signals = [\"ai-filter-type:1\"]",
        "4:11: tpdo.1.signals: the device cannot map ai-filter-type:1 (0x61A0:1) here",
    ),
    (
        "tpdo.1",
        "signals = 3",
        "4:11: tpdo.1.signals: an integer instead of a list of signals ([\"pressure\", \"pressure.status\"])",
    ),
    ("tpdo.1", "enabled = 1", "4:11: tpdo.1.enabled: an integer instead of true or false"),
    (
        "tpdo.9",
        "enabled = true",
        "4:1: tpdo.9.enabled: WIKA MH-4-CAN has no such setting (similar: tpdo.1.enabled, tpdo.2.enabled)",
    ),
    (
        "address",
        "tpdo.1.cob-id = 0x900",
        "4:17: address.tpdo.1.cob-id: \"2304\" is not an 11-bit identifier (0x1A5) or \"default\"",
    ),
    (
        "address",
        "tpdo.1.cob-id = \"0x601\"",
        "4:17: address.tpdo.1.cob-id: CiA 301 reserves the identifier 0x601 for other services",
    ),
    ("address", "node-id = 200", "4:11: address.node-id: not in the range 1 to 127"),
];

#[test]
fn each_mistake_of_a_file_has_its_place_and_nothing_is_sent() {
    let bench = Bench::of(ALL);
    let mut wrong = Vec::new();
    for (section, line, expected) in MISTAKES {
        std::fs::write(bench.path("f.toml"), with(section, line)).expect("a file");
        let done = bench.run("config apply 1 f.toml").exit(2);
        assert_eq!(done.frames, [""; 0], "{line}");
        let errors: Vec<&str> = done.stderr.lines().filter(|line| line.starts_with("cangauge: ")).collect();
        if !matches!(errors[..], [only] if only.starts_with(&format!("cangauge: f.toml:{expected}"))) {
            wrong.push(done.stderr);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.concat());
}

#[test]
fn a_file_that_is_no_toml_has_its_place() {
    let bench = Bench::of(ALL);
    for (text, place) in [("[node\n", "1:6"), ("a = 1\na = 2\n", "2:1"), ("[node]\nheartbeat = 5 0\n", "2:13")] {
        std::fs::write(bench.path("f.toml"), text).expect("a file");
        let done = bench.run("config apply 1 f.toml").exit(2);
        assert!(done.stderr.starts_with(&format!("cangauge: f.toml:{place}: ")), "{text}: {}", done.stderr);
        assert_eq!(done.frames, [""; 0]);
    }
}

/// The settings of another kind of device, measuring range and reference are refused before the first write.
/// The end of a file is never cut off: the settings after it would be lost.
#[test]
fn file_larger_than_16_mib_is_refused() {
    let bench = Bench::of("mh4@1");
    let comment = format!("#{}\n", "-".repeat(16 << 20));
    std::fs::write(bench.path("large.toml"), format!("[node]\nheartbeat = \"100ms\"\n{comment}")).expect("written");
    for words in ["config apply 1 large.toml", "info 1 --eds large.toml"] {
        bench.run(words).fails(8, "cangauge: read large.toml: the file is larger than 16 MiB\n");
    }
}

#[test]
fn another_device_is_refused() {
    let bench = Bench::of(ALL);
    for (node, text, key) in [
        ("2", "[device]\nkind = \"mh4\"\n", "device.kind is d20, the file has mh4"),
        ("1", "[device]\nrange.pressure = \"0 bar to 400 bar\"\n", "device.range.pressure is 0 bar to 10 bar"),
        ("127", "[device]\nreference = \"absolute\"\n", "device.reference is gauge, the file has absolute"),
        ("127", "[device]\nrange.pressure = \"500 psi\"\n", "device.range.pressure is 100.000 psi"),
        ("127", "[device]\nproduct = 5\n", "device.product is 0x443150"),
    ] {
        std::fs::write(bench.path("f.toml"), format!("{text}[node]\nheartbeat = \"500ms\"\n")).expect("a file");
        let done = bench.run(&format!("config apply {node} f.toml")).exit(1);
        assert!(done.stderr.contains(key), "{text}: {}", done.stderr);
        assert_eq!(writes(&done), [""; 0], "{text}");
    }
    std::fs::write(bench.path("f.toml"), "[device]\nrange.pressure = \"6.895 bar\"\n[node]\nheartbeat = \"500ms\"\n")
        .expect("a file");
    bench.run("config apply 127 f.toml").exit(0);
}

/// The requests that write.
fn writes(done: &super::Done) -> Vec<&str> {
    let is_write = |frame: &&String| {
        let specifier = frame.split('#').nth(1).and_then(|data| data.get(..2));
        frame.starts_with('6') && matches!(specifier, Some("22" | "23" | "27" | "2B" | "2F" | "21" | "20"))
    };
    done.frames.iter().filter(is_write).map(String::as_str).collect()
}

const FILE: &str = r#"[device]
kind = "mh4"
[node]
heartbeat = "500ms"
[signal.pressure]
unit = "psi"
filter = "moving"
lower = "1 bar"
upper = 100
[tpdo.1]
signals = ["pressure", "temperature"]
transmission = "timer"
event-timer = "100ms"
"#;

#[test]
fn apply_writes_differences_and_reads_them_back() {
    let bench = Bench::of(ALL);
    std::fs::write(bench.path("f.toml"), FILE).expect("a file");
    let done = bench.run("config apply 1 f.toml --store --reset --format json").exit(0);
    let report = &done.json()[0];
    assert_eq!((report["verified"].as_str(), report["stored"].as_bool()), (Some("reset"), Some(true)));
    let settings = report["settings"].as_array().expect("rows");
    let row = |key: &str| settings.iter().find(|row| row["setting"] == key).unwrap_or_else(|| panic!("{key}"));
    // 1 bar, in the unit that the device has then.
    assert_eq!(row("signal.pressure.lower")["after"], "14.503774 psi");
    assert_eq!(row("signal.pressure.upper")["after"], "100 psi");
    assert_eq!(row("tpdo.1.signals")["before"], serde_json::json!(["pressure", "pressure.status"]));
    // The unit comes first, the lower limit before the upper one, which falls, and the store last.
    let order: Vec<&str> = writes(&done).into_iter().filter_map(|frame| frame.get(6..12)).collect();
    let at = |object: &str| order.iter().position(|other| *other == object).unwrap_or_else(|| panic!("{object}"));
    assert!(at("316101") < at("346101") && at("346101") < at("356101") && at("356101") < at("171000"));
    assert_eq!(order.last(), Some(&"101001"));
}

#[test]
fn the_dump_of_a_device_changes_nothing() {
    let bench = Bench::of(ALL);
    for node in ["1", "2", "3", "127"] {
        let dump = bench.run(&format!("config dump {node}")).exit(0).stdout;
        std::fs::write(bench.path("f.toml"), dump).expect("a file");
        let done = bench.run(&format!("config apply {node} f.toml --address --with-calibration")).exit(0);
        assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", format!("node {node}: 0 changes\n").as_str()));
        assert_eq!(writes(&done), [""; 0]);
        bench.run(&format!("config diff {node} f.toml --address --with-calibration")).prints("");
        let stored = bench.run(&format!("config apply {node} f.toml --store")).exit(0);
        assert_eq!(writes(&stored).len(), 1, "{stored:?}");
    }
}

#[test]
fn a_dry_run_lists_the_writes() {
    let bench = Bench::of(ALL);
    std::fs::write(bench.path("f.toml"), FILE).expect("a file");
    let done = bench.run("config apply 1 f.toml --dry-run --store").exit(0);
    assert_eq!(writes(&done), [""; 0]);
    let lines: Vec<&str> = done.stdout.lines().collect();
    assert_eq!(lines[0], "cangauge sdo write 1 0x6131:1 0x00AB0000 --type u32  # signal.pressure.unit");
    assert_eq!(lines.last(), Some(&"cangauge store 1"));
    for line in lines.iter().filter(|line| !line.contains("0x1A")) {
        let words: Vec<&str> = line.split("  #").next().unwrap_or_default().split(' ').skip(1).collect();
        bench.run_words(&words).exit(0);
    }
}

#[test]
fn diff_lists_differences_with_units() {
    let bench = Bench::of(ALL);
    std::fs::write(bench.path("f.toml"), FILE).expect("a file");
    let done = bench.run("config diff 1 f.toml").exit(1);
    assert!(done.stdout.contains("signal.pressure.upper"), "{}", done.stdout);
    let row = done.stdout.lines().find(|line| line.starts_with("signal.pressure.upper")).expect("a row");
    assert_eq!(row.split_whitespace().collect::<Vec<_>>(), ["signal.pressure.upper", "10", "bar", "100", "psi"]);
    let dump = bench.run("config dump 1").exit(0).stdout;
    std::fs::write(bench.path("a.toml"), &dump).expect("a file");
    std::fs::write(bench.path("b.toml"), dump.replace("heartbeat = \"0ms\"", "heartbeat = \"0s\"")).expect("a file");
    bench.run("config diff a.toml b.toml").prints("");
    std::fs::write(bench.path("b.toml"), dump.replace("node-id = 1", "node-id = 9")).expect("a file");
    let done = bench.run("config diff a.toml b.toml --format json").exit(1);
    assert_eq!(done.json()[0]["setting"], "address.node-id");
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 1\n[[device]]\nkind = \"mh4\"\nnode = 2\nset = { \"0x1017\" = 500 }\n",
    );
    let done = bench.run("config diff 1 2 --format json").exit(1);
    assert_eq!(done.json(), [serde_json::json!({"setting":"node.heartbeat","before":"0ms","after":"500ms"})]);
}

/// A replacement has another node-ID, offset, unit and mapping: one command makes all settings equal, except the
/// calibration.
#[test]
fn address_and_calibration_are_set_only_on_request() {
    let bench = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\n");
    let old = bench.run("config dump 1").exit(0).stdout;
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nserial = 7\nset = { \"0x6127:1\" = 0.25, \"0x6131:1\" = 0x00AB0000, \"0x1017\" = 100 }\n",
    );
    std::fs::write(bench.path("f.toml"), old).expect("a file");
    let done = bench.run("config apply 5 f.toml --format json").exit(0);
    let report = &done.json()[0];
    let notes: Vec<&str> =
        report["notes"].as_array().expect("notes").iter().filter_map(|note| note["message"].as_str()).collect();
    assert!(notes.contains(&"not set: address.node-id (--address sets them)"), "{notes:?}");
    assert!(notes.iter().any(|note| note.starts_with("not set: calibration.pressure.offset")), "{notes:?}");
    let done = bench.run("config apply 5 f.toml --with-calibration").exit(1);
    assert!(done.stderr.contains("calibration.serial is 7, the file has 10001"), "{}", done.stderr);
    assert_eq!(writes(&done), [""; 0]);
    let done = bench.run("config apply 5 f.toml --address --store --format json").exit(0);
    let settings = done.json()[0]["settings"].clone();
    let row = |key: &str| settings.as_array().expect("rows").iter().find(|row| row["setting"] == key).cloned();
    assert_eq!(row("address.node-id").expect("the node-ID")["after"], 1);
    let two = bench.run("config apply 5,6 f.toml --address").exit(2);
    assert_eq!(two.frames, [""; 0]);
}

/// Forty transmitters from one file and one table; a device that is not in the table stays as it is.
#[test]
fn a_table_sets_forty_devices_and_no_other() {
    let devices = (1..=41).map(|node| format!("[[device]]\nkind = \"mh4\"\nnode = {node}\nserial = {}\n", 1000 + node));
    let bench = Bench::described(&devices.collect::<String>());
    let rows = (1..=40).map(|node| format!("0x47,1,{},{},\"{}ms\"\n", 1000 + node, 50 + node, 100 + node));
    std::fs::write(bench.path("t.csv"), format!("vendor,product,serial,node,timer\n{}", rows.collect::<String>()))
        .expect("a file");
    let file = "[device]\nkind = \"mh4\"\n[node]\nheartbeat = \"500ms\"\n[tpdo.1]\nevent-timer = \"{timer}\"\n";
    std::fs::write(bench.path("f.toml"), file).expect("a file");
    let done = bench.run("config apply --table t.csv f.toml --address --store --record r.json --format json").exit(0);
    let reports = done.json();
    assert_eq!(reports.len(), 40);
    let last = reports.iter().find(|report| report["serial"] == 1040).expect("the last row");
    let settings = last["settings"].as_array().expect("rows");
    let row = |key: &str| {
        settings.iter().find(|row| row["setting"] == key).unwrap_or_else(|| panic!("{key}"))["after"].clone()
    };
    assert_eq!((row("tpdo.1.event-timer"), row("address.node-id")), ("140ms".into(), 90.into()));
    assert_eq!(writes(&done).iter().filter(|frame| frame.starts_with("629")).count(), 0, "node 41 is not in the table");
    let record: serde_json::Value = serde_json::from_str(&bench.text("r.json")).expect("JSON");
    assert_eq!(record["devices"].as_array().map(Vec::len), Some(40));
    assert_eq!(record["devices"][0]["before"]["node.heartbeat"], "0ms");
    assert_eq!(record["devices"][0]["after"]["node.heartbeat"], "500ms");
}

#[test]
fn a_wrong_table_is_refused_before_anything_is_sent() {
    let bench = Bench::of(ALL);
    std::fs::write(bench.path("f.toml"), "[device]\nkind = \"mh4\"\n[node]\nheartbeat = \"{beat}\"\n").expect("a file");
    for (table, message) in [
        ("vendor,serial\n1,2\n", "t.csv:1: no column \"product\""),
        ("vendor,product,serial,beat\n71,1,0,500ms\n", "t.csv:2: serial: the number 0 does not identify a device"),
        ("vendor,product,serial,beat\n71,x,5,500ms\n", "t.csv:2: product: \"x\" is not a number"),
        ("vendor,product,serial,beat\n71,1,5,500ms\n71,1,5,500ms\n", "t.csv:3: the device with the serial number 5"),
        ("vendor,product,serial,node,beat\n71,1,5,9,1s\n71,1,6,9,1s\n", "t.csv:3: node: two devices get the node-ID 9"),
        (
            "vendor,product,serial,node,beat\n866,4469072,5,127,1s\n",
            "t.csv:2: node: 127 is the node-ID of a new device",
        ),
        ("vendor,product,serial\n71,1,5\n", "f.toml (row 2 of t.csv):4:13: node.heartbeat: the table has no value"),
        ("vendor,product,serial,beat\n71,1,5,fast\n", "f.toml (row 2 of t.csv):4:13: node.heartbeat: \"fast\" is not"),
        ("vendor,product,serial\n", "t.csv:1: the table has no devices"),
    ] {
        std::fs::write(bench.path("t.csv"), table).expect("a file");
        let done = bench.run("config apply --table t.csv f.toml --address").exit(2);
        assert!(done.stderr.starts_with(&format!("cangauge: {message}")), "{table}: {}", done.stderr);
        assert_eq!(done.frames, [""; 0], "{table}");
    }
    std::fs::write(bench.path("t.csv"), "vendor,product,serial,beat\n71,1,5,500ms\n").expect("a file");
    let done = bench.run("config apply --table t.csv f.toml").exit(3);
    assert!(done.stderr.contains("no device with the serial number 5 answers"), "{}", done.stderr);
    assert_eq!(writes(&done), [""; 0]);
}

#[test]
fn the_record_can_be_a_page_and_the_schema_is_json() {
    let bench = Bench::of(ALL);
    std::fs::write(bench.path("f.toml"), FILE).expect("a file");
    bench.run("config apply 1 f.toml --store --reset --record r.html").exit(0);
    let page = bench.text("r.html");
    assert!(page.contains("serial number 10001") && page.contains("read again after a reset"), "{page}");
    assert!(page.contains("<td>node.heartbeat</td><td>0ms</td><td><strong>500ms</strong></td>"), "{page}");
    let schema: serde_json::Value = serde_json::from_str(&bench.run("config schema").exit(0).stdout).expect("JSON");
    for key in ["device", "address", "node", "signal", "tpdo", "object", "calibration"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
}

#[test]
fn dcf_sets_a_device_and_equal_values_are_not_written() {
    for (device, node) in [("mh4", 1), ("dps", 127), ("d20", 2), ("mc1609", 3), ("jumo", 4)] {
        let bench = Bench::of(&format!("{device}@{node},{device}@9"));
        let dcf = bench.run(&format!("config dump {node} --dcf")).exit(0).stdout;
        assert!(!dcf.contains("[Calibration") && dcf.contains(&format!("NodeID={node}\n")), "{dcf}");
        std::fs::write(bench.path("x.dcf"), &dcf).expect("a file");
        let done = bench.run(&format!("config apply {node} x.dcf")).exit(0);
        assert_eq!(done.stderr, format!("node {node}: 0 changes\n"), "{device}");
        assert_eq!(writes(&done), [""; 0], "{device}");
        // Identifiers follow the node-ID of the device.
        let done = bench.run("config apply 9 x.dcf").exit(0);
        assert!(done.stderr.ends_with("node 9: 0 changes\n"), "{device}: {}", done.stderr);
        let changed = dcf.replace("ParameterName=producer-heartbeat-time", "ParameterName=Heartbeat");
        let place = changed.find("[1017]").expect("1017h");
        let (before, after) = changed.split_at(place);
        let (_, rest) = after.split_once("ParameterValue=").expect("a value");
        let rest = rest.split_once('\n').map_or("", |(_, rest)| rest);
        let head = after.split("ParameterValue=").next().expect("a head");
        std::fs::write(bench.path("y.dcf"), format!("{before}{head}ParameterValue=0x1F4\r\n{rest}")).expect("a file");
        let done = bench.run("config diff 9 y.dcf").exit(1);
        assert!(done.stdout.contains("node.heartbeat") && done.stdout.contains("500ms"), "{device}: {}", done.stdout);
    }
}

#[test]
fn objects_of_a_dcf_that_the_device_lacks_are_reported() {
    let bench = Bench::of("mh4@1,dps@127");
    let mut dcf = bench.run("config dump 1 --dcf").exit(0).stdout;
    dcf += "[2FF0]\nParameterName=Gain\nObjectType=7\nDataType=7\nAccessType=rw\nParameterValue=5\n\
            [1000]\nParameterName=Device type\nObjectType=7\nDataType=7\nAccessType=ro\nParameterValue=0x123\n";
    std::fs::write(bench.path("x.dcf"), &dcf).expect("a file");
    let done = bench.run("config apply 1 x.dcf").exit(0);
    assert!(done.stderr.contains("node 1: the device does not have: 0x2FF0:0 (gain)\n"), "{}", done.stderr);
    let others = "node 1: not set, because they are read-only, commands or PDO parameters without a setting: 0x1000:0 (device-type)\n";
    assert!(done.stderr.contains(others), "{}", done.stderr);
    let report = bench.run("config apply 1 x.dcf -f json").exit(0).json();
    assert_eq!(report[0]["notes"][0]["code"], "not-on-device");
    let done = bench.run("config apply 127 x.dcf").exit(1);
    assert!(done.stderr.contains("another device: device.vendor is"), "{}", done.stderr);
    assert_eq!(writes(&done), [""; 0]);
    let eds = dcf.replace("ParameterValue", "DefaultValue");
    std::fs::write(bench.path("x.eds"), eds).expect("a file");
    let done = bench.run("config apply 1 x.eds -q").exit(2);
    assert!(
        done.stderr.contains("x.eds: it has no ParameterValue: it describes a device and sets nothing"),
        "{done:?}"
    );
}

/// A value that cannot be read must not be left out silently: the other values would be applied without it.
#[test]
fn unreadable_value_of_a_dcf_is_an_error_with_its_line() {
    let bench = Bench::of("mh4@1");
    let object = |index: &str, data_type: u8, value: &str| {
        format!(
            "[{index}]\nParameterName=P{index}\nObjectType=7\nDataType={data_type}\nAccessType=rw\nParameterValue={value}\n"
        )
    };
    for (value, reason) in [
        ("100ms", "[1017] ParameterValue: \"100ms\" is not a value of type u16"),
        ("70000", "[1017] ParameterValue: \"70000\" does not fit u16 (0 to 65535)"),
    ] {
        let dcf = object("1015", 6, "5") + &object("1017", 6, value);
        std::fs::write(bench.path("x.dcf"), dcf).expect("a file");
        for line in ["config diff 1 x.dcf", "config apply 1 x.dcf", "config apply 1 x.dcf --dry-run"] {
            let done = bench.run(line).exit(2);
            assert!(done.stderr.contains(&format!("cangauge: x.dcf:12:1: {reason}\n")), "{line}: {}", done.stderr);
        }
    }
    std::fs::write(bench.path("x.dcf"), object("1017", 99, "5")).expect("a file");
    let done = bench.run("config diff 1 x.dcf").exit(2);
    assert!(done.stderr.contains("x.dcf:6:1: [1017] ParameterValue: the data type is unknown\n"), "{}", done.stderr);
    // Doubts about values are shown, not only counted.
    std::fs::write(bench.path("x.dcf"), object("1017", 6, "0100")).expect("a file");
    let done = bench.run("config diff 1 x.dcf").exit(1);
    assert!(done.stderr.contains("x.dcf:6: [1017] ParameterValue: \"0100\" begins with 0"), "{}", done.stderr);
}

#[test]
fn a_dcf_of_another_tool_has_formulas_units_and_an_address() {
    let bench = Bench::of("dps@127");
    let dcf = "[DeviceComissioning]\nNodeID=0x21\nBaudrate=125\n[1017]\nParameterName=Heartbeat\nObjectType=7\nDataType=6\n\
               AccessType=rw\nParameterValue=250\n[1800]\nParameterName=TPDO\nObjectType=9\nSubNumber=2\n[1800sub1]\n\
               ParameterName=COB-ID\nDataType=7\nAccessType=rw\nParameterValue=0x180+$NodeID\n[1800sub5]\n\
               ParameterName=Timer\nDataType=6\nAccessType=rw\nParameterValue=0x32\n[6131]\nParameterName=Unit\n\
               ObjectType=8\nSubNumber=1\n[6131sub1]\nParameterName=Unit\nDataType=7\nAccessType=rw\n\
               ParameterValue=0x004E0000\n";
    std::fs::write(bench.path("x.dcf"), dcf).expect("a file");
    let done = bench.run("config diff 127 x.dcf").exit(1);
    let rows: Vec<&str> = done.stdout.lines().skip(1).map(|line| line.split(' ').next().expect("a key")).collect();
    assert_eq!(rows, ["node.heartbeat", "signal.pressure.unit", "tpdo.1.event-timer"], "{}", done.stdout);
    let done = bench.run("config apply 127 x.dcf").exit(0);
    assert!(
        done.stderr.contains("not set: address.node-id, address.bit-rate (--address sets them)"),
        "{}",
        done.stderr
    );
    let done = bench.run("config apply 127 x.dcf --address --dry-run").exit(0);
    assert!(done.stdout.contains("lss set-id 127 33"), "{}", done.stdout);
}

#[test]
fn an_eds_or_a_description_of_the_user_is_enough() {
    let bench = Bench::of("mh4@1");
    let mut eds = "[DeviceInfo]\nVendorName=Maker\n".to_owned();
    for (index, name, data_type) in [(0x1015, "Inhibit time EMCY", 6), (0x1017, "Heartbeat", 6)] {
        eds += &format!("[{index:04X}]\nParameterName={name}\nObjectType=7\nDataType={data_type}\nAccessType=rw\n");
    }
    let text = bench.run("devices show mh4").exit(0).stdout;
    std::fs::write(bench.path("mine.toml"), text.replacen("name = \"mh4\"", "name = \"mine\"", 1)).expect("a file");
    std::fs::write(bench.path("x.eds"), eds).expect("a file");
    for (option, lines) in [("--eds x.eds", 2), ("--device mine.toml", 20)] {
        let dump = bench.run(&format!("config dump 1 {option}")).exit(0).stdout;
        let count = dump.lines().filter(|line| line.contains(" = ")).count();
        assert!(count >= lines && dump.contains("heartbeat = \"0ms\""), "{option}: {dump}");
        std::fs::write(bench.path("x.toml"), &dump).expect("a file");
        let done = bench.run(&format!("config apply 1 x.toml {option}")).exit(0);
        assert!(done.stderr.ends_with("node 1: 0 changes\n"), "{option}: {}", done.stderr);
        std::fs::write(bench.path("x.toml"), dump.replace("heartbeat = \"0ms\"", "heartbeat = \"500ms\""))
            .expect("a file");
        let done = bench.run(&format!("config apply 1 x.toml {option}")).exit(0);
        assert_eq!(writes(&done), ["601#2B171000F4010000"], "{option}");
    }
}

#[test]
fn a_failed_apply_is_rolled_back_from_its_journal() {
    let bench = Bench::of("mh4@1");
    let text = bench.run("devices show mh4").exit(0).stdout.replace("allow = [\"0-240\", \"254\", \"255\"]\n", "");
    std::fs::write(bench.path("mine.toml"), text.replacen("name = \"mh4\"", "name = \"mine\"", 1)).expect("a file");
    // The device rejects this transmission type.
    let file = "[node]\nheartbeat = \"500ms\"\nemcy-inhibit-time = \"10ms\"\n[tpdo.1]\ntransmission = 245\n";
    std::fs::write(bench.path("f.toml"), file).expect("a file");
    let run = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().chain(["--device", "mine.toml"]).collect();
        bench.finish(bench.traced(&words).env("XDG_STATE_HOME", bench.folder.path()))
    };
    let failed = run("config apply 1 f.toml").exit(4);
    assert!(failed.stderr.contains("written: node.heartbeat, node.emcy-inhibit-time"), "{}", failed.stderr);
    assert!(failed.stderr.contains("go back: cangauge config apply 1 --rollback"), "{}", failed.stderr);
    // Each command starts a new simulated device: the bench contains the written values.
    let set =
        "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 1\nset = { \"0x1017\" = 500, \"0x1015\" = 100 }\n";
    std::fs::write(bench.path("bench.toml"), set).expect("a file");
    let done = run("config apply 1 --rollback").exit(0);
    assert_eq!(writes(&done), ["601#2B15100000000000", "601#2B17100000000000"]);
    let done = run("config apply 1 --rollback").exit(1);
    assert_eq!(writes(&done), [""; 0]);
}

/// The blocks between .EX and .EE in the recipes of the manual page.
fn recipe_blocks() -> Vec<String> {
    let page = include_str!("../../src/cli/man/cangauge-config.1").replace("\\-", "-");
    let blocks = page.split(".EX\n").skip(1).map(|rest| rest.split(".EE").next().unwrap_or_default().to_owned());
    blocks.collect()
}

#[test]
fn the_recipes_of_the_manual_page_work() {
    let blocks = recipe_blocks();
    let [dump, replace, file, table, series] = &blocks[..] else { panic!("{blocks:?}") };
    let run = |bench: &Bench, line: &str| bench.run(line.strip_prefix("cangauge ").expect(line)).exit(0);
    let old = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 500, \"0x6127:1\" = 0.25, \"0x1800:5\" = 20 }\n",
    );
    let (line, name) = dump.trim().split_once(" > ").expect("a redirection");
    let settings = run(&old, line).stdout;
    let new = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\nserial = 777\n");
    std::fs::write(new.path(name), settings).expect("a file");
    let mut lines = replace.lines();
    let shown = run(&new, lines.next().expect("a dry run"));
    assert!(shown.stdout.contains("0x1017:0 500") && writes(&shown).is_empty(), "{}", shown.stdout);
    assert!(!shown.stdout.contains("0x6127"), "the offset belongs to the old sensor: {}", shown.stdout);
    let done = run(&new, lines.next().expect("the writes"));
    assert!(done.stdout.contains("address.node-id"), "{}", done.stdout);
    let bench = Bench::described(
        &[51, 52, 53]
            .map(|at| format!("[[device]]\nkind = \"mh4\"\nnode = {}\nserial = {}\n", at - 40, at + 950))
            .concat(),
    );
    std::fs::write(bench.path("line.toml"), file).expect("a file");
    std::fs::write(bench.path("forty.csv"), table).expect("a file");
    for line in series.lines() {
        let done = run(&bench, line);
        let is_third = |frame: &&&str| frame.starts_with("60D#2");
        assert_eq!(writes(&done).iter().filter(is_third).count(), 0, "{line}: node 13 is not in the table");
    }
    assert!(bench.text("forty.html").contains("1002"));
}
