//! Another unit (6131h): the process value and the settings are converted, and the old unit can be set again.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::{CHANGED_CHANNELS, Channel, Number, check_channels, numbers, rounding, touch_numbers};
use crate::canopen::object::ObjectId;
use crate::device::unit::Unit;
use crate::node::Error;
use crate::tasks::settings::unit::{Scale, in_unit};

const fn case(id: &'static str, sentence: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, "CiA 404, object 6131h", run)
}

pub(in super::super) const CASES: &[Case] = &[
    case("404-10", "After another unit (6131h) is set, the process value is in this unit", process_value)
        .matters(High, "Measurements have a wrong unit.")
        .alone(),
    case("404-11", "Another unit (6131h) converts scaling, span, limits and offset", settings)
        .matters(High, "Limits and offset have a wrong unit.")
        .alone(),
    case("404-12", "After the old unit (6131h) is set again, scaling, span, limits and offset are as before", undone)
        .matters(Medium, "A change of the unit changes the settings.")
        .alone(),
];

/// The units that are tried if no description states those of the device: bar, psi, kPa, MPa, degC, degF, K.
const UNITS: [Unit; 7] = [
    Unit(0x004e_0000),
    Unit(0x00ab_0000),
    Unit(0x0322_0000),
    Unit(0x0622_0000),
    Unit(0x002d_0000),
    Unit(0x00ac_0000),
    Unit::KELVIN,
];

/// A change of the unit.
#[derive(Clone, Copy)]
struct Change {
    object: ObjectId,
    from: Unit,
    to: Unit,
}

/// The units that a device may accept.
struct Candidates {
    object: ObjectId,
    from: Unit,
    units: Vec<Unit>,
}

/// Other units that the device may accept. The verdict if there is none.
fn prepare(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Result<Candidates, Verdict>, Error> {
    let Some(object) = channel.unit else { return Ok(Err(Verdict::NotApplicable(WhyNot::NoSuitableObject))) };
    let Some(code) = session.number(object)? else { return Ok(Err(Verdict::NotApplicable(WhyNot::NoObject(object)))) };
    let from = Unit(u32::try_from(code).unwrap_or(0));
    let stated = session.node.described(object).map_or(&[][..], |entry| &entry.allow);
    let stated: Vec<Unit> = stated.iter().map(|range| Unit(range.low)).collect();
    let mut units = if stated.is_empty() { UNITS.to_vec() } else { stated };
    units.retain(|unit| *unit != from && from.convert(1.0, *unit).is_some());
    if units.is_empty() || session.node.is_read_only(object) {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NotWritable(object))));
    }
    // These could not be restored.
    if in_unit(&session.node, &channel.signal).iter().any(|(object, _)| session.settings.is_protected(*object)) {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NeedsStore)));
    }
    touch_numbers(session, channel)?;
    Ok(Ok(Candidates { object, from, units }))
}

/// Sets another unit. The verdict if the device has no other unit.
fn change(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Result<Change, Verdict>, Error> {
    let Candidates { object, from, units } = match prepare(session, channel)? {
        Ok(prepared) => prepared,
        Err(verdict) => return Ok(Err(verdict)),
    };
    for to in units {
        if session.try_write(object, &to.0.to_le_bytes())?.is_none() && session.number(object)? == Some(u64::from(to.0))
        {
            return Ok(Ok(Change { object, from, to }));
        }
    }
    Ok(Err(Verdict::NotApplicable(WhyNot::NotWritable(object))))
}

fn process_value(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, CHANGED_CHANNELS, process_value_of)
}

fn process_value_of(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Verdict, Error> {
    let digits = session.digits_of(channel)?;
    let mut before = Vec::new();
    for &(object, data_type) in &channel.values {
        before.push(session.readings(object, data_type, digits)?);
    }
    let change = match change(session, channel)? {
        Ok(change) => change,
        Err(verdict) => return Ok(verdict),
    };
    let digits = session.digits_of(channel)?;
    let (mut findings, mut is_judged, mut why_not) = (Vec::new(), false, WhyNot::NoValidValue(channel.values[0].0));
    for (&(object, data_type), old) in channel.values.iter().zip(before) {
        let new = session.readings(object, data_type, digits)?;
        let converted = old.and_then(|old| old.map(|value| change.from.convert(value, change.to)));
        let (Some(old), Some(new), Some(converted)) = (old, new, converted) else { continue };
        let expected = converted.middle();
        let steps = rounding(data_type, digits, expected)
            .max(converted_rounding(change, rounding(data_type, digits, old.middle())));
        let tolerance = converted.allowance(new) + 2.0 * steps;
        if let Some(finding) = Finding::measured(object, expected, tolerance, new.middle()) {
            findings.push(finding);
        } else if (old.middle() - expected).abs() > tolerance {
            is_judged = true;
        } else {
            why_not = WhyNot::NearZero(object);
        }
    }
    let is_judged = is_judged || !findings.is_empty();
    Ok(if is_judged { Verdict::of(findings) } else { Verdict::not_judged(why_not) })
}

/// A rounding error in the new unit.
fn converted_rounding(change: Change, rounding: f64) -> f64 {
    Scale::Distance.convert(rounding, change.from, change.to).map_or(0.0, f64::abs)
}

fn settings(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, CHANGED_CHANNELS, |session, channel| {
        let before = numbers(session, channel)?;
        let change = match change(session, channel)? {
            Ok(change) => change,
            Err(verdict) => return Ok(verdict),
        };
        if before.is_empty() {
            return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
        }
        let after = numbers(session, channel)?;
        let mut findings = Vec::new();
        for old in before {
            let converted = old.scale.convert(old.value, change.from, change.to);
            let new = after.iter().find(|new| new.object == old.object);
            let (Some(expected), Some(new)) = (converted, new) else { continue };
            let tolerance = new.rounding + converted_rounding(change, old.rounding) + 0.002 * expected.abs();
            findings.extend(Finding::measured(old.object, expected, tolerance, new.value));
        }
        Ok(Verdict::of(findings))
    })
}

fn undone(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, CHANGED_CHANNELS, |session, channel| {
        let before = numbers(session, channel)?;
        let change = match change(session, channel)? {
            Ok(change) => change,
            Err(verdict) => return Ok(verdict),
        };
        let between = numbers(session, channel)?;
        if let Some(code) = session.try_write(change.object, &change.from.0.to_le_bytes())? {
            return Ok(Verdict::of([Finding::at(change.object, Expected::Acknowledged, Seen::Abort(code))]));
        }
        let back = Change { from: change.to, to: change.from, ..change };
        let after = numbers(session, channel)?;
        let mut findings = Vec::new();
        for old in before {
            let find = |list: &[Number]| list.iter().find(|number| number.object == old.object).copied();
            let (Some(between), Some(new)) = (find(&between), find(&after)) else { continue };
            let tolerance = old.rounding + converted_rounding(back, between.rounding) + 1e-5 * old.value.abs();
            findings.extend(Finding::measured(old.object, old.value, tolerance, new.value));
        }
        Ok(Verdict::of(findings))
    })
}
