//! Checks of a parsed expression that need no device.

use super::LocatedError;
use super::tree::{Condition, Position, Quantity};

/// When the value of a quantity is known.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Availability {
    /// Always, because it is a constant.
    Always,
    /// With each sample.
    EachSample,
    /// After the last sample.
    AtEnd,
}

/// Checks one part of an expression:
/// - each comparison contains a signal,
/// - values of single samples and functions of all samples are not mixed.
pub(super) fn check(part: &Condition) -> Result<(), LocatedError> {
    let mut seen = None;
    condition(part, &mut seen)
}

fn condition(part: &Condition, seen: &mut Option<Availability>) -> Result<(), LocatedError> {
    match part {
        Condition::Compare(left, _, right, at) => comparison(&[left, right], *at, seen),
        Condition::Within(value, low, high, at) => comparison(&[value, low, high], *at, seen),
        Condition::And(left, right) | Condition::Or(left, right) => {
            condition(left, seen)?;
            condition(right, seen)
        }
        Condition::Not(inner) => condition(inner, seen),
    }
}

fn comparison(quantities: &[&Quantity], at: Position, seen: &mut Option<Availability>) -> Result<(), LocatedError> {
    let mut has_signal = false;
    for quantity in quantities {
        has_signal |= availability(quantity, seen)? != Availability::Always;
    }
    if has_signal {
        return Ok(());
    }
    Err(LocatedError::new(at, "this comparison contains no signal")
        .hint("add a signal: pressure, 5.pressure, or an object: 0x1001"))
}

fn availability(quantity: &Quantity, seen: &mut Option<Availability>) -> Result<Availability, LocatedError> {
    let found = match quantity {
        Quantity::Number(..) => return Ok(Availability::Always),
        Quantity::Negative(inner, _) | Quantity::Absolute(inner, _) => return availability(inner, seen),
        Quantity::Arithmetic(left, _, right, _) => {
            let (left, right) = (availability(left, seen)?, availability(right, seen)?);
            return Ok(if left == Availability::Always { right } else { left });
        }
        Quantity::Signal(_) => Availability::EachSample,
        Quantity::Aggregate(function, inner, _) => {
            let mut functions = Vec::new();
            inner.functions(&mut functions);
            if !functions.is_empty() {
                return Err(LocatedError::new(inner.at(), "functions cannot be nested"));
            }
            if inner.is_constant() {
                return Err(LocatedError::new(inner.at(), format!("{}() needs a signal", function.as_str())));
            }
            Availability::AtEnd
        }
    };
    match seen.replace(found) {
        Some(before) if before != found => {
            let message = "values of single samples and functions of all samples cannot be mixed";
            Err(LocatedError::new(quantity.at(), message)
                .hint("write two expressions, or use functions on both sides: max(pressure) - mean(pressure) < 0.1"))
        }
        _ => Ok(found),
    }
}
