//! `cangauge health`.

use super::{Bench, Done};
use serde_json::{Value, json};
use std::fs;

/// Runs health on the recording `t.log`.
fn replay(bench: &Bench, options: &str) -> Done {
    let words = ["--bus", "replay:t.log", "health", "-f", "json"].into_iter().chain(options.split_whitespace());
    bench.finish(&mut bench.command(&words.collect::<Vec<_>>()))
}

/// The row of a figure.
#[track_caller]
fn figure(done: &Done, node: Option<u8>, name: &str) -> Value {
    let rows = done.json();
    let is_meant = |row: &&Value| row["figure"] == name && row["node"].as_u64() == node.map(u64::from);
    rows.iter().find(is_meant).unwrap_or_else(|| panic!("{name}: {}", done.stdout)).clone()
}

#[track_caller]
fn value(done: &Done, node: Option<u8>, name: &str) -> f64 {
    figure(done, node, name)["value"].as_f64().unwrap_or_else(|| panic!("{name}: {}", done.stdout))
}

fn device(node: u8, more: &str) -> String {
    format!("[[device]]\nkind = \"mh4\"\nnode = {node}\nstart = true\n{more}\n")
}

#[test]
fn answer_times_differ_by_the_latency_of_the_devices() {
    let devices = [(5, "300us"), (6, "5300us"), (7, "150ms")]
        .map(|(node, latency)| device(node, &format!("latency = \"{latency}\"")));
    let bench = Bench::described(&devices.concat());
    let done = bench.run("health 5-7 --for 60s -f json").exit(0);
    for name in ["node.sdo.min", "node.sdo.mean", "node.sdo.p99", "node.sdo.max"] {
        let [fast, slow, slowest] = [5, 6, 7].map(|node| value(&done, Some(node), name));
        assert!((slow - fast - 0.005).abs() < 0.0006, "{name}: {fast} {slow}");
        assert!((slowest - fast - 0.1497).abs() < 0.0006, "{name}: {fast} {slowest}");
        // Request and answer take about 0.5 ms each on the bus.
        assert!((fast - 0.0013).abs() < 0.0007, "{name}: {fast}");
    }
    assert_eq!(figure(&done, Some(5), "node.sdo.p99")["verdict"], "ok");
    assert_eq!(figure(&done, Some(7), "node.sdo.p99")["verdict"], "warning");
    assert!(value(&done, Some(5), "node.sdo.count") > 500.0);
    assert_eq!(done.frames.iter().filter(|frame| frame.starts_with("000")).count(), 0, "no NMT");
}

#[test]
fn heartbeat_intervals_are_compared_with_1017h() {
    let regular = device(5, "set = { \"0x1017\" = 200 }");
    let silent = device(6, "set = { \"0x1017\" = 1000 }\nconnected = { from = \"0s\", until = \"4500ms\" }");
    let bench = Bench::described(&(regular + &silent));
    let done = bench.run("health 5,6 --for 10s -f json").exit(0);
    for name in ["node.heartbeat.min", "node.heartbeat.mean", "node.heartbeat.max", "node.heartbeat.time"] {
        assert!((value(&done, Some(5), name) - 0.2).abs() < 0.002, "{name}");
    }
    assert_eq!(figure(&done, Some(5), "node.heartbeat.max")["verdict"], "ok");
    let longest = figure(&done, Some(6), "node.heartbeat.max");
    assert_eq!((&longest["verdict"], &longest["limit"]), (&json!("warning"), &json!(1.5)));
    assert!(longest["value"].as_f64().is_some_and(|time| (5.0..6.5).contains(&time)), "{longest}");
    assert!(value(&done, Some(6), "node.sdo.unanswered") > 5.0);
    let text = bench.run("health 5,6").exit(0).stdout;
    assert!(text.contains("warning: node 6: node.heartbeat.max 5.9") && text.contains("(limit 1.5 s)"), "{text}");
    assert!(text.contains("\nNODE  STATE"), "{text}");
}

#[test]
fn load_is_that_of_the_frames_and_needs_a_bit_rate() {
    let bench = Bench::of("mh4@5");
    // 55 bits with stuff bits and intermission each, 100 per second, then 500 per second.
    let slow = (0..200).map(|count| count * 10_000);
    let fast = (0..1000).map(|count| 2_000_000 + count * 2000);
    let lines =
        slow.chain(fast).map(|at| format!("(17672256{:02}.{:06}) can0 705#05\n", at / 1_000_000, at % 1_000_000));
    fs::write(bench.path("t.log"), lines.collect::<String>()).expect("written");
    let done = replay(&bench, "--bitrate 125k").exit(0);
    let mean = value(&done, None, "bus.load");
    let peak = value(&done, None, "bus.load.peak");
    let bits_of_one = mean / 100.0 * 125_000.0 * value(&done, None, "bus.duration") / 1200.0;
    assert!((bits_of_one - bits_of_one.round()).abs() < 1e-3 && (50.0..60.0).contains(&bits_of_one), "{bits_of_one}");
    assert!((peak - 500.0 * bits_of_one / 1250.0).abs() < 0.1, "{peak}");
    assert!((value(&done, Some(5), "node.load") - mean).abs() < 1e-6);
    let unknown = replay(&bench, "").exit(0);
    assert_eq!(figure(&unknown, None, "bus.load")["value"], Value::Null);
    assert_eq!(figure(&unknown, None, "bus.load")["verdict"], Value::Null);
    assert_eq!(value(&unknown, None, "bus.frames.heartbeat"), 1200.0);
}

#[test]
fn passive_figures_come_from_the_traffic_of_others() {
    let bench = Bench::described(&device(5, "latency = \"4ms\"\nset = { \"0x1017\" = 500 }"));
    bench.run("log 5 --poll 50ms --duration 3s").exit(0);
    fs::rename(bench.path("trace"), bench.path("t.log")).expect("the trace");
    let done = replay(&bench, "").exit(0);
    let time = value(&done, Some(5), "node.sdo.mean");
    assert!((0.004..0.006).contains(&time), "{time}");
    assert!(value(&done, Some(5), "node.sdo.count") > 50.0);
    let silent = bench.run("health --passive --for 3s -f json").exit(0);
    assert_eq!(
        (value(&silent, Some(5), "node.sdo.count"), silent.frames.iter().any(|it| it.starts_with("6"))),
        (0.0, false)
    );
}

#[test]
fn absent_node_and_wrong_options() {
    let bench = Bench::of("mh4@5");
    assert!(bench.run("health 5,9 --for 2s").exit(7).stderr.contains("node 9: no heartbeat and no SDO answer"));
    bench.run("health 9 --for 2s").exit(3);
    assert!(bench.run("health --for 5").exit(2).stderr.contains("has no unit"));
    assert!(bench.run("health --bitrate fast").exit(2).stderr.contains("\"fast\" is not a CAN bit rate"));
    assert!(replay(&bench, "").exit(8).stderr.contains("t.log"));
}

#[test]
fn figures_are_signals_of_check() {
    let bench = Bench::described(&(device(5, "set = { \"0x1017\" = 1000 }") + &device(6, "latency = \"30ms\"")));
    let figures = ["bus.load < 60 %", "node.sdo.p99 < 0.1 s", "5.node.heartbeat.max < 1.1 s", "bus.errors == 0"];
    let words: Vec<&str> = ["check", "5,6"].into_iter().chain(figures).chain(["--for", "10s"]).collect();
    bench.run_words(&words).exit(0);
    let done =
        bench.run_words(&["check", "5,6", "node.sdo.max < 20 ms", "bus.load < 0.1 %", "--for", "5s", "-f", "json"]);
    let verdicts = done.exit(1).json();
    let outcome = |node: Value| verdicts.iter().find(|row| row["node"] == node).map(|row| row["verdict"].clone());
    assert_eq!(outcome(json!(5)), Some(json!("ok")), "{verdicts:?}");
    assert_eq!(outcome(json!(6)), Some(json!("fail")), "{verdicts:?}");
    assert_eq!(outcome(Value::Null), Some(json!("fail")), "{verdicts:?}");
    bench.run_words(&["check", "5", "bus.load < 60 %"]).refuses("bus.load needs some time");
    bench.run_words(&["check", "5", "bus.lod < 60 %", "--for", "1s"]).refuses("no figure \"bus.lod\"");
    bench.run_words(&["check", "5", "pressure < 100 bar", "bus.load < 60 %", "--for", "2s", "--poll", "100ms"]).exit(0);
}
