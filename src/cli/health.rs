//! `cangauge health`.

use super::args::{BitRate, Duration, Nodes};
use super::bus::host;
use super::exit::several;
use super::{Global, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::tasks::Failure;
use cangauge::tasks::health::{Controller, Health, HealthOptions, figures, health};
use cangauge::tasks::nmt::NmtFailure;
use clap::Args;

/// Measure the load of the bus, heartbeat intervals and SDO answer times
///
/// Reads 1017h of each node once, and then 1000h repeatedly. Each node is read at most once in 100 ms, and all reads
/// together take at most 5 % of the bus. Heartbeat intervals are shown as min / mean / max. SDO answer times are shown
/// as min / mean / 99th percentile / max (number of answers).
///
/// The limits are: mean load 60 %; load in each second 80 %; heartbeat interval 1.5 times the heartbeat time (1017h);
/// 99 % of the SDO answers within 100 ms; no errors, emergencies or restarts. The command check compares the same
/// figures with your own limits: cangauge check 5 'node.heartbeat.max < 1.1 s' 'bus.load < 60 %' --for 10s.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim health --for 5s\n  cangauge health 5,6 --for 1h\n  cangauge health --passive\n  cangauge -b replay:trace.log health --bitrate 250k"
)]
pub(crate) struct HealthCommand {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    #[arg(default_value = "all")]
    nodes: Nodes,
    /// Measure for this time [default: 10s; a recording is measured to its end]
    #[arg(short, long = "for", visible_alias = "duration", value_name = "DUR")]
    duration: Option<Duration>,
    /// Send nothing. SDO answer times are then measured from the reads of other masters
    #[arg(long)]
    pub(super) passive: bool,
    /// Bit rate of the bus, if the interface does not report it: 250k
    #[arg(long, value_name = "RATE")]
    bitrate: Option<BitRate>,
}

/// The duration of a measurement on a live bus without `--for`.
const DEFAULT_DURATION: std::time::Duration = std::time::Duration::from_secs(10);

impl HealthCommand {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let measured = global.with_master(|master| {
            let is_live = master.bus().is_live();
            let reads = is_live && !self.passive;
            let nodes = match &self.nodes {
                Nodes::These(nodes) => nodes.clone(),
                Nodes::All if reads => open::all(master, global)?,
                Nodes::All => Vec::new(),
            };
            let described = if nodes.is_empty() { NodeId::all().collect() } else { nodes.clone() };
            let duration = self.duration.map(|duration| duration.0);
            let options = HealthOptions {
                reads: reads && !nodes.is_empty(),
                nodes,
                duration: duration.or(is_live.then_some(DEFAULT_DURATION)),
                bit_rate: self.bitrate.map(|rate| rate.0),
                overrides: descriptions::overrides(global, &described)?,
            };
            let measured = health(master, &options)?;
            Ok(Health { controller: controller(master.bus().name()), ..measured })
        })?;
        global.print(&figures(&measured))?;
        let absent = measured.nodes.iter().filter(|(_, tally)| tally.frames == 0);
        let absent: Vec<Failure> = absent.map(|(&node, _)| Failure::at(node, NmtFailure::Absent)).collect();
        Ok(several(measured.nodes.len(), absent)?)
    }
}

/// The state of the controller of an interface of this computer.
fn controller(name: &str) -> Option<Controller> {
    let interface = host::list().into_iter().find(|interface| interface.interface == name)?;
    let (tx_errors, rx_errors) = (interface.tx_errors, interface.rx_errors);
    interface.state.map(|state| Controller { state, tx_errors, rx_errors })
}
