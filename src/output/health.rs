//! The report of `health`.

use super::report::{Cell, Column, Report};
use super::{table, text};
use crate::bus::time::format_duration;
use crate::canopen::id::NodeId;
use crate::tasks::health::Figure;
use std::collections::BTreeSet;
use std::io::{self, Write};
use std::time::Duration;

/// The columns of the table of nodes.
const HEADINGS: [&str; 9] = ["NODE", "STATE", "FRAMES", "RATE", "LOAD", "HEARTBEAT", "SDO ANSWER", "EMCY", "RESTARTS"];

impl Report for Figure {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("figure"),
        Column::new("value"),
        Column::new("unit"),
        Column::new("limit"),
        Column::new("verdict"),
        Column::new("detail"),
    ];

    fn cells(&self) -> Vec<Cell> {
        // Counts and bit rates are whole numbers.
        let decimals = if matches!(self.unit, "" | "bit/s") { 0 } else { 6 };
        let number = |value: f64| match format!("{value:.0}").parse() {
            Ok(whole) if decimals == 0 => Cell::Integer(whole),
            _ => Cell::Real(value, decimals),
        };
        let word = |is_ok: bool| if is_ok { "ok" } else { "warning" };
        vec![
            self.node.into(),
            self.name.as_str().into(),
            self.value.map_or(Cell::Null, number),
            self.unit.into(),
            self.verdict.filter(|_| self.value.is_some()).map_or(Cell::Null, |verdict| number(verdict.limit)),
            self.verdict.map(|verdict| word(verdict.is_ok)).into(),
            self.detail.as_ref().into(),
        ]
    }

    /// Writes the bus in a few lines, the nodes as a table, and then a warning for each figure above its limit.
    fn text(figures: &[Figure], out: &mut dyn Write) -> io::Result<()> {
        let texts = FigureTexts(figures);
        texts.bus(out)?;
        let nodes: BTreeSet<NodeId> = figures.iter().filter_map(|figure| figure.node).collect();
        if !nodes.is_empty() {
            let mut rows = vec![HEADINGS.map(str::to_owned).to_vec()];
            rows.extend(nodes.iter().map(|&node| texts.row(node)));
            let (left, right) = (table::Align::Left, table::Align::Right);
            table::write(out, &[right, left, right, right, right, left, left, right, right], &rows)?;
        }
        figures.iter().filter_map(warning).try_for_each(|line| writeln!(out, "{}", text::safe(&line)))
    }
}

/// Returns the line for a figure above its limit; `None` for other figures.
fn warning(figure: &Figure) -> Option<String> {
    let verdict = figure.verdict.filter(|verdict| !verdict.is_ok)?;
    let subject = figure.node.map_or_else(|| "bus".to_owned(), |node| format!("node {node}"));
    let detail = figure.detail.as_ref().map(|detail| format!(": {detail}")).unwrap_or_default();
    let value = figure
        .value
        .map(|value| format!(" {} (limit {})", amount(value, figure.unit), amount(verdict.limit, figure.unit)));
    Some(format!("warning: {subject}: {}{}{detail}", figure.name, value.unwrap_or_default()))
}

/// `12.3 %`, `1.002 s`, `5`.
fn amount(value: f64, unit: &str) -> String {
    match unit {
        "" => format!("{value:.0}"),
        "%" => format!("{value:.1} %"),
        "s" => format_duration(rounded(Duration::from_secs_f64(value.max(0.0)))),
        "1/s" => format!("{value:.1}/s"),
        _ => format!("{value:.0} {unit}"),
    }
}

/// Rounds a time to about four digits.
fn rounded(time: Duration) -> Duration {
    let step = if time >= Duration::from_secs(1) { 1000 } else { 10 };
    let microseconds = u64::try_from(time.as_micros()).unwrap_or(u64::MAX - step);
    Duration::from_micros((microseconds + step / 2) / step * step)
}

/// Finds figures by node and name, and formats them.
struct FigureTexts<'a>(&'a [Figure]);

impl FigureTexts<'_> {
    fn figure(&self, node: Option<NodeId>, name: &str) -> Option<&Figure> {
        self.0.iter().find(|figure| figure.node == node && figure.name == name)
    }

    fn amount(&self, node: Option<NodeId>, name: &str) -> Option<String> {
        let figure = self.figure(node, name)?;
        figure.value.map(|value| amount(value, figure.unit))
    }

    fn or_dash(&self, node: Option<NodeId>, name: &str) -> String {
        self.amount(node, name).unwrap_or_else(|| "-".to_owned())
    }

    fn detail(&self, node: Option<NodeId>, name: &str) -> Option<String> {
        self.figure(node, name)?.detail.clone()
    }

    fn bus(&self, out: &mut dyn Write) -> io::Result<()> {
        let text_of = |name: &str| self.or_dash(None, name);
        writeln!(out, "frames      {} in {}, {}", text_of("bus.frames"), text_of("bus.duration"), text_of("bus.rate"))?;
        let kinds = self.0.iter().filter_map(|figure| {
            let kind = figure.name.strip_prefix("bus.frames.").filter(|_| figure.node.is_none())?;
            Some(format!("{kind} {}", amount(figure.value?, "")))
        });
        writeln!(out, "kinds       {}", kinds.collect::<Vec<_>>().join(", "))?;
        match self.amount(None, "bus.load") {
            None => writeln!(out, "load        unknown: the bit rate is unknown (--bitrate)")?,
            Some(load) => {
                let (now, peak, rate) = (text_of("bus.load.now"), text_of("bus.load.peak"), text_of("bus.bitrate"));
                writeln!(out, "load        mean {load}, now {now}, peak {peak} at {rate}")?;
                let (frames, burst) = (text_of("bus.burst.frames"), text_of("bus.burst"));
                writeln!(out, "burst       {frames} frames in {burst}")?;
            }
        }
        let errors = self.detail(None, "bus.errors").unwrap_or_else(|| "none".to_owned());
        writeln!(out, "errors      {errors}")?;
        if let Some(state) = self.detail(None, "bus.state") {
            let (tx, rx) = (text_of("bus.tx-errors"), text_of("bus.rx-errors"));
            writeln!(out, "controller  {state}, transmit errors {tx}, receive errors {rx}")?;
        }
        Ok(())
    }

    fn row(&self, node: NodeId) -> Vec<String> {
        let text_of = |name: &str| self.or_dash(Some(node), name);
        let heartbeat = match self.amount(Some(node), "node.heartbeat.max") {
            None => "-".to_owned(),
            Some(max) => {
                let wanted = self.amount(Some(node), "node.heartbeat.time").map(|time| format!(" (1017h: {time})"));
                let (min, mean) = (text_of("node.heartbeat.min"), text_of("node.heartbeat.mean"));
                format!("{min} / {mean} / {max}{}", wanted.unwrap_or_default())
            }
        };
        let answer = match self.amount(Some(node), "node.sdo.max") {
            None => "-".to_owned(),
            Some(max) => {
                let (min, mean, p99) = (text_of("node.sdo.min"), text_of("node.sdo.mean"), text_of("node.sdo.p99"));
                format!("{min} / {mean} / {p99} / {max} ({})", text_of("node.sdo.count"))
            }
        };
        let state = self.detail(Some(node), "node.state").unwrap_or_else(|| "-".to_owned());
        let (frames, rate, load) = (text_of("node.frames"), text_of("node.rate"), text_of("node.load"));
        vec![
            node.to_string(),
            state,
            frames,
            rate,
            load,
            heartbeat,
            answer,
            text_of("node.emcy"),
            text_of("node.restarts"),
        ]
    }
}
