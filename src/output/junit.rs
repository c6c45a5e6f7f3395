//! Verdicts as the XML that CI servers read (the JUnit form, as Jenkins and GitLab take it): one test case per
//! expression, and per node where an expression is judged for several.

use super::verdict::findings;
use crate::measure::expression::verdict::{Ruling, Verdict};
use crate::tasks::check::Report;
use std::fmt::Write;

/// The whole document.
pub fn document(report: &Report) -> String {
    let count = |ruling| report.count(ruling);
    let seconds = report.length.as_secs_f64();
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"0\" time=\"{seconds:.3}\"",
        report.verdicts.len(),
        count(Ruling::Fail),
        count(Ruling::NoData)
    );
    let stamp = report.begun.map(|begun| {
        let time = humantime::format_rfc3339_seconds(begun.wall.system_time()).to_string();
        // The form knows no time zone.
        format!(" timestamp=\"{}\"", time.trim_end_matches('Z'))
    });
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    // Writing to a String cannot fail.
    let _ = writeln!(text, "<testsuites name=\"cangauge check\" {counts}>");
    let _ = writeln!(text, "  <testsuite name=\"cangauge check\" {counts}{}>", stamp.unwrap_or_default());
    report.verdicts.iter().for_each(|verdict| case(&mut text, verdict, seconds));
    text.push_str("  </testsuite>\n</testsuites>\n");
    text
}

fn case(text: &mut String, verdict: &Verdict, seconds: f64) {
    let class = verdict.node.map_or_else(|| "cangauge".to_owned(), |node| format!("cangauge.node-{node}"));
    let (name, found) = (escaped(&verdict.text), escaped(&findings(verdict)));
    let _ = writeln!(text, "    <testcase classname=\"{class}\" name=\"{name}\" time=\"{seconds:.3}\">");
    let _ = match verdict.ruling {
        Ruling::Ok => writeln!(text, "      <system-out>{found}</system-out>"),
        Ruling::Fail => {
            writeln!(text, "      <failure type=\"check-failed\" message=\"{found}\">{name}: {found}</failure>")
        }
        Ruling::NoData => writeln!(text, "      <error type=\"no-answer\" message=\"{found}\">{name}: {found}</error>"),
    };
    text.push_str("    </testcase>\n");
}

/// Text as it may stand in XML, between tags and in attributes. Characters that XML 1.0 has not become U+FFFD.
fn escaped(text: &str) -> String {
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
    use crate::bus::{Mono, Stamp, Wall};
    use crate::canopen::id::NodeId;
    use std::time::Duration;

    #[test]
    fn one_test_case_per_expression() {
        let ok = Verdict { ruling: Ruling::Ok, reason: None, ..Verdict::nothing("a < 1 and b > 2", None, "") };
        let fail = Verdict {
            ruling: Ruling::Fail,
            reason: None,
            node: NodeId::new(5).ok(),
            ..Verdict::nothing("a in 1..2", None, "")
        };
        let none = Verdict::nothing("|a| < 1", None, "\"no\" <answer> & more\u{1b}\n");
        let begun = Stamp { mono: Mono::START, wall: Wall::at(Duration::from_secs(1_700_000_000)) };
        let report = Report {
            verdicts: vec![ok, fail, none],
            begun: Some(begun),
            length: Duration::from_millis(1500),
            failures: Vec::new(),
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
             \x20     <error type=\"no-answer\" message=\"no data: &quot;no&quot; &lt;answer&gt; &amp; more\u{fffd}&#10;\">|a| &lt; 1: no data: &quot;no&quot; &lt;answer&gt; &amp; more\u{fffd}&#10;</error>\n\
             \x20   </testcase>\n\
             \x20 </testsuite>\n\
             </testsuites>\n"
        );
    }
}
