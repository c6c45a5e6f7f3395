//! `cangauge minmax`.

use super::Global;
use super::nodes::on_node;
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::tasks::settings::minmax::{reset, show};
use clap::Args;

/// Show the lowest and highest value that the device has measured, or reset them
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b sim minmax 1\n  cangauge -b sim minmax 1 --reset")]
pub(crate) struct Minmax {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Reset, and print the previous values
    #[arg(long)]
    pub(super) reset: bool,
}

impl Minmax {
    /// The node that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let report = on_node(
            global,
            self.node,
            |master, node| if self.reset { reset(master, node) } else { show(master, node) },
        )?;
        global.print(&report)?;
        if self.reset {
            global.console().note(&format!("node {}: minimum and maximum are reset", self.node));
        }
        Ok(())
    }
}
