//! Causes of failures: an NMT state was not reached or not confirmed.

use crate::canopen::nmt::NmtState;
use crate::tasks::Kind;
use crate::tasks::journal::JournalError;

/// An NMT state was not reached or not confirmed.
#[derive(Clone, Debug, PartialEq)]
pub enum NmtFailure {
    /// The node is in another state.
    OtherState {
        /// The state of the node.
        state: NmtState,
        /// The state that was requested.
        wanted: NmtState,
    },
    /// After the command, the node sent nothing and did not answer.
    NoSign,
    /// No boot-up message came after a reset.
    NoBootUp,
    /// The state could not be confirmed.
    NotConfirmed,
    /// The node sends no heartbeat and does not answer SDO requests.
    Absent,
    /// A temporary write could not be recorded in the journal, so it was not sent.
    NotRecorded(JournalError),
    /// The object that decides how the device starts is not in the description.
    NoStartupObject,
}

impl NmtFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            NmtFailure::OtherState { .. } => Kind::Unexpected,
            NmtFailure::NoStartupObject => Kind::Refused,
            NmtFailure::NotRecorded(_) => Kind::Io,
            NmtFailure::NoSign | NmtFailure::NoBootUp | NmtFailure::NotConfirmed | NmtFailure::Absent => Kind::NoAnswer,
        }
    }
}
