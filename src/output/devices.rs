//! The reports of `devices`: the list of descriptions, a description as TOML, and mistakes in a file.

use super::report::{Cell, Column, Report};
use super::text;
use crate::device::catalog::Model;
use crate::device::description::DescriptionError;
use std::io::{self, Write};
use std::sync::Arc;

/// A description in the list.
#[derive(Clone, Debug)]
pub struct Listed {
    /// The description.
    pub model: Arc<Model>,
    /// Its file; `None` if it is built in.
    pub file: Option<String>,
}

impl Report for Listed {
    const COLUMNS: &'static [Column] = &[
        Column::new("name"),
        Column::new("title"),
        Column::new("vendor").data_only(),
        Column::new("profile").right(),
        Column::new("node_id").heading("NODE").right(),
        Column::new("bit_rate").heading("RATE").right(),
        Column::new("signals"),
        Column::new("objects").data_only(),
        Column::new("file"),
        Column::new("source").data_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let description = &self.model.description;
        let rate = description.factory.bit_rate;
        let profile = description.identify.device_type.map(|device_type| device_type & 0xffff);
        let signals = Cell::list(description.signals.iter().map(|signal| signal.name.as_str()));
        let several = description.signals.len() > 3;
        let count = format!("{} signals", description.signals.len());
        vec![
            description.name.as_str().into(),
            description.title.as_str().into(),
            description.vendor.as_str().into(),
            profile.into(),
            description.factory.node_id.into(),
            Cell::from(rate).shown_as(rate.map_or_else(|| "-".to_owned(), |rate| format!("{}k", rate / 1000))),
            if several { signals.shown_as(count) } else { signals },
            self.model.dictionary.iter().count().into(),
            Cell::from(self.file.as_ref()).shown_as(self.file.as_deref().unwrap_or("built-in")),
            description.source.as_str().into(),
        ]
    }
}

/// A description as TOML.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DescriptionText {
    /// The name of the description.
    pub name: String,
    /// The contents of the file.
    pub toml: String,
}

impl Report for DescriptionText {
    const COLUMNS: &'static [Column] = &[Column::new("name"), Column::new("toml")];

    fn cells(&self) -> Vec<Cell> {
        vec![self.name.as_str().into(), self.toml.as_str().into()]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        reports.iter().try_for_each(|report| out.write_all(report.toml.as_bytes()))
    }
}

/// A mistake, or a possible mistake, in the file of a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The file.
    pub file: String,
    /// The place and the text.
    pub mistake: DescriptionError,
    /// Whether the mistake makes the file unusable.
    pub is_error: bool,
}

impl Report for Finding {
    const COLUMNS: &'static [Column] = &[
        Column::new("file"),
        Column::new("line"),
        Column::new("column"),
        Column::new("error"),
        Column::new("message"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let DescriptionError { place, message } = &self.mistake;
        vec![self.file.as_str().into(), place.line.into(), place.column.into(), self.is_error.into(), message.into()]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        for report in reports {
            let DescriptionError { place, message } = &report.mistake;
            let note = if report.is_error { "" } else { "note: " };
            let line = format!("{}:{place}: {note}{message}", report.file);
            writeln!(out, "{}", text::safe(&text::one_line(&line)))?;
        }
        Ok(())
    }
}
