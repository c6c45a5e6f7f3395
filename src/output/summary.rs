//! The summary at the end of a recording: lines for people, one JSON object for programs.

use super::text::{grouped, significant};
use crate::bus::time::spoken;
use crate::measure::sample::Source;
use crate::measure::statistics::Statistics;
use crate::tasks::log::Outcome;
use serde::Serialize;
use std::io::{self, Write};

/// What became of the rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Lines of either layout.
    pub rows: u64,
    /// Of which so many were lost: they came faster than they could be written.
    pub lost: u64,
    /// Events that were lost in the same way.
    pub events_lost: u64,
    /// Values that had no place in the wide layout.
    pub left_out: u64,
}

/// The summary in lines.
pub fn lines(outcome: &Outcome, written: Written) -> Vec<String> {
    let mut head = format!(
        "{} rows in {}, {} timestamps, {} frames dropped, {} gaps",
        grouped(written.rows),
        spoken(outcome.length),
        outcome.timestamps,
        grouped(outcome.dropped),
        grouped(outcome.gaps)
    );
    for (count, what) in [
        (outcome.emergencies, "emergency messages"),
        (outcome.skipped, "polls skipped"),
        (outcome.syncs, "SYNC sent"),
        (written.lost, "rows lost"),
        (written.events_lost, "events lost"),
    ] {
        if count > 0 {
            head.push_str(&format!(", {} {what}", grouped(count)));
        }
    }
    let mut lines = vec![head];
    for (source, statistics) in &outcome.statistics {
        lines.push(signal(source, statistics));
    }
    if written.left_out > 0 {
        lines.push(format!(
            "{} values have no place in the wide layout: late, or not the first in their cycle; --layout long has all",
            grouped(written.left_out)
        ));
    }
    lines.extend(outcome.remarks.iter().cloned());
    lines
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
    if statistics.invalid() > 0 {
        line.push_str(&format!("  {} invalid", grouped(statistics.invalid())));
    }
    line.trim_end().to_owned()
}

/// The summary as one JSON object.
pub fn json(out: &mut dyn Write, outcome: &Outcome, written: Written) -> io::Result<()> {
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
    }
    #[derive(Serialize)]
    struct Summary<'a> {
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
        lost_nodes: Vec<u8>,
        remarks: &'a [String],
        signals: Vec<Signal<'a>>,
    }
    let signals = outcome.statistics.iter().map(|(source, statistics)| Signal {
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
    });
    let summary = Summary {
        rows: written.rows,
        rows_lost: written.lost,
        events_lost: written.events_lost,
        values_left_out: written.left_out,
        length_s: outcome.length.as_secs_f64(),
        timestamps: outcome.timestamps.to_string(),
        dropped: outcome.dropped,
        gaps: outcome.gaps,
        emergencies: outcome.emergencies,
        skipped_polls: outcome.skipped,
        syncs: outcome.syncs,
        lost_nodes: outcome.lost.iter().map(|node| node.get()).collect(),
        remarks: &outcome.remarks,
        signals: signals.collect(),
    };
    serde_json::to_writer(&mut *out, &summary)?;
    out.write_all(b"\n")
}
