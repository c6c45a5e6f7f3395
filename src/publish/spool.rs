//! Reads the whole lines of a recording in their order, while it is written: also of rotated, moved, truncated and
//! replaced files.

use super::position::Position;
use super::series;
use crate::bus::file::identity;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The most bytes of a chunk. A longer line is a chunk of its own.
const CHUNK_SIZE: u64 = 512 * 1024;

/// The longest line. A longer line is not a row, and is cut.
const LONGEST_LINE: u64 = 4 * 1024 * 1024;

/// The first bytes of a file, which identify it: the header and the first row.
const HEAD_SIZE: u64 = 512;

/// Whole lines of one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// The lines, with their line ends.
    pub bytes: Vec<u8>,
    /// The number of the first line in its file, counted from 1.
    pub first_line: u64,
    /// The place after the lines.
    pub end: Place,
}

/// A place in the files of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The name of the file when it was opened.
    pub file: PathBuf,
    /// Device and inode.
    pub identity: Option<(u64, u64)>,
    /// The number of bytes before the place.
    pub offset: u64,
    /// The number of lines before the place.
    pub line: u64,
    /// The first bytes of the file, at most those before the place.
    pub head: Vec<u8>,
}

/// A change of the files by another program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SpoolEvent {
    /// The file became shorter, or its contents were replaced. It is read from its start.
    Truncated(PathBuf),
    /// The file of the position does not exist any more. The recording is read from this file on.
    Gone(PathBuf, PathBuf),
}

/// Where a recording without a position is read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The first row.
    Start,
    /// The rows that follow.
    End,
}

/// The files of a recording.
#[derive(Debug)]
pub struct Spool {
    base: PathBuf,
    current: Option<Current>,
    events: Vec<SpoolEvent>,
}

/// The open file.
#[derive(Debug)]
struct Current {
    file: File,
    place: Place,
    /// Whether a next file existed before the last look at this one. Then no more lines follow.
    is_final: bool,
}

impl Spool {
    /// Opens a recording: `base` is a file, or the name from which the names of rotated files follow. A recording that
    /// does not exist yet is opened later.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn open(base: &Path, position: Option<&Position>, start: Start) -> io::Result<Spool> {
        let mut spool = Spool { base: base.to_owned(), current: None, events: Vec::new() };
        match (position, start) {
            (Some(position), _) => spool.resume(position)?,
            (None, Start::Start) => spool.open_next()?,
            (None, Start::End) => {
                if let Some(last) = spool.names()?.pop() {
                    let mut current = Current::open(&last)?;
                    current.skip_to_end()?;
                    spool.current = Some(current);
                }
            }
        }
        Ok(spool)
    }

    /// Whether a file of the recording exists.
    pub fn exists(&self) -> bool {
        self.current.is_some()
    }

    /// The place of the next line; `None` if the recording does not exist yet.
    pub fn place(&self) -> Option<&Place> {
        self.current.as_ref().map(|current| &current.place)
    }

    /// The changes since the last call.
    pub fn take_events(&mut self) -> Vec<SpoolEvent> {
        std::mem::take(&mut self.events)
    }

    /// The header of the next line, from the start of its file; empty if there is none. Only for a start at the end.
    pub fn first_line(&self) -> String {
        let head = self.place().map(|place| place.head.as_slice()).unwrap_or_default();
        let line = head.split_inclusive(|&byte| byte == b'\n').next().filter(|line| line.ends_with(b"\n"));
        String::from_utf8_lossy(line.unwrap_or_default()).trim_end().to_owned()
    }

    /// The bytes that follow `place`, in all files.
    pub fn bytes_after(&self, place: &Place) -> u64 {
        let length = |path: &Path| fs::metadata(path).map_or(0, |metadata| metadata.len());
        let number = self.number(&place.file);
        let own = match &self.current {
            Some(current) if current.place.file == place.file => {
                current.file.metadata().map_or(0, |metadata| metadata.len())
            }
            _ => length(&place.file),
        };
        let later = self.names().unwrap_or_default().into_iter().filter(|name| self.number(name) > number);
        own.saturating_sub(place.offset) + later.map(|name| length(&name)).sum::<u64>()
    }

    /// The next whole lines; `None` if there are none at present.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn next_chunk(&mut self) -> io::Result<Option<Chunk>> {
        loop {
            let Some(current) = &mut self.current else {
                self.open_next()?;
                if self.current.is_none() {
                    return Ok(None);
                }
                continue;
            };
            if current.has_other_contents()? {
                self.events.push(SpoolEvent::Truncated(current.place.file.clone()));
                let file = current.place.file.clone();
                current.place = Place { file, identity: current.place.identity, ..Place::default() };
            }
            if let Some(chunk) = current.read()? {
                return Ok(Some(chunk));
            }
            let is_final = current.is_final;
            match self.successor()? {
                None => return Ok(None),
                // The writer may have added lines before it created the next file.
                Some(_) if !is_final => self.current.iter_mut().for_each(|current| current.is_final = true),
                Some(next) => self.current = Some(Current::open(&next)?),
            }
        }
    }

    /// The files of the recording, in their order.
    fn names(&self) -> io::Result<Vec<PathBuf>> {
        let mut names: Vec<PathBuf> = self.base.is_file().then(|| self.base.clone()).into_iter().collect();
        match series::existing(&self.base) {
            Ok(numbers) => names.extend(numbers.into_iter().map(|number| series::name(&self.base, number))),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
        Ok(names)
    }

    /// The place of a file in the order of the recording.
    fn number(&self, file: &Path) -> u32 {
        series::number(&self.base, file).unwrap_or(0)
    }

    fn open_next(&mut self) -> io::Result<()> {
        if let Some(first) = self.names()?.first() {
            self.current = Some(Current::open(first)?);
        }
        Ok(())
    }

    /// The file that follows the present one.
    fn successor(&self) -> io::Result<Option<PathBuf>> {
        let Some(current) = &self.current else { return Ok(None) };
        let file = &current.place.file;
        let number = self.number(file);
        if let Some(next) = self.names()?.into_iter().find(|name| self.number(name) > number) {
            return Ok(Some(next));
        }
        // Another file may have the name now. As long as it is empty, the writer still writes to the moved file.
        let is_other = fs::metadata(file).is_ok_and(|now| {
            let now = identity(&now);
            now.is_some() && now != current.place.identity
        });
        let has_line = |path: &Path| -> io::Result<bool> {
            let mut start = Vec::new();
            File::open(path)?.take(CHUNK_SIZE).read_to_end(&mut start)?;
            Ok(start.contains(&b'\n'))
        };
        Ok((is_other && has_line(file)?).then(|| file.clone()))
    }

    /// Continues at a position: in the file with its name, in a file that was moved, or in the next file.
    fn resume(&mut self, position: &Position) -> io::Result<()> {
        let folder = series::folder(&self.base).to_owned();
        let name = self.base.with_file_name(&position.file);
        let own = name.is_file().then(|| name.clone());
        let is_moved = |path: &PathBuf| {
            fs::metadata(path).is_ok_and(|metadata| metadata.is_file() && identity(&metadata) == position.identity())
        };
        let entries = fs::read_dir(&folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
        let moved = entries.filter(|_| position.identity().is_some()).find(is_moved);
        for path in own.into_iter().chain(moved) {
            let mut current = Current::open(&path)?;
            if current.resume(position)? {
                current.place.file = name;
                self.current = Some(current);
                return Ok(());
            }
        }
        // The same name with other contents is another recording. Otherwise, the next file follows.
        let number = self.number(&name);
        let names = self.names()?;
        let next = names.iter().find(|next| **next == name || self.number(next) > number).or(names.first());
        if let Some(next) = next {
            self.events.push(if *next == name {
                SpoolEvent::Truncated(name)
            } else {
                SpoolEvent::Gone(name, next.clone())
            });
            self.current = Some(Current::open(next)?);
        }
        Ok(())
    }
}

impl Current {
    fn open(path: &Path) -> io::Result<Current> {
        let file = File::open(path)?;
        let place = Place { file: path.to_owned(), identity: identity(&file.metadata()?), ..Place::default() };
        Ok(Current { file, place, is_final: false })
    }

    /// Goes to a position. `false` if the file has other contents.
    fn resume(&mut self, position: &Position) -> io::Result<bool> {
        let head = self.bytes(0, position.head_length.min(HEAD_SIZE))?;
        let is_same = head.len() as u64 == position.head_length
            && super::position::hash(&head) == position.head_hash
            && self.file.metadata()?.len() >= position.offset;
        if is_same {
            (self.place.offset, self.place.line, self.place.head) = (position.offset, position.line, head);
        }
        Ok(is_same)
    }

    /// Whether the file became shorter, or begins with other bytes than before.
    fn has_other_contents(&mut self) -> io::Result<bool> {
        if self.file.metadata()?.len() < self.place.offset {
            return Ok(true);
        }
        Ok(self.bytes(0, self.place.head.len() as u64)? != self.place.head)
    }

    /// At most `length` bytes from `offset` on.
    fn bytes(&mut self, offset: u64, length: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.file.seek(SeekFrom::Start(offset))?;
        Read::by_ref(&mut self.file).take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// Reads whole lines.
    fn read(&mut self) -> io::Result<Option<Chunk>> {
        let mut bytes = self.bytes(self.place.offset, CHUNK_SIZE)?;
        let mut end = last_line_end(&bytes);
        if end == 0 && bytes.len() as u64 == CHUNK_SIZE {
            bytes = self.bytes(self.place.offset, LONGEST_LINE)?;
            let first = bytes.iter().position(|&byte| byte == b'\n').map(|at| at + 1);
            end = first.unwrap_or(if bytes.len() as u64 == LONGEST_LINE { bytes.len() } else { 0 });
        }
        if end == 0 {
            return Ok(None);
        }
        bytes.truncate(end);
        let first_line = self.place.line + 1;
        self.advance(&bytes);
        Ok(Some(Chunk { bytes, first_line, end: self.place.clone() }))
    }

    fn advance(&mut self, bytes: &[u8]) {
        let missing = usize::try_from(HEAD_SIZE).unwrap_or(0).saturating_sub(self.place.head.len());
        if self.place.head.len() as u64 == self.place.offset {
            self.place.head.extend_from_slice(&bytes[..missing.min(bytes.len())]);
        }
        self.place.offset += bytes.len() as u64;
        self.place.line += bytes.iter().filter(|&&byte| byte == b'\n').count() as u64;
    }

    fn skip_to_end(&mut self) -> io::Result<()> {
        while self.read()?.is_some() {}
        Ok(())
    }
}

/// The number of bytes up to the last line end.
fn last_line_end(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1)
}

#[cfg(test)]
mod tests;
