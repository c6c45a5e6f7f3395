//! `cangauge nmt`.

use super::args::{Duration, Nodes};
use super::exit::{IntoFailure, several, stdout};
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::bus::time::spoken;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtCommand;
use crate::output::failure::ErrorMessage;
use crate::output::{csv, json, table};
use crate::tasks::nmt::{Change, Proof, Seen, Starts, StateReport, command, probe, startup, states, watch};
use crate::tasks::{Failure, Kind};
use clap::{Args, Subcommand, ValueEnum};
use std::io::{self, Write};
use std::ops::ControlFlow;

/// Send NMT commands and tell states
///
/// After a command the state is confirmed: by heartbeat or boot-up, by node guarding where that is
/// harmless, or by SDO, which proves only stopped. What nothing confirms is said ("none").
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim nmt start 1\n  cangauge -b sim nmt reset 127\n  cangauge -b sim nmt state 1-3"
)]
pub(crate) struct Nmt {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
#[command(defer = true)]
enum Action {
    /// To OPERATIONAL: the nodes send their TPDOs
    Start(Targets),
    /// To STOPPED: only NMT, heartbeat and LSS
    Stop(Targets),
    /// To PRE-OPERATIONAL: everything but PDOs
    Preop(Targets),
    /// Restart the application (reset node)
    Reset(Targets),
    /// Restart the communication
    ResetComm(Targets),
    /// Tell the states: by heartbeat, or node guarding where that is harmless; "-" where nothing tells it
    State(StateArgs),
    /// Follow heartbeats, boot-ups and losses until Ctrl-C
    Watch(WatchArgs),
    /// Tell or set who starts a device after power on: wait for the master, or auto (by itself)
    Startup(StartupArgs),
}

#[derive(Debug, Args)]
struct Targets {
    /// Which nodes: 5, 0x7f, 1-16, 1,5; all is one broadcast
    nodes: Nodes,
    /// Exit 3 where nothing confirms the state
    #[arg(long, conflicts_with = "no_wait")]
    confirm: bool,
    /// Only send
    #[arg(long)]
    no_wait: bool,
}

#[derive(Debug, Args)]
struct StateArgs {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Where nothing tells the state: set the heartbeat (1017h) for a moment and put it back
    #[arg(long)]
    probe: bool,
}

#[derive(Debug, Args)]
struct WatchArgs {
    /// Which nodes: 5, 0x7f, 1-16, 1,5; named ones are asked for their heartbeat time, else it is learned
    #[arg(default_value = "all")]
    nodes: Nodes,
    /// End after this time
    #[arg(short, long, value_name = "DUR")]
    duration: Option<Duration>,
}

#[derive(Debug, Args)]
struct StartupArgs {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// wait or auto; not given: only tell
    set: Option<StartupMode>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum StartupMode {
    /// The master starts the device
    Wait,
    /// The device starts itself
    Auto,
}

impl Nmt {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        match &self.action {
            Action::Start(targets)
            | Action::Stop(targets)
            | Action::Preop(targets)
            | Action::Reset(targets)
            | Action::ResetComm(targets) => targets.nodes.claim(),
            Action::State(args) => args.nodes.claim(),
            // It asks each node once and then listens, for hours.
            Action::Watch(_) => Claim::Nothing,
            Action::Startup(args) => Claim::Nodes(vec![args.node]),
        }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (kind, targets) = match &self.action {
            Action::Start(targets) => (NmtCommand::Start, targets),
            Action::Stop(targets) => (NmtCommand::Stop, targets),
            Action::Preop(targets) => (NmtCommand::EnterPreOperational, targets),
            Action::Reset(targets) => (NmtCommand::ResetNode, targets),
            Action::ResetComm(targets) => (NmtCommand::ResetCommunication, targets),
            Action::State(args) => return args.run(global),
            Action::Watch(args) => return args.run(global),
            Action::Startup(args) => return args.run(global),
        };
        let reports = global.with_master(|master| {
            let broadcast = targets.nodes == Nodes::All;
            if targets.no_wait {
                match &targets.nodes {
                    Nodes::All => master.send(kind.frame(None)),
                    Nodes::These(nodes) => nodes.iter().for_each(|&node| master.send(kind.frame(Some(node)))),
                }
                return Ok(Vec::new());
            }
            let nodes = match &targets.nodes {
                Nodes::These(nodes) => nodes.clone(),
                // The broadcast goes out whoever is there; who is there decides what can be confirmed.
                Nodes::All => match open::nodes(master, global, &Nodes::All) {
                    Err(error)
                        if error.downcast_ref::<Failure>().is_some_and(|failure| failure.kind() == Kind::NoAnswer) =>
                    {
                        Vec::new()
                    }
                    nodes => nodes?,
                },
            };
            Ok(command(master, kind, &nodes, broadcast).or_fail()?)
        })?;
        print(&reports, global.format).map_err(stdout)?;
        let failures = reports.iter().filter_map(|report| targets.judge(kind, report, global)).collect();
        Ok(several(reports.len(), failures)?)
    }
}

impl Targets {
    /// What is wrong with a node after a command. What cannot be confirmed is a failure only when asked to be.
    fn judge(&self, kind: NmtCommand, report: &StateReport, global: &Global) -> Option<Failure> {
        let wanted = kind.target();
        match (report.state, report.by) {
            // A device that starts by itself leaves PRE-OPERATIONAL at once after a reset.
            (Some(_), _) if kind.is_reset() => None,
            (Some(state), _) if state == wanted => None,
            (Some(state), _) => {
                let message = format!("it is {state}, not {wanted}");
                Some(Failure::of_node(Kind::Unexpected, report.node, message))
            }
            (None, _) => {
                let (why, hint) = if !report.is_present {
                    (
                        "sent, and nothing came back: no heartbeat, no boot-up, no SDO answer",
                        "who is there: cangauge scan".to_owned(),
                    )
                } else if kind.is_reset() {
                    ("sent, and no boot-up came", format!("is it there? cangauge nmt state {}", report.node))
                } else {
                    (
                        "sent, and nothing confirms it: no heartbeat (1017h is 0)",
                        format!("set a heartbeat: cangauge sdo write {} producer-heartbeat-time 1000", report.node),
                    )
                };
                let failure = Failure::of_node(Kind::NoAnswer, report.node, why);
                // A device that is there tells its boot-up, whatever else it tells: silence after a reset, and
                // silence of a node that was named, are no success.
                if self.confirm || !report.is_present || kind.is_reset() {
                    return Some(failure.hint(hint));
                }
                global.console().note(&ErrorMessage::from(&failure).message);
                None
            }
        }
    }
}

impl StateArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let reports = global.with_master(|master| {
            let nodes: Vec<NodeId> = open::nodes(master, global, &self.nodes)?;
            let mut reports = states(master, &nodes).or_fail()?;
            for report in reports.iter_mut().filter(|report| self.probe && report.is_present && report.state.is_none())
            {
                let probed = probe(master, report.node).or_fail()?;
                if let Some(trouble) = probed.trouble {
                    global.console().warn(&format!("node {}: {trouble}", report.node));
                }
                *report = probed.report;
            }
            Ok(reports)
        })?;
        print(&reports, global.format).map_err(stdout)?;
        let failures: Vec<Failure> = reports
            .iter()
            .filter(|report| !report.is_present)
            .map(|report| {
                Failure::of_node(Kind::NoAnswer, report.node, "no heartbeat and no SDO answer")
                    .hint("who is there: cangauge scan")
            })
            .collect();
        Ok(several(reports.len(), failures)?)
    }
}

impl WatchArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (nodes, ask) = match &self.nodes {
            Nodes::All => (NodeId::all().collect(), false),
            Nodes::These(nodes) => (nodes.clone(), true),
        };
        let mut failed = None;
        global.with_master(|master| {
            let until = self.duration.map(|duration| master.now() + duration.0);
            let mut tell = |seen: &Seen| match print_seen(seen, global.format) {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    failed = Some(error);
                    ControlFlow::Break(())
                }
            };
            Ok(watch(master, &nodes, ask, until, &mut tell).or_fail()?)
        })?;
        failed.map_or(Ok(()), |error| Err(stdout(error)))
    }
}

impl StartupArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let overrides = open::overrides(global, &[self.node])?;
        let set = self.set.map(|mode| match mode {
            StartupMode::Wait => Starts::Wait,
            StartupMode::Auto => Starts::Auto,
        });
        let report = global.with_master(|master| Ok(startup(master, self.node, &overrides, set)?))?;
        let word = match report.starts {
            Starts::Wait => "wait".to_owned(),
            Starts::Auto => "auto".to_owned(),
            Starts::Other(raw) => format!("0x{raw:X}"),
        };
        let mut out = io::stdout().lock();
        match global.format {
            Format::Json => json::startup(&mut out, self.node, &word, report.raw),
            Format::Csv => writeln!(out, "{},{word},{}", self.node, report.raw),
            Format::Text => writeln!(out, "{word}"),
        }
        .and_then(|()| out.flush())
        .map_err(stdout)?;
        if !report.doubt.is_empty() {
            global.console().warn(&format!("node {}: {}", self.node, report.doubt));
        }
        if set.is_some() {
            let node = self.node;
            let note = format!("node {node}: kept after power off only when it is stored: cangauge store {node}");
            global.console().note(&note);
        }
        Ok(())
    }
}

fn print_seen(seen: &Seen, format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let time = humantime::format_rfc3339_micros(seen.at.wall.system_time()).to_string();
    let (event, state) = match seen.change {
        Change::State(state) => ("state", Some(state)),
        Change::BootUp => ("boot-up", None),
        Change::Lost(_) => ("lost", None),
        Change::Back(state) => ("back", Some(state)),
    };
    match format {
        Format::Json => {
            let state = state.map(|state| state.to_string());
            json::seen(&mut out, &time, seen.node, event, state.as_deref())?;
        }
        Format::Csv => {
            let state = state.map(|state| state.to_string()).unwrap_or_default();
            writeln!(out, "{time},{},{event},{state}", seen.node)?;
        }
        Format::Text => {
            let rest = match seen.change {
                Change::State(state) | Change::Back(state) => format!(" {state}"),
                Change::Lost(silent) => format!(": silent for {}", spoken(silent)),
                Change::BootUp => String::new(),
            };
            writeln!(out, "{time}  {:>3}  {event}{rest}", seen.node)?;
        }
    }
    out.flush()
}

fn print(reports: &[StateReport], format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match format {
        Format::Json => reports.iter().try_for_each(|report| json::report(&mut out, report))?,
        Format::Csv => {
            csv::write(&mut out, &["node", "state", "by"], reports.iter().map(|report| cells(report, "")))?;
        }
        Format::Text => {
            let rows: Vec<Vec<String>> = reports.iter().map(|report| cells(report, "-")).collect();
            let align = [table::Align::Right, table::Align::Left, table::Align::Left];
            table::write(&mut out, &align, &rows)?;
        }
    }
    out.flush()
}

fn cells(report: &StateReport, missing: &str) -> Vec<String> {
    let by = match report.by {
        Proof::None => "none",
        by => by.as_str(),
    };
    let state = report.state.map_or_else(|| missing.to_owned(), |state| state.to_string());
    vec![report.node.to_string(), state, by.to_owned()]
}
