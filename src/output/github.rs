//! Verdicts for GitHub Actions: annotations (workflow commands), and a table for the step summary.

use super::verdict::findings;
use crate::measure::expression::verdict::{Outcome, Verdict};
use crate::tasks::check::CheckReport;

/// One annotation per verdict: an error if the expression is not satisfied or has no data, else a notice.
pub fn annotations(report: &CheckReport) -> Vec<String> {
    let annotation = |verdict: &Verdict| {
        let command = if verdict.outcome == Outcome::Ok { "notice" } else { "error" };
        let title = escape(&format!("cangauge check{}", of_node(verdict)), true);
        let text = format!("{}: {}", verdict.text, findings(verdict, &report.failures));
        format!("::{command} title={title}::{}", escape(&text, false))
    };
    report.verdicts.iter().map(annotation).collect()
}

fn of_node(verdict: &Verdict) -> String {
    verdict.node.map(|node| format!(" node {node}")).unwrap_or_default()
}

/// Escapes a text for a workflow command. In a property, the separators `:` and `,` are also escaped.
fn escape(text: &str, is_property: bool) -> String {
    let text = text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
    if is_property { text.replace(':', "%3A").replace(',', "%2C") } else { text }
}

/// Returns the step summary: a table in Markdown.
pub fn summary(report: &CheckReport) -> String {
    let mut text = String::from("### cangauge check\n\n| Result | Node | Expression | Measured |\n|---|---|---|---|\n");
    for verdict in &report.verdicts {
        let result = match verdict.outcome {
            Outcome::Ok => "ok",
            Outcome::Fail => "**FAIL**",
            Outcome::NoData => "**no data**",
        };
        let node = verdict.node.map(|node| node.to_string()).unwrap_or_default();
        let (expression, found) = (literal(&verdict.text), literal(&findings(verdict, &report.failures)));
        text.push_str(&format!("| {result} | {node} | {expression} | {found} |\n"));
    }
    text.push('\n');
    text
}

/// Escapes a text, so that none of its characters has a meaning in Markdown or HTML.
fn literal(text: &str) -> String {
    let escape = |letter: char| match letter {
        '|' | '<' | '>' | '&' | '`' | '*' | '_' | '~' | '[' | ']' | '\\' | '$' | '@' | '#' => {
            format!("&#{};", u32::from(letter))
        }
        letter if letter.is_control() => " ".to_owned(),
        letter => letter.to_string(),
    };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_end_an_annotation_or_a_cell() {
        assert_eq!(escape("50 %, a: b\r\n::error::x", true), "50 %25%2C a%3A b%0D%0A%3A%3Aerror%3A%3Ax");
        assert_eq!(escape("50 %\na: b, c", false), "50 %25%0Aa: b, c");
        assert_eq!(literal("|a| <\nb"), "&#124;a&#124; &#60; b");
    }
}
