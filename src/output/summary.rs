//! The summary of a recording: lines for people, one JSON object for programs.

use super::events::remark_text;
use super::text::{grouped, significant};
use crate::bus::time::spoken;
use crate::measure::histogram::Histogram;
use crate::measure::sample::Source;
use crate::measure::statistics::{Jitter, Statistics};
use crate::tasks::log::{RecordingReport, Remark, SyncStatistics};
use serde::Serialize;
use std::io::{self, Write};
use std::time::Duration;

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Rows of either layout.
    pub rows: u64,
    /// Rows among them that were lost: they came too fast, or could not be written.
    pub lost: u64,
    /// Events that were lost.
    pub events_lost: u64,
    /// Values that are in no row of layout `wide`.
    pub left_out: u64,
}

/// The summary as lines of text.
pub fn lines(report: &RecordingReport, written: Written) -> Vec<String> {
    let mut head = format!(
        "{} rows in {}, {} timestamps, {} frames dropped, {} gaps",
        grouped(written.rows),
        spoken(report.length),
        report.timestamps,
        grouped(report.dropped),
        grouped(report.gaps)
    );
    let events = &report.events;
    for (count, what) in [
        (report.emergencies, ["emergency message", "emergency messages"]),
        (events.restarts, ["restart", "restarts"]),
        (events.silences, ["silent node", "silent nodes"]),
        (events.heartbeat_losses, ["heartbeat lost", "heartbeats lost"]),
        (events.changes, ["changed mapping or unit", "changed mappings or units"]),
        (events.wrong_lengths, ["TPDO of the wrong length", "TPDOs of the wrong length"]),
        (events.link_losses, ["interface loss", "interface losses"]),
        (events.bus_offs, ["bus-off", "bus-offs"]),
        (report.skipped, ["poll skipped", "polls skipped"]),
        (written.lost, ["row lost", "rows lost"]),
        (written.events_lost, ["event lost", "events lost"]),
    ] {
        if count > 0 {
            let [one, several] = what;
            head.push_str(&format!(", {} {}", grouped(count), if count == 1 { one } else { several }));
        }
    }
    let mut lines = vec![head];
    if events.not_recorded > 0 {
        let count = grouped(events.not_recorded);
        lines.push(format!("{count} TPDOs or polled values made no row: the setup of their node had to be read again"));
    }
    lines.extend(syncs(&report.syncs));
    for (source, statistics) in &report.statistics {
        lines.push(signal(source, statistics));
    }
    if written.left_out > 0 {
        lines.push(format!(
            "{} values are in no row: late, or not the first in their cycle (--layout long contains all values)",
            grouped(written.left_out)
        ));
    }
    lines.extend(report.remarks.iter().map(remark_text));
    lines
}

fn syncs(syncs: &SyncStatistics) -> Option<String> {
    let delays = &syncs.delays;
    let quantile = |share| delays.quantile(share).map(spoken);
    let (p50, p99) = (quantile(0.5)?, quantile(0.99)?);
    let (min, max) = (spoken(delays.shortest()?), spoken(delays.longest()?));
    Some(format!("{} SYNC sent, delay min {min}  p50 {p50}  p99 {p99}  max {max}", grouped(syncs.sent)))
}

fn signal(source: &Source, statistics: &Statistics) -> String {
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
        let (median, p99, max) = (spoken(median), spoken(p99), spoken(max));
        line.push_str(&format!("  every {median}, jitter p99 {p99}  max {max}"));
    }
    if statistics.gaps() > 0 {
        line.push_str(&format!("  {} gaps", grouped(statistics.gaps())));
    }
    if statistics.invalid() > 0 {
        line.push_str(&format!("  {} invalid", grouped(statistics.invalid())));
    }
    line.trim_end().to_owned()
}

/// The distribution of times, in seconds.
#[derive(Serialize)]
struct Spread {
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<f64>,
    p50: f64,
    p99: f64,
    max: f64,
}

impl Spread {
    fn of(times: &Histogram) -> Option<Spread> {
        let seconds = |time: Duration| time.as_secs_f64();
        Some(Spread {
            min: times.shortest().map(seconds),
            p50: times.quantile(0.5).map(seconds)?,
            p99: times.quantile(0.99).map(seconds)?,
            max: times.longest().map(seconds)?,
        })
    }
}

/// Writes the summary as one JSON object. `complete` is false if the recording ended before --count or --duration.
///
/// # Errors
/// The output cannot be written.
pub fn json(out: &mut dyn Write, report: &RecordingReport, written: Written, complete: bool) -> io::Result<()> {
    #[derive(Serialize)]
    struct Signal<'a> {
        node: u8,
        signal: &'a str,
        unit: &'a str,
        count: u64,
        invalid: u64,
        rate: Option<f64>,
        min: Option<f64>,
        max: Option<f64>,
        mean: Option<f64>,
        sd: Option<f64>,
        longest_interval_s: f64,
        gaps: u64,
        interval_s: Option<Spread>,
        jitter_s: Option<Spread>,
    }
    #[derive(Serialize)]
    struct Summary<'a> {
        complete: bool,
        rows: u64,
        rows_lost: u64,
        events_lost: u64,
        values_left_out: u64,
        length_s: f64,
        timestamps: String,
        dropped: u64,
        gaps: u64,
        emergencies: u64,
        skipped_polls: u64,
        syncs: u64,
        syncs_left_out: u64,
        sync_delay_s: Option<Spread>,
        restarts: u64,
        node_losses: u64,
        heartbeat_losses: u64,
        changes: u64,
        not_recorded: u64,
        wrong_lengths: u64,
        link_losses: u64,
        bus_offs: u64,
        receive_buffer_bytes: Option<usize>,
        lost_nodes: Vec<u8>,
        left_operational: Vec<u8>,
        remarks: Vec<String>,
        signals: Vec<Signal<'a>>,
    }
    let signals = report.statistics.iter().map(|(source, statistics)| Signal {
        node: source.node.get(),
        signal: &source.signal,
        unit: &source.unit,
        count: statistics.count(),
        invalid: statistics.invalid(),
        rate: statistics.rate(),
        min: statistics.min(),
        max: statistics.max(),
        mean: statistics.mean(),
        sd: statistics.deviation(),
        longest_interval_s: statistics.longest_interval().as_secs_f64(),
        gaps: statistics.gaps(),
        interval_s: Spread::of(statistics.intervals()),
        jitter_s: statistics.jitter().map(|jitter| Spread {
            min: None,
            p50: jitter.p50.as_secs_f64(),
            p99: jitter.p99.as_secs_f64(),
            max: jitter.max.as_secs_f64(),
        }),
    });
    let events = &report.events;
    let summary = Summary {
        complete,
        rows: written.rows,
        rows_lost: written.lost,
        events_lost: written.events_lost,
        values_left_out: written.left_out,
        length_s: report.length.as_secs_f64(),
        timestamps: report.timestamps.to_string(),
        dropped: report.dropped,
        gaps: report.gaps,
        emergencies: report.emergencies,
        skipped_polls: report.skipped,
        syncs: report.syncs.sent,
        syncs_left_out: report.syncs.left_out,
        sync_delay_s: Spread::of(&report.syncs.delays),
        restarts: events.restarts,
        node_losses: events.silences,
        heartbeat_losses: events.heartbeat_losses,
        changes: events.changes,
        not_recorded: events.not_recorded,
        wrong_lengths: events.wrong_lengths,
        link_losses: events.link_losses,
        bus_offs: events.bus_offs,
        receive_buffer_bytes: report.receive_buffer.map(|buffer| buffer.bytes),
        lost_nodes: report.lost.iter().map(|node| node.get()).collect(),
        left_operational: left_operational(report),
        remarks: report.remarks.iter().map(remark_text).collect(),
        signals: signals.collect(),
    };
    super::json::line(out, &summary)
}

/// The nodes that were started and stay operational, because their previous state is unknown.
fn left_operational(report: &RecordingReport) -> Vec<u8> {
    let nodes = report.remarks.iter().filter_map(|remark| match remark {
        Remark::LeftOperational(nodes) => Some(nodes),
        _ => None,
    });
    nodes.flatten().map(|node| node.get()).collect()
}
