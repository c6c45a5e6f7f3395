//! `cangauge scan`.

use super::args::Nodes;
use super::exit::{IntoFailure, several};
use super::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::nmt::NmtState;
use cangauge::output::progress::Activity;
use cangauge::tasks::Failure;
use cangauge::tasks::scan::{Found, ScanFailure, listen, scan};
use clap::Args;
use std::time::Duration;

/// The time that `--passive` listens: three heartbeats at the usual interval of 1 s.
const LISTEN_TIMEOUT: Duration = Duration::from_secs(3);

/// The wait after the last request of the first round.
pub(super) const SCAN_TIMEOUT: Duration = Duration::from_millis(200);

/// List every node that answers, with its state, identity and recognised device
///
/// The device types of all nodes are read at the same time. If a node does not answer, the read is repeated once. The
/// state is read from the heartbeat. It is "-" if the node sends no heartbeat.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b sim scan\n  cangauge -b sim scan 1-16 --format json")]
pub(crate) struct Scan {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    #[arg(default_value = "1-127")]
    nodes: Nodes,
    /// Send nothing: list the nodes that send something within 3 s (or --timeout)
    #[arg(long)]
    pub(super) passive: bool,
}

impl Scan {
    /// The command `scan --passive` for one node.
    pub(super) fn passive(node: NodeId) -> Scan {
        Scan { nodes: Nodes::These(vec![node]), passive: true }
    }

    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        if self.passive { Claim::Nothing } else { self.nodes.claim() }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let nodes: Vec<NodeId> = match &self.nodes {
            Nodes::All => NodeId::all().collect(),
            Nodes::These(nodes) => nodes.clone(),
        };
        let overrides = descriptions::overrides(global, &nodes)?;
        let (found, took) = global.with_master(|master| {
            let begin = master.now();
            let text = if self.passive { "listening" } else { "asking the nodes" };
            let _activity = Activity::new(global.shows_progress(), text);
            let found = if self.passive {
                // A replayed recording is read to its end.
                let default = if master.bus().is_live() { LISTEN_TIMEOUT } else { Duration::MAX };
                let duration = global.timeout.map_or(default, |timeout| timeout.0);
                listen(master, &nodes, duration, &overrides).or_fail()?
            } else {
                let timing = global.timing(SCAN_TIMEOUT);
                scan(master, &nodes, timing.timeout, 1 + timing.retries, &overrides).or_fail()?
            };
            Ok((found, master.now().since(begin)))
        })?;
        if found.is_empty() {
            let cause = if self.passive { ScanFailure::NoFrame } else { ScanFailure::NoAnswer };
            return Err(Failure::general(cause).into());
        }
        global.print(&found)?;
        self.note(&found, took, global);
        let failures: Vec<Failure> = found.iter().filter_map(|found| found.failure.clone()).collect();
        Ok(several(found.len(), failures)?)
    }

    /// Prints the number of nodes found, and the command for unknown states.
    fn note(&self, found: &[Found], took: Duration, global: &Global) {
        let nodes = if found.len() == 1 { "node" } else { "nodes" };
        global.console().note(&format!("{} {nodes} in {:.2} s", found.len(), took.as_secs_f64()));
        for other in found.iter().filter(|found| found.is_other_device) {
            global.console().warn(&format!("node {}: the description or EDS is for another device", other.node));
        }
        for found in found {
            if let Some(NmtState::Other(state)) = found.state {
                let text = format!("node {}: its heartbeat has the unknown state byte {state:02X}h", found.node);
                global.console().warn(&text);
            }
        }
        let is_silent = |found: &&Found| !found.device.is_identified && found.failure.is_none();
        for silent in found.iter().filter(is_silent).filter(|_| !self.passive) {
            global
                .console()
                .note(&format!("node {}: it sends heartbeats, but does not answer SDO requests", silent.node));
        }
        let unknown = found.iter().find(|found| found.state.is_none()).filter(|_| !self.passive);
        if let Some(unknown) = unknown {
            global.console().note(&format!(
                "State \"-\": unknown (no heartbeat was received); find out: cangauge nmt state {} --probe",
                unknown.node
            ));
        }
    }
}
