//! `cangauge errors`.

use super::exit::stdout;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::{csv, info, settings as json, table};
use crate::tasks::settings::Device;
use crate::tasks::settings::errors::{Errors as Report, clear, read};
use clap::Args;
use std::io::{self, Write};

/// Tell the errors of a device: register (1001h) and history (1003h) in words, or clear the history
///
/// Codes are told by the device's own table, else by their class in CiA 301.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b sim errors 1\n  cangauge -b sim errors 1 --clear")]
pub(crate) struct Errors {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// Delete the history; an error that is pending stays in the register
    #[arg(long)]
    clear: bool,
}

impl Errors {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let overrides = open::overrides(global, &[self.node])?;
        let (report, cleared) = global.with_master(|master| {
            let device = Device::open(master, self.node, &overrides)?;
            if self.clear {
                let (before, now) = clear(master, &device)?;
                return Ok((now, before.count));
            }
            Ok((read(master, &device)?, None))
        })?;
        self.print(&report, cleared, global.format).map_err(stdout)?;
        if let Some(count) = cleared {
            let console = global.console();
            let errors = if count == 1 { "1 error".to_owned() } else { format!("{count} errors") };
            console.note(&format!("node {}: {errors} deleted from the history", self.node));
            if report.register.is_some_and(|bits| bits != 0) {
                console.note(&format!("node {}: an error is still pending: {}", self.node, report.register_text));
            }
        }
        Ok(())
    }

    fn print(&self, report: &Report, cleared: Option<u64>, format: Format) -> io::Result<()> {
        let mut out = io::stdout().lock();
        match format {
            Format::Json => json::errors(&mut out, self.node, report, cleared)?,
            Format::Csv => {
                let rows = report.history.iter().enumerate().map(|(at, error)| {
                    let (code, raw) = (format!("0x{:04X}", error.code), format!("0x{:08X}", error.raw));
                    let (node, number) = (self.node.to_string(), (at + 1).to_string());
                    vec![node, number, code, error.text.clone(), error.detail.clone(), raw]
                });
                csv::write(&mut out, &["node", "number", "code", "text", "detail", "raw"], rows)?;
            }
            Format::Text => table::write(&mut out, &[table::Align::Left; 2], &info::errors(report))?,
        }
        out.flush()
    }
}
