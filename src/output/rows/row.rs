//! Typed rows, independent of the file format.

use crate::bus::Wall;
use crate::measure::sample::{Number, Sample, Source, Status};
use std::time::Duration;

/// One row of a recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<'a> {
    /// When its first value was received.
    pub(super) time: Wall,
    /// Time since the first row of the run.
    pub(super) elapsed: Duration,
    /// The measured signal.
    pub(super) values: Values<'a>,
}

/// The values of one row.
#[derive(Clone, Copy, Debug)]
pub(super) enum Values<'a> {
    /// Layout `long`: one value.
    One {
        /// The value.
        sample: &'a Sample,
        /// Its node, signal and unit.
        source: &'a Source,
    },
    /// Layout `wide`: the values of one cycle.
    Cycle {
        /// The signals of the cells, in their order.
        columns: &'a [Column],
        /// One cell per column; `None` if no value was received in this cycle.
        cells: &'a [Option<Cell>],
    },
}

impl<'a> Values<'a> {
    /// The columns of this row.
    pub(super) fn columns(&self) -> Columns<'a> {
        match *self {
            Values::One { .. } => Columns::Long,
            Values::Cycle { columns, .. } => Columns::Wide(columns),
        }
    }
}

/// Value and status of one signal in a row of layout `wide`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cell {
    /// The number; `None` if it is invalid.
    pub(super) value: Option<Number>,
    /// The status; `None` if the device reports none.
    pub(super) status: Option<Status>,
}

impl Cell {
    /// Value and status of a sample.
    pub(super) fn of(sample: &Sample) -> Cell {
        Cell { value: sample.value, status: sample.status }
    }
}

/// The columns of one signal in layout `wide`.
#[derive(Clone, Debug)]
pub(super) struct Column {
    /// The number of the source of the values.
    pub(super) number: usize,
    /// Node, signal and unit.
    pub(super) source: Source,
    /// `5.pressure [bar]`.
    pub(super) value_name: String,
    /// `5.pressure.status`.
    pub(super) status_name: String,
}

impl Column {
    /// The columns of the source with this number.
    pub(super) fn new(number: usize, source: &Source) -> Column {
        let name = format!("{}.{}", source.node, source.signal);
        // A status object that was requested as a signal contains bits, not a status word.
        let unit = if source.signal.ends_with(".status") { "code" } else { &*source.unit };
        let status_name = format!("{name}.status");
        let value_name = if unit.is_empty() { name } else { format!("{name} [{unit}]") };
        Column { number, source: source.clone(), value_name, status_name }
    }

    /// Whether the column is for the same signal of the same node, in any unit.
    pub(super) fn is_same_signal(&self, source: &Source) -> bool {
        (self.source.node, &self.source.signal) == (source.node, &source.signal)
    }
}

/// The columns of all rows until they change.
#[derive(Clone, Copy, Debug)]
pub(super) enum Columns<'a> {
    /// Layout `long`: always the same columns.
    Long,
    /// Layout `wide`: time and elapsed time, then two per signal.
    Wide(&'a [Column]),
}

/// The columns of layout `long`.
pub(in crate::output) const LONG_COLUMNS: [&str; 8] =
    ["time", "elapsed_s", "node", "signal", "value", "unit", "status", "raw"];

impl Columns<'_> {
    /// The names, in their order.
    pub(super) fn names(self) -> Vec<String> {
        match self {
            Columns::Long => LONG_COLUMNS.map(str::to_owned).to_vec(),
            Columns::Wide(columns) => {
                let first = LONG_COLUMNS[..2].iter().map(|&name| name.to_owned());
                let signals = columns.iter().flat_map(|column| [column.value_name.clone(), column.status_name.clone()]);
                first.chain(signals).collect()
            }
        }
    }
}
