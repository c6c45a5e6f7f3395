//! Finds the nodes on the bus and reads their identities.

mod failure;

pub use failure::ScanFailure;

use crate::bus::Filters;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::master::{Error, Master};
use crate::node::scan::{self, Presence};
use crate::node::survey::identify_each;
use crate::node::{Node, Overrides};
use crate::tasks::Failure;
use std::time::Duration;

/// A node that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Its node-ID.
    pub node: NodeId,
    /// Its NMT state, if a heartbeat showed it.
    pub state: Option<NmtState>,
    /// Its identity and description, as far as they could be read.
    pub device: Node,
    /// Whether the description or EDS that the user named is for another device.
    pub is_other_device: bool,
    /// Why its identity could not be read.
    pub failure: Option<Failure>,
}

impl Found {
    fn new(node: NodeId, state: Option<NmtState>) -> Found {
        Found { node, state, device: Node::new(node), is_other_device: false, failure: None }
    }
}

/// Reads the device type of every node in parallel, then the identity of the nodes that answer.
///
/// Heartbeats and boot-up messages also show nodes, for example stopped nodes that cannot answer. Nodes without an
/// answer are asked `rounds` times in total; `timeout` is the waiting time after the first request to the last node.
///
/// # Errors
/// Bus errors and Ctrl-C. If there is no node, the list is empty.
pub fn scan(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    timeout: Duration,
    rounds: u32,
    overrides: &Overrides,
) -> Result<Vec<Found>, Error> {
    // If only one node is scanned, it may answer with another COB-ID.
    if nodes.len() == 1 {
        master.listen(&Filters::All)?
    } else {
        master.listen_to(nodes)?
    }
    let presence = scan::find(master, nodes, timeout, rounds)?;
    let answering: Vec<NodeId> = nodes.iter().copied().filter(|node| presence.answered.contains(node)).collect();
    master.listen_to(nodes)?;
    let mut found = found_nodes(&presence, nodes);
    if let (Some(error), []) = (&presence.other_channel, &found[..]) {
        found.push(Found { failure: Some(error.clone().into()), ..Found::new(error.node, None) });
    }
    for (node, result) in answering.iter().zip(identify_each(master, &answering, overrides)?) {
        let Some(entry) = found.iter_mut().find(|entry| entry.node == *node) else { continue };
        match result {
            Ok(node) => {
                entry.is_other_device = overrides.get(&node.id).is_some_and(|model| !node.identity.fits(model));
                entry.device = node;
            }
            Err(error) => entry.failure = Some(error.into()),
        }
    }
    // Heartbeats also arrive while the identities are read.
    found.iter_mut().for_each(|found| found.state = found.state.or(master.last_state(found.node)));
    // A file that is for another device is not used.
    let others: Vec<NodeId> = found.iter().filter(|found| found.is_other_device).map(|found| found.node).collect();
    for node in identify_each(master, &others, &Overrides::new())?.into_iter().flatten() {
        found.iter_mut().filter(|entry| entry.node == node.id).for_each(|entry| entry.device = node.clone());
    }
    Ok(found)
}

/// Listens for `duration` without sending anything. Identities come from the SDO answers that other masters received.
///
/// # Errors
/// Bus errors. Ctrl-C ends the scan early.
pub fn listen(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    duration: Duration,
    overrides: &Overrides,
) -> Result<Vec<Found>, Error> {
    let presence = scan::listen(master, duration)?;
    let mut found = found_nodes(&presence, nodes);
    for entry in &mut found {
        let identity = presence.overheard.identity(entry.node);
        let named = overrides.get(&entry.node).filter(|model| identity.fits(model)).cloned();
        entry.device.model = named.or_else(|| presence.overheard.recognise(entry.node));
        entry.device.identity = identity;
    }
    Ok(found)
}

/// Returns the requested nodes that were detected, in ascending order.
fn found_nodes(presence: &Presence, nodes: &[NodeId]) -> Vec<Found> {
    let of_node = |node| Found::new(node, presence.state(node));
    presence.nodes().into_iter().filter(|node| nodes.contains(node)).map(of_node).collect()
}
