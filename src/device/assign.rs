//! How a device is given its node-ID and bit rate: the ways that lead there, as data, and the indices that stand
//! for bit rates.

use super::description::Description;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use std::collections::BTreeMap;

/// One way to a new node-ID and bit rate. The first one that a description has is the one to take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssignEntry {
    /// By which means.
    pub way: AssignWay,
    /// The NMT state that the device wants for it; any, where nothing is said.
    pub state: Option<AssignState>,
    /// Whether a device that does not answer LSS is asked once more in STOPPED.
    pub retry_stopped: bool,
    /// Where the node-ID is written.
    pub node_id: Option<AssignPlace>,
    /// Where the index of the bit rate is written.
    pub bit_rate: Option<AssignPlace>,
    /// The object that makes it last, written with "save"; none where the device keeps it by itself. LSS has its own
    /// service for that.
    pub store: Option<ObjectId>,
    /// What brings it into force.
    pub applies: Applies,
    /// No source prints it: it is done only when it is asked for by name.
    pub unverified: bool,
    /// Page or table of the manual.
    pub page: String,
    /// What the manual contradicts or leaves open.
    pub doubt: String,
}

impl AssignEntry {
    /// LSS as the standard has it, for devices of which nothing else is known.
    pub fn lss() -> AssignEntry {
        AssignEntry {
            way: AssignWay::Lss,
            state: None,
            retry_stopped: false,
            node_id: None,
            bit_rate: None,
            store: None,
            applies: Applies::default(),
            unverified: false,
            page: String::new(),
            doubt: String::new(),
        }
    }
}

/// By which means a device takes its node-ID and bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssignWay {
    /// CiA 305.
    Lss,
    /// Objects of its own, by SDO.
    Objects,
}

/// The NMT state that a device wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssignState {
    /// PRE-OPERATIONAL.
    PreOperational,
    /// STOPPED.
    Stopped,
}

/// What brings a new node-ID or bit rate into force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Applies {
    /// A reset of the node.
    #[default]
    Reset,
    /// Power off and on; whether a reset does as well is not known.
    Power,
}

/// An object that takes a node-ID or the index of a bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AssignPlace {
    /// Where.
    pub object: ObjectId,
    /// Its type.
    pub data_type: DataType,
    /// Whether the number goes with the signature: `nn 's' 'e' 't'`, that is 0x746573nn.
    pub signature: bool,
}

impl AssignPlace {
    /// The bytes that set `number`.
    ///
    /// # Errors
    /// In words, when the type cannot take the number.
    pub fn encode(&self, number: u8) -> Result<Vec<u8>, String> {
        if self.signature {
            return Ok(vec![number, b's', b'e', b't']);
        }
        self.data_type.encode_text(&number.to_string()).map_err(|error| error.to_string())
    }
}

/// Which index stands for which bit rate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RateTable {
    rates: BTreeMap<u8, u32>,
    /// The index of automatic detection, if there is one.
    auto: Option<u8>,
    /// Whose it is.
    pub source: RateSource,
}

/// Whose table of bit rates it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateSource {
    /// The description of the device has it.
    Device,
    /// Nothing is known of the device's own: it is that of CiA 305.
    Standard,
}

/// CiA 305, table 0. 5 is reserved; 9 is automatic detection, which few devices have and each must say itself.
const STANDARD: [(u8, u32); 8] =
    [(0, 1_000_000), (1, 800_000), (2, 500_000), (3, 250_000), (4, 125_000), (6, 50_000), (7, 20_000), (8, 10_000)];

impl RateTable {
    /// The table of a device; that of CiA 305 where its own is not known.
    pub fn of(description: Option<&Description>) -> RateTable {
        let own = description.filter(|description| !description.bit_rates.is_empty());
        let auto = description.and_then(|description| description.auto_bit_rate);
        match own {
            Some(description) => RateTable { rates: description.bit_rates.clone(), auto, source: RateSource::Device },
            None => RateTable { rates: STANDARD.into_iter().collect(), auto, source: RateSource::Standard },
        }
    }

    /// The index of a bit rate in bit/s.
    pub fn index_of(&self, bit_rate: u32) -> Option<u8> {
        self.rates.iter().find(|(_, rate)| **rate == bit_rate).map(|(&index, _)| index)
    }

    /// The bit rate of an index in bit/s.
    pub fn rate_of(&self, index: u8) -> Option<u32> {
        self.rates.get(&index).copied()
    }

    /// The index of automatic detection, if the device has it.
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

/// A bit rate as people write it: `250k`, `1M`.
pub fn spoken_rate(bit_rate: u32) -> String {
    match bit_rate {
        mega if mega > 0 && mega.is_multiple_of(1_000_000) => format!("{}M", mega / 1_000_000),
        kilo if kilo > 0 && kilo.is_multiple_of(1_000) => format!("{}k", kilo / 1_000),
        other => other.to_string(),
    }
}

impl Description {
    /// The way to take when the user has not said which: the first that a source prints.
    pub fn assign_way(&self) -> Option<&AssignEntry> {
        self.assign.iter().find(|entry| !entry.unverified)
    }

    /// The way by these means, if the device has one.
    pub fn assign_by(&self, way: AssignWay) -> Option<&AssignEntry> {
        self.assign.iter().find(|entry| entry.way == way)
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
        let dps = RateTable::of(Some(&description("dps")));
        assert_eq!((dps.index_of(100_000), dps.index_of(125_000), dps.index_of(800_000)), (Some(5), Some(4), None));
        assert_eq!((dps.auto(), dps.source), (None, RateSource::Device));
        assert_eq!(dps.rates(), [1_000_000, 500_000, 250_000, 125_000, 100_000, 50_000]);
        let mh4 = RateTable::of(Some(&description("mh4")));
        assert_eq!((mh4.auto(), mh4.index_of(100_000), mh4.rate_of(5)), (Some(9), None, None));
        // CiA 305 has 5 reserved, and what is not known to be there is not there: 9.
        let standard = RateTable::of(None);
        assert_eq!((standard.rate_of(5), standard.rate_of(9), standard.auto()), (None, None, None));
        assert_eq!((standard.index_of(10_000), standard.source), (Some(8), RateSource::Standard));
        assert_eq!(RateTable::of(Some(&description("d20"))).source, RateSource::Standard);
    }

    #[test]
    fn numbers_go_with_their_signature() {
        let mh4 = description("mh4");
        assert_eq!(mh4.assign_way().map(|entry| entry.way), Some(AssignWay::Lss));
        let objects = mh4.assign_by(AssignWay::Objects).expect("2320h and 2321h");
        assert_eq!(objects.node_id.map(|place| place.encode(3)), Some(Ok(b"\x03set".to_vec())));
        // HYDAC and Baumer take plain numbers.
        let baumer = description("baumer");
        let objects = baumer.assign_way().expect("2100h and 2101h");
        assert_eq!(objects.node_id.map(|place| place.encode(3)), Some(Ok(vec![3])));
    }

    #[test]
    fn what_no_source_prints_is_done_only_when_asked_for() {
        let d20 = description("d20");
        assert_eq!(d20.assign_way().map(|entry| (entry.way, entry.retry_stopped)), Some((AssignWay::Lss, true)));
        assert_eq!(d20.assign_by(AssignWay::Objects).map(|entry| entry.unverified), Some(true));
    }

    #[test]
    fn every_way_leads_somewhere() {
        for model in built_in() {
            let Description { name, assign, .. } = &model.description;
            assert!(!assign.is_empty(), "{name}");
            for entry in assign {
                let places: Vec<AssignPlace> = entry.node_id.into_iter().chain(entry.bit_rate).collect();
                assert_eq!(places.is_empty(), entry.way == AssignWay::Lss, "{name}");
                for place in places {
                    // What is known by name alone is no entry.
                    let described = model.dictionary.get(place.object);
                    assert_eq!(described.is_none(), entry.unverified, "{name}: {}", place.object);
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
