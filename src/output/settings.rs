//! The settings of a device.

use super::json::{JsonNumber, line};
use super::report::{Cell, Column, Report};
use super::table::{self, Align};
use crate::canopen::id::NodeId;
use crate::tasks::settings::Quantity;
use crate::tasks::settings::errors::{Errors, PastError};
use crate::tasks::settings::filter::FilterOf;
use crate::tasks::settings::limits::{Limit, Limits};
use crate::tasks::settings::minmax::{Extremes, MinMax};
use crate::tasks::settings::unit::{UnitChange, UnitOf, list};
use serde::Serialize;
use std::io::{self, Write};

fn number(quantity: Option<Quantity>) -> JsonNumber {
    JsonNumber(quantity.map(|quantity| quantity.number))
}

fn unit_name(quantity: Option<Quantity>) -> Option<String> {
    quantity?.unit.map(|unit| unit.to_string()).filter(|unit| !unit.is_empty())
}

impl Report for UnitOf {
    const COLUMNS: &'static [Column] = &[
        Column::new("node").right(),
        Column::new("signal"),
        Column::new("unit"),
        Column::new("code").data_only(),
        Column::new("takes").json_only(),
        Column::new("fixed").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let takes = Cell::list(self.takes.iter().copied());
        vec![
            self.node.into(),
            self.signal.as_str().into(),
            self.unit.into(),
            Cell::hex(self.unit.0, 8),
            takes,
            self.fixed.into(),
        ]
    }

    /// The unit of a single signal is printed alone.
    fn text(units: &[UnitOf], out: &mut dyn Write) -> io::Result<()> {
        if let [only] = units {
            return writeln!(out, "{}", only.unit);
        }
        let choice = |unit: &UnitOf| match (unit.fixed, unit.takes.as_slice()) {
            (true, _) => "(fixed)".to_owned(),
            (false, []) => String::new(),
            (false, takes) => format!("(takes {})", list(takes)),
        };
        let row = |unit: &UnitOf| vec![unit.signal.clone(), unit.unit.to_string(), choice(unit)];
        table::write(out, &[Align::Left; 3], &units.iter().map(row).collect::<Vec<_>>())
    }
}

impl Report for UnitChange {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("signal"),
        Column::new("before").json_only(),
        Column::new("after").json_only(),
        Column::new("unit_before").csv_only(),
        Column::new("unit_after").csv_only(),
        Column::new("code").json_only(),
        Column::nested(
            "rescaled",
            &[
                Column::new("object"),
                Column::new("name"),
                Column::new("before"),
                Column::new("after"),
                Column::new("stale"),
            ],
        ),
    ];

    fn cells(&self) -> Vec<Cell> {
        let rescaled = self.rescaled.iter().map(|item| {
            let [before, after] = [item.before, item.after].map(|quantity| quantity.map(|quantity| quantity.number));
            vec![item.object.into(), item.name.as_str().into(), before.into(), after.into(), item.stale.into()]
        });
        let (before, after) = (Cell::from(self.before), Cell::from(self.now.unit));
        vec![
            self.now.node.into(),
            self.now.signal.as_str().into(),
            before.clone(),
            after.clone(),
            before,
            after,
            Cell::hex(self.now.unit.0, 8),
            Cell::Rows(rescaled.collect()),
        ]
    }

    /// `pressure  psi -> bar`, and each rescaled value below it.
    fn text(changes: &[UnitChange], out: &mut dyn Write) -> io::Result<()> {
        let row = |name: &str, before: String, after: String| vec![name.to_owned(), before, "->".to_owned(), after];
        let mut rows = Vec::new();
        for change in changes {
            rows.push(row(&change.now.signal, change.before.to_string(), change.now.unit.to_string()));
            rows.extend(change.rescaled.iter().map(|item| row(&item.name, shown(item.before), shown(item.after))));
        }
        table::write(out, &[Align::Left; 4], &rows)
    }
}

/// A quantity with its unit; `-` if it is unknown.
fn shown(quantity: Option<Quantity>) -> String {
    quantity.map_or_else(|| "-".to_owned(), |quantity| quantity.to_string())
}

/// The filter of a signal; after a change with whether the damping showed.
pub fn filter(out: &mut dyn Write, node: NodeId, filter: &FilterOf, damping_shown: Option<bool>) -> io::Result<()> {
    #[derive(Serialize)]
    struct Filter<'a> {
        node: u8,
        signal: &'a str,
        code: Option<u64>,
        #[serde(rename = "type")]
        kind: &'a str,
        constant: Option<u64>,
        #[serde(skip_serializing_if = "Option::is_none")]
        damping_shown: Option<bool>,
    }
    let (signal, kind) = (filter.signal.as_str(), filter.kind.as_str());
    let (node, code, constant) = (node.get(), filter.code, filter.constant);
    line(out, &Filter { node, signal, code, kind, constant, damping_shown })
}

/// The limits of a signal; `null` for those that the device has not.
pub fn limits(out: &mut dyn Write, node: NodeId, limits: &Limits) -> io::Result<()> {
    #[derive(Serialize)]
    struct Json<'a> {
        node: u8,
        signal: &'a str,
        delta: JsonNumber,
        lower: JsonNumber,
        upper: JsonNumber,
        hysteresis: JsonNumber,
        unit: Option<String>,
        silent: &'a [String],
    }
    let of = |limit: Limit| limits.values.iter().find(|(other, ..)| *other == limit).map(|&(_, _, quantity)| quantity);
    line(
        out,
        &Json {
            node: node.get(),
            signal: &limits.signal,
            delta: number(of(Limit::Delta)),
            lower: number(of(Limit::Lower)),
            upper: number(of(Limit::Upper)),
            hysteresis: number(of(Limit::Hysteresis)),
            unit: unit_name(limits.values.first().map(|&(_, _, quantity)| quantity)),
            silent: &limits.silent,
        },
    )
}

impl Report for MinMax {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("signal"),
        Column::new("min"),
        Column::new("max"),
        Column::new("unit"),
        Column::new("before").json_only(),
        Column::new("before_min").csv_only(),
        Column::new("before_max").csv_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let number = |quantity: Option<Quantity>| Cell::from(quantity.map(|quantity| quantity.number));
        let ends = |extremes: &Extremes| [number(extremes.lowest), number(extremes.highest)];
        let [min, max] = ends(&self.now);
        let before = self.before.as_ref().map(ends);
        let object = before.clone().map_or(Cell::Null, |[min, max]| Cell::Object(vec![("min", min), ("max", max)]));
        let [before_min, before_max] = before.unwrap_or([Cell::Null, Cell::Null]);
        let unit = self.now.lowest.and_then(|quantity| quantity.unit);
        let signal = self.now.signal.as_str().into();
        vec![self.now.node.into(), signal, min, max, unit.into(), object, before_min, before_max]
    }

    /// After a reset the previous values: they are worth more than the new ones.
    fn text(all: &[MinMax], out: &mut dyn Write) -> io::Result<()> {
        let row = |report: &MinMax| {
            let extremes = report.before.as_ref().unwrap_or(&report.now);
            let [lowest, highest] = [extremes.lowest, extremes.highest].map(shown);
            vec![extremes.signal.clone(), format!("min {lowest}"), format!("max {highest}")]
        };
        table::write(out, &[Align::Left; 3], &all.iter().map(row).collect::<Vec<_>>())
    }
}

/// An entry of the error history.
#[derive(Serialize)]
pub(super) struct Past<'a> {
    code: String,
    text: &'a str,
    detail: Option<&'a str>,
    raw: String,
}

impl<'a> Past<'a> {
    pub(super) fn new(error: &'a PastError) -> Past<'a> {
        Past {
            code: format!("0x{:04X}", error.code),
            text: &error.text,
            detail: Some(error.detail.as_str()).filter(|detail| !detail.is_empty()),
            raw: format!("0x{:08X}", error.raw),
        }
    }
}

/// Register and history; after they were cleared with how many errors there were.
pub fn errors(out: &mut dyn Write, node: NodeId, errors: &Errors, cleared: Option<u64>) -> io::Result<()> {
    #[derive(Serialize)]
    struct Json<'a> {
        node: u8,
        register: Option<String>,
        register_text: Option<&'a str>,
        count: Option<u64>,
        history: Vec<Past<'a>>,
        #[serde(skip_serializing_if = "Option::is_none")]
        cleared: Option<u64>,
    }
    line(
        out,
        &Json {
            node: node.get(),
            register: errors.register.map(|bits| format!("0x{bits:02X}")),
            register_text: errors.register.map(|_| errors.register_text.as_str()),
            count: errors.count,
            history: errors.history.iter().map(Past::new).collect(),
            cleared,
        },
    )
}
