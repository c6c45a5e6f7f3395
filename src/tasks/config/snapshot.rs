//! The values of all settings of a device.

use super::setting::{Form, Setting, Stage};
use super::value::{Content, Scales};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::DataType;
use crate::device::assign::AssignKind;
use crate::device::config_file::Item;
use crate::master::{Master, SdoError, SdoFailure};
use crate::node::Node;
use crate::node::read::Reader;
use crate::tasks::Failure;
use crate::tasks::pdo;
use std::collections::BTreeMap;

/// The values of all settings of a device at one moment.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The node.
    pub node: Node,
    /// The settings that the device has.
    pub settings: Vec<Setting>,
    /// The units and digits.
    pub scales: Scales,
    /// The TPDOs.
    pub tpdos: Vec<pdo::Settings>,
    pub(super) values: BTreeMap<ObjectId, Vec<u8>>,
    bit_rate: Option<u32>,
    /// Objects whose read is rejected by the device.
    pub unreadable: Vec<(ObjectId, AbortCode)>,
}

impl Snapshot {
    /// Reads all settings of a surveyed node.
    ///
    /// # Errors
    /// The node stops answering; bus errors and Ctrl-C.
    pub fn read(master: &mut Master<'_>, node: Node, settings: Vec<Setting>) -> Result<Snapshot, Failure> {
        let is_single = |setting: &&Setting| setting.object.index != 0 && !matches!(setting.stage, Stage::Tpdo(_));
        let mut objects: Vec<(ObjectId, DataType)> =
            settings.iter().filter(is_single).map(|setting| (setting.object, setting.data_type)).collect();
        objects.extend(extra_objects(&node));
        objects.sort_by_key(|(object, _)| *object);
        objects.dedup_by_key(|(object, _)| *object);
        let (values, unreadable) = read_objects(master, &node, &objects)?;
        let numbers: Vec<TpdoNumber> = node.tpdos.iter().map(|tpdo| tpdo.number).collect();
        let tpdos: Vec<pdo::Settings> =
            numbers.into_iter().map(|number| pdo::read(master, &node, number)).collect::<Result<_, _>>()?;
        let bit_rate = bit_rate(&node, &values).or(master.bus().bit_rate());
        let mut node = node;
        renew_signals(&mut node, &values);
        renew_tpdos(&mut node, &tpdos);
        let scales = Scales::of(&node);
        let mut snapshot = Snapshot { node, settings: Vec::new(), scales, tpdos, values, bit_rate, unreadable };
        snapshot.settings = settings.into_iter().filter(|setting| snapshot.content(setting).is_some()).collect();
        Ok(snapshot)
    }

    /// Returns the value of a setting; `None` if the device does not have it.
    pub fn content(&self, setting: &Setting) -> Option<Content> {
        let word = || {
            let bytes = self.values.get(&setting.object)?;
            let word = <[u8; 4]>::try_from(bytes.as_slice()).ok().map(u32::from_le_bytes);
            word.or_else(|| setting.data_type.decode(bytes).ok()?.as_u64()?.try_into().ok())
        };
        match setting.form {
            Form::NodeId => Some(Content::Number(self.node.id.get().into())),
            Form::BitRate => self.bit_rate.map(Content::Number),
            _ => match setting.stage {
                Stage::Tpdo(number) => self.of_tpdo(setting, self.tpdo(number)?),
                _ => match setting.form {
                    Form::CobId(_) => Some(Content::Number(word()? & 0x1fff_ffff)),
                    Form::Bit(bit, set) => Some(Content::Number(u32::from((word()? >> bit & 1 == 1) == set))),
                    _ => self.values.get(&setting.object).cloned().map(Content::Bytes),
                },
            },
        }
    }

    /// Returns the bit rate in bit/s, if it is known.
    pub fn bit_rate(&self) -> Option<u32> {
        self.bit_rate
    }

    /// Returns the settings of a TPDO.
    pub fn tpdo(&self, number: TpdoNumber) -> Option<&pdo::Settings> {
        self.tpdos.iter().find(|tpdo| tpdo.number == number)
    }

    /// Replaces the settings of a TPDO.
    pub(super) fn set_tpdo(&mut self, now: pdo::Settings) {
        if let Some(tpdo) = self.tpdos.iter_mut().find(|tpdo| tpdo.number == now.number) {
            *tpdo = now;
        }
        renew_tpdos(&mut self.node, &self.tpdos);
    }

    fn of_tpdo(&self, setting: &Setting, tpdo: &pdo::Settings) -> Option<Content> {
        let word = tpdo.cob_id.0;
        match setting.form {
            Form::Bit(bit, set) => Some(Content::Number(u32::from((word >> bit & 1 == 1) == set))),
            Form::CobId(_) => Some(Content::Number(CobId(word).0 & 0x1fff_ffff)),
            Form::Signals(_) if tpdo.multiplexed => None,
            Form::Signals(_) => Some(Content::Mapping(tpdo.mapping.clone())),
            Form::Transmission(_) => Some(Content::Bytes(vec![tpdo.transmission])),
            Form::Duration(100) => Some(Content::Bytes(tpdo.inhibit_100us?.to_le_bytes().to_vec())),
            _ => Some(Content::Bytes(tpdo.event_timer_ms?.to_le_bytes().to_vec())),
        }
    }

    /// Returns the bytes of an object.
    pub fn bytes(&self, object: ObjectId) -> Option<&[u8]> {
        self.values.get(&object).map(Vec::as_slice)
    }

    /// Returns the value of a setting in the form of a file.
    pub fn show(&self, setting: &Setting) -> Option<Item> {
        Some(setting.show(&self.node, &self.scales, &self.content(setting)?))
    }

    /// Whether a setting has its factory default; `None` if the default is unknown.
    pub fn is_default(&self, setting: &Setting) -> Option<bool> {
        Some(self.content(setting)? == self.default(setting)?)
    }

    /// Returns the factory default of a setting, if a description or EDS contains it without a `doubt`.
    pub fn default(&self, setting: &Setting) -> Option<Content> {
        let default = |object: ObjectId| {
            let is_doubtful = self.node.described(object).is_some_and(|entry| !entry.doubt.is_empty());
            let entry = self.node.model.as_ref()?.dictionary.get(object)?;
            entry.default_bytes(self.node.id).filter(|_| !is_doubtful)
        };
        match &setting.form {
            Form::NodeId | Form::BitRate => None,
            Form::CobId(id) => Some(Content::Number((*id).into())),
            Form::Bit(bit, set) => {
                let word = <[u8; 4]>::try_from(default(setting.object)?).ok().map(u32::from_le_bytes)?;
                Some(Content::Number(u32::from((word >> bit & 1 == 1) == *set)))
            }
            Form::Signals(number) => {
                let count = default(number.mapping(0))?.first().copied()?;
                let entry = |sub| <[u8; 4]>::try_from(default(number.mapping(sub))?).ok().map(u32::from_le_bytes);
                let words: Vec<u32> = (1..=count).map(entry).collect::<Option<_>>()?;
                Some(Content::Mapping(words.into_iter().map(crate::canopen::pdo::MappingEntry::from_word).collect()))
            }
            // The default holds only if unit and digits have their defaults.
            Form::Quantity(signal, _) => {
                let channel = self.node.signals.get(*signal)?.channel;
                let has_default = |low| {
                    let object = ObjectId::new(low, channel);
                    self.values.get(&object).is_none_or(|bytes| default(object).as_ref() == Some(bytes))
                };
                let is_integer = !matches!(setting.data_type, DataType::Real32 | DataType::Real64);
                let has_default_scale = has_default(0x6131) && (!is_integer || has_default(0x6132));
                default(setting.object).filter(|_| has_default_scale).map(Content::Bytes)
            }
            _ => default(setting.object).map(Content::Bytes),
        }
    }
}

/// Returns the objects that are read in addition to the settings: units and digits, bit rate, range, reference, dates.
fn extra_objects(node: &Node) -> Vec<(ObjectId, DataType)> {
    let mut objects = Vec::new();
    for signal in &node.signals {
        objects.extend([0x6131, 0x6132].map(|index| ObjectId::new(index, signal.channel)));
    }
    objects.extend(super::identity::objects(node));
    if let Some(model) = &node.model {
        objects.extend(model.dictionary.find("bit-rate").map(|entry| entry.object));
    }
    objects.retain(|object| node.may_have(*object));
    objects.into_iter().map(|object| (object, node.data_type(object))).collect()
}

/// The bytes of the objects, and the objects that the device refuses to read.
type Values = (BTreeMap<ObjectId, Vec<u8>>, Vec<(ObjectId, AbortCode)>);

fn read_objects(master: &mut Master<'_>, node: &Node, objects: &[(ObjectId, DataType)]) -> Result<Values, Failure> {
    let asked: Vec<_> = objects.iter().map(|&(object, _)| (node.id, object)).collect();
    let answers = Reader::new(master).read_optional(&asked)?;
    let (mut values, mut unreadable) = (BTreeMap::new(), Vec::new());
    for (&(object, data_type), answer) in objects.iter().zip(answers) {
        let checked = answer.map(|answer| {
            let fits = data_type.width().is_none() || answer.value(node.id, object, Some(data_type)).is_ok();
            let mut bytes = answer.uploaded.map(|uploaded| uploaded.bytes).unwrap_or_default();
            if let Some(width) = data_type.width().filter(|_| fits) {
                bytes.truncate(width);
            }
            if data_type == DataType::VisibleString {
                let end = bytes.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
                bytes.truncate(end);
            }
            bytes
        });
        match checked {
            Ok(bytes) => {
                values.insert(object, bytes);
            }
            Err(SdoError { failure: SdoFailure::Refused(AbortCode::NO_OBJECT | AbortCode::NO_SUB_INDEX), .. }) => {}
            Err(SdoError { failure: SdoFailure::Refused(code), .. }) => unreadable.push((object, code)),
            // An object without a valid answer is noted at the end of the command.
            Err(_) => {}
        }
    }
    Ok((values, unreadable))
}

/// Returns the bit rate setting of the device, if an object contains its code.
fn bit_rate(node: &Node, values: &BTreeMap<ObjectId, Vec<u8>>) -> Option<u32> {
    let model = node.model.as_ref()?;
    let code = *values.get(&model.dictionary.find("bit-rate")?.object)?.first()?;
    model.description.bit_rates_of(AssignKind::Objects).get(&code).copied()
}

/// Updates the units and digits of the signals.
pub(super) fn renew_signals(node: &mut Node, values: &BTreeMap<ObjectId, Vec<u8>>) {
    for signal in &mut node.signals {
        let bytes = |index: u16| values.get(&ObjectId::new(index, signal.channel));
        let unit = bytes(0x6131).and_then(|bytes| bytes.as_slice().try_into().ok()).map(u32::from_le_bytes);
        let digits = bytes(0x6132).and_then(|bytes| bytes.first().copied());
        signal.unit = unit.map(crate::device::unit::Unit).or(signal.unit);
        signal.digits = digits.or(signal.digits);
    }
}

/// Updates the TPDOs, because checks of identifiers use them.
pub(super) fn renew_tpdos(node: &mut Node, tpdos: &[pdo::Settings]) {
    for tpdo in &mut node.tpdos {
        if let Some(now) = tpdos.iter().find(|now| now.number == tpdo.number) {
            (tpdo.cob_id, tpdo.mapping) = (now.cob_id, now.mapping.clone());
            (tpdo.transmission, tpdo.event_timer_ms) = (Some(now.transmission()), now.event_timer_ms);
        }
    }
}
