//! What decoding needs to know of a node: its signals and the layout of its TPDOs.

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber, Transmission};
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::device::unit::Unit;

/// One measured signal of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// `pressure`, `temperature`, `ch1` …
    pub name: String,
    /// The CiA 404 channel.
    pub channel: u8,
    /// The object that holds the process value, and its type.
    pub value: (ObjectId, DataType),
    /// Other objects that hold the same process value.
    pub also: Vec<ObjectId>,
    /// The status object (6150h), if the node has one.
    pub status: Option<ObjectId>,
    /// Whether the smallest value of the type marks an overload.
    pub marker: bool,
    /// The physical unit (6131h); `None` if it is unknown.
    pub unit: Option<Unit>,
    /// The decimal digits (6132h); `None` if they are unknown.
    pub digits: Option<u8>,
}

impl Signal {
    /// Whether `object` holds the process value of this signal.
    ///
    /// True for the described objects, and for the four process value families of CiA 404 (6130h REAL32, 7130h
    /// INTEGER16, 8130h INTEGER24, 9130h INTEGER32) with the channel as sub-index.
    pub fn is_value(&self, object: ObjectId) -> bool {
        object == self.value.0
            || self.also.contains(&object)
            || object.sub == self.channel && PROCESS_VALUES.iter().any(|&(index, _)| index == object.index)
    }
}

/// The process value objects of CiA 404 with the types that the standard gives them, the most precise first.
pub const PROCESS_VALUES: [(u16, DataType); 4] = [
    (0x6130, DataType::Real32),
    (0x9130, DataType::Integer(4)),
    (0x8130, DataType::Integer(3)),
    (0x7130, DataType::Integer(2)),
];

/// The parameters and the mapping of a TPDO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tpdo {
    /// The number of the TPDO.
    pub number: TpdoNumber,
    /// The COB-ID (180xh:1).
    pub cob_id: CobId,
    /// The transmission type (180xh:2).
    pub transmission: Option<Transmission>,
    /// The event timer (180xh:5) in milliseconds.
    pub event_timer_ms: Option<u16>,
    /// The mapping (1Axxh).
    pub mapping: Vec<MappingEntry>,
}

/// Signals and TPDOs of one node, as far as decoding needs them.
#[derive(Clone, Copy, Debug)]
pub struct Layout<'a> {
    /// The node-ID.
    pub node: NodeId,
    /// The device description, if the node was recognised or the user named one.
    pub model: Option<&'a Model>,
    /// The signals.
    pub signals: &'a [Signal],
    /// The TPDOs.
    pub tpdos: &'a [Tpdo],
}

impl Layout<'_> {
    /// The type of a mapped object of `bits` bits.
    ///
    /// It comes from the description, else from CiA 404 for a process value. If neither fits the number of bits, it is
    /// an unsigned number.
    pub fn mapped_type(&self, object: ObjectId, bits: u8) -> DataType {
        let described = self.model.and_then(|model| model.dictionary.get(object)).map(|entry| entry.data_type);
        let fits = |data_type: &DataType| data_type.width() == Some(usize::from(bits.div_ceil(8)));
        let standard =
            PROCESS_VALUES.iter().find(|&&(index, _)| index == object.index).map(|&(_, data_type)| data_type);
        described.or(standard).filter(fits).unwrap_or(DataType::Unsigned(bits.div_ceil(8).clamp(1, 8)))
    }
}
