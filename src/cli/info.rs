//! `cangauge info`.

use super::scan::Scan;
use super::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::tasks::settings::info::read;
use clap::Args;

/// Show everything about a device on one page
///
/// The page shows identity, versions, bit rate, NMT state (if the node sends a heartbeat), monitoring and errors. Then
/// it shows signals with unit, range, status and settings, TPDOs and manufacturer-specific objects. The last section
/// shows which settings the device can store (1010h), and which it cannot. Missing objects are omitted.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim info 1\n  cangauge -b sim info 127 --format json\n  cangauge -b replay:run.log info 1 --passive"
)]
pub(crate) struct Info {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Send nothing. Show the state, and the identity if another master reads it
    #[arg(long)]
    pub(super) passive: bool,
}

impl Info {
    /// The node that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        if self.passive { Claim::Nothing } else { Claim::Nodes(vec![self.node]) }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        if self.passive {
            return Scan::passive(self.node).run(global);
        }
        let overrides = descriptions::overrides(global, &[self.node])?;
        global.print(&[global.with_master(|master| Ok(read(master, self.node, &overrides)?))?])
    }
}
