//! PRE-OPERATIONAL for the time of a change, and the state before it afterwards.

use super::device::{Device, Trouble};
use crate::bus::Filters;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::tasks::nmt::{command, states};

/// What was done to a node's state.
#[derive(Clone, Debug, Default)]
pub(super) struct Switched {
    /// The state before; `None` inside where nothing told it.
    before: Option<Option<NmtState>>,
}

impl Switched {
    /// Puts the node in PRE-OPERATIONAL, unless it is known to be in it.
    ///
    /// # Errors
    /// What stops everything.
    pub(super) fn enter(&mut self, device: &mut Device<'_, '_>) -> Result<(), Trouble> {
        // Others' guarding requests are remote frames, which no list of identifiers lets through.
        device.master.listen(&Filters::All)?;
        if self.before.is_none() {
            let before = states(device.master, &[device.node])?.first().and_then(|report| report.state);
            if before == Some(NmtState::PreOperational) {
                device.master.listen_to(&[device.node])?;
                return Ok(());
            }
            self.before = Some(before);
        }
        command(device.master, NmtCommand::EnterPreOperational, &[device.node], false)?;
        device.master.listen_to(&[device.node])?;
        Ok(())
    }

    /// Whether the node was switched.
    pub(super) fn is_switched(&self) -> bool {
        self.before.is_some()
    }

    /// Whether the node was switched, and from OPERATIONAL.
    pub(super) fn was_operational(&self) -> bool {
        self.before == Some(Some(NmtState::Operational))
    }

    /// Puts the state before back, where it was known; what is to be said about it.
    ///
    /// # Errors
    /// What stops everything; the command has been sent all the same.
    pub(super) fn put_back(&mut self, device: &mut Device<'_, '_>) -> Result<Option<String>, Trouble> {
        let (node, before) = (device.node, self.before.take());
        let (back, wanted) = match before {
            None => return Ok(None),
            Some(Some(NmtState::Operational)) => (NmtCommand::Start, NmtState::Operational),
            Some(Some(NmtState::Stopped)) => (NmtCommand::Stop, NmtState::Stopped),
            Some(_) => {
                return Ok(Some(format!(
                    "node {node} was put in PRE-OPERATIONAL; its state before is not known, so it stays there \
                     (cangauge nmt start {node})"
                )));
            }
        };
        device.master.listen(&Filters::All)?;
        let reached = command(device.master, back, &[node], false)?.first().and_then(|report| report.state);
        device.master.listen_to(&[node])?;
        Ok(match reached {
            Some(reached) if reached == wanted => None,
            Some(other) => {
                Some(format!("node {node} was {wanted} before and is {other} now (cangauge nmt state {node})"))
            }
            None => Some(format!("node {node} was sent back to {wanted}, and nothing confirms it")),
        })
    }
}
