//! What a simulated device is told when it is put together.

use super::model::Overload;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::catalog::Model;
use crate::device::description::{Scalar, SimChannel};
use std::sync::Arc;

/// What a device is told when it is put together.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Its kind.
    pub model: Arc<Model>,
    /// Its node-ID.
    pub node: NodeId,
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
}

impl Setup {
    /// A device as its description has it.
    pub fn new(model: Arc<Model>, node: NodeId) -> Setup {
        let sim = &model.description.sim;
        let (serial, channels) = (sim.serial, sim.channels.clone());
        Setup { model, node, serial, start: false, set: Vec::new(), channels, overloads: Vec::new(), seed: 0 }
    }
}
