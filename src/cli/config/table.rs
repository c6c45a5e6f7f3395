//! `config apply --table FILE.csv`: one row for each device, by its identity. The columns replace `{column}` in the
//! file.

use super::{document, mistakes};
use crate::canopen::id::{NodeId, parse_u32};
use crate::cli::exit::FileError;
use crate::device::catalog;
use crate::device::config_file::{Document, Entry, Item, Place};
use crate::output::failure::ErrorMessage;
use crate::tasks::config::{Mistake, Problem};
use std::fs::File;
use std::path::Path;

/// One device of a table.
#[derive(Clone, Debug)]
pub(super) struct TableRow {
    /// Vendor, product and serial number.
    pub(super) identity: [u32; 3],
    /// The file with the values of the row.
    pub(super) document: Document,
    /// The file and the row, for messages: `mh4.toml (row 3 of forty.csv)`.
    pub(super) label: String,
}

/// Reads a table and its file.
pub(super) fn read(table: &Path, file: &str, with_address: bool) -> anyhow::Result<Vec<TableRow>> {
    let name = table.display().to_string();
    let io = |source: std::io::Error| FileError { what: format!("read {name}"), source };
    let wrong = |line: usize, message: String| ErrorMessage::usage(format!("{name}:{line}: {message}"));
    let template = document(file)?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(File::open(table).map_err(io)?);
    let columns: Vec<String> = reader
        .headers()
        .map_err(|error| wrong(1, error.to_string()))?
        .iter()
        .map(|column| column.trim_start_matches('\u{feff}').to_owned())
        .collect();
    for needed in ["vendor", "product", "serial"] {
        if !columns.iter().any(|column| column == needed) {
            return Err(wrong(1, format!("no column \"{needed}\""))
                .hint("columns: vendor,product,serial,node,…")
                .into());
        }
    }
    let mut rows: Vec<TableRow> = Vec::new();
    let mut nodes: Vec<NodeId> = Vec::new();
    for (line, record) in (2..).zip(reader.records()) {
        let record = record.map_err(|error| wrong(line, error.to_string()))?;
        let cell = |column: &str| {
            let at = columns.iter().position(|known| known == column)?;
            record.get(at).filter(|cell| !cell.is_empty())
        };
        let number = |column: &str| {
            let text = cell(column).unwrap_or_default();
            parse_u32(text).ok_or_else(|| wrong(line, format!("{column}: \"{text}\" is not a number (71, 0x47)")))
        };
        let identity = [number("vendor")?, number("product")?, number("serial")?];
        if identity[2] == 0 {
            return Err(wrong(line, "serial: the number 0 does not identify a device".to_owned()).into());
        }
        if rows.iter().any(|row| row.identity == identity) {
            return Err(wrong(line, format!("the device with the serial number {} occurs twice", identity[2])).into());
        }
        let label = format!("{file} (row {line} of {name})");
        let mut document =
            filled(&template, &|column| cell(column).map(str::to_owned)).map_err(|found| mistakes(&label, found))?;
        if let Some(text) = cell("node") {
            let node: NodeId = text.parse().map_err(|error| wrong(line, format!("node: {error}")))?;
            if nodes.contains(&node) {
                return Err(wrong(line, format!("node: two devices get the node-ID {node}")).into());
            }
            nodes.push(node);
            if with_address && is_factory_id(identity, node) {
                let message = format!("node: {node} is the node-ID of a new device, which may also be on the bus");
                return Err(wrong(line, message).hint("choose another node-ID").into());
            }
            replace(&mut document, "address.node-id", Item::Integer(node.get().into()));
        }
        if document.entries.iter().any(|entry| entry.key.starts_with("calibration.")) {
            replace(&mut document, "calibration.serial", Item::Integer(identity[2].into()));
        }
        rows.push(TableRow { identity, document, label });
    }
    if rows.is_empty() { Err(wrong(1, "the table has no devices".to_owned()).into()) } else { Ok(rows) }
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

/// The file with `{column}` replaced by the cells of a row.
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
