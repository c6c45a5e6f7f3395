//! `cangauge plot`. Reading and drawing: `src/output/recording/tests.rs`, `src/output/plot/tests.rs`.

use super::{ALL, Bench};
use std::fs;

/// A bench with recordings of two nodes in both layouts and formats, in parts, and compressed.
fn recorded() -> Bench {
    let bench = Bench::of(ALL);
    bench.run("log 1,2 --sync 100ms --count 80 -o run.csv --events events.csv").exit(0);
    bench.run("log 1,2 --sync 100ms --count 20 --layout wide -o wide.csv").exit(0);
    bench.run("log 1,2 --sync 100ms --count 80 --format json -o run.json").exit(0);
    bench.run("log 1,2 --sync 100ms --count 120 -o parts.csv --rotate 1s").exit(0);
    bench
}

#[test]
fn plots_of_all_files_of_log() {
    let bench = recorded();
    for file in ["run.csv", "wide.csv", "run.json", "parts.csv", "parts-0001.csv parts-0002.csv"] {
        let done = bench.run(&format!("plot {file} --events events.csv")).exit(0);
        assert!(done.stdout.contains("\npressure [bar]\n"), "{file}\n{}", done.stdout);
        assert!(done.stdout.contains(" 1 node 1\n") && done.stdout.contains(" 2 node 2\n"), "{file}\n{}", done.stdout);
        assert_eq!(done.stderr, "", "{file}");
        assert!(!done.stdout.contains('\x1b') && done.stdout.lines().all(|line| line.chars().count() < 80));
    }
    let done = bench.run("plot run.csv --signal 1.pressure --elapsed --from 500ms --to 2s").exit(0);
    assert!(done.stdout.contains("node 1 pressure [bar]") && done.stdout.contains("elapsed [s]"), "{}", done.stdout);
    assert!(done.stdout.contains(" 1.0 ") && !done.stdout.contains(" 2.5"), "{}", done.stdout);
}

#[test]
fn pictures_replace_existing_ones() {
    let bench = recorded();
    fs::write(bench.path("run.svg"), "old").expect("written");
    bench.run("plot run.csv -o run.svg").exit(0);
    bench.run("plot run.csv -o run.PNG").exit(0);
    assert!(bench.text("run.svg").starts_with("<svg xmlns="));
    assert!(fs::read(bench.path("run.PNG")).expect("a picture").starts_with(b"\x89PNG"));
    assert!(bench.files().iter().all(|name| !name.ends_with(".tmp")), "{:?}", bench.files());
    bench.run("plot run.csv -o absent/run.svg").exit(8);
}

#[test]
fn wrong_files_and_options() {
    let bench = recorded();
    bench.run("plot absent.csv").exit(8);
    fs::write(bench.path("empty.csv"), "").expect("written");
    let done = bench.run("plot empty.csv").exit(8);
    assert_eq!(done.stderr, "cangauge: empty.csv: the file is empty\n");
    fs::write(bench.path("none.csv"), "time,elapsed_s,node,signal,value,unit,status,raw\n").expect("written");
    assert_eq!(bench.run("plot none.csv").exit(8).stderr, "cangauge: none.csv: no rows\n");
    fs::write(bench.path("frames.log"), "(1.000000) can0 181#00\n").expect("written");
    let done = bench.run("plot frames.log").exit(8);
    assert_eq!(
        done.stderr,
        "cangauge: frames.log: not a recording of log (CSV or JSON Lines)\n\
         hint: decode recorded frames first: cangauge -b replay:frames.log log all -o run.csv\n"
    );
    let done = bench.run("plot run.csv --signal presure").exit(2);
    assert_eq!(
        done.stderr,
        "cangauge: run.csv: no signal \"presure\" (nearest: pressure)\nhint: nodes in the recording: 1, 2\n"
    );
    bench.run("plot run.csv --signal 3.pressure").exit(2);
    let done = bench.run("plot run.csv -o run.pdf").exit(2);
    assert!(
        done.stderr.contains("\"run.pdf\": a plot is an SVG or PNG file: its name ends in .svg or .png"),
        "{done:?}"
    );
    bench.run("plot run.csv --from 1s --to 1s").refuses("--from must be before --to");
    bench.run("plot run.csv --from 1h").refuses("no values between --from and --to");
    bench
        .run("plot run.csv --elapsed --from 12:00")
        .refuses("with --elapsed, --from and --to are times since the start: 10m");
    bench.run("plot run.csv --format csv").refuses("a plot is a picture: omit --format");
}

#[test]
fn cut_off_line_is_a_warning() {
    let bench = recorded();
    let text = bench.text("run.csv");
    fs::write(bench.path("cut.csv"), &text[..text.len() - 8]).expect("written");
    let done = bench.run("plot cut.csv").exit(0);
    assert_eq!(done.stderr, "warning: cut.csv: the last line is incomplete, and was skipped\n");
    fs::write(bench.path("mixed.csv"), text.replacen("\n2", "\nhello\n2", 3)).expect("written");
    let done = bench.run("plot mixed.csv -o mixed.svg").exit(0);
    assert_eq!(done.stderr, "warning: mixed.csv: 3 lines are not rows, and were skipped (first: 2)\n");
}

#[test]
fn log_plots_at_the_end() {
    let bench = Bench::of(ALL);
    let done = bench.run("log 1,127 --sync 50ms --count 100 -o run.csv --plot").exit(0);
    assert!(done.stderr.contains("\nrun.csv\nnode 1 pressure [bar]\n"), "{}", done.stderr);
    assert!(done.stderr.contains("node 127 pressure [psi]\n") && done.stderr.contains(" ┤"), "{}", done.stderr);
    let done = bench.run("log 1 pressure --sync 50ms --count 10 --plot").exit(0);
    assert!(done.stdout.starts_with("time,") && !done.stdout.contains('┤'), "{}", done.stdout);
    assert!(done.stderr.contains("\nnode 1 pressure [bar]\n"), "{}", done.stderr);
}
