//! `config apply --table FILE.csv`: one row for each device, with its identity. The cells of the row replace `{column}`
//! in the settings file.

use super::{document, mistakes};
use crate::cli::exit::FileError;
use crate::cli::file::ReportFile;
use cangauge::canopen::id::{NodeId, parse_u32};
use cangauge::device::catalog;
use cangauge::device::config_file::{Document, Entry, Item, Place};
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::config::{Mistake, Problem};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// One device of a table.
#[derive(Clone, Debug)]
pub(super) struct TableRow {
    /// Vendor, product and serial number.
    pub(super) identity: [u32; 3],
    /// The node-ID.
    pub(super) node: Option<NodeId>,
    /// The settings file with the values of the row.
    pub(super) document: Document,
    /// The file and the row, for messages: `mh4.toml (row 3 of forty.csv)`.
    pub(super) label: String,
}

/// The column that [`Table::write_result`] writes.
const RESULT: &str = "result";

/// The first word of a result if the device was set.
pub(super) const OK: &str = "ok";

/// A table with the devices of a series.
#[derive(Clone, Debug)]
pub(super) struct Table {
    pub(super) rows: Vec<TableRow>,
    path: PathBuf,
    /// The header and the rows, as they are in the file.
    records: Vec<Vec<String>>,
}

impl Table {
    /// Reads the table, and fills the settings file `file` with the values of each row.
    pub(super) fn read(table: &Path, file: &str, with_address: bool) -> anyhow::Result<Table> {
        let name = table.display().to_string();
        let io = |source: std::io::Error| FileError { what: format!("read {name}"), source };
        let wrong = |line: u64, message: String| ErrorMessage::usage(format!("{name}:{line}: {message}"));
        let template = document(file)?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .has_headers(false)
            .from_reader(File::open(table).map_err(io)?);
        let (mut rows, mut records): (Vec<TableRow>, Vec<Vec<String>>) = (Vec::new(), Vec::new());
        for record in reader.records() {
            let line_of = |position: Option<&csv::Position>| position.map_or(1, csv::Position::line);
            let record = record.map_err(|error| wrong(line_of(error.position()), error.to_string()))?;
            let line = line_of(record.position());
            let wrong = |message: String| wrong(line, message);
            let Some(columns) = records.first() else {
                let columns: Vec<String> =
                    record.iter().map(|column| column.trim_start_matches('\u{feff}').to_owned()).collect();
                check_columns(&columns)
                    .map_err(|message| wrong(message).hint("columns: vendor,product,serial,node,…"))?;
                records.push(columns);
                continue;
            };
            let cells: Cells =
                columns.iter().map(String::as_str).zip(&record).filter(|(_, cell)| !cell.is_empty()).collect();
            let (identity, node) = identity_and_node(&cells, &rows, with_address).map_err(wrong)?;
            let label = format!("{file} (row {line} of {name})");
            let document = filled(&template, &|column| cells.get(column).map(|cell| (*cell).to_owned()));
            let mut document = document.map_err(|found| mistakes(&label, found))?;
            if let Some(node) = node {
                replace(&mut document, "address.node-id", Item::Integer(node.get().into()));
            }
            if document.entries.iter().any(|entry| entry.key.starts_with("calibration.")) {
                replace(&mut document, "calibration.serial", Item::Integer(identity[2].into()));
            }
            rows.push(TableRow { identity, node, document, label });
            records.push(record.iter().map(str::to_owned).collect());
        }
        if rows.is_empty() {
            return Err(wrong(1, "the table has no devices".to_owned()).into());
        }
        Ok(Table { rows, path: table.to_owned(), records })
    }

    /// Whether the device of a row was set, according to the column "result".
    pub(super) fn is_done(&self, row: usize) -> bool {
        let column = self.records[0].iter().position(|column| column == RESULT);
        column.and_then(|column| self.records[row + 1].get(column)).is_some_and(|result| result.starts_with(OK))
    }

    /// Writes the result of a row to the table file. A rename replaces the file, so it is never incomplete.
    pub(super) fn write_result(&mut self, row: usize, result: String) -> anyhow::Result<()> {
        let column = self.records[0].iter().position(|column| column == RESULT).unwrap_or_else(|| {
            self.records[0].push(RESULT.to_owned());
            self.records[1..].iter_mut().for_each(|record| record.push(String::new()));
            self.records[0].len() - 1
        });
        self.records[row + 1][column] = result;
        let mut writer = csv::Writer::from_writer(Vec::new());
        self.records.iter().try_for_each(|record| writer.write_record(record))?;
        ReportFile::create(&self.path, false, None)?.write(&writer.into_inner()?)
    }
}

/// The cells of a row that are not empty, by column.
type Cells<'a> = BTreeMap<&'a str, &'a str>;

fn check_columns(columns: &[String]) -> Result<(), String> {
    let is_missing = |needed: &&&str| !columns.iter().any(|column| column == *needed);
    match ["vendor", "product", "serial"].iter().find(is_missing) {
        Some(missing) => Err(format!("no column \"{missing}\"")),
        None => Ok(()),
    }
}

/// Returns the identity and the node-ID of a row. Fails if a row before has the same identity or node-ID.
fn identity_and_node(
    cells: &Cells<'_>,
    before: &[TableRow],
    with_address: bool,
) -> Result<([u32; 3], Option<NodeId>), String> {
    let number = |column: &str| {
        let text = cells.get(column).copied().unwrap_or_default();
        parse_u32(text).ok_or_else(|| format!("{column}: \"{text}\" is not a number (71, 0x47)"))
    };
    let identity = [number("vendor")?, number("product")?, number("serial")?];
    if identity[2] == 0 {
        return Err("serial: the number 0 does not identify a device".to_owned());
    }
    if before.iter().any(|row| row.identity == identity) {
        return Err(format!("the device with the serial number {} occurs twice", identity[2]));
    }
    let node = cells.get("node").map(|text| text.parse::<NodeId>());
    let node = node.transpose().map_err(|error| format!("node: {error}"))?;
    if let Some(node) = node {
        if before.iter().any(|row| row.node == Some(node)) {
            return Err(format!("node: two devices get the node-ID {node}"));
        }
        if with_address && is_factory_id(identity, node) {
            return Err(format!(
                "node: {node} is the node-ID of a new device, which may also be on the bus; choose another one"
            ));
        }
    }
    Ok((identity, node))
}

/// Whether this is the factory node-ID of this kind of device.
fn is_factory_id([vendor, product, _]: [u32; 3], node: NodeId) -> bool {
    catalog::by_identity(vendor, product).is_some_and(|model| model.description.factory.node_id == Some(node))
}

fn replace(document: &mut Document, key: &str, value: Item) {
    match document.entries.iter_mut().find(|entry| entry.key == key) {
        Some(entry) => entry.value = value,
        None => {
            let (key, at) = (key.to_owned(), Place::default());
            document.entries.push(Entry { key, value, key_at: at, value_at: at });
        }
    }
}

/// Returns the settings file with each `{column}` replaced by the cell of a row.
fn filled(template: &Document, cell: &dyn Fn(&str) -> Option<String>) -> Result<Document, Vec<Mistake>> {
    let mut filled = template.clone();
    let mut mistakes = Vec::new();
    for entry in &mut filled.entries {
        let Item::Text(text) = &entry.value else { continue };
        let mut out = String::new();
        let mut rest = text.as_str();
        while let Some((before, after)) = rest.split_once('{') {
            out.push_str(before);
            let Some((column, after)) = after.split_once('}') else {
                out.push('{');
                rest = after;
                continue;
            };
            match cell(column) {
                Some(cell) => out.push_str(&cell),
                None => {
                    let problem = Problem::NoColumn { column: column.to_owned() };
                    mistakes.push(Mistake { place: entry.value_at, key: entry.key.clone(), problem });
                }
            }
            rest = after;
        }
        out.push_str(rest);
        // If the cell is the whole value, it may be a number.
        let is_whole = text.starts_with('{') && text.find('}') == Some(text.len() - 1);
        entry.value = match (is_whole, out.parse::<i128>(), out.parse::<f64>()) {
            (true, Ok(number), _) => Item::Integer(number),
            (true, _, Ok(number)) if number.is_finite() => Item::Real(number),
            _ => Item::Text(out),
        };
    }
    if mistakes.is_empty() { Ok(filled) } else { Err(mistakes) }
}
