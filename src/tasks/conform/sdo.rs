//! SDO transfers: expedited and segmented.

pub(super) mod blocks;
pub(super) mod general;
pub(super) mod segments;

use super::case::{Area, Case, Severity::*};
use super::codes;
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::session::{Session, number, request};
use super::settings::may_write;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::multiplexer;
use crate::canopen::value::DataType;
use crate::device::description::Access;
use crate::device::dictionary::Entry;
use crate::node::Error;
use crate::node::state::HEARTBEAT_TIME;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: super::case::Run) -> Case {
    Case::new(Area::Sdo, id, sentence, clause, run)
}

const INITIATE_UPLOAD: &str = "CiA 301, SDO upload initiate";
const INITIATE_DOWNLOAD: &str = "CiA 301, SDO download initiate";
const ABORT: &str = "CiA 301, SDO abort transfer";

pub(super) const CASES: &[Case] = &[
    case("SDO-01", "A read of 1000h is answered with its four bytes in one frame", INITIATE_UPLOAD, expedited_upload)
        .matters(High, "Masters cannot find out what kind of device this is."),
    case("SDO-02", "Answers have eight bytes", "CiA 301, SDO protocols", eight_bytes)
        .matters(Medium, "Masters that check the length ignore the answers."),
    case("SDO-03", "A write to the read-only object 1000h is rejected", ABORT, write_read_only)
        .matters(Medium, "A wrong write is not noticed, or the abort code does not show the reason."),
    case("SDO-04", "A read of a write-only object is rejected", ABORT, read_write_only)
        .matters(Low, "The reason of a failed read is not shown."),
    case("SDO-05", "A read of a missing sub-index is rejected", ABORT, missing_sub_index)
        .matters(Medium, "Tools that search the object dictionary find entries that do not exist."),
    case("SDO-06", "A read of a missing object is rejected", ABORT, missing_object)
        .matters(Medium, "Tools that search the object dictionary find objects that do not exist."),
    case("SDO-07", "A request with an unknown command specifier is rejected", ABORT, unknown_command)
        .matters(Low, "Masters wait for the time-out, for example after a request for block transfer."),
    case(
        "SDO-08",
        "A value that is longer than the object is rejected, and changes nothing",
        INITIATE_DOWNLOAD,
        too_long,
    )
    .matters(Medium, "A wrong type in the master's settings is not noticed, and a cut-off value is used."),
    case(
        "SDO-09",
        "A value that is shorter than the object is rejected, and changes nothing",
        INITIATE_DOWNLOAD,
        too_short,
    )
    .matters(Medium, "A wrong type in the master's settings is not noticed, and a wrong value is used."),
    case("SDO-10", "A value above the upper limit is rejected, and changes nothing", ABORT, too_high)
        .matters(Medium, "A setting that the device does not support is not noticed."),
    case("SDO-11", "A value below the lower limit is rejected, and changes nothing", ABORT, too_low)
        .matters(Medium, "A setting that the device does not support is not noticed."),
    case(
        "SDO-12",
        "1200h contains the COB-IDs of the predefined connection set",
        "CiA 301, object 1200h",
        server_cob_ids,
    )
    .matters(Medium, "Masters that use 1200h send requests to a wrong COB-ID."),
];

const READS: &[u8] = &[0x43, 0x42];

/// The size that an answer to an initiate upload indicates, if it contains the data.
pub(super) fn expedited_size(answer: &Frame) -> Option<usize> {
    match answer.data().first() {
        Some(command @ (0x43 | 0x47 | 0x4b | 0x4f)) => Some(4 - usize::from(command >> 2 & 0b11)),
        _ => None,
    }
}

/// An SDO abort with one of these codes is expected.
pub(super) fn expect_abort(
    session: &Session<'_, '_>,
    object: ObjectId,
    codes: &'static [u32],
    answer: Option<Frame>,
) -> Option<Finding> {
    let is_allowed = answer.as_ref().and_then(abort_code).is_some_and(|code| codes.contains(&code.0));
    (!is_allowed).then(|| Finding::at(object, Expected::Abort(codes), Seen::answer(answer, session.timeout())))
}

fn expedited_upload(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let object = ObjectId::DEVICE_TYPE;
    let answer = session.upload(object)?;
    session.open_transfer = None;
    let is_right = answer.as_ref().is_some_and(|frame| {
        frame.data().first().is_some_and(|command| READS.contains(command)) && multiplexer(frame.data()) == Some(object)
    });
    let finding = || Finding::at(object, Expected::Command(READS), Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_right).then(finding)))
}

fn eight_bytes(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let requests = [ObjectId::DEVICE_TYPE, ObjectId::new(0x1001, 0), ObjectId::new(0x1018, 0), MISSING];
    let mut findings = Vec::new();
    for object in requests {
        let Some(answer) = session.upload(object)? else { continue };
        if answer.data().len() != 8 {
            findings.push(Finding::at(object, Expected::EightBytes, Seen::Frame(answer)));
        }
    }
    session.open_transfer = None;
    Ok(Verdict::of(findings))
}

fn write_read_only(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let object = ObjectId::DEVICE_TYPE;
    let Some(value) = session.read(object)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(object))) };
    let answer = session.download(object, &value)?;
    Ok(Verdict::of(expect_abort(session, object, codes::READ_ONLY, answer)))
}

fn read_write_only(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let dictionary = session.node.model.as_ref().map(|model| &model.dictionary);
    let found = dictionary.and_then(|entries| entries.iter().find(|entry| entry.access == Access::Wo));
    let Some(object) = found.map(|entry| entry.object) else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    let answer = session.upload(object)?;
    Ok(Verdict::of(expect_abort(session, object, codes::WRITE_ONLY, answer)))
}

fn missing_sub_index(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let object = ObjectId::DEVICE_TYPE.with_sub(1);
    let answer = session.upload(object)?;
    Ok(Verdict::of(expect_abort(session, object, codes::NO_SUB_INDEX, answer)))
}

/// Objects that CiA 301 reserves.
const MISSING: ObjectId = ObjectId::new(0x1004, 0);
const RESERVED: ObjectId = ObjectId::new(0x0fff, 0);

fn missing_object(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let mut findings = Vec::new();
    for object in [MISSING, RESERVED] {
        let answer = session.upload(object)?;
        findings.extend(expect_abort(session, object, codes::NO_OBJECT, answer));
    }
    Ok(Verdict::of(findings))
}

fn unknown_command(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let object = ObjectId::DEVICE_TYPE;
    let answer = session.raw(request(0xe0, object, [0; 4]))?;
    Ok(Verdict::of(expect_abort(session, object, codes::COMMAND, answer)))
}

/// A writable number of one or two bytes that may be written with its own value.
pub(super) fn narrow_setting(session: &mut Session<'_, '_>) -> Result<Option<(ObjectId, Vec<u8>)>, Error> {
    let candidates = [HEARTBEAT_TIME, ObjectId::new(0x1015, 0), ObjectId::new(0x1800, 5), ObjectId::new(0x1800, 2)];
    for object in candidates {
        if let Some(value) = session.read(object)?.filter(|value| value.len() <= 2)
            && session.try_write(object, &value)?.is_none()
        {
            return Ok(Some((object, value)));
        }
    }
    Ok(None)
}

/// Whether the object has another value than before the case.
pub(super) fn unchanged(
    session: &mut Session<'_, '_>,
    object: ObjectId,
    value: &[u8],
) -> Result<Option<Finding>, Error> {
    let found = session.read(object)?.unwrap_or_default();
    Ok((found != value).then(|| Finding::at(object, Expected::Bytes(value.to_vec()), Seen::Bytes(found))))
}

fn too_long(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((object, value)) = narrow_setting(session)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    session.touch(object)?;
    // The excess is not 0, so that it cannot be padding.
    let answer = session.raw(request(0x23, object, [value[0], value.get(1).copied().unwrap_or(1), 1, 1]))?;
    let refused = expect_abort(session, object, codes::TOO_LONG, answer);
    Ok(Verdict::of(refused.into_iter().chain(unchanged(session, object, &value)?)))
}

fn too_short(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((object, value)) = narrow_setting(session)?.filter(|(_, value)| value.len() == 2) else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    session.touch(object)?;
    let answer = session.raw(request(0x2f, object, [value[0] ^ 0x40, 0, 0, 0]))?;
    let refused = expect_abort(session, object, codes::TOO_SHORT, answer);
    Ok(Verdict::of(refused.into_iter().chain(unchanged(session, object, &value)?)))
}

/// A setting, its value, and a number beyond its limit.
struct Limited {
    object: ObjectId,
    value: Vec<u8>,
    beyond: Vec<u8>,
}

/// Whether the rules for PDOs decide which values of an object are allowed.
pub(super) fn has_pdo_rules(object: ObjectId) -> bool {
    match object.index {
        0x1005 | 0x1014 | 0x1a00..=0x1bff => true,
        0x1800..=0x19ff => object.sub == 1,
        _ => false,
    }
}

/// A number beyond the upper or lower limit of an unsigned entry; `None` if there is none.
fn beyond(entry: &Entry, is_high: bool) -> Option<Vec<u8>> {
    let DataType::Unsigned(1..=4) = entry.data_type else { return None };
    let limit = if is_high { entry.high.as_ref()? } else { entry.low.as_ref()? };
    let limit = limit.encode(entry.data_type, NodeId::MIN).ok()?;
    let number = number(&limit);
    let beyond = if is_high { number + 1 } else { number.checked_sub(1)? };
    (beyond >> (8 * limit.len()) == 0).then(|| beyond.to_le_bytes()[..limit.len()].to_vec())
}

/// A setting with a limit.
fn limited(session: &mut Session<'_, '_>, is_high: bool) -> Result<Option<Limited>, Error> {
    let Some(model) = session.node.model.clone() else { return Ok(None) };
    for entry in model.dictionary.iter().filter(|entry| entry.access == Access::Rw && may_write(entry.object)) {
        let object = entry.object;
        let is_signature = model.description.object(object).is_some_and(|object| object.signature.is_some());
        let Some(beyond) = beyond(entry, is_high).filter(|_| !is_signature && !has_pdo_rules(object)) else { continue };
        if let Some(value) = session.read(object)? {
            return Ok(Some(Limited { object, value, beyond }));
        }
    }
    Ok(None)
}

fn beyond_limit(session: &mut Session<'_, '_>, is_high: bool, codes: &'static [u32]) -> Result<Verdict, Error> {
    let Some(Limited { object, value, beyond }) = limited(session, is_high)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    let answer = session.download(object, &beyond)?;
    let refused = expect_abort(session, object, codes, answer);
    Ok(Verdict::of(refused.into_iter().chain(unchanged(session, object, &value)?)))
}

fn too_high(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    beyond_limit(session, true, codes::TOO_HIGH)
}

fn too_low(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    beyond_limit(session, false, codes::TOO_LOW)
}

fn server_cob_ids(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let node = session.node.id;
    let mut findings = Vec::new();
    for (sub, id) in [(1, CanId::sdo_request(node)), (2, CanId::sdo_response(node))] {
        let object = ObjectId::new(0x1200, sub);
        let Some(bytes) = session.read(object)? else {
            return Ok(Verdict::NotApplicable(WhyNot::NoObject(object)));
        };
        if number(&bytes) != u64::from(id.number()) {
            findings.push(Finding::at(object, Expected::Bytes(id.number().to_le_bytes().to_vec()), Seen::Bytes(bytes)));
        }
    }
    Ok(Verdict::of(findings))
}
