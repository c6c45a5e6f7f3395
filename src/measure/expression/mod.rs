//! What is expected of measurements, as people write it: `pressure in 9.95..10.05 bar`.
//!
//! ```text
//! condition:   condition and condition, condition or condition, not condition, (condition)
//!              quantity < quantity          also <= > >= == !=
//!              quantity in quantity..quantity, both ends belong to it
//! quantity:    quantity + quantity          also - * /, -quantity, (quantity), |quantity|
//!              10, 9.95 bar, 1.2 psi        a number alone is in the unit of what it stands with
//!              pressure, ch1, pressure.status, 0x6130:1; of one node: 5.pressure
//!              mean(quantity), noise(), min(), max(), rate(), gap(), count(), invalid()
//! ```
//!
//! [`Expression::parse`] reads the text before anything is measured. [`bind`] finds the signals and brings
//! the units together once the devices are known; [`judge`] takes samples and gives verdicts. Nothing here
//! does I/O or reads a clock, and every text is either an expression or an error that points at a character.

pub mod bind;
mod case;
mod dimension;
mod evaluate;
pub mod judge;
mod lex;
mod parse;
mod rules;
#[cfg(test)]
mod tests;
pub mod tree;
pub mod verdict;

use crate::measure::decode::Wanted;
use std::fmt;
use std::str::FromStr;
use tree::{At, Condition, SignalName};

/// The longest text that is taken for an expression, in characters: what is nested in it stays on the stack.
const LONGEST: usize = 1000;

/// A text that is an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    text: String,
    parts: Vec<Condition>,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// What is wrong, and with which character it begins.
    pub fn parse(text: &str) -> Result<Expression, ExpressionError> {
        // Line ends and tabs are blanks; the places of errors are those in the text without them.
        let text = &*text.split_whitespace().collect::<Vec<_>>().join(" ");
        let fail = |at, message: String| ExpressionError { text: text.to_owned(), at, message, hint: None };
        if let Some((at, _)) = text.char_indices().nth(LONGEST) {
            return Err(fail(at, format!("an expression has at most {LONGEST} characters")));
        }
        let condition = parse::parse(text).map_err(|fault| fault.of(text))?;
        let mut parts = Vec::new();
        split(condition, &mut parts);
        parts.iter().try_for_each(rules::check).map_err(|fault| fault.of(text))?;
        Ok(Expression { text: text.to_owned(), parts })
    }

    /// The text it was read from, with single blanks.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What has to hold, every one of them: the parts that stand between `and`.
    pub fn parts(&self) -> &[Condition] {
        &self.parts
    }

    /// The signals in it, in the order in which they stand, each once for every time.
    pub fn signals(&self) -> Vec<&SignalName> {
        let mut signals = Vec::new();
        self.parts.iter().for_each(|part| part.signals(&mut signals));
        signals
    }

    /// What has to be measured of a node for it, each once.
    pub fn wanted(&self) -> Vec<Wanted> {
        let mut wanted = Vec::new();
        for signal in self.signals() {
            if !wanted.contains(&signal.what) {
                wanted.push(signal.what.clone());
            }
        }
        wanted
    }

    /// The first function in it that one sample says nothing about: how much it varies, and how often it comes.
    pub fn needs_many(&self) -> Option<tree::Function> {
        let mut functions = Vec::new();
        self.parts.iter().for_each(|part| part.functions(&mut functions));
        functions.into_iter().find(|function| function.needs_many())
    }

    /// An error at `at` in this text.
    fn fail(&self, at: At, message: impl Into<String>) -> ExpressionError {
        ExpressionError { text: self.text.clone(), at: at.0, message: message.into(), hint: None }
    }
}

impl fmt::Display for Expression {
    /// The expression with the parentheses and blanks that it needs; it reads back as the same one.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let [only] = self.parts.as_slice() {
            return only.fmt(f);
        }
        for (at, part) in self.parts.iter().enumerate() {
            if at > 0 {
                f.write_str(" and ")?;
            }
            part.fmt_within(f, tree::Binds::And)?;
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

/// Every sample has to satisfy both sides of an `and`: they can be judged one by one.
fn split(condition: Condition, parts: &mut Vec<Condition>) {
    match condition {
        Condition::And(left, right) => {
            split(*left, parts);
            split(*right, parts);
        }
        other => parts.push(other),
    }
}

/// What is wrong with an expression, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExpressionError {
    /// The whole expression.
    pub text: String,
    /// The byte in it that the trouble begins with; its length where something is missing at the end.
    pub at: usize,
    /// In words.
    pub message: String,
    /// What helps.
    pub hint: Option<String>,
}

impl ExpressionError {
    /// The character that the trouble begins with, counted from 1.
    pub fn column(&self) -> usize {
        self.before().chars().count() + 1
    }

    /// What stands before the trouble.
    pub fn before(&self) -> &str {
        self.text.get(..self.at).unwrap_or(&self.text)
    }
}

/// What is wrong with a part of a text, and where; not yet with the text.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Fault {
    at: At,
    message: String,
    hint: Option<String>,
}

impl Fault {
    fn new(at: At, message: impl Into<String>) -> Fault {
        Fault { at, message: message.into(), hint: None }
    }

    fn hint(mut self, hint: impl Into<String>) -> Fault {
        self.hint = Some(hint.into());
        self
    }

    fn of(self, text: &str) -> ExpressionError {
        ExpressionError { text: text.to_owned(), at: self.at.0, message: self.message, hint: self.hint }
    }
}
