//! Lists the cases without a result in the text output: one line for each reason.

use super::record::details;
use super::wrap;
use crate::output::text;
use crate::tasks::conform::{CaseResult, Verdict, WhyNot};
use std::io::{self, Write};

/// Whether a case has no result, and is listed together with the other cases that have the same reason.
pub(super) fn is_skipped(result: &CaseResult) -> bool {
    let is_without_result = match &result.verdict {
        Verdict::NotApplicable(_) => true,
        Verdict::NotJudged(why) => matches!(**why, WhyNot::NoStimulus),
        _ => false,
    };
    is_without_result && result.not_restored.is_empty()
}

/// Writes one line for each reason: `not applicable: SDO-30 to SDO-36 (the device has no block transfer)`.
///
/// # Errors
/// `out` cannot be written.
pub fn write_skipped(results: &[CaseResult], width: Option<usize>, out: &mut dyn Write) -> io::Result<()> {
    let mut groups: Vec<(&str, String, Vec<usize>)> = Vec::new();
    for (place, result) in results.iter().enumerate().filter(|(_, result)| is_skipped(result)) {
        let (verdict, reason) = (result.verdict.name(), details(result).join("; "));
        match groups.iter_mut().find(|group| group.0 == verdict && group.1 == reason) {
            Some(group) => group.2.push(place),
            None => groups.push((verdict, reason, vec![place])),
        }
    }
    for (verdict, reason, places) in groups {
        let cases = ranges(results, &places).join(", ");
        let line = format!("{}: {cases} ({})", verdict.replace('-', " "), text::safe(&reason));
        wrap(out, "", &line, width)?;
    }
    Ok(())
}

/// Returns the numbers of the cases. Three or more successive cases of one area are joined to a range.
fn ranges(results: &[CaseResult], places: &[usize]) -> Vec<String> {
    let follows = |a: &usize, b: &usize| *a + 1 == *b && results[*a].case.area == results[*b].case.area;
    let id = |place: &usize| results[*place].case.id.to_owned();
    let range = |chunk: &[usize]| match chunk {
        [first, _, .., last] => vec![format!("{} to {}", id(first), id(last))],
        several => several.iter().map(id).collect(),
    };
    places.chunk_by(follows).flat_map(range).collect()
}
