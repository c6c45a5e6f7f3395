//! Reports of `store` and `restore`.

use super::notes;
use super::report::{Cell, Column, Report, rows_only};
use crate::tasks::store::{Group, StoreReport};
use std::io::{self, Write};

/// The result of `store`.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored(pub StoreReport);

/// The result of `restore`.
#[derive(Clone, Debug, PartialEq)]
pub struct Restored(pub StoreReport);

const fn columns(groups: &'static str) -> [Column; 4] {
    [Column::new("node").right(), Column::new(groups), Column::new("verified"), Column::new("notes").json_only()]
}

impl Report for Stored {
    const COLUMNS: &'static [Column] = &columns("stored");

    fn cells(&self) -> Vec<Cell> {
        cells(&self.0)
    }

    fn text(reports: &[Stored], out: &mut dyn Write) -> io::Result<()> {
        rows_only(reports, out)
    }
}

impl Report for Restored {
    const COLUMNS: &'static [Column] = &columns("restored");

    fn cells(&self) -> Vec<Cell> {
        cells(&self.0)
    }

    fn text(reports: &[Restored], out: &mut dyn Write) -> io::Result<()> {
        rows_only(reports, out)
    }
}

fn cells(report: &StoreReport) -> Vec<Cell> {
    let groups = Group::names(&report.groups);
    vec![report.node.into(), groups.into(), report.verified.as_str().into(), notes::cell(&report.notes)]
}
