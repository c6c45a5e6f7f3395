//! Which objects can be mapped to a TPDO.

use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::pdo::mapping::{Open, open};
use super::super::session::Session;
use super::{NO_FILE, entries, file};
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::device::dictionary::Entry;
use crate::node::Error;

/// The mapping entry of an object; `None` if its type has no fixed size, or no TPDO has room for it.
fn mapping_entry(entry: &Entry) -> Option<u32> {
    let bits = entry.data_type.width().and_then(|width| u8::try_from(8 * width).ok()).filter(|bits| *bits <= 64)?;
    let [index, sub] = [u32::from(entry.object.index), u32::from(entry.object.sub)];
    Some(index << 16 | sub << 8 | u32::from(bits))
}

/// Maps only this object. Returns the abort code if the device rejects it. The mapping is then open again.
fn map(session: &mut Session<'_, '_>, open: &Open, entry: u32) -> Result<Option<AbortCode>, Error> {
    let rejected = match session.try_write(open.tpdo.mapping(1), &entry.to_le_bytes())? {
        Some(code) => Some(code),
        None => session.try_write(open.tpdo.mapping(0), &[1])?,
    };
    session.try_write(open.tpdo.mapping(0), &[0])?;
    Ok(rejected)
}

/// Maps each of these objects. Returns those that the device treats differently from the file.
fn map_each(
    session: &mut Session<'_, '_>,
    objects: &[(ObjectId, u32)],
    finding: impl Fn(ObjectId, Option<AbortCode>) -> Option<Finding>,
) -> Result<Verdict, Error> {
    if objects.is_empty() {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    }
    let open = match open(session)? {
        Ok(open) => open,
        Err(verdict) => return Ok(verdict),
    };
    let mut findings = Vec::new();
    for (object, entry) in objects {
        findings.extend(finding(*object, map(session, &open, *entry)?));
    }
    Ok(Verdict::of(findings))
}

pub(super) fn mappable(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    // A writable object may be mappable to an RPDO only.
    let wanted = entries(&eds).filter(|entry| entry.pdo && entry.access.is_readable() && !entry.access.is_writable());
    let objects: Vec<(ObjectId, u32)> =
        wanted.filter_map(|entry| Some((entry.object, mapping_entry(entry)?))).collect();
    map_each(session, &objects, |object, rejected| {
        rejected.map(|code| Finding::at(object, Expected::Mapped, Seen::Abort(code)))
    })
}

pub(super) fn not_mappable(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    // PDO-23 checks 1018h:0.
    let is_checked = |object: ObjectId| object == ObjectId::new(0x1018, 0);
    let wanted = entries(&eds).filter(|entry| !entry.pdo && !is_checked(entry.object));
    let objects: Vec<(ObjectId, u32)> =
        wanted.filter_map(|entry| Some((entry.object, mapping_entry(entry)?))).collect();
    map_each(session, &objects, |object, rejected| {
        rejected.is_none().then(|| Finding::at(object, Expected::Refused, Seen::Acknowledged))
    })
}
