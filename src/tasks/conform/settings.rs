//! The settings of the node before the first case, and how they are restored.

use super::error_control::{GUARD_TIME, LIFE_TIME_FACTOR};
use super::history::ErrorEntries;
use super::session::{SETTLE, Session, number};
use crate::canopen::frame::Frame;
use crate::canopen::nmt::NmtCommand;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::CobId;
use crate::canopen::sdo::AbortCode;
use crate::device::standard;
use crate::master::{Request, SdoFailure};
use crate::node::state::BOOT_TIMEOUT;
use crate::node::write::{write, write_with};
use crate::node::{Error, Node, WriteOptions};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Objects that are written to start an action, or to delete something.
const ACTIONS: [u16; 3] = [0x1003, 0x1010, 0x1011];

/// The number of entries in the error history.
pub(super) const ERROR_COUNT: ObjectId = ObjectId::new(0x1003, 0);

/// The number of times that all settings are written, because one setting may change or lock another.
const ROUNDS: usize = 3;

/// The TPDOs whose parameters are read if no description states the objects.
const UNDESCRIBED_TPDOS: u16 = 4;

/// The mapping entries that are read if no description states the objects.
const UNDESCRIBED_ENTRIES: u8 = 8;

/// The number of further Ctrl-C that are ignored until the settings are restored.
const MAX_INTERRUPTS: u32 = 5;

/// The settings before the first case.
#[derive(Clone, Debug, Default)]
pub(super) struct Settings {
    before: BTreeMap<ObjectId, Vec<u8>>,
    /// The settings that may have another value now.
    changed: BTreeSet<ObjectId>,
    /// Settings that the program must not write. They are lost at a reset, if they were not stored.
    protected: BTreeSet<ObjectId>,
    /// The error history before the first case; `None` if the device has none.
    pub(super) history: Option<ErrorEntries>,
}

impl Settings {
    /// After a reset, all settings that were not stored have another value.
    pub(super) fn all_changed(&mut self) {
        self.changed = self.before.keys().copied().collect();
    }

    /// The settings of CiA 404 whose index has these last three digits.
    pub(super) fn of_profile(&self, digits: &[u16]) -> Vec<(ObjectId, Vec<u8>)> {
        let is_wanted = |object: &ObjectId| object.index >= 0x6000 && digits.contains(&(object.index & 0xfff));
        let wanted = self.before.iter().filter(|(object, _)| is_wanted(object) && object.sub > 0);
        wanted.map(|(object, value)| (*object, value.clone())).collect()
    }

    /// Whether the program must not write a setting.
    pub(super) fn is_protected(&self, object: ObjectId) -> bool {
        self.protected.contains(&object)
    }

    /// The value of a setting before the first case.
    pub(super) fn before(&self, object: ObjectId) -> Option<&[u8]> {
        self.before.get(&object).map(Vec::as_slice)
    }
}

/// Whether the program may write an object without `--store`: it is in the communication area or in the profile.
pub(super) fn may_write(object: ObjectId) -> bool {
    matches!(object.index, 0x1000..=0x1fff | 0x6000..=0x9fff) && !ACTIONS.contains(&object.index)
}

/// The settings of a node: objects that can be read and written, and that start no action.
fn objects(node: &Node) -> Vec<ObjectId> {
    let Some(model) = node.model.as_ref().filter(|model| !model.dictionary.is_empty()) else {
        let single = standard::single_objects().filter(|object| may_write(*object));
        let writable = single.filter(|object| standard::entry(*object).is_some_and(|entry| entry.access.is_writable()));
        let pdos = (0..UNDESCRIBED_TPDOS).flat_map(|number| {
            let communication = [1, 2, 3, 5].map(|sub| ObjectId::new(0x1800 + number, sub));
            let mapping = (0..=UNDESCRIBED_ENTRIES).map(move |sub| ObjectId::new(0x1a00 + number, sub));
            communication.into_iter().chain(mapping)
        });
        return writable.chain(pdos).collect();
    };
    let entries = model.dictionary.iter().filter(|entry| entry.access.is_writable() && entry.access.is_readable());
    let is_action = |object: ObjectId| {
        let described = model.description.object(object);
        ACTIONS.contains(&object.index) || described.is_some_and(|entry| entry.signature.is_some())
    };
    entries.map(|entry| entry.object).filter(|object| object.index >= 0x1000 && !is_action(*object)).collect()
}

impl Session<'_, '_> {
    /// Reads all settings.
    pub(super) fn read_settings(&mut self, stores: bool) -> Result<(), Error> {
        for object in objects(&self.node) {
            if let Some(value) = self.read_or_skip(object)? {
                self.settings.before.insert(object, value);
                if !stores && !may_write(object) {
                    self.settings.protected.insert(object);
                }
            }
        }
        self.settings.history = self.error_entries()?;
        // An empty error history can be restored: 0 deletes its entries.
        if let Some(empty) = self.read_or_skip(ERROR_COUNT)?.filter(|count| number(count) == 0) {
            self.settings.before.insert(ERROR_COUNT, empty);
        }
        Ok(())
    }

    /// Reads a number of at most eight bytes; `None` without a valid answer.
    pub(super) fn number_or_skip(&mut self, object: ObjectId) -> Result<Option<u64>, Error> {
        Ok(self.read_or_skip(object)?.filter(|bytes| bytes.len() <= 8).map(|bytes| number(&bytes)))
    }

    /// Reads an object; `None` without a valid answer.
    fn read_or_skip(&mut self, object: ObjectId) -> Result<Option<Vec<u8>>, Error> {
        match self.read(object) {
            Err(error) if !error.is_fatal() => Ok(None),
            result => result,
        }
    }

    /// Whether an error that the case causes can be removed from the error history afterwards.
    pub(super) fn may_cause_error(&mut self) -> Result<bool, Error> {
        if self.settings.before(ERROR_COUNT).is_some() {
            self.touch(ERROR_COUNT)?;
            return Ok(true);
        }
        Ok(self.read_or_skip(ERROR_COUNT)?.is_none())
    }

    /// Notes that a setting may change. It is restored after the case.
    pub(super) fn touch(&mut self, object: ObjectId) -> Result<(), Error> {
        if self.settings.before.contains_key(&object) {
            self.settings.changed.insert(object);
        } else if let Some(value) = self.read_or_skip(object)? {
            self.settings.before.insert(object, value);
            self.settings.changed.insert(object);
        }
        Ok(())
    }

    /// Notes that the mapping of a TPDO may change.
    pub(super) fn touch_mapping(&mut self, count: ObjectId) -> Result<(), Error> {
        let known = self.settings.before.keys().filter(|object| object.index == count.index);
        let known: Vec<ObjectId> = known.copied().collect();
        self.settings.changed.extend(known);
        self.touch(count)
    }

    /// Writes a setting. It is restored after the case.
    pub(super) fn set(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), Error> {
        self.touch(object)?;
        write(self.master, &self.node, object, bytes).map(drop)
    }

    /// Writes a setting. Returns the abort code if the device rejects it.
    pub(super) fn try_write(&mut self, object: ObjectId, bytes: &[u8]) -> Result<Option<AbortCode>, Error> {
        match self.set(object, bytes) {
            Ok(()) => Ok(None),
            Err(Error::Sdo(error)) => match error.failure {
                SdoFailure::Refused(code) => Ok(Some(code)),
                _ => Err(Error::Sdo(error)),
            },
            Err(error) => Err(error),
        }
    }

    /// Restores the settings that the case has changed, also after Ctrl-C. Returns the settings that have another value
    /// then.
    pub(super) fn restore(&mut self) -> Result<Vec<ObjectId>, Error> {
        self.despite_interrupts(Self::restore_once)
    }

    /// Runs an action, and repeats it if Ctrl-C interrupts it.
    pub(super) fn despite_interrupts<T>(&mut self, act: impl Fn(&mut Self) -> Result<T, Error>) -> Result<T, Error> {
        let mut result = act(self);
        for _ in 0..MAX_INTERRUPTS {
            if !matches!(result, Err(Error::Interrupted)) {
                break;
            }
            self.is_answer_open = true;
            result = act(self);
        }
        result
    }

    fn restore_once(&mut self) -> Result<Vec<ObjectId>, Error> {
        if self.is_answer_open {
            self.master.discard_answers(SETTLE * 5)?;
            self.is_answer_open = false;
        }
        self.restore_input()?;
        self.leave_lss()?;
        if self.needs_reset {
            self.reset(NmtCommand::ResetNode)?;
            self.needs_reset = false;
        }
        self.wake_up()?;
        self.end_transfer()?;
        if std::mem::take(&mut self.guarded) {
            // Life guarding is switched off before the last guarding request, so that it cannot fail again.
            self.put_back(GUARD_TIME)?;
            self.put_back(LIFE_TIME_FACTOR)?;
            self.end_guarding_error()?;
        }
        if std::mem::take(&mut self.wrong_sync) {
            self.send(Frame::empty(self.node.sync))?;
        }
        let mut wrong = self.differing()?;
        for _ in 0..ROUNDS {
            if wrong.is_empty() {
                break;
            }
            let writable: Vec<ObjectId> =
                wrong.iter().copied().filter(|object| !self.settings.protected.contains(object)).collect();
            self.write_back(&writable)?;
            wrong = self.differing()?;
        }
        if wrong.is_empty() {
            wrong = self.store_again()?;
        }
        self.settings.changed.clear();
        // What could not be restored is compared again after the next case.
        self.settings.changed.extend(&wrong);
        Ok(wrong)
    }

    /// Brings the node to a state in which it answers SDO requests.
    fn wake_up(&mut self) -> Result<(), Error> {
        if !self.state_open {
            return Ok(());
        }
        let until = self.master.now() + BOOT_TIMEOUT;
        loop {
            // A node that is restarting ignores the command.
            self.command(NmtCommand::EnterPreOperational)?;
            let read = Request::read(self.node.id, ObjectId::DEVICE_TYPE).within(SETTLE * 5).once();
            match self.master.transfer_one(read)? {
                Err(error) if matches!(error.failure, SdoFailure::NoAnswer { .. }) && self.master.now() < until => {}
                _ => break,
            }
        }
        self.command(NmtCommand::EnterPreOperational)?;
        self.state_open = false;
        Ok(())
    }

    /// The settings that may have changed and have another value than before.
    fn differing(&mut self) -> Result<Vec<ObjectId>, Error> {
        let mut wrong = Vec::new();
        for object in self.settings.changed.clone() {
            let found = self.read_or_skip(object)?;
            if found.as_deref() != self.settings.before(object) {
                wrong.push(object);
            }
        }
        Ok(wrong)
    }

    /// Writes the old values. A rejected write is tried again in the next round.
    fn write_back(&mut self, wrong: &[ObjectId]) -> Result<(), Error> {
        let is_pdo = |object: &&ObjectId| (0x1800..0x1c00).contains(&object.index);
        let (pdos, others): (Vec<&ObjectId>, Vec<&ObjectId>) = wrong.iter().partition(is_pdo);
        // The offsets are given in the unit, so the unit is written first.
        let (units, others): (Vec<&ObjectId>, Vec<&ObjectId>) =
            others.into_iter().partition(|object| object.index == 0x6131);
        for object in units.into_iter().chain(others) {
            self.put_back(*object)?;
        }
        let numbers: BTreeSet<u16> = pdos.iter().map(|object| object.index & 0x1ff).collect();
        for number in numbers {
            let of_this: Vec<ObjectId> =
                pdos.iter().copied().filter(|object| object.index & 0x1ff == number).copied().collect();
            self.put_back_pdo(number, &of_this)?;
        }
        Ok(())
    }

    fn put_back(&mut self, object: ObjectId) -> Result<(), Error> {
        let Some(bytes) = self.settings.before(object).map(<[u8]>::to_vec) else { return Ok(()) };
        self.put(object, &bytes)
    }

    fn put(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), Error> {
        let mut unused = (|_| {}, |_: &crate::bus::Received| {});
        let mut options = WriteOptions::new(&mut unused.0, &mut unused.1);
        options.min_timeout = Duration::from_secs(1);
        match write_with(self.master, &self.node, object, bytes, &mut options) {
            Err(error) if error.is_fatal() => Err(error),
            Ok(_) | Err(_) => Ok(()),
        }
    }

    /// Writes the parameters of a PDO in the order that CiA 301 requires: switch it off, clear the mapping, write.
    fn put_back_pdo(&mut self, number: u16, wrong: &[ObjectId]) -> Result<(), Error> {
        let cob_id = ObjectId::new(0x1800 + number, 1);
        let count = ObjectId::new(0x1a00 + number, 0);
        self.settings.changed.insert(cob_id);
        if let Some(old) = self.settings.before(cob_id).map(super::session::number) {
            let off = CobId(u32::try_from(old).unwrap_or(0)).switched_off();
            self.put(cob_id, &off.0.to_le_bytes())?;
        }
        if wrong.iter().any(|object| object.index == count.index) {
            self.put(count, &[0])?;
            for object in wrong.iter().filter(|object| object.index == count.index && object.sub > 0) {
                self.put_back(*object)?;
            }
            self.put_back(count)?;
        }
        for object in wrong.iter().filter(|object| object.index == cob_id.index && object.sub > 1) {
            self.put_back(*object)?;
        }
        self.put_back(cob_id)
    }
}
