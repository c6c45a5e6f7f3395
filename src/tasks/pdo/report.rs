//! What is said of a change: why it failed and where it was left, and what the new settings mean.

use super::change::Change;
use super::device::{Trouble, Write};
use super::mend;
use super::settings::Settings;
use crate::canopen::pdo::MappingEntry;
use crate::canopen::sdo::AbortCode;
use crate::device::description::Remap;
use crate::master::Error;
use crate::tasks::{Failure, Kind};

/// So many objects that can be mapped are named.
const SHOWN: usize = 16;

impl Change<'_, '_, '_> {
    /// What was being done, at a write, as a part of a message.
    fn what(trouble: &Trouble, at: Option<&Write>) -> String {
        let step = |object| {
            let write = at.filter(|write| write.object == object);
            write.map(|write| format!(" ({})", described(write))).unwrap_or_default()
        };
        match trouble {
            Trouble::Refused(error) | Trouble::Lost(error) => {
                format!("{} {}{}: {}", error.operation, error.object, step(error.object), error.failure)
            }
            Trouble::Restarted => "it restarted in the middle".to_owned(),
            Trouble::Stopped(error) => {
                let at = at.map(|write| format!(" at {} ({})", write.object, described(write)));
                format!("{error}{}", at.unwrap_or_default())
            }
            Trouble::NotKept(object, reads, wrote) => {
                format!("{object} was acknowledged and reads {reads:#X} instead of {wrote:#X}")
            }
        }
    }

    /// What is to be said of a change that is there in spite of some trouble. An answer that was lost, and Ctrl-C
    /// when all was done, are none.
    pub(super) fn in_spite_of(&self, trouble: &Trouble) -> Option<String> {
        let told = matches!(trouble, Trouble::Refused(_) | Trouble::Restarted | Trouble::NotKept(..));
        let what = Self::what(trouble, self.failed_at.as_ref());
        told.then(|| format!("node {}: {what}; yet {} is as wanted", self.device.node, self.old.number))
    }

    /// The failure of the change, with how it ended.
    pub(super) fn failure(&self, trouble: &Trouble, end: &str) -> Failure {
        let node = self.device.node;
        let message = format!("{}: {end}", Self::what(trouble, self.failed_at.as_ref()));
        let failure = |kind| Failure::of_node(kind, node, &message);
        match trouble {
            Trouble::Refused(error) => {
                let cause = Failure::from(error.clone());
                let hint = match cause.abort() {
                    Some(AbortCode::NOT_MAPPABLE) => self.mappable(),
                    _ => None,
                };
                let failure = Failure { object: cause.object, ..failure(Kind::Refused) }.with_abort(cause.abort());
                match hint {
                    Some(hint) => failure.hint(hint),
                    None => failure,
                }
            }
            Trouble::Lost(error) => {
                let cause = Failure::from(error.clone());
                Failure { object: cause.object, ..failure(cause.kind()) }
            }
            Trouble::Restarted => failure(Kind::Unexpected),
            Trouble::Stopped(Error::Interrupted) => failure(Kind::Interrupted),
            Trouble::Stopped(_) => failure(Kind::Bus),
            Trouble::NotKept(object, ..) => Failure { object: Some(*object), ..failure(Kind::Unexpected) },
        }
    }

    /// What the description says can be mapped.
    fn mappable(&self) -> Option<String> {
        let model = self.instrument.model.as_ref()?;
        let entries = model.dictionary.iter().filter(|entry| entry.pdo);
        let entry = |object, bits| mend::entry_text(MappingEntry { object, bits });
        let mut names: Vec<String> = entries
            .filter_map(|known| Some(entry(known.object, u8::try_from(8 * known.data_type.width()?).ok()?)))
            .collect();
        if let Some(more) = names.len().checked_sub(SHOWN).filter(|&more| more > 0) {
            names.truncate(SHOWN);
            names.push(format!("and {more} more"));
        }
        (!names.is_empty()).then(|| format!("it can map: {}", names.join(" ")))
    }

    /// The device cannot be put back: where it was left, and the command that mends it.
    pub(super) fn left(&self, trouble: &Trouble, last: &Trouble) -> Failure {
        let (node, number) = (self.device.node, self.old.number);
        let end = match &self.done {
            Some(write) => format!("{number} was left half changed, after {} ({})", write.object, described(write)),
            None => format!("whether {number} was changed is not known: no step was confirmed"),
        };
        let why = match (trouble, last) {
            (Trouble::Lost(_), Trouble::Lost(_)) => String::new(),
            _ => format!("; putting it back failed: {}", Self::what(last, self.at.as_ref())),
        };
        let mend = mend::command(node, &self.old, self.remap == Remap::CountOnly);
        let start = if self.state.was_operational() { format!(" && cangauge nmt start {node}") } else { String::new() };
        self.failure(trouble, &format!("{end}{why}")).hint(format!("when it answers again: {mend}{start}"))
    }

    /// What the new settings mean for who waits for the PDO.
    pub(super) fn advise(&mut self) {
        let Settings { number, event_timer_ms, .. } = self.wanted;
        let (node, kind) = (self.device.node, self.wanted.transmission());
        if !self.wanted.cob_id.is_valid() {
            self.remarks.push(format!("node {node}: {number} is off: name signals, or --cob-id, to switch it on"));
        } else if kind.needs_sync() {
            self.remarks.push(format!("node {node}: {number} waits for SYNC"));
        } else if event_timer_ms == Some(0) {
            self.remarks.push(format!(
                "node {node}: the event timer of {number} is 0: it is sent only when a value changes by its delta \
                 (x133h) or passes a limit, if ever"
            ));
        }
        if kind.needs_sync() && event_timer_ms != self.old.event_timer_ms {
            self.remarks.push(format!("node {node}: with {kind} the event timer does nothing"));
        }
    }
}

/// What a write does, in words.
fn described(write: &Write) -> String {
    match (write.object.index, write.object.sub) {
        (0x1a00..=0x1bff, 0) => format!("{} entries", write.value),
        (0x1a00..=0x1bff, _) => mend::entry_text(MappingEntry::from_word(write.value)),
        (_, 1) => format!("0x{:08X}", write.value),
        _ => write.value.to_string(),
    }
}
