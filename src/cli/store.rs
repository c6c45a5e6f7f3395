//! `cangauge store` and `cangauge restore`.

use super::args::Nodes;
use super::each::{Each, each};
use super::exit::stdout;
use super::{Format, Global};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::{csv, json, table};
use crate::tasks::store::{Done, Group};
use crate::tasks::{restore, store};
use clap::{Args, ValueEnum};
use std::io::{self, Write};

/// Let devices keep their settings beyond power off (1010h)
///
/// The device's own word is read first: whether it stores on command, and which groups. "save" then goes out once;
/// at least 3 s are left for the answer, and a command that got none is not repeated. Where storing everything would
/// put custom COB-IDs back to their defaults (MH-4), comm and app are stored instead. What the device does not keep
/// is named. A device that was restored and not reset yet still works with its old settings, and storing keeps
/// those; nothing on the bus shows this, so reset it first.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim store 1\n  cangauge -b sim store 1 --group app --verify\n  cangauge -b sim store 1,127 --format json"
)]
pub(crate) struct Store {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Which settings: everything, communication (1000h to 1FFFh), or application (6000h to 9FFFh)
    #[arg(long, default_value = "all")]
    group: GroupArg,
    /// Reset the node, read again what it is said to keep, and compare
    #[arg(long)]
    verify: bool,
}

/// Give devices their settings as delivered (1011h); node-ID and bit rate stay
///
/// "load" goes out once; at least 3 s are left for the answer, and a command that got none is not repeated. The
/// settings come into force at the next reset of the node only: a store before that may keep the old ones.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim restore 1 --reset\n  cangauge -b sim restore 1 --group comm --reset\n  cangauge -b sim restore 127"
)]
pub(crate) struct Restore {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Which settings: everything, communication (1000h to 1FFFh), or application (6000h to 9FFFh)
    #[arg(long, default_value = "all")]
    group: GroupArg,
    /// Reset the node, and compare with its description
    #[arg(long)]
    reset: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum GroupArg {
    All,
    Comm,
    App,
}

impl From<GroupArg> for Group {
    fn from(group: GroupArg) -> Group {
        match group {
            GroupArg::All => Group::All,
            GroupArg::Comm => Group::Communication,
            GroupArg::App => Group::Application,
        }
    }
}

impl Store {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let each = each(global, &self.nodes, |master, node, overrides| {
            let device = store::device(master, node, overrides)?;
            store::store(master, &device, self.group.into(), self.verify)
        })?;
        tell(each, global, "stored", json::stored)
    }
}

impl Restore {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let each = each(global, &self.nodes, |master, node, overrides| {
            let device = store::device(master, node, overrides)?;
            restore::restore(master, &device, self.group.into(), self.reset)
        })?;
        tell(each, global, "restored", json::restored)
    }
}

/// Prints what was done, and what is to be said of it.
fn tell(
    each: Each<Done>,
    global: &Global,
    what: &str,
    json: impl Fn(&mut dyn Write, NodeId, &Done) -> io::Result<()>,
) -> anyhow::Result<()> {
    let cells =
        |(node, done): &(NodeId, Done)| vec![node.to_string(), done.groups(), done.verified.as_str().to_owned()];
    let print = || {
        let mut out = io::stdout().lock();
        match global.format {
            Format::Json => each.done.iter().try_for_each(|(node, done)| json(&mut out, *node, done))?,
            Format::Csv => csv::write(&mut out, &["node", what, "verified"], each.done.iter().map(cells))?,
            Format::Text => {
                let rows: Vec<Vec<String>> = each.done.iter().map(cells).collect();
                table::write(&mut out, &[table::Align::Right, table::Align::Left, table::Align::Left], &rows)?;
            }
        }
        out.flush()
    };
    print().map_err(stdout)?;
    for (node, done) in &each.done {
        done.notes.iter().for_each(|note| global.console().note(&format!("node {node}: {note}")));
    }
    each.end()
}
