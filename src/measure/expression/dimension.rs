//! Units in expressions: which values can be compared, and how they are converted to one unit.
//!
//! The scales degC, degF and K have different zero points. So a temperature is converted with the offset of the scale,
//! and a temperature difference without it. For each value, the number of its offsets is counted: 1 in a temperature, 0
//! in a difference of two temperatures. If this number is unknown, the conversion is rejected.

use super::LocatedError;
use super::formula::Formula;
use super::tree::{Operator, Position};
use crate::device::unit::Unit;

/// The number of offsets of the scale that a value contains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Offsets {
    /// The number: 1 in a temperature, 0 in a difference of two temperatures.
    Known(f64),
    /// A number in the expression. The other side of the operator decides.
    Literal,
    /// Unknown, for example in a product of two temperatures.
    Unknown,
}

/// The unit of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Dimension {
    /// A number without a unit in the expression. It takes the unit of the other side.
    Literal,
    /// No unit: a count, a ratio, or a signal of unknown unit.
    None,
    /// A unit.
    In(Unit, Offsets),
}

/// A formula with the unit of its value.
#[derive(Clone, Debug)]
pub(super) struct Typed {
    /// The formula.
    pub(super) formula: Formula,
    /// The unit of its value.
    pub(super) dimension: Dimension,
    /// Whether the value is neither calculated nor converted.
    pub(super) exact: bool,
    /// The quantity as written in the expression.
    pub(super) name: String,
    /// Its position in the expression.
    pub(super) at: Position,
}

impl Typed {
    /// Whether the quantity is a number written with a unit.
    fn is_literal(&self) -> bool {
        matches!(self.dimension, Dimension::In(_, Offsets::Literal))
    }

    /// Replaces `C` and `F` by degrees if `other` is a temperature.
    fn resolve_degrees(mut self, other: Dimension) -> Typed {
        if let (Dimension::In(unit, Offsets::Literal), Dimension::In(other, _)) = (self.dimension, other) {
            self.dimension = Dimension::In(unit.beside(other), Offsets::Literal);
        }
        self
    }

    /// The unit of the device, if the quantity was measured in it.
    fn measured_unit(&self) -> Option<Unit> {
        match self.dimension {
            Dimension::In(unit, _) if !self.is_literal() && unit != Unit::NONE => Some(unit),
            _ => None,
        }
    }

    /// Formats the unit for errors: `p is in bar` or `p has no unit`.
    fn describe_unit(&self) -> String {
        match self.dimension {
            Dimension::In(unit, _) => format!("{} is in {unit}", self.name),
            Dimension::Literal | Dimension::None => format!("{} has no unit", self.name),
        }
    }

    /// Converts this value to the unit of `to`.
    fn converted(self, to: &Typed) -> Result<Typed, LocatedError> {
        let (from, offsets, unit, other_offsets) = match (self.dimension, to.dimension) {
            (Dimension::Literal, _) | (_, Dimension::Literal) | (Dimension::None, Dimension::None) => return Ok(self),
            (Dimension::In(from, _), Dimension::In(unit, _)) if from == unit => return Ok(self),
            (Dimension::In(from, offsets), Dimension::In(unit, others)) => (from, offsets, unit, others),
            _ => return Err(units_differ(&self, to)),
        };
        if from.convert(1.0, unit).is_none() {
            return Err(units_differ(&self, to));
        }
        let offsets = match (offsets, other_offsets) {
            _ if from.has_same_zero(unit) => 0.0,
            (Offsets::Known(offsets), _) | (Offsets::Literal, Offsets::Known(offsets)) => offsets,
            (Offsets::Literal, Offsets::Literal) => 1.0,
            (Offsets::Unknown, _) | (Offsets::Literal, Offsets::Unknown) => {
                return Err(ambiguous(&self, to, from, unit));
            }
        };
        let dimension = Dimension::In(unit, if self.is_literal() { Offsets::Literal } else { Offsets::Known(offsets) });
        let formula = Formula::Converted(Box::new(self.formula), from, unit, offsets);
        Ok(Typed { formula, dimension, exact: false, ..self })
    }
}

fn units_differ(first: &Typed, second: &Typed) -> LocatedError {
    let message = format!("units do not match: {}, {}", first.describe_unit(), second.describe_unit());
    // Report the position of the number, because the user can change it.
    LocatedError::new(if first.is_literal() { first.at } else { second.at }, message)
}

fn ambiguous(first: &Typed, second: &Typed, from: Unit, to: Unit) -> LocatedError {
    let (literal, unit) = if first.is_literal() { (first, to) } else { (second, from) };
    let message = format!("{} is ambiguous: a temperature or a temperature difference", literal.name);
    LocatedError::new(literal.at, message).hint(format!("write it in {unit}"))
}

/// A number without a unit, and the unit of the device that is used for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LimitWithoutUnit {
    /// The number as in the expression.
    pub limit: String,
    /// The unit.
    pub unit: Unit,
}

/// Finds the number or range (`9..11`) in `sides` that takes the unit of the device, because no side states a unit.
pub(super) fn limit_without_unit(sides: &[&Typed]) -> Option<LimitWithoutUnit> {
    let unit = sides.iter().find_map(|side| side.measured_unit())?;
    let bare = sides.iter().filter(|side| side.dimension == Dimension::Literal);
    let limit = bare.map(|side| side.name.as_str()).collect::<Vec<_>>().join("..");
    let is_stated = limit.is_empty() || sides.iter().any(|side| side.is_literal());
    (!is_stated).then_some(LimitWithoutUnit { limit, unit })
}

fn resolve_degrees_of_both(first: Typed, second: Typed) -> (Typed, Typed) {
    let (one, other) = (first.dimension, second.dimension);
    (first.resolve_degrees(other), second.resolve_degrees(one))
}

/// Converts two quantities to one unit: the unit of a number written with a unit, otherwise the first unit.
pub(super) fn to_one_unit(first: Typed, second: Typed) -> Result<(Typed, Typed), LocatedError> {
    let (first, second) = resolve_degrees_of_both(first, second);
    if second.is_literal() {
        Ok((first.converted(&second)?, second))
    } else {
        let second = second.converted(&first)?;
        Ok((first, second))
    }
}

/// Converts a value and its two limits to one unit.
pub(super) fn within(value: Typed, low: Typed, high: Typed) -> Result<[Typed; 3], LocatedError> {
    let (low, high) = (low.resolve_degrees(value.dimension), high.resolve_degrees(value.dimension));
    let value = match [&high, &low].into_iter().find(|limit| limit.is_literal()) {
        Some(limit) => value.converted(limit)?,
        None => value,
    };
    let (low, high) = (low.converted(&value)?, high.converted(&value)?);
    Ok([value, low, high])
}

/// Combines two quantities. `at` is the position of the operator.
pub(super) fn calculate(
    first: Typed,
    operator: Operator,
    second: Typed,
    at: Position,
    name: String,
) -> Result<Typed, LocatedError> {
    let start = first.at;
    let (first, second) = resolve_degrees_of_both(first, second);
    let (first, second) = match operator {
        Operator::Multiply => (first, second),
        // The measured value determines the unit of a sum.
        _ if first.is_literal() && !second.is_literal() && operator != Operator::Divide => {
            let first = convert_term(first, &second)?;
            (first, second)
        }
        Operator::Add | Operator::Subtract => {
            let second = convert_term(second, &first)?;
            (first, second)
        }
        Operator::Divide => match (first.dimension, second.dimension) {
            (Dimension::In(..), Dimension::In(..)) => {
                let second = convert_term(second, &first)?;
                (first, second)
            }
            _ => (first, second),
        },
    };
    let dimension = match operator {
        Operator::Add | Operator::Subtract => sum(first.dimension, operator, second.dimension),
        Operator::Multiply | Operator::Divide => product(&first, operator, &second, at)?,
    };
    let formula = Formula::Arithmetic(Box::new(first.formula), operator, Box::new(second.formula));
    Ok(Typed { formula, dimension, exact: false, name, at: start })
}

/// Converts one term of a sum. A number in another temperature unit is rejected: it could be a temperature or a
/// difference. In the unit of the other term, both are the same number.
fn convert_term(term: Typed, to: &Typed) -> Result<Typed, LocatedError> {
    if let (Dimension::In(from, Offsets::Literal), Dimension::In(unit, offsets)) = (term.dimension, to.dimension)
        && offsets != Offsets::Known(0.0)
        && from.convert(1.0, unit).is_some()
        && !from.has_same_zero(unit)
    {
        return Err(ambiguous(&term, to, from, unit));
    }
    term.converted(to)
}

/// Returns the unit of a sum. Both terms have the same unit.
fn sum(first: Dimension, operator: Operator, second: Dimension) -> Dimension {
    match (first, second) {
        (Dimension::In(unit, first), Dimension::In(_, second)) => Dimension::In(
            unit,
            match (first, second) {
                (Offsets::Known(first), Offsets::Known(second)) if operator == Operator::Add => {
                    Offsets::Known(first + second)
                }
                (Offsets::Known(first), Offsets::Known(second)) => Offsets::Known(first - second),
                // A number added to a difference is a difference.
                (Offsets::Known(0.0), Offsets::Literal) | (Offsets::Literal, Offsets::Known(0.0)) => {
                    Offsets::Known(0.0)
                }
                (Offsets::Literal, Offsets::Literal) => Offsets::Literal,
                _ => Offsets::Unknown,
            },
        ),
        (Dimension::In(unit, offsets), _) | (_, Dimension::In(unit, offsets)) => Dimension::In(
            unit,
            match offsets {
                Offsets::Known(0.0) | Offsets::Literal => offsets,
                _ => Offsets::Unknown,
            },
        ),
        (Dimension::Literal, Dimension::Literal) => Dimension::Literal,
        _ => Dimension::None,
    }
}

/// Returns the unit of a product or a quotient.
fn product(first: &Typed, operator: Operator, second: &Typed, at: Position) -> Result<Dimension, LocatedError> {
    let is_division = operator == Operator::Divide;
    let scaled = |unit: Unit, offsets: Offsets, by: &Typed| {
        let offsets = match (offsets, by.formula.constant()) {
            (Offsets::Known(offsets), Some(by)) => {
                Offsets::Known(if is_division { offsets / by } else { offsets * by })
            }
            (Offsets::Literal, Some(_)) => Offsets::Literal,
            _ => Offsets::Unknown,
        };
        Dimension::In(unit, offsets)
    };
    Ok(match (first.dimension, second.dimension) {
        (Dimension::In(..), Dimension::In(..)) if is_division => Dimension::None,
        (Dimension::In(unit, offsets), Dimension::Literal | Dimension::None) => scaled(unit, offsets, second),
        (Dimension::Literal | Dimension::None, Dimension::In(unit, offsets)) if !is_division => {
            scaled(unit, offsets, first)
        }
        (_, Dimension::In(unit, _)) => {
            let (verb, preposition) = if is_division { ("divide", "by") } else { ("multiply", "by") };
            let first = match first.dimension {
                Dimension::In(unit, _) => unit.to_string(),
                Dimension::Literal | Dimension::None => "a value without a unit".to_owned(),
            };
            let message = format!("cannot {verb} {first} {preposition} {unit}: the result has no known unit");
            return Err(LocatedError::new(at, message));
        }
        (Dimension::Literal, Dimension::Literal) => Dimension::Literal,
        _ => Dimension::None,
    })
}

/// Returns the unit of an absolute value. The absolute value of a temperature cannot be converted.
pub(super) fn absolute(dimension: Dimension) -> Dimension {
    match dimension {
        Dimension::In(unit, Offsets::Known(offsets)) if offsets != 0.0 => Dimension::In(unit, Offsets::Unknown),
        other => other,
    }
}

/// Returns the unit of a negated value.
pub(super) fn negative(dimension: Dimension) -> Dimension {
    match dimension {
        Dimension::In(unit, Offsets::Known(offsets)) => Dimension::In(unit, Offsets::Known(-offsets)),
        other => other,
    }
}
