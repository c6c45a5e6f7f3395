//! Rows as JSON Lines, in both layouts.

use super::{HeaderMismatch, RowFormat};
use crate::measure::sample::Status;
use crate::output::json::{self, JsonNumber};
use crate::output::rows::cells::{TimeForm, Times};
use crate::output::rows::row::{Columns, Row, Values};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use std::collections::BTreeMap;
use std::io;

/// Writes JSON Lines: one object per row.
#[derive(Debug)]
pub(super) struct JsonRows {
    times: Times,
    tag_names: Vec<String>,
    /// The members of the tags, each after a comma.
    tag_members: Vec<u8>,
}

impl JsonRows {
    pub(super) fn new(time: TimeForm, tags: &[(String, String)]) -> JsonRows {
        let mut tag_members = Vec::new();
        for (name, value) in tags {
            let name: serde_json::Value = name.as_str().into();
            let value: serde_json::Value = value.as_str().into();
            tag_members.extend_from_slice(format!(",{name}:{value}").as_bytes());
        }
        let tag_names = tags.iter().map(|(name, _)| name.clone()).collect();
        JsonRows { times: Times::new(time), tag_names, tag_members }
    }

    /// Adds the tags to the object that ends here.
    fn add_tags(&self, out: &mut Vec<u8>) {
        if !self.tag_members.is_empty() {
            out.truncate(out.len() - b"}\n".len());
            out.extend_from_slice(&self.tag_members);
            out.extend_from_slice(b"}\n");
        }
    }
}

/// A row of layout `long`. The keys are the columns of the CSV format.
#[derive(Serialize)]
struct LongRow<'a> {
    time: serde_json::Value,
    elapsed_s: f64,
    node: u8,
    signal: &'a str,
    value: JsonNumber,
    unit: Option<&'a str>,
    status: Option<&'a str>,
    raw: String,
}

impl RowFormat for JsonRows {
    fn header(&self, _columns: Columns<'_>) -> Vec<u8> {
        Vec::new()
    }

    fn new_columns(&self, _columns: Columns<'_>) -> Vec<u8> {
        Vec::new()
    }

    /// Compares the keys of the first row, in any order.
    fn check_header(&self, first_line: &str, columns: Columns<'_>) -> Result<(), HeaderMismatch> {
        let row = serde_json::from_str::<BTreeMap<String, serde_json::Value>>(first_line);
        let found: Vec<String> = row.unwrap_or_default().into_keys().collect();
        let names: Vec<String> = columns.names().into_iter().chain(self.tag_names.iter().cloned()).collect();
        let mut expected = names.clone();
        expected.sort_unstable();
        if found == expected {
            return Ok(());
        }
        Err(HeaderMismatch { found: first_line.to_owned(), expected: names.join(",") })
    }

    fn write(&mut self, row: &Row<'_>, out: &mut Vec<u8>) -> io::Result<()> {
        let (time, elapsed_s) = (self.times.json(row.time)?, row.elapsed.as_secs_f64());
        match row.values {
            Values::One { sample, source } => {
                let row = LongRow {
                    time,
                    elapsed_s,
                    node: source.node.get(),
                    signal: &source.signal,
                    value: JsonNumber(sample.value),
                    unit: Some(&*source.unit).filter(|unit| !unit.is_empty()),
                    status: sample.status.map(Status::as_str),
                    raw: sample.raw.to_string(),
                };
                json::line(out, &row)?;
            }
            Values::Cycle { columns, cells } => {
                let mut serializer = serde_json::Serializer::new(&mut *out);
                let mut object = serializer.serialize_map(None)?;
                object.serialize_entry("time", &time)?;
                object.serialize_entry("elapsed_s", &elapsed_s)?;
                for (column, cell) in columns.iter().zip(cells) {
                    let cell = cell.unwrap_or_default();
                    object.serialize_entry(&column.value_name, &JsonNumber(cell.value))?;
                    object.serialize_entry(&column.status_name, &cell.status.map(Status::as_str))?;
                }
                object.end()?;
                out.push(b'\n');
            }
        }
        self.add_tags(out);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::rows::row::LONG_COLUMNS;

    #[test]
    fn only_the_same_keys_may_follow() {
        let json = JsonRows::new(TimeForm::default(), &[]);
        let keys: Vec<String> = LONG_COLUMNS.iter().rev().map(|key| format!("\"{key}\":1")).collect();
        assert_eq!(json.check_header(&format!("{{{}}}", keys.join(",")), Columns::Long), Ok(()));
        assert!(json.check_header("{\"time\":1}", Columns::Long).is_err());
        assert!(json.check_header(&LONG_COLUMNS.join(","), Columns::Long).is_err());
    }
}
