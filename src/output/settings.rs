//! The reports of settings of a device.

use super::info;
use super::notes;
use super::report::{Cell, Column, Report};
use super::table::{self, Align};
use crate::canopen::object::ObjectId;
use crate::tasks::settings::ValueWithUnit;
use crate::tasks::settings::errors::{ErrorCounter, ErrorReport, Errors, PastError};
use crate::tasks::settings::filter::{FilterReport, SignalFilter};
use crate::tasks::settings::limits::{Limit, Limits};
use crate::tasks::settings::minmax::{Extremes, MinMax};
use crate::tasks::settings::unit::{SignalUnit, UnitChange, list};
use std::io::{self, Write};

impl Report for SignalUnit {
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

    /// For a single signal, only the unit is printed.
    fn text(units: &[SignalUnit], out: &mut dyn Write) -> io::Result<()> {
        if let [only] = units {
            return writeln!(out, "{}", only.unit);
        }
        let choice = |unit: &SignalUnit| match (unit.fixed, unit.takes.as_slice()) {
            (true, _) => "(fixed)".to_owned(),
            (false, []) => String::new(),
            (false, takes) => format!("(accepts {})", list(takes)),
        };
        let row = |unit: &SignalUnit| vec![unit.signal.clone(), unit.unit.to_string(), choice(unit)];
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
        Column::new("notes").json_only(),
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
            notes::cell(&self.notes),
        ]
    }

    /// `pressure psi -> bar`, followed by each converted value.
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
fn shown(quantity: Option<ValueWithUnit>) -> String {
    quantity.map_or_else(|| "-".to_owned(), |quantity| quantity.to_string())
}

impl Report for FilterReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("signal"),
        Column::new("code"),
        Column::new("type"),
        Column::new("constant"),
        Column::new("damping_shown").json_only(),
        Column::new("notes").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let SignalFilter { node, signal, code, kind, constant } = &self.filter;
        let damping_shown = self.damping_shown.into();
        let notes = notes::cell(&self.notes);
        vec![(*node).into(), signal.into(), (*code).into(), kind.into(), (*constant).into(), damping_shown, notes]
    }

    /// `pressure  moving average (1)  constant 8`.
    fn text(filters: &[FilterReport], out: &mut dyn Write) -> io::Result<()> {
        let row = |FilterReport { filter, .. }: &FilterReport| {
            let kind = filter.code.map_or_else(|| "-".to_owned(), |code| format!("{} ({code})", filter.kind));
            let constant = filter.constant.map(|constant| format!("constant {constant}"));
            vec![filter.signal.clone(), kind, constant.unwrap_or_default()]
        };
        table::write(out, &[Align::Left; 3], &filters.iter().map(row).collect::<Vec<_>>())
    }
}

impl Report for Limits {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("signal"),
        Column::new("delta").json_only(),
        Column::new("lower").json_only(),
        Column::new("upper").json_only(),
        Column::new("hysteresis").json_only(),
        Column::new("unit").json_only(),
        Column::new("silent").json_only(),
        Column::nested("values", &[Column::new("limit"), Column::new("value"), Column::new("unit")]).csv_only(),
        Column::new("notes").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let all = Limit::ALL.map(|limit| {
            let value = self.values.iter().find(|(other, ..)| *other == limit);
            Cell::from(value.map(|(_, _, quantity)| quantity.number))
        });
        let unit = self.values.first().and_then(|(_, _, quantity)| quantity.unit);
        let row = |(limit, _, quantity): &(Limit, ObjectId, ValueWithUnit)| {
            vec![limit.as_str().into(), quantity.number.into(), quantity.unit.into()]
        };
        let mut cells = vec![self.node.into(), self.signal.as_str().into()];
        cells.extend(all);
        cells.extend([unit.into(), Cell::list(&self.silent), Cell::Rows(self.values.iter().map(row).collect())]);
        cells.push(notes::cell(&self.notes));
        cells
    }

    /// `delta  0.5 bar  (0x6133:1)`.
    fn text(all: &[Limits], out: &mut dyn Write) -> io::Result<()> {
        let is_single = all.len() == 1;
        let rows = all.iter().flat_map(|limits| {
            limits.values.iter().map(move |(limit, object, quantity)| {
                let name = (!is_single).then(|| limits.signal.clone());
                let cells = [limit.as_str().to_owned(), quantity.to_string(), format!("({object})")];
                name.into_iter().chain(cells).collect()
            })
        });
        let columns = if is_single { 3 } else { 4 };
        table::write(out, &[Align::Left; 4][..columns], &rows.collect::<Vec<Vec<String>>>())
    }
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
        let number = |quantity: Option<ValueWithUnit>| Cell::from(quantity.map(|quantity| quantity.number));
        let ends = |extremes: &Extremes| [number(extremes.lowest), number(extremes.highest)];
        let [min, max] = ends(&self.now);
        let before = self.before.as_ref().map(ends);
        let object = before.clone().map_or(Cell::Null, |[min, max]| Cell::Object(vec![("min", min), ("max", max)]));
        let [before_min, before_max] = before.unwrap_or([Cell::Null, Cell::Null]);
        let unit = self.now.lowest.and_then(|quantity| quantity.unit);
        let signal = self.now.signal.as_str().into();
        vec![self.now.node.into(), signal, min, max, unit.into(), object, before_min, before_max]
    }

    /// After a reset, the previous values are shown, because the new values have no meaning yet.
    fn text(all: &[MinMax], out: &mut dyn Write) -> io::Result<()> {
        let row = |report: &MinMax| {
            let extremes = report.before.as_ref().unwrap_or(&report.now);
            let [lowest, highest] = [extremes.lowest, extremes.highest].map(shown);
            vec![extremes.signal.clone(), format!("min {lowest}"), format!("max {highest}")]
        };
        table::write(out, &[Align::Left; 3], &all.iter().map(row).collect::<Vec<_>>())
    }
}

/// The columns of an entry of the error history.
const HISTORY: &[Column] = &[
    Column::new("number").csv_only(),
    Column::new("code"),
    Column::new("text"),
    Column::new("detail"),
    Column::new("raw"),
];

impl Report for ErrorReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("register").json_only(),
        Column::new("register_text").json_only(),
        Column::new("count").json_only(),
        Column::nested("history", HISTORY),
        Column::new("counters").json_only(),
        Column::new("cleared").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let errors = &self.errors;
        let row = |(error, number): (&PastError, u32)| {
            let (code, raw) = (Cell::hex(error.code, 4), Cell::hex(error.raw, 8));
            vec![number.into(), code, error.text.as_str().into(), error.detail.as_str().into(), raw]
        };
        let [register, register_text, count] = error_cells(errors);
        let history = Cell::Rows(errors.history.iter().zip(1..).map(row).collect());
        let counters = counters_cell(errors);
        vec![self.node.into(), register, register_text, count, history, counters, self.cleared.into()]
    }

    fn text(reports: &[ErrorReport], out: &mut dyn Write) -> io::Result<()> {
        let rows: Vec<Vec<String>> = reports.iter().flat_map(|report| info::errors(&report.errors)).collect();
        table::write(out, &[Align::Left; 2], &rows)
    }
}

/// Returns the error counters as a list, with one object for each counter.
pub(super) fn counters_cell(errors: &Errors) -> Cell {
    let cell = |counter: &ErrorCounter| {
        let (name, text) = (counter.name.as_str().into(), counter.text.as_str().into());
        let fields =
            [("object", counter.object.into()), ("name", name), ("count", counter.count.into()), ("text", text)];
        Cell::Object(fields.into())
    };
    Cell::List(errors.counters.iter().map(cell).collect())
}

/// Register, its meaning, and the number of errors in the history.
pub(super) fn error_cells(errors: &Errors) -> [Cell; 3] {
    let register = errors.register.map(|bits| Cell::hex(bits, 2));
    [register.into(), errors.register_text.as_str().into(), errors.count.into()]
}
