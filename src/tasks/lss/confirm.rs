//! Confirms a new node-ID: resets the device and waits for it under the new node-ID.

use super::device::{DeviceName, LssDevice};
use super::failure::{LssCause, LssFailure};
use super::node_id::{AnsweringDevices, answering_devices};
use crate::bus::{Filters, Mono};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand};
use crate::master::{Error, Master, MasterEvent};
use crate::node::wait::{Policy, pause, wait};
use crate::tasks::Failure;
use std::ops::ControlFlow;
use std::time::Duration;

/// The longest wait for a boot-up message. No manual gives a time, and a device may first write its non-volatile
/// memory.
const BOOT_TIMEOUT: Duration = Duration::from_secs(5);

/// How long requests are repeated after the boot-up message. Some devices do not answer for 2 to 3 s.
const FIRST_ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// The pause before the next request to a silent device.
const ASK_AGAIN_PAUSE: Duration = Duration::from_millis(100);

/// The confirmation of the new values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Confirmed {
    /// The boot-up message of the new node-ID, and the identity read from it.
    BootUp,
    /// The identity, read from the new node-ID or at the new bit rate.
    Identity,
    /// The acknowledgement. The values take effect later.
    Acknowledge,
}

impl Confirmed {
    /// Returns the word in JSON and tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Confirmed::BootUp => "boot-up",
            Confirmed::Identity => "identity",
            Confirmed::Acknowledge => "ack",
        }
    }
}

/// Resets the node `reset`, if given, and waits for the device with the node-ID `new`. Returns the confirmation, and
/// the time until the boot-up message.
///
/// # Errors
/// The device does not restart, restarts with its old node-ID, or shares its new node-ID with another device; bus
/// errors and Ctrl-C.
pub(super) fn confirm(
    master: &mut Master<'_>,
    device: &LssDevice,
    new: NodeId,
    reset: Option<NodeId>,
    has_booted: bool,
) -> Result<(Confirmed, Option<Duration>), Failure> {
    master.listen(&Filters::All)?;
    let start = master.now();
    if let Some(old) = reset {
        master.send(NmtCommand::ResetNode.frame(Some(old)));
    }
    let boot_time = if has_booted { Some(Duration::ZERO) } else { wait_for_boot_up(master, new, start)? };
    let proof = if boot_time.is_some() { Confirmed::BootUp } else { Confirmed::Identity };
    let cause = match first_answer(master, new, boot_time.is_some())? {
        AnsweringDevices::Device(found) if device.address.is_none_or(|address| address == found) => {
            return Ok((proof, boot_time));
        }
        AnsweringDevices::Unidentified if device.address.is_none() && boot_time.is_some() => {
            return Ok((proof, boot_time));
        }
        AnsweringDevices::Device(found) => LssCause::OtherDeviceAnswers(found),
        AnsweringDevices::Unidentified => LssCause::NotIdentified,
        AnsweringDevices::Several(sign) => LssCause::DuplicateNewNodeId(sign),
        AnsweringDevices::None(waited) if boot_time.is_some() => LssCause::SilentAfterBootUp(waited),
        AnsweringDevices::None(_) => return Err(not_seen(master, device, new, reset)?),
    };
    let name = DeviceName { node: Some(new), ..device.name() };
    Err(Failure::at(new, LssFailure { device: name, cause }))
}

fn wait_for_boot_up(master: &mut Master<'_>, new: NodeId, start: Mono) -> Result<Option<Duration>, Error> {
    let until = start + BOOT_TIMEOUT.max(master.timing().timeout);
    let booted = wait(master, until, Policy::Command, |_, event| match event {
        MasterEvent::Frame(received)
            if ErrorControlMessage::parse(&received.frame) == Some((new, ErrorControlMessage::BootUp)) =>
        {
            ControlFlow::Break(received.at.mono.since(start))
        }
        _ => ControlFlow::Continue(()),
    })?;
    Ok(booted.done())
}

/// Returns the device that answers at the new node-ID. After a boot-up message, requests to a silent device are
/// repeated.
fn first_answer(master: &mut Master<'_>, new: NodeId, has_booted: bool) -> Result<AnsweringDevices, Failure> {
    let until = master.now() + FIRST_ANSWER_TIMEOUT;
    loop {
        let found = answering_devices(master, new)?;
        if !matches!(found, AnsweringDevices::None(_)) || !has_booted || master.now() >= until {
            return Ok(found);
        }
        let again = master.now() + ASK_AGAIN_PAUSE;
        pause(master, again, Policy::Command)?;
    }
}

/// Returns the failure of a device that does not respond at its new node-ID.
fn not_seen(
    master: &mut Master<'_>,
    device: &LssDevice,
    new: NodeId,
    reset: Option<NodeId>,
) -> Result<Failure, Failure> {
    if let Some(old) = reset.filter(|old| *old != new)
        && let AnsweringDevices::Device(found) = answering_devices(master, old)?
        && device.address.is_none_or(|address| address == found)
    {
        return Ok(device.failure(LssCause::StillOldNodeId { old, new }));
    }
    Ok(device.failure(LssCause::NotSeen { new, waited: BOOT_TIMEOUT }))
}
