//! Causes of failures: a channel was not set to zero.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// A channel was not set to zero.
#[derive(Clone, Debug, PartialEq)]
pub enum AutozeroFailure {}

impl AutozeroFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<AutozeroFailure> for Cause {
    fn from(cause: AutozeroFailure) -> Cause {
        Cause::Autozero(cause)
    }
}
