//! The filter (61A0h, 61A1h) without a change of the input: rejected types, and the mean. The step response is in
//! `step`.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::codes;
use super::super::finding::{Finding, Verdict, WhyNot};
use super::super::sdo::expect_abort;
use super::super::session::Session;
use super::{Channel, check_channels, rounding};
use crate::node::Error;
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, clause, run)
}

pub(in super::super) const CASES: &[Case] = &[
    case("404-30", "The reserved filter type (61A0h) 99 is rejected", "CiA 404, object 61A0h", reserved)
        .matters(Low, "A wrong setting is not noticed.")
        .alone(),
    case(
        "404-31",
        "The filter types 1 and 2 (61A0h) do not shift the process value",
        "CiA 404, objects 61A0h and 61A1h",
        mean,
    )
    .matters(High, "Filtered measurements are wrong.")
    .alone(),
];

pub(super) const TYPE: u16 = 0x61a0;
pub(super) const CONSTANT: u16 = 0x61a1;

/// One channel is enough: the filters of the other channels are the same software.
const ONE: usize = 1;

/// The types 3 to 99 are reserved in version 1.2, and 5 to 99 in later versions.
const RESERVED: u8 = 99;

fn reserved(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ONE, |session, channel| {
        let object = channel.object(TYPE);
        if !session.node.may_have(object) {
            return Ok(Verdict::NotApplicable(WhyNot::NoObject(object)));
        }
        let Some(present) = session.read(object)? else {
            return Ok(Verdict::NotApplicable(WhyNot::NoObject(object)));
        };
        if session.try_write(object, &present)?.is_some() {
            return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
        }
        let answer = session.download(object, &[RESERVED])?;
        Ok(Verdict::of(expect_abort(session, object, codes::VALUE, answer)))
    })
}

/// The filter constant: a few samples.
const STEPS: u16 = 4;

/// The time for a filter with this constant.
const SETTLING: Duration = Duration::from_millis(100);

fn mean(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ONE, mean_of)
}

fn mean_of(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Verdict, Error> {
    let (kind, constant) = (channel.object(TYPE), channel.object(CONSTANT));
    let no_object = Verdict::NotApplicable(WhyNot::NoObject(kind));
    if !session.node.may_have(kind) {
        return Ok(no_object);
    }
    let Some(present) = session.read(kind)? else { return Ok(no_object) };
    let (value, data_type) = channel.values[0];
    let digits = session.digits_of(channel)?;
    if session.node.may_have(constant) && session.read(constant)?.is_some() {
        session.try_write(constant, &STEPS.to_le_bytes())?;
    }
    let (mut findings, mut is_judged) = (Vec::new(), false);
    for code in [1, 2] {
        let before = session.readings(value, data_type, digits)?;
        if session.try_write(kind, &[code])?.is_some() {
            continue;
        }
        session.pause(SETTLING)?;
        let filtered = session.readings(value, data_type, digits)?;
        session.try_write(kind, &present)?;
        session.pause(SETTLING)?;
        let after = session.readings(value, data_type, digits)?;
        let (Some(before), Some(filtered), Some(after)) = (before, filtered, after) else {
            return Ok(Verdict::not_judged(WhyNot::NoValidValue(value)));
        };
        is_judged = true;
        // The value may change from the first to the last reading.
        let (low, high) = (before.low.min(after.low), before.high.max(after.high));
        let expected = f64::midpoint(low, high);
        let tolerance =
            (high - low) + before.allowance(after) + 2.0 * (filtered.spread() + rounding(data_type, digits, expected));
        findings.extend(Finding::measured(value, expected, tolerance, filtered.middle()));
    }
    Ok(if is_judged { Verdict::of(findings) } else { Verdict::NotApplicable(WhyNot::NotWritable(kind)) })
}
