//! Reports of `store` and `restore`.

use super::report::{Cell, Column, Report, rows_only};
use crate::canopen::id::NodeId;
use crate::tasks::store::Done;
use std::io::{self, Write};

/// What a node stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stored(pub NodeId, pub Done);

/// What a node restored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Restored(pub NodeId, pub Done);

impl Report for Stored {
    const COLUMNS: &'static [Column] = &[Column::new("node").right(), Column::new("stored"), Column::new("verified")];

    fn cells(&self) -> Vec<Cell> {
        cells(self.0, &self.1)
    }

    fn text(reports: &[Stored], out: &mut dyn Write) -> io::Result<()> {
        rows_only(reports, out)
    }
}

impl Report for Restored {
    const COLUMNS: &'static [Column] = &[Column::new("node").right(), Column::new("restored"), Column::new("verified")];

    fn cells(&self) -> Vec<Cell> {
        cells(self.0, &self.1)
    }

    fn text(reports: &[Restored], out: &mut dyn Write) -> io::Result<()> {
        rows_only(reports, out)
    }
}

fn cells(node: NodeId, done: &Done) -> Vec<Cell> {
    vec![node.into(), done.groups().into(), done.verified.as_str().into()]
}
