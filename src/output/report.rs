//! Reports: the output of a command on stdout, defined once for text, JSON Lines and CSV.
//!
//! A command returns values that implement [`Report`]. Each value is one JSON object. The CSV file and the table have
//! the same columns and cells. Only [`render`] and [`Stream`] know the formats.
//!
//! Rules for every report:
//!
//! - A value that is unknown or does not apply is `null` in JSON, empty in CSV and `-` in a table. It is never omitted.
//! - COB-IDs, device types, addresses, unit codes and bit fields are hexadecimal text (`"0x181"`).
//! - Vendor, product, revision and serial number are numbers. `vendor_name` follows `vendor`.
//! - A change has the columns `before` and `after`. A measured value has the column `signal`.

mod cell;

pub use cell::Cell;

use super::rows::FileFormat;
use super::table::{self, Align};
use super::{csv, json};
use serde::ser::{Serialize, SerializeMap, SerializeSeq, Serializer};
use std::io::{self, Write};
use std::marker::PhantomData;

/// The form of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Text with aligned tables.
    Text,
    /// JSON Lines: one object per line.
    Json,
    /// Comma-separated values with a header.
    Csv,
    /// A format that only recordings have.
    Recording(FileFormat),
}

impl Format {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Format::Text => "text",
            Format::Json => "json",
            Format::Csv => "csv",
            Format::Recording(format) => format.name(),
        }
    }

    /// Whether only recordings have this format.
    pub fn is_for_recordings(self) -> bool {
        matches!(self, Format::Recording(_))
    }

    /// Whether the format is text.
    pub fn is_text(self) -> bool {
        self == Format::Text
    }

    /// Whether the format is JSON Lines.
    pub fn is_json(self) -> bool {
        self == Format::Json
    }
}

/// One field of a report.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    name: &'static str,
    heading: Option<&'static str>,
    align: Align,
    in_json: bool,
    in_csv: bool,
    in_table: bool,
    /// The columns of the nested rows.
    nested: &'static [Column],
}

/// Returns the columns of a report that extends another report. `SUM` is `N + M`.
pub const fn joined<const N: usize, const M: usize, const SUM: usize>(
    first: [Column; N],
    then: [Column; M],
) -> [Column; SUM] {
    let mut all = [first[0]; SUM];
    let mut at = 0;
    while at < SUM {
        all[at] = if at < N { first[at] } else { then[at - N] };
        at += 1;
    }
    all
}

impl Column {
    /// A column of this name in JSON, CSV and the table. The table shows the name in capital letters.
    pub const fn new(name: &'static str) -> Column {
        Column { name, heading: None, align: Align::Left, in_json: true, in_csv: true, in_table: true, nested: &[] }
    }

    /// A column of nested rows: an array of objects in JSON; one line per nested row in CSV, which repeats the other
    /// columns; not in the table. Its cell is [`Cell::Rows`].
    pub const fn nested(name: &'static str, nested: &'static [Column]) -> Column {
        Column { nested, in_table: false, ..Column::new(name) }
    }

    /// Aligns the column to the right in the table.
    pub const fn right(self) -> Column {
        Column { align: Align::Right, ..self }
    }

    /// Sets another heading for the table.
    pub const fn heading(self, heading: &'static str) -> Column {
        Column { heading: Some(heading), ..self }
    }

    /// Prints the column only in JSON.
    pub const fn json_only(self) -> Column {
        Column { in_csv: false, in_table: false, ..self }
    }

    /// Prints the column only in CSV.
    pub const fn csv_only(self) -> Column {
        Column { in_json: false, in_table: false, ..self }
    }

    /// Prints the column only in the table.
    pub const fn table_only(self) -> Column {
        Column { in_json: false, in_csv: false, ..self }
    }

    /// Prints the column in CSV and the table, not in JSON.
    pub const fn not_json(self) -> Column {
        Column { in_json: false, ..self }
    }

    /// Prints the column in JSON and CSV, not in the table.
    pub const fn data_only(self) -> Column {
        Column { in_table: false, ..self }
    }
}

/// A result of a command: one JSON object, one row.
pub trait Report: Sized {
    /// The fields, in order.
    const COLUMNS: &'static [Column];

    /// One cell per column.
    fn cells(&self) -> Vec<Cell>;

    /// The text form. Default: a table with a heading.
    ///
    /// # Errors
    /// `out` cannot be written.
    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        table(reports, out)
    }

    /// The text line for a report that is printed as soon as it arrives. Default: the cells of the table, separated by
    /// two blanks.
    ///
    /// # Errors
    /// `out` cannot be written.
    fn line(&self, out: &mut dyn Write) -> io::Result<()> {
        let shown = Self::COLUMNS.iter().zip(self.cells()).filter(|(column, _)| column.in_table);
        let cells: Vec<String> = shown.map(|(_, cell)| cell.shown()).collect();
        writeln!(out, "{}", super::text::safe(cells.join("  ").trim_end()))
    }
}

/// Prints reports in this format. All bytes are written together.
///
/// # Errors
/// `out` cannot be written.
pub fn render<R: Report>(reports: &[R], format: Format, out: &mut dyn Write) -> io::Result<()> {
    let mut bytes = Vec::new();
    match format {
        Format::Text => R::text(reports, &mut bytes)?,
        Format::Json => reports.iter().try_for_each(|report| json_line(report, &mut bytes))?,
        Format::Csv | Format::Recording(_) => {
            csv::write(&mut bytes, &csv_head::<R>(), reports.iter().flat_map(csv_rows))?
        }
    }
    out.write_all(&bytes)?;
    out.flush()
}

/// Prints reports one by one as they arrive.
#[derive(Debug)]
pub struct Stream<R, W> {
    format: Format,
    out: W,
    report: PhantomData<fn(&R)>,
}

impl<R: Report, W: Write> Stream<R, W> {
    /// Starts the output. For CSV, writes the header.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub fn new(format: Format, mut out: W) -> io::Result<Stream<R, W>> {
        if format == Format::Csv {
            csv::write(&mut out, &csv_head::<R>(), [])?;
        }
        Ok(Stream { format, out, report: PhantomData })
    }

    /// Prints one report and flushes it.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub fn push(&mut self, report: &R) -> io::Result<()> {
        let mut bytes = Vec::new();
        match self.format {
            Format::Text => report.line(&mut bytes)?,
            Format::Json => json_line(report, &mut bytes)?,
            Format::Csv | Format::Recording(_) => csv::write(&mut bytes, &[], csv_rows(report))?,
        }
        self.out.write_all(&bytes)?;
        self.out.flush()
    }

    /// Ends the output. In the text format only, `write` prints further lines after the last report.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub fn end_text(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        if self.format == Format::Text {
            write(&mut self.out)?;
        }
        self.out.flush()
    }
}

/// Writes a table with a heading; nothing if there are no reports.
///
/// # Errors
/// `out` cannot be written.
pub fn table<R: Report>(reports: &[R], out: &mut dyn Write) -> io::Result<()> {
    if reports.is_empty() {
        return Ok(());
    }
    let columns: Vec<&Column> = R::COLUMNS.iter().filter(|column| column.in_table).collect();
    let heading = |column: &&Column| column.heading.map_or_else(|| column.name.to_ascii_uppercase(), str::to_owned);
    let mut rows: Vec<Vec<String>> = vec![columns.iter().map(heading).collect()];
    rows.extend(reports.iter().map(shown));
    table::write(out, &aligns::<R>(), &rows)
}

/// Writes the table without a heading.
///
/// # Errors
/// `out` cannot be written.
pub fn rows_only<R: Report>(reports: &[R], out: &mut dyn Write) -> io::Result<()> {
    table::write(out, &aligns::<R>(), &reports.iter().map(shown).collect::<Vec<_>>())
}

fn aligns<R: Report>() -> Vec<Align> {
    R::COLUMNS.iter().filter(|column| column.in_table).map(|column| column.align).collect()
}

/// A report as a row of the table.
fn shown<R: Report>(report: &R) -> Vec<String> {
    let cells = R::COLUMNS.iter().zip(report.cells()).filter(|(column, _)| column.in_table);
    cells.map(|(_, cell)| cell.shown()).collect()
}

fn csv_head<R: Report>() -> Vec<&'static str> {
    fn names(column: &'static Column) -> Vec<&'static str> {
        match column.nested {
            [] => vec![column.name],
            nested => nested.iter().filter(|column| column.in_csv).map(|column| column.name).collect(),
        }
    }
    R::COLUMNS.iter().filter(|column| column.in_csv).flat_map(names).collect()
}

/// The CSV rows of a report: one row, or one per nested row.
fn csv_rows<R: Report>(report: &R) -> Vec<Vec<String>> {
    let cells: Vec<(&Column, Cell)> =
        R::COLUMNS.iter().zip(report.cells()).filter(|(column, _)| column.in_csv).collect();
    let nested = cells.iter().find_map(|(_, cell)| if let Cell::Rows(rows) = cell { Some(rows) } else { None });
    let row = |inner: Option<&Vec<Cell>>| {
        let mut row = Vec::new();
        for (column, cell) in &cells {
            match (column.nested, inner) {
                ([], _) => row.push(cell.in_csv()),
                (nested, Some(inner)) => {
                    let inner = nested.iter().zip(inner).filter(|(column, _)| column.in_csv);
                    row.extend(inner.map(|(_, cell)| cell.in_csv()));
                }
                (_, None) => {}
            }
        }
        row
    };
    match nested {
        None => vec![row(None)],
        Some(rows) => rows.iter().map(|inner| row(Some(inner))).collect(),
    }
}

fn json_line<R: Report>(report: &R, out: &mut Vec<u8>) -> io::Result<()> {
    json::line(out, &Object { columns: R::COLUMNS, cells: &report.cells() })
}

/// A row as a JSON object.
struct Object<'a> {
    columns: &'static [Column],
    cells: &'a [Cell],
}

impl Serialize for Object<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (column, cell) in self.columns.iter().zip(self.cells).filter(|(column, _)| column.in_json) {
            match cell {
                Cell::Rows(rows) => map.serialize_entry(column.name, &Array { columns: column.nested, rows })?,
                cell => map.serialize_entry(column.name, cell)?,
            }
        }
        map.end()
    }
}

/// Nested rows as a JSON array.
struct Array<'a> {
    columns: &'static [Column],
    rows: &'a [Vec<Cell>],
}

impl Serialize for Array<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut array = serializer.serialize_seq(Some(self.rows.len()))?;
        for cells in self.rows {
            array.serialize_element(&Object { columns: self.columns, cells })?;
        }
        array.end()
    }
}

#[cfg(test)]
mod tests;
