//! `cangauge bus` without an interface: its arguments, and `detect` on the simulated bus.

use super::Bench;

#[test]
fn wrong_arguments_are_reported_first() {
    let bench = Bench::of("mh4@1");
    let first = |line: &str| {
        let done = bench.run(line).exit(2);
        done.stderr.lines().next().unwrap_or("").to_owned()
    };
    for rate in ["0", "2M", "250", "-1", "fast", "auto", "83.3k"] {
        let wrong = format!("cangauge: \"{rate}\" is not a CAN bit rate (250k, 1M, 125000)");
        assert_eq!(first(&format!("bus up can0 -- {rate}")), wrong);
    }
    assert_eq!(first("bus up sim 250k"), "cangauge: \"sim\" is not a CAN interface of this computer (can0)");
    assert_eq!(first("bus down a/b"), "cangauge: \"a/b\" is not the name of an interface");
    assert_eq!(first("bus up"), "cangauge: the following required arguments were not provided: <INTERFACE>");
    assert!(first("bus up can0 --listen-only").contains("required arguments were not provided: <RATE>"));
    assert_eq!(first("bus detect can0 --for 0s"), "cangauge: \"0s\" for --for <DUR>: a duration must be longer than 0");
    bench
        .finish(&mut bench.command(&["bus", "detect"]))
        .fails(2, "cangauge: no bus was given\nhint: list the interfaces: cangauge bus list\n");
}

#[test]
#[cfg(target_os = "linux")]
fn absent_interface_is_exit_5() {
    let bench = Bench::of("mh4@1");
    let refused = "cangauge: there is no CAN interface \"nosuchcan\"\n\
                   hint: list the interfaces: cangauge bus list; without hardware: --bus sim\n";
    bench.run("bus up nosuchcan 250k").fails(5, refused);
    bench.run("bus down nosuchcan").fails(5, refused);
    let error = bench.run("bus up nosuchcan -f json").exit(5).error();
    assert_eq!(error["error"]["kind"], "bus");
}

#[test]
#[cfg(target_os = "linux")]
fn loopback_is_not_a_can_interface() {
    let bench = Bench::of("mh4@1");
    let done = bench.run("bus up lo").exit(5);
    assert!(done.stderr.starts_with("cangauge: lo is not a CAN interface\n"), "{}", done.stderr);
}

/// Two devices with a heartbeat at 125 kbit/s. The program starts at 250 kbit/s.
const OTHER_RATE: &str = "[[device]]\nkind = \"mh4\"\nnode = 5\nbit_rate = 125000\nset = { \"0x1017\" = 1000 }\n\
                          [[device]]\nkind = \"dps\"\nnode = 6\nbit_rate = 125000\n";

#[test]
fn listening_finds_the_bit_rate() {
    let bench = Bench::described(OTHER_RATE);
    let done = bench.run("bus detect").prints("125000\n");
    let lines: Vec<&str> = done.stderr.lines().collect();
    assert!(lines[0].starts_with("250000 bit/s: 0 valid frames, "), "{}", done.stderr);
    assert!(lines[1].starts_with("125000 bit/s: ") && lines[1].contains(" valid frame"), "{}", done.stderr);
    assert!(done.frames.iter().all(|frame| frame.starts_with("705#")), "it sends nothing: {:?}", done.frames);
    let done = bench.run("bus detect sim:bench.toml -f csv -q");
    assert_eq!(done.exit(0).stdout, "interface,bit_rate,by\nsim,125000,frames\n");
    let found = &bench.run("bus detect -f json -q").exit(0).json()[0];
    assert_eq!(
        (&found["interface"], &found["bit_rate"], &found["by"]),
        (&"sim".into(), &125_000.into(), &"frames".into())
    );
    assert_eq!(found["tried"][0]["bit_rate"], 250_000);
    assert_eq!(found["tried"][0]["acknowledged"], serde_json::Value::Null);
}

#[test]
fn single_sensor_is_asked_only_with_active() {
    let bench = Bench::described("[[device]]\nkind = \"dps\"\nnode = 6\nbit_rate = 100000\n");
    let done = bench.run("bus detect -q").exit(3);
    assert_eq!(done.stdout, "");
    let first = done.stderr.lines().next();
    assert!(first.is_some_and(|line| line.starts_with("cangauge: sim: ")), "{}", done.stderr);
    assert!(done.stderr.contains("only with a single device: cangauge bus detect sim --active"), "{}", done.stderr);
    let done = bench.run("bus detect --active").prints("100000\n");
    assert!(done.stderr.contains("no valid frame; now sending requests"), "{}", done.stderr);
    assert!(done.frames.contains(&"606#4000100000000000".to_owned()));
}
