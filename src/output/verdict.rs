//! Verdicts: their columns and their text.

use super::failure::ErrorMessage;
use super::report::{Cell, Column, Report};
use super::table::{Align, write};
use super::text::{grouped, significant};
use crate::measure::expression::verdict::{Outcome, QuantityValue, Reason, Verdict, Violation};
use crate::measure::sample::{Number, Status};
use crate::tasks::Failure;
use crate::tasks::check::CheckReport;
use anstyle::{AnsiColor, Style};
use std::io::{self, Write};

/// Significant digits of a calculated value.
const CALCULATED_DIGITS: usize = 7;

/// The longest text of an exact value. Longer values are rounded.
const MAX_EXACT_LENGTH: usize = 11;

/// The word for an outcome in text output, and its style.
pub(super) fn word(outcome: Outcome) -> (&'static str, Style) {
    match outcome {
        Outcome::Ok => ("ok", AnsiColor::Green.on_default()),
        Outcome::Fail => ("FAIL", AnsiColor::Red.on_default().bold()),
        Outcome::NoData => ("none", AnsiColor::Yellow.on_default().bold()),
    }
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

/// The text of a reason. For [`Reason::Failed`], it is the message of the failure.
fn reason_text(reason: &Reason, failures: &[Failure]) -> String {
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

/// Describes the first sample that does not satisfy the expression.
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

/// A value with the decimal digits of the device. If they are unknown, an exact value is printed as it is, and any
/// other value is rounded to [`CALCULATED_DIGITS`].
fn number(quantity: &QuantityValue, value: f64) -> String {
    match quantity.digits {
        Some(digits) => format!("{value:.*}", usize::from(digits)),
        // A mean of exact values can have many digits.
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

/// The word for an outcome in JSON and CSV.
fn data_word(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Fail => "fail",
        Outcome::NoData => "no-data",
    }
}

/// A verdict with the failures that its reason refers to.
#[derive(Clone, Copy, Debug)]
pub struct VerdictRow<'a> {
    verdict: &'a Verdict,
    failures: &'a [Failure],
}

/// The rows of a check.
pub fn rows(report: &CheckReport) -> Vec<VerdictRow<'_>> {
    report.verdicts.iter().map(|verdict| VerdictRow { verdict, failures: &report.failures }).collect()
}

impl Report for VerdictRow<'_> {
    const COLUMNS: &'static [Column] = &[
        Column::new("expression"),
        Column::new("node"),
        Column::new("verdict"),
        Column::new("count"),
        Column::new("violations"),
        Column::new("invalid"),
        Column::new("values").json_only(),
        Column::new("first").json_only(),
        Column::new("reason").json_only(),
        Column::new("findings"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let VerdictRow { verdict, failures } = self;
        vec![
            verdict.text.as_str().into(),
            verdict.node.into(),
            data_word(verdict.outcome).into(),
            verdict.count.into(),
            verdict.violations.into(),
            verdict.invalid.into(),
            Cell::List(verdict.values.iter().map(quantity_cell).collect()),
            verdict.first.as_ref().map_or(Cell::Null, violation_cell),
            verdict.reason.as_ref().map(|reason| reason_text(reason, failures)).into(),
            findings(verdict, failures).into(),
        ]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        let has_several_nodes = reports.windows(2).any(|pair| pair[0].verdict.node != pair[1].verdict.node);
        let row = |row: &VerdictRow<'_>| {
            let VerdictRow { verdict, failures } = row;
            let node = verdict.node.map_or_else(|| "-".to_owned(), |node| node.to_string());
            let mut cells = vec![format!("{:<4}", word(verdict.outcome).0)];
            cells.extend(has_several_nodes.then_some(node));
            cells.extend([verdict.text.clone(), findings(verdict, failures)]);
            cells
        };
        let rows: Vec<Vec<String>> = reports.iter().map(row).collect();
        let mut table = Vec::new();
        write(&mut table, &[Align::Left; 4][..if has_several_nodes { 4 } else { 3 }], &rows)?;
        for (line, row) in String::from_utf8_lossy(&table).lines().zip(reports) {
            let (word, style) = word(row.verdict.outcome);
            let rest = line.strip_prefix(word).unwrap_or(line);
            writeln!(out, "{style}{word}{style:#}{rest}")?;
        }
        Ok(())
    }
}

fn real(value: Option<f64>) -> Cell {
    value.map(Number::Real64).into()
}

fn quantity_cell(value: &QuantityValue) -> Cell {
    let (min, max) = value.range.unzip();
    Cell::Object(vec![
        ("quantity", value.name.as_str().into()),
        ("value", real(value.value)),
        ("unit", value.unit.map(|unit| unit.to_string()).into()),
        ("min", real(min)),
        ("max", real(max)),
    ])
}

fn violation_cell(first: &Violation) -> Cell {
    Cell::Object(vec![
        ("time", humantime::format_rfc3339_micros(first.at.wall.system_time()).to_string().into()),
        ("elapsed_s", Cell::Real(first.elapsed.as_secs_f64(), 6)),
        ("values", Cell::List(first.values.iter().map(|&value| real(value)).collect())),
        ("status", first.status.into()),
    ])
}
