//! Why an interface of this computer could not be configured.

use super::Failure;
use super::failure::BusError;
use crate::tasks::Kind;

/// An action on an interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HostAction {
    /// Bring it up.
    Up {
        /// Its name.
        interface: String,
        /// The bit rate in bit/s; `None` keeps the present bit rate.
        bit_rate: Option<u32>,
        /// Whether to set listen-only mode.
        listen_only: bool,
    },
    /// Bring it down.
    Down {
        /// Its name.
        interface: String,
    },
    /// Find the bit rate of the bus.
    Detect {
        /// Its name.
        interface: String,
    },
}

/// Why an interface was not set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HostFailure {
    /// The program lacks the privilege (CAP_NET_ADMIN).
    NotPermitted {
        /// The action that needs the privilege: `set the bit rate of can0`.
        what: String,
        /// The action.
        action: HostAction,
    },
    /// The interface, its driver or this system does not support the action.
    Unsupported {
        /// The reason.
        reason: String,
        /// The action.
        action: HostAction,
    },
    /// The interface has no bit rate yet, and the user gave none.
    NoBitRate {
        /// Its name.
        interface: String,
    },
}

impl HostFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        Kind::Bus
    }
}

/// Converts the error of an action on an interface to a failure.
pub fn not_set(error: BusError, action: HostAction) -> Failure {
    match error {
        BusError::Permission(what) => Failure::general(HostFailure::NotPermitted { what, action }),
        BusError::Unsupported(reason) => Failure::general(HostFailure::Unsupported { reason, action }),
        error => error.into(),
    }
}
