//! What makes a TPDO of a signal go out by itself: delta, lower and upper limit, hysteresis (CiA 404, x133h
//! to x136h, in the family of the process value).

use super::{Device, Quantity, encode_quantity};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::Transmission;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::tasks::{Failure, Kind};

/// One of the four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// x133h: a change of at least this sends.
    Delta,
    /// x134h: below it, it sends.
    Lower,
    /// x135h: above it, it sends.
    Upper,
    /// x136h: how far back behind a limit before it counts again.
    Hysteresis,
}

impl Limit {
    /// All of them, in the order of their objects.
    pub const ALL: [Limit; 4] = [Limit::Delta, Limit::Lower, Limit::Upper, Limit::Hysteresis];

    /// As it is typed and printed.
    pub fn as_str(self) -> &'static str {
        match self {
            Limit::Delta => "delta",
            Limit::Lower => "lower",
            Limit::Upper => "upper",
            Limit::Hysteresis => "hysteresis",
        }
    }

    /// Where it stands.
    pub fn object(self, device: &Device, signal: &Signal) -> ObjectId {
        let low = match self {
            Limit::Delta => 0x133,
            Limit::Lower => 0x134,
            Limit::Upper => 0x135,
            Limit::Hysteresis => 0x136,
        };
        device.in_family(signal, low)
    }
}

/// The limits of a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `ch1` …
    pub signal: String,
    /// What the device has of the four, with where it stands.
    pub values: Vec<(Limit, ObjectId, Quantity)>,
    /// TPDOs that may never send because delta is 0.
    pub silent: Vec<String>,
}

/// The limits of a signal.
///
/// # Errors
/// Signals that the device has not or that have no limits, silence.
pub fn show(master: &mut Master<'_>, device: &Device, signal: &str) -> Result<Limits, Failure> {
    let signal = device.signal(Some(signal))?;
    let wanted: Vec<(Limit, ObjectId)> = Limit::ALL
        .into_iter()
        .map(|limit| (limit, limit.object(device, signal)))
        .filter(|&(_, object)| device.may_have(object))
        .collect();
    let objects: Vec<ObjectId> = wanted.iter().map(|&(_, object)| object).collect();
    let values: Vec<(Limit, ObjectId, Quantity)> = wanted
        .into_iter()
        .zip(device.read_each(master, &objects)?)
        .filter_map(|((limit, object), value)| Some((limit, object, device.quantity(signal, &value?)?)))
        .collect();
    if values.is_empty() {
        let range = format!("{} to {}", Limit::Delta.object(device, signal), Limit::Hysteresis.object(device, signal));
        let message = format!("{} has no delta and no limits ({range})", signal.name);
        return Err(Failure::of_node(Kind::Unexpected, device.node(), message));
    }
    let silent = silent(device, signal, &values);
    Ok(Limits { node: device.node(), signal: signal.name.clone(), values, silent })
}

/// Sets limits of a signal, in its unit, and reads them back. What was set is put back where a later one is
/// refused.
///
/// # Errors
/// Numbers that the device cannot hold, a lower limit above the upper one, refusals, silence.
pub fn set(master: &mut Master<'_>, device: &Device, signal: &str, wanted: &[(Limit, f64)]) -> Result<Limits, Failure> {
    let before = show(master, device, signal)?;
    let described = device.signal(Some(signal))?;
    let usage = |message: String| Failure::of_node(Kind::Usage, device.node(), message);
    let number = |limit: Limit| {
        let asked = wanted.iter().find(|(other, _)| *other == limit).map(|&(_, number)| number);
        let present = before.values.iter().find(|(other, ..)| *other == limit);
        asked.or(present.map(|(_, _, quantity)| quantity.number.as_f64()))
    };
    if let (Some(lower), Some(upper)) = (number(Limit::Lower), number(Limit::Upper))
        && lower > upper
        && wanted.iter().any(|(limit, _)| matches!(limit, Limit::Lower | Limit::Upper))
    {
        return Err(usage(format!("{signal}: the lower limit {lower} is above the upper one, {upper}")));
    }
    let mut writes = Vec::new();
    for &(limit, number) in wanted {
        let Some(&(_, object, old)) = before.values.iter().find(|(other, ..)| *other == limit) else {
            return Err(usage(format!("{signal} has no {} ({})", limit.as_str(), limit.object(device, described))));
        };
        let digits = described.digits.unwrap_or(0);
        let encode = |number| encode_quantity(number, device.data_type(object), digits);
        let bytes = encode(number).map_err(|error| usage(format!("{signal} {}: {error}", limit.as_str())))?;
        let undo = encode(old.number.as_f64()).unwrap_or_default();
        writes.push((limit, number > old.number.as_f64(), object, bytes, undo));
    }
    // A device may refuse a lower limit above the present upper one: what rises rises from the top.
    let rises = writes.iter().any(|(limit, rises, ..)| *limit == Limit::Upper && *rises);
    if rises {
        writes.reverse();
    }
    for (at, (_, _, object, bytes, _)) in writes.iter().enumerate() {
        let Err(failure) = device.set(master, *object, bytes) else { continue };
        if failure.kind() == Kind::NoAnswer || failure.kind() == Kind::Bus || failure.kind() == Kind::Interrupted {
            return Err(failure.hint(format!("what stands now: cangauge limits {} {signal}", device.node())));
        }
        // The one that acknowledged and keeps something else is put back too.
        let done = if failure.kind() == Kind::Unexpected { at + 1 } else { at };
        let mut back = true;
        for (_, _, object, _, undo) in writes.iter().take(done).rev() {
            back &= !undo.is_empty() && device.set(master, *object, undo).is_ok();
        }
        let told = if back { "the limits are as before" } else { "not all limits could be put back" };
        return Err(failure.hint(format!("{told}: cangauge limits {} {signal}", device.node())));
    }
    show(master, device, signal)
}

/// TPDOs that carry the signal and go out by event alone, while no change is large enough to be one.
fn silent(device: &Device, signal: &Signal, values: &[(Limit, ObjectId, Quantity)]) -> Vec<String> {
    let delta = values.iter().find(|(limit, ..)| *limit == Limit::Delta);
    if delta.is_none_or(|(_, _, quantity)| quantity.number.as_f64() != 0.0) {
        return Vec::new();
    }
    let tpdos = device.instrument.tpdos.iter().filter(|tpdo| {
        let by_event = matches!(tpdo.transmission, Some(Transmission::Manufacturer | Transmission::Profile));
        let no_timer = tpdo.event_timer_ms.unwrap_or(0) == 0;
        let carries = tpdo.mapping.iter().any(|entry| signal.is_value(entry.object));
        tpdo.cob_id.is_valid() && by_event && no_timer && carries
    });
    tpdos.map(|tpdo| tpdo.number.to_string()).collect()
}
