//! TPDOs: how they are set up, and what they carry as it comes.

use super::json::{JsonNumber, line};
use super::{table, text};
use crate::bus::time::spoken;
use crate::measure::sample::{Sample, Status};
use crate::tasks::pdo::{Carried, Line, Shown};
use serde::Serialize;
use std::io::{self, Write};

/// The identifier as people type it: `0x181`.
fn identifier(shown: &Shown) -> String {
    format!("0x{}", shown.settings.cob_id.can_id())
}

fn unit(carried: &Carried) -> Option<String> {
    carried.unit.map(|unit| unit.to_string()).filter(|unit| !unit.is_empty())
}

/// One JSON object.
pub fn json(out: &mut dyn Write, shown: &Shown) -> io::Result<()> {
    #[derive(Serialize)]
    struct Pdo<'a> {
        node: u8,
        pdo: u16,
        cob_id: String,
        valid: bool,
        rtr: bool,
        transmission: String,
        event_timer_ms: Option<u16>,
        inhibit_us: Option<u32>,
        mapping: Vec<Entry<'a>>,
    }
    #[derive(Serialize)]
    struct Entry<'a> {
        object: String,
        bits: u8,
        signal: Option<&'a str>,
        unit: Option<String>,
    }
    fn entry(carried: &Carried) -> Entry<'_> {
        let Carried { entry, signal, .. } = carried;
        let object = entry.object.to_string();
        Entry { object, bits: entry.bits, signal: signal.as_deref(), unit: unit(carried) }
    }
    let settings = &shown.settings;
    let pdo = Pdo {
        node: shown.node.get(),
        pdo: settings.number.get(),
        cob_id: identifier(shown),
        valid: settings.cob_id.is_valid(),
        rtr: settings.cob_id.allows_rtr(),
        transmission: settings.transmission().to_string(),
        event_timer_ms: settings.event_timer_ms,
        inhibit_us: settings.inhibit_100us.map(|inhibit| 100 * u32::from(inhibit)),
        mapping: shown.carried.iter().map(entry).collect(),
    };
    line(out, &pdo)
}

/// Comma-separated, with a header.
pub fn csv(out: &mut dyn Write, all: &[Shown]) -> io::Result<()> {
    let head = ["node", "pdo", "cob_id", "valid", "rtr", "transmission", "event_timer_ms", "inhibit_us", "mapping"];
    let number = |number: Option<u32>| number.map(|number| number.to_string()).unwrap_or_default();
    let row = |shown: &Shown| {
        let settings = &shown.settings;
        let mapping = settings.mapping.iter().map(|entry| format!("{}/{}", entry.object, entry.bits));
        vec![
            shown.node.to_string(),
            settings.number.get().to_string(),
            identifier(shown),
            settings.cob_id.is_valid().to_string(),
            settings.cob_id.allows_rtr().to_string(),
            settings.transmission().to_string(),
            number(settings.event_timer_ms.map(u32::from)),
            number(settings.inhibit_100us.map(|inhibit| 100 * u32::from(inhibit))),
            mapping.collect::<Vec<_>>().join(" "),
        ]
    };
    super::csv::write(out, &head, all.iter().map(row))
}

/// A table for people.
pub fn text(out: &mut dyn Write, all: &[Shown]) -> io::Result<()> {
    use table::Align::{Left, Right};
    let head = ["PDO", "COB-ID", "SENT", "TIMER", "INHIBIT", "MAPPING"].map(str::to_owned).to_vec();
    let time = |time: Option<std::time::Duration>| match time {
        None => "-".to_owned(),
        Some(time) if time.is_zero() => "0".to_owned(),
        Some(time) => spoken(time),
    };
    let row = |shown: &Shown| {
        let settings = &shown.settings;
        let timer = settings.event_timer_ms.map(|timer| std::time::Duration::from_millis(timer.into()));
        let sent = settings.transmission().to_string();
        let mapping: Vec<String> = shown.carried.iter().map(entry_text).collect();
        vec![
            settings.number.get().to_string(),
            identifier(shown),
            if settings.cob_id.is_valid() { sent } else { format!("off ({sent})") },
            time(timer),
            time(shown.inhibit()),
            if mapping.is_empty() { "nothing".to_owned() } else { mapping.join(", ") },
        ]
    };
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(all.iter().map(row)).collect();
    table::write(out, &[Right, Left, Left, Right, Right, Left], &rows)
}

/// `0x6130:1/32 pressure [bar]`.
fn entry_text(carried: &Carried) -> String {
    let mut text = format!("{}/{}", carried.entry.object, carried.entry.bits);
    if let Some(signal) = &carried.signal {
        text += &format!(" {signal}");
    }
    if let Some(unit) = unit(carried) {
        text += &format!(" [{unit}]");
    }
    text
}

/// The header of [`watched_csv`].
///
/// # Errors
/// Those of `out`.
pub fn watched_head(out: &mut dyn Write) -> io::Result<()> {
    let head = ["time", "node", "pdo", "signal", "value", "unit", "status", "raw"];
    super::csv::write(out, &head, std::iter::empty())
}

/// One TPDO as it came, one JSON object; nothing for what is no TPDO.
pub fn watched_json(out: &mut dyn Write, seen: &Line<'_>) -> io::Result<()> {
    #[derive(Serialize)]
    struct Pdo<'a> {
        time: String,
        node: u8,
        pdo: u16,
        values: Vec<Value<'a>>,
    }
    #[derive(Serialize)]
    struct Value<'a> {
        signal: &'a str,
        value: JsonNumber,
        unit: Option<&'a str>,
        status: Option<&'static str>,
        raw: String,
    }
    let Line::Pdo { at, node, number, samples, sources } = seen else { return Ok(()) };
    let values = samples.iter().filter_map(|sample| {
        let source = sources.get(sample.source)?;
        Some(Value {
            signal: &source.signal,
            value: JsonNumber(sample.value),
            unit: Some(&*source.unit).filter(|unit| !unit.is_empty()),
            status: sample.status.map(Status::as_str),
            raw: sample.raw.to_string(),
        })
    });
    let time = text::utc(*at);
    line(out, &Pdo { time, node: node.get(), pdo: number.get(), values: values.collect() })
}

/// One TPDO as it came, one line a value.
pub fn watched_csv(out: &mut dyn Write, seen: &Line<'_>) -> io::Result<()> {
    let Line::Pdo { at, node, number, samples, sources } = seen else { return Ok(()) };
    let row = |sample: &Sample| {
        let source = sources.get(sample.source)?;
        Some(vec![
            text::utc(*at),
            node.to_string(),
            number.get().to_string(),
            source.signal.to_string(),
            sample.value.map(|value| value.to_string()).unwrap_or_default(),
            source.unit.to_string(),
            sample.status.map_or("", Status::as_str).to_owned(),
            sample.raw.to_string(),
        ])
    };
    super::csv::write(out, &[], samples.iter().filter_map(row))
}

/// One TPDO as it came, on one line for people.
pub fn watched_text(out: &mut dyn Write, seen: &Line<'_>) -> io::Result<()> {
    match seen {
        Line::Pdo { at, node, number, samples, sources } => {
            let value = |sample: &Sample| {
                let source = sources.get(sample.source)?;
                let value = sample.value.map_or_else(|| "-".to_owned(), |value| value.to_string());
                let status = sample.status.map_or("", Status::as_str);
                let words = [&*source.signal, &value, &*source.unit, status];
                Some(words.iter().filter(|word| !word.is_empty()).copied().collect::<Vec<_>>().join(" "))
            };
            let values: Vec<String> = samples.iter().filter_map(value).collect();
            writeln!(out, "{}  {node:>3}  {number}  {}", text::utc(*at), values.join("  "))
        }
        Line::WrongLength { at, node, number, length } => {
            let time = text::utc(*at);
            writeln!(out, "{time}  {node:>3}  {number}  {length} bytes, which is not the length of its mapping")
        }
        Line::Restarted(_) | Line::Nothing => Ok(()),
    }
}
