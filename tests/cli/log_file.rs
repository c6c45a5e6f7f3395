//! The files of `cangauge log`: none overwritten unasked, none left empty, none half written.

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
    // Asked to overwrite: only once there is something to write.
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
    // A link to a file that does not exist yet makes it, as elsewhere.
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
fn a_full_disk() {
    let bench = Bench::of("mh4@1");
    bench.run("log 1 --sync 10ms --count 5 -o /dev/full").fails(
        8,
        "SYNC every 10 ms with its TPDOs takes 7.4 % of the bus\nwarning: 5 rows could not be written\ncangauge: write /dev/full: No space left on device (os error 28)\n",
    );
    // The failure ends the recording, and the node's state is restored.
    let heartbeat = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\nset = { \"0x1017\" = 100 }\n");
    let done = heartbeat.run("log 1 --sync 10ms --duration 1h -o /dev/full").exit(8);
    assert_eq!(done.frames_of("000"), ["0101", "8001"]);
    assert!(done.times.last().is_some_and(|&last| last < 5_000_000), "{:?}", done.times.last());
}

#[test]
fn rows_are_handed_over_within_a_second() {
    // A reader that goes after the first line ends a recording of an hour at the next rows, on the real clock.
    use std::io::{BufRead, BufReader};
    let begun = std::time::Instant::now();
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
    // However busy the machine is: a block of rows takes a minute.
    assert!(begun.elapsed() < std::time::Duration::from_secs(30), "{:?}", begun.elapsed());
}
