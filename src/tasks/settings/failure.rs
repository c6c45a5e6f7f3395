//! Causes of failures: a setting could not be shown or changed.

use crate::tasks::Kind;
use crate::tasks::failure::Cause;

/// A setting could not be shown or changed.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsFailure {}

impl SettingsFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match *self {}
    }
}

impl From<SettingsFailure> for Cause {
    fn from(cause: SettingsFailure) -> Cause {
        Cause::Settings(cause)
    }
}
