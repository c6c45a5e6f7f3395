//! Mistakes in a file with settings.

use crate::canopen::object::ObjectId;
use crate::canopen::value::ValueError;
use crate::device::config_file::{Item, Place};
use crate::device::unit::Unit;
use crate::tasks::Failure;

/// A mistake with its place.
#[derive(Clone, Debug)]
pub struct Mistake {
    /// The place in the file.
    pub place: Place,
    /// The key; empty for a mistake of the syntax.
    pub key: String,
    /// The problem.
    pub problem: Problem,
}

/// A problem in a file.
#[derive(Clone, Debug)]
pub enum Problem {
    /// The text is not TOML.
    Syntax {
        /// The message of the parser.
        message: String,
    },
    /// The key does not exist, or this device does not have it.
    UnknownKey {
        /// The title of the device, if the key is only missing there.
        device: Option<String>,
        /// Similar keys, at most three, the nearest first.
        nearest: Vec<String>,
    },
    /// The value of another key has the same meaning.
    Twice {
        /// The other key.
        other: String,
    },
    /// The value has another type.
    Type {
        /// The expected type, with an example.
        expected: &'static str,
        /// The type in the file.
        found: &'static str,
    },
    /// The text is not a duration with a unit.
    NotADuration {
        /// The text.
        text: String,
    },
    /// The duration is not a multiple of the step of the device.
    DurationStep {
        /// The step in microseconds.
        tick: u32,
    },
    /// The text is not a unit.
    UnknownUnit {
        /// The text.
        text: String,
    },
    /// The text is not a number with a unit.
    NotAQuantity {
        /// The text.
        text: String,
    },
    /// The number has no unit, and the file sets no unit for the signal.
    NoUnit,
    /// The units belong to different quantities.
    OtherQuantity {
        /// The unit in the file.
        from: Unit,
        /// The unit of the signal.
        to: Unit,
    },
    /// The number has more decimal digits than the device.
    TooFine {
        /// The decimal digits.
        digits: u8,
    },
    /// The value does not fit the type of the object.
    Value(ValueError),
    /// The number is out of range.
    Range {
        /// The lowest number.
        low: String,
        /// The highest number.
        high: String,
    },
    /// The device accepts only these values.
    Allowed {
        /// The values.
        values: Vec<String>,
    },
    /// The text is not an allowed word.
    Word {
        /// The text.
        text: String,
        /// The words.
        known: Vec<String>,
    },
    /// The text is not a transmission type.
    Transmission {
        /// The text.
        text: String,
    },
    /// The text is not an identifier.
    NotACobId {
        /// The text.
        text: String,
    },
    /// CiA 301 reserves the identifier.
    Restricted {
        /// The identifier.
        id: u16,
    },
    /// Two PDOs or services have the same identifier.
    SameId {
        /// The identifier.
        id: u32,
        /// The other key.
        other: String,
    },
    /// A TPDO that is switched on needs an identifier.
    NoId,
    /// The text is not a bit rate.
    NotABitRate {
        /// The text.
        text: String,
    },
    /// The mapping has more bits than a frame.
    Bits {
        /// The bits.
        bits: u32,
    },
    /// The mapping has more entries than the device supports.
    Entries {
        /// The number of entries of the device.
        high: String,
    },
    /// An entry of a mapping is wrong.
    Mapping(Box<Failure>),
    /// The device cannot map the object.
    NotMappable {
        /// The object.
        object: ObjectId,
        /// The entry as written in the file.
        text: String,
    },
    /// The table has no such column, or the cell is empty.
    NoColumn {
        /// The column.
        column: String,
    },
    /// The value cannot be changed.
    Fixed {
        /// The value of the device; `None` if it is unknown.
        present: Option<Item>,
    },
    /// The lower end is above the upper end.
    Crossed {
        /// The key of the other end.
        other: String,
        /// Its value.
        value: Item,
    },
    /// Only one of two settings may be on.
    Excluded {
        /// The other key.
        other: String,
        /// Its value.
        value: Item,
    },
}
