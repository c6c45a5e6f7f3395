//! Single LSS services: inquire, activate, store.

use super::device::{Descriptions, LssDevice};
use super::event::{LssEvent, Reason};
use super::failure::LssCause;
use super::method::choose_method;
use super::resolve::resolve;
use super::session::{in_required_state, restore_state};
use super::{Notify, Target, Via};
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, Mode};
use crate::master::{Lss, LssError, Master};
use crate::tasks::{Effect, Failure};
use std::sync::Arc;

/// The identity and node-ID that a slave reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InquireReport {
    /// The device as the user named it.
    pub target: Target,
    /// Its identity; `None` if it does not support the inquiry.
    pub address: Option<LssAddress>,
    /// Its node-ID: `Some(None)` if it has none, `None` if it does not support the inquiry.
    pub node: Option<Option<NodeId>>,
}

/// Reads identity and node-ID of a slave by LSS.
///
/// # Errors
/// The errors of [`super::assign`]; [`LssCause::NoInquiry`].
pub fn inquire(
    master: &mut Master<'_>,
    target: &Target,
    descriptions: &Descriptions<'_>,
    notify: Notify<'_>,
) -> Result<InquireReport, Failure> {
    let device = resolve(master, target, descriptions, (Via::Lss, false), notify)?;
    let mut others = Vec::new();
    let (address, node) = with_device(master, &device, notify, |lss| {
        let address = unless_silent(lss.inquire_address(), &mut others)?;
        let node = unless_silent(lss.inquire_node_id(), &mut others)?;
        Ok((address, node.and_then(|gathered| gathered.answers.first().copied())))
    })?;
    for error in others {
        notify(device.note(LssEvent::OtherAnswer(Reason(Arc::new(error)))));
    }
    if address.is_none() && node.is_none() {
        return Err(device.failure(LssCause::NoInquiry));
    }
    Ok(InquireReport { target: target.clone(), address, node })
}

/// Returns the answer, or `None` if the slave does not answer. If it sent another frame instead, the error is added to
/// `others`.
fn unless_silent<T>(result: Result<T, LssError>, others: &mut Vec<LssError>) -> Result<Option<T>, LssError> {
    match result {
        Ok(answer) => Ok(Some(answer)),
        Err(error @ LssError::NoAnswer { received, .. }) => {
            others.extend(received.map(|_| error));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Stores the configured node-ID and bit rate in non-volatile memory.
///
/// # Errors
/// The errors of [`super::assign`].
pub fn store(
    master: &mut Master<'_>,
    target: &Target,
    descriptions: &Descriptions<'_>,
    force: bool,
    notify: Notify<'_>,
) -> Result<(), Failure> {
    let device = resolve(master, target, descriptions, (Via::Lss, force), notify).map_err(with_nothing_changed)?;
    with_device(master, &device, notify, |lss| accepted_by_all(lss.store(), force))
}

/// Activates the configured bit rate. The slave is silent for `delay_ms`, changes the bit rate, and is silent for
/// `delay_ms` again. Without a target, all slaves are addressed. Slaves do not acknowledge the request.
///
/// # Errors
/// The errors of [`super::assign`].
pub fn activate(
    master: &mut Master<'_>,
    target: Option<&Target>,
    delay_ms: u16,
    descriptions: &Descriptions<'_>,
    force: bool,
    notify: Notify<'_>,
) -> Result<(), Failure> {
    let Some(target) = target else {
        let mut lss = master.lss();
        let sent = lss.switch_global(Mode::Configuration).and_then(|()| lss.activate(delay_ms));
        let leave_result = lss.leave();
        sent?;
        return Ok(leave_result?);
    };
    let device = resolve(master, target, descriptions, (Via::Lss, force), notify).map_err(with_nothing_changed)?;
    with_device(master, &device, notify, |lss| lss.activate(delay_ms))
}

/// Carries out a service with the device in configuration state.
fn with_device<T>(
    master: &mut Master<'_>,
    device: &LssDevice,
    notify: Notify<'_>,
    mut service: impl FnMut(&mut Lss<'_, '_>) -> Result<T, LssError>,
) -> Result<T, Failure> {
    let method = choose_method(device, Via::Lss, true, notify)?;
    let session = in_required_state(master, device, &method, notify, |lss| {
        service(lss).map_err(|error| device.lss_failure(error))
    })?;
    restore_state(master, device, session.previous_state, notify);
    Ok(session.result)
}

/// Adds to a failure that nothing was changed.
pub(super) fn with_nothing_changed(mut failure: Failure) -> Failure {
    failure.effects.push(Effect::NothingChanged);
    failure
}

/// Treats several answers that all accept the request as a success, if `force` is set.
pub(super) fn accepted_by_all(result: Result<(), LssError>, force: bool) -> Result<(), LssError> {
    match result {
        Err(LssError::Several { frames, .. })
            if force && frames.iter().all(|frame| frame.data().get(1) == Some(&0)) =>
        {
            Ok(())
        }
        result => result,
    }
}
