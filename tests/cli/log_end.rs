//! How a recording starts and ends: NMT states restored, silent nodes, Ctrl-C.

use super::Bench;
use serde_json::json;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

#[test]
fn mh4_is_silent_without_sync() {
    let bench = Bench::of("mh4@1");
    let silent = "cangauge: node 1: no measurements within 5 s: TPDO1 waits for SYNC, and no node sends SYNC; node 1 was \
                  started and stays operational: its previous state is unknown and cannot be restored\n\
                  hint: add --sync 100ms, or read by SDO: --poll 100ms (node 1)\n";
    let done = bench.run("log 1 -o run.csv").exit(3);
    assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", silent));
    assert_eq!(bench.files(), [""; 0], "no file is left");
    bench.run("log 1").fails(3, silent);
    let error = bench.run("log 1 --format json").exit(3).error();
    assert_eq!(error["error"]["effects"][0]["code"], "left-operational");
    let within = bench.run("log 1 --duration 2s").exit(3).stderr;
    assert!(within.contains("no measurements within 2 s"), "{within}");
    let within = bench.run("log 1 --duration 1h").exit(3).stderr;
    assert!(within.contains("no measurements within 5 s"), "{within}");
}

#[test]
fn known_state_is_restored() {
    let with = |more: &str| {
        Bench::described(&format!("[[device]]\nkind = \"mh4\"\nnode = 5\n{more}set = {{ \"0x1017\" = 100 }}\n"))
    };
    let done = with("").run("log 5 --sync 10ms --count 10").exit(0);
    assert_eq!(done.frames_of("000"), ["0105", "8005"]);
    assert!(!done.stderr.contains("stays operational"), "{}", done.stderr);
    let last = done.frames.iter().rposition(|frame| frame == "080#").expect("a SYNC");
    assert!(done.frames[last..].contains(&"000#8005".to_owned()), "restored at the end");
    let done = with("start = true\n").run("log 5 --sync 10ms --count 10").exit(0);
    assert_eq!(done.frames_of("000"), [""; 0], "it was operational already");
    // Also after an error.
    let done = with("").run("log 5").exit(3);
    assert_eq!(done.frames_of("000"), ["0105", "8005"]);
}

#[test]
fn unknown_state_is_not_guessed() {
    let done = Bench::of("mh4@5,mh4@6").run("log 5 --sync 10ms --count 10").exit(0);
    assert_eq!(done.frames_of("000"), ["0105"], "named nodes only");
    let said = "node 5 was started and stays operational: its previous state is unknown and cannot be restored\n";
    assert!(done.stderr.ends_with(said), "{}", done.stderr);
}

#[test]
fn no_nmt_sends_no_nmt_command() {
    let bench = Bench::described("[[device]]\nkind = \"dps\"\nnode = 5\nstart = true\n");
    let done = bench.run("log 5 --count 3 --no-nmt").exit(0);
    assert_eq!(done.frames_of("000"), [""; 0]);
    let done = Bench::of("dps@5").run("log 5 --no-nmt").exit(3);
    assert_eq!((done.frames_of("000"), done.stdout.as_str()), (vec![], ""));
    assert!(done.stderr.contains("probably not operational") && done.stderr.contains("nmt state 5"), "{}", done.stderr);
}

#[test]
fn node_without_an_answer_is_named_and_the_others_are_recorded() {
    let bench = Bench::of("mh4@1");
    let no_answer = "cangauge: node 9: read 0x1000:0: no answer within 500 ms\nhint: check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor 9\n";
    let done = bench.run("log 9 --sync 10ms -o run.csv").fails(3, no_answer);
    assert_eq!((done.frames_of("000"), bench.files()), (vec![], vec![]), "nothing was started, no file is left");
    let done = bench.run("log 1,9 --sync 10ms --count 4 -o run.csv").exit(7);
    assert!(done.stderr.ends_with(no_answer), "{}", done.stderr);
    let warning = "node 9: read 0x1000:0: no answer within 500 ms: the node is not recorded";
    assert!(done.stderr.lines().next().is_some_and(|line| line.contains(warning)), "{}", done.stderr);
    assert_eq!(bench.files(), ["run.csv"]);
}

#[test]
fn silent_node_among_others_is_partial_success() {
    let done = Bench::of("mh4@1,dps@127").run("log 1,127 --duration 2s").exit(7);
    assert!(done.stdout.lines().skip(1).all(|line| line.contains(",127,pressure,")), "{}", done.stdout);
    assert!(
        done.stderr.contains("node 1: no measurements: TPDO1 waits for SYNC, and no node sends SYNC"),
        "{}",
        done.stderr
    );
    assert!(done.stderr.ends_with("cangauge: node 1 lost: no measurements at the end\n"), "{}", done.stderr);
}

#[test]
fn unknown_signals_are_refused() {
    let bench = Bench::of("mh4@1,dps@127");
    bench
        .run("log 1,127 presure --sync 10ms")
        .fails(2, "cangauge: no node has a signal \"presure\"\nhint: the signals are: pressure, temperature\n");
    bench.run("log 127 pressure.status").fails(2, "cangauge: no node has a status object for pressure\n");
    bench
        .run("log 127 0x6132:1")
        .fails(6, "cangauge: no TPDO contains 0x6132:1\nhint: read it by SDO: --poll 100ms (without --sync); or put it into a TPDO: cangauge pdo map --help\n");
    bench.run("log 127 0x6132:1 --poll 100ms --count 3").exit(0);
}

#[test]
fn summary_has_the_statistics_of_the_rows() {
    let bench = Bench::of("dps@127");
    let done = bench.run("log 127 --count 20 --summary sum.json").exit(0);
    let lines: Vec<&str> = done.stderr.lines().collect();
    assert_eq!(lines[0], "20 rows in 1.9 s, simulated timestamps, 0 frames dropped, 0 gaps");
    assert!(lines[1].starts_with("NODE  SIGNAL     N  MEAN "), "{}", lines[1]);
    assert!(lines[2].starts_with(" 127  pressure  20  "), "{}", lines[2]);
    let summary: serde_json::Value = serde_json::from_str(&bench.text("sum.json")).expect("JSON");
    assert_eq!(
        (&summary["rows"], &summary["timestamps"], &summary["dropped"], &summary["gaps"], &summary["lost_nodes"]),
        (&json!(20), &json!("simulated"), &json!(0), &json!(0), &json!([]))
    );
    let values: Vec<f64> = done
        .stdout
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(4).and_then(|cell| cell.parse().ok()).expect(line))
        .collect();
    let mean = values.iter().sum::<f64>() / 20.0;
    let sd = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 19.0).sqrt();
    let signal = &summary["signals"][0];
    let near = |key: &str, wanted: f64| {
        let found = signal[key].as_f64().expect(key);
        assert!((found - wanted).abs() < 1e-9, "{key}: {found}, {wanted}");
    };
    near("mean", mean);
    near("sd", sd);
    near("min", values.iter().copied().fold(f64::INFINITY, f64::min));
    near("max", values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    assert_eq!(
        (&signal["node"], &signal["signal"], &signal["unit"], &signal["count"], &signal["invalid"]),
        (&json!(127), &json!("pressure"), &json!("psi"), &json!(20), &json!(0))
    );
    let done = bench.run("log 127 --count 2 -q --summary - -o run.csv").exit(0);
    assert_eq!(done.json()[0]["rows"], 2);
    bench.run("log 127 --count 2 -q --summary sum.json").exit(0);
    let summary: serde_json::Value = serde_json::from_str(&bench.text("sum.json")).expect("JSON");
    assert_eq!(summary["rows"], 2, "an existing report is replaced");
    assert_eq!(bench.files(), ["run.csv", "sum.json"], "no temporary file is left");
    bench
        .run("log 127 --count 2 --summary no/folder.json")
        .fails(8, "cangauge: create no/folder.json: No such file or directory (os error 2)\n");
}

#[test]
fn gaps_jitter_and_syncs_in_the_summary() {
    let bench = Bench::of("dps@127,mh4@5");
    // 19 intervals of 100 ms are longer than the allowed 99 ms.
    let done = bench.run("log 127 --count 20 --max-gap 99ms --summary sum.json -v").exit(0);
    assert!(done.stderr.contains(", 19 gaps\n"), "{}", done.stderr);
    assert!(done.stderr.contains("  INTERVAL  GAPS  JITTER P99  JITTER MAX\n"), "{}", done.stderr);
    assert!(done.stderr.contains("  psi   10.00/s    100 ms    19  "), "{}", done.stderr);
    let summary: serde_json::Value = serde_json::from_str(&bench.text("sum.json")).expect("JSON");
    let signal = &summary["signals"][0];
    assert_eq!((&summary["gaps"], &signal["gaps"], &summary["sync_delay_s"]), (&json!(19), &json!(19), &json!(null)));
    let seconds = |key: &str, part: &str| signal[key][part].as_f64().expect(key);
    assert!((seconds("interval_s", "p50") - 0.1).abs() < 0.000_03 && seconds("jitter_s", "max") < 0.000_5, "{signal}");
    let done = bench.run("log 127 --count 20 --max-gap 101ms").exit(0);
    assert!(done.stderr.contains(", 0 gaps\n"), "{}", done.stderr);
    // Four TPDOs, ten times each: gaps are counted per TPDO, not per value.
    let done = Bench::of("mc1609@3").run("log 3 --count 160 --max-gap 99ms").exit(0);
    assert!(done.stderr.contains(", 36 gaps\n"), "{}", done.stderr);
    let done = bench.run("log 5 --sync 10ms --count 50 --summary - -o run.csv -v").exit(0);
    let summary = &done.json()[0];
    assert_eq!((&summary["syncs"], &summary["syncs_left_out"]), (&json!(50), &json!(0)));
    assert!(summary["sync_delay_s"]["max"].as_f64().is_some_and(|delay| delay < 0.001), "{summary}");
    assert!(done.stderr.contains("50 SYNC sent, delay min "), "{}", done.stderr);
    bench.run("log 127 --max-gap 3").exit(2);
}

#[test]
fn overload_is_reported_at_once() {
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n\
         [[device.overload]]\nchannel = 1\nfrom = \"700ms\"\nuntil = \"800ms\"\ndirection = \"high\"\n",
    );
    let done = bench.run("log 5 --sync 10ms --duration 1s").exit(0);
    let text = "warning: node 5: emergency F001h, user input overload";
    assert!(done.stderr.lines().any(|line| line.starts_with(text)), "{}", done.stderr);
    // (1 SYNC of at most 50 bits and 1 TPDO of at most 135) in 10 ms, of 250 kbit/s.
    assert!(done.stderr.starts_with("SYNC every 10 ms and its TPDOs use 7.4 % of the bus\n"), "{}", done.stderr);
    assert!(done.stderr.contains("node 5: emergency over (0000h)"), "{}", done.stderr);
    assert!(done.stderr.contains("  INVALID\n") && done.stderr.contains("     10 ms       10\n"), "{}", done.stderr);
}

#[cfg(unix)]
fn signal(child: &std::process::Child, name: &str) {
    let status = Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status().expect("kill");
    assert!(status.success());
}

/// A command that starts `command` by another program, for example `nohup`.
#[cfg(unix)]
fn started_by(runner: &[&str], command: &Command) -> Command {
    let mut started = Command::new(runner[0]);
    started.args(&runner[1..]).arg(command.get_program()).args(command.get_args());
    if let Some(folder) = command.get_current_dir() {
        started.current_dir(folder);
    }
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => started.env(name, value),
            None => started.env_remove(name),
        };
    }
    started
}

/// On the real clock. `env` sets SIGHUP to its default: the tests themselves may run under `nohup`.
#[test]
#[cfg(unix)]
fn signals_end_a_recording_with_success() {
    for name in ["INT", "TERM", "HUP"] {
        let bench = Bench::real("dps@127");
        let mut command = started_by(&["env", "--default-signal=HUP"], &bench.traced(&["log", "127"]));
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
        let mut reader = BufReader::new(child.stdout.take().expect("stdout"));
        let mut text = String::new();
        for _ in 0..2 {
            reader.read_line(&mut text).expect("a line");
        }
        signal(&child, name);
        std::io::Read::read_to_string(&mut reader, &mut text).expect("the rest");
        let mut lines = text.split_inclusive('\n');
        assert_eq!(lines.next(), Some("time,elapsed_s,node,signal,value,unit,status,raw\n"));
        assert!(lines.all(|line| line.ends_with('\n') && line.split(',').count() == 8), "{text}");
        let output = child.wait_with_output().expect("its end");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{stderr}");
        let rows = text.lines().count() - 1;
        assert!(stderr.starts_with(&format!("{rows} row")), "{stderr}");
    }
}

#[test]
#[cfg(unix)]
fn ctrl_c_before_the_first_row_is_interrupted() {
    let bench = Bench::real("mh4@1");
    let words = ["-b", &bench.bus, "--trace", "-", "log", "1", "-o", "run.csv"];
    let mut child = bench.command(&words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
    let mut reader = BufReader::new(child.stderr.take().expect("stderr"));
    let mut line = String::new();
    while !line.contains("000#0101") {
        line.clear();
        assert!(reader.read_line(&mut line).expect("a line") > 0, "it ended before it had started the node");
    }
    signal(&child, "INT");
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut reader, &mut rest).expect("the rest");
    assert_eq!(child.wait().expect("its end").code(), Some(130), "{rest}");
    let left = "node 1 was started and stays operational: its previous state is unknown and cannot be restored";
    assert_eq!(rest, format!("cangauge: interrupted; {left}\n"));
    assert_eq!(bench.files(), [""; 0], "no file is left");
}

/// On the real clock. The reader reads at least the header.
#[cfg(unix)]
fn end_early(words: &[&str], end: impl FnOnce(&mut std::process::Child)) -> (Option<i32>, String, serde_json::Value) {
    let bench = Bench::real("dps@127");
    let words: Vec<&str> = [&["log", "127", "--summary", "sum.json"], words].concat();
    let mut command = bench.traced(&words);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
    end(&mut child);
    let output = child.wait_with_output().expect("its end");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    let text = std::fs::read_to_string(bench.path("sum.json")).unwrap_or_default();
    let summary = serde_json::from_str(&text).unwrap_or_default();
    (output.status.code(), stderr, summary)
}

#[cfg(unix)]
fn read_lines(child: &mut std::process::Child, count: usize) -> BufReader<std::process::ChildStdout> {
    let mut reader = BufReader::with_capacity(16, child.stdout.take().expect("stdout"));
    let mut text = String::new();
    for _ in 0..count {
        reader.read_line(&mut text).expect("a line");
    }
    reader
}

#[test]
#[cfg(unix)]
fn interrupted_before_its_planned_end_is_not_complete() {
    for limit in [["--duration", "1h"], ["--count", "100000"]] {
        let (code, stderr, summary) = end_early(&limit, |child| {
            let mut reader = read_lines(child, 2);
            signal(child, "INT");
            std::io::Read::read_to_string(&mut reader, &mut String::new()).expect("the rest");
        });
        assert_eq!((code, &summary["complete"]), (Some(130), &json!(false)), "{stderr}");
        let written = summary["rows"].as_u64().expect("rows");
        let word = if written == 1 { "row" } else { "rows" };
        let message = format!("cangauge: interrupted before the end: {written} {word} written\n");
        assert!(stderr.ends_with(&message), "{stderr}");
    }
    let (code, stderr, summary) = end_early(&[], |child| {
        let mut reader = read_lines(child, 2);
        signal(child, "INT");
        std::io::Read::read_to_string(&mut reader, &mut String::new()).expect("the rest");
    });
    assert_eq!((code, &summary["complete"]), (Some(0), &json!(true)), "{stderr}");
}

#[test]
#[cfg(unix)]
fn closed_output_before_the_planned_end_is_not_complete() {
    for limit in [["--duration", "1h"], ["--count", "100000"]] {
        let (code, stderr, summary) = end_early(&limit, |child| drop(read_lines(child, 2)));
        assert_eq!((code, &summary["complete"]), (Some(8), &json!(false)), "{stderr}");
        assert!(stderr.contains("cangauge: the output was closed before the end: "), "{stderr}");
    }
    // Without a planned end, the reader decides when it has enough.
    let (code, stderr, _) = end_early(&[], |child| drop(read_lines(child, 2)));
    assert_eq!((code, stderr.contains("cangauge:")), (Some(0), false), "{stderr}");
}

#[test]
#[cfg(unix)]
fn hangup_is_ignored_under_nohup() {
    let bench = Bench::real("dps@127");
    let command = bench.traced(&["log", "127", "--duration", "2s", "-o", "run.csv"]);
    let mut nohup = started_by(&["env", "--ignore-signal=HUP"], &command);
    let mut child = nohup.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("env");
    while !bench.path("trace").metadata().is_ok_and(|trace| trace.len() > 0) {
        assert!(child.try_wait().expect("a child").is_none(), "it ended");
        std::thread::yield_now();
    }
    signal(&child, "HUP");
    let output = child.wait_with_output().expect("its end");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}
