//! `cangauge monitor`.

use super::{ALL, Bench, Done, closed_pipe};
use serde_json::{Value, json};
use std::fs;
use std::process::Stdio;

/// Runs monitor on the trace of the last command.
fn monitor(bench: &Bench, options: &str) -> Done {
    let words = ["--bus", "replay:trace.log", "monitor"].into_iter().chain(options.split_whitespace());
    bench.finish(&mut bench.command(&words.collect::<Vec<_>>()))
}

/// Keeps the trace of the last command as a recording.
fn keep(bench: &Bench) {
    fs::rename(bench.path("trace"), bench.path("trace.log")).expect("the trace");
}

/// Writes a recording with one frame per millisecond.
fn record(bench: &Bench, frames: &[&str]) {
    let lines = frames.iter().zip(0..).map(|(frame, at)| format!("(1767225600.{:06}) can0 {frame}\n", at * 1000));
    fs::write(bench.path("trace.log"), lines.collect::<String>()).expect("written");
}

/// The text of each line, without the time.
fn lines(done: &Done) -> Vec<&str> {
    done.stdout.lines().map(|line| line.split_once("  ").expect("a time").1.trim_end()).collect()
}

#[test]
fn values_match_the_reports_of_other_commands() {
    let bench = Bench::of(ALL);
    for (command, node) in [
        ("sdo read 1 0x1000 0x1008 0x1017 0x1018:4 0x1a00:1 0x6131:1 0x6132:1 0x6150:1 0x2010:1", 1),
        ("sdo read 127 0x1000 0x1008 0x1018:4 0x6130:1 0x6131:1 0x1800:1", 127),
        ("sdo read 2 0x1000 0x1008 0x6132:1 0x6130:1", 2),
        ("sdo read 3 0x1000 0x1018:2 0x7130:1 0x1a00:1 0x6110:1", 3),
    ] {
        let reported = bench.run(&format!("{command} --format json")).exit(0).json();
        keep(&bench);
        let seen = monitor(&bench, &format!("{node} --kind sdo --format json")).exit(0).json();
        for read in &reported {
            let fields = ["node", "object", "name", "type", "value", "raw"];
            let same = |row: &&Value| row["event"] == "read" && fields.iter().all(|&field| row[field] == read[field]);
            assert!(seen.iter().any(|row| same(&row)), "{command}: {read}\n{seen:#?}");
        }
    }
}

#[test]
fn every_frame_of_every_command_is_decoded() {
    let bench = Bench::of(ALL);
    for command in [
        "scan",
        "info 1",
        "info 127",
        "read all",
        "log 1-3,127 --sync 20ms --count 60",
        "log 127 --poll 100ms --count 5",
        "nmt start 1",
        "nmt reset 127",
        "nmt state 1-3 --probe",
        "pdo show 3",
        "pdo map 1 1 pressure --transmission timer --event-timer 50ms",
        "unit 127 bar",
        "store 1",
        "restore 1 --reset",
        "config dump 1",
        "lss set-id 127 12",
        "lss scan",
        "lss identify 0x47:0x1:0x0-0xffff:1-99999",
        "sdo write 1 0x1017 500",
        "sdo write 1 0x1017 100 --block always",
        "sdo read 1 0x1fff",
        "autozero 1 --limit 20bar --dry-run",
        "errors 1",
        "check 1 pressure<100bar",
    ] {
        bench.run(command);
        keep(&bench);
        let frames = bench.text("trace.log").lines().count();
        let done = monitor(&bench, "--all --format json").exit(0);
        let rows = done.json();
        let is_raw = |row: &&Value| row["kind"] == "other" || row["event"] == "frame";
        assert_eq!(rows.iter().find(is_raw), None, "{command}");
        let total = done.stderr.lines().find_map(|line| line.split_once(" frames in ")).expect(&done.stderr).0;
        assert_eq!(total.replace(',', ""), frames.to_string(), "{command}");
        assert_eq!(monitor(&bench, "").exit(0).frames, [""; 0], "monitor sends");
    }
}

#[test]
fn words_for_every_service() {
    let bench = Bench::of("mh4@5");
    record(
        &bench,
        &[
            "000#0105",
            "000#8100",
            "705#00",
            "705#05",
            "705#05",
            "080#",
            "080#07",
            "100#60E316003C00",
            "100#60E316003C",
            "605#4017100000000000",
            "585#4B17100064000000",
            "605#2B171000F4010000",
            "585#8017100030000906",
            "605#2301180181000080",
            "585#6001180100000000",
            "085#01F0810103000000",
            "085#0000000000000000",
            "185#0000A03F00",
            "285#R5",
            "305#0102",
            "7E5#0401000000000000",
            "7E5#1105000000000000",
            "7E4#1101000000000000",
            "7E5#51470000001F0001",
            "7E4#4F00000000000000",
            "123#1122",
            "12345678#R2",
            "585#0102",
            "605#4000100000000000",
        ],
    );
    let done = monitor(&bench, "--device 5=mh4").exit(0);
    assert_eq!(
        lines(&done),
        [
            "node 5     nmt        start",
            "all nodes  nmt        reset node",
            "node 5     boot-up",
            "node 5     heartbeat  operational",
            "-          sync",
            "-          sync       counter 7",
            "-          time       1984-03-01T00:25:00.000Z",
            "-          other      0x100  60 E3 16 00 3C",
            "node 5     read       producer-heartbeat-time -> 100 ms",
            "node 5     write      producer-heartbeat-time: rejected: 0x06090030, value outside its range",
            "node 5     write      tpdo2-cob-id <- 0x80000081",
            "node 5     emcy       F001h user input overload: pressure outside the range by more than 3.125 %; \
             check the system: the accuracy is no longer guaranteed, also after the overload, generic, manufacturer \
             (01 03 00 00 00)",
            "node 5     emcy       0000h emergency over",
            "node 5     TPDO1      pressure 1.25 bar ok",
            "node 5     pdo        0x285  remote request",
            "node 5     RPDO2      0x305  01 02  (unknown mapping)",
            "-          lss        switch state global: configuration",
            "-          lss        configure node-ID: 5",
            "-          lss        configure node-ID: error 1, node-ID out of range",
            "-          lss        fastscan: vendor-ID 0x00000047, bit 31, then the product code",
            "-          lss        fastscan: a slave answers",
            "-          other      0x123  11 22",
            "-          other      0x12345678  remote request for 2 bytes",
            "node 5     sdo        0x585  01 02",
            "node 5     read       device-type: no answer",
        ]
    );
    assert!(done.stderr.contains("1 repetition not shown (--all)"), "{}", done.stderr);
}

#[test]
fn nodes_kinds_count_and_formats() {
    let bench = Bench::of(ALL);
    bench.run("log 1,127 --sync 20ms --count 60").exit(0);
    keep(&bench);
    let all = monitor(&bench, "--format json").exit(0).json();
    let nodes = |rows: &[Value]| rows.iter().all(|row| row["node"] == 1 || row["node"].is_null());
    let one = monitor(&bench, "1 --format json").exit(0).json();
    assert!(!nodes(&all) && nodes(&one) && one.iter().any(|row| row["kind"] == "sync"));
    let pdos = monitor(&bench, "127 --kind pdo,emcy --format json").exit(0).json();
    assert!(!pdos.is_empty() && pdos.iter().all(|row| row["kind"] == "pdo" && row["node"] == 127));
    assert_eq!(pdos[0]["values"][0]["unit"], json!("psi"));
    assert_eq!(monitor(&bench, "-n 3").exit(0).stdout.lines().count(), 3);
    let csv = monitor(&bench, "--kind sync --format csv").exit(0).stdout;
    assert!(csv.starts_with("time,node,kind,event,object,name,type,value,unit,abort,cob_id,raw,text\n"), "{csv}");
    assert!(csv.lines().nth(1).is_some_and(|line| line.contains(",,sync,sync,")), "{csv}");
    assert!(monitor(&bench, "--for 1ms").exit(0).stdout.lines().count() < all.len());
}

#[test]
fn second_master_on_an_sdo_channel_is_shown() {
    let bench = Bench::of("mh4@5");
    record(&bench, &["605#4017100000000000", "605#4018100100000000", "585#4B17100064000000", "585#4318100147000000"]);
    let done = monitor(&bench, "").exit(0);
    let line = "node 5     sdo        two masters use the SDO channel at the same time";
    assert_eq!(lines(&done).iter().filter(|text| **text == line).count(), 1, "{}", done.stdout);
    assert!(done.stdout.contains("vendor-id -> 71") && done.stdout.contains("-> 100 ms"), "{}", done.stdout);
}

#[test]
fn wrong_use_is_explained() {
    let bench = Bench::of("mh4@5");
    fs::write(bench.path("trace.log"), "").expect("written");
    monitor(&bench, "").fails(8, "cangauge: replay trace.log: the file is empty\n");
    fs::remove_file(bench.path("trace.log")).expect("removed");
    assert!(monitor(&bench, "").exit(8).stderr.contains("replay trace.log"));
    assert!(bench.run("monitor --kind tpdo").exit(2).stderr.contains("possible values: nmt, heartbeat"));
    assert!(bench.run("monitor 200").exit(2).stderr.contains("not a valid node-ID"));
    assert!(bench.run("monitor -n 0").exit(2).stderr.contains("--count"));
    bench.run("scan").exit(0);
    keep(&bench);
    let mut command = bench.command(&["--bus", "replay:trace.log", "monitor"]);
    let done = command.stdout(closed_pipe()).stderr(Stdio::piped()).output().expect("it starts");
    assert_eq!((done.status.code(), done.stderr.len()), (Some(0), 0), "{done:?}");
}
