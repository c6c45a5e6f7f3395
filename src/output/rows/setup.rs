//! The settings for writing a recording.

use super::cells::{Dialect, TimeForm};
use super::format::{FileFormat, HeaderMismatch};
use super::rotation::Rotation;
use super::row::Columns;

/// The layout: one row per value, or one row per cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// One row per value.
    #[default]
    Long,
    /// One row per cycle.
    Wide,
}

/// The settings for writing a recording.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    /// The file format.
    pub format: FileFormat,
    /// The layout: one row per value, or one row per cycle.
    pub layout: Layout,
    /// Separators of CSV.
    pub dialect: Dialect,
    /// The form of times.
    pub time: TimeForm,
    /// The tags: constant columns after the others, each with its name and its value.
    pub tags: Vec<(String, String)>,
    /// The bench and the run: further tags of line protocol.
    pub origin: Vec<(String, String)>,
    /// When the next file starts.
    pub rotation: Option<Rotation>,
    /// The recording ends after this many rows.
    pub max_rows: Option<u64>,
    /// Whether other columns start a new file. If not, they follow in the same file.
    pub has_series: bool,
    /// Whether the first file already has its header.
    pub continues: bool,
    /// The first line of the existing file, or of the last file of the series.
    pub existing_header: Option<String>,
}

impl Setup {
    /// Whether rows of layout `long` may follow those in the existing file.
    ///
    /// # Errors
    /// The file has other columns.
    pub fn check_long(&self) -> Result<(), HeaderMismatch> {
        self.check_columns(Columns::Long)
    }

    pub(super) fn check_columns(&self, columns: Columns<'_>) -> Result<(), HeaderMismatch> {
        match &self.existing_header {
            Some(header) => self.format.writer(self).check_header(header, columns),
            None => Ok(()),
        }
    }
}
