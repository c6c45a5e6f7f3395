//! What comes of expressions.

use crate::bus::Stamp;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::sample::Status;
use std::time::Duration;

/// What it comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ruling {
    /// It holds.
    Ok,
    /// It does not hold.
    Fail,
    /// Nothing was measured that it could be judged by.
    NoData,
}

/// The value of a quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// As it stands in the expression.
    pub name: String,
    /// Its unit: that of the limit where one was given.
    pub unit: Option<Unit>,
    /// The device's decimal digits, where it is a number as the device sends it.
    pub digits: Option<u8>,
    /// Whether it is a number as it was sent, without rounding.
    pub exact: bool,
    /// The value; the mean where there are several.
    pub value: Option<f64>,
    /// The least and the greatest one, where there are several.
    pub range: Option<(f64, f64)>,
}

/// A sample that did not satisfy.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// When it came.
    pub at: Stamp,
    /// Since the first sample of all.
    pub elapsed: Duration,
    /// The value of each quantity of the verdict; `None` where it has none.
    pub values: Vec<Option<f64>>,
    /// What the device says of it.
    pub status: Option<Status>,
}

/// What came of an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The expression as it was written.
    pub text: String,
    /// The node that its signals without a node are of.
    pub node: Option<NodeId>,
    /// What it comes to.
    pub ruling: Ruling,
    /// The values it was judged by.
    pub values: Vec<Shown>,
    /// Samples, valid and invalid.
    pub count: u64,
    /// Samples that did not satisfy, without the invalid ones.
    pub violations: u64,
    /// Samples without a valid value, where they are not what was asked about.
    pub invalid: u64,
    /// The first sample that did not satisfy.
    pub first: Option<Violation>,
    /// Why nothing was measured.
    pub reason: Option<String>,
}

impl Verdict {
    /// That nothing was measured.
    pub fn nothing(text: &str, node: Option<NodeId>, reason: impl Into<String>) -> Verdict {
        Verdict {
            text: text.to_owned(),
            node,
            ruling: Ruling::NoData,
            values: Vec::new(),
            count: 0,
            violations: 0,
            invalid: 0,
            first: None,
            reason: Some(reason.into()),
        }
    }
}

/// Why nothing came of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Silence {
    /// Which one.
    pub node: NodeId,
    /// Which signal, as it stands in a [`crate::measure::sample::Source`]; `None` for all of them.
    pub signal: Option<String>,
    /// In words.
    pub reason: String,
}

/// How an expression stands while it is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// The expression as it was written.
    pub text: String,
    /// The node that its signals without a node are of.
    pub node: Option<NodeId>,
    /// Whether it has held until now; `None` before there is anything to judge.
    pub holds: Option<bool>,
    /// The values at the moment.
    pub values: Vec<Shown>,
}
