//! The rules for the mapping of a TPDO.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::super::session::Session;
use super::{NO_TPDO, Tpdo, prepare};
use crate::canopen::object::ObjectId;
use crate::device::description::Remap;
use crate::node::Error;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Pdo, id, sentence, clause, run)
}

const MAPPING: &str = "CiA 301, PDO mapping parameter";

pub(in super::super) const CASES: &[Case] = &[
    case("PDO-20", "The mapping cannot be changed while the TPDO is valid", MAPPING, locked)
        .matters(Low, "Masters receive TPDOs with a half-changed mapping."),
    case("PDO-21", "Entries cannot be changed while the number of entries is not 0", MAPPING, count_locks)
        .matters(Low, "Masters receive TPDOs with a half-changed mapping."),
    case("PDO-22", "A missing object cannot be mapped", MAPPING, missing_object)
        .matters(Medium, "A wrong mapping is not noticed."),
    case("PDO-23", "An object that is not mappable cannot be mapped", MAPPING, not_mappable)
        .matters(Low, "A wrong mapping is not noticed."),
    case("PDO-24", "An entry with a wrong length cannot be mapped", MAPPING, wrong_length)
        .matters(Medium, "All following values of the TPDO are decoded wrongly."),
    case("PDO-25", "More than 64 bits cannot be mapped", MAPPING, too_long)
        .matters(Medium, "Values at the end of the TPDO are missing."),
    case("PDO-26", "A number of entries above 64 is rejected", MAPPING, too_many)
        .matters(Low, "A wrong mapping is not noticed."),
    case("PDO-27", "The old mapping can be written again after a rejected one", MAPPING, again)
        .matters(High, "After a mistake the device must be restored to its factory settings."),
];

/// A TPDO with its mapping. The mapping is open for changes.
pub(in super::super) struct Open {
    pub(in super::super) tpdo: Tpdo,
    entries: Vec<u32>,
}

/// The mapping of the TPDO.
pub(in super::super) fn mapping(session: &mut Session<'_, '_>, tpdo: Tpdo) -> Result<Vec<u32>, Error> {
    let count = session.number(tpdo.mapping(0))?.unwrap_or(0);
    let mut entries = Vec::new();
    for sub in 1..=u8::try_from(count).unwrap_or(0) {
        entries.push(u32::try_from(session.number(tpdo.mapping(sub))?.unwrap_or(0)).unwrap_or(0));
    }
    Ok(entries)
}

/// Switches a TPDO off and sets its number of entries to 0. `None` if the mapping is fixed.
pub(in super::super) fn open(session: &mut Session<'_, '_>) -> Result<Result<Open, Verdict>, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(Err(NO_TPDO)) };
    let entries = mapping(session, tpdo)?;
    session.touch_mapping(tpdo.mapping(0))?;
    let off = tpdo.cob_id.switched_off().0.to_le_bytes();
    let is_off = session.try_write(tpdo.communication(1), &off)?.is_none();
    if !is_off && !is_count_only(session) || session.try_write(tpdo.mapping(0), &[0])?.is_some() {
        return Ok(Err(Verdict::NotApplicable(WhyNot::FixedMapping)));
    }
    Ok(Ok(Open { tpdo, entries }))
}

/// Whether the manual states that the mapping is changed without bit 31.
fn is_count_only(session: &Session<'_, '_>) -> bool {
    let description = session.node.model.as_ref().map(|model| &model.description);
    description.is_some_and(|description| description.pdo.remap == Remap::CountOnly)
}

/// The device must reject one of the writes: an entry, or the number of entries after it.
fn refuses(session: &mut Session<'_, '_>, open: &Open, entries: &[u32]) -> Result<Verdict, Error> {
    for (sub, entry) in (1..).zip(entries) {
        let object = open.tpdo.mapping(sub);
        let answer = session.download(object, &entry.to_le_bytes())?;
        match answer {
            Some(frame) if abort_code(&frame).is_some() => return Ok(Verdict::Pass),
            Some(_) => {}
            None => {
                let seen = Seen::Nothing(session.timeout());
                return Ok(Verdict::of([Finding::at(object, Expected::Refused, seen)]));
            }
        }
    }
    let object = open.tpdo.mapping(0);
    let count = u8::try_from(entries.len()).unwrap_or(u8::MAX);
    let answer = session.download(object, &[count])?;
    let is_refused = answer.as_ref().and_then(abort_code).is_some();
    let finding = || Finding::at(object, Expected::Refused, Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_refused).then(finding)))
}

/// A case with an open mapping.
fn with_open(
    session: &mut Session<'_, '_>,
    entries: impl FnOnce(&mut Session<'_, '_>, &Open) -> Result<Option<Vec<u32>>, Error>,
) -> Result<Verdict, Error> {
    let open = match open(session)? {
        Ok(open) => open,
        Err(verdict) => return Ok(verdict),
    };
    match entries(session, &open)? {
        Some(entries) => refuses(session, &open, &entries),
        None => Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject)),
    }
}

fn locked(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Err(verdict) = open(session)? {
        return Ok(verdict);
    }
    // Back to the valid TPDO.
    session.restore()?;
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    session.touch_mapping(tpdo.mapping(0))?;
    let object = tpdo.mapping(0);
    let answer = session.download(object, &[0])?;
    let is_refused = answer.as_ref().and_then(abort_code).is_some();
    let finding = || Finding::at(object, Expected::Refused, Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_refused).then(finding)))
}

fn count_locks(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let open = match open(session)? {
        Ok(open) => open,
        Err(verdict) => return Ok(verdict),
    };
    let count = u8::try_from(open.entries.len()).unwrap_or(0);
    if session.try_write(open.tpdo.mapping(0), &[count])?.is_some() {
        return Ok(Verdict::not_judged(WhyNot::NotWritable(open.tpdo.mapping(0))));
    }
    let object = open.tpdo.mapping(1);
    let Some(first) = open.entries.first() else { return Ok(NO_TPDO) };
    let answer = session.download(object, &first.to_le_bytes())?;
    let is_refused = answer.as_ref().and_then(abort_code).is_some();
    let finding = || Finding::at(object, Expected::Refused, Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_refused).then(finding)))
}

fn missing_object(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    with_open(session, |_, _| Ok(Some(vec![0x1004_0020])))
}

fn not_mappable(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    // The number of entries of the identity is never mappable.
    with_open(session, |session, _| Ok(session.number(ObjectId::new(0x1018, 0))?.map(|_| vec![0x1018_0008])))
}

fn wrong_length(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    with_open(session, |_, open| Ok(open.entries.first().map(|entry| vec![entry & !0xff | 0x30])))
}

fn too_long(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    with_open(session, |_, open| {
        let Some(widest) = open.entries.iter().max_by_key(|entry| *entry & 0xff).copied() else { return Ok(None) };
        let bits = usize::try_from(widest & 0xff).unwrap_or(0).max(1);
        Ok(Some(vec![widest; 64 / bits + 1]))
    })
}

fn too_many(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let open = match open(session)? {
        Ok(open) => open,
        Err(verdict) => return Ok(verdict),
    };
    let object = open.tpdo.mapping(0);
    let answer = session.download(object, &[65])?;
    let is_refused = answer.as_ref().and_then(abort_code).is_some();
    let finding = || Finding::at(object, Expected::Refused, Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_refused).then(finding)))
}

fn again(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let open = match open(session)? {
        Ok(open) => open,
        Err(verdict) => return Ok(verdict),
    };
    session.download(open.tpdo.mapping(1), &0x1004_0020u32.to_le_bytes())?;
    session.try_write(open.tpdo.mapping(0), &[0])?;
    let entries: Vec<(u8, u32)> = (1..).zip(open.entries.iter().copied()).collect();
    for (sub, entry) in entries {
        let object = open.tpdo.mapping(sub);
        if let Some(code) = session.try_write(object, &entry.to_le_bytes())? {
            return Ok(Verdict::of([Finding::at(object, Expected::Acknowledged, Seen::Abort(code))]));
        }
    }
    let object = open.tpdo.mapping(0);
    let count = u8::try_from(open.entries.len()).unwrap_or(0);
    let code = session.try_write(object, &[count])?;
    Ok(Verdict::of(code.map(|code| Finding::at(object, Expected::Acknowledged, Seen::Abort(code)))))
}
