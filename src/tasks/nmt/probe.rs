//! Finds a state out by switching the heartbeat on for a moment.

use super::{By, HEARTBEAT, Report, Watch};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::Life;
use crate::canopen::sdo::DownloadSize;
use crate::canopen::value::DataType;
use crate::master::{Error, Master, Request};
use crate::measure::survey::read_all;
use std::time::Duration;

/// The heartbeat that is set for a moment.
const PERIOD: Duration = Duration::from_millis(100);

/// What became of a probe.
#[derive(Debug)]
pub struct Probe {
    /// The state, if it came out.
    pub report: Report,
    /// What went wrong with setting 1017h or putting it back, in words.
    pub trouble: Option<String>,
}

/// Sets 1017h of a node, waits for a heartbeat and puts 1017h back, on every way out.
///
/// # Errors
/// What stops everything.
pub fn probe(master: &mut Master<'_>, node: NodeId) -> Result<Probe, Error> {
    let unknown = Report { node, state: None, by: By::None, present: true };
    let failed = |trouble: String| Ok(Probe { report: unknown, trouble: Some(trouble) });
    let before = match read_all(master, &[(node, HEARTBEAT, DataType::Unsigned(2))])?.pop() {
        Some(Ok(value)) => value.as_u64().and_then(|time| u16::try_from(time).ok()).unwrap_or(0),
        Some(Err(error)) => return failed(error.to_string()),
        None => return failed("nothing was read".to_owned()),
    };
    let set = |time: u16| Request::write(node, HEARTBEAT, time.to_le_bytes().to_vec(), DownloadSize::Indicated);
    let milliseconds = u16::try_from(PERIOD.as_millis()).unwrap_or(u16::MAX);
    if let Err(error) = master.transfer_one(set(milliseconds))? {
        return failed(error.to_string());
    }
    let mut watch = Watch::default();
    let until = master.now() + PERIOD + master.timing().timeout;
    let waited = watch.wait(master, until, &|watch| matches!(watch.lives.get(&node), Some(Life::State(_))));
    let restored = master.transfer_one(set(before));
    waited?;
    let trouble = match restored? {
        Ok(_) => None,
        Err(error) => Some(format!("{error}; 1017h stays at {} ms", PERIOD.as_millis())),
    };
    let report = match watch.lives.get(&node) {
        Some(Life::State(state)) => Report { state: Some(*state), by: By::Heartbeat, ..unknown },
        _ => unknown,
    };
    Ok(Probe { report, trouble })
}
