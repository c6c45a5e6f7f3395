//! Rows as InfluxDB line protocol, in both layouts: one line for each value.

use super::{HeaderMismatch, RowFormat};
use crate::measure::sample::{Number, Source, Status};
use crate::output::rows::cells::push_value;
use crate::output::rows::row::{Cell, Columns, Row, Values};
use crate::output::rows::setup::Setup;
use crate::publish::line_protocol::{Line, MEASUREMENT, head, push_line};
use std::io;

/// Writes line protocol.
#[derive(Debug)]
pub(super) struct InfluxRows {
    head: Vec<u8>,
    /// The number of the present line.
    value: Vec<u8>,
}

impl InfluxRows {
    pub(super) fn new(setup: &Setup) -> InfluxRows {
        let tags = setup.tags.iter().chain(&setup.origin);
        InfluxRows { head: head(tags.map(|(key, value)| (key.as_str(), value.as_str()))), value: Vec::new() }
    }

    fn push(&mut self, time_ns: i128, source: &Source, cell: Cell, out: &mut Vec<u8>) -> io::Result<()> {
        let value = cell.value.filter(|value| value.is_finite());
        self.value.clear();
        push_value(&mut self.value, value, b'.')?;
        let line = Line {
            node: source.node.get(),
            signal: &source.signal,
            unit: &source.unit,
            status: cell.status.map_or("", Status::as_str),
            value: value.map(|_: Number| self.value.as_slice()),
            time_ns,
        };
        push_line(out, &self.head, &line);
        Ok(())
    }
}

impl RowFormat for InfluxRows {
    fn header(&self, _columns: Columns<'_>) -> Vec<u8> {
        Vec::new()
    }

    fn new_columns(&self, _columns: Columns<'_>) -> Vec<u8> {
        Vec::new()
    }

    /// Each line is complete, so any line of this measurement may follow another one.
    fn check_header(&self, first_line: &str, _columns: Columns<'_>) -> Result<(), HeaderMismatch> {
        match first_line.strip_prefix(MEASUREMENT) {
            Some(rest) if rest.starts_with(',') => Ok(()),
            _ => Err(HeaderMismatch { found: first_line.to_owned(), expected: format!("{MEASUREMENT},...") }),
        }
    }

    fn write(&mut self, row: &Row<'_>, out: &mut Vec<u8>) -> io::Result<()> {
        let time_ns = i128::try_from(row.time.since_epoch().as_nanos()).map_err(io::Error::other)?;
        match row.values {
            Values::One { sample, source } => self.push(time_ns, source, Cell::of(sample), out),
            Values::Cycle { columns, cells } => {
                let known = columns.iter().zip(cells).filter_map(|(column, cell)| Some((column, (*cell)?)));
                known.into_iter().try_for_each(|(column, cell)| self.push(time_ns, &column.source, cell, out))
            }
        }
    }
}
