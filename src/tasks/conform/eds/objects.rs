//! Existence, size and access of the objects in the file.

use super::super::codes;
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::super::od::{counts_entries, entry, exists};
use super::super::sdo::{expect_abort, expedited_size};
use super::super::session::Session;
use super::super::settings::may_write;
use super::{MANDATORY, NO_FILE, entries, file, is_measuring, is_setting, starts_action};
use crate::canopen::frame::Frame;
use crate::canopen::object::ObjectId;
use crate::device::description::Access;
use crate::device::standard;
use crate::node::Error;
use std::collections::BTreeMap;

/// The abort codes for a missing object or sub-index, and the general one.
const MISSING: [u32; 3] = [0x0602_0000, 0x0609_0011, 0x0800_0000];

pub(super) fn exist(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let mut findings: Vec<Finding> = Vec::new();
    for object in entries(&eds).map(|entry| entry.object) {
        // The entries of a list that is not full may be missing.
        if counts_entries(object.index) && object.sub > 0 {
            continue;
        }
        let answer = entry(session, object)?;
        let code = answer.as_ref().and_then(abort_code);
        if answer.is_none() || code.is_some_and(|code| MISSING.contains(&code.0)) {
            let is_reported = |finding: &Finding| finding.object.is_some_and(|other| other.index == object.index);
            // One finding is enough if the whole object is missing.
            if code.is_none_or(|code| code.0 != MISSING[0]) || !findings.iter().any(is_reported) {
                findings.push(Finding::at(object, Expected::Exists, Seen::answer(answer, session.timeout())));
            }
        }
    }
    Ok(Verdict::of(findings))
}

/// The objects that are looked for: those of CiA 301, the TPDOs, those of CiA 404 if it applies, and the sub-index after
/// the last one of each object in the file.
fn candidates(session: &mut Session<'_, '_>, last: &BTreeMap<u16, u8>) -> Result<Vec<ObjectId>, Error> {
    let tpdos = (0x1800..0x1810).flat_map(|index| [ObjectId::new(index, 1), ObjectId::new(index + 0x200, 0)]);
    let mut candidates: Vec<ObjectId> = standard::single_objects().chain(tpdos).collect();
    if is_measuring(session)? {
        let of_profile = (0x6100..0x6200).map(|index| ObjectId::new(index, 1));
        candidates.extend(of_profile.filter(|object| standard::entry(*object).is_some()));
    }
    let is_list = |index: &u16| !counts_entries(*index);
    let next = last.iter().filter(|(index, sub)| is_list(index) && (1..254).contains(*sub));
    candidates.extend(next.map(|(index, sub)| ObjectId::new(*index, sub + 1)));
    Ok(candidates)
}

pub(super) fn are_listed(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let mut last: BTreeMap<u16, u8> = BTreeMap::new();
    for object in eds.dictionary.iter().map(|entry| entry.object) {
        last.insert(object.index, object.sub);
    }
    let mut findings = Vec::new();
    for object in candidates(session, &last)? {
        // EDS-02 checks the mandatory objects.
        if eds.dictionary.get(object).is_none() && !MANDATORY.contains(&object.index) {
            let answer = entry(session, object)?;
            if exists(answer.as_ref()) {
                findings.push(Finding::at(object, Expected::InFile, Seen::answer(answer, session.timeout())));
            }
        }
    }
    Ok(Verdict::of(findings))
}

/// The size that an answer to an initiate upload indicates.
fn indicated_size(frame: &Frame) -> Option<usize> {
    match frame.data() {
        [0x41, _, _, _, a, b, c, d] => usize::try_from(u32::from_le_bytes([*a, *b, *c, *d])).ok(),
        _ => expedited_size(frame),
    }
}

pub(super) fn have_sizes(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let mut findings = Vec::new();
    for described in entries(&eds).filter(|entry| entry.access.is_readable()) {
        let Some(width) = described.data_type.width() else { continue };
        let Some(answer) = entry(session, described.object)? else { continue };
        if indicated_size(&answer).is_some_and(|size| size != width) {
            findings.push(Finding::at(described.object, Expected::Size(width), Seen::Frame(answer)));
        }
    }
    Ok(Verdict::of(findings))
}

/// Objects whose write is checked by `SDO-03` and `OD-06`.
const CHECKED: [ObjectId; 3] = [ObjectId::DEVICE_TYPE, ObjectId::new(0x1001, 0), ObjectId::new(0x1018, 1)];

pub(super) fn read_only(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let mut findings = Vec::new();
    let is_fixed = |access: Access| matches!(access, Access::Ro | Access::Const);
    for entry in entries(&eds).filter(|entry| is_fixed(entry.access) && !CHECKED.contains(&entry.object)) {
        let object = entry.object;
        if entry.pdo || !may_write(object) || starts_action(object.index) {
            continue;
        }
        let Some(value) = session.read(object)?.filter(|value| (1..=4).contains(&value.len())) else { continue };
        // A description may call it writable. Other objects may change by themselves, and are not restored.
        if session.settings.before(object).is_some() {
            session.touch(object)?;
        }
        let answer = session.raw(session.download_request(object, &value))?;
        findings.extend(expect_abort(session, object, codes::READ_ONLY, answer));
    }
    Ok(Verdict::of(findings))
}

pub(super) fn write_only(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let (mut findings, mut is_any) = (Vec::new(), false);
    for object in entries(&eds).filter(|entry| entry.access == Access::Wo).map(|entry| entry.object) {
        is_any = true;
        let answer = entry(session, object)?;
        findings.extend(expect_abort(session, object, codes::WRITE_ONLY, answer));
    }
    if !is_any {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    }
    Ok(Verdict::of(findings))
}

pub(super) fn writable(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let mut findings = Vec::new();
    for entry in entries(&eds).filter(|entry| entry.access == Access::Rw) {
        let object = entry.object;
        let is_number = entry.data_type.width().is_some_and(|width| width <= 4);
        if !is_number || !is_setting(session, entry) {
            continue;
        }
        let Some(value) = session.read(object)? else { continue };
        // Other codes are allowed: the state of the device or another setting may lock the object.
        if let Some(code) = session.try_write(object, &value)?.filter(|code| code.0 == codes::READ_ONLY[0]) {
            findings.push(Finding::at(object, Expected::Acknowledged, Seen::Abort(code)));
        }
    }
    Ok(Verdict::of(findings))
}
