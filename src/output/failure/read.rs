//! Text for causes: measured values could not be read.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::read::ReadFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &ReadFailure) -> Words {
    match *cause {}
}
