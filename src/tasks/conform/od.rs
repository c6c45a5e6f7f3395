//! The mandatory objects, and the rules for all objects.

use super::case::{Area, Case, Run, Severity::*};
use super::codes;
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::sdo::expect_abort;
use super::session::{Session, number};
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::object::ObjectId;
use crate::node::Error;
use std::collections::BTreeMap;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Od, id, sentence, clause, run)
}

pub(super) const CASES: &[Case] = &[
    case(
        "OD-01",
        "1000h, 1001h, 1018h:0 and 1018h:1 can be read and have their sizes",
        "CiA 301, mandatory objects",
        mandatory,
    )
    .matters(High, "Masters do not recognise the device."),
    case("OD-02", "Bit 0 of 1001h is set if any other bit is set", "CiA 301, object 1001h", error_register)
        .matters(Medium, "Masters that check only bit 0 do not notice the error."),
    case("OD-03", "1018h:0 is 1 to 4, and the sub-indices up to it can be read", "CiA 301, object 1018h", identity)
        .matters(Medium, "Masters cannot distinguish this device from others; LSS needs all four numbers."),
    case("OD-04", "The vendor-ID (1018h:1) is not 0", "CiA 301, object 1018h", vendor)
        .matters(Medium, "The maker of the device is unknown to tools."),
    case(
        "OD-05",
        "Sub-index 0 contains the highest sub-index of its object",
        "CiA 301, sub-index 0",
        highest_sub_index,
    )
    .matters(Low, "Tools that read the object dictionary miss entries, or report errors."),
    case("OD-06", "1001h and 1018h:1 reject a write", "CiA 301, objects 1001h and 1018h", read_only)
        .matters(Medium, "A wrong write changes the identity or hides an error."),
    case("OD-07", "1008h, 1009h and 100Ah are printable texts", "CiA 301, object 1008h", texts)
        .matters(Low, "Tools show unreadable characters."),
    case("OD-08", "1000h, 1008h and 1018h have the same values in each read", "CiA 301, constant objects", constants)
        .matters(High, "Masters confuse the device with another one."),
    case("OD-09", "1005h, 1012h and 1014h contain allowed CAN-IDs", "CiA 301, restricted CAN-IDs", cob_ids)
        .matters(High, "SYNC or emergencies disturb other services."),
    case("OD-10", "1005h, 1012h and 1014h reject restricted CAN-IDs", "CiA 301, restricted CAN-IDs", restricted)
        .matters(Medium, "A wrong setting lets the device disturb SDO or NMT of other nodes."),
];

const IDENTITY: ObjectId = ObjectId::new(0x1018, 0);
const ERROR_REGISTER: ObjectId = ObjectId::new(0x1001, 0);

fn mandatory(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let objects = [(ObjectId::DEVICE_TYPE, 4), (ERROR_REGISTER, 1), (IDENTITY, 1), (IDENTITY.with_sub(1), 4)];
    let mut findings = Vec::new();
    for (object, size) in objects {
        match session.read(object)? {
            None => findings.push(Finding::at(object, Expected::Answer, Seen::Bytes(Vec::new()))),
            Some(bytes) if bytes.len() != size => {
                findings.push(Finding::at(object, Expected::Size(size), Seen::Bytes(bytes)));
            }
            Some(_) => {}
        }
    }
    Ok(Verdict::of(findings))
}

fn error_register(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(register) = session.number(ERROR_REGISTER)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(ERROR_REGISTER)));
    };
    let is_wrong = register != 0 && register & 1 == 0;
    Ok(Verdict::of(is_wrong.then(|| Finding::at(ERROR_REGISTER, Expected::GenericErrorBit, Seen::Number(register)))))
}

fn identity(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(count) = session.number(IDENTITY)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(IDENTITY)));
    };
    if !(1..=4).contains(&count) {
        return Ok(Verdict::of([Finding::at(IDENTITY, Expected::Range(1, 4), Seen::Number(count))]));
    }
    let mut findings = Vec::new();
    for sub in 1..=u8::try_from(count).unwrap_or(4) {
        let object = IDENTITY.with_sub(sub);
        match session.read(object)? {
            Some(bytes) if bytes.len() == 4 => {}
            found => findings.push(Finding::at(object, Expected::Size(4), Seen::Bytes(found.unwrap_or_default()))),
        }
    }
    Ok(Verdict::of(findings))
}

fn vendor(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let object = IDENTITY.with_sub(1);
    let Some(vendor) = session.number(object)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(object))) };
    let finding = || Finding::at(object, Expected::Range(1, u32::MAX.into()), Seen::Number(0));
    Ok(Verdict::of((vendor == 0).then(finding)))
}

/// Objects whose sub-index 0 is not the highest sub-index, but a number of valid entries.
pub(super) fn counts_entries(index: u16) -> bool {
    index == 0x1003 || (0x1600..=0x17ff).contains(&index) || (0x1a00..=0x1bff).contains(&index)
}

fn highest_sub_index(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    // Index, and the highest sub-index that the description or EDS states.
    let mut highest: BTreeMap<u16, u8> = [0x1010, 0x1011, 0x1018, 0x1200, 0x1800].map(|index| (index, 0)).into();
    if let Some(model) = session.node.model.clone() {
        for object in model.dictionary.iter().map(|entry| entry.object).filter(|object| object.sub > 0) {
            let entry = highest.entry(object.index).or_default();
            *entry = (*entry).max(object.sub);
        }
    }
    let mut findings = Vec::new();
    for (index, described) in highest.into_iter().filter(|(index, _)| !counts_entries(*index)) {
        let object = ObjectId::new(index, 0);
        let Some(found) = session.number(object)?.and_then(|count| u8::try_from(count).ok()).filter(|count| *count > 0)
        else {
            continue;
        };
        let last = object.with_sub(found);
        let answer = entry(session, last)?;
        if !exists(answer.as_ref()) {
            findings.push(Finding::at(last, Expected::Entry, Seen::answer(answer, session.timeout())));
        }
        for sub in [found.saturating_add(1), described] {
            if sub > found && sub < 255 && exists(entry(session, object.with_sub(sub))?.as_ref()) {
                findings.push(Finding::at(object, Expected::Range(sub.into(), 254), Seen::Number(found.into())));
                break;
            }
        }
    }
    Ok(Verdict::of(findings))
}

/// The answer to a read of an entry.
pub(super) fn entry(session: &mut Session<'_, '_>, object: ObjectId) -> Result<Option<Frame>, Error> {
    let answer = session.upload(object)?;
    session.end_transfer_of(answer.as_ref())?;
    Ok(answer)
}

/// Whether an entry exists: the device answers, or rejects a read because the entry is write-only.
pub(super) fn exists(answer: Option<&Frame>) -> bool {
    let code = answer.and_then(abort_code);
    answer.is_some() && code.is_none_or(|code| codes::WRITE_ONLY[..2].contains(&code.0))
}

fn read_only(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let mut findings = Vec::new();
    for object in [ERROR_REGISTER, IDENTITY.with_sub(1)] {
        let Some(value) = session.read(object)? else { continue };
        let answer = session.download(object, &value)?;
        findings.extend(expect_abort(session, object, codes::READ_ONLY, answer));
    }
    Ok(Verdict::of(findings))
}

fn texts(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let (mut findings, mut is_any) = (Vec::new(), false);
    for index in [0x1008, 0x1009, 0x100a] {
        let object = ObjectId::new(index, 0);
        let Some(bytes) = session.read(object)? else { continue };
        is_any = true;
        // A short text without an indicated size is filled with zeros.
        let end = bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
        if !bytes[..end].iter().all(|byte| (0x20..0x7f).contains(byte)) {
            findings.push(Finding::at(object, Expected::Text, Seen::Bytes(bytes)));
        }
    }
    if !is_any {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(ObjectId::new(0x1008, 0))));
    }
    Ok(Verdict::of(findings))
}

/// The reads of each object in `OD-08`.
const REPEATS: usize = 3;

fn constants(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let identity = (1..=4).map(|sub| IDENTITY.with_sub(sub));
    let objects = [ObjectId::DEVICE_TYPE, ObjectId::new(0x1008, 0)].into_iter().chain(identity);
    let mut findings = Vec::new();
    for object in objects {
        let first = session.read(object)?;
        for _ in 1..REPEATS {
            let next = session.read(object)?;
            if next != first {
                let (first, next) = (first.unwrap_or_default(), next.unwrap_or_default());
                findings.push(Finding::at(object, Expected::Bytes(first), Seen::Bytes(next)));
                break;
            }
        }
    }
    Ok(Verdict::of(findings))
}

const COB_IDS: [ObjectId; 3] = [ObjectId::new(0x1005, 0), ObjectId::new(0x1012, 0), ObjectId::new(0x1014, 0)];

fn cob_ids(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let (mut findings, mut is_any) = (Vec::new(), false);
    for object in COB_IDS {
        let Some(value) = session.read(object)? else { continue };
        is_any = true;
        let word = number(&value);
        let id = u16::try_from(word & 0x7ff).ok().and_then(CanId::standard);
        let is_valid = object.index == 0x1005 || word & 0x8000_0000 == 0;
        let is_extended = word & 0x2000_0000 != 0;
        if is_valid && !is_extended && id.is_some_and(CanId::is_restricted) {
            findings.push(Finding::at(object, Expected::OtherCanId, Seen::Bytes(value)));
        }
    }
    if !is_any {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(COB_IDS[0])));
    }
    Ok(Verdict::of(findings))
}

/// COB-IDs that CiA 301 reserves: SDO of a node, error control of a node.
const RESTRICTED: [u32; 2] = [0x0000_0601, 0x0000_0701];

fn restricted(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let (mut findings, mut is_any) = (Vec::new(), false);
    for object in COB_IDS {
        let Some(value) = session.read(object)? else { continue };
        if session.try_write(object, &value)?.is_some() {
            continue;
        }
        is_any = true;
        for id in RESTRICTED {
            let answer = session.download(object, &id.to_le_bytes())?;
            findings.extend(expect_abort(session, object, codes::VALUE, answer));
        }
    }
    if !is_any {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(COB_IDS[0])));
    }
    Ok(Verdict::of(findings))
}
