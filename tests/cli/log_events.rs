//! `cangauge log --events`: events during a recording, with their times.

use super::Bench;

const HEADER: &str = "time,elapsed_s,node,event,text";

fn overload() -> Bench {
    Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\n\
         [[device.overload]]\nchannel = 1\nfrom = \"700ms\"\nuntil = \"800ms\"\ndirection = \"high\"\n",
    )
}

#[test]
fn emergencies_have_the_time_of_the_rows() {
    let bench = overload();
    let done = bench.run("log 5 --sync 10ms --duration 1s -o run.csv --events events.csv").exit(0);
    let text = bench.text("events.csv");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(HEADER));
    let events: Vec<Vec<&str>> = lines.map(|line| line.splitn(5, ',').collect()).collect();
    assert_eq!(events.iter().map(|event| event[3]).collect::<Vec<_>>(), ["emcy", "emcy"], "{text}");
    assert_eq!(events[1][4], "node 5: emergency over (0000h)");
    for event in &events {
        assert_eq!((event.len(), event[2]), (5, "5"));
        let warning = format!("warning: {}", event[4].trim_matches('"'));
        assert!(done.stderr.lines().any(|line| line == warning), "{warning}: the same words as on stderr");
    }
    // Both times of an event are between those of the row before and of the row after it.
    let rows = bench.text("run.csv");
    let first_bad = rows.lines().position(|line| line.contains("overload-high")).expect("a row");
    let near = |line: Option<&str>, column: usize| line.and_then(|line| line.split(',').nth(column)).map(str::to_owned);
    for column in [0, 1] {
        let (before, behind) =
            (near(rows.lines().nth(first_bad - 2), column), near(rows.lines().nth(first_bad + 2), column));
        let event = Some(events[0][column].to_owned());
        assert!(before <= event && event <= behind, "{before:?} {event:?} {behind:?}");
    }
}

#[test]
fn file_without_events_has_a_header() {
    let bench = Bench::of("dps@127");
    bench.run("log 127 --count 3 --events events.csv").exit(0);
    assert_eq!(bench.text("events.csv"), format!("{HEADER}\n"));
    bench.run("log 127 --count 3 --events events.csv").refuses("events.csv exists");
    bench.run("log 127 --count 3 --events events.csv --force").exit(0);
    bench.run("log 9 --events other.csv").exit(3);
    assert_eq!(bench.files(), ["events.csv"], "and of none there is none");
}

#[test]
fn events_use_the_separators_of_the_rows_and_are_continued() {
    let bench = overload();
    let words =
        "log 5 --sync 10ms --duration 1s -o run.csv --events events.csv --append --delimiter ; --decimal , --time unix";
    bench.run(words).exit(0);
    bench.run(words).exit(0);
    let text = bench.text("events.csv");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!((lines[0], lines.len()), ("time;elapsed_s;node;event;text", 5));
    let cells: Vec<&str> = lines[1].split(';').collect();
    assert!(cells[0].starts_with("17672256") && cells[0].contains(','), "{}", cells[0]);
    assert!(cells[1].starts_with("0,"), "{}", cells[1]);
    bench.run("log 5 --sync 10ms --events events.csv -o new.csv --append").exit(2);
}
