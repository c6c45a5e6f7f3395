//! The results of expressions.

use crate::bus::Stamp;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::sample::Status;
use std::time::Duration;

/// The result of one expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples satisfy the expression.
    Ok,
    /// At least one sample is invalid or does not satisfy the expression.
    Fail,
    /// There are not enough samples to decide.
    NoData,
}

/// A quantity of an expression with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct QuantityValue {
    /// The quantity as written in the expression.
    pub name: String,
    /// The unit of the limit if it has one, else the unit of the signal.
    pub unit: Option<Unit>,
    /// The device's decimal digits. `None` if the value was calculated.
    pub digits: Option<u8>,
    /// Whether the value was neither calculated nor converted.
    pub is_exact: bool,
    /// The value; the mean if there are several samples.
    pub value: Option<f64>,
    /// Lowest and highest value, if there are several samples.
    pub range: Option<(f64, f64)>,
}

/// A sample that does not satisfy the expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// When the sample was received.
    pub at: Stamp,
    /// Time since the first sample of the run.
    pub elapsed: Duration,
    /// The value of each quantity of the verdict. `None` if it is invalid or unknown.
    pub values: Vec<Option<f64>>,
    /// The status that the device reported with this sample.
    pub status: Option<Status>,
}

/// Why there is no decision, or why an expression failed without a violation.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The node or the signal failed. The number is an index into the failures of the report.
    Failed(usize),
    /// No sample of this signal was received.
    NotReceived {
        /// The node.
        node: NodeId,
        /// The name as in [`Source`](crate::measure::sample::Source).
        signal: String,
    },
    /// The signal stopped before the end of the recording.
    Stopped {
        /// The node.
        node: NodeId,
        /// The name as in [`Source`](crate::measure::sample::Source).
        signal: String,
    },
    /// The node stopped sending before the end of the recording.
    NodeStopped(NodeId),
    /// No sample of this node was received.
    NodeNotReceived(NodeId),
    /// None of the signals was received.
    NothingReceived,
    /// A function needs more samples.
    TooFewSamples,
    /// The result of a calculation is not a finite number, for example after a division by zero.
    NotANumber,
}

/// The result of one expression. If the expression contains no node, it is the result for one node.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The expression as entered.
    pub text: String,
    /// The node of all signals that have no node in the expression.
    pub node: Option<NodeId>,
    /// The result.
    pub outcome: Outcome,
    /// The quantities that were compared.
    pub values: Vec<QuantityValue>,
    /// Number of samples, valid and invalid.
    pub count: u64,
    /// Number of valid samples that do not satisfy the expression.
    pub violations: u64,
    /// Number of samples without a valid value. Samples inside `invalid()` do not count.
    pub invalid: u64,
    /// The first sample that does not satisfy the expression.
    pub first: Option<Violation>,
    /// The reason for [`Outcome::NoData`], and for some failures.
    pub reason: Option<Reason>,
}

impl Verdict {
    /// Creates a verdict without data.
    pub fn no_data(text: &str, node: Option<NodeId>, reason: Reason) -> Verdict {
        Verdict {
            text: text.to_owned(),
            node,
            outcome: Outcome::NoData,
            values: Vec::new(),
            count: 0,
            violations: 0,
            invalid: 0,
            first: None,
            reason: Some(reason),
        }
    }
}

/// A node or a signal that could not be measured.
#[derive(Clone, Debug, PartialEq)]
pub struct MissingData {
    /// The node.
    pub node: NodeId,
    /// The signal as in [`Source`](crate::measure::sample::Source). `None`: all signals of the node.
    pub signal: Option<String>,
    /// The reason why no data was received.
    pub reason: Reason,
}

/// The state of an expression during a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveResult {
    /// The expression as entered.
    pub text: String,
    /// The node of all signals that have no node in the expression.
    pub node: Option<NodeId>,
    /// Whether all samples until now satisfy the expression. `None` before the first decision.
    pub is_satisfied: Option<bool>,
    /// The latest values.
    pub values: Vec<QuantityValue>,
}
