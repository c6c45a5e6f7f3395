//! Causes of failures: a node-ID or a bit rate was not set. The texts are in `output`.

use super::device::DeviceName;
use super::event::AnotherSlave;
use super::method::RequestedRate;
use super::node_id::{DuplicateSign, TakenSign};
use super::progress::Progress;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss::{LssAddress, LssRange};
use crate::canopen::object::ObjectId;
use crate::device::catalog::TargetDevice;
use crate::master::LssError;
use crate::tasks::Kind;
use crate::tasks::failure::lss_kind;
use std::sync::Arc;
use std::time::Duration;

/// A node-ID or a bit rate was not set.
#[derive(Clone, Debug)]
pub struct LssFailure {
    /// The device.
    pub device: DeviceName,
    /// The cause.
    pub cause: LssCause,
}

/// Why a node-ID or a bit rate was not set.
#[derive(Clone, Debug)]
pub enum LssCause {
    /// An LSS service with the device failed.
    Service(Arc<LssError>),
    /// The description that the user chose is for this other device.
    OtherDescription(TargetDevice),
    /// The device has no serial number, so it cannot be distinguished from others.
    NoSerialNumber,
    /// More than one device has this node-ID.
    DuplicateNodeId(DuplicateSign),
    /// The node does not answer.
    NoAnswer(Duration),
    /// According to LSS, the device with this identity has another node-ID, or none.
    OtherNodeIdByLss(Option<NodeId>),
    /// Another node has the same identity.
    SameIdentity(NodeId),
    /// More than one slave answers to the identity.
    SeveralWithIdentity,
    /// More than one device is on the bus.
    NotTheOnly(AnotherSlave),
    /// No device answers by SDO or LSS.
    NoDevice,
    /// No device without a node-ID answers.
    NoUnconfigured,
    /// No slave has an identity in this range.
    NoneInRange(LssRange),
    /// The slave does not support inquiries.
    NoInquiry,
    /// The new node-ID is in use.
    Taken(NodeId, TakenSign),
    /// The objects of this device are unknown.
    ObjectsUnknown,
    /// SDO does not reach the device, or also reaches other devices.
    ObjectsOutOfReach,
    /// No object is known for this setting.
    NoObject(Setting),
    /// The object cannot hold the number.
    Number(ObjectId, String),
    /// The values take effect only if they are stored by this object; `None` if the write itself stores them.
    NeedsStore(Option<ObjectId>),
    /// The device does not have this bit rate.
    NoSuchRate {
        /// The title of the description; `None` for the table of CiA 305.
        title: Option<String>,
        /// The requested bit rate.
        rate: RequestedRate,
        /// The rates of the table in bit/s.
        rates: Vec<u32>,
        /// Whether the device can detect the bit rate.
        has_auto: bool,
        /// Whether the table of CiA 305 was used.
        is_standard: bool,
    },
    /// The bit rate codes of the device are unknown.
    RateCodesUnknown(Option<String>),
    /// The device was not reset, so the new node-ID is not confirmed.
    NotReset(NodeId, NotReset),
    /// Another device answers under the new node-ID.
    OtherDeviceAnswers(LssAddress),
    /// The device under the new node-ID reports no identity.
    NotIdentified,
    /// More than one device answers under the new node-ID.
    DuplicateNewNodeId(DuplicateSign),
    /// After the boot-up message, the device did not answer.
    SilentAfterBootUp(Duration),
    /// The device restarted under its old node-ID.
    StillOldNodeId {
        /// The old node-ID.
        old: NodeId,
        /// The new node-ID.
        new: NodeId,
    },
    /// No boot-up message and no answer came from the new node-ID.
    NotSeen {
        /// The new node-ID.
        new: NodeId,
        /// The waiting time.
        waited: Duration,
    },
    /// The host cannot change its bit rate together with the device.
    HostCannotChange(HostObstacle),
    /// Another device is on the bus, so the bit rate of the bus cannot be changed.
    NotAloneForRetime(Neighbour),
    /// The device does not answer at the new bit rate (in bit/s).
    SilentAtRate(u32),
    /// The device stored the new bit rate and was reset, but does not answer at this bit rate.
    SilentAfterStore {
        /// The new bit rate in bit/s.
        bit_rate: u32,
        /// The interface.
        interface: String,
        /// The bit rate of the host now, in bit/s.
        host: u32,
    },
}

/// The setting to change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// The node-ID.
    NodeId,
    /// The bit rate.
    BitRate,
}

/// Why a device was not reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotReset {
    /// Another device has the same node-ID.
    SharedNodeId(NodeId),
    /// The present node-ID of the device is unknown.
    NodeIdUnknown,
}

/// Why the host cannot change its bit rate together with the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostObstacle {
    /// The new bit rate is unknown.
    RateUnknown,
    /// The interface has no bit rate.
    NoBitRate,
    /// The device changes its bit rate at power-on.
    AppliesAtPowerOn,
    /// The device changes its bit rate only after storing.
    AppliesAfterStore,
}

/// Another participant on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Neighbour {
    /// Another node.
    Node(NodeId),
    /// A device without a node-ID.
    Unconfigured,
    /// The sender of frames with this identifier.
    Sender(CanId),
}

/// A change before an LSS task failed, or the state after the failure.
#[derive(Clone, Debug, PartialEq)]
pub enum LssEffect {
    /// The completed steps of the change.
    Progress(DeviceName, Progress, NextStep),
    /// The device may still be in configuration state.
    MayBeConfiguring,
    /// The host uses its old bit rate again.
    HostIsBack {
        /// The old bit rate in bit/s.
        bit_rate: u32,
        /// The new bit rate in bit/s.
        new: u32,
        /// Whether the device answers at the old bit rate.
        device_answers: bool,
    },
}

/// The next step after an incomplete change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NextStep {
    /// Follow the hint of the cause.
    Cause,
    /// Check the node-ID and bit rate of the device after a power cycle.
    SeeAfterPowerCycle,
    /// Check after a power cycle whether the value is stored, or store again.
    StoreAgain,
    /// A power cycle discards values that are not stored.
    PowerCycle,
}

impl LssFailure {
    /// Creates a failure that does not belong to a single device.
    pub fn general(cause: LssCause) -> LssFailure {
        LssFailure { device: DeviceName::default(), cause }
    }

    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match &self.cause {
            LssCause::Service(error) => lss_kind(error),
            LssCause::OtherDescription(_) => Kind::Usage,
            LssCause::NoSerialNumber
            | LssCause::DuplicateNodeId(_)
            | LssCause::OtherNodeIdByLss(_)
            | LssCause::SameIdentity(_)
            | LssCause::SeveralWithIdentity
            | LssCause::NotTheOnly(_)
            | LssCause::Taken(..)
            | LssCause::ObjectsUnknown
            | LssCause::ObjectsOutOfReach
            | LssCause::NoObject(_)
            | LssCause::HostCannotChange(_)
            | LssCause::NotAloneForRetime(_) => Kind::CheckFailed,
            LssCause::Number(..)
            | LssCause::NeedsStore(_)
            | LssCause::NoSuchRate { .. }
            | LssCause::RateCodesUnknown(_) => Kind::Usage,
            LssCause::NoAnswer(_)
            | LssCause::NoDevice
            | LssCause::NoUnconfigured
            | LssCause::NoneInRange(_)
            | LssCause::NoInquiry
            | LssCause::SilentAfterBootUp(_)
            | LssCause::NotSeen { .. }
            | LssCause::SilentAtRate(_)
            | LssCause::SilentAfterStore { .. } => Kind::NoAnswer,
            LssCause::NotReset(..)
            | LssCause::OtherDeviceAnswers(_)
            | LssCause::NotIdentified
            | LssCause::DuplicateNewNodeId(_)
            | LssCause::StillOldNodeId { .. } => Kind::Unexpected,
        }
    }
}
