//! The summary of a recording, as text lines or as one JSON object.

use super::events::remark_text;
use super::report::{Cell, Column, Format, Report, render};
use super::table::{self, Align, align_decimals};
use super::text::{folded, grouped, significant};
use crate::bus::time::format_duration;
use crate::measure::histogram::Histogram;
use crate::measure::sample::{Number, Source};
use crate::measure::statistics::{Jitter, Statistics};
use crate::tasks::log::{RecordingReport, Remark, SyncStatistics};
use std::io::{self, Write};
use std::time::Duration;

/// The rows that were written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Rows in the layout `long` or `wide`.
    pub rows: u64,
    /// The number of these rows that were lost, because writing was too slow or failed.
    pub lost: u64,
    /// Events that were lost.
    pub events_lost: u64,
    /// Values that no row of layout `wide` contains.
    pub left_out: u64,
}

/// The summary of a recording.
#[derive(Clone, Copy, Debug)]
pub struct Summary<'a> {
    /// The recording.
    pub report: &'a RecordingReport,
    /// The rows that were written.
    pub written: Written,
    /// Whether the recording reached its planned end (`--count`, `--duration`). Without a planned end, always true.
    pub complete: bool,
}

impl Report for Summary<'_> {
    const COLUMNS: &'static [Column] = &[
        Column::new("complete"),
        Column::new("rows"),
        Column::new("rows_lost"),
        Column::new("events_lost"),
        Column::new("values_left_out"),
        Column::new("length_s"),
        Column::new("timestamps"),
        Column::new("dropped"),
        Column::new("gaps"),
        Column::new("emergencies"),
        Column::new("skipped_polls"),
        Column::new("syncs"),
        Column::new("syncs_left_out"),
        Column::new("sync_delay_s"),
        Column::new("restarts"),
        Column::new("node_losses"),
        Column::new("heartbeat_losses"),
        Column::new("changes"),
        Column::new("not_recorded"),
        Column::new("wrong_lengths"),
        Column::new("missing"),
        Column::new("link_losses"),
        Column::new("bus_offs"),
        Column::new("receive_buffer_bytes"),
        Column::new("lost_nodes"),
        Column::new("left_operational"),
        Column::new("remarks"),
        Column::nested(
            "signals",
            &[
                Column::new("node"),
                Column::new("signal"),
                Column::new("unit"),
                Column::new("count"),
                Column::new("invalid"),
                Column::new("rate"),
                Column::new("min"),
                Column::new("max"),
                Column::new("mean"),
                Column::new("sd"),
                Column::new("longest_interval_s"),
                Column::new("gaps"),
                Column::new("interval_s"),
                Column::new("jitter_s"),
            ],
        ),
    ];

    fn cells(&self) -> Vec<Cell> {
        let Summary { report, written, complete } = *self;
        let events = &report.events;
        vec![
            complete.into(),
            written.rows.into(),
            written.lost.into(),
            written.events_lost.into(),
            written.left_out.into(),
            seconds(report.length),
            report.timestamps.to_string().as_str().into(),
            report.dropped.into(),
            report.gaps.into(),
            report.emergencies.into(),
            report.skipped.into(),
            report.syncs.sent.into(),
            report.syncs.left_out.into(),
            spread(&report.syncs.delays),
            events.restarts.into(),
            events.silences.into(),
            events.heartbeat_losses.into(),
            events.changes.into(),
            events.not_recorded.into(),
            events.wrong_lengths.into(),
            events.missing.into(),
            events.link_losses.into(),
            events.bus_offs.into(),
            report.receive_buffer.map(|buffer| buffer.bytes as u64).into(),
            Cell::list(report.lost.iter().copied()),
            left_operational(report),
            Cell::list(report.remarks.iter().map(|remark| Cell::from(remark_text(remark).as_str()))),
            Cell::Rows(report.statistics.iter().map(|(source, statistics)| signal_cells(source, statistics)).collect()),
        ]
    }

    /// The lines at the end of a recording.
    fn text(summaries: &[Self], out: &mut dyn Write) -> io::Result<()> {
        summaries
            .iter()
            .flat_map(|summary| summary.lines(SummaryForm::default()))
            .try_for_each(|line| writeln!(out, "{line}"))
    }
}

fn signal_cells(source: &Source, statistics: &Statistics) -> Vec<Cell> {
    let jitter = statistics.jitter().map_or(Cell::Null, |jitter| {
        Cell::Object(vec![("p50", seconds(jitter.p50)), ("p99", seconds(jitter.p99)), ("max", seconds(jitter.max))])
    });
    vec![
        source.node.into(),
        (&*source.signal).into(),
        (&*source.unit).into(),
        statistics.count().into(),
        statistics.invalid().into(),
        real(statistics.rate()),
        real(statistics.min()),
        real(statistics.max()),
        real(statistics.mean()),
        real(statistics.deviation()),
        seconds(statistics.longest_interval()),
        statistics.gaps().into(),
        spread(statistics.intervals()),
        jitter,
    ]
}

/// A computed number in full precision.
fn real(number: Option<f64>) -> Cell {
    number.map_or(Cell::Null, |number| Cell::Number(Number::Real64(number)))
}

fn seconds(time: Duration) -> Cell {
    real(Some(time.as_secs_f64()))
}

/// The distribution of times, in seconds.
fn spread(times: &Histogram) -> Cell {
    let (Some(p50), Some(p99), Some(max)) = (times.quantile(0.5), times.quantile(0.99), times.longest()) else {
        return Cell::Null;
    };
    let min = times.shortest().unwrap_or_default();
    Cell::Object(vec![("min", seconds(min)), ("p50", seconds(p50)), ("p99", seconds(p99)), ("max", seconds(max))])
}

/// The nodes that were started and stay operational, because their previous state is unknown.
fn left_operational(report: &RecordingReport) -> Cell {
    let nodes = report.remarks.iter().filter_map(|remark| match remark {
        Remark::LeftOperational(nodes) => Some(nodes),
        _ => None,
    });
    Cell::list(nodes.flatten().copied())
}

/// The form of the summary on stderr.
#[derive(Clone, Copy, Debug, Default)]
pub struct SummaryForm {
    /// Whether the lines contain the figures that are otherwise only in the JSON summary.
    pub verbose: bool,
    /// The longest line in characters; `None` without a terminal.
    pub width: Option<usize>,
}

impl Summary<'_> {
    /// The summary as lines of text.
    pub fn lines(&self, form: SummaryForm) -> Vec<String> {
        let Summary { report, written, .. } = self;
        let mut before = vec![head(report, *written)];
        if report.events.not_recorded > 0 {
            let count = grouped(report.events.not_recorded);
            before.push(format!(
                "{count} TPDOs or polled values were ignored while the setup of their node was read again"
            ));
        }
        before.extend(syncs(&report.syncs).filter(|_| form.verbose));
        let mut after = Vec::new();
        if written.left_out > 0 {
            after.push(format!(
                "{} values are not in any row: late, or not the first in their cycle (--layout long contains all values)",
                grouped(written.left_out)
            ));
        }
        after.extend(report.remarks.iter().map(remark_text));
        let folded = |lines: Vec<String>| -> Vec<String> {
            lines.iter().flat_map(|line| folded(line, form.width.unwrap_or(usize::MAX))).collect()
        };
        let table = signal_table(&report.statistics, form);
        folded(before).into_iter().chain(table).chain(folded(after)).collect()
    }
}

/// A column of the table of signals.
struct SignalColumn {
    heading: &'static str,
    align: Align,
    /// Columns with the highest rank are omitted first on a narrow terminal.
    rank: u8,
    cells: Vec<String>,
}

impl SignalColumn {
    fn width(&self) -> usize {
        self.cells.iter().map(|cell| cell.chars().count()).max().unwrap_or(0).max(self.heading.len())
    }
}

/// The table of signals. Columns that do not fit are omitted; they are in the JSON summary.
fn signal_table(signals: &[(Source, Statistics)], form: SummaryForm) -> Vec<String> {
    use Align::{Left, Right};
    let column = |heading, align, rank, cell: &dyn Fn(&Source, &Statistics) -> String| {
        let cells = signals.iter().map(|(source, statistics)| cell(source, statistics)).collect();
        SignalColumn { heading, align, rank, cells }
    };
    let number = |heading, rank, digits, value: &dyn Fn(&Statistics) -> Option<f64>| {
        let mut column = column(heading, Left, rank, &|_, statistics| {
            value(statistics).map_or_else(|| "-".to_owned(), |value| significant(value, digits))
        });
        align_decimals(&mut column.cells);
        column
    };
    let time = |time: Option<Duration>| time.map_or_else(|| "-".to_owned(), format_duration);
    let jitter = |statistics: &Statistics, part: &dyn Fn(Jitter) -> Duration| time(statistics.jitter().map(part));
    let is_any = |count: &dyn Fn(&Statistics) -> u64| signals.iter().any(|(_, statistics)| count(statistics) > 0);
    let mut columns = vec![
        column("NODE", Right, 0, &|source, _| source.node.to_string()),
        column("SIGNAL", Left, 0, &|source, _| source.signal.to_string()),
        column("N", Right, 0, &|_, statistics| grouped(statistics.count())),
        number("MEAN", 0, 6, &Statistics::mean),
        number("SD", 3, 3, &Statistics::deviation),
        number("MIN", 1, 6, &Statistics::min),
        number("MAX", 1, 6, &Statistics::max),
        column("UNIT", Left, 0, &|source, _| source.unit.to_string()),
        column("RATE", Right, 2, &|_, statistics| {
            statistics.rate().map_or_else(|| "-".to_owned(), |rate| format!("{}/s", significant(rate, 4)))
        }),
        column("INTERVAL", Right, 4, &|_, statistics| time(statistics.intervals().quantile(0.5).map(rounded))),
    ];
    if is_any(&Statistics::gaps) {
        columns.push(column("GAPS", Right, 0, &|_, statistics| grouped(statistics.gaps())));
    }
    if is_any(&Statistics::invalid) {
        columns.push(column("INVALID", Right, 0, &|_, statistics| grouped(statistics.invalid())));
    }
    if form.verbose {
        columns.push(column("JITTER P99", Right, 5, &|_, statistics| jitter(statistics, &|jitter| jitter.p99)));
        columns.push(column("JITTER MAX", Right, 6, &|_, statistics| jitter(statistics, &|jitter| jitter.max)));
    }
    let length = |columns: &[SignalColumn]| columns.iter().map(|column| column.width() + 2).sum::<usize>();
    while length(&columns) > form.width.unwrap_or(usize::MAX).saturating_add(2)
        && let Some(highest_rank) = columns.iter().map(|column| column.rank).max().filter(|rank| *rank > 0)
    {
        columns.retain(|column| column.rank != highest_rank);
    }
    let head = columns.iter().map(|column| column.heading.to_owned()).collect();
    let rows = (0..signals.len()).map(|row| columns.iter().map(|column| column.cells[row].clone()).collect());
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let align: Vec<Align> = columns.iter().map(|column| column.align).collect();
    let mut out = Vec::new();
    // Writing to memory cannot fail.
    let _ = table::write(&mut out, &align, &rows);
    let width = form.width.unwrap_or(usize::MAX);
    String::from_utf8_lossy(&out).lines().map(|line| line.chars().take(width).collect()).collect()
}

/// Rounds a time to three digits, so that it is easy to read.
fn rounded(time: Duration) -> Duration {
    let digits = time.as_micros().checked_ilog10().unwrap_or(0);
    let unit = 10u64.pow(digits.saturating_sub(2)) * 1000;
    let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
    Duration::from_nanos((nanoseconds.saturating_add(unit / 2)) / unit * unit)
}

fn head(report: &RecordingReport, written: Written) -> String {
    let mut head = format!(
        "{} in {}, {} timestamps, {}, {}",
        counted(written.rows, "row", "rows"),
        format_duration(report.length),
        report.timestamps,
        counted(report.dropped, "frame dropped", "frames dropped"),
        counted(report.gaps, "gap", "gaps")
    );
    let events = &report.events;
    for (count, one, several) in [
        (report.emergencies, "emergency message", "emergency messages"),
        (events.restarts, "restart", "restarts"),
        (events.silences, "silent node", "silent nodes"),
        (events.heartbeat_losses, "heartbeat lost", "heartbeats lost"),
        (events.changes, "changed mapping or unit", "changed mappings or units"),
        (events.wrong_lengths, "TPDO of the wrong length", "TPDOs of the wrong length"),
        (events.missing, "value due after SYNC or request is missing", "values due after SYNC or request are missing"),
        (events.link_losses, "interface loss", "interface losses"),
        (events.bus_offs, "bus-off", "bus-offs"),
        (report.skipped, "poll skipped", "polls skipped"),
        (written.lost, "row lost", "rows lost"),
        (written.events_lost, "event lost", "events lost"),
    ] {
        if count > 0 {
            head.push_str(&format!(", {}", counted(count, one, several)));
        }
    }
    head
}

/// `1 row`, `1,200 rows`.
fn counted(count: u64, one: &str, several: &str) -> String {
    format!("{} {}", grouped(count), if count == 1 { one } else { several })
}

fn syncs(syncs: &SyncStatistics) -> Option<String> {
    let delays = &syncs.delays;
    let quantile = |share| delays.quantile(share).map(format_duration);
    let (p50, p99) = (quantile(0.5)?, quantile(0.99)?);
    let (min, max) = (format_duration(delays.shortest()?), format_duration(delays.longest()?));
    Some(format!("{} SYNC sent, delay min {min}  p50 {p50}  p99 {p99}  max {max}", grouped(syncs.sent)))
}

/// Writes the summary as one JSON object.
///
/// # Errors
/// `out` cannot be written.
pub fn write_json(summary: &Summary<'_>, out: &mut dyn Write) -> io::Result<()> {
    render(std::slice::from_ref(summary), Format::Json, out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::id::NodeId;

    fn signals() -> Vec<(Source, Statistics)> {
        let source = |node, signal: &str| {
            let node = NodeId::new(node).expect("a node-ID");
            Source { node, signal: signal.into(), unit: "bar".into() }
        };
        let mut statistics = Statistics::default();
        (0..5).for_each(|at| statistics.add(Some(1.5), Duration::from_millis(at * 100)));
        let mut higher = statistics.clone();
        higher.add(Some(1234.5), Duration::from_millis(502));
        higher.add(None, Duration::from_millis(600));
        higher.add_gap();
        vec![
            (source(1, "pressure"), statistics),
            (source(127, "ch1"), higher),
            (source(2, "ch2"), Statistics::default()),
        ]
    }

    fn table(verbose: bool, width: Option<usize>) -> Vec<String> {
        signal_table(&signals(), SummaryForm { verbose, width })
    }

    #[test]
    fn table_of_signals_has_aligned_decimals() {
        assert_eq!(
            table(false, None),
            [
                "NODE  SIGNAL    N  MEAN       SD   MIN      MAX         UNIT     RATE  INTERVAL  GAPS  INVALID",
                "   1  pressure  5    1.50000    0  1.50000     1.50000  bar   10.00/s    100 ms     0        0",
                " 127  ch1       7  207.000    503  1.50000  1234.50     bar   10.00/s    100 ms     1        1",
                "   2  ch2       0    -          -  -           -        bar         -         -     0        0",
            ]
        );
        assert!(table(true, None)[1].ends_with("  0 us        0 us"), "{:?}", table(true, None));
    }

    #[test]
    fn narrow_table_omits_columns() {
        for width in 20..120 {
            let lines = table(true, Some(width));
            assert!(lines.iter().all(|line| line.chars().count() <= width), "{lines:?}");
            assert!(lines[0].starts_with("NODE  SIGNAL    N ") && lines.len() == 4, "{lines:?}");
        }
        assert!(!table(false, Some(79))[0].contains("INTERVAL") && table(false, Some(79))[0].contains("RATE"));
    }
}
