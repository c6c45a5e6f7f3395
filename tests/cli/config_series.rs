//! `config apply` for several devices: at the same time, and one after the other at a terminal.

use super::Bench;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::wire_length::frame_time;
use std::io::Write;
use std::process::Stdio;
use std::time::Duration;

const FILE: &str = "[device]\nkind = \"mh4\"\n[node]\nheartbeat = \"500ms\"\n[signal.pressure]\nunit = \"psi\"\n\
                    lower = \"1 bar\"\nupper = 100\n[tpdo.1]\nsignals = [\"pressure\", \"temperature\"]\n\
                    transmission = \"timer\"\nevent-timer = \"100ms\"\n";

fn device(node: u32, serial: u32, more: &str) -> String {
    format!("[[device]]\nkind = \"mh4\"\nnode = {node}\nserial = {serial}\n{more}\n")
}

/// The time of all frames at 250 kbit/s with stuff bits, compared with the time that the command took.
#[test]
fn sixteen_devices_take_little_more_than_the_time_of_their_frames() {
    let bench = Bench::described(&(1..=16).map(|node| device(node, 1000 + node, "")).collect::<String>());
    std::fs::write(bench.path("f.toml"), FILE).expect("a file");
    let done = bench.run("config apply 1-16 f.toml").exit(0);
    assert_eq!(done.stdout.matches("10 changes, verified").count(), 16, "{}", done.stdout);
    let needed: Duration =
        done.frames.iter().map(|frame| frame_time(&frame.parse::<Frame>().expect("a frame"), 250_000)).sum();
    let took = Duration::from_micros(done.times.last().expect("frames") - done.times[0]);
    assert!(took < needed.mul_f64(1.2), "{took:?} for frames of {needed:?}");
    // A node never gets a second request before its answer to the first. Heartbeats do not delay an answer beyond the
    // time-out.
    for node in 1..=16 {
        let (request, answer) = (format!("6{node:02X}#"), format!("5{:02X}#", 0x80 + node));
        let own = done.frames.iter().filter(|frame| frame.starts_with(&request) || frame.starts_with(&answer));
        let is_request: Vec<bool> = own.map(|frame| frame.starts_with(&request)).collect();
        assert!(is_request.chunks(2).all(|pair| pair == [true, false]), "node {node}");
    }
}

/// A device that sends TPDOs all the time: the load stays below 50 % together with it.
#[test]
fn other_traffic_halves_the_load() {
    let tpdos = "start = true\nset = { \"0x1800:2\" = 254, \"0x1800:5\" = 5 }";
    let more = format!("{}{}", device(20, 1020, tpdos), device(21, 1021, tpdos));
    let bench = Bench::described(&((1..=8).map(|node| device(node, 1000 + node, "")).collect::<String>() + &more));
    std::fs::write(bench.path("f.toml"), FILE).expect("a file");
    let load = load(&bench.run("config apply 1-8 f.toml").exit(0));
    assert!((0.4..0.52).contains(&load), "{load}");
    // Polling too: the cycles that find no time are skipped and reported.
    let done = bench.run("log 1-8 --poll 1ms --duration 3s").exit(0);
    assert!((0.4..0.52).contains(&self::load(&done)), "{}", self::load(&done));
    assert!(done.stderr.contains("skipped"), "{}", done.stderr);
    let done = bench.run("log 1-8 --poll 1ms --duration 3s --max-load 80%").exit(0);
    assert!((0.7..0.82).contains(&self::load(&done)), "{}", self::load(&done));
}

/// The bus load after the first 300 ms.
fn load(done: &super::Done) -> f64 {
    let from = done.times.iter().position(|time| *time > 300_000).expect("frames");
    let busy: Duration =
        done.frames[from..].iter().map(|frame| frame_time(&frame.parse::<Frame>().expect("a frame"), 250_000)).sum();
    let took = Duration::from_micros(done.times.last().expect("frames") - done.times[from]);
    busy.as_secs_f64() / took.as_secs_f64()
}

#[test]
fn a_node_that_fails_does_not_stop_the_others() {
    let devices = [(1, ""), (2, "answers_only = [\"0x1000\"]"), (3, "")];
    let bench = Bench::described(&devices.map(|(node, more)| device(node, 1000 + node, more)).concat());
    std::fs::write(bench.path("f.toml"), FILE).expect("a file");
    let done = bench.run("config apply 1-4 f.toml --format json").exit(7);
    let changed: Vec<_> = done.json().iter().map(|report| report["node"].clone()).collect();
    assert_eq!(changed, [1, 3]);
    let failed: Vec<&str> = done.stderr.lines().filter(|line| line.contains("\"error\"")).collect();
    assert_eq!(failed.len(), 2, "{}", done.stderr);
    assert!(failed[0].contains("\"node\":2") && failed[1].contains("\"node\":4"), "{failed:?}");
}

const TABLE: &str = "vendor,product,serial,node,timer,note\n0x47,1,1001,51,100ms,\"a, b\"\n0x47,1,1002,52,200ms,\n\
                     71,1,1003,53,300ms,x\n";

const TEMPLATE: &str = "[device]\nkind = \"mh4\"\n[tpdo.1]\nevent-timer = \"{timer}\"\n";

/// Runs `config apply --table t.csv f.toml --prompt` at a terminal. This text is typed first. `None` if this
/// computer has no program to make a terminal.
#[allow(clippy::print_stderr, reason = "a skipped test must be visible")]
fn at_terminal(bench: &Bench, typed: &str, end: bool) -> Option<super::Done> {
    std::fs::write(bench.path("f.toml"), TEMPLATE).expect("a file");
    let mut script = std::process::Command::new("script");
    let command = format!(
        "{} --bus {} --trace trace config apply --table t.csv f.toml --prompt --record r.json",
        env!("CARGO_BIN_EXE_cangauge"),
        bench.bus
    );
    script.current_dir(bench.folder.path()).args(["-qec", &command, "/dev/null"]);
    let spawned = script.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let Ok(mut child) = spawned else {
        assert!(std::env::var_os("CI").is_none(), "no program \"script\"");
        eprintln!("SKIPPED: no program \"script\"");
        return None;
    };
    child.stdin.as_mut().expect("a pipe").write_all(typed.as_bytes()).expect("typed");
    if end {
        child.stdin = None;
    }
    Some(bench.end(child))
}

/// Between two devices the bus is empty: nothing acknowledges the frames.
#[test]
fn devices_of_a_table_are_set_as_they_are_plugged_in() {
    let plugged = |from: u32, until: u32| format!("connected = {{ from = \"{from}s\", until = \"{until}s\" }}");
    let bench = Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nserial = 1001\n{}\n{}{}{}{}",
        plugged(2, 60),
        device(1, 9999, &plugged(65, 75)),
        device(1, 1002, &plugged(80, 110)),
        device(2, 1005, &plugged(81, 84)),
        device(1, 1003, &plugged(115, 150)),
    ));
    std::fs::write(bench.path("t.csv"), TABLE).expect("a file");
    let Some(done) = at_terminal(&bench, "", false) else { return };
    let done = done.exit(0);
    for line in [
        "plug in the next sensor (3 left",
        "serial number 1001: ok: node 51, ",
        "serial number 9999: not in the table; nothing was changed",
        "serial number 1002: ok: node 52, ",
        "serial number 1003: ok: node 53, ",
    ] {
        assert!(done.stdout.contains(line), "{line}: {}", done.stdout);
    }
    let table = bench.text("t.csv");
    assert!(
        table.starts_with("vendor,product,serial,node,timer,note,result\n0x47,1,1001,51,100ms,\"a, b\",\"ok: node 51")
    );
    assert_eq!(table.matches("ok: node").count(), 3, "{table}");
    let record: serde_json::Value = serde_json::from_str(&bench.text("r.json")).expect("JSON");
    let serials: Vec<_> =
        record["devices"].as_array().expect("devices").iter().map(|one| one["serial"].clone()).collect();
    assert_eq!(serials, [1001, 1002, 1003]);
    let timers = done.frames.iter().filter(|frame| frame.contains("#2B001805"));
    let timers: Vec<&str> = timers.map(String::as_str).collect();
    let ids: Vec<&str> = timers.iter().map(|frame| &frame[..3]).collect();
    assert_eq!(ids, ["633", "601", "601"], "each device under the node-ID that it has then");
    // Nothing is left to do, so the next run ends at once.
    let Some(again) = at_terminal(&bench, "", false) else { return };
    assert_eq!(again.exit(0).frames, [""; 0]);
}

#[test]
fn the_serial_number_on_the_label_is_compared() {
    let bench = Bench::described(&device(1, 1002, "connected = { from = \"100s\", until = \"110s\" }"));
    std::fs::write(bench.path("t.csv"), TABLE).expect("a file");
    let Some(done) = at_terminal(&bench, "1003\n", true) else { return };
    let done = done.exit(2);
    assert!(done.stdout.contains("the input ended before the first device"), "{}", done.stdout);
    assert_eq!(bench.text("t.csv"), TABLE);
}

#[test]
fn without_a_terminal_nothing_is_sent() {
    let bench = Bench::of("mh4@1");
    std::fs::write(bench.path("t.csv"), TABLE).expect("a file");
    std::fs::write(bench.path("f.toml"), TEMPLATE).expect("a file");
    bench
        .run("config apply --table t.csv f.toml --prompt")
        .refuses("--prompt needs a terminal: someone plugs in the devices");
    bench.run("config apply 1 f.toml --prompt").exit(2);
}
