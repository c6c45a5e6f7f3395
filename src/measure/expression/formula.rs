//! Values of formulas and results of rules.

use super::tree::{Operator, Relation};
use crate::device::unit::Unit;

/// Calculated values are equal if they differ by less than this share of the larger value. This share is larger than
/// rounding errors, and far below the resolution of any sensor.
const ROUNDING: f64 = 1e-9;

/// The values at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values<'a> {
    /// The latest value of each input.
    pub(super) inputs: &'a [Option<f64>],
    /// The value of each aggregate.
    pub(super) aggregates: &'a [Option<f64>],
}

/// How a value is calculated.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Formula {
    Number(f64),
    Input(usize),
    Aggregate(usize),
    Negative(Box<Formula>),
    Absolute(Box<Formula>),
    Arithmetic(Box<Formula>, Operator, Box<Formula>),
    /// Converts from one unit to another. The number is the number of offsets of the scale in the value.
    Converted(Box<Formula>, Unit, Unit, f64),
}

impl Formula {
    /// Calculates the value. `None` if a value is missing or the result is not finite.
    pub(super) fn value(&self, values: Values<'_>) -> Option<f64> {
        let value = match self {
            Formula::Number(number) => *number,
            Formula::Input(input) => values.inputs.get(*input).copied().flatten()?,
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
            Formula::Converted(inner, from, to, offsets) => {
                from.convert_with_zeros(inner.value(values)?, *to, *offsets)?
            }
        };
        value.is_finite().then_some(value)
    }

    /// Returns the formula with input 0 in place of its only input.
    pub(super) fn of_first_input(&self) -> Formula {
        let inner = |formula: &Formula| Box::new(formula.of_first_input());
        match self {
            Formula::Input(_) => Formula::Input(0),
            Formula::Number(_) | Formula::Aggregate(_) => self.clone(),
            Formula::Negative(of) => Formula::Negative(inner(of)),
            Formula::Absolute(of) => Formula::Absolute(inner(of)),
            Formula::Arithmetic(first, operator, second) => Formula::Arithmetic(inner(first), *operator, inner(second)),
            Formula::Converted(of, from, to, offsets) => Formula::Converted(inner(of), *from, *to, *offsets),
        }
    }

    /// Calculates the constant parts once, for formulas that are evaluated for each sample.
    fn fold(&mut self) {
        let is_constant = |formula: &Formula| {
            let mut inputs = Vec::new();
            formula.inputs(&mut inputs);
            inputs.is_empty() && !formula.has_aggregates()
        };
        if let Some(number) = self.constant().filter(|_| is_constant(self)) {
            *self = Formula::Number(number);
            return;
        }
        match self {
            Formula::Number(_) | Formula::Input(_) | Formula::Aggregate(_) => {}
            Formula::Negative(inner) | Formula::Absolute(inner) | Formula::Converted(inner, ..) => inner.fold(),
            Formula::Arithmetic(first, _, second) => {
                first.fold();
                second.fold();
            }
        }
    }

    fn has_aggregates(&self) -> bool {
        match self {
            Formula::Aggregate(_) => true,
            Formula::Number(_) | Formula::Input(_) => false,
            Formula::Negative(inner) | Formula::Absolute(inner) | Formula::Converted(inner, ..) => {
                inner.has_aggregates()
            }
            Formula::Arithmetic(first, _, second) => first.has_aggregates() || second.has_aggregates(),
        }
    }

    /// Calculates the value of a formula without inputs.
    pub(super) fn constant(&self) -> Option<f64> {
        self.value(Values { inputs: &[], aggregates: &[] })
    }

    /// Adds the inputs of this formula to `inputs`, without repetitions.
    pub(super) fn inputs(&self, inputs: &mut Vec<usize>) {
        match self {
            Formula::Number(_) | Formula::Aggregate(_) => {}
            Formula::Input(input) if inputs.contains(input) => {}
            Formula::Input(input) => inputs.push(*input),
            Formula::Negative(inner) | Formula::Absolute(inner) | Formula::Converted(inner, ..) => {
                inner.inputs(inputs);
            }
            Formula::Arithmetic(first, _, second) => {
                first.inputs(inputs);
                second.inputs(inputs);
            }
        }
    }
}

/// A condition whose signals and units are known.
#[derive(Clone, Debug)]
pub(super) enum Rule {
    /// A comparison. The flag is `true` if both sides are exact: neither calculated nor converted.
    Compare(Formula, Relation, Formula, bool),
    /// A range, ends included.
    Within(Formula, Formula, Formula, bool),
    And(Box<Rule>, Box<Rule>),
    Or(Box<Rule>, Box<Rule>),
    Not(Box<Rule>),
}

impl Rule {
    /// Evaluates the rule. `None` if any of its values is missing.
    pub(super) fn is_satisfied(&self, values: Values<'_>) -> Option<bool> {
        Some(match self {
            Rule::Compare(first, relation, second, exact) => {
                compare(first.value(values)?, *relation, second.value(values)?, *exact)
            }
            Rule::Within(value, low, high, exact) => {
                let (value, low, high) = (value.value(values)?, low.value(values)?, high.value(values)?);
                compare(value, Relation::AtLeast, low, *exact) && compare(value, Relation::AtMost, high, *exact)
            }
            // Both sides are evaluated: a missing value on either side makes the result unknown.
            Rule::And(first, second) => {
                let (first, second) = (first.is_satisfied(values)?, second.is_satisfied(values)?);
                first && second
            }
            Rule::Or(first, second) => {
                let (first, second) = (first.is_satisfied(values)?, second.is_satisfied(values)?);
                first || second
            }
            Rule::Not(inner) => !inner.is_satisfied(values)?,
        })
    }

    /// Calculates the constant parts of the formulas, for example a limit in another unit.
    pub(super) fn fold(&mut self) {
        match self {
            Rule::Compare(first, _, second, _) => [first, second].into_iter().for_each(Formula::fold),
            Rule::Within(value, low, high, _) => [value, low, high].into_iter().for_each(Formula::fold),
            Rule::And(first, second) | Rule::Or(first, second) => [first, second].into_iter().for_each(|it| it.fold()),
            Rule::Not(inner) => inner.fold(),
        }
    }

    /// Adds the inputs of this rule to `inputs`, without repetitions.
    pub(super) fn inputs(&self, inputs: &mut Vec<usize>) {
        match self {
            Rule::Compare(first, _, second, _) => [first, second].into_iter().for_each(|side| side.inputs(inputs)),
            Rule::Within(value, low, high, _) => [value, low, high].into_iter().for_each(|side| side.inputs(inputs)),
            Rule::And(first, second) | Rule::Or(first, second) => {
                first.inputs(inputs);
                second.inputs(inputs);
            }
            Rule::Not(inner) => inner.inputs(inputs),
        }
    }
}

fn compare(first: f64, relation: Relation, second: f64, exact: bool) -> bool {
    let equal =
        if exact { first == second } else { (first - second).abs() <= ROUNDING * first.abs().max(second.abs()) };
    match relation {
        Relation::Less => first < second && !equal,
        Relation::AtMost => first < second || equal,
        Relation::Greater => first > second && !equal,
        Relation::AtLeast => first > second || equal,
        Relation::Equal => equal,
        Relation::Unequal => !equal,
    }
}
