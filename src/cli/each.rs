//! Commands that change one node after the other.

use super::Global;
use super::args::Nodes;
use super::exit::Several;
use super::open;
use crate::canopen::id::NodeId;
use crate::master::Master;
use crate::node::Overrides;
use crate::tasks::failure::together;
use crate::tasks::{Failure, Kind};

/// What became of every node that was reached.
pub(super) struct Each<T> {
    asked: usize,
    pub(super) done: Vec<(NodeId, T)>,
    failures: Vec<Failure>,
}

/// Does `work` with every node, one after the other. A bus that fails and the wish to stop end it.
pub(super) fn each<T>(
    global: &Global,
    nodes: &Nodes,
    mut work: impl FnMut(&mut Master<'_>, NodeId, &Overrides) -> Result<T, Failure>,
) -> anyhow::Result<Each<T>> {
    global.with_master(|master| {
        let nodes = open::nodes(master, global, nodes)?;
        let overrides = open::overrides(global, &nodes)?;
        let mut each = Each { asked: nodes.len(), done: Vec::new(), failures: Vec::new() };
        for &node in &nodes {
            let result = master.listen_to(&[node]).map_err(Failure::from).and_then(|()| work(master, node, &overrides));
            match result {
                Ok(done) => each.done.push((node, done)),
                Err(failure) => {
                    let ends = matches!(failure.kind, Kind::Interrupted | Kind::Bus);
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
    /// Takes the failures out that a request for everybody excuses: who cannot do it was not meant, unless nobody
    /// can.
    pub(super) fn excuse(&mut self, global: &Global, excused: impl Fn(&Failure) -> bool) {
        if self.done.is_empty() {
            return;
        }
        let (without, failed): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.failures).into_iter().partition(|failure| excused(failure));
        without.iter().for_each(|failure| global.console().note(&failure.message));
        self.failures = failed;
    }

    /// What all of it comes to. Where it was ended, that is what it comes to.
    pub(super) fn end(self) -> anyhow::Result<()> {
        let ended = self.failures.last().filter(|failure| matches!(failure.kind, Kind::Interrupted | Kind::Bus));
        if let Some(kind) = ended.map(|failure| failure.kind) {
            let failures = self.failures.into_iter().map(|failure| Failure { kind, ..failure }).collect();
            return Err(Several(failures).into());
        }
        together(self.asked, self.failures).map_err(|failures| Several(failures).into())
    }
}
