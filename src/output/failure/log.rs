//! Text for causes: nothing was recorded, or a recording ended early.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::log::LogFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &LogFailure) -> Words {
    match *cause {}
}
