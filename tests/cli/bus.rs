//! `cangauge bus`, without an interface: what is typed, and `detect` on the simulated bus.

use super::Bench;

#[test]
fn what_is_typed_wrong_is_said_first() {
    let bench = Bench::of("mh4@1");
    let first = |line: &str| {
        let done = bench.run(line).exit(2);
        done.stderr.lines().next().unwrap_or("").to_owned()
    };
    for rate in ["0", "2M", "250", "-1", "fast", "auto", "83.3k"] {
        let wrong = format!("cangauge: \"{rate}\" is not a bit rate of CAN (250k, 1M, 125000)");
        assert_eq!(first(&format!("bus up can0 -- {rate}")), wrong);
    }
    assert_eq!(first("bus up sim 250k"), "cangauge: \"sim\" is no interface of this machine (can0)");
    assert_eq!(first("bus down a/b"), "cangauge: \"a/b\" is not a name of an interface");
    assert_eq!(first("bus up"), "cangauge: the following required arguments were not provided: <INTERFACE>");
    assert!(first("bus up can0 --listen-only").contains("required arguments were not provided: <RATE>"));
    assert_eq!(first("bus detect can0 --for 0s"), "cangauge: \"0s\" for --for <DUR>: a duration must be longer than 0");
    bench
        .finish(&mut bench.command(&["bus", "detect"]))
        .fails(2, "cangauge: which bus?\nhint: see what is there: cangauge bus list\n");
}

#[test]
#[cfg(target_os = "linux")]
fn an_interface_that_is_not_there() {
    let bench = Bench::of("mh4@1");
    let refused = "cangauge: there is no CAN interface \"nosuchcan\"\n\
                   hint: see what is there: cangauge bus list; without hardware: --bus sim\n";
    bench.run("bus up nosuchcan 250k").fails(5, refused);
    bench.run("bus down nosuchcan").fails(5, refused);
    let error = bench.run("bus up nosuchcan -f json").exit(5).error();
    assert_eq!(error["error"]["kind"], "bus");
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_no_can_interface() {
    let bench = Bench::of("mh4@1");
    let done = bench.run("bus up lo").exit(5);
    assert!(done.stderr.starts_with("cangauge: lo is not a CAN interface\n"), "{}", done.stderr);
}
