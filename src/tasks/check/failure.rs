//! Causes of failures: a check failed or had no data.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// A check failed or had no data.
#[derive(Clone, Debug, PartialEq)]
pub enum CheckFailure {}

impl CheckFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<CheckFailure> for Cause {
    fn from(cause: CheckFailure) -> Cause {
        Cause::Check(cause)
    }
}
