//! Messages, hints and notes of `store` and `restore`.

use super::CauseText;
use super::node::shown;
use crate::canopen::id::NodeId;
use crate::output::notes::NoteText;
use crate::tasks::Failure;
use crate::tasks::store::{Difference, Group, Snapshot, StoreCommand, StoreEffect, StoreFact, StoreFailure};

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &StoreFailure) -> CauseText {
    let object = failure.object.map(|object| object.to_string()).unwrap_or_default();
    match cause {
        StoreFailure::NotOnCommand { command: StoreCommand::Store, bits } if bits & 2 != 0 => CauseText::new(format!(
            "the device stores automatically, not on command ({object} reads 0x{bits:08X}): nothing was stored"
        )),
        StoreFailure::NotOnCommand { command, bits } => CauseText::new(format!(
            "the device does not {} on command ({object} reads 0x{bits:08X}): nothing was {}",
            name(*command),
            done(*command)
        )),
        StoreFailure::NoGroup { command, group: Group::All, .. } => CauseText::new(format!(
            "the device cannot {} (no {object}): nothing was {}",
            name(*command),
            done(*command)
        )),
        StoreFailure::NoGroup { command, group, .. } => {
            let cause_text = CauseText::new(format!(
                "the device cannot {} group {} (no {object}): nothing was {}",
                name(*command),
                group.as_str(),
                done(*command)
            ));
            match failure.node {
                Some(node) => cause_text.hint(format!("{} everything: cangauge {0} {node}", name(*command))),
                None => cause_text,
            }
        }
        StoreFailure::CapabilityUnreadable { command, code } => {
            let (name, done) = (name(*command), done(*command));
            CauseText::new(format!(
                "it is unknown whether the device can {name} ({object} cannot be read: {code}): nothing was {done}"
            ))
        }
        StoreFailure::ChangedAtReset(changed) => {
            let change = |change: &Difference| {
                let now = change.found.as_ref().map_or_else(|| "not readable".to_owned(), |now| shown(&now.value()));
                format!("{} was {} and is {now}", label(&change.expected), shown(&change.expected.value()))
            };
            CauseText::new(format!("settings changed at the reset: {}", list(changed, change)))
        }
        StoreFailure::NotDefault(wrong) => {
            let wrong_value = |wrong: &Difference| {
                let now = wrong.found.as_ref().map_or_else(|| "not readable".to_owned(), |now| shown(&now.value()));
                format!("{} is {now} instead of {}", label(&wrong.expected), shown(&wrong.expected.value()))
            };
            CauseText::new(format!("restored and reset, but not at the defaults: {}", list(wrong, wrong_value)))
        }
    }
}

/// The text for an effect.
pub(in crate::output) fn effect(node: &str, effect: &StoreEffect) -> NoteText {
    match effect {
        StoreEffect::SignatureSent { command, group } => {
            let (signature, object) = (command.signature(), command.object(*group));
            let (unknown, verify) = match command {
                StoreCommand::Store => ("whether the settings were stored", "--verify"),
                StoreCommand::Restore => ("whether the next reset sets the defaults", "--reset"),
            };
            let message =
                format!("\"{signature}\" was sent to {object} once and is not repeated; it is unknown {unknown}");
            let command = format!("cangauge {} {node} --group {} {verify}", name(*command), group.as_str());
            NoteText::new("signature-sent", message).command("repeat and verify", command)
        }
        StoreEffect::Answers(true) => NoteText::new("answers", "the device answers other requests"),
        StoreEffect::Answers(false) => NoteText::new("no-answer", "the device no longer answers"),
        StoreEffect::Stored(groups) => NoteText::new("stored", format!("stored: {}", Group::names(groups))),
        StoreEffect::NotVerified(command) => NoteText::new(
            "not-verified",
            format!("the device acknowledged the {}; the result was not verified", name(*command)),
        ),
    }
}

/// The text for a note.
pub(in crate::output) fn fact(node: Option<NodeId>, fact: &StoreFact) -> NoteText {
    let node = node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    match fact {
        StoreFact::InsteadOfAll(cob_ids) => {
            let cob_id = |(object, value): &(_, Option<u64>)| match value {
                Some(value) => format!("{object} (0x{value:08X})"),
                None => format!("{object} (not readable)"),
            };
            NoteText::new(
                "instead-of-all",
                format!(
                    "stored comm and app, because storing all would reset these COB-IDs: {}",
                    list(cob_ids, cob_id)
                ),
            )
        }
        StoreFact::OnlyInAll(names) => NoteText::new(
            "only-in-all",
            format!("only group \"all\" stores these; they were not saved: {}", names.join(", ")),
        ),
        StoreFact::NotStored(settings) => NoteText::new(
            "not-stored",
            format!(
                "the device does not store these; they return to their defaults at power off: {}",
                list(settings, with_value)
            ),
        ),
        StoreFact::AfterReset(group) => {
            let group = if *group == Group::All { String::new() } else { format!(" --group {}", group.as_str()) };
            NoteText::new(
                "after-reset",
                "the defaults are used after the next reset; a store before that may keep the old values",
            )
            .command("reset and compare", format!("cangauge restore {node}{group} --reset"))
        }
        StoreFact::NothingCompared => {
            NoteText::new("nothing-compared", "the device was reset; there is no known value to compare")
        }
        StoreFact::Unchanged(settings) => NoteText::new(
            "unchanged",
            format!(
                "these settings did not change, and differ from the usual defaults; they were set at the factory, or \
                 were not restored: {}",
                list(settings, with_value)
            ),
        ),
    }
}

fn name(command: StoreCommand) -> &'static str {
    match command {
        StoreCommand::Store => "store",
        StoreCommand::Restore => "restore",
    }
}

fn done(command: StoreCommand) -> &'static str {
    match command {
        StoreCommand::Store => "stored",
        StoreCommand::Restore => "restored",
    }
}

fn list<T>(items: &[T], text: impl Fn(&T) -> String) -> String {
    items.iter().map(text).collect::<Vec<_>>().join(", ")
}

/// Address and name: `0x1017:0 producer-heartbeat-time`.
fn label(setting: &Snapshot) -> String {
    match &setting.name {
        Some(name) => format!("{} {name}", setting.object),
        None => setting.object.to_string(),
    }
}

fn with_value(setting: &Snapshot) -> String {
    format!("{} ({})", label(setting), shown(&setting.value()))
}
