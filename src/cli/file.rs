//! Files that a command writes: opened before the bus, and none overwritten unasked.

use super::exit::FileError;
use crate::tasks::{Failure, Kind};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file to be written. What stood in it stays until there is something to write; a new one in which
/// nothing came to stand goes away again.
#[derive(Debug)]
pub(super) struct OutFile {
    path: PathBuf,
    file: File,
    new: bool,
}

impl OutFile {
    pub(super) fn create(path: &Path, force: bool) -> anyhow::Result<OutFile> {
        let mut options = OpenOptions::new();
        options.write(true);
        let there = path.metadata().ok();
        let new = there.is_none();
        // A FIFO and a device are opened as they are, as other programs do.
        if new || !force && there.is_some_and(|metadata| metadata.is_file()) {
            options.create_new(true);
        }
        match options.open(path) {
            Ok(file) => Ok(OutFile { path: path.to_owned(), file, new }),
            Err(source) if source.kind() == io::ErrorKind::AlreadyExists => {
                let failure = Failure::new(Kind::Usage, format!("{} exists", path.display()));
                Err(failure.hint("overwrite it with --force, or name another file").into())
            }
            Err(source) => Err(FileError { what: format!("create {}", path.display()), source }.into()),
        }
    }

    /// The file, for somebody else to empty and to write to.
    pub(super) fn handle(&self) -> anyhow::Result<File> {
        self.file.try_clone().map_err(|source| self.error(source))
    }

    /// Writes all there is to write.
    pub(super) fn write(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let regular = self.file.metadata().is_ok_and(|metadata| metadata.is_file());
        let emptied = if regular { self.file.set_len(0) } else { Ok(()) };
        // An object of no bytes makes a file of no bytes, which stays.
        self.new = false;
        emptied.and_then(|()| self.file.write_all(bytes)).map_err(|source| self.error(source))
    }

    /// What the operating system says, with the file's name.
    pub(super) fn error(&self, source: io::Error) -> anyhow::Error {
        FileError { what: format!("write {}", self.path.display()), source }.into()
    }
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
