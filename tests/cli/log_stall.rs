//! Readers that are slow, stop reading or end. The recording neither waits for them nor hangs.

use super::Bench;
use std::io::{BufRead, BufReader, Read};
use std::process::Stdio;

#[test]
fn slow_reader_gets_every_row_on_the_virtual_clock() {
    // Far more data than a pipe holds, and at first no reader.
    let bench = Bench::of("mh4@1");
    let whole = bench.run("log 1 --sync 10ms --duration 60s").exit(0).stdout;
    let mut command = bench.traced(&["log", "1", "--sync", "10ms", "--duration", "60s"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
    let mut reader = BufReader::with_capacity(100, child.stdout.take().expect("stdout"));
    let mut text = String::new();
    reader.read_to_string(&mut text).expect("rows");
    assert!(text == whole, "{} bytes of {}", text.len(), whole.len());
    bench.end(child).exit(0);
}

#[cfg(unix)]
fn signal(child: &std::process::Child, name: &str) {
    let status = std::process::Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status();
    assert!(status.expect("kill").success());
}

/// On the real clock: rows wait for a blocked reader, and Ctrl-C ends the recording.
#[test]
#[cfg(unix)]
fn ctrl_c_ends_a_recording_into_a_blocked_pipe() {
    let bench = Bench::real("mc1609@3,mh4@1");
    // 300 kB per second fill the 64 kB of the pipe quickly.
    let mut command = bench.traced(&["log", "1", "--sync", "1ms", "--summary", "sum.json"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
    let mut reader = BufReader::new(child.stdout.take().expect("stdout"));
    let mut line = String::new();
    reader.read_line(&mut line).expect("a line");
    assert_eq!(line, "time,elapsed_s,node,signal,value,unit,status,raw\n");
    // SYNC continues while the pipe is full: the trace has far more of them than the pipe has rows.
    let mut syncs = 0;
    while syncs < 3000 {
        let trace = std::fs::read_to_string(bench.path("trace")).unwrap_or_default();
        syncs = trace.matches(" 080#").count();
        assert!(child.try_wait().expect("a child").is_none(), "it ended");
        std::thread::yield_now();
    }
    signal(&child, "INT");
    let status = child.wait().expect("its end");
    let mut stderr = String::new();
    child.stderr.take().expect("stderr").read_to_string(&mut stderr).expect("text");
    assert_eq!(status.code(), Some(8), "{stderr}");
    assert!(stderr.contains(" rows lost\n") && stderr.contains("rows lost: stdout could not keep up"), "{stderr}");
    let summary: serde_json::Value = serde_json::from_str(&bench.text("sum.json")).expect("JSON");
    let (rows, lost) = (summary["rows"].as_u64().expect("rows"), summary["rows_lost"].as_u64().expect("rows_lost"));
    assert!(0 < lost && lost < rows, "{lost} of {rows}");
    // All rows that were not counted as lost are there. Only the last line may be cut off.
    let mut rest = String::new();
    reader.read_to_string(&mut rest).expect("rows");
    assert!(rest.matches('\n').count() as u64 >= rows - lost, "{lost} of {rows} were lost");
}

/// On the real clock: rows reach the file during the recording, and after `kill -9` each row is complete.
#[test]
#[cfg(unix)]
fn kill_leaves_complete_rows() {
    let bench = Bench::real("mh4@1");
    let mut child = bench
        .traced(&["log", "1", "--sync", "1ms", "-o", "run.csv"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary");
    let text = || std::fs::read_to_string(bench.path("run.csv")).unwrap_or_default();
    // The file grows during the recording, every half second.
    let mut sizes = std::collections::BTreeSet::new();
    while sizes.len() < 4 {
        sizes.insert(text().len());
        assert!(child.try_wait().expect("a child").is_none(), "it ended");
        std::thread::yield_now();
    }
    child.kill().expect("SIGKILL");
    child.wait().expect("its end");
    let text = text();
    let whole = text.rsplit_once('\n').expect("lines").0;
    let mut lines = whole.lines();
    assert_eq!(lines.next(), Some("time,elapsed_s,node,signal,value,unit,status,raw"));
    assert!(lines.all(|line| line.split(',').count() == 8), "{text}");
}
