//! Causes of failures: a node-ID or a bit rate was not set.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// A node-ID or a bit rate was not set.
#[derive(Clone, Debug, PartialEq)]
pub enum LssFailure {}

impl LssFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<LssFailure> for Cause {
    fn from(cause: LssFailure) -> Cause {
        Cause::Lss(cause)
    }
}
