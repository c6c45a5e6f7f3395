//! Causes of failures: the bit rate of a bus was not found.

use super::Detection;
use crate::tasks::Kind;
use crate::tasks::failure::BusError;
use std::sync::Arc;

/// Why a detection failed.
#[derive(Clone, Debug)]
pub enum DetectFailure {
    /// No bit rate was found.
    NotFound {
        /// The interface.
        interface: String,
        /// The bit rates that were tried.
        detection: Detection,
        /// Whether requests were also sent.
        active: bool,
    },
    /// The interface could not be restored to its previous state.
    NotRestored {
        /// The interface.
        interface: String,
        /// The bit rate of the bus in bit/s, if it was found.
        found: Option<u32>,
        /// The reason.
        error: Arc<BusError>,
    },
}

impl DetectFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            DetectFailure::NotFound { .. } => Kind::NoAnswer,
            DetectFailure::NotRestored { .. } => Kind::Bus,
        }
    }
}
