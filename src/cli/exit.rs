//! From errors to words and exit codes. The one place where that happens.

use super::Cli;
use crate::bus::BusError;
use crate::master::{Error, SdoError};
use crate::measure::expression::ExpressionError;
use crate::output::console::Console;
use crate::tasks::{Failure, Kind};
use anstream::ColorChoice;
use clap::CommandFactory;
use clap::error::{ContextKind, ErrorKind};
use std::ffi::OsString;
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
pub fn usage(error: &clap::Error, words: impl Iterator<Item = OsString>) -> u8 {
    if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // A reader of the help that has gone has seen enough.
        let _ = error.print();
        return if error.use_stderr() { code(Kind::Usage) } else { 0 };
    }
    let words: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    let text = error.render().to_string();
    let paragraphs: Vec<&str> = text.split("\n\n").map(str::trim).collect();
    let first = paragraphs.first().map_or("", |first| first.trim_start_matches("error: "));
    let tip = paragraphs.iter().find_map(|paragraph| paragraph.strip_prefix("tip: "));
    let usage = paragraphs.iter().find_map(|paragraph| paragraph.strip_prefix("Usage: "));
    let hint = match (tip, usage) {
        (Some(tip), _) => one_line(tip),
        (None, Some(usage)) => format!("usage: {}", one_line(usage)),
        (None, None) => help_for(&words),
    };
    let message = wrong_value(error).unwrap_or_else(|| one_line(first));
    let mut failure = Failure::new(Kind::Usage, message);
    if let Some(error) = std::error::Error::source(error).and_then(|error| error.downcast_ref::<ExpressionError>()) {
        failure = error.clone().into();
    }
    failure.hint.get_or_insert(hint);
    let console =
        Console { quiet: false, verbose: 0, json: wants_json(&words), color: ColorChoice::Auto, progress: None };
    console.fail(&failure, code(Kind::Usage));
    code(Kind::Usage)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What a value is wrong for says its own parser best; a parser that does not name the value is helped out.
fn wrong_value(error: &clap::Error) -> Option<String> {
    let inner = std::error::Error::source(error)?.to_string();
    let (argument, value) = (error.get(ContextKind::InvalidArg)?, error.get(ContextKind::InvalidValue)?);
    let named = inner.contains(&format!("\"{value}\""));
    Some(if named { inner } else { format!("\"{value}\" for {argument}: {inner}") })
}

/// Parsing has failed, so the option has to be looked for by hand.
fn wants_json(words: &[String]) -> bool {
    let apart = words.windows(2).any(|pair| matches!(pair[0].as_str(), "-f" | "--format") && pair[1] == "json");
    apart || words.iter().any(|word| word == "-fjson" || word == "--format=json")
}

/// The command line that shows the help of the command that was begun.
fn help_for(words: &[String]) -> String {
    let mut root = Cli::command();
    root.build();
    let (mut command, mut line) = (&root, root.get_name().to_owned());
    let mut words = words.iter().skip(1);
    while let Some(word) = words.next() {
        if word.starts_with('-') {
            let mut arguments = command.get_arguments().filter(|argument| argument.get_action().takes_values());
            if arguments.any(|argument| {
                argument.get_long().is_some_and(|long| *word == format!("--{long}"))
                    || argument.get_short().is_some_and(|short| *word == format!("-{short}"))
            }) {
                words.next();
            }
        } else if let Some(below) = command.find_subcommand(word) {
            command = below;
            line = format!("{line} {word}");
        } else {
            break;
        }
    }
    line + " --help"
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
