//! Causes of failures: an NMT state was not reached or not confirmed.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// An NMT state was not reached or not confirmed.
#[derive(Clone, Debug, PartialEq)]
pub enum NmtFailure {}

impl NmtFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<NmtFailure> for Cause {
    fn from(cause: NmtFailure) -> Cause {
        Cause::Nmt(cause)
    }
}
