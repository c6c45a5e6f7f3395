//! Commands that work on one node, or on one node after the other.

use super::Global;
use super::args::Nodes;
use super::exit::several;
use super::{descriptions, open};
use crate::canopen::id::NodeId;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::node::{Node, Overrides};
use crate::output::failure::ErrorMessage;
use crate::output::notes;
use crate::tasks::settings::{open as open_node, select};
use crate::tasks::{Failure, Kind, Note};

/// The results of all nodes.
pub(super) struct Each<T> {
    asked: usize,
    /// The nodes that succeeded, in the order in which they were named.
    pub(super) done: Vec<(NodeId, T)>,
    failures: Vec<Failure>,
}

/// Runs `work` on every node, one after the other. A bus failure or Ctrl-C ends it.
pub(super) fn each<T>(
    global: &Global,
    nodes: &Nodes,
    mut work: impl FnMut(&mut Master<'_>, NodeId, &Overrides) -> Result<T, Failure>,
) -> anyhow::Result<Each<T>> {
    global.with_master(|master| {
        let nodes = open::nodes(master, global, nodes)?;
        let overrides = descriptions::overrides_on(master, global, &nodes)?;
        let mut each = Each { asked: nodes.len(), done: Vec::new(), failures: Vec::new() };
        for &node in &nodes {
            let result = master.listen_to(&[node]).map_err(Failure::from).and_then(|()| work(master, node, &overrides));
            match result {
                Ok(done) => each.done.push((node, done)),
                Err(failure) => {
                    let ends = matches!(failure.kind(), Kind::Interrupted | Kind::Bus);
                    each.failures.push(failure);
                    if ends {
                        break;
                    }
                }
            }
        }
        Ok(each)
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

/// Runs `work` on the channels of one node that `signals` selects, one after the other. Without `signals`, `work` chooses.
/// `all` means the channels that the setting `applies` to.
pub(super) fn on_channels<T>(
    global: &Global,
    node: NodeId,
    signals: Option<&str>,
    applies: impl Fn(&Node, &Signal) -> bool,
    mut work: impl FnMut(&mut Master<'_>, &mut Node, Option<&str>) -> Result<T, Failure>,
) -> anyhow::Result<Each<T>> {
    on_node(global, node, |master, node| {
        let names = signals.map(|text| select(node, text, |signal| applies(node, signal))).transpose()?;
        let names: Vec<Option<String>> = names.map_or(vec![None], |names| names.into_iter().map(Some).collect());
        let mut each = Each { asked: names.len(), done: Vec::new(), failures: Vec::new() };
        for name in names {
            match work(master, node, name.as_deref()) {
                Ok(done) => each.done.push((node.id, done)),
                // The same is wrong with the other channels, or nothing was asked of them.
                Err(failure) if failure.kind() == Kind::Usage && each.done.is_empty() => return Err(failure),
                Err(failure) => {
                    let ends = matches!(failure.kind(), Kind::Interrupted | Kind::Bus | Kind::NoAnswer);
                    each.failures.push(failure);
                    if ends {
                        break;
                    }
                }
            }
        }
        Ok(each)
    })
}

impl<T> Each<T> {
    /// The results, without their nodes, and what the command ends with.
    pub(super) fn into_parts(self) -> (Vec<T>, Each<T>) {
        let Each { asked, done, failures } = self;
        (done.into_iter().map(|(_, done)| done).collect(), Each { asked, done: Vec::new(), failures })
    }

    /// Turns failures that `all` tolerates into notes, if at least one node succeeded: `all` does not mean the
    /// nodes that lack the feature.
    pub(super) fn excuse(&mut self, global: &Global, excused: impl Fn(&Failure) -> bool) {
        if self.done.is_empty() {
            return;
        }
        let (without, failed): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.failures).into_iter().partition(|failure| excused(failure));
        without.iter().for_each(|failure| global.console().note(&ErrorMessage::from(failure).message));
        self.failures = failed;
    }

    /// The result of the command.
    ///
    /// # Errors
    /// The failures, with the exit code for several nodes.
    pub(super) fn end(self) -> anyhow::Result<()> {
        Ok(several(self.asked, self.failures)?)
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
