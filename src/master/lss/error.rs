//! Errors of LSS services.

use crate::bus::{BusError, time::format_duration};
use crate::canopen::frame::Frame;
use crate::canopen::lss::{ErrorCode, FastscanError, LssAddress, Service, Violation};
use crate::master::Error;
use std::time::Duration;

/// Why an LSS service failed.
#[derive(Debug, thiserror::Error)]
pub enum LssError {
    /// The slave rejected the request with an error code.
    #[error("LSS {service}: refused by the device ({})", code.describe(*.service))]
    Refused {
        /// The service.
        service: Service,
        /// The error code.
        code: ErrorCode,
    },
    /// No slave answered in time.
    #[error("LSS {service}: no answer within {}{}", format_duration(*.waited), .received.map(|frame| format!("; received {frame}")).unwrap_or_default())]
    NoAnswer {
        /// The service.
        service: Service,
        /// The longest wait for one answer.
        waited: Duration,
        /// The first frame of a slave that answers another service.
        received: Option<Frame>,
    },
    /// More than one slave answered a request for one slave.
    #[error("LSS {service}: more than one slave answers")]
    Several {
        /// The service.
        service: Service,
        /// The different answers.
        frames: Vec<Frame>,
    },
    /// An answer violates the protocol.
    #[error("LSS {service}: {violation}: {frame}")]
    Violation {
        /// The service.
        service: Service,
        /// The violation.
        violation: Violation,
        /// The answer.
        frame: Frame,
    },
    /// Another LSS master is active. The other master may have addressed the slave in configuration state.
    #[error("another LSS master sends at the same time: {0}")]
    Disturbed(Frame),
    /// Fastscan got answers but found no address.
    #[error("LSS fastscan: {0}")]
    Fastscan(FastscanError),
    /// The slave that fastscan found reports a different address, or several slaves answer.
    #[error("LSS fastscan: found {found}, but the device reports {reported}")]
    AddressMismatch {
        /// The address that fastscan found.
        found: LssAddress,
        /// The address that the slave in configuration state reports.
        reported: LssAddress,
    },
    /// The bus failed or the user interrupted.
    #[error(transparent)]
    Master(#[from] Error),
}

impl From<BusError> for LssError {
    fn from(error: BusError) -> LssError {
        LssError::Master(Error::Bus(error))
    }
}
