//! Descriptions and EDS files that the user names: for this device, for another one, both together, with warnings.

use super::Bench;
use std::fs;

/// An EDS for this vendor and product, with these objects: index, name, data type.
fn eds(vendor: u32, product: u32, objects: &[(u16, &str, u8)]) -> String {
    let mut text = format!("[DeviceInfo]\nVendorName=Maker\nVendorNumber={vendor:#x}\nProductNumber={product:#x}\n");
    text += &format!("[ManufacturerObjects]\nSupportedObjects={}\n", objects.len());
    for (at, (index, ..)) in (1..).zip(objects) {
        text += &format!("{at}={index:#06x}\n");
    }
    for (index, name, data_type) in objects {
        text += &format!("[{index:04X}]\nParameterName={name}\nObjectType=7\nDataType={data_type}\nAccessType=rw\n");
    }
    text
}

const NAMES: [(u16, &str, u8); 4] =
    [(0x1017, "Heartbeat", 6), (0x2200, "Offset", 8), (0x2201, "4-20 mA Input", 8), (0x2202, "Position Value", 4)];

fn bench_with(devices: &str, files: &[(&str, String)]) -> Bench {
    let bench = Bench::of(devices);
    files.iter().for_each(|(name, text)| fs::write(bench.path(name), text).expect("written"));
    bench
}

#[test]
fn an_eds_of_another_device_is_a_warning_or_an_error() {
    let bench = bench_with("mh4@1", &[("vendor.eds", eds(0x56, 1, &NAMES)), ("product.eds", eds(0x47, 2, &NAMES))]);
    for file in ["vendor.eds", "product.eds"] {
        let run = |line: &str| bench.run(&format!("--eds {file} {line}"));
        for line in ["read 1 pressure", "sdo read 1 0x1018:1", "info 1"] {
            let done = run(line).exit(0);
            assert!(done.stderr.contains(&format!("node 1: {file} is for another device")), "{line}: {}", done.stderr);
        }
        for line in [
            "log 1 --sync 100ms --count 2",
            "check 1 'pressure<5'",
            "sdo write 1 0x1017 100",
            "unit 1 pressure mbar",
            "store 1",
            "pdo map 1 1 --transmission sync:2",
            "lss set-id 1 9",
            "lss set-bitrate 1 125k",
            "lss store 1",
            "lss set-id 71:1:1:10001 9",
            "config dump 1",
            "config diff 1 1",
            "nmt state 1 --probe",
        ] {
            let line = line.replace('\'', "");
            let done = run(&line).exit(2);
            assert!(
                done.stderr.contains("choose the file of this device, or add --accept-mismatch"),
                "{line}: {}",
                done.stderr
            );
            // Requests of a read, also of one in segments.
            let reads = |data: &&str| ["40", "60", "70"].iter().any(|first| data.starts_with(first));
            assert!(done.frames_of("601").iter().all(reads), "{line}: {:?}", done.frames);
            let sets = |data: &&str| ["11", "13", "17"].iter().any(|first| data.starts_with(first));
            assert!(!done.frames_of("7E5").iter().any(sets), "{line}: {:?}", done.frames);
        }
        let done = run("sdo write 1 0x1017 100 --accept-mismatch").exit(0);
        assert_eq!(done.stderr, "");
    }
}

#[test]
fn numbers_that_are_0_or_missing_are_not_compared() {
    let text = eds(0, 0, &NAMES).replace("ProductNumber=0x0\n", "RevisionNumber=0x999\n");
    let bench = bench_with("mh4@1", &[("x.eds", text)]);
    let done = bench.run("--eds x.eds sdo write 1 0x1017 100").exit(0);
    assert_eq!(done.stderr, "node 1: x.eds is for another revision of the device\n");
}

#[test]
fn eds_for_all_nodes_applies_to_matching_nodes() {
    let bench = bench_with("mh4@1,dps@127", &[("mh4.eds", eds(0x47, 1, &NAMES))]);
    let done = bench.run("--eds mh4.eds log 1,127 --poll 100ms --count 4").exit(0);
    assert!(done.stdout.contains(",127,pressure,"), "{}", done.stdout);
    let done = bench.run("--eds 127=mh4.eds log 1,127 --poll 100ms --count 4").exit(2);
    assert!(done.stderr.contains("node 127: mh4.eds is for another device"), "{}", done.stderr);
}

#[test]
fn a_device_keeps_its_name_if_the_eds_is_for_another_one() {
    for kind in ["mc1609", "mh4", "dps"] {
        let bench = bench_with(&format!("{kind}@3"), &[("other.eds", eds(0x56, 0x41, &NAMES))]);
        for line in ["--eds other.eds scan", "--eds other.eds scan 3", "--eds 3=other.eds scan 3"] {
            let found = bench.run(&format!("{line} --format json")).exit(0).json();
            assert_eq!(found[0]["device"], kind, "{line}");
        }
        let title = |line: &str| bench.run(line).exit(0).stdout.lines().next().map(str::to_owned);
        assert_eq!(title("--eds other.eds info 3"), title("info 3"));
    }
}

#[test]
fn values_and_vendor_come_from_the_device() {
    let other = eds(0x56, 0x41, &[(0x6130, "Value", 4), (0x2200, "Offset", 8)]).replace("[6130]", "[6130sub1]");
    let bench = bench_with("mh4@1", &[("other.eds", other)]);
    let plain = bench.run("scan 1 --format json").exit(0).json();
    let scanned = bench.run("--eds other.eds scan 1 --format json").exit(0);
    assert_eq!(scanned.json()[0]["vendor_name"], plain[0]["vendor_name"]);
    assert!(scanned.stderr.contains("node 1: the description or EDS is for another device"), "{}", scanned.stderr);
    // The simulated pressure changes with the time of the request.
    let pressure = |line: &str| bench.run(line).exit(0).stdout.trim().parse::<f64>().unwrap();
    let (with, without) = (pressure("--eds other.eds read 1 pressure"), pressure("read 1 pressure"));
    assert!((with - without).abs() < 0.05, "{with} {without}");
}

#[test]
fn a_description_and_an_eds_are_used_together() {
    let own = eds(0x47, 1, &[(0x2200, "Offset", 8), (0x1017, "Other name", 6)]);
    let bench = bench_with("mh4@1", &[("x.eds", own)]);
    let run = |line: &str| bench.run(&format!("--device mh4 --eds x.eds {line}"));
    run("sdo read 1 producer-heartbeat-time").exit(0);
    let done = run("sdo read 1 offset").exit(4);
    assert!(done.stderr.contains("read 0x2200:0"), "{}", done.stderr);
    bench.run("--eds x.eds --eds x.eds read 1").refuses("two EDS files for the same nodes");
    bench.run("--device 1=mh4 --device 1=dps read 1").refuses("two device descriptions for node 1");
    run("--eds 1=x.eds read 1").exit(0);
}

#[test]
fn eds_warnings_are_one_line_and_concern_the_object() {
    let text = eds(0x47, 1, &NAMES).replace("4=0x2202\n", "").replace("3=0x2201\n", "");
    let bench = bench_with("mh4@1", &[("x.eds", text)]);
    let done = bench.run("--eds x.eds sdo read 1 0x1018:1").exit(0);
    assert_eq!(done.stderr.lines().filter(|line| line.contains("x.eds")).count(), 1, "{}", done.stderr);
    assert!(done.stderr.contains("warnings (-v shows them)"), "{}", done.stderr);
    let done = bench.run("--eds x.eds sdo read 1 0x2202").exit(4);
    assert!(done.stderr.contains("object 2202h is described, but not listed"), "{}", done.stderr);
    assert!(!done.stderr.contains("object 2201h"), "{}", done.stderr);
    let done = bench.run("-v --eds x.eds sdo read 1 0x1018:1").exit(0);
    assert!(done.stderr.contains("2201h") && done.stderr.contains("2202h"), "{}", done.stderr);
}

#[test]
fn text_that_is_not_an_address_is_a_name() {
    let bench = bench_with("mh4@1", &[("x.eds", eds(0x47, 1, &NAMES))]);
    for (name, object) in [
        ("offset", "0x2200:0"),
        ("OFFSET", "0x2200:0"),
        ("4-20-ma-input", "0x2201:0"),
        ("4-20 mA Input", "0x2201:0"),
        ("Position Value", "0x2202:0"),
    ] {
        for command in [&["sdo", "read"][..], &["read"]] {
            let words: Vec<&str> = ["--eds", "x.eds"].iter().chain(command).copied().chain(["1", name]).collect();
            let done = bench.run_words(&words).exit(4);
            assert!(done.stderr.contains(&format!("read {object}")), "{words:?}: {}", done.stderr);
        }
    }
    let done = bench.run("--eds x.eds sdo read 1 ofset").exit(2);
    assert!(done.stderr.contains("similar names: offset"), "{}", done.stderr);
    let done = bench.run("--eds x.eds log 1 heartbeat --poll 100ms --count 2").exit(0);
    assert!(done.stdout.contains(",1,heartbeat,0,"), "{}", done.stdout);
}

const SPELLINGS: &str = include_str!("../data/eds/31-spellings.eds");

#[test]
fn names_are_typed_as_the_eds_spells_them() {
    let bench = bench_with("x.eds@5", &[("x.eds", SPELLINGS.to_owned())]);
    let run = |words: &[&str]| bench.run_words(&[&["--eds", "x.eds", "-q"], words].concat());
    for (name, value) in [
        ("Pressure / Temperature", "10"),
        ("Value < 3", "11"),
        ("Value # 3", "12"),
        ("+offset", "13"),
        ("Offset", "14"),
        ("Face", "15"),
        ("100", "16"),
        ("***", "18"),
        ("pump.status", "19"),
        ("Level:2", "21"),
    ] {
        for command in [&["sdo", "read", "5"][..], &["read", "5"]] {
            let done = run(&[command, &[name]].concat()).exit(0);
            assert_eq!(done.stdout.trim(), value, "{command:?} {name}");
        }
        let done = run(&["log", "5", name, "--poll", "50ms", "--count", "1"]).exit(0);
        assert!(done.stdout.contains(&format!(",{value},")), "{name}: {}", done.stdout);
        run(&["check", "5", &format!("\"{name}\" == {value}")]).exit(0);
        run(&["pdo", "map", "5", "1", name]).exit(0);
        run(&["objects", name]).exit(0);
    }
    let done = run(&["sdo", "read", "5", "Value"]).exit(2);
    let expected = "several objects have the name \"Value\"\nhint: name one: sensor-a:1, sensor-b:1\n";
    assert!(done.stderr.ends_with(expected), "{}", done.stderr);
    let done = run(&["objects", "value"]).exit(0);
    assert!(done.stdout.contains("sensor-a:1") && done.stdout.contains("sensor-b:1"), "{}", done.stdout);
    let done = run(&["read", "5", "Value"]).exit(2);
    assert!(done.stderr.contains("(it has: sensor-a:1, sensor-b:1"), "{}", done.stderr);
}

#[test]
fn mapped_text_has_no_number_and_hides_no_other_signal() {
    let bench = bench_with("x.eds@5", &[("x.eds", SPELLINGS.to_owned())]);
    let done = bench.run("--eds x.eds read 5").exit(0);
    assert!(done.stdout.contains("pressure-temperature  10"), "{}", done.stdout);
    assert!(done.stderr.contains("serial-text: no value: it is text or bytes"), "{}", done.stderr);
    let done = bench.run("--eds x.eds read 5 serial-text").exit(2);
    assert!(done.stderr.contains("hint: cangauge sdo read 5 serial-text"), "{}", done.stderr);
    bench.run_words(&["--eds", "x.eds", "check", "5", "serial-text == 3"]).exit(2);
}

#[test]
fn an_expression_uses_the_names_of_an_eds() {
    let bench = bench_with("mh4@1", &[("x.eds", eds(0x47, 1, &NAMES))]);
    let run = |words: &[&str]| bench.run_words(&[&["--eds", "x.eds"], words].concat());
    let done = run(&["check", "1", "heartbeat == 0"]).exit(0);
    assert_eq!(done.stdout, "ok    heartbeat == 0  0\n");
    run(&["check", "1", "1.Heartbeat > 5"]).exit(1);
    run(&["check", "1", "heartbeat == 0", "--for", "300ms", "--poll", "100ms"]).exit(0);
    run(&["log", "1", "heartbeat", "--poll", "100ms", "--count", "2", "--expect", "heartbeat == 0"]).exit(0);
    let done = run(&["check", "1", "offset < 5"]).exit(4);
    assert!(done.stderr.contains("read 0x2200:0"), "{}", done.stderr);
    let done = run(&["check", "1", "ofset < 5"]).exit(2);
    assert!(done.stderr.contains("no signal \"ofset\""), "{}", done.stderr);
    // The description also has names.
    bench.run_words(&["check", "1", "pressure < 100 bar and producer-heartbeat-time == 0"]).exit(0);
}

/// A description without objects: one signal, and a fixed unit if there is one.
fn description(unit: Option<&str>) -> String {
    let head = "name = \"mine\"\ntitle = \"Mine\"\nvendor = \"Maker\"\n[identify]\n";
    let signal = "[[signal]]\nname = \"level\"\nchannel = 1\nvalue = \"0x6130:1\"\nstatus = \"0x6150:1\"\n";
    let object = |unit| {
        format!(
            "[[object]]\nat = \"0x6130:1\"\nname = \"level\"\ntype = \"r32\"\naccess = \"ro\"\npdo = true\nunit = \"{unit}\"\n"
        )
    };
    let status = "[[object]]\nat = \"0x6150:1\"\nname = \"state\"\ntype = \"u8\"\naccess = \"ro\"\n";
    format!("{head}{signal}{}", unit.map(|unit| object(unit) + status).unwrap_or_default())
}

#[test]
fn tpdos_missing_in_a_description_are_read_from_the_device() {
    let files = [("mine.toml", description(None)), ("x.eds", eds(0x47, 1, &NAMES))];
    let bench = bench_with("mh4@1", &files);
    for line in ["--device mine.toml", "--eds x.eds", "--device mine.toml --eds x.eds"] {
        let done = bench.run(&format!("{line} log 1 --sync 100ms --count 2")).exit(0);
        assert_eq!(done.stdout.lines().count(), 3, "{}", done.stdout);
        let done = bench.run(&format!("{line} pdo show 1")).exit(0);
        assert!(done.stdout.contains("0x181"), "{}", done.stdout);
    }
    // 1008h is not read if the user named the description.
    let named = bench.run("--device mine.toml read 1");
    assert!(!named.frames.iter().any(|frame| frame.starts_with("601#40081000")), "{:?}", named.frames);
}

#[test]
fn a_unit_in_a_description_is_the_unit_of_the_signal() {
    let head = "name = \"mine\"\ntitle = \"Mine\"\nvendor = \"Maker\"\n[identify]\n";
    let signal = "[[signal]]\nname = \"flow\"\nchannel = 9\nvalue = \"0x1017:0\"\n";
    let object = "[[object]]\nat = \"0x1017:0\"\nname = \"flow\"\ntype = \"u16\"\naccess = \"ro\"\nunit = \"l/min\"\n";
    let bench = bench_with("mh4@1", &[("mine.toml", format!("{head}{signal}{object}"))]);
    let done = bench.run("--device mine.toml read 1 --format csv").exit(0);
    assert!(done.stdout.contains(",flow,0,l/min,"), "{}", done.stdout);
    let done = bench.run("--device mine.toml log 1 --poll 100ms --count 1").exit(0);
    assert!(done.stdout.contains(",1,flow,0,l/min,,"), "{}", done.stdout);
}

#[test]
fn mistakes_in_a_description_are_shown_with_their_places() {
    let head = "name = \"mine\"\ntitle = \"Mine\"\nvendor = \"Maker\"\n[identify]\n";
    let signal =
        |name, channel, rest| format!("[[signal]]\nname = \"{name}\"\n{channel}\nvalue = \"0x6130:1\"\n{rest}");
    let one = signal("pressure", "channel = 1", "");
    for (text, message) in [
        (
            format!("{one}{}", signal("temperature", "channel = 1", "")),
            "11:11: channel: two signals have the channel 1",
        ),
        (
            format!("{one}{}", signal("pressure", "channel = 2", "")),
            "10:8: name: two signals have the name \"pressure\"",
        ),
        (signal("pressure", "channel = 0", ""), "7:11: channel: 0 is not in the range"),
        (signal("ch2", "channel = 1", ""), "6:8: name: \"ch2\" is channel 2"),
        (signal("pressure", "chanel = 1", ""), "7:1: unknown key \"chanel\""),
        (signal("pressure", "channel = 1", "units = \"bar\"\n"), "9:1: unknown key \"units\""),
        ("[[signal]\n".to_owned(), "5:10: "),
    ] {
        let bench = bench_with("mh4@1", &[("mine.toml", format!("{head}{text}"))]);
        for line in ["read 1", "log 1 --sync 100ms --count 1", "pdo show 1"] {
            let done = bench.run(&format!("--device mine.toml {line}")).exit(2);
            assert!(done.stderr.starts_with(&format!("cangauge: mine.toml:{message}")), "{line}: {}", done.stderr);
            assert!(done.frames.is_empty(), "{:?}", done.frames);
        }
    }
}

#[test]
fn description_of_another_vendor_is_used_only_with_types_of_cia_404() {
    let devices = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/device/devices/mh4.toml");
    let text = fs::read_to_string(devices).expect("the description");
    let other = text.replacen("name = \"mh4\"", "name = \"other\"", 1);
    let other =
        other.replace("default = 71\n", "default = 0x7777\n").replace("vendor_id = 71\n", "vendor_id = 0x7777\n");
    let bench = Bench::described("[[device]]\nkind = \"other.toml\"\nnode = 5\n");
    for (file, fitting) in [(other.clone(), &["mh4", "hydac"][..]), (other.replace("0x00820194", "0x00820191"), &[])] {
        fs::write(bench.path("other.toml"), file).expect("written");
        for device in ["mh4", "hydac", "dps"] {
            let line = format!("--device {device} log 5 --sync 100ms --count 2");
            if fitting.contains(&device) {
                let done = bench.run(&line).exit(0);
                assert!(done.stderr.contains("is for another device"), "{line}: {}", done.stderr);
            } else {
                bench.run(&line).exit(2);
            }
        }
    }
}

/// The names that the completion offers after these words.
fn completed(bench: &Bench, words: &[&str]) -> Vec<String> {
    let done = bench.run_words(&[&["completions", "--"], words].concat()).exit(0);
    done.stdout.lines().map(str::to_owned).collect()
}

#[test]
fn completion_offers_names_of_descriptions_and_files() {
    let bench = bench_with("x.eds@5", &[("x.eds", SPELLINGS.to_owned())]);
    let offers = |words: &[&str], names: &[&str]| {
        let found = completed(&bench, words);
        names.iter().for_each(|name| assert!(found.iter().any(|found| found == name), "{words:?} {name}: {found:?}"));
    };
    for command in [&["log"][..], &["read"], &["check"], &["sdo", "read"], &["sdo", "write"], &["objects"]] {
        let words = [&["--eds", "x.eds"], command, &["5", "sen"]].concat();
        assert_eq!(completed(&bench, &words), ["sensor-a:0", "sensor-a:1", "sensor-b:0", "sensor-b:1"], "{words:?}");
    }
    offers(&["pdo", "map", "5", "1", "--eds=5=x.eds", "pump"], &["pump-status"]);
    offers(&["objects", "x.eds", "lev"], &["level-2"]);
    offers(&["read", "5", ""], &["pressure", "temperature", "producer-heartbeat-time"]);
    offers(&["--device", "mh4", "log", "5", "--sync", "10ms", "ai-input-pv:"], &["ai-input-pv:1"]);
    offers(&["log", "5", "--device", "d"], &["d20", "dps"]);
    offers(&["read", "5", "--device=m"], &["--device=mh4"]);
    offers(&["read", "5", "pressure", "--in", "k"], &["kPa"]);
    offers(&["unit", "5", "pressure", "p"], &["psi"]);
    offers(&["devices", "show", "hy"], &["hydac"]);
    for words in [&["log", "1"][..], &["read", "5", "--eds", "x"], &["--eds", "none.eds", "-t", ""]] {
        assert_eq!(completed(&bench, words), [""; 0], "{words:?}");
    }
}

#[test]
fn completion_offers_commands_options_and_values() {
    let bench = Bench::of(super::ALL);
    let offers = |line: &str, names: &[&str]| {
        let found = completed(&bench, &line.split(' ').collect::<Vec<_>>());
        let found: Vec<&str> = found.iter().filter_map(|found| found.split('\t').next()).collect();
        names.iter().for_each(|name| assert!(found.contains(name), "{line} {name}: {found:?}"));
    };
    // The value of an option is not a command.
    offers("-b sim re", &["read", "restore"]);
    offers("-b sim:mh4@5 log 5 --sy", &["--sync"]);
    offers("log 5 --ex", &["--expect"]);
    offers("read 5 ", &["pressure"]);
    offers("read ", &["--timeout", "--in"]);
    offers("log 5 --layout ", &["long", "wide"]);
    offers("--format=j", &["--format=json"]);
    offers("-b s", &["sim", "sim:mh4@1", "slcan:", "socketcand://"]);
    offers("pdo map 5 ", &["1", "4"]);
    offers("pdo map 5 1 --transmission ", &["sync:1", "timer"]);
    offers("lss ", &["scan", "set-id"]);
    assert!(completed(&bench, &["sca"])[0].starts_with("scan\tList every node"), "{:?}", completed(&bench, &["sca"]));
    assert_eq!(completed(&bench, &["--eds", ""]), [""; 0], "a file");
    assert_eq!(completed(&bench, &["plot", ""]), [""; 0], "a file");
}

#[test]
fn bash_completes_names_with_colons() {
    let bench = bench_with("x.eds@5", &[("x.eds", SPELLINGS.to_owned())]);
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_cangauge"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/completions/cangauge.bash");
    let text = format!(
        "PATH={}:$PATH; source {script}; COMP_LINE='cangauge --eds x.eds read 5 sensor-a:'; COMP_POINT=${{#COMP_LINE}}; \
         COMP_WORDS=(cangauge --eds x.eds read 5 sensor-a :); COMP_CWORD=6; _cangauge cangauge : sensor-a; \
         printf '%s\\n' \"${{COMPREPLY[@]}}\"",
        program.parent().expect("a folder").display()
    );
    let done = std::process::Command::new("bash").args(["-c", &text]).current_dir(bench.path("")).output();
    let output = done.expect("bash").stdout;
    let found = String::from_utf8_lossy(&output).into_owned();
    assert!(found.lines().any(|line| line == "1") && found.lines().any(|line| line == "0"), "{found}");
}
