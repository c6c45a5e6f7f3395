//! Lists the figures with their verdicts.

use super::{Controller, Health, NodeTally};
use crate::canopen::id::NodeId;
use crate::tasks::monitor::FrameKind;
use std::collections::BTreeSet;
use std::time::Duration;

/// The limit for the mean load. Above this load, messages with a low priority wait long.
const LOAD_LIMIT: f64 = 60.0;

/// The limit for the load in one second.
const PEAK_LIMIT: f64 = 80.0;

/// A heartbeat is late after this multiple of the producer heartbeat time (1017h). Consumers usually wait 1.5 to 2
/// times as long.
const HEARTBEAT_FACTOR: f64 = 1.5;

/// The limit for the SDO answer time of 99 % of the reads, in seconds.
const ANSWER_LIMIT: f64 = 0.1;

/// A verdict on a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The highest good value.
    pub limit: f64,
    /// Whether the value is good.
    pub is_ok: bool,
}

/// One figure: `bus.load`, `node.heartbeat.max`.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// The node; `None` for the bus.
    pub node: Option<NodeId>,
    /// Its name, which is also its name in expressions.
    pub name: String,
    /// The value; `None` if it is unknown.
    pub value: Option<f64>,
    /// The unit: `%`, `s`; empty for counts.
    pub unit: &'static str,
    /// The verdict, if the figure has a limit and a value.
    pub verdict: Option<Verdict>,
    /// A state or a meaning in words.
    pub detail: Option<String>,
}

impl Figure {
    fn new(node: Option<NodeId>, name: &str, value: Option<f64>, unit: &'static str) -> Figure {
        Figure { node, name: name.to_owned(), value, unit, verdict: None, detail: None }
    }

    fn at_most(self, limit: f64) -> Figure {
        let verdict = self.value.map(|value| Verdict { limit, is_ok: value <= limit });
        Figure { verdict, ..self }
    }

    fn with_detail(self, detail: Option<String>) -> Figure {
        Figure { detail, ..self }
    }
}

fn seconds(time: Option<Duration>) -> Option<f64> {
    time.map(|time| time.as_secs_f64())
}

fn percent(share: Option<f64>) -> Option<f64> {
    share.map(|share| share * 100.0)
}

fn count(number: u64) -> Option<f64> {
    Some(number as f64)
}

/// Returns all figures: those of the bus first.
pub fn figures(health: &Health) -> Vec<Figure> {
    let bus = |name: &str, value, unit| Figure::new(None, name, value, unit);
    let frames: u64 = health.frames.values().sum();
    let faults: u64 = health.faults.iter().map(|(_, count)| count).sum();
    let rate = (!health.length.is_zero()).then(|| frames as f64 / health.length.as_secs_f64());
    let words: Vec<String> = health.faults.iter().map(|(fault, count)| format!("{fault}: {count}")).collect();
    let (burst, in_burst) = health.load.longest_burst().unzip();
    let mut all = vec![
        bus("bus.duration", Some(health.length.as_secs_f64()), "s"),
        bus("bus.bitrate", health.bit_rate.map(f64::from), "bit/s"),
        bus("bus.frames", count(frames), ""),
        bus("bus.rate", rate, "1/s"),
        bus("bus.load", percent(health.load.mean()), "%").at_most(LOAD_LIMIT),
        bus("bus.load.now", percent(health.load.now()), "%"),
        bus("bus.load.peak", percent(health.load.peak()), "%").at_most(PEAK_LIMIT),
        bus("bus.burst", seconds(burst), "s"),
        bus("bus.burst.frames", in_burst.and_then(count), ""),
        bus("bus.errors", count(faults), "").at_most(0.0).with_detail((faults > 0).then(|| words.join(", "))),
        bus("bus.dropped", count(health.dropped), "").at_most(0.0),
    ];
    if let Some(controller) = health.controller {
        let is_ok = controller.state == "error-active";
        let state = bus("bus.state", None, "").with_detail(Some(controller.state.to_owned()));
        all.push(Figure { verdict: Some(Verdict { limit: 0.0, is_ok }), ..state });
        all.push(bus("bus.tx-errors", controller.tx_errors.map(f64::from), ""));
        all.push(bus("bus.rx-errors", controller.rx_errors.map(f64::from), ""));
    }
    all.extend(
        health
            .frames
            .iter()
            .map(|(kind, &of_kind)| Figure::new(None, &format!("bus.frames.{}", kind.as_str()), count(of_kind), "")),
    );
    all.extend(health.nodes.iter().flat_map(|(&node, tally)| of_node(node, tally, health)));
    all
}

/// Returns the names of all figures.
pub fn names() -> BTreeSet<String> {
    let controller = Some(Controller { state: "", tx_errors: None, rx_errors: None });
    let frames = FrameKind::ALL.map(|kind| (kind, 0)).into();
    let nodes = [(NodeId::MIN, NodeTally::default())].into();
    figures(&Health { controller, frames, nodes, ..Health::default() }).into_iter().map(|figure| figure.name).collect()
}

fn of_node(node: NodeId, tally: &NodeTally, health: &Health) -> Vec<Figure> {
    let figure = |name: &str, value, unit| Figure::new(Some(node), name, value, unit);
    let (heartbeat, answers) = (&tally.heartbeat, &tally.answers);
    let wanted = tally.heartbeat_time.filter(|time| !time.is_zero());
    // Without any heartbeat, the longest interval is the whole observation.
    let without_heartbeat = wanted.filter(|_| heartbeat.count() == 0).map(|_| health.length);
    let longest = figure("node.heartbeat.max", seconds(tally.longest_heartbeat().or(without_heartbeat)), "s");
    let rate = (!health.length.is_zero()).then(|| tally.frames as f64 / health.length.as_secs_f64());
    let emergency = tally.last_emergency.as_ref().map(|(code, meaning)| format!("{code:04X}h {meaning}"));
    vec![
        figure("node.state", None, "").with_detail(tally.state.map(|state| state.to_string())),
        figure("node.frames", count(tally.frames), ""),
        figure("node.rate", rate, "1/s"),
        figure("node.load", percent(health.load.share_of(tally.bits)), "%"),
        figure("node.heartbeat.time", seconds(tally.heartbeat_time), "s"),
        figure("node.heartbeat.min", seconds(heartbeat.min()), "s"),
        figure("node.heartbeat.mean", seconds(heartbeat.mean()), "s"),
        match wanted {
            Some(time) => longest.at_most(time.as_secs_f64() * HEARTBEAT_FACTOR),
            None => longest,
        },
        figure("node.sdo.count", count(answers.count()), ""),
        figure("node.sdo.min", seconds(answers.min()), "s"),
        figure("node.sdo.mean", seconds(answers.mean()), "s"),
        figure("node.sdo.p99", seconds(answers.p99()), "s").at_most(ANSWER_LIMIT),
        figure("node.sdo.max", seconds(answers.max()), "s"),
        figure("node.sdo.unanswered", count(tally.unanswered), "").at_most(0.0),
        figure("node.emcy", count(tally.emergencies), "").at_most(0.0).with_detail(emergency),
        figure("node.restarts", count(tally.restarts), "").at_most(0.0),
    ]
}
