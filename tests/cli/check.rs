//! `cangauge check` and `log --expect`: satisfied, failed, and without data.

use super::Bench;
use serde_json::json;
use std::fs;
#[cfg(unix)]
use std::io::{BufRead, BufReader, Read};
#[cfg(unix)]
use std::process::{Command, Stdio};

/// Devices with constant values.
fn constant() -> Bench {
    let device = |kind: &str, node: u8, channels: &[f64]| {
        let channel = |(at, base): (usize, &f64)| {
            format!("[[device.channel]]\nchannel = {}\nbase = {base:?}\namplitude = 0.0\nnoise = 0.0\n", at + 1)
        };
        let channels: String = channels.iter().enumerate().map(channel).collect();
        format!("[[device]]\nkind = \"{kind}\"\nnode = {node}\n{channels}")
    };
    Bench::described(&[device("mh4", 5, &[1.25, 25.5]), device("dps", 127, &[50.0])].concat())
}

/// An MH-4 in overload from 300 ms to 500 ms.
fn overloaded() -> Bench {
    Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n\
         [[device.overload]]\nchannel = 1\nfrom = \"300ms\"\nuntil = \"500ms\"\ndirection = \"high\"\n",
    )
}

fn check(bench: &Bench, words: &[&str]) -> super::Done {
    bench.run_words(&[&["check"], words].concat())
}

#[test]
fn one_reading() {
    let bench = constant();
    let done = check(&bench, &["5", "pressure in 1..1.5 bar", "temperature < 60 degC", "|pressure| <= 1.25 bar"])
        .prints(
            "ok    pressure in 1..1.5 bar  1.25 bar\n\
         ok    temperature < 60 degC   25.5 degC\n\
         ok    |pressure| <= 1.25 bar  1.25 bar\n",
        );
    assert_eq!(done.stderr, "");
    assert_eq!(done.frames_of("000"), [""; 0], "reading sends no NMT");
    let done = check(&bench, &["5", "pressure < 1.25 bar", "temperature < 60 degC", "pressure >= 1.3 bar"]).exit(1);
    assert_eq!(
        done.stdout,
        "FAIL  pressure < 1.25 bar    1.25 bar\n\
         ok    temperature < 60 degC  25.5 degC\n\
         FAIL  pressure >= 1.3 bar    1.25 bar\n"
    );
    assert_eq!(
        done.stderr,
        "cangauge: 2 of 3 checks failed: node 5: pressure < 1.25 bar: 1.25 bar; node 5: pressure >= 1.3 bar: 1.25 bar\n"
    );
    check(&bench, &["5", "0x6130:1 == 1.25 bar and pressure.status == 0"])
        .prints("ok    0x6130:1 == 1.25 bar and pressure.status == 0  0x6130:1 1.25 bar, pressure.status 0\n");
}

#[test]
fn the_error_names_expression_and_value() {
    let bench = constant();
    let error = check(&bench, &["5", "pressure < 1 bar", "-q", "-f", "json"]).exit(1).error();
    assert_eq!(error["error"]["message"], json!("1 of 1 check failed: node 5: pressure < 1 bar: 1.25 bar"));
}

#[test]
fn units_are_converted() {
    let bench = constant();
    // 50 psi are 3.44738 bar.
    check(&bench, &["127", "pressure in 3.44..3.45 bar"]).prints("ok    pressure in 3.44..3.45 bar  3.447379 bar\n");
    check(&bench, &["127", "pressure <= 50.000"]).prints("ok    pressure <= 50.000  50.000 psi\n");
    check(&bench, &["127", "pressure < 50 bar", "pressure < 3 bar"]).exit(1);
    check(&bench, &["5", "temperature in 77..78 degF"]).prints("ok    temperature in 77..78 degF  77.9 degF\n");
    check(&bench, &["5,127", "127.pressure - 5.pressure in 31.8..31.9"])
        .prints("ok    127.pressure - 5.pressure in 31.8..31.9  31.87028 psi\n");
}

#[test]
fn units_are_found_in_another_case_and_c_means_degrees() {
    let bench = constant();
    check(&bench, &["127", "pressure in 3.44..3.45 BAR"]).prints("ok    pressure in 3.44..3.45 BAR  3.447379 bar\n");
    check(&bench, &["5", "temperature in 77..78 F"]).prints("ok    temperature in 77..78 F  77.9 degF\n");
    check(&bench, &["5", "20 C < temperature", "temperature < 26 \u{b0}c", "temperature + 1 C < 26.6"]).exit(0);
    check(&bench, &["5", "pressure < 5 C"]).exit(2);
    check(&bench, &["5", "pressure < 5 mpa"]).refuses("the unit \"mpa\" is ambiguous: MPa or mPa");
}

#[test]
fn unquoted_comparison_gets_a_hint() {
    let stderr = check(&constant(), &["5", "pressure"]).exit(2).stderr;
    assert!(
        stderr.ends_with("hint: the shell takes an unquoted > or < as a redirection; quote it: 'pressure > 5 bar'\n"),
        "{stderr}"
    );
}

#[test]
fn each_node_is_checked() {
    let bench = constant();
    let done = check(&bench, &["5,127", "pressure < 2 bar", "5.temperature < 60"]).exit(1);
    assert_eq!(
        done.stdout,
        "ok    5    pressure < 2 bar    1.25 bar\n\
         FAIL  127  pressure < 2 bar    3.447379 bar\n\
         ok    -    5.temperature < 60  25.5 degC\n"
    );
    check(&bench, &["5,127", "temperature < 60"])
        .fails(2, "cangauge: node 127: no signal \"temperature\" (it has: pressure)\n  temperature < 60\n  ^\n");
    // With `all`, nodes without the signal are skipped.
    check(&bench, &["all", "temperature < 60"]).prints("ok    temperature < 60  25.5 degC\n");
    check(&bench, &["all", "humidity < 60"]).exit(2);
}

#[test]
fn wrong_arguments_are_refused_before_the_bus_is_opened() {
    let bench = constant();
    let refuses = |words: &[&str], stderr: &str| {
        let done = check(&bench, words);
        assert_eq!(done.stderr, stderr);
        done.refuses(stderr.lines().next().and_then(|line| line.strip_prefix("cangauge: ")).expect("a message"));
    };
    refuses(
        &["5", "pressure < 3 furlong"],
        "cangauge: unknown unit \"furlong\"\n  pressure < 3 furlong\n               ^\n\
         hint: common units: bar, mbar, kPa, MPa, psi, degC, degF, K, mV, mA, Hz, ms\n",
    );
    refuses(
        &["5", "noise(pressure) < 1"],
        "cangauge: noise() needs more than one reading\nhint: measure for some time: --for 10s\n",
    );
    refuses(&["5", "6.pressure < 3"], "cangauge: node 6 is not one of the given nodes\n  6.pressure < 3\n  ^\n");
    refuses(
        &["5", "pressure < 3\t\u{b0}C\n&& x"],
        "cangauge: \"&&\" is not supported here; use and\n  pressure < 3 \u{b0}C && x\n                  ^\nhint: cangauge check --help\n",
    );
    for words in [&["5"][..], &["5", ""], &["0", "pressure < 3"], &["5", "pressure < 3", "--sync", "10ms"]] {
        let done = check(&bench, words).exit(2);
        assert_eq!((done.stdout.as_str(), done.frames.len()), ("", 0), "{words:?}");
    }
    let error = check(&bench, &["5", "1 < pressure < 3", "-f", "json"]).exit(2).error();
    assert_eq!(
        (&error["error"]["kind"], &error["error"]["exit"], &error["error"]["column"]),
        (&json!("usage"), &json!(2), &json!(14))
    );
}

#[test]
fn unknown_signals_and_wrong_units_are_refused_before_measuring() {
    let bench = constant();
    check(&bench, &["5", "presure < 3"]).fails(
        2,
        "cangauge: node 5: no signal \"presure\" \
         (it has: pressure, temperature, pressure.status, temperature.status)\n  presure < 3\n  ^\n",
    );
    let done = check(&bench, &["5", "temperature < 3 bar", "--for", "1s", "--sync", "10ms"]).exit(2);
    assert_eq!(
        done.stderr,
        "cangauge: units do not match: temperature is in degC, 3 bar is in bar\n  temperature < 3 bar\n                ^\n"
    );
    assert_eq!((done.frames_of("000").len(), done.frames_of("080").len()), (0, 0), "nothing was started");
}

#[test]
fn each_sample_of_a_recording_is_checked() {
    let bench = constant();
    let done =
        check(&bench, &["5,127", "pressure < 4 bar", "rate(pressure) in 5..200", "--for", "2s", "--sync", "10ms"]);
    let lines: Vec<&str> = done.stdout.lines().collect();
    assert_eq!(lines[0], "ok    5    pressure < 4 bar          1.25 bar (n 200, 1.25..1.25)", "{}", done.stderr);
    assert!(lines[1].starts_with("ok    127  pressure < 4 bar          3.447379 bar (n "), "{}", lines[1]);
    assert!(lines[2].starts_with("ok    5    rate(pressure) in 5..200  100.0"), "{}", lines[2]);
    assert_eq!(done.frames_of("080").len(), 200);
    done.exit(0);
    // With --poll no node is started.
    let done = check(&bench, &["5", "mean(temperature) == 25.5", "--for", "1s", "--poll", "100ms"]);
    assert_eq!(done.stdout, "ok    mean(temperature) == 25.5  25.5 degC (n 10)\n");
    assert_eq!(done.exit(0).frames_of("000"), [""; 0]);
}

#[test]
fn an_invalid_sample_fails() {
    let words = ["5", "pressure < 1000", "invalid(pressure) in 15..25", "mean(pressure) < 1000", "--for", "1s"];
    let done = check(&overloaded(), &[&words[..], &["--sync", "10ms"]].concat()).exit(1);
    let lines: Vec<&str> = done.stdout.lines().collect();
    assert!(lines[0].starts_with("FAIL  pressure < 1000              overload-high at 0."), "{}", lines[0]);
    assert!(lines[0].contains(" (n 100, ") && lines[0].contains(" invalid, "), "{}", lines[0]);
    assert!(lines[1].starts_with("ok    invalid(pressure) in 15..25  "), "{}", lines[1]);
    assert!(lines[2].starts_with("FAIL  mean(pressure) < 1000  "), "{}", lines[2]);
    let last = done.stderr.lines().last().expect("an error");
    assert!(last.starts_with("cangauge: 2 of 3 checks failed: node 5: pressure < 1000: overload-high at 0."), "{last}");
    let always = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n[[device.overload]]\nchannel = 1\nfrom = \"0s\"\ndirection = \"low\"\n",
    );
    let done = check(&always, &["5", "pressure < 1000", "not pressure > 1000"]).exit(1);
    assert_eq!(done.stdout, "FAIL  pressure < 1000      overload-low\nFAIL  not pressure > 1000  overload-low\n");
}

#[test]
fn missing_data_is_an_error() {
    let bench = constant();
    let done = check(&bench, &["9", "pressure < 3"]).exit(3);
    assert_eq!(done.stdout, "none  pressure < 3  no data: node 9: read 0x1000:0: no answer within 500 ms\n");
    assert_eq!(
        done.stderr,
        "cangauge: node 9: read 0x1000:0: no answer within 500 ms\nhint: check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor 9\n"
    );
    // A failed check has priority over missing data.
    check(&bench, &["5,9", "pressure < 3"]).exit(7);
    let done = check(&bench, &["5,9", "pressure < 1", "|5.pressure - 9.pressure| < 1"]).exit(1);
    let words: Vec<&str> = done.stdout.lines().map(|line| &line[..6]).collect();
    assert_eq!(words, ["FAIL  ", "none  ", "none  "], "{}", done.stdout);
    let done = check(&bench, &["5", "pressure < 3", "0x5000:1/u8 < 3"]).exit(4);
    assert!(done.stdout.ends_with("(0x06020000, the object does not exist)\n"), "{}", done.stdout);
    // A TPDO that waits for SYNC.
    let done = check(&bench, &["5", "pressure < 3", "--for", "1s"]).exit(3);
    assert!(
        done.stdout.starts_with("none  pressure < 3  no data: node 5: no measurements within 1 s: "),
        "{}",
        done.stdout
    );
    let done = check(&bench, &["5", "noise(pressure) < 3", "--for", "100ms", "--poll", "1s"]).exit(3);
    assert_eq!(done.stdout, "none  noise(pressure) < 3  no data: too few samples\n");
}

#[test]
fn json_and_csv() {
    let bench = constant();
    let rows = check(&bench, &["5,127", "pressure < 2 bar", "-f", "json"]).exit(1).json();
    assert_eq!(
        rows[0],
        json!({"expression": "pressure < 2 bar", "node": 5, "verdict": "ok", "count": 1, "violations": 0, "invalid": 0,
            "values": [{"quantity": "pressure", "value": 1.25, "unit": "bar", "min": null, "max": null}],
            "first": null, "reason": null, "findings": "1.25 bar"})
    );
    assert_eq!((&rows[1]["verdict"], &rows[1]["violations"]), (&json!("fail"), &json!(1)));
    assert_eq!(
        rows[1]["first"]["values"],
        rows[1]["values"].as_array().map_or(json!(null), |all| json!([all[0]["value"]]))
    );
    check(&bench, &["127", "pressure < 51", "-f", "csv"])
        .prints("expression,node,verdict,count,violations,invalid,findings\npressure < 51,127,ok,1,0,0,50.000 psi\n");
}

#[test]
fn junit_reports() {
    let bench = constant();
    let words = ["5", "pressure < 1 bar", "temperature > 20", "--junit", "report.xml"];
    let done = check(&bench, &words).exit(1);
    assert_eq!(done.stdout.lines().count(), 2);
    let report = bench.text("report.xml");
    assert!(report.starts_with("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites "), "{report}");
    assert!(report.contains(" tests=\"2\" failures=\"1\" errors=\"0\" "), "{report}");
    assert!(report.contains("<testcase classname=\"cangauge.node-5\" name=\"pressure &lt; 1 bar\""), "{report}");
    assert!(report.contains("message=\"1.25 bar\">pressure &lt; 1 bar: 1.25 bar</failure>"), "{report}");
    assert_eq!(report.matches("<testcase ").count(), 2);
    // An existing report is replaced only if there is a result.
    fs::write(bench.path("report.xml"), "old").expect("written");
    check(&bench, &["5", "presure < 1", "--junit", "report.xml"]).exit(2);
    assert_eq!(bench.text("report.xml"), "old");
    check(&bench, &words).exit(1);
    assert_eq!(bench.text("report.xml"), report.replace(timestamp(&report), timestamp(&bench.text("report.xml"))));
    // No answer: an error for each expression. Wrong arguments: no file.
    check(&bench, &["9", "pressure < 1", "--junit", "silent.xml", "--for", "1s"]).exit(3);
    assert!(
        bench.text("silent.xml").contains(" tests=\"1\" failures=\"0\" errors=\"1\" "),
        "{}",
        bench.text("silent.xml")
    );
    check(&bench, &["5", "presure < 1", "--junit", "wrong.xml"]).exit(2);
    assert_eq!(bench.files(), ["report.xml", "silent.xml"]);
}

#[test]
fn github_annotations_and_step_summary() {
    let bench = constant();
    let words = ["check", "5", "pressure < 1 bar", "temperature > 20 degC", "-q"];
    let run = |words: &[&str], variables: &[(&str, &str)]| {
        let mut command = bench.traced(words);
        command.envs(variables.iter().copied());
        bench.finish(&mut command)
    };
    let lines = "::error title=cangauge check node 5::pressure < 1 bar: 1.25 bar\n\
                 ::notice title=cangauge check node 5::temperature > 20 degC: 25.5 degC\n";
    let error = "cangauge: 1 of 2 checks failed: node 5: pressure < 1 bar: 1.25 bar\n";
    assert_eq!(run(&words, &[("GITHUB_ACTIONS", "false")]).exit(1).stderr, error);
    let done = run(&words, &[("GITHUB_ACTIONS", "true"), ("GITHUB_STEP_SUMMARY", "summary.md")]).exit(1);
    assert_eq!(done.stderr, [lines, error].concat());
    let row =
        "| **FAIL** | 5 | pressure &#60; 1 bar | 1.25 bar |\n| ok | 5 | temperature &#62; 20 degC | 25.5 degC |\n";
    assert!(bench.text("summary.md").contains(row), "{}", bench.text("summary.md"));
    // Also without an answer. The table of an earlier step is kept.
    let silent = ["check", "9", "pressure < 1 bar", "--annotate", "github"];
    let done = run(&silent, &[("GITHUB_STEP_SUMMARY", "summary.md")]).exit(3);
    assert!(
        done.stderr.starts_with("::error title=cangauge check node 9::pressure < 1 bar: no data: "),
        "{}",
        done.stderr
    );
    assert!(bench.text("summary.md").contains(row) && bench.text("summary.md").contains("| **no data** | 9 |"));
}

fn timestamp(report: &str) -> &str {
    report.split("timestamp=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("a timestamp")
}

#[test]
fn log_with_expressions() {
    let bench = constant();
    let log = |more: &[&str]| {
        bench.run_words(&[&["log", "5", "--sync", "10ms", "--count", "20", "-o", "run.csv", "--force"], more].concat())
    };
    let done = log(&["--expect", "pressure in 1..2 bar", "--expect", "rate(pressure) > 50"]).exit(0);
    assert!(done.stderr.contains("ok: node 5: pressure in 1..2 bar: 1.25 bar (n "), "{}", done.stderr);
    let done = log(&["--expect", "pressure < 1 bar", "--summary", "summary.json"]).exit(1);
    assert!(done.stderr.contains("warning: failed: node 5: pressure < 1 bar: 1.25 bar at "), "{}", done.stderr);
    let last = done.stderr.lines().last().expect("an error");
    assert!(last.starts_with("cangauge: 1 of 1 check failed: node 5: pressure < 1 bar: 1.25 bar at "), "{last}");
    assert_eq!(bench.text("run.csv").lines().count(), 21, "the file stays");
    assert!(bench.text("summary.json").contains("\"rows\":20"));
    log(&["--expect", "6.pressure < 1"]).refuses("node 6 is not one of the given nodes");
    bench
        .run_words(&["log", "5", "pressure", "--sync", "10ms", "--count", "2", "--expect", "temperature < 1"])
        .refuses("temperature is not recorded");
    let done = log(&["--expect", "pressure < 1 degC"]).exit(2);
    assert_eq!(done.frames_of("000"), [""; 0], "nothing was started");
    // An object that is not mapped is not received.
    let done = log(&["--expect", "0x1001:0 == 0"]).exit(3);
    assert!(done.stderr.contains("no data for 1 of 1 check"), "{}", done.stderr);
}

#[test]
fn limits_without_a_unit_are_reported() {
    let bench = constant();
    let warning =
        |number, unit| format!("warning: limit {number} has no unit: the unit of the device ({unit}) is used\n");
    let done = check(&bench, &["5", "pressure < 5", "temperature in 20..30 degC"]).exit(0);
    assert_eq!(done.stderr, warning("5", "bar"));
    let done = check(&bench, &["5,127", "pressure > 5"]).exit(1);
    assert!(done.stderr.starts_with(&(warning("5", "bar") + &warning("5", "psi"))), "{}", done.stderr);
    assert_eq!(
        check(&bench, &["5", "temperature < 60", "--for", "1s", "--poll", "200ms"]).stderr,
        warning("60", "degC")
    );
    let log = |expression| bench.run_words(&["log", "5", "--sync", "10ms", "--count", "2", "--expect", expression]);
    let done = log("pressure in 1..2").exit(0);
    assert!(done.stderr.contains(&warning("1..2", "bar")), "{}", done.stderr);
    assert!(!log("pressure in 1..2 bar").exit(0).stderr.contains("has no unit"));
}

#[test]
fn a_passive_log_learns_units_from_the_traffic() {
    let bench = Bench::described(
        "[[device]]\nkind = \"dps\"\nnode = 5\nstart = true\n\
         [[device.channel]]\nchannel = 1\nbase = 50.0\namplitude = 0.0\nnoise = 0.0\n",
    );
    let log = |expression| {
        bench.run_words(&["log", "5", "--passive", "--device", "dps", "--count", "9", "--expect", expression])
    };
    let done = log("pressure in 49..51").exit(0);
    assert!(done.stderr.contains("ok: node 5: pressure in 49..51: 50.000"), "{}", done.stderr);
    log("5.pressure < 49").exit(1);
    let done = log("temperature < 49").exit(3);
    assert!(done.stderr.contains("temperature < 49: no data: none of its signals was received"), "{}", done.stderr);
}

#[test]
fn a_replayed_recording_is_checked_completely() {
    let bench = constant();
    bench.run("log 5,127 --sync 10ms --duration 2s").exit(0);
    fs::rename(bench.path("trace"), bench.path("t.log")).expect("the trace");
    let replay = |words: &[&str]| bench.finish(&mut bench.command(&[&["-b", "replay:t.log", "check"], words].concat()));
    let done = replay(&["5,127", "pressure < 4 bar", "rate(pressure) > 1"]).exit(0);
    assert!(
        done.stdout.starts_with("ok    5    pressure < 4 bar    1.25 bar (n 200, 1.25..1.25)\n"),
        "{}",
        done.stdout
    );
    assert_eq!(done.stdout.lines().count(), 4);
    replay(&["all", "pressure < 2 bar"]).exit(1);
    // A named node that is not in the recording is an error.
    let done = replay(&["5,9", "pressure < 2 bar"]).exit(7);
    assert!(
        done.stdout.contains("none  9  pressure < 2 bar  no data: node 9 sent none of its signals\n"),
        "{}",
        done.stdout
    );
    replay(&["5", "humidity < 2"]).exit(2);
    replay(&["5", "pressure < 2 degC"]).exit(2);
    replay(&["5", "pressure < 2", "--for", "1s", "--poll", "10ms"])
        .refuses("a recording (replay:) is receive-only: --sync, --poll and --request send");
}

#[test]
#[cfg(unix)]
fn an_interrupted_check_prints_no_verdict() {
    let bench = Bench::real("mh4@1");
    let check = ["check", "1", "pressure < 1000", "--for", "1h", "--poll", "10ms", "--junit", "r.xml"];
    let mut command = bench.command(&[&["-b", &bench.bus, "--trace", "-"], &check[..]].concat());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
    let mut reader = BufReader::new(child.stderr.take().expect("stderr"));
    let mut line = String::new();
    while !line.contains("601#40306101") {
        line.clear();
        assert!(reader.read_line(&mut line).expect("a line") > 0, "it ended before the first measurement");
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(killed.success());
    let mut rest = String::new();
    reader.read_to_string(&mut rest).expect("the rest");
    let output = child.wait_with_output().expect("its end");
    assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(130), &b""[..]), "{rest}");
    assert!(rest.ends_with("cangauge: interrupted\n"), "{rest}");
    assert!(bench.text("r.xml").contains(" errors=\"1\""));
}

/// Noise of 0.5 bar, evenly distributed (standard deviation 0.29 bar), at the input of an MH-4.
#[test]
fn a_filter_reduces_noise() {
    let noisy = |set: &str| {
        Bench::described(&format!(
            "[[device]]\nkind = \"mh4\"\nnode = 5\nset = {{ {set} }}\n\
             [[device.channel]]\nchannel = 1\nbase = 5.0\namplitude = 0.0\nnoise = 0.5\n"
        ))
    };
    let words = ["5", "noise(pressure) < 0.1", "--for", "2s", "--sync", "20ms"];
    check(&noisy(""), &words).exit(1);
    check(&noisy("\"0x61A0:1\" = 1, \"0x61A1:1\" = 100"), &words).exit(0);
    check(&noisy("\"0x61A0:1\" = 2, \"0x61A1:1\" = 30"), &words).exit(0);
    check(&noisy("\"0x61A0:1\" = 0, \"0x61A1:1\" = 100"), &words).exit(1);
}
