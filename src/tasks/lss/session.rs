//! Switches a device to LSS configuration state and back, in the required NMT state.

use super::Notify;
use super::device::{LssDevice, Reach};
use super::event::LssEvent;
use super::failure::{LssCause, LssEffect};
use crate::canopen::id::NodeId;
use crate::canopen::lss::{Mode, Service};
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::device::assign::{AssignEntry, AssignState};
use crate::master::{Lss, LssError, Master};
use crate::node::state::state;
use crate::tasks::Failure;
use crate::tasks::failure::Cause;
use std::collections::BTreeSet;

/// The result of work in configuration state.
pub(super) struct Session<T> {
    /// The result.
    pub result: T,
    /// The nodes that booted during the work. A device without a node-ID boots when it leaves configuration state with
    /// a new node-ID.
    pub booted: BTreeSet<NodeId>,
    /// The NMT state to restore.
    pub previous_state: Option<PreviousState>,
}

/// Switches the device to configuration state, does the work, and switches it back to waiting state in any case.
///
/// # Errors
/// The device does not answer to its identity; errors of `work`.
pub(super) fn in_configuration_state<T>(
    master: &mut Master<'_>,
    device: &LssDevice,
    work: impl FnOnce(&mut Lss<'_, '_>) -> Result<T, Failure>,
) -> Result<Session<T>, Failure> {
    let mut lss = master.lss();
    let entered = match device.reach {
        Reach::Global => lss.switch_global(Mode::Configuration),
        Reach::Selective(address) => lss.switch_selective(&address),
    };
    let result = entered.map_err(|error| device.lss_failure(error)).and_then(|()| work(&mut lss));
    let leave_result = lss.leave();
    let result = result?;
    leave_result.map_err(|error| {
        let mut failure = device.lss_failure(error);
        failure.effects.push(LssEffect::MayBeConfiguring.into());
        failure
    })?;
    Ok(Session { result, booted: lss.boot_ups().keys().copied().collect(), previous_state: None })
}

/// The NMT state of a node before it was changed for LSS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PreviousState {
    node: NodeId,
    /// `None` if it is unknown.
    state: Option<NmtState>,
    changed_to: AssignState,
}

/// Switches the device to the NMT state that the method requires. Without a requirement, or if the command would reach
/// another device, nothing is sent.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub(super) fn enter_state(
    master: &mut Master<'_>,
    device: &LssDevice,
    required: Option<AssignState>,
) -> Result<Option<PreviousState>, Failure> {
    let (Some(node), Some(required)) = (device.own_node(), required) else { return Ok(None) };
    let state = state(master, node)?;
    let (command, target) = match required {
        AssignState::PreOperational => (NmtCommand::EnterPreOperational, NmtState::PreOperational),
        AssignState::Stopped => (NmtCommand::Stop, NmtState::Stopped),
    };
    // The command is sent even if the node is already in this state, as in the manuals.
    master.send(command.frame(Some(node)));
    Ok(Some(PreviousState { node, state, changed_to: required }).filter(|_| state != Some(target)))
}

/// Restores the NMT state that [`enter_state`] changed, if it was known. A stopped device does not answer SDO, so a
/// device of unknown state is not left in STOPPED.
pub(super) fn restore_state(
    master: &mut Master<'_>,
    device: &LssDevice,
    previous: Option<PreviousState>,
    notify: Notify<'_>,
) {
    let Some(PreviousState { node, state, changed_to }) = previous else { return };
    let command = match (state, changed_to) {
        (Some(NmtState::Operational), _) => Some(NmtCommand::Start),
        (Some(NmtState::Stopped), _) => Some(NmtCommand::Stop),
        (Some(NmtState::PreOperational), _) | (Some(NmtState::Other(_)) | None, AssignState::Stopped) => {
            Some(NmtCommand::EnterPreOperational)
        }
        (Some(NmtState::Other(_)) | None, AssignState::PreOperational) => None,
    };
    if let Some(command) = command {
        master.send(command.frame(Some(node)));
        master.settle();
    }
    if matches!(state, Some(NmtState::Other(_)) | None) {
        notify(device.note(LssEvent::LeftPreOperational));
    }
}

/// Works in configuration state and in the NMT state that the method requires. If the device does not answer LSS and
/// the method allows it, the work is repeated in STOPPED.
///
/// On success the caller restores the NMT state; on failure it is restored here.
///
/// # Errors
/// The errors of [`in_configuration_state`].
pub(super) fn in_required_state<T>(
    master: &mut Master<'_>,
    device: &LssDevice,
    method: &AssignEntry,
    notify: Notify<'_>,
    mut work: impl FnMut(&mut Lss<'_, '_>) -> Result<T, Failure>,
) -> Result<Session<T>, Failure> {
    let previous = enter_state(master, device, method.state)?;
    let first = in_configuration_state(master, device, &mut work);
    let is_silent = first.as_ref().is_err_and(|failure| is_silent(device, failure));
    let (done, previous_state) = if is_silent && method.retry_stopped && device.is_alone {
        notify(device.note(LssEvent::RetryInStopped));
        let stopped = enter_state(master, device, Some(AssignState::Stopped))?;
        (in_configuration_state(master, device, work), previous.or(stopped))
    } else {
        (first, previous)
    };
    match done {
        Ok(session) => Ok(Session { previous_state, ..session }),
        Err(failure) => {
            restore_state(master, device, previous_state, notify);
            Err(failure)
        }
    }
}

/// Whether a failure means that the device does not answer LSS at all. A global switch has no answer, so the first
/// service after it decides.
pub(super) fn is_silent(device: &LssDevice, failure: &Failure) -> bool {
    let Cause::Lss(cause) = &failure.cause else { return false };
    let LssCause::Service(error) = &cause.cause else { return false };
    let LssError::NoAnswer { service, .. } = **error else { return false };
    service == Service::SwitchSelective || device.reach == Reach::Global && service != Service::Store
}
