//! Reads the lines of a recording as typed rows: both layouts, CSV and JSON Lines.

use super::cells::{Cells, Clock, micros, text, text_time, wide_column};
use serde_json::{Map, Value};
use std::borrow::Cow;

/// The byte order mark at the start of a file.
const BOM: &[u8] = b"\xef\xbb\xbf";

/// The columns of layout `long`, before the tags.
const LONG: [&str; 8] = ["time", "elapsed_s", "node", "signal", "value", "unit", "status", "raw"];

/// One value of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row<'a> {
    /// Microseconds since 1970-01-01 UTC.
    pub time_us: i64,
    /// The node-ID.
    pub node: u8,
    /// The signal.
    pub signal: Cow<'a, str>,
    /// The unit; empty if it is unknown.
    pub unit: Cow<'a, str>,
    /// The status; empty if the device reports none.
    pub status: Cow<'a, str>,
    /// The number as it is written in the recording, with a decimal point; `None` if there is no finite number.
    pub value: Option<Cow<'a, [u8]>>,
}

/// The tags of a line, each with its name and its value.
pub type Tags = Vec<(String, String)>;

/// The table that the next lines of a CSV file belong to.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Table {
    Long,
    /// Node, signal and unit of each pair of columns.
    Wide(Vec<(u8, String, String)>),
}

/// The header of the next lines.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Header {
    delimiter: u8,
    table: Table,
    tag_names: Vec<String>,
}

/// A line of a recording.
#[derive(Debug, PartialEq, Eq)]
pub enum Content<'a> {
    /// An empty line or a header.
    Nothing,
    /// The values of the line; empty for a cycle without values.
    Rows(Vec<Row<'a>>),
    /// Neither a header nor a row.
    Other,
}

/// Reads lines in their order.
#[derive(Debug, Default)]
pub struct RowReader {
    header: Option<Header>,
    header_line: String,
    clock: Clock,
    /// The cells of the tags in the last line, as they are in the file.
    tag_cells: Vec<u8>,
    tags: Tags,
    /// Counts the changes of `tags`.
    generation: u64,
}

impl RowReader {
    /// A reader that continues after a line. `header` is the header of that line; empty if it has none.
    pub fn after(header: &str) -> RowReader {
        let mut reader = RowReader::default();
        reader.read(header.as_bytes());
        reader
    }

    /// The header of the next lines; empty for JSON Lines.
    pub fn header(&self) -> &str {
        &self.header_line
    }

    /// The tags of the last line.
    pub fn tags(&self) -> &Tags {
        &self.tags
    }

    /// A number that changes whenever the tags change.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Reads a line, with or without its line end.
    pub fn read<'a>(&mut self, line: &'a [u8]) -> Content<'a> {
        let line = line.trim_ascii_end();
        let line = line.strip_prefix(BOM).unwrap_or(line);
        if line.is_empty() {
            return Content::Nothing;
        }
        if line.starts_with(b"{") {
            return self.json(line).map_or(Content::Other, Content::Rows);
        }
        if let Some(header) = Header::parse(line) {
            self.header_line = text(line).into_owned();
            self.header = Some(header);
            self.tag_cells.clear();
            self.set_tags(Vec::new());
            return Content::Nothing;
        }
        self.csv(line).map_or(Content::Other, Content::Rows)
    }

    fn csv<'a>(&mut self, line: &'a [u8]) -> Option<Vec<Row<'a>>> {
        let header = self.header.as_ref()?;
        let mut cells = Cells::new(line, header.delimiter);
        let time_us = self.clock.time(&cells.next()?)?;
        cells.next()?;
        let mut rows = Vec::new();
        match &header.table {
            Table::Long => {
                let (node, signal) = (text(&cells.next()?).parse().ok()?, owned_text(cells.next()?));
                let (value, unit) = (number(cells.next()?)?, owned_text(cells.next()?));
                let status = owned_text(cells.next()?);
                cells.next()?;
                rows.push(Row { time_us, node, signal, unit, status, value });
            }
            Table::Wide(columns) => {
                for (node, signal, unit) in columns {
                    let (value, status) = (cells.next()?, cells.next()?);
                    if value.is_empty() && status.is_empty() {
                        continue;
                    }
                    rows.push(Row {
                        time_us,
                        node: *node,
                        signal: Cow::Owned(signal.clone()),
                        unit: Cow::Owned(unit.clone()),
                        status: owned_text(status),
                        value: number(value)?,
                    });
                }
            }
        }
        if cells.rest() != self.tag_cells || self.tags.len() != header.tag_names.len() {
            self.tag_cells = cells.rest().to_vec();
            let values: Vec<String> = cells.map(|cell| text(&cell).into_owned()).collect();
            if values.len() != header.tag_names.len() {
                return None;
            }
            let tags = header.tag_names.iter().cloned().zip(values).collect();
            self.set_tags(tags);
        }
        Some(rows)
    }

    fn json(&mut self, line: &[u8]) -> Option<Vec<Row<'static>>> {
        let mut members: Map<String, Value> = serde_json::from_slice(line).ok()?;
        let time_us = match members.remove("time")? {
            Value::String(text) => text_time(&text)?,
            Value::Number(number) => super::cells::moment(number.as_f64()?),
            _ => return None,
        };
        members.remove("elapsed_s")?;
        let word = |value: Option<Value>| match value {
            Some(Value::String(text)) => Some(text),
            Some(Value::Null) | None => Some(String::new()),
            Some(_) => None,
        };
        let number = |value: Value| match value {
            Value::Number(number) => Some(Some(Cow::Owned(number.to_string().into_bytes()))),
            Value::Null => Some(None),
            _ => None,
        };
        let mut rows = Vec::new();
        if let Some(node) = members.remove("node") {
            let node = u8::try_from(node.as_u64()?).ok()?;
            rows.push(Row {
                time_us,
                node,
                signal: word(members.remove("signal"))?.into(),
                unit: word(members.remove("unit"))?.into(),
                status: word(members.remove("status"))?.into(),
                value: number(members.remove("value")?)?,
            });
            members.remove("raw");
        } else {
            let names: Vec<String> = members.keys().filter(|name| name.contains('.')).cloned().collect();
            for name in names.iter().filter(|name| !is_status_of_another(name, &names)) {
                let (node, signal, unit) = wide_column(name)?;
                let status = word(members.remove(&format!("{node}.{signal}.status")))?;
                let value = number(members.remove(name)?)?;
                if value.is_some() || !status.is_empty() {
                    let (signal, unit) = (signal.to_owned().into(), unit.to_owned().into());
                    rows.push(Row { time_us, node, signal, unit, status: status.into(), value });
                }
            }
        }
        let tags =
            members.into_iter().map(|(name, value)| Some((name, word(Some(value))?))).collect::<Option<Tags>>()?;
        self.set_tags(tags);
        Some(rows)
    }

    fn set_tags(&mut self, tags: Tags) {
        if tags != self.tags {
            self.tags = tags;
            self.generation += 1;
        }
    }
}

/// Whether a member is the status of another signal: `5.pressure.status` beside `5.pressure [bar]`.
fn is_status_of_another(name: &str, names: &[String]) -> bool {
    let Some(signal) = name.strip_suffix(".status") else { return false };
    names.iter().any(|other| {
        other == signal || other.strip_prefix(signal).is_some_and(|rest| rest.starts_with(" [") && rest.ends_with(']'))
    })
}

fn owned_text(cell: Cow<'_, [u8]>) -> Cow<'_, str> {
    match cell {
        Cow::Borrowed(bytes) => text(bytes),
        Cow::Owned(bytes) => Cow::Owned(String::from_utf8_lossy(&bytes).into_owned()),
    }
}

/// The number in a cell, with a decimal point. `Some(None)` if the cell is empty or not finite; `None` if it contains
/// anything else.
fn number(mut cell: Cow<'_, [u8]>) -> Option<Option<Cow<'_, [u8]>>> {
    if cell.is_empty() {
        return Some(None);
    }
    if let Some(comma) = cell.iter().position(|byte| *byte == b',') {
        cell.to_mut()[comma] = b'.';
    }
    let is_plain = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.' | b'e' | b'E');
    let value: f64 = str::from_utf8(&cell).ok()?.parse().ok()?;
    Some((value.is_finite() && cell.iter().all(is_plain)).then_some(cell))
}

impl Header {
    /// A header of `log`; `None` for another line.
    fn parse(line: &[u8]) -> Option<Header> {
        let delimiter = *line.strip_prefix(LONG[0].as_bytes())?.first()?;
        if !matches!(delimiter, b',' | b';' | b'|' | b'\t') {
            return None;
        }
        let names: Vec<String> = Cells::new(line, delimiter).map(|cell| text(&cell).into_owned()).collect();
        if let Some(tag_names) = names.strip_prefix(&LONG.map(str::to_owned)) {
            return Some(Header { delimiter, table: Table::Long, tag_names: tag_names.to_vec() });
        }
        let [time, elapsed, rest @ ..] = names.as_slice() else { return None };
        if (time.as_str(), elapsed.as_str()) != (LONG[0], LONG[1]) {
            return None;
        }
        // The names of tags contain no dot.
        let signals = rest.iter().take_while(|name| name.contains('.')).count();
        let (pairs, tag_names) = rest.split_at(signals);
        let columns = pairs.chunks(2).map(|pair| {
            let (node, signal, unit) = wide_column(&pair[0])?;
            let is_pair = pair.get(1).is_some_and(|status| *status == format!("{node}.{signal}.status"));
            is_pair.then(|| (node, signal.to_owned(), unit.to_owned()))
        });
        let columns = columns.collect::<Option<Vec<_>>>().filter(|columns| !columns.is_empty())?;
        Some(Header { delimiter, table: Table::Wide(columns), tag_names: tag_names.to_vec() })
    }
}

/// Microseconds of a time in RFC 3339 or as seconds; `None` if it is neither.
pub fn parse_time(text: &str) -> Option<i64> {
    text_time(text).or_else(|| text.parse().ok().map(micros))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "time,elapsed_s,node,signal,value,unit,status,raw";

    fn read(reader: &mut RowReader, line: &str) -> Vec<(u8, String, Option<String>)> {
        match reader.read(line.as_bytes()) {
            Content::Rows(rows) => {
                let value = |row: &Row<'_>| row.value.as_ref().map(|value| text(value).into_owned());
                rows.iter()
                    .map(|row| (row.node, format!("{}|{}|{}", row.signal, row.unit, row.status), value(row)))
                    .collect()
            }
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn rows_of_layout_long() {
        let mut reader = RowReader::after(&format!("{HEADER},bench,part"));
        let row = "2023-11-14T22:13:21.010001Z,0.000000,5,pressure,1.2500,bar,ok,0x00,3,\"P,1\"\n";
        assert_eq!(read(&mut reader, row), [(5, "pressure|bar|ok".to_owned(), Some("1.2500".to_owned()))]);
        let pair = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        assert_eq!(reader.tags(), &[pair("bench", "3"), pair("part", "P,1")]);
        let generation = reader.generation();
        read(&mut reader, row);
        assert_eq!(reader.generation(), generation);
        for value in ["", "NaN", "inf", "-inf"] {
            let row = format!("1700000001.010001,0.000000,5,pressure,{value},,,0x00,3,x");
            assert_eq!(read(&mut reader, &row), [(5, "pressure||".to_owned(), None)], "{value}");
        }
        assert_ne!(reader.generation(), generation, "other tags");
        for other in ["x", "1,2", "1,0,5,pressure,1 2,,,0x00,3,x", "1,0,5,pressure,1,,,0x00,3", "1,0,500,p,1,,,0x,3,x"]
        {
            assert_eq!(reader.read(other.as_bytes()), Content::Other, "{other}");
        }
        assert_eq!(RowReader::default().read(b"1,0,5,pressure,1,,,0x00"), Content::Other, "no header");
    }

    #[test]
    fn rows_of_layout_wide() {
        let mut reader = RowReader::default();
        let header = "time;elapsed_s;5.p [bar];5.p.status;6.t.status [code];6.t.status.status;rig";
        assert_eq!(reader.read(header.as_bytes()), Content::Nothing);
        let rows = read(&mut reader, "1700000001,5;0;1,5;ok;;;a");
        assert_eq!(rows, [(5, "p|bar|ok".to_owned(), Some("1.5".to_owned()))]);
        assert_eq!(
            read(&mut reader, "1700000001,5;0;;;3;;a"),
            [(6, "t.status|code|".to_owned(), Some("3".to_owned()))]
        );
        assert_eq!(reader.tags(), &[("rig".to_owned(), "a".to_owned())]);
        assert_eq!(reader.read(b"1;0;1;ok;;"), Content::Other, "a cell is missing");
        assert_eq!(RowReader::after(reader.header()).read(b"1;0;;;;;a"), Content::Rows(Vec::new()));
    }

    #[test]
    fn rows_of_json_lines() {
        let mut reader = RowReader::default();
        let long = r#"{"time":"2023-11-14T22:13:21.010001Z","elapsed_s":0.0,"node":5,"signal":"p","value":1.5,"unit":"bar","status":null,"raw":"0x","bench":"3"}"#;
        assert_eq!(read(&mut reader, long), [(5, "p|bar|".to_owned(), Some("1.5".to_owned()))]);
        assert_eq!(reader.tags(), &[("bench".to_owned(), "3".to_owned())]);
        let wide = r#"{"time":1700000001.5,"elapsed_s":0.0,"5.p [bar]":null,"5.p.status":"invalid","6.t":2,"6.t.status":null}"#;
        let expected = [(5, "p|bar|invalid".to_owned(), None), (6, "t||".to_owned(), Some("2".to_owned()))];
        assert_eq!(read(&mut reader, wide), expected);
        for other in ["{", "{}", r#"{"time":true,"elapsed_s":0}"#, r#"{"time":1,"elapsed_s":0,"node":5,"value":"x"}"#] {
            assert_eq!(reader.read(other.as_bytes()), Content::Other, "{other}");
        }
    }
}
