//! Messages, hints and notes about settings that were applied or not applied.

use super::CauseText;
use crate::output::notes::NoteText;
use crate::tasks::config::{ConfigEffect, ConfigFact, ConfigFailure, Mistake, Problem};

/// The message and the hint for a cause.
pub(super) fn words(cause: &ConfigFailure) -> CauseText {
    match cause {
        ConfigFailure::Mistake { file, mistake } => of_mistake(file, mistake),
        ConfigFailure::Condition { place, key, wanted, found } => {
            let found = found.as_ref().map_or_else(|| "unknown".to_owned(), ToString::to_string);
            let cause_text =
                CauseText::new(format!("another device: {key} is {found}, the file has {wanted} (line {place})"));
            match key.as_str() {
                "calibration.serial" => {
                    cause_text.hint("omit --with-calibration: a calibration is for one device only")
                }
                _ => cause_text.hint("compare both: cangauge config diff NODE FILE"),
            }
        }
        ConfigFailure::NoSerial { place } => {
            CauseText::new(format!("[calibration] needs the serial number of its device (line {place})"))
                .hint("add: serial = NUMBER; or omit --with-calibration")
        }
        ConfigFailure::ReadBackDiffers { settings, is_after_reset } => {
            let list: Vec<String> = settings
                .iter()
                .map(|(key, wanted, found)| {
                    let found = found.as_ref().map_or_else(|| "not readable".to_owned(), ToString::to_string);
                    format!("{key} is {found}, not {wanted}")
                })
                .collect();
            let when = if *is_after_reset { "after the reset" } else { "read back" };
            CauseText::new(format!("{when}: {}", list.join(", ")))
        }
        ConfigFailure::OthersOnBus { nodes } => {
            let list: Vec<String> = nodes.iter().map(ToString::to_string).collect();
            let nodes = if nodes.len() == 1 { "node" } else { "nodes" };
            CauseText::new(format!("{nodes} {} on the bus: nothing was changed", list.join(", ")))
                .hint("a node-ID must be free, and a bit rate is only set on a bus with one node")
        }
        ConfigFailure::NotOneDevice { serial, nodes } if nodes.is_empty() => {
            CauseText::new(format!("no device with the serial number {serial} answers"))
                .hint("check its power and cable; find the cause: cangauge doctor")
        }
        ConfigFailure::NotOneDevice { serial, nodes } => {
            let list: Vec<String> = nodes.iter().map(ToString::to_string).collect();
            CauseText::new(format!("several devices have the serial number {serial}: node {}", list.join(", ")))
        }
        ConfigFailure::NotPluggedIn { serials } => {
            let list: Vec<String> = serials.iter().map(ToString::to_string).collect();
            CauseText::new(format!("not plugged in, or not set: serial number {}", list.join(", ")))
                .hint("run the same command again: it continues with these")
        }
        ConfigFailure::NoNodeId { serial } => CauseText::new(format!(
            "the device with the serial number {serial} has no node-ID, and the table has none for it"
        ))
        .hint("add it to the column \"node\""),
        ConfigFailure::Journal { reason } => CauseText::new(format!("the journal cannot be written: {reason}")),
        ConfigFailure::NoJournal => CauseText::new("nothing to roll back: the last change of this device was complete"),
    }
}

/// `mh4.toml:12:5: tpdo.1.event-timer: "100" has no unit (100ms, 1s)`.
fn of_mistake(file: &str, mistake: &Mistake) -> CauseText {
    let key = if mistake.key.is_empty() { String::new() } else { format!("{}: ", mistake.key) };
    let CauseText { message, hint, .. } = of_problem(&mistake.problem);
    CauseText { message: format!("{file}:{}: {key}{message}", mistake.place), hint, place: None }
}

fn of_problem(problem: &Problem) -> CauseText {
    let list = |words: &[String]| words.join(", ");
    CauseText::new(match problem {
        Problem::Syntax { message } => message.clone(),
        Problem::UnknownKey { device, nearest } => {
            let owner = device.as_ref().map(|title| format!("{title} has no such setting"));
            let message = owner.unwrap_or_else(|| "no such setting".to_owned());
            if nearest.is_empty() { message } else { format!("{message} (similar: {})", list(nearest)) }
        }
        Problem::Twice { other } => format!("the same setting as {other}"),
        Problem::Type { expected, found } => format!("{found} instead of {expected}"),
        Problem::NotADuration { text } if text.parse::<f64>().is_ok() => format!("\"{text}\" has no unit (100ms, 1s)"),
        Problem::NotADuration { text } => format!("\"{text}\" is not a duration (100ms, 1s)"),
        Problem::DurationStep { tick: 1000 } => "the device needs a multiple of 1ms".to_owned(),
        Problem::DurationStep { tick } => format!("the device needs a multiple of {tick}us"),
        Problem::UnknownUnit { text } => format!("\"{text}\" is not a known unit (bar, kPa, degC)"),
        Problem::NotAQuantity { text } => format!("\"{text}\" is not a number with a unit (\"3.2 bar\")"),
        Problem::NoUnit => {
            "a number without a unit, and the file sets no unit for this signal (\"3.2 bar\")".to_owned()
        }
        Problem::OtherQuantity { from, to } => format!("{from} cannot be converted to {to}, the unit of the signal"),
        Problem::TooFine { digits } => format!("the number has more than the {digits} decimal digits of the device"),
        Problem::Value(error) => error.to_string(),
        Problem::Range { low, high } => match (low.is_empty(), high.is_empty()) {
            (_, true) => format!("below the lowest value {low}"),
            (true, false) => format!("above the highest value {high}"),
            (false, false) => format!("not in the range {low} to {high}"),
        },
        Problem::Allowed { values } => format!("the device accepts only {}", list(values)),
        Problem::Word { text, known } => format!("\"{text}\" is not one of: {}", list(known)),
        Problem::Transmission { text } => {
            format!("\"{text}\" is not a transmission type (acyclic, sync:1 to sync:240, event, timer, 0 to 255)")
        }
        Problem::NotACobId { text } => format!("\"{text}\" is not an 11-bit identifier (0x1A5) or \"default\""),
        Problem::Restricted { id } => format!("CiA 301 reserves the identifier 0x{id:X} for other services"),
        Problem::SameId { id, other } => format!("{other} also uses the identifier 0x{id:X}"),
        Problem::NoId => "a TPDO that is on needs an identifier: add its cob-id to [address]".to_owned(),
        Problem::NotABitRate { text } => format!("\"{text}\" is not a bit rate (250k, 1M)"),
        Problem::Bits { bits } => format!("{bits} bits: a TPDO has at most 64"),
        Problem::Entries { high } => format!("the device maps at most {high} objects in this TPDO"),
        Problem::Mapping(cause) => return super::words(cause),
        Problem::NotMappable { object, text } => format!("the device cannot map {text} ({object}) here"),
        Problem::NoColumn { column } => format!("the table has no value for {{{column}}}"),
        Problem::Fixed { present: Some(present) } => format!("the device has {present} and cannot change it"),
        Problem::Fixed { present: None } => "the device cannot change it".to_owned(),
        Problem::Crossed { other, value } => format!("beyond {other}, which is {value}"),
        Problem::Excluded { other, value } => {
            format!("the device accepts it only if {other} is 0; {other} is {value}")
        }
    })
}

/// The text for an effect.
pub(in crate::output) fn effect(node: &str, effect: &ConfigEffect) -> NoteText {
    let written: Vec<&str> = effect.written.iter().map(|row| row.key.as_str()).collect();
    let missing = effect.missing.join(", ");
    let message = match (written.is_empty(), missing.is_empty()) {
        (true, _) => "nothing was written".to_owned(),
        (false, true) => format!("written: {}", written.join(", ")),
        (false, false) => format!("written: {}; not written: {missing}", written.join(", ")),
    };
    let note = NoteText::new("applied-in-part", message);
    if written.is_empty() {
        return note;
    }
    let apply = format!("cangauge config apply {node}");
    note.command("continue", format!("{apply} {}; go back: {apply} --rollback", effect.arguments))
}

/// The text for a note.
pub(in crate::output) fn fact(fact: &ConfigFact) -> NoteText {
    match fact {
        ConfigFact::Ignored { section, keys } => {
            let option = if *section == "address" { "--address" } else { "--with-calibration" };
            NoteText::new("section-ignored", format!("not set: {} ({option} sets them)", keys.join(", ")))
        }
        ConfigFact::NotInFile { keys } => NoteText::new(
            "not-in-file",
            format!(
                "these are not in the file and not at their factory defaults: {} (--exact sets the defaults)",
                keys.join(", ")
            ),
        ),
        ConfigFact::NotOnDevice { objects } => {
            NoteText::new("not-on-device", format!("the device does not have: {}", objects.join(", ")))
        }
        ConfigFact::NotSettings { objects } => NoteText::new(
            "not-settings",
            format!(
                "not set, because they are read-only, commands or PDO parameters without a setting: {}",
                objects.join(", ")
            ),
        ),
        ConfigFact::RateAfterRestart { rate } => NoteText::new(
            "rate-after-restart",
            format!("{} kbit/s is stored, and takes effect when the device starts again", rate / 1000),
        ),
    }
}
