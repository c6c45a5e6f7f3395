//! How to set the node-ID and bit rate of a device, and the tables of bit rate indices.

use super::description::Description;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use std::collections::BTreeMap;

/// One method to set node-ID and bit rate. The first one of a description is preferred.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssignEntry {
    /// The method.
    pub kind: AssignKind,
    /// The NMT state that the method requires; `None` for any.
    pub state: Option<AssignState>,
    /// Whether to retry in STOPPED if the device does not answer LSS.
    pub retry_stopped: bool,
    /// The object for the node-ID.
    pub node_id: Option<AssignObject>,
    /// The object for the index of the bit rate.
    pub bit_rate: Option<AssignObject>,
    /// Bit rates in bit/s by index, if the method has its own indices. Empty: the table of the device applies.
    pub bit_rates: BTreeMap<u8, u32>,
    /// The object that stores node-ID and bit rate when "save" is written to it. `None`: the device stores them by
    /// itself, or by the store service of LSS.
    pub store: Option<ObjectId>,
    /// When the new values take effect.
    pub applies: Applies,
    /// Whether no document confirms this method. An unverified method is used only if the user selects it.
    pub unverified: bool,
    /// Page or table of the manual.
    pub page: String,
    /// Contradictions and gaps in the manual.
    pub doubt: String,
}

impl AssignEntry {
    /// LSS as in CiA 305, for devices without a description.
    pub fn lss() -> AssignEntry {
        AssignEntry {
            kind: AssignKind::Lss,
            state: None,
            retry_stopped: false,
            node_id: None,
            bit_rate: None,
            bit_rates: BTreeMap::new(),
            store: None,
            applies: Applies::default(),
            unverified: false,
            page: String::new(),
            doubt: String::new(),
        }
    }
}

/// The method to set node-ID and bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssignKind {
    /// LSS (CiA 305).
    Lss,
    /// Manufacturer-specific objects, written by SDO.
    Objects,
}

/// The NMT state that a method requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssignState {
    /// PRE-OPERATIONAL.
    PreOperational,
    /// STOPPED.
    Stopped,
}

/// When a new node-ID or bit rate takes effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Applies {
    /// After a reset of the node.
    #[default]
    Reset,
    /// After a power cycle; it is unknown whether a reset is sufficient.
    Power,
}

/// An object for the node-ID or the index of the bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AssignObject {
    /// The object.
    pub object: ObjectId,
    /// Its type.
    pub data_type: DataType,
    /// Whether the number is written with the signature: `nn 's' 'e' 't'`, that is 0x746573nn.
    pub signature: bool,
}

impl AssignObject {
    /// Encodes `number` for this object.
    ///
    /// # Errors
    /// The type cannot hold the number.
    pub fn encode(&self, number: u8) -> Result<Vec<u8>, String> {
        if self.signature {
            return Ok(vec![number, b's', b'e', b't']);
        }
        self.data_type.encode_text(&number.to_string()).map_err(|error| error.to_string())
    }
}

/// A table of bit rates with their indices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RateTable {
    rates: BTreeMap<u8, u32>,
    /// The index that selects automatic bit rate detection, if the device has one.
    auto: Option<u8>,
    /// The origin of the table.
    pub source: RateSource,
}

/// The origin of a table of bit rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateSource {
    /// The description of the device.
    Device,
    /// The table of CiA 305, because the table of the device is unknown.
    Standard,
}

/// CiA 305, table 0. Index 5 is reserved. Index 9 (automatic detection) is used only if a description contains it.
const STANDARD: [(u8, u32); 8] =
    [(0, 1_000_000), (1, 800_000), (2, 500_000), (3, 250_000), (4, 125_000), (6, 50_000), (7, 20_000), (8, 10_000)];

impl RateTable {
    /// Returns the table of a device for a method, or the table of CiA 305 if the table of the device is unknown.
    pub fn of(description: Option<&Description>, method: AssignKind) -> RateTable {
        let own = description.map(|description| description.bit_rates_of(method)).filter(|rates| !rates.is_empty());
        let auto = description.and_then(|description| description.auto_bit_rate);
        match own {
            Some(rates) => RateTable { rates: rates.clone(), auto, source: RateSource::Device },
            None => RateTable { rates: STANDARD.into_iter().collect(), auto, source: RateSource::Standard },
        }
    }

    /// Returns the index of a bit rate in bit/s.
    pub fn index_of(&self, bit_rate: u32) -> Option<u8> {
        self.rates.iter().find(|(_, rate)| **rate == bit_rate).map(|(&index, _)| index)
    }

    /// Returns the bit rate of an index in bit/s.
    pub fn rate_of(&self, index: u8) -> Option<u32> {
        self.rates.get(&index).copied()
    }

    /// The index that selects automatic bit rate detection, if the device has one.
    pub fn auto(&self) -> Option<u8> {
        self.auto
    }

    /// Every bit rate in bit/s, the fastest first.
    pub fn rates(&self) -> Vec<u32> {
        let mut rates: Vec<u32> = self.rates.values().copied().collect();
        rates.sort_unstable_by(|a, b| b.cmp(a));
        rates
    }
}

/// Formats a bit rate in short form: `250k`, `1M`.
pub fn short_bit_rate(bit_rate: u32) -> String {
    match bit_rate {
        mega if mega > 0 && mega.is_multiple_of(1_000_000) => format!("{}M", mega / 1_000_000),
        kilo if kilo > 0 && kilo.is_multiple_of(1_000) => format!("{}k", kilo / 1_000),
        other => other.to_string(),
    }
}

impl Description {
    /// The preferred method: the first that a document confirms.
    pub fn preferred_assign(&self) -> Option<&AssignEntry> {
        self.assign.iter().find(|entry| !entry.unverified)
    }

    /// Returns the bit rates of a method in bit/s by index; empty if they are unknown.
    pub fn bit_rates_of(&self, method: AssignKind) -> &BTreeMap<u8, u32> {
        let own = self.assign_of_kind(method).map(|entry| &entry.bit_rates).filter(|rates| !rates.is_empty());
        own.unwrap_or(&self.bit_rates)
    }

    /// Returns the method of this kind, if the device has it.
    pub fn assign_of_kind(&self, kind: AssignKind) -> Option<&AssignEntry> {
        self.assign.iter().find(|entry| entry.kind == kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::catalog::{built_in, by_name};

    fn description(name: &str) -> Description {
        by_name(name).unwrap_or_else(|| panic!("{name} is built in")).description.clone()
    }

    #[test]
    fn each_device_has_its_own_table() {
        let dps = RateTable::of(Some(&description("dps")), AssignKind::Lss);
        assert_eq!((dps.index_of(100_000), dps.index_of(125_000), dps.index_of(800_000)), (Some(5), Some(4), None));
        assert_eq!((dps.auto(), dps.source), (None, RateSource::Device));
        assert_eq!(dps.rates(), [1_000_000, 500_000, 250_000, 125_000, 100_000, 50_000]);
        let mh4 = RateTable::of(Some(&description("mh4")), AssignKind::Objects);
        assert_eq!((mh4.auto(), mh4.index_of(100_000), mh4.rate_of(5)), (Some(9), None, None));
        // CiA 305: index 5 is reserved, and automatic detection (9) is not assumed.
        let standard = RateTable::of(None, AssignKind::Lss);
        assert_eq!((standard.rate_of(5), standard.rate_of(9), standard.auto()), (None, None, None));
        assert_eq!((standard.index_of(10_000), standard.source), (Some(8), RateSource::Standard));
        assert_eq!(RateTable::of(Some(&description("d20")), AssignKind::Lss).source, RateSource::Standard);
        // 2100h has other codes than LSS.
        let [lss, objects] =
            [AssignKind::Lss, AssignKind::Objects].map(|method| RateTable::of(Some(&description("baumer")), method));
        assert_eq!((lss.index_of(250_000), lss.index_of(800_000)), (Some(3), Some(1)));
        assert_eq!((objects.index_of(250_000), objects.index_of(800_000)), (Some(4), Some(6)));
    }

    #[test]
    fn numbers_are_written_with_their_signature() {
        let mh4 = description("mh4");
        assert_eq!(mh4.preferred_assign().map(|entry| entry.kind), Some(AssignKind::Lss));
        let objects = mh4.assign_of_kind(AssignKind::Objects).expect("2320h and 2321h");
        assert_eq!(objects.node_id.map(|place| place.encode(3)), Some(Ok(b"\x03set".to_vec())));
        // HYDAC and Baumer accept plain numbers without a signature.
        let baumer = description("baumer");
        let objects = baumer.preferred_assign().expect("2100h and 2101h");
        assert_eq!(objects.node_id.map(|place| place.encode(3)), Some(Ok(vec![3])));
    }

    #[test]
    fn unverified_methods_are_not_preferred() {
        let d20 = description("d20");
        assert_eq!(
            d20.preferred_assign().map(|entry| (entry.kind, entry.retry_stopped)),
            Some((AssignKind::Lss, true))
        );
        assert_eq!(d20.assign_of_kind(AssignKind::Objects).map(|entry| entry.unverified), Some(true));
    }

    #[test]
    fn every_method_has_its_objects() {
        for model in built_in() {
            let Description { name, assign, signals, .. } = &model.description;
            // Without a method, the description is for reading only.
            assert!(!assign.is_empty() || !signals.is_empty(), "{name}");
            for entry in assign {
                let places: Vec<AssignObject> = entry.node_id.into_iter().chain(entry.bit_rate).collect();
                assert_eq!(places.is_empty(), entry.kind == AssignKind::Lss, "{name}");
                for place in places {
                    // An unverified object may be missing.
                    let described = model.dictionary.get(place.object);
                    assert!(described.is_some() || entry.unverified, "{name}: {}", place.object);
                    let data_type = described.map_or(place.data_type, |described| described.data_type);
                    assert_eq!(data_type, place.data_type, "{name}: {}", place.object);
                    assert!(!place.signature || place.data_type == DataType::Unsigned(4), "{name}: {}", place.object);
                    assert!(place.encode(127).is_ok(), "{name}: {}", place.object);
                }
                assert!(entry.store.is_none_or(|object| model.dictionary.get(object).is_some()), "{name}");
                assert!(!entry.unverified || !entry.doubt.is_empty(), "{name}: say why it is unverified");
            }
        }
    }
}
