//! Who takes part in LSS.

use super::subject::everybody_described;
use super::{Note, Tell};
use crate::bus::Filters;
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, LssRange};
use crate::device::catalog::{self, Model};
use crate::master::Master;
use crate::tasks::Failure;
use std::sync::Arc;

/// A device that can be given a node-ID.
#[derive(Clone, Debug)]
pub struct Slave {
    /// Its node-ID; `None` of one that has none.
    pub node: Option<NodeId>,
    /// Its identity, where it tells all of it.
    pub address: Option<LssAddress>,
    /// Its description, where one is known.
    pub model: Option<Arc<Model>>,
}

/// Everybody who has a node-ID, by SDO, and one who has none, by fastscan: the next one shows itself when that one has
/// been given a node-ID.
///
/// # Errors
/// What stops everything. Nobody there is an empty list.
pub fn scan(master: &mut Master<'_>, tell: Tell<'_>) -> Result<Vec<Slave>, Failure> {
    let mut found: Vec<Slave> = everybody_described(master)?
        .into_iter()
        .map(|found| {
            let identity = &found.instrument.identity;
            let parts = [identity.vendor, identity.product, identity.revision, identity.serial];
            let address = match parts {
                [Some(vendor), Some(product), Some(revision), Some(serial)] => {
                    Some(LssAddress { vendor, product, revision, serial })
                }
                _ => None,
            };
            Slave { node: Some(found.node), address, model: found.instrument.model }
        })
        .collect();
    master.listen(&Filters::All)?;
    let mut lss = master.lss();
    let unconfigured = lss.fastscan();
    let left = lss.leave();
    let unconfigured = unconfigured?;
    left?;
    if let Some(address) = unconfigured {
        tell(Note::Step(
            "fastscan finds one device without a node-ID at a time: once that one has been given one, ask again"
                .to_owned(),
        ));
        let model = catalog::by_identity(address.vendor, address.product);
        found.push(Slave { node: None, address: Some(address), model });
    }
    Ok(found)
}

/// Whether there are slaves whose numbers lie within the limits.
///
/// # Errors
/// What stops everything.
pub fn identify(master: &mut Master<'_>, range: &LssRange) -> Result<bool, Failure> {
    master.listen(&Filters::All)?;
    Ok(master.lss().identify(range)?)
}
