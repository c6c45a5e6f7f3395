//! Text for failures: a message in one line, and a hint if something can be done.
//!
//! Each area of `tasks` has one file here. A message states the event and its meaning; a hint is a command to
//! type or one thing to check.

pub(super) mod autozero;
mod below;
mod check;
pub(super) mod config;
pub(super) mod conform;
mod detect;
pub mod host;
mod log;
pub(super) mod lss;
mod nmt;
mod node;
pub(super) mod pdo;
mod read;
mod scan;
pub(super) mod settings;
pub(super) mod store;

pub use below::{second_answer, unknown_objects};

use super::json;
use super::notes::{NoteText, effect};
use crate::canopen::id::NodeId;
use crate::tasks::failure::{BusError, Cause};
use crate::tasks::{Failure, Kind};
use serde::Serialize;
use std::fmt;
use std::io::{self, Write};

/// The text of a failure.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMessage {
    /// The kind, which decides the exit code.
    pub kind: Kind,
    /// The node of the failure.
    pub node: Option<NodeId>,
    /// The object that was read or written.
    pub object: Option<String>,
    /// The abort code, if the device rejected an SDO request.
    pub abort: Option<String>,
    /// One line: the node, the event, and the effects.
    pub message: String,
    /// A command to type, or one thing to check.
    pub hint: Option<String>,
    /// The place in the text entered by the user.
    pub place: Option<Place>,
    /// The changes before the failure, and the state left behind.
    pub effects: Vec<NoteText>,
}

/// The position of a character in a text entered by the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The whole text.
    pub text: String,
    /// The part before the character.
    pub before: String,
}

impl Place {
    /// The column of the character, counted from 1.
    pub fn column(&self) -> usize {
        self.before.chars().count() + 1
    }
}

/// The text for a cause, without the node in front.
#[derive(Clone, Debug, Default)]
struct CauseText {
    message: String,
    hint: Option<String>,
    place: Option<Place>,
}

impl CauseText {
    fn new(message: impl Into<String>) -> CauseText {
        CauseText { message: message.into(), ..CauseText::default() }
    }

    fn hint(mut self, hint: impl Into<String>) -> CauseText {
        self.hint = Some(hint.into());
        self
    }
}

impl ErrorMessage {
    /// Converts the failure of a task to text.
    pub fn of(failure: &Failure) -> ErrorMessage {
        failure.into()
    }

    /// An error outside of the tasks: wrong arguments, a local file.
    pub fn new(kind: Kind, message: impl Into<String>) -> ErrorMessage {
        ErrorMessage {
            kind,
            node: None,
            object: None,
            abort: None,
            message: message.into(),
            hint: None,
            place: None,
            effects: Vec::new(),
        }
    }

    /// An error about wrong arguments.
    pub fn usage(message: impl Into<String>) -> ErrorMessage {
        ErrorMessage::new(Kind::Usage, message)
    }

    /// Adds a hint to the error.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> ErrorMessage {
        self.hint = Some(hint.into());
        self
    }

    /// Writes the error as one JSON object on one line. `exit` is the exit code of its kind.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub fn json(&self, out: &mut dyn Write, exit: u8) -> io::Result<()> {
        #[derive(Serialize)]
        struct Object<'a> {
            error: Fields<'a>,
        }
        #[derive(Serialize)]
        struct Fields<'a> {
            kind: &'a str,
            exit: u8,
            message: &'a str,
            node: Option<u8>,
            object: Option<&'a str>,
            abort: Option<&'a str>,
            hint: Option<&'a str>,
            #[serde(skip_serializing_if = "Option::is_none")]
            column: Option<usize>,
            #[serde(skip_serializing_if = "<[NoteText]>::is_empty")]
            effects: &'a [NoteText],
        }
        let error = Fields {
            kind: kind_name(self.kind),
            exit,
            message: &self.message,
            node: self.node.map(NodeId::get),
            object: self.object.as_deref(),
            abort: self.abort.as_deref(),
            hint: self.hint.as_deref(),
            column: self.place.as_ref().map(Place::column),
            effects: &self.effects,
        };
        json::line(out, &Object { error })
    }
}

impl fmt::Display for ErrorMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ErrorMessage {}

/// The name of a kind in JSON.
pub fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::CheckFailed => "check-failed",
        Kind::Usage => "usage",
        Kind::NoAnswer => "no-answer",
        Kind::Refused => "refused",
        Kind::Bus => "bus",
        Kind::Unexpected => "unexpected",
        Kind::Partial => "partial",
        Kind::Io => "io",
        Kind::Interrupted => "interrupted",
    }
}

impl From<&Failure> for ErrorMessage {
    fn from(failure: &Failure) -> ErrorMessage {
        let cause_text = words(failure);
        let mut message = cause_text.message;
        let mut hint = cause_text.hint;
        let mut effects = Vec::new();
        for item in &failure.effects {
            let text = effect(failure.node, item);
            message = format!("{message}; {}", text.message);
            // A command that undoes an effect or completes the task is better than the general hint of the cause.
            hint = text.hint().or(hint);
            effects.push(text);
        }
        // "node 5 is in use by …" already contains the node.
        let is_named = matches!(&failure.cause, Cause::Bus(error) if matches!(**error, BusError::InUse(_)));
        if let Some(node) = failure.node.filter(|_| !is_named) {
            message = format!("node {node}: {message}");
        }
        ErrorMessage {
            kind: failure.kind(),
            node: failure.node,
            object: failure.object.map(|object| object.to_string()),
            abort: failure.abort().map(|code| format!("0x{:08X}", code.0)),
            message,
            hint,
            place: cause_text.place,
            effects,
        }
    }
}

fn words(failure: &Failure) -> CauseText {
    match &failure.cause {
        Cause::Bus(error) => below::bus(error),
        Cause::Sdo(error) => below::sdo(error),
        Cause::LssService(error) => below::lss(error),
        Cause::Node(error) => node::words(failure, error),
        Cause::Host(cause) => host::words(cause),
        Cause::Interrupted => CauseText::new("interrupted"),
        Cause::Expression(error) => below::expression(error),
        Cause::Unconfirmed(name) => CauseText::new(format!("the description {name} is not confirmed by a manual"))
            .hint(format!("if it is the right description, add: --device {name}")),
        Cause::Read(cause) => read::words(failure, cause),
        Cause::Scan(cause) => scan::words(failure, cause),
        Cause::Nmt(cause) => nmt::words(failure, cause),
        Cause::Store(cause) => store::words(failure, cause),
        Cause::Pdo(cause) => pdo::words(failure, cause),
        Cause::Settings(cause) => settings::words(failure, cause),
        Cause::Log(cause) => log::words(failure, cause),
        Cause::Check(cause) => check::words(failure, cause),
        Cause::Config(cause) => config::words(cause),
        Cause::Lss(cause) => lss::words(failure, cause),
        Cause::Detect(cause) => detect::words(cause),
        Cause::Autozero(cause) => autozero::words(failure, cause),
        Cause::Conform(cause) => conform::words(failure, cause),
    }
}
