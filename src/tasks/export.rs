//! Exports the contents of TPDOs for other programs: bits, factor, offset and unit of each signal.

use super::Failure;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::TpdoNumber;
use crate::canopen::value::DataType;
use crate::device::scale::Scale;
use crate::device::unit::Unit;
use crate::master::Master;
use crate::measure::layout::Tpdo;
use crate::measure::reading::Reading;
use crate::node::survey::survey_each;
use crate::node::{Node, Overrides};
use std::collections::BTreeSet;

/// A TPDO with its signals.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The node that sends it.
    pub node: NodeId,
    /// The name of the device.
    pub device: Option<String>,
    /// The number of the TPDO.
    pub number: TpdoNumber,
    /// Its COB-ID.
    pub id: CanId,
    /// Its length in bytes.
    pub length: usize,
    /// Its signals, in the order of their bits.
    pub signals: Vec<MessageSignal>,
    /// Mapped objects whose type or decimal digits are unknown.
    pub unknown: Vec<ObjectId>,
    /// Whether another node sends with the same COB-ID.
    pub is_shared: bool,
}

/// A signal in a TPDO.
#[derive(Clone, Debug, PartialEq)]
pub struct MessageSignal {
    /// `pressure`, or the name of the object.
    pub name: String,
    /// The first bit.
    pub start: usize,
    /// The number of bits.
    pub bits: u8,
    /// The type of the number.
    pub data_type: DataType,
    /// The scaling from the number to the value.
    pub scale: Scale,
    /// The unit; `None` if the signal has no unit or if the unit is unknown.
    pub unit: Option<Unit>,
}

/// Reads the valid TPDOs of nodes. The second part of the result contains the failures of the other nodes.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn messages(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    overrides: &Overrides,
) -> Result<(Vec<Message>, Vec<Failure>), Failure> {
    master.listen_to(nodes)?;
    let (mut messages, mut failures, mut ids) = (Vec::new(), Vec::new(), BTreeSet::new());
    for result in survey_each(master, nodes, overrides)? {
        match result {
            Err(error) => failures.push(error.into()),
            Ok(node) => {
                for tpdo in node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()) {
                    let is_shared = !ids.insert(tpdo.cob_id.can_id());
                    messages.push(Message { is_shared, ..message(&node, tpdo) });
                }
            }
        }
    }
    Ok((messages, failures))
}

fn message(node: &Node, tpdo: &Tpdo) -> Message {
    let layout = node.layout();
    let (mut start, mut signals, mut unknown) = (0, Vec::new(), Vec::new());
    for entry in &tpdo.mapping {
        let (object, bits) = (entry.object, entry.bits);
        let data_type = layout.mapped_type(object, bits);
        let signal = node.signals.iter().find(|signal| signal.is_value(object));
        let status = node.signals.iter().find(|signal| signal.status == Some(object));
        let reading = match signal {
            Some(signal) => Reading::of_signal(signal, data_type, 0),
            None => Reading::of_object(layout, object, data_type, 0),
        };
        let name = signal.map(|signal| signal.name.clone()).or(status.map(|signal| format!("{}.status", signal.name)));
        let unit = signal.map_or_else(|| layout.unit_of(object), |signal| signal.unit);
        match data_type.zip(reading.scale()) {
            // Objects below 20h only fill gaps in the mapping.
            _ if object.index < 0x20 => {}
            Some((data_type, scale)) => {
                let name = name.unwrap_or_else(|| layout.name_of(object));
                signals.push(MessageSignal { name, start, bits, data_type, scale, unit });
            }
            None => unknown.push(object),
        }
        start += usize::from(bits);
    }
    Message {
        node: node.id,
        device: node.identity.name.clone(),
        number: tpdo.number,
        id: tpdo.cob_id.can_id(),
        length: start.div_ceil(8),
        signals,
        unknown,
        is_shared: false,
    }
}
