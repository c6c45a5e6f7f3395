//! The layouts of a log: wide rows, delimiters, decimal signs, times.

use super::{Bench, Done};
use std::collections::{BTreeMap, BTreeSet};

/// The cells of each line.
fn cells(csv: &str) -> Vec<Vec<String>> {
    csv.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// Time, value and status by signal, from the long layout.
fn long(bench: &Bench, line: &str) -> BTreeMap<String, Vec<[String; 3]>> {
    let done = bench.run(line).exit(0);
    let mut signals: BTreeMap<String, Vec<[String; 3]>> = BTreeMap::new();
    for row in &cells(&done.stdout)[1..] {
        let [time, _, node, signal, value, _, status, _] = row.as_slice() else { panic!("{row:?}") };
        let value = [time, value, status].map(String::clone);
        signals.entry(format!("{node}.{signal}")).or_default().push(value);
    }
    signals
}

#[test]
fn wide_has_a_row_per_sync_with_the_values_of_the_long_layout() {
    let bench = || Bench::of("mh4@1,dps@127");
    let long = long(&bench(), "log 1,127 --sync 10ms --duration 1s");
    let wide = cells(&bench().run("log 1,127 --sync 10ms --duration 1s --layout wide").exit(0).stdout);
    let head = "time,elapsed_s,1.pressure [bar],1.pressure.status,1.temperature [degC],1.temperature.status,\
                127.pressure [psi],127.pressure.status";
    assert_eq!(wide[0].join(","), head);
    assert_eq!(wide.len() - 1, 100, "one a SYNC");
    for (column, name) in [(2, "1.pressure"), (4, "1.temperature"), (6, "127.pressure")] {
        let given = wide[1..].iter().map(|row| [row[column].clone(), row[column + 1].clone()]);
        let given: Vec<[String; 2]> = given.filter(|[value, _]| !value.is_empty()).collect();
        let wanted: Vec<[String; 2]> =
            long.get(name).into_iter().flatten().map(|[_, value, status]| [value.clone(), status.clone()]).collect();
        assert_eq!(given, wanted, "{name}");
    }
    // The DPS sends only ten times a second: its other cells are empty.
    assert!(long["127.pressure"].len() < 11 && long["1.pressure"].len() == 100);
    let times: BTreeSet<&String> = long.values().flatten().map(|[time, ..]| time).collect();
    for (at, row) in wide[1..].iter().enumerate() {
        assert!(times.contains(&row[0]), "the time is that of a value");
        let seconds: f64 = row[1].parse().expect("elapsed_s");
        assert!((seconds - 0.01 * at as f64).abs() < 0.002, "{row:?}");
        assert_eq!(row.len(), 8);
    }
}

#[test]
fn wide_rows_of_polling_and_as_json() {
    let bench = || Bench::of("mh4@1,dps@127");
    let line = "log 1,127 pressure --poll 100ms --count 20 --layout wide";
    let wide = cells(&bench().run(line).exit(0).stdout);
    assert_eq!(wide.len(), 21, "--count counts lines");
    assert!(wide[1..].iter().all(|row| row.iter().filter(|cell| cell.is_empty()).count() == 1), "{wide:?}");
    let json = bench().run(&format!("{line} --format json")).exit(0).json();
    assert_eq!(json.len(), 20);
    for (row, object) in wide[1..].iter().zip(&json) {
        for (name, cell) in wide[0].iter().zip(row) {
            let value = match &object[name] {
                serde_json::Value::Null => String::new(),
                serde_json::Value::String(text) => text.clone(),
                number => number.to_string(),
            };
            match (cell.parse::<f64>(), value.parse::<f64>()) {
                // Parsing JSON may miss the last bit.
                (Ok(cell), Ok(value)) => assert!((cell - value).abs() < 1e-12, "{name}: {cell} {value}"),
                _ => assert_eq!(*cell, value, "{name}"),
            }
        }
        assert_eq!(object.as_object().map(serde_json::Map::len), Some(6));
    }
}

#[test]
fn late_answer_is_in_the_row_of_its_poll() {
    // The second device answers after one and a half cycles: it is asked for its error register and its value.
    let bench = Bench::described(
        "[[device]]\nkind = \"dps\"\nnode = 1\n[[device]]\nkind = \"dps\"\nnode = 2\nlatency = \"75ms\"\n",
    );
    let done = bench.run("log 1,2 pressure --poll 100ms --count 6 --layout wide");
    let rows = cells(&done.exit(0).stdout);
    let given: Vec<(bool, bool)> = rows[1..].iter().map(|row| (!row[2].is_empty(), !row[4].is_empty())).collect();
    assert_eq!(given, [(true, true), (true, false), (true, true), (true, false), (true, true), (true, false)]);
}

#[test]
fn silent_node_has_empty_cells() {
    let done = Bench::of("mh4@1,dps@127").run("log 1,127 --sync 1s --count 3 --layout wide --no-nmt");
    assert_eq!(done.code, Some(3), "no node was started: {}", done.stderr);
    let bench =
        Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\nstart = true\n[[device]]\nkind = \"mh4\"\nnode = 2\n");
    let done = bench.run("log 1,2 pressure --sync 100ms --count 5 --layout wide --no-nmt").exit(7);
    let rows = cells(&done.stdout);
    assert_eq!(rows.len(), 6);
    assert!(rows[1..].iter().all(|row| !row[2].is_empty() && row[4].is_empty() && row[5].is_empty()), "{rows:?}");
    // The fifth row is written one cycle later, when its values cannot arrive any more.
    assert!(done.frames_of("080").len() <= 7, "{}", done.frames_of("080").len());
    assert!(done.stderr.contains("5 rows in "), "{}", done.stderr);
}

#[test]
fn second_value_in_a_cycle_is_omitted_and_counted() {
    let done = Bench::of("mh4@1,dps@127").run("log 1,127 --sync 1s --count 3 --layout wide --summary -").exit(0);
    let said = "values are not in any row: late, or not the first in their cycle (--layout long contains all values)";
    assert!(done.stderr.contains(said), "{}", done.stderr);
    let summary: serde_json::Value = serde_json::from_str(done.stdout.lines().last().expect("a line")).expect("JSON");
    assert_eq!(summary["rows"], 3);
    assert!(summary["values_left_out"].as_u64() > Some(15), "{summary}");
}

#[test]
fn changed_unit_starts_new_columns() {
    // A unit cannot change here, because log does not write. The unit tests of the rows check the new columns.
    let done = Bench::of("mh4@1").run("log 1 pressure pressure.status --sync 10ms --count 2 --layout wide").exit(0);
    let head = "time,elapsed_s,1.pressure [bar],1.pressure.status,1.pressure.status [code],1.pressure.status.status";
    assert_eq!(done.stdout.lines().next(), Some(head));
}

#[test]
fn separators_and_times_for_spreadsheets() {
    let plain = Bench::of("dps@127").run("log 127 --count 5").exit(0);
    let words = ["log", "127", "--count", "5", "--delimiter", ";", "--decimal", ",", "--bom", "--time", "excel"];
    let bench = Bench::of("dps@127");
    let other = bench.run_words(&words).exit(0);
    let text = other.stdout.strip_prefix('\u{feff}').expect("a byte order mark");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time;elapsed_s;node;signal;value;unit;status;raw"));
    for (line, plain) in lines.zip(plain.stdout.lines().skip(1)) {
        let (cells, plain): (Vec<&str>, Vec<&str>) = (line.split(';').collect(), plain.split(',').collect());
        let number = |text: &str| text.replace(',', ".").parse::<f64>().expect(line);
        assert!(cells[0].contains(',') && cells[4].contains(','), "{line}");
        // The virtual clock starts on 2026-01-01, which is day 46023.
        assert!((46023.0..46023.01).contains(&number(cells[0])), "{line}");
        assert_eq!((number(cells[1]), number(cells[4])), (number(plain[1]), number(plain[4])));
        assert_eq!((cells[2], cells[7]), (plain[2], plain[7]));
    }
    let unix = bench.run("log 127 --count 1 --time unix --format json").exit(0).json();
    assert!(
        unix[0]["time"].as_f64().is_some_and(|time| (1_767_225_600.0..1_767_225_700.0).contains(&time)),
        "{unix:?}"
    );
    let tabs = bench.run("log 127 --count 1 --delimiter tab").exit(0).stdout;
    assert!(tabs.starts_with("time\telapsed_s\tnode\t"), "{tabs}");
}

#[test]
fn contradicting_options_are_refused() {
    let bench = Bench::of("mh4@1");
    let wide = "--layout wide needs --sync, --poll or --request: each row is one of their cycles";
    bench.run("log 1 --layout wide").refuses(wide);
    bench.run("log 1 --layout wide --passive --device mh4").refuses(wide);
    bench.run("log 1 --sync 10ms --decimal ,").refuses("the decimal sign and the delimiter must differ");
    let error = bench.run("log 1 --sync 10ms --bom --format json").exit(2).error();
    assert_eq!(error["error"]["message"], "--delimiter, --decimal and --bom are for CSV");
    bench.run("log 1 --sync 10ms --delimiter :").refuses("\":\" is not a delimiter (, ; | or tab)");
    bench.run("log 1 --sync 10ms -o a.csv --events a.csv").refuses("a.csv is used for two outputs");
    assert_eq!(bench.files(), [""; 0]);
    let hint = |done: Done| done.stderr.lines().nth(1).map(str::to_owned);
    assert_eq!(hint(bench.run("log 1 --decimal ,")).as_deref(), Some("hint: add --delimiter ';'"));
}
