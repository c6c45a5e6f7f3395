//! Emergencies, the error register and the error history.

use super::case::{Area, Case, Run, Severity::*};
use super::codes;
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::sdo::expect_abort;
use super::session::{Session, number};
use super::settings::ERROR_COUNT;
use crate::bus::Received;
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::object::ObjectId;
use crate::node::Error;
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Emcy, id, sentence, clause, run)
}

pub(super) const CASES: &[Case] = &[
    case("EMC-01", "1014h contains 80h + node-ID unless it was changed", "CiA 301, object 1014h", cob_id)
        .matters(Medium, "Masters do not recognise the emergencies."),
    case("EMC-02", "1003h:0 is the number of entries that can be read", "CiA 301, object 1003h", history)
        .matters(Medium, "Past errors are not shown."),
    case("EMC-03", "1003h:0 rejects other numbers than 0", "CiA 301, object 1003h", not_zero)
        .matters(Low, "A wrong write deletes the error history."),
    case("EMC-04", "If an error is pending, 1001h is not 0", "CiA 301, object 1001h", register)
        .matters(Medium, "Masters do not notice the error."),
    case(
        "EMC-05",
        "An emergency has eight bytes, and its error register is equal to 1001h",
        "CiA 301, EMCY protocol",
        emergency,
    )
    .matters(High, "Masters decode the emergency wrongly.")
    .alone(),
    case("EMC-06", "An emergency is the first entry of 1003h", "CiA 301, object 1003h", recorded)
        .matters(Medium, "The error cannot be found out later.")
        .alone(),
    case("EMC-07", "The end of the error is reported with code 0000h", "CiA 301, EMCY protocol", ended)
        .matters(Medium, "Masters show an error that is over.")
        .alone(),
];

const ERROR_REGISTER: ObjectId = ObjectId::new(0x1001, 0);
const COB_ID: ObjectId = ObjectId::new(0x1014, 0);

fn cob_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(value) = session.read(COB_ID)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(COB_ID))) };
    let usual = 0x80 + u64::from(session.node.id.get());
    let word = number(&value);
    // OD-09 reports a restricted CAN-ID.
    if u16::try_from(word & 0x7ff).ok().and_then(CanId::standard).is_some_and(CanId::is_restricted) {
        return Ok(Verdict::not_judged(WhyNot::NotWritable(COB_ID)));
    }
    // A COB-ID that can be written may have been changed on purpose.
    let is_changeable = word & 0x7ff != usual && session.try_write(COB_ID, &value)?.is_none();
    let is_wrong = word & 0x7ff != usual && !is_changeable;
    let finding = || Finding::at(COB_ID, Expected::Number(usual), Seen::Number(word));
    Ok(Verdict::of(is_wrong.then(finding)))
}

fn history(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(count) = session.number(ERROR_COUNT)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(ERROR_COUNT)));
    };
    if count == 0 {
        return Ok(Verdict::NotApplicable(WhyNot::NoError));
    }
    let mut findings = Vec::new();
    for sub in 1..=u8::try_from(count.min(254)).unwrap_or(254) {
        let object = ERROR_COUNT.with_sub(sub);
        if session.number(object)?.is_none_or(|entry| entry == 0) {
            findings.push(Finding::at(object, Expected::Answer, Seen::Bytes(Vec::new())));
        }
    }
    Ok(Verdict::of(findings))
}

fn not_zero(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(count) = session.number(ERROR_COUNT)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(ERROR_COUNT)));
    };
    if count != 0 {
        return Ok(Verdict::not_judged(WhyNot::ErrorHistory));
    }
    session.touch(ERROR_COUNT)?;
    let answer = session.download(ERROR_COUNT, &[5])?;
    let read_only = answer
        .as_ref()
        .and_then(super::finding::abort_code)
        .is_some_and(|code| codes::READ_ONLY[..2].contains(&code.0));
    if read_only {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(ERROR_COUNT)));
    }
    Ok(Verdict::of(expect_abort(session, ERROR_COUNT, codes::VALUE, answer)))
}

fn register(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if provoke(session)?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoError));
    }
    let Some(register) = session.number(ERROR_REGISTER)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(ERROR_REGISTER)));
    };
    Ok(Verdict::of((register == 0).then(|| Finding::at(ERROR_REGISTER, Expected::Range(1, 255), Seen::Number(0)))))
}

/// How long an emergency may take.
const EMERGENCY: Duration = Duration::from_millis(200);

/// Sends a SYNC of eight bytes, which causes emergency 8240h on devices that know it. Returns the emergency.
fn provoke(session: &mut Session<'_, '_>) -> Result<Option<Received>, Error> {
    if session.node.sync_overflow.is_some() || !session.may_cause_error()? {
        return Ok(None);
    }
    session.wrong_sync = true;
    if let Ok(frame) = Frame::new(session.node.sync, &[0; 8]) {
        session.master.send(frame);
    }
    let id = session.node.emergency;
    Ok(session.collect(EMERGENCY)?.into_iter().find(|received| received.frame.id() == id))
}

fn emergency(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(received) = provoke(session)? else { return Ok(Verdict::NotApplicable(WhyNot::NoError)) };
    let data = received.frame.data();
    if data.len() != 8 {
        return Ok(Verdict::of([Finding::new(Expected::EightBytes, Seen::Frame(received.frame))]));
    }
    let sent = u64::from(data[2]);
    let register = session.number(ERROR_REGISTER)?.unwrap_or(0);
    let finding = || Finding::at(ERROR_REGISTER, Expected::Number(sent), Seen::Number(register));
    // EMC-04 reports a register without any bit, and OD-02 a wrong bit 0.
    Ok(Verdict::of((register != 0 && (register ^ sent) & !1 != 0).then(finding)))
}

fn recorded(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(received) = provoke(session)? else { return Ok(Verdict::NotApplicable(WhyNot::NoError)) };
    let first = ERROR_COUNT.with_sub(1);
    let (Some(entry), Some(emergency)) = (session.number(first)?, Emergency::parse(&received.frame)) else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(first)));
    };
    let layout = session.node.model.as_ref().map(|model| model.description.error_history).unwrap_or_default();
    let (code, _) = layout.read(u32::try_from(entry).unwrap_or(0));
    let finding = || Finding::at(first, Expected::Number(emergency.code.into()), Seen::Number(code.into()));
    Ok(Verdict::of((code != emergency.code).then(finding)))
}

fn ended(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if provoke(session)?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoError));
    }
    session.master.send(Frame::empty(session.node.sync));
    let id = session.node.emergency;
    let frames = session.collect(EMERGENCY)?;
    let is_end = |received: &Received| {
        received.frame.id() == id && Emergency::parse(&received.frame).is_some_and(|emergency| emergency.code == 0)
    };
    let finding = || Finding::new(Expected::NoError, Seen::Nothing(EMERGENCY));
    Ok(Verdict::of((!frames.iter().any(is_end)).then(finding)))
}
