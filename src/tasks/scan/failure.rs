//! Causes of failures: a scan did not find nodes.

use crate::tasks::Kind;

/// A scan did not find nodes.
#[derive(Clone, Debug, PartialEq)]
pub enum ScanFailure {
    /// No node answered, and none was detected by another frame.
    NoAnswer,
    /// No node sent anything while the program only listened.
    NoFrame,
}

impl ScanFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            ScanFailure::NoAnswer | ScanFailure::NoFrame => Kind::NoAnswer,
        }
    }
}
