//! The report of `autozero`.

use super::notes::NoteText;
use super::report::{Cell, Column, Report};
use crate::canopen::id::NodeId;
use crate::tasks::autozero::AutozeroReport;
use std::io::{self, Write};

/// A channel of a node that was set to zero.
#[derive(Clone, Copy, Debug)]
pub struct ZeroReport<'a> {
    /// The node.
    pub node: NodeId,
    /// The result.
    pub zeroed: &'a AutozeroReport,
}

impl Report for ZeroReport<'_> {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("channel"),
        Column::new("signal"),
        Column::new("unit"),
        Column::new("before"),
        Column::new("after"),
        Column::new("offset_before"),
        Column::new("offset"),
        Column::new("stored"),
        Column::new("notes").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let zeroed = self.zeroed;
        // Two more decimal digits than in the table, because a mean is more precise.
        let mean = |mean: Option<f64>| mean.map_or(Cell::Null, |mean| Cell::Real(mean, zeroed.decimals + 2));
        let notes = super::notes::notes(&zeroed.notes);
        vec![
            self.node.into(),
            zeroed.channel.into(),
            zeroed.signal.as_str().into(),
            zeroed.unit.as_str().into(),
            mean(zeroed.before),
            mean(zeroed.after),
            zeroed.offset_before.into(),
            zeroed.offset.into(),
            zeroed.stored.into(),
            Cell::List(notes.iter().map(NoteText::cell).collect()),
        ]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        let rows: Vec<Vec<String>> = reports.iter().map(|report| table_row(report.node, report.zeroed)).collect();
        super::table::write(out, &[super::table::Align::Left; 5], &rows)
    }
}

/// Half of the last decimal digit in the table.
fn half_digit(zeroed: &AutozeroReport) -> f64 {
    i32::try_from(zeroed.decimals).map_or(0.0, |decimals| 0.5 * 10f64.powi(-decimals))
}

/// The cells of `1 pressure 0.013 -> 0.000 bar shift -0.013 bar offset 0.0 -> -0.013`. If nothing was changed, there is
/// no shift and no new offset.
fn table_row(node: NodeId, zeroed: &AutozeroReport) -> Vec<String> {
    // A number that rounds to zero is printed without a sign.
    let number =
        |number: f64| format!("{:.*}", zeroed.decimals, if number.abs() < half_digit(zeroed) { 0.0 } else { number });
    let mean = |mean: Option<f64>| mean.map_or_else(|| "-".to_owned(), number);
    let with_unit = |text: String| format!("{text} {}", zeroed.unit).trim_end().to_owned();
    let mut row = vec![node.to_string(), zeroed.signal.clone()];
    if zeroed.after.is_none() {
        row.push(with_unit(mean(zeroed.before)));
        row.extend(zeroed.offset_before.map(|old| format!("offset {old}")));
        return row;
    }
    row.push(with_unit(format!("{} -> {}", mean(zeroed.before), mean(zeroed.after))));
    row.extend(zeroed.shift().map(|shift| format!("shift {}", with_unit(number(shift)))));
    row.extend(zeroed.offset_before.zip(zeroed.offset).map(|(old, new)| format!("offset {old} -> {new}")));
    row
}
