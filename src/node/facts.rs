//! The facts that are known about one node.

use super::Overrides;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::TpdoNumber;
use crate::canopen::value::DataType;
use crate::device::catalog::{IdentityAnswers, Model};
use crate::device::unit::Unit;
use crate::measure::layout::{Layout, Signal, Tpdo};
use std::sync::Arc;

/// The identity that a node reports. A field is `None` if the node rejected the read or if the object was not read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// The device type (1000h).
    pub device_type: Option<u32>,
    /// The vendor-ID (1018h:1).
    pub vendor: Option<u32>,
    /// The product code (1018h:2).
    pub product: Option<u32>,
    /// The revision number (1018h:3).
    pub revision: Option<u32>,
    /// The serial number (1018h:4).
    pub serial: Option<u32>,
    /// The device name (1008h).
    pub name: Option<String>,
}

impl Identity {
    /// The number of the device profile, the low word of 1000h.
    pub fn profile(&self) -> Option<u32> {
        self.device_type.map(|device_type| device_type & 0xffff)
    }

    /// 1018h:1 to 4, as far as they are known.
    pub fn numbers(&self) -> [Option<u32>; 4] {
        [self.vendor, self.product, self.revision, self.serial]
    }

    /// Whether a description or EDS can be for this device: vendor and product agree. Unknown numbers are not compared.
    pub fn fits(&self, model: &Model) -> bool {
        model.made_for.iter().all(|device| device.fits(self.vendor, self.product))
    }

    /// The facts by which a device description is recognised.
    pub fn traits(&self) -> IdentityAnswers {
        IdentityAnswers {
            device_type: self.device_type,
            vendor_id: self.vendor,
            product_code: self.product,
            device_name: self.name.clone(),
            ..IdentityAnswers::default()
        }
    }
}

/// A node: its identity, its device description, its signals and its TPDOs.
#[derive(Clone, Debug)]
pub struct Node {
    /// The node-ID.
    pub id: NodeId,
    /// The identity that the node reports.
    pub identity: Identity,
    /// The device description, if the node was recognised or the user chose a description.
    pub model: Option<Arc<Model>>,
    /// Whether the description was searched for: `model: None` then means an unknown device.
    pub is_identified: bool,
    /// The signals.
    pub signals: Vec<Signal>,
    /// The TPDOs.
    pub tpdos: Vec<Tpdo>,
    /// Valid TPDOs without a known mapping, each with 1Axxh:0 if it was read: FEh and FFh mean multiplexed PDOs.
    pub not_decoded: Vec<(TpdoNumber, Option<u8>)>,
    /// The producer heartbeat time (1017h) in milliseconds: 0 if the node sends no heartbeat, `None` if unknown.
    pub heartbeat_ms: Option<u16>,
    /// The CAN-ID of its emergencies (1014h, else 080h + node-ID).
    pub emergency: CanId,
    /// Whether the error register (1001h) reports an overload that no status object reports.
    pub has_overload: bool,
    /// The CAN-ID of the SYNC that it receives (1005h, else 080h).
    pub sync: CanId,
    /// The synchronous counter overflow value (1019h), 2 to 240; `None` if the node expects SYNC without a counter.
    pub sync_overflow: Option<u8>,
}

impl Node {
    /// Creates a node of which only the node-ID is known.
    pub fn new(id: NodeId) -> Node {
        Node {
            id,
            identity: Identity::default(),
            model: None,
            is_identified: false,
            signals: Vec::new(),
            tpdos: Vec::new(),
            not_decoded: Vec::new(),
            heartbeat_ms: None,
            emergency: CanId::emergency(id),
            has_overload: false,
            sync: CanId::SYNC,
            sync_overflow: None,
        }
    }

    /// Creates a node of which only the node-ID and the description named by the user are known.
    pub fn with_overrides(id: NodeId, overrides: &Overrides) -> Node {
        let model = overrides.get(&id).cloned();
        Node { is_identified: model.is_some(), model, ..Node::new(id) }
    }

    /// Returns the unit that the description states for an object.
    pub fn fixed_unit(&self, object: ObjectId) -> Option<Unit> {
        self.model.as_ref()?.description.object(object)?.unit.as_deref().and_then(Unit::from_symbol)
    }

    /// The facts that decoding needs.
    pub fn layout(&self) -> Layout<'_> {
        Layout {
            node: self.id,
            profile: self.identity.profile(),
            model: self.model.as_deref(),
            signals: &self.signals,
            tpdos: &self.tpdos,
        }
    }

    /// Returns the type of a mapped object: see [`Layout::mapped_type`].
    pub fn mapped_type(&self, object: ObjectId, bits: u8) -> Option<DataType> {
        self.layout().mapped_type(object, bits)
    }

    /// The signals that the valid TPDOs carry.
    pub fn mapped_signals(&self) -> impl Iterator<Item = &Signal> {
        self.signals.iter().filter(|signal| {
            let mut entries = self.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).flat_map(|tpdo| &tpdo.mapping);
            entries.any(|entry| signal.is_value(entry.object))
        })
    }
}
