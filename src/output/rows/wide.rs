//! The wide layout: one row per cycle of SYNC or polling, with two columns per signal.
//!
//! A value belongs to the cycle in which it was received. A polled value belongs to the cycle in which it was
//! requested. A row is complete when every column has a value. An incomplete row waits for one more cycle, at most half
//! a second. Later values, and second values of a signal in one cycle, are omitted.

use super::row::{Cell, Column};
use crate::bus::{Mono, Stamp};
use crate::measure::sample::{Sample, Source};
use std::collections::VecDeque;
use std::time::Duration;

/// How long a row waits for missing values after its cycle.
const MAX_WAIT: Duration = Duration::from_millis(500);

/// One cycle.
#[derive(Debug)]
pub(super) struct Cycle {
    number: u64,
    start: Stamp,
    /// When the first value was received.
    first: Option<Stamp>,
    pub(super) cells: Vec<Option<Cell>>,
    filled: usize,
}

impl Cycle {
    fn is_full(&self) -> bool {
        self.filled == self.cells.len()
    }

    /// The time of the row: that of its first value. If no value was received before the next cycle, it is the start of
    /// the cycle. So rows are in order of time.
    fn at(&self, next: Option<Mono>) -> Stamp {
        self.first.filter(|first| next.is_none_or(|next| first.mono < next)).unwrap_or(self.start)
    }
}

/// Collects the values of each cycle.
#[derive(Debug, Default)]
pub(super) struct Wide {
    columns: Vec<Column>,
    /// The index of the column of each source.
    places: Vec<Option<usize>>,
    open: VecDeque<Cycle>,
    /// Whether any cycle had a value. Empty cycles before the first value are skipped.
    has_values: bool,
    /// Values that are not in any row.
    pub(super) left_out: u64,
}

impl Wide {
    /// One column for each of the sources.
    pub(super) fn set_sources(&mut self, sources: &[Source]) {
        self.columns = sources.iter().enumerate().map(|(number, source)| Column::new(number, source)).collect();
        self.index(sources.len());
    }

    fn index(&mut self, sources: usize) {
        self.places = vec![None; sources];
        for (place, column) in self.columns.iter().enumerate() {
            self.places[column.number] = Some(place);
        }
    }

    /// The columns of the next rows.
    pub(super) fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// A cycle starts.
    pub(super) fn start_cycle(&mut self, number: u64, at: Stamp) {
        let cells = vec![None; self.columns.len()];
        self.open.push_back(Cycle { number, start: at, first: None, cells, filled: 0 });
    }

    /// Whether the sample has a column.
    pub(super) fn has_column(&self, sample: &Sample) -> bool {
        self.places.get(sample.source).is_some_and(Option::is_some)
    }

    /// Adds a column for the source of a sample. The column replaces that of the same signal, or follows the last
    /// column of its node. Open cycles also get the column.
    pub(super) fn add_column(&mut self, sample: &Sample, sources: &[Source]) {
        let Some(new) = sources.get(sample.source) else { return };
        let column = Column::new(sample.source, new);
        if let Some(place) = self.columns.iter().position(|column| column.is_same_signal(new)) {
            self.columns[place] = column;
            for cycle in &mut self.open {
                cycle.filled -= usize::from(cycle.cells[place].take().is_some());
            }
        } else {
            let last = self.columns.iter().rposition(|column| column.source.node == new.node);
            let place = last.map_or(self.columns.len(), |last| last + 1);
            self.columns.insert(place, column);
            self.open.iter_mut().for_each(|cycle| cycle.cells.insert(place, None));
        }
        self.index(sources.len());
    }

    /// Adds a sample. A polled sample has the number of the cycle in which it was requested.
    pub(super) fn put(&mut self, number: Option<u64>, sample: &Sample) {
        let place = self.places.get(sample.source).copied().flatten();
        let cycle = match number {
            Some(number) => self.open.iter_mut().find(|cycle| cycle.number == number),
            None => self.open.iter_mut().rev().find(|cycle| cycle.start.mono <= sample.at.mono),
        };
        let (Some(place), Some(cycle)) = (place, cycle) else {
            self.left_out += 1;
            return;
        };
        if cycle.cells[place].is_some() {
            self.left_out += 1;
            return;
        }
        cycle.cells[place] = Some(Cell::of(sample));
        cycle.filled += 1;
        cycle.first.get_or_insert(sample.at);
    }

    /// The next row that can be written now, with its time. With `all_but_last`, only the row of the last cycle waits.
    pub(super) fn pop(&mut self, now: Mono, all_but_last: bool) -> Option<(Stamp, Cycle)> {
        loop {
            let next = self.open.get(1).map(|next| next.start.mono);
            let front = self.open.front()?;
            let is_over =
                next.is_some_and(|next| all_but_last || now.since(next) >= next.since(front.start.mono).min(MAX_WAIT));
            if !front.is_full() && !is_over {
                return None;
            }
            let cycle = self.open.pop_front()?;
            self.has_values |= cycle.filled > 0;
            if self.has_values {
                return Some((cycle.at(next), cycle));
            }
        }
    }

    /// The next row at the end of the recording. Empty cycles after the last value are skipped.
    pub(super) fn drain(&mut self) -> Option<(Stamp, Cycle)> {
        while self.open.iter().any(|cycle| cycle.filled > 0) {
            let next = self.open.get(1).map(|next| next.start.mono);
            let cycle = self.open.pop_front()?;
            self.has_values |= cycle.filled > 0;
            if self.has_values {
                return Some((cycle.at(next), cycle));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::Wall;
    use crate::canopen::id::NodeId;
    use crate::measure::sample::{Number, Raw};

    fn at(ms: u64) -> Stamp {
        let since = Duration::from_millis(ms);
        Stamp { mono: Mono::at(since), wall: Wall::at(since) }
    }

    fn source(node: u8, signal: &str, unit: &str) -> Source {
        Source { node: NodeId::new(node).expect("a node-ID"), signal: signal.into(), unit: unit.into() }
    }

    fn sample(ms: u64, source: usize, value: i128) -> Sample {
        let value = Some(Number::Decimal { mantissa: value, digits: 0 });
        Sample { at: at(ms), source, value, status: None, raw: Raw::new(&[]), doubt: None }
    }

    /// `12: 1 -`: the time in milliseconds and the cells.
    fn text((time, cycle): (Stamp, Cycle)) -> String {
        let cell = |cell: &Option<Cell>| match cell {
            Some(Cell { value: Some(value), .. }) => format!(" {value}"),
            _ => " -".to_owned(),
        };
        let cells: String = cycle.cells.iter().map(cell).collect();
        format!("{}:{cells}", time.mono.since_start().as_millis())
    }

    fn popped(wide: &mut Wide, now: u64) -> Vec<String> {
        std::iter::from_fn(|| wide.pop(at(now).mono, false)).map(text).collect()
    }

    fn drained(wide: &mut Wide) -> Vec<String> {
        std::iter::from_fn(|| wide.drain()).map(text).collect()
    }

    fn two() -> Wide {
        let mut wide = Wide::default();
        wide.set_sources(&[source(1, "pressure", "bar"), source(2, "pressure", "psi")]);
        wide
    }

    #[test]
    fn row_is_complete_with_its_last_value() {
        let mut wide = two();
        wide.start_cycle(0, at(0));
        wide.put(None, &sample(2, 1, 7));
        assert_eq!(popped(&mut wide, 3), [""; 0]);
        wide.put(None, &sample(3, 0, 8));
        assert_eq!(popped(&mut wide, 3), ["2: 8 7"]);
        assert_eq!(drained(&mut wide), [""; 0]);
    }

    #[test]
    fn value_belongs_to_the_cycle_of_its_receive_time() {
        let mut wide = two();
        wide.start_cycle(0, at(0));
        wide.put(None, &sample(2, 0, 1));
        // The program is late: it processes a frame after the start of the next cycle.
        wide.start_cycle(1, at(10));
        wide.put(None, &sample(9, 1, 2));
        wide.put(None, &sample(12, 1, 4));
        wide.put(None, &sample(13, 1, 5));
        assert_eq!(popped(&mut wide, 13), ["2: 1 2"]);
        assert_eq!(wide.left_out, 1, "the second one in a cycle");
        assert_eq!(drained(&mut wide), ["12: - 4"]);
    }

    #[test]
    fn polled_value_belongs_to_the_cycle_of_its_request() {
        let mut wide = two();
        wide.start_cycle(0, at(0));
        wide.put(Some(0), &sample(2, 0, 1));
        wide.start_cycle(1, at(10));
        wide.put(Some(1), &sample(12, 0, 3));
        wide.put(Some(0), &sample(13, 1, 2));
        assert_eq!(popped(&mut wide, 13), ["2: 1 2"]);
        wide.start_cycle(2, at(20));
        assert_eq!(popped(&mut wide, 29), [""; 0]);
        wide.start_cycle(3, at(30));
        assert_eq!(popped(&mut wide, 30), ["12: 3 -"]);
        // The row of this cycle is already written.
        wide.put(Some(1), &sample(31, 1, 9));
        assert_eq!(wide.left_out, 1);
        // Received in the next cycle, so the time of the row is the start of the cycle of the row.
        wide.put(Some(2), &sample(33, 0, 5));
        wide.put(Some(3), &sample(34, 0, 6));
        assert_eq!(drained(&mut wide), ["20: 5 -", "34: 6 -"]);
    }

    #[test]
    fn empty_cycles_make_rows_only_between_values() {
        let mut wide = two();
        (0..3).for_each(|cycle| wide.start_cycle(cycle, at(cycle * 10)));
        assert_eq!(popped(&mut wide, 20), [""; 0], "no value yet");
        wide.put(None, &sample(25, 0, 1));
        (3..6).for_each(|cycle| wide.start_cycle(cycle, at(cycle * 10)));
        assert_eq!(popped(&mut wide, 50), ["25: 1 -", "30: - -"]);
        assert_eq!(drained(&mut wide), [""; 0]);
        let mut wide = two();
        (0..4).for_each(|cycle| wide.start_cycle(cycle, at(cycle * 10)));
        wide.put(None, &sample(15, 0, 1));
        wide.put(None, &sample(35, 0, 2));
        assert_eq!(drained(&mut wide), ["15: 1 -", "20: - -", "35: 2 -"]);
    }

    #[test]
    fn row_of_a_long_cycle_waits_half_a_second() {
        let mut wide = two();
        wide.start_cycle(0, at(0));
        wide.put(None, &sample(1, 0, 1));
        wide.start_cycle(1, at(10_000));
        assert_eq!(popped(&mut wide, 10_499), [""; 0]);
        assert_eq!(popped(&mut wide, 10_500), ["1: 1 -"]);
    }

    #[test]
    fn changed_unit_replaces_its_column_and_new_signal_adds_one() {
        let mut wide = two();
        wide.start_cycle(0, at(0));
        wide.put(None, &sample(1, 0, 1));
        wide.put(None, &sample(2, 1, 2));
        let mut sources = vec![source(1, "pressure", "bar"), source(2, "pressure", "psi")];
        sources.extend([source(1, "pressure", "Pa"), source(1, "temperature", ""), source(1, "pressure.status", "")]);
        wide.start_cycle(1, at(10));
        assert_eq!(std::iter::from_fn(|| wide.pop(at(11).mono, true)).map(text).collect::<Vec<_>>(), ["1: 1 2"]);
        wide.put(None, &sample(12, 1, 3));
        for new in 2..5 {
            assert!(!wide.has_column(&sample(13, new, 0)));
            wide.add_column(&sample(13, new, 0), &sources);
            wide.put(None, &sample(13, new, new as i128));
        }
        let names: Vec<String> = wide.columns().iter().map(|column| column.value_name.clone()).collect();
        assert_eq!(names, ["1.pressure [Pa]", "1.temperature", "1.pressure.status [code]", "2.pressure [psi]"]);
        assert_eq!(popped(&mut wide, 13), ["12: 2 3 4 3"]);
        assert!(!wide.has_column(&sample(14, 0, 0)), "the old unit is a change as well");
    }
}
