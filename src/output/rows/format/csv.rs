//! Rows as CSV, in both layouts.

use super::{HeaderMismatch, RowFormat};
use crate::measure::sample::Status;
use crate::output::rows::cells::{
    BOM, Dialect, TimeForm, Times, push_number, push_raw, push_seconds, push_text, push_texts, push_value,
};
use crate::output::rows::row::{Columns, Row, Values};
use std::io;

/// Writes CSV.
#[derive(Debug)]
pub(super) struct CsvRows {
    dialect: Dialect,
    times: Times,
    tag_names: Vec<String>,
    /// The cells of the tags, each after a delimiter.
    tag_cells: Vec<u8>,
}

impl CsvRows {
    pub(super) fn new(dialect: Dialect, time: TimeForm, tags: &[(String, String)]) -> CsvRows {
        let mut tag_cells = Vec::new();
        for (_, value) in tags {
            tag_cells.push(dialect.delimiter);
            push_text(&mut tag_cells, value, dialect.delimiter);
        }
        let tag_names = tags.iter().map(|(name, _)| name.clone()).collect();
        CsvRows { dialect, times: Times::new(time), tag_names, tag_cells }
    }

    fn names(&self, columns: Columns<'_>) -> Vec<u8> {
        let mut line = Vec::new();
        let names = columns.names();
        push_texts(&mut line, names.iter().chain(&self.tag_names).map(String::as_str), self.dialect.delimiter);
        line
    }
}

impl RowFormat for CsvRows {
    fn header(&self, columns: Columns<'_>) -> Vec<u8> {
        let mut header = if self.dialect.bom { BOM.to_vec() } else { Vec::new() };
        header.extend(self.names(columns));
        header
    }

    /// An empty line separates the two tables.
    fn new_columns(&self, columns: Columns<'_>) -> Vec<u8> {
        let mut lines = vec![b'\n'];
        lines.extend(self.names(columns));
        lines
    }

    fn check_header(&self, first_line: &str, columns: Columns<'_>) -> Result<(), HeaderMismatch> {
        let names = self.names(columns);
        let expected = String::from_utf8_lossy(&names).trim_end_matches('\n').to_owned();
        if first_line.trim_end_matches('\r') == expected {
            return Ok(());
        }
        Err(HeaderMismatch { found: first_line.to_owned(), expected })
    }

    fn write(&mut self, row: &Row<'_>, out: &mut Vec<u8>) -> io::Result<()> {
        let Dialect { delimiter, decimal, .. } = self.dialect;
        self.times.write(out, row.time, decimal)?;
        out.push(delimiter);
        push_seconds(out, row.elapsed, decimal);
        match row.values {
            Values::One { sample, source } => {
                out.push(delimiter);
                push_number(out, u64::from(source.node.get()));
                out.push(delimiter);
                push_text(out, &source.signal, delimiter);
                out.push(delimiter);
                push_value(out, sample.value, decimal)?;
                out.push(delimiter);
                push_text(out, &source.unit, delimiter);
                out.push(delimiter);
                push_status(out, sample.status);
                out.push(delimiter);
                push_raw(out, &sample.raw);
            }
            Values::Cycle { cells, .. } => {
                for cell in cells {
                    let cell = cell.unwrap_or_default();
                    out.push(delimiter);
                    push_value(out, cell.value, decimal)?;
                    out.push(delimiter);
                    push_status(out, cell.status);
                }
            }
        }
        out.extend_from_slice(&self.tag_cells);
        out.push(b'\n');
        Ok(())
    }
}

/// Writes a status word; writes nothing if the device reports no status.
fn push_status(out: &mut Vec<u8>, status: Option<Status>) {
    out.extend_from_slice(status.map_or("", Status::as_str).as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_same_columns_may_follow() {
        let csv = CsvRows::new(Dialect { bom: true, ..Dialect::default() }, TimeForm::default(), &[]);
        let long = "time,elapsed_s,node,signal,value,unit,status,raw";
        assert_eq!(csv.check_header(long, Columns::Long), Ok(()));
        assert_eq!(csv.check_header(&format!("{long}\r"), Columns::Long), Ok(()));
        let mismatch = HeaderMismatch { found: "a;b".to_owned(), expected: long.to_owned() };
        assert_eq!(csv.check_header("a;b", Columns::Long), Err(mismatch));
        assert!(csv.check_header("{}", Columns::Long).is_err());
        let tagged = CsvRows::new(Dialect::default(), TimeForm::default(), &[("bench".to_owned(), "3".to_owned())]);
        assert_eq!(tagged.check_header(&format!("{long},bench"), Columns::Long), Ok(()));
        assert!(tagged.check_header(long, Columns::Long).is_err(), "a tag is a column");
    }
}
