//! Causes of failures, effects and facts: a TPDO could not be shown or changed.

use super::settings::Settings;
use crate::bus::BusError;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{MappingEntry, TpdoNumber, Transmission};
use crate::canopen::sdo::AbortCode;
use crate::master::{Error, SdoError, SdoFailure};
use crate::tasks::diagnosis::Silence;
use crate::tasks::failure::Cause;
use crate::tasks::journal::JournalError;
use crate::tasks::store::Group;
use crate::tasks::{Failure, Kind};
use std::sync::Arc;

/// A TPDO could not be shown or changed.
#[derive(Clone, Debug)]
pub enum PdoFailure {
    /// The node has no TPDO.
    NoTpdo,
    /// The node rejected a read of the settings.
    Rejected {
        /// The answer.
        error: Box<SdoError>,
        /// The TPDOs of the node.
        available: Vec<TpdoNumber>,
    },
    /// The node restarted while the settings were read.
    Restarted,
    /// The TPDO is a multiplexed PDO, and its mapping is not a list.
    Multiplexed {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The device does not store the settings of the TPDO.
    NotStored {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The mapping cannot be changed.
    FixedMapping {
        /// The TPDO.
        number: TpdoNumber,
        /// Its mapping.
        mapping: Vec<MappingEntry>,
    },
    /// The CAN identifier is already in use.
    Occupied {
        /// The identifier.
        id: CanId,
        /// Its user.
        by: CobIdUser,
    },
    /// CiA 301 reserves the identifier for other services.
    Restricted {
        /// The identifier.
        id: CanId,
    },
    /// The TPDO has no valid identifier, so it cannot be switched on.
    NoIdentifier {
        /// The TPDO.
        number: TpdoNumber,
        /// The present identifier.
        id: CanId,
    },
    /// The TPDO does not have this parameter.
    NoParameter {
        /// The TPDO.
        number: TpdoNumber,
        /// The parameter.
        parameter: Parameter,
    },
    /// The mapping is longer than 64 bits.
    TooLong {
        /// Its length in bits.
        bits: u32,
    },
    /// The node has no signal and no object with this name.
    UnknownName {
        /// The name.
        name: String,
        /// Similar names, the nearest first.
        nearest: Vec<String>,
        /// The signals of the node.
        signals: Vec<String>,
    },
    /// The width of the object is unknown.
    WidthUnknown {
        /// The object.
        object: ObjectId,
    },
    /// A step of the change failed.
    Change {
        /// The reason.
        error: StepError,
        /// The failed write.
        write: Option<StepWrite>,
        /// The entries that the device can map, if it rejected an entry.
        mappable: Vec<MappingEntry>,
    },
    /// No TPDO of the nodes was received.
    NothingReceived {
        /// The nodes, each with the reason.
        nodes: Vec<(NodeId, Silence)>,
    },
}

/// A parameter of a TPDO that not every device has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// The event timer (180xh:5).
    EventTimer,
    /// The inhibit time (180xh:3).
    InhibitTime,
}

impl Parameter {
    /// Its object.
    pub fn object(self, number: TpdoNumber) -> ObjectId {
        match self {
            Parameter::EventTimer => number.communication(5),
            Parameter::InhibitTime => number.communication(3),
        }
    }
}

/// The user of a CAN identifier.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CobIdUser {
    /// A service of the whole bus: SYNC or TIME.
    Service(&'static str),
    /// A service or PDO of the node itself: `EMCY`, `TPDO2`.
    Own(String),
    /// A service or PDO of another node.
    Other(NodeId, &'static str),
    /// A frame with the identifier was received.
    Traffic,
}

/// One write of a change: an unsigned number of `width` bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepWrite {
    /// The object.
    pub object: ObjectId,
    /// The number.
    pub value: u32,
    /// Its width, 1 to 4 bytes.
    pub width: usize,
}

impl StepWrite {
    pub(super) fn new(object: ObjectId, value: u32, width: usize) -> StepWrite {
        StepWrite { object, value, width }
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        self.value.to_le_bytes().into_iter().take(self.width).collect()
    }
}

/// Why a step failed.
#[derive(Clone, Debug)]
pub enum StepError {
    /// The device rejected the request.
    Rejected(SdoError),
    /// The device did not answer, or its answer violates the protocol.
    Lost(SdoError),
    /// The device restarted.
    Restarted,
    /// The user pressed Ctrl-C.
    Interrupted,
    /// The bus failed.
    Bus(Arc<BusError>),
    /// The step could not be recorded in the journal, so it was not sent.
    NotRecorded(JournalError),
    /// The device acknowledged a write, but has another value.
    ReadBackDiffers {
        /// The object.
        object: ObjectId,
        /// The number that was read back.
        found: u64,
        /// The number that was written.
        written: u64,
    },
}

impl StepError {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            StepError::Rejected(_) => Kind::Refused,
            StepError::Lost(error) => Cause::Sdo(Box::new(error.clone())).kind(),
            StepError::Restarted | StepError::ReadBackDiffers { .. } => Kind::Unexpected,
            StepError::Interrupted => Kind::Interrupted,
            StepError::NotRecorded(_) => Kind::Io,
            StepError::Bus(error) => Cause::Bus(Arc::clone(error)).kind(),
        }
    }

    /// Returns the object of the failed step, if any.
    pub fn object(&self) -> Option<ObjectId> {
        match self {
            StepError::Rejected(error) | StepError::Lost(error) => Some(error.object),
            StepError::ReadBackDiffers { object, .. } => Some(*object),
            StepError::Restarted | StepError::Interrupted | StepError::NotRecorded(_) | StepError::Bus(_) => None,
        }
    }

    /// Returns the abort code, if the device rejected the request.
    pub fn abort(&self) -> Option<AbortCode> {
        match self {
            StepError::Rejected(SdoError { failure: SdoFailure::Refused(code), .. }) => Some(*code),
            _ => None,
        }
    }
}

/// Compares the debug forms, because bus errors have no comparison.
impl PartialEq for StepError {
    fn eq(&self, other: &StepError) -> bool {
        format!("{self:?}") == format!("{other:?}")
    }
}

impl From<Error> for StepError {
    fn from(error: Error) -> StepError {
        match error {
            Error::Interrupted => StepError::Interrupted,
            Error::Bus(error) => StepError::Bus(Arc::new(error)),
            Error::Sdo(error) => error.into(),
        }
    }
}

impl From<SdoError> for StepError {
    fn from(error: SdoError) -> StepError {
        match error.failure {
            SdoFailure::Refused(_) => StepError::Rejected(error),
            _ => StepError::Lost(error),
        }
    }
}

/// The state after a failed change.
#[derive(Clone, Debug, PartialEq)]
pub enum PdoEffect {
    /// The previous mapping and parameters are set.
    Restored {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The previous settings could not be restored.
    Incomplete(Box<Incomplete>),
    /// The new settings are set, but not stored.
    SetNotStored {
        /// The TPDO.
        number: TpdoNumber,
    },
}

/// A change that was neither completed nor reverted.
#[derive(Clone, Debug, PartialEq)]
pub struct Incomplete {
    /// The last confirmed write; `None` if no write was confirmed.
    pub last: Option<StepWrite>,
    /// Why the previous settings could not be restored, and the failed write; `None` if the change failed for the same
    /// reason.
    pub restore: Option<(StepError, Option<StepWrite>)>,
    /// The previous settings.
    pub previous: Settings,
    /// Whether the mapping can be written only in PRE-OPERATIONAL.
    pub needs_preop: bool,
    /// Whether the node was operational.
    pub was_operational: bool,
}

/// A fact about a TPDO that was set.
#[derive(Clone, Debug, PartialEq)]
pub enum PdoFact {
    /// The TPDO already had the requested settings, so nothing was written.
    AlreadySet {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The device does not store the settings of the TPDO.
    LostAtPowerOff {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The device acknowledged that it stored the settings.
    Stored {
        /// The groups of 1010h.
        groups: Vec<Group>,
    },
    /// According to the description, the object cannot be mapped. The request was sent nevertheless.
    MaybeNotMappable {
        /// The object.
        object: ObjectId,
    },
    /// The device does not accept bit 31 of the COB-ID, so the TPDO was changed while it was on.
    ChangedWhileOn {
        /// The TPDO.
        number: TpdoNumber,
        /// The answer to the write of bit 31.
        error: SdoError,
    },
    /// A step failed, but the TPDO has the requested settings.
    SetDespite {
        /// The TPDO.
        number: TpdoNumber,
        /// The error.
        error: StepError,
        /// The failed write.
        write: Option<StepWrite>,
    },
    /// The TPDO is off.
    Off {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The TPDO is sent after a SYNC.
    WaitsForSync {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The event timer is 0: the TPDO is sent only on changes.
    OnlyOnChange {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// The transmission type does not use the event timer.
    TimerUnused {
        /// The transmission type.
        transmission: Transmission,
    },
}

impl PdoFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            PdoFailure::NoTpdo | PdoFailure::Restarted | PdoFailure::Multiplexed { .. } => Kind::Unexpected,
            PdoFailure::Rejected { .. } | PdoFailure::FixedMapping { .. } | PdoFailure::NoParameter { .. } => {
                Kind::Refused
            }
            PdoFailure::NotStored { .. } | PdoFailure::Occupied { .. } => Kind::CheckFailed,
            PdoFailure::Restricted { .. }
            | PdoFailure::NoIdentifier { .. }
            | PdoFailure::TooLong { .. }
            | PdoFailure::UnknownName { .. }
            | PdoFailure::WidthUnknown { .. } => Kind::Usage,
            PdoFailure::Change { error, .. } => error.kind(),
            PdoFailure::NothingReceived { .. } => Kind::NoAnswer,
        }
    }

    /// Returns the abort code, if the device rejected a request.
    pub fn abort(&self) -> Option<AbortCode> {
        match self {
            PdoFailure::Rejected { error, .. } => StepError::from((**error).clone()).abort(),
            PdoFailure::Change { error, .. } => error.abort(),
            _ => None,
        }
    }
}

impl PdoFact {
    /// Whether the fact is a warning.
    pub fn is_warning(&self) -> bool {
        matches!(self, PdoFact::ChangedWhileOn { .. } | PdoFact::SetDespite { .. })
    }
}

/// Converts the error of a read of TPDO settings to a failure.
pub(super) fn read_failure(node: NodeId, available: Vec<TpdoNumber>, error: StepError) -> Failure {
    match error {
        StepError::Rejected(error) => {
            let object = error.object;
            Failure::at(node, PdoFailure::Rejected { error: Box::new(error), available }).of_object(object)
        }
        StepError::Lost(error) => error.into(),
        StepError::Interrupted => Failure::general(Cause::Interrupted),
        StepError::Bus(error) => Failure::general(Cause::Bus(error)),
        // Only writes are recorded and read back.
        StepError::Restarted | StepError::ReadBackDiffers { .. } | StepError::NotRecorded(_) => {
            Failure::at(node, PdoFailure::Restarted)
        }
    }
}
