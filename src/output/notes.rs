//! Text for effects, notes and warnings of tasks.
//!
//! Each text has a code for scripts, which never changes, and a message. Some have a command to type.

use super::console::Console;
use super::doubt;
use super::events::left_operational;
use super::failure::host::up_by_hand;
use super::failure::{self, autozero, config, conform, pdo, settings, store};
use super::report::Cell;
use super::{lss, objects};
use crate::canopen::id::NodeId;
use crate::tasks::journal::{TemporaryWrite, UndoResult};
use crate::tasks::note::{Rule, StateEffect};
use crate::tasks::{Effect, Fact, Note};
use serde::Serialize;

/// An effect or a note as text, and as an object in the `effects` or `notes` of a JSON report.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct NoteText {
    /// The code for scripts.
    pub code: &'static str,
    /// The text in one line, without the node in front.
    pub message: String,
    /// A command to type.
    pub command: Option<String>,
    /// The purpose of the command: `undo`.
    #[serde(skip)]
    pub purpose: &'static str,
}

impl NoteText {
    /// An effect or a note without a command.
    pub(super) fn new(code: &'static str, message: impl Into<String>) -> NoteText {
        NoteText { code, message: message.into(), command: None, purpose: "" }
    }

    /// Adds a command. `purpose` is a word or clause: `undo`.
    pub(super) fn command(mut self, purpose: &'static str, command: impl Into<String>) -> NoteText {
        self.command = Some(command.into());
        self.purpose = purpose;
        self
    }

    /// Converts to a cell, for a list of notes in a report.
    pub(super) fn cell(&self) -> Cell {
        Cell::Object(vec![
            ("code", self.code.into()),
            ("message", self.message.as_str().into()),
            ("command", self.command.clone().into()),
        ])
    }

    /// The message with its hint.
    fn line(&self) -> String {
        let hint = self.hint().map_or_else(String::new, |hint| format!("; {hint}"));
        format!("{}{hint}", self.message)
    }

    /// The command with its purpose, as a hint: `undo: cangauge …`.
    pub fn hint(&self) -> Option<String> {
        self.command.as_ref().map(|command| format!("{}: {command}", self.purpose))
    }
}

/// The text for an effect on `node`.
pub(super) fn effect(node: Option<NodeId>, effect: &Effect) -> NoteText {
    let number = node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    match effect {
        Effect::Rule(rule) => rule_text(&number, rule),
        Effect::NothingChanged => NoteText::new("nothing-changed", "nothing was changed"),
        Effect::InterfaceNotRestored { interface, bit_rate, reason } => NoteText::new(
            "interface-not-restored",
            format!("{interface} was not restored to its previous bit rate: {reason}"),
        )
        .command("restore it", up_by_hand(interface, *bit_rate)),
        Effect::WasOperational => NoteText::new("was-operational", "the node was operational before")
            .command("start it again", format!("cangauge nmt start {number}")),
        Effect::Autozero(effect) => autozero::effect(&number, effect),
        Effect::Lss(effect) => failure::lss::effect(effect),
        Effect::Config(effect) => config::effect(&number, effect),
        Effect::Pdo(effect) => pdo::effect(&number, effect),
        Effect::Settings(effect) => settings::effect(&number, effect),
        Effect::State(state) => state_text(&number, *state),
        Effect::LeftOperational(nodes) => NoteText::new("left-operational", left_operational(nodes)),
        Effect::Store(effect) => store::effect(&number, effect),
        Effect::Conform(effect) => conform::effect(&number, effect),
    }
}

/// The text for a note.
pub fn note(note: &Note) -> NoteText {
    match &note.fact {
        Fact::KeptUntilPowerOff => {
            let text = NoteText::new("kept-until-power-off", "not stored: the node loses the new values at power off");
            match note.node {
                Some(node) => text.command("to keep them", format!("cangauge store {node}")),
                None => text,
            }
        }
        Fact::OperationalAgain => {
            NoteText::new("operational-again", "the node was operational and is operational again")
        }
        Fact::LeftOperational => NoteText::new(
            "left-operational",
            "the node was started and stays operational: its previous state is unknown and cannot be restored",
        ),
        Fact::Rule(rule) => rule_text("", rule),
        Fact::MayClip(value) => NoteText::new("may-clip", doubt::may_clip(value)),
        Fact::Autozero(fact) => autozero::fact(note.node, fact),
        Fact::Lss(fact) => lss::fact(fact),
        Fact::Config(fact) => config::fact(fact),
        Fact::Pdo(fact) => pdo::fact(fact),
        Fact::Settings(fact) => settings::fact(fact),
        Fact::State(state) => state_text(&note.node.map_or_else(|| "NODE".to_owned(), |node| node.to_string()), *state),
        Fact::Store(fact) => store::fact(note.node, fact),
        Fact::StateAsBooted => NoteText::new(
            "state-as-booted",
            "the state before the reset is unknown; the node is in the state in which it boots",
        ),
    }
}

/// `0x1800:5 accepts 0, 4-65535 ms (manual: table 29)`.
fn rule_text(node: &str, rule: &Rule) -> NoteText {
    let Rule { object, entry, is_out_of_range } = rule;
    let page = if entry.page.is_empty() { String::new() } else { format!(" (manual: {})", entry.page) };
    if *is_out_of_range {
        let unit = entry.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
        return NoteText::new("not-allowed", format!("{object} accepts {}{unit}{page}", objects::allowed(entry)));
    }
    let others: Vec<String> = entry.only_if_zero.iter().map(ToString::to_string).collect();
    let verb = if others.len() == 1 { "is" } else { "are" };
    let message = format!("{object} can be set only while {} {verb} 0{page}", others.join(" and "));
    let zeros: Vec<String> = entry.only_if_zero.iter().map(|other| format!("{other}=0")).collect();
    NoteText::new("only-if-zero", message)
        .command("switch the other off first", format!("cangauge sdo write {node} {}", zeros.join(" ")))
}

/// The text for an NMT state that differs from the previous one.
fn state_text(node: &str, state: StateEffect) -> NoteText {
    match state {
        StateEffect::Unknown => NoteText::new(
            "left-pre-operational",
            "the node was set to PRE-OPERATIONAL and stays there: its previous state is unknown and cannot be restored",
        )
        .command("start it", format!("cangauge nmt start {node}")),
        StateEffect::Differs { before, now } => {
            NoteText::new("state-differs", format!("the node was {before} before and is {now} now"))
                .command("show its state", format!("cangauge nmt state {node}"))
        }
        StateEffect::Unconfirmed { before } => {
            NoteText::new("state-unconfirmed", format!("the node was set to {before} again, without confirmation"))
        }
        StateEffect::NotRestored => NoteText::new("state-not-restored", "the previous NMT state was not restored"),
    }
}

/// The notes of a report, for JSON.
pub fn notes(notes: &[Note]) -> Vec<NoteText> {
    notes.iter().map(note).collect()
}

/// Converts the notes of a report to a cell: a list with one object for each note.
pub(super) fn cell(notes: &[Note]) -> Cell {
    Cell::List(notes.iter().map(|note| self::note(note).cell()).collect())
}

/// Prints a note on stderr, as a warning if needed.
pub fn print(console: &Console, note: &Note) {
    let node = note.node.map_or_else(String::new, |node| format!("node {node}: "));
    let line = format!("{node}{}", self::note(note).line());
    if note.fact.is_warning() { console.warn(&line) } else { console.note(&line) }
}

/// The warning about a temporary write that an earlier run left behind.
pub fn undone_text(write: &TemporaryWrite, undone: UndoResult) -> String {
    let TemporaryWrite { node, object, .. } = write;
    let [before, written] = [&write.before, &write.written].map(|bytes| value_text(bytes));
    let what = match undone {
        UndoResult::Restored => format!("restored to {before}"),
        UndoResult::ChangedSince => "it has another value now and was not changed".to_owned(),
        UndoResult::OtherDevice => "another device has this node-ID now: nothing was changed".to_owned(),
        UndoResult::NotRestored => format!("it could not be restored to {before}"),
    };
    format!("node {node}: an earlier run was killed and left {object} at {written}: {what}")
}

fn value_text(bytes: &[u8]) -> String {
    let number = bytes.iter().rev().try_fold(0u64, |number, &byte| Some(number.checked_mul(256)? + u64::from(byte)));
    number.map_or_else(|| format!("{} bytes", bytes.len()), |number| number.to_string())
}

/// Prints a note of a report on stderr.
pub fn print_text(console: &Console, text: &NoteText) {
    console.note(&text.line());
}
