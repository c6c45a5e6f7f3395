//! The files of `cangauge log`: never overwritten without `--force`, never empty, never cut off.

use super::Bench;
use std::fs;
use std::process::Stdio;

#[test]
fn existing_file_is_refused() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("run.csv"), "old\n").expect("written");
    let done = bench.run("log 1 --sync 10ms --count 5 -o run.csv");
    assert_eq!(done.stderr, "cangauge: run.csv exists\nhint: overwrite it with --force, or choose another file\n");
    done.refuses("run.csv exists");
    assert_eq!(bench.text("run.csv"), "old\n");
    // --force overwrites only when there is something to write.
    bench.run("log 9 -o run.csv --force").exit(3);
    bench.run("log 1 -o run.csv --force").exit(3);
    assert_eq!(bench.text("run.csv"), "old\n");
    let done = bench.run("log 1 --sync 10ms --count 5 -o run.csv --force").prints("");
    assert!(done.stderr.lines().any(|line| line.starts_with("5 rows in ")), "{}", done.stderr);
    assert_eq!(bench.text("run.csv").lines().count(), 6);
    bench.run("log 1 --sync 10ms --count 2 -o run.csv --force").exit(0);
    assert_eq!(bench.text("run.csv").lines().count(), 3, "nothing of the longer one before is left");
}

#[test]
fn file_has_the_same_bytes_as_stdout() {
    let bench = Bench::of("mh4@1,dps@127");
    let printed = bench.run("log 1,127 --sync 10ms --count 100").exit(0).stdout;
    bench.run("log 1,127 --sync 10ms --count 100 -o run.csv").prints("");
    assert_eq!(bench.text("run.csv"), printed);
}

#[test]
#[cfg(unix)]
fn links_and_pipes() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("old.csv"), "old\n".repeat(1000)).expect("written");
    std::os::unix::fs::symlink("old.csv", bench.path("link.csv")).expect("a link");
    bench.run("log 1 --sync 10ms --count 2 -o link.csv").refuses("link.csv exists");
    bench.run("log 1 --sync 10ms --count 2 -o link.csv --force").exit(0);
    assert_eq!(bench.text("old.csv").lines().count(), 3);
    // A dangling link: its target is created.
    std::os::unix::fs::symlink("nowhere.csv", bench.path("broken.csv")).expect("a link");
    bench.run("log 1 --sync 10ms --count 2 -o broken.csv").exit(0);
    assert_eq!(bench.text("nowhere.csv").lines().count(), 3);
    let made = std::process::Command::new("mkfifo").arg(bench.path("fifo")).status().expect("mkfifo");
    assert!(made.success());
    let child = bench
        .traced(&["log", "1", "--sync", "10ms", "--count", "3", "-o", "fifo"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary");
    assert_eq!(fs::read_to_string(bench.path("fifo")).expect("rows").lines().count(), 4);
    bench.end(child).exit(0);
}

#[test]
fn unwritable_places_fail_before_the_bus_is_used() {
    let bench = Bench::of("mh4@1");
    let done = bench.run("log 1 --sync 10ms -o no/such/folder.csv").exit(8);
    assert_eq!(done.stderr, "cangauge: create no/such/folder.csv: No such file or directory (os error 2)\n");
    assert_eq!(done.frames, [""; 0], "the bus was used");
    fs::create_dir(bench.path("folder")).expect("a folder");
    let done = bench.run("log 1 --sync 10ms -o folder").exit(8);
    assert_eq!(done.frames, [""; 0], "the bus was used");
}

#[test]
#[cfg(target_os = "linux")]
fn full_disk_is_exit_8() {
    let bench = Bench::of("mh4@1");
    bench.run("log 1 --sync 10ms --count 5 -o /dev/full").fails(
        8,
        "SYNC every 10 ms and its TPDOs use 7.4 % of the bus\nwarning: 5 rows could not be written\ncangauge: write /dev/full: No space left on device (os error 28)\n",
    );
    // The error ends the recording, and the state of the node is restored.
    let heartbeat = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\nset = { \"0x1017\" = 100 }\n");
    let done = heartbeat.run("log 1 --sync 10ms --duration 1h -o /dev/full").exit(8);
    assert_eq!(done.frames_of("000"), ["0101", "8001"]);
    assert!(done.times.last().is_some_and(|&last| last < 5_000_000), "{:?}", done.times.last());
}

#[test]
fn rows_are_handed_over_within_a_second() {
    // On the real clock: if the reader ends after the first line, the recording of an hour ends at the next rows.
    use std::io::{BufRead, BufReader};
    let start = std::time::Instant::now();
    let bench = Bench::real("dps@127");
    let mut command = bench.traced(&["log", "127"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("stdout")).read_line(&mut line).expect("a line");
    assert_eq!(line, "time,elapsed_s,node,signal,value,unit,status,raw\n");
    let output = child.wait_with_output().expect("its end");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("cangauge:") && !stderr.contains("warning"), "{stderr}");
    // Even on a busy machine: filling a block with rows would take a minute.
    assert!(start.elapsed() < std::time::Duration::from_secs(30), "{:?}", start.elapsed());
}

/// Holds the lock of a file, as a recording does.
fn locked(path: std::path::PathBuf) -> fs::File {
    let file = fs::File::options().append(true).create(true).open(path).expect("a file");
    file.try_lock().expect("locked");
    file
}

#[test]
#[cfg(target_os = "linux")]
fn file_has_one_writer() {
    let bench = Bench::of("mh4@1");
    let own = std::process::id();
    let locks = ["run.csv", "events.csv", ".summary.json.tmp", "data.bin", "old.json", "run-0002.csv"]
        .map(|name| locked(bench.path(name)));
    for (line, name) in [
        ("log 1 --sync 10ms --count 5 -o run.csv --append", "run.csv"),
        ("log 1 --sync 10ms --count 5 -o run.csv --force", "run.csv"),
        ("log 1 --sync 10ms --count 5 -o a.csv --events events.csv --append", "events.csv"),
        ("log 1 --sync 10ms --count 5 --summary summary.json", "summary.json"),
        ("check 1 pressure<100 --junit old.json", "old.json"),
        ("log 1 --sync 10ms --count 5 -o run.csv --rotate 1s --append", "run-0002.csv"),
        ("log 1 --sync 10ms --count 5 -o run.csv --rotate 1s --force", "run-0002.csv"),
        ("sdo read 1 0x1008 --output data.bin --force", "data.bin"),
    ] {
        let path = bench.path(name);
        let name = if name.starts_with("old") { path.display().to_string() } else { name.to_owned() };
        bench.run(line).refuses(&format!("{name} is being written by process {own}"));
    }
    let mut command = bench.command(&["--bus", "sim", "--trace", "run.csv", "read", "1"]);
    let done = bench.finish(&mut command).exit(2);
    assert!(done.stderr.contains("run.csv is being written by process"), "{}", done.stderr);
    drop(locks);
    bench.run("log 1 --sync 10ms --count 5 -o run.csv --append").exit(0);
}

#[test]
#[cfg(target_os = "linux")]
fn two_links_to_one_file_are_one_file() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("run.csv"), "").expect("written");
    std::os::unix::fs::symlink("run.csv", bench.path("soft.csv")).expect("a link");
    fs::hard_link(bench.path("run.csv"), bench.path("hard.csv")).expect("a link");
    let log = "log 1 --sync 10ms --count 5 -o run.csv --force";
    for (option, name) in [("--events", "soft.csv"), ("--events", "hard.csv"), ("--summary", "soft.csv")] {
        let done = bench.run(&format!("{log} {option} {name}")).exit(2);
        assert!(done.stderr.contains(".csv is used for two outputs\n"), "{}", done.stderr);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn trace_is_opened_with_the_bus() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("old.log"), "old").expect("written");
    let mut command = bench.command(&["--bus", "no-such-can", "--trace", "old.log", "read", "1"]);
    bench.finish(&mut command).exit(5);
    let mut command = bench.command(&["--bus", "sim:no-such-bench.toml", "--trace", "old.log", "read", "1"]);
    bench.finish(&mut command).exit(8);
    assert_eq!(bench.text("old.log"), "old");
}

#[test]
#[cfg(target_os = "linux")]
fn limit_for_the_size_of_files_is_a_full_disk() {
    let bench = Bench::of("mh4@1");
    let line = format!(
        "ulimit -f 8; exec {} -b {} log 1 --sync 10ms --duration 1h -o run.csv",
        env!("CARGO_BIN_EXE_cangauge"),
        bench.bus
    );
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", &line]).current_dir(bench.folder.path());
    let done = bench.finish(&mut shell).exit(8);
    assert!(done.stderr.contains("cangauge: write run.csv: File too large"), "{}", done.stderr);
    assert!(bench.text("run.csv").ends_with('\n'), "whole lines");
}

#[test]
#[cfg(target_os = "linux")]
fn fifo_without_a_reader_is_waited_for_within_the_duration() {
    let bench = Bench::of("mh4@1");
    let made = std::process::Command::new("mkfifo").arg(bench.path("fifo")).status().expect("mkfifo");
    assert!(made.success());
    let log = "log 1 --sync 10ms --duration 300ms";
    let check = "check 1 pressure<99 --sync 10ms --for 300ms --junit fifo";
    let outputs = ["-o fifo", "-o run.csv --force --events fifo", "-o run.csv --force --summary fifo"];
    let lines = outputs.map(|output| format!("{log} {output}")).into_iter();
    for line in lines.chain([check.to_owned(), format!("{log} -o run.csv --force --trace fifo")]) {
        let start = std::time::Instant::now();
        let done = bench.run(&line);
        done.fails(8, "cangauge: open fifo: no program reads from this FIFO\nhint: start the reader first: cat fifo\n");
        assert!(start.elapsed() >= std::time::Duration::from_millis(300));
    }
}
