//! Sets node-ID and bit rate by LSS (CiA 305), or through objects of the device.
//!
//! Rules for all functions:
//! - Nothing is changed before exactly one device is known to be addressed.
//! - Every exit path ends the LSS configuration state.
//! - A node is reset only if the reset cannot reach another device.
//! - Success is proven by the device under its new node-ID, not by its acknowledgement.
//!
//! The modules, from the bottom up: `device` (the device and how LSS reaches it), `node_id` and `nodes` (the devices
//! on the bus), `session` (configuration state), `sole` and `resolve` (from the argument to the device), `method`,
//! `objects`, `retime`, `confirm`, `cob_ids`, and the tasks themselves: `assign`, `services`, `find`.

mod assign;
mod cob_ids;
mod confirm;
mod device;
mod event;
mod failure;
mod find;
mod method;
mod node_id;
mod nodes;
mod objects;
mod progress;
mod resolve;
mod retime;
mod services;
mod session;
mod sole;

pub use assign::{Assigned, Job, assign};
pub use cob_ids::{CobIds, StaleCobId};
pub use confirm::Confirmed;
pub use device::{Descriptions, DeviceName};
pub use event::{AnotherSlave, LssEvent, LssFact, Reason, UnansweredService};
pub use failure::{HostObstacle, LssCause, LssEffect, LssFailure, Neighbour, NextStep, NotReset, Setting};
pub use find::{FoundSlave, SearchTimes, identify, scan};
pub use method::{PlannedRate, RequestedRate, check_rate, check_store};
pub use node_id::{DuplicateSign, TakenSign};
pub use progress::{Progress, Stage};
pub use services::{InquireReport, activate, inquire, store};

use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddressError;
pub use crate::canopen::lss::{LssAddress, LssRange};
use crate::tasks::Note;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// The device given to a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// The device with this node-ID. Its identity is read first, then it is addressed by the identity.
    Node(NodeId),
    /// The device with this identity.
    Address(LssAddress),
    /// The only device on the bus.
    Only,
    /// A device without a node-ID: the first that fastscan finds.
    Unconfigured,
}

/// A text that is not a target of LSS.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is not a device (5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured)")]
pub struct TargetError(String);

impl FromStr for Target {
    type Err = TargetError;

    fn from_str(text: &str) -> Result<Target, TargetError> {
        match text {
            "only" => Ok(Target::Only),
            "unconfigured" => Ok(Target::Unconfigured),
            _ if text.contains(':') => {
                text.parse().map(Target::Address).map_err(|_: LssAddressError| TargetError(text.to_owned()))
            }
            _ => text.parse().map(Target::Node).map_err(|_| TargetError(text.to_owned())),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Target::Node(node) => node.fmt(f),
            Target::Address(address) => address.fmt(f),
            Target::Only => f.write_str("only"),
            Target::Unconfigured => f.write_str("unconfigured"),
        }
    }
}

/// The method to set node-ID and bit rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Via {
    /// By the method that the description of the device prefers, else by LSS.
    #[default]
    Auto,
    /// By LSS.
    Lss,
    /// Through objects of the device.
    Sdo,
}

/// Receives notes while a task runs.
pub type Notify<'a> = &'a mut dyn FnMut(Note);

/// The shortest time-out for a write to non-volatile memory.
const STORE_TIMEOUT: Duration = Duration::from_secs(3);
