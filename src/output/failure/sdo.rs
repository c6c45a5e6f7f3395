//! Text for causes: an object could not be named, read or written.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::sdo::ObjectFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &ObjectFailure) -> Words {
    match *cause {}
}
