//! `cangauge store` and `cangauge restore`.

use super::Global;
use super::args::Nodes;
use super::nodes::{NodeResults, on_each_node};
use cangauge::bus::claim::Claim;
use cangauge::output::notes;
use cangauge::output::report::Report;
use cangauge::output::store::{Restored, Stored};
use cangauge::tasks::store::{Group, StoreReport};
use cangauge::tasks::{restore, store};
use clap::{Args, ValueEnum};

/// Save settings to non-volatile memory (1010h)
///
/// First, 1010h is read: it shows which settings the device can store. "save" is sent once and never repeated. The
/// time-out is at least 3 s. If storing everything would reset custom COB-IDs (MH-4), comm and app are stored instead.
/// Settings that the device does not store are listed. After a restore, reset the device before you store. Otherwise
/// the device stores its old settings again.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim store 1\n  cangauge -b sim store 1 --group app --verify\n  cangauge -b sim store 1,127 --format json"
)]
pub(crate) struct Store {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Settings: all, communication (1000h to 1FFFh), or application (6000h to 9FFFh)
    #[arg(long, default_value = "all")]
    group: GroupArg,
    /// Reset the node, read the stored settings again, and compare
    #[arg(long)]
    verify: bool,
}

/// Restore factory defaults (1011h), except node-ID and bit rate
///
/// "load" is sent once and never repeated. The time-out is at least 3 s. The device uses the defaults after its next
/// reset. If you store before the reset, the device may keep its old settings.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim restore 1 --reset\n  cangauge -b sim restore 1 --group comm --reset\n  cangauge -b sim restore 127"
)]
pub(crate) struct Restore {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Settings: all, communication (1000h to 1FFFh), or application (6000h to 9FFFh)
    #[arg(long, default_value = "all")]
    group: GroupArg,
    /// Reset the node, and compare its settings with the defaults in its description
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
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let results = on_each_node(global, &self.nodes, |master, node, overrides| {
            let device = store::device(master, node, overrides)?;
            store::store(master, &device, self.group.into(), self.verify)
        })?;
        print(results, global, Stored)
    }
}

impl Restore {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let results = on_each_node(global, &self.nodes, |master, node, overrides| {
            let device = store::device(master, node, overrides)?;
            restore::restore(master, &device, self.group.into(), self.reset)
        })?;
        print(results, global, Restored)
    }
}

/// Prints the reports, the notes and the failures.
fn print<R: Report>(
    results: NodeResults<StoreReport>,
    global: &Global,
    report: fn(StoreReport) -> R,
) -> anyhow::Result<()> {
    let reports: Vec<R> = results.done.iter().map(|(_, done)| report(done.clone())).collect();
    global.print(&reports)?;
    for note in results.done.iter().flat_map(|(_, done)| &done.notes) {
        notes::print(&global.console(), note);
    }
    results.end()
}
