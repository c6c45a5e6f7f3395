//! Messages, hints and notes of `autozero` and `tare`.

use super::CauseText;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::output::notes::NoteText;
use crate::tasks::Failure;
use crate::tasks::autozero::{
    AutozeroEffect, AutozeroFact, AutozeroFailure, FailedCheck, OffsetChange, Proof, Quantity, Undo, ZeroTarget,
};
use crate::tasks::store::Group;

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &AutozeroFailure) -> CauseText {
    let node = failure.node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    match cause {
        AutozeroFailure::NoAutozero { title } => CauseText::new(format!("{title} has no autozero")),
        AutozeroFailure::NoSuchChannel { title, channel, available } => {
            CauseText::new(format!("{title} has no autozero of channel {channel}"))
                .hint(format!("use one of: {}", list(available)))
        }
        AutozeroFailure::WhichChannel { target, available } if available.is_empty() => {
            CauseText::new("the device has several channels: choose one")
                .hint(format!("cangauge {} {node} --channel 1", target.as_str()))
        }
        AutozeroFailure::NoTare => {
            CauseText::new("no description or EDS of it has a tare (0x6139) and a net value (0x6140)")
                .hint("use a description with both: --device FILE or --eds FILE")
        }
        AutozeroFailure::NoTareOfChannel { channel, available } => {
            CauseText::new(format!("it has no tare of channel {channel}"))
                .hint(format!("use one of: {}", list(available)))
        }
        AutozeroFailure::NoTareZero { channel } => {
            CauseText::new(format!("it has no tare zero (0x6138:{channel}) that can be written"))
                .hint(format!("a reset may clear it: cangauge nmt reset {node}"))
        }
        AutozeroFailure::WhichChannel { available, .. } => {
            CauseText::new("the device has several channels: choose one")
                .hint(format!("--channel with one of {}", list(available)))
        }
        AutozeroFailure::NoMeasuredValueOnChannel { channel } => {
            CauseText::new(format!("it has no measured value on channel {channel}"))
        }
        AutozeroFailure::NoObject { channel, object, .. } => {
            CauseText::new(format!("it has no autozero of channel {channel} (no {object})"))
        }
        AutozeroFailure::LimitUnit { signal, unit, limit } => {
            CauseText::new(format!("the limit in {limit} cannot be converted: {signal} {}", present_unit(*unit)))
        }
        AutozeroFailure::RestartedBefore => {
            CauseText::new("the device restarted during the measurement: nothing was changed")
        }
        AutozeroFailure::Unsafe { target, failed_check, channel } => {
            let choice = channel.map(|channel| format!(" --channel {channel}")).unwrap_or_default();
            CauseText::new(format!("{}: nothing was changed", reason(failed_check))).hint(remedy(
                *target,
                failed_check,
                &node,
                &choice,
            ))
        }
        AutozeroFailure::RestartedAfter => CauseText::new(
            "the device accepted the signature, then restarted: the zero is lost unless the device stored it",
        ),
        AutozeroFailure::NotZero { signal, reading, has_acted, offset } => {
            not_zero(signal, *reading, *has_acted, offset)
        }
        AutozeroFailure::OtherOffsetStored => {
            CauseText::new("the offset changed between the zero and the store: another offset was stored")
        }
    }
}

fn not_zero(signal: &str, reading: Option<Quantity>, has_acted: bool, offset: &OffsetChange) -> CauseText {
    let reads = match reading {
        Some(mean) if has_acted => format!("{signal} reads {} afterwards, not zero", quantity(mean)),
        Some(mean) => format!("nothing has changed: {signal} reads {}", quantity(mean)),
        None => format!("{signal} has no valid value afterwards"),
    };
    CauseText::new(format!("the device accepted the signature, and {reads}; {}", offset_change(offset)))
}

fn present_unit(unit: Option<Unit>) -> String {
    unit.map_or_else(|| "has no known unit".to_owned(), |unit| format!("is in {unit}"))
}

fn offset_change(offset: &OffsetChange) -> String {
    match offset {
        OffsetChange::Changed(old, new) => format!("the offset went from {old} to {new}"),
        OffsetChange::Unchanged => "the offset is unchanged".to_owned(),
        OffsetChange::Unreadable => "the offset cannot be read".to_owned(),
    }
}

fn list(channels: &[u8]) -> String {
    channels.iter().map(u8::to_string).collect::<Vec<_>>().join(", ")
}

fn quantity(quantity: Quantity) -> String {
    let unit = quantity.unit.map(|unit| unit.to_string()).unwrap_or_default();
    format!("{:.*} {unit}", quantity.decimals, quantity.value).trim_end().to_owned()
}

/// The reason why a safety check failed.
fn reason(failed_check: &FailedCheck) -> String {
    let part = |percent: &Option<f64>, otherwise: &str| {
        percent.map_or_else(|| otherwise.to_owned(), |percent| format!("{percent} % of the range"))
    };
    match failed_check {
        FailedCheck::Absolute => {
            "the sensor measures absolute pressure: if it is vented, it reads the air pressure, not zero".to_owned()
        }
        FailedCheck::Invalid { signal, status } => format!("{signal} has no valid value: {status}"),
        FailedCheck::RangeUnknown { signal } => {
            format!("the measuring range of {signal} is unknown, so the limit for a zero is unknown too")
        }
        FailedCheck::TooFar { signal, reading, limit, percent, .. } => {
            format!("{signal} is {}, limit {} ({})", quantity(*reading), quantity(*limit), part(percent, "--limit"))
        }
        FailedCheck::Unsteady { signal, spread, limit, percent } => format!(
            "the readings of {signal} vary by {} (limit {}, {}): the value is not steady",
            quantity(*spread),
            quantity(*limit),
            part(percent, "half of --limit")
        ),
        FailedCheck::TotalOffset { offset, total, limit } => format!(
            "the offset is already {} and would become {}, limit {}",
            quantity(*offset),
            quantity(*total),
            quantity(*limit)
        ),
    }
}

/// The remedy for a failed safety check.
fn remedy(target: ZeroTarget, failed_check: &FailedCheck, node: &str, choice: &str) -> String {
    match failed_check {
        FailedCheck::Absolute => "apply a vacuum and use --force".to_owned(),
        FailedCheck::Invalid { .. } => format!("show the errors of the device: cangauge errors {node}"),
        FailedCheck::RangeUnknown { .. } => "add the largest reading to accept as zero: --limit VALUE".to_owned(),
        FailedCheck::TooFar { sufficient_limit, limit, .. } => {
            let sufficient_limit =
                limit.unit.map_or_else(|| sufficient_limit.clone(), |unit| format!("{sufficient_limit}{unit}"));
            format!(
                "vent or isolate the line; if the limit is too low: cangauge autozero {node}{choice} --limit {sufficient_limit}"
            )
        }
        FailedCheck::Unsteady { .. } if target == ZeroTarget::Tare => "wait until the value is steady".to_owned(),
        FailedCheck::Unsteady { .. } => "wait until the value is steady, or use --force".to_owned(),
        FailedCheck::TotalOffset { .. } => {
            "several small offsets have added up: check the sensor, or use --force".to_owned()
        }
    }
}

/// The text for an effect.
pub(in crate::output) fn effect(node: &str, effect: &AutozeroEffect) -> NoteText {
    let with_command = |text: NoteText, offset: &Option<String>, signal: &str| match offset {
        Some(object) => text.command("show the present offset", format!("cangauge sdo read {node} {object}")),
        None => text.command("show the present reading", format!("cangauge read {node} {signal}")),
    };
    match effect {
        AutozeroEffect::SignatureSent { object } => {
            NoteText::new("signature-sent", format!("the signature was sent to {object} once and is not repeated"))
        }
        AutozeroEffect::OffsetBefore { offset, signal } => {
            let text = match offset {
                Some((object, number)) => format!("the offset {object} was {number}"),
                None => "the offset cannot be read".to_owned(),
            };
            with_command(NoteText::new("offset-before", text), &offset.map(|(object, _)| object.to_string()), signal)
        }
        AutozeroEffect::NoChangeSeen { offset, signal } => {
            let text = match offset {
                Some(_) => "the offset is unchanged",
                None => "the offset cannot be read, and the reading is not zero",
            };
            with_command(NoteText::new("no-change-seen", text), &offset.map(|object| object.to_string()), signal)
        }
        AutozeroEffect::Moved(Some(shift)) => {
            NoteText::new("zero-moved", format!("the zero was shifted by {}", quantity(*shift)))
        }
        AutozeroEffect::Moved(None) => NoteText::new("zero-moved", "the zero was set"),
        AutozeroEffect::Stored => NoteText::new("stored", "the zero was stored"),
        AutozeroEffect::Undo(undo) => undo_text(node, undo),
    }
}

/// The text for a note.
pub(in crate::output) fn fact(node: Option<NodeId>, fact: &AutozeroFact) -> NoteText {
    let node = node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    match fact {
        AutozeroFact::Forced(failed_check) => NoteText::new("forced", format!("forced: {}", reason(failed_check))),
        AutozeroFact::NothingChanged => NoteText::new("nothing-changed", "nothing was changed"),
        AutozeroFact::ProvedBy(proof) => {
            let proof = match proof {
                Proof::Offset => "the offset",
                Proof::Reading => "the reading",
            };
            NoteText::new(
                "no-answer",
                format!("no answer to the signature; {proof} proves that the device executed it"),
            )
        }
        AutozeroFact::Undo(undo) => undo_text(&node, undo),
        AutozeroFact::NotStored { group } => NoteText::new("not-stored", "not stored: lost at power off")
            .command("store it", format!("cangauge store {node} --group {}", group.as_str())),
        AutozeroFact::Stored { groups } => NoteText::new("stored", format!("stored: {}", Group::names(groups))),
    }
}

fn undo_text(node: &str, undo: &Undo) -> NoteText {
    match undo {
        Undo::Write { object, value, data_type, store } => {
            let store =
                store.map_or_else(String::new, |group| format!(" && cangauge store {node} --group {}", group.as_str()));
            NoteText::new("undo", "the previous offset is known")
                .command("undo", format!("cangauge sdo write {node} {object} {value} --type {data_type}{store}"))
        }
        Undo::Restore => {
            NoteText::new("undo", "the offset cannot be written; only the factory defaults remove the zero")
                .command("undo", format!("cangauge restore {node} --reset"))
        }
        Undo::Reset => NoteText::new("undo", "the zero is not stored, so a reset removes it")
            .command("undo", format!("cangauge nmt reset {node}")),
    }
}
