//! `cangauge log --tag`, the file of the run, and `--format influx`.

use super::Bench;
use serde_json::Value;

const HEADER: &str = "time,elapsed_s,node,signal,value,unit,status,raw";

/// The runs in a file of runs.
fn runs(bench: &Bench, file: &str) -> Vec<Value> {
    bench.text(file).lines().map(|line| serde_json::from_str(line).expect(line)).collect()
}

#[test]
fn tags_are_constant_columns_after_the_others() {
    let bench = Bench::of("dps@127");
    bench.run("log 127 --count 2 -o plain.csv").exit(0);
    bench.run("log 127 --count 2 -o run.csv --tag bench=3 --tag part=P,1").exit(0);
    let plain = bench.text("plain.csv");
    let mut expected = plain.lines();
    let tagged = bench.text("run.csv");
    let mut lines = tagged.lines();
    assert_eq!(lines.next(), Some(format!("{HEADER},bench,part").as_str()));
    assert_eq!(expected.next(), Some(HEADER));
    assert!(lines.all(|line| line.ends_with(",3,\"P,1\"") && line.split(',').count() == 11), "{tagged}");

    bench.run("log 127 --count 1 -o run.csv --append --tag bench=4 --tag part=x").exit(0);
    assert!(bench.text("run.csv").ends_with(",4,x\n"));
    bench
        .run("log 127 --count 1 -o run.csv --append")
        .refuses(&format!("run.csv has other columns: \"{HEADER},bench,part\", not \"{HEADER}\""));

    let wide = bench.run("log 127 --sync 100ms --layout wide --count 1 --tag bench=3").exit(0).stdout;
    assert!(wide.lines().next().is_some_and(|line| line.ends_with(".status,bench")), "{wide}");
    assert!(wide.lines().nth(1).is_some_and(|line| line.ends_with(",3")), "{wide}");
}

#[test]
fn tags_are_members_of_json_lines() {
    let bench = Bench::of("dps@127");
    for layout in ["", " --sync 100ms --layout wide"] {
        let out = bench.run(&format!("log 127 --count 1 --format json --tag part=P\"7{layout}")).exit(0).stdout;
        let row: Value = serde_json::from_str(&out).expect("JSON");
        assert_eq!((&row["part"], &row["elapsed_s"]), (&"P\"7".into(), &0.0.into()), "{out}");
    }
    bench.run("log 127 --count 1 --format json --tag part=7 -o run.jsonl").exit(0);
    bench.run("log 127 --count 1 --format json --tag part=8 -o run.jsonl --append").exit(0);
    bench.run("log 127 --count 1 --format json -o run.jsonl --append").exit(2);
}

#[test]
fn wrong_tags_are_refused() {
    let bench = Bench::of("dps@127");
    for (tag, message) in [
        ("part", "\"part\" is not a tag (part=P107)"),
        ("7=x", "\"7\" is not a name of a tag (a letter, then letters, digits, _ or -)"),
        ("a.b=x", "\"a.b\" is not a name of a tag (a letter, then letters, digits, _ or -)"),
        ("node=5", "the name \"node\" has another meaning in recordings: choose another tag"),
        ("part=", "the value of the tag \"part\" must have 1 to 256 bytes"),
        ("part=a\\", "the value of the tag \"part\" must not contain \\ or control characters"),
    ] {
        let done = bench.run(&format!("log 127 --count 1 --tag {tag}")).exit(2);
        assert!(done.stderr.contains(message), "{tag}: {}", done.stderr);
    }
    bench.run("log 127 --count 1 --tag a=1 --tag a=2").refuses("the tag \"a\" is given twice");
}

#[test]
fn tagged_recordings_can_be_plotted() {
    let bench = Bench::of("dps@127");
    for (file, options) in [
        ("long.csv", ""),
        ("long.jsonl", " --format json"),
        ("wide.csv", " --sync 100ms --layout wide"),
        ("wide.jsonl", " --sync 100ms --layout wide --format json"),
    ] {
        bench.run(&format!("log 127 --count 5 --tag bench=3 --tag rig-2=a -o {file}{options}")).exit(0);
        let done = bench.run(&format!("plot {file}")).exit(0);
        assert!(done.stdout.contains("\nnode 127 pressure [psi]\n") && done.stderr.is_empty(), "{file}: {done:?}");
    }
}

#[test]
fn file_of_the_run_identifies_each_run() {
    let bench = Bench::of("dps@127");
    bench.run("log 127 --count 2 -o run.csv --tag part=P107").exit(0);
    let first = runs(&bench, "run.csv.run.json").remove(0);
    assert_eq!((&first["file"], &first["offset"]), (&"run.csv".into(), &0.into()));
    assert_eq!((&first["tags"]["part"], &first["nodes"][0]["node"]), (&"P107".into(), &127.into()));
    assert_eq!((&first["nodes"][0]["device"], &first["nodes"][0]["serial"]), (&"dps".into(), &20002.into()));
    assert!(
        bench.text("run.csv").lines().nth(1).is_some_and(|row| row.starts_with(first["started"].as_str().unwrap()))
    );
    let host = first["host"].as_str().expect("a host");
    assert_eq!(first["bench"], format!("{host}-sim"));

    let length = bench.text("run.csv").len();
    bench.run("log 127 --count 2 -o run.csv --tag part=P108 --append").exit(0);
    let both = runs(&bench, "run.csv.run.json");
    assert_eq!((both.len(), &both[0]), (2, &first), "a run that is continued keeps its entry");
    assert_eq!((&both[1]["offset"], &both[1]["file"]), (&length.into(), &"run.csv".into()));
    assert_ne!(both[0]["run"], both[1]["run"]);

    bench.run("log 127 --duration 2s -o part.csv --rotate 1s").exit(0);
    bench.run("log 127 --duration 2s -o part.csv --rotate 1s --append --tag bench=3").exit(2);
    bench.run("log 127 --duration 2s -o part.csv --rotate 1s --append").exit(0);
    let files: Vec<Value> = runs(&bench, "part.csv.run.json").iter().map(|run| run["file"].clone()).collect();
    assert_eq!(files, ["part-0001.csv", "part-0003.csv"], "rotated files share the file of the run");

    // Without rows there is no recording, so there is no run either.
    bench.run("log 9 -o none.csv").exit(3);
    assert!(!bench.path("none.csv.run.json").exists());
}

#[test]
fn line_protocol_has_one_line_for_each_value() {
    let bench = Bench::of("dps@127");
    let out = bench.run("log 127 --count 3 --format influx --tag part=a,b --tag bench=3").exit(0).stdout;
    assert_eq!(out.lines().count(), 3);
    for line in out.lines() {
        let (tags, rest) = line.split_once(' ').expect("fields");
        assert!(tags.starts_with("cangauge,part=a\\,b,bench=3,run="), "{line}");
        assert!(tags.ends_with(",node=127,signal=pressure,unit=psi"), "{line}");
        let (field, time) = rest.split_once(' ').expect("a time");
        assert!(field.starts_with("value=") && time.parse::<u64>().is_ok_and(|time| time > 1 << 60), "{line}");
    }
    let wide = bench.run("log 127 --sync 100ms --layout wide --count 1 --format influx").exit(0).stdout;
    assert!(wide.starts_with("cangauge,bench="), "{wide}");
    bench.run("log 127 --count 1 --format influx -o run.lp").exit(0);
    bench.run("log 127 --count 1 --format influx -o run.lp --append").exit(0);
    assert_eq!(bench.text("run.lp").lines().count(), 2);
    bench.run("log 127 --count 1 --format influx --time unix").refuses("line protocol has times in nanoseconds");
    bench.run("scan --format influx").refuses("--format influx is only for recordings (log)");
}
