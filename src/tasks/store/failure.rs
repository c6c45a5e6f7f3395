//! Causes of failures: settings were not stored or restored.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// Settings were not stored or restored.
#[derive(Clone, Debug, PartialEq)]
pub enum StoreFailure {}

impl StoreFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<StoreFailure> for Cause {
    fn from(cause: StoreFailure) -> Cause {
        Cause::Store(cause)
    }
}
