//! `cangauge info`.

use super::exit::stdout;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::{csv, info, info_json};
use crate::tasks::settings::Device;
use crate::tasks::settings::info::{Info as Page, Setting, read};
use clap::Args;
use std::io::{self, Write};

/// Tell everything about one device on one page
///
/// Identity, versions, bit rate, NMT state where something tells it, monitoring, errors, signals with unit, range and status, their settings,
/// TPDOs, the manufacturer's objects, what 1010h keeps and what not. What the device has not is left out.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b sim info 1\n  cangauge -b sim info 127 --format json")]
pub(crate) struct Info {
    /// Which node: 5, 0x7f
    node: NodeId,
}

impl Info {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let overrides = open::overrides(global, &[self.node])?;
        let page = global.with_master(|master| {
            let device = Device::open(master, self.node, &overrides)?;
            Ok(read(master, &device)?)
        })?;
        // One page is one system call, and whole or not there.
        let mut text = Vec::new();
        match global.format {
            Format::Json => info_json::object(&mut text, &page),
            Format::Csv => table(&mut text, &page),
            Format::Text => info::text(&mut text, &page),
        }
        .and_then(|()| io::stdout().lock().write_all(&text))
        .map_err(stdout)
    }
}

/// Every object of the page in a row.
fn table(out: &mut dyn Write, page: &Page) -> io::Result<()> {
    let node = page.instrument.id.to_string();
    let settings = page.channels.iter().flat_map(|channel| &channel.settings);
    let rows =
        page.communication.iter().chain(settings).chain(&page.own).map(|Setting { object, name, value, text }| {
            vec![node.clone(), object.to_string(), name.clone(), value.to_string(), text.clone()]
        });
    csv::write(out, &["node", "object", "name", "value", "text"], rows)
}
