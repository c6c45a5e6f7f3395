//! Steps and warnings that a running task reports, as types. The texts are in `output`.

use super::device::DeviceName;
use super::progress::Progress;
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::master::LssError;
use std::sync::Arc;

/// An event of an LSS task.
#[derive(Clone, Debug, PartialEq)]
pub struct LssFact {
    /// The device.
    pub device: DeviceName,
    /// The event.
    pub event: LssEvent,
}

/// A step of an LSS task.
#[derive(Clone, Debug, PartialEq)]
pub enum LssEvent {
    /// The target was found.
    Found {
        /// The title of its description.
        title: Option<String>,
        /// The new node-ID, if it was found to be free.
        free: Option<NodeId>,
    },
    /// The bit rate table of the device is unknown; the table of CiA 305 is used.
    StandardRateTable,
    /// The completed steps of the change.
    Progress(Progress),
    /// A service was answered with another specifier.
    OtherAnswer(Reason),
    /// The device does not answer LSS; the request is repeated in STOPPED.
    RetryInStopped,
    /// The device is in PRE-OPERATIONAL; its previous state is unknown.
    LeftPreOperational,
    /// The device changes to a new bit rate together with the host.
    ChangingRate {
        /// The bit rate in bit/s.
        bit_rate: u32,
        /// The time until the change in milliseconds.
        delay_ms: u16,
    },
    /// The device answers at the new bit rate.
    AnswersAt {
        /// The bit rate in bit/s.
        bit_rate: u32,
    },
    /// The device does not answer LSS; its objects are used instead.
    ObjectsInsteadOfLss,
    /// No document confirms the method.
    UnverifiedMethod {
        /// The doubt in the description.
        doubt: String,
    },
    /// Storing also stores all other values, and resets the COB-IDs to their defaults.
    StoreResetsCobIds,
    /// Another device has the same node-ID, so the node is not reset.
    SharedNodeId(NodeId),
    /// Several slaves are on the bus, and all of them accept the change.
    AllSlavesChange(AnotherSlave),
    /// The slave lacks a service, so LSS cannot show that it is the only slave.
    CannotExcludeOthers(UnansweredService),
    /// Fastscan stopped after this device; there may be further devices.
    MoreUnconfigured {
        /// The device that was found last.
        last: LssAddress,
        /// The error; `None` if the device was found again.
        reason: Option<Reason>,
    },
    /// The device stores the bit rate before it uses it, so it cannot return to the old bit rate.
    NoReturn {
        /// The new bit rate in bit/s.
        bit_rate: u32,
    },
}

impl LssEvent {
    /// Whether the event is printed as a warning.
    pub fn is_warning(&self) -> bool {
        match self {
            LssEvent::Found { .. }
            | LssEvent::StandardRateTable
            | LssEvent::Progress(_)
            | LssEvent::RetryInStopped
            | LssEvent::LeftPreOperational
            | LssEvent::ChangingRate { .. }
            | LssEvent::AnswersAt { .. } => false,
            LssEvent::OtherAnswer(_)
            | LssEvent::ObjectsInsteadOfLss
            | LssEvent::UnverifiedMethod { .. }
            | LssEvent::StoreResetsCobIds
            | LssEvent::SharedNodeId(_)
            | LssEvent::AllSlavesChange(_)
            | LssEvent::CannotExcludeOthers(_)
            | LssEvent::MoreUnconfigured { .. }
            | LssEvent::NoReturn { .. } => true,
        }
    }
}

/// A service that a slave does not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnansweredService {
    /// The inquiry services (5Ah to 5Dh).
    Inquire,
    /// The identify service (46h to 4Bh).
    Identify,
}

/// The evidence of more than one slave on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnotherSlave {
    /// Several nodes answer SDO or send heartbeats.
    Nodes(Vec<NodeId>),
    /// Several devices share a node-ID.
    SharedNodeId(NodeId, super::node_id::DuplicateSign),
    /// Two answers to one LSS inquiry.
    Answers(u32, u32),
    /// The answers to an LSS inquiry collide.
    Collision,
    /// A slave with another serial number than this answers.
    OtherSerial(u32),
    /// The slaves report different node-IDs.
    NodeIds,
    /// LSS and SDO report different identities.
    Identities {
        /// By SDO.
        by_sdo: LssAddress,
        /// By LSS.
        by_lss: LssAddress,
    },
}

/// An LSS error as the reason of an event.
#[derive(Clone, Debug)]
pub struct Reason(pub Arc<LssError>);

/// Compares the debug forms, because errors of the operating system have no comparison.
impl PartialEq for Reason {
    fn eq(&self, other: &Reason) -> bool {
        format!("{:?}", self.0) == format!("{:?}", other.0)
    }
}
