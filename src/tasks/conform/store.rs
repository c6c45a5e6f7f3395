//! Storing settings (1010h) and restoring factory defaults (1011h).

use super::case::{Area, Case, Run, Severity::*};
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::sdo::expect_abort;
use super::session::Session;
use crate::canopen::nmt::NmtCommand;
use crate::canopen::object::ObjectId;
use crate::master::lss::STORE_TIMEOUT;
use crate::master::{SdoError, SdoFailure};
use crate::node::state::HEARTBEAT_TIME;
use crate::node::write::write_with;
use crate::node::{Error, WriteOptions};

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Store, id, sentence, clause, run)
}

const STORE: &str = "CiA 301, object 1010h";
const RESTORE: &str = "CiA 301, object 1011h";

pub(super) const CASES: &[Case] = &[
    case("STO-01", "1010h shows whether the device stores on command, and its reserved bits are 0", STORE, capability)
        .matters(Low, "Tools do not know whether settings can be stored."),
    case("STO-02", "1011h shows whether the device restores, and its reserved bits are 0", RESTORE, restore_capability)
        .matters(Low, "Tools do not know whether factory defaults can be restored."),
    case("STO-03", "1010h rejects a wrong signature", STORE, wrong_save)
        .matters(High, "A write by mistake stores temporary settings.")
        .stores(),
    case("STO-04", "A stored value is kept over a reset", STORE, kept)
        .matters(High, "Settings are lost at power off.")
        .stores(),
    case("STO-05", "1011h rejects a wrong signature", RESTORE, wrong_load)
        .matters(High, "A write by mistake deletes all settings.")
        .stores(),
    case("STO-06", "After a restore the settings are unchanged until the next reset", RESTORE, later)
        .matters(Medium, "The communication changes while the device is in use.")
        .stores(),
    case("STO-07", "After a restore and a reset a setting has its default", RESTORE, defaults)
        .matters(High, "Factory defaults cannot be restored.")
        .stores(),
];

pub(super) const STORE_ALL: ObjectId = ObjectId::new(0x1010, 1);
pub(super) const RESTORE_ALL: ObjectId = ObjectId::new(0x1011, 1);

/// The value of each sub-index of 1010h or 1011h.
fn bits(session: &mut Session<'_, '_>, index: u16, reserved: u64) -> Result<Verdict, Error> {
    let count = ObjectId::new(index, 0);
    let Some(highest) = session.number(count)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(count))) };
    let mut findings = Vec::new();
    for sub in 1..=u8::try_from(highest.min(127)).unwrap_or(127) {
        let object = count.with_sub(sub);
        if let Some(word) = session.number(object)?.filter(|word| word & reserved != 0) {
            findings.push(Finding::at(object, Expected::Range(0, !reserved & 0xffff_ffff), Seen::Number(word)));
        }
    }
    Ok(Verdict::of(findings))
}

fn capability(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    bits(session, 0x1010, 0xffff_fffc)
}

fn restore_capability(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    bits(session, 0x1011, 0xffff_fffe)
}

/// The sub-index of the communication parameters, else of all parameters. "Save all" resets COB-IDs on some devices.
fn group(session: &mut Session<'_, '_>, all: ObjectId) -> Result<Option<ObjectId>, Error> {
    for object in [all.with_sub(2), all] {
        if session.number(object)?.is_some_and(|word| word & 1 == 1) {
            return Ok(Some(object));
        }
    }
    Ok(None)
}

impl Session<'_, '_> {
    /// Writes a signature to 1010h or 1011h. `false` if the device rejects it.
    pub(super) fn sign(&mut self, object: ObjectId, signature: &[u8; 4]) -> Result<bool, Error> {
        let mut unused = (|_| {}, |_: &crate::bus::Received| {});
        let mut options = WriteOptions::new(&mut unused.0, &mut unused.1);
        options.min_timeout = STORE_TIMEOUT;
        match write_with(self.master, &self.node, object, signature, &mut options) {
            Ok(_) => Ok(true),
            Err(Error::Sdo(SdoError { failure: SdoFailure::Refused(_), .. })) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Stores the present settings, so that they are as before the first store. Returns the sub-indices of 1010h that
    /// did not acknowledge it.
    pub(super) fn store_again(&mut self) -> Result<Vec<ObjectId>, Error> {
        let mut failed = Vec::new();
        for object in self.stored.clone() {
            match self.sign(object, b"save") {
                Ok(true) => {}
                Err(error) if error.is_fatal() => return Err(error),
                Ok(false) | Err(_) => failed.push(object),
            }
        }
        self.stored.clear();
        Ok(failed)
    }
}

/// Signatures are rejected with one of these codes.
const WRONG_SIGNATURE: &[u32] = &[0x0800_0020, 0x0800_0021, 0x0800_0022, 0x0800_0000];

fn wrong_save(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(object) = group(session, STORE_ALL)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(STORE_ALL)));
    };
    let answer = session.download(object, b"sava")?;
    Ok(Verdict::of(expect_abort(session, object, WRONG_SIGNATURE, answer)))
}

fn wrong_load(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(object) = group(session, RESTORE_ALL)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(RESTORE_ALL)));
    };
    // If the device takes it for the right signature, the settings are stored again.
    session.stored = vec![STORE_ALL.with_sub(object.sub)];
    session.settings.all_changed();
    let answer = session.download(object, b"loaa")?;
    Ok(Verdict::of(expect_abort(session, object, WRONG_SIGNATURE, answer)))
}

/// The heartbeat time that is stored for a while.
const STORED: u16 = 5_000;

/// Sets and stores the heartbeat time. The verdict if that is not possible.
fn store_value(session: &mut Session<'_, '_>) -> Result<Option<Verdict>, Error> {
    let Some(object) = group(session, STORE_ALL)? else {
        return Ok(Some(Verdict::NotApplicable(WhyNot::NoObject(STORE_ALL))));
    };
    if session.try_write(HEARTBEAT_TIME, &STORED.to_le_bytes())?.is_some() {
        return Ok(Some(Verdict::NotApplicable(WhyNot::NotWritable(HEARTBEAT_TIME))));
    }
    session.stored = vec![object];
    if !session.sign(object, b"save")? {
        return Ok(Some(Verdict::of([Finding::at(object, Expected::Acknowledged, Seen::Bytes(b"save".to_vec()))])));
    }
    Ok(None)
}

fn kept(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = store_value(session)? {
        return Ok(verdict);
    }
    session.reset(NmtCommand::ResetNode)?;
    let found = session.read(HEARTBEAT_TIME)?.unwrap_or_default();
    let wanted = STORED.to_le_bytes();
    let finding = || Finding::at(HEARTBEAT_TIME, Expected::Bytes(wanted.to_vec()), Seen::Bytes(found.clone()));
    Ok(Verdict::of((found != wanted).then(finding)))
}

/// Stores a value and restores the defaults. The verdict if that is not possible.
fn restore_defaults(session: &mut Session<'_, '_>) -> Result<Option<Verdict>, Error> {
    let Some(object) = group(session, RESTORE_ALL)? else {
        return Ok(Some(Verdict::NotApplicable(WhyNot::NoObject(RESTORE_ALL))));
    };
    if let Some(verdict) = store_value(session)? {
        return Ok(Some(verdict));
    }
    let store = STORE_ALL.with_sub(object.sub);
    if !session.stored.contains(&store) {
        session.stored.push(store);
    }
    session.settings.all_changed();
    if !session.sign(object, b"load")? {
        return Ok(Some(Verdict::of([Finding::at(object, Expected::Acknowledged, Seen::Bytes(b"load".to_vec()))])));
    }
    Ok(None)
}

fn later(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = restore_defaults(session)? {
        return Ok(verdict);
    }
    let found = session.read(HEARTBEAT_TIME)?.unwrap_or_default();
    let wanted = STORED.to_le_bytes();
    let finding = || Finding::at(HEARTBEAT_TIME, Expected::Bytes(wanted.to_vec()), Seen::Bytes(found.clone()));
    Ok(Verdict::of((found != wanted).then(finding)))
}

fn defaults(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = restore_defaults(session)? {
        return Ok(verdict);
    }
    session.reset(NmtCommand::ResetNode)?;
    let found = session.read(HEARTBEAT_TIME)?.unwrap_or_default();
    let old = STORED.to_le_bytes();
    let finding = || Finding::at(HEARTBEAT_TIME, Expected::OtherBytes(old.to_vec()), Seen::Bytes(found.clone()));
    Ok(Verdict::of((found == old).then(finding)))
}
