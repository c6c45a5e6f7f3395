//! Text for causes: the bit rate of a bus was not found.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::detect::DetectFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &DetectFailure) -> Words {
    match *cause {}
}
