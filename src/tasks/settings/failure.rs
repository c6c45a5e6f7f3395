//! Causes of failures, effects and facts: a setting could not be shown or changed.

use super::ValueWithUnit;
use super::filter::FilterType;
use super::limits::Limit;
use crate::canopen::object::ObjectId;
use crate::canopen::value::ValueError;
use crate::device::unit::Unit;
use crate::tasks::Kind;

/// A setting could not be shown or changed.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsFailure {
    /// The device has several signals, but the user named none.
    WhichSignal {
        /// The signals of the device.
        available: Vec<String>,
    },
    /// The signal is not a CiA 404 channel, so it has no unit, filter or limits.
    NoChannel {
        /// The signal.
        signal: String,
    },
    /// The device has neither an error register (1001h) nor an error history (1003h).
    NoErrorObjects,
    /// The device has no error history (1003h).
    NoErrorHistory,
    /// The device acknowledged the deletion of the history, but the history is unchanged.
    HistoryNotCleared {
        /// The number of errors in the history.
        count: u64,
    },
    /// This signal (or all signals) has no filter (61A0h, 61A1h).
    NoFilter {
        /// The signal, if one was named.
        signal: Option<String>,
    },
    /// The device does not accept this filter constant.
    FilterConstant {
        /// The signal.
        signal: String,
        /// The constant.
        constant: u16,
    },
    /// The device does not have this type of filter.
    FilterType {
        /// The signal.
        signal: String,
        /// The type.
        wanted: FilterType,
        /// Code and meaning of the available types.
        available: Vec<(u64, String)>,
        /// The doubt about the types in the description; may be empty.
        doubt: String,
    },
    /// No object is known that accepts a damping.
    NoDamping {
        /// The signal.
        signal: String,
    },
    /// A damping requires the moving average, but the filter has another type.
    DampingOfOtherType {
        /// The signal.
        signal: String,
        /// The present type; `None` if the command asks for another type.
        present: Option<String>,
    },
    /// The damping is longer than 65535 ms.
    DampingTooLong,
    /// This signal (or all signals) has no unit (6131h).
    NoUnit {
        /// The signal, if the failure is for one signal.
        signal: Option<String>,
    },
    /// The unit of the signal cannot be changed.
    UnitFixed {
        /// The signal.
        signal: String,
        /// Its unit.
        unit: Unit,
    },
    /// The device does not accept this unit.
    UnitNotAccepted {
        /// The signal.
        signal: String,
        /// The unit.
        unit: Unit,
        /// The accepted units.
        accepted: Vec<Unit>,
    },
    /// The signal has neither a delta nor limits.
    NoLimits {
        /// The signal.
        signal: String,
        /// The first and the last object of the search.
        objects: [ObjectId; 2],
    },
    /// The signal does not have this limit.
    NoSuchLimit {
        /// The signal.
        signal: String,
        /// The limit.
        limit: Limit,
        /// The missing object.
        object: ObjectId,
    },
    /// The lower limit would be above the upper limit.
    LimitsCrossed {
        /// The signal.
        signal: String,
        /// The lower limit, in the unit of the signal.
        lower: f64,
        /// The upper limit, in the unit of the signal.
        upper: f64,
    },
    /// The limit does not fit the object.
    LimitValue {
        /// The signal.
        signal: String,
        /// The limit.
        limit: Limit,
        /// The reason.
        error: QuantityError,
    },
    /// No object is known that contains minimum and maximum.
    NoMinMax,
    /// No object is known that resets minimum and maximum.
    NoMinMaxReset {
        /// The signal.
        signal: String,
    },
    /// The device acknowledged the reset, but minimum and maximum are unchanged.
    MinMaxNotReset {
        /// The signal.
        signal: String,
    },
}

/// A number in the unit of a signal that does not fit its object.
#[derive(Clone, Debug, PartialEq)]
pub enum QuantityError {
    /// The number has more decimal digits than the device.
    TooFine {
        /// The number.
        number: f64,
        /// The decimal digits of the device.
        digits: u8,
    },
    /// The number does not fit the type of the object.
    Value(ValueError),
}

/// The limits after a failed change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SettingsEffect {
    /// The previous limits of the signal were restored.
    LimitsRestored {
        /// The signal.
        signal: String,
    },
    /// Not all previous limits of the signal could be restored.
    LimitsNotRestored {
        /// The signal.
        signal: String,
    },
    /// It is unknown which limits the signal has.
    LimitsUnknown {
        /// The signal.
        signal: String,
    },
}

/// A note about a setting.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsFact {
    /// The signal already has this unit.
    AlreadyInUnit {
        /// The signal.
        signal: String,
        /// The unit.
        unit: Unit,
    },
    /// The device kept the number of an object when the unit changed, so the meaning of the number has changed.
    NotConverted {
        /// The name of the object.
        name: String,
        /// Its value now.
        now: Option<ValueWithUnit>,
    },
    /// The device acknowledged the damping, but the filter constant did not change.
    DampingNotShown {
        /// The filter constant, if it is known.
        constant: Option<u64>,
    },
    /// The description explains this filter constant.
    FilterConstant {
        /// The constant.
        constant: u64,
        /// Its meaning.
        meaning: String,
    },
    /// The repeating average is formed between two TPDOs, and only for a limited time.
    RepeatingLimit {
        /// The TPDO.
        tpdo: String,
        /// Its event timer in ms; `None` if it is sent on SYNC.
        timer_ms: Option<u16>,
        /// The longest time in ms.
        limit_ms: u16,
    },
    /// The TPDO is sent on events, but its event timer and the delta are 0.
    MayNeverSend {
        /// The TPDO.
        tpdo: String,
    },
}

impl SettingsFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            SettingsFailure::WhichSignal { .. }
            | SettingsFailure::FilterConstant { .. }
            | SettingsFailure::FilterType { .. }
            | SettingsFailure::NoDamping { .. }
            | SettingsFailure::DampingOfOtherType { .. }
            | SettingsFailure::DampingTooLong
            | SettingsFailure::UnitFixed { .. }
            | SettingsFailure::UnitNotAccepted { .. }
            | SettingsFailure::NoSuchLimit { .. }
            | SettingsFailure::LimitsCrossed { .. }
            | SettingsFailure::LimitValue { .. } => Kind::Usage,
            SettingsFailure::NoFilter { .. }
            | SettingsFailure::NoErrorObjects
            | SettingsFailure::NoErrorHistory
            | SettingsFailure::NoUnit { .. }
            | SettingsFailure::NoChannel { .. }
            | SettingsFailure::NoLimits { .. }
            | SettingsFailure::NoMinMax
            | SettingsFailure::NoMinMaxReset { .. } => Kind::Refused,
            SettingsFailure::HistoryNotCleared { .. } | SettingsFailure::MinMaxNotReset { .. } => Kind::Unexpected,
        }
    }
}

impl SettingsFact {
    /// Whether the fact is a warning.
    pub fn is_warning(&self) -> bool {
        !matches!(self, SettingsFact::AlreadyInUnit { .. })
    }
}
