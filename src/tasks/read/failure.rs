//! Causes of failures: measured values could not be read.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// Measured values could not be read.
#[derive(Clone, Debug, PartialEq)]
pub enum ReadFailure {}

impl ReadFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<ReadFailure> for Cause {
    fn from(cause: ReadFailure) -> Cause {
        Cause::Read(cause)
    }
}
