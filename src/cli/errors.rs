//! `cangauge errors`.

use super::Global;
use super::nodes::on_node;
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::tasks::settings::errors::{ErrorReport, clear, read};
use clap::Args;

/// Show the error register (1001h) and the error history (1003h) of a device, or clear the history
///
/// The meaning of an error code is taken from the description of the device. If it is not there, the error class of
/// CiA 301 is shown.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b sim errors 1\n  cangauge -b sim errors 1 --clear")]
pub(crate) struct Errors {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Delete the history; a pending error stays in the register
    #[arg(long)]
    pub(super) clear: bool,
}

impl Errors {
    /// The node that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let report = on_node(global, self.node, |master, node| {
            let (errors, cleared) = if self.clear {
                let (before, now) = clear(master, node)?;
                (now, before.count)
            } else {
                (read(master, node)?, None)
            };
            Ok(ErrorReport { node: self.node, errors, cleared })
        })?;
        global.print(std::slice::from_ref(&report))?;
        let Some(count) = report.cleared else { return Ok(()) };
        let console = global.console();
        let errors = if count == 1 { "1 error".to_owned() } else { format!("{count} errors") };
        console.note(&format!("node {}: {errors} deleted from the history", self.node));
        if report.errors.register.is_some_and(|bits| bits != 0) {
            console.note(&format!("node {}: an error is still pending: {}", self.node, report.errors.register_text));
        }
        Ok(())
    }
}
