//! `cangauge config`.

mod apply;
mod diff;
mod table;

use super::args::Nodes;
use super::exit::{FileError, open_stdout, stdout};
use super::file::{as_text, read_input};
use super::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::device::catalog;
use cangauge::device::config_file::{Document, Item, Place};
use cangauge::device::eds::Warning;
use cangauge::node::Node;
use cangauge::node::offline::offline;
use cangauge::output::config::{SCHEMA, write_toml};
use cangauge::output::dcf::write_dcf;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::config::{ConfigFailure, Mistake, Problem, read};
use cangauge::tasks::{self, Failure};
use clap::{Args, Subcommand};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Show all settings of a device as a file, compare them with a file, and set them from a file
///
/// The file is TOML with the sections [device], [address], [node], [signal.NAME], [tpdo.N], [object] and [calibration].
/// Values have units: "100ms", "3.2 bar". The whole file is checked before the first write. Only settings that differ
/// are written, and all settings are read back. diff and apply also accept a DCF (FILE.dcf).
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim config dump 1 > mh4.toml\n  cangauge -b sim config dump 127 --changed\n  cangauge config diff 1 mh4.toml\n  cangauge config apply 1 mh4.toml --dry-run\n  cangauge config apply 1-16 mh4.toml --store"
)]
pub(crate) struct Config {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
#[command(defer = true)]
enum Action {
    /// Print all settings of a device as a file for config apply
    Dump(Dump),
    /// Compare a device with a file, two devices, or two files; exit 1 if anything differs
    Diff(diff::Diff),
    /// Configure a device from a file: check the file, write the differences, read everything back
    // Not at the type `Apply`: clap builds its help later, which would replace the line about the global options.
    #[command(
        after_help = "Examples:\n  cangauge config apply 1 mh4.toml --dry-run\n  cangauge config apply 1 mh4.toml --store --reset\n  cangauge config apply 1-16 mh4.toml --store\n  cangauge config apply --table forty.csv mh4.toml --address --store --record forty.html\n  cangauge config apply 1 --rollback"
    )]
    Apply(apply::Apply),
    /// Print the JSON Schema of the settings file, for text editors that complete and check it
    Schema,
}

#[derive(Debug, Args)]
struct Dump {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Omit settings that are factory defaults
    #[arg(long)]
    changed: bool,
    /// Print a DCF (CiA 306) for other tools; without [calibration]
    #[arg(long, conflicts_with = "changed")]
    dcf: bool,
}

impl Config {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        match &self.action {
            Action::Dump(dump) => Claim::Nodes(vec![dump.node]),
            Action::Diff(diff) => diff.claim(),
            Action::Apply(apply) => apply.claim(),
            Action::Schema => Claim::Nothing,
        }
    }

    /// Whether the command only reads. A description for another device then causes a warning and no error.
    pub(super) fn only_reads(&self) -> bool {
        !matches!(self.action, Action::Apply(_))
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::Dump(dump) => dump.run(global),
            Action::Diff(diff) => diff.run(global),
            Action::Apply(apply) => apply.run(global),
            Action::Schema => open_stdout()?.lock().write_all(SCHEMA.as_bytes()).map_err(stdout),
        }
    }
}

impl Dump {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let overrides = descriptions::overrides(global, &[self.node])?;
        let snapshot = global.with_master(|master| Ok(read(master, self.node, &overrides, None)?))?;
        if self.dcf {
            return write_dcf(&snapshot, &mut super::exit::open_stdout()?.lock()).map_err(stdout);
        }
        let dump = snapshot.dump(self.changed);
        global.print_or(&dump.rows, |out| write_toml(&dump, out))
    }
}

/// Reads a settings file: a DCF if the extension is dcf or eds, otherwise TOML.
fn file(name: &str, global: &Global) -> anyhow::Result<tasks::config::File> {
    let extension = Path::new(name).extension().map(|extension| extension.to_ascii_lowercase());
    if extension.is_none_or(|extension| extension != "dcf" && extension != "eds") {
        return Ok(tasks::config::File::Settings(document(name)?));
    }
    let mut dcf = descriptions::eds(name, global)?;
    if !dcf.unread_values.is_empty() {
        let mistake = |warning: Warning| {
            let place = Place { line: warning.line, column: 1 };
            Mistake { place, key: String::new(), problem: Problem::Syntax { message: warning.text } }
        };
        return Err(mistakes(name, dcf.unread_values.drain(..).map(mistake).collect()));
    }
    descriptions::warn_about_values(name, &dcf, global);
    if dcf.parameter_values.is_empty() {
        let message = format!("{name}: it has no ParameterValue: it describes a device and sets nothing");
        return Err(ErrorMessage::usage(message).into());
    }
    Ok(tasks::config::File::Dcf(Box::new(dcf)))
}

/// Reads a file with settings in TOML.
fn document(file: &str) -> anyhow::Result<Document> {
    let text = File::open(file)
        .and_then(|opened| as_text(read_input(opened)?))
        .map_err(|source| FileError { what: format!("read {file}"), source })?;
    parse(file, &text)
}

fn parse(file: &str, text: &str) -> anyhow::Result<Document> {
    Document::parse(text).map_err(|error| {
        let problem = Problem::Syntax { message: error.message };
        mistakes(file, vec![Mistake { place: error.place, key: String::new(), problem }])
    })
}

/// Combines the mistakes of a file into one error.
fn mistakes(file: &str, mistakes: Vec<Mistake>) -> anyhow::Error {
    let failures = ConfigFailure::of_mistakes(file, None, mistakes);
    match super::exit::several_each(1, vec![failures]) {
        Err(several) => several.into(),
        Ok(()) => anyhow::anyhow!("{file}: no mistake"),
    }
}

/// Returns the device named in `device.kind`, according to its description. `None` if the kind is missing or unknown.
fn described(document: &Document) -> Option<Node> {
    let Item::Text(kind) = &document.get("device.kind")?.value else { return None };
    let model = catalog::by_name(kind)?;
    (!model.description.signals.is_empty()).then(|| offline(NodeId::MIN, &model))
}

/// The failures of several nodes, one list for each node.
type Failures = Vec<Vec<Failure>>;

/// Splits the positional arguments into nodes and file. `None` if they are not exactly these two.
fn nodes_and_file(words: &[String]) -> Option<(Nodes, &str)> {
    match words {
        [nodes, file] => Some((nodes.parse().ok()?, file)),
        _ => None,
    }
}
