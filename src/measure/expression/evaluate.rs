//! The values of formulas, and whether rules hold.

use super::tree::{Comparison, Operator};
use crate::device::unit::Unit;

/// Values that were calculated count as equal within this share of the larger one: about the rounding of the
/// calculation, and far below the digits of any sensor.
const ROUNDING: f64 = 1e-9;

/// What is known at the moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values<'a> {
    /// The newest value of each slot.
    pub(super) slots: &'a [Option<f64>],
    /// The value of each aggregate.
    pub(super) aggregates: &'a [Option<f64>],
}

/// How a value comes about.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Formula {
    Number(f64),
    Slot(usize),
    Aggregate(usize),
    Negative(Box<Formula>),
    Absolute(Box<Formula>),
    Arithmetic(Box<Formula>, Operator, Box<Formula>),
    /// From a unit to another one, with so many zeros of its scale.
    Converted(Box<Formula>, Unit, Unit, f64),
}

impl Formula {
    /// The value; `None` where something in it has none, and where the result is no finite number.
    pub(super) fn value(&self, values: Values<'_>) -> Option<f64> {
        let value = match self {
            Formula::Number(number) => *number,
            Formula::Slot(slot) => values.slots.get(*slot).copied().flatten()?,
            Formula::Aggregate(aggregate) => values.aggregates.get(*aggregate).copied().flatten()?,
            Formula::Negative(inner) => -inner.value(values)?,
            Formula::Absolute(inner) => inner.value(values)?.abs(),
            Formula::Arithmetic(first, operator, second) => {
                let (first, second) = (first.value(values)?, second.value(values)?);
                match operator {
                    Operator::Add => first + second,
                    Operator::Subtract => first - second,
                    Operator::Multiply => first * second,
                    Operator::Divide => first / second,
                }
            }
            Formula::Converted(inner, from, to, zeros) => from.convert_with_zeros(inner.value(values)?, *to, *zeros)?,
        };
        value.is_finite().then_some(value)
    }

    /// The value of a formula in which nothing is measured.
    pub(super) fn constant(&self) -> Option<f64> {
        self.value(Values { slots: &[], aggregates: &[] })
    }

    /// Adds the slots in it to `slots`, each once.
    pub(super) fn slots(&self, slots: &mut Vec<usize>) {
        match self {
            Formula::Number(_) | Formula::Aggregate(_) => {}
            Formula::Slot(slot) if slots.contains(slot) => {}
            Formula::Slot(slot) => slots.push(*slot),
            Formula::Negative(inner) | Formula::Absolute(inner) | Formula::Converted(inner, ..) => inner.slots(slots),
            Formula::Arithmetic(first, _, second) => {
                first.slots(slots);
                second.slots(slots);
            }
        }
    }
}

/// What has to hold.
#[derive(Clone, Debug)]
pub(super) enum Rule {
    /// The comparison; whether both sides are as they were sent or written.
    Compare(Formula, Comparison, Formula, bool),
    /// Both ends belong to it.
    Within(Formula, Formula, Formula, bool),
    And(Box<Rule>, Box<Rule>),
    Or(Box<Rule>, Box<Rule>),
    Not(Box<Rule>),
}

impl Rule {
    /// Whether it holds; `None` where any of its values is missing.
    pub(super) fn holds(&self, values: Values<'_>) -> Option<bool> {
        Some(match self {
            Rule::Compare(first, comparison, second, exact) => {
                compare(first.value(values)?, *comparison, second.value(values)?, *exact)
            }
            Rule::Within(value, low, high, exact) => {
                let (value, low, high) = (value.value(values)?, low.value(values)?, high.value(values)?);
                compare(value, Comparison::AtLeast, low, *exact) && compare(value, Comparison::AtMost, high, *exact)
            }
            Rule::And(first, second) => {
                let (first, second) = (first.holds(values)?, second.holds(values)?);
                first && second
            }
            Rule::Or(first, second) => {
                let (first, second) = (first.holds(values)?, second.holds(values)?);
                first || second
            }
            Rule::Not(inner) => !inner.holds(values)?,
        })
    }

    /// Adds the slots in it to `slots`, each once.
    pub(super) fn slots(&self, slots: &mut Vec<usize>) {
        match self {
            Rule::Compare(first, _, second, _) => [first, second].into_iter().for_each(|side| side.slots(slots)),
            Rule::Within(value, low, high, _) => [value, low, high].into_iter().for_each(|side| side.slots(slots)),
            Rule::And(first, second) | Rule::Or(first, second) => {
                first.slots(slots);
                second.slots(slots);
            }
            Rule::Not(inner) => inner.slots(slots),
        }
    }
}

fn compare(first: f64, comparison: Comparison, second: f64, exact: bool) -> bool {
    let equal =
        if exact { first == second } else { (first - second).abs() <= ROUNDING * first.abs().max(second.abs()) };
    match comparison {
        Comparison::Less => first < second && !equal,
        Comparison::AtMost => first < second || equal,
        Comparison::Greater => first > second && !equal,
        Comparison::AtLeast => first > second || equal,
        Comparison::Equal => equal,
        Comparison::Unequal => !equal,
    }
}
