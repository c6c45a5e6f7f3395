//! Causes of failures: a scan did not find or identify nodes.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// A scan did not find or identify nodes.
#[derive(Clone, Debug, PartialEq)]
pub enum ScanFailure {}

impl ScanFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<ScanFailure> for Cause {
    fn from(cause: ScanFailure) -> Cause {
        Cause::Scan(cause)
    }
}
