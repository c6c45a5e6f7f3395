//! The record of `config apply` for quality documents, as JSON or as one page to print.

use super::text;
use crate::bus::Wall;
use crate::tasks::config::{ApplyReport, Row, Snapshot};
use serde_json::{Map, Value, json};

/// The record of one run.
#[derive(Clone, Debug)]
pub struct ConfigRecord<'a> {
    /// When the run ended.
    pub time: Wall,
    /// The bus.
    pub bus: String,
    /// The file with the settings.
    pub file: String,
    /// The configured devices.
    pub done: Vec<&'a ApplyReport>,
    /// The messages about failed devices.
    pub failed: Vec<String>,
}

impl ConfigRecord<'_> {
    fn time(&self) -> String {
        humantime::format_rfc3339_seconds(self.time.system_time()).to_string()
    }

    /// Returns the record as a JSON object.
    pub fn json(&self) -> String {
        let devices: Vec<Value> = self.done.iter().map(|applied| device(applied)).collect();
        let record = json!({
            "time": self.time(),
            "tool": "cangauge",
            "version": env!("CARGO_PKG_VERSION"),
            "bus": self.bus,
            "file": self.file,
            "complete": self.failed.is_empty(),
            "devices": devices,
            "failed": self.failed,
        });
        format!("{record:#}\n")
    }

    /// Returns the record as an HTML page.
    pub fn html(&self) -> String {
        let mut page = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Settings</title>\n<style>body{{font:11pt \
             sans-serif;margin:2em}}table{{border-collapse:collapse;margin:1em 0}}td,th{{border:1px solid #999;padding:2px \
             8px;text-align:left}}h2{{page-break-after:avoid}}</style></head><body>\n<h1>Settings of {}</h1>\n\
             <p>{} &middot; cangauge {} &middot; bus {} &middot; file {}</p>\n",
            if self.done.len() == 1 { "1 device".to_owned() } else { format!("{} devices", self.done.len()) },
            self.time(),
            env!("CARGO_PKG_VERSION"),
            escape(&self.bus),
            escape(&self.file)
        );
        for failed in &self.failed {
            page.push_str(&format!("<p><strong>Failed:</strong> {}</p>\n", escape(failed)));
        }
        for applied in &self.done {
            page.push_str(&section(applied));
        }
        page.push_str("</body></html>\n");
        page
    }
}

fn verification(applied: &ApplyReport) -> &'static str {
    match (applied.stored, applied.is_reset) {
        (true, true) => "stored, and every setting read again after a reset",
        (true, false) => "every setting read back; the device acknowledged the store",
        (false, _) => "every setting read back; not stored",
    }
}

fn settings(snapshot: &Snapshot) -> Value {
    let row = |row: Row| (row.key, Value::String(row.value.to_string()));
    Value::Object(snapshot.dump(false).rows.into_iter().map(row).collect::<Map<_, _>>())
}

fn device(applied: &ApplyReport) -> Value {
    let (identity, kind) = (&applied.after.node.identity, applied.after.kind());
    let dates: Map<String, Value> = kind.dates.iter().map(|(what, date)| ((*what).to_owned(), json!(date))).collect();
    let text = |item: &Option<crate::device::config_file::Item>| item.as_ref().map(ToString::to_string);
    let change = |row: &crate::tasks::config::ChangedRow| json!({"setting": row.key, "before": text(&row.before), "after": text(&row.after)});
    json!({
        "node": applied.after.node.id.get(),
        "device": kind.title,
        "vendor": identity.vendor,
        "product": identity.product,
        "revision": identity.revision,
        "serial": identity.serial,
        "dates": dates,
        "verified": verification(applied),
        "stored": applied.stored,
        "changes": applied.rows.iter().map(change).collect::<Vec<_>>(),
        "before": settings(&applied.before),
        "after": settings(&applied.after),
    })
}

fn section(applied: &ApplyReport) -> String {
    let (identity, kind) = (&applied.after.node.identity, applied.after.kind());
    let number = |number: Option<u32>| number.map_or_else(|| "unknown".to_owned(), |number| number.to_string());
    let mut html = format!(
        "<h2>Node {}: {}, serial number {}</h2>\n<p>vendor {}, product {}, revision {}",
        applied.after.node.id,
        escape(kind.title.as_deref().unwrap_or("unknown device")),
        number(identity.serial),
        number(identity.vendor),
        number(identity.product),
        number(identity.revision)
    );
    for (what, date) in &kind.dates {
        html.push_str(&format!(", {what} {}", escape(date)));
    }
    html.push_str(&format!(
        "<br>{}</p>\n<table><tr><th>Setting</th><th>Before</th><th>Now</th></tr>\n",
        verification(applied)
    ));
    let before = applied.before.dump(false).rows;
    for row in applied.after.dump(false).rows {
        let old = before.iter().find(|old| old.key == row.key).map_or_else(String::new, |old| old.value.to_string());
        let (now, is_changed) = (row.value.to_string(), old != row.value.to_string());
        let now = if is_changed { format!("<strong>{}</strong>", escape(&now)) } else { escape(&now) };
        html.push_str(&format!("<tr><td>{}</td><td>{}</td><td>{now}</td></tr>\n", escape(&row.key), escape(&old)));
    }
    html.push_str("</table>\n");
    html
}

fn escape(text: &str) -> String {
    text::safe(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
