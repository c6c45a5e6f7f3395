//! Buses behind a byte stream, and simulated devices that outlast a command.

use super::Bench;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStderr, Stdio};

/// Starts `sim --listen 0`. Returns its bus.
fn serve(bench: &Bench, words: &[&str]) -> (Child, BufReader<ChildStderr>, String) {
    let mut command = bench.command(&["sim", "--listen", "0"]);
    let command = command.args(words).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the simulator");
    let mut stderr = BufReader::new(child.stderr.take().expect("stderr"));
    let (mut text, mut line) = (String::new(), String::new());
    while !text.contains("simulation is running") {
        line.clear();
        assert!(stderr.read_line(&mut line).expect("text") > 0, "{text}");
        text.push_str(&line);
    }
    let bus = text.split_whitespace().find(|word| word.starts_with("socketcand://")).expect("a bus").to_owned();
    (child, stderr, bus.replace("localhost", "127.0.0.1"))
}

#[test]
fn served_devices_answer_and_obey_lines() {
    let bench = Bench::of("mh4@1");
    let (mut child, mut stderr, bus) = serve(&bench, &["mh4@1:pressure=2bar", "dps@127"]);
    let run = |line: &str| {
        let words: Vec<&str> = ["-b", &bus].into_iter().chain(line.split_whitespace()).collect();
        bench.finish(&mut bench.command(&words))
    };
    run("read 1 pressure").prints("2\n");
    let input = child.stdin.as_mut().expect("stdin");
    input.write_all(b"volume 1 5l\npressure 1 5.2bar\nunplug 127\n").expect("written");
    let mut line = String::new();
    stderr.read_line(&mut line).expect("text");
    assert_eq!(line, "warning: \"volume 1 5l\": no signal \"volume\" (it has: pressure, temperature)\n");
    let mut value = run("read 1 pressure");
    // The lines are executed one after the other, at once.
    for _ in 0..50 {
        if value.stdout.contains("5.2") {
            break;
        }
        value = run("read 1 pressure");
    }
    value.prints("5.2\n");
    run("read 127 --timeout 50ms --retries 0").exit(3);
    child.kill().expect("killed");
    child.wait().expect("ended");
    let refused = run("scan").exit(5).stderr;
    assert!(refused.contains("connection refused: no server listens there\nhint: check the address"), "{refused}");
}

#[test]
fn names_of_buses_and_addresses_are_checked_first() {
    let bench = Bench::of("mh4@1");
    let refused = |words: &[&str], message: &str| {
        let done = bench.finish(&mut bench.command(words)).exit(2);
        assert_eq!(done.stderr.lines().next(), Some(format!("cangauge: {message}").as_str()));
    };
    refused(
        &["-b", "slcan:/dev/ttyACM0", "scan"],
        "\"slcan:/dev/ttyACM0\" has no bit rate; add that of the bus: slcan:/dev/ttyACM0@250k",
    );
    refused(&["-b", "socketcand://pi", "scan"], "\"socketcand://pi\" is not socketcand://HOST[:PORT]/BUS");
    refused(
        &["-b", "vcan0", "sim", "mh4@5", "--listen", "1"],
        "--listen serves the devices in place of a bus: omit --bus",
    );
    let done = bench.finish(&mut bench.command(&["sim", "mh4@5", "--listen", "pi"])).exit(2);
    assert!(done.stderr.contains("\"pi\" is not PORT or ADDRESS:PORT"), "{}", done.stderr);
    let absent = bench.finish(&mut bench.command(&["-b", "slcan:./absent@250k", "scan"]));
    absent.fails(
        5,
        "cangauge: slcan:./absent@250k: there is no such device\n\
         hint: list the serial adapters: cangauge bus list; to wait for one, add --wait 1m\n",
    );
}

#[test]
fn stored_settings_last_from_one_run_to_the_next() {
    let device = "[[device]]\nkind = \"mh4\"\nnode = 5\n[[device]]\nkind = \"mh4\"\n";
    let bench = Bench::described(&format!("state = \"state.toml\"\n{device}"));
    bench.run("lss set-id 5 12").exit(0);
    bench.run("lss set-id unconfigured 9").exit(0);
    let nodes = |bench: &Bench| {
        let found = bench.run("scan -f json").exit(0).json();
        found.iter().map(|node| node["node"].as_u64()).collect::<Vec<_>>()
    };
    assert_eq!(nodes(&bench), [Some(9), Some(12)]);
    let map = "pdo map 12 1 temperature --transmission timer --event-timer 200ms";
    let timer = || bench.run("sdo read 12 0x1800:5").exit(0).stdout;
    bench.run(map).exit(0);
    assert_ne!(timer(), "200\n", "it was not stored");
    bench.run(&format!("{map} --store")).exit(0);
    assert_eq!(timer(), "200\n");
    bench.run("restore 12").exit(0);
    assert_ne!(timer(), "200\n", "the defaults were restored");
    std::fs::write(bench.path("state.toml"), "version = 7\n").expect("written");
    let refused = bench.run("scan").exit(2).stderr;
    assert!(refused.contains("state.toml: version 7 of the state file is unknown (this program: 1)"), "{refused}");
}
