//! The objects of the SDO server: objects with a value, objects with a measurement, and objects whose write starts an
//! action.

use super::abort::Abort;
use super::channels::Channels;
use super::emergency::Emergencies;
use super::objects::{Group, Objects};
use super::sdo_server::Dictionary;
use super::settings::Settings;
use super::tpdo;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::description::{Remap, Signature};
use crate::device::unit::Unit;
use std::time::Duration;

/// Objects, measuring channels and errors of one device.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    /// The active node-ID; unused while the device is unconfigured.
    pub(super) node: NodeId,
    pub(super) settings: Settings,
    pub(super) objects: Objects,
    pub(super) channels: Channels,
    pub(super) emergencies: Emergencies,
    pub(super) remap: Remap,
}

impl Memory {
    /// Returns the bytes of an object at `time`, independent of its access.
    pub(super) fn value(&mut self, object: ObjectId, time: Duration) -> Option<Vec<u8>> {
        match self.channels.read(&self.objects, object, time) {
            Some(shown) => Some(shown),
            None => self.objects.bytes(object).map(<[u8]>::to_vec),
        }
    }

    /// Whether a TPDO without mapped objects is sent, with 0 bytes.
    pub(super) fn sends_empty_pdo(&self) -> bool {
        self.remap == Remap::CountOnly
    }

    /// Gives access to the memory for one request.
    pub(super) fn at(&mut self, time: Duration, pre_operational: bool) -> Access<'_> {
        Access { memory: self, time, pre_operational, written: None }
    }

    /// Executes a write that has passed every check.
    fn act(&mut self, object: ObjectId, bytes: &[u8], time: Duration) -> Result<(), Abort> {
        if !self.settings.allows(object, bytes) {
            return Err(Abort::VALUE);
        }
        match self.objects.spec(object).and_then(|spec| spec.signature) {
            Some(Signature::Save) => {
                let group = Group::of_sub(object.sub).ok_or(Abort::NOT_STORED)?;
                self.objects.save(group, self.node);
            }
            Some(Signature::Load) => self.objects.restore(Group::of_sub(object.sub).ok_or(Abort::NOT_STORED)?),
            Some(Signature::Zero) if object.index & 0x0fff == 0x125 => {
                if !self.channels.autozero(&mut self.objects, object.sub, time) {
                    return Err(Abort::NOT_STORED);
                }
            }
            Some(Signature::Tare) => self.channels.tare(&mut self.objects, object.sub, time)?,
            Some(Signature::Zero) => self.channels.reset_extremes(object.sub),
            // Only the number is kept, without the signature.
            Some(Signature::Set) => {
                self.objects.put(object, vec![bytes.first().copied().unwrap_or(0), 0, 0, 0]);
            }
            None if object == ObjectId::new(0x1003, 0) => {
                if bytes != [0] {
                    return Err(Abort::VALUE);
                }
                self.emergencies.clear_history(&mut self.objects);
            }
            None if self.channels.is_unit(object) => {
                let code = bytes.iter().rev().fold(0u32, |code, byte| code << 8 | u32::from(*byte));
                if !self.channels.change_unit(&mut self.objects, object, Unit(code)) {
                    return Err(Abort::VALUE);
                }
                self.channels.share(&mut self.objects, object);
            }
            None if self.objects.asks_for_default(object, bytes) => self.objects.put_default(object, self.node),
            None => {
                self.objects.put(object, bytes.to_vec());
                self.channels.share(&mut self.objects, object);
                self.channels.refilter(&mut self.objects, object, time);
            }
        }
        self.settings.keep(object, &self.objects);
        Ok(())
    }
}

/// The memory at one moment.
pub(super) struct Access<'a> {
    memory: &'a mut Memory,
    time: Duration,
    pre_operational: bool,
    /// The object that was written.
    pub(super) written: Option<ObjectId>,
}

impl Access<'_> {
    fn finish(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), Abort> {
        self.memory.act(object, bytes, self.time)?;
        self.written = Some(object);
        Ok(())
    }
}

impl Dictionary for Access<'_> {
    fn upload(&mut self, object: ObjectId) -> Result<Vec<u8>, Abort> {
        self.memory.objects.check_readable(object)?;
        self.memory.value(object, self.time).ok_or(Abort::GENERAL)
    }

    fn width(&self, object: ObjectId) -> Result<Option<usize>, Abort> {
        Ok(self.memory.objects.check_writable(object)?.data_type.width())
    }

    fn download(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), Abort> {
        let objects = &self.memory.objects;
        if objects.asks_for_default(object, bytes) {
            objects.check_length(object, bytes)?;
            return self.finish(object, bytes);
        }
        let pdo = || tpdo::check(objects, self.memory.remap, self.pre_operational, object, bytes);
        // An impossible mapping or identifier has its own abort code, so it is checked before the limits.
        let is_mapping = (0x1a00..0x1c00).contains(&object.index) && object.sub > 0;
        if is_mapping || matches!(object.index, tpdo::COB_ID_SYNC | tpdo::COB_ID_EMCY) {
            objects.check_length(object, bytes)?;
            pdo()?;
            objects.check_write(object, bytes)?;
        } else {
            objects.check_write(object, bytes)?;
            pdo()?;
        }
        self.finish(object, bytes)
    }
}
