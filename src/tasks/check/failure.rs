//! Causes of failures: a check failed or had no data.

use crate::measure::expression::verdict::Verdict;
use crate::tasks::Kind;

/// A check failed or had no data.
#[derive(Clone, Debug, PartialEq)]
pub enum CheckFailure {
    /// At least one expression is not satisfied.
    NotSatisfied {
        /// The verdicts of these expressions.
        failed: Vec<Verdict>,
        /// The number of all verdicts.
        all: usize,
    },
    /// The type of an object in an expression is unknown.
    UnknownType {
        /// The object as entered by the user.
        signal: String,
    },
    /// There is no data for at least one expression.
    NoData {
        /// The number of verdicts without data.
        without: usize,
        /// The number of all verdicts.
        all: usize,
    },
}

impl CheckFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            CheckFailure::NotSatisfied { .. } => Kind::CheckFailed,
            CheckFailure::NoData { .. } => Kind::NoAnswer,
            CheckFailure::UnknownType { .. } => Kind::Usage,
        }
    }
}
