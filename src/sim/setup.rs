//! What a simulated device is told when it is put together.

use super::data::{SimChannel, SimData};
use super::model::Overload;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::catalog::Model;
use crate::device::scalar::Scalar;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// 1018h:4.
pub(super) const SERIAL_NUMBER: ObjectId = ObjectId::new(0x1018, 4);

/// What a device is told when it is put together.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Its kind.
    pub model: Arc<Model>,
    /// How its kind is simulated.
    pub sim: SimData,
    /// Its node-ID; none: it is unconfigured, and only LSS reaches it.
    pub node: Option<NodeId>,
    /// Its bit rate in bit/s; none: that of the bus on which its power comes on first.
    pub bit_rate: Option<u32>,
    /// Its serial number.
    pub serial: u32,
    /// Whether it becomes OPERATIONAL by itself.
    pub start: bool,
    /// Objects that were set and saved before.
    pub set: Vec<(ObjectId, Scalar)>,
    /// Its measuring channels.
    pub channels: Vec<SimChannel>,
    /// Overloads by channel.
    pub overloads: Vec<(u8, Overload)>,
    /// What makes the noise different from that of another run.
    pub seed: u64,
    /// What it does otherwise than it should.
    pub oddities: Oddities,
}

/// What a device does otherwise than it should.
#[derive(Clone, Debug, Default)]
pub struct Oddities {
    /// How long it thinks before it answers SDO and LSS.
    pub latency: Duration,
    /// LSS services whose next answer is lost, once for each time that it stands here. The service that
    /// switches selectively is 43h, the one that identifies 4Bh.
    pub lose: Vec<u8>,
    /// LSS services whose next answer comes that much later, once.
    pub late: BTreeMap<u8, Duration>,
    /// LSS services (11h, 13h, 17h) that are refused, with their error codes.
    pub refuse: BTreeMap<u8, u8>,
    /// Whether it answers every fastscan frame once it is in configuration state, as CANopenNode does.
    pub scans_for_ever: bool,
    /// After what it does not come back until its power goes off and on.
    pub gone_after: Vec<GoneAfter>,
}

/// After what a device does not come back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoneAfter {
    /// A reset of the node or of the communication.
    Reset,
    /// The activation of another bit rate by LSS.
    Activate,
}

impl Setup {
    /// A device as its description has it.
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
            oddities: Oddities::default(),
        }
    }
}
