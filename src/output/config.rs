//! The file of `config dump`, and the reports of `config diff` and `config apply`.

use super::report::{Cell, Column, Report};
use super::table::{self, Align};
use super::{notes, text};
use crate::canopen::value::DataType;
use crate::device::config_file::{Item, toml_key, toml_value};
use crate::tasks::config::{ApplyReport, ChangedRow, Dump, Line, Row, Step};
use std::io::{self, Write};

/// Converts a value to a cell.
fn value(item: &Item) -> Cell {
    match item {
        Item::Integer(number) => match (i64::try_from(*number), u64::try_from(*number)) {
            (Ok(number), _) => number.into(),
            (_, Ok(number)) => number.into(),
            _ => number.to_string().into(),
        },
        Item::Flag(flag) => (*flag).into(),
        Item::List(list) => Cell::list(list.iter().map(String::as_str)),
        other => other.to_string().into(),
    }
}

impl Report for Row {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("setting"),
        Column::new("value"),
        Column::new("default"),
        Column::new("fixed"),
    ];

    fn cells(&self) -> Vec<Cell> {
        vec![
            self.node.into(),
            self.key.as_str().into(),
            value(&self.value),
            self.is_default.into(),
            self.is_fixed.into(),
        ]
    }
}

/// Writes the settings as TOML with comments.
///
/// # Errors
/// `out` cannot be written.
pub fn write_toml(dump: &Dump, out: &mut dyn Write) -> io::Result<()> {
    let title = dump.title.as_deref().unwrap_or("a device without a description");
    writeln!(out, "# Settings of {}, written by cangauge config dump.", text::safe(title))?;
    writeln!(out, "# Set them again: cangauge config apply NODE FILE")?;
    let mut current = String::new();
    for row in &dump.rows {
        let (section, name) = split(&row.key);
        if section != current {
            writeln!(out, "\n[{section}]")?;
            if section.starts_with("calibration") && !current.starts_with("calibration") {
                writeln!(out, "# Values of this one device: set only with --with-calibration.")?;
                dump.dates.iter().try_for_each(|(what, date)| writeln!(out, "# {what} {date}"))?;
            }
            if section == "address" {
                writeln!(out, "# Set only with --address.")?;
            }
            current = section;
        }
        writeln!(out, "{name} = {}{}", toml_value(&row.value), comment(row))?;
        if row.key == "device.product" {
            identity_comment(dump, out)?;
        }
    }
    for object in &dump.unreadable {
        writeln!(out, "# not readable: {}", text::safe(object))?;
    }
    Ok(())
}

/// Writes revision and serial number as a comment, because they differ between devices of one kind.
fn identity_comment(dump: &Dump, out: &mut dyn Write) -> io::Result<()> {
    let [revision, serial] = dump.revision_and_serial;
    let revision = revision.map(|revision| format!("revision 0x{revision:X}"));
    let serial = serial.map(|serial| format!("serial number {serial}"));
    let known: Vec<String> = [revision, serial].into_iter().flatten().collect();
    if known.is_empty() { Ok(()) } else { writeln!(out, "# {}", known.join(", ")) }
}

/// Splits the key of a setting into the name of its TOML table and the key in this table.
fn split(key: &str) -> (String, String) {
    let parts: Vec<&str> = key.split('.').collect();
    let depth = match parts.as_slice() {
        ["signal" | "tpdo" | "calibration", _, _, ..] => 2,
        _ => 1,
    };
    let join = |parts: &[&str]| parts.iter().map(|part| toml_key(part)).collect::<Vec<_>>().join(".");
    // Names of objects may contain dots.
    let name = if parts.first() == Some(&"object") { toml_key(&parts[1..].join(".")) } else { join(&parts[depth..]) };
    (join(&parts[..depth]), name)
}

fn comment(row: &Row) -> String {
    let meaning = row.meaning.as_deref().map(text::safe);
    let default = (row.is_default == Some(true)).then(|| "default".to_owned());
    let fixed = row.is_fixed.then(|| "fixed".to_owned());
    let parts: Vec<String> = [meaning, fixed, default].into_iter().flatten().collect();
    if parts.is_empty() { String::new() } else { format!("  # {}", parts.join("; ")) }
}

/// A setting that differs or was changed.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangedSetting(pub ChangedRow);

const CHANGE: &[Column] =
    &[Column::new("setting"), Column::new("before").heading("OLD"), Column::new("after").heading("NEW")];

fn change_cells(row: &ChangedRow) -> Vec<Cell> {
    vec![row.key.as_str().into(), optional(row.before.as_ref()), optional(row.after.as_ref())]
}

fn optional(item: Option<&Item>) -> Cell {
    item.map_or(Cell::Null, value)
}

impl Report for ChangedSetting {
    const COLUMNS: &'static [Column] = CHANGE;

    fn cells(&self) -> Vec<Cell> {
        change_cells(&self.0)
    }
}

/// The result of `config apply` for one device.
#[derive(Clone, Debug)]
pub struct AppliedReport(pub ApplyReport);

impl AppliedReport {
    /// `4 changes, verified and stored`.
    pub fn sentence(&self) -> String {
        let ApplyReport { rows, stored, is_reset, .. } = &self.0;
        let changes = match rows.len() {
            1 => "1 change".to_owned(),
            count => format!("{count} changes"),
        };
        match (rows.is_empty(), *stored, *is_reset) {
            (true, false, _) => changes,
            (true, true, false) => format!("{changes}, stored"),
            (true, true, true) => format!("{changes}, stored, verified after a reset"),
            (false, false, _) => format!("{changes}, verified, not stored"),
            (false, true, false) => format!("{changes}, verified and stored"),
            (false, true, true) => format!("{changes}, stored, verified after a reset"),
        }
    }
}

impl Report for AppliedReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("serial"),
        Column::new("changes"),
        Column::new("verified").data_only(),
        Column::new("stored"),
        Column::nested("settings", CHANGE),
        Column::new("notes").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let ApplyReport { after, rows, stored, is_reset, notes, .. } = &self.0;
        vec![
            self.0.node.into(),
            after.node.identity.serial.into(),
            u64::try_from(rows.len()).unwrap_or(u64::MAX).into(),
            if *is_reset { "reset" } else { "read-back" }.into(),
            (*stored).into(),
            Cell::Rows(rows.iter().map(change_cells).collect()),
            notes::cell(notes),
        ]
    }

    /// One device: a table of its settings. Several devices: one line each.
    fn text(reports: &[AppliedReport], out: &mut dyn Write) -> io::Result<()> {
        let shown =
            |item: &Option<Item>| item.as_ref().map_or_else(|| "-".to_owned(), |item| text::safe(&item.to_string()));
        if reports.is_empty() {
            return Ok(());
        }
        let mut rows = Vec::new();
        if let [only] = reports {
            if only.0.rows.is_empty() {
                return Ok(());
            }
            rows.push(["NODE", "SETTING", "OLD", "NEW"].map(str::to_owned).to_vec());
            let node = only.0.after.node.id.to_string();
            let row = |row: &ChangedRow| vec![node.clone(), row.key.clone(), shown(&row.before), shown(&row.after)];
            rows.extend(only.0.rows.iter().map(row));
        } else {
            rows.push(["NODE", "SERIAL", "RESULT"].map(str::to_owned).to_vec());
            let serial = |report: &AppliedReport| report.0.after.node.identity.serial;
            let serial = |report| serial(report).map_or_else(|| "-".to_owned(), |serial| serial.to_string());
            rows.extend(
                reports.iter().map(|report| vec![report.0.node.to_string(), serial(report), report.sentence()]),
            );
        }
        table::write(out, &[Align::Right, Align::Left, Align::Left, Align::Left][..rows[0].len()], &rows)
    }
}

/// One step of `config apply --dry-run`.
#[derive(Clone, Debug, PartialEq)]
pub struct LineReport(pub Line);

impl LineReport {
    fn command(&self) -> String {
        let node = self.0.node;
        match &self.0.step {
            Step::Write { object, data_type, bytes } => {
                let value = data_type.decode(bytes).map(|value| value.to_string()).unwrap_or_default();
                let is_code = object.index < 0x2000 || object.index == 0x6131;
                let value = match <[u8; 4]>::try_from(bytes.as_slice()) {
                    Ok(bytes) if is_code && *data_type == DataType::Unsigned(4) => {
                        format!("0x{:08X}", u32::from_le_bytes(bytes))
                    }
                    _ if value.contains(' ') || value.is_empty() => format!("\"{value}\""),
                    _ => value,
                };
                format!("cangauge sdo write {node} {object} {value} --type {data_type}")
            }
            Step::SetId(id) => format!("cangauge lss set-id {node} {id}"),
            Step::SetBitRate(rate) => format!("cangauge lss set-bitrate {node} {rate}"),
            Step::Store => format!("cangauge store {node}"),
        }
    }
}

impl Report for LineReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("setting"),
        Column::new("object"),
        Column::new("type"),
        Column::new("raw"),
        Column::new("command"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let (object, data_type, raw) = match &self.0.step {
            Step::Write { object, data_type, bytes } => {
                ((*object).into(), data_type.to_string().into(), crate::measure::sample::Raw::new(bytes).into())
            }
            _ => (Cell::Null, Cell::Null, Cell::Null),
        };
        let setting = Some(self.0.key.as_str()).filter(|key| !key.is_empty());
        vec![self.0.node.into(), setting.into(), object, data_type, raw, self.command().into()]
    }

    /// `cangauge sdo write 1 0x1017:0 500 --type u16  # node.heartbeat`.
    fn text(reports: &[LineReport], out: &mut dyn Write) -> io::Result<()> {
        for report in reports {
            let key = if report.0.key.is_empty() { String::new() } else { format!("  # {}", report.0.key) };
            writeln!(out, "{}{key}", text::safe(&report.command()))?;
        }
        Ok(())
    }
}

/// The JSON Schema of the settings file, for text editors.
pub const SCHEMA: &str = include_str!("config.schema.json");
