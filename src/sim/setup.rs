//! The settings of a simulated device before it is switched on.

use super::data::{SimChannel, SimData};
use super::model::Overload;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::catalog::Model;
use crate::device::scalar::Scalar;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// The serial number.
pub(super) const SERIAL_NUMBER: ObjectId = ObjectId::new(0x1018, 4);

/// The settings of a simulated device before it is switched on.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Its description.
    pub model: Arc<Model>,
    /// The simulator's data for this kind of device.
    pub sim: SimData,
    /// The node-ID; `None`: the device is unconfigured and answers only LSS.
    pub node: Option<NodeId>,
    /// The bit rate in bit/s; `None`: the bit rate of the bus at the first power-on.
    pub bit_rate: Option<u32>,
    /// Its serial number.
    pub serial: u32,
    /// Whether the device becomes OPERATIONAL by itself.
    pub start: bool,
    /// Objects with a stored value.
    pub set: Vec<(ObjectId, Scalar)>,
    /// Its measured quantities.
    pub channels: Vec<SimChannel>,
    /// Overloads by channel.
    pub overloads: Vec<(u8, Overload)>,
    /// Seed of the noise.
    pub seed: u64,
    /// Faults and deviations.
    pub oddities: SimulatedFaults,
}

/// Faults and deviations of a device.
#[derive(Clone, Debug, Default)]
pub struct SimulatedFaults {
    /// Response time of SDO and LSS.
    pub latency: Duration,
    /// LSS services whose next answer is lost, once per entry. The selective switch is 43h, the identification 4Bh.
    pub lose: Vec<u8>,
    /// LSS services whose next answer is delayed, once.
    pub late: BTreeMap<u8, Duration>,
    /// LSS services (11h, 13h, 17h) that are rejected, with their error codes.
    pub refuse: BTreeMap<u8, u8>,
    /// Whether the device answers every fastscan frame in configuration state, as CANopenNode does.
    pub endless_fastscan: bool,
    /// If not empty, only SDO requests for these objects are answered.
    pub answers_only: Vec<ObjectId>,
    /// Events after which the device is offline until a power cycle.
    pub offline_after: Vec<OfflineAfter>,
    /// The time from plugging in to unplugging. `None`: the device is always connected.
    pub connected: Option<Range<Duration>>,
}

/// An event after which a device is offline until a power cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OfflineAfter {
    /// A reset of the node or of the communication.
    Reset,
    /// The activation of another bit rate by LSS.
    Activate,
}

impl Setup {
    /// Creates a device with the values of its description.
    pub fn new(model: Arc<Model>, node: NodeId) -> Setup {
        let sim = SimData::of(&model);
        let channels = sim.channels.clone();
        let serial = model.dictionary.get(SERIAL_NUMBER).and_then(|entry| entry.default_bytes(node));
        let serial = serial.and_then(|bytes| bytes.try_into().ok()).map_or(1, u32::from_le_bytes);
        Setup {
            model,
            sim,
            node: Some(node),
            bit_rate: None,
            serial,
            start: false,
            set: Vec::new(),
            channels,
            overloads: Vec::new(),
            seed: 0,
            oddities: SimulatedFaults::default(),
        }
    }
}
