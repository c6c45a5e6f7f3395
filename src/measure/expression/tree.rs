//! An expression as a tree, and the tree as text.

use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use std::fmt::{self, Display};

/// Where something begins in the text, in bytes. It is not part of what an expression is: all are equal.
#[derive(Clone, Copy, Debug, Default)]
pub struct At(pub usize);

impl PartialEq for At {
    fn eq(&self, _: &At) -> bool {
        true
    }
}

impl Eq for At {}

/// A signal as it was named.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignalName {
    /// Of this node; `None` of every node that is checked.
    pub node: Option<NodeId>,
    /// Which one.
    pub what: Wanted,
    /// Where it stands.
    pub at: At,
}

impl SignalName {
    /// The name without the node, as it stands in a [`crate::measure::sample::Source`].
    pub fn name(&self) -> String {
        match &self.what {
            Wanted::Signal(name) => name.clone(),
            Wanted::Status(name) => format!("{name}.status"),
            Wanted::Object(object) => object.to_string(),
        }
    }
}

impl Display for SignalName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(node) = self.node {
            write!(f, "{node}.")?;
        }
        f.write_str(&self.name())
    }
}

/// What is made of all samples together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Arithmetic mean.
    Mean,
    /// Standard deviation (n - 1).
    Noise,
    /// Least value.
    Min,
    /// Greatest value.
    Max,
    /// Samples a second, between the first and the last.
    Rate,
    /// The longest time between two samples.
    Gap,
    /// How many samples.
    Count,
    /// How many of them had no valid value.
    Invalid,
}

impl Function {
    /// Every function.
    pub const ALL: [Function; 8] = [
        Function::Mean,
        Function::Noise,
        Function::Min,
        Function::Max,
        Function::Rate,
        Function::Gap,
        Function::Count,
        Function::Invalid,
    ];

    /// As it is written.
    pub fn as_str(self) -> &'static str {
        match self {
            Function::Mean => "mean",
            Function::Noise => "noise",
            Function::Min => "min",
            Function::Max => "max",
            Function::Rate => "rate",
            Function::Gap => "gap",
            Function::Count => "count",
            Function::Invalid => "invalid",
        }
    }

    /// Whether one sample tells nothing about it.
    pub fn needs_many(self) -> bool {
        matches!(self, Function::Noise | Function::Rate | Function::Gap)
    }
}

/// The four rules of arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// `+`
    Add,
    /// `-`
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
}

impl Operator {
    /// As it is written.
    pub fn as_str(self) -> &'static str {
        match self {
            Operator::Add => "+",
            Operator::Subtract => "-",
            Operator::Multiply => "*",
            Operator::Divide => "/",
        }
    }

    fn binds(self) -> Binds {
        match self {
            Operator::Add | Operator::Subtract => Binds::Sum,
            Operator::Multiply | Operator::Divide => Binds::Product,
        }
    }
}

/// How two quantities are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    Greater,
    /// `>=`
    AtLeast,
    /// `==`
    Equal,
    /// `!=`
    Unequal,
}

impl Comparison {
    /// As it is written.
    pub fn as_str(self) -> &'static str {
        match self {
            Comparison::Less => "<",
            Comparison::AtMost => "<=",
            Comparison::Greater => ">",
            Comparison::AtLeast => ">=",
            Comparison::Equal => "==",
            Comparison::Unequal => "!=",
        }
    }
}

/// Something that has a value.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantity {
    /// `10`, `9.95 bar`: never negative, and finite.
    Number(f64, Option<Unit>, At),
    /// `pressure`.
    Signal(SignalName),
    /// `-pressure`.
    Negative(Box<Quantity>, At),
    /// `|pressure|`.
    Absolute(Box<Quantity>, At),
    /// `pressure + 1`; the place is that of the operator.
    Arithmetic(Box<Quantity>, Operator, Box<Quantity>, At),
    /// `mean(pressure)`.
    Aggregate(Function, Box<Quantity>, At),
}

/// Something that holds or does not.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// `pressure < 10`; the place is that of the comparison.
    Compare(Quantity, Comparison, Quantity, At),
    /// `pressure in 9..10`; the place is that of `in`.
    Within(Quantity, Quantity, Quantity, At),
    /// Both hold.
    And(Box<Condition>, Box<Condition>),
    /// One of them holds, or both.
    Or(Box<Condition>, Box<Condition>),
    /// It does not hold.
    Not(Box<Condition>),
}

/// How tightly something holds together, the loosest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Binds {
    Or,
    And,
    Not,
    Compare,
    Sum,
    Product,
    Sign,
    Alone,
}

impl Quantity {
    /// Where it begins.
    pub fn at(&self) -> At {
        match self {
            Quantity::Number(_, _, at)
            | Quantity::Negative(_, at)
            | Quantity::Absolute(_, at)
            | Quantity::Aggregate(_, _, at) => *at,
            Quantity::Signal(signal) => signal.at,
            Quantity::Arithmetic(left, ..) => left.at(),
        }
    }

    /// Adds the signals in it to `signals`.
    pub fn signals<'a>(&'a self, signals: &mut Vec<&'a SignalName>) {
        match self {
            Quantity::Number(..) => {}
            Quantity::Signal(signal) => signals.push(signal),
            Quantity::Negative(inner, _) | Quantity::Absolute(inner, _) | Quantity::Aggregate(_, inner, _) => {
                inner.signals(signals);
            }
            Quantity::Arithmetic(left, _, right, _) => {
                left.signals(signals);
                right.signals(signals);
            }
        }
    }

    /// Adds the functions in it to `functions`.
    pub fn functions(&self, functions: &mut Vec<Function>) {
        match self {
            Quantity::Number(..) | Quantity::Signal(_) => {}
            Quantity::Negative(inner, _) | Quantity::Absolute(inner, _) => inner.functions(functions),
            Quantity::Arithmetic(left, _, right, _) => {
                left.functions(functions);
                right.functions(functions);
            }
            Quantity::Aggregate(function, ..) => functions.push(*function),
        }
    }

    /// Whether nothing in it is measured.
    pub fn is_constant(&self) -> bool {
        let mut signals = Vec::new();
        self.signals(&mut signals);
        signals.is_empty()
    }

    fn binds(&self) -> Binds {
        match self {
            Quantity::Arithmetic(_, operator, ..) => operator.binds(),
            Quantity::Negative(..) => Binds::Sign,
            _ => Binds::Alone,
        }
    }

    fn fmt_within(&self, f: &mut fmt::Formatter<'_>, at_least: Binds) -> fmt::Result {
        if self.binds() < at_least { write!(f, "({self})") } else { self.fmt(f) }
    }
}

impl Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Quantity::Number(number, None, _) => write!(f, "{number}"),
            Quantity::Number(number, Some(unit), _) => write!(f, "{number} {unit}"),
            Quantity::Signal(signal) => signal.fmt(f),
            Quantity::Negative(inner, _) => {
                f.write_str("-")?;
                inner.fmt_within(f, Binds::Sign)
            }
            Quantity::Absolute(inner, _) => write!(f, "|{inner}|"),
            Quantity::Arithmetic(left, operator, right, _) => {
                left.fmt_within(f, operator.binds())?;
                write!(f, " {} ", operator.as_str())?;
                // What stands on the right of an operator of its own rank was in parentheses.
                let tighter = if operator.binds() == Binds::Sum { Binds::Product } else { Binds::Sign };
                right.fmt_within(f, tighter)
            }
            Quantity::Aggregate(function, inner, _) => write!(f, "{}({inner})", function.as_str()),
        }
    }
}

impl Condition {
    /// Adds the signals in it to `signals`.
    pub fn signals<'a>(&'a self, signals: &mut Vec<&'a SignalName>) {
        self.quantities(&mut |quantity| quantity.signals(signals));
    }

    /// Adds the functions in it to `functions`.
    pub fn functions(&self, functions: &mut Vec<Function>) {
        self.quantities(&mut |quantity| quantity.functions(functions));
    }

    /// Hands every quantity that is compared in it to `take`.
    pub fn quantities<'a>(&'a self, take: &mut dyn FnMut(&'a Quantity)) {
        match self {
            Condition::Compare(left, _, right, _) => [left, right].into_iter().for_each(take),
            Condition::Within(value, low, high, _) => [value, low, high].into_iter().for_each(take),
            Condition::And(left, right) | Condition::Or(left, right) => {
                left.quantities(take);
                right.quantities(take);
            }
            Condition::Not(inner) => inner.quantities(take),
        }
    }

    fn binds(&self) -> Binds {
        match self {
            Condition::Or(..) => Binds::Or,
            Condition::And(..) => Binds::And,
            Condition::Not(_) => Binds::Not,
            Condition::Compare(..) | Condition::Within(..) => Binds::Compare,
        }
    }

    pub(super) fn fmt_within(&self, f: &mut fmt::Formatter<'_>, at_least: Binds) -> fmt::Result {
        if self.binds() < at_least { write!(f, "({self})") } else { self.fmt(f) }
    }
}

impl Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Condition::Compare(left, comparison, right, _) => write!(f, "{left} {} {right}", comparison.as_str()),
            Condition::Within(value, low, high, _) => write!(f, "{value} in {low}..{high}"),
            Condition::And(left, right) => {
                left.fmt_within(f, Binds::And)?;
                f.write_str(" and ")?;
                right.fmt_within(f, Binds::Not)
            }
            Condition::Or(left, right) => {
                left.fmt_within(f, Binds::Or)?;
                f.write_str(" or ")?;
                right.fmt_within(f, Binds::And)
            }
            Condition::Not(inner) => {
                f.write_str("not ")?;
                inner.fmt_within(f, Binds::Not)
            }
        }
    }
}
