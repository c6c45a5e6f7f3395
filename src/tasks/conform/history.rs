//! The error history (1003h) before and after the check.

use super::session::Session;
use super::settings::ERROR_COUNT;
use crate::node::Error;

/// The error history at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorEntries {
    /// The number of entries (1003h:0).
    pub count: u64,
    /// The newest entry (1003h:1), if there is one and the device shows it.
    pub newest: Option<u64>,
}

/// An error history that is not as before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HistoryChange {
    /// The error history before the first case.
    pub before: ErrorEntries,
    /// The error history after the last case.
    pub after: ErrorEntries,
}

impl Session<'_, '_> {
    /// Reads the error history; `None` if the device has none.
    pub(super) fn error_entries(&mut self) -> Result<Option<ErrorEntries>, Error> {
        let Some(count) = self.number_or_skip(ERROR_COUNT)? else { return Ok(None) };
        let newest = ERROR_COUNT.with_sub(1);
        let newest = if count > 0 && self.node.may_have(newest) { self.number_or_skip(newest)? } else { None };
        Ok(Some(ErrorEntries { count, newest }))
    }

    /// Compares the error history with the history before the first case. Cases delete the entries that they cause. So
    /// a difference is an error that no case has expected, or a reset has deleted entries.
    pub(super) fn history_change(&mut self) -> Result<Option<HistoryChange>, Error> {
        let Some(before) = self.settings.history else { return Ok(None) };
        let after = self.despite_interrupts(Self::error_entries)?;
        Ok(after.filter(|after| *after != before).map(|after| HistoryChange { before, after }))
    }
}
