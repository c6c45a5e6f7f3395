//! Node-ID and bit rate, by LSS (CiA 305) or by objects of the device's own.
//!
//! What all of these hold to: nothing is changed before it is clear that one device is meant and which; the
//! configuration state is left again on every way out; a node is reset only where the reset cannot hit another
//! device; and success is what the device shows afterwards under its new node-ID, not what it acknowledged.

mod assign;
mod cob_ids;
mod confirm;
mod failure;
mod find;
mod objects;
mod only;
mod presence;
mod progress;
mod retime;
mod session;
mod single;
mod subject;
mod ways;

pub use failure::LssFailure;

pub use assign::{Job, Report, assign};
pub use cob_ids::{CobIds, Stale};
pub use confirm::Confirmed;
pub use find::{Slave, identify, scan};
pub use single::{Inquired, Named, activate, inquire, store};
pub use ways::{PlannedRate, Rate, check_rate, check_store};

use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddressError;
pub use crate::canopen::lss::{LssAddress, LssRange};
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// Which device is meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// The one with this node-ID: its identity is read first, and it is addressed by that.
    Node(NodeId),
    /// The one with this identity.
    Address(LssAddress),
    /// The only one on the bus.
    Only,
    /// One without a node-ID, whichever is found first.
    Unconfigured,
}

/// Text that names no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" names no device (5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured)")]
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

/// By which means node-ID and bit rate are set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Via {
    /// What the description of the device says, else LSS.
    #[default]
    Auto,
    /// LSS.
    Lss,
    /// Objects of the device's own.
    Sdo,
}

/// Something worth knowing while it is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Note {
    /// What is going on.
    Step(String),
    /// What is not as it should be, or what could not be proved.
    Warning(String),
}

/// Hears of what is going on.
pub type Tell<'a> = &'a mut dyn FnMut(Note);

/// The longest wait for the acknowledge of what writes to a non-volatile memory; `--timeout` can only lengthen it.
pub const STORE_TIME: Duration = Duration::from_secs(3);
