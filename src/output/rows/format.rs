//! The file formats of a recording. Each format has its own file in this folder.

mod csv;
mod influx;
mod json_lines;

use super::row::{Columns, Row};
use super::setup::Setup;
use crate::output::report::Format;
use csv::CsvRows;
use influx::InfluxRows;
use json_lines::JsonRows;
use std::fmt::Debug;
use std::io;

/// The format of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FileFormat {
    /// CSV.
    #[default]
    Csv,
    /// JSON Lines.
    JsonLines,
    /// InfluxDB line protocol.
    Influx,
}

/// The values of `--format`. A format only for recordings is a [`Format::Recording`].
pub const CHOICES: &[Format] = &[Format::Text, Format::Json, Format::Csv, Format::Recording(FileFormat::Influx)];

impl From<Format> for FileFormat {
    /// Files and pipes use CSV unless another format is requested.
    fn from(format: Format) -> FileFormat {
        match format {
            Format::Text | Format::Csv => FileFormat::Csv,
            Format::Json => FileFormat::JsonLines,
            Format::Recording(format) => format,
        }
    }
}

/// Converts typed rows to lines.
pub(super) trait RowFormat: Debug {
    /// The lines before the first row of a file; empty if the format has none.
    fn header(&self, columns: Columns<'_>) -> Vec<u8>;

    /// The lines in the middle of a stream, before the first row with other columns; empty if the format has none.
    fn new_columns(&self, columns: Columns<'_>) -> Vec<u8>;

    /// Whether rows with these columns may follow in a file that begins with `first_line`.
    ///
    /// # Errors
    /// The file has other columns.
    fn check_header(&self, first_line: &str, columns: Columns<'_>) -> Result<(), HeaderMismatch>;

    /// Appends one row, with its line end.
    ///
    /// # Errors
    /// The time cannot be represented.
    fn write(&mut self, row: &Row<'_>, out: &mut Vec<u8>) -> io::Result<()>;
}

impl FileFormat {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            FileFormat::Csv => "csv",
            FileFormat::JsonLines => "json",
            FileFormat::Influx => "influx",
        }
    }

    /// Whether the options for CSV apply.
    pub fn is_csv(self) -> bool {
        self == FileFormat::Csv
    }

    /// Whether the form of times can be chosen.
    pub fn has_time_forms(self) -> bool {
        self != FileFormat::Influx
    }

    /// The writer of this format.
    pub(super) fn writer(self, setup: &Setup) -> Box<dyn RowFormat> {
        match self {
            FileFormat::Csv => Box::new(CsvRows::new(setup.dialect, setup.time, &setup.tags)),
            FileFormat::JsonLines => Box::new(JsonRows::new(setup.time, &setup.tags)),
            FileFormat::Influx => Box::new(InfluxRows::new(setup)),
        }
    }
}

/// The columns of an existing file differ from those of the new rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeaderMismatch {
    /// The first line of the file.
    pub found: String,
    /// The columns of the new rows.
    pub expected: String,
}
