//! Other decimal digits (6132h): integers are scaled, and the old digits can be set again.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::{CHANGED_CHANNELS, Channel, check_channels, numbers, rounding, step, touch_numbers};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::node::Error;

const fn case(id: &'static str, sentence: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, "CiA 404, object 6132h", run)
}

pub(in super::super) const CASES: &[Case] = &[
    case("404-20", "Other decimal digits (6132h) scale the integers of the process value", process_value)
        .matters(High, "Masters scale the measurements wrongly.")
        .alone(),
    case("404-21", "After the old decimal digits (6132h) are set again, span, limits and offset are as before", undone)
        .matters(Medium, "A change of the digits changes the settings.")
        .alone(),
];

/// A change of the digits.
#[derive(Clone, Copy)]
struct Change {
    object: ObjectId,
    from: u8,
    to: u8,
}

/// Sets one digit less, or 1 instead of 0. The verdict if the device rejects it.
fn change(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Result<Change, Verdict>, Error> {
    let Some(object) = channel.digits else { return Ok(Err(Verdict::NotApplicable(WhyNot::NoSuitableObject))) };
    let Some(digits) = session.number(object)? else {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NoObject(object))));
    };
    let fixed = Verdict::NotApplicable(WhyNot::NotWritable(object));
    let from = u8::try_from(digits).unwrap_or(u8::MAX);
    let to = from.checked_sub(1).unwrap_or(1);
    if session.node.is_read_only(object) {
        return Ok(Err(fixed));
    }
    touch_numbers(session, channel)?;
    let is_changed = session.try_write(object, &[to])?.is_none() && session.number(object)? == Some(u64::from(to));
    Ok(if is_changed { Ok(Change { object, from, to }) } else { Err(fixed) })
}

fn process_value(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, CHANGED_CHANNELS, |session, channel| {
        let integers: Vec<(ObjectId, DataType)> =
            channel.values.iter().copied().filter(|(_, data_type)| matches!(data_type, DataType::Integer(_))).collect();
        let Some(&(first, _)) = integers.first() else {
            return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
        };
        let digits = session.digits_of(channel)?;
        let mut before = Vec::new();
        for &(object, data_type) in &integers {
            before.push(session.readings(object, data_type, digits)?);
        }
        let change = match change(session, channel)? {
            Ok(change) => change,
            Err(verdict) => return Ok(verdict),
        };
        let (mut findings, mut is_judged, mut why_not) = (Vec::new(), false, WhyNot::NoValidValue(first));
        for (&(object, data_type), old) in integers.iter().zip(before) {
            let new = session.readings(object, data_type, change.to)?;
            let (Some(old), Some(new)) = (old, new) else { continue };
            let expected = old.middle();
            let steps = step(data_type, change.from) + step(data_type, change.to);
            let tolerance = old.allowance(new) + steps;
            if let Some(finding) = Finding::measured(object, expected, tolerance, new.middle()) {
                findings.push(finding);
            } else if 0.9 * expected.abs() > tolerance {
                is_judged = true;
            } else {
                why_not = WhyNot::NearZero(object);
            }
        }
        let is_judged = is_judged || !findings.is_empty();
        Ok(if is_judged { Verdict::of(findings) } else { Verdict::not_judged(why_not) })
    })
}

fn undone(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, CHANGED_CHANNELS, |session, channel| {
        let before = numbers(session, channel)?;
        let change = match change(session, channel)? {
            Ok(change) => change,
            Err(verdict) => return Ok(verdict),
        };
        if let Some(code) = session.try_write(change.object, &[change.from])? {
            return Ok(Verdict::of([Finding::at(change.object, Expected::Acknowledged, Seen::Abort(code))]));
        }
        let after = numbers(session, channel)?;
        let mut findings = Vec::new();
        for old in before {
            let Some(new) = after.iter().find(|new| new.object == old.object) else { continue };
            let data_type = session.node.data_type(old.object);
            let tolerance = old.rounding + rounding(data_type, change.to, old.value);
            findings.extend(Finding::measured(old.object, old.value, tolerance, new.value));
        }
        Ok(Verdict::of(findings))
    })
}
