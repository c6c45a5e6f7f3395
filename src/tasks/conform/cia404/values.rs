//! Values that are only read: sensor type, unit, decimal digits, process values, status and span.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::{Channel, Number, READINGS, check_channels, numbers, rounding};
use crate::device::sensor::{self, Measurand};
use crate::device::unit::Unit;
use crate::node::Error;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, clause, run)
}

pub(in super::super) const CASES: &[Case] = &[
    case(
        "404-01",
        "The unit (6131h) belongs to the physical quantity of the sensor type (6110h)",
        "CiA 404, object 6131h",
        unit,
    )
    .matters(High, "Measurements are shown in a wrong unit."),
    case("404-02", "Bits 0 to 7 of the unit code (6131h) are 0", "CiA 303-2, CiA 890", unit_code)
        .matters(Medium, "Tools do not recognise the unit."),
    case("404-03", "The number of decimal digits (6132h) is 9 or less", "CiA 404, object 6132h", digits)
        .matters(High, "Tools scale the integer values wrongly."),
    case(
        "404-04",
        "The process values of all types (6130h, 7130h, 8130h, 9130h) are equal within their digits",
        "CiA 404, objects x130h",
        equal_values,
    )
    .matters(High, "Masters that use another type receive wrong measurements."),
    case(
        "404-05",
        "The status (6150h) shows an overload if the process value is outside of the span (x148h, x149h)",
        "CiA 404, object 6150h",
        status,
    )
    .matters(High, "Wrong measurements are used, or right ones are not."),
    case(
        "404-06",
        "The span starts below its end (x148h, x149h), and is the same in all types",
        "CiA 404, objects x148h and x149h",
        span,
    )
    .matters(Medium, "Tools show a wrong measuring range."),
];

/// All channels: these cases only read.
const ALL: usize = 255;

const NO_OBJECT: Verdict = Verdict::NotApplicable(WhyNot::NoSuitableObject);

fn unit(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let sensor_type = channel.object(0x6110);
        let Some(object) = channel.unit else { return Ok(NO_OBJECT) };
        let (Some(code), Some(unit)) = (session.number(sensor_type)?, session.number(object)?) else {
            return Ok(NO_OBJECT);
        };
        let Some(measurand) = u16::try_from(code).ok().and_then(sensor::measurand) else {
            return Ok(Verdict::not_judged(WhyNot::UnknownCode(sensor_type)));
        };
        let unit = Unit(u32::try_from(unit).unwrap_or(u32::MAX));
        let wanted = match measurand {
            Measurand::Pressure => Unit::PASCAL,
            Measurand::Temperature => Unit::KELVIN,
        };
        if unit.symbol().is_none() {
            return Ok(Verdict::not_judged(WhyNot::UnknownCode(object)));
        }
        let is_wrong = unit.convert(1.0, wanted).is_none();
        Ok(Verdict::of(is_wrong.then(|| Finding::at(object, Expected::UnitLike(wanted), Seen::Unit(unit)))))
    })
}

fn unit_code(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let Some(object) = channel.unit else { return Ok(NO_OBJECT) };
        let Some(code) = session.number(object)? else { return Ok(NO_OBJECT) };
        let bytes = |code: u64| u32::try_from(code).unwrap_or(u32::MAX).to_le_bytes().to_vec();
        let finding = || Finding::at(object, Expected::Bytes(bytes(code & !0xff)), Seen::Bytes(bytes(code)));
        Ok(Verdict::of((code & 0xff != 0).then(finding)))
    })
}

/// With more digits, 1 does not fit into an INTEGER32.
const MOST_DIGITS: u64 = 9;

fn digits(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let Some(object) = channel.digits else { return Ok(NO_OBJECT) };
        let Some(digits) = session.number(object)? else {
            return Ok(Verdict::NotApplicable(WhyNot::NoObject(object)));
        };
        let finding = || Finding::at(object, Expected::Range(0, MOST_DIGITS), Seen::Number(digits));
        Ok(Verdict::of((digits > MOST_DIGITS).then(finding)))
    })
}

fn equal_values(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, equal_values_of)
}

fn equal_values_of(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Verdict, Error> {
    let [reference, others @ ..] = &channel.values[..] else { return Ok(NO_OBJECT) };
    let digits = session.digits_of(channel)?;
    let (mut findings, mut is_judged) = (Vec::new(), false);
    for &(object, data_type) in others {
        // The reference is read before and after each value, so that a slow change has no effect on the means.
        let (mut sums, mut low, mut high) = ([0.0; 2], f64::INFINITY, f64::NEG_INFINITY);
        let mut count = 0;
        for _ in 0..READINGS {
            let before = session.quantity(reference.0, reference.1, digits)?;
            let value = session.quantity(object, data_type, digits)?;
            let after = session.quantity(reference.0, reference.1, digits)?;
            let (Some(before), Some(value), Some(after)) = (before, value, after) else { continue };
            sums = [sums[0] + (before + after) / 2.0, sums[1] + value];
            (low, high, count) = (low.min(before).min(after), high.max(before).max(after), count + 1);
        }
        if count < READINGS {
            continue;
        }
        is_judged = true;
        let [expected, seen] = sums.map(|sum| sum / f64::from(count));
        let errors = rounding(reference.1, digits, expected) + rounding(data_type, digits, seen);
        findings.extend(Finding::measured(object, expected, errors + (high - low), seen));
    }
    Ok(match (is_judged, others.is_empty()) {
        (_, true) => NO_OBJECT,
        (false, _) => Verdict::not_judged(WhyNot::NoValidValue(reference.0)),
        _ => Verdict::of(findings),
    })
}

/// The families of process values: REAL32, INTEGER16, INTEGER24, INTEGER32.
const FAMILIES: [u16; 4] = [0x6000, 0x9000, 0x8000, 0x7000];

/// Start and end of the span in each family.
pub(super) fn spans(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Vec<[Number; 2]>, Error> {
    let all = numbers(session, channel)?;
    let find = |index: u16| all.iter().find(|number| number.object.index == index).copied();
    let span = |family: u16| Some([find(family | 0x148)?, find(family | 0x149)?]);
    Ok(FAMILIES.into_iter().filter_map(span).collect())
}

/// How far the process value is outside of the span if the status must show it: a part of the span.
const BEYOND: f64 = 0.05;

/// The bits of an overload.
pub(super) const POSITIVE: u64 = 0b010;
pub(super) const NEGATIVE: u64 = 0b100;

fn status(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let object = channel.object(0x6150);
        if channel.signal.status != Some(object) || !session.node.may_have(object) {
            return Ok(Verdict::NotApplicable(WhyNot::NoObject(object)));
        }
        let Some([start, end]) = spans(session, channel)?.first().copied() else { return Ok(NO_OBJECT) };
        let digits = session.digits_of(channel)?;
        let (value, data_type) = channel.values[0];
        let beyond = BEYOND * (end.value - start.value).abs();
        let mut wrong = None;
        for _ in 0..3 {
            let Some(status) = session.number(object)? else {
                return Ok(Verdict::NotApplicable(WhyNot::NoObject(object)));
            };
            let Some(value) = session.quantity(value, data_type, digits)? else {
                return Ok(Verdict::not_judged(WhyNot::NoValidValue(value)));
            };
            let expected = match value {
                _ if value > start.value && value < end.value => 0,
                _ if value > end.value + beyond => POSITIVE,
                _ if value < start.value - beyond => NEGATIVE,
                // At the limit both are right.
                _ => return Ok(Verdict::Pass),
            };
            if status & (POSITIVE | NEGATIVE) == expected {
                return Ok(Verdict::Pass);
            }
            wrong = Some(Finding::at(object, Expected::Number(expected), Seen::Number(status)));
        }
        Ok(Verdict::of(wrong))
    })
}

fn span(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let spans = spans(session, channel)?;
        let [[start, end], others @ ..] = &spans[..] else { return Ok(NO_OBJECT) };
        let mut findings = Vec::new();
        if start.value >= end.value {
            let expected = Expected::Above(start.value);
            findings.push(Finding::at(end.object, expected, Seen::Measured(end.value)));
        }
        for (first, other) in others.iter().flat_map(|[low, high]| [(start, low), (end, high)]) {
            let tolerance = first.rounding + other.rounding;
            findings.extend(Finding::measured(other.object, first.value, tolerance, other.value));
        }
        Ok(Verdict::of(findings))
    })
}
