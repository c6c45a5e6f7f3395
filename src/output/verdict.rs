//! Verdicts as text, JSON Lines and CSV.

use super::failure::ErrorMessage;
use super::table::{Align, write};
use super::text::{grouped, significant};
use crate::canopen::id::NodeId;
use crate::measure::expression::verdict::{Outcome, QuantityValue, Reason, Verdict, Violation};
use crate::measure::sample::Status;
use crate::tasks::Failure;
use serde::Serialize;
use std::io::{self, Write};

/// Significant digits of a calculated value.
const CALCULATED_DIGITS: usize = 7;

/// The longest text of an exact value. Longer ones are rounded.
const MAX_EXACT_LENGTH: usize = 11;

/// The word for an outcome in text output.
pub fn word(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Fail => "FAIL",
        Outcome::NoData => "none",
    }
}

/// Writes the verdicts as aligned lines. If the nodes differ, there is a column for the node.
pub fn lines(out: &mut dyn Write, verdicts: &[Verdict], failures: &[Failure]) -> io::Result<()> {
    let has_several_nodes = verdicts.windows(2).any(|pair| pair[0].node != pair[1].node);
    let row = |verdict: &Verdict| {
        let node = verdict.node.map_or_else(|| "-".to_owned(), |node| node.to_string());
        let mut row = vec![format!("{:<4}", word(verdict.outcome))];
        row.extend(has_several_nodes.then_some(node));
        row.extend([verdict.text.clone(), findings(verdict, failures)]);
        row
    };
    let rows: Vec<Vec<String>> = verdicts.iter().map(row).collect();
    write(out, &[Align::Left; 4][..if has_several_nodes { 4 } else { 3 }], &rows)
}

/// The values that led to a verdict: `10.003 bar (n 100, 9.998..10.009)`.
pub fn findings(verdict: &Verdict, failures: &[Failure]) -> String {
    let reason = verdict.reason.as_ref().map(|reason| reason_text(reason, failures));
    if let (Outcome::NoData, Some(reason)) = (verdict.outcome, &reason) {
        return format!("no data: {reason}");
    }
    let mut text = match &verdict.first {
        Some(first) => violation(verdict, first),
        None => values(&verdict.values, &verdict.values.iter().map(|value| value.value).collect::<Vec<_>>()),
    };
    if let Some(reason) = &reason {
        text.push_str(&format!(": {reason}"));
    }
    if verdict.count < 2 {
        return text;
    }
    let mut notes = vec![format!("n {}", grouped(verdict.count))];
    for (count, what) in [(verdict.violations, "outside"), (verdict.invalid, "invalid")] {
        if count > 0 {
            notes.push(format!("{} {what}", grouped(count)));
        }
    }
    for value in &verdict.values {
        if let Some((min, max)) = value.range {
            let name = if verdict.values.len() > 1 { format!("{} ", value.name) } else { String::new() };
            notes.push(format!("{name}{}..{}", number(value, min), number(value, max)));
        }
    }
    format!("{text} ({})", notes.join(", "))
}

/// The text of a reason. [`Reason::Failed`] takes the message of the failure.
pub fn reason_text(reason: &Reason, failures: &[Failure]) -> String {
    match reason {
        Reason::Failed(at) => {
            failures.get(*at).map_or_else(|| "not measured".to_owned(), |failure| ErrorMessage::of(failure).message)
        }
        Reason::NotReceived { node, signal } => format!("node {node}: {signal} was not received"),
        Reason::Stopped { node, signal } => format!("node {node}: {signal} stopped before the end"),
        Reason::NodeStopped(node) => format!("node {node} stopped sending before the end"),
        Reason::NodeNotReceived(node) => format!("node {node} sent none of its signals"),
        Reason::NothingReceived => "none of its signals was received".to_owned(),
        Reason::TooFewSamples => "too few samples".to_owned(),
        Reason::NotANumber => "the result is not a number".to_owned(),
    }
}

/// The first sample that does not satisfy the expression.
fn violation(verdict: &Verdict, first: &Violation) -> String {
    let has_values = first.values.iter().any(Option::is_some);
    let text = match first.status {
        Some(status) if !has_values && status != Status::Ok => status.as_str().to_owned(),
        _ if !has_values && verdict.values.iter().any(|value| value.value.is_some()) => "invalid value".to_owned(),
        _ if !has_values => "no valid value".to_owned(),
        _ => values(&verdict.values, &first.values),
    };
    if verdict.count < 2 { text } else { format!("{text} at {:.3} s", first.elapsed.as_secs_f64()) }
}

/// Values with their units. If there are several, each has its name.
pub fn values(quantities: &[QuantityValue], values: &[Option<f64>]) -> String {
    let one = |(quantity, value): (&QuantityValue, &Option<f64>)| {
        let unit = quantity.unit.map(|unit| unit.to_string()).unwrap_or_default();
        let value = value.map_or_else(|| "-".to_owned(), |value| format!("{} {unit}", number(quantity, value)));
        let value = value.trim_end();
        if quantities.len() > 1 { format!("{} {value}", quantity.name) } else { value.to_owned() }
    };
    quantities.iter().zip(values).map(one).collect::<Vec<_>>().join(", ")
}

/// A value with the device's digits, or exactly, or rounded to [`CALCULATED_DIGITS`].
fn number(quantity: &QuantityValue, value: f64) -> String {
    match quantity.digits {
        Some(digits) => format!("{value:.*}", usize::from(digits)),
        // The mean of exact values can be long.
        None if quantity.is_exact && value.to_string().len() <= MAX_EXACT_LENGTH => value.to_string(),
        None => {
            let text = significant(value, CALCULATED_DIGITS);
            // 1.234500 becomes 1.2345.
            if text.contains('.') && !text.contains('e') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
    }
}

#[derive(Serialize)]
struct JsonValue<'a> {
    quantity: &'a str,
    value: Option<f64>,
    unit: Option<String>,
    min: Option<f64>,
    max: Option<f64>,
}

#[derive(Serialize)]
struct JsonViolation {
    time: String,
    elapsed_s: f64,
    values: Vec<Option<f64>>,
    status: Option<&'static str>,
}

#[derive(Serialize)]
struct JsonVerdict<'a> {
    expression: &'a str,
    node: Option<u8>,
    verdict: &'a str,
    count: u64,
    violations: u64,
    invalid: u64,
    values: Vec<JsonValue<'a>>,
    first: Option<JsonViolation>,
    reason: Option<String>,
}

/// The word for an outcome in JSON and CSV.
fn field(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Fail => "fail",
        Outcome::NoData => "no-data",
    }
}

/// Writes the verdicts as JSON Lines.
pub fn json(out: &mut dyn Write, verdicts: &[Verdict], failures: &[Failure]) -> io::Result<()> {
    for verdict in verdicts {
        let values = verdict.values.iter().map(|value| {
            let (min, max) = value.range.unzip();
            let unit = value.unit.map(|unit| unit.to_string());
            JsonValue { quantity: &value.name, value: value.value, unit, min, max }
        });
        let first = verdict.first.as_ref().map(|first| JsonViolation {
            time: humantime::format_rfc3339_micros(first.at.wall.system_time()).to_string(),
            elapsed_s: (first.elapsed.as_secs_f64() * 1e6).round() / 1e6,
            values: first.values.clone(),
            status: first.status.map(Status::as_str),
        });
        let object = JsonVerdict {
            expression: &verdict.text,
            node: verdict.node.map(NodeId::get),
            verdict: field(verdict.outcome),
            count: verdict.count,
            violations: verdict.violations,
            invalid: verdict.invalid,
            values: values.collect(),
            first,
            reason: verdict.reason.as_ref().map(|reason| reason_text(reason, failures)),
        };
        super::json::line(out, &object)?;
    }
    Ok(())
}

/// Writes the verdicts as CSV.
pub fn csv(out: &mut dyn Write, verdicts: &[Verdict], failures: &[Failure]) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(["expression", "node", "verdict", "count", "violations", "invalid", "findings"])?;
    for verdict in verdicts {
        let node = verdict.node.map(|node| node.to_string()).unwrap_or_default();
        let [count, violations, invalid] = [verdict.count, verdict.violations, verdict.invalid].map(|n| n.to_string());
        let findings = findings(verdict, failures);
        csv.write_record([&verdict.text, &node, field(verdict.outcome), &count, &violations, &invalid, &findings])?;
    }
    csv.flush()
}
