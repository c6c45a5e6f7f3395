//! A database that has acknowledged rows only in its memory for some seconds, and is killed.

use super::{HEADER, at, options};
use crate::bus::Wall;
use crate::publish::publisher::{Publisher, Step};
use crate::publish::sink::{Record, SendError, Sink, Trouble};
use std::collections::BTreeSet;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The time after which rows are on the disk, in seconds.
const IN_MEMORY_S: f64 = 10.0;

#[derive(Debug, Default)]
struct Database {
    disk: BTreeSet<String>,
    /// The rows in the memory, with the time of their acknowledgement.
    memory: Vec<(f64, String)>,
    /// How often it was killed.
    kills: u64,
    /// It does not accept connections before this time.
    absent_until: f64,
}

impl Database {
    fn save(&mut self, now: f64) {
        for (_, row) in self.memory.extract_if(.., |(time, _)| now - *time >= IN_MEMORY_S) {
            self.disk.insert(row);
        }
    }

    fn kill(&mut self, now: f64, absence: f64) {
        self.save(now);
        self.memory.clear();
        (self.kills, self.absent_until) = (self.kills + 1, now + absence);
    }
}

struct Client {
    database: Arc<Mutex<Database>>,
    known_kills: Option<u64>,
    has_restarted: bool,
}

impl Sink for Client {
    fn encode(&mut self, record: &Record<'_>, out: &mut Vec<u8>) {
        out.extend(format!("{}:{}\n", record.origin.file, record.line).bytes());
    }

    fn send(&mut self, rows: &[u8], now: Wall) -> Result<(), SendError> {
        let mut database = self.database.lock().expect("not poisoned");
        self.has_restarted = false;
        let now = (now.since_epoch() - Duration::from_secs(1_700_000_000)).as_secs_f64();
        if now < database.absent_until {
            return Err(Trouble::NoConnection("refused".to_owned()).into());
        }
        database.save(now);
        let rows = String::from_utf8_lossy(rows);
        database.memory.extend(rows.lines().map(|row| (now, row.to_owned())));
        self.has_restarted = self.known_kills.replace(database.kills).is_some_and(|kills| kills != database.kills);
        Ok(())
    }

    fn idle(&mut self, probe: bool) -> Result<(), Trouble> {
        let kills = self.database.lock().expect("not poisoned").kills;
        if probe {
            self.has_restarted = self.known_kills.replace(kills).is_some_and(|known| known != kills);
        }
        Ok(())
    }

    fn grace(&self) -> Duration {
        Duration::from_secs(15)
    }

    fn has_restarted(&self) -> bool {
        self.has_restarted
    }
}

/// A number below `limit`, from a seed that changes.
fn random(seed: &mut u64, limit: f64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    f64::from(u32::try_from(*seed >> 32).expect("32 bits")) / f64::from(u32::MAX) * limit
}

/// Writes ten rows a second, in a file for each half minute.
fn record(folder: &Path, rows: &mut usize, until: f64) {
    while (*rows as f64) < until * 10.0 {
        let name = folder.join(format!("run-{:04}.csv", *rows / 300 + 1));
        let is_new = !name.exists();
        let mut file = OpenOptions::new().append(true).create(true).open(name).expect("a file");
        if is_new {
            file.write_all(HEADER.as_bytes()).expect("written");
        }
        writeln!(file, "2026-11-29T15:00:00.000001Z,0.0,5,p,{rows},bar,ok,0x00").expect("written");
        *rows += 1;
    }
}

#[test]
fn rows_in_the_memory_of_a_killed_server_are_sent_again() {
    for first_seed in 1..=30 {
        let (mut seed, folder) = (first_seed, tempfile::tempdir().expect("a folder"));
        let database = Arc::new(Mutex::new(Database::default()));
        let mut options = options();
        options.follow = true;
        let open = |now: f64| {
            let client = Client { database: Arc::clone(&database), known_kills: None, has_restarted: false };
            let recording = folder.path().join("run.csv");
            Publisher::open(&recording, "db", "db://", client, options.clone(), at(now).wall).expect("opened")
        };
        let (mut now, mut rows, mut publisher) = (0.0, 0, open(0.0));
        let (mut next_kill, mut next_end) = (random(&mut seed, 15.0), random(&mut seed, 30.0));
        while now < 150.0 {
            if now < 100.0 {
                record(folder.path(), &mut rows, now);
            }
            if now >= next_kill && now < 100.0 {
                // Half of the times, no request fails.
                let absence = (random(&mut seed, 6.0) - 3.0).max(0.0);
                database.lock().expect("not poisoned").kill(now, absence);
                next_kill = now + random(&mut seed, 15.0);
            }
            if now >= next_end && now < 100.0 {
                drop(publisher);
                publisher = open(now);
                next_end = now + random(&mut seed, 60.0);
            }
            match publisher.step(at(now)).expect("no failure") {
                Step::Wait(length) => now += length.as_secs_f64(),
                _ => now += 0.01,
            }
        }
        let progress = publisher.progress();
        assert_eq!((progress.behind, progress.sent), (0, rows as u64), "seed {first_seed}");
        let mut database = database.lock().expect("not poisoned");
        database.save(1e9);
        assert_eq!(database.disk.len(), rows, "seed {first_seed}: rows are lost");
    }
}

#[test]
fn end_saves_all_acknowledged_rows() {
    let folder = tempfile::tempdir().expect("a folder");
    record(folder.path(), &mut 0, 1.0);
    let database = Arc::new(Mutex::new(Database::default()));
    for follow in [true, false] {
        let client = Client { database: Arc::clone(&database), known_kills: None, has_restarted: false };
        let mut options = options();
        options.follow = follow;
        let recording = folder.path().join("run.csv");
        let mut publisher = Publisher::open(&recording, "db", "db://", client, options, at(0.0).wall).expect("opened");
        while publisher.step(at(1.0)).expect("no failure") == Step::Again {}
        publisher.close(at(1.0).wall);
        assert_eq!(database.lock().expect("not poisoned").memory.len(), 10);
    }
}
