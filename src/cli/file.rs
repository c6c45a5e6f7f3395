//! Files that a command reads or writes. Files to write are opened before the bus, so that a wrong name has no effect on
//! the bus.

use super::exit::{FileError, open_stdout};
use cangauge::bus::file::{Locked, is_same, lock, wait_for_reader};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::rows::{ExistingLines, OutputTarget, existing_lines};
use cangauge::tasks::Kind;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The maximum size of a description, an EDS or a settings file, in bytes. With it, `--eds /dev/zero` does not fill the
/// memory.
const MAX_INPUT: u64 = 16 << 20;

/// Reads the content of a file that contains a description or settings.
///
/// # Errors
/// The file cannot be read, or is larger than 16 MiB.
pub(super) fn read_input(file: File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(MAX_INPUT + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > MAX_INPUT {
        true => Err(io::Error::new(io::ErrorKind::FileTooLarge, "the file is larger than 16 MiB")),
        false => Ok(bytes),
    }
}

/// Returns the bytes as text.
///
/// # Errors
/// The bytes are not UTF-8.
pub(super) fn as_text(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "the text is not UTF-8"))
}

/// How an existing file is treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Existing {
    /// An existing file is an error.
    Refuse,
    /// The content is replaced.
    Overwrite,
    /// Rows are appended after the last whole line.
    Continue,
}

/// A file for data. An existing file is changed only when there is something to write. A new file that stays empty is
/// removed.
#[derive(Debug)]
pub(super) struct OutFile {
    path: PathBuf,
    file: File,
    is_new: bool,
    existing: Existing,
    /// The number of bytes of the existing file that are kept.
    keep: u64,
    /// Whether the file is a standard stream of this program, whose content is never removed.
    is_own_stream: bool,
    /// The time that opening waited for the reader of a FIFO.
    pub(super) waited: Duration,
}

impl OutFile {
    /// Opens a file. With `force`, an existing file is overwritten.
    pub(super) fn create(path: &Path, force: bool) -> anyhow::Result<OutFile> {
        OutFile::open(path, if force { Existing::Overwrite } else { Existing::Refuse }, None)
    }

    /// Opens a file and locks it. Waits for the reader of a FIFO, at most for `limit`.
    pub(super) fn open(path: &Path, existing: Existing, limit: Option<Duration>) -> anyhow::Result<OutFile> {
        let mut options = OpenOptions::new();
        options.append(true);
        let out = |file: File, is_new: bool, is_own_stream: bool, waited: Duration| OutFile {
            path: path.to_owned(),
            file,
            is_new,
            existing,
            keep: 0,
            is_own_stream,
            waited,
        };
        if is_own_stream(path) {
            if ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|name| path == Path::new(name)) {
                open_stdout()?;
            }
            // The shell opened this stream, which may already contain other data.
            let file = options.open(path).map_err(|source| file_error("open", path, source))?;
            return Ok(out(file, false, true, Duration::ZERO));
        }
        let metadata = path.metadata().ok();
        // The target of a dangling link is created.
        let is_dangling_link = metadata.is_none() && path.symlink_metadata().is_ok();
        let is_new = metadata.is_none() && !is_dangling_link;
        let is_regular = metadata.is_some_and(|metadata| metadata.is_file());
        // An existing FIFO or device file is only opened.
        if is_new || existing == Existing::Refuse && is_regular {
            options.create_new(true);
        }
        options.create(is_dangling_link);
        options.read(existing == Existing::Continue && is_regular);
        let (waited, _reader) = wait_for_reader(path, limit).map_err(|source| no_reader(path, source))?;
        match options.open(path) {
            Ok(file) => {
                lock_output(&file, path)?;
                Ok(out(file, is_new, false, waited))
            }
            Err(source) if source.kind() == io::ErrorKind::AlreadyExists => {
                let error = ErrorMessage::usage(format!("{} exists", path.display()));
                Err(error.hint("overwrite it with --force, or choose another file").into())
            }
            Err(source) => Err(file_error("create", path, source)),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn is_regular(&self) -> bool {
        !self.is_own_stream && self.file.metadata().is_ok_and(|metadata| metadata.is_file())
    }

    /// The lines of an existing file; `None` if it has no lines.
    pub(super) fn existing_lines(&mut self) -> anyhow::Result<Option<ExistingLines>> {
        if self.existing != Existing::Continue || self.is_new || !self.is_regular() {
            return Ok(None);
        }
        let lines = existing_lines(&mut self.file).map_err(|source| file_error("read", &self.path, source))?;
        self.keep = lines.as_ref().map_or(0, |lines| lines.length);
        Ok(lines)
    }

    /// Returns the target for a writer. The first `keep` bytes of the file stay, and the rest is replaced.
    pub(super) fn target(&self, keep: u64) -> anyhow::Result<OutputTarget> {
        let file = self.file.try_clone().map_err(|source| self.error(source))?;
        Ok(if self.is_own_stream {
            OutputTarget::Stream(Box::new(file))
        } else {
            OutputTarget::File { file, path: self.path.clone(), keep }
        })
    }

    /// Writes the whole content, after the bytes that are kept.
    pub(super) fn write(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let emptied = if self.is_regular() { self.file.set_len(self.keep) } else { Ok(()) };
        // The content may be an object of 0 bytes, so an empty file is kept.
        self.is_new = false;
        emptied.and_then(|()| self.file.write_all(bytes)).map_err(|source| self.error(source))
    }

    /// The error of the operating system, with the name of the file.
    pub(super) fn error(&self, source: io::Error) -> anyhow::Error {
        file_error("write", &self.path, source)
    }
}

impl Drop for OutFile {
    fn drop(&mut self) {
        let is_empty = self.file.metadata().is_ok_and(|metadata| metadata.is_file() && metadata.len() == 0);
        if self.is_new && is_empty {
            // An empty file that cannot be removed does no harm.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// A file for a report. It is written with a temporary name and then renamed, so that a reader never finds an
/// incomplete file. An existing report is replaced.
#[derive(Debug)]
pub(super) struct ReportFile {
    path: PathBuf,
    file: File,
    /// The name until the file is complete; `None` for a FIFO, a device and the standard streams of this program.
    temporary: Option<PathBuf>,
    /// The report that will be replaced. Its lock prevents writes by other programs.
    _replaced: Option<File>,
    /// The complete lines of the existing report, if the new report is appended.
    before: Vec<u8>,
    /// The time for which the program waited for the reader of a FIFO.
    pub(super) waited: Duration,
}

impl ReportFile {
    /// Opens the file with its temporary name. With `append`, the new report follows the existing one. It waits for the
    /// reader of a FIFO, not longer than `limit`.
    pub(super) fn create(path: &Path, append: bool, limit: Option<Duration>) -> anyhow::Result<ReportFile> {
        let is_regular = path.metadata().map_or(true, |metadata| metadata.is_file());
        let mut options = OpenOptions::new();
        if is_own_stream(path) || !is_regular {
            let (waited, _reader) = wait_for_reader(path, limit).map_err(|source| no_reader(path, source))?;
            let file = options.append(true).open(path).map_err(|source| file_error("open", path, source))?;
            let (path, before) = (path.to_owned(), Vec::new());
            return Ok(ReportFile { path, file, temporary: None, _replaced: None, before, waited });
        }
        // A link is kept, and its target replaced.
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let mut before = Vec::new();
        if append && path.exists() {
            before = fs::read(&path).map_err(|source| file_error("read", &path, source))?;
            let lines = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
            before.truncate(lines);
        }
        let mut name = OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(".tmp");
        let replaced = File::open(&path).ok();
        replaced.as_ref().map_or(Ok(()), |file| lock_output(file, &path))?;
        let temporary = path.with_file_name(name);
        options.append(true).create(true);
        let file = loop {
            let file = options.open(&temporary).map_err(|source| file_error("create", &path, source))?;
            lock_output(&file, &path)?;
            // Another program may have renamed the file between the open and the lock.
            let is_same = |now: &fs::Metadata| file.metadata().is_ok_and(|own| is_same(&own, now));
            if cfg!(not(unix)) || temporary.metadata().is_ok_and(|now| is_same(&now)) {
                break file;
            }
        };
        file.set_len(0).map_err(|source| file_error("create", &path, source))?;
        Ok(ReportFile { path, file, temporary: Some(temporary), _replaced: replaced, before, waited: Duration::ZERO })
    }

    /// Writes the whole report.
    pub(super) fn write(mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let mut result = self.file.write_all(&self.before).and_then(|()| self.file.write_all(bytes));
        if let (Ok(()), Some(temporary)) = (&result, &self.temporary) {
            result = fs::rename(temporary, &self.path);
        }
        if result.is_ok() {
            self.temporary = None;
        }
        result.map_err(|source| file_error("write", &self.path, source))
    }
}

impl Drop for ReportFile {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // A file that cannot be removed keeps its temporary name.
            let _ = fs::remove_file(temporary);
        }
    }
}

/// Locks an output file until it is closed.
pub(super) fn lock_output(file: &File, path: &Path) -> Result<(), ErrorMessage> {
    lock(file).map_err(|Locked { process, is_own }| {
        let name = path.display();
        match process {
            Some(_) if is_own => ErrorMessage::usage(format!("{name} is used for two outputs"))
                .hint("each output needs a file of its own"),
            Some(process) => ErrorMessage::usage(format!("{name} is being written by process {process}"))
                .hint("choose another file, or end that process"),
            None => ErrorMessage::usage(format!("{name} is being written by another process"))
                .hint("choose another file, or end that process"),
        }
    })
}

/// Converts the error of waiting for the reader of a FIFO.
pub(super) fn no_reader(path: &Path, source: io::Error) -> anyhow::Error {
    let name = path.display();
    match source.kind() {
        io::ErrorKind::TimedOut => ErrorMessage::new(Kind::Io, format!("open {name}: no program reads from this FIFO"))
            .hint(format!("start the reader first: cat {name}"))
            .into(),
        io::ErrorKind::Interrupted => {
            ErrorMessage::new(Kind::Interrupted, format!("interrupted while waiting for a reader of {name}")).into()
        }
        _ => file_error("open", path, source),
    }
}

fn file_error(verb: &str, path: &Path, source: io::Error) -> anyhow::Error {
    FileError { what: format!("{verb} {}", path.display()), source }.into()
}

/// Whether a path is a standard stream of this program.
fn is_own_stream(path: &Path) -> bool {
    let folders = ["/dev/fd", "/proc/self/fd"];
    path == Path::new("/dev/stdout")
        || path == Path::new("/dev/stderr")
        || folders.iter().any(|folder| path.starts_with(folder))
}
