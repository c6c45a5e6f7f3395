//! Reports of `sdo read`.

use super::report::{Cell, Column, Report};
use super::text;
use crate::canopen::value::Value;
use crate::tasks::sdo::ReadValue;
use std::io::{self, Write};

/// A value of an object, as `sdo read` prints it.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectValue {
    /// What was read.
    pub read: ReadValue,
    /// The object as the user typed it.
    pub typed: String,
    /// Whether it is the only object that the user asked for: people then get the bare value.
    pub is_single: bool,
    /// Whether people see the bytes in wire order instead of the value.
    pub as_bytes: bool,
}

impl ObjectValue {
    fn raw(&self) -> String {
        text::wire_bytes(&self.read.raw)
    }

    /// The value for people.
    fn shown(&self) -> String {
        match &self.read.value {
            _ if self.as_bytes => self.raw(),
            Value::Text(text) => text::safe(text),
            Value::Bytes(_) => self.raw(),
            value => value.to_string(),
        }
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

    /// A single value bare, several as `OBJECT VALUE`.
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
