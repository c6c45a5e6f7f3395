//! `cangauge tare`.

use super::Global;
use super::args::Nodes;
use super::autozero::run_each;
use cangauge::bus::claim::Claim;
use cangauge::tasks::autozero::{Limit, Options, ZeroTarget, autozero, undo_tare};
use clap::Args;

/// Set the net value of a channel to zero (6139h), or restore it (--undo)
///
/// The net value is the process value minus the tare zero. The command measures, writes the signature once, and
/// measures again. The tare zero before and after is printed, and the command to undo it is printed on stderr. The tare
/// zero is not stored.
///
/// The description (--device) or EDS (--eds) must contain 6139h and the net value (6140h, 7140h ...). Each reading must
/// be valid, and the readings may vary by at most 0.5 % of the measuring range. Otherwise nothing is changed (exit 1).
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge --eds scale.eds tare 5\n  cangauge --device scale.toml tare 5 --channel 2 --undo"
)]
pub(crate) struct Tare {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Channel [default: the only channel with a tare]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=199))]
    channel: Option<u8>,
    /// Set the tare zero to 0, so that the net value is the process value again
    #[arg(long)]
    undo: bool,
}

impl Tare {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let options = Options {
            target: ZeroTarget::Tare,
            channel: self.channel,
            limit: Limit::Default,
            samples: 10,
            force: false,
            store: false,
            dry_run: false,
        };
        let task = if self.undo { undo_tare } else { autozero };
        run_each(global, &self.nodes, |master, node, overrides| task(master, node, overrides, &options))
    }
}
