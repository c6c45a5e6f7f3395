//! A recording played again.

use super::{Bench, Done};
use std::fs;

/// Runs a command on a recording: `replay(&bench, "t.log", "log 1")`.
fn replay(bench: &Bench, file: &str, line: &str) -> Done {
    let bus = format!("replay:{file}");
    let words: Vec<&str> = ["--bus", &bus].into_iter().chain(line.split_whitespace()).collect();
    bench.finish(&mut bench.command(&words))
}

/// Keeps what the last command sent and received.
fn keep(bench: &Bench) {
    fs::rename(bench.path("trace"), bench.path("t.log")).expect("the trace");
}

#[test]
fn gives_the_rows_of_the_live_log() {
    let bench = Bench::of("mh4@1,d20@2,mc1609@3,dps@127");
    let live = bench.run("log 1-3,127 --sync 20ms --count 200").exit(0).stdout;
    keep(&bench);
    assert_eq!(live.lines().count(), 201);
    let replayed = replay(&bench, "t.log", "log 1-3,127 --count 200").exit(0).stdout;
    assert_eq!(replayed, live);
    // The end of the recording is the end of the log.
    let all = replay(&bench, "t.log", "log all").exit(0);
    assert_eq!(all.stdout, live);
    assert!(all.stderr.contains("200 rows in"), "{}", all.stderr);
    assert!(all.stderr.contains("recorded timestamps"), "{}", all.stderr);
}

#[test]
fn a_recording_without_its_beginning_needs_a_description() {
    let bench = Bench::of("mh4@1");
    bench.run("log 1 --sync 20ms --count 20").exit(0);
    keep(&bench);
    let text = bench.text("t.log");
    let tail: Vec<&str> = text.lines().filter(|line| line.contains(" 181#")).collect();
    fs::write(bench.path("tail.log"), tail.join("\n") + "\n").expect("written");
    replay(&bench, "tail.log", "log 1").exit(2);
    let done = replay(&bench, "tail.log", "log 1 --device mh4").exit(0);
    assert_eq!(done.stdout.lines().count(), 21, "{}", done.stdout);
}

/// A recording of node 5, which another program asks for these objects; `None` is one that it does not have. Then it
/// sends two INTEGER32 in TPDO1, 1234 and -5678.
fn asked(objects: &[(u16, u8, Option<u32>)]) -> String {
    let mut lines = String::new();
    for (at, (index, sub, value)) in objects.iter().enumerate() {
        let [low, high] = index.to_le_bytes();
        let (command, word) = value.map_or((0x80, 0x0602_0000), |value| (0x43, value));
        let word: String = word.to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
        lines += &format!("(1700000000.{at:03}000) can0 605#40{low:02X}{high:02X}{sub:02X}00000000\n");
        lines += &format!("(1700000000.{at:03}500) can0 585#{command:02X}{low:02X}{high:02X}{sub:02X}{word}\n");
    }
    lines + "(1700000001.000000) can0 185#D2040000D2E9FFFF\n"
}

#[test]
fn each_channel_is_learned_with_its_own_digits_and_none_is_guessed() {
    let bench = Bench::of("mh4@1");
    let mut objects = vec![
        (0x1800, 1, Some(0x185)),
        (0x1a00, 0, Some(2)),
        (0x1a00, 1, Some(0x9130_0120)),
        (0x1a00, 2, Some(0x9130_0220)),
        (0x6131, 1, Some(0x004e_0000)),
        (0x6131, 2, Some(0x002d_0000)),
        (0x6132, 1, Some(3)),
    ];
    let log = |objects: &[_]| {
        fs::write(bench.path("t.log"), asked(objects)).expect("written");
        replay(&bench, "t.log", "log 5")
    };
    let said = log(&objects).exit(2).stderr;
    assert!(said.contains("it sends TPDOs, and their mapping is unknown"), "{said}");
    objects.push((0x6132, 2, Some(1)));
    let done = log(&objects).exit(0);
    let rows: Vec<&str> = done.stdout.lines().skip(1).map(|row| row.splitn(4, ',').last().unwrap_or(row)).collect();
    assert_eq!(rows, ["ch1,1.234,bar,,0xD2040000", "ch2,-567.8,degC,,0xD2E9FFFF"]);
    // Who has no such object has no digits.
    objects[7].2 = None;
    let done = log(&objects).exit(0);
    assert!(done.stdout.ends_with("ch2,-5678,degC,,0xD2E9FFFF\n"), "{}", done.stdout);
}

#[test]
fn nothing_can_be_sent_into_it() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("t.log"), "(1700000000.000000) can0 701#00\n").expect("written");
    let done = replay(&bench, "t.log", "read 1").exit(5);
    assert_eq!(
        done.stderr,
        "cangauge: the recording t.log can only receive\n\
         hint: commands that only listen work on it: log, scan --passive, nmt watch\n"
    );
    replay(&bench, "t.log", "log 1 --sync 10ms")
        .refuses("a recording (replay:) is receive-only: --sync and --poll send");
    replay(&bench, "t.log", "log 1 --poll 10ms")
        .refuses("a recording (replay:) is receive-only: --sync and --poll send");
}

#[test]
fn what_is_no_log_is_named_with_its_line() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("t.log"), "(1.0) can0 701#00\nnonsense\n").expect("written");
    let done = replay(&bench, "t.log", "log 1").exit(8);
    assert!(done.stderr.starts_with("cangauge: replay t.log:2: not a line of a candump log"), "{}", done.stderr);
    replay(&bench, "nowhere.log", "log 1").exit(8);
    replay(&bench, "", "log 1").exit(2);
}

#[test]
fn scan_and_watch_listen_to_the_whole_of_it() {
    let bench = Bench::of("mh4@1");
    let log = "(1700000000.000000) can0 701#00\n(1700003600.000000) can0 705#05\n";
    fs::write(bench.path("t.log"), log).expect("written");
    let done = replay(&bench, "t.log", "scan --passive --format json").exit(0);
    let nodes: Vec<_> = done.json().iter().map(|line| line["node"].clone()).collect();
    assert_eq!(nodes, [1, 5]);
    let done = replay(&bench, "t.log", "nmt watch").exit(0);
    assert_eq!(done.stdout.lines().count(), 2, "{}", done.stdout);
}
