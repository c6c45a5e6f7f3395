//! Verdicts: lines for people, JSON Lines, CSV.

use super::table::{Align, write};
use super::text::{grouped, significant};
use crate::canopen::id::NodeId;
use crate::measure::expression::verdict::{Ruling, Shown, Verdict, Violation};
use crate::measure::sample::Status;
use serde::Serialize;
use std::io::{self, Write};

/// How many digits of a calculated value are shown.
const DIGITS: usize = 7;

/// No REAL32 has more characters, but for very large and very small ones.
const EXACT: usize = 11;

/// A ruling in a word.
pub fn word(ruling: Ruling) -> &'static str {
    match ruling {
        Ruling::Ok => "ok",
        Ruling::Fail => "FAIL",
        Ruling::NoData => "none",
    }
}

/// The verdicts in aligned lines; with the node of each where there are several nodes.
pub fn lines(out: &mut dyn Write, verdicts: &[Verdict]) -> io::Result<()> {
    let several = verdicts.windows(2).any(|pair| pair[0].node != pair[1].node);
    let row = |verdict: &Verdict| {
        let node = verdict.node.map_or_else(|| "-".to_owned(), |node| node.to_string());
        let mut row = vec![format!("{:<4}", word(verdict.ruling))];
        row.extend(several.then_some(node));
        row.extend([verdict.text.clone(), findings(verdict)]);
        row
    };
    let rows: Vec<Vec<String>> = verdicts.iter().map(row).collect();
    write(out, &[Align::Left; 4][..if several { 4 } else { 3 }], &rows)
}

/// What a verdict rests on: `10.003 bar (n 100, 9.998..10.009)`.
pub fn findings(verdict: &Verdict) -> String {
    if let (Ruling::NoData, Some(reason)) = (verdict.ruling, &verdict.reason) {
        return format!("no data: {reason}");
    }
    let mut text = match &verdict.first {
        Some(first) => violation(verdict, first),
        None => values(&verdict.values, &verdict.values.iter().map(|shown| shown.value).collect::<Vec<_>>()),
    };
    if let Some(reason) = &verdict.reason {
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
    for shown in &verdict.values {
        if let Some((min, max)) = shown.range {
            let name = if verdict.values.len() > 1 { format!("{} ", shown.name) } else { String::new() };
            notes.push(format!("{name}{}..{}", number(shown, min), number(shown, max)));
        }
    }
    format!("{text} ({})", notes.join(", "))
}

/// The first sample that did not satisfy.
fn violation(verdict: &Verdict, first: &Violation) -> String {
    let has_values = first.values.iter().any(Option::is_some);
    let text = match first.status {
        Some(status) if !has_values && status != Status::Ok => status.as_str().to_owned(),
        _ if !has_values && verdict.values.iter().any(|shown| shown.value.is_some()) => "invalid value".to_owned(),
        _ if !has_values => "no valid value".to_owned(),
        _ => values(&verdict.values, &first.values),
    };
    if verdict.count < 2 { text } else { format!("{text} at {:.3} s", first.elapsed.as_secs_f64()) }
}

/// Values with their units; with their names where there are several.
pub fn values(all: &[Shown], values: &[Option<f64>]) -> String {
    let one = |(shown, value): (&Shown, &Option<f64>)| {
        let unit = shown.unit.map(|unit| unit.to_string()).unwrap_or_default();
        let value = value.map_or_else(|| "-".to_owned(), |value| format!("{} {unit}", number(shown, value)));
        let value = value.trim_end();
        if all.len() > 1 { format!("{} {value}", shown.name) } else { value.to_owned() }
    };
    all.iter().zip(values).map(one).collect::<Vec<_>>().join(", ")
}

/// A value with the device's digits, as it was sent, or with as many digits as a calculation is worth.
fn number(shown: &Shown, value: f64) -> String {
    match shown.digits {
        Some(digits) => format!("{value:.*}", usize::from(digits)),
        // The mean of exact numbers is none.
        None if shown.exact && value.to_string().len() <= EXACT => value.to_string(),
        None => {
            let text = significant(value, DIGITS);
            // 1.234500 is 1.2345.
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
    reason: Option<&'a str>,
}

/// A ruling in JSON and CSV.
fn ruling_name(ruling: Ruling) -> &'static str {
    match ruling {
        Ruling::Ok => "ok",
        Ruling::Fail => "fail",
        Ruling::NoData => "no-data",
    }
}

/// The verdicts as JSON Lines.
pub fn json(out: &mut dyn Write, verdicts: &[Verdict]) -> io::Result<()> {
    for verdict in verdicts {
        let value = |shown: &'_ Shown| {
            let (min, max) = shown.range.unzip();
            (shown.value, shown.unit.map(|unit| unit.to_string()), min, max)
        };
        let values = verdict.values.iter().map(|shown| {
            let (value, unit, min, max) = value(shown);
            JsonValue { quantity: &shown.name, value, unit, min, max }
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
            verdict: ruling_name(verdict.ruling),
            count: verdict.count,
            violations: verdict.violations,
            invalid: verdict.invalid,
            values: values.collect(),
            first,
            reason: verdict.reason.as_deref(),
        };
        super::json::line(out, &object)?;
    }
    Ok(())
}

/// The verdicts as CSV.
pub fn csv(out: &mut dyn Write, verdicts: &[Verdict]) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(["expression", "node", "verdict", "count", "violations", "invalid", "findings"])?;
    for verdict in verdicts {
        let node = verdict.node.map(|node| node.to_string()).unwrap_or_default();
        let [count, violations, invalid] = [verdict.count, verdict.violations, verdict.invalid].map(|n| n.to_string());
        let ruling = ruling_name(verdict.ruling);
        csv.write_record([&verdict.text, &node, ruling, &count, &violations, &invalid, &findings(verdict)])?;
    }
    csv.flush()
}
