//! Exit codes. This is the only place that converts errors to an exit code.

use super::Cli;
use anstream::ColorChoice;
use cangauge::bus::BusError;
use cangauge::master::{Error, SdoError};
use cangauge::measure::expression::ExpressionError;
use cangauge::output::console::Console;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::failure::Cause;
use cangauge::tasks::{Failure, Kind};
use clap::CommandFactory;
use clap::error::{ContextKind, ErrorKind};
use std::ffi::OsString;
use std::io;
use std::num::{IntErrorKind, ParseIntError};

/// Several failures, each with its own kind, and the kind that decides the exit code of the process.
#[derive(Debug, thiserror::Error)]
#[error("{} failures", .failures.len())]
pub(super) struct Several {
    /// Decides the exit code.
    pub(super) kind: Kind,
    /// The failures in the order of printing.
    pub(super) failures: Vec<Failure>,
}

/// Like [`Several`], for failures that do not come from a task.
#[cfg(feature = "publish")]
#[derive(Debug, thiserror::Error)]
#[error("{} failures", .messages.len())]
pub(super) struct Messages {
    /// Decides the exit code.
    pub(super) kind: Kind,
    /// The messages in the order of printing.
    pub(super) messages: Vec<ErrorMessage>,
}

/// Returns the result of a command for several nodes: success if no node failed.
///
/// # Errors
/// The failures. [`combined`] determines the kind.
pub(super) fn several(asked: usize, failures: Vec<Failure>) -> Result<(), Several> {
    let kinds: Vec<Kind> = failures.iter().map(Failure::kind).collect();
    match combined(asked, &kinds) {
        None => Ok(()),
        Some(kind) => Err(Several { kind, failures }),
    }
}

/// Like [`several`], if a node can have several failures, such as the mistakes of a file.
///
/// # Errors
/// The failures; the first one of each node decides the exit code.
pub(super) fn several_each(asked: usize, failures: Vec<Vec<Failure>>) -> Result<(), Several> {
    let kinds: Vec<Kind> = failures.iter().filter_map(|of_node| of_node.first().map(Failure::kind)).collect();
    match combined(asked, &kinds) {
        None => Ok(()),
        Some(kind) => Err(Several { kind, failures: failures.into_iter().flatten().collect() }),
    }
}

/// Returns the kind that decides the exit code; `None` without a failure. `kinds`: one for each failed node of `asked`.
///
/// A bus failure and Ctrl-C end the command at once, so they decide alone. Otherwise:
/// `partial` if some nodes succeeded, the common kind if all failures have the same kind, else `unexpected`.
fn combined(asked: usize, kinds: &[Kind]) -> Option<Kind> {
    let first = *kinds.first()?;
    if let Some(&end) = kinds.iter().find(|kind| matches!(kind, Kind::Interrupted | Kind::Bus)) {
        return Some(end);
    }
    Some(if kinds.len() < asked {
        Kind::Partial
    } else if kinds.iter().all(|&kind| kind == first) {
        first
    } else {
        Kind::Unexpected
    })
}

/// A local file that could not be opened, read or written.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub(super) struct FileError {
    /// The failed operation: `open run.csv`.
    pub(super) what: String,
    /// The error of the operating system.
    pub(super) source: io::Error,
}

/// The output pipe was closed. The command ends without a message and with success.
#[derive(Debug, thiserror::Error)]
#[error("the output pipe was closed")]
struct ClosedPipe;

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

/// Prints the result of the argument parser and returns the exit code: help and version unchanged, an error on one
/// line with a hint. `words` are the words of the command line.
pub fn usage(error: &clap::Error, words: impl Iterator<Item = OsString>) -> u8 {
    let words: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    let console =
        Console { quiet: false, verbose: 0, json: wants_json(&words), color: ColorChoice::Auto, progress: None };
    if !error.use_stderr() {
        let printed = open_stdout().and_then(|_| error.print().map_err(stdout));
        return printed.map_or_else(|error| print(&console, &error), |()| 0);
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let _ = error.print();
        return code(Kind::Usage);
    }
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
    let mut failure = ErrorMessage::usage(message);
    if let Some(error) = std::error::Error::source(error).and_then(|error| error.downcast_ref::<ExpressionError>()) {
        failure = (&Failure::from(error.clone())).into();
    }
    failure.hint.get_or_insert(hint);
    console.fail(&failure, code(Kind::Usage));
    code(Kind::Usage)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the message of the value parser. Adds the value if the message does not contain it.
fn wrong_value(error: &clap::Error) -> Option<String> {
    let source = std::error::Error::source(error)?;
    let inner = match source.downcast_ref::<ParseIntError>().map(ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => "the number is out of range".to_owned(),
        Some(_) => "not a whole number".to_owned(),
        None => source.to_string(),
    };
    let (argument, value) = (error.get(ContextKind::InvalidArg)?, error.get(ContextKind::InvalidValue)?);
    let named = inner.contains(&format!("\"{value}\""));
    Some(if named { inner } else { format!("\"{value}\" for {argument}: {inner}") })
}

/// Whether to print errors as JSON. Parsing has failed, so this function looks for the option in the words.
fn wants_json(words: &[String]) -> bool {
    let is_separate = words.windows(2).any(|pair| matches!(pair[0].as_str(), "-f" | "--format") && pair[1] == "json");
    is_separate || words.iter().any(|word| word == "-fjson" || word == "--format=json")
}

/// The command line that shows the help of the command in `words`.
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
        } else if let Some(subcommand) = command.find_subcommand(word) {
            command = subcommand;
            line = format!("{line} {word}");
        } else {
            break;
        }
    }
    line + " --help"
}

/// Prints an error and returns the exit code of the process.
pub fn report(cli: &Cli, error: &anyhow::Error) -> u8 {
    print(&cli.global.console(), error)
}

fn print(console: &Console, error: &anyhow::Error) -> u8 {
    let messages = messages(error);
    for message in &messages {
        console.fail(message, code(message.kind));
    }
    let kind = error.downcast_ref::<Several>().map(|several| several.kind);
    #[cfg(feature = "publish")]
    let kind = kind.or(error.downcast_ref::<Messages>().map(|messages| messages.kind));
    kind.or(messages.first().map(|message| message.kind)).map_or(0, code)
}

/// The messages to print; none if only the output pipe was closed.
fn messages(error: &anyhow::Error) -> Vec<ErrorMessage> {
    if error.is::<ClosedPipe>() {
        return Vec::new();
    }
    if let Some(several) = error.downcast_ref::<Several>() {
        return several.failures.iter().map(ErrorMessage::from).collect();
    }
    #[cfg(feature = "publish")]
    if let Some(several) = error.downcast_ref::<Messages>() {
        return several.messages.clone();
    }
    vec![message(error)]
}

fn message(error: &anyhow::Error) -> ErrorMessage {
    if let Some(failure) = error.downcast_ref::<Failure>() {
        failure.into()
    } else if let Some(message) = error.downcast_ref::<ErrorMessage>() {
        message.clone()
    } else if let Some(error) = error.downcast_ref::<FileError>() {
        ErrorMessage::new(Kind::Io, error.to_string())
    } else if let Some(error) = error.downcast_ref::<io::Error>() {
        ErrorMessage::new(Kind::Io, error.to_string())
    } else {
        ErrorMessage::new(Kind::Unexpected, format!("{error:#}"))
    }
}

/// Opens stdout.
///
/// # Errors
/// stdout was closed when the program started.
pub(super) fn open_stdout() -> anyhow::Result<io::Stdout> {
    cangauge::bus::stdout::stdout().map_err(stdout)
}

/// Returns the message of an error that means: no bus can be used. `doctor` reports it as a finding. `None` if another
/// program uses the node.
pub(super) fn bus_error(error: &anyhow::Error, has_interface: bool) -> Option<ErrorMessage> {
    let message = message(error);
    let cause = error.downcast_ref::<Failure>().map(|failure| &failure.cause);
    let is_in_use = matches!(cause, Some(Cause::Bus(error)) if matches!(**error, BusError::InUse(_)));
    let is_about_bus = message.kind == Kind::Bus || message.kind == Kind::Usage && !has_interface;
    (is_about_bus && !is_in_use).then_some(message)
}

/// Converts the error of a write to stdout. A closed pipe ends the command with success.
pub(super) fn stdout(error: io::Error) -> anyhow::Error {
    if error.kind() == io::ErrorKind::BrokenPipe {
        ClosedPipe.into()
    } else {
        FileError { what: "write to stdout".to_owned(), source: error }.into()
    }
}

/// Converts errors of the layers below to a [`Failure`].
pub(super) trait IntoFailure<T> {
    /// Converts the error of the result to a [`Failure`].
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exit_code_of_several_nodes() {
        assert_eq!(combined(2, &[]), None);
        assert_eq!(combined(2, &[Kind::NoAnswer]), Some(Kind::Partial));
        assert_eq!(combined(2, &[Kind::NoAnswer, Kind::NoAnswer]), Some(Kind::NoAnswer));
        assert_eq!(combined(2, &[Kind::NoAnswer, Kind::Refused]), Some(Kind::Unexpected));
        assert_eq!(combined(1, &[Kind::Refused]), Some(Kind::Refused));
        assert_eq!(combined(3, &[Kind::Refused, Kind::Bus]), Some(Kind::Bus));
    }
}
