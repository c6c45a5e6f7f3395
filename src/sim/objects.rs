//! The object values of a simulated device: working values, stored values, and the rules for every write.

use super::abort::Abort;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::device::description::{Access, ObjectEntry, Signature, StoreGroup};
use crate::device::dictionary::Entry;
use crate::device::quirk::Quirk;
use crate::device::scalar::{NumberRange, Scalar};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The facts about one entry for the server.
#[derive(Clone, Debug)]
pub(super) struct Spec {
    pub(super) name: String,
    pub(super) data_type: DataType,
    pub(super) pdo: bool,
    pub(super) signature: Option<Signature>,
    pub(super) only_if_zero: Vec<ObjectId>,
    access: Access,
    low: Option<f64>,
    high: Option<f64>,
    allow: Vec<NumberRange>,
    default: Option<Scalar>,
    group: Option<Group>,
}

/// Whether these bytes are the signature. For "set", byte 0 is the value.
fn is_signed(signature: Signature, bytes: &[u8]) -> bool {
    let word: &[u8] = match signature {
        Signature::Save => b"save",
        Signature::Load => b"load",
        Signature::Zero => b"zero",
        Signature::Tare => b"tara",
        Signature::Set => return bytes.get(1..) == Some(b"set"),
    };
    bytes == word
}

/// Parameters that are stored and restored together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    All,
    Communication,
    Application,
    /// A manufacturer-specific group; no entry with a value belongs to it.
    Other,
}

impl Group {
    /// Returns the group of a sub-index of 1010h and 1011h.
    pub(super) fn of_sub(sub: u8) -> Option<Group> {
        Some(match sub {
            1 => Group::All,
            2 => Group::Communication,
            3 => Group::Application,
            4..=0x7f => Group::Other,
            _ => return None,
        })
    }

    /// Whether a command for `self` includes an entry of group `entry`.
    fn includes(self, entry: Group) -> bool {
        self == Group::All || self == entry
    }
}

impl From<StoreGroup> for Group {
    fn from(group: StoreGroup) -> Group {
        match group {
            StoreGroup::All => Group::All,
            StoreGroup::Communication => Group::Communication,
            StoreGroup::Application => Group::Application,
        }
    }
}

/// The part of the dictionary that a reset affects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Area {
    /// Everything.
    All,
    /// 1000h to 1FFFh.
    Communication,
}

impl Area {
    fn affects(self, object: ObjectId) -> bool {
        self == Area::All || (0x1000..0x2000).contains(&object.index)
    }
}

/// The object dictionary of one device.
#[derive(Clone, Debug)]
pub(super) struct Objects {
    specs: Arc<BTreeMap<ObjectId, Spec>>,
    /// Whether the description contains `stored` keys. If not, every writable object is stored in the group of its
    /// area.
    has_stored_keys: bool,
    /// Whether the device has [`Quirk::SaveAllResetsCobIds`].
    resets_cob_ids: bool,
    /// Whether the device has [`Quirk::CobIdZeroIsDefault`].
    zero_is_default: bool,
    values: BTreeMap<ObjectId, Vec<u8>>,
    saved: BTreeMap<ObjectId, Vec<u8>>,
}

impl Objects {
    /// Creates the objects of a new device with this node-ID.
    pub(super) fn new(model: &Model, node: NodeId) -> Objects {
        // An EDS has only a dictionary.
        let plain = model.dictionary.iter().map(|entry| (entry.object, Spec::plain(entry)));
        let mut specs: BTreeMap<ObjectId, Spec> = plain.collect();
        for entry in &model.description.objects {
            for object in entry.objects() {
                specs.insert(object, Spec::new(entry));
            }
        }
        let has_stored_keys = specs.values().any(|spec| spec.group.is_some());
        let mut objects = Objects {
            specs: Arc::new(specs),
            has_stored_keys,
            resets_cob_ids: model.description.quirks.contains(&Quirk::SaveAllResetsCobIds),
            zero_is_default: model.description.quirks.contains(&Quirk::CobIdZeroIsDefault),
            values: BTreeMap::new(),
            saved: BTreeMap::new(),
        };
        objects.reset(Area::All, node);
        objects
    }

    pub(super) fn spec(&self, object: ObjectId) -> Option<&Spec> {
        self.specs.get(&object)
    }

    /// Every entry of the description.
    pub(super) fn specs(&self) -> impl Iterator<Item = (ObjectId, &Spec)> {
        self.specs.iter().map(|(object, spec)| (*object, spec))
    }

    pub(super) fn has(&self, object: ObjectId) -> bool {
        self.specs.contains_key(&object)
    }

    /// Returns the indexes of this range that have an entry, in ascending order.
    pub(super) fn indexes(&self, range: RangeInclusive<u16>) -> Vec<u16> {
        let entries = ObjectId::new(*range.start(), 0)..=ObjectId::new(*range.end(), 255);
        let mut indexes: Vec<u16> = self.specs.range(entries).map(|(object, _)| object.index).collect();
        indexes.dedup();
        indexes
    }

    /// Returns the working value.
    pub(super) fn bytes(&self, object: ObjectId) -> Option<&[u8]> {
        self.values.get(&object).map(Vec::as_slice)
    }

    /// Returns the working value as an unsigned number of at most four bytes; 0 if there is none.
    pub(super) fn number(&self, object: ObjectId) -> u32 {
        let mut wide = [0; 4];
        let bytes = self.bytes(object).unwrap_or_default();
        let len = bytes.len().min(4);
        wide[..len].copy_from_slice(&bytes[..len]);
        u32::from_le_bytes(wide)
    }

    /// Returns the working value as a number of its type.
    pub(super) fn real(&self, object: ObjectId) -> Option<f64> {
        self.spec(object)?.data_type.decode(self.bytes(object)?).ok()?.as_f64()
    }

    /// Whether a write requests the default of a COB-ID instead of setting a value.
    pub(super) fn asks_for_default(&self, object: ObjectId, bytes: &[u8]) -> bool {
        self.zero_is_default && is_cob_id(object) && bytes.iter().all(|&byte| byte == 0)
    }

    /// Restores the factory default of an object.
    pub(super) fn put_default(&mut self, object: ObjectId, node: NodeId) {
        if let Some(value) = self.spec(object).map(|spec| spec.factory_default(node)) {
            self.values.insert(object, value);
        }
    }

    /// Sets a working value, independent of the access.
    pub(super) fn put(&mut self, object: ObjectId, bytes: Vec<u8>) {
        if self.has(object) {
            self.values.insert(object, bytes);
        }
    }

    /// Adds 1 to the objects with this name, if the device has any.
    pub(super) fn count(&mut self, name: &str) {
        let specs = Arc::clone(&self.specs);
        for (object, spec) in specs.iter().filter(|(_, spec)| spec.name == name) {
            let number = self.number(*object).saturating_add(1).to_le_bytes();
            self.put(*object, number[..spec.data_type.width().unwrap_or(4).min(4)].to_vec());
        }
    }

    /// Sets and stores a value, as if it had been written and stored before.
    pub(super) fn preset(&mut self, object: ObjectId, bytes: Vec<u8>) {
        if self.has(object) {
            self.saved.insert(object, bytes.clone());
            self.values.insert(object, bytes);
        }
    }

    /// Checks that the entry exists and can be written.
    pub(super) fn check_writable(&self, object: ObjectId) -> Result<&Spec, Abort> {
        let spec = self.find(object)?;
        if spec.access.is_writable() { Ok(spec) } else { Err(Abort::READ_ONLY) }
    }

    /// Checks that the entry exists and can be read.
    pub(super) fn check_readable(&self, object: ObjectId) -> Result<&Spec, Abort> {
        let spec = self.find(object)?;
        if spec.access.is_readable() { Ok(spec) } else { Err(Abort::WRITE_ONLY) }
    }

    fn find(&self, object: ObjectId) -> Result<&Spec, Abort> {
        match self.spec(object) {
            Some(spec) => Ok(spec),
            None if !self.indexes(object.index..=object.index).is_empty() => Err(Abort::NO_SUB_INDEX),
            None => Err(Abort::NO_OBJECT),
        }
    }

    /// Checks that the entry can be written with this number of bytes.
    pub(super) fn check_length(&self, object: ObjectId, bytes: &[u8]) -> Result<&Spec, Abort> {
        let spec = self.check_writable(object)?;
        if spec.data_type.width().is_some_and(|width| width != bytes.len()) {
            return Err(Abort::LENGTH);
        }
        Ok(spec)
    }

    /// Checks access, length, signature and limits of a write.
    pub(super) fn check_write(&self, object: ObjectId, bytes: &[u8]) -> Result<&Spec, Abort> {
        let spec = self.check_length(object, bytes)?;
        if let Some(signature) = spec.signature {
            return if is_signed(signature, bytes) { Ok(spec) } else { Err(Abort::NOT_STORED) };
        }
        if spec.only_if_zero.iter().any(|&other| self.number(other) != 0) && bytes.iter().any(|&byte| byte != 0) {
            return Err(Abort::NOT_STORED);
        }
        spec.check_limits(bytes)?;
        Ok(spec)
    }

    /// Resets the working values to the stored ones, else to the factory defaults.
    pub(super) fn reset(&mut self, area: Area, node: NodeId) {
        for (object, spec) in self.specs.iter().filter(|(object, _)| area.affects(**object)) {
            let value = self.saved.get(object).cloned().unwrap_or_else(|| spec.factory_default(node));
            self.values.insert(*object, value);
        }
    }

    /// Stores the working values of a group. Factory defaults are not stored, so that defaults with the node-ID still
    /// depend on it.
    pub(super) fn save(&mut self, group: Group, node: NodeId) {
        let specs = Arc::clone(&self.specs);
        for (object, spec) in specs.iter() {
            if !self.is_stored_by(group, *object, spec) {
                continue;
            }
            let reset = self.resets_cob_ids && group == Group::All && is_cob_id(*object);
            match self.values.get(object).filter(|_| !reset) {
                Some(value) if *value != spec.factory_default(node) => self.saved.insert(*object, value.clone()),
                _ => self.saved.remove(object),
            };
        }
    }

    /// The stored values.
    pub(super) fn saved(&self) -> &BTreeMap<ObjectId, Vec<u8>> {
        &self.saved
    }

    /// Sets the stored values; they become active at the next reset.
    pub(super) fn set_saved(&mut self, saved: BTreeMap<ObjectId, Vec<u8>>) {
        self.saved = saved;
        self.saved.retain(|object, _| self.specs.contains_key(object));
    }

    /// Deletes the stored values of a group; the working values change at the next reset.
    pub(super) fn restore(&mut self, group: Group) {
        let specs = Arc::clone(&self.specs);
        for (object, spec) in specs.iter() {
            // Node-ID and bit rate are not restored (MH-4, 4.3.8 and 4.3.9).
            if spec.signature != Some(Signature::Set) && self.is_stored_by(group, *object, spec) {
                self.saved.remove(object);
            }
        }
    }

    /// Deletes the stored COB-IDs. After the next reset, the device uses the predefined connection set.
    pub(super) fn forget_cob_ids(&mut self) {
        self.saved.retain(|object, _| !is_cob_id(*object));
    }

    fn is_stored_by(&self, group: Group, object: ObjectId, spec: &Spec) -> bool {
        if self.has_stored_keys {
            return spec.group.is_some_and(|entry| group.includes(entry));
        }
        let by_area = if object.index < 0x2000 { Group::Communication } else { Group::Application };
        let holds_a_value = spec.signature.is_none_or(|signature| signature == Signature::Set);
        spec.access == Access::Rw && holds_a_value && group.includes(by_area)
    }
}

/// Whether an object is the COB-ID of emergencies or of a TPDO.
fn is_cob_id(object: ObjectId) -> bool {
    object == ObjectId::new(0x1014, 0) || ((0x1800..0x1a00).contains(&object.index) && object.sub == 1)
}

impl Spec {
    fn new(entry: &ObjectEntry) -> Spec {
        let limit = |scalar: &Option<Scalar>| scalar.as_ref().and_then(Scalar::as_f64);
        Spec {
            name: entry.name.clone(),
            data_type: entry.data_type,
            pdo: entry.pdo,
            signature: entry.signature,
            only_if_zero: entry.only_if_zero.clone(),
            access: entry.access,
            low: limit(&entry.low),
            high: limit(&entry.high),
            allow: entry.allow.clone(),
            default: entry.default.clone(),
            group: entry.stored.map(Group::from),
        }
    }

    /// Creates the entry of an object in an EDS. The signatures for storing and restoring come from CiA 301.
    fn plain(entry: &Entry) -> Spec {
        let limit = |scalar: &Option<Scalar>| scalar.as_ref().and_then(Scalar::as_f64);
        let signature = match (entry.object.index, entry.object.sub) {
            (0x1010, 1..) => Some(Signature::Save),
            (0x1011, 1..) => Some(Signature::Load),
            _ => None,
        };
        Spec {
            name: entry.name.clone(),
            data_type: entry.data_type,
            pdo: entry.pdo,
            signature,
            only_if_zero: Vec::new(),
            access: entry.access,
            low: limit(&entry.low),
            high: limit(&entry.high),
            allow: Vec::new(),
            default: entry.default.clone(),
            group: None,
        }
    }

    /// Returns the factory default; zeros or empty text if the description has none.
    fn factory_default(&self, node: NodeId) -> Vec<u8> {
        let described = self.default.as_ref().and_then(|default| default.encode(self.data_type, node).ok());
        described.unwrap_or_else(|| vec![0; self.data_type.width().unwrap_or(0)])
    }

    /// Encodes a value in the type of the entry.
    pub(super) fn encode(&self, value: &Scalar, node: NodeId) -> Result<Vec<u8>, String> {
        value.encode(self.data_type, node).map_err(|error| error.to_string())
    }

    fn check_limits(&self, bytes: &[u8]) -> Result<(), Abort> {
        let Some(number) = self.data_type.decode(bytes).ok().and_then(|value| value.as_f64()) else {
            return Ok(());
        };
        if self.high.is_some_and(|high| number > high) {
            return Err(Abort::TOO_HIGH);
        }
        if self.low.is_some_and(|low| number < low) {
            return Err(Abort::TOO_LOW);
        }
        if !self.allow.is_empty() && !self.allow.iter().any(|range| range.contains(number)) {
            return Err(Abort::VALUE);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
