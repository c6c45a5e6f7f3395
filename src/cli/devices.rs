//! `cangauge devices`.

use super::descriptions::read_file;
use super::{Global, descriptions, own};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::device::catalog::{self, Model};
use cangauge::device::description::read_with_notes;
use cangauge::output::devices::{DescriptionText, Finding, Listed};
use cangauge::output::draft::toml;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::describe::draft;
use clap::{Args, Subcommand};
use std::sync::Arc;

/// List device descriptions; show one as TOML, check a file, or describe a new device
///
/// A description is a TOML file with the objects, signals and behaviour of one kind of device. To describe
/// another device, edit a copy of a description.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge devices\n  cangauge devices show mh4 > mine.toml\n  cangauge devices check mine.toml\n  cangauge -b sim devices new 1"
)]
pub(crate) struct Devices {
    #[command(subcommand)]
    action: Option<Action>,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print a description as TOML
    Show {
        /// Name of the description: mh4
        name: String,
    },
    /// Print a draft description, made from the connected device and its EDS (--eds); comments mark missing parts
    New {
        /// Node-ID: 5, 0x7f
        node: NodeId,
    },
    /// Report each mistake in a description file with its line
    Check {
        /// Description file (TOML)
        file: String,
    },
}

impl Devices {
    /// The node that is read.
    pub(super) fn claim(&self) -> Claim {
        match &self.action {
            Some(Action::New { node }) => Claim::Nodes(vec![*node]),
            _ => Claim::Nothing,
        }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            None => list(global),
            Some(Action::Show { name }) => show(name, global),
            Some(Action::New { node }) => {
                let overrides = descriptions::overrides(global, &[*node])?;
                let draft = global.with_master(|master| Ok(draft(master, *node, &overrides)?))?;
                global.print(&[DescriptionText { name: "new".to_owned(), toml: toml(&draft) }])
            }
            Some(Action::Check { file }) => check(file, global),
        }
    }
}

fn list(global: &Global) -> anyhow::Result<()> {
    let file = |model: &Arc<Model>| own::file_of(model).to_owned();
    let is_own = |model: &Arc<Model>| catalog::own().iter().any(|own| Arc::ptr_eq(own, model));
    let all = catalog::all().map(|model| Listed { model: model.clone(), file: is_own(model).then(|| file(model)) });
    global.print(&all.collect::<Vec<_>>())
}

fn show(name: &str, global: &Global) -> anyhow::Result<()> {
    let own = catalog::own().iter().find(|model| model.description.name == name);
    let own = own.map(|model| read_file(own::file_of(model))).transpose()?;
    let own = own.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    match own.or_else(|| catalog::text(name).map(str::to_owned)) {
        Some(toml) => global.print(&[DescriptionText { name: name.to_owned(), toml }]),
        None => Err(descriptions::unknown(name).into()),
    }
}

fn check(file: &str, global: &Global) -> anyhow::Result<()> {
    let text = descriptions::text(file, read_file(file)?)?;
    let (result, notes) = read_with_notes(&text);
    let mistakes = result.as_ref().err().cloned().unwrap_or_default();
    let finding = |mistake, is_error| Finding { file: file.to_owned(), mistake, is_error };
    let count = mistakes.len();
    let mistakes = mistakes.into_iter().map(|mistake| finding(mistake, true));
    let mut findings: Vec<Finding> = mistakes.chain(notes.into_iter().map(|note| finding(note, false))).collect();
    findings.sort_by_key(|finding| finding.mistake.place);
    global.print(&findings)?;
    match (result, count) {
        (Ok(description), _) => {
            let (objects, signals) = (description.objects.len(), description.signals.len());
            global.console().note(&format!("{file}: no mistakes ({signals} signals, {objects} entries of objects)"));
            Ok(())
        }
        (Err(_), 1) => Err(ErrorMessage::usage(format!("{file}: 1 mistake")).into()),
        (Err(_), count) => Err(ErrorMessage::usage(format!("{file}: {count} mistakes")).into()),
    }
}
