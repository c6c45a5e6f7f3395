//! `cangauge doctor`.

use super::args::{BusSpec, Nodes};
use super::exit;
use super::scan::SCAN_TIMEOUT;
use super::{Global, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::output::doctor::FindingReport;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::Kind;
use cangauge::tasks::doctor::{DoctorOptions, examine};
use clap::Args;

/// Find out why a node or the whole bus is silent
///
/// The command looks for nodes and observes their TPDOs for up to 5 s. Then it reads the status of the values, the
/// error registers, and the objects that explain why a node is silent. It changes nothing. After each finding, it shows
/// the command to type. The exit code is 0 if there is no problem, and 1 if a problem was found.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge doctor 5\n  cangauge doctor --passive\n  cangauge doctor all --format json"
)]
pub(crate) struct Doctor {
    /// Node-ID: 5, 0x7f, or all. If no node answers, `all` also searches for devices without a node-ID (LSS)
    /// [default: every node]
    node: Option<Nodes>,
    /// Send nothing
    #[arg(long)]
    pub(super) passive: bool,
}

impl Doctor {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        match &self.node {
            Some(nodes) if !self.passive => nodes.claim(),
            _ => Claim::Nothing,
        }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        if matches!(global.bus, Some(BusSpec::Replay(_))) {
            return Err(ErrorMessage::usage("doctor examines nodes on a live bus, not in a recording (replay:)")
                .hint("to see what a recording contains: monitor, health, or log")
                .into());
        }
        let node = match &self.node {
            Some(Nodes::These(nodes)) if nodes.len() > 1 => {
                return Err(ErrorMessage::usage("doctor examines one node, or all").hint("cangauge doctor").into());
            }
            Some(Nodes::These(nodes)) => nodes.first().copied(),
            _ => None,
        };
        let nodes: Vec<NodeId> = node.map_or_else(|| NodeId::all().collect(), |node| vec![node]);
        let timing = global.timing(SCAN_TIMEOUT);
        let options = DoctorOptions {
            node,
            passive: self.passive,
            lss: self.node == Some(Nodes::All) && !self.passive,
            timeout: timing.timeout,
            rounds: 1 + timing.retries,
            overrides: descriptions::overrides(global, &nodes)?,
        };
        let examined = global.with_master(|master| {
            let examination = examine(master, &options)?;
            let name = master.bus().name().to_owned();
            let reports = examination.findings.iter().map(|finding| FindingReport::new(finding, &name)).collect();
            Ok((examination.nodes.len(), reports))
        });
        let (nodes, findings): (usize, Vec<FindingReport>) = match examined {
            Err(error) => match exit::bus_error(&error, global.bus.is_some() || open::has_interface()) {
                Some(message) => (0, vec![FindingReport::of_bus(message)]),
                None => return Err(error),
            },
            Ok(examined) => examined,
        };
        Self::report(global, nodes, &findings)
    }

    /// Prints the findings.
    fn report(global: &Global, nodes: usize, findings: &[FindingReport]) -> anyhow::Result<()> {
        global.print(findings)?;
        if findings.is_empty() {
            let nodes = if nodes == 1 { "1 node".to_owned() } else { format!("{nodes} nodes") };
            global.console().note(&format!("{nodes}: no problem found"));
            return Ok(());
        }
        let count = if findings.len() == 1 { "1 finding".to_owned() } else { format!("{} findings", findings.len()) };
        Err(ErrorMessage::new(Kind::CheckFailed, count).into())
    }
}
