//! The run file, `run.csv.run.json`: facts that the rows of a recording do not contain. Each run is one JSON object.

use super::json;
use crate::bus::Wall;
use crate::node::Node;
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use std::io;

/// A run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RunRecord {
    /// The identifier of the run.
    pub run: String,
    /// The version of the program.
    pub version: &'static str,
    /// The words of the command line.
    pub command: Vec<String>,
    /// The bus, as for `--bus`.
    pub bus: String,
    /// The host name.
    pub host: String,
    /// The tag `bench`, or the host name and the interface.
    pub bench: String,
    /// The name of the first file of the run, without its folder.
    pub file: String,
    /// The number of bytes of earlier runs in this file.
    pub offset: u64,
    /// The time of the first row.
    #[serde(serialize_with = "time")]
    pub started: Wall,
    /// The tags.
    #[serde(serialize_with = "members")]
    pub tags: Vec<(String, String)>,
    /// The nodes. Empty for a passive recording.
    pub nodes: Vec<RunNode>,
}

/// The identity of a node. Unknown facts are null.
#[derive(Clone, Debug, Serialize)]
pub struct RunNode {
    node: u8,
    vendor: Option<u32>,
    product: Option<u32>,
    revision: Option<u32>,
    serial: Option<u32>,
    name: Option<String>,
    device: Option<String>,
}

impl From<&Node> for RunNode {
    fn from(node: &Node) -> RunNode {
        let [vendor, product, revision, serial] = node.identity.numbers();
        let device = node.model.as_ref().map(|model| model.description.name.clone());
        RunNode { node: node.id.get(), vendor, product, revision, serial, name: node.identity.name.clone(), device }
    }
}

impl RunRecord {
    /// Returns the run as one line of JSON.
    ///
    /// # Errors
    /// None: writing to memory cannot fail.
    pub fn line(&self) -> io::Result<Vec<u8>> {
        let mut line = Vec::new();
        json::line(&mut line, self)?;
        Ok(line)
    }
}

fn time<S: Serializer>(time: &Wall, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&humantime::format_rfc3339_micros(time.system_time()))
}

fn members<S: Serializer>(tags: &[(String, String)], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(tags.len()))?;
    tags.iter().try_for_each(|(key, value)| map.serialize_entry(key, value))?;
    map.end()
}
