//! Why an LSS service has no result.

use crate::bus::{BusError, time::spoken};
use crate::canopen::frame::Frame;
use crate::canopen::lss::{ErrorCode, FastscanError, LssAddress, Service, Violation};
use crate::master::Error;
use std::time::Duration;

/// Why an LSS service has no result.
#[derive(Debug, thiserror::Error)]
pub enum LssError {
    /// The slave said no.
    #[error("LSS {service}: refused by the device ({})", code.spoken(*.service))]
    Refused {
        /// What was asked for.
        service: Service,
        /// Its reason.
        code: ErrorCode,
    },
    /// Nobody answered.
    #[error("LSS {service}: no answer within {}", spoken(*.waited))]
    NoAnswer {
        /// What was asked for.
        service: Service,
        /// The longest wait for one answer.
        waited: Duration,
    },
    /// More than one slave answered where one was meant.
    #[error("LSS {service}: more than one slave answers")]
    Several {
        /// What was asked for.
        service: Service,
        /// The different answers.
        frames: Vec<Frame>,
    },
    /// A slave answered against the protocol.
    #[error("LSS {service}: {violation}: {frame}")]
    Violation {
        /// What was asked for.
        service: Service,
        /// What is wrong with the answer.
        violation: Violation,
        /// The answer.
        frame: Frame,
    },
    /// Another LSS master is at work: whose slave is in configuration state cannot be told.
    #[error("another LSS master sends at the same time: {0}")]
    Disturbed(Frame),
    /// Fastscan finds somebody and no address.
    #[error("LSS fastscan: {0}")]
    Fastscan(FastscanError),
    /// The slave that fastscan found calls itself by another address, or several do.
    #[error("LSS fastscan: found {found}, but the device calls itself {told}")]
    Mistaken {
        /// What fastscan found.
        found: LssAddress,
        /// What the slave in configuration state says.
        told: LssAddress,
    },
    /// The bus fails, or the user asked to stop.
    #[error(transparent)]
    Master(#[from] Error),
}

impl From<BusError> for LssError {
    fn from(error: BusError) -> LssError {
        LssError::Master(Error::Bus(error))
    }
}
