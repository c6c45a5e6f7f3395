//! The syntax tree of an expression, and its text form.

use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use std::fmt::{self, Display};

/// A position in the text, in bytes. All positions compare as equal, so that trees compare by their meaning.
#[derive(Clone, Copy, Debug, Default)]
pub struct Position(pub usize);

impl PartialEq for Position {
    fn eq(&self, _: &Position) -> bool {
        true
    }
}

impl Eq for Position {}

/// A signal in an expression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignalName {
    /// The node. `None`: each node that is checked.
    pub node: Option<NodeId>,
    /// The signal or object.
    pub what: Wanted,
    /// Its position in the text.
    pub at: Position,
}

impl SignalName {
    /// The name without the node, as in [`crate::measure::sample::Source`].
    pub fn name(&self) -> String {
        self.what.name()
    }
}

impl Display for SignalName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(node) = self.node {
            write!(f, "{node}.")?;
        }
        match self.name() {
            name if matches!(self.what, Wanted::Signal(_)) && !is_bare(&name) => write!(f, "\"{name}\""),
            name => f.write_str(&name),
        }
    }
}

/// Whether a name needs no quotes in an expression: letters, digits and `_`, with hyphens before letters, and an
/// optional sub-index.
fn is_bare(name: &str) -> bool {
    let (word, sub) = name.split_once(':').unwrap_or((name, "0"));
    let is_word = |part: &str| part.starts_with(|first: char| first.is_ascii_alphabetic());
    let is_plain = |part: &str| part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    !sub.is_empty()
        && sub.bytes().all(|byte| byte.is_ascii_digit())
        && word.split('-').all(|part| is_word(part) && is_plain(part))
}

/// A function of all samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Arithmetic mean.
    Mean,
    /// Standard deviation (n - 1).
    Noise,
    /// Lowest value.
    Min,
    /// Highest value.
    Max,
    /// Samples per second, from the first to the last one.
    Rate,
    /// The longest interval between two samples, in seconds.
    Gap,
    /// Number of samples.
    Count,
    /// Number of samples without a valid value.
    Invalid,
}

impl Function {
    /// All functions.
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

    /// The text in an expression.
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

    /// Whether the function needs more than one sample.
    pub fn needs_many_samples(self) -> bool {
        matches!(self, Function::Noise | Function::Rate | Function::Gap)
    }
}

/// An arithmetic operator.
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
    /// The text in an expression.
    pub fn as_str(self) -> &'static str {
        match self {
            Operator::Add => "+",
            Operator::Subtract => "-",
            Operator::Multiply => "*",
            Operator::Divide => "/",
        }
    }

    fn precedence(self) -> Precedence {
        match self {
            Operator::Add | Operator::Subtract => Precedence::Sum,
            Operator::Multiply | Operator::Divide => Precedence::Product,
        }
    }
}

/// A comparison operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
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

impl Relation {
    /// The text in an expression.
    pub fn as_str(self) -> &'static str {
        match self {
            Relation::Less => "<",
            Relation::AtMost => "<=",
            Relation::Greater => ">",
            Relation::AtLeast => ">=",
            Relation::Equal => "==",
            Relation::Unequal => "!=",
        }
    }
}

/// An expression with a numeric value.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantity {
    /// `10`, `9.95 bar`: finite, not negative.
    Number(f64, Option<Unit>, Position),
    /// `pressure`.
    Signal(SignalName),
    /// `-pressure`.
    Negative(Box<Quantity>, Position),
    /// `|pressure|`.
    Absolute(Box<Quantity>, Position),
    /// `pressure + 1`, with the position of the operator.
    Arithmetic(Box<Quantity>, Operator, Box<Quantity>, Position),
    /// `mean(pressure)`.
    Aggregate(Function, Box<Quantity>, Position),
}

/// An expression that is true or false.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// `pressure < 10`, with the position of the comparison operator.
    Compare(Quantity, Relation, Quantity, Position),
    /// `pressure in 9..10`, with the position of `in`.
    Within(Quantity, Quantity, Quantity, Position),
    /// Both are true.
    And(Box<Condition>, Box<Condition>),
    /// At least one is true.
    Or(Box<Condition>, Box<Condition>),
    /// The inner condition is false.
    Not(Box<Condition>),
}

/// Operator precedence, lowest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Precedence {
    Or,
    And,
    Not,
    Compare,
    Sum,
    Product,
    Sign,
    Primary,
}

impl Quantity {
    /// Its position in the text.
    pub fn at(&self) -> Position {
        match self {
            Quantity::Number(_, _, at)
            | Quantity::Negative(_, at)
            | Quantity::Absolute(_, at)
            | Quantity::Aggregate(_, _, at) => *at,
            Quantity::Signal(signal) => signal.at,
            Quantity::Arithmetic(left, ..) => left.at(),
        }
    }

    /// Adds its signals to `signals`.
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

    /// Adds its functions to `functions`.
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

    /// Whether it contains no signal.
    pub fn is_constant(&self) -> bool {
        let mut signals = Vec::new();
        self.signals(&mut signals);
        signals.is_empty()
    }

    fn precedence(&self) -> Precedence {
        match self {
            Quantity::Arithmetic(_, operator, ..) => operator.precedence(),
            Quantity::Negative(..) => Precedence::Sign,
            _ => Precedence::Primary,
        }
    }

    fn fmt_within(&self, f: &mut fmt::Formatter<'_>, lowest: Precedence) -> fmt::Result {
        if self.precedence() < lowest { write!(f, "({self})") } else { self.fmt(f) }
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
                inner.fmt_within(f, Precedence::Sign)
            }
            Quantity::Absolute(inner, _) => write!(f, "|{inner}|"),
            Quantity::Arithmetic(left, operator, right, _) => {
                left.fmt_within(f, operator.precedence())?;
                write!(f, " {} ", operator.as_str())?;
                // A right operand of the same precedence needs parentheses.
                let tighter =
                    if operator.precedence() == Precedence::Sum { Precedence::Product } else { Precedence::Sign };
                right.fmt_within(f, tighter)
            }
            Quantity::Aggregate(function, inner, _) => write!(f, "{}({inner})", function.as_str()),
        }
    }
}

impl Condition {
    /// Adds its signals to `signals`.
    pub fn signals<'a>(&'a self, signals: &mut Vec<&'a SignalName>) {
        self.quantities(&mut |quantity| quantity.signals(signals));
    }

    /// Adds its functions to `functions`.
    pub fn functions(&self, functions: &mut Vec<Function>) {
        self.quantities(&mut |quantity| quantity.functions(functions));
    }

    /// Calls `visit` with each quantity that is compared.
    pub fn quantities<'a>(&'a self, visit: &mut dyn FnMut(&'a Quantity)) {
        match self {
            Condition::Compare(left, _, right, _) => [left, right].into_iter().for_each(visit),
            Condition::Within(value, low, high, _) => [value, low, high].into_iter().for_each(visit),
            Condition::And(left, right) | Condition::Or(left, right) => {
                left.quantities(visit);
                right.quantities(visit);
            }
            Condition::Not(inner) => inner.quantities(visit),
        }
    }

    fn precedence(&self) -> Precedence {
        match self {
            Condition::Or(..) => Precedence::Or,
            Condition::And(..) => Precedence::And,
            Condition::Not(_) => Precedence::Not,
            Condition::Compare(..) | Condition::Within(..) => Precedence::Compare,
        }
    }

    pub(super) fn fmt_within(&self, f: &mut fmt::Formatter<'_>, lowest: Precedence) -> fmt::Result {
        if self.precedence() < lowest { write!(f, "({self})") } else { self.fmt(f) }
    }
}

impl Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Condition::Compare(left, relation, right, _) => write!(f, "{left} {} {right}", relation.as_str()),
            Condition::Within(value, low, high, _) => write!(f, "{value} in {low}..{high}"),
            Condition::And(left, right) => {
                left.fmt_within(f, Precedence::And)?;
                f.write_str(" and ")?;
                right.fmt_within(f, Precedence::Not)
            }
            Condition::Or(left, right) => {
                left.fmt_within(f, Precedence::Or)?;
                f.write_str(" or ")?;
                right.fmt_within(f, Precedence::And)
            }
            Condition::Not(inner) => {
                f.write_str("not ")?;
                inner.fmt_within(f, Precedence::Not)
            }
        }
    }
}
