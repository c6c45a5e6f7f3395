//! `cangauge export`.

use super::args::Nodes;
use super::exit::{open_stdout, several, stdout};
use super::{ErrorMessage, Global, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::output::dbc;
use cangauge::tasks::export::messages;
use clap::{Args, Subcommand};

/// Export the TPDOs of nodes for other programs (DBC)
#[derive(Debug, Args)]
pub(crate) struct Export {
    #[command(subcommand)]
    format: ExportFormat,
}

#[derive(Debug, Subcommand)]
#[command(defer = true)]
enum ExportFormat {
    /// Print a DBC file with the present mapping of the TPDOs
    ///
    /// Signals have the names, units and decimal digits that the devices report. After a change of the mapping or of a
    /// unit, print the file again.
    #[command(after_help = "Examples:\n  cangauge -b sim export dbc all > bench.dbc")]
    Dbc(DbcArgs),
}

#[derive(Debug, Args)]
struct DbcArgs {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
}

impl Export {
    /// The nodes that are read.
    pub(super) fn claim(&self) -> Claim {
        let ExportFormat::Dbc(dbc) = &self.format;
        dbc.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let ExportFormat::Dbc(arguments) = &self.format;
        if !global.prints_text() {
            return Err(ErrorMessage::usage("a DBC is text: omit --format").into());
        }
        let (asked, (messages, failures)) = global.with_master(|master| {
            let nodes = open::nodes(master, global, &arguments.nodes)?;
            let overrides = descriptions::overrides_on(master, global, &nodes)?;
            Ok((nodes.len(), messages(master, &nodes, &overrides)?))
        })?;
        let console = global.console();
        for message in &messages {
            let tpdo = format!("node {}: TPDO{}", message.node, message.number.get());
            for object in &message.unknown {
                console.warn(&format!("{tpdo}: the type or the decimal digits of {object} are unknown: omitted"));
            }
            if message.is_shared {
                console.warn(&format!("{tpdo}: another node has the same COB-ID 0x{}: omitted", message.id));
            }
        }
        if failures.len() < asked {
            dbc::write(&messages, &mut open_stdout()?.lock()).map_err(stdout)?;
        }
        Ok(several(asked, failures)?)
    }
}
