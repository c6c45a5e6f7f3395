//! The journal keeps the old settings of a device until the change is complete.
//!
//! Each device has one file, named after the bus and the identity. The file is written and synced before the first
//! write, and removed after success. It is kept if the change fails or the program is killed.

use super::apply::text_of;
use crate::cli::journal::{folder, sync_folder, write_synced};
use crate::output::console::Console;
use crate::tasks::Failure;
use crate::tasks::config::{ConfigFailure, Journal, Snapshot};
use std::fs::{self, File};
use std::path::PathBuf;

/// The file of a device: bus, vendor, product and serial number; without a serial number the node-ID.
fn file(bus: &str, snapshot: &Snapshot) -> Option<PathBuf> {
    let identity = &snapshot.node.identity;
    let code = |number: Option<u32>| number.map_or_else(|| "-".to_owned(), |number| format!("{number:X}"));
    let device = match identity.serial.filter(|serial| *serial != 0) {
        Some(serial) => serial.to_string(),
        None => format!("node{}", snapshot.node.id),
    };
    let bus: String = bus.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let name = format!("{bus}_{}_{}_{device}.toml", code(identity.vendor), code(identity.product));
    Some(folder()?.join(name))
}

/// The journal of one device.
pub(super) struct FileJournal<'a> {
    path: Option<PathBuf>,
    console: &'a Console,
}

impl<'a> FileJournal<'a> {
    pub(super) fn new(bus: &str, snapshot: &Snapshot, console: &'a Console) -> FileJournal<'a> {
        FileJournal { path: file(bus, snapshot), console }
    }
}

impl Journal for FileJournal<'_> {
    fn begin(&mut self, before: &Snapshot) -> Result<(), Failure> {
        let Some(path) = &self.path else {
            self.console.note("no journal: neither XDG_STATE_HOME nor HOME is set; --rollback is not possible");
            return Ok(());
        };
        // An earlier change was not completed, so the settings before that change are kept.
        if path.exists() {
            return Ok(());
        }
        // If the program is killed now, no incomplete journal remains.
        let draft = path.with_extension("draft");
        let written = write_synced(&draft, File::options().write(true).create(true), &text_of(before));
        written.and_then(|_| fs::rename(&draft, path)).map(|()| sync_folder(path)).map_err(|error| {
            let reason = format!("{}: {error}", path.display());
            Failure::at(before.node.id, ConfigFailure::Journal { reason })
        })
    }

    fn finish(&mut self) {
        if let Some(path) = &self.path {
            // A remaining file is older than the settings. --rollback then reports it, because the values differ.
            let _ = fs::remove_file(path);
        }
    }
}

/// The old settings of a device after an incomplete change: the name of the file, and its text.
///
/// # Errors
/// [`ConfigFailure::NoJournal`].
pub(super) fn latest(bus: &str, snapshot: &Snapshot) -> Result<(String, String), Failure> {
    let path = file(bus, snapshot);
    let text = path.as_ref().and_then(|path| fs::read_to_string(path).ok());
    match path.zip(text) {
        Some((path, text)) => Ok((path.display().to_string(), text)),
        None => Err(Failure::at(snapshot.node.id, ConfigFailure::NoJournal)),
    }
}
