//! Text for causes: a TPDO could not be shown or changed.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::pdo::PdoFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &PdoFailure) -> Words {
    match *cause {}
}
