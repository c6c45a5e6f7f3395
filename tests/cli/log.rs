//! `cangauge log` records exactly the values that the devices sent.

use super::{Bench, Done, since_epoch};
use std::collections::{BTreeMap, BTreeSet};

const HEADER: &str = "time,elapsed_s,node,signal,value,unit,status,raw";

/// A line of the log, or of the record of the simulator, which has no `elapsed_s`.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Row {
    /// Microseconds since the bus was opened.
    at: u64,
    node: String,
    signal: String,
    /// Value, unit, status, bytes.
    rest: [String; 4],
}

impl Row {
    fn status(&self) -> &str {
        &self.rest[2]
    }
}

/// `2026-01-01T00:00:01.234567Z` as microseconds since the virtual clock's start; within its first day.
fn time(text: &str) -> u64 {
    let clock = text.strip_prefix("2026-01-01T").and_then(|text| text.strip_suffix('Z')).expect(text);
    let parts: Vec<&str> = clock.split(':').collect();
    let [hours, minutes, seconds] = parts[..] else { panic!("{text}") };
    let minutes = hours.parse::<u64>().expect(text) * 60 + minutes.parse::<u64>().expect(text);
    let (whole, fraction) = seconds.split_once('.').expect(text);
    assert_eq!((whole.len(), fraction.len()), (2, 6), "{text}");
    let seconds = minutes * 60 + whole.parse::<u64>().expect(text);
    seconds * 1_000_000 + fraction.parse::<u64>().expect(text)
}

/// The rows of a CSV log. Checks the header, the columns and `elapsed_s` too.
fn rows(csv: &str) -> Vec<Row> {
    let mut lines = csv.split_inclusive('\n');
    assert_eq!(lines.next(), Some(format!("{HEADER}\n").as_str()));
    let mut rows: Vec<Row> = Vec::new();
    for line in lines {
        let line = line.strip_suffix('\n').expect("whole lines");
        let cells: Vec<&str> = line.split(',').collect();
        let [at, elapsed, node, signal, value, unit, status, raw] = cells[..] else { panic!("{line}") };
        let at = time(at);
        let first = rows.first().map_or(at, |row| row.at);
        assert_eq!(elapsed, format!("{}.{:06}", (at - first) / 1_000_000, (at - first) % 1_000_000), "{line}");
        let rest = [value, unit, status, raw].map(str::to_owned);
        rows.push(Row { at, node: node.to_owned(), signal: signal.to_owned(), rest });
    }
    rows
}

/// The record of the simulator.
fn truth(bench: &Bench) -> Vec<Row> {
    let text = bench.text("truth.csv");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("t_us,node,signal,value,unit,status,raw"));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let [at, node, signal, value, unit, status, raw] = cells[..] else { panic!("{line}") };
        let rest = [value, unit, status, raw].map(str::to_owned);
        Row { at: at.parse().expect(line), node: node.to_owned(), signal: signal.to_owned(), rest }
    };
    lines.map(row).collect()
}

/// Checks that the log has exactly the values that were sent between its first and its last row, in order.
#[track_caller]
fn assert_true(rows: &[Row], truth: &[Row]) {
    let (first, last) = (rows.first().expect("rows").at, rows.last().expect("rows").at);
    let sent: Vec<&Row> = truth.iter().filter(|row| (first..=last).contains(&row.at)).collect();
    for (at, (row, sent)) in rows.iter().zip(&sent).enumerate() {
        assert_eq!(row, *sent, "row {at}");
    }
    assert_eq!(rows.len(), sent.len());
}

/// The four devices, with overloads in the middle, and a record of the simulator.
fn four_devices(seed: u64) -> Bench {
    let mut text = format!("seed = {seed}\nrecord = \"truth.csv\"\n");
    for (kind, node, channel, direction) in
        [("mh4", 1, 1, "high"), ("d20", 2, 1, "high"), ("mc1609", 3, 7, "low"), ("dps", 127, 1, "low")]
    {
        text += &format!(
            "[[device]]\nkind = \"{kind}\"\nnode = {node}\n[[device.overload]]\nchannel = {channel}\n\
             from = \"900ms\"\nuntil = \"1300ms\"\ndirection = \"{direction}\"\n"
        );
    }
    Bench::described(&text)
}

/// One device of this kind, with a record of the simulator.
fn one(kind: &str, more: &str) -> Bench {
    Bench::described(&format!("record = \"truth.csv\"\n[[device]]\nkind = \"{kind}\"\nnode = 5\n{more}"))
}

fn count<'a>(rows: impl IntoIterator<Item = &'a Row>) -> BTreeMap<(&'a str, &'a str), usize> {
    let mut counts = BTreeMap::new();
    for row in rows {
        *counts.entry((row.node.as_str(), row.signal.as_str())).or_default() += 1;
    }
    counts
}

#[test]
fn rows_match_the_values_of_four_devices() {
    let mut first_values = BTreeSet::new();
    for seed in [0, 1, 7, 12345] {
        let bench = four_devices(seed);
        let done = bench.run("log 1-3,127 --sync 10ms --duration 2s").exit(0);
        let mut rows = rows(&done.stdout);
        // D-20-9 and DPS report no status: a value beyond the measuring range shows their overload.
        for (node, status) in [("2", "overload-high"), ("127", "overload-low")] {
            let own = || rows.iter().filter(|row| row.node == node);
            let beyond: Vec<&Row> = own().filter(|row| row.status() == status).collect();
            assert!(!beyond.is_empty() && own().all(|row| ["", status].contains(&row.status())), "node {node}");
            assert!(beyond.iter().all(|row| (900_000..1_400_000).contains(&row.at) && !row.rest[0].is_empty()));
        }
        rows.iter_mut().filter(|row| ["2", "127"].contains(&row.node.as_str())).for_each(|row| row.rest[2].clear());
        let truth = truth(&bench);
        assert_true(&rows, &truth);
        // Nothing was sent before the first row, and the recording did not end early.
        assert_eq!(rows[0], truth[0]);
        assert!(rows.last().expect("rows").at - rows[0].at > 1_980_000);
        let counts = count(&rows);
        assert_eq!((counts[&("1", "pressure")], counts[&("2", "pressure")]), (200, 200), "one a SYNC");
        assert_eq!(counts.keys().filter(|(node, _)| *node == "3").count(), 16);
        assert!(counts.iter().filter(|((node, _), _)| ["3", "127"].contains(node)).all(|(_, count)| *count == 19));
        // The overload of the MH-4 lasts 400 ms. Its rows have no value.
        let over: Vec<&Row> = rows.iter().filter(|row| row.status() == "overload-high").collect();
        assert_eq!((over.len(), count(over.iter().copied()).len()), (40, 1));
        assert!(over.iter().all(|row| row.node == "1" && row.rest[0].is_empty() && row.rest[3] == "0x0000C07F"));
        assert!(over.iter().all(|row| (900_000..1_310_000).contains(&row.at)));
        assert!(
            rows.iter().filter(|row| row.node != "1").all(|row| row.status().is_empty()),
            "the other devices report no status"
        );
        first_values.insert(rows[0].rest[0].clone());
    }
    assert_eq!(first_values.len(), 4, "another seed, other values");
}

#[test]
fn two_runs_write_the_same_bytes() {
    let run = || four_devices(3).run("log 1-3,127 --sync 10ms --duration 1s").exit(0).stdout;
    assert_eq!(run(), run());
}

#[test]
fn json_lines_contain_the_same_rows() {
    let csv = rows(&four_devices(5).run("log 1-3,127 --sync 10ms --duration 2s").exit(0).stdout);
    let json = four_devices(5).run("log 1-3,127 --sync 10ms --duration 2s --format json").exit(0).json();
    assert_eq!(csv.len(), json.len());
    let keys =
        |line: &serde_json::Value| line.as_object().expect("an object").keys().cloned().collect::<Vec<_>>().len();
    for (row, line) in csv.iter().zip(&json) {
        let text = |key: &str| line[key].as_str().unwrap_or_default();
        assert_eq!(keys(line), 8, "{line}");
        assert_eq!(time(text("time")), row.at);
        assert_eq!(line["elapsed_s"].as_f64().map(|s| (s * 1e6).round()), Some((row.at - csv[0].at) as f64), "{line}");
        assert_eq!((line["node"].to_string(), text("signal")), (row.node.clone(), row.signal.as_str()));
        assert_eq!(line["value"].as_f64(), row.rest[0].parse::<f64>().ok(), "{line}");
        assert!(!row.rest[0].is_empty() || line["value"].is_null(), "{line}");
        assert_eq!([text("unit"), text("status"), text("raw")], [row.rest[1].as_str(), &row.rest[2], &row.rest[3]]);
        assert_eq!(line["status"].is_null(), row.rest[2].is_empty(), "{line}");
    }
    let line = one("mh4", "").run("log 5 --sync 10ms --count 1 -f json").exit(0).stdout;
    assert!(line.starts_with("{\"time\":\"2026-01-01T00:00:00."), "{line}");
}

/// The frames of a trace that the program sent with this identifier, with their times.
fn sent(done: &Done, frame: &str) -> Vec<u64> {
    done.frames.iter().zip(&done.times).filter(|(sent, _)| *sent == frame).map(|(_, time)| *time).collect()
}

#[test]
fn sync_count_is_exact_and_does_not_drift() {
    let done = one("mh4", "").run("log 5 --sync 10ms --duration 1s -v").exit(0);
    let syncs = sent(&done, "080#");
    assert_eq!(syncs.len(), 100);
    assert!(syncs.windows(2).all(|pair| pair[1] - pair[0] == 10_000), "{syncs:?}");
    assert!(done.stderr.contains("100 SYNC sent"), "{}", done.stderr);
    assert_eq!(rows(&done.stdout).len(), 100);
    // The period does not divide the duration: the last SYNC is before the end.
    let done = one("mh4", "").run("log 5 --sync 300ms --duration 1s").exit(0);
    assert_eq!(sent(&done, "080#").len(), 4);
}

#[test]
fn first_sync_follows_the_starts_of_all_nodes() {
    for count in [9, 64] {
        let nodes: Vec<String> = (1..=count).map(|node| format!("mh4@{node}")).collect();
        let line = format!("log 1-{count} --sync 100ms --duration 1s --summary s.json");
        let bench = Bench::of(&nodes.join(","));
        let done = bench.run(&line).exit(0);
        let last_start = sent(&done, &format!("000#01{count:02X}"));
        let syncs = sent(&done, "080#");
        assert_eq!((last_start.len(), syncs.len()), (1, 10), "{count} nodes");
        assert!(last_start[0] <= syncs[0], "{count} nodes: {last_start:?}, {syncs:?}");
        let recorded = rows(&done.stdout);
        let per_node = |node: u32| recorded.iter().filter(|row| row.node == node.to_string()).count();
        assert!((1..=count).all(|node| per_node(node) == per_node(1) && per_node(1) >= 10), "{count} nodes");
        assert!(bench.text("s.json").contains("\"missing\":0"), "{}", bench.text("s.json"));
    }
}

#[test]
fn sync_uses_the_cob_id_of_1005h() {
    let done = one("mh4", "set = { \"0x1005\" = 0x90 }\n").run("log 5 --sync 10ms --count 10").exit(0);
    assert_eq!((sent(&done, "090#").len(), sent(&done, "080#").len()), (10, 0));
}

#[test]
fn sync_is_refused_if_the_cob_ids_differ() {
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1005\" = 0x90 }\n[[device]]\nkind = \"mh4\"\nnode = 6\n",
    );
    let done = bench.run("log 5,6 --sync 10ms").exit(1);
    assert_eq!(
        done.stderr,
        "cangauge: the nodes have different COB-IDs of SYNC (1005h): node 5: 090, node 6: 080\n\
         hint: set 1005h to the same value in all nodes, or record them one by one\n"
    );
    assert_eq!(done.frames_of("000"), [""; 0], "nothing was started");
}

#[test]
fn dps_sends_ten_rows_per_second() {
    let bench = one("dps", "");
    let done = bench.run("log 5 --duration 10s").exit(0);
    let rows = rows(&done.stdout);
    assert_true(&rows, &truth(&bench));
    // The first row comes 100 ms after the start, the hundredth at the end.
    assert!((99..=100).contains(&rows.len()), "{}", rows.len());
    assert!(rows.windows(2).all(|pair| (99_900..100_100).contains(&(pair[1].at - pair[0].at))));
    assert!(rows.iter().all(|row| row.rest[1] == "psi" && row.status().is_empty()));
    assert!(rows.iter().all(|row| row.rest[0].split_once('.').is_some_and(|(_, digits)| digits.len() == 3)));
}

#[test]
fn each_device_alone() {
    for (kind, line) in [
        ("mh4", "log 5 --sync 20ms --count 50"),
        ("d20", "log 5 --sync 20ms --count 50"),
        ("mc1609", "log 5 --count 160"),
        ("dps", "log 5 --count 50"),
    ] {
        let bench = one(kind, "");
        let done = bench.run(line).exit(0);
        let rows = rows(&done.stdout);
        assert_true(&rows, &truth(&bench));
        assert_eq!(rows.len().to_string(), line.split(' ').next_back().expect("a count"), "{kind}");
    }
}

#[test]
fn changed_setup_is_decoded() {
    // Event timer, unit (mbar) and decimal digits are read from the device.
    let bench = one("mh4", "start = true\nset = { \"0x1800:2\" = 254, \"0x1800:5\" = 50 }\n");
    let rows = rows(&bench.run("log 5 --duration 1s").exit(0).stdout);
    assert_true(&rows, &truth(&bench));
    assert!((19..=20).contains(&rows.len()), "{}", rows.len());
}

#[test]
fn count_ends_in_the_middle_of_a_frame() {
    let bench = one("mc1609", "");
    let rows = rows(&bench.run("log 5 --count 6").exit(0).stdout);
    assert_eq!(
        rows.iter().map(|row| row.signal.as_str()).collect::<Vec<_>>(),
        ["ch1", "ch2", "ch3", "ch4", "ch5", "ch6"]
    );
    let truth = truth(&bench);
    assert_eq!(rows, truth[..6], "the rest of a frame was sent, too");
}

#[test]
fn only_requested_signals_are_recorded() {
    let bench = one("mc1609", "");
    let rows_of = |line: &str| rows(&bench.run(line).exit(0).stdout);
    let ch5 = rows_of("log 5 ch5 --count 10");
    assert_eq!(count(&ch5).into_keys().collect::<Vec<_>>(), [("5", "ch5")]);
    let wanted: Vec<Row> = truth(&bench).into_iter().filter(|row| row.signal == "ch5").collect();
    assert_eq!(ch5, wanted[..10]);
    let both = rows_of("log 5 ch16 ch1 --count 10");
    assert_eq!(count(&both).into_keys().collect::<Vec<_>>(), [("5", "ch1"), ("5", "ch16")]);
    // The status has separate rows only if it is requested.
    let bench = one("mh4", "");
    let status = rows(&bench.run("log 5 pressure pressure.status --sync 10ms --count 4").exit(0).stdout);
    let found: Vec<_> = status.iter().map(|row| (row.signal.as_str(), row.status(), row.rest[3].len())).collect();
    assert_eq!(
        found,
        [("pressure", "ok", 10), ("pressure.status", "", 4), ("pressure", "ok", 10), ("pressure.status", "", 4)]
    );
    let raw = rows(&bench.run("log 5 0x6130:1 --sync 10ms --count 2").exit(0).stdout);
    assert!(raw.iter().all(|row| row.signal == "0x6130:1" && row.rest[0].parse::<f32>().is_ok()), "{raw:?}");
}

#[test]
fn nodes_without_a_requested_signal_are_skipped() {
    let bench = four_devices(0);
    for line in ["log 1-3,127 pressure --sync 10ms --count 50", "log 1-3,127 pressure --poll 100ms --count 30"] {
        let done = bench.run(line).exit(0);
        let counts = count(&rows(&done.stdout)).into_keys().map(|(node, _)| node.to_owned()).collect::<BTreeSet<_>>();
        assert_eq!(counts.into_iter().collect::<Vec<_>>(), ["1", "127", "2"], "{line}");
        assert!(done.stderr.contains("node 3 has none of the requested signals"), "{}", done.stderr);
    }
}

#[test]
fn polled_values() {
    let bench = Bench::of("mh4@1,mc1609@3,dps@127");
    let done = bench.run("log 1,3,127 --poll 100ms --duration 2s").exit(0);
    let rows = rows(&done.stdout);
    assert_eq!(done.frames_of("000"), [""; 0], "polling needs no NMT");
    assert!(rows.windows(2).all(|pair| pair[0].at <= pair[1].at), "in order of time");
    let counts = count(&rows);
    assert_eq!(counts.len(), 2 + 16 + 1);
    assert!(counts.values().all(|&count| count == 20), "{counts:?}");
    // Each value has the time and the bytes of its answer: 43h or 42h, expedited, four bytes.
    let answers: BTreeSet<(u64, &str)> =
        done.times.iter().zip(&done.frames).map(|(time, frame)| (*time, &frame[..6])).collect();
    let bytes: BTreeMap<u64, &str> = (done.times.iter().zip(&done.frames))
        .filter(|(_, frame)| frame.starts_with("581#") || frame.starts_with("5FF#"))
        .map(|(time, frame)| (*time, &frame[12..]))
        .collect();
    for row in rows.iter().filter(|row| row.node != "3") {
        let id = 0x580 + row.node.parse::<u16>().expect("a number");
        let heads = [format!("{id:03X}#43"), format!("{id:03X}#42")];
        assert!(heads.iter().any(|head| answers.contains(&(row.at, head))), "{row:?}");
        assert_eq!(bytes[&row.at], &row.rest[3][2..], "{row:?}");
    }
    assert!(done.stderr.starts_with("380 rows in "), "{}", done.stderr);
}

#[test]
fn too_fast_polls_are_skipped_and_counted() {
    let done = Bench::of("mc1609@3").run("log 3 --poll 1ms --duration 500ms").exit(0);
    let rows = rows(&done.stdout);
    assert!(rows.len() > 300 && done.stderr.contains("polls skipped"), "{} rows, {}", rows.len(), done.stderr);
}

#[test]
fn passive_sends_nothing_and_needs_a_mapping() {
    let bench = one("dps", "start = true\n");
    let done = bench.run("log 5 --passive --device dps --duration 2s").exit(0);
    assert_true(&rows(&done.stdout), &truth(&bench));
    assert!(done.frames.iter().all(|frame| frame.starts_with("185#") || frame == "705#00"), "{:?}", done.frames);
    let done = bench.run("log 5 --passive --duration 2s").exit(2);
    assert_eq!(
        done.stderr,
        "cangauge: node 5: the mapping of its TPDOs is unknown\n\
         hint: name the device: --device 5=mh4 (or a file), or start recording before another master reads the mapping\n"
    );
    assert_eq!(done.stdout, "");
    let done = one("dps", "").run("log 5 --passive --device dps").exit(3);
    assert!(done.frames_of("185").is_empty() && done.stderr.contains("nmt start 5"), "{}", done.stderr);
}

#[test]
fn frames_before_the_recording_make_no_rows() {
    // A started node also sends while its setup is read. Only later frames are recorded.
    let bench = one("dps", "start = true\nset = { \"0x1017\" = 100 }\n");
    let done = bench.run("log 5 --duration 3s").exit(0);
    let rows = rows(&done.stdout);
    assert_true(&rows, &truth(&bench));
    assert!((29..=30).contains(&rows.len()), "{}", rows.len());
}

#[test]
fn trace_and_rows_have_the_same_times() {
    let bench = one("mh4", "");
    let done = bench.run("log 5 --sync 10ms --count 20").exit(0);
    let on_the_wire: Vec<u64> = done
        .frames
        .iter()
        .zip(&done.times)
        .filter(|(frame, _)| frame.starts_with("185#"))
        .map(|(_, time)| *time)
        .collect();
    assert_eq!(rows(&done.stdout).iter().map(|row| row.at).collect::<Vec<_>>(), on_the_wire[..20]);
    assert_eq!(since_epoch("1767225601.000002"), 1_000_002);
}

/// An MH-4 whose TPDO1 has this COB-ID and this transmission type.
fn on_request(cob_id: u32, transmission: u8) -> Bench {
    Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nnode = 1\nset = {{ \"0x1800:1\" = {cob_id}, \"0x1800:2\" = {transmission}, \"0x1801:1\" = 0x80000281 }}\n"
    ))
}

#[test]
fn tpdos_are_requested_by_remote_frames() {
    for (transmission, syncs) in [(252, true), (253, false)] {
        let done = on_request(0x181, transmission).run("log 1 --request 100ms --count 6").exit(0);
        assert_eq!(done.stdout.lines().count(), 7, "{}", done.stdout);
        let frames = done.frames_of("181");
        let (requests, answers): (Vec<&str>, Vec<&str>) = frames.iter().partition(|frame| frame.starts_with('R'));
        let length = answers[0].len() / 2;
        assert_eq!(requests[0], format!("R{length}"), "the length of the mapping");
        assert!(requests.len() <= answers.len() + 1, "{frames:?}");
        assert_eq!(!done.frames_of("080").is_empty(), syncs, "{:?}", done.frames);
        if syncs {
            let at = |frame: &str| done.frames.iter().position(|sent| sent.starts_with(frame)).expect("a frame");
            assert!(at("080#") < at("181#R"), "{:?}", done.frames);
        }
        assert!(done.stderr.contains("values were sent on remote request and may be old"), "{}", done.stderr);
        assert!(!done.stderr.contains("missing"), "{}", done.stderr);
    }
}

#[test]
fn tpdo_that_answers_no_request_is_refused_or_named() {
    let done = on_request(0x4000_0181, 253).run("log 1 --request 100ms --count 4");
    assert!(done.frames_of("000").is_empty(), "{:?}", done.frames);
    done.fails(
        4,
        "cangauge: node 1: TPDO1 does not answer remote requests (bit 30 of 1800h:1): nothing was started\n\
         hint: read by SDO instead: --poll 100ms\n",
    );
    let done = on_request(0x181, 253).run("log 1 --request 100ms --no-nmt --duration 1s").exit(3);
    assert!(done.stderr.contains("TPDO1 is due on each remote request, and no TPDO1 was received"), "{}", done.stderr);
    let done = on_request(0x181, 253).run("log 1 --duration 1s").exit(3);
    assert!(done.stderr.contains("--request 100ms"), "{}", done.stderr);
    on_request(0x181, 253).run("log 1 --request 100ms --poll 1s").exit(2);
    on_request(0x181, 253)
        .run("log 1 --request 100us")
        .refuses("\"100us\" is too short for remote requests (1ms or more)");
}

/// Node 6 sends TPDO1 with the COB-ID of node 5.
fn shared_cob_id(values: [f64; 2]) -> Bench {
    let device = |(node, value): (u8, f64)| {
        let set = if node == 6 { "start = true\nset = { \"0x1800:1\" = 0x40000185 }\n" } else { "" };
        format!(
            "[[device]]\nkind = \"mh4\"\nnode = {node}\n{set}\
             [[device.channel]]\nchannel = 1\nbase = {value:?}\namplitude = 0.0\nnoise = 0.0\n"
        )
    };
    Bench::described(&[5, 6].into_iter().zip(values).map(device).collect::<String>())
}

#[test]
fn second_sender_of_a_tpdo_gives_no_value() {
    for interval in ["100ms", "60ms"] {
        let done = shared_cob_id([1.25, 2.5]).run(&format!("log 5 pressure --sync {interval} --duration 1s")).exit(6);
        assert!(!done.stdout.contains("pressure"), "{}", done.stdout);
        assert!(
            done.stderr.contains("TPDO1 arrives twice at a SYNC, with different values: two devices have this node-ID"),
            "{}",
            done.stderr
        );
        assert!(done.stderr.contains("hint: disconnect one of them"), "{}", done.stderr);
    }
}

#[test]
fn values_of_the_first_sync_are_kept_in_order() {
    for line in ["log 1,2 --sync 10ms --count 8", "log 1,2 --sync 1s --count 2", "log 1,2 --sync 20ms --duration 30ms"]
    {
        let done = Bench::of("mh4@1,d20@2").run(line).exit(0);
        let times: Vec<&str> = done.stdout.lines().skip(1).filter_map(|row| row.split(',').next()).collect();
        assert!(times.len() >= 2 && times.is_sorted(), "{line}: {}", done.stdout);
    }
}
