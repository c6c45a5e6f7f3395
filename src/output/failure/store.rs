//! Text for causes: settings were not stored or restored.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::store::StoreFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &StoreFailure) -> Words {
    match *cause {}
}
