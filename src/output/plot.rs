//! Plots of recordings: as SVG, as PNG, and in a terminal.
//!
//! Signals with the same unit share a panel and its value axis. All panels share the time axis.

mod axis;
mod marks;
mod path;
mod png;
mod scene;
mod svg;
mod terminal;

use super::recording::{Curve, EventMark, Point, Recording};
pub use axis::TimeAxis;
pub use png::png;
use std::collections::BTreeMap;
pub use svg::svg;
pub use terminal::terminal;

/// A plot, independent of its size on paper or in a terminal.
#[derive(Debug)]
pub struct Plot {
    title: String,
    axis: TimeAxis,
    /// The first and the last time in microseconds.
    span: (i64, i64),
    panels: Vec<Panel>,
    events: Vec<EventMark>,
}

/// The curves of one unit.
#[derive(Debug)]
struct Panel {
    heading: String,
    curves: Vec<Labelled>,
    /// The lowest and the highest value of the axis.
    range: (f64, f64),
}

/// A curve and its name in the panel.
#[derive(Debug)]
struct Labelled {
    label: String,
    points: Vec<Point>,
}

impl Plot {
    /// Plots a recording from the first to the second time of `span` (default: from the first to the last value).
    /// `None` if there is no value in this time.
    pub fn new(recording: Recording, title: String, axis: TimeAxis, span: [Option<i64>; 2]) -> Option<Plot> {
        let (from, to) = (span[0].unwrap_or(i64::MIN), span[1].unwrap_or(i64::MAX));
        let mut units: BTreeMap<usize, Vec<Curve>> = BTreeMap::new();
        let mut names: Vec<String> = Vec::new();
        for mut curve in recording.curves {
            curve.points.retain(|point| (from..=to).contains(&point.at));
            if curve.points.is_empty() {
                continue;
            }
            // Values without a unit share a panel only if they belong to the same signal.
            let has_unit = !curve.unit.is_empty() && curve.unit != "code";
            let name = if has_unit { curve.unit.clone() } else { format!(" {}", curve.signal) };
            let place = names.iter().position(|known| *known == name).unwrap_or(names.len());
            if place == names.len() {
                names.push(name);
            }
            units.entry(place).or_default().push(curve);
        }
        let times = || units.values().flatten().flat_map(|curve| [curve.points.first(), curve.points.last()]).flatten();
        let first = span[0].or(times().map(|point| point.at).min())?;
        let last = span[1].or(times().map(|point| point.at).max())?;
        let events = recording.events.into_iter().filter(|event| (first..=last).contains(&event.at)).collect();
        // For a single value, the time axis is one second long.
        let span = if first < last { (first, last) } else { (first - 500_000, last + 500_000) };
        let panels: Vec<Panel> = units.into_values().map(Panel::new).collect();
        (!panels.is_empty()).then_some(Plot { title, axis, span, panels, events })
    }

    /// The number of events of each kind: `2 emcy, 1 gap`.
    fn event_counts(&self) -> String {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        self.events.iter().for_each(|event| *counts.entry(&event.event).or_default() += 1);
        let texts: Vec<String> = counts.iter().map(|(event, count)| format!("{count} {event}")).collect();
        texts.join(", ")
    }

    /// The position of a time on the time axis, from 0 to 1.
    fn place(&self, at: i64) -> f64 {
        (at - self.span.0) as f64 / (self.span.1 - self.span.0) as f64
    }
}

impl Panel {
    fn new(curves: Vec<Curve>) -> Panel {
        let is_same =
            |property: &dyn Fn(&Curve) -> String| curves.iter().all(|curve| property(curve) == property(&curves[0]));
        let unit = match curves[0].unit.as_str() {
            "" | "code" => String::new(),
            unit => format!(" [{unit}]"),
        };
        let (one_node, one_signal) = (is_same(&|curve| curve.node.to_string()), is_same(&|curve| curve.signal.clone()));
        let has_runs = !is_same(&|curve| curve.run.to_string());
        let heading = match (one_node, one_signal) {
            (true, true) => format!("node {} {}", curves[0].node, curves[0].signal),
            (true, false) => format!("node {}", curves[0].node),
            (false, true) => curves[0].signal.clone(),
            (false, false) => String::new(),
        };
        let label = |curve: &Curve| {
            let name = match (one_node, one_signal) {
                (_, true) => format!("node {}", curve.node),
                (true, false) => curve.signal.clone(),
                (false, false) => format!("{}.{}", curve.node, curve.signal),
            };
            if has_runs { format!("{name}, run {}", curve.run) } else { name }
        };
        let curves: Vec<Labelled> =
            curves.iter().map(|curve| Labelled { label: label(curve), points: curve.points.clone() }).collect();
        let values = curves.iter().flat_map(|curve| &curve.points).map(|point| point.value).filter(|v| v.is_finite());
        let range = values.fold(None, |range: Option<(f64, f64)>, value| {
            Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
        });
        let heading = (heading + &unit).trim_start().to_owned();
        Panel { heading, curves, range: axis::with_margins(range.unwrap_or((0.0, 1.0))) }
    }

    /// The position of a value from 0 (bottom) to 1 (top).
    fn place(&self, value: f64) -> f64 {
        (value - self.range.0) / (self.range.1 - self.range.0)
    }
}

/// Places labels at the side of a panel: near `wanted`, at least `distance` apart, from 0 to `end`.
fn spread(wanted: &[f64], distance: f64, end: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|a, b| wanted[*a].total_cmp(&wanted[*b]));
    let mut places = vec![0.0; wanted.len()];
    let mut next = 0.0f64;
    for &at in &order {
        places[at] = next.max(wanted[at]);
        next = places[at] + distance;
    }
    let mut last = end;
    for &at in order.iter().rev() {
        places[at] = places[at].min(last);
        last = places[at] - distance;
    }
    places
}

#[cfg(test)]
mod tests;
