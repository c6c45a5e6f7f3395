//! The page of `cangauge info` as aligned text.

use super::table::{self, Align};
use crate::device::catalog::{self, TargetDevice};
use crate::measure::sample::Status;
use crate::tasks::settings::errors::Errors;
use crate::tasks::settings::info::{Channel, Date, Info, Meaning, Monitoring, Setting};
use std::io::{self, Write};

/// The width of the page in characters.
const WIDTH: usize = 100;

/// The largest number of signals that have a column each. With more signals, the settings are grouped by value.
const COLUMNS: usize = 3;

/// The rows below a heading.
type Rows = Vec<Vec<String>>;

fn section(out: &mut dyn Write, heading: &str, rows: &Rows) -> io::Result<()> {
    if rows.is_empty() {
        return Ok(());
    }
    writeln!(out, "\n{heading}")?;
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let mut lines = Vec::new();
    table::write(&mut lines, &vec![Align::Left; columns], rows)?;
    for line in String::from_utf8_lossy(&lines).lines() {
        writeln!(out, "  {line}")?;
    }
    Ok(())
}

fn row(label: &str, text: impl Into<String>) -> Vec<String> {
    vec![label.to_owned(), text.into()]
}

/// Writes the page as text.
pub fn text(out: &mut dyn Write, info: &Info) -> io::Result<()> {
    let described = info.node.model.as_ref().map(|model| &model.description);
    let title = described.map_or("unknown device", |description| description.title.as_str());
    writeln!(out, "node {}: {title}", info.node.id)?;
    section(out, "identity", &identity(info))?;
    let mut rows: Rows = Vec::new();
    rows.extend(info.bit_rate.map(|rate| row("bit rate", format!("{} kbit/s", f64::from(rate) / 1000.0))));
    rows.push(row("state", state(info)));
    rows.push(row("monitoring", monitoring(info.monitoring)));
    rows.extend(info.communication.iter().map(|setting| row(&setting.name, meaning(setting))));
    section(out, "communication", &rows)?;
    section(out, "errors", &info.errors.as_ref().map(errors).unwrap_or_default())?;
    section(out, "signals", &info.channels.iter().map(signal).collect())?;
    section(out, "signal settings", &settings(&info.channels))?;
    section(out, "TPDOs", &tpdos(info))?;
    let mut rows: Rows = Vec::new();
    rows.extend(info.calibrated.as_ref().map(|date| row("calibrated", self::date(date))));
    rows.extend(info.produced.as_ref().map(|date| row("produced", self::date(date))));
    rows.extend(info.own.iter().map(|setting| row(&full_name(setting), meaning(setting))));
    section(out, "manufacturer-specific", &rows)?;
    section(out, "stored by 1010h", &store(info))
}

/// The NMT state, or the command that finds it.
fn state(info: &Info) -> String {
    let unknown = || format!("unknown (no heartbeat): cangauge nmt state {} --probe", info.node.id);
    info.state.map_or_else(unknown, |state| format!("{state} (heartbeat)"))
}

/// A value with its unit and meaning.
pub(super) fn meaning(setting: &Setting) -> String {
    let value = &setting.value;
    let number = value.as_u64().unwrap_or(0);
    match &setting.meaning {
        Meaning::Quantity(quantity) => quantity.to_string(),
        Meaning::Unit(unit) => unit.to_string(),
        Meaning::Labelled(label) => format!("{value} {label}"),
        Meaning::CobId => format!("0x{number:X}"),
        Meaning::OperatingMode if number == 0 => "0 off".to_owned(),
        Meaning::OperatingMode if number == 1 => "1 normal operation".to_owned(),
        Meaning::Microseconds => format!("{number} us"),
        Meaning::HundredMicroseconds => format!("{}.{} ms", number / 10, number % 10),
        Meaning::Milliseconds if number == 0 => "off".to_owned(),
        Meaning::Milliseconds => format!("{number} ms"),
        Meaning::OperatingMode | Meaning::Plain => value.to_string(),
    }
}

/// `2016-04-01`; the numbers if they are not a date.
pub(super) fn date(Date { parts: [year, month, day] }: &Date) -> String {
    match (year.as_u64(), month.as_u64(), day.as_u64()) {
        (Some(year @ 1980..=2200), Some(month @ 1..=12), Some(day @ 1..=31)) => format!("{year}-{month:02}-{day:02}"),
        _ => format!("year {year}, month {month}, day {day}"),
    }
}

/// Describes how the loss of the device is detected.
pub(super) fn monitoring(Monitoring { heartbeat_ms, guarding_ms }: Monitoring) -> String {
    match (heartbeat_ms, guarding_ms) {
        (0, (_, 0)) => "none".to_owned(),
        (0, (guard, life)) => format!("node guarding every {guard} ms, life time {life} ms"),
        (heartbeat, (_, 0)) => format!("heartbeat every {heartbeat} ms"),
        (heartbeat, _) => format!("heartbeat every {heartbeat} ms and node guarding (CiA 301 allows only one of them)"),
    }
}

/// The source of the description: `built-in`, or its files.
pub(super) fn source(info: &Info) -> Option<String> {
    let model = info.node.model.as_ref()?;
    let place = |device: &TargetDevice| match catalog::text(&device.file) {
        Some(_) => "built-in".to_owned(),
        None => super::text::safe(&device.file),
    };
    let places: Vec<String> = model.made_for.iter().map(place).collect();
    (!places.is_empty()).then(|| places.join(", "))
}

fn identity(info: &Info) -> Rows {
    let identity = &info.node.identity;
    let described = info.node.model.as_ref().map(|model| &model.description);
    let mut rows: Rows = Vec::new();
    rows.extend(identity.name.as_ref().map(|name| row("name", super::text::safe(name))));
    let source = source(info).map(|source| format!(" ({source})")).unwrap_or_default();
    rows.extend(described.map(|description| row("description", format!("{}{source}", description.name))));
    rows.extend(
        identity.device_type.map(|number| row("device type", format!("0x{number:08X} profile {}", number & 0xffff))),
    );
    let vendor = described.map_or("", |description| description.vendor.as_str());
    rows.extend(identity.vendor.map(|number| row("vendor", format!("0x{number:08X} {vendor}").trim_end())));
    rows.extend(identity.product.map(|number| row("product", format!("0x{number:08X}"))));
    rows.extend(
        identity.revision.map(|number| row("revision", format!("0x{number:08X} {}.{}", number >> 16, number & 0xffff))),
    );
    rows.extend(identity.serial.map(|number| row("serial", number.to_string())));
    rows.extend(info.hardware.as_ref().map(|version| row("hardware", super::text::safe(version))));
    rows.extend(info.software.as_ref().map(|version| row("software", super::text::safe(version))));
    rows
}

/// Returns the rows for the error register, the error history and the error counters.
pub fn errors(errors: &Errors) -> Vec<Vec<String>> {
    let mut rows: Rows = Vec::new();
    rows.extend(errors.register.map(|bits| row("register", format!("0x{bits:02X} {}", errors.register_text))));
    rows.push(match errors.count {
        None => row("history", "not supported"),
        Some(0) => row("history", "empty"),
        Some(1) => row("history", "1 error"),
        Some(count) => row("history", format!("{count} errors, newest first")),
    });
    for error in &errors.history {
        let detail = if error.detail.is_empty() { String::new() } else { format!(" ({})", error.detail) };
        rows.push(row("", format!("0x{:04X} {}{detail}", error.code, error.text)));
    }
    for counter in &errors.counters {
        let count = counter.count.map_or_else(|| "-".to_owned(), |count| count.to_string());
        let text = if counter.text.is_empty() { String::new() } else { format!(" ({})", counter.text) };
        rows.push(row(&counter.name, format!("{count}{text}")));
    }
    rows
}

fn signal(channel: &Channel) -> Vec<String> {
    let unit = channel.signal.unit.map(|unit| unit.to_string()).unwrap_or_default();
    let sample = channel.sample.as_ref();
    let number = sample.and_then(|sample| sample.value);
    let value = number.map_or_else(|| "-".to_owned(), |number| format!("{number} {unit}").trim_end().to_owned());
    let status = sample.and_then(|sample| sample.status).map_or("(no status)", Status::as_str);
    let range = channel.range.map(|(start, end)| format!("range {} to {end}", start.number)).unwrap_or_default();
    vec![channel.signal.name.clone(), value, status.to_owned(), range]
}

/// The settings of all signals: one column for each signal, or grouped by value if there are many signals.
fn settings(channels: &[Channel]) -> Rows {
    let mut names: Vec<&str> = Vec::new();
    for setting in channels.iter().flat_map(|channel| &channel.settings) {
        if !names.contains(&setting.name.as_str()) {
            names.push(&setting.name);
        }
    }
    let setting =
        |channel: &Channel, name: &str| channel.settings.iter().find(|setting| setting.name == name).map(meaning);
    if channels.len() <= COLUMNS {
        let cells = |name: &&str| {
            let texts = channels.iter().map(|channel| setting(channel, name).unwrap_or_else(|| "-".to_owned()));
            std::iter::once((*name).to_owned()).chain(texts).collect()
        };
        let head = std::iter::once(String::new()).chain(channels.iter().map(|channel| channel.signal.name.clone()));
        let rows: Rows = names.iter().map(cells).collect();
        let head: Vec<String> = head.collect();
        return if channels.len() > 1 && !rows.is_empty() { std::iter::once(head).chain(rows).collect() } else { rows };
    }
    let grouped = |name: &&str| {
        let mut groups: Vec<(String, Vec<&str>)> = Vec::new();
        for channel in channels {
            let text = setting(channel, name).unwrap_or_else(|| "-".to_owned());
            match groups.iter_mut().find(|(known, _)| *known == text) {
                Some((_, members)) => members.push(&channel.signal.name),
                None => groups.push((text, vec![&channel.signal.name])),
            }
        }
        let text = match groups.as_slice() {
            [(text, _)] => text.clone(),
            several => {
                let each: Vec<String> =
                    several.iter().map(|(text, members)| format!("{text} ({})", members.join(" "))).collect();
                each.join(", ")
            }
        };
        row(name, text)
    };
    names.iter().map(grouped).collect()
}

fn tpdos(info: &Info) -> Rows {
    let mut rows: Rows = Vec::new();
    for (tpdo, inhibit) in info.node.tpdos.iter().zip(&info.inhibit_100us) {
        let id = tpdo.cob_id.can_id().number();
        let valid = if tpdo.cob_id.is_valid() { "" } else { " off" };
        let kind = tpdo.transmission.map(|kind| kind.to_string()).unwrap_or_default();
        let mut terms = match (kind.as_str(), tpdo.event_timer_ms) {
            ("timer", Some(0)) => vec!["timer off".to_owned()],
            ("timer", Some(timer)) => vec![format!("timer {timer} ms")],
            (_, Some(timer)) if timer > 0 => vec![kind, format!("timer {timer} ms")],
            _ => vec![kind],
        };
        let inhibit = inhibit.filter(|&inhibit| inhibit > 0);
        terms.extend(inhibit.map(|inhibit| format!("inhibit {}.{} ms", inhibit / 10, inhibit % 10)));
        let mapping = tpdo.mapping.iter().map(|entry| mapped(info, entry.object.to_string(), entry.bits));
        let mapping: Vec<String> = mapping.collect();
        let content = if mapping.is_empty() { "nothing mapped".to_owned() } else { mapping.join(", ") };
        rows.push(vec![tpdo.number.to_string(), format!("0x{id:X}{valid}"), terms.join(", "), content]);
    }
    rows
}

/// A mapped object, with the name of its signal.
fn mapped(info: &Info, object: String, bits: u8) -> String {
    name_of(info, &object).map_or_else(|| format!("{object}/{bits}"), |name| format!("{name} {object}/{bits}"))
}

/// Returns the name of the signal that has its value or status in an object, otherwise the name of the object.
pub(super) fn name_of(info: &Info, object: &str) -> Option<String> {
    let of_signal = info.node.signals.iter().find_map(|signal| {
        let mut values = info.node.tpdos.iter().flat_map(|tpdo| &tpdo.mapping).map(|entry| entry.object);
        let is_value = values.any(|entry| entry.to_string() == object && signal.is_value(entry));
        let is_status = signal.status.is_some_and(|status| status.to_string() == object);
        match (is_value, is_status) {
            (true, _) => Some(signal.name.clone()),
            (false, true) => Some(format!("{}.status", signal.name)),
            (false, false) => None,
        }
    });
    let of_object = || Some(info.node.layout().name_of(object.parse().ok()?)).filter(|name| name != object);
    of_signal.or_else(of_object)
}

fn store(info: &Info) -> Rows {
    let store = &info.store;
    let mut rows: Rows = Vec::new();
    for &(sub, capability) in &store.groups {
        let group = match sub {
            1 => "all",
            2 => "communication",
            3 => "application",
            _ => "manufacturer-specific",
        };
        let how = match capability & 0b11 {
            0b01 => "on command",
            0b10 => "automatically",
            0b11 => "on command and automatically",
            _ => "not stored",
        };
        rows.push(row(&format!("group {sub}"), format!("{group}: {how}")));
    }
    if store.kept.is_empty() && store.lost.is_empty() {
        if !rows.is_empty() {
            rows.push(row("stored", "unknown"));
        }
        return rows;
    }
    for (label, names) in [("stored", &store.kept), ("not stored", &store.lost)] {
        for (at, names) in wrapped(names).into_iter().enumerate() {
            rows.push(row(if at == 0 { label } else { "" }, names));
        }
    }
    rows
}

/// Joins names with commas, in lines that fit the page.
fn wrapped(names: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for name in names {
        match lines.last_mut() {
            Some(last) if last.len() + name.len() + 2 + 16 <= WIDTH => {
                last.push_str(", ");
                last.push_str(name);
            }
            _ => {
                if let Some(last) = lines.last_mut() {
                    last.push(',');
                }
                lines.push(name.clone());
            }
        }
    }
    lines
}

/// The name, with the sub-index if it is not 0.
fn full_name(setting: &Setting) -> String {
    if setting.object.sub == 0 { setting.name.clone() } else { format!("{}:{}", setting.name, setting.object.sub) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::value::Value;

    #[test]
    fn only_valid_dates_are_shown_as_dates() {
        let date = |parts: [u64; 3]| date(&Date { parts: parts.map(Value::Unsigned) });
        assert_eq!(date([2016, 4, 1]), "2016-04-01");
        assert_eq!(date([16, 4, 1]), "year 16, month 4, day 1");
    }
}
