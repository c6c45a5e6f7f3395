//! Devices of other profiles than CiA 404, with and without an EDS: the signals that `read`, `log`, `check`, `pdo` and
//! `info` show.

use super::Bench;
use std::fs;

/// An object: address, type, access, default.
type Object<'a> = (&'a str, &'a str, &'a str, &'a str);

/// A simulated device of this type, with these objects, and one TPDO of these mapping entries sent at every SYNC.
fn device(device_type: &str, objects: &[Object<'_>], mapping: &[&str]) -> String {
    let mut text = "name = \"own\"\ntitle = \"Own\"\nvendor = \"Maker\"\n".to_owned();
    let mut add = |(at, data_type, access, default): Object<'_>| {
        let pdo = !at.starts_with("0x1");
        let name = format!("o-{}", at.replace(':', "-")).to_lowercase();
        text += &format!(
            "[[object]]\nat = \"{at}\"\nname = \"{name}\"\ntype = \"{data_type}\"\naccess = \"{access}\"\npdo = {pdo}\n\
             default = {default}\n"
        );
    };
    add(("0x1000", "u32", "ro", device_type));
    add(("0x1800:1", "u32", "rw", "\"$NODEID+0x40000180\""));
    add(("0x1800:2", "u8", "rw", "1"));
    add(("0x1A00:0", "u8", "rw", &mapping.len().to_string()));
    for (sub, word) in (1..).zip(mapping) {
        add((&format!("0x1A00:{sub}"), "u32", "rw", word));
    }
    objects.iter().copied().for_each(&mut add);
    text
}

fn bench(text: &str) -> Bench {
    let bench = Bench::described("[[device]]\nkind = \"own.toml\"\nnode = 5\n");
    fs::write(bench.path("own.toml"), text).expect("written");
    bench
}

fn check(bench: &Bench, nodes: &str, expression: &str) -> super::Done {
    let mut words: Vec<&str> = nodes.split(' ').collect();
    let node = words.pop().expect("a node");
    words.extend(["check", node, expression]);
    bench.run_words(&words)
}

/// The lines of `read` with one blank between the words, and without the remark about the missing status.
fn values(done: super::Done) -> Vec<String> {
    let done = done.exit(0);
    let words = |line: &str| line.replace("(no status)", "").split_whitespace().collect::<Vec<_>>().join(" ");
    done.stdout.lines().map(words).collect()
}

/// The columns signal, value, unit and status of the first rows.
fn rows(csv: &str, count: usize) -> Vec<String> {
    let cells = |line: &str| line.split(',').skip(3).take(4).collect::<Vec<_>>().join(",");
    csv.lines().skip(1).take(count).map(cells).collect()
}

/// An inclinometer with a resolution of 0.01 deg.
fn inclinometer() -> String {
    let objects = [("0x6000", "u16", "rw", "10"), ("0x6010", "i16", "ro", "-1234"), ("0x6020", "i16", "ro", "500")];
    device("0x0002019A", &objects, &["0x60100010", "0x60200010"])
}

#[test]
fn inclinometers_show_degrees() {
    let bench = bench(&inclinometer());
    assert_eq!(values(bench.run("read 5")), ["5 slope-long16 -12.34 deg", "5 slope-lateral16 5.00 deg"]);
    bench.run("read 5 slope-long16").prints("-12.34\n");
    bench.run("read 5 0x6010").prints("-1234\n");
    let info = bench.run("info 5 --format json").exit(0).json();
    assert!(info[0]["signals"][0]["range"].is_null(), "{info:?}");
    // A signal of a description has the step of the profile too, unless the description states another one.
    let new = bench.run("devices new 5").exit(0).stdout;
    std::fs::write(bench.path("new.toml"), &new).expect("written");
    assert_eq!(
        values(bench.run("--device new.toml read 5")),
        ["5 slope-long16 -12.34 deg", "5 slope-lateral16 5.00 deg"]
    );
    let own = new.replacen("value = \"0x6010:0\"", "value = \"0x6010:0\"\nunit = \"deg\"\nfactor = 0.1", 1);
    std::fs::write(bench.path("factor.toml"), own).expect("written");
    bench.run("--device factor.toml read 5 slope-long16").prints("-123.4\n");
    let log = bench.run("log 5 --sync 100ms --count 2").exit(0);
    assert_eq!(rows(&log.stdout, 2), ["slope-long16,-12.34,deg,", "slope-lateral16,5.00,deg,"]);
    let wide = bench.run("log 5 slope-lateral16 --sync 100ms --count 1 --layout wide").exit(0);
    assert!(wide.stdout.starts_with("time,elapsed_s,5.slope-lateral16 [deg],"), "{}", wide.stdout);
    check(&bench, "5", "slope-long16 in -12.4..-12.3 deg").exit(0);
    check(&bench, "5", "slope-long16 > 0 deg").exit(1);
    let shown = bench.run("pdo show 5").exit(0);
    assert!(shown.stdout.contains("0x6010:0/16 slope-long16 [deg]"), "{}", shown.stdout);
    bench.run("pdo map 5 1 Slope-Lateral16").exit(0);
    let page = bench.run("info 5").exit(0);
    assert!(page.stdout.contains("slope-long16") && page.stdout.contains("resolution"), "{}", page.stdout);
    bench.run("unit 5").exit(4);
}

#[test]
fn other_resolutions_and_none() {
    let with =
        |resolution: &str| bench(&inclinometer().replace("default = 10\n", &format!("default = {resolution}\n")));
    with("1").run("read 5 slope-long16").prints("-1.234\n");
    with("100").run("read 5 slope-long16").prints("-123.4\n");
    with("1000").run("read 5 slope-long16").prints("-1234\n");
    let none = with("0").run("read 5 slope-long16 --format json").exit(0).json();
    assert_eq!(
        (none[0]["value"].as_i64(), none[0]["unit"].as_str()),
        (Some(-1234), None),
        "no unit without a resolution"
    );
}

#[test]
fn encoders_show_position_and_speed() {
    let rotary = [("0x6004", "u32", "ro", "4096"), ("0x6030:0", "u8", "ro", "1"), ("0x6030:1", "i16", "ro", "-7")];
    let mapping = ["0x60040020", "0x60300110"];
    let bench = bench(&device("0x00020196", &rotary, &mapping));
    assert_eq!(values(bench.run("read 5")), ["5 position-value 4096", "5 speed-value:1 -7"]);
    check(&bench, "5", "speed-value:1 < 0").exit(0);
    let steps = [("0x6005:0", "u8", "ro", "2"), ("0x6005:1", "u32", "rw", "5000"), ("0x6005:2", "u32", "rw", "10")];
    let bench = self::bench(&device("0x00080196", &[&rotary[..], &steps[..]].concat(), &mapping));
    assert_eq!(values(bench.run("read 5")), ["5 position-value 20.480 mm", "5 speed-value:1 -0.7 mm/s"]);
    let page = bench.run("info 5").exit(0);
    assert!(page.stdout.contains("20.480 mm") && !page.stdout.contains("range"), "{}", page.stdout);
    let log = bench.run("log 5 --sync 100ms --count 2").exit(0);
    assert_eq!(rows(&log.stdout, 2), ["position-value,20.480,mm,", "speed-value:1,-0.7,mm/s,"]);
}

#[test]
fn inputs_and_outputs_are_shown_as_they_are() {
    let objects = [
        ("0x6000:0", "u8", "ro", "2"),
        ("0x6000:1", "u8", "ro", "165"),
        ("0x6000:2", "u8", "ro", "1"),
        ("0x6401:0", "u8", "ro", "1"),
        ("0x6401:1", "i16", "ro", "32767"),
    ];
    let bench = bench(&device("0x000D0191", &objects, &["0x60000108", "0x64010110"]));
    let expected = ["5 digital-input-8:1 165", "5 digital-input-8:2 1", "5 analogue-input-16:1 32767"];
    assert_eq!(values(bench.run("read 5")), expected);
    // It may move something, so it is started only on request.
    let silent = bench.run("log 5 --sync 100ms --duration 1s").exit(3);
    assert_eq!(silent.frames_of("000"), [""; 0]);
    let log = bench.run("log 5 --start --sync 100ms --count 2").exit(0);
    assert_eq!(log.frames_of("000"), ["0105"]);
    assert_eq!(rows(&log.stdout, 2), ["digital-input-8:1,165,,", "analogue-input-16:1,32767,,"]);
}

#[test]
fn drives_and_devices_without_a_profile_show_their_tpdos() {
    let drive = [("0x6041", "u16", "ro", "567"), ("0x6064", "i32", "ro", "-100000")];
    let bench = bench(&device("0x00020192", &drive, &["0x60410010", "0x60640020"]));
    assert_eq!(values(bench.run("read 5")), ["5 statusword 567", "5 position-actual-value -100000"]);
    let other = [("0x2100:1", "r32", "ro", "21.5"), ("0x2100:2", "u16", "ro", "3")];
    let bench = self::bench(&device("0", &other, &["0x21000120", "0x21000210"]));
    let none = bench.run("read 5 --format json").exit(0).json();
    assert_eq!((none[0]["signal"].as_str(), none[0]["value"].is_null()), (Some("0x2100:1"), true), "{none:?}");
    let eds = "[ManufacturerObjects]\nSupportedObjects=1\n1=0x2100\n[2100]\nParameterName=Measurement\nObjectType=9\n\
               SubNumber=3\n[2100sub0]\nParameterName=Entries\nDataType=5\nAccessType=ro\n[2100sub1]\n\
               ParameterName=Temperature\nDataType=8\nAccessType=ro\nPDOMapping=1\n[2100sub2]\n\
               ParameterName=4-20 mA Count\nDataType=6\nAccessType=ro\nPDOMapping=1\n";
    fs::write(bench.path("x.eds"), eds).expect("written");
    let run = |line: &str| bench.run(&format!("--eds x.eds {line}"));
    assert_eq!(values(run("read 5")), ["5 temperature 21.5", "5 4-20-ma-count 3"]);
    run("read 5 Temperature").prints("21.5\n");
    run("read 5 4-20-ma-count").prints("3\n");
    let log = run("log 5 --sync 100ms --count 2").exit(0);
    assert_eq!(rows(&log.stdout, 2), ["temperature,21.5,,", "4-20-ma-count,3,,"]);
    let log = run("log 5 temperature --sync 100ms --count 1 --layout wide").exit(0);
    assert!(log.stdout.starts_with("time,elapsed_s,5.temperature,"), "{}", log.stdout);
    run("pdo map 5 1 4-20-ma-count temperature").exit(0);
    let shown = run("pdo show 5 --format json").exit(0).json();
    assert_eq!(shown[0]["mapping"][1]["signal"], "4-20-ma-count", "the simulated bus starts fresh");
    for (expression, code) in [
        ("temperature < 60", 0),
        ("temperature > 60", 1),
        ("\"4-20-ma-count\" == 3", 0),
        ("'4-20 mA Count' == 3", 0),
        ("5.\"Temperature\" < 60", 0),
        ("tempratur < 60", 2),
    ] {
        let done = check(&bench, "--eds x.eds 5", expression).exit(code);
        assert!(code < 2 || done.stderr.contains("temperature"), "{}", done.stderr);
    }
    let unknown = run("log 5 tempratur --sync 100ms --count 1").exit(2);
    assert!(unknown.stderr.contains("temperature"), "{}", unknown.stderr);
    let unknown = run("read 5 tempratur").exit(2);
    assert!(unknown.stderr.contains("temperature"), "{}", unknown.stderr);
}

#[test]
fn described_signals_have_their_own_scale_and_status() {
    let mut text = device("0", &[("0x2000:1", "i16", "ro", "1250"), ("0x2001", "u16", "ro", "0x100")], &["0x20000110"]);
    text += "[[signal]]\nname = \"flow\"\nvalue = \"0x2000:1\"\nunit = \"l/h\"\nfactor = 0.01\nstatus = \"0x2001\"\n\
             status_bits = { invalid = 0x80, high = 0x100 }\n";
    let bench = bench(&text);
    bench.run("devices check own.toml").exit(0);
    assert_eq!(values(bench.run("--device own.toml read 5")), ["5 flow 12.50 l/h overload-high"]);
    let log = bench.run("--device own.toml log 5 --sync 100ms --count 1").exit(0);
    assert_eq!(rows(&log.stdout, 1), ["flow,12.50,l/h,"]);
    check(&bench, "--device own.toml 5", "flow < 20 l/h").exit(1);
    check(&bench, "--device own.toml 5", "flow > 20 l/h").exit(1);
    bench.run("--device own.toml unit 5 flow bar").exit(4);
}

/// The mapping of the other TPDO is not shifted.
#[test]
fn a_missing_mapping_entry_affects_its_tpdo_only() {
    let objects = [
        ("0x7130:1", "i16", "ro", "111"),
        ("0x7130:2", "i16", "ro", "222"),
        ("0x6132:1", "u8", "ro", "0"),
        ("0x6132:2", "u8", "ro", "0"),
        ("0x1A00:3", "u32", "rw", "0x71300110"),
        ("0x1801:1", "u32", "rw", "\"$NODEID+0x40000280\""),
        ("0x1801:2", "u8", "rw", "1"),
        ("0x1A01:0", "u8", "rw", "1"),
        ("0x1A01:1", "u32", "rw", "0x71300210"),
    ];
    let text = device("0x00020194", &objects, &["0x71300110"]);
    let three = text.replacen(
        "access = \"rw\"\npdo = false\ndefault = 1\n[[object]]\nat = \"0x1A00:1\"",
        "access = \"rw\"\npdo = false\ndefault = 3\n[[object]]\nat = \"0x1A00:1\"",
        1,
    );
    assert_ne!(three, text);
    let log = bench(&three).run("log 5 --sync 100ms --count 2").exit(0);
    assert_eq!(rows(&log.stdout, 2), ["ch2,222,,", "ch2,222,,"]);
}

/// A wrong power of ten must not pass a check.
#[test]
fn integer_with_unknown_or_impossible_digits_passes_no_check() {
    for (value, data_type, entry) in
        [("0x7130:1", "i16", "0x71300110"), ("0x8130:1", "i24", "0x81300118"), ("0x9130:1", "i32", "0x91300120")]
    {
        for (digits, code) in [(Some("2"), 0), (None, 1), (Some("10"), 1), (Some("255"), 1)] {
            let mut channel = vec![(value, data_type, "ro", "777"), ("0x6131:1", "u32", "ro", "0x004E0000")];
            channel.extend(digits.map(|digits| ("0x6132:1", "u8", "ro", digits)));
            let bench = bench(&device("0x00020194", &channel, &[entry]));
            for more in [&[][..], &["--for", "1s", "--sync", "100ms"]] {
                let words = [&["check", "5", "ch1 < 1000"][..], more].concat();
                let done = bench.run_words(&words).exit(code);
                assert_eq!(done.stdout.starts_with("ok "), code == 0, "{digits:?} {words:?}: {}", done.stdout);
            }
        }
    }
}

/// A process value and a net value are the same by address as by name: unit, digits, status, range.
#[test]
fn values_by_address_are_read_as_the_signal() {
    let unit_and_digits = [("0x6131:1", "u32", "ro", "0x004E0000"), ("0x6132:1", "u8", "ro", "3")];
    let range = [("0x6148:1", "r32", "ro", "0"), ("0x6149:1", "r32", "ro", "100")];
    let bench_of = |objects: &[(&str, &str, &str, &str)], mapping: &[&str]| {
        let all: Vec<_> = objects.iter().chain(&unit_and_digits).chain(&range).copied().collect();
        bench(&device("0x00020194", &all, mapping))
    };
    let scaled = bench_of(&[("0x9130:1", "i32", "ro", "1307")], &["0x91300120"]);
    assert_eq!(values(scaled.run("read 5 0x9130:1 ch1")), ["5 0x9130:1 1.307 bar", "5 ch1 1.307 bar"]);
    check(&scaled, "5", "0x9130:1 > 40").exit(1);
    check(&scaled, "5", "0x9130:1 < 2 bar").exit(0);
    let log = scaled.run("log 5 0x9130:1 --poll 100ms --count 1").exit(0);
    assert_eq!(rows(&log.stdout, 1), ["0x9130:1,1.307,bar,"]);
    // The number as sent: with its type.
    scaled.run("read 5 0x9130:1/i32").prints("1307\n");
    // An integer instead of the REAL32 of CiA 404.
    let integer = bench_of(&[("0x6130:1", "i32", "ro", "12345")], &["0x61300120"]);
    check(&integer, "5", "0x6130:1 < 1").exit(1);
    // The status object reports that the value is not valid.
    let invalid = bench_of(
        &[("0x6130:1", "r32", "ro", "7.5"), ("0x6140:1", "r32", "ro", "7.5"), ("0x6150:1", "u8", "ro", "1")],
        &["0x61300120", "0x61500108"],
    );
    for signal in ["0x6130:1", "0x6140:1", "ch1.net"] {
        check(&invalid, "5", &format!("{signal} < 100")).exit(1);
    }
    // An integer that is the limit of its type.
    let clipped = bench_of(&[("0x7130:1", "i16", "ro", "32767"), ("0x7140:1", "i16", "ro", "32767")], &["0x71300110"]);
    for signal in ["0x7130:1", "0x7140:1", "ch1.net"] {
        check(&clipped, "5", &format!("{signal} < 90 bar")).exit(1);
    }
}

/// A device with integers only may have its range in another integer family than the value.
#[test]
fn range_in_an_integer_family_shows_a_clipped_value() {
    for (low, high, data_type, end, row) in [
        ("0x9148:1", "0x9149:1", "i32", "10000000", "ch1,,bar,clipped"),
        ("0x9148:1", "0x9149:1", "i32", "8000000", "ch1,83.88607,bar,"),
        ("0x8148:1", "0x8149:1", "i24", "8000000", "ch1,83.88607,bar,"),
    ] {
        let objects = [
            ("0x8130:1", "i24", "ro", "8388607"),
            ("0x6131:1", "u32", "ro", "0x004E0000"),
            ("0x6132:1", "u8", "ro", "5"),
            (low, data_type, "ro", "0"),
            (high, data_type, "ro", end),
        ];
        let log = bench(&device("0x00020194", &objects, &["0x81300118"])).run("log 5 --sync 100ms --count 1").exit(0);
        assert_eq!(rows(&log.stdout, 1), [row]);
    }
}
