//! Finds the nodes on the bus by SDO.

use super::failure::{LssCause, LssFailure};
use crate::bus::Filters;
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::master::Master;
use crate::node::{Node, Overrides};
use crate::tasks::Failure;
use crate::tasks::scan::{Found, scan};
use std::time::Duration;

/// The waiting time for answers after the last request of the first round of an SDO scan.
const SCAN_TIMEOUT: Duration = Duration::from_millis(200);

/// The number of requests to a silent node.
const SCAN_ROUNDS: u32 = 2;

/// Returns every node that answers, with its identity.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub(super) fn find_identified(master: &mut Master<'_>) -> Result<Vec<Found>, Failure> {
    let all: Vec<NodeId> = NodeId::all().collect();
    let found = scan(master, &all, SCAN_TIMEOUT, SCAN_ROUNDS, &Overrides::new())?;
    master.listen(&Filters::All)?;
    Ok(found)
}

/// Returns every node that answers.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub(super) fn find_ids(master: &mut Master<'_>) -> Result<Vec<NodeId>, Failure> {
    Ok(find_identified(master)?.into_iter().map(|found| found.node).collect())
}

/// Returns the LSS address that a node reports, if it reports all four parts.
pub(super) fn address_of(node: &Node) -> Option<LssAddress> {
    let identity = &node.identity;
    Some(LssAddress {
        vendor: identity.vendor?,
        product: identity.product?,
        revision: identity.revision?,
        serial: identity.serial?,
    })
}

/// Returns the nodes that report this identity.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub(super) fn find_by_identity(master: &mut Master<'_>, address: LssAddress) -> Result<Vec<NodeId>, Failure> {
    let found = find_identified(master)?;
    Ok(found.iter().filter(|found| address_of(&found.device) == Some(address)).map(|found| found.node).collect())
}

/// Rejects an identity that another node also has, because LSS would address both nodes. Some vendors give all devices
/// the same serial number.
///
/// # Errors
/// [`LssCause::SameIdentity`]; bus errors and Ctrl-C.
pub(super) fn refuse_shared_identity(
    master: &mut Master<'_>,
    address: LssAddress,
    node: Option<NodeId>,
) -> Result<(), Failure> {
    let Some(other) = find_by_identity(master, address)?.into_iter().find(|&other| Some(other) != node) else {
        return Ok(());
    };
    let device = super::DeviceName { node, address: Some(address) };
    Err(Failure::general(LssFailure { device, cause: LssCause::SameIdentity(other) }))
}
