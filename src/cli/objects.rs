//! `cangauge objects`.

use super::exit::IntoFailure;
use super::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::{NodeId, parse_u32};
use cangauge::device::catalog::{self, Model};
use cangauge::device::dictionary::Entry;
use cangauge::node::names::nearest;
use cangauge::node::survey::identify;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::objects::ObjectFacts;
use clap::Args;
use std::path::Path;
use std::sync::Arc;

/// Show the objects of a device from its description or EDS
///
/// Prints name, type, access, range, default and unit of each object. With OBJECT or WORD, only these objects are
/// printed, with their meaning, page in the manual and unclear points. With DEVICE, --device or --eds, no bus is used.
/// With NODE, only the identity of the node is read.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge objects mh4\n  cangauge objects mh4 0x1800 filter\n  cangauge objects --eds FILE.eds temperature\n  cangauge -b sim objects 127 6148h:1 --format json"
)]
pub(crate) struct Objects {
    /// Node-ID, the name of a description (mh4), or a file (FILE.toml, FILE.eds); omit it with --device or --eds
    #[arg(value_name = "NODE|DEVICE")]
    what: Option<String>,
    /// Show only objects with this address, index or name, or with this word in their name or meaning
    #[arg(value_name = "OBJECT|WORD")]
    queries: Vec<String>,
}

impl Objects {
    fn node(&self) -> Option<NodeId> {
        self.what.as_deref()?.parse().ok()
    }

    /// The node whose identity is read.
    pub(super) fn claim(&self) -> Claim {
        self.node().map_or(Claim::Nothing, |node| Claim::Nodes(vec![node]))
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (model, queries) = self.model(global)?;
        let mut found = Vec::new();
        for query in &queries {
            let matching = model.search(query);
            if matching.is_empty() {
                return Err(unknown(&model, query).into());
            }
            found.extend(matching);
        }
        let is_detailed = !queries.is_empty();
        if !is_detailed {
            found = model.dictionary.iter().collect();
        }
        found.sort_by_key(|entry| entry.object);
        found.dedup_by_key(|entry| entry.object);
        let facts = found.into_iter().map(|entry| ObjectFacts { model: &model, entry, is_detailed });
        global.print(&facts.collect::<Vec<_>>())
    }

    /// Returns the description, and the objects or words to search for.
    fn model(&self, global: &Global) -> anyhow::Result<(Arc<Model>, Vec<String>)> {
        let queries = self.queries.clone();
        let node = self.node();
        let named = descriptions::overrides(global, &[node.unwrap_or(NodeId::MIN)])?.into_values().next();
        global.pending.take();
        if let Some(node) = node {
            let model = named.map_or_else(|| of_node(global, node), Ok)?;
            return Ok((model, queries));
        }
        match (&self.what, named) {
            (Some(what), named) if catalog::by_name(what).is_some() || is_file(what) || Path::new(what).is_file() => {
                let own = descriptions::model(what, false, global)?;
                Ok((named.map_or_else(|| Arc::clone(&own), |eds| Arc::new(own.with_eds(&eds))), queries))
            }
            (Some(word), Some(named)) => Ok((named, [vec![word.clone()], queries].concat())),
            (None, Some(named)) => Ok((named, queries)),
            (Some(what), None) => match what.parse::<NodeId>() {
                Err(error) if parse_u32(what).is_some() => Err(ErrorMessage::usage(error.to_string()).into()),
                _ => Ok((descriptions::model(what, false, global)?, queries)),
            },
            (None, None) => {
                let hint = "cangauge objects mh4; cangauge objects --eds FILE.eds; cangauge objects 5";
                Err(ErrorMessage::usage("which node or device?").hint(hint).into())
            }
        }
    }
}

fn is_file(what: &str) -> bool {
    let what = what.to_ascii_lowercase();
    [".toml", ".eds", ".dcf"].iter().any(|extension| what.ends_with(extension))
}

/// The description of the device at a node.
fn of_node(global: &Global, node: NodeId) -> anyhow::Result<Arc<Model>> {
    let found = global.with_master(|master| {
        master.listen_to(&[node]).or_fail()?;
        Ok(identify(master, &[node], &Default::default()).or_fail()?.pop())
    })?;
    found.and_then(|node| node.model).ok_or_else(|| {
        let message = format!("node {node}: no description is known for this device");
        let hint =
            format!("add its EDS: cangauge objects {node} --eds FILE; or describe it: cangauge devices new {node}");
        ErrorMessage::usage(message).hint(hint).into()
    })
}

fn unknown(model: &Model, query: &str) -> ErrorMessage {
    let message = format!("{} has no object \"{query}\"", model.description.title);
    match nearest(query, model.dictionary.iter().map(Entry::full_name)) {
        names if names.is_empty() => ErrorMessage::usage(message),
        names => ErrorMessage::usage(message).hint(format!("similar names: {}", names.join(", "))),
    }
}
