//! Text for causes: a setting could not be shown or changed.

use super::Words;
use crate::tasks::Failure;
use crate::tasks::settings::SettingsFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &SettingsFailure) -> Words {
    match *cause {}
}
