//! The report of `read`.

use super::report::{Cell, Column, Report, rows_only};
use super::text;
use crate::device::unit::Unit;
use crate::measure::sample::{Number, Sample, Source, Status};
use std::io::{self, Write};

/// A measured value.
#[derive(Clone, Debug)]
pub struct ReadValue<'a> {
    source: &'a Source,
    value: Option<Number>,
    /// The value as sent, or converted with the same number of digits; empty if invalid.
    text: String,
    unit: String,
    status: Option<Status>,
    /// Whether the text contains only the number.
    is_number_only: bool,
}

impl<'a> ReadValue<'a> {
    /// A value in the unit of the device.
    pub fn new(source: &'a Source, sample: &Sample, is_number_only: bool) -> ReadValue<'a> {
        let text = sample.value.map(|value| value.to_string()).unwrap_or_default();
        let unit = source.unit.to_string();
        ReadValue { source, value: sample.value, text, unit, status: sample.status, is_number_only }
    }

    /// Replaces the value and the unit by `value` in `unit`.
    #[must_use]
    pub fn converted(self, value: Option<f64>, unit: Unit) -> ReadValue<'a> {
        let text = value.map(|value| text::significant(value, significant_digits(self.value))).unwrap_or_default();
        ReadValue { value: value.map(Number::Real64), text, unit: unit.to_string(), ..self }
    }
}

/// The number of significant digits of a value. A converted value has the same number.
fn significant_digits(value: Option<Number>) -> usize {
    match value {
        Some(Number::Decimal { mantissa, .. }) => mantissa.unsigned_abs().to_string().len().max(4),
        Some(Number::Real32(_)) | None => 7,
        Some(Number::Real64(_)) => 15,
    }
}

impl Report for ReadValue<'_> {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("signal"),
        Column::new("value").json_only(),
        Column::new("value").not_json(),
        Column::new("unit").data_only(),
        Column::new("status"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let text = Cell::from(self.text.as_str());
        vec![
            self.source.node.into(),
            (&*self.source.signal).into(),
            self.value.into(),
            if self.text.is_empty() { text } else { text.shown_as(format!("{}{unit}", self.text)) },
            self.unit.as_str().into(),
            match self.status {
                Some(status) => status.into(),
                None => Cell::Null.shown_as("(no status)"),
            },
        ]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        match reports {
            [single] if single.is_number_only => writeln!(out, "{}", single.text),
            reports => rows_only(reports, out),
        }
    }
}
