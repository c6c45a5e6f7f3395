//! Parameters of a TPDO that cannot be changed while it is valid.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::codes;
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::super::sdo::expect_abort;
use super::super::session::{Session, number};
use super::{NO_TPDO, PARAMETERS, Tpdo, prepare};
use crate::canopen::pdo::CobId;
use crate::node::Error;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Pdo, id, sentence, clause, run)
}

pub(in super::super) const CASES: &[Case] = &[
    case(
        "PDO-30",
        "The inhibit time cannot be changed while the TPDO is valid",
        "CiA 301, inhibit time",
        inhibit_locked,
    )
    .matters(Low, "A change at run time has undefined effects."),
    case("PDO-31", "The CAN-ID cannot be changed while the TPDO is valid", PARAMETERS, cob_id_locked)
        .matters(Low, "A change at run time has undefined effects."),
    case("PDO-32", "A restricted CAN-ID is rejected", "CiA 301, restricted CAN-IDs", restricted)
        .matters(Medium, "A wrong setting lets the device disturb SDO or NMT of other nodes."),
];

fn inhibit_locked(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    let object = tpdo.communication(3);
    let Some(old) = session.read(object)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(object))) };
    let new = u16::try_from(number(&old)).unwrap_or(0) ^ 0x40;
    let answer = session.download(object, &new.to_le_bytes())?;
    let is_refused = answer.as_ref().and_then(abort_code).is_some();
    let finding = || Finding::at(object, Expected::Refused, Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_refused).then(finding)))
}

/// A free CAN-ID for a TPDO.
const OTHER_ID: u32 = 0x1f0;

/// A COB-ID with another CAN-ID.
pub(super) fn other_id(tpdo: Tpdo) -> CobId {
    let id = if tpdo.cob_id.0 & 0x7ff == OTHER_ID { OTHER_ID + 1 } else { OTHER_ID };
    tpdo.cob_id.with_standard(id).unwrap_or(tpdo.cob_id)
}

fn cob_id_locked(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    let object = tpdo.communication(1);
    let answer = session.download(object, &other_id(tpdo).0.to_le_bytes())?;
    let is_refused = answer.as_ref().and_then(abort_code).is_some();
    let finding = || Finding::at(object, Expected::Refused, Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_refused).then(finding)))
}

/// SDO, NMT error control and NMT.
const RESTRICTED: [u32; 3] = [0x0000_0601, 0x0000_0701, 0x0000_0001];

fn restricted(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    let object = tpdo.communication(1);
    if session.try_write(object, &tpdo.cob_id.switched_off().0.to_le_bytes())?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
    }
    let mut findings = Vec::new();
    for id in RESTRICTED {
        let word = tpdo.cob_id.with_standard(id).unwrap_or(tpdo.cob_id);
        let answer = session.download(object, &word.0.to_le_bytes())?;
        findings.extend(expect_abort(session, object, codes::VALUE, answer));
        session.try_write(object, &tpdo.cob_id.switched_off().0.to_le_bytes())?;
    }
    Ok(Verdict::of(findings))
}
