//! Messages, hints and notes if a TPDO was changed, or could not be shown or changed.

use super::{CauseText, below};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::pdo::{MappingEntry, Transmission};
use crate::output::diagnosis;
use crate::output::notes::NoteText;
use crate::tasks::Failure;
use crate::tasks::diagnosis::Silence;
use crate::tasks::pdo::{
    CobIdUser, Incomplete, Parameter, PdoEffect, PdoFact, PdoFailure, Settings, StepError, StepWrite,
};
use crate::tasks::store::Group;

/// The largest number of mappable objects that a hint lists.
const MAX_LISTED: usize = 16;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &PdoFailure) -> CauseText {
    match cause {
        PdoFailure::NoTpdo => CauseText::new("no TPDO"),
        PdoFailure::Rejected { error, available } => {
            let numbers: Vec<String> = available.iter().map(|number| number.get().to_string()).collect();
            CauseText::new(error.to_string()).hint(format!("it has the TPDOs {}", numbers.join(", ")))
        }
        PdoFailure::Restarted => CauseText::new("it restarted while its TPDO was read"),
        PdoFailure::Multiplexed { number } => {
            CauseText::new(format!("{number} is a multiplexed PDO: its mapping is not a list"))
        }
        PdoFailure::NotStored { number } => {
            CauseText::new(format!("it does not store the settings of {number}: nothing was changed"))
                .hint("omit --store, and set the TPDO after every power-on")
        }
        PdoFailure::FixedMapping { number, mapping } => {
            let entries = list(mapping);
            CauseText::new(format!("the mapping of {number} is fixed ({entries}): nothing was changed"))
        }
        PdoFailure::Occupied { id, by } => {
            CauseText::new(format!("identifier 0x{id} is used by {}: nothing was changed", cob_id_user(by)))
                .hint("choose another identifier: --cob-id")
        }
        PdoFailure::Restricted { id } => {
            CauseText::new(format!("identifier 0x{id} is not for PDOs (CiA 301 reserves it for other services)"))
                .hint("PDOs can use 0x181 to 0x57F, if no other node uses the identifier")
        }
        PdoFailure::NoIdentifier { number, id } => {
            CauseText::new(format!("{number} has no identifier yet (0x{id})")).hint("set one: --cob-id 0x3A5")
        }
        PdoFailure::NoParameter { number, parameter } => {
            let name = match parameter {
                Parameter::EventTimer => "event timer",
                Parameter::InhibitTime => "inhibit time",
            };
            CauseText::new(format!("{number} has no {name} ({} does not exist)", parameter.object(*number)))
        }
        PdoFailure::TooLong { bits } => {
            let length = if bits % 8 == 0 { format!("{} bytes", bits / 8) } else { format!("{bits} bits") };
            CauseText::new(format!("the mapping has {length}; a PDO has at most 8 bytes"))
        }
        PdoFailure::UnknownName { name, nearest, signals } => unknown_name(name, nearest, signals),
        PdoFailure::WidthUnknown { object } => CauseText::new(format!("the width of {object} is unknown"))
            .hint(format!("add the width in bits: {object}/32")),
        PdoFailure::Change { error, write, mappable } => {
            let cause_text = CauseText::new(step(error, write.as_ref()));
            match mappable.is_empty() {
                true => cause_text,
                false => cause_text.hint(format!("it can map: {}", list_some(mappable))),
            }
        }
        PdoFailure::NothingReceived { nodes } => nothing_received(nodes),
    }
}

fn unknown_name(name: &str, nearest: &[String], signals: &[String]) -> CauseText {
    let cause_text = CauseText::new(format!("no object or signal \"{name}\""));
    match (nearest, signals) {
        ([], []) => cause_text,
        ([], signals) => cause_text.hint(format!("its signals: {}", signals.join(", "))),
        (nearest, _) => cause_text.hint(format!("similar names: {}", nearest.join(", "))),
    }
}

fn nothing_received(nodes: &[(NodeId, Silence)]) -> CauseText {
    if nodes.is_empty() {
        return CauseText::new("no TPDO was received");
    }
    let cause_text = CauseText::new(format!("no TPDO was received; {}", diagnosis::reasons(nodes)));
    let hint = |(node, silence): &(NodeId, Silence)| diagnosis::hint(silence, *node, &format!("cangauge log {node}"));
    match nodes.first().and_then(hint) {
        Some(hint) => cause_text.hint(hint),
        None => cause_text,
    }
}

fn cob_id_user(by: &CobIdUser) -> String {
    match by {
        CobIdUser::Service(name) => (*name).to_owned(),
        CobIdUser::Own(name) => format!("its {name}"),
        CobIdUser::Other(node, name) => format!("{name} of node {node}"),
        CobIdUser::Traffic => "an unknown sender".to_owned(),
    }
}

/// `0x6130:1/32`.
pub(in crate::output) fn entry(entry: MappingEntry) -> String {
    format!("{}/{}", entry.object, entry.bits)
}

fn list(entries: &[MappingEntry]) -> String {
    entries.iter().map(|&item| entry(item)).collect::<Vec<_>>().join(" ")
}

/// Lists the entries. Of a long list, only the first entries are shown.
fn list_some(entries: &[MappingEntry]) -> String {
    match entries.get(..MAX_LISTED) {
        Some(first) if entries.len() > MAX_LISTED => {
            format!("{} and {} more", list(first), entries.len() - MAX_LISTED)
        }
        _ => list(entries),
    }
}

/// Returns the reason why a step failed: `write 0x1A00:2 (0x6132:1/8): refused by the device …`.
fn step(error: &StepError, write: Option<&StepWrite>) -> String {
    let at = write.map(|write| format!("{} ({})", write.object, number(write)));
    match error {
        StepError::Rejected(error) | StepError::Lost(error) => {
            let write = write.filter(|write| write.object == error.object);
            let number = write.map(|write| format!(" ({})", number(write))).unwrap_or_default();
            format!("{} {}{number}: {}", error.operation, error.object, error.failure)
        }
        StepError::Restarted => "it restarted during the change".to_owned(),
        StepError::Interrupted => at.map_or_else(|| "interrupted".to_owned(), |at| format!("interrupted at {at}")),
        StepError::NotRecorded(error) => below::not_recorded(error),
        StepError::Bus(error) => at.map_or_else(|| error.to_string(), |at| format!("{error} at {at}")),
        StepError::ReadBackDiffers { object, found, written } => {
            format!("the write of {object} was acknowledged, but its value is {found:#X} instead of {written:#X}")
        }
    }
}

/// Formats the number of a write as it is usual for its object.
fn number(write: &StepWrite) -> String {
    match (write.object.index, write.object.sub) {
        (0x1a00..=0x1bff, 0) => format!("{} entries", write.value),
        (0x1a00..=0x1bff, _) => entry(MappingEntry::from_word(write.value)),
        (_, 1) => format!("0x{:08X}", write.value),
        _ => write.value.to_string(),
    }
}

/// The text for an effect.
pub(in crate::output) fn effect(node: &str, effect: &PdoEffect) -> NoteText {
    match effect {
        PdoEffect::Restored { number } => {
            NoteText::new("restored", format!("{number} has its old mapping and parameters"))
        }
        PdoEffect::Incomplete(incomplete) => incomplete_text(node, incomplete),
        PdoEffect::SetNotStored { number } => NoteText::new(
            "set-not-stored",
            format!("{number} has the requested settings, but they are lost at power off"),
        ),
    }
}

fn incomplete_text(node: &str, incomplete: &Incomplete) -> NoteText {
    let Incomplete { last, restore, previous, needs_preop, was_operational } = incomplete;
    let tpdo = previous.number;
    let mut message = match last {
        Some(write) => {
            format!("{tpdo} is only partly changed; the last confirmed write was {} ({})", write.object, number(write))
        }
        None => format!("it is unknown whether {tpdo} was changed: no step was confirmed"),
    };
    if let Some((error, write)) = restore {
        message += &format!("; restoring it failed: {}", step(error, write.as_ref()));
    }
    let start = if *was_operational { format!(" && cangauge nmt start {node}") } else { String::new() };
    let command = format!("{}{start}", recovery_command(node, previous, *needs_preop));
    NoteText::new("incomplete", message).command("when it answers again", command)
}

/// The text for a note.
pub(in crate::output) fn fact(fact: &PdoFact) -> NoteText {
    match fact {
        PdoFact::AlreadySet { number } => {
            NoteText::new("already-set", format!("{number} has these settings already: nothing was written"))
        }
        PdoFact::LostAtPowerOff { number } => NoteText::new(
            "not-kept",
            format!("the device does not store the settings of {number}: they are lost at power off"),
        ),
        PdoFact::Stored { groups } => {
            NoteText::new("stored", format!("stored ({}), acknowledged", Group::names(groups)))
        }
        PdoFact::MaybeNotMappable { object } => {
            NoteText::new("maybe-not-mappable", format!("{object} cannot be mapped according to the description"))
        }
        PdoFact::ChangedWhileOn { number, error } => {
            NoteText::new("changed-while-on", format!("{error}: {number} was changed while it was on"))
        }
        PdoFact::SetDespite { number, error, write } => {
            let step = step(error, write.as_ref());
            NoteText::new("set-despite", format!("{step}; but {number} has the requested settings"))
        }
        PdoFact::Off { number } => {
            NoteText::new("off", format!("{number} is off: map signals or set --cob-id to switch it on"))
        }
        PdoFact::WaitsForSync { number } => NoteText::new("waits-for-sync", format!("{number} waits for SYNC")),
        PdoFact::OnlyOnChange { number } => NoteText::new(
            "only-on-change",
            format!(
                "{number} is sent only if a value changes by its delta (x133h) or crosses a limit: its event timer is 0"
            ),
        ),
        PdoFact::TimerUnused { transmission } => {
            NoteText::new("timer-unused", format!("transmission type {transmission} does not use the event timer"))
        }
    }
}

/// Returns the command that sets a TPDO to `old`. If the TPDO was off or empty, the command consists of plain writes,
/// because `map` switches it on.
fn recovery_command(node: &str, old: &Settings, needs_preop: bool) -> String {
    let number = old.number.get();
    if !old.cob_id.is_valid() || old.mapping.is_empty() {
        let preop = if needs_preop { format!("cangauge nmt preop {node} && ") } else { String::new() };
        return preop + &write_command(node, old);
    }
    let mut line = format!("cangauge pdo map {node} {number} {}", list(&old.mapping));
    let transmission = match old.transmission() {
        kind @ (Transmission::AcyclicSync | Transmission::Sync(_)) => kind.to_string(),
        _ => old.transmission.to_string(),
    };
    line += &format!(" --transmission {transmission}");
    if let Some(timer) = old.event_timer_ms {
        line += &format!(" --event-timer {timer}ms");
    }
    if let Some(inhibit) = old.inhibit_100us {
        line += &format!(" --inhibit {}us", 100 * u32::from(inhibit));
    }
    if let CanId::Standard(id) = old.cob_id.can_id() {
        line += &format!(" --cob-id 0x{id:03X}");
    }
    line
}

fn write_command(node: &str, old: &Settings) -> String {
    let number = old.number;
    let mut line = format!("cangauge sdo write {node}");
    let mut add = |object, value: u32| line += &format!(" {object}=0x{value:X}");
    add(number.communication(1), old.cob_id.switched_off().0);
    add(number.mapping(0), 0);
    for (sub, entry) in (1..=u8::MAX).zip(&old.mapping) {
        add(number.mapping(sub), entry.word());
    }
    add(number.mapping(0), u32::try_from(old.mapping.len()).unwrap_or(0));
    add(number.communication(2), old.transmission.into());
    if let Some(timer) = old.event_timer_ms {
        add(number.communication(5), timer.into());
    }
    if let Some(inhibit) = old.inhibit_100us {
        add(number.communication(3), inhibit.into());
    }
    if old.cob_id.is_valid() {
        add(number.communication(1), old.cob_id.0);
    }
    line
}
