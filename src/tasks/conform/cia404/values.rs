//! Values that are only read: sensor type, unit, decimal digits, process values, status and span.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::{Channel, READINGS, check_channels, rounding};
use crate::device::sensor::{self, Measurand};
use crate::device::unit::Unit;
use crate::node::Error;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, clause, run)
}

pub(in super::super) const CASES: &[Case] = &[
    case("404-01", "The unit (6131h) is one of the quantity of the sensor type (6110h)", "CiA 404, object 6131h", unit)
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
];

/// All channels: these cases only read.
const ALL: usize = 255;

const NO_UNIT: Verdict = Verdict::NotApplicable(WhyNot::NoSuitableObject);

fn unit(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let sensor_type = channel.object(0x6110);
        let Some(object) = channel.unit else { return Ok(NO_UNIT) };
        let (Some(code), Some(unit)) = (session.number(sensor_type)?, session.number(object)?) else {
            return Ok(NO_UNIT);
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
        let Some(object) = channel.unit else { return Ok(NO_UNIT) };
        let Some(code) = session.number(object)? else { return Ok(NO_UNIT) };
        let bytes = |code: u64| u32::try_from(code).unwrap_or(u32::MAX).to_le_bytes().to_vec();
        let finding = || Finding::at(object, Expected::Bytes(bytes(code & !0xff)), Seen::Bytes(bytes(code)));
        Ok(Verdict::of((code & 0xff != 0).then(finding)))
    })
}

/// With more digits, 1 does not fit into an INTEGER32.
const MOST_DIGITS: u64 = 9;

fn digits(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let Some(object) = channel.digits else { return Ok(NO_UNIT) };
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
    let [reference, others @ ..] = &channel.values[..] else { return Ok(NO_UNIT) };
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
        if (expected - seen).abs() > errors + (high - low) {
            let near = Expected::Measured { value: expected, tolerance: errors + (high - low) };
            findings.push(Finding::at(object, near, Seen::Measured(seen)));
        }
    }
    Ok(match (is_judged, others.is_empty()) {
        (_, true) => NO_UNIT,
        (false, _) => Verdict::not_judged(WhyNot::NoValidValue(reference.0)),
        _ => Verdict::of(findings),
    })
}
