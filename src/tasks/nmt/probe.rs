//! Finds a state out by switching the heartbeat on for a moment.

use crate::canopen::id::NodeId;
use crate::canopen::nmt::Life;
use crate::canopen::sdo::DownloadSize;
use crate::canopen::value::DataType;
use crate::master::{Answer, Error, Master, Request, SdoError, SdoFailure};
use crate::node::read::read_values;
use crate::node::state::{HEARTBEAT_TIME, LifeWatch, Proof, StateReport};
use std::time::Duration;

/// The heartbeat that is set for a moment.
const PERIOD: Duration = Duration::from_millis(100);

/// How many more requests to stop are passed over until 1017h is put back.
const DEAF: u32 = 5;

/// What became of a probe.
#[derive(Debug)]
pub struct Probe {
    /// The state, if it came out.
    pub report: StateReport,
    /// What went wrong with setting 1017h or putting it back, in words.
    pub trouble: Option<String>,
}

/// Sets 1017h of a node, waits for a heartbeat and puts 1017h back, on every way out.
///
/// # Errors
/// What stops everything.
pub fn probe(master: &mut Master<'_>, node: NodeId) -> Result<Probe, Error> {
    let unknown = StateReport { node, state: None, by: Proof::None, is_present: true };
    let failed = |trouble: String| Ok(Probe { report: unknown, trouble: Some(trouble) });
    let before = match read_values(master, &[(node, HEARTBEAT_TIME, DataType::Unsigned(2))])?.pop() {
        Some(Ok(value)) => value.as_u64().and_then(|time| u16::try_from(time).ok()).unwrap_or(0),
        Some(Err(error)) => return failed(error.to_string()),
        None => return failed("nothing was read".to_owned()),
    };
    let set = |time: u16| Request::write(node, HEARTBEAT_TIME, time.to_le_bytes().to_vec(), DownloadSize::Indicated);
    let milliseconds = u16::try_from(PERIOD.as_millis()).unwrap_or(u16::MAX);
    let begun = master.transfer_one(set(milliseconds));
    if let Ok(Err(error @ SdoError { failure: SdoFailure::Refused(_), .. })) = &begun {
        return failed(error.to_string());
    }
    let mut watch = LifeWatch::default();
    let waited = match &begun {
        Ok(Ok(_)) => {
            let until = master.now() + PERIOD + master.timing().timeout;
            watch.wait(master, until, &|watch| matches!(watch.lives.get(&node), Some(Life::State(_))))
        }
        // Without an answer it may have been set all the same.
        Ok(Err(_)) | Err(_) => Ok(()),
    };
    let restored = put_back(master, &set(before));
    let begun = begun?;
    waited?;
    let trouble = match (begun, restored?) {
        (Ok(_), Ok(_)) => None,
        (Err(error), Ok(_)) => Some(error.to_string()),
        (Ok(_), Err(error)) => Some(format!("{error}; 1017h stays at {milliseconds} ms")),
        (Err(_), Err(error)) => Some(format!("{error}; 1017h may stay at {milliseconds} ms")),
    };
    let report = match watch.lives.get(&node) {
        Some(Life::State(state)) => StateReport { state: Some(*state), by: Proof::Heartbeat, ..unknown },
        _ => unknown,
    };
    Ok(Probe { report, trouble })
}

/// Writes what was there before, whatever asks to stop in the meantime.
fn put_back(master: &mut Master<'_>, write: &Request) -> Result<Result<Answer, SdoError>, Error> {
    let mut result = master.transfer_one(write.clone());
    for _ in 0..DEAF {
        if !matches!(result, Err(Error::Interrupted)) {
            break;
        }
        result = master.transfer_one(write.clone());
    }
    result
}
