//! `cangauge nmt`.

use super::args::{Duration, Nodes};
use super::exit::{IntoFailure, several, stdout};
use super::journal::FileJournal;
use super::{Global, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::nmt::NmtCommand;
use cangauge::master::Master;
use cangauge::node::Node;
use cangauge::node::survey::identify_each;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::nmt::left_heartbeat;
use cangauge::output::notes;
use cangauge::tasks::nmt::{
    NmtFailure, Proof, Starts, StateEvent, StateReport, command, probe, startup, states, watch,
};
use cangauge::tasks::{Fact, Failure, Note};
use clap::{Args, Subcommand, ValueEnum};
use std::ops::ControlFlow;

/// Send NMT commands and show NMT states
///
/// After a command, the state is confirmed by a heartbeat, a boot-up message or node guarding. After "stop", the state
/// is also confirmed if the node no longer answers SDO. Node guarding is not used if it would start life guarding, or
/// if another master uses it. Unconfirmed states are shown as "none".
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
    /// Set nodes to OPERATIONAL: nodes send TPDOs
    Start(Targets),
    /// Set nodes to STOPPED: only NMT, heartbeat and LSS work
    Stop(Targets),
    /// Set nodes to PRE-OPERATIONAL: everything except PDOs works
    Preop(Targets),
    /// Restart the application (reset node)
    Reset(Targets),
    /// Restart the communication
    ResetComm(Targets),
    /// Show the NMT states that nodes report by heartbeat or node guarding; "-" if unknown
    State(StateArgs),
    /// Follow heartbeats, boot-ups and losses until Ctrl-C
    Watch(WatchArgs),
    /// Show or set the start after power-on: wait (for the master) or auto (the device starts by itself)
    Startup(StartupArgs),
}

#[derive(Debug, Args)]
struct Targets {
    /// Nodes: 5, 0x7f, 1-16, 1,5; "all" sends one broadcast
    nodes: Nodes,
    /// Exit with 3 if the state cannot be confirmed
    #[arg(long, conflicts_with = "no_wait")]
    confirm: bool,
    /// Send the command, and do not wait for the new state
    #[arg(long)]
    no_wait: bool,
}

#[derive(Debug, Args)]
struct StateArgs {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// If the state is unknown, switch on the heartbeat (1017h) for a moment
    #[arg(long)]
    probe: bool,
}

#[derive(Debug, Args)]
struct WatchArgs {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all. If nodes are listed, their heartbeat times are read (1017h). With "all", they
    /// are measured
    #[arg(default_value = "all")]
    nodes: Nodes,
    /// End after this time
    #[arg(short, long, value_name = "DUR")]
    duration: Option<Duration>,
}

#[derive(Debug, Args)]
struct StartupArgs {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// wait or auto [default: show the setting]
    set: Option<StartupMode>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum StartupMode {
    /// The master starts the device
    Wait,
    /// The device starts by itself
    Auto,
}

impl Nmt {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        match &self.action {
            Action::Start(targets)
            | Action::Stop(targets)
            | Action::Preop(targets)
            | Action::Reset(targets)
            | Action::ResetComm(targets) => targets.nodes.claim(),
            Action::State(args) => args.nodes.claim(),
            // The command sends one request to each node, and then only listens.
            Action::Watch(_) => Claim::Nothing,
            Action::Startup(args) => Claim::Nodes(vec![args.node]),
        }
    }

    pub(super) fn changes_devices(&self) -> bool {
        !matches!(&self.action, Action::State(_) | Action::Watch(_) | Action::Startup(StartupArgs { set: None, .. }))
    }

    pub(super) fn writes(&self) -> bool {
        match &self.action {
            Action::Startup(args) => args.set.is_some(),
            Action::State(args) => args.probe,
            _ => false,
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
        targets.run(kind, global)
    }
}

impl Targets {
    fn run(&self, kind: NmtCommand, global: &Global) -> anyhow::Result<()> {
        let reports = global.with_master(|master| {
            if self.no_wait {
                match &self.nodes {
                    Nodes::All => master.send(kind.frame(None)),
                    Nodes::These(nodes) => nodes.iter().for_each(|&node| master.send(kind.frame(Some(node)))),
                }
                return Ok(Vec::new());
            }
            let nodes = self.confirmable(master, global)?;
            Ok(command(master, kind, &nodes, self.nodes == Nodes::All).or_fail()?)
        })?;
        global.print(&reports)?;
        let failures = reports.iter().filter_map(|report| self.failure_of(kind, report, global)).collect();
        Ok(several(reports.len(), failures)?)
    }

    /// Returns the nodes whose state can be confirmed. The broadcast is sent even if no node answers.
    fn confirmable(&self, master: &mut Master<'_>, global: &Global) -> anyhow::Result<Vec<NodeId>> {
        match &self.nodes {
            Nodes::These(nodes) => Ok(nodes.clone()),
            Nodes::All => open::all(master, global),
        }
    }

    /// Returns the failure of the command for a node. An unconfirmed state is a failure only with `--confirm`.
    fn failure_of(&self, kind: NmtCommand, report: &StateReport, global: &Global) -> Option<Failure> {
        let wanted = kind.target();
        let cause = match report.state {
            // After a reset, a device that starts by itself leaves PRE-OPERATIONAL at once.
            Some(state) if kind.is_reset() || state == wanted => return None,
            Some(state) => NmtFailure::OtherState { state, wanted },
            // The restart is proven, but not the state.
            None if kind.is_reset() && report.by == Proof::BootUp => return None,
            None if !report.is_present => NmtFailure::NoSign,
            None if kind.is_reset() => NmtFailure::NoBootUp,
            None => NmtFailure::NotConfirmed,
        };
        let failure = Failure::at(report.node, cause.clone());
        if cause == NmtFailure::NotConfirmed && !self.confirm {
            global.console().note(&ErrorMessage::of(&failure).message);
            return None;
        }
        Some(failure)
    }
}

impl StateArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let reports = global.with_master(|master| {
            let nodes: Vec<NodeId> = open::nodes(master, global, &self.nodes)?;
            let mut reports = states(master, &nodes).or_fail()?;
            if self.probe {
                probe_unknown(master, global, &mut reports)?;
            }
            Ok(reports)
        })?;
        global.print(&reports)?;
        let absent = reports.iter().filter(|report| !report.is_present);
        let failures = absent.map(|report| Failure::at(report.node, NmtFailure::Absent)).collect();
        Ok(several(reports.len(), failures)?)
    }
}

/// Probes the nodes whose state is unknown.
fn probe_unknown(master: &mut Master<'_>, global: &Global, reports: &mut [StateReport]) -> anyhow::Result<()> {
    let is_unknown = |report: &&mut StateReport| report.is_present && report.by == Proof::None;
    let mut unknown: Vec<&mut StateReport> = reports.iter_mut().filter(is_unknown).collect();
    let ids: Vec<NodeId> = unknown.iter().map(|report| report.node).collect();
    let overrides = descriptions::overrides_on(master, global, &ids)?;
    let nodes = identify_each(master, &ids, &overrides).or_fail()?;
    let mut journal = FileJournal::of(&open::spec(global)?);
    for (report, node) in unknown.iter_mut().zip(nodes) {
        let node = node.unwrap_or_else(|_| Node::new(report.node));
        let probed = probe(master, &node, &mut journal).or_fail()?;
        let text = probed.failure.map(|failure| ErrorMessage::of(&failure).message);
        let left = probed.left.map(left_heartbeat);
        if let Some(text) = text {
            global.console().warn(&left.map_or(text.clone(), |left| format!("{text}; {left}")));
        }
        **report = probed.report;
    }
    Ok(())
}

impl WatchArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (nodes, ask) = match &self.nodes {
            Nodes::All => (NodeId::all().collect(), false),
            Nodes::These(nodes) => (nodes.clone(), true),
        };
        let mut rows = global.stream::<StateEvent>()?;
        let mut write_error = None;
        global.with_master(|master| {
            let until = self.duration.map(|duration| master.now() + duration.0);
            let mut on_change = |event: &StateEvent| match rows.push(event) {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    write_error = Some(error);
                    ControlFlow::Break(())
                }
            };
            // Nodes in a recording do not answer requests.
            let ask = ask && master.bus().is_live();
            Ok(watch(master, &nodes, ask, until, &mut on_change).or_fail()?)
        })?;
        write_error.map_or(Ok(()), |error| Err(stdout(error)))
    }
}

impl StartupArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let overrides = descriptions::overrides(global, &[self.node])?;
        let set = self.set.map(|mode| match mode {
            StartupMode::Wait => Starts::Wait,
            StartupMode::Auto => Starts::Auto,
        });
        let report = global.with_master(|master| Ok(startup(master, self.node, &overrides, set)?))?;
        let doubt = report.doubt.clone();
        global.print(&[report])?;
        if !doubt.is_empty() {
            global.console().warn(&format!("node {}: {doubt}", self.node));
        }
        if set.is_some() {
            notes::print(&global.console(), &Note::of_node(self.node, Fact::KeptUntilPowerOff));
        }
        Ok(())
    }
}
