//! The wide layout: one row per cycle of SYNC or polling, with two columns per signal.
//!
//! A value belongs to the cycle in which it was received, a polled one to that in which it was asked for.
//! Its row waits for it, until every column has come or another cycle, at most half a second, has passed.
//! What comes later, and what comes a second time in a cycle, has no place.

use crate::bus::{Mono, Stamp};
use crate::measure::sample::{Number, Sample, Source, Status};
use std::collections::VecDeque;
use std::time::Duration;

/// A row waits for its last values no longer than this after its cycle.
const LONGEST_WAIT: Duration = Duration::from_millis(500);

/// What stands in the two cells of a signal.
pub(super) type Cell = Option<(Option<Number>, Option<Status>)>;

/// One cycle.
#[derive(Debug)]
pub(super) struct Cycle {
    number: u64,
    begin: Stamp,
    /// When the first value came.
    first: Option<Stamp>,
    pub(super) cells: Vec<Cell>,
    filled: usize,
}

impl Cycle {
    fn is_full(&self) -> bool {
        self.filled == self.cells.len()
    }

    /// The time of the row: that of its first value. In a cycle to which nothing came while it lasted, and so
    /// that rows stand in order of time, it is the cycle's beginning.
    pub(super) fn at(&self, next: Option<Mono>) -> Stamp {
        self.first.filter(|first| next.is_none_or(|next| first.mono < next)).unwrap_or(self.begin)
    }
}

/// Puts values into rows.
#[derive(Debug, Default)]
pub(super) struct Wide {
    /// Which source stands in which column.
    columns: Vec<usize>,
    /// And the other way round.
    places: Vec<Option<usize>>,
    names: Vec<Source>,
    open: VecDeque<Cycle>,
    /// A row with a value was written; before it there are none.
    begun: bool,
    /// Values without a place.
    pub(super) left_out: u64,
}

impl Wide {
    /// One column pair for each of the sources.
    pub(super) fn set(&mut self, sources: &[Source]) {
        self.columns = (0..sources.len()).collect();
        self.index(sources);
    }

    fn index(&mut self, sources: &[Source]) {
        self.places = vec![None; sources.len()];
        for (place, &source) in self.columns.iter().enumerate() {
            self.places[source] = Some(place);
        }
        self.names = self.columns.iter().map(|&source| sources[source].clone()).collect();
    }

    /// The names of the columns, of value and status.
    pub(super) fn names(&self) -> impl Iterator<Item = [String; 2]> + '_ {
        self.names.iter().map(|source| {
            let name = format!("{}.{}", source.node, source.signal);
            let status = format!("{name}.status");
            // The bits of a status object that was asked for are not the status in words.
            let unit = if source.signal.ends_with(".status") { "code" } else { &*source.unit };
            [if unit.is_empty() { name } else { format!("{name} [{unit}]") }, status]
        })
    }

    /// A cycle begins.
    pub(super) fn begin(&mut self, number: u64, at: Stamp) {
        let cells = vec![None; self.columns.len()];
        self.open.push_back(Cycle { number, begin: at, first: None, cells, filled: 0 });
    }

    /// Whether the sample has a column.
    pub(super) fn knows(&self, sample: &Sample) -> bool {
        self.places.get(sample.source).is_some_and(Option::is_some)
    }

    /// Makes a column for the source of a sample: in the place of that of the same name, or behind those of the
    /// same node. The rows that are not written yet come along.
    pub(super) fn change(&mut self, sample: &Sample, sources: &[Source]) {
        let Some(new) = sources.get(sample.source) else { return };
        let same = |source: &Source| (source.node, &source.signal) == (new.node, &new.signal);
        if let Some(place) = self.names.iter().position(same) {
            self.columns[place] = sample.source;
            for cycle in &mut self.open {
                cycle.filled -= usize::from(cycle.cells[place].take().is_some());
            }
        } else {
            let behind = self.names.iter().rposition(|source| source.node == new.node);
            let place = behind.map_or(self.columns.len(), |last| last + 1);
            self.columns.insert(place, sample.source);
            self.open.iter_mut().for_each(|cycle| cycle.cells.insert(place, None));
        }
        self.index(sources);
    }

    /// Takes a sample, into the cycle of this number if it was polled.
    pub(super) fn put(&mut self, number: Option<u64>, sample: &Sample) {
        let place = self.places.get(sample.source).copied().flatten();
        let cycle = match number {
            Some(number) => self.open.iter_mut().find(|cycle| cycle.number == number),
            None => self.open.iter_mut().rev().find(|cycle| cycle.begin.mono <= sample.at.mono),
        };
        let (Some(place), Some(cycle)) = (place, cycle) else {
            self.left_out += 1;
            return;
        };
        if cycle.cells[place].is_some() {
            self.left_out += 1;
            return;
        }
        cycle.cells[place] = Some((sample.value, sample.status));
        cycle.filled += 1;
        cycle.first.get_or_insert(sample.at);
    }

    /// The next row that can be written now, with its time; all but the last cycle with `older`.
    pub(super) fn pop(&mut self, now: Mono, older: bool) -> Option<(Stamp, Cycle)> {
        loop {
            let next = self.open.get(1).map(|next| next.begin.mono);
            let front = self.open.front()?;
            let over =
                next.is_some_and(|next| older || now.since(next) >= next.since(front.begin.mono).min(LONGEST_WAIT));
            if !front.is_full() && !over {
                return None;
            }
            let cycle = self.open.pop_front()?;
            self.begun |= cycle.filled > 0;
            if self.begun {
                return Some((cycle.at(next), cycle));
            }
        }
    }

    /// The next row at the end; cycles behind the last value are none.
    pub(super) fn drain(&mut self) -> Option<(Stamp, Cycle)> {
        while self.open.iter().any(|cycle| cycle.filled > 0) {
            let next = self.open.get(1).map(|next| next.begin.mono);
            let cycle = self.open.pop_front()?;
            self.begun |= cycle.filled > 0;
            if self.begun {
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
    use crate::measure::sample::Raw;

    fn at(ms: u64) -> Stamp {
        let since = Duration::from_millis(ms);
        Stamp { mono: Mono::at(since), wall: Wall::at(since) }
    }

    fn source(node: u8, signal: &str, unit: &str) -> Source {
        Source { node: NodeId::new(node).expect("a node-ID"), signal: signal.into(), unit: unit.into() }
    }

    fn sample(ms: u64, source: usize, value: i128) -> Sample {
        let value = Some(Number::Decimal { mantissa: value, digits: 0 });
        Sample { at: at(ms), source, value, status: None, raw: Raw::new(&[]) }
    }

    /// `12: 1 -`: the time in milliseconds and the cells.
    fn text((time, cycle): (Stamp, Cycle)) -> String {
        let cell = |cell: &Cell| match cell {
            Some((Some(value), _)) => format!(" {value}"),
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
        wide.set(&[source(1, "pressure", "bar"), source(2, "pressure", "psi")]);
        wide
    }

    #[test]
    fn a_row_is_whole_with_its_last_value() {
        let mut wide = two();
        wide.begin(0, at(0));
        wide.put(None, &sample(2, 1, 7));
        assert_eq!(popped(&mut wide, 3), [""; 0]);
        wide.put(None, &sample(3, 0, 8));
        assert_eq!(popped(&mut wide, 3), ["2: 8 7"]);
        assert_eq!(drained(&mut wide), [""; 0]);
    }

    #[test]
    fn a_value_that_was_received_before_belongs_to_the_cycle_before() {
        let mut wide = two();
        wide.begin(0, at(0));
        wide.put(None, &sample(2, 0, 1));
        // The program was late: what it hears after the SYNC was received before it.
        wide.begin(1, at(10));
        wide.put(None, &sample(9, 1, 2));
        wide.put(None, &sample(12, 1, 4));
        wide.put(None, &sample(13, 1, 5));
        assert_eq!(popped(&mut wide, 13), ["2: 1 2"]);
        assert_eq!(wide.left_out, 1, "the second one in a cycle");
        assert_eq!(drained(&mut wide), ["12: - 4"]);
    }

    #[test]
    fn an_answer_belongs_to_the_cycle_of_its_request() {
        let mut wide = two();
        wide.begin(0, at(0));
        wide.put(Some(0), &sample(2, 0, 1));
        wide.begin(1, at(10));
        wide.put(Some(1), &sample(12, 0, 3));
        wide.put(Some(0), &sample(13, 1, 2));
        assert_eq!(popped(&mut wide, 13), ["2: 1 2"]);
        wide.begin(2, at(20));
        assert_eq!(popped(&mut wide, 29), [""; 0]);
        wide.begin(3, at(30));
        assert_eq!(popped(&mut wide, 30), ["12: 3 -"]);
        // Its row is written: it goes into none.
        wide.put(Some(1), &sample(31, 1, 9));
        assert_eq!(wide.left_out, 1);
        // Came in the next cycle: the row's time is the beginning of its own.
        wide.put(Some(2), &sample(33, 0, 5));
        wide.put(Some(3), &sample(34, 0, 6));
        assert_eq!(drained(&mut wide), ["20: 5 -", "34: 6 -"]);
    }

    #[test]
    fn empty_cycles_stand_between_values_only() {
        let mut wide = two();
        (0..3).for_each(|cycle| wide.begin(cycle, at(cycle * 10)));
        assert_eq!(popped(&mut wide, 20), [""; 0], "nothing came yet");
        wide.put(None, &sample(25, 0, 1));
        (3..6).for_each(|cycle| wide.begin(cycle, at(cycle * 10)));
        assert_eq!(popped(&mut wide, 50), ["25: 1 -", "30: - -"]);
        assert_eq!(drained(&mut wide), [""; 0]);
        let mut wide = two();
        (0..4).for_each(|cycle| wide.begin(cycle, at(cycle * 10)));
        wide.put(None, &sample(15, 0, 1));
        wide.put(None, &sample(35, 0, 2));
        assert_eq!(drained(&mut wide), ["15: 1 -", "20: - -", "35: 2 -"]);
    }

    #[test]
    fn a_long_cycle_is_written_half_a_second_after_it() {
        let mut wide = two();
        wide.begin(0, at(0));
        wide.put(None, &sample(1, 0, 1));
        wide.begin(1, at(10_000));
        assert_eq!(popped(&mut wide, 10_499), [""; 0]);
        assert_eq!(popped(&mut wide, 10_500), ["1: 1 -"]);
    }

    #[test]
    fn a_unit_that_changes_takes_the_place_and_a_new_signal_a_new_one() {
        let mut wide = two();
        wide.begin(0, at(0));
        wide.put(None, &sample(1, 0, 1));
        wide.put(None, &sample(2, 1, 2));
        let mut sources = vec![source(1, "pressure", "bar"), source(2, "pressure", "psi")];
        sources.extend([source(1, "pressure", "Pa"), source(1, "temperature", ""), source(1, "pressure.status", "")]);
        wide.begin(1, at(10));
        assert_eq!(std::iter::from_fn(|| wide.pop(at(11).mono, true)).map(text).collect::<Vec<_>>(), ["1: 1 2"]);
        wide.put(None, &sample(12, 1, 3));
        for new in 2..5 {
            assert!(!wide.knows(&sample(13, new, 0)));
            wide.change(&sample(13, new, 0), &sources);
            wide.put(None, &sample(13, new, new as i128));
        }
        let names: Vec<String> = wide.names().map(|[value, _]| value).collect();
        assert_eq!(names, ["1.pressure [Pa]", "1.temperature", "1.pressure.status [code]", "2.pressure [psi]"]);
        assert_eq!(popped(&mut wide, 13), ["12: 2 3 4 3"]);
        assert!(!wide.knows(&sample(14, 0, 0)), "and back again is a change, too");
    }
}
