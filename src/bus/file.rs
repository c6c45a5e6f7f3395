//! Queries about open files: which process has the lock, whether the file was renamed or deleted, whether a FIFO has a
//! reader. Reads compressed files.

use super::interrupt::Interrupts;
use flate2::bufread::MultiGzDecoder;
use std::fs::{File, Metadata, TryLockError};
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::time::{Duration, Instant};

/// The first bytes of a gzip file.
pub(super) const GZIP: &[u8] = b"\x1f\x8b";

/// The buffer size for a file that is read to its end.
const BUFFER_SIZE: usize = 1 << 18;

/// Opens a file to read its text; `-` is standard input. A gzip file is decompressed.
///
/// # Errors
/// The file cannot be opened or read.
pub fn open_text(path: &Path) -> io::Result<Box<dyn BufRead>> {
    let mut reader: Box<dyn BufRead> = match path.to_str() {
        Some("-") => Box::new(BufReader::with_capacity(BUFFER_SIZE, io::stdin())),
        _ => Box::new(BufReader::with_capacity(BUFFER_SIZE, File::open(path)?)),
    };
    if !reader.fill_buf()?.starts_with(GZIP) {
        return Ok(reader);
    }
    Ok(Box::new(BufReader::with_capacity(BUFFER_SIZE, MultiGzDecoder::new(reader))))
}

/// The file cannot be locked: it is already open elsewhere and locked there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Locked {
    /// The process that has the lock, if known.
    pub process: Option<u32>,
    /// Whether this process has the lock.
    pub is_own: bool,
}

/// Locks a regular file until it is closed, so that it has only one writer. Other files are not locked.
///
/// # Errors
/// Another process is writing the file, or this process has locked it through another open file.
pub fn lock(file: &File) -> Result<(), Locked> {
    if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
        return Ok(());
    }
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let process = holder(file);
            Err(Locked { process, is_own: process == Some(std::process::id()) })
        }
        // Some network file systems have no locks.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

/// Returns the process that has the lock, from `/proc/locks`; `None` unless exactly one process has it.
fn holder(file: &File) -> Option<u32> {
    let (_, inode) = identity(&file.metadata().ok()?)?;
    let locks = std::fs::read_to_string("/proc/locks").ok()?;
    let mut holders = locks.lines().filter_map(|line| holder_in(line, inode));
    holders.next().filter(|_| holders.next().is_none())
}

/// Parses the process from a line of `/proc/locks`: `1: FLOCK ADVISORY WRITE 4711 fd:01:1234 0 EOF`. A line with `->`
/// is ignored, because its process still waits for the lock.
fn holder_in(line: &str, inode: u64) -> Option<u32> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [_, "FLOCK", _, _, process, place, ..] = words.as_slice() else { return None };
    let found: u64 = place.rsplit(':').next()?.parse().ok()?;
    // 0 stands for a process in another namespace.
    process.parse().ok().filter(|&process| found == inode && process != 0)
}

/// A change of the name of an open file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameChange {
    /// The file has another name now.
    Moved,
    /// The file was deleted.
    Deleted,
}

/// Checks whether an open file was renamed or deleted; `None` if `path` is still its name.
pub fn name_change(metadata: &Metadata, path: &Path) -> Option<NameChange> {
    let found = path.metadata().ok().and_then(|metadata| identity(&metadata));
    match identity(metadata) {
        Some(_) if links(metadata) == 0 => Some(NameChange::Deleted),
        Some(own) => (found != Some(own)).then_some(NameChange::Moved),
        None => None,
    }
}

/// Whether two open files are the same file.
pub fn is_same(one: &Metadata, other: &Metadata) -> bool {
    identity(one).is_some_and(|one| identity(other) == Some(one))
}

/// Returns the device and inode numbers; `None` if the system has none.
#[cfg(unix)]
pub fn identity(metadata: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((metadata.dev(), metadata.ino()))
}

#[cfg(unix)]
fn links(metadata: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(metadata)
}

/// Returns `None`: this system has no inode numbers.
#[cfg(not(unix))]
pub fn identity(_: &Metadata) -> Option<(u64, u64)> {
    None
}

#[cfg(not(unix))]
fn links(_: &Metadata) -> u64 {
    1
}

/// The interval at which a FIFO is checked for a reader.
const READER_INTERVAL: Duration = Duration::from_millis(20);

/// Waits until a program has opened a FIFO for reading, because opening it for writing would block until then. Returns
/// the waiting time, and a file that keeps the FIFO open until the caller has opened it. Does not wait for other files.
///
/// # Errors
/// [`io::ErrorKind::TimedOut`] after `limit`, [`io::ErrorKind::Interrupted`] after a signal.
#[cfg(unix)]
pub fn wait_for_reader(path: &Path, limit: Option<Duration>) -> io::Result<(Duration, Option<File>)> {
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
    if !path.metadata().is_ok_and(|metadata| metadata.file_type().is_fifo()) {
        return Ok((Duration::ZERO, None));
    }
    let (start, mut interrupts) = (Instant::now(), Interrupts::new()?);
    loop {
        let opened = File::options().write(true).custom_flags(libc::O_NONBLOCK).open(path);
        match opened {
            Err(error) if error.raw_os_error() == Some(libc::ENXIO) => {}
            opened => return Ok((start.elapsed(), Some(opened?))),
        }
        let left = limit.map_or(READER_INTERVAL, |limit| limit.saturating_sub(start.elapsed()));
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        if interrupts.wait_for(left.min(READER_INTERVAL)) {
            return Err(io::ErrorKind::Interrupted.into());
        }
    }
}

/// Does not wait on this system: the caller waits when it opens a FIFO without a reader.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn wait_for_reader(_: &Path, _: Option<Duration>) -> io::Result<(Duration, Option<File>)> {
    Ok((Duration::ZERO, None))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn file_has_one_writer() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        let first = File::create(&path).expect("created");
        let second = File::open(&path).expect("opened");
        assert_eq!(lock(&first), Ok(()));
        let process = cfg!(target_os = "linux").then(std::process::id);
        assert_eq!(lock(&second), Err(Locked { process, is_own: process.is_some() }));
        drop(first);
        assert_eq!(lock(&second), Ok(()));
        assert_eq!(lock(&File::open("/dev/null").expect("a device")), Ok(()));
    }

    #[test]
    fn lines_of_proc_locks() {
        let line = "1: FLOCK  ADVISORY  WRITE 4711 fd:01:1234 0 EOF";
        assert_eq!((holder_in(line, 1234), holder_in(line, 123)), (Some(4711), None));
        assert_eq!(holder_in("1: -> FLOCK  ADVISORY  WRITE 4712 fd:01:1234 0 EOF", 1234), None);
        assert_eq!(holder_in("2: POSIX  ADVISORY  WRITE 4711 fd:01:1234 0 EOF", 1234), None);
        assert_eq!(holder_in("1: FLOCK  ADVISORY  WRITE 0 fd:01:1234 0 EOF", 1234), None);
    }

    #[test]
    fn renamed_or_deleted_file_is_detected() {
        let folder = tempfile::tempdir().expect("a folder");
        let [path, other] = ["run.csv", "old.csv"].map(|name| folder.path().join(name));
        let file = File::create(&path).expect("created");
        let change = || name_change(&file.metadata().expect("metadata"), &path);
        assert_eq!(change(), None);
        std::fs::rename(&path, &other).expect("moved");
        assert_eq!(change(), Some(NameChange::Moved));
        File::create(&path).expect("a new one");
        assert_eq!(change(), Some(NameChange::Moved), "another file has the name");
        std::fs::remove_file(&other).expect("deleted");
        assert_eq!(change(), Some(NameChange::Deleted));
    }
}
