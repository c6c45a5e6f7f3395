//! Converts the objects of a DCF (CiA 306) to settings, and the settings of a device to objects of a DCF.

use super::check::named_object;
use super::dump::path;
use super::failure::ConfigFact;
use super::setting::{Form, Setting, Stage};
use super::snapshot::Snapshot;
use super::value::Scales;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, MappingEntry};
use crate::canopen::value::{DataType, Value};
use crate::device::config_file::{Document, Entry, Item, Place};
use crate::device::eds::Eds;
use crate::device::scalar::Scalar;
use crate::node::Node;
use crate::tasks::Note;
use std::collections::{BTreeMap, BTreeSet};

const U32: DataType = DataType::Unsigned(4);

/// Returns settings for objects that the DCF contains and the device may have, but the table of settings lacks.
pub(super) fn named_objects(dcf: &Eds, node: &Node, settings: &[Setting]) -> Vec<Setting> {
    let is_new = |object: &&ObjectId| !settings.iter().any(|setting| setting.object == **object);
    let entries = dcf.parameter_values.keys().filter(is_new).filter_map(|object| dcf.dictionary.get(*object));
    let setting = |entry| {
        let found = named_object(node, entry)?;
        let data_type = node.known_type(found.object).unwrap_or(entry.data_type);
        // The device may use this name for another object.
        Some(Setting { key: format!("object.{}", found.object), data_type, ..found })
    };
    entries.filter_map(setting).collect()
}

/// Returns the objects of a setting.
fn objects(setting: &Setting) -> Vec<ObjectId> {
    match setting.form {
        Form::Signals(number) => (0..=64).map(|sub| number.mapping(sub)).collect(),
        _ => vec![setting.object],
    }
}

impl Snapshot {
    /// Converts the settings of a DCF to a settings file for this device, with notes about objects that the device
    /// lacks.
    pub fn document_of(&self, dcf: &Eds) -> (Document, Vec<Note>) {
        let future = self.with_values(dcf);
        let mut document = Document::default();
        let mut push = |key: String, value: Item, object: Option<ObjectId>| {
            let line = object.and_then(|object| dcf.value_lines.get(&object)).copied().unwrap_or(1);
            let at = Place { line, column: 1 };
            document.entries.push(Entry { key, value, key_at: at, value_at: at });
        };
        let numbers = [("device.vendor", dcf.info.vendor_number), ("device.product", dcf.info.product_number)];
        for (key, number) in numbers {
            if let Some(number) = number.filter(|&number| number != 0) {
                push(key.to_owned(), Item::Integer(number.into()), None);
            }
        }
        let commissioning = dcf.commissioning.clone().unwrap_or_default();
        if let Some(id) = commissioning.node_id {
            push("address.node-id".to_owned(), Item::Integer(id.get().into()), None);
        }
        if let Some(rate) = commissioning.bit_rate.filter(|_| self.settings.iter().any(|one| one.form == Form::BitRate))
        {
            push("address.bit-rate".to_owned(), Item::Text(format!("{}k", rate / 1000)), None);
        }
        let mut used = BTreeSet::new();
        let mut is_calibrated = false;
        for setting in &future.settings {
            let named: Vec<ObjectId> =
                objects(setting).into_iter().filter(|object| dcf.parameter_values.contains_key(object)).collect();
            let Some(content) = future.content(setting).filter(|_| !named.is_empty()) else { continue };
            if setting.is_writable {
                let value = setting.show(&future.node, &future.scales, &content);
                is_calibrated |= setting.stage == Stage::Calibration;
                push(path(setting, &content), value, named.first().copied());
            }
            if setting.is_writable || self.content(setting) == Some(content) {
                used.extend(named);
            }
        }
        if let Some(serial) = commissioning.lss_serial.filter(|_| is_calibrated) {
            push("calibration.serial".to_owned(), Item::Integer(serial.into()), None);
        }
        let rest = dcf.parameter_values.keys().filter(|object| !used.contains(object));
        let is_setting = |object: &ObjectId| {
            let entry = dcf.dictionary.get(*object);
            entry.is_some_and(|entry| named_object(&self.node, entry).is_some())
        };
        let (missing, others): (Vec<ObjectId>, Vec<ObjectId>) = rest.copied().partition(is_setting);
        let name = |object: &ObjectId| match dcf.dictionary.get(*object) {
            Some(entry) => format!("{object} ({})", entry.full_name()),
            None => object.to_string(),
        };
        let note = |objects: &[ObjectId], fact: fn(Vec<String>) -> ConfigFact| {
            let names = objects.iter().map(name).collect();
            (!objects.is_empty()).then(|| Note::of_node(self.node.id, fact(names)))
        };
        let missing = note(&missing, |objects| ConfigFact::NotOnDevice { objects });
        let others = note(&others, |objects| ConfigFact::NotSettings { objects });
        (document, missing.into_iter().chain(others).collect())
    }

    /// Returns the settings of the device with the values of a DCF.
    fn with_values(&self, dcf: &Eds) -> Snapshot {
        let id = self.node.id;
        let written_for = dcf.commissioning.as_ref().and_then(|commissioning| commissioning.node_id).unwrap_or(id);
        let mut future = self.clone();
        for (object, value) in &dcf.parameter_values {
            let own = self.settings.iter().find(|setting| setting.object == *object);
            let Some(own) = own.filter(|_| self.bytes(*object).is_some()) else { continue };
            if let Ok(bytes) = value.encode(own.data_type, id) {
                let bytes = match (own.form.clone(), <[u8; 4]>::try_from(bytes.as_slice())) {
                    (Form::CobId(default), Ok(word)) if !matches!(value, Scalar::NodeIdPlus(_)) => {
                        adapt_cob_id(u32::from_le_bytes(word), default, id, written_for).to_le_bytes().to_vec()
                    }
                    _ => bytes,
                };
                future.values.insert(*object, bytes);
            }
        }
        for tpdo in &mut future.tpdos {
            let number = tpdo.number;
            let word = |object: ObjectId| {
                let bytes = dcf.parameter_values.get(&object)?.encode(U32, id).ok()?;
                Some(u32::from_le_bytes(bytes.try_into().ok()?))
            };
            let word16 = |sub: u8| word(number.communication(sub)).and_then(|word| u16::try_from(word).ok());
            if let Some(found) = word(number.communication(1)) {
                let is_formula =
                    matches!(dcf.parameter_values.get(&number.communication(1)), Some(Scalar::NodeIdPlus(_)));
                let default = super::setting::default_id(&self.node, number);
                tpdo.cob_id = CobId(if is_formula { found } else { adapt_cob_id(found, default, id, written_for) });
            }
            tpdo.transmission = word16(2).and_then(|code| u8::try_from(code).ok()).unwrap_or(tpdo.transmission);
            tpdo.inhibit_100us = tpdo.inhibit_100us.map(|old| word16(3).unwrap_or(old));
            tpdo.event_timer_ms = tpdo.event_timer_ms.map(|old| word16(5).unwrap_or(old));
            let count = word(number.mapping(0)).and_then(|count| u8::try_from(count).ok());
            let count = count.unwrap_or(u8::try_from(tpdo.mapping.len()).unwrap_or(u8::MAX));
            let entry = |sub: u8| {
                let old = || tpdo.mapping.get(usize::from(sub) - 1).map(|entry| entry.word());
                word(number.mapping(sub)).or_else(old)
            };
            let words: Vec<u32> = (1..=count.min(64)).filter_map(entry).filter(|word| *word != 0).collect();
            tpdo.mapping = words.into_iter().map(MappingEntry::from_word).collect();
        }
        super::snapshot::renew_signals(&mut future.node, &future.values);
        super::snapshot::renew_tpdos(&mut future.node, &future.tpdos);
        future.scales = Scales::of(&future.node);
        future
    }

    /// Converts the settings of the device to the objects of a DCF. The calibration is omitted, because a DCF tool
    /// would write it to every device.
    pub fn dcf_objects(&self) -> BTreeMap<ObjectId, (DataType, Scalar)> {
        let id = u32::from(self.node.id.get());
        let word = |word: u32, default: Option<u16>| match default {
            Some(default) if word & 0x7ff == u32::from(default) && word >= id => Scalar::NodeIdPlus(word - id),
            _ => Scalar::Integer(word.into()),
        };
        let mut objects = BTreeMap::new();
        for setting in self.settings.iter().filter(|setting| setting.is_writable) {
            let Some(bytes) = self.bytes(setting.object) else { continue };
            let Ok(value) = setting.data_type.decode(bytes) else { continue };
            let default = match (&setting.form, setting.stage) {
                (_, Stage::Calibration | Stage::Tpdo(_) | Stage::Address) => continue,
                (Form::CobId(default), _) if setting.key == "node.emcy-cob-id" => Some(*default),
                _ => None,
            };
            let scalar = match value.as_u64().and_then(|number| u32::try_from(number).ok()).zip(default) {
                Some((number, default)) => word(number, Some(default)),
                None => scalar(&value),
            };
            objects.insert(setting.object, (setting.data_type, scalar));
        }
        let unsigned = |width: u8, number: u32| (DataType::Unsigned(width), Scalar::Integer(number.into()));
        for tpdo in &self.tpdos {
            let number = tpdo.number;
            let default = super::setting::default_id(&self.node, number);
            let mut put = |object: ObjectId, value| {
                if self.node.may_have(object) && !self.node.is_read_only(object) {
                    objects.insert(object, value);
                }
            };
            let follows = Some(default).filter(|default| u32::from(*default) > id);
            put(number.communication(1), (U32, word(tpdo.cob_id.0, follows)));
            put(number.communication(2), unsigned(1, tpdo.transmission.into()));
            let times = [(3, tpdo.inhibit_100us), (5, tpdo.event_timer_ms)];
            for (sub, time) in times {
                time.into_iter().for_each(|time| put(number.communication(sub), unsigned(2, time.into())));
            }
            if !tpdo.multiplexed {
                put(number.mapping(0), unsigned(1, u32::try_from(tpdo.mapping.len()).unwrap_or(0)));
                for (sub, entry) in (1..).zip(&tpdo.mapping) {
                    put(number.mapping(sub), (U32, Scalar::Integer(entry.word().into())));
                }
            }
        }
        objects
    }
}

/// Adapts a COB-ID to this node-ID, if it is the default for the node-ID of the DCF.
fn adapt_cob_id(word: u32, default: u16, id: NodeId, written_for: NodeId) -> u32 {
    let [default, id, other] = [u32::from(default), u32::from(id.get()), u32::from(written_for.get())];
    if default > id && word & 0x1fff_ffff == default - id + other { word & !0x1fff_ffff | default } else { word }
}

fn scalar(value: &Value) -> Scalar {
    match value {
        Value::Bool(bit) => Scalar::Integer((*bit).into()),
        Value::Integer(number) => Scalar::Integer(*number),
        Value::Unsigned(number) => {
            i64::try_from(*number).map_or_else(|_| Scalar::Text(number.to_string()), Scalar::Integer)
        }
        Value::Real32(number) => Scalar::Real(number.to_string().parse().unwrap_or(f64::from(*number))),
        Value::Real64(number) => Scalar::Real(*number),
        Value::Bytes(bytes) => Scalar::Text(bytes.iter().map(|byte| format!("{byte:02X}")).collect()),
        other => Scalar::Text(other.to_string()),
    }
}
