//! `cangauge devices`.

use super::descriptions::read_file;
use super::{Global, descriptions};
use crate::bus::claim::Claim;
use crate::device::catalog;
use crate::device::description::read_with_notes;
use crate::output::devices::{DescriptionText, Finding, Listed};
use crate::output::failure::ErrorMessage;
use clap::{Args, Subcommand};

/// List the device descriptions, show one as TOML, or check a file
///
/// A description is a TOML file with the objects, signals and behaviour of one kind of device. Start your own with a copy.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge devices\n  cangauge devices show mh4 > mine.toml\n  cangauge devices check mine.toml"
)]
pub(crate) struct Devices {
    #[command(subcommand)]
    action: Option<Action>,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print a description as TOML
    Show {
        /// Its name: mh4
        name: String,
    },
    /// Report each mistake in a description file with its line
    Check {
        /// A TOML file
        file: String,
    },
}

impl Devices {
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            None => list(global),
            Some(Action::Show { name }) => show(name, global),
            Some(Action::Check { file }) => check(file, global),
        }
    }
}

fn list(global: &Global) -> anyhow::Result<()> {
    let built_in = catalog::built_in().iter().map(|model| Listed { model: model.clone(), file: None });
    global.print(&built_in.collect::<Vec<_>>())
}

fn show(name: &str, global: &Global) -> anyhow::Result<()> {
    match catalog::text(name) {
        Some(toml) => global.print(&[DescriptionText { name: name.to_owned(), toml: toml.to_owned() }]),
        None => Err(descriptions::unknown(name).into()),
    }
}

fn check(file: &str, global: &Global) -> anyhow::Result<()> {
    let text =
        String::from_utf8(read_file(file)?).map_err(|_| ErrorMessage::usage(format!("{file}: not a text file")))?;
    let (result, notes) = read_with_notes(&text);
    let mistakes = result.as_ref().err().cloned().unwrap_or_default();
    let finding = |mistake, is_error| Finding { file: file.to_owned(), mistake, is_error };
    let count = mistakes.len();
    let mistakes = mistakes.into_iter().map(|mistake| finding(mistake, true));
    let mut findings: Vec<Finding> = mistakes.chain(notes.into_iter().map(|note| finding(note, false))).collect();
    findings.sort_by_key(|finding| finding.mistake.line);
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
