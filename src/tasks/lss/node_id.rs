//! Counts the devices that answer at a node-ID: none, one or several.

use super::device::DeviceName;
use super::failure::{LssCause, LssFailure};
use crate::bus::{Fault, Filters, Mono};
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Error, Master, MasterEvent, Request, SdoError, SdoFailure};
use crate::node::wait::{Policy, wait};
use crate::tasks::Failure;
use std::ops::ControlFlow;
use std::time::Duration;

const IDENTITY: u16 = 0x1018;

/// The number of reads of an identity. The answers of two devices can merge on the bus once, but not every time.
const IDENTITY_READS: usize = 3;

/// The waiting time for a second answer after an identity was read.
const SECOND_ANSWER_TIMEOUT: Duration = Duration::from_millis(50);

/// How long to listen for other nodes. The usual heartbeat time is 1 s.
pub(super) const LISTEN_TIME: Duration = Duration::from_millis(1100);

/// The longest time of an SDO transfer.
const MAX_TRANSFER_TIME: Duration = Duration::from_secs(3600);

/// The evidence of two devices with one node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DuplicateSign {
    /// Another master sends requests to the node, so the answers cannot be assigned.
    OtherMaster,
    /// Answers arrive twice.
    AnswersTwice,
    /// Answers collide.
    AnswersCollide,
    /// Answers to the same request differ.
    AnswersDiffer,
}

/// The evidence that a node-ID is in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TakenSign {
    /// A node answers SDO.
    Answer,
    /// A node sends heartbeats or a boot-up message.
    Heartbeat,
}

/// The devices that answer at a node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AnsweringDevices {
    /// One device with this identity.
    Device(LssAddress),
    /// Probably one device. It has no serial number, so it cannot be distinguished from others.
    Unidentified,
    /// Several devices.
    Several(DuplicateSign),
    /// No device answered within this time.
    None(Duration),
}

/// Reads the identity (1018h) of a node several times, and checks for two devices: answers that arrive twice, differ or
/// collide.
///
/// # Errors
/// Bus errors and Ctrl-C; an answer that violates the protocol.
pub(super) fn answering_devices(master: &mut Master<'_>, node: NodeId) -> Result<AnsweringDevices, Failure> {
    master.listen(&Filters::All)?;
    let mut first: Option<[Option<u32>; 4]> = None;
    for _ in 0..IDENTITY_READS {
        let mut parts = [None; 4];
        for (part, sub) in parts.iter_mut().zip(1..) {
            let mut monitor = SdoMonitor::new(node);
            *part = match monitor.read(master, ObjectId::new(IDENTITY, sub))? {
                Ok(number) => Some(number),
                Err(SdoError { failure: SdoFailure::Refused(_) | SdoFailure::Fit(_), .. }) => None,
                Err(SdoError { failure: SdoFailure::NoAnswer { waited, .. }, .. }) => {
                    return Ok(match monitor.has_collision {
                        true => AnsweringDevices::Several(DuplicateSign::AnswersCollide),
                        false => AnsweringDevices::None(waited),
                    });
                }
                Err(SdoError { failure: SdoFailure::TwoDevices(_), .. }) if !monitor.has_other_master => {
                    return Ok(AnsweringDevices::Several(DuplicateSign::AnswersDiffer));
                }
                Err(error) => return Err(error.into()),
            };
            if sub == 4 {
                monitor.listen(master, SECOND_ANSWER_TIMEOUT)?;
            }
            if let Some(sign) = monitor.sign(master) {
                return Ok(AnsweringDevices::Several(sign));
            }
        }
        if first.is_some_and(|first| first != parts) {
            return Ok(AnsweringDevices::Several(DuplicateSign::AnswersDiffer));
        }
        first = Some(parts);
    }
    Ok(match first.unwrap_or_default() {
        [Some(vendor), Some(product), Some(revision), Some(serial)] if serial != 0 => {
            AnsweringDevices::Device(LssAddress { vendor, product, revision, serial })
        }
        _ => AnsweringDevices::Unidentified,
    })
}

/// Watches the SDO channel of a node for another master and for collisions.
struct SdoMonitor {
    node: NodeId,
    has_other_master: bool,
    has_collision: bool,
}

impl SdoMonitor {
    fn new(node: NodeId) -> SdoMonitor {
        SdoMonitor { node, has_other_master: false, has_collision: false }
    }

    fn sign(&self, master: &Master<'_>) -> Option<DuplicateSign> {
        // The master recognises late answers and answers to other masters.
        let has_second_answer = || master.second_answers().iter().any(|(node, _)| *node == self.node);
        match self {
            SdoMonitor { has_other_master: true, .. } => Some(DuplicateSign::OtherMaster),
            _ if has_second_answer() => Some(DuplicateSign::AnswersTwice),
            SdoMonitor { has_collision: true, .. } => Some(DuplicateSign::AnswersCollide),
            SdoMonitor { .. } => None,
        }
    }

    fn on_event(&mut self, event: &MasterEvent) {
        match event {
            MasterEvent::Frame(received) => {
                self.has_other_master |= received.frame.id().sdo_request_node() == Some(self.node);
            }
            MasterEvent::Fault(fault, _) => self.has_collision |= is_collision(*fault),
            _ => {}
        }
    }

    /// Reads an UNSIGNED32.
    fn read(&mut self, master: &mut Master<'_>, object: ObjectId) -> Result<Result<u32, SdoError>, Failure> {
        let node = self.node;
        let request = master.start(Request::read(node, object));
        let until = master.now() + MAX_TRANSFER_TIME;
        let answer = wait(master, until, Policy::Command, |_, event| match event {
            MasterEvent::Sdo(ticket, result) if ticket == request => ControlFlow::Break(result),
            event => {
                self.on_event(&event);
                ControlFlow::Continue(())
            }
        })?;
        let answer = answer.done().ok_or(Error::Interrupted)?;
        let value = answer.and_then(|answer| answer.value(node, object, Some(DataType::Unsigned(4))));
        let number = value.map(|(value, _)| value.as_u64().and_then(|number| u32::try_from(number).ok()));
        Ok(number.map(Option::unwrap_or_default))
    }

    fn listen(&mut self, master: &mut Master<'_>, duration: Duration) -> Result<(), Failure> {
        let until = master.now() + duration;
        wait(master, until, Policy::Command, |_, event| {
            self.on_event(&event);
            ControlFlow::<()>::Continue(())
        })?;
        Ok(())
    }
}

/// Whether two nodes that send at the same time can cause this fault.
fn is_collision(fault: Fault) -> bool {
    matches!(fault, Fault::Protocol | Fault::ErrorPassive | Fault::BusOff)
}

/// Returns the sign that a node-ID is in use: an SDO answer, a heartbeat or a boot-up message. A stopped node without
/// heartbeat cannot be detected.
///
/// The node-ID is free if the node is silent for [`LISTEN_TIME`] after `start`, and after two requests. Frames received
/// since `start` count, so the requests of a scan are not repeated.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub(super) fn find_taken_sign(
    master: &mut Master<'_>,
    node: NodeId,
    start: Mono,
) -> Result<Option<TakenSign>, Failure> {
    master.listen(&Filters::All)?;
    let timeout = master.timing().timeout.min(LISTEN_TIME / 3);
    let sign = |master: &Master<'_>| match () {
        () if master.has_answered_since(node, start) => Some(TakenSign::Answer),
        () if master.has_heartbeat_since(node, start) => Some(TakenSign::Heartbeat),
        () => None,
    };
    let mut until = start + LISTEN_TIME;
    if let Some(asked) = master.asked_twice_since(node, start) {
        until = until.max(asked + timeout);
    } else if sign(master).is_none() {
        ask_twice(master, node, timeout)?;
    }
    let until = until.max(master.now());
    let signed = |found: Option<TakenSign>| found.map_or(ControlFlow::Continue(()), ControlFlow::Break);
    let waited = match sign(master) {
        Some(sign) => return Ok(Some(sign)),
        None => wait(master, until, Policy::Command, |master, _| signed(sign(master)))?,
    };
    Ok(waited.done())
}

/// Reads the device type twice, until the first answer, heartbeat or boot-up message.
fn ask_twice(master: &mut Master<'_>, node: NodeId, timeout: Duration) -> Result<(), Failure> {
    // One request or its answer may be lost.
    let start = master.now();
    let requests = [(); 2].map(|()| Request::read(node, ObjectId::DEVICE_TYPE).once().within(timeout));
    let tickets = requests.map(|request| master.start(request));
    let mut unanswered = tickets.len();
    wait(master, start + MAX_TRANSFER_TIME, Policy::Command, |master, event| {
        unanswered -= usize::from(matches!(event, MasterEvent::Sdo(ticket, _) if tickets.contains(&ticket)));
        let is_found = master.has_answered_since(node, start) || master.has_heartbeat_since(node, start);
        if unanswered == 0 || is_found { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    master.forget(tickets.into_iter());
    Ok(())
}

/// Returns the identity of the only device with a node-ID.
///
/// # Errors
/// No device, more than one, or a device without a serial number; bus errors and Ctrl-C.
pub(super) fn identity_of(master: &mut Master<'_>, node: NodeId) -> Result<LssAddress, Failure> {
    let cause = match answering_devices(master, node)? {
        AnsweringDevices::Device(address) => return Ok(address),
        AnsweringDevices::Unidentified => LssCause::NoSerialNumber,
        AnsweringDevices::Several(sign) => LssCause::DuplicateNodeId(sign),
        AnsweringDevices::None(waited) => LssCause::NoAnswer(waited),
    };
    let device = DeviceName { node: Some(node), address: None };
    Err(Failure::at(node, LssFailure { device, cause }))
}
