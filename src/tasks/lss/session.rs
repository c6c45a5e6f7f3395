//! Configuration state: how one device gets there, in which NMT state, and that everything is left as it was.

use super::subject::Subject;
use super::{Note, Tell};
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, Mode};
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::device::assign::{AssignEntry, AssignState};
use crate::master::{Lss, LssError, Master};
use crate::tasks::nmt::states;
use crate::tasks::{Failure, Kind};
use std::collections::BTreeSet;

/// How LSS reaches a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// By its identity: 40h to 43h.
    Selective(LssAddress),
    /// Whoever is there: 04h.
    Global,
}

/// What was done in configuration state.
pub(super) struct Session<T> {
    /// What came of it.
    pub done: T,
    /// Who has booted meanwhile: a device that had no node-ID boots when it leaves configuration state with one.
    pub booted: BTreeSet<NodeId>,
    /// The NMT state to be put back.
    pub before: Option<Before>,
}

/// Does something in configuration state, and leaves it again however that ends.
///
/// # Errors
/// A device that does not answer to its identity, and whatever `work` finds.
pub(super) fn configured<T>(
    master: &mut Master<'_>,
    subject: &Subject,
    work: impl FnOnce(&mut Lss<'_, '_>) -> Result<T, Failure>,
) -> Result<Session<T>, Failure> {
    let mut lss = master.lss();
    let entered = match subject.reach {
        Reach::Global => lss.switch_global(Mode::Configuration),
        Reach::Selective(address) => lss.switch_selective(&address),
    };
    let done = entered.map_err(|error| subject.lss_failure(error)).and_then(|()| work(&mut lss));
    let left = lss.leave();
    let done = done?;
    left.map_err(|error| {
        let failure = subject.lss_failure(error).and("the device may still be in configuration state");
        failure.hint("power off and on brings it out")
    })?;
    Ok(Session { done, booted: lss.boot_ups().keys().copied().collect(), before: None })
}

impl Subject {
    /// An error of LSS with the device's name.
    pub(super) fn lss_failure(&self, error: LssError) -> Failure {
        match error {
            LssError::Master(error) => error.into(),
            error => Failure { node: self.node, ..Failure::from(error) },
        }
    }
}

/// The NMT state of a device before it was put into the one that it wants for LSS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Before {
    node: NodeId,
    /// `None`: nothing told it.
    state: Option<NmtState>,
    now: AssignState,
}

/// Puts the device into the NMT state that it wants, where that is one and the command reaches nobody else.
///
/// # Errors
/// What stops everything.
pub(super) fn prepare(
    master: &mut Master<'_>,
    subject: &Subject,
    wanted: Option<AssignState>,
) -> Result<Option<Before>, Failure> {
    let (Some(node), Some(wanted), true) = (subject.node, wanted, subject.alone) else { return Ok(None) };
    let state = states(master, &[node])?.into_iter().find_map(|report| report.state);
    let (command, target) = match wanted {
        AssignState::PreOperational => (NmtCommand::EnterPreOperational, NmtState::PreOperational),
        AssignState::Stopped => (NmtCommand::Stop, NmtState::Stopped),
    };
    // Also where it is in that state already: the manuals print the command.
    master.send(command.frame(Some(node)));
    Ok(Some(Before { node, state, now: wanted }).filter(|_| state != Some(target)))
}

/// Puts back what [`prepare`] changed, as far as the state before was known. A stopped device has no SDO, so it is
/// not left stopped where it was not known to be.
pub(super) fn put_back(master: &mut Master<'_>, before: Option<Before>, tell: Tell<'_>) {
    let Some(Before { node, state, now }) = before else { return };
    let command = match (state, now) {
        (Some(NmtState::Operational), _) => NmtCommand::Start,
        (Some(NmtState::Stopped), _) => NmtCommand::Stop,
        (Some(NmtState::PreOperational), _) | (Some(NmtState::Other(_)) | None, AssignState::Stopped) => {
            NmtCommand::EnterPreOperational
        }
        (Some(NmtState::Other(_)) | None, AssignState::PreOperational) => {
            tell(Note::Step(format!("node {node} is in PRE-OPERATIONAL; nothing told its state before")));
            return;
        }
    };
    master.send(command.frame(Some(node)));
    master.settle();
    if state.is_none() {
        tell(Note::Step(format!("node {node} is in PRE-OPERATIONAL again; nothing told its state before")));
    }
}

/// Does something in configuration state, in the NMT state that the way wants, and once more in STOPPED where the
/// device does not answer and the way says so. The NMT state is put back.
///
/// # Errors
/// As [`configured`].
pub(super) fn prepared<T>(
    master: &mut Master<'_>,
    subject: &Subject,
    way: &AssignEntry,
    tell: Tell<'_>,
    mut work: impl FnMut(&mut Lss<'_, '_>) -> Result<T, Failure>,
) -> Result<Session<T>, Failure> {
    let before = prepare(master, subject, way.state)?;
    let mut entered = false;
    let first = configured(master, subject, |lss| {
        // To a global switch nobody answers.
        entered = subject.reach != Reach::Global;
        work(lss)
    });
    let silent = matches!(&first, Err(failure) if failure.kind() == Kind::NoAnswer) && !entered;
    let (done, before) = if silent && way.retry_stopped && subject.alone {
        tell(Note::Step(format!("{}: silent; once more in STOPPED", subject.name())));
        let stopped = prepare(master, subject, Some(AssignState::Stopped))?;
        (configured(master, subject, work), before.or(stopped))
    } else {
        (first, before)
    };
    match done {
        Ok(session) => Ok(Session { before, ..session }),
        Err(failure) => {
            put_back(master, before, tell);
            Err(failure)
        }
    }
}
