//! Text for causes: a scan did not find or identify nodes.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::scan::ScanFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &ScanFailure) -> Words {
    match *cause {}
}
