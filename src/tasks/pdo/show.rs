//! How TPDOs are set up, with what they carry by name.

use super::device::{Device, Trouble};
use super::mend::inhibit_time;
use super::settings::Settings;
use crate::canopen::id::NodeId;
use crate::canopen::pdo::{MappingEntry, TpdoNumber};
use crate::device::unit::Unit;
use crate::master::Master;
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::survey_nodes;
use crate::tasks::{Failure, Kind};
use std::time::Duration;

/// One entry of a mapping, and what it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Carried {
    /// The entry.
    pub entry: MappingEntry,
    /// `pressure`, `pressure.status`; `None` of an object that is no signal.
    pub signal: Option<String>,
    /// The unit of a measured value, where the device tells it.
    pub unit: Option<Unit>,
}

/// A TPDO as it is set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Of which node.
    pub node: NodeId,
    /// What it is set to.
    pub settings: Settings,
    /// What it carries, in the order of its bytes.
    pub carried: Vec<Carried>,
}

impl Shown {
    /// The settings with what is known of the device.
    pub(super) fn new(instrument: &Node, settings: Settings) -> Shown {
        let carried = settings.mapping.iter().map(|&entry| carried(instrument, entry)).collect();
        Shown { node: instrument.id, settings, carried }
    }

    /// The inhibit time; `None` where the device has none.
    pub fn inhibit(&self) -> Option<Duration> {
        self.settings.inhibit_100us.map(inhibit_time)
    }
}

fn carried(instrument: &Node, entry: MappingEntry) -> Carried {
    if let Some(signal) = instrument.signals.iter().find(|signal| signal.is_value(entry.object)) {
        return Carried { entry, signal: Some(signal.name.clone()), unit: signal.unit };
    }
    let status = instrument.signals.iter().find(|signal| signal.status == Some(entry.object));
    Carried { entry, signal: status.map(|signal| format!("{}.status", signal.name)), unit: None }
}

/// Whether 180xh:3 is worth a question: a description that lists the objects lists all of them.
pub(super) fn may_inhibit(instrument: &Node, number: TpdoNumber) -> bool {
    let described = instrument.model.as_ref().filter(|model| !model.description.objects.is_empty());
    described.is_none_or(|model| model.dictionary.get(number.communication(3)).is_some())
}

/// The TPDOs of a node, or one of them.
///
/// # Errors
/// A node that does not answer, a TPDO that it does not have, and what stops everything.
pub fn show(
    master: &mut Master<'_>,
    node: NodeId,
    number: Option<TpdoNumber>,
    overrides: &Overrides,
) -> Result<Vec<Shown>, Failure> {
    master.listen_to(&[node])?;
    let found = survey_nodes(master, &[node], overrides)?.pop();
    let instrument = found.ok_or_else(|| Failure::of_node(Kind::NoAnswer, node, "it is not there"))?;
    let there: Vec<TpdoNumber> = instrument.tpdos.iter().map(|tpdo| tpdo.number).collect();
    let wanted = match number {
        None => there,
        Some(number) => vec![there.iter().copied().find(|&there| there == number).unwrap_or(number)],
    };
    if wanted.is_empty() {
        return Err(Failure::of_node(Kind::Unexpected, node, "it has no TPDO"));
    }
    let mut device = Device::new(master, &instrument);
    let read = |number| {
        let settings = Settings::read(&mut device, number, may_inhibit(&instrument, number));
        settings.map(|settings| Shown::new(&instrument, settings)).map_err(|trouble| unread(&instrument, trouble))
    };
    wanted.into_iter().map(read).collect()
}

/// Why a TPDO could not be read.
pub(super) fn unread(instrument: &Node, trouble: Trouble) -> Failure {
    match trouble {
        Trouble::Refused(error) => {
            let numbers: Vec<String> = instrument.tpdos.iter().map(|tpdo| tpdo.number.get().to_string()).collect();
            Failure::from(error).hint(format!("its TPDOs: {}", numbers.join(", ")))
        }
        Trouble::Lost(error) => error.into(),
        Trouble::Stopped(error) => error.into(),
        Trouble::Restarted => Failure::of_node(Kind::Unexpected, instrument.id, "it restarted in the middle"),
        Trouble::NotKept(object, reads, wrote) => {
            let message = format!("{object} reads {reads} instead of {wrote}");
            Failure::of_node(Kind::Unexpected, instrument.id, message)
        }
    }
}
