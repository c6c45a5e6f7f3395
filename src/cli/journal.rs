//! The journal: files in `$XDG_STATE_HOME/cangauge/` with the changes to undo if the program is killed. A file contains
//! one temporary write to a device, or the settings of a device before `config apply`.
//!
//! The file is written and synced before the first write to the device, and removed after success. The file of a
//! temporary write is locked while its program runs. A file without a lock was left by a killed program.

use super::args::BusSpec;
use cangauge::bus::file::lock;
use cangauge::canopen::id::NodeId;
use cangauge::output::config::write_toml;
use cangauge::output::console::Console;
use cangauge::tasks::Failure;
use cangauge::tasks::config::{self, ConfigFailure, Snapshot};
use cangauge::tasks::journal::{Journal, JournalError, TemporaryWrite};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The first line of the file of a temporary write. Files with another version are ignored.
const HEADER: &str = "cangauge journal 1";

/// The extensions of the two kinds of files.
const WRITE_EXTENSION: &str = "undo";
const SETTINGS_EXTENSION: &str = "toml";

/// The files of one bus.
#[derive(Debug)]
pub(super) struct FileJournal {
    folder: Option<PathBuf>,
    bus: String,
    /// The locked files of the temporary writes of this run.
    locked: BTreeMap<PathBuf, File>,
}

impl FileJournal {
    /// Opens the journal of a bus. Simulated devices and recordings need no journal.
    pub(super) fn of(bus: &BusSpec) -> FileJournal {
        match bus {
            BusSpec::SocketCan(name) => FileJournal::in_folder(folder(), name),
            BusSpec::Remote(remote) => FileJournal::in_folder(folder(), &remote.to_string()),
            BusSpec::Sim(_) | BusSpec::Replay(_) => FileJournal::in_folder(None, ""),
        }
    }

    fn in_folder(folder: Option<PathBuf>, bus: &str) -> FileJournal {
        FileJournal { folder, bus: bus.to_owned(), locked: BTreeMap::new() }
    }

    /// Returns the path of a file for a device. The node-ID replaces a missing serial number.
    fn path(&self, node: NodeId, identity: [Option<u32>; 4], suffix: &str) -> Option<PathBuf> {
        let bus: String = self.bus.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        let [vendor, product, _, serial] = identity;
        let code = |number: Option<u32>| number.map_or_else(|| "-".to_owned(), |number| format!("{number:X}"));
        let device =
            serial.filter(|serial| *serial != 0).map_or_else(|| format!("node{node}"), |serial| serial.to_string());
        Some(self.folder.as_ref()?.join(format!("{bus}_{}_{}_{device}{suffix}", code(vendor), code(product))))
    }

    fn path_of(&self, write: &TemporaryWrite) -> Option<PathBuf> {
        let suffix = format!("_{}_{:04x}.{WRITE_EXTENSION}", write.node, write.object.index);
        self.path(write.node, write.identity, &suffix)
    }

    /// Returns the temporary writes of killed programs on this bus, for the nodes in `is_ours`. Locks their files.
    pub(super) fn left_behind(&mut self, is_ours: &dyn Fn(NodeId) -> bool) -> Vec<TemporaryWrite> {
        let entries = self.folder.as_ref().and_then(|folder| fs::read_dir(folder).ok());
        let paths: Vec<PathBuf> = entries.into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        let mut found = Vec::new();
        for path in
            paths.into_iter().filter(|path| path.extension().is_some_and(|extension| extension == WRITE_EXTENSION))
        {
            let Ok(text) = fs::read_to_string(&path) else { continue };
            let Some(write) = parse(&text, &self.bus).filter(|write| is_ours(write.node)) else { continue };
            let Ok(file) = File::options().append(true).open(&path) else { continue };
            if self.path_of(&write).as_ref() == Some(&path) && lock(&file).is_ok() {
                self.locked.insert(path, file);
                found.push(write);
            }
        }
        found
    }
}

impl Journal for FileJournal {
    fn record(&mut self, write: &TemporaryWrite) -> Result<(), JournalError> {
        let Some(path) = self.path_of(write) else { return Ok(()) };
        let file = write_synced(&path, text(write, &self.bus).as_bytes())
            .map_err(|error| JournalError { file: path.display().to_string(), reason: error.to_string() })?;
        self.locked.insert(path, file);
        Ok(())
    }

    fn remove(&mut self, write: &TemporaryWrite) {
        if let Some(path) = self.path_of(write) {
            // If the file remains, the next run finds another value in the object, and writes nothing.
            let _ = fs::remove_file(&path);
            self.locked.remove(&path);
        }
    }
}

/// The settings of one device before `config apply`. They are kept if the change fails or the program is killed.
pub(super) struct SettingsJournal<'a> {
    node: NodeId,
    path: Option<PathBuf>,
    console: &'a Console,
}

impl<'a> SettingsJournal<'a> {
    pub(super) fn new(bus: &str, snapshot: &Snapshot, console: &'a Console) -> SettingsJournal<'a> {
        let node = &snapshot.node;
        let path = FileJournal::in_folder(folder(), bus).path(
            node.id,
            node.identity.numbers(),
            &format!(".{SETTINGS_EXTENSION}"),
        );
        SettingsJournal { node: node.id, path, console }
    }

    /// The old settings after an incomplete change: the name of the file, and its text.
    ///
    /// # Errors
    /// [`ConfigFailure::NoJournal`].
    pub(super) fn latest(&self) -> Result<(String, String), Failure> {
        let text = self.path.as_ref().and_then(|path| fs::read_to_string(path).ok());
        let latest = self.path.as_ref().zip(text).map(|(path, text)| (path.display().to_string(), text));
        latest.ok_or_else(|| Failure::at(self.node, ConfigFailure::NoJournal))
    }
}

impl config::Journal for SettingsJournal<'_> {
    fn begin(&mut self, before: &Snapshot) -> Result<(), Failure> {
        let Some(path) = &self.path else {
            self.console.note("no journal: neither XDG_STATE_HOME nor HOME is set; --rollback is not possible");
            return Ok(());
        };
        // An earlier change was not completed, so the settings before that change are kept.
        if path.exists() {
            return Ok(());
        }
        let mut text = Vec::new();
        // The draft is renamed when it is complete, so a killed program leaves no incomplete journal.
        let draft = path.with_extension("draft");
        let written = write_toml(&before.dump(false), &mut text).and_then(|()| write_synced(&draft, &text));
        written.and_then(|_| fs::rename(&draft, path)).map(|()| sync_folder(path)).map_err(|error| {
            let reason = format!("{}: {error}", path.display());
            Failure::at(self.node, ConfigFailure::Journal { reason })
        })
    }

    fn finish(&mut self) {
        if let Some(path) = &self.path {
            // A failure is ignored. If the file remains, a later `--rollback` restores the settings from before this
            // change.
            let _ = fs::remove_file(path);
        }
    }
}

/// Writes a file and replaces its contents. When this returns, the file and its name are on the disk. The file is
/// locked until it is closed.
///
/// # Errors
/// The file cannot be written, or another process has locked it.
fn write_synced(path: &Path, text: &[u8]) -> io::Result<File> {
    fs::create_dir_all(path.parent().unwrap_or(path))?;
    let mut file = File::options().append(true).create(true).open(path)?;
    lock(&file).map_err(|_| io::Error::from(io::ErrorKind::ResourceBusy))?;
    file.set_len(0)?;
    file.write_all(text)?;
    file.sync_all()?;
    sync_folder(path);
    Ok(file)
}

/// Syncs the folder of a file, so that the name of the file survives a power failure.
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(path.parent().unwrap_or(path)) {
        // Some file systems cannot sync a folder.
        let _ = folder.sync_all();
    }
}

/// Returns the folder of the journal (XDG base directories). `None` if `XDG_STATE_HOME` and `HOME` are not set.
fn folder() -> Option<PathBuf> {
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let state = absolute("XDG_STATE_HOME").or_else(|| Some(absolute("HOME")?.join(".local/state")))?;
    Some(state.join("cangauge"))
}

fn text(write: &TemporaryWrite, bus: &str) -> String {
    let identity = write.identity.map(|number| number.map_or("-".to_owned(), |number| number.to_string()));
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    format!(
        "{HEADER}\nbus {bus}\nnode {}\nidentity {}\nobject {}\nbefore {}\nwritten {}\nend\n",
        write.node,
        identity.join(" "),
        write.object,
        hex(&write.before),
        hex(&write.written)
    )
}

/// Parses a file of this bus. Returns `None` if the file is incomplete: its write was not sent.
fn parse(text: &str, bus: &str) -> Option<TemporaryWrite> {
    let mut lines = text.lines();
    let mut line = |name: &str| lines.next()?.strip_prefix(name)?.strip_prefix(' ').map(str::to_owned);
    let is_ours = line("cangauge")? == HEADER.strip_prefix("cangauge ")? && line("bus")? == bus;
    let node = NodeId::new(line("node")?.parse().ok()?).ok()?;
    let numbers = line("identity")?;
    let numbers: Vec<Option<u32>> = numbers.split(' ').map(|number| number.parse().ok()).collect();
    let object = line("object")?.parse().ok()?;
    let before = bytes(&line("before")?)?;
    let written = bytes(&line("written")?)?;
    let is_complete = lines.next() == Some("end");
    let identity = numbers.try_into().ok()?;
    (is_ours && is_complete).then_some(TemporaryWrite { node, identity, object, before, written })
}

fn bytes(hex: &str) -> Option<Vec<u8>> {
    let pair = |at: usize| u8::from_str_radix(hex.get(at..at + 2)?, 16).ok();
    (0..hex.len()).step_by(2).map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cangauge::canopen::object::ObjectId;

    fn example() -> TemporaryWrite {
        TemporaryWrite {
            node: NodeId::new(5).expect("a node-ID"),
            identity: [Some(71), Some(1), None, Some(10001)],
            object: ObjectId::new(0x1017, 0),
            before: vec![0, 0],
            written: vec![100, 0],
        }
    }

    #[test]
    fn file_is_read_back_unless_it_is_cut_off() {
        let text = text(&example(), "can0");
        assert_eq!(parse(&text, "can0"), Some(example()));
        assert_eq!(parse(&text, "can1"), None);
        for length in 0..text.len() - 1 {
            assert_eq!(parse(&text[..length], "can0"), None, "{length} bytes");
        }
        assert_eq!(parse(&text.replace("journal 1", "journal 2"), "can0"), None);
    }

    #[test]
    fn write_is_left_behind_by_a_program_that_ends_before_it_is_undone() {
        let folder = tempfile::tempdir().expect("a folder");
        let journal = |bus: &str| FileJournal::in_folder(Some(folder.path().join("cangauge")), bus);
        let all = |_: NodeId| true;
        let mut first = journal("can0");
        first.record(&example()).expect("recorded");
        assert_eq!(journal("can0").left_behind(&all), [], "its program runs");
        assert!(journal("can0").record(&example()).is_err(), "its program runs");
        drop(first);
        assert_eq!(journal("can1").left_behind(&all), []);
        assert_eq!(journal("can0").left_behind(&|node| node.get() == 6), []);
        let mut next = journal("can0");
        assert_eq!(next.left_behind(&all), [example()]);
        next.remove(&example());
        drop(next);
        assert_eq!(journal("can0").left_behind(&all), []);
    }
}
