//! Files that a command writes: opened before the bus, and none overwritten unasked.

use super::exit::FileError;
use crate::output::rows::{ExistingLines, Target, existing_lines};
use crate::tasks::{Failure, Kind};
use std::fs::{File, OpenOptions};
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

/// What is done with a file that exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Existing {
    /// It is not touched.
    Refuse,
    /// What stands in it goes.
    Overwrite,
    /// It is continued behind its last whole line.
    Continue,
}

/// A file to be written. What stood in it stays until there is something to write; a new one in which
/// nothing came to stand goes away again.
#[derive(Debug)]
pub(super) struct OutFile {
    path: PathBuf,
    file: File,
    new: bool,
    existing: Existing,
    /// How many bytes stay.
    keep: u64,
    /// A stream that we have been given: nothing of it is taken away.
    own: bool,
}

impl OutFile {
    pub(super) fn create(path: &Path, force: bool) -> anyhow::Result<OutFile> {
        OutFile::open(path, if force { Existing::Overwrite } else { Existing::Refuse })
    }

    pub(super) fn open(path: &Path, existing: Existing) -> anyhow::Result<OutFile> {
        let mut options = OpenOptions::new();
        if is_own(path) {
            // A file on our own standard output was chosen by whoever started us, and may hold more already.
            let file = options.append(true).open(path);
            let file = file.map_err(|source| FileError { what: format!("open {}", path.display()), source })?;
            return Ok(OutFile { path: path.to_owned(), file, new: false, existing, keep: 0, own: true });
        }
        options.write(true);
        let there = path.metadata().ok();
        // A link that leads nowhere yet leads to the new file.
        let leads = there.is_none() && path.symlink_metadata().is_ok();
        let new = there.is_none() && !leads;
        let regular = there.is_some_and(|metadata| metadata.is_file());
        // A FIFO and a device are opened as they are, as other programs do.
        if new || existing == Existing::Refuse && regular {
            options.create_new(true);
        }
        options.create(leads);
        options.read(existing == Existing::Continue && regular);
        match options.open(path) {
            Ok(file) => Ok(OutFile { path: path.to_owned(), file, new, existing, keep: 0, own: false }),
            Err(source) if source.kind() == io::ErrorKind::AlreadyExists => {
                let failure = Failure::new(Kind::Usage, format!("{} exists", path.display()));
                Err(failure.hint("overwrite it with --force, or name another file").into())
            }
            Err(source) => Err(FileError { what: format!("create {}", path.display()), source }.into()),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn is_regular(&self) -> bool {
        !self.own && self.file.metadata().is_ok_and(|metadata| metadata.is_file())
    }

    /// What stays of a file that is continued.
    pub(super) fn look(&mut self) -> anyhow::Result<Option<ExistingLines>> {
        if self.existing != Existing::Continue || self.new || !self.is_regular() {
            return Ok(None);
        }
        let what = || format!("read {}", self.path.display());
        let kept = existing_lines(&mut self.file).map_err(|source| FileError { what: what(), source })?;
        self.keep = kept.as_ref().map_or(0, |kept| kept.length);
        Ok(kept)
    }

    /// The file, for somebody else to empty but for its first `keep` bytes and to write to.
    pub(super) fn target(&self, keep: u64) -> anyhow::Result<Target> {
        let file = self.file.try_clone().map_err(|source| self.error(source))?;
        Ok(if self.own { Target::Stream(Box::new(file)) } else { Target::File { file, keep } })
    }

    /// Writes all there is to write, behind what stays.
    pub(super) fn write(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let emptied = if self.is_regular() {
            self.file.set_len(self.keep).and_then(|()| self.file.seek(io::SeekFrom::End(0)).map(drop))
        } else {
            Ok(())
        };
        // An object of no bytes makes a file of no bytes, which stays.
        self.new = false;
        emptied.and_then(|()| self.file.write_all(bytes)).map_err(|source| self.error(source))
    }

    /// What the operating system says, with the file's name.
    pub(super) fn error(&self, source: io::Error) -> anyhow::Error {
        FileError { what: format!("write {}", self.path.display()), source }.into()
    }
}

/// Whether a path names a stream that we have been given.
fn is_own(path: &Path) -> bool {
    let folders = ["/dev/fd", "/proc/self/fd"];
    path == Path::new("/dev/stdout")
        || path == Path::new("/dev/stderr")
        || folders.iter().any(|folder| path.starts_with(folder))
}

impl Drop for OutFile {
    fn drop(&mut self) {
        let empty = self.file.metadata().is_ok_and(|metadata| metadata.is_file() && metadata.len() == 0);
        if self.new && empty {
            // What cannot be removed stays: an empty file is no loss.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
