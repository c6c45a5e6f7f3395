//! Text for causes: a channel was not set to zero.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::autozero::AutozeroFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &AutozeroFailure) -> Words {
    match *cause {}
}
