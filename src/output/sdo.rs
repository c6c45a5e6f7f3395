//! Reports of `sdo read`.

use super::report::{Cell, Column, Report};
use super::text;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::tasks::sdo::ReadValue;
use std::io::{self, Write};

/// A value of an object that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectValue {
    /// The value.
    pub read: ReadValue,
    /// The object as entered by the user.
    pub typed: String,
    /// Whether it is the only requested object. The text is then only the value.
    pub is_single: bool,
    /// The form of the value in the text.
    pub form: ValueForm,
}

/// The form of a value in the text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ValueForm {
    /// By its type; COB-IDs, mapping entries and unit codes are hexadecimal, as in manuals.
    #[default]
    Usual,
    /// A hexadecimal number, which can be written back.
    Hexadecimal,
    /// The bytes in wire order: `47 00 00 00`.
    Bytes,
}

/// Formats the bytes of a number in hexadecimal, with leading zeros. `None` for more than eight bytes.
fn hexadecimal(bytes: &[u8]) -> Option<String> {
    let digits: String = bytes.iter().rev().map(|byte| format!("{byte:02X}")).collect();
    (1..=8).contains(&bytes.len()).then(|| format!("0x{digits}"))
}

/// Whether manuals print the values of an object in hexadecimal: COB-IDs, mapping entries, unit codes.
pub(super) fn is_usually_hexadecimal(object: ObjectId) -> bool {
    match object.index {
        0x1005 | 0x1012 | 0x1014 => object.sub == 0,
        0x1200..=0x12ff => matches!(object.sub, 1 | 2),
        0x1400..=0x15ff | 0x1800..=0x19ff => object.sub == 1,
        0x1600..=0x17ff | 0x1a00..=0x1bff | 0x6131 => object.sub > 0,
        _ => false,
    }
}

impl ObjectValue {
    fn raw(&self) -> String {
        text::wire_bytes(&self.read.raw)
    }

    /// The value as text.
    fn shown(&self) -> String {
        match &self.read.value {
            _ if self.form == ValueForm::Bytes => text::spaced_bytes(&self.read.raw),
            // Text is shown as bytes, because it is not a number.
            Value::Text(_) if self.form == ValueForm::Hexadecimal => text::spaced_bytes(&self.read.raw),
            _ if self.form == ValueForm::Hexadecimal => {
                hexadecimal(&self.read.raw).unwrap_or_else(|| text::spaced_bytes(&self.read.raw))
            }
            value => usual(self.read.object, value, &self.read.raw),
        }
    }
}

/// The usual text of a value. `raw`: the bytes of the value.
pub(super) fn usual(object: ObjectId, value: &Value, raw: &[u8]) -> String {
    match value {
        Value::Text(text) => text::safe(text),
        Value::Bytes(bytes) => text::spaced_bytes(bytes),
        Value::Unsigned(_) if is_usually_hexadecimal(object) => hexadecimal(raw).unwrap_or_default(),
        value => value.to_string(),
    }
}

impl Report for ObjectValue {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("object"),
        Column::new("name"),
        Column::new("type"),
        Column::new("value"),
        Column::new("raw"),
    ];

    fn cells(&self) -> Vec<Cell> {
        vec![
            self.read.node.into(),
            self.read.object.into(),
            self.read.name.clone().into(),
            self.read.data_type.map(|data_type| data_type.to_string()).into(),
            match &self.read.value {
                Value::Bytes(_) => self.raw().into(),
                value => value.into(),
            },
            self.raw().into(),
        ]
    }

    /// A single value alone, several values as `OBJECT VALUE`.
    fn text(reports: &[ObjectValue], out: &mut dyn Write) -> io::Result<()> {
        reports.iter().try_for_each(|value| value.line(out))
    }

    fn line(&self, out: &mut dyn Write) -> io::Result<()> {
        if self.is_single {
            writeln!(out, "{}", self.shown())
        } else {
            writeln!(out, "{} {}", self.typed, self.shown())
        }
    }
}
