//! Autozero (6125h). These cases write the signature, and restore the offset afterwards.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::super::sdo::expect_abort;
use super::super::session::Session;
use super::{Channel, Readings, check_channels, offset_object, rounding, touch_numbers};
use crate::canopen::object::ObjectId;
use crate::node::Error;

const fn case(id: &'static str, sentence: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, "CiA 404, object 6125h", run)
}

pub(in super::super) const CASES: &[Case] = &[
    case("404-50", "Autozero (6125h) rejects a wrong signature with 0800 0020h", wrong_signature)
        .matters(High, "A write by mistake changes the zero of the measurements.")
        .stores()
        .alone(),
    case("404-51", "Autozero (6125h) sets the process value to zero", zero)
        .matters(High, "The zero of the measurements cannot be set.")
        .stores()
        .alone(),
    case("404-52", "Autozero (6125h) changes the offset (6124h or 6127h) by as much as the process value", offset)
        .matters(Medium, "The zero cannot be checked, stored as a setting, or restored.")
        .stores()
        .alone(),
    case("404-53", "Writing the old offset (6124h or 6127h) restores the process value", undone)
        .matters(Medium, "A wrong zero cannot be undone.")
        .stores()
        .alone(),
];

/// Only the first channel with autozero.
const ALL: usize = 255;

/// The abort codes for a wrong signature; the general one is always allowed.
const WRONG_SIGNATURE: &[u32] = &[0x0800_0020, 0x0800_0000];

/// The objects of an autozero.
#[derive(Clone, Copy)]
struct Objects {
    autozero: ObjectId,
    offset: ObjectId,
}

/// The objects of an autozero. The verdict if there is none, or if it could not be undone.
fn objects(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Result<Objects, Verdict>, Error> {
    let number = channel.signal.channel;
    let description = session.node.model.as_ref().map(|model| &model.description);
    let described = description.and_then(|description| description.autozero.iter().find(|one| one.channel == number));
    let autozero = described.map_or(channel.object(0x6125), |one| one.object);
    if !session.node.may_have(autozero) {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NoObject(autozero))));
    }
    let Some(offset) = offset_object(session, channel) else {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NoObject(channel.object(0x6124)))));
    };
    touch_numbers(session, channel)?;
    Ok(Ok(Objects { autozero, offset }))
}

fn wrong_signature(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let objects = match objects(session, channel)? {
            Ok(objects) => objects,
            Err(verdict) => return Ok(verdict),
        };
        let answer = session.download(objects.autozero, b"zera")?;
        Ok(Verdict::of(expect_abort(session, objects.autozero, WRONG_SIGNATURE, answer)))
    })
}

/// An autozero that was executed.
struct ExecutedAutozero {
    objects: Objects,
    before: Readings,
    after: Readings,
    offset_before: f64,
    offset_after: f64,
    tolerance: f64,
}

/// Writes the signature. The verdict if nothing can be judged.
fn autozero(session: &mut Session<'_, '_>, channel: &Channel) -> Result<Result<ExecutedAutozero, Verdict>, Error> {
    let objects = match objects(session, channel)? {
        Ok(objects) => objects,
        Err(verdict) => return Ok(Err(verdict)),
    };
    let (value, data_type) = channel.values[0];
    let digits = session.digits_of(channel)?;
    let offset_type = session.node.data_type(objects.offset);
    let invalid = |object| Ok(Err(Verdict::not_judged(WhyNot::NoValidValue(object))));
    let Some(offset_before) = session.quantity(objects.offset, offset_type, digits)? else {
        return invalid(objects.offset);
    };
    let Some(before) = session.readings(value, data_type, digits)? else { return invalid(value) };
    // If the offset does not show the zero, only a reset restores it.
    session.needs_reset = true;
    let answer = session.download(objects.autozero, b"zero")?;
    if let Some(code) = answer.as_ref().and_then(abort_code) {
        session.needs_reset = false;
        return Ok(Err(Verdict::not_judged(WhyNot::Rejected(objects.autozero, code))));
    }
    let after = session.readings(value, data_type, digits)?;
    let Some(offset_after) = session.quantity(objects.offset, offset_type, digits)? else {
        return invalid(objects.offset);
    };
    session.needs_reset = offset_after == offset_before;
    let Some(after) = after else { return invalid(value) };
    let shift = before.middle();
    let steps = 2.0 * (rounding(data_type, digits, shift) + rounding(offset_type, digits, shift));
    let tolerance = before.allowance(after) + steps;
    if shift.abs() <= 2.0 * tolerance {
        return Ok(Err(Verdict::not_judged(WhyNot::NearZero(value))));
    }
    Ok(Ok(ExecutedAutozero { objects, before, after, offset_before, offset_after, tolerance }))
}

fn zero(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let zeroed = match autozero(session, channel)? {
            Ok(zeroed) => zeroed,
            Err(verdict) => return Ok(verdict),
        };
        let (value, _) = channel.values[0];
        Ok(Verdict::of(Finding::measured(value, 0.0, zeroed.tolerance, zeroed.after.middle())))
    })
}

fn offset(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let zeroed = match autozero(session, channel)? {
            Ok(zeroed) => zeroed,
            Err(verdict) => return Ok(verdict),
        };
        let ExecutedAutozero { objects, before, after, offset_before, offset_after, tolerance } = zeroed;
        // 404-51 reports a process value that is not zero.
        let expected = offset_before + after.middle() - before.middle();
        Ok(Verdict::of(Finding::measured(objects.offset, expected, tolerance, offset_after)))
    })
}

fn undone(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    check_channels(session, ALL, |session, channel| {
        let zeroed = match autozero(session, channel)? {
            Ok(zeroed) => zeroed,
            Err(verdict) => return Ok(verdict),
        };
        let offset = zeroed.objects.offset;
        let Some(old) = session.settings.before(offset).map(<[u8]>::to_vec) else {
            return Ok(Verdict::NotApplicable(WhyNot::NoObject(offset)));
        };
        // 404-52 reports an offset that was not changed.
        if zeroed.offset_after == zeroed.offset_before {
            return Ok(Verdict::not_judged(WhyNot::NotWritable(offset)));
        }
        if let Some(code) = session.try_write(offset, &old)? {
            return Ok(Verdict::of([Finding::at(offset, Expected::Acknowledged, Seen::Abort(code))]));
        }
        let (value, data_type) = channel.values[0];
        let digits = session.digits_of(channel)?;
        let Some(now) = session.readings(value, data_type, digits)? else {
            return Ok(Verdict::not_judged(WhyNot::NoValidValue(value)));
        };
        let tolerance = zeroed.tolerance + zeroed.before.allowance(now);
        Ok(Verdict::of(Finding::measured(value, zeroed.before.middle(), tolerance, now.middle())))
    })
}
