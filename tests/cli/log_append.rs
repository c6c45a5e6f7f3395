//! `cangauge log --append`: files that are continued.

use super::Bench;
use std::fs;

const HEADER: &str = "time,elapsed_s,node,signal,value,unit,status,raw";

#[test]
fn second_run_continues_the_file() {
    let bench = Bench::of("dps@127");
    bench.run("log 127 --count 3 -o run.csv --append").exit(0);
    let first = bench.text("run.csv");
    assert_eq!((first.lines().next(), first.lines().count()), (Some(HEADER), 4), "a new file has its header");
    bench.run("log 127 --count 2 -o run.csv --append --summary sum.json --append").exit(2);
    bench.run("log 127 --count 2 -o run.csv --append --summary sum.json").exit(0);
    let both = bench.text("run.csv");
    let rest = both.strip_prefix(&first).expect("the old content stays");
    assert_eq!(rest.lines().count(), 2);
    // elapsed_s counts from the first row of its run.
    assert_eq!(rest.lines().next().and_then(|line| line.split(',').nth(1)), Some("0.000000"));
    // The summary has one line for each run.
    bench.run("log 127 --count 1 -o run.csv --append --summary sum.json").exit(0);
    let summary = bench.text("sum.json");
    let rows: Vec<serde_json::Value> = summary.lines().map(|line| serde_json::from_str(line).expect(line)).collect();
    assert_eq!((&rows[0]["rows"], &rows[1]["rows"], rows.len()), (&2.into(), &1.into(), 2));
}

#[test]
fn cut_off_line_is_removed() {
    let bench = Bench::of("dps@127");
    bench.run("log 127 --count 3 -o run.csv").exit(0);
    let whole = bench.text("run.csv");
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    // Killed at any byte of the last line, or of the header.
    for (kept, cut) in [(3, 1), (3, 40), (3, lines[3].len() - 1), (0, 5)] {
        fs::write(bench.path("run.csv"), lines[..kept].concat() + &lines[kept][..cut]).expect("written");
        bench.run("log 127 --count 1 -o run.csv --append").exit(0);
        let text = bench.text("run.csv");
        let before = lines[..kept.max(1)].concat();
        let rest = text.strip_prefix(&before).expect("whole lines stay");
        assert_eq!((rest.lines().count(), rest.split(',').count()), (1, 8), "{kept} {cut}: {text}");
        assert!(rest.ends_with('\n'));
    }
    // The file is not changed before the first row.
    fs::write(bench.path("run.csv"), lines[..2].concat() + "2026").expect("written");
    bench.run("log 9 -o run.csv --append").exit(3);
    assert_eq!(bench.text("run.csv"), lines[..2].concat() + "2026");
}

#[test]
fn other_columns_are_refused() {
    let bench = Bench::of("mh4@1,dps@127");
    fs::write(bench.path("run.csv"), "a,b\n1,2\n3").expect("written");
    bench
        .run("log 127 --count 3 -o run.csv --append")
        .refuses(&format!("run.csv has other columns: \"a,b\", not \"{HEADER}\""));
    bench.run("log 127 --format json --count 3 -o run.csv --append").exit(2);
    assert_eq!(bench.text("run.csv"), "a,b\n1,2\n3");
    bench.run("log 127 --count 3 -o run.csv --append --force").exit(2);
    // The columns of the wide layout are known only after the setup is read. No state is changed before.
    bench.run("log 127 --poll 100ms --count 3 --layout wide -o wide.csv").exit(0);
    let wide = bench.text("wide.csv");
    let done = bench.run("log 1,127 --sync 100ms --count 3 --layout wide -o wide.csv --append").exit(2);
    assert!(
        done.stderr.contains(
            "wide.csv has other columns: \"time,elapsed_s,127.pressure [psi],127.pressure.status\", \
             not \"time,ela"
        ),
        "{}",
        done.stderr
    );
    assert_eq!((done.frames_of("000"), bench.text("wide.csv")), (vec![], wide.clone()));
    bench.run("log 127 --poll 100ms --count 2 --layout wide -o wide.csv --append").exit(0);
    assert_eq!(bench.text("wide.csv").strip_prefix(&wide).map(|rest| rest.lines().count()), Some(2));
}

#[test]
fn json_lines_and_files_with_byte_order_mark_are_continued() {
    let bench = Bench::of("dps@127");
    for _ in 0..2 {
        bench.run("log 127 --count 2 --format json -o run.json --append").exit(0);
        bench.run_words(&["log", "127", "-n", "2", "--bom", "--delimiter", ";", "-o", "run.csv", "--append"]).exit(0);
    }
    assert_eq!(bench.text("run.json").lines().filter(|line| line.starts_with("{\"time\":")).count(), 4);
    let csv = bench.text("run.csv");
    assert_eq!((csv.matches("time").count(), csv.matches('\u{feff}').count(), csv.lines().count()), (1, 1, 5));
    bench.run("log 127 --count 2 -o run.csv --append").exit(2);
}
