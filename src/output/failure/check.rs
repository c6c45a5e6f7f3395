//! Messages and hints if a check failed or had no data.

use super::CauseText;
use crate::measure::expression::verdict::Verdict;
use crate::output::doubt;
use crate::output::verdict::findings;
use crate::tasks::Failure;
use crate::tasks::check::CheckFailure;

/// The largest number of failed expressions listed in a message.
const MAX_LISTED: usize = 3;

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &CheckFailure) -> CauseText {
    match cause {
        CheckFailure::NotSatisfied { failed, all } => {
            let mut list: Vec<String> = failed.iter().take(MAX_LISTED).map(describe).collect();
            if failed.len() > MAX_LISTED {
                list.push(format!("{} more", failed.len() - MAX_LISTED));
            }
            CauseText::new(format!("{} of {all} {} failed: {}", failed.len(), checks(*all), list.join("; ")))
        }
        CheckFailure::UnknownType { signal } => {
            let cause_text = CauseText::new(doubt::unknown_type(signal));
            match failure.node {
                Some(node) => cause_text.hint(doubt::type_remedy(node, signal)),
                None => cause_text,
            }
        }
        CheckFailure::NoData { without, all } => {
            CauseText::new(format!("no data for {without} of {all} {}", checks(*all)))
        }
    }
}

/// `node 5: pressure < 1 bar: 1.25 bar`.
fn describe(verdict: &Verdict) -> String {
    let node = verdict.node.map(|node| format!("node {node}: ")).unwrap_or_default();
    format!("{node}{}: {}", verdict.text, findings(verdict, &[]))
}

fn checks(number: usize) -> &'static str {
    if number == 1 { "check" } else { "checks" }
}
