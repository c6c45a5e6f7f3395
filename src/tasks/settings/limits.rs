//! The triggers of a TPDO: delta, lower limit, upper limit and hysteresis of a signal (CiA 404, x133h to x136h, in the
//! family of the process value).

use super::{
    SettingsEffect, SettingsFact, SettingsFailure, ValueWithUnit, encode_quantity, find_signal, quantity, read_each,
    set_object,
};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::Transmission;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::node::Node;
use crate::tasks::{Fact, Failure, Kind, Note};

/// One of the four trigger settings of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// x133h: a change by at least this value triggers the TPDO.
    Delta,
    /// x134h: a value that falls below this limit triggers the TPDO.
    Lower,
    /// x135h: a value that rises above this limit triggers the TPDO.
    Upper,
    /// x136h: the distance from a limit at which the limit can trigger again.
    Hysteresis,
}

impl Limit {
    /// All limits, in the order of their objects.
    pub const ALL: [Limit; 4] = [Limit::Delta, Limit::Lower, Limit::Upper, Limit::Hysteresis];

    /// Its name in options and reports.
    pub fn as_str(self) -> &'static str {
        match self {
            Limit::Delta => "delta",
            Limit::Lower => "lower",
            Limit::Upper => "upper",
            Limit::Hysteresis => "hysteresis",
        }
    }

    /// Its object.
    pub fn object(self, node: &Node, signal: &Signal) -> ObjectId {
        let low = match self {
            Limit::Delta => 0x133,
            Limit::Lower => 0x134,
            Limit::Upper => 0x135,
            Limit::Hysteresis => 0x136,
        };
        node.object_in_family(signal, low)
    }
}

/// The limits of a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `ch1` …
    pub signal: String,
    /// The settings that the device has, with their objects.
    pub values: Vec<(Limit, ObjectId, ValueWithUnit)>,
    /// TPDOs that may never be sent because the delta is 0.
    pub silent: Vec<String>,
    /// Further notes.
    pub notes: Vec<Note>,
}

/// Whether a signal may have limits.
pub fn has_limits(node: &Node, signal: &Signal) -> bool {
    Limit::ALL.iter().any(|limit| node.may_have(limit.object(node, signal)))
}

/// Reads the limits of a signal.
///
/// # Errors
/// No such signal, no limits, no answer.
pub fn show(master: &mut Master<'_>, node: &Node, signal: &str) -> Result<Limits, Failure> {
    let signal = find_signal(node, Some(signal))?;
    let wanted: Vec<(Limit, ObjectId)> = Limit::ALL
        .into_iter()
        .map(|limit| (limit, limit.object(node, signal)))
        .filter(|&(_, object)| node.may_have(object))
        .collect();
    let objects: Vec<ObjectId> = wanted.iter().map(|&(_, object)| object).collect();
    let values: Vec<(Limit, ObjectId, ValueWithUnit)> = wanted
        .into_iter()
        .zip(read_each(master, node, &objects)?)
        .filter_map(|((limit, object), value)| Some((limit, object, quantity(signal, &value?)?)))
        .collect();
    if values.is_empty() {
        let objects = [Limit::Delta, Limit::Hysteresis].map(|limit| limit.object(node, signal));
        return Err(Failure::at(node.id, SettingsFailure::NoLimits { signal: signal.name.clone(), objects }));
    }
    let silent = silent_tpdos(node, signal, &values);
    let note = |tpdo: &String| Note::of_node(node.id, SettingsFact::MayNeverSend { tpdo: tpdo.clone() });
    let notes = silent.iter().map(note).collect();
    Ok(Limits { node: node.id, signal: signal.name.clone(), values, silent, notes })
}

/// A limit to set.
struct LimitWrite {
    limit: Limit,
    object: ObjectId,
    rises: bool,
    bytes: Vec<u8>,
    /// The bytes of the previous number; empty if the number does not fit.
    previous: Vec<u8>,
}

/// Sets limits of a signal, in its unit, and reads them back. If the device rejects a limit, the previous limits are
/// restored.
///
/// # Errors
/// - A number does not fit its object.
/// - The lower limit is above the upper limit.
/// - The device rejects a limit or does not answer.
pub fn set(master: &mut Master<'_>, node: &Node, signal: &str, wanted: &[(Limit, f64)]) -> Result<Limits, Failure> {
    let before = show(master, node, signal)?;
    check_order(node, &before, wanted)?;
    let described = find_signal(node, Some(signal))?;
    let mut writes = Vec::new();
    for &(limit, number) in wanted {
        writes.push(limit_write(node, described, &before, limit, number)?);
    }
    // A device may reject a lower limit above the present upper limit. So if the limits rise, the upper limit is
    // written first.
    if writes.iter().any(|write| write.limit == Limit::Upper && write.rises) {
        writes.reverse();
    }
    for (at, write) in writes.iter().enumerate() {
        let Err(failure) = set_object(master, node, write.object, &write.bytes) else { continue };
        let signal = signal.to_owned();
        if matches!(failure.kind(), Kind::NoAnswer | Kind::Bus | Kind::Interrupted) {
            return Err(failure.with(node.id, SettingsEffect::LimitsUnknown { signal }));
        }
        // If the device acknowledged this object but has another value, this object is also restored.
        let done = if failure.kind() == Kind::Unexpected { at + 1 } else { at };
        let mut is_restored = true;
        for write in writes.iter().take(done).rev() {
            is_restored &=
                !write.previous.is_empty() && set_object(master, node, write.object, &write.previous).is_ok();
        }
        return Err(match is_restored {
            true => failure.with(node.id, SettingsEffect::LimitsRestored { signal }),
            false => failure.with(node.id, SettingsEffect::LimitsNotRestored { signal }),
        });
    }
    let mut now = show(master, node, signal)?;
    now.notes.push(Note::of_node(node.id, Fact::KeptUntilPowerOff));
    Ok(now)
}

/// Checks that the lower limit will not exceed the upper limit.
fn check_order(node: &Node, before: &Limits, wanted: &[(Limit, f64)]) -> Result<(), Failure> {
    let number = |limit: Limit| {
        let requested = wanted.iter().find(|(other, _)| *other == limit).map(|&(_, number)| number);
        let present = before.values.iter().find(|(other, ..)| *other == limit);
        requested.or(present.map(|(_, _, quantity)| quantity.number.as_f64()))
    };
    let changes_limit = wanted.iter().any(|(limit, _)| matches!(limit, Limit::Lower | Limit::Upper));
    match (number(Limit::Lower), number(Limit::Upper)) {
        (Some(lower), Some(upper)) if lower > upper && changes_limit => {
            let signal = before.signal.clone();
            Err(Failure::at(node.id, SettingsFailure::LimitsCrossed { signal, lower, upper }))
        }
        _ => Ok(()),
    }
}

fn limit_write(
    node: &Node,
    signal: &Signal,
    before: &Limits,
    limit: Limit,
    number: f64,
) -> Result<LimitWrite, Failure> {
    let name = signal.name.clone();
    let Some(&(_, object, old)) = before.values.iter().find(|(other, ..)| *other == limit) else {
        let object = limit.object(node, signal);
        return Err(Failure::at(node.id, SettingsFailure::NoSuchLimit { signal: name, limit, object }));
    };
    let old = old.number.as_f64();
    let encode = |number| encode_quantity(number, node.data_type(object), signal.digits.unwrap_or(0));
    let bytes = encode(number)
        .map_err(|error| Failure::at(node.id, SettingsFailure::LimitValue { signal: name, limit, error }))?;
    Ok(LimitWrite { limit, object, rises: number > old, bytes, previous: encode(old).unwrap_or_default() })
}

/// Returns the TPDOs that contain the signal and are sent only on events, if the delta is 0.
fn silent_tpdos(node: &Node, signal: &Signal, values: &[(Limit, ObjectId, ValueWithUnit)]) -> Vec<String> {
    let delta = values.iter().find(|(limit, ..)| *limit == Limit::Delta);
    if delta.is_none_or(|(_, _, quantity)| quantity.number.as_f64() != 0.0) {
        return Vec::new();
    }
    let tpdos = node.tpdos.iter().filter(|tpdo| {
        let by_event = matches!(tpdo.transmission, Some(Transmission::Manufacturer | Transmission::Profile));
        let no_timer = node.event_timer(tpdo.transmission, tpdo.event_timer_ms).is_none();
        let carries = tpdo.mapping.iter().any(|entry| signal.is_value(entry.object));
        tpdo.cob_id.is_valid() && by_event && no_timer && carries
    });
    tpdos.map(|tpdo| tpdo.number.to_string()).collect()
}
