//! Finds the device that an argument names: its identity, its node-ID, and its address for LSS.

use super::device::{Descriptions, LssDevice};
use super::event::LssEvent;
use super::failure::{LssCause, LssFailure};
use super::node_id::{AnsweringDevices, answering_devices, identity_of};
use super::session::{in_configuration_state, is_silent};
use super::sole::only_device;
use super::{Notify, Target, Via, nodes};
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::master::{LssError, Master, OnTwoDevices};
use crate::tasks::Failure;

/// Finds the device of a target. Nothing is changed, and the device is switched back to waiting state. `force` applies
/// to [`Target::Only`].
///
/// # Errors
/// No device, several devices, or a device that cannot be distinguished from others; bus errors and Ctrl-C.
pub(super) fn resolve(
    master: &mut Master<'_>,
    target: &Target,
    descriptions: &Descriptions<'_>,
    (via, force): (Via, bool),
    notify: Notify<'_>,
) -> Result<LssDevice, Failure> {
    match target {
        Target::Node(node) => by_node_id(master, *node, descriptions, via),
        Target::Address(address) => by_address(master, *address, descriptions, notify),
        Target::Only => only_device(master, descriptions, force, notify),
        Target::Unconfigured => find_unconfigured(master, descriptions),
    }
}

fn by_node_id(
    master: &mut Master<'_>,
    node: NodeId,
    descriptions: &Descriptions<'_>,
    via: Via,
) -> Result<LssDevice, Failure> {
    let address = identity_of(master, node)?;
    nodes::refuse_shared_identity(master, address, Some(node))?;
    let mut device = LssDevice { node: Some(node), is_alone: true, ..LssDevice::with_address(address) };
    device.model = descriptions.model_of(master, &device)?;
    if device.uses_lss(via)
        && let LssNodeId::Known(found) = inquire_node_id(master, &device)?
        && found != Some(node)
    {
        return Err(device.failure(LssCause::OtherNodeIdByLss(found)));
    }
    Ok(device)
}

fn by_address(
    master: &mut Master<'_>,
    address: LssAddress,
    descriptions: &Descriptions<'_>,
    notify: Notify<'_>,
) -> Result<LssDevice, Failure> {
    // With this target, LSS addresses only one of two devices with the same node-ID. So this target can be used to
    // separate the two devices.
    master.set_on_two_devices(OnTwoDevices::Report);
    let mut device = LssDevice::with_address(address);
    // A device that requires another NMT state does not answer LSS here, but may answer SDO.
    let by_lss = inquire_node_id(master, &device)?;
    match by_lss {
        LssNodeId::Known(Some(node)) => device.node = Some(node),
        LssNodeId::Known(None) => device.is_unconfigured = true,
        LssNodeId::NotSupported | LssNodeId::Silent(_) => {
            device.node = nodes::find_by_identity(master, address)?.first().copied();
        }
    }
    nodes::refuse_shared_identity(master, address, device.node)?;
    let mut is_stopped = false;
    if let Some(node) = device.node {
        match answering_devices(master, node)? {
            AnsweringDevices::Device(found) if found == address => device.is_alone = true,
            AnsweringDevices::Device(_) | AnsweringDevices::Several(_) => {
                notify(device.note(LssEvent::SharedNodeId(node)))
            }
            // The device answers LSS but not SDO, so it is stopped. No other device answers at its node-ID.
            AnsweringDevices::None(_) => is_stopped = matches!(by_lss, LssNodeId::Known(_)),
            AnsweringDevices::Unidentified => {}
        }
    }
    if let LssNodeId::Silent(failure) = by_lss
        && !device.is_alone
    {
        return Err(*failure);
    }
    device.model = descriptions.model_of(master, &device)?;
    device.is_alone |= is_stopped;
    Ok(device)
}

fn find_unconfigured(master: &mut Master<'_>, descriptions: &Descriptions<'_>) -> Result<LssDevice, Failure> {
    let mut lss = master.lss();
    let found = lss.fastscan();
    let leave_result = lss.leave();
    let found = found?;
    leave_result?;
    drop(lss);
    let address = found.ok_or_else(|| Failure::general(LssFailure::general(LssCause::NoUnconfigured)))?;
    let mut device = LssDevice { is_unconfigured: true, ..LssDevice::with_address(address) };
    // Fails if a configured device has the same identity.
    inquire_node_id(master, &device)?;
    device.model = descriptions.model_of(master, &device)?;
    Ok(device)
}

/// The node-ID that a device reports by LSS.
enum LssNodeId {
    /// The node-ID; `None` if the device has none.
    Known(Option<NodeId>),
    /// The device does not support the service (5Eh).
    NotSupported,
    /// The device does not answer to its identity. Some devices answer only in one NMT state.
    Silent(Box<Failure>),
}

/// Reads the node-ID by LSS (5Eh).
///
/// # Errors
/// [`LssCause::SeveralWithIdentity`]; bus errors and Ctrl-C.
fn inquire_node_id(master: &mut Master<'_>, device: &LssDevice) -> Result<LssNodeId, Failure> {
    let asked = in_configuration_state(master, device, |lss| match lss.inquire_node_id() {
        Ok(gathered) => Ok(Some(gathered)),
        Err(LssError::NoAnswer { .. }) => Ok(None),
        Err(error) => Err(device.lss_failure(error)),
    });
    match asked {
        Ok(session) => match session.result {
            Some(gathered) if !gathered.is_one() => Err(device.failure(LssCause::SeveralWithIdentity)),
            Some(gathered) => {
                Ok(gathered.answers.first().map_or(LssNodeId::NotSupported, |node| LssNodeId::Known(*node)))
            }
            None => Ok(LssNodeId::NotSupported),
        },
        Err(failure) if is_silent(device, &failure) => Ok(LssNodeId::Silent(Box::new(failure))),
        Err(failure) => Err(failure),
    }
}
