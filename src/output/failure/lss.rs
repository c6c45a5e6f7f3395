//! Text for causes: a node-ID or a bit rate was not set.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::lss::LssFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &LssFailure) -> Words {
    match *cause {}
}
