//! Text for causes: an NMT state was not reached or not confirmed.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::nmt::NmtFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &NmtFailure) -> Words {
    match *cause {}
}
