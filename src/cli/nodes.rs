//! Runs commands on one node, or on one node after the other.

use super::Global;
use super::args::Nodes;
use super::exit::several;
use super::{descriptions, open};
use cangauge::canopen::id::NodeId;
use cangauge::master::Master;
use cangauge::measure::layout::Signal;
use cangauge::node::{Node, Overrides};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes;
use cangauge::tasks::settings::{open as open_node, select_signals};
use cangauge::tasks::{Failure, Kind, Note};

/// The results of all nodes.
pub(super) struct NodeResults<T> {
    /// The number of requested nodes.
    count: usize,
    /// The successful nodes, in the order of the request.
    pub(super) done: Vec<(NodeId, T)>,
    failures: Vec<Failure>,
}

/// Runs `work` on every node, one after the other. A bus failure or Ctrl-C ends the command.
pub(super) fn on_each_node<T>(
    global: &Global,
    nodes: &Nodes,
    mut work: impl FnMut(&mut Master<'_>, NodeId, &Overrides) -> Result<T, Failure>,
) -> anyhow::Result<NodeResults<T>> {
    global.with_master(|master| {
        let nodes = open::nodes(master, global, nodes)?;
        let overrides = descriptions::overrides_on(master, global, &nodes)?;
        let mut results = NodeResults { count: nodes.len(), done: Vec::new(), failures: Vec::new() };
        for &node in &nodes {
            let result = master.listen_to(&[node]).map_err(Failure::from).and_then(|()| work(master, node, &overrides));
            match result {
                Ok(done) => results.done.push((node, done)),
                Err(failure) => {
                    let ends = matches!(failure.kind(), Kind::Interrupted | Kind::Bus);
                    results.failures.push(failure);
                    if ends {
                        break;
                    }
                }
            }
        }
        Ok(results)
    })
}

/// Runs `work` on one node, with its signals and TPDOs.
pub(super) fn on_node<T>(
    global: &Global,
    node: NodeId,
    work: impl FnOnce(&mut Master<'_>, &mut Node) -> Result<T, Failure>,
) -> anyhow::Result<T> {
    let overrides = descriptions::overrides(global, &[node])?;
    global.with_master(|master| {
        let mut node = open_node(master, node, &overrides)?;
        Ok(work(master, &mut node)?)
    })
}

/// Runs `work` on the channels of one node that `signals` selects, one after the other. Without `signals`, `work`
/// chooses the channel. `all` means the channels for which `applies` is true.
pub(super) fn on_channels<T>(
    global: &Global,
    node: NodeId,
    signals: Option<&str>,
    applies: impl Fn(&Node, &Signal) -> bool,
    mut work: impl FnMut(&mut Master<'_>, &mut Node, Option<&str>) -> Result<T, Failure>,
) -> anyhow::Result<NodeResults<T>> {
    on_node(global, node, |master, node| {
        let names = signals.map(|text| select_signals(node, text, |signal| applies(node, signal))).transpose()?;
        let names: Vec<Option<String>> = names.map_or(vec![None], |names| names.into_iter().map(Some).collect());
        let mut results = NodeResults { count: names.len(), done: Vec::new(), failures: Vec::new() };
        for name in names {
            match work(master, node, name.as_deref()) {
                Ok(done) => results.done.push((node.id, done)),
                // After a usage error of the first channel, the other channels would fail in the same way.
                Err(failure) if failure.kind() == Kind::Usage && results.done.is_empty() => return Err(failure),
                Err(failure) => {
                    let ends = matches!(failure.kind(), Kind::Interrupted | Kind::Bus | Kind::NoAnswer);
                    results.failures.push(failure);
                    if ends {
                        break;
                    }
                }
            }
        }
        Ok(results)
    })
}

impl<T> NodeResults<T> {
    /// Returns the results without their nodes, and the failures for [`NodeResults::end`].
    pub(super) fn into_parts(self) -> (Vec<T>, NodeResults<T>) {
        let NodeResults { count, done, failures } = self;
        (done.into_iter().map(|(_, done)| done).collect(), NodeResults { count, done: Vec::new(), failures })
    }

    /// Converts tolerated failures to notes, if at least one node succeeded. With `all`, a node without the feature is
    /// not a failure.
    pub(super) fn tolerate(&mut self, global: &Global, is_tolerated: impl Fn(&Failure) -> bool) {
        if self.done.is_empty() {
            return;
        }
        let (tolerated, failed): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.failures).into_iter().partition(|failure| is_tolerated(failure));
        tolerated.iter().for_each(|failure| global.console().note(&ErrorMessage::from(failure).message));
        self.failures = failed;
    }

    /// The result of the command.
    ///
    /// # Errors
    /// The failures, with the exit code for several nodes.
    pub(super) fn end(self) -> anyhow::Result<()> {
        Ok(several(self.count, self.failures)?)
    }
}

/// Prints the notes of several reports, each note once.
pub(super) fn print_notes<'a>(global: &Global, all: impl Iterator<Item = &'a Note>) {
    let mut printed: Vec<&Note> = Vec::new();
    for note in all {
        if !printed.contains(&note) {
            notes::print(&global.console(), note);
            printed.push(note);
        }
    }
}
