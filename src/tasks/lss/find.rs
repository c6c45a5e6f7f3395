//! Lists the devices whose node-ID can be set.

use super::device::DeviceName;
use super::event::{LssEvent, LssFact, Reason};
use super::{Notify, nodes};
use crate::bus::Filters;
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, LssRange};
use crate::device::catalog::{self, Model};
use crate::master::{Lss, LssError, Master};
use crate::tasks::{Failure, Note};
use std::sync::Arc;
use std::time::Duration;

/// A device whose node-ID can be set.
#[derive(Clone, Debug)]
pub struct FoundSlave {
    /// Its node-ID; `None` if it has none.
    pub node: Option<NodeId>,
    /// Its identity, if it reports all four numbers.
    pub address: Option<LssAddress>,
    /// Its description; `None` for an unknown device.
    pub model: Option<Arc<Model>>,
}

/// How long a search waits for devices without a node-ID.
#[derive(Clone, Copy, Debug)]
pub struct SearchTimes {
    /// The waiting time for the first answer, from the first request. Devices with a node-ID are searched meanwhile.
    pub first: Duration,
    /// The waiting time for further devices, after each of two requests. `None`: the time-out, and once more with
    /// pauses between the frames.
    pub further: Option<Duration>,
}

impl Default for SearchTimes {
    /// 450 ms for the first device, which is enough for a device that needs pauses between frames. All devices receive
    /// the first request, and most answer it while the node-IDs are scanned. So the wait for further devices is short.
    fn default() -> SearchTimes {
        SearchTimes { first: Duration::from_millis(450), further: Some(Duration::from_millis(75)) }
    }
}

impl SearchTimes {
    /// Returns times for slow devices: every wait is at least as long as this time-out.
    pub fn patient(timeout: Duration) -> SearchTimes {
        SearchTimes { first: timeout, further: None }
    }
}

/// Lists the devices with a node-ID (by SDO) and without a node-ID (by fastscan). A device found by fastscan stays in
/// configuration state while the next device is searched. Nothing is changed.
///
/// # Errors
/// Bus errors and Ctrl-C; the first fastscan failed. The failure of a later fastscan is an event. Without a device, the
/// list is empty.
pub fn scan(master: &mut Master<'_>, times: SearchTimes, notify: Notify<'_>) -> Result<Vec<FoundSlave>, Failure> {
    master.listen(&Filters::All)?;
    let asked = master.lss().ask_unconfigured()?;
    let mut slaves: Vec<FoundSlave> = nodes::find_identified(master)?
        .into_iter()
        .map(|found| FoundSlave {
            node: Some(found.node),
            address: nodes::address_of(&found.device),
            model: found.device.model,
        })
        .collect();
    master.listen(&Filters::All)?;
    let mut lss = master.lss();
    let unconfigured = match lss.has_unconfigured_slave(asked, times.first) {
        Ok(true) => find_unconfigured(&mut lss, times.further, notify),
        Ok(false) => Ok(Vec::new()),
        Err(error) => Err(error),
    };
    let leave_result = lss.leave();
    let unconfigured = unconfigured?;
    leave_result?;
    slaves.extend(unconfigured.into_iter().map(|address| {
        let model = catalog::by_identity(address.vendor, address.product);
        FoundSlave { node: None, address: Some(address), model }
    }));
    Ok(slaves)
}

/// Finds devices without a node-ID, until no further device answers.
fn find_unconfigured(
    lss: &mut Lss<'_, '_>,
    further: Option<Duration>,
    notify: Notify<'_>,
) -> Result<Vec<LssAddress>, LssError> {
    let mut found: Vec<LssAddress> = Vec::new();
    loop {
        let reason = match lss.fastscan_excluding(&found, further.filter(|_| !found.is_empty())) {
            Ok(None) => return Ok(found),
            Ok(Some(address)) if !found.contains(&address) => {
                found.push(address);
                continue;
            }
            Ok(Some(_)) => None,
            Err(error @ (LssError::Master(_) | LssError::Disturbed(_))) => return Err(error),
            // If no device was found, the error is the result.
            Err(error) if found.is_empty() => return Err(error),
            Err(error) => Some(Reason(Arc::new(error))),
        };
        let Some(&last) = found.last() else { return Ok(found) };
        let device = DeviceName { node: None, address: Some(last) };
        notify(Note::general(LssFact { device, event: LssEvent::MoreUnconfigured { last, reason } }));
        return Ok(found);
    }
}

/// Whether slaves have an identity in this range.
///
/// # Errors
/// Bus errors and Ctrl-C; an answer violates the protocol.
pub fn identify(master: &mut Master<'_>, range: &LssRange) -> Result<bool, Failure> {
    master.listen(&Filters::All)?;
    Ok(master.lss().identify(range)?)
}
