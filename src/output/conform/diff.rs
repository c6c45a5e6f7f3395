//! Two saved reports of `conform`, compared case by case.

use crate::output::conform::words::{figure_time, statistic};
use crate::output::report::{Cell, Column, Report};
use crate::tasks::conform::Statistic;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// A report as `conform --report FILE.json` writes it; only the facts that are compared.
#[derive(Clone, Debug, Deserialize)]
pub struct SavedReport {
    cases: Vec<SavedCase>,
}

#[derive(Clone, Debug, Deserialize, PartialEq)]
struct SavedCase {
    case: String,
    verdict: String,
    sentence: String,
    details: Vec<String>,
    /// Times in seconds by name.
    #[serde(default)]
    figures: BTreeMap<String, f64>,
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
            (Some(before), Some(after)) if before.verdict == after.verdict && !before.figures.is_empty() => {
                before.changed_figures(after).next().is_some()
            }
            (Some(before), Some(after)) => before.verdict != after.verdict || before.details != after.details,
            _ => true,
        };
        rows.into_values().filter(differs).collect()
    }
}

impl SavedCase {
    /// The figures that differ by more than the noise of a measurement.
    fn changed_figures<'a>(&'a self, other: &'a SavedCase) -> impl Iterator<Item = Statistic> + 'a {
        Statistic::ALL.into_iter().filter(|one| {
            let times = (self.figures.get(one.name()), other.figures.get(one.name()));
            matches!(times, (Some(first), Some(second)) if differ(*one, *first, *second))
        })
    }

    /// The verdict, or the figures that differ from the other report.
    fn shown(&self, other: Option<&SavedCase>) -> String {
        let changed = other.filter(|other| other.verdict == self.verdict).into_iter();
        let changed = changed.flat_map(|other| self.changed_figures(other));
        let figure = |one: Statistic| {
            let time = self.figures.get(one.name()).and_then(|time| Duration::try_from_secs_f64(*time).ok());
            format!("{} {}", statistic(one), figure_time(time.unwrap_or_default()))
        };
        let figures: Vec<String> = changed.map(figure).collect();
        if figures.is_empty() { self.verdict.clone() } else { figures.join(", ") }
    }
}

/// Whether two figures in seconds differ by more than noise. Extreme values and jitter depend on single frames.
fn differ(statistic: Statistic, first: f64, second: f64) -> bool {
    let (factor, least) = match statistic {
        Statistic::Median | Statistic::Mean => (1.5, 0.002),
        Statistic::Min | Statistic::Jitter | Statistic::P99 | Statistic::Max => (3.0, 0.010),
    };
    let (low, high) = if first < second { (first, second) } else { (second, first) };
    high > low * factor && high - low > least
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
        let verdict = |case: &Option<SavedCase>, other: &Option<SavedCase>| {
            case.as_ref().map_or(Cell::Null, |case| case.shown(other.as_ref()).into())
        };
        let details = |case: &Option<SavedCase>| Cell::list(case.iter().flat_map(|case| case.details.clone()));
        vec![
            self.case.as_str().into(),
            verdict(&self.before, &self.after),
            verdict(&self.after, &self.before),
            self.sentence.as_str().into(),
            details(&self.before),
            details(&self.after),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(median: f64, max: f64) -> SavedReport {
        let case = |id: &str, figures: String| {
            format!(
                r#"{{"case": "{id}", "verdict": "measured", "sentence": "", "details": ["{median}"], "figures": {{{figures}}}}}"#
            )
        };
        let figures = format!(r#""median": {median}, "max": {max}"#);
        SavedReport::parse(&format!(r#"{{"cases": [{}]}}"#, case("TIM-01", figures))).expect("a report")
    }

    #[test]
    fn noise_of_measured_times_is_no_difference() {
        let before = || report(0.000_4, 0.003);
        assert!(before().diff(report(0.000_9, 0.011)).is_empty());
        let rows = before().diff(report(0.004, 0.020));
        let cells: Vec<String> = rows[0].cells().iter().map(Cell::shown).collect();
        assert_eq!(cells[..3], ["TIM-01", "median 0.400 ms, max 3.000 ms", "median 4.000 ms, max 20 ms"]);
    }
}
