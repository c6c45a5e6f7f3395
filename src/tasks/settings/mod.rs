//! The settings of one measuring device by name: unit, filter, limits, minimum and maximum, errors, and all
//! of them on one page.

pub mod errors;
mod failure;
pub mod filter;
pub mod info;
pub mod limits;
pub mod minmax;
mod page;
pub mod unit;

pub use failure::SettingsFailure;

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::device::catalog::Model;
use crate::device::description::ObjectEntry;
use crate::device::dictionary::Entry;
use crate::device::unit::Unit;
use crate::master::{Master, SdoError, SdoFailure};
use crate::measure::decode::is_smallest;
use crate::measure::layout::Signal;
use crate::measure::sample::Number;
use crate::node::Node;
use crate::node::Overrides;
use crate::node::read::read_values;
use crate::node::survey::survey_nodes;
use crate::node::write::{write, write_and_verify};
use crate::tasks::{Failure, Kind};
use std::sync::Arc;

/// A device whose settings are read and changed.
#[derive(Clone, Debug)]
pub struct Device {
    /// What it is and how it is set up.
    pub instrument: Node,
}

/// A number in the unit of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The number, integers with the device's digits.
    pub number: Number,
    /// `None` where the device does not tell.
    pub unit: Option<Unit>,
}

impl Device {
    /// Reads what a device is and how it is set up.
    ///
    /// # Errors
    /// Silence, breaches of the protocol, and what stops everything.
    pub fn open(master: &mut Master<'_>, node: NodeId, overrides: &Overrides) -> Result<Device, Failure> {
        master.listen_to(&[node])?;
        let instrument = survey_nodes(master, &[node], overrides)?.pop();
        let instrument = instrument.unwrap_or_else(|| Node::new(node));
        Ok(Device { instrument })
    }

    /// The node-ID.
    pub fn node(&self) -> NodeId {
        self.instrument.id
    }

    /// The description, recognised or given.
    pub fn model(&self) -> Option<&Arc<Model>> {
        self.instrument.model.as_ref()
    }

    /// What the description says about an object beyond its type.
    pub fn described(&self, object: ObjectId) -> Option<&ObjectEntry> {
        self.instrument.described(object)
    }

    /// The entry of an object, from the description or the standard.
    pub fn entry(&self, object: ObjectId) -> Option<Entry> {
        self.instrument.entry(object)
    }

    /// The name of an object; its address if it has none.
    pub fn name(&self, object: ObjectId) -> String {
        self.instrument.name_of(object)
    }

    /// Whether the device can have an object. Without a description every object is possible.
    pub fn may_have(&self, object: ObjectId) -> bool {
        self.instrument.may_have(object)
    }

    /// Whether the description says that an object cannot be written.
    pub fn is_fixed(&self, object: ObjectId) -> bool {
        self.instrument.is_read_only(object)
    }

    /// The type of an object: from the description, from the standard, or by the first digit of its index.
    pub fn data_type(&self, object: ObjectId) -> DataType {
        self.instrument.data_type(object)
    }

    /// An object of a signal in the family of its process value; `low` is the index without its first digit.
    pub fn in_family(&self, signal: &Signal, low: u16) -> ObjectId {
        self.instrument.in_family(signal, low)
    }

    /// The object with this name that belongs to a signal.
    pub fn of_signal(&self, signal: &Signal, name: &str) -> Option<ObjectId> {
        self.instrument.object_of(signal, name)
    }

    /// The signal of a name, or the only one.
    ///
    /// # Errors
    /// A name that the device has not, and several signals to choose from.
    pub fn signal(&self, name: Option<&str>) -> Result<&Signal, Failure> {
        match (name, self.instrument.signals.as_slice()) {
            (Some(name), _) => super::read::find(&self.instrument, name),
            (None, [only]) => Ok(only),
            (None, []) => Err(Failure::of_node(Kind::Unexpected, self.node(), "it has no measured value of CiA 404")),
            (None, several) => {
                let names: Vec<&str> = several.iter().map(|signal| signal.name.as_str()).collect();
                let message = format!("which signal? It has {}", names.join(", "));
                Err(Failure::of_node(Kind::Usage, self.node(), message))
            }
        }
    }

    /// Reads objects; `None` for what the device has not or does not tell.
    ///
    /// # Errors
    /// Silence, breaches of the protocol, and what stops everything.
    pub fn read_each(&self, master: &mut Master<'_>, objects: &[ObjectId]) -> Result<Vec<Option<Value>>, Failure> {
        let items: Vec<_> = objects.iter().map(|&object| (self.node(), object, self.data_type(object))).collect();
        let told = |result: Result<Value, SdoError>| match result {
            Ok(value) => Ok(Some(value)),
            Err(SdoError { failure: SdoFailure::Refused(_) | SdoFailure::Fit(_), .. }) => Ok(None),
            Err(error) => Err(Failure::from(error)),
        };
        read_values(master, &items)?.into_iter().map(told).collect()
    }

    /// Reads an object that the device must have.
    ///
    /// # Errors
    /// Refusals too.
    pub fn read(&self, master: &mut Master<'_>, object: ObjectId) -> Result<Value, Failure> {
        Ok(master.read(self.node(), object, self.data_type(object))??)
    }

    /// Writes an object in the form that the device expects.
    ///
    /// # Errors
    /// Refusal, no answer, protocol error, and whatever ends the command.
    pub fn write(&self, master: &mut Master<'_>, object: ObjectId, data: &[u8]) -> Result<(), Failure> {
        write(master, &self.instrument, object, data)?;
        Ok(())
    }

    /// Writes a value and reads it back.
    ///
    /// # Errors
    /// As [`Device::write`]; an object that acknowledges the write and keeps another value.
    pub fn set(&self, master: &mut Master<'_>, object: ObjectId, data: &[u8]) -> Result<(), Failure> {
        write_and_verify(master, &self.instrument, object, data, self.data_type(object))?;
        Ok(())
    }

    /// A value of an object in the unit of its signal.
    pub fn quantity(&self, signal: &Signal, value: &Value) -> Option<Quantity> {
        let number =
            Number::from_value(value, signal.digits.unwrap_or(0)).filter(|number| number.as_f64().is_finite())?;
        Some(Quantity { number, unit: signal.unit })
    }

    /// The same of an object that may show the measured value: none where that is the marker of an overload.
    fn measured(&self, signal: &Signal, object: ObjectId, value: &Value) -> Option<Quantity> {
        let marked = signal.marker && signal.is_value(object) && is_smallest(value, self.data_type(object));
        self.quantity(signal, value).filter(|_| !marked)
    }
}

/// The bytes of a number in the unit of a signal, for an object of a type: integers count `digits`.
///
/// # Errors
/// In words: a number that the type cannot hold, or not with these digits.
pub(super) fn encode_quantity(number: f64, data_type: DataType, digits: u8) -> Result<Vec<u8>, String> {
    let text = match data_type {
        DataType::Real32 | DataType::Real64 => number.to_string(),
        _ => {
            let scaled = number * 10f64.powi(i32::from(digits));
            let whole = scaled.round();
            if (scaled - whole).abs() > 1e-9 * scaled.abs().max(1.0) {
                return Err(format!("{number} is finer than the {digits} decimal digits of the device"));
            }
            format!("{whole:.0}")
        }
    };
    data_type.encode_text(&text).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_count_the_digits_of_the_device() {
        let i32 = DataType::Integer(4);
        assert_eq!(encode_quantity(0.5, i32, 3), Ok(vec![0xf4, 0x01, 0, 0]));
        assert_eq!(encode_quantity(-1.234, i32, 3), Ok(vec![0x2e, 0xfb, 0xff, 0xff]));
        assert_eq!(encode_quantity(0.3, i32, 1), Ok(vec![3, 0, 0, 0]), "not exact in binary, and meant");
        assert_eq!(encode_quantity(12.5, DataType::Real32, 3), Ok(vec![0, 0, 0x48, 0x41]));
        assert_eq!(
            encode_quantity(0.0005, i32, 3),
            Err("0.0005 is finer than the 3 decimal digits of the device".to_owned())
        );
        assert!(encode_quantity(40.0, DataType::Integer(2), 3).is_err(), "does not fit");
    }
}
