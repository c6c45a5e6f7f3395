//! Reads and writes named settings of a device: unit, filter, limits, extreme values, errors.

pub mod errors;
mod failure;
pub mod filter;
pub mod info;
pub mod limits;
pub mod minmax;
mod page;
pub mod unit;

pub use failure::{QuantityError, SettingsEffect, SettingsFact, SettingsFailure};

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::device::unit::Unit;
use crate::master::{Master, SdoError, SdoFailure};
use crate::measure::decode::is_smallest;
use crate::measure::layout::Signal;
use crate::measure::sample::Number;
use crate::node::read::read_values;
use crate::node::survey::survey_nodes;
use crate::node::write::write_and_verify;
use crate::node::{Node, Overrides};
use crate::tasks::Failure;
use crate::tasks::read::ReadFailure;

/// A number in the unit of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueWithUnit {
    /// The number; an integer is scaled with the decimal digits of the device.
    pub number: Number,
    /// The unit; `None` if it is unknown.
    pub unit: Option<Unit>,
}

/// Reads identity, signals and TPDOs of a node.
///
/// # Errors
/// No answer, protocol errors, bus errors and Ctrl-C.
pub fn open(master: &mut Master<'_>, node: NodeId, overrides: &Overrides) -> Result<Node, Failure> {
    master.listen_to(&[node])?;
    Ok(survey_nodes(master, &[node], overrides)?.pop().unwrap_or_else(|| Node::new(node)))
}

/// Returns the signal with this name; without a name, the only signal of the node.
///
/// # Errors
/// The node has no such signal, or several signals and no name was given.
pub fn find_signal<'a>(node: &'a Node, name: Option<&str>) -> Result<&'a Signal, Failure> {
    match (name, node.channels().as_slice()) {
        (Some(name), _) => match super::read::find(node, name)? {
            signal if signal.has_channel() => Ok(signal),
            signal => Err(Failure::at(node.id, SettingsFailure::NoChannel { signal: signal.name.clone() })),
        },
        (None, [only]) => Ok(only),
        (None, []) => Err(Failure::at(node.id, ReadFailure::NoMeasuredValue)),
        (None, several) => {
            let available = several.iter().map(|signal| signal.name.clone()).collect();
            Err(Failure::at(node.id, SettingsFailure::WhichSignal { available }))
        }
    }
}

/// Returns the names of the signals that `text` selects: one name, a list (`ch1,ch3`), a range (`ch1-ch4`, `ch1-4`), or
/// `all`. `all` selects the signals for which `is_selected` is true; if there are none, all signals.
///
/// # Errors
/// The node has no such signal; [`SettingsFailure::NoChannel`].
pub fn select_signals(node: &Node, text: &str, is_selected: impl Fn(&Signal) -> bool) -> Result<Vec<String>, Failure> {
    let channels = node.channels();
    let position = |name: &str| channels.iter().position(|signal| signal.name == name);
    let range = |item: &str| {
        item.match_indices('-').find_map(|(at, _)| {
            let (first, last) = (&item[..at], &item[at + 1..]);
            let prefix = first.trim_end_matches(|c: char| c.is_ascii_digit());
            let (first, last) = (position(first)?, position(last).or_else(|| position(&format!("{prefix}{last}")))?);
            (first <= last).then_some(first..=last)
        })
    };
    let mut names: Vec<String> = Vec::new();
    for item in text.split(',') {
        let found: Vec<&Signal> = match range(item) {
            _ if position(item).is_none() && item == "all" && channels.iter().any(|signal| is_selected(signal)) => {
                channels.iter().copied().filter(|signal| is_selected(signal)).collect()
            }
            _ if position(item).is_none() && item == "all" => channels.clone(),
            Some(range) if position(item).is_none() => channels[range].to_vec(),
            _ => match super::read::find(node, item)? {
                signal if is_selected(signal) => vec![signal],
                _ => vec![find_signal(node, Some(item))?],
            },
        };
        for signal in found {
            if !names.contains(&signal.name) {
                names.push(signal.name.clone());
            }
        }
    }
    Ok(names)
}

/// Reads objects that must answer. A value is `None` if the node rejects the request or the bytes do not fit the type.
fn read_each(master: &mut Master<'_>, node: &Node, objects: &[ObjectId]) -> Result<Vec<Option<Value>>, Failure> {
    let items: Vec<_> = objects.iter().map(|&object| (node.id, object, node.data_type(object))).collect();
    let value = |result: Result<Value, SdoError>| match result {
        Ok(value) => Ok(Some(value)),
        Err(SdoError { failure: SdoFailure::Refused(_) | SdoFailure::Fit(_), .. }) => Ok(None),
        Err(error) => Err(Failure::from(error)),
    };
    read_values(master, &items)?.into_iter().map(value).collect()
}

/// Writes a value and reads it back.
fn set_object(master: &mut Master<'_>, node: &Node, object: ObjectId, data: &[u8]) -> Result<(), Failure> {
    let written = write_and_verify(master, node, object, data, node.data_type(object));
    written.map(drop).map_err(|error| Failure::from(error).explained(node, object, data))
}

/// Converts a value of an object to the unit of its signal; `None` if it is not a finite number.
fn quantity(signal: &Signal, value: &Value) -> Option<ValueWithUnit> {
    let number = signal.number(value).filter(|number| number.as_f64().is_finite())?;
    Some(ValueWithUnit { number, unit: signal.unit })
}

/// Does the same as [`quantity`], but returns `None` if `object` is the process value and contains the overload marker.
fn measured_quantity(node: &Node, signal: &Signal, object: ObjectId, value: &Value) -> Option<ValueWithUnit> {
    let is_marker = signal.has_marker && signal.is_value(object) && is_smallest(value, node.data_type(object));
    quantity(signal, value).filter(|_| !is_marker)
}

/// Encodes a number that is in the unit of a signal. For integer types, the number is multiplied by 10^`digits`.
pub(super) fn encode_quantity(number: f64, data_type: DataType, digits: u8) -> Result<Vec<u8>, QuantityError> {
    let text = match data_type {
        DataType::Real32 | DataType::Real64 => number.to_string(),
        _ => {
            let scaled = number * 10f64.powi(i32::from(digits));
            let whole = scaled.round();
            if (scaled - whole).abs() > 1e-9 * scaled.abs().max(1.0) {
                return Err(QuantityError::TooFine { number, digits });
            }
            format!("{whole:.0}")
        }
    };
    data_type.encode_text(&text).map_err(QuantityError::Value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_scaled_with_the_digits_of_the_device() {
        let i32 = DataType::Integer(4);
        assert_eq!(encode_quantity(0.5, i32, 3), Ok(vec![0xf4, 0x01, 0, 0]));
        assert_eq!(encode_quantity(-1.234, i32, 3), Ok(vec![0x2e, 0xfb, 0xff, 0xff]));
        assert_eq!(encode_quantity(0.3, i32, 1), Ok(vec![3, 0, 0, 0]), "0.3 is not exact in binary");
        assert_eq!(encode_quantity(12.5, DataType::Real32, 3), Ok(vec![0, 0, 0x48, 0x41]));
        assert_eq!(encode_quantity(0.0005, i32, 3), Err(QuantityError::TooFine { number: 0.0005, digits: 3 }));
        assert!(encode_quantity(40.0, DataType::Integer(2), 3).is_err(), "does not fit");
    }
}
