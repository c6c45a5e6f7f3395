//! Units in expressions: what may be compared with what, and how it is brought to one unit.
//!
//! Scales that do not begin at the same zero (degC, degF, K) want care: a temperature converts otherwise than
//! a difference of two. So it is kept in mind how often the zero of the scale is in a value, and where that
//! cannot be told the conversion is refused.

use super::Fault;
use super::evaluate::Formula;
use super::tree::{At, Operator};
use crate::device::unit::Unit;

/// How often the zero of its scale is in a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Zeros {
    /// So often: once in a temperature, not at all in a difference of two.
    Known(f64),
    /// A number that somebody wrote: as often as in what it stands with.
    Free,
    /// Nobody can tell.
    Unknown,
}

/// What a value is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Dimension {
    /// Numbers that somebody wrote without a unit: that of what they stand with.
    Bare,
    /// No unit: a count, a ratio, a signal whose device tells none.
    Plain,
    /// In this unit.
    In(Unit, Zeros),
}

/// A formula and what its value is of.
#[derive(Clone, Debug)]
pub(super) struct Typed {
    /// The formula.
    pub(super) formula: Formula,
    /// What its value is of.
    pub(super) dimension: Dimension,
    /// Whether its value is a number as it was sent or written, without rounding.
    pub(super) exact: bool,
    /// As people write it.
    pub(super) name: String,
    /// Where it begins.
    pub(super) at: At,
}

impl Typed {
    /// Whether it is a number that somebody wrote, with a unit.
    fn is_literal(&self) -> bool {
        matches!(self.dimension, Dimension::In(_, Zeros::Free))
    }

    fn unit_in_words(&self) -> String {
        match self.dimension {
            Dimension::In(unit, _) => format!("in {unit}"),
            Dimension::Bare | Dimension::Plain => "without a unit".to_owned(),
        }
    }

    /// The same in the unit of `to`; the trouble, if there is any, is with `to`.
    fn adapted(self, to: &Typed) -> Result<Typed, Fault> {
        let (from, zeros, unit, others) = match (self.dimension, to.dimension) {
            (Dimension::Bare, _) | (_, Dimension::Bare) | (Dimension::Plain, Dimension::Plain) => return Ok(self),
            (Dimension::In(from, _), Dimension::In(unit, _)) if from == unit => return Ok(self),
            (Dimension::In(from, zeros), Dimension::In(unit, others)) => (from, zeros, unit, others),
            _ => return Err(differ(&self, to)),
        };
        if from.convert(1.0, unit).is_none() {
            return Err(differ(&self, to));
        }
        let zeros = match (zeros, others) {
            _ if from.has_zero_of(unit) => 0.0,
            (Zeros::Known(zeros), _) | (Zeros::Free, Zeros::Known(zeros)) => zeros,
            (Zeros::Free, Zeros::Free) => 1.0,
            (Zeros::Unknown, _) | (Zeros::Free, Zeros::Unknown) => return Err(cannot_tell(&self, to, from, unit)),
        };
        let dimension = Dimension::In(unit, if self.is_literal() { Zeros::Free } else { Zeros::Known(zeros) });
        let formula = Formula::Converted(Box::new(self.formula), from, unit, zeros);
        Ok(Typed { formula, dimension, exact: false, ..self })
    }
}

fn differ(first: &Typed, second: &Typed) -> Fault {
    let (first_unit, second_unit) = (first.unit_in_words(), second.unit_in_words());
    let message = format!("{} is {first_unit}, and {} is {second_unit}", first.name, second.name);
    // The trouble is with what somebody wrote rather than with what is measured.
    Fault::new(if first.is_literal() { first.at } else { second.at }, message)
}

fn cannot_tell(first: &Typed, second: &Typed, from: Unit, to: Unit) -> Fault {
    let literal = if first.is_literal() { first } else { second };
    let unit = if first.is_literal() { to } else { from };
    let message = format!("{} may be a temperature here or a difference of two", literal.name);
    Fault::new(literal.at, message).hint(format!("write it in {unit}"))
}

/// Two quantities in one unit, to be compared: that of a number that somebody wrote, else that of the first.
pub(super) fn alike(first: Typed, second: Typed) -> Result<(Typed, Typed), Fault> {
    if second.is_literal() {
        Ok((first.adapted(&second)?, second))
    } else {
        let second = second.adapted(&first)?;
        Ok((first, second))
    }
}

/// A value with two limits, in one unit.
pub(super) fn within(value: Typed, low: Typed, high: Typed) -> Result<[Typed; 3], Fault> {
    let value = match [&high, &low].into_iter().find(|limit| limit.is_literal()) {
        Some(limit) => value.adapted(limit)?,
        None => value,
    };
    let (low, high) = (low.adapted(&value)?, high.adapted(&value)?);
    Ok([value, low, high])
}

/// Two quantities in a calculation.
pub(super) fn calculate(first: Typed, operator: Operator, second: Typed, at: At, name: String) -> Result<Typed, Fault> {
    let begin = first.at;
    let (first, second) = match operator {
        Operator::Multiply => (first, second),
        // Of an addition the one that was measured gives the unit.
        _ if first.is_literal() && !second.is_literal() && operator != Operator::Divide => {
            let first = addend(first, &second)?;
            (first, second)
        }
        Operator::Add | Operator::Subtract => {
            let second = addend(second, &first)?;
            (first, second)
        }
        Operator::Divide => match (first.dimension, second.dimension) {
            (Dimension::In(..), Dimension::In(..)) => {
                let second = addend(second, &first)?;
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
    Ok(Typed { formula, dimension, exact: false, name, at: begin })
}

/// A number that somebody wrote may be added to a temperature as a difference or taken from it as another one:
/// only its own unit says the same either way.
fn addend(term: Typed, to: &Typed) -> Result<Typed, Fault> {
    if let (Dimension::In(from, Zeros::Free), Dimension::In(unit, zeros)) = (term.dimension, to.dimension)
        && zeros != Zeros::Known(0.0)
        && from.convert(1.0, unit).is_some()
        && !from.has_zero_of(unit)
    {
        return Err(cannot_tell(&term, to, from, unit));
    }
    term.adapted(to)
}

/// What a sum of these is of; they have been brought to one unit.
fn sum(first: Dimension, operator: Operator, second: Dimension) -> Dimension {
    match (first, second) {
        (Dimension::In(unit, first), Dimension::In(_, second)) => Dimension::In(
            unit,
            match (first, second) {
                (Zeros::Known(first), Zeros::Known(second)) if operator == Operator::Add => {
                    Zeros::Known(first + second)
                }
                (Zeros::Known(first), Zeros::Known(second)) => Zeros::Known(first - second),
                // To a difference a difference is added.
                (Zeros::Known(0.0), Zeros::Free) | (Zeros::Free, Zeros::Known(0.0)) => Zeros::Known(0.0),
                (Zeros::Free, Zeros::Free) => Zeros::Free,
                _ => Zeros::Unknown,
            },
        ),
        (Dimension::In(unit, zeros), _) | (_, Dimension::In(unit, zeros)) => Dimension::In(
            unit,
            match zeros {
                Zeros::Known(0.0) | Zeros::Free => zeros,
                _ => Zeros::Unknown,
            },
        ),
        (Dimension::Bare, Dimension::Bare) => Dimension::Bare,
        _ => Dimension::Plain,
    }
}

/// What a product or a quotient of these is of.
fn product(first: &Typed, operator: Operator, second: &Typed, at: At) -> Result<Dimension, Fault> {
    let divided = operator == Operator::Divide;
    let scaled = |unit: Unit, zeros: Zeros, by: &Typed| {
        let zeros = match (zeros, by.formula.constant()) {
            (Zeros::Known(zeros), Some(by)) => Zeros::Known(if divided { zeros / by } else { zeros * by }),
            (Zeros::Free, Some(_)) => Zeros::Free,
            _ => Zeros::Unknown,
        };
        Dimension::In(unit, zeros)
    };
    Ok(match (first.dimension, second.dimension) {
        (Dimension::In(..), Dimension::In(..)) if divided => Dimension::Plain,
        (Dimension::In(unit, zeros), Dimension::Bare | Dimension::Plain) => scaled(unit, zeros, second),
        (Dimension::Bare | Dimension::Plain, Dimension::In(unit, zeros)) if !divided => scaled(unit, zeros, first),
        (_, Dimension::In(..)) => {
            let (first_unit, second_unit) = (first.unit_in_words(), second.unit_in_words());
            let word = if divided { "divided by" } else { "times" };
            let message = format!("a value {first_unit} {word} one {second_unit} has no unit that is known here");
            return Err(Fault::new(at, message));
        }
        (Dimension::Bare, Dimension::Bare) => Dimension::Bare,
        _ => Dimension::Plain,
    })
}

/// What stays of it between two bars: the size of a temperature is none.
pub(super) fn absolute(dimension: Dimension) -> Dimension {
    match dimension {
        Dimension::In(unit, Zeros::Known(zeros)) if zeros != 0.0 => Dimension::In(unit, Zeros::Unknown),
        other => other,
    }
}

/// What stays of it with its sign turned.
pub(super) fn negative(dimension: Dimension) -> Dimension {
    match dimension {
        Dimension::In(unit, Zeros::Known(zeros)) => Dimension::In(unit, Zeros::Known(-zeros)),
        other => other,
    }
}
