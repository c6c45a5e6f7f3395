//! Compares sub-index 255 of objects (the object code and the data type) with the EDS file.

use super::super::finding::{Expected, Finding, Seen, Verdict};
use super::super::session::Session;
use super::{NO_FILE, file};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::node::Error;
use std::collections::BTreeMap;

/// Object codes.
const DOMAIN: u64 = 2;
const VAR: u64 = 7;
const ARRAY: u64 = 8;
const RECORD: u64 = 9;

const STRUCTURE: u8 = 255;

pub(super) fn types(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let mut objects: BTreeMap<u16, Vec<(u8, Option<DataType>)>> = BTreeMap::new();
    for entry in eds.dictionary.iter() {
        let data_type = (!eds.untyped.contains(&entry.object)).then_some(entry.data_type);
        objects.entry(entry.object.index).or_default().push((entry.object.sub, data_type));
    }
    let mut findings = Vec::new();
    for (index, subs) in objects {
        let object = ObjectId::new(index, STRUCTURE);
        let Some(found) = session.read(object)?.filter(|bytes| bytes.len() == 4) else { continue };
        // SDO-05 reports a device that ignores the sub-index.
        if session.read(object.with_sub(0))?.is_some_and(|value| value == found) {
            continue;
        }
        findings.extend(wrong_part(object, &subs, &found));
    }
    Ok(Verdict::of(findings))
}

/// Returns a finding if the object code or the data type differs from the file.
fn wrong_part(object: ObjectId, subs: &[(u8, Option<DataType>)], found: &[u8]) -> Option<Finding> {
    let (code, type_code) = (u64::from(found[0]), u16::from(found[1]));
    let is_variable = matches!(subs, [(0, _)]);
    // A file can describe an array or a record without its elements.
    if is_variable && (ARRAY..=RECORD).contains(&code) {
        return None;
    }
    let (low, high) = if is_variable { (DOMAIN, VAR) } else { (ARRAY, RECORD) };
    if !(low..=high).contains(&code) {
        return Some(Finding::at(object, Expected::Range(low, high), Seen::Number(code)));
    }
    // A record has a complex data type, which the file does not contain.
    let &(_, Some(expected)) =
        subs.iter().find(|(sub, _)| is_variable || code == ARRAY && (1..STRUCTURE).contains(sub))?
    else {
        return None;
    };
    let shown = DataType::from_code(type_code);
    let seen = || shown.map_or(Seen::Number(type_code.into()), Seen::Type);
    (shown != Some(expected)).then(|| Finding::at(object, Expected::Type(expected), seen()))
}
