//! Configuration state: how one device gets there, in which NMT state, and that everything is left as it was.

use super::subject::Subject;
use super::{Note, Tell};
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, Mode};
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::device::assign::{AssignEntry, AssignState};
use crate::master::{Error, Lss, LssError, Master};
use crate::tasks::nmt::states;
use crate::tasks::{Failure, Kind};

/// How LSS reaches a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// By its identity: 40h to 43h.
    Selective(LssAddress),
    /// Whoever is there: 04h.
    Global,
}

/// Does something in configuration state, and leaves it again however that ends.
///
/// # Errors
/// A device that does not answer to its identity, and whatever `work` finds.
pub(super) fn configured<T>(
    master: &mut Master<'_>,
    subject: &Subject,
    work: impl FnOnce(&mut Lss<'_, '_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let mut lss = master.lss();
    let entered = match subject.reach {
        Reach::Global => lss.switch_global(Mode::Configuration),
        Reach::Selective(address) => lss.switch_selective(&address),
    };
    let done = entered.map_err(|error| subject.lss_failure(error)).and_then(|()| work(&mut lss));
    let left = lss.leave();
    let done = done?;
    left.map_err(|error| {
        let failure = subject.lss_failure(error);
        let message = format!("{}; the device may still be in configuration state", failure.message);
        Failure { message, ..failure }.hint("power off and on brings it out")
    })?;
    Ok(done)
}

impl Subject {
    /// An error of LSS with the device's name.
    pub fn lss_failure(&self, error: LssError) -> Failure {
        match error {
            LssError::Master(error) => error.into(),
            error => {
                let failure = Failure::from(error);
                Failure { message: format!("{}: {}", self.name(), failure.message), node: self.node, ..failure }
            }
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
) -> Result<(T, Option<Before>), Failure> {
    let before = prepare(master, subject, way.state)?;
    let mut entered = false;
    let mut tried = |master: &mut Master<'_>| {
        configured(master, subject, |lss| {
            entered = true;
            work(lss)
        })
    };
    let first = tried(master);
    let silent = matches!(&first, Err(failure) if failure.kind == Kind::NoAnswer);
    let (done, before) = if silent && way.retry_stopped && subject.alone && !entered {
        tell(Note::Step(format!("{}: silent; once more in STOPPED", subject.name())));
        let stopped = prepare(master, subject, Some(AssignState::Stopped))?;
        (configured(master, subject, &mut work), before.or(stopped))
    } else {
        (first, before)
    };
    match done {
        Ok(done) => Ok((done, before)),
        Err(failure) => {
            put_back(master, before, tell);
            Err(failure)
        }
    }
}

/// Whether it was the user who ended it.
pub(super) fn is_interrupted(error: &LssError) -> bool {
    matches!(error, LssError::Master(Error::Interrupted))
}
