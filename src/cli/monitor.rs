//! `cangauge monitor`.

use super::args::{BusSpec, Duration, Nodes, one_of};
use super::exit::stdout;
use super::{Global, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::master::{Master, Timing};
use cangauge::node::Overrides;
use cangauge::output::monitor::{masters, totals};
use cangauge::tasks::monitor::{Entry, FrameKind, MonitorOptions, identify, monitor};
use clap::Args;
use std::ops::ControlFlow;

/// Show all traffic on the bus in words, until Ctrl-C
///
/// SDO transfers are shown when they are complete, with name, value and unit. TPDOs are decoded if the mapping is known
/// from observed SDO traffic, --device or --eds. Unknown frames are shown as bytes. The command sends nothing.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge monitor\n  cangauge monitor 5 --kind sdo,emcy\n  cangauge monitor --device 5=mh4 --duration 10s\n  cangauge -b replay:trace.log monitor --format json"
)]
pub(crate) struct Monitor {
    /// Nodes to show: 5, 0x7f, 1-16, 1,5, all. Messages that do not belong to one node (SYNC, LSS) are always shown
    #[arg(default_value = "all")]
    nodes: Nodes,
    /// Show only these kinds of messages [default: all]
    #[arg(short, long, value_name = "KIND", value_delimiter = ',')]
    #[arg(value_parser = one_of(&FrameKind::ALL, FrameKind::as_str))]
    kind: Vec<FrameKind>,
    /// Also show repetitions: heartbeats without a change of the state, repeated error frames
    #[arg(short, long)]
    all: bool,
    /// End after this time
    #[arg(short, long, visible_alias = "for", value_name = "DUR")]
    duration: Option<Duration>,
    /// End after this many messages
    #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,
}

impl Monitor {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    /// Identifies the devices in a recording file, which is read once more for this. Returns their descriptions.
    fn recognised(global: &Global) -> anyhow::Result<Overrides> {
        match &global.bus {
            Some(BusSpec::Replay(file)) if file != "-" => {
                let first = Global { quiet: true, pace: false, trace: None, ..global.clone() };
                let mut bus = open::open(&first)?;
                Ok(identify(&mut Master::new(&mut *bus, first.timing(Timing::default().timeout)))?)
            }
            _ => Ok(Overrides::new()),
        }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (nodes, described_nodes) = match &self.nodes {
            Nodes::All => (Vec::new(), NodeId::all().collect()),
            Nodes::These(nodes) => (nodes.clone(), nodes.clone()),
        };
        let options = MonitorOptions {
            nodes: nodes.into_iter().collect(),
            kinds: self.kind.iter().copied().collect(),
            all: self.all,
            duration: self.duration.map(|duration| duration.0),
            count: self.count,
            overrides: descriptions::overrides(global, &described_nodes)?,
            recognised: Monitor::recognised(global)?,
        };
        let mut rows = global.stream::<Entry>()?;
        let mut write_error = None;
        let report = global.with_master(|master| {
            let mut on_entry = |entry: &Entry| match rows.push(entry) {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    write_error = Some(error);
                    ControlFlow::Break(())
                }
            };
            Ok(monitor(master, &options, &mut on_entry)?)
        })?;
        if let Some(error) = write_error {
            return Err(stdout(error));
        }
        let console = global.console();
        for (id, node) in &report.not_decoded {
            console.note(&format!(
                "node {node}: the mapping of TPDOs with COB-ID 0x{id} is unknown; with a description of the device: \
                 --device {node}=FILE"
            ));
        }
        masters(&report).iter().for_each(|text| console.note(text));
        console.note(&totals(&report));
        Ok(())
    }
}
