//! SDO segmented transfer.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::codes;
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::super::session::{Session, number, request};
use super::{ABORT, READS, expect_abort, narrow_setting, unchanged};
use crate::canopen::frame::Frame;
use crate::canopen::object::ObjectId;
use crate::node::Error;
use crate::node::state::HEARTBEAT_TIME;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Sdo, id, sentence, clause, run)
}

const UPLOAD_SEGMENT: &str = "CiA 301, SDO upload segment";
const DOWNLOAD_SEGMENT: &str = "CiA 301, SDO download segment";

pub(in super::super) const CASES: &[Case] = &[
    case(
        "SDO-13",
        "A long object is read in segments with alternating toggle bit and the announced size",
        UPLOAD_SEGMENT,
        segmented_upload,
    )
    .matters(High, "Names and other long objects cannot be read, or are cut off."),
    case("SDO-14", "A value is accepted in a segmented download", DOWNLOAD_SEGMENT, segmented_download)
        .matters(Low, "Masters that always write in segments cannot set the device up."),
    case("SDO-15", "A segment request with a wrong toggle bit is rejected", UPLOAD_SEGMENT, wrong_toggle_upload)
        .matters(Medium, "After a lost frame, a segment may be delivered twice or be missing."),
    case(
        "SDO-16",
        "A written segment with a wrong toggle bit is rejected, and changes nothing",
        DOWNLOAD_SEGMENT,
        wrong_toggle_download,
    )
    .matters(Medium, "After a repeated frame, a wrong value is written."),
    case("SDO-17", "A segment request without a transfer is rejected", UPLOAD_SEGMENT, segment_without_transfer)
        .matters(Low, "A master with a wrong state waits for the time-out."),
    case("SDO-18", "An abort ends the transfer and is not answered", ABORT, abort_ends_transfer)
        .matters(Medium, "A cancelled transfer disturbs the next one."),
    case("SDO-19", "A new request replaces an unfinished transfer", "CiA 301, SDO protocols", new_request_replaces)
        .matters(Medium, "After a restart of the master, the device answers late or not at all."),
];

/// An object of more than four bytes, and the answer to the initiate of its upload.
fn long_object(session: &mut Session<'_, '_>) -> Result<Option<(ObjectId, Frame)>, Error> {
    for index in [0x1008, 0x1009, 0x100a] {
        let object = ObjectId::new(index, 0);
        if let Some(answer) = session.upload(object)?.filter(|answer| matches!(answer.data(), [0x40 | 0x41, ..])) {
            return Ok(Some((object, answer)));
        }
    }
    session.open_transfer = None;
    Ok(None)
}

/// The most segments of a name.
const MAX_SEGMENTS: usize = 100;

fn segmented_upload(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((object, initiate)) = long_object(session)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    let announced = match initiate.data() {
        [0x41, _, _, _, size @ ..] => usize::try_from(number(size)).ok(),
        _ => None,
    };
    let (mut size, mut toggle, mut is_last) = (0, 0u8, false);
    for _ in 0..MAX_SEGMENTS {
        let answer = session.raw(request(0x60 | toggle, ObjectId::new(0, 0), [0; 4]))?;
        let segment = answer.as_ref().filter(|frame| frame.data().len() == 8 && frame.data()[0] & 0xf0 == toggle);
        let Some(command) = segment.map(|frame| frame.data()[0]) else {
            let seen = Seen::answer(answer, session.timeout());
            return Ok(Verdict::of([Finding::at(object, Expected::Segment, seen)]));
        };
        size += 7 - usize::from(command >> 1 & 0b111);
        toggle ^= 0x10;
        is_last = command & 1 != 0;
        if is_last {
            break;
        }
    }
    session.open_transfer = None;
    let is_right = is_last && announced.is_none_or(|announced| announced == size);
    let finding = || Finding::at(object, Expected::Size(announced.unwrap_or(0)), Seen::Number(size as u64));
    Ok(Verdict::of((!is_right).then(finding)))
}

/// Starts a segmented download of the heartbeat time with its present value. `None` if the device has no segmented
/// transfer or does not allow it.
fn start_download(session: &mut Session<'_, '_>) -> Result<Result<Vec<u8>, Verdict>, Error> {
    let Some((_, value)) = narrow_setting(session)?.filter(|(object, _)| *object == HEARTBEAT_TIME) else {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NoSuitableObject)));
    };
    session.touch(HEARTBEAT_TIME)?;
    session.open_transfer = Some(HEARTBEAT_TIME);
    let answer = session.raw(request(0x21, HEARTBEAT_TIME, [2, 0, 0, 0]))?;
    if answer.as_ref().is_some_and(|frame| frame.data().first() == Some(&0x60)) {
        return Ok(Ok(value));
    }
    if answer.as_ref().and_then(abort_code).is_some_and(|code| codes::COMMAND.contains(&code.0)) {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NoSegments)));
    }
    let seen = Seen::answer(answer, session.timeout());
    Ok(Err(Verdict::of([Finding::at(HEARTBEAT_TIME, Expected::Command(&[0x60]), seen)])))
}

fn segmented_download(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let value = match start_download(session)? {
        Ok(value) => value,
        Err(verdict) => return Ok(verdict),
    };
    let new = [value[0] ^ 0x40, value[1]];
    let answer = session.raw([0x0b, new[0], new[1], 0, 0, 0, 0, 0])?;
    session.open_transfer = None;
    if answer.as_ref().and_then(|frame| frame.data().first()) != Some(&0x20) {
        let seen = Seen::answer(answer, session.timeout());
        return Ok(Verdict::of([Finding::at(HEARTBEAT_TIME, Expected::Command(&[0x20]), seen)]));
    }
    Ok(Verdict::of(unchanged(session, HEARTBEAT_TIME, &new)?))
}

fn wrong_toggle_upload(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((object, _)) = long_object(session)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    let answer = session.raw(request(0x70, ObjectId::new(0, 0), [0; 4]))?;
    Ok(Verdict::of(expect_abort(session, object, codes::TOGGLE, answer)))
}

fn wrong_toggle_download(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let value = match start_download(session)? {
        Ok(value) => value,
        Err(verdict) => return Ok(verdict),
    };
    let answer = session.raw([0x1b, value[0] ^ 0x40, value[1], 0, 0, 0, 0, 0])?;
    let refused = expect_abort(session, HEARTBEAT_TIME, codes::TOGGLE, answer);
    session.end_transfer()?;
    Ok(Verdict::of(refused.into_iter().chain(unchanged(session, HEARTBEAT_TIME, &value)?)))
}

const SEGMENT_REQUEST: [u8; 8] = [0x60, 0, 0, 0, 0, 0, 0, 0];

fn segment_without_transfer(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    // An expedited read ends any earlier transfer.
    session.upload(ObjectId::DEVICE_TYPE)?;
    session.open_transfer = None;
    let answer = session.raw(SEGMENT_REQUEST)?;
    let is_abort = answer.as_ref().and_then(abort_code).is_some();
    let finding = || Finding::new(Expected::Abort(codes::COMMAND), Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_abort).then(finding)))
}

fn abort_ends_transfer(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((object, _)) = long_object(session)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    let timeout = session.timeout();
    if let Some(answer) = session.raw(request(0x80, object, 0x0800_0000u32.to_le_bytes()))? {
        return Ok(Verdict::of([Finding::at(object, Expected::NoAnswer, Seen::answer(Some(answer), timeout))]));
    }
    let answer = session.raw(SEGMENT_REQUEST)?;
    let is_segment = answer.as_ref().is_some_and(|frame| frame.data().first().is_some_and(|command| command >> 5 == 0));
    let finding = || Finding::at(object, Expected::Abort(codes::COMMAND), Seen::answer(answer, timeout));
    Ok(Verdict::of(is_segment.then(finding)))
}

fn new_request_replaces(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if long_object(session)?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    }
    let object = ObjectId::DEVICE_TYPE;
    let answer = session.upload(object)?;
    let is_right = answer.as_ref().is_some_and(|frame| frame.data().first().is_some_and(|command| command >> 5 == 2));
    let finding = || Finding::at(object, Expected::Command(READS), Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_right).then(finding)))
}
