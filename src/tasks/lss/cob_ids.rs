//! What still goes by the old node-ID: COB-IDs that did not follow.

use crate::bus::Filters;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::master::{Error, Master};
use crate::node::read::read_values;
use std::fmt;

const EMERGENCY: ObjectId = ObjectId::new(0x1014, 0);

/// TPDOs that have a predefined COB-ID, and their function codes.
const FUNCTIONS: [(u16, u32); 4] = [(1, 0x180), (2, 0x280), (3, 0x380), (4, 0x480)];

/// A COB-ID of a device, and how it stands to its node-ID.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CobIds {
    /// TPDOs with the identifiers at which they are, where they are valid.
    pub tpdos: Vec<(u16, CanId)>,
    /// What is still where the old node-ID had it.
    pub stale: Vec<Stale>,
}

/// A COB-ID that is still that of the old node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stale {
    /// Where it stands.
    pub object: ObjectId,
    /// What stands there.
    pub cob_id: CobId,
    /// What the new node-ID would have there.
    pub expected: u32,
}

impl fmt::Display for Stale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is still 0x{:03X}", self.object, self.cob_id.can_id().number())
    }
}

/// Reads 1014h and the 180xh:1 of a node that was `old`, or had none.
///
/// # Errors
/// What stops everything. What the device does not tell is not among them.
pub(super) fn cob_ids(
    master: &mut Master<'_>,
    node: NodeId,
    old: Option<NodeId>,
    model: Option<&Model>,
) -> Result<CobIds, Error> {
    master.listen(&Filters::All)?;
    let described = |number: u16| {
        TpdoNumber::new(number)
            .filter(|number| model.is_none_or(|model| model.dictionary.has_index(number.communication(0).index)))
    };
    let tpdos: Vec<(TpdoNumber, u32)> =
        FUNCTIONS.iter().filter_map(|&(number, function)| Some((described(number)?, function))).collect();
    let objects = tpdos.iter().map(|&(number, function)| (number.communication(1), function));
    let objects: Vec<(ObjectId, u32)> = std::iter::once((EMERGENCY, 0x80)).chain(objects).collect();
    let items: Vec<_> = objects.iter().map(|&(object, _)| (node, object, DataType::Unsigned(4))).collect();
    let values = read_values(master, &items)?;
    let mut found = CobIds { tpdos: Vec::new(), stale: Vec::new() };
    for (&(object, function), value) in objects.iter().zip(values) {
        let Some(number) = value.ok().and_then(|value| value.as_u64()).and_then(|word| u32::try_from(word).ok()) else {
            continue;
        };
        let cob_id = CobId(number);
        let of = |node: NodeId| function + u32::from(node.get());
        if old.is_some_and(|old| old != node && cob_id.can_id().number() == of(old)) {
            found.stale.push(Stale { object, cob_id, expected: of(node) });
        }
        if let Some((number, _)) = tpdos.iter().find(|(number, _)| number.communication(1) == object)
            && cob_id.is_valid()
        {
            found.tpdos.push((number.get(), cob_id.can_id()));
        }
    }
    Ok(found)
}
