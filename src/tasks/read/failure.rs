//! Causes of failures: measured values could not be read.

use crate::device::unit::Unit;
use crate::measure::sample::{Raw, Status};
use crate::tasks::Kind;

/// Measured values could not be read.
#[derive(Clone, Debug, PartialEq)]
pub enum ReadFailure {
    /// The device has no measured value of CiA 404.
    NoMeasuredValue,
    /// The device has no signal of this name.
    NoSignal {
        /// The name.
        name: String,
        /// The signals of the device.
        available: Vec<String>,
    },
    /// The signal has no status object.
    NoStatus {
        /// The signal.
        signal: String,
    },
    /// The value cannot be converted to the requested unit.
    NotConvertible {
        /// The signal.
        signal: String,
        /// Its unit; `None` if it has none.
        from: Option<Unit>,
        /// The requested unit.
        to: Unit,
    },
    /// The object is text or bytes.
    NotNumber {
        /// The object as entered by the user.
        signal: String,
    },
    /// The type of the object is unknown.
    TypeUnknown {
        /// The object as entered by the user.
        signal: String,
        /// The bytes that were received.
        raw: Raw,
    },
    /// The value is invalid.
    Invalid {
        /// The signal.
        signal: String,
        /// The status of the device.
        status: Option<Status>,
    },
}

impl ReadFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            ReadFailure::NoMeasuredValue | ReadFailure::Invalid { .. } => Kind::Unexpected,
            ReadFailure::NoSignal { .. }
            | ReadFailure::NoStatus { .. }
            | ReadFailure::NotConvertible { .. }
            | ReadFailure::NotNumber { .. }
            | ReadFailure::TypeUnknown { .. } => Kind::Usage,
        }
    }
}
