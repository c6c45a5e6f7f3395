//! The report of `objects`: the facts about an object in a description or an EDS.

use super::report::{Cell, Column, Report};
use super::{table, text};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::device::description::ObjectEntry;
use crate::device::dictionary::Entry;
use crate::device::scalar::{NumberRange, Scalar};
use crate::output::sdo::is_usually_hexadecimal;
use std::io::{self, Write};

/// The facts about one object, without access to the device.
#[derive(Clone, Debug)]
pub struct ObjectFacts<'a> {
    /// The description or EDS.
    pub model: &'a Model,
    /// The object.
    pub entry: &'a Entry,
    /// Whether the user selected this object. The text then contains all facts, not one line.
    pub is_detailed: bool,
}

impl<'a> ObjectFacts<'a> {
    fn described(&self) -> Option<&'a ObjectEntry> {
        self.model.description.object(self.entry.object)
    }

    fn text_of<'t>(&self, text: fn(&'a ObjectEntry) -> &'t str) -> &'t str
    where
        'a: 't,
    {
        self.described().map_or("", text)
    }

    fn data_type(&self) -> Option<DataType> {
        Some(self.entry.data_type).filter(|_| !self.model.untyped.contains(&self.entry.object))
    }

    fn scalar(&self, scalar: &Option<Scalar>) -> Cell {
        let is_hexadecimal = is_usually_hexadecimal(self.entry.object) || self.entry.object.index == 0x1000;
        match scalar {
            None => Cell::Null,
            Some(Scalar::Integer(number)) => {
                let hex = u32::try_from(*number).ok().filter(|_| is_hexadecimal).map(|number| format!("0x{number:X}"));
                let cell = Cell::Integer(i128::from(*number));
                hex.map_or(cell.clone(), |hex| cell.shown_as(hex))
            }
            Some(other) => other.to_string().into(),
        }
    }

    fn range(&self) -> String {
        let shown = |scalar: &Option<Scalar>| self.scalar(scalar).shown();
        let allowed = self.allowed();
        match (&self.entry.low, &self.entry.high) {
            _ if !allowed.is_empty() => allowed.join(", "),
            (None, None) => String::new(),
            (low, None) => format!("from {}", shown(low)),
            (None, high) => format!("to {}", shown(high)),
            (low, high) => format!("{} to {}", shown(low), shown(high)),
        }
    }

    /// The values and ranges that the object accepts; empty if it accepts a single range.
    fn allowed(&self) -> Vec<String> {
        self.described().map(ranges).unwrap_or_default()
    }

    fn unit(&self) -> Cell {
        self.described().and_then(|described| described.unit.as_ref()).into()
    }

    /// The meanings of numbers: `0 off`.
    fn values(&self) -> Vec<String> {
        let is_hexadecimal = is_usually_hexadecimal(self.entry.object);
        let number = |number: u64| if is_hexadecimal { format!("0x{number:08X}") } else { number.to_string() };
        let values = self.described().into_iter().flat_map(|described| &described.values);
        values.map(|(value, meaning)| format!("{} {meaning}", number(*value))).collect()
    }

    /// Writes all facts, each on its own line.
    fn details(&self, out: &mut dyn Write) -> io::Result<()> {
        let entry = self.entry;
        let mut lines = Vec::new();
        let data_type = self.data_type().map_or_else(|| "type unknown".to_owned(), |data_type| data_type.to_string());
        let mapped = if entry.pdo { ", can be mapped" } else { "" };
        lines.push(format!("{data_type}, {}{mapped}", entry.access.as_str()));
        let unit = self.unit();
        let facts = [("range", Cell::from(self.range())), ("default", self.scalar(&entry.default)), ("unit", unit)];
        let facts: Vec<String> = facts
            .into_iter()
            .filter(|(_, cell)| *cell != Cell::Null)
            .map(|(name, cell)| format!("{name} {}", cell.shown()))
            .collect();
        lines.push(facts.join(", "));
        lines.push(self.text_of(|described| &described.text).to_owned());
        lines.extend(self.values());
        if let Some(signature) = self.described().and_then(|described| described.signature) {
            lines.push(format!("takes the signature \"{}\"", signature.as_str()));
        }
        lines.push(self.stored().map_or_else(String::new, |group| format!("stored by 1010h: {group}")));
        let prefixed = |name: &str, text: &str| if text.is_empty() { String::new() } else { format!("{name}: {text}") };
        lines.push(prefixed("manual", self.text_of(|described| &described.page)));
        lines.push(prefixed("doubt", self.text_of(|described| &described.doubt)));
        writeln!(out, "{}  {}", entry.object, text::safe(&entry.full_name()))?;
        let lines = lines.iter().filter(|line| !line.is_empty());
        lines.into_iter().try_for_each(|line| writeln!(out, "  {}", text::safe(line)))
    }

    fn stored(&self) -> Option<&'static str> {
        self.described()?.stored.map(|group| group.as_str())
    }

    /// Returns one line of the table for the consecutive objects from `first` to `last`.
    fn row(first: &ObjectFacts<'_>, last: ObjectId) -> Vec<String> {
        let entry = first.entry;
        let (object, name) = if entry.object == last {
            (entry.object.to_string(), entry.full_name())
        } else {
            (format!("{}-{}", entry.object, last.sub), format!("{}:{}-{}", entry.name, entry.object.sub, last.sub))
        };
        let data_type = first.data_type().map_or_else(|| "-".to_owned(), |data_type| data_type.to_string());
        let shown = [Cell::from(first.range()), first.scalar(&entry.default), first.unit()].map(|cell| cell.shown());
        let page = Cell::from(first.text_of(|described| &described.page)).shown();
        let pdo = if entry.pdo { "pdo" } else { "-" };
        let head = [object, name, data_type, entry.access.as_str().to_owned(), pdo.to_owned()];
        head.into_iter().chain(shown).chain([page]).collect()
    }

    /// Whether the description has one entry for both objects. They then share a line of the table.
    fn is_alike(&self, other: &ObjectFacts<'_>) -> bool {
        let run = |facts: &ObjectFacts<'_>| facts.described().map(|described| described.at);
        run(self).is_some_and(|at| at.is_run && run(other) == Some(at))
    }
}

const HEADING: [&str; 9] = ["OBJECT", "NAME", "TYPE", "ACCESS", "PDO", "RANGE", "DEFAULT", "UNIT", "MANUAL"];

/// The values and ranges that an object accepts; empty if it accepts a single range.
fn ranges(entry: &ObjectEntry) -> Vec<String> {
    let is_hexadecimal = is_usually_hexadecimal(entry.at.first);
    let number = |number: u32| if is_hexadecimal { format!("0x{number:08X}") } else { number.to_string() };
    let text = |range: &NumberRange| match range.low == range.high {
        true => number(range.low),
        false => format!("{}-{}", number(range.low), number(range.high)),
    };
    entry.allow.iter().map(text).collect()
}

/// The numbers that an object accepts: `0, 4-65535`, `from 100`.
pub(super) fn allowed(entry: &ObjectEntry) -> String {
    match (&entry.low, &entry.high) {
        _ if !entry.allow.is_empty() => ranges(entry).join(", "),
        (Some(low), Some(high)) => format!("{low} to {high}"),
        (Some(low), None) => format!("from {low}"),
        (None, Some(high)) => format!("up to {high}"),
        (None, None) => String::new(),
    }
}

impl Report for ObjectFacts<'_> {
    const COLUMNS: &'static [Column] = &[
        Column::new("device"),
        Column::new("object"),
        Column::new("name"),
        Column::new("type"),
        Column::new("access"),
        Column::new("pdo"),
        Column::new("low"),
        Column::new("high"),
        Column::new("allowed"),
        Column::new("default"),
        Column::new("unit"),
        Column::new("values"),
        Column::new("signature"),
        Column::new("stored"),
        Column::new("meaning"),
        Column::new("page"),
        Column::new("doubt"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let entry = self.entry;
        let signature = self.described().and_then(|described| described.signature);
        vec![
            self.model.description.name.as_str().into(),
            entry.object.into(),
            entry.full_name().into(),
            self.data_type().map(|data_type| data_type.to_string()).into(),
            entry.access.as_str().into(),
            entry.pdo.into(),
            self.scalar(&entry.low),
            self.scalar(&entry.high),
            Cell::list(self.allowed()),
            self.scalar(&entry.default),
            self.unit(),
            Cell::list(self.values()),
            signature.map(|signature| signature.as_str()).into(),
            self.stored().into(),
            self.text_of(|described| &described.text).into(),
            self.text_of(|described| &described.page).into(),
            self.text_of(|described| &described.doubt).into(),
        ]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        if reports.first().is_some_and(|report| report.is_detailed) {
            return reports.iter().try_for_each(|report| report.details(out));
        }
        let mut rows: Vec<Vec<String>> = vec![HEADING.map(str::to_owned).to_vec()];
        for run in reports.chunk_by(|one, next| one.is_alike(next)) {
            if let [first, .., last] | [first @ last] = run {
                rows.push(ObjectFacts::row(first, last.entry.object));
            }
        }
        table::write(out, &[table::Align::Left; HEADING.len()], &rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::catalog::by_name;
    use crate::output::report::{Format, render};

    fn shown(query: &str, is_detailed: bool, format: Format) -> String {
        let model = by_name("mh4").expect("built in");
        let facts: Vec<ObjectFacts<'_>> =
            model.search(query).into_iter().map(|entry| ObjectFacts { model: &model, entry, is_detailed }).collect();
        let mut out = Vec::new();
        render(&facts, format, &mut out).expect("memory");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn details_have_every_fact_of_the_description() {
        assert_eq!(
            shown("1800:2", true, Format::Text),
            "0x1800:2  tpdo1-transmission-type\n  u8, rw\n  range 0-240, 254, 255, default 1\n  n from 1 to 240: on every \
             n-th SYNC\n  0 on SYNC, when a mapped value has changed\n  1 on every SYNC\n  254 event timer, limits and \
             delta\n  255 limits and delta\n  stored by 1010h: comm\n  manual: 4.1.14, 3.4.3\n  doubt: 2.3 and 3.4.3 give \
             254 the event timer and, with 255, limits and delta; limits 0 to 255 printed, 241 to 253 not described\n"
        );
    }

    #[test]
    fn the_table_has_one_line_for_equal_sub_indices() {
        let table = shown("6150", false, Format::Text);
        assert_eq!(table.lines().count(), 3, "{table}");
        assert!(table.contains("0x6150:1-2  ai-status:1-2"), "{table}");
    }

    #[test]
    fn data_has_one_object_a_line() {
        let json = shown("6150:1", false, Format::Json);
        assert!(
            json.starts_with("{\"device\":\"mh4\",\"object\":\"0x6150:1\",\"name\":\"ai-status:1\",\"type\":\"u8\""),
            "{json}"
        );
        assert!(shown("1017", false, Format::Csv).contains("mh4,0x1017:0,producer-heartbeat-time,u16,rw,false,"));
    }
}
