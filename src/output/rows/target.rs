//! The target of lines: a file, a series of files, or a stream. After a failure, files contain only whole lines.

use super::series::Series;
use crate::bus::file::{NameChange, name_change};
use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;

/// The target of lines.
#[derive(Debug)]
pub enum OutputTarget {
    /// A file. A regular file keeps its first `keep` bytes; the first line replaces the rest.
    File {
        /// The file, open for appending.
        file: File,
        /// Its name.
        path: PathBuf,
        /// The number of bytes that are kept.
        keep: u64,
    },
    /// stdout, a pipe, a device.
    Stream(Box<dyn Stream>),
}

/// A stream that a thread can write to.
pub trait Stream: Write + std::fmt::Debug + Send {}

impl<T: Write + std::fmt::Debug + Send> Stream for T {}

/// A change of a file by another program while it was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileChange {
    /// The file became shorter. The header is written again.
    Shortened(PathBuf),
    /// The file was moved. Further rows go to the moved file.
    Moved(PathBuf),
    /// The file was deleted together with its rows.
    Deleted(PathBuf),
}

/// The place of the header lines of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HeaderPlace {
    /// The lines start the next file of the series.
    NextFile,
    /// The lines go to the current file.
    CurrentFile,
    /// The lines are not written now: the current file contains them, or they are written with the first row.
    Present,
}

/// A failed write, and the number of lost rows.
pub(super) type WriteFailure = (io::Error, u64);

/// Writes lines to a target. With a series, later lines go to further files.
#[derive(Debug)]
pub(super) struct TargetWriter {
    target: OutputTarget,
    series: Option<Series>,
    is_prepared: bool,
    /// The lines before the first row.
    header: Vec<u8>,
    /// The length of a regular file after the last write.
    length: u64,
    name_change: Option<NameChange>,
    changes: Vec<FileChange>,
}

impl TargetWriter {
    pub(super) fn new(target: OutputTarget, series: Option<Series>) -> TargetWriter {
        TargetWriter {
            target,
            series,
            is_prepared: false,
            header: Vec::new(),
            length: 0,
            name_change: None,
            changes: Vec::new(),
        }
    }

    /// Sets the header, and writes it unless it is already present.
    pub(super) fn set_header(&mut self, place: HeaderPlace, bytes: &[u8]) -> Result<(), WriteFailure> {
        self.header = bytes.to_vec();
        if place == HeaderPlace::Present {
            return Ok(());
        }
        self.prepare().map_err(|error| (error, 0))?;
        if let (HeaderPlace::NextFile, Some(series)) = (place, &mut self.series) {
            let (path, file) = series.create().map_err(|error| (error, 0))?;
            self.target = OutputTarget::File { file, path, keep: 0 };
            (self.length, self.name_change) = (0, None);
        }
        self.write_rows(bytes, 0)
    }

    /// Changes of the files by other programs since the last call.
    pub(super) fn take_changes(&mut self) -> Vec<FileChange> {
        std::mem::take(&mut self.changes)
    }

    /// Writes whole lines. After a failure the file ends with a whole line.
    pub(super) fn write_rows(&mut self, bytes: &[u8], rows: u64) -> Result<(), WriteFailure> {
        self.prepare().map_err(|error| (error, rows))?;
        self.check_file().map_err(|error| (error, rows))?;
        self.length += bytes.len() as u64;
        write_lines(&mut self.target, bytes).map_err(|(error, kept)| {
            let lines = bytes[kept..].iter().filter(|&&byte| byte == b'\n').count() as u64;
            (error, lines.min(rows))
        })
    }

    /// Removes the bytes of the file that are not kept, before the first line.
    fn prepare(&mut self) -> io::Result<()> {
        if std::mem::replace(&mut self.is_prepared, true) {
            return Ok(());
        }
        if let Some(series) = &mut self.series {
            series.repair_last()?;
        }
        if let OutputTarget::File { file, keep, .. } = &mut self.target
            && file.metadata()?.is_file()
        {
            file.set_len(*keep)?;
            self.length = *keep;
        }
        Ok(())
    }

    /// Detects changes of the file by other programs since the last write. If the file became shorter, the header is
    /// written again.
    pub(super) fn check_file(&mut self) -> io::Result<()> {
        let OutputTarget::File { file, path, .. } = &self.target else { return Ok(()) };
        let metadata = file.metadata()?;
        if !self.is_prepared || !metadata.is_file() {
            return Ok(());
        }
        let change = name_change(&metadata, path);
        if change != std::mem::replace(&mut self.name_change, change) {
            let report = change.map(|change| match change {
                NameChange::Moved => FileChange::Moved(path.clone()),
                NameChange::Deleted => FileChange::Deleted(path.clone()),
            });
            self.changes.extend(report);
        }
        let is_shorter = metadata.len() < self.length;
        self.length = metadata.len();
        if is_shorter {
            self.changes.push(FileChange::Shortened(path.clone()));
            // If old rows remain in the file, an empty line separates the two tables.
            let separator: &[u8] = if self.length > 0 && !self.header.is_empty() { b"\n" } else { b"" };
            let lines = [separator, &self.header].concat();
            self.length += lines.len() as u64;
            write_lines(&mut self.target, &lines).map_err(|(error, _)| error)?;
        }
        Ok(())
    }
}

/// Writes all of `bytes`. After an error, returns also the number of kept bytes, which are whole lines.
fn write_lines(target: &mut OutputTarget, bytes: &[u8]) -> Result<(), (io::Error, usize)> {
    let mut done = 0;
    while done < bytes.len() {
        let result = match target {
            OutputTarget::File { file, .. } => file.write(&bytes[done..]),
            OutputTarget::Stream(stream) => stream.write(&bytes[done..]),
        };
        match result {
            Ok(0) => return Err((io::ErrorKind::WriteZero.into(), cut_partial_line(target, bytes, done))),
            Ok(count) => done += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err((error, cut_partial_line(target, bytes, done))),
        }
    }
    if let OutputTarget::Stream(stream) = target {
        stream.flush().map_err(|error| (error, bytes.len()))?;
    }
    Ok(())
}

/// Cuts a file back to its last whole line. `done` of `bytes` were written; returns the number of kept bytes.
fn cut_partial_line(target: &mut OutputTarget, bytes: &[u8], done: usize) -> usize {
    let whole = bytes[..done].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    if let OutputTarget::File { file, .. } = target {
        let excess = (done - whole) as u64;
        if let Ok(metadata) = file.metadata()
            && metadata.is_file()
            && excess > 0
        {
            // The disk has already failed; the caller reports the cause.
            let _ = file.set_len(metadata.len().saturating_sub(excess));
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partial_row_is_removed() {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(b"head\naaa\nbb").expect("written");
        let mut target = OutputTarget::File { file: file.try_clone().expect("a file"), path: PathBuf::new(), keep: 0 };
        assert_eq!(cut_partial_line(&mut target, b"aaa\nbbb\n", 6), 4);
        assert_eq!(file.metadata().expect("a file").len(), 9, "header and the first row");
        assert_eq!(cut_partial_line(&mut target, b"ccc\n", 0), 0);
        assert_eq!(file.metadata().expect("a file").len(), 9);
    }

    fn writer(path: &std::path::Path) -> TargetWriter {
        let file = File::options().append(true).create(true).open(path).expect("a file");
        TargetWriter::new(OutputTarget::File { file, path: path.to_owned(), keep: 0 }, None)
    }

    #[test]
    #[cfg(unix)]
    fn file_that_became_shorter_gets_its_header_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        let mut writer = writer(&path);
        writer.set_header(HeaderPlace::Present, b"head\n").expect("taken");
        writer.write_rows(b"head\naaa\nbbb\n", 2).expect("written");
        let file = File::options().write(true).open(&path).expect("a file");
        file.set_len(0).expect("truncated");
        writer.write_rows(b"ccc\n", 1).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("read"), "head\nccc\n");
        file.set_len(7).expect("truncated");
        writer.write_rows(b"ddd\n", 1).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("read"), "head\ncc\nhead\nddd\n");
        assert_eq!(writer.take_changes(), vec![FileChange::Shortened(path.clone()); 2]);
        // If a file became longer, rows are appended at its end.
        std::fs::write(&path, "a much longer text of another program\n").expect("written");
        writer.write_rows(b"eee\n", 1).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("read"), "a much longer text of another program\neee\n");
        assert_eq!(writer.take_changes(), []);
    }

    #[test]
    #[cfg(unix)]
    fn moved_and_deleted_file_is_reported_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let [path, old] = ["run.csv", "run.old"].map(|name| folder.path().join(name));
        let mut writer = writer(&path);
        writer.write_rows(b"aaa\n", 1).expect("written");
        std::fs::rename(&path, &old).expect("moved");
        writer.write_rows(b"bbb\n", 1).expect("written");
        writer.write_rows(b"ccc\n", 1).expect("written");
        assert_eq!(std::fs::read_to_string(&old).expect("read"), "aaa\nbbb\nccc\n");
        std::fs::remove_file(&old).expect("deleted");
        writer.check_file().expect("no error");
        assert_eq!(writer.take_changes(), [FileChange::Moved(path.clone()), FileChange::Deleted(path)]);
    }
}
