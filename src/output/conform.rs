//! Results of `conform`: one row for each case.

mod diff;
mod record;
mod skipped;
mod words;

pub use diff::{DiffRow, SavedReport};
pub use record::ConformRecord;
pub use skipped::write_skipped;
pub use words::finding;
use words::page;
pub(in crate::output) use words::{lss_setting, stimulus_failure};

use super::report::{Cell, Column, Report};
use super::text;
use crate::canopen::id::NodeId;
use crate::tasks::conform::{Case, CaseResult, ConformReport, RecordedFrame, StateAfter, Transcript, Verdict};
use std::io::{self, Write};

/// One case in the list of `--dry-run`.
#[derive(Clone, Copy, Debug)]
pub struct CaseRow(pub &'static Case);

impl Report for CaseRow {
    const COLUMNS: &'static [Column] = &[
        Column::new("case"),
        Column::new("area"),
        Column::new("needs"),
        Column::new("clause").data_only(),
        Column::new("severity").data_only(),
        Column::new("sentence").heading("WHAT"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let case = self.0;
        vec![
            case.id.into(),
            case.area.name().into(),
            case.needs.name().map_or(Cell::Null, Into::into),
            case.clause.into(),
            case.severity.name().into(),
            case.sentence.into(),
        ]
    }
}

/// The result of one case.
#[derive(Clone, Debug)]
pub struct ResultRow {
    /// The node.
    pub node: NodeId,
    /// The result.
    pub result: CaseResult,
    /// The width of the terminal in characters; `None`: lines are not wrapped.
    pub width: Option<usize>,
}

/// The frames as in `candump`: `>` for sent ones.
fn frames(transcript: &Transcript) -> Vec<String> {
    let frame = |one: &RecordedFrame| format!("{} {}", if one.is_sent { '>' } else { '<' }, one.frame);
    transcript.frames.iter().map(frame).collect()
}

impl Report for ResultRow {
    const COLUMNS: &'static [Column] = &[
        Column::new("node").data_only(),
        Column::new("case"),
        Column::new("area").data_only(),
        Column::new("verdict"),
        Column::new("known").data_only(),
        Column::new("severity").data_only(),
        Column::new("sentence").heading("WHAT"),
        Column::new("clause").data_only(),
        Column::new("details").data_only(),
        Column::new("meaning").data_only(),
        Column::new("not_restored").data_only(),
        Column::new("seconds").data_only(),
        Column::new("figures").json_only(),
        Column::new("frames").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let (result, case) = (&self.result, self.result.case);
        let deviates = matches!(result.verdict, Verdict::Deviates(_));
        vec![
            self.node.into(),
            case.id.into(),
            case.area.name().into(),
            result.verdict.name().into(),
            result.known.clone().map_or(Cell::Null, Into::into),
            case.severity.name().into(),
            case.sentence.into(),
            case.clause.into(),
            Cell::list(record::details(result)),
            if deviates { case.meaning.into() } else { Cell::Null },
            Cell::list(result.not_restored.iter().map(ToString::to_string)),
            Cell::Real(result.length.as_secs_f64(), 3),
            Cell::Object(
                record::figures_of(result)
                    .map(|figure| (figure.statistic.name(), Cell::Real(figure.time.as_secs_f64(), 6)))
                    .collect(),
            ),
            Cell::list(frames(&result.transcript)),
        ]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        reports.iter().try_for_each(|report| report.line(out))
    }

    fn line(&self, out: &mut dyn Write) -> io::Result<()> {
        let (result, case) = (&self.result, self.result.case);
        if skipped::is_skipped(result) {
            return Ok(());
        }
        let head = format!("{:<7} {:<10}  ", case.id, result.verdict.name());
        wrap(out, &head, case.sentence, self.width)?;
        let mut detail = |line: &str| wrap(out, "        ", line, self.width);
        for found in record::details(result) {
            detail(&text::safe(&found))?;
        }
        if let Verdict::Deviates(_) = result.verdict {
            match &result.known {
                Some(known) => detail(&page(known))?,
                None => detail(&format!("{} ({}): {}", case.severity.name(), case.clause, case.meaning))?,
            }
        }
        if !result.not_restored.is_empty() {
            detail(&format!("not restored: {}", super::failure::conform::list(&result.not_restored)))?;
        }
        Ok(())
    }
}

/// The smallest width of the text after the number and the verdict of a case, in characters.
const MIN_TEXT_WIDTH: usize = 30;

/// Writes a line after `head`. If there is a width, the line is broken at spaces, and further lines are indented.
fn wrap(out: &mut dyn Write, head: &str, line: &str, width: Option<usize>) -> io::Result<()> {
    let indent = head.chars().count();
    let lines = match width {
        Some(width) => text::folded(line, width.saturating_sub(indent).max(MIN_TEXT_WIDTH)),
        None => vec![line.to_owned()],
    };
    for (number, line) in lines.iter().enumerate() {
        let before = if number == 0 { head } else { "" };
        writeln!(out, "{before:<indent$}{line}")?;
    }
    Ok(())
}

/// The counts in one line: `62 cases in 8.1 s: 50 pass, 1 deviate, 2 known deviations, 9 not applicable`.
pub fn summary(report: &ConformReport) -> String {
    let count = |wanted: fn(&CaseResult) -> bool| report.results.iter().filter(|result| wanted(result)).count();
    let deviates = |result: &CaseResult| matches!(result.verdict, Verdict::Deviates(_));
    let known = report.results.iter().filter(|result| deviates(result) && result.known.is_some()).count();
    let counts = [
        (count(|result| matches!(result.verdict, Verdict::Pass)), "pass"),
        (count(|result| matches!(result.verdict, Verdict::Measured(_))), "measured"),
        (count(CaseResult::is_new_deviation), "deviate"),
        (known, if known == 1 { "known deviation" } else { "known deviations" }),
        (count(|result| matches!(result.verdict, Verdict::NotJudged(_))), "not judged"),
        (count(|result| matches!(result.verdict, Verdict::NotApplicable(_))), "not applicable"),
    ];
    let counts: Vec<String> =
        counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
    format!("{} cases in {:.1} s: {}", report.results.len(), report.length.as_secs_f64(), counts.join(", "))
}

/// What was not restored.
pub fn left(report: &ConformReport) -> Option<String> {
    let objects = || format!("not restored: {}", super::failure::conform::list(&report.not_restored));
    let state = || "the NMT state from before is unknown: the node is pre-operational".to_owned();
    let left: Vec<String> = (!report.not_restored.is_empty())
        .then(objects)
        .into_iter()
        .chain(report.lss_not_restored.iter().map(|setting| lss_setting(*setting)))
        .chain((report.state == StateAfter::Unknown).then(state))
        .chain(report.history.as_ref().map(super::failure::conform::history_left))
        .chain(report.input_failure.as_ref().map(super::failure::conform::input_left))
        .collect();
    (!left.is_empty()).then(|| left.join("; "))
}
