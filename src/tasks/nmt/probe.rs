//! Reads the state of a node by switching on its heartbeat for a short time.

use crate::canopen::value::DataType;
use crate::master::{Error as MasterError, Master, SdoError, SdoFailure};
use crate::node::read::read_values;
use crate::node::state::{ErrorControlWatch, HEARTBEAT_TIME, Proof, StateReport};
use crate::node::write::{verify, write};
use crate::node::{Error, Node};
use crate::tasks::Failure;
use crate::tasks::journal::{Journal, TemporaryWrite};
use crate::tasks::nmt::NmtFailure;
use std::time::Duration;

/// The heartbeat time during the probe.
const PROBE_PERIOD: Duration = Duration::from_millis(100);

/// The number of further attempts to restore 1017h after Ctrl-C, or if the node has another value.
const MAX_ATTEMPTS: u32 = 5;

/// The result of a probe.
#[derive(Debug)]
pub struct Probe {
    /// The state, if it was received.
    pub report: StateReport,
    /// Why the probe failed.
    pub failure: Option<Failure>,
    /// The value of 1017h in milliseconds after the probe, if it was not restored.
    pub left: Option<UnrestoredHeartbeat>,
}

/// A heartbeat time that was not restored after a probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnrestoredHeartbeat {
    /// The heartbeat time in milliseconds.
    pub milliseconds: u16,
    /// The heartbeat time before the probe in milliseconds.
    pub before: u16,
    /// Whether the node acknowledged the time; otherwise 1017h may have either value.
    pub is_certain: bool,
}

/// Sets 1017h of a node, waits for a heartbeat, and always restores 1017h.
///
/// # Errors
/// Bus errors and Ctrl-C. A rejection or a missing answer of the node is in the result.
pub fn probe(master: &mut Master<'_>, node: &Node, journal: &mut dyn Journal) -> Result<Probe, MasterError> {
    let unknown = StateReport::unknown(node.id, true);
    let failed = |failure: Failure| Probe { report: unknown, failure: Some(failure), left: None };
    let before = match read_values(master, &[(node.id, HEARTBEAT_TIME, DataType::Unsigned(2))])?.pop() {
        Some(Err(error)) => return Ok(failed(error.into())),
        Some(Ok(value)) => value.as_u64().and_then(|time| u16::try_from(time).ok()).unwrap_or(0),
        None => 0,
    };
    let probe_time = u16::try_from(PROBE_PERIOD.as_millis()).unwrap_or(u16::MAX);
    let temporary = TemporaryWrite::to(node, HEARTBEAT_TIME, &before.to_le_bytes(), &probe_time.to_le_bytes());
    if let Err(error) = journal.record(&temporary) {
        return Ok(failed(Failure::at(node.id, NmtFailure::NotRecorded(error))));
    }
    let set = write(master, node, HEARTBEAT_TIME, &temporary.written);
    if let Err(Error::Sdo(error @ SdoError { failure: SdoFailure::Refused(_), .. })) = set {
        journal.remove(&temporary);
        return Ok(failed(error.into()));
    }
    let mut watch = ErrorControlWatch::default();
    let waited = match &set {
        Ok(_) => {
            let until = master.now() + PROBE_PERIOD + master.timing().timeout;
            watch.wait(master, until, &|watch| watch.state(node.id).is_some())
        }
        Err(_) => Ok(()),
    };
    let (restored, is_acknowledged) = restore(master, node, before);
    if restored.is_ok() {
        journal.remove(&temporary);
    }
    let milliseconds = match &restored {
        Err(Error::ReadBackDiffers { found, .. }) => found.as_u64().and_then(|time| u16::try_from(time).ok()),
        _ => None,
    };
    let is_certain = milliseconds.is_some() || set.is_ok() && !is_acknowledged;
    let left = UnrestoredHeartbeat { milliseconds: milliseconds.unwrap_or(probe_time), before, is_certain };
    let failure = node_failure(set)?;
    waited?;
    let (failure, left) = match node_failure(restored)? {
        None => (failure, None),
        Some(error) => (Some(error), Some(left)),
    };
    let report = watch.state(node.id).map_or(unknown, |state| StateReport::known(node.id, state, Proof::Heartbeat));
    Ok(Probe { report, failure, left })
}

/// Writes the old heartbeat time and reads it back, even after Ctrl-C. Also returns whether a write was acknowledged.
/// This does not prove the value: a frame with a flipped bit is acknowledged, too.
fn restore(master: &mut Master<'_>, node: &Node, before: u16) -> (Result<(), Error>, bool) {
    let mut is_acknowledged = false;
    let mut attempt = |master: &mut Master<'_>| {
        write(master, node, HEARTBEAT_TIME, &before.to_le_bytes())?;
        is_acknowledged = true;
        verify(master, node, HEARTBEAT_TIME, &before.to_le_bytes(), DataType::Unsigned(2))
    };
    let mut result = attempt(master);
    for _ in 0..MAX_ATTEMPTS {
        if !matches!(result, Err(Error::Interrupted | Error::ReadBackDiffers { .. })) {
            break;
        }
        result = attempt(master);
    }
    (result, is_acknowledged)
}

/// Returns the failure of the node itself. Bus errors and Ctrl-C are returned as errors.
fn node_failure<T>(result: Result<T, Error>) -> Result<Option<Failure>, MasterError> {
    match result {
        Ok(_) => Ok(None),
        Err(Error::Bus(error)) => Err(MasterError::Bus(error)),
        Err(Error::Interrupted) => Err(MasterError::Interrupted),
        Err(error) => Ok(Some(error.into())),
    }
}
