//! `cangauge log --rotate`: many files of one recording.

use super::Bench;
use std::fs;

const HEADER: &str = "time,elapsed_s,node,signal,value,unit,status,raw\n";

/// The rows of the files without headers, in order.
fn rows(bench: &Bench, names: &[String]) -> String {
    let rows = |name: &String| bench.text(name).strip_prefix(HEADER).expect(name).to_owned();
    names.iter().map(rows).collect()
}

fn names(numbers: std::ops::RangeInclusive<u32>) -> Vec<String> {
    numbers.map(|number| format!("run-{number:04}.csv")).collect()
}

#[test]
fn rotation_by_time_keeps_each_row_once() {
    let whole = Bench::of("mh4@1").run("log 1 --sync 10ms --duration 5s").exit(0).stdout;
    let bench = Bench::of("mh4@1");
    bench.run("log 1 --sync 10ms --duration 5s -o run.csv --rotate 2s").prints("");
    assert_eq!(bench.files(), names(1..=3));
    assert_eq!(rows(&bench, &names(1..=3)), whole.strip_prefix(HEADER).expect("rows"));
    // Two signals, each 100 times a second. Each file starts at a multiple of two seconds.
    for (name, begin) in names(1..=3).iter().zip([0.0, 2.0, 4.0]) {
        let text = bench.text(name);
        let elapsed = |line: &str| line.split(',').nth(1).and_then(|cell| cell.parse::<f64>().ok()).expect(line);
        let times: Vec<f64> = text.lines().skip(1).map(elapsed).collect();
        assert!(times.iter().all(|&time| (begin..begin + 2.0).contains(&time)), "{name}");
        assert!(times[0] < begin + 0.01, "{name} begins at {}", times[0]);
    }
}

#[test]
fn rotation_by_size_keeps_each_row_once() {
    for line in ["--sync 10ms", "--sync 10ms --format json", "--sync 10ms --layout wide"] {
        let whole = Bench::of("mh4@1").run(&format!("log 1 {line} --duration 2s")).exit(0).stdout;
        let bench = Bench::of("mh4@1");
        bench.run(&format!("log 1 {line} --duration 2s -o run.csv --rotate 3kB")).exit(0);
        let files = bench.files();
        assert!(files.len() > 3 && files == names(1..=u32::try_from(files.len()).unwrap_or(0)), "{files:?}");
        let head = if line.contains("json") { "" } else { whole.split_inclusive('\n').next().expect("a line") };
        let texts: Vec<String> = files.iter().map(|name| bench.text(name)).collect();
        assert!(texts.iter().all(|text| text.len() <= 3000 && text.ends_with('\n')), "{line}");
        assert!(texts[..texts.len() - 1].iter().all(|text| text.len() > 2700), "{line}: they are filled");
        let rows: String = texts.iter().map(|text| text.strip_prefix(head).expect("a header")).collect();
        assert_eq!(rows, whole.strip_prefix(head).expect("a header"), "{line}");
    }
}

#[test]
fn existing_files_are_kept_without_force() {
    let bench = Bench::of("dps@127");
    fs::write(bench.path("run-0002.csv"), "old\n").expect("written");
    let log = "log 127 --duration 3s -o run.csv --rotate 1s";
    bench.run(log).refuses("run-0002.csv exists");
    assert_eq!(bench.files(), ["run-0002.csv"]);
    bench.run(&format!("{log} --force")).exit(0);
    assert_eq!(bench.files(), names(1..=3));
    assert!(bench.text("run-0002.csv").starts_with(HEADER));
    // Without measurements there is no file.
    Bench::of("mh4@1").run("log 1 -o run.csv --rotate 1s").exit(3);
    bench.run("log 9 -o other.csv --rotate 1s").exit(3);
    assert_eq!(bench.files(), names(1..=3));
    bench.run("log 127 --rotate 1s --count 1").exit(2);
    bench
        .run("log 127 --rotate 10M -o run.csv")
        .refuses("\"10M\" is neither a time nor a size (10m, 1h30m, 100MB, 1GiB)");
}

#[test]
fn append_continues_with_the_next_number() {
    let bench = Bench::of("dps@127");
    let log = "log 127 --duration 2s -o run.csv --rotate 1s --append";
    bench.run(log).exit(0);
    assert_eq!(bench.files(), names(1..=2));
    // A kill cut off its last line.
    let last = bench.text("run-0002.csv");
    fs::write(bench.path("run-0002.csv"), format!("{last}2026-01")).expect("written");
    bench.run(log).exit(0);
    assert_eq!((bench.files(), bench.text("run-0002.csv")), (names(1..=4), last));
    assert!(bench.text("run-0003.csv").starts_with(HEADER));
    fs::write(bench.path("run-0009.csv"), "a,b\n").expect("written");
    bench.run(log).refuses(&format!("run-0010.csv has other columns: \"a,b\", not \"{}\"", HEADER.trim_end()));
    assert_eq!(bench.files().len(), 5);
}
