//! The values in the file: identity, and defaults.

use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::super::settings::may_write;
use super::super::store::{RESTORE_ALL, STORE_ALL};
use super::{NO_FILE, entries, file, starts_action};
use crate::canopen::nmt::NmtCommand;
use crate::canopen::object::ObjectId;
use crate::device::dictionary::Entry;
use crate::node::Error;

pub(super) fn defaults_within_limits(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let finding = |entry: &Entry| {
        let default = entry.default.as_ref()?;
        let number = default.as_f64()?;
        let is_below = entry.low.as_ref().and_then(|low| low.as_f64()).is_some_and(|low| number < low);
        let is_above = entry.high.as_ref().and_then(|high| high.as_f64()).is_some_and(|high| number > high);
        let expected = Expected::Limits(entry.low.clone(), entry.high.clone());
        (is_below || is_above).then(|| Finding::at(entry.object, expected, Seen::Value(default.clone())))
    };
    Ok(Verdict::of(entries(&eds).filter_map(finding)))
}

pub(super) fn device_info(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let info = &eds.info;
    let mut findings = Vec::new();
    for (sub, wanted) in [(1, info.vendor_number), (2, info.product_number), (3, info.revision_number)] {
        let object = ObjectId::new(0x1018, sub);
        let (Some(wanted), Some(found)) = (wanted.filter(|number| *number != 0), session.number(object)?) else {
            continue;
        };
        if found != 0 && found != u64::from(wanted) {
            findings.push(Finding::at(object, Expected::Number(wanted.into()), Seen::Number(found)));
        }
    }
    Ok(Verdict::of(findings))
}

/// A value without the zeros that a device may add to a short text.
fn trimmed(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    &bytes[..end]
}

/// The objects that are the same in all devices of a kind. The serial number (1018h:4) is not.
const IDENTITY: [(u16, u8); 6] = [(0x1000, 0), (0x1008, 0), (0x1018, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3)];

pub(super) fn identity(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let mut findings = Vec::new();
    for object in IDENTITY.map(|(index, sub)| ObjectId::new(index, sub)) {
        let default = eds.dictionary.get(object).and_then(|entry| entry.default_bytes(session.node.id));
        // 0 stands for a number that differs between versions.
        let Some(wanted) = default.filter(|bytes| !trimmed(bytes).is_empty()) else { continue };
        let Some(found) = session.read(object)? else { continue };
        if trimmed(&found) != trimmed(&wanted) {
            findings.push(Finding::at(object, Expected::Bytes(wanted), Seen::Bytes(found)));
        }
    }
    Ok(Verdict::of(findings))
}

/// The sub-indices of 1010h and 1011h for the settings that are compared. "All" resets COB-IDs on some devices, and may
/// change the node-ID. `None` if the device cannot store or restore them.
fn groups(session: &mut Session<'_, '_>) -> Result<Option<Vec<u8>>, Error> {
    let mut supported = Vec::new();
    for sub in 1..=3 {
        let mut has = true;
        for object in [STORE_ALL.with_sub(sub), RESTORE_ALL.with_sub(sub)] {
            has = has && session.number(object)?.is_some_and(|word| word & 1 == 1);
        }
        if has {
            supported.push(sub);
        }
    }
    Ok(match supported.as_slice() {
        [.., 2, 3] => Some(vec![2, 3]),
        [1, ..] => Some(vec![1]),
        _ => None,
    })
}

pub(super) fn restored(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let Some(groups) = groups(session)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(RESTORE_ALL))) };
    session.settings.all_changed();
    for sub in groups {
        session.stored.push(STORE_ALL.with_sub(sub));
        let object = RESTORE_ALL.with_sub(sub);
        if !session.sign(object, b"load")? {
            let seen = Seen::Bytes(b"load".to_vec());
            return Ok(Verdict::of([Finding::at(object, Expected::Acknowledged, seen)]));
        }
    }
    session.reset(NmtCommand::ResetNode)?;
    let mut findings = Vec::new();
    let is_setting = |entry: &&Entry| {
        entry.access.is_writable() && may_write(entry.object) && !entry.pdo && !starts_action(entry.object.index)
    };
    for entry in entries(&eds).filter(is_setting) {
        let Some(wanted) = entry.default_bytes(session.node.id) else { continue };
        let Some(found) = session.read(entry.object)? else { continue };
        if found != wanted {
            findings.push(Finding::at(entry.object, Expected::Bytes(wanted), Seen::Bytes(found)));
        }
    }
    Ok(Verdict::of(findings))
}
