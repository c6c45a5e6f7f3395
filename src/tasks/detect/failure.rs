//! Causes of failures: the bit rate of a bus was not found.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// The bit rate of a bus was not found.
#[derive(Clone, Debug, PartialEq)]
pub enum DetectFailure {}

impl DetectFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<DetectFailure> for Cause {
    fn from(cause: DetectFailure) -> Cause {
        Cause::Detect(cause)
    }
}
