//! Finds COB-IDs of a device that still belong to its old node-ID.

use crate::bus::Filters;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::master::{Error, Master};
use crate::node::read::read_values;

/// The object of the emergency COB-ID, and its function code.
const EMERGENCY: (ObjectId, u32) = (ObjectId::new(0x1014, 0), 0x080);

/// The TPDOs with a predefined COB-ID, and their function codes.
const TPDOS: [(u16, u32); 4] = [(1, 0x180), (2, 0x280), (3, 0x380), (4, 0x480)];

/// The COB-IDs of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CobIds {
    /// The valid TPDOs with their identifiers.
    pub tpdos: Vec<(u16, CanId)>,
    /// The COB-IDs that still contain the old node-ID.
    pub stale: Vec<StaleCobId>,
}

/// A COB-ID that still contains the old node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StaleCobId {
    /// The object.
    pub object: ObjectId,
    /// Its value.
    pub cob_id: CobId,
    /// The predefined value for the new node-ID.
    pub expected: u32,
}

/// Reads 1014h and 1800h:1 to 1803h:1 of a node. `old` is its previous node-ID.
///
/// # Errors
/// Bus errors and Ctrl-C. Objects that cannot be read are omitted.
pub(super) fn cob_ids(
    master: &mut Master<'_>,
    node: NodeId,
    old: Option<NodeId>,
    model: Option<&Model>,
) -> Result<CobIds, Error> {
    master.listen(&Filters::All)?;
    let may_have =
        |number: &TpdoNumber| model.is_none_or(|model| model.dictionary.has_index(number.communication(0).index));
    let tpdos: Vec<(TpdoNumber, u32)> = TPDOS
        .iter()
        .filter_map(|&(number, function)| Some((TpdoNumber::new(number).filter(may_have)?, function)))
        .collect();
    let of_tpdos = tpdos.iter().map(|&(number, function)| (number.communication(1), function));
    let objects: Vec<(ObjectId, u32)> = std::iter::once(EMERGENCY).chain(of_tpdos).collect();
    let items: Vec<_> = objects.iter().map(|&(object, _)| (node, object, DataType::Unsigned(4))).collect();
    let values = read_values(master, &items)?;
    let mut found = CobIds { tpdos: Vec::new(), stale: Vec::new() };
    for (&(object, function), value) in objects.iter().zip(values) {
        let number = value.ok().and_then(|value| value.as_u64()).and_then(|number| u32::try_from(number).ok());
        let Some(cob_id) = number.map(CobId) else { continue };
        let predefined = |node: NodeId| function + u32::from(node.get());
        if old.is_some_and(|old| old != node && cob_id.can_id().number() == predefined(old)) {
            found.stale.push(StaleCobId { object, cob_id, expected: predefined(node) });
        }
        let tpdo = tpdos.iter().find(|(number, _)| number.communication(1) == object);
        if let Some((number, _)) = tpdo.filter(|_| cob_id.is_valid()) {
            found.tpdos.push((number.get(), cob_id.can_id()));
        }
    }
    Ok(found)
}
