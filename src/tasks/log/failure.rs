//! Causes of failures: nothing was recorded, or a recording ended early.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// Nothing was recorded, or a recording ended early.
#[derive(Clone, Debug, PartialEq)]
pub enum LogFailure {}

impl LogFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<LogFailure> for Cause {
    fn from(cause: LogFailure) -> Cause {
        Cause::Log(cause)
    }
}
