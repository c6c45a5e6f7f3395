//! Causes, effects and notes of `store` and `restore`.

use super::snapshot::Snapshot;
use super::{Group, StoreCommand};
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::tasks::Kind;

/// Settings were not stored or restored.
#[derive(Clone, Debug, PartialEq)]
pub enum StoreFailure {
    /// According to 1010h or 1011h, the device does not support the command.
    NotOnCommand {
        /// The command.
        command: StoreCommand,
        /// The value of the object.
        bits: u64,
    },
    /// The device has no object for this group.
    NoGroup {
        /// The command.
        command: StoreCommand,
        /// The group.
        group: Group,
        /// The abort code.
        code: AbortCode,
    },
    /// The device rejects the read of its capability.
    CapabilityUnreadable {
        /// The command.
        command: StoreCommand,
        /// The abort code.
        code: AbortCode,
    },
    /// After the reset, these settings have other values than before.
    ChangedAtReset(Vec<Difference>),
    /// After the reset, these settings do not have their defaults.
    NotDefault(Vec<Difference>),
}

/// A setting with another value than expected.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The expected value.
    pub expected: Snapshot,
    /// The value that was read; `None` if it could not be read.
    pub found: Option<Snapshot>,
}

impl StoreFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            StoreFailure::NotOnCommand { .. }
            | StoreFailure::NoGroup { .. }
            | StoreFailure::CapabilityUnreadable { .. } => Kind::Refused,
            StoreFailure::ChangedAtReset(_) | StoreFailure::NotDefault(_) => Kind::Unexpected,
        }
    }

    /// Returns the abort code, if the device rejected a request.
    pub fn abort(&self) -> Option<AbortCode> {
        match self {
            StoreFailure::NoGroup { code, .. } | StoreFailure::CapabilityUnreadable { code, .. } => Some(*code),
            _ => None,
        }
    }
}

/// The completed steps of a failed store or restore.
#[derive(Clone, Debug, PartialEq)]
pub enum StoreEffect {
    /// The signature was sent once. It is unknown whether the device executed it.
    SignatureSent {
        /// The command.
        command: StoreCommand,
        /// The group.
        group: Group,
    },
    /// Whether the device answers other requests after the signature.
    Answers(bool),
    /// These groups were stored before the failure.
    Stored(Vec<Group>),
    /// The device acknowledged the signature, but its effect was not verified.
    NotVerified(StoreCommand),
}

/// Notes about a store or restore.
#[derive(Clone, Debug, PartialEq)]
pub enum StoreFact {
    /// These groups are stored instead of the group "all", which would reset these COB-IDs. A value is `None` if it
    /// cannot be read.
    InsteadOfAll(Vec<(ObjectId, Option<u64>)>),
    /// Only the group "all" stores these settings.
    OnlyInAll(Vec<String>),
    /// The device does not store these settings, and they are not at their defaults.
    NotStored(Vec<Snapshot>),
    /// The defaults are used after the next reset.
    AfterReset(Group),
    /// The device was reset, but no setting could be compared.
    NothingCompared,
    /// The settings have the same values as before, which are not their usual defaults.
    Unchanged(Vec<Snapshot>),
}
