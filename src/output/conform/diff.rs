//! Two saved reports of `conform`, compared case by case.

use crate::output::report::{Cell, Column, Report};
use serde::Deserialize;
use std::collections::BTreeMap;

/// A report as `conform --report FILE.json` writes it; only the facts that are compared.
#[derive(Clone, Debug, Deserialize)]
pub struct SavedReport {
    cases: Vec<SavedCase>,
}

#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
struct SavedCase {
    case: String,
    verdict: String,
    sentence: String,
    details: Vec<String>,
}

/// A case whose verdict or findings differ.
#[derive(Clone, Debug)]
pub struct DiffRow {
    case: String,
    sentence: String,
    before: Option<SavedCase>,
    after: Option<SavedCase>,
}

impl SavedReport {
    /// Reads a report.
    ///
    /// # Errors
    /// The text is not such a report.
    pub fn parse(text: &str) -> Result<SavedReport, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    /// The cases that differ in `after`, in the order of their numbers.
    pub fn diff(self, after: SavedReport) -> Vec<DiffRow> {
        let mut rows: BTreeMap<String, DiffRow> = BTreeMap::new();
        let row = |case: &SavedCase| DiffRow {
            case: case.case.clone(),
            sentence: case.sentence.clone(),
            before: None,
            after: None,
        };
        for case in self.cases {
            let empty = row(&case);
            let row = rows.entry(empty.case.clone()).or_insert(empty);
            row.before = Some(case);
        }
        for case in after.cases {
            let empty = row(&case);
            let row = rows.entry(empty.case.clone()).or_insert(empty);
            row.after = Some(case);
        }
        let differs = |row: &DiffRow| match (&row.before, &row.after) {
            (Some(before), Some(after)) => before.verdict != after.verdict || before.details != after.details,
            _ => true,
        };
        rows.into_values().filter(differs).collect()
    }
}

impl Report for DiffRow {
    const COLUMNS: &'static [Column] = &[
        Column::new("case"),
        Column::new("before"),
        Column::new("after"),
        Column::new("sentence").heading("WHAT"),
        Column::new("details_before").data_only(),
        Column::new("details_after").data_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let verdict = |case: &Option<SavedCase>| case.as_ref().map_or(Cell::Null, |case| case.verdict.as_str().into());
        let details = |case: &Option<SavedCase>| Cell::list(case.iter().flat_map(|case| case.details.clone()));
        vec![
            self.case.as_str().into(),
            verdict(&self.before),
            verdict(&self.after),
            self.sentence.as_str().into(),
            details(&self.before),
            details(&self.after),
        ]
    }
}
