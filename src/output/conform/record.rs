//! The report of `conform` for the maker of a device: one HTML page, JSON, or JUnit XML.

use super::words::{figure_time, figures, finding, page, statistic, why_not};
use super::{frames, left, summary};
use crate::bus::Wall;
use crate::output::junit::escape;
use crate::output::text;
use crate::tasks::conform::{CaseResult, ConformReport, Figure, Statistic, Verdict};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;

/// A report with the facts that identify the run.
#[derive(Clone, Copy, Debug)]
pub struct ConformRecord<'a> {
    /// When the check ended.
    pub time: Wall,
    /// The bus.
    pub bus: &'a str,
    /// The bit rate in bit/s, if it is known.
    pub bit_rate: Option<u32>,
    /// The command line.
    pub command: &'a str,
    /// The results.
    pub report: &'a ConformReport,
}

impl ConformRecord<'_> {
    fn time(&self) -> String {
        humantime::format_rfc3339_seconds(self.time.system_time()).to_string()
    }

    /// One JSON object. `conform diff` reads it.
    pub fn json(&self) -> String {
        let (node, report) = (&self.report.node, self.report);
        let settings = report.lss_not_restored.iter().map(|setting| format!("{} (LSS)", setting.name()));
        let not_restored: Vec<String> = report.not_restored.iter().map(ToString::to_string).chain(settings).collect();
        let record = json!({
            "time": self.time(),
            "tool": "cangauge",
            "version": env!("CARGO_PKG_VERSION"),
            "command": self.command,
            "bus": self.bus,
            "bit_rate": self.bit_rate,
            "node": node.id.get(),
            "device": node.model.as_ref().map(|model| model.description.title.as_str()),
            "vendor": node.identity.vendor,
            "product": node.identity.product,
            "revision": node.identity.revision,
            "serial": node.identity.serial,
            "seconds": report.length.as_secs_f64(),
            "not_restored": not_restored,
            "error_history": report.history.map(|change| json!({
                "before": change.before.count,
                "after": change.after.count,
                "newest": change.after.newest,
            })),
            "cases": report.results.iter().map(case).collect::<Vec<_>>(),
        });
        format!("{record:#}\n")
    }

    /// One HTML page: the deviations first, then all cases.
    pub fn html(&self) -> String {
        let report = self.report;
        let identity = &report.node.identity;
        let number = |number: Option<u32>| number.map_or_else(|| "unknown".to_owned(), |number| number.to_string());
        let title = report.node.model.as_ref().map_or("unknown device", |model| model.description.title.as_str());
        let mut html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Conformance of {title}</title>\n\
             <style>body{{font:11pt sans-serif;margin:2em}}table{{border-collapse:collapse;margin:1em 0}}td,th{{border:1px \
             solid #999;padding:2px 8px;text-align:left;vertical-align:top}}pre{{font-size:9pt}}h2,h3{{page-break-after:\
             avoid}}</style></head><body>\n<h1>{title}, serial number {}</h1>\n<p>vendor {}, product {}, revision {}<br>{} \
             &middot; cangauge {} &middot; bus {} &middot; node {}<br>{}</p>\n<p><strong>{}</strong></p>\n",
            number(identity.serial),
            number(identity.vendor),
            number(identity.product),
            number(identity.revision),
            self.time(),
            env!("CARGO_PKG_VERSION"),
            safe(self.bus),
            report.node.id,
            safe(self.command),
            safe(&summary(report)),
            title = safe(title),
        );
        if let Some(left) = left(report) {
            let _ = writeln!(html, "<p><strong>{}</strong></p>", safe(&left));
        }
        let new = report.results.iter().filter(|result| result.is_new_deviation());
        let known = report.results.iter().filter(|result| result.known.is_some());
        section(&mut html, "Deviations", new);
        section(&mut html, "Deviations that the manual states", known);
        profile(&mut html, report);
        html.push_str(
            "<h2>All cases</h2>\n<table><tr><th>Case</th><th>Verdict</th><th>What</th><th>Clause</th></tr>\n",
        );
        for result in &report.results {
            let case = result.case;
            let _ = writeln!(
                html,
                "<tr><td>{}</td><td>{}</td><td>{}{}</td><td>{}</td></tr>",
                case.id,
                result.verdict.name(),
                safe(case.sentence),
                details(result).iter().map(|detail| format!("<br>{}", safe(detail))).collect::<String>(),
                safe(case.clause)
            );
        }
        html.push_str("</table>\n</body></html>\n");
        html
    }

    /// JUnit XML for CI servers: one test case for each case. A known deviation is no failure.
    pub fn junit(&self) -> String {
        let report = self.report;
        let count = |wanted: fn(&CaseResult) -> bool| report.results.iter().filter(|result| wanted(result)).count();
        let is_skipped = |result: &CaseResult| matches!(result.verdict, Verdict::NotApplicable(_));
        let is_error = |result: &CaseResult| matches!(result.verdict, Verdict::NotJudged(_));
        let counts = format!(
            "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3}\"",
            report.results.len(),
            count(CaseResult::is_new_deviation),
            count(is_error),
            count(is_skipped),
            report.length.as_secs_f64()
        );
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        // Writing to a String cannot fail.
        let _ = writeln!(text, "<testsuites name=\"cangauge conform\" {counts}>");
        let _ = writeln!(text, "  <testsuite name=\"cangauge conform\" {counts}>");
        report.results.iter().for_each(|result| test_case(&mut text, report, result));
        text.push_str("  </testsuite>\n</testsuites>\n");
        text
    }
}

fn test_case(text: &mut String, report: &ConformReport, result: &CaseResult) {
    let (node, case, seconds) = (report.node.id, result.case, result.length.as_secs_f64());
    let name = escape(&format!("{} {}", case.id, case.sentence));
    let found = escape(&details(result).join("; "));
    let _ = write!(
        text,
        "    <testcase classname=\"cangauge.node-{node}.{}\" name=\"{name}\" time=\"{seconds:.3}\">",
        case.area
    );
    let _ = match (&result.verdict, &result.known) {
        (Verdict::Pass, _) => Ok(()),
        (Verdict::Measured(_), _) => write!(text, "<system-out>{found}</system-out>"),
        (Verdict::Deviates(_), Some(known)) => {
            write!(text, "<system-out>{found}; {}</system-out>", escape(&page(known)))
        }
        (Verdict::Deviates(_), None) => write!(text, "<failure type=\"deviates\" message=\"{found}\"/>"),
        (Verdict::NotJudged(_), _) => write!(text, "<error type=\"not-judged\" message=\"{found}\"/>"),
        (Verdict::NotApplicable(_), _) => write!(text, "<skipped message=\"{found}\"/>"),
    };
    text.push_str("</testcase>\n");
}

/// The findings, or why there is no verdict.
pub(super) fn details(result: &CaseResult) -> Vec<String> {
    match &result.verdict {
        Verdict::Pass => Vec::new(),
        Verdict::Measured(measured) => vec![figures(measured)],
        Verdict::Deviates(findings) => findings.iter().map(finding).collect(),
        Verdict::NotJudged(why) => vec![why_not(why)],
        Verdict::NotApplicable(why) => vec![why_not(why)],
    }
}

/// The figures of a case; none if it has another verdict.
pub(super) fn figures_of(result: &CaseResult) -> impl Iterator<Item = &Figure> {
    let Verdict::Measured(figures) = &result.verdict else { return [].iter() };
    figures.iter()
}

/// Times in seconds by name.
type Figures = BTreeMap<&'static str, f64>;

fn case(result: &CaseResult) -> Value {
    let case = result.case;
    json!({
        "case": case.id,
        "area": case.area.name(),
        "verdict": result.verdict.name(),
        "known": result.known,
        "severity": case.severity.name(),
        "sentence": case.sentence,
        "clause": case.clause,
        "details": details(result),
        "figures": figures_of(result).map(|figure| (figure.statistic.name(), figure.time.as_secs_f64())).collect::<Figures>(),
        "frames": frames(&result.transcript),
    })
}

/// The deviations with their meaning and their frames.
fn section<'a>(html: &mut String, title: &str, results: impl Iterator<Item = &'a CaseResult>) {
    let mut is_open = false;
    for result in results {
        if !std::mem::replace(&mut is_open, true) {
            let _ = writeln!(html, "<h2>{title}</h2>");
        }
        let case = result.case;
        let known = result.known.as_deref().map(|known| format!("<br>{}", safe(&page(known)))).unwrap_or_default();
        let _ = writeln!(
            html,
            "<h3>{}: {}</h3>\n<p>{} &middot; severity {}{known}<br>{}</p>\n<ul>{}</ul>\n<pre>{}{}</pre>",
            case.id,
            safe(case.sentence),
            safe(case.clause),
            case.severity.name(),
            safe(case.meaning),
            details(result).iter().map(|detail| format!("<li>{}</li>", safe(detail))).collect::<String>(),
            frames(&result.transcript).iter().map(|frame| safe(frame) + "\n").collect::<String>(),
            match result.transcript.omitted {
                0 => String::new(),
                omitted => format!("and {omitted} more frames\n"),
            }
        );
    }
}

/// The table of the measured times.
fn profile(html: &mut String, report: &ConformReport) {
    let measured = |result: &&CaseResult| matches!(result.verdict, Verdict::Measured(_));
    if !report.results.iter().any(|result| measured(&result)) {
        return;
    }
    html.push_str("<h2>Timing profile</h2>\n<table><tr><th>Case</th><th>What</th>");
    Statistic::ALL.iter().for_each(|one| *html += &format!("<th>{}</th>", statistic(*one)));
    html.push_str("</tr>\n");
    for result in report.results.iter().filter(measured) {
        let _ = write!(html, "<tr><td>{}</td><td>{}</td>", result.case.id, safe(result.case.sentence));
        for wanted in Statistic::ALL {
            let found = figures_of(result).find(|figure| figure.statistic == wanted);
            let _ = write!(html, "<td>{}</td>", found.map(|figure| figure_time(figure.time)).unwrap_or_default());
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</table>\n");
}

fn safe(text: &str) -> String {
    text::safe(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
