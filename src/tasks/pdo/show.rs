//! Shows the settings of TPDOs with their signals.

use super::failure::{PdoFailure, read_failure};
use super::session::Session;
use super::settings::Settings;
use crate::canopen::id::NodeId;
use crate::canopen::pdo::{MappingEntry, TpdoNumber};
use crate::device::unit::Unit;
use crate::master::Master;
use crate::node::{Node, Overrides};
use crate::tasks::Failure;
use crate::tasks::settings::open;
use std::time::Duration;

/// An entry of a mapping, with its signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MappedItem {
    /// The entry.
    pub entry: MappingEntry,
    /// `pressure`, `pressure.status`, or the name of the object; `None` if the object has no name.
    pub signal: Option<String>,
    /// The unit of a process value, if the device reports it.
    pub unit: Option<Unit>,
}

/// The settings of a TPDO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TpdoReport {
    /// The node.
    pub node: NodeId,
    /// The settings.
    pub settings: Settings,
    /// The mapping, in the order of the bytes.
    pub items: Vec<MappedItem>,
}

impl TpdoReport {
    /// Adds the signals of the node to the settings.
    pub(super) fn new(node: &Node, settings: Settings) -> TpdoReport {
        let items = settings.mapping.iter().map(|&entry| mapped_item(node, entry)).collect();
        TpdoReport { node: node.id, settings, items }
    }

    /// Returns the inhibit time; `None` if the device has none.
    pub fn inhibit(&self) -> Option<Duration> {
        self.settings.inhibit_100us.map(|inhibit| Duration::from_micros(100) * u32::from(inhibit))
    }
}

fn mapped_item(node: &Node, entry: MappingEntry) -> MappedItem {
    if let Some(signal) = node.signals.iter().find(|signal| signal.is_value(entry.object)) {
        return MappedItem { entry, signal: Some(signal.name.clone()), unit: signal.unit };
    }
    if let Some(signal) = node.signals.iter().find(|signal| signal.status == Some(entry.object)) {
        return MappedItem { entry, signal: Some(format!("{}.status", signal.name)), unit: None };
    }
    let layout = node.layout();
    let name = Some(layout.name_of(entry.object)).filter(|name| *name != entry.object.to_string());
    MappedItem { entry, signal: name, unit: layout.unit_of(entry.object) }
}

/// Whether the TPDO may have an inhibit time (180xh:3). A description with objects lists all objects of the device.
pub(super) fn may_have_inhibit_time(node: &Node, number: TpdoNumber) -> bool {
    let described = node.model.as_ref().filter(|model| !model.description.objects.is_empty());
    described.is_none_or(|model| model.dictionary.get(number.communication(3)).is_some())
}

/// Returns the numbers of the node's TPDOs.
pub(super) fn tpdo_numbers(node: &Node) -> Vec<TpdoNumber> {
    node.tpdos.iter().map(|tpdo| tpdo.number).collect()
}

/// Reads the settings of all TPDOs of a node, or of one TPDO.
///
/// # Errors
/// No answer; the node does not have the TPDO; bus errors and Ctrl-C.
pub fn show(
    master: &mut Master<'_>,
    node: NodeId,
    number: Option<TpdoNumber>,
    overrides: &Overrides,
) -> Result<Vec<TpdoReport>, Failure> {
    let node = open(master, node, overrides)?;
    let available = tpdo_numbers(&node);
    let wanted = number.map_or_else(|| available.clone(), |number| vec![number]);
    if wanted.is_empty() {
        return Err(Failure::at(node.id, PdoFailure::NoTpdo));
    }
    let mut session = Session { accepts_silence: true, ..Session::new(master, &node) };
    let read = |number| {
        let settings = Settings::read(&mut session, number, may_have_inhibit_time(&node, number));
        let settings = settings.map_err(|error| read_failure(node.id, available.clone(), error))?;
        Ok(TpdoReport::new(&node, settings))
    };
    wanted.into_iter().map(read).collect()
}
