//! `cangauge doctor`. The findings themselves: `tests/scenarios/doctor.rs`.

use super::Bench;
use serde_json::json;

const SENDING: &str = "[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\n\
                       set = { \"0x1800:2\" = 254, \"0x1800:5\" = 100, \"0x1801:5\" = 100 }\n";

#[test]
fn finding_is_followed_by_the_command_to_type() {
    let bench = Bench::of("mh4@5");
    let done = bench.run("doctor 5").exit(1);
    assert_eq!(
        done.stdout,
        "node 5: TPDO1 waits for SYNC, and no node sends SYNC\n  cangauge log 5 --sync 100ms, or read by SDO: --poll 100ms (node 5)\n"
    );
    assert_eq!(done.stderr, "cangauge: 1 finding\n");
    let found = bench.run("doctor 9 --format json").exit(1).json();
    assert_eq!((&found[0]["node"], &found[0]["finding"]), (&json!(9), &json!("absent")));
}

#[test]
fn bus_without_faults_is_success() {
    let done = Bench::described(SENDING).run("doctor 5").exit(0);
    assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", "1 node: no problem found\n"));
}

#[test]
fn missing_bus_is_a_finding() {
    let bench = Bench::of("mh4@5");
    let done = bench.command(&["-b", "can47", "doctor"]).output().expect("it starts");
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(done.status.code() == Some(1) && text.contains("CAN") || text.contains("can47"), "{done:?}");
    bench.run("doctor 5,6").exit(2);
}

/// On a bus on which no node answers, and for an absent node.
#[test]
fn no_hint_leads_to_another_exit_3() {
    let commands = [
        "read 9",
        "sdo read 9 0x1000",
        "sdo write 9 0x1017 100",
        "nmt state 9",
        "nmt start 9 --confirm",
        "nmt reset 9",
        "store 9",
        "lss set-id 9 12",
        "lss scan",
        "scan --passive",
        "log 9 pressure --device mh4 --count 1",
    ];
    for bench in ["dps@unconfigured", "mh4@5"].map(Bench::of) {
        for command in commands {
            let done = bench.run(command);
            let Some(3) = done.code else { continue };
            let hint = done.stderr.lines().find_map(|line| line.strip_prefix("hint: ")).unwrap_or_default();
            let next: Vec<&str> = hint.split("cangauge ").skip(1).collect();
            for next in next.iter().map(|text| text.split([';', ',', '(']).next().unwrap_or_default().trim()) {
                assert_ne!(bench.run(next).code, Some(3), "{command}: {next}");
            }
            assert!(!hint.is_empty(), "{command}: {}", done.stderr);
        }
    }
}
