//! `cangauge nmt`.

use super::args::Nodes;
use super::exit::{IntoFailure, Several, stdout};
use super::{Format, Global, open};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtCommand;
use crate::output::{json, table};
use crate::tasks::failure::together;
use crate::tasks::nmt::{By, Report, command, states};
use crate::tasks::{Failure, Kind};
use clap::{Args, Subcommand};
use std::io::{self, Write};

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
    /// Tell the states
    State(Nodes1),
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
struct Nodes1 {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
}

impl Nmt {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (kind, targets) = match &self.action {
            Action::Start(targets) => (NmtCommand::Start, targets),
            Action::Stop(targets) => (NmtCommand::Stop, targets),
            Action::Preop(targets) => (NmtCommand::EnterPreOperational, targets),
            Action::Reset(targets) => (NmtCommand::ResetNode, targets),
            Action::ResetComm(targets) => (NmtCommand::ResetCommunication, targets),
            Action::State(nodes) => return state(global, &nodes.nodes),
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
                Nodes::All => open::nodes(master, global, &Nodes::All).unwrap_or_default(),
            };
            Ok(command(master, kind, &nodes, broadcast).or_fail()?)
        })?;
        print(&reports, global.format).map_err(stdout)?;
        let failures = reports.iter().filter_map(|report| targets.judge(kind, report, global)).collect();
        together(reports.len(), failures).map_err(|failures| Several(failures).into())
    }
}

impl Targets {
    /// What is wrong with a node after a command. What cannot be confirmed is a failure only when asked to be.
    fn judge(&self, kind: NmtCommand, report: &Report, global: &Global) -> Option<Failure> {
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
                let (why, hint) = if !report.present {
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
                if self.confirm {
                    return Some(failure.hint(hint));
                }
                global.console().note(&failure.message);
                None
            }
        }
    }
}

fn state(global: &Global, nodes: &Nodes) -> anyhow::Result<()> {
    let reports = global.with_master(|master| {
        let nodes: Vec<NodeId> = open::nodes(master, global, nodes)?;
        Ok(states(master, &nodes).or_fail()?)
    })?;
    print(&reports, global.format).map_err(stdout)?;
    let silent = |report: &&Report| !report.present;
    let failures: Vec<Failure> = reports
        .iter()
        .filter(silent)
        .map(|report| {
            Failure::of_node(Kind::NoAnswer, report.node, "no heartbeat and no SDO answer")
                .hint("who is there: cangauge scan")
        })
        .collect();
    together(reports.len(), failures).map_err(|failures| Several(failures).into())
}

fn print(reports: &[Report], format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match format {
        Format::Json => reports.iter().try_for_each(|report| json::report(&mut out, report))?,
        Format::Csv => {
            let mut csv = csv::Writer::from_writer(&mut out);
            csv.write_record(["node", "state", "by"])?;
            reports.iter().try_for_each(|report| csv.write_record(cells(report, "")))?;
            csv.flush()?;
        }
        Format::Text => {
            let rows: Vec<Vec<String>> = reports.iter().map(|report| cells(report, "-")).collect();
            let align = [table::Align::Right, table::Align::Left, table::Align::Left];
            table::write(&mut out, &align, &rows)?;
        }
    }
    out.flush()
}

fn cells(report: &Report, missing: &str) -> Vec<String> {
    let by = match report.by {
        By::None => "none",
        by => by.as_str(),
    };
    let state = report.state.map_or_else(|| missing.to_owned(), |state| state.to_string());
    vec![report.node.to_string(), state, by.to_owned()]
}
