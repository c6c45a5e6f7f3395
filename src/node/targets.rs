//! The nodes that `all` selects.
//!
//! These are the nodes that a scan finds, and those that send a heartbeat, a boot-up message, a TPDO or a late answer
//! during the scan. Nodes that answer only some requests are included. The command must succeed with each node or
//! report its failure: no node is omitted silently.

use super::read::{Item, read_values};
use super::scan::{self, Presence};
use crate::bus::Filters;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::value::DataType;
use crate::master::{Error, Master};
use std::collections::BTreeSet;
use std::time::Duration;

/// Finds the nodes on the bus, in ascending order. `timeout` and `rounds` as in [`scan::find`].
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn all(master: &mut Master<'_>, timeout: Duration, rounds: u32) -> Result<Vec<NodeId>, Error> {
    let every: Vec<NodeId> = NodeId::all().collect();
    master.listen(&Filters::All)?;
    let presence = scan::find(master, &every, timeout, rounds)?;
    let mut nodes = presence.nodes();
    nodes.extend(nodes_by_tpdo(master, &presence)?);
    Ok(nodes.into_iter().collect())
}

/// Nodes that were detected only by a TPDO.
///
/// The COB-ID may belong to a TPDO of another node. So the TPDOs of the answering nodes are read first.
fn nodes_by_tpdo(master: &mut Master<'_>, presence: &Presence) -> Result<Vec<NodeId>, Error> {
    let known = presence.nodes();
    let unknown: Vec<_> = presence.tpdos.iter().filter(|(node, _)| !known.contains(node)).collect();
    if unknown.is_empty() {
        return Ok(Vec::new());
    }
    let numbers = || (1..=4).filter_map(TpdoNumber::new);
    let items: Vec<Item> = presence
        .answered
        .iter()
        .flat_map(|&node| numbers().map(move |number| (node, number.communication(1), DataType::Unsigned(4))))
        .collect();
    let words = read_values(master, &items)?.into_iter().filter_map(|word| word.ok()?.as_u64());
    let used: BTreeSet<CanId> = words.filter_map(|word| Some(CobId(u32::try_from(word).ok()?).can_id())).collect();
    Ok(unknown.into_iter().filter(|(_, ids)| !ids.is_subset(&used)).map(|(&node, _)| node).collect())
}
