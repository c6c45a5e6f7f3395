//! The filter of a signal: type (61A0h), constant (61A1h), and the damping, from which some devices calculate the
//! constant (MH-4 2023h).

use super::{SettingsFact, SettingsFailure, find_signal, read_each, set_object};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::Transmission;
use crate::canopen::value::Value;
use crate::master::Master;
use crate::measure::layout::{Signal, Tpdo};
use crate::node::Node;
use crate::node::write::write;
use crate::tasks::{Fact, Failure, Note};
use std::time::Duration;

/// The report of a filter.
#[derive(Clone, Debug, PartialEq)]
pub struct FilterReport {
    /// The filter, read from the device.
    pub filter: SignalFilter,
    /// Whether the filter constant (61A1h) changed with the new damping; `None` if no damping was set.
    pub damping_shown: Option<bool>,
    /// Further notes.
    pub notes: Vec<Note>,
}

/// The filter of a signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignalFilter {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `ch1` …
    pub signal: String,
    /// The filter type (61A0h); `None` if it cannot be read.
    pub code: Option<u64>,
    /// The meaning of the type on this device.
    pub kind: String,
    /// The filter constant (61A1h); `None` if it cannot be read.
    pub constant: Option<u64>,
}

/// The types of CiA 404 that can be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterType {
    /// No filter (0).
    None,
    /// Moving average (1).
    Moving,
    /// Repeating average (2).
    Repeating,
}

/// The settings to change. A setting that is `None` is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilterRequest {
    /// The type (61A0h).
    pub kind: Option<FilterType>,
    /// The constant (61A1h).
    pub constant: Option<u16>,
    /// The settling time after a step, at most 65535 ms. The device calculates the constant.
    pub damping: Option<Duration>,
}

impl FilterType {
    fn code(self) -> u8 {
        match self {
            FilterType::None => 0,
            FilterType::Moving => 1,
            FilterType::Repeating => 2,
        }
    }

    /// Returns the first word of the meaning of this type in descriptions, which is also the value of `--type`.
    pub fn word(self) -> &'static str {
        match self {
            FilterType::None => "none",
            FilterType::Moving => "moving",
            FilterType::Repeating => "repeating",
        }
    }
}

fn kind_object(signal: &Signal) -> ObjectId {
    ObjectId::new(0x61a0, signal.channel)
}

fn constant_object(signal: &Signal) -> ObjectId {
    ObjectId::new(0x61a1, signal.channel)
}

/// Returns the meaning of a filter type (61A0h), from the description, else from CiA 404.
pub(in crate::tasks) fn meaning(node: &Node, signal: &Signal, code: u64) -> String {
    let described = node.described(kind_object(signal)).and_then(|entry| entry.meaning(code));
    described.map_or_else(
        || match code {
            0 => "none".to_owned(),
            1 => "moving average".to_owned(),
            2 => "repeating average".to_owned(),
            3 => "Bessel low-pass".to_owned(),
            4 => "Butterworth low-pass".to_owned(),
            100.. => format!("manufacturer-specific ({code})"),
            _ => format!("unknown ({code})"),
        },
        str::to_owned,
    )
}

/// Whether a signal may have a filter.
pub fn has_filter(node: &Node, signal: &Signal) -> bool {
    node.may_have(kind_object(signal)) || node.may_have(constant_object(signal))
}

/// Reads the filter of one signal, or of every signal with a filter.
///
/// # Errors
/// No such signal, no filter, no answer.
pub fn show(master: &mut Master<'_>, node: &Node, signal: Option<&str>) -> Result<Vec<FilterReport>, Failure> {
    let signals: Vec<&Signal> = match signal {
        Some(name) => vec![find_signal(node, Some(name))?],
        None => node.channels(),
    };
    let mut filters = Vec::new();
    for signal in signals.into_iter().filter(|signal| has_filter(node, signal)) {
        let filter = filter_of(master, node, signal)?;
        filters.extend(filter.map(|filter| {
            let notes = effect_notes(node, signal, &filter);
            FilterReport { filter, damping_shown: None, notes }
        }));
    }
    if filters.is_empty() {
        return Err(Failure::at(node.id, SettingsFailure::NoFilter { signal: signal.map(str::to_owned) }));
    }
    Ok(filters)
}

fn filter_of(master: &mut Master<'_>, node: &Node, signal: &Signal) -> Result<Option<SignalFilter>, Failure> {
    let values = read_each(master, node, &[kind_object(signal), constant_object(signal)])?;
    let [code, constant] = [0, 1].map(|at| values.get(at).and_then(Option::as_ref).and_then(Value::as_u64));
    let kind = code.map(|code| meaning(node, signal, code)).unwrap_or_default();
    let is_known = code.is_some() || constant.is_some();
    Ok(is_known.then(|| SignalFilter { node: node.id, signal: signal.name.clone(), code, kind, constant }))
}

/// Sets the filter of a signal, or of the only signal with a filter, and reads it back.
///
/// # Errors
/// The device does not accept the settings (according to its description or its answer), does not answer, or keeps
/// other settings.
pub fn set(
    master: &mut Master<'_>,
    node: &Node,
    signal: Option<&str>,
    wanted: FilterRequest,
) -> Result<FilterReport, Failure> {
    let mut with_filter = node.channels().into_iter().filter(|signal| has_filter(node, signal));
    let signal = match (signal, with_filter.next(), with_filter.next()) {
        (None, Some(only), None) => only,
        (name, ..) => find_signal(node, name)?,
    };
    let no_filter = || Failure::at(node.id, SettingsFailure::NoFilter { signal: Some(signal.name.clone()) });
    if !has_filter(node, signal) {
        return Err(no_filter());
    }
    // All checks are made before the first write.
    let kind = wanted.kind.map(|kind| code_of(node, signal, kind)).transpose()?;
    let constant = constant_object(signal);
    if let (Some(number), Some(entry)) = (wanted.constant, node.described(constant))
        && !entry.allows(f64::from(number))
    {
        let cause = SettingsFailure::FilterConstant { signal: signal.name.clone(), constant: number };
        return Err(Failure::at(node.id, cause));
    }
    let before = filter_of(master, node, signal)?.ok_or_else(no_filter)?;
    let damping = wanted.damping.map(|damping| damping_write(node, signal, damping, kind, &before)).transpose()?;
    if let Some(code) = kind {
        set_object(master, node, kind_object(signal), &[code])?;
    }
    if let Some(number) = wanted.constant {
        let width = node.data_type(constant).width().unwrap_or(2).min(4);
        set_object(master, node, constant, &u32::from(number).to_le_bytes()[..width])?;
    }
    if let Some((object, milliseconds)) = damping {
        write(master, node, object, &milliseconds.to_le_bytes())?;
    }
    let now = filter_of(master, node, signal)?.ok_or_else(no_filter)?;
    let damping_shown = damping.map(|_| now.constant != before.constant);
    let mut notes = effect_notes(node, signal, &now);
    if damping_shown == Some(false) {
        notes.push(Note::of_node(node.id, SettingsFact::DampingNotShown { constant: now.constant }));
    }
    if before != now {
        notes.push(Note::of_node(node.id, Fact::KeptUntilPowerOff));
    }
    Ok(FilterReport { filter: now, damping_shown, notes })
}

/// Returns notes about unexpected effects of a filter, from the description.
fn effect_notes(node: &Node, signal: &Signal, filter: &SignalFilter) -> Vec<Note> {
    let mut notes = Vec::new();
    let is_repeating = filter.kind.starts_with(FilterType::Repeating.word());
    let constant = filter.constant.filter(|_| !is_repeating);
    let meaning = constant.and_then(|constant| node.described(constant_object(signal))?.meaning(constant));
    if let Some((constant, meaning)) = constant.zip(meaning) {
        let meaning = meaning.to_owned();
        notes.push(Note::of_node(node.id, SettingsFact::FilterConstant { constant, meaning }));
    }
    let limit_ms = node.model.as_ref().and_then(|model| model.description.repeating_average_ms);
    let Some(limit_ms) = limit_ms.filter(|_| is_repeating) else { return notes };
    let carries = |tpdo: &&Tpdo| tpdo.mapping.iter().any(|entry| signal.is_value(entry.object));
    for tpdo in node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).filter(carries) {
        let waits_for_sync = tpdo.transmission.is_some_and(Transmission::needs_sync);
        let timer_ms = tpdo.event_timer_ms.filter(|_| !waits_for_sync);
        if waits_for_sync || timer_ms.is_some_and(|timer_ms| timer_ms > limit_ms) {
            let tpdo = tpdo.number.to_string();
            notes.push(Note::of_node(node.id, SettingsFact::RepeatingLimit { tpdo, timer_ms, limit_ms }));
        }
    }
    notes
}

/// Returns the object and the number of milliseconds that set a damping. `kind` is the filter type to set.
fn damping_write(
    node: &Node,
    signal: &Signal,
    damping: Duration,
    kind: Option<u8>,
    before: &SignalFilter,
) -> Result<(ObjectId, u16), Failure> {
    let name = signal.name.clone();
    let Some(object) = node.object_of(signal, "damping") else {
        return Err(Failure::at(node.id, SettingsFailure::NoDamping { signal: name }));
    };
    if kind.map(u64::from).or(before.code) != Some(1) {
        let present = kind.is_none().then(|| before.kind.clone());
        return Err(Failure::at(node.id, SettingsFailure::DampingOfOtherType { signal: name, present }));
    }
    let milliseconds = u16::try_from(damping.as_millis());
    Ok((object, milliseconds.map_err(|_| Failure::at(node.id, SettingsFailure::DampingTooLong))?))
}

/// Returns the code of a filter type, if the code has this meaning on this device. On the MC1609, for example, 0 may be
/// a filter.
fn code_of(node: &Node, signal: &Signal, kind: FilterType) -> Result<u8, Failure> {
    let code = kind.code();
    let Some(entry) = node.described(kind_object(signal)).filter(|entry| !entry.values.is_empty()) else {
        return Ok(code);
    };
    if entry.meaning(code.into()).is_some_and(|meaning| meaning.starts_with(kind.word())) {
        return Ok(code);
    }
    let available = entry.values.iter().map(|(code, meaning)| (*code, meaning.clone())).collect();
    let (signal, doubt) = (signal.name.clone(), entry.doubt.clone());
    Err(Failure::at(node.id, SettingsFailure::FilterType { signal, wanted: kind, available, doubt }))
}
