//! Finds devices that are plugged in one after the other (`config apply --prompt`).

use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::master::Master;
use crate::node::Overrides;
use crate::node::wait::{Policy, pause};
use crate::tasks::lss::{Descriptions, FoundSlave, Job, SearchTimes, Target, Via, assign, scan};
use crate::tasks::{Failure, Kind, Note};
use std::time::Duration;

/// The time between two searches.
const SEARCH_INTERVAL: Duration = Duration::from_secs(1);

/// A device is unplugged if it is missing in this many searches in succession. In one search it may be restarting.
const MISSED_SEARCHES: u32 = 2;

/// Finds devices that are new on the bus.
#[derive(Clone, Debug, Default)]
pub struct Arrivals {
    /// The devices that are not new. `None` before the first search.
    known: Option<Vec<FoundSlave>>,
    misses: u32,
}

/// Whether two searches found the same device.
fn is_same(one: &FoundSlave, other: &FoundSlave) -> bool {
    one.node == other.node && one.address == other.address
}

/// Whether a device has no node-ID, or the factory node-ID of its kind.
fn is_unconfigured(found: &FoundSlave) -> bool {
    let factory = found.model.as_ref().and_then(|model| model.description.factory.node_id);
    found.node.is_none() || factory == found.node
}

impl Arrivals {
    /// Searches once for new devices, and changes nothing. A device is new if it was not on the bus before. In the
    /// first search, a device is new if it has no node-ID or the factory node-ID of its kind.
    ///
    /// # Errors
    /// Bus errors and Ctrl-C.
    pub fn search(&mut self, master: &mut Master<'_>) -> Result<Vec<FoundSlave>, Failure> {
        let Some(found) = search_bus(master)? else { return Ok(Vec::new()) };
        let known =
            self.known.get_or_insert_with(|| found.iter().filter(|one| !is_unconfigured(one)).cloned().collect());
        known.retain(|one| found.iter().any(|other| is_same(one, other)));
        Ok(found.into_iter().filter(|one| !known.iter().any(|other| is_same(one, other))).collect())
    }

    /// Searches once for the configured device. Returns `true` if it was missing in two searches in succession.
    ///
    /// # Errors
    /// Bus errors and Ctrl-C.
    pub fn is_unplugged(&mut self, master: &mut Master<'_>, device: &FoundSlave) -> Result<bool, Failure> {
        let Some(found) = search_bus(master)? else { return Ok(false) };
        let is_device = |other: &FoundSlave| match device.address {
            Some(address) => other.address == Some(address),
            None => other.node == device.node,
        };
        self.misses = if found.iter().any(is_device) { 0 } else { self.misses + 1 };
        let is_gone = self.misses == MISSED_SEARCHES;
        if is_gone {
            self.misses = 0;
        }
        Ok(is_gone)
    }
}

/// Waits for [`SEARCH_INTERVAL`], and returns the devices on the bus. Returns `None` if a service was disturbed, for
/// example by a device that is being plugged in.
fn search_bus(master: &mut Master<'_>) -> Result<Option<Vec<FoundSlave>>, Failure> {
    // Without any device on the bus, no node acknowledges the requests.
    master.set_tolerates_outages(true);
    let paused = pause(master, master.now() + SEARCH_INTERVAL, Policy::Reconnect);
    let found = paused.map_err(Failure::from).and_then(|()| scan(master, SearchTimes::default(), &mut |_| {}));
    master.set_tolerates_outages(false);
    match found {
        Ok(found) => Ok(Some(found)),
        Err(failure) if matches!(failure.kind(), Kind::Bus | Kind::Interrupted) => Err(failure),
        Err(_) => Ok(None),
    }
}

/// Gives a device without a node-ID its node-ID. The device is addressed by its identity.
///
/// # Errors
/// The errors of [`assign`].
pub fn assign_first(
    master: &mut Master<'_>,
    address: LssAddress,
    id: NodeId,
    overrides: &Overrides,
    notify: &mut dyn FnMut(Note),
) -> Result<(), Failure> {
    let job = Job {
        target: Target::Address(address),
        id: Some(id),
        rate: None,
        store: true,
        retime: false,
        via: Via::Auto,
        force: false,
        descriptions: Descriptions { overrides, given: overrides.get(&id) },
    };
    assign(master, &job, notify).map(drop)
}
