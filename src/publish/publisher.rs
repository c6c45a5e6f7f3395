//! Publishes one recording to one server: reads lines, sends them, and moves the position after the acknowledgement.
//!
//! The position file has the last position whose rows the server has certainly stored (`recent`).
//!
//! [`Publisher::step`] performs one action: read, send, save rejected rows, or save the position. A publisher that ends
//! between any two steps loses no row.

mod recent;

use super::batch::{Batch, Entry};
use super::position::{Position, PositionFile, Stored};
use super::row::{Content, RowReader};
use super::run::{Run, Runs};
use super::sink::{Origin, Record, SendError, Sink, Trouble};
use super::spool::{Chunk, Place, Spool, Start};
pub use super::state::{Options, Progress, PublishError, PublishEvent};
use crate::bus::{Mono, Stamp, Wall};
use recent::Recent;
use serde::Serialize;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The interval at which a recording is checked for new rows.
pub const POLL_INTERVAL: Duration = Duration::from_millis(500);

/// The first wait before rows are sent again. It doubles up to [`LONGEST_DELAY`].
const FIRST_DELAY: Duration = Duration::from_millis(500);

/// The longest wait before rows are sent again.
const LONGEST_DELAY: Duration = Duration::from_secs(15);

/// The longest wait that a server can demand.
const LONGEST_DEMAND: Duration = Duration::from_secs(300);

/// What follows a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Another step.
    Again,
    /// Another step after this time.
    Wait(Duration),
    /// All rows are acknowledged or saved as rejected.
    Done,
}

/// The next action.
#[derive(Debug)]
enum Stage {
    Read,
    Send(Box<Batch>),
    SaveRejected(Box<Batch>),
    SavePosition(Box<Batch>),
}

/// When rows are sent again after a failure.
#[derive(Debug)]
struct Retry {
    trouble: Option<Trouble>,
    since: Option<Mono>,
    wait_until: Option<Mono>,
    delay: Duration,
}

impl Default for Retry {
    fn default() -> Retry {
        Retry { trouble: None, since: None, wait_until: None, delay: FIRST_DELAY }
    }
}

/// Publishes one recording.
pub struct Publisher<S> {
    recording: PathBuf,
    options: Options,
    sink: S,
    spool: Spool,
    reader: RowReader,
    runs: Runs,
    origin: Origin,
    /// The tags and the run from which `origin` was made.
    origin_of: Option<(u64, Option<Run>)>,
    /// The position after all acknowledged rows.
    position: Position,
    /// The position in the file.
    safe: Position,
    recent: Recent,
    file: PositionFile,
    rejects: PathBuf,
    stage: Stage,
    events: Vec<PublishEvent>,
    sent_now: u64,
    rejected_now: u64,
    retry: Retry,
    /// Whether the server accepted a row.
    has_accepted: bool,
    /// The most rows in one request.
    most_rows: usize,
}

impl<S: Sink> Publisher<S> {
    /// Opens a recording. `name` is the short name of the server, and `url` its address without credentials.
    ///
    /// # Errors
    /// The recording does not exist (without `follow`), or its position file cannot be used.
    pub fn open(
        recording: &Path,
        name: &str,
        url: &str,
        sink: S,
        options: Options,
        now: Wall,
    ) -> Result<Publisher<S>, PublishError> {
        let exists = Spool::open(recording, None, Start::Start).map_err(PublishError::Read)?.exists();
        if !exists && !options.follow {
            return Err(PublishError::NoRecording);
        }
        let path = super::position::file_name(recording, name, "pos");
        let (file, stored) =
            PositionFile::open(&path, url).map_err(|error| PublishError::Position(path.clone(), error))?;
        let is_damaged = stored == Stored::Damaged;
        let start = if is_damaged { Start::Start } else { options.start };
        let mut events: Vec<PublishEvent> = is_damaged.then_some(PublishEvent::PositionDamaged).into_iter().collect();
        let position = stored.position();
        let mut spool = Spool::open(recording, position.as_ref(), start).map_err(PublishError::Read)?;
        events.extend(spool.take_events().into_iter().map(PublishEvent::Spool));
        let header = header(&spool, position.as_ref());
        let (is_new, mut position) = (position.is_none(), position.unwrap_or_default());
        url.clone_into(&mut position.url);
        if let Some(place) = spool.place() {
            position.set_place(place, &header);
        }
        let mut publisher = Publisher {
            recording: recording.to_owned(),
            options,
            most_rows: sink.most_rows(),
            sink,
            spool,
            reader: RowReader::after(&header),
            runs: Runs::of(recording),
            origin: Origin::default(),
            origin_of: None,
            safe: position.clone(),
            recent: Recent::default(),
            position,
            file,
            rejects: super::position::file_name(recording, name, "rejected"),
            stage: Stage::Read,
            events,
            sent_now: 0,
            rejected_now: 0,
            retry: Retry::default(),
            has_accepted: false,
        };
        publisher.announce();
        if is_new {
            // A start at the end must not move if this publisher is killed before it sends a row.
            publisher.position.state = "ok".to_owned();
            publisher.store(now)?;
        }
        Ok(publisher)
    }

    /// Tells the sink the bench before the first row, if it is known.
    fn announce(&mut self) {
        self.runs.refresh();
        let run = self.spool.place().and_then(|place| self.runs.at(&place.file, place.offset));
        let own = self.options.tags.iter().find(|(key, _)| key == "bench").map(|(_, bench)| bench);
        if let Some(bench) = own.or(run.map(|run| &run.bench)).filter(|bench| !bench.is_empty()) {
            self.sink.announce(bench);
        }
    }

    /// The events since the last call.
    pub fn take_events(&mut self) -> Vec<PublishEvent> {
        std::mem::take(&mut self.events)
    }

    /// The present state.
    pub fn progress(&self) -> Progress {
        let unsent = match (&self.stage, self.spool.place()) {
            (Stage::Read, Some(place)) => self.spool.bytes_after(place),
            (Stage::Send(batch) | Stage::SaveRejected(batch) | Stage::SavePosition(batch), _) => {
                self.spool.bytes_after(&batch.end) + batch.source.len() as u64
            }
            (Stage::Read, None) => 0,
        };
        Progress {
            file: self.recording.display().to_string(),
            url: self.position.url.clone(),
            sent: self.position.sent,
            sent_now: self.sent_now,
            rejected: self.position.rejected,
            rejected_now: self.rejected_now,
            behind: unsent,
            last_row: self.position.last_row.clone(),
            trouble: self.retry.trouble.clone(),
        }
    }

    /// The file of the rejected rows.
    pub fn rejects(&self) -> &Path {
        &self.rejects
    }

    /// Saves the position after all acknowledged rows, and ends the connection.
    pub fn close(&mut self, now: Wall) {
        // Without the position, the rows are sent again.
        let _ = self.settle_all(now);
        self.sink.close();
    }

    /// Performs one action.
    ///
    /// # Errors
    /// A local file cannot be used, or the server does not accept rows and `follow` is not set.
    pub fn step(&mut self, now: Stamp) -> Result<Step, PublishError> {
        if let Some(until) = self.retry.wait_until {
            let left = until.since(now.mono);
            if !left.is_zero() {
                return Ok(Step::Wait(left));
            }
            self.retry.wait_until = None;
        }
        match std::mem::replace(&mut self.stage, Stage::Read) {
            Stage::Read => self.read(now),
            Stage::Send(batch) => self.send(batch, now),
            Stage::SaveRejected(batch) => self.save_rejected(batch),
            Stage::SavePosition(batch) => {
                self.save_position(&batch, now);
                self.settle(now)?;
                Ok(Step::Again)
            }
        }
    }

    fn read(&mut self, now: Stamp) -> Result<Step, PublishError> {
        let chunk = self.spool.next_chunk().map_err(PublishError::Read)?;
        self.events.extend(self.spool.take_events().into_iter().map(PublishEvent::Spool));
        let Some(chunk) = chunk else {
            return self.idle(now);
        };
        if self.safe.file.is_empty() {
            // The file did not exist at the start of publish. After a restart, `--from end` must not skip its rows.
            let (file, identity) = (chunk.end.file.clone(), chunk.end.identity);
            self.safe.set_place(&Place { file, identity, ..Place::default() }, "");
            self.store(now.wall)?;
        }
        let mut batch = Box::new(self.batch(chunk));
        batch.queue(self.most_rows);
        self.stage = Stage::Send(batch);
        Ok(Step::Again)
    }

    /// Encodes the rows of a chunk.
    fn batch(&mut self, chunk: Chunk) -> Batch {
        if chunk.first_line == 1 {
            // A CSV file begins with its header.
            self.reader = RowReader::default();
            self.origin_of = None;
        }
        self.runs.refresh();
        let first = chunk.end.offset - chunk.bytes.len() as u64;
        let run = |runs: &Runs, offset: u64| runs.at(&chunk.end.file, offset).cloned();
        let mut present = run(&self.runs, first);
        let is_one_run = present == run(&self.runs, chunk.end.offset.saturating_sub(1));
        let mut batch = Batch::new(chunk.end.clone());
        let (mut offset, mut line) = (0, chunk.first_line);
        for text in chunk.bytes.split_inclusive(|&byte| byte == b'\n') {
            if !is_one_run {
                present = run(&self.runs, first + offset as u64);
            }
            let source = offset..offset + text.len();
            let start = batch.body.len();
            match self.reader.read(text) {
                Content::Nothing => {}
                Content::Other => batch.add_other(line, source),
                Content::Rows(rows) => {
                    self.set_origin(present.as_ref(), &chunk.end.file);
                    for row in &rows {
                        self.sink.encode(&Record { row, line, origin: &self.origin }, &mut batch.body);
                    }
                    let time_us = rows.first().map(|row| row.time_us);
                    batch.add(Entry { line, source, encoded: start..batch.body.len(), rows: rows.len(), time_us });
                }
            }
            offset += text.len();
            line += 1;
        }
        batch.source = chunk.bytes;
        self.reader.header().clone_into(&mut batch.header);
        batch
    }

    /// Prepares what the next rows have in common.
    fn set_origin(&mut self, run: Option<&Run>, file: &Path) {
        let generation = self.reader.generation();
        let file = file.file_name().unwrap_or_default().to_string_lossy();
        if let Some((of, known)) = &self.origin_of
            && *of == generation
            && known.as_ref() == run
            && self.origin.file == *file
        {
            return;
        }
        let mut tags = self.options.tags.clone();
        let is_new = |(key, _): &&(String, String)| self.options.tags.iter().all(|(known, _)| known != key);
        tags.extend(self.reader.tags().iter().filter(is_new).cloned());
        tags.sort();
        let own = tags.iter().position(|(key, _)| key == "bench").map(|at| tags.remove(at).1);
        let of_run = || run.map(|run| run.bench.clone()).filter(|bench| !bench.is_empty());
        let bench = own.or_else(of_run).unwrap_or_else(|| self.options.bench.clone());
        let nodes = run.filter(|_| self.options.identity).map_or(&[][..], |run| &run.nodes);
        let identities = nodes.iter().map(|node| {
            let serial = node.serial.map(|serial| ("serial".to_owned(), serial.to_string()));
            let name = node.name.clone().map(|name| ("name".to_owned(), name));
            (node.node, name.into_iter().chain(serial).collect())
        });
        self.origin = Origin {
            id: self.origin.id + 1,
            run: run.map(|run| run.run.clone()),
            bench,
            file: file.into_owned(),
            tags,
            identities: identities.collect(),
        };
        self.sink.announce(&self.origin.bench);
        self.origin_of = Some((generation, run.cloned()));
    }

    fn send(&mut self, mut batch: Box<Batch>, now: Stamp) -> Result<Step, PublishError> {
        if let Some(part) = batch.next_part() {
            let answer = self.sink.send(batch.bytes(&part), now.wall);
            if self.is_restarted(&answer) && self.go_back(batch.accepted > 0)? {
                return match answer {
                    Err(SendError::Trouble(trouble, after)) => self.set_trouble(trouble, after, now),
                    _ => Ok(Step::Again),
                };
            }
            match answer {
                Ok(()) => {
                    self.has_accepted = true;
                    self.recover();
                    batch.accept(&part);
                }
                Err(SendError::Rejected(rejection)) => batch.reject(part, rejection),
                Err(SendError::TooLarge) => {
                    self.most_rows = (part.len() / 2).max(1);
                    batch.split(part);
                }
                Err(SendError::Trouble(trouble, after)) => {
                    batch.put_back(part);
                    self.stage = Stage::Send(batch);
                    return self.set_trouble(trouble, after, now);
                }
            }
            self.stage = Stage::Send(batch);
            return Ok(Step::Again);
        }
        if let Some(reason) = batch.doubtful_rejection().filter(|_| !self.has_accepted) {
            batch.queue(self.most_rows);
            self.stage = Stage::Send(batch);
            return self.set_trouble(Trouble::RejectsEverything(reason), None, now);
        }
        self.recover();
        self.stage = if batch.rejected.is_empty() { Stage::SavePosition(batch) } else { Stage::SaveRejected(batch) };
        Ok(Step::Again)
    }

    fn recover(&mut self) {
        if std::mem::take(&mut self.retry).trouble.is_some() {
            self.events.push(PublishEvent::Recovered);
        }
    }

    fn set_trouble(&mut self, trouble: Trouble, after: Option<Duration>, now: Stamp) -> Result<Step, PublishError> {
        let since = *self.retry.since.get_or_insert(now.mono);
        if !self.options.follow && (trouble.is_lasting() || now.mono.since(since) >= self.options.give_up) {
            return Err(PublishError::Server(trouble));
        }
        if self.retry.trouble.as_ref() != Some(&trouble) {
            self.events.push(PublishEvent::Trouble(trouble.clone()));
            trouble.word().clone_into(&mut self.position.state);
            self.store(now.wall)?;
            self.retry.trouble = Some(trouble);
        }
        let wait = after.unwrap_or(self.retry.delay).clamp(FIRST_DELAY, LONGEST_DEMAND);
        self.retry.delay = (self.retry.delay * 2).min(LONGEST_DELAY);
        self.retry.wait_until = Some(now.mono + wait);
        Ok(Step::Wait(wait))
    }

    /// Appends the rejected rows to their file.
    fn save_rejected(&mut self, batch: Box<Batch>) -> Result<Step, PublishError> {
        let file = batch.end.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut lines = Vec::new();
        for rejected in &batch.rejected {
            let line = RejectedLine {
                file: &file,
                line: rejected.line,
                reason: rejected.reason.as_deref(),
                row: String::from_utf8_lossy(&batch.source[rejected.source.clone()]).trim_end().to_owned(),
            };
            serde_json::to_writer(&mut lines, &line)
                .map_err(|error| PublishError::Rejects(self.rejects.clone(), error.into()))?;
            lines.push(b'\n');
        }
        let file_to = OpenOptions::new().append(true).create(true).open(&self.rejects);
        file_to
            .and_then(|mut file| file.write_all(&lines))
            .map_err(|error| PublishError::Rejects(self.rejects.clone(), error))?;
        if let Some(first) = batch.rejected.first() {
            let count = batch.rejected.len();
            self.events.push(PublishEvent::Rejected(count, file, first.line, first.reason.clone()));
        }
        self.stage = Stage::SavePosition(batch);
        Ok(Step::Again)
    }

    fn save_position(&mut self, batch: &Batch, now: Stamp) {
        self.position.set_place(&batch.end, &batch.header);
        let rejected = batch.rejected.len() as u64;
        self.position.sent += batch.accepted;
        self.position.rejected += rejected;
        self.sent_now += batch.accepted;
        self.rejected_now += rejected;
        if let Some(time) = batch.last_time().and_then(|time| u64::try_from(time).ok()) {
            self.position.last_row = Some(rfc3339(Wall::at(Duration::from_micros(time))));
        }
        "ok".clone_into(&mut self.position.state);
        self.recent.push(now.mono, self.position.clone());
    }

    fn store(&mut self, now: Wall) -> Result<(), PublishError> {
        self.safe.updated = rfc3339(now);
        self.position.state.clone_into(&mut self.safe.state);
        let stored = self.file.store(&self.safe);
        stored.map_err(|error| PublishError::Position(self.file.path().to_owned(), error))
    }
}

/// The header of the next row.
fn header(spool: &Spool, position: Option<&Position>) -> String {
    let is_at_start = spool.place().is_none_or(|place| place.offset == 0);
    match position {
        _ if is_at_start => String::new(),
        Some(position) => position.header.clone(),
        None => spool.first_line(),
    }
}

/// A line in the file of rejected rows.
#[derive(Serialize)]
struct RejectedLine<'a> {
    file: &'a str,
    line: u64,
    /// The words of the server; null for a line that is not a row.
    reason: Option<&'a str>,
    row: String,
}

fn rfc3339(time: Wall) -> String {
    humantime::format_rfc3339_micros(time.system_time()).to_string()
}

#[cfg(test)]
mod tests;
