//! The position file `run.csv.SINK.pos`: which rows of a recording the server has acknowledged.
//!
//! It is replaced by renaming, so it is always complete. A lock on it gives each recording one publisher for each sink.

use super::spool::Place;
use crate::bus::file::{Locked, is_same, lock};
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// The version of the format.
const VERSION: u32 = 1;

/// A larger file is not a position.
const LARGEST_FILE: u64 = 1 << 20;

/// What the server has acknowledged.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Position {
    /// The version of the format.
    pub version: u32,
    /// The server, without credentials.
    pub url: String,
    /// The file, without its folder.
    pub file: String,
    /// The device of the file; `None` if the system has none.
    pub device: Option<u64>,
    /// The inode of the file.
    pub inode: Option<u64>,
    /// The header of the next row; empty for JSON Lines.
    pub header: String,
    /// The number of first bytes of the file in `head_hash`.
    pub head_length: u64,
    /// A hash of the first bytes of the file, which identify it.
    pub head_hash: String,
    /// The bytes of the file that are acknowledged.
    pub offset: u64,
    /// The lines of the file that are acknowledged.
    pub line: u64,
    /// The rows that were sent and acknowledged, in all files.
    pub sent: u64,
    /// The rows that the server rejected, and the lines that are not rows.
    pub rejected: u64,
    /// The time of the last acknowledged row, in RFC 3339.
    pub last_row: Option<String>,
    /// When the position was written, in RFC 3339.
    pub updated: String,
    /// `ok`, or the kind of the present trouble.
    pub state: String,
}

impl Position {
    /// Device and inode.
    pub fn identity(&self) -> Option<(u64, u64)> {
        self.device.zip(self.inode)
    }

    /// The same position after these lines.
    pub fn set_place(&mut self, place: &Place, header: &str) {
        self.file = place.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        (self.device, self.inode) = place.identity.unzip();
        (self.head_length, self.head_hash) = (place.head.len() as u64, hash(&place.head));
        (self.offset, self.line) = (place.offset, place.line);
        header.clone_into(&mut self.header);
    }
}

/// A hash of bytes (FNV-1a, 64 bits), hexadecimal. It detects other contents, not intent.
pub fn hash(bytes: &[u8]) -> String {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
    format!("{:016x}", bytes.iter().fold(0xcbf2_9ce4_8422_2325, step))
}

/// Why a position file cannot be used.
#[derive(Debug)]
pub enum PositionError {
    /// Another process publishes this recording to this server.
    Locked(Locked),
    /// The file is the position for another server, or of a newer version.
    Other(String),
    /// It cannot be read or written.
    Io(io::Error),
}

impl From<io::Error> for PositionError {
    fn from(error: io::Error) -> PositionError {
        PositionError::Io(error)
    }
}

/// An open and locked position file.
#[derive(Debug)]
pub struct PositionFile {
    path: PathBuf,
    /// Has the lock.
    file: File,
}

/// The contents of a position file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stored {
    /// Nothing was acknowledged yet.
    Empty,
    /// A position.
    Position(Box<Position>),
    /// The contents are damaged, for example after a power failure.
    Damaged,
}

impl Stored {
    /// The position; `None` if there is no place yet, because the recording was never found.
    pub fn position(self) -> Option<Position> {
        match self {
            Stored::Position(position) => Some(*position).filter(|position| !position.file.is_empty()),
            Stored::Empty | Stored::Damaged => None,
        }
    }
}

/// The name of the position file of a recording, for a sink.
pub fn file_name(recording: &Path, sink: &str, extension: &str) -> PathBuf {
    let mut name = recording.file_name().map(OsString::from).unwrap_or_default();
    name.push(format!(".{sink}.{extension}"));
    recording.with_file_name(name)
}

impl PositionFile {
    /// Opens and locks a position file. An absent file is created.
    ///
    /// # Errors
    /// Another process has it, it belongs to another server, or it cannot be created.
    pub fn open(path: &Path, url: &str) -> Result<(PositionFile, Stored), PositionError> {
        let file = loop {
            let file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
            lock(&file).map_err(PositionError::Locked)?;
            // Another process may have replaced the file between the two calls.
            if cfg!(not(unix))
                || fs::metadata(path).is_ok_and(|now| file.metadata().is_ok_and(|own| is_same(&own, &now)))
            {
                break file;
            }
        };
        let stored = read(&file)?;
        if let Stored::Position(position) = &stored
            && (position.url != url || position.version > VERSION)
        {
            return Err(PositionError::Other(position.url.clone()));
        }
        Ok((PositionFile { path: path.to_owned(), file }, stored))
    }

    /// Replaces the position.
    ///
    /// # Errors
    /// The file cannot be written. The old position remains.
    pub fn store(&mut self, position: &Position) -> Result<(), PositionError> {
        let position = Position { version: VERSION, ..position.clone() };
        let mut text = serde_json::to_vec(&position).map_err(io::Error::other)?;
        text.push(b'\n');
        let mut name = OsString::from(".");
        name.push(self.path.file_name().unwrap_or_default());
        name.push(".tmp");
        let temporary = self.path.with_file_name(name);
        let mut file = OpenOptions::new().write(true).create(true).truncate(true).open(&temporary)?;
        lock(&file).map_err(PositionError::Locked)?;
        file.write_all(&text)?;
        fs::rename(&temporary, &self.path)?;
        self.file = file;
        Ok(())
    }

    /// The name of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Reads an open position file.
fn read(file: &File) -> io::Result<Stored> {
    let mut text = Vec::new();
    file.take(LARGEST_FILE).read_to_end(&mut text)?;
    if text.is_empty() {
        return Ok(Stored::Empty);
    }
    Ok(serde_json::from_slice(&text).map_or(Stored::Damaged, |position| Stored::Position(Box::new(position))))
}

/// The position files of a recording with their contents, for `--status`. They are not locked.
///
/// # Errors
/// The folder or a file cannot be read.
pub fn all_of(recording: &Path) -> io::Result<Vec<(PathBuf, Stored)>> {
    let mut start = recording.file_name().map(OsString::from).unwrap_or_default();
    start.push(".");
    let start = start.to_string_lossy().into_owned();
    let mut found = Vec::new();
    for entry in fs::read_dir(super::series::folder(recording))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.strip_prefix(&start).is_some_and(|rest| rest.ends_with(".pos")) {
            found.push((path.clone(), read(&File::open(&path)?)?));
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn position_is_replaced_and_locked() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = file_name(&folder.path().join("run.csv"), "influx-h-8086-db", "pos");
        assert_eq!(path.file_name(), Some("run.csv.influx-h-8086-db.pos".as_ref()));
        let (mut file, stored) = PositionFile::open(&path, "influx://h:8086/db").expect("opened");
        assert_eq!(stored, Stored::Empty);
        let mut position = Position { url: "influx://h:8086/db".to_owned(), offset: 7, ..Position::default() };
        for offset in [7, 8] {
            position.offset = offset;
            file.store(&position).expect("stored");
            let second = PositionFile::open(&path, "influx://h:8086/db");
            assert!(matches!(second, Err(PositionError::Locked(_))), "{second:?}");
        }
        drop(file);
        let (file, stored) = PositionFile::open(&path, "influx://h:8086/db").expect("opened");
        let Stored::Position(read) = stored else { panic!("{stored:?}") };
        assert_eq!((read.offset, read.version), (8, VERSION));
        drop(file);
        let other = PositionFile::open(&path, "influx://other:8086/db");
        assert!(matches!(&other, Err(PositionError::Other(url)) if url == "influx://h:8086/db"), "{other:?}");
        assert_eq!(all_of(&folder.path().join("run.csv")).expect("read").len(), 1);
        fs::write(&path, "{\"version\":1,").expect("written");
        assert_eq!(PositionFile::open(&path, "influx://h:8086/db").expect("opened").1, Stored::Damaged);
    }
}
