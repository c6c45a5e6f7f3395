//! A measuring device as it is set up at the moment: identity, signals with unit and digits, TPDOs.

use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber, Transmission};
use crate::canopen::value::DataType;
use crate::device::catalog::{Model, Traits};
use crate::device::unit::Unit;
use std::sync::Arc;

/// What a device says of itself; what it did not answer is `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:1.
    pub vendor: Option<u32>,
    /// 1018h:2.
    pub product: Option<u32>,
    /// 1018h:3.
    pub revision: Option<u32>,
    /// 1018h:4.
    pub serial: Option<u32>,
    /// 1008h.
    pub name: Option<String>,
}

impl Identity {
    /// The number of the device profile, the low word of 1000h.
    pub fn profile(&self) -> Option<u32> {
        self.device_type.map(|device_type| device_type & 0xffff)
    }

    /// What a recognition goes by.
    pub fn traits(&self) -> Traits {
        Traits {
            device_type: self.device_type,
            vendor_id: self.vendor,
            product_code: self.product,
            device_name: self.name.clone(),
            ..Traits::default()
        }
    }
}

/// One measured quantity of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// `pressure`, `temperature`, `ch1` …
    pub name: String,
    /// The CiA 404 channel.
    pub channel: u8,
    /// The object that holds the process value, and its type.
    pub value: (ObjectId, DataType),
    /// The same quantity under other indices.
    pub also: Vec<ObjectId>,
    /// 6150h, where the device has one.
    pub status: Option<ObjectId>,
    /// Whether an overload shows in the value itself.
    pub marker: bool,
    /// 6131h; `None` where the device does not tell.
    pub unit: Option<Unit>,
    /// 6132h; `None` where the device does not tell.
    pub digits: Option<u8>,
}

impl Signal {
    /// Whether `object` holds this signal's process value: the described ones, and with its channel as
    /// sub-index the four families of CiA 404 (6130h REAL32, 7130h INTEGER16, 8130h INTEGER24, 9130h
    /// INTEGER32).
    pub fn is_value(&self, object: ObjectId) -> bool {
        object == self.value.0
            || self.also.contains(&object)
            || object.sub == self.channel && PROCESS_VALUES.iter().any(|&(index, _)| index == object.index)
    }
}

/// The process value objects of CiA 404 and the types that the standard gives them, the exact one first.
pub const PROCESS_VALUES: [(u16, DataType); 4] = [
    (0x6130, DataType::Real32),
    (0x9130, DataType::Integer(4)),
    (0x8130, DataType::Integer(3)),
    (0x7130, DataType::Integer(2)),
];

/// A transmit PDO as it is set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tpdo {
    /// Which one.
    pub number: TpdoNumber,
    /// 180xh:1.
    pub cob_id: CobId,
    /// 180xh:2.
    pub transmission: Option<Transmission>,
    /// 180xh:5 in ms.
    pub event_timer_ms: Option<u16>,
    /// 1Axxh.
    pub mapping: Vec<MappingEntry>,
}

/// A measuring device as it is set up at the moment.
#[derive(Clone, Debug)]
pub struct Instrument {
    /// Its node-ID.
    pub node: NodeId,
    /// What it says of itself.
    pub identity: Identity,
    /// Its description, where one was recognised or given.
    pub model: Option<Arc<Model>>,
    /// What it measures.
    pub signals: Vec<Signal>,
    /// What it sends.
    pub tpdos: Vec<Tpdo>,
    /// 1017h in ms; 0 when it sends no heartbeat, `None` when it does not tell.
    pub heartbeat_ms: Option<u16>,
    /// Where its emergencies come from (1014h, else the predefined identifier).
    pub emergency: CanId,
    /// The SYNC identifier that it listens to (1005h, else 080h).
    pub sync: CanId,
}

impl Instrument {
    /// An instrument of which nothing is known yet.
    pub fn new(node: NodeId) -> Instrument {
        Instrument {
            node,
            identity: Identity::default(),
            model: None,
            signals: Vec::new(),
            tpdos: Vec::new(),
            heartbeat_ms: None,
            emergency: CanId::emergency(node),
            sync: CanId::SYNC,
        }
    }

    /// The type of an object: from the description, else the one that CiA 404 gives a process value, else
    /// an unsigned number of `bits`.
    pub fn data_type(&self, object: ObjectId, bits: u8) -> DataType {
        let described = self.model.as_ref().and_then(|model| model.dictionary.get(object)).map(|entry| entry.data_type);
        let wide_enough = |data_type: &DataType| data_type.width() == Some(usize::from(bits.div_ceil(8)));
        let standard =
            PROCESS_VALUES.iter().find(|&&(index, _)| index == object.index).map(|&(_, data_type)| data_type);
        described.or(standard).filter(wide_enough).unwrap_or(DataType::Unsigned(bits.div_ceil(8).clamp(1, 8)))
    }

    /// The signals that the valid TPDOs carry.
    pub fn mapped_signals(&self) -> impl Iterator<Item = &Signal> {
        self.signals.iter().filter(|signal| {
            let mut entries = self.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).flat_map(|tpdo| &tpdo.mapping);
            entries.any(|entry| signal.is_value(entry.object))
        })
    }
}
