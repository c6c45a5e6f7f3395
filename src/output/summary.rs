//! The summary of a recording, as text lines or as one JSON object.

use super::events::remark_text;
use super::report::{Cell, Column, Format, Report, render};
use super::text::{grouped, significant};
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
    /// The lost rows among them, because writing was too slow or failed.
    pub lost: u64,
    /// Events that were lost.
    pub events_lost: u64,
    /// Values that are not in any row of layout `wide`.
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
        summaries.iter().flat_map(Summary::lines).try_for_each(|line| writeln!(out, "{line}"))
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

impl Summary<'_> {
    /// The summary as lines of text.
    pub fn lines(&self) -> Vec<String> {
        let Summary { report, written, .. } = self;
        let mut lines = vec![head(report, *written)];
        if report.events.not_recorded > 0 {
            let count = grouped(report.events.not_recorded);
            lines.push(format!(
                "{count} TPDOs or polled values were ignored while the setup of their node was read again"
            ));
        }
        lines.extend(syncs(&report.syncs));
        lines.extend(report.statistics.iter().map(|(source, statistics)| signal_line(source, statistics)));
        if written.left_out > 0 {
            lines.push(format!(
                "{} values are not in any row: late, or not the first in their cycle (--layout long contains all values)",
                grouped(written.left_out)
            ));
        }
        lines.extend(report.remarks.iter().map(remark_text));
        lines
    }
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

fn signal_line(source: &Source, statistics: &Statistics) -> String {
    let mut line = format!("node {} {}  n {}", source.node, source.signal, grouped(statistics.count()));
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| significant(value, 6));
    if statistics.mean().is_some() {
        let mean = number(statistics.mean());
        let deviation = statistics.deviation().map_or_else(|| "-".to_owned(), |value| significant(value, 3));
        let (min, max) = (number(statistics.min()), number(statistics.max()));
        line.push_str(&format!("  mean {mean}  sd {deviation}  min {min}  max {max} {}", source.unit));
    }
    if let Some(rate) = statistics.rate() {
        line = format!("{}  {}/s", line.trim_end(), significant(rate, 4));
    }
    if let Some(Jitter { median, p99, max, .. }) = statistics.jitter() {
        let (median, p99, max) = (format_duration(median), format_duration(p99), format_duration(max));
        line.push_str(&format!("  every {median}, jitter p99 {p99}  max {max}"));
    }
    if statistics.gaps() > 0 {
        line.push_str(&format!("  {}", counted(statistics.gaps(), "gap", "gaps")));
    }
    if statistics.invalid() > 0 {
        line.push_str(&format!("  {} invalid", grouped(statistics.invalid())));
    }
    line.trim_end().to_owned()
}

/// Writes the summary as one JSON object.
///
/// # Errors
/// Those of `out`.
pub fn write_json(summary: &Summary<'_>, out: &mut dyn Write) -> io::Result<()> {
    render(std::slice::from_ref(summary), Format::Json, out)
}
