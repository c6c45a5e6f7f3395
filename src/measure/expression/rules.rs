//! What a tree must be to mean something, whatever is measured.

use super::Fault;
use super::tree::{At, Condition, Quantity};

/// What a quantity is known by.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Known {
    /// From the beginning.
    Always,
    /// With every sample.
    BySample,
    /// At the end.
    AtTheEnd,
}

/// Checks one part of an expression: every comparison has something measured in it, and what is known with
/// every sample does not stand with what is known at the end.
pub(super) fn check(part: &Condition) -> Result<(), Fault> {
    let mut seen = None;
    condition(part, &mut seen)
}

fn condition(part: &Condition, seen: &mut Option<Known>) -> Result<(), Fault> {
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

fn comparison(quantities: &[&Quantity], at: At, seen: &mut Option<Known>) -> Result<(), Fault> {
    let mut measured = false;
    for quantity in quantities {
        match known(quantity, seen)? {
            Known::Always => {}
            Known::BySample | Known::AtTheEnd => measured = true,
        }
    }
    if measured {
        return Ok(());
    }
    Err(Fault::new(at, "nothing in this comparison is measured")
        .hint("name a signal: pressure, 5.pressure, or an object with its sub-index: 0x1001:0"))
}

fn known(quantity: &Quantity, seen: &mut Option<Known>) -> Result<Known, Fault> {
    let found = match quantity {
        Quantity::Number(..) => return Ok(Known::Always),
        Quantity::Negative(inner, _) | Quantity::Absolute(inner, _) => return known(inner, seen),
        Quantity::Arithmetic(left, _, right, _) => {
            let (left, right) = (known(left, seen)?, known(right, seen)?);
            return Ok(if left == Known::Always { right } else { left });
        }
        Quantity::Signal(_) => Known::BySample,
        Quantity::Aggregate(function, inner, _) => {
            let mut functions = Vec::new();
            inner.functions(&mut functions);
            if !functions.is_empty() {
                return Err(Fault::new(inner.at(), "a function of a function is not known here"));
            }
            if inner.is_constant() {
                return Err(Fault::new(inner.at(), format!("{}() wants something measured", function.as_str())));
            }
            Known::AtTheEnd
        }
    };
    match seen.replace(found) {
        Some(before) if before != found => Err(Fault::new(
            quantity.at(),
            "what is known with every sample and what is known at the end cannot stand together",
        )
        .hint("write two expressions, or use functions on both sides: max(pressure) - mean(pressure) < 0.1")),
        _ => Ok(found),
    }
}
