//! Causes of failures: a TPDO could not be shown or changed.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// A TPDO could not be shown or changed.
#[derive(Clone, Debug, PartialEq)]
pub enum PdoFailure {}

impl PdoFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<PdoFailure> for Cause {
    fn from(cause: PdoFailure) -> Cause {
        Cause::Pdo(cause)
    }
}
