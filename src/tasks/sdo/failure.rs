//! Causes of failures: an object could not be named, read or written.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// An object could not be named, read or written.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectFailure {}

impl ObjectFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<ObjectFailure> for Cause {
    fn from(cause: ObjectFailure) -> Cause {
        Cause::Object(cause)
    }
}
