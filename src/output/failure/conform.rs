//! Text for causes and effects of `conform`.

use super::CauseText;
use crate::canopen::object::ObjectId;
use crate::output::conform::{lss_setting, stimulus_failure};
use crate::output::notes::NoteText;
use crate::tasks::Failure;
use crate::tasks::conform::{ConformEffect, ConformFailure, HistoryChange, Input, StimulusFailure};

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &ConformFailure) -> CauseText {
    let node = failure.node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    match cause {
        ConformFailure::Unfinished => {
            CauseText::new("an earlier change of its settings was not completed: nothing was changed")
                .hint(format!("cangauge config apply {node} --rollback"))
        }
        ConformFailure::NotAlone { nodes, frame } => {
            let seen = match (nodes.as_slice(), frame) {
                ([], Some(frame)) => format!("other traffic is on the bus ({frame})"),
                ([], None) => "other traffic is on the bus".to_owned(),
                ([one], _) => format!("node {one} is on the bus, too"),
                (several, _) => {
                    let several: Vec<String> = several.iter().map(ToString::to_string).collect();
                    format!("nodes {} are on the bus, too", several.join(", "))
                }
            };
            CauseText::new(format!("{seen}: nothing was changed")).hint(format!(
                "disconnect them, or check only areas other than pdo and lss: cangauge conform {node} --only sdo,nmt"
            ))
        }
    }
}

/// The text for an effect.
pub(in crate::output) fn effect(node: &str, effect: &ConformEffect) -> NoteText {
    let undo = format!("cangauge config apply {node} --rollback");
    match effect {
        ConformEffect::NotRestored(objects) => {
            NoteText::new("not-restored", format!("not restored: {}", list(objects))).command("undo", undo)
        }
        ConformEffect::Unknown => {
            NoteText::new("not-restored", "the settings could not be restored").command("undo", undo)
        }
        ConformEffect::HistoryUnknown => {
            NoteText::new("error-history", "the error history (1003h) could not be read at the end")
        }
        ConformEffect::HistoryChanged(change) => NoteText::new("error-history", history_left(change)),
        ConformEffect::LssNotRestored(settings) => {
            let left: Vec<String> = settings.iter().map(|setting| lss_setting(*setting)).collect();
            NoteText::new("not-restored", left.join("; "))
        }
        ConformEffect::InputNotNormal(reason) => NoteText::new("input-not-normal", input_left(reason)),
    }
}

/// The text for an error history that is not as before.
pub(in crate::output) fn history_left(change: &HistoryChange) -> String {
    let (before, after) = (change.before.count, change.after.count);
    let entries = if after == 1 { "1 entry".to_owned() } else { format!("{after} entries") };
    let newest = change.after.newest.map(|entry| format!(", the newest is 0x{entry:08X}")).unwrap_or_default();
    format!("the error history (0x1003) has {entries} ({before} before){newest}")
}

/// The text for an input of the device that is not as before.
pub(in crate::output) fn input_left(reason: &StimulusFailure) -> String {
    let normal = Input::Normal.name();
    format!("the input of the device may not be normal: --stimulus {normal}: {}", stimulus_failure(reason))
}

/// Objects in one line.
pub(in crate::output) fn list(objects: &[ObjectId]) -> String {
    objects.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
