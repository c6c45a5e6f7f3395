//! Causes, effects and notes of `autozero` and `tare`.

use super::ZeroTarget;
use super::channel::Offset;
use super::safety::FailedCheck;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::{DataType, Value};
use crate::device::unit::Unit;
use crate::measure::sample::Number;
use crate::tasks::Kind;
use crate::tasks::store::Group;

/// A value with its unit and its decimal digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The value.
    pub value: f64,
    /// Its unit; `None` if the device reports none.
    pub unit: Option<Unit>,
    /// The number of decimal digits to show.
    pub decimals: usize,
}

/// Why a channel was not set to zero.
#[derive(Clone, Debug, PartialEq)]
pub enum AutozeroFailure {
    /// The device has no autozero.
    NoAutozero {
        /// The title of its description.
        title: String,
    },
    /// The device has no autozero for this channel.
    NoSuchChannel {
        /// The title of its description.
        title: String,
        /// The channel.
        channel: u8,
        /// The channels that support it.
        available: Vec<u8>,
    },
    /// The device has several channels, and none was chosen.
    WhichChannel {
        /// The value to set to zero.
        target: ZeroTarget,
        /// The channels that support it; empty if they are unknown.
        available: Vec<u8>,
    },
    /// Neither description nor EDS contains a tare.
    NoTare,
    /// Neither description nor EDS contains a tare for this channel.
    NoTareOfChannel {
        /// The channel.
        channel: u8,
        /// The channels that support it.
        available: Vec<u8>,
    },
    /// The device has no tare zero that can be read and written.
    NoTareZero {
        /// The channel.
        channel: u8,
    },
    /// The channel has no measured value.
    NoMeasuredValueOnChannel {
        /// The channel.
        channel: u8,
    },
    /// The device rejects access to 6125h of this channel.
    NoObject {
        /// The channel.
        channel: u8,
        /// The object.
        object: ObjectId,
        /// The abort code.
        code: AbortCode,
    },
    /// The limit has a unit that does not convert to the unit of the signal.
    LimitUnit {
        /// The signal.
        signal: String,
        /// Its unit.
        unit: Option<Unit>,
        /// The unit of the limit.
        limit: Unit,
    },
    /// The device restarted before the signature was sent.
    RestartedBefore,
    /// A safety check failed.
    Unsafe {
        /// The value to set to zero.
        target: ZeroTarget,
        /// The reason.
        failed_check: FailedCheck,
        /// The channel, if the user chose one.
        channel: Option<u8>,
    },
    /// The device accepted the signature and restarted.
    RestartedAfter,
    /// The device accepted the signature, but the reading is not zero.
    NotZero {
        /// The signal.
        signal: String,
        /// The mean afterwards; `None` if a reading was invalid.
        reading: Option<Quantity>,
        /// Whether the offset or the reading has changed.
        has_acted: bool,
        /// The offset.
        offset: OffsetChange,
    },
    /// The offset changed between the signature and the store.
    OtherOffsetStored,
}

/// The change of the offset by the signature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OffsetChange {
    /// The offset changed from the first to the second number.
    Changed(Number, Number),
    /// The offset did not change.
    Unchanged,
    /// The device has no offset that can be read.
    Unreadable,
}

impl AutozeroFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            AutozeroFailure::NoSuchChannel { .. }
            | AutozeroFailure::NoTare
            | AutozeroFailure::NoTareOfChannel { .. }
            | AutozeroFailure::WhichChannel { .. }
            | AutozeroFailure::NoMeasuredValueOnChannel { .. }
            | AutozeroFailure::LimitUnit { .. } => Kind::Usage,
            AutozeroFailure::NoAutozero { .. }
            | AutozeroFailure::NoObject { .. }
            | AutozeroFailure::NoTareZero { .. } => Kind::Refused,
            AutozeroFailure::Unsafe { .. } => Kind::CheckFailed,
            AutozeroFailure::RestartedBefore
            | AutozeroFailure::RestartedAfter
            | AutozeroFailure::NotZero { .. }
            | AutozeroFailure::OtherOffsetStored => Kind::Unexpected,
        }
    }

    /// Returns the abort code, if the device rejected a request.
    pub fn abort(&self) -> Option<AbortCode> {
        match self {
            AutozeroFailure::NoObject { code, .. } => Some(*code),
            _ => None,
        }
    }
}

/// The state after a failed autozero.
#[derive(Clone, Debug, PartialEq)]
pub enum AutozeroEffect {
    /// The signature was sent once. It is unknown whether the device executed it.
    SignatureSent {
        /// The object.
        object: ObjectId,
    },
    /// The previous offset, and the object with the present offset.
    OffsetBefore {
        /// The object and the number; `None` if no offset can be read.
        offset: Option<(ObjectId, Number)>,
        /// The signal.
        signal: String,
    },
    /// The offset did not change; if no offset can be read, the reading is not zero.
    NoChangeSeen {
        /// The object of the offset; `None` if no offset can be read.
        offset: Option<ObjectId>,
        /// The signal.
        signal: String,
    },
    /// The zero was shifted by this value; `None` if it is unknown.
    Moved(Option<Quantity>),
    /// The zero was stored.
    Stored,
    /// How to undo the change.
    Undo(Undo),
}

/// How to undo a zero.
#[derive(Clone, Debug, PartialEq)]
pub enum Undo {
    /// Write the previous offset.
    Write {
        /// The object.
        object: ObjectId,
        /// The previous value.
        value: Value,
        /// Its type.
        data_type: DataType,
        /// The group to be stored afterwards, if the zero is stored.
        store: Option<Group>,
    },
    /// Restore the factory defaults, because no offset can be written and the zero is stored.
    Restore,
    /// Reset the device, because the zero is not stored.
    Reset,
}

impl Undo {
    pub(super) fn write(offset: &Offset, store: Option<Group>) -> Undo {
        Undo::Write { object: offset.object, value: offset.value.clone(), data_type: offset.data_type, store }
    }
}

/// The proof that the device executed a signature that it did not acknowledge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// The offset changed.
    Offset,
    /// The reading changed to zero.
    Reading,
}

/// A note about a zero that was set.
#[derive(Clone, Debug, PartialEq)]
pub enum AutozeroFact {
    /// A safety check failed and was skipped.
    Forced(FailedCheck),
    /// Nothing was changed, because it was a dry run.
    NothingChanged,
    /// The device did not acknowledge the signature, but this proves that it executed the signature.
    ProvedBy(Proof),
    /// How to undo the change.
    Undo(Undo),
    /// The zero is not stored.
    NotStored {
        /// The group that stores it.
        group: Group,
    },
    /// The zero is stored.
    Stored {
        /// The groups.
        groups: Vec<Group>,
    },
}
