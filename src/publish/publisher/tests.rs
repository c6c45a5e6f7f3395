mod restarts;

use super::*;
use crate::bus::Mono;
use crate::publish::position::PositionError;
use crate::publish::sink::Rejection;
use std::collections::BTreeMap;
use std::fs;
use std::sync::{Arc, Mutex};
use tempfile::TempDir;

const HEADER: &str = "time,elapsed_s,node,signal,value,unit,status,raw\n";

/// A database in memory. The same row overwrites itself.
#[derive(Debug, Default)]
struct Database {
    rows: BTreeMap<String, u64>,
    /// Requests so far.
    requests: usize,
    /// The answer to each request, by its number; the others are acknowledged.
    script: BTreeMap<usize, Answer>,
    /// Rows with these values are never accepted.
    bad: Vec<String>,
    /// Whether the reason for a rejection is about rows.
    names_rows: bool,
    /// The most bytes of a request.
    most_bytes: Option<usize>,
    /// Whether the database answers that it rejects every request.
    rejects_everything: bool,
}

#[derive(Clone, Copy, Debug)]
enum Answer {
    /// The rows are stored, and the acknowledgement is lost.
    Lost,
    /// Half of the rows is stored.
    Half,
    /// Nothing is stored.
    Nothing,
}

#[derive(Clone, Debug, Default)]
struct Script(Arc<Mutex<Database>>);

impl Sink for Script {
    fn encode(&mut self, record: &Record<'_>, out: &mut Vec<u8>) {
        let value = String::from_utf8_lossy(record.row.value.as_deref().unwrap_or_default()).into_owned();
        let Origin { run, bench, file, tags, .. } = record.origin;
        let run = run.as_deref().unwrap_or("-");
        let tags: String = tags.iter().map(|(key, value)| format!(" {key}={value}")).collect();
        let identity: String =
            record.origin.identity(record.row.node).iter().map(|(key, value)| format!(" {key}={value}")).collect();
        out.extend(format!("{run} {bench} {file}:{} {value}{tags}{identity}\n", record.line).bytes());
    }

    fn send(&mut self, rows: &[u8], _now: Wall) -> Result<(), SendError> {
        let mut database = self.0.lock().expect("not poisoned");
        let number = database.requests;
        database.requests += 1;
        let lines: Vec<String> = String::from_utf8_lossy(rows).lines().map(str::to_owned).collect();
        if database.rejects_everything {
            return Err(SendError::Rejected(Rejection { reason: "no".to_owned(), ..Rejection::default() }));
        }
        if database.most_bytes.is_some_and(|most| rows.len() > most) {
            return Err(SendError::TooLarge);
        }
        let answer = database.script.get(&number).copied();
        let stored = match answer {
            Some(Answer::Nothing) => 0,
            Some(Answer::Half) => lines.len() / 2,
            Some(Answer::Lost) | None => lines.len(),
        };
        let is_bad = |line: &String, bad: &[String]| bad.iter().any(|value| line.contains(&format!(" {value}")));
        let bad = lines.iter().filter(|line| is_bad(line, &database.bad)).count();
        let good: Vec<String> =
            lines.iter().take(stored).filter(|line| !is_bad(line, &database.bad)).cloned().collect();
        good.into_iter().for_each(|line| *database.rows.entry(line).or_default() += 1);
        match answer {
            Some(_) => Err(Trouble::Closed.into()),
            None if bad > 0 => {
                let is_about_rows = database.names_rows;
                Err(SendError::Rejected(Rejection { reason: "bad".to_owned(), is_about_rows, dropped: None }))
            }
            None => Ok(()),
        }
    }
}

fn options() -> Options {
    Options {
        follow: false,
        start: Start::Start,
        give_up: Duration::from_secs(30),
        tags: Vec::new(),
        identity: false,
        bench: "lab".to_owned(),
    }
}

fn at(seconds: f64) -> Stamp {
    let since = Duration::from_secs_f64(seconds);
    Stamp { mono: Mono::at(since), wall: Wall::at(Duration::from_secs(1_700_000_000) + since) }
}

struct Bench {
    folder: TempDir,
    database: Script,
    options: Options,
}

impl Bench {
    fn new(text: &str) -> Bench {
        let bench =
            Bench { folder: tempfile::tempdir().expect("a folder"), database: Script::default(), options: options() };
        fs::write(bench.path("run.csv"), text).expect("written");
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn open(&self) -> Result<Publisher<Script>, PublishError> {
        let sink = self.database.clone();
        Publisher::open(&self.path("run.csv"), "script", "script://", sink, self.options.clone(), at(0.0).wall)
    }

    /// Runs a new publisher to its end, at most `most` steps. Waits take no time.
    fn run(&self, most: usize) -> (Result<usize, PublishError>, Vec<PublishEvent>) {
        let mut publisher = self.open().expect("opened");
        let (mut now, mut events) = (1.0, Vec::new());
        for step in 0..most {
            let result = publisher.step(at(now));
            events.extend(publisher.take_events());
            match result {
                Ok(Step::Again) => {}
                Ok(Step::Wait(length)) => now += length.as_secs_f64(),
                Ok(Step::Done) => return (Ok(step), events),
                Err(error) => return (Err(error), events),
            }
        }
        (Ok(most), events)
    }

    fn rows(&self) -> Vec<String> {
        self.database.0.lock().expect("not poisoned").rows.keys().cloned().collect()
    }

    fn set(&self, change: impl FnOnce(&mut Database)) {
        change(&mut self.database.0.lock().expect("not poisoned"));
    }
}

fn row(number: usize) -> String {
    format!("2023-11-14T22:13:{:02}.010001Z,0.000000,5,pressure,{number},bar,ok,0x00\n", number % 60)
}

fn recording(rows: usize) -> String {
    let mut text = HEADER.to_owned();
    (0..rows).for_each(|number| text.push_str(&row(number)));
    text
}

fn expected(rows: usize) -> Vec<String> {
    let mut expected: Vec<String> = (0..rows).map(|number| format!("- lab run.csv:{} {number}", number + 2)).collect();
    expected.sort();
    expected
}

#[test]
fn each_row_is_sent_once_and_a_second_run_sends_nothing() {
    let bench = Bench::new(&recording(20));
    assert_eq!(bench.run(1000).1, []);
    assert_eq!(bench.rows(), expected(20));
    fs::write(bench.path("run.csv"), recording(23)).expect("written");
    bench.run(1000).0.expect("published");
    let database = bench.database.0.lock().expect("not poisoned");
    assert!(database.rows.len() == 23 && database.rows.values().all(|count| *count == 1), "{database:?}");
}

#[test]
fn no_row_is_lost_if_the_publisher_is_killed_after_any_step_and_the_server_fails_in_any_request() {
    for answer in [Answer::Lost, Answer::Half, Answer::Nothing] {
        for failed in 0..6 {
            for killed in 0..12 {
                let bench = Bench::new(&recording(7));
                bench.set(|database| {
                    database.script = [(failed, answer)].into();
                    database.bad = vec!["3".to_owned()];
                    database.names_rows = true;
                });
                bench.run(killed).0.expect("no error");
                fs::write(bench.path("run.csv"), recording(9)).expect("written");
                bench.run(1000).0.expect("published");
                let mut rows = expected(9);
                rows.retain(|row| !row.ends_with(" 3"));
                assert_eq!(bench.rows(), rows, "{answer:?} {failed} {killed}");
                let rejected = fs::read_to_string(bench.path("run.csv.script.rejected")).expect("a file");
                let lines: Vec<&str> = rejected.lines().collect();
                assert!(!lines.is_empty() && lines.iter().all(|line| *line == lines[0]), "{lines:?}");
                assert!(lines[0].starts_with("{\"file\":\"run.csv\",\"line\":5,\"reason\":\"bad\",\"row\":\"2023-"));
            }
        }
    }
}

#[test]
fn rejected_rows_and_other_lines_do_not_block_the_rest() {
    let bench = Bench::new(&(recording(40) + "nonsense\n" + &row(40)));
    bench.set(|database| database.bad = ["7", "31", "32"].map(str::to_owned).to_vec());
    let (result, events) = bench.run(1000);
    result.expect("published");
    assert_eq!(bench.rows().len(), 38);
    assert_eq!(events, [PublishEvent::Rejected(4, "run.csv".to_owned(), 42, None)]);
    let rejected = fs::read_to_string(bench.path("run.csv.script.rejected")).expect("a file");
    assert_eq!(rejected.lines().count(), 4);
    assert!(rejected.starts_with("{\"file\":\"run.csv\",\"line\":42,\"reason\":null,\"row\":\"nonsense\"}\n"));
    let publisher = bench.open().expect("opened");
    assert_eq!((publisher.progress().sent, publisher.progress().rejected), (38, 4));
}

#[test]
fn server_that_rejects_everything_gets_no_row_taken_away() {
    let bench = Bench::new(&recording(5));
    bench.set(|database| database.rejects_everything = true);
    let (result, _) = bench.run(1000);
    assert!(matches!(&result, Err(PublishError::Server(Trouble::RejectsEverything(_)))), "{result:?}");
    assert!(!bench.path("run.csv.script.rejected").exists());
    bench.set(|database| database.rejects_everything = false);
    bench.run(1000).0.expect("published");
    assert_eq!(bench.rows(), expected(5));
}

#[test]
fn server_that_accepts_less_gets_smaller_requests() {
    let bench = Bench::new(&recording(100));
    bench.set(|database| database.most_bytes = Some(200));
    bench.run(1000).0.expect("published");
    assert_eq!(bench.rows(), expected(100));
    bench.set(|database| database.most_bytes = Some(5));
    fs::write(bench.path("run.csv"), recording(102)).expect("written");
    bench.run(1000).0.expect("published");
    assert_eq!(bench.rows(), expected(100), "a row that never fits is rejected");
}

#[test]
fn absent_server_is_tried_again_and_given_up_only_without_follow() {
    let mut bench = Bench::new(&recording(3));
    bench.set(|database| database.script = (0..50).map(|number| (number, Answer::Nothing)).collect());
    let (result, events) = bench.run(1000);
    assert!(matches!(result, Err(PublishError::Server(Trouble::Closed))), "{result:?}");
    assert_eq!(events, [PublishEvent::Trouble(Trouble::Closed)], "reported once");
    bench.options.follow = true;
    let (_, events) = bench.run(200);
    assert_eq!(events, [PublishEvent::Trouble(Trouble::Closed), PublishEvent::Recovered]);
    assert_eq!(bench.rows(), expected(3));
}

#[test]
fn start_at_the_end_stays_after_a_kill() {
    let mut bench = Bench::new(&recording(3));
    bench.options.start = Start::End;
    drop(bench.open().expect("opened"));
    fs::write(bench.path("run.csv"), recording(5)).expect("written");
    bench.run(1000).0.expect("published");
    assert_eq!(bench.rows(), ["- lab run.csv:5 3", "- lab run.csv:6 4"]);
}

#[test]
fn damaged_position_sends_everything_again() {
    let bench = Bench::new(&recording(3));
    bench.run(1000).0.expect("published");
    fs::write(bench.path("run.csv.script.pos"), "{").expect("written");
    assert_eq!(bench.run(1000).1, [PublishEvent::PositionDamaged]);
    assert_eq!(bench.rows(), expected(3));
}

#[test]
fn one_recording_has_one_publisher_for_each_server() {
    let bench = Bench::new(&recording(3));
    let _first = bench.open().expect("opened");
    let second = bench.open().map(|_| ());
    assert!(matches!(second, Err(PublishError::Position(_, PositionError::Locked(_)))), "{second:?}");
    fs::remove_file(bench.path("run.csv")).expect("removed");
    drop(_first);
    assert!(matches!(bench.open().map(|_| ()), Err(PublishError::NoRecording)));
}

#[test]
fn tags_run_and_identity_come_from_the_recording_and_its_run() {
    let header = HEADER.trim_end().to_owned() + ",bench,part\n";
    let tagged = |number: usize, tags: &str| row(number).trim_end().to_owned() + tags + "\n";
    let first = header + &tagged(1, ",3,a");
    let mut bench = Bench::new(&(first.clone() + &tagged(2, ",4,b")));
    let runs = format!(
        "{{\"run\":\"r1\",\"bench\":\"x\",\"file\":\"run.csv\",\"nodes\":[{{\"node\":5,\"serial\":7,\"name\":\"N\"}}]}}\n\
         {{\"run\":\"r2\",\"file\":\"run.csv\",\"offset\":{}}}\n",
        first.len()
    );
    fs::write(bench.path("run.csv.run.json"), runs).expect("written");
    bench.options.identity = true;
    bench.options.tags = vec![("part".to_owned(), "c".to_owned())];
    bench.run(1000).0.expect("published");
    assert_eq!(bench.rows(), ["r1 3 run.csv:2 1 part=c name=N serial=7", "r2 4 run.csv:3 2 part=c"]);
}
