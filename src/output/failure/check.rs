//! Text for causes: a check failed or had no data.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::check::CheckFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &CheckFailure) -> Words {
    match *cause {}
}
