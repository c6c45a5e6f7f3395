//! Reads an unknown device for a first version of its description: identity, readable objects, signals.

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::device::description::Access;
use crate::device::{profiles, standard};
use crate::master::{Master, SdoError, SdoFailure};
use crate::measure::layout::PROCESS_VALUES;
use crate::node::read::read_values;
use crate::node::{Node, Overrides};
use crate::tasks::Failure;
use crate::tasks::settings::open;
use std::collections::BTreeSet;

/// The facts that were read from a device.
#[derive(Clone, Debug)]
pub struct Draft {
    /// Identity, signals and TPDOs.
    pub node: Node,
    /// The objects of the device, in ascending order.
    pub objects: Vec<DraftObject>,
}

/// An object of the device.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftObject {
    /// Its address.
    pub object: ObjectId,
    /// The name in the EDS, the standard or the profile. It does not contain the sub-index.
    pub name: Option<String>,
    /// Whether several sub-indices have this name.
    pub is_numbered: bool,
    /// The data type; `None` if no source states it.
    pub data_type: Option<DataType>,
    /// Access by SDO.
    pub access: Access,
    /// The value read; `None` for an object that only the EDS contains.
    pub value: Option<Value>,
    /// Whether a TPDO can contain it.
    pub pdo: bool,
}

/// The number of channels of CiA 404 whose objects are searched.
const MAX_CHANNELS: usize = 16;

/// The objects that a channel has in each family of CiA 404: the index without its first digit.
const FAMILY_OBJECTS: [u16; 16] =
    [0x100, 0x120, 0x121, 0x122, 0x123, 0x124, 0x126, 0x127, 0x130, 0x133, 0x134, 0x135, 0x136, 0x138, 0x148, 0x149];

/// The objects of a channel that are the same for all families.
const CHANNEL_OBJECTS: [u16; 9] = [0x6110, 0x6111, 0x6112, 0x6114, 0x6131, 0x6132, 0x6150, 0x61a0, 0x61a1];

/// Reads a device.
///
/// # Errors
/// No answer, protocol errors, bus errors and Ctrl-C.
pub fn draft(master: &mut Master<'_>, node: NodeId, overrides: &Overrides) -> Result<Draft, Failure> {
    let node = open(master, node, overrides)?;
    let candidates: Vec<ObjectId> = candidates(&node).into_iter().collect();
    let data_type = |object: ObjectId| node.layout().data_type(object);
    let is_readable = |object: &&ObjectId| node.entry(**object).is_none_or(|entry| entry.access.is_readable());
    let readable: Vec<ObjectId> = candidates.iter().filter(is_readable).copied().collect();
    let items: Vec<_> =
        readable.iter().map(|&object| (node.id, object, data_type(object).unwrap_or(DataType::Domain))).collect();
    let mut values = Vec::new();
    for result in read_values(master, &items)? {
        values.push(match result {
            Ok(value) => Some(value),
            Err(SdoError { failure: SdoFailure::Refused(_) | SdoFailure::Fit(_), .. }) => None,
            Err(error) => return Err(error.into()),
        });
    }
    let mut found: Vec<DraftObject> = Vec::new();
    for (object, value) in readable.iter().zip(values) {
        found.extend(value.map(|value| draft_object(&node, *object, Some(value))));
    }
    let unreadable = candidates.iter().filter(|object| !readable.contains(object));
    found.extend(unreadable.map(|object| draft_object(&node, *object, None)));
    found.sort_by_key(|found| found.object);
    Ok(Draft { node, objects: found })
}

/// Returns the objects to read: from the EDS, else from the standard and the profile.
fn candidates(node: &Node) -> BTreeSet<ObjectId> {
    let mapped = node.tpdos.iter().flat_map(|tpdo| &tpdo.mapping).map(|entry| entry.object);
    let mut all: BTreeSet<ObjectId> = mapped.filter(|object| object.index >= 0x20).collect();
    for tpdo in &node.tpdos {
        all.extend((0..=6).map(|sub| tpdo.number.communication(sub)));
        all.extend((0..=8).map(|sub| tpdo.number.mapping(sub)));
    }
    if let Some(model) = node.model.as_ref().filter(|model| !model.dictionary.is_empty()) {
        all.extend(model.dictionary.iter().map(|entry| entry.object));
        return all;
    }
    all.extend(standard::single_objects());
    for signal in &node.signals {
        all.insert(signal.value_object.0);
        all.extend(signal.status);
    }
    for signal in node.channels().into_iter().take(MAX_CHANNELS) {
        all.extend(CHANNEL_OBJECTS.map(|index| ObjectId::new(index, signal.channel)));
        let families = PROCESS_VALUES.iter().map(|(index, _)| index & 0xf000);
        all.extend(families.flat_map(|family| FAMILY_OBJECTS.map(|low| ObjectId::new(family | low, signal.channel))));
    }
    all.extend(node.identity.profile().into_iter().flat_map(profiles::settings_of));
    all
}

fn draft_object(node: &Node, object: ObjectId, value: Option<Value>) -> DraftObject {
    let entry = node.entry(object);
    let layout = node.layout();
    let mut mapped = node.tpdos.iter().flat_map(|tpdo| &tpdo.mapping);
    let of_profile = || Some(layout.name_of(object)).filter(|name| *name != object.to_string());
    let name = entry.as_ref().map(|entry| entry.name.clone()).or_else(of_profile);
    DraftObject {
        object,
        is_numbered: entry.as_ref().is_some_and(|entry| entry.numbered),
        name,
        data_type: layout.data_type(object),
        access: entry.as_ref().map_or(Access::Ro, |entry| entry.access),
        pdo: entry.is_some_and(|entry| entry.pdo) || mapped.any(|entry| entry.object == object),
        value,
    }
}
