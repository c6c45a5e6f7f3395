//! Dumps, compares and applies all settings of a device.
//!
//! One table ([`setting`]) contains every setting with its key, object, form of values and stage. [`Snapshot`] reads
//! the settings; [`crate::device::config_file::Document`] is a file.

mod apply;
mod arrivals;
mod check;
mod conditions;
mod dcf;
pub mod diff;
mod dump;
mod failure;
mod identity;
mod lines;
mod order;
mod problem;
pub mod setting;
mod snapshot;
pub mod value;

pub use apply::{ApplyReport, Journal, Options, Row as ChangedRow, apply, targets};
pub use arrivals::{Arrivals, assign_first};
pub use check::{FileSettings, Sections, Wanted, check};
pub use conditions::check_device;
pub use dump::{Dump, Row, SECTIONS};
pub use failure::{ConfigEffect, ConfigFact, ConfigFailure};
pub use identity::{Kind, Range};
pub use lines::{Line, Step, lines};
pub use problem::{Mistake, Problem};
pub use snapshot::Snapshot;

use crate::canopen::id::NodeId;
use crate::device::config_file::Document;
use crate::device::eds::Eds;
use crate::master::Master;
use crate::node::Overrides;
use crate::tasks::settings::open;
use crate::tasks::{Failure, Note};

/// A file with settings.
#[derive(Clone, Debug)]
pub enum File {
    /// A file in the format of `config dump`.
    Settings(Document),
    /// A DCF. The meaning of its values depends on the device.
    Dcf(Box<Eds>),
}

impl File {
    /// Returns the contents for one device, and notes about settings that the device lacks.
    pub fn document(&self, snapshot: &Snapshot) -> (Document, Vec<Note>) {
        match self {
            File::Settings(document) => (document.clone(), Vec::new()),
            File::Dcf(dcf) => snapshot.document_of(dcf),
        }
    }
}

/// Adds the PDOs and services to a file that an interrupted run may have switched off, unless the file contains them.
pub fn resume(document: &mut Document, before: &Document) {
    let is_switch = |key: &str| key.ends_with(".enabled") || key.ends_with("-producer");
    let switches = before.entries.iter().filter(|entry| is_switch(&entry.key));
    let missing = switches.filter(|entry| document.entries.iter().all(|own| own.key != entry.key));
    document.entries.extend(missing.cloned().collect::<Vec<_>>());
}

/// Reads all settings of a node, and further objects in a file.
///
/// # Errors
/// The node does not answer; bus errors and Ctrl-C.
pub fn read(
    master: &mut Master<'_>,
    node: NodeId,
    overrides: &Overrides,
    file: Option<&File>,
) -> Result<Snapshot, Failure> {
    let node = open(master, node, overrides)?;
    let mut settings = setting::settings(&node);
    let named = match file {
        None => Vec::new(),
        Some(File::Settings(document)) => check::named_objects(document, &node, &settings),
        Some(File::Dcf(dcf)) => dcf::named_objects(dcf, &node, &settings),
    };
    settings.extend(named);
    Snapshot::read(master, node, settings)
}

impl Snapshot {
    /// Checks a file against the device.
    ///
    /// # Errors
    /// All mistakes, in the order of their places in the file.
    pub fn check(&self, document: &Document) -> Result<FileSettings, Vec<Mistake>> {
        check(document, &self.node, &self.settings, Some(self))
    }
}
