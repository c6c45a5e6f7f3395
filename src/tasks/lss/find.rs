//! Who takes part in LSS.

use super::subject::everybody_described;
use super::{Note, Tell};
use crate::bus::Filters;
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, LssRange};
use crate::device::catalog::{self, Model};
use crate::master::{Lss, LssError, Master};
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

/// Everybody who has a node-ID, by SDO, and those who have none, by fastscan. Each of these is set aside in
/// configuration state while the next one is looked for; nothing is changed in any of them.
///
/// # Errors
/// What stops everything, and a first fastscan that fails: a later one is said. Nobody there is an empty list.
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
    let unconfigured = unconfigured(&mut lss, tell);
    let left = lss.leave();
    let unconfigured = unconfigured?;
    left?;
    found.extend(unconfigured.into_iter().map(|address| {
        let model = catalog::by_identity(address.vendor, address.product);
        Slave { node: None, address: Some(address), model }
    }));
    Ok(found)
}

/// One after the other, until nobody answers any more.
fn unconfigured(lss: &mut Lss<'_, '_>, tell: Tell<'_>) -> Result<Vec<LssAddress>, LssError> {
    let mut found: Vec<LssAddress> = Vec::new();
    loop {
        let more = match lss.fastscan_beside(&found) {
            Ok(None) => return Ok(found),
            Ok(Some(address)) if !found.contains(&address) => {
                found.push(address);
                continue;
            }
            Ok(Some(_)) => "it answers again although it has been found".to_owned(),
            // What stops everything does; with nothing found the error is the answer.
            Err(error @ (LssError::Master(_) | LssError::Disturbed(_))) => return Err(error),
            Err(error) if found.is_empty() => return Err(error),
            Err(error) => error.to_string(),
        };
        let last = found.last().map(ToString::to_string).unwrap_or_default();
        tell(Note::Warning(format!(
            "whether there are more devices without a node-ID than {last} cannot be told ({more}): \
             once that one has been given one, ask again"
        )));
        return Ok(found);
    }
}

/// Whether there are slaves whose numbers lie within the limits.
///
/// # Errors
/// What stops everything.
pub fn identify(master: &mut Master<'_>, range: &LssRange) -> Result<bool, Failure> {
    master.listen(&Filters::All)?;
    Ok(master.lss().identify(range)?)
}
