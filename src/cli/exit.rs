//! From errors to words and exit codes. The one place where that happens.

use super::Cli;
use crate::bus::BusError;
use crate::master::{Error, SdoError};
use crate::output::console::Console;
use crate::tasks::{Failure, Kind};
use clap::error::ErrorKind;
use std::io;

/// Several nodes that failed; the first one's kind is that of all.
#[derive(Debug, thiserror::Error)]
#[error("{} nodes failed", .0.len())]
pub(super) struct Several(pub(super) Vec<Failure>);

/// A local file that fails.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub(super) struct FileError {
    /// What was being done.
    pub(super) what: String,
    /// What the operating system says.
    pub(super) source: io::Error,
}

/// Ends without a word and with success: whoever read our output has had enough.
#[derive(Debug, thiserror::Error)]
#[error("the reader has gone")]
struct ReaderGone;

/// The exit code of a kind. These numbers never change.
fn code(kind: Kind) -> u8 {
    match kind {
        Kind::CheckFailed => 1,
        Kind::Usage => 2,
        Kind::NoAnswer => 3,
        Kind::Refused => 4,
        Kind::Bus => 5,
        Kind::Unexpected => 6,
        Kind::Partial => 7,
        Kind::Io => 8,
        Kind::Interrupted => 130,
    }
}

/// What the parser says, in the contract's form: help and version as they are, and an error on one line
/// with a hint. `words` are those of the command line. Returns the exit code.
pub fn usage(error: &clap::Error, mut words: impl Iterator<Item = String>) -> u8 {
    if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // A reader of the help that has gone has seen enough.
        let _ = error.print();
        return if error.use_stderr() { code(Kind::Usage) } else { 0 };
    }
    let text = error.render().to_string();
    let paragraphs: Vec<&str> = text.split("\n\n").map(str::trim).collect();
    let one_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let first = paragraphs.first().map_or("", |first| first.trim_start_matches("error: "));
    // What a value is wrong for says its own parser best.
    let message = std::error::Error::source(error).map_or_else(|| first.to_owned(), |inner| inner.to_string());
    let tip = paragraphs.iter().find_map(|paragraph| paragraph.strip_prefix("tip: "));
    let help = paragraphs
        .iter()
        .find_map(|paragraph| paragraph.strip_prefix("Usage: "))
        .map(|usage| format!("usage: {}", one_line(usage)));
    let failure = Failure {
        hint: Some(tip.map(one_line).or(help).unwrap_or_else(|| "cangauge --help".to_owned())),
        ..Failure::new(Kind::Usage, one_line(&message))
    };
    // Parsing has failed, so the option has to be looked for by hand.
    let mut json = false;
    while let Some(word) = words.next() {
        json |= word == "--format=json" || word == "-fjson";
        json |= (word == "--format" || word == "-f") && words.next().is_some_and(|form| form == "json");
    }
    let console = Console { quiet: false, verbose: 0, json, color: anstream::ColorChoice::Auto, progress: None };
    console.fail(&failure, code(Kind::Usage));
    code(Kind::Usage)
}

/// Says what went wrong and returns the exit code.
pub fn report(cli: &Cli, error: &anyhow::Error) -> u8 {
    let failures = failures(error);
    let console = cli.global.console();
    let exit = failures.first().map_or(0, |failure| code(failure.kind));
    for failure in failures {
        console.fail(&failure, exit);
    }
    exit
}

/// What failed: nothing when only the reader of stdout has gone.
fn failures(error: &anyhow::Error) -> Vec<Failure> {
    if error.is::<ReaderGone>() {
        return Vec::new();
    }
    if let Some(Several(failures)) = error.downcast_ref::<Several>() {
        return failures.clone();
    }
    if let Some(failure) = error.downcast_ref::<Failure>() {
        return vec![failure.clone()];
    }
    let failure = if let Some(error) = error.downcast_ref::<FileError>() {
        Failure::new(Kind::Io, error.to_string())
    } else if let Some(error) = error.downcast_ref::<io::Error>() {
        Failure::new(Kind::Io, error.to_string())
    } else {
        Failure::new(Kind::Unexpected, format!("{error:#}"))
    };
    vec![failure]
}

/// An error of writing to stdout: a closed pipe is a quiet success.
pub(super) fn stdout(error: io::Error) -> anyhow::Error {
    if error.kind() == io::ErrorKind::BrokenPipe {
        ReaderGone.into()
    } else {
        FileError { what: "write to stdout".to_owned(), source: error }.into()
    }
}

/// Errors of the layers below, as the contract's kinds.
pub(super) trait IntoFailure<T> {
    /// The same result with its error as a [`Failure`].
    fn or_fail(self) -> Result<T, Failure>;
}

impl<T> IntoFailure<T> for Result<T, Error> {
    fn or_fail(self) -> Result<T, Failure> {
        self.map_err(Failure::from)
    }
}

impl<T> IntoFailure<T> for Result<T, SdoError> {
    fn or_fail(self) -> Result<T, Failure> {
        self.map_err(Failure::from)
    }
}

impl<T> IntoFailure<T> for Result<T, BusError> {
    fn or_fail(self) -> Result<T, Failure> {
        self.map_err(Failure::from)
    }
}
