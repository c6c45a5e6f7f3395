//! Expressions that measurements must satisfy: `pressure in 9.95..10.05 bar`.
//!
//! ```text
//! condition:   condition and condition, condition or condition, not condition, (condition)
//!              quantity < quantity          also <= > >= == !=
//!              quantity in quantity..quantity (ends included)
//! quantity:    quantity + quantity          also - * /, -quantity, (quantity), |quantity|
//!              10, 9.95 bar, 1.2 psi        a number without a unit takes the unit of the other side
//!              pressure, ch1, pressure.status, 0x6130:1; of one node: 5.pressure
//!              mean(quantity), noise(), min(), max(), rate(), gap(), count(), invalid()
//! ```
//!
//! - [`Expression::parse`] reads the text before anything is measured.
//! - [`bind`] finds the signals and converts the units as soon as the devices are known.
//! - [`evaluator`] takes samples and returns verdicts.
//!
//! This module does no I/O and reads no clock. Every text is an expression or an error with a position.

pub mod bind;
mod comparison;
mod dimension;
pub mod evaluator;
mod formula;
mod lex;
mod parse;
mod series;
#[cfg(test)]
mod tests;
pub mod tree;
mod validate;
pub mod verdict;

use crate::measure::decode::Wanted;
use std::fmt;
use std::str::FromStr;
use tree::{Condition, Position, SignalName};

/// The longest expression, in characters. It limits how deeply the tree can be nested.
const MAX_LENGTH: usize = 1000;

/// The prefixes of figures of the bus and of a node, which are not signals of a device: `bus.load`.
const FIGURES: [&str; 2] = ["bus.", "node."];

/// An expression: one or several conditions that must all be true.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    text: String,
    parts: Vec<Condition>,
}

impl Expression {
    /// Parses an expression.
    ///
    /// # Errors
    /// The first mistake, with its position in the text.
    pub fn parse(text: &str) -> Result<Expression, ExpressionError> {
        // Line ends and tabs become blanks. The positions of errors refer to this text.
        let text = &*text.split_whitespace().collect::<Vec<_>>().join(" ");
        if let Some((at, _)) = text.char_indices().nth(MAX_LENGTH) {
            let message = format!("the expression is too long (at most {MAX_LENGTH} characters)");
            return Err(LocatedError::new(Position(at), message).in_text(text));
        }
        let condition = parse::parse(text).map_err(|error| error.in_text(text))?;
        let mut parts = Vec::new();
        split(condition, &mut parts);
        parts.iter().try_for_each(validate::check).map_err(|error| error.in_text(text))?;
        Ok(Expression { text: text.to_owned(), parts })
    }

    /// The text as entered, with single blanks.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The conditions joined by `and`. All must be true.
    pub fn parts(&self) -> &[Condition] {
        &self.parts
    }

    /// The signals in the order of the text, with repetitions.
    pub fn signals(&self) -> Vec<&SignalName> {
        let mut signals = Vec::new();
        self.parts.iter().for_each(|part| part.signals(&mut signals));
        signals
    }

    /// The signals to measure, without repetitions.
    pub fn wanted(&self) -> Vec<Wanted> {
        let mut wanted = Vec::new();
        for signal in self.signals() {
            if !wanted.contains(&signal.what) {
                wanted.push(signal.what.clone());
            }
        }
        wanted
    }

    /// The figures of the bus and of nodes in this expression, without repetitions: `bus.load`, `node.heartbeat.max`.
    pub fn figures(&self) -> Vec<String> {
        let names = self.wanted().into_iter().map(|wanted| wanted.name());
        names.filter(|name| FIGURES.iter().any(|prefix| name.starts_with(prefix))).collect()
    }

    /// Returns the first function that needs more than one sample, for example `noise` or `rate`.
    pub fn needs_many_samples(&self) -> Option<tree::Function> {
        let mut functions = Vec::new();
        self.parts.iter().for_each(|part| part.functions(&mut functions));
        functions.into_iter().find(|function| function.needs_many_samples())
    }

    /// Creates an error at a position of this text.
    fn error(&self, at: Position, message: impl Into<String>) -> ExpressionError {
        LocatedError::new(at, message).in_text(&self.text)
    }
}

impl fmt::Display for Expression {
    /// Writes the expression with the necessary parentheses. The text parses to the same expression.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let [only] = self.parts.as_slice() {
            return only.fmt(f);
        }
        for (at, part) in self.parts.iter().enumerate() {
            if at > 0 {
                f.write_str(" and ")?;
            }
            part.fmt_within(f, tree::Precedence::And)?;
        }
        Ok(())
    }
}

impl FromStr for Expression {
    type Err = ExpressionError;

    fn from_str(text: &str) -> Result<Expression, ExpressionError> {
        Expression::parse(text)
    }
}

/// Splits a condition at each `and`. Both sides must be true for every sample, so each one is evaluated separately.
fn split(condition: Condition, parts: &mut Vec<Condition>) {
    match condition {
        Condition::And(left, right) => {
            split(*left, parts);
            split(*right, parts);
        }
        other => parts.push(other),
    }
}

/// A mistake in an expression, with its position.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExpressionError {
    /// The complete expression.
    pub text: String,
    /// Byte offset of the mistake in `text`. It is the length of `text` if the end is missing.
    pub at: usize,
    /// The message for the user.
    pub message: String,
    /// How to correct it.
    pub hint: Option<String>,
}

impl ExpressionError {
    /// The column of the mistake in characters, counted from 1.
    pub fn column(&self) -> usize {
        self.before().chars().count() + 1
    }

    /// The text before the mistake.
    pub fn before(&self) -> &str {
        self.text.get(..self.at).unwrap_or(&self.text)
    }
}

/// A mistake and its position, before the complete text is added.
#[derive(Clone, Debug, PartialEq, Eq)]
struct LocatedError {
    at: Position,
    message: String,
    hint: Option<String>,
}

impl LocatedError {
    fn new(at: Position, message: impl Into<String>) -> LocatedError {
        LocatedError { at, message: message.into(), hint: None }
    }

    fn hint(mut self, hint: impl Into<String>) -> LocatedError {
        self.hint = Some(hint.into());
        self
    }

    fn in_text(self, text: &str) -> ExpressionError {
        ExpressionError { text: text.to_owned(), at: self.at.0, message: self.message, hint: self.hint }
    }
}
