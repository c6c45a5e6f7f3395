//! A draft description of a device as TOML, with comments about the missing parts.

use super::sdo::is_usually_hexadecimal;
use super::text::safe;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::measure::layout::{Scaling, Signal};
use crate::tasks::describe::{Draft, DraftObject};
use std::collections::BTreeSet;
use std::fmt::Write;

/// Converts a draft description to TOML.
pub fn toml(draft: &Draft) -> String {
    let node = &draft.node;
    let identity = &node.identity;
    let title = identity.name.clone().unwrap_or_else(|| "Unknown device".to_owned());
    let mut names = BTreeSet::new();
    let mut text = String::new();
    let mut line = |written: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{written}");
    };
    line("# A first description, read from the device. Lines with \"fill in\" need its manual.".to_owned());
    line("# The format: man cangauge-device. Check it with: cangauge devices check FILE".to_owned());
    line(format!(
        "name = {}  # fill in: a short name for --device",
        quoted(&unused_name(&title, "device", &mut names))
    ));
    line(format!("title = {}", quoted(&title)));
    line("vendor = \"unknown\"  # fill in".to_owned());
    line("# source = \"\"  # fill in: the manual, with its edition".to_owned());
    line("\n[identify]".to_owned());
    let mut identify = |key: &str, number: Option<u32>| {
        if let Some(number) = number {
            line(format!("{key} = 0x{number:X}"));
        }
    };
    identify("device_type", identity.device_type);
    identify("vendor_id", identity.vendor);
    identify("product_code", identity.product);
    if let Some(name) = &identity.name {
        line(format!("device_name = {}", quoted(name)));
    }
    line("\n# [factory]  # fill in\n# node_id = 1\n# bit_rate = 250000".to_owned());
    let mut names = BTreeSet::new();
    node.signals.iter().for_each(|signal| line(signal_entry(draft, signal, &mut names)));
    let mut names = BTreeSet::new();
    draft.objects.iter().for_each(|object| line(object_entry(draft, object, &mut names)));
    text
}

/// Makes a valid name that is not in `used`, and adds it to `used`.
fn unused_name(name: &str, fallback: &str, used: &mut BTreeSet<String>) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let words: String = name.chars().map(plain).collect();
    let words: Vec<&str> = words.split('-').filter(|word| !word.is_empty()).collect();
    let mut name = words.join("-");
    if name.is_empty() || ObjectId::looks_like_address(&name) {
        name = fallback.to_owned();
    }
    let base = name.clone();
    for number in 2.. {
        if used.insert(name.clone()) {
            break;
        }
        name = format!("{base}-{number}");
    }
    name
}

fn object_name(object: ObjectId) -> String {
    format!("object-{:04x}-{}", object.index, object.sub)
}

fn signal_entry(draft: &Draft, signal: &Signal, names: &mut BTreeSet<String>) -> String {
    let has = |object: &ObjectId| draft.objects.iter().any(|found| found.object == *object);
    let value = signal.value_object.0;
    let fallback = object_name(value);
    let name = if signal.name == value.to_string() { fallback.clone() } else { signal.name.clone() };
    let mut lines = vec![
        "\n[[signal]]".to_owned(),
        format!("name = {}  # fill in: pressure, temperature", quoted(&unused_name(&name, &fallback, names))),
    ];
    if signal.has_channel() {
        lines.push(format!("channel = {}", signal.channel));
    }
    lines.push(format!("value = \"{value}\""));
    let channel = |index: u16| Some(ObjectId::new(index, signal.channel)).filter(|_| signal.has_channel());
    let family = value.index & 0xf000;
    let objects = [
        ("unit", channel(0x6131)),
        ("digits", channel(0x6132)),
        ("status", signal.status),
        ("span_start", channel(family | 0x148)),
        ("span_end", channel(family | 0x149)),
    ];
    let objects = objects.into_iter().filter_map(|(key, object)| Some((key, object.filter(|object| has(object))?)));
    lines.extend(objects.map(|(key, object)| format!("{key} = \"{object}\"")));
    if let Scaling::Fixed(_) = signal.rules.scaling {
        lines.push("# unit and factor: those of the profile".to_owned());
    } else if !signal.has_channel() {
        let unit = signal.unit.map(|unit| unit.to_string()).unwrap_or_default();
        let note = "fill in: a fixed unit, or the object with its code";
        lines.push(format!("# unit = {}  # {note}", quoted(&unit)));
        lines.push("# factor = 1.0  # fill in: value = number * factor + offset".to_owned());
    }
    if signal.value_object.1.is_none() {
        return commented("the type of the value is unknown, see [[object]] below", &lines);
    }
    lines.join("\n")
}

fn object_entry(draft: &Draft, found: &DraftObject, names: &mut BTreeSet<String>) -> String {
    let object = found.object;
    let fallback = object_name(object);
    // Numbered objects share a name. Their `at` is a range of sub-indices, because only a range adds the number.
    let (at, name) = match &found.name {
        Some(name) if found.is_numbered && object.sub > 0 => {
            let plain = unused_name(name, &fallback, &mut BTreeSet::new());
            let key = format!("{plain}:{:04x}", object.index);
            let is_other = names.contains(&plain) && !names.contains(&key);
            names.extend([plain.clone(), key]);
            if is_other {
                (object.to_string(), unused_name(&fallback, &fallback, names))
            } else {
                (sub_index_range(object), plain)
            }
        }
        Some(name) => (object.to_string(), unused_name(name, &fallback, names)),
        None => (object.to_string(), unused_name(&fallback, &fallback, names)),
    };
    let data_type = found.data_type.map_or_else(|| "?".to_owned(), |data_type| data_type.to_string());
    let mut lines = vec![
        "\n[[object]]".to_owned(),
        format!("at = \"{at}\""),
        format!("name = {}", quoted(&name)),
        format!("type = \"{data_type}\""),
        format!("access = \"{}\"", found.access.as_str()),
    ];
    if found.pdo {
        lines.push("pdo = true".to_owned());
    }
    let is_value = draft.node.signals.iter().any(|signal| signal.is_value(object));
    let default = found.value.as_ref().filter(|_| !is_value).and_then(|value| literal(draft.node.id, object, value));
    match default {
        Some(default) if maps_unknown(draft, found) => {
            lines.push(format!("# default = {default}  # it maps an object whose type is unknown"));
        }
        Some(default) => lines.push(format!("default = {default}")),
        None => {}
    }
    match (found.data_type, &found.value) {
        (None, Some(Value::Bytes(bytes))) => {
            let note = format!("fill in the type of these {} bytes: {}", bytes.len(), super::text::spaced_bytes(bytes));
            commented(&note, &lines)
        }
        _ => lines.join("\n"),
    }
}

fn sub_index_range(object: ObjectId) -> String {
    format!("{object}-{}", object.sub)
}

/// Whether a mapping entry contains an object that is commented out.
fn maps_unknown(draft: &Draft, found: &DraftObject) -> bool {
    let Some(word) = found.value.as_ref().and_then(Value::as_u64).filter(|_| is_mapping(found.object)) else {
        return false;
    };
    let [bits, sub, low, high, ..] = word.to_le_bytes();
    let object = ObjectId::new(u16::from_le_bytes([low, high]), sub);
    let mapped = draft.objects.iter().find(|other| other.object == object);
    let data_type = mapped.and_then(|other| other.data_type);
    word != 0 && data_type.and_then(DataType::width).is_none_or(|width| 8 * width != usize::from(bits))
}

fn is_mapping(object: ObjectId) -> bool {
    (0x1a00..0x1c00).contains(&object.index) && object.sub > 0
}

/// Converts the lines to comments below a note that says what to fill in.
fn commented(note: &str, lines: &[String]) -> String {
    let lines = lines.iter().flat_map(|line| line.lines().filter(|line| !line.is_empty()));
    let lines: Vec<String> = lines.map(|line| format!("# {line}")).collect();
    format!("\n# {note}\n{}", lines.join("\n"))
}

/// Converts a value to TOML; `None` for bytes and times.
fn literal(node: NodeId, object: ObjectId, value: &Value) -> Option<String> {
    let is_cob_id = object.index == 0x1014 || (0x1800..0x1a00).contains(&object.index) && object.sub == 1;
    match value {
        Value::Unsigned(number) if is_cob_id && number & 0x7f == u64::from(node.get()) => {
            Some(format!("\"$NODEID+0x{:X}\"", number - u64::from(node.get())))
        }
        Value::Unsigned(number) if *number > i64::MAX as u64 => None,
        Value::Unsigned(number) if is_usually_hexadecimal(object) || object.index == 0x1000 => {
            Some(format!("0x{number:X}"))
        }
        Value::Unsigned(number) => Some(number.to_string()),
        Value::Integer(number) => Some(number.to_string()),
        Value::Real32(number) if number.is_finite() => Some(format!("{number:?}")),
        Value::Real64(number) if number.is_finite() => Some(format!("{number:?}")),
        Value::Text(text) => Some(quoted(text)),
        _ => None,
    }
}

/// Converts a text to a TOML string in quotation marks.
fn quoted(text: &str) -> String {
    let escaped = safe(text).replace('\\', "\\\\").replace('"', "\\\"");
    format!("\"{escaped}\"")
}
