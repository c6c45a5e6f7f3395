//! Rows as CSV, in both layouts.

use super::{HeaderMismatch, RowFormat};
use crate::measure::sample::{Source, Status};
use crate::output::rows::cells::{
    BOM, Dialect, TimeForm, Times, push_number, push_raw, push_seconds, push_text, push_texts, push_value,
};
use crate::output::rows::row::{Columns, Row, Values};
use std::io;
use std::sync::Arc;

/// The cells of a source that are the same in all its rows, with the delimiters before and after them.
#[derive(Debug)]
struct SourceCells {
    source: Source,
    /// Node and signal.
    before_value: Vec<u8>,
    /// Unit.
    after_value: Vec<u8>,
}

impl SourceCells {
    fn new(source: &Source, delimiter: u8) -> SourceCells {
        let (mut before_value, mut after_value) = (vec![delimiter], vec![delimiter]);
        push_number(&mut before_value, u64::from(source.node.get()));
        before_value.push(delimiter);
        push_text(&mut before_value, &source.signal, delimiter);
        before_value.push(delimiter);
        push_text(&mut after_value, &source.unit, delimiter);
        after_value.push(delimiter);
        SourceCells { source: source.clone(), before_value, after_value }
    }

    fn is_of(&self, source: &Source) -> bool {
        let Source { node, signal, unit } = source;
        self.source.node == *node && Arc::ptr_eq(&self.source.signal, signal) && Arc::ptr_eq(&self.source.unit, unit)
    }
}

/// Writes CSV.
#[derive(Debug)]
pub(super) struct CsvRows {
    dialect: Dialect,
    times: Times,
    tag_names: Vec<String>,
    /// The cells of the tags, each after a delimiter.
    tag_cells: Vec<u8>,
    /// The cells of the sources, by the numbers of the sources.
    source_cells: Vec<Option<SourceCells>>,
}

impl CsvRows {
    pub(super) fn new(dialect: Dialect, time: TimeForm, tags: &[(String, String)]) -> CsvRows {
        let mut tag_cells = Vec::new();
        for (_, value) in tags {
            tag_cells.push(dialect.delimiter);
            push_text(&mut tag_cells, value, dialect.delimiter);
        }
        let tag_names = tags.iter().map(|(name, _)| name.clone()).collect();
        CsvRows { dialect, times: Times::new(time), tag_names, tag_cells, source_cells: Vec::new() }
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
                if self.source_cells.len() <= sample.source {
                    self.source_cells.resize_with(sample.source + 1, || None);
                }
                let known = &mut self.source_cells[sample.source];
                known.take_if(|cells| !cells.is_of(source));
                let cells = known.get_or_insert_with(|| SourceCells::new(source, delimiter));
                out.extend_from_slice(&cells.before_value);
                push_value(out, sample.value, decimal)?;
                out.extend_from_slice(&cells.after_value);
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
