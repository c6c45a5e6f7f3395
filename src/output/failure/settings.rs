//! Messages, hints and notes if a setting was changed, or could not be shown or changed.

use super::CauseText;
use crate::device::unit::Unit;
use crate::output::notes::NoteText;
use crate::tasks::Failure;
use crate::tasks::settings::unit::list;
use crate::tasks::settings::{QuantityError, SettingsEffect, SettingsFact, SettingsFailure};

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &SettingsFailure) -> CauseText {
    match cause {
        SettingsFailure::WhichSignal { available } => {
            CauseText::new(format!("choose a signal (it has: {})", available.join(", ")))
        }
        SettingsFailure::NoErrorObjects => {
            CauseText::new("it has neither an error register (1001h) nor an error history (1003h)")
        }
        SettingsFailure::NoErrorHistory => CauseText::new("it has no error history (1003h)"),
        SettingsFailure::HistoryNotCleared { count } => CauseText::new(format!(
            "it acknowledged the write of 0x1003:0, but the history still has {}",
            errors(*count)
        )),
        SettingsFailure::NoChannel { signal } => {
            CauseText::new(format!("{signal} is not a CiA 404 channel: it has no such setting"))
        }
        SettingsFailure::NoUnit { signal } => {
            CauseText::new(format!("{} has no unit (6131h)", subject(signal.as_ref())))
        }
        SettingsFailure::UnitFixed { signal, unit } => {
            CauseText::new(format!("{signal} is in {unit}, which the device cannot change"))
        }
        SettingsFailure::UnitNotAccepted { signal, unit, accepted } => unit_not_accepted(signal, *unit, accepted),
        SettingsFailure::NoMinMax => CauseText::new("no object with minimum and maximum is known for this device"),
        SettingsFailure::NoMinMaxReset { signal } => {
            CauseText::new(format!("no object that resets minimum and maximum of {signal} is known for this device"))
        }
        SettingsFailure::MinMaxNotReset { signal } => {
            CauseText::new(format!("it acknowledged the reset, but minimum and maximum of {signal} are unchanged"))
        }
        SettingsFailure::NoLimits { .. }
        | SettingsFailure::NoSuchLimit { .. }
        | SettingsFailure::LimitsCrossed { .. }
        | SettingsFailure::LimitValue { .. } => of_limits(cause),
        SettingsFailure::NoFilter { .. }
        | SettingsFailure::FilterConstant { .. }
        | SettingsFailure::FilterType { .. }
        | SettingsFailure::NoDamping { .. }
        | SettingsFailure::DampingOfOtherType { .. }
        | SettingsFailure::DampingTooLong => of_filter(cause),
    }
}

/// The subject of a message: `pressure`, or `it` for the whole device.
fn subject(signal: Option<&String>) -> &str {
    signal.map_or("it", String::as_str)
}

fn errors(count: u64) -> String {
    if count == 1 { "1 error".to_owned() } else { format!("{count} errors") }
}

fn unit_not_accepted(signal: &str, unit: Unit, accepted: &[Unit]) -> CauseText {
    let cause_text = CauseText::new(format!("{signal} accepts {}, not {unit}", list(accepted)));
    let swapped = Unit(unit.0.swap_bytes());
    match accepted.contains(&swapped) {
        true => cause_text.hint(format!("0x{:08X} is {swapped} in wire order: use 0x{:08X}", unit.0, swapped.0)),
        false => cause_text,
    }
}

fn of_limits(cause: &SettingsFailure) -> CauseText {
    match cause {
        SettingsFailure::NoLimits { signal, objects: [first, last] } => {
            CauseText::new(format!("{signal} has no delta and no limits ({first} to {last})"))
        }
        SettingsFailure::NoSuchLimit { signal, limit, object } => {
            CauseText::new(format!("{signal} has no {} ({object})", limit.as_str()))
        }
        SettingsFailure::LimitsCrossed { signal, lower, upper } => {
            CauseText::new(format!("{signal}: the lower limit {lower} is above the upper limit {upper}"))
        }
        SettingsFailure::LimitValue { signal, limit, error } => {
            let reason = match error {
                QuantityError::TooFine { number, digits } => {
                    format!("{number} has more than the {digits} decimal digits of the device")
                }
                QuantityError::Value(error) => error.to_string(),
            };
            CauseText::new(format!("{signal} {}: {reason}", limit.as_str()))
        }
        _ => CauseText::default(),
    }
}

fn of_filter(cause: &SettingsFailure) -> CauseText {
    match cause {
        SettingsFailure::NoFilter { signal } => {
            CauseText::new(format!("{} has no filter (61A0h, 61A1h)", subject(signal.as_ref())))
        }
        SettingsFailure::FilterConstant { signal, constant } => {
            CauseText::new(format!("{signal} does not accept the filter constant {constant}"))
        }
        SettingsFailure::FilterType { signal, wanted, available, doubt } => {
            let available: Vec<String> =
                available.iter().map(|(code, meaning)| format!("{meaning} ({code})")).collect();
            let available = available.join(", ");
            let cause_text =
                CauseText::new(format!("{signal} has no filter type \"{}\" (it has: {available})", wanted.word()));
            if doubt.is_empty() { cause_text } else { cause_text.hint(format!("61A0h: {doubt}")) }
        }
        SettingsFailure::NoDamping { signal } => {
            CauseText::new(format!("no object that sets a damping of {signal} is known for this device"))
                .hint("set the filter constant instead: --constant N")
        }
        SettingsFailure::DampingOfOtherType { signal, present } => {
            let present = match present {
                Some(present) => format!("the filter is: {present}"),
                None => "--type sets another filter".to_owned(),
            };
            CauseText::new(format!("{signal}: a damping needs the moving average ({present})"))
                .hint("add --type moving")
        }
        SettingsFailure::DampingTooLong => CauseText::new("the damping is limited to 65535 ms"),
        _ => CauseText::default(),
    }
}

/// The text for an effect.
pub(in crate::output) fn effect(node: &str, effect: &SettingsEffect) -> NoteText {
    let (code, message, signal) = match effect {
        SettingsEffect::LimitsRestored { signal } => ("limits-restored", "the previous limits were restored", signal),
        SettingsEffect::LimitsNotRestored { signal } => {
            ("limits-not-restored", "not all previous limits could be restored", signal)
        }
        SettingsEffect::LimitsUnknown { signal } => ("limits-unknown", "the present limits are unknown", signal),
    };
    NoteText::new(code, message).command("show the limits", format!("cangauge limits {node} {signal}"))
}

/// The text for a note.
pub(in crate::output) fn fact(fact: &SettingsFact) -> NoteText {
    match fact {
        SettingsFact::AlreadyInUnit { signal, unit } => {
            NoteText::new("already-in-unit", format!("{signal} is already in {unit}"))
        }
        SettingsFact::NotConverted { name, now } => {
            let now = now.map_or_else(String::new, |now| format!(": it is now {now}"));
            NoteText::new("not-converted", format!("the device did not convert {name}{now}"))
        }
        SettingsFact::DampingNotShown { constant } => {
            let constant = constant.map_or_else(|| "unknown".to_owned(), |constant| constant.to_string());
            let message = format!("it acknowledged the damping, but the filter constant did not change ({constant})");
            NoteText::new("damping-not-shown", message)
        }
        SettingsFact::FilterConstant { constant, meaning } => {
            NoteText::new("filter-constant", format!("filter constant {constant}: {meaning}"))
        }
        SettingsFact::RepeatingLimit { tpdo, timer_ms, limit_ms } => {
            let message = match timer_ms {
                Some(timer_ms) => {
                    format!(
                        "{tpdo} is sent every {timer_ms} ms: after {limit_ms} ms the device changes to the moving average"
                    )
                }
                None => format!(
                    "{tpdo} is sent on SYNC: if its interval is longer than {limit_ms} ms, the device changes to the \
                     moving average"
                ),
            };
            NoteText::new("repeating-limit", message)
        }
        SettingsFact::MayNeverSend { tpdo } => NoteText::new(
            "may-never-send",
            format!("{tpdo} is sent on events, and its event timer and the delta are 0: it may never be sent"),
        ),
    }
}
