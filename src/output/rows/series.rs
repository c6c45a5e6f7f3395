//! The files of one recording: `run-0001.csv`, `run-0002.csv` and so on.

use crate::bus::file::lock;
use crate::publish::series::name;
use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// The numbered files of one recording.
#[derive(Debug)]
pub struct Series {
    base: PathBuf,
    next: u32,
    force: bool,
    /// The last file of an earlier run, and its length without an incomplete line.
    last: Option<(File, u64)>,
}

impl Series {
    /// The files `run-NNNN.csv` for the `base` `run.csv`, from the number `next`. With `force`, existing files are
    /// overwritten; otherwise their numbers are skipped.
    pub fn new(base: &Path, next: u32, force: bool) -> Series {
        Series { base: base.to_owned(), next, force, last: None }
    }

    /// Truncates the last file of an earlier run to this many bytes, before the first row is written.
    #[must_use]
    pub fn with_last(self, file: File, length: u64) -> Series {
        Series { last: Some((file, length)), ..self }
    }

    pub(super) fn repair_last(&mut self) -> io::Result<()> {
        self.last.take().map_or(Ok(()), |(file, length)| file.set_len(length))
    }

    /// Creates the next file and locks it. The number of a file that another program writes is skipped.
    pub(super) fn create(&mut self) -> io::Result<(PathBuf, File)> {
        loop {
            let path = name(&self.base, self.next);
            self.next += 1;
            let mut options = OpenOptions::new();
            options.append(true).create(self.force).create_new(!self.force);
            match options.open(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && self.next < u32::MAX => {}
                Ok(file) if lock(&file).is_err() => {}
                Ok(file) => return file.set_len(0).map(|()| (path, file)),
                Err(error) => return Err(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::series::existing;
    use std::fs;

    #[test]
    fn existing_files_are_found_and_skipped() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["run-0002.csv", "run-0010.csv", "run-1.csv", "run-0003.txt", "other-0004.csv", "run.csv"] {
            fs::write(folder.path().join(name), name).expect("written");
        }
        let base = folder.path().join("run.csv");
        assert_eq!(existing(&base).expect("read"), [2, 10]);
        let mut series = Series::new(&base, 1, false);
        let created: Vec<bool> = (0..2).map(|_| series.create().is_ok()).collect();
        assert_eq!((created, existing(&base).expect("read")), (vec![true, true], vec![1, 2, 3, 10]));
        assert_eq!(fs::read_to_string(folder.path().join("run-0002.csv")).expect("read"), "run-0002.csv");
        let first = Series::new(&base, 2, true).create().expect("overwritten");
        assert_eq!(fs::read_to_string(folder.path().join("run-0002.csv")).expect("read"), "");
        // A file in use by a writer is not overwritten.
        let (second, _file) = Series::new(&base, 2, true).create().expect("overwritten");
        assert_eq!((first.0, second), (name(&base, 2), name(&base, 3)));
    }
}
