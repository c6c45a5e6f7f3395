//! Verdicts as JUnit XML for CI servers (Jenkins, GitLab, GitHub): one test case per expression and node.

use super::verdict::findings;
use crate::measure::expression::verdict::{Outcome, Verdict};
use crate::tasks::Failure;
use crate::tasks::check::CheckReport;
use std::fmt::Write;

/// Returns the complete document.
pub fn document(report: &CheckReport) -> String {
    let seconds = report.length.as_secs_f64();
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"0\" time=\"{seconds:.3}\"",
        report.verdicts.len(),
        report.count(Outcome::Fail),
        report.count(Outcome::NoData)
    );
    let stamp = report.started.map(|started| {
        let time = humantime::format_rfc3339_seconds(started.wall.system_time()).to_string();
        // JUnit timestamps have no time zone.
        format!(" timestamp=\"{}\"", time.trim_end_matches('Z'))
    });
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    // Writing to a String cannot fail.
    let _ = writeln!(text, "<testsuites name=\"cangauge check\" {counts}>");
    let _ = writeln!(text, "  <testsuite name=\"cangauge check\" {counts}{}>", stamp.unwrap_or_default());
    report.verdicts.iter().for_each(|verdict| test_case(&mut text, verdict, &report.failures, seconds));
    text.push_str("  </testsuite>\n</testsuites>\n");
    text
}

fn test_case(text: &mut String, verdict: &Verdict, failures: &[Failure], seconds: f64) {
    let class = verdict.node.map_or_else(|| "cangauge".to_owned(), |node| format!("cangauge.node-{node}"));
    let (name, found) = (escape(&verdict.text), escape(&findings(verdict, failures)));
    let _ = writeln!(text, "    <testcase classname=\"{class}\" name=\"{name}\" time=\"{seconds:.3}\">");
    let _ = match verdict.outcome {
        Outcome::Ok => writeln!(text, "      <system-out>{found}</system-out>"),
        Outcome::Fail => {
            writeln!(text, "      <failure type=\"check-failed\" message=\"{found}\">{name}: {found}</failure>")
        }
        Outcome::NoData => {
            writeln!(text, "      <error type=\"no-answer\" message=\"{found}\">{name}: {found}</error>")
        }
    };
    text.push_str("    </testcase>\n");
}

/// Escapes text for XML elements and attributes. Characters that XML 1.0 does not allow become U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&apos;"),
            '\t' | '\n' | '\r' => {
                let _ = write!(safe, "&#{};", u32::from(character));
            }
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::{BusError, Mono, Stamp, Wall};
    use crate::canopen::id::NodeId;
    use crate::measure::expression::verdict::Reason;
    use std::time::Duration;

    #[test]
    fn each_verdict_is_one_test_case() {
        let verdict = |text: &str, outcome, node| Verdict {
            outcome,
            reason: None,
            node,
            ..Verdict::no_data(text, None, Reason::TooFewSamples)
        };
        let ok = verdict("a < 1 and b > 2", Outcome::Ok, None);
        let fail = verdict("a in 1..2", Outcome::Fail, NodeId::new(5).ok());
        let none = Verdict::no_data("|a| < 1", None, Reason::Failed(0));
        let report = CheckReport {
            verdicts: vec![ok, fail, none],
            started: Some(Stamp { mono: Mono::START, wall: Wall::at(Duration::from_secs(1_700_000_000)) }),
            length: Duration::from_millis(1500),
            failures: vec![BusError::NoInterface("<a> & 'b'\u{1b}\n".to_owned()).into()],
            remarks: Vec::new(),
        };
        assert_eq!(
            document(&report),
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <testsuites name=\"cangauge check\" tests=\"3\" failures=\"1\" errors=\"1\" skipped=\"0\" time=\"1.500\">\n\
             \x20 <testsuite name=\"cangauge check\" tests=\"3\" failures=\"1\" errors=\"1\" skipped=\"0\" time=\"1.500\" timestamp=\"2023-11-14T22:13:20\">\n\
             \x20   <testcase classname=\"cangauge\" name=\"a &lt; 1 and b &gt; 2\" time=\"1.500\">\n\
             \x20     <system-out></system-out>\n\
             \x20   </testcase>\n\
             \x20   <testcase classname=\"cangauge.node-5\" name=\"a in 1..2\" time=\"1.500\">\n\
             \x20     <failure type=\"check-failed\" message=\"\">a in 1..2: </failure>\n\
             \x20   </testcase>\n\
             \x20   <testcase classname=\"cangauge\" name=\"|a| &lt; 1\" time=\"1.500\">\n\
             \x20     <error type=\"no-answer\" message=\"no data: there is no CAN interface &quot;&lt;a&gt; &amp; &apos;b&apos;\u{fffd}&#10;&quot;\">|a| &lt; 1: no data: there is no CAN interface &quot;&lt;a&gt; &amp; &apos;b&apos;\u{fffd}&#10;&quot;</error>\n\
             \x20   </testcase>\n\
             \x20 </testsuite>\n\
             </testsuites>\n"
        );
    }
}
