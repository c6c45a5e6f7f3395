//! Sets a node to PRE-OPERATIONAL for a change, and back to its previous state.

use super::failure::StepError;
use super::session::Session;
use crate::bus::Filters;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::node::state::{command, state};
use crate::tasks::note::StateEffect;

/// The NMT state before a node was set to PRE-OPERATIONAL.
#[derive(Clone, Debug, Default)]
pub(super) struct StateSwitch {
    /// `None` if the node was not switched, `Some(None)` if its previous state is unknown.
    before: Option<Option<NmtState>>,
}

impl StateSwitch {
    /// Sets the node to PRE-OPERATIONAL, unless it is known to be in this state.
    ///
    /// # Errors
    /// Bus errors and Ctrl-C.
    pub(super) fn enter(&mut self, session: &mut Session<'_, '_>) -> Result<(), StepError> {
        let node = session.node.id;
        // Guarding requests of another master are remote frames, which pass only the filter for all frames.
        session.master.listen(&Filters::All)?;
        if self.before.is_none() {
            let before = state(session.master, node)?;
            if before == Some(NmtState::PreOperational) {
                session.master.listen_to(&[node])?;
                return Ok(());
            }
            self.before = Some(before);
        }
        command(session.master, NmtCommand::EnterPreOperational, &[node], false)?;
        session.master.listen_to(&[node])?;
        Ok(())
    }

    /// Whether the node was switched.
    pub(super) fn is_switched(&self) -> bool {
        self.before.is_some()
    }

    /// Whether the node was switched from OPERATIONAL.
    pub(super) fn was_operational(&self) -> bool {
        self.before == Some(Some(NmtState::Operational))
    }

    /// Sets the node to its previous state, if this state is known.
    ///
    /// # Errors
    /// Bus errors and Ctrl-C. The command was sent in any case.
    pub(super) fn restore(&mut self, session: &mut Session<'_, '_>) -> Result<Option<StateEffect>, StepError> {
        let node = session.node.id;
        let (back, before) = match self.before.take() {
            None => return Ok(None),
            Some(Some(before @ NmtState::Operational)) => (NmtCommand::Start, before),
            Some(Some(before @ NmtState::Stopped)) => (NmtCommand::Stop, before),
            Some(_) => return Ok(Some(StateEffect::Unknown)),
        };
        session.master.listen(&Filters::All)?;
        let reached = command(session.master, back, &[node], false)?.first().and_then(|report| report.state);
        session.master.listen_to(&[node])?;
        Ok(match reached {
            Some(now) if now == before => None,
            Some(now) => Some(StateEffect::Differs { before, now }),
            None => Some(StateEffect::Unconfirmed { before }),
        })
    }
}
