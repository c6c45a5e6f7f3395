//! The settings that a device keeps after a reset: their objects and values, and the reset itself.

use super::Group;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::device::description::{Access, ObjectEntry};
use crate::device::standard;
use crate::master::{Master, Request, SdoError, SdoFailure};
use crate::node::{Node, state};
use crate::tasks::note::StateEffect;
use crate::tasks::{Effect, Fact, Failure, Note};

/// Settings of CiA 301 and CiA 404, which are read if the description does not list the stored settings.
const COMMUNICATION_OBJECTS: [u16; 11] =
    [0x1005, 0x1006, 0x1007, 0x100c, 0x100d, 0x1012, 0x1014, 0x1015, 0x1017, 0x1019, 0x1f80];
const APPLICATION_OBJECTS: [u16; 14] =
    [0x6110, 0x6112, 0x6114, 0x6124, 0x6126, 0x6127, 0x6131, 0x6132, 0x6133, 0x6134, 0x6135, 0x6136, 0x61a0, 0x61a1];
/// The number of TPDOs and channels that are read in this case.
const MAX_NUMBER: u8 = 4;

/// The value of an object at one time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snapshot {
    /// The object.
    pub object: ObjectId,
    /// Its name, if it is known.
    pub name: Option<String>,
    /// Its bytes, in the width of its type if the type is known.
    pub bytes: Vec<u8>,
    /// Its type, if it is known.
    pub data_type: Option<DataType>,
}

impl Snapshot {
    /// Returns the value, or the bytes if they do not fit the type.
    pub fn value(&self) -> Value {
        let value = self.data_type.and_then(|data_type| data_type.decode(&self.bytes).ok());
        value.unwrap_or_else(|| Value::Bytes(self.bytes.clone()))
    }
}

/// Returns the objects of the description; `None` if the description does not list the stored objects.
fn described(device: &Node) -> Option<&[ObjectEntry]> {
    let entries = &device.model.as_ref()?.description.objects;
    entries.iter().any(|entry| entry.stored.is_some()).then_some(entries)
}

/// Returns the readable settings of these groups.
pub(in crate::tasks) fn objects(device: &Node, groups: &[Group]) -> Vec<ObjectId> {
    let is_included = |stored: &str| groups.iter().any(|group| group.contains(stored));
    if let Some(entries) = described(device) {
        return entries
            .iter()
            // Node-ID and bit rate are stored by their own signature, and reading them returns the future value.
            .filter(|entry| entry.signature.is_none() && entry.access.is_readable())
            .filter(|entry| entry.stored.is_some_and(|group| is_included(group.as_str())))
            .flat_map(|entry| entry.objects())
            .collect();
    }
    let mut objects = Vec::new();
    if is_included("comm") {
        objects.extend(COMMUNICATION_OBJECTS.map(|index| ObjectId::new(index, 0)));
        for number in 0..u16::from(MAX_NUMBER) {
            objects.extend([1, 2, 3, 5].map(|sub| ObjectId::new(0x1800 + number, sub)));
            objects.extend((0..=8).map(|sub| ObjectId::new(0x1a00 + number, sub)));
        }
    }
    if is_included("app") {
        let channels = |index: u16| (1..=MAX_NUMBER).map(move |channel| ObjectId::new(index, channel));
        objects.extend(APPLICATION_OBJECTS.into_iter().flat_map(channels));
    }
    objects
}

/// Reads objects. Rejected objects are omitted.
///
/// # Errors
/// No answer, protocol errors, bus errors and Ctrl-C.
pub(in crate::tasks) fn read_settings(
    master: &mut Master<'_>,
    device: &Node,
    objects: &[ObjectId],
) -> Result<Vec<Snapshot>, Failure> {
    let requests = objects.iter().map(|&object| Request::read(device.id, object)).collect();
    let answers = master.transfer(requests, &mut |_| {})?;
    let mut settings = Vec::new();
    for (&object, answer) in objects.iter().zip(answers) {
        let answer = match answer {
            Ok(answer) => answer,
            Err(SdoError { failure: SdoFailure::Refused(_), .. }) => continue,
            Err(error) => return Err(error.into()),
        };
        let described = device.model.as_ref().and_then(|model| model.dictionary.get(object)).cloned();
        let entry = described.or_else(|| standard::entry(object));
        let data_type = entry.as_ref().map(|entry| entry.data_type);
        let mut bytes = answer.uploaded.map(|uploaded| uploaded.bytes).unwrap_or_default();
        // A server that does not indicate the size sends four bytes for every type.
        bytes.truncate(data_type.and_then(DataType::width).unwrap_or(usize::MAX));
        settings.push(Snapshot { object, name: entry.map(|entry| entry.full_name()), bytes, data_type });
    }
    Ok(settings)
}

/// Reads the settings that the device does not store (according to its description) and that differ from their
/// defaults.
///
/// # Errors
/// The errors of [`read_settings`].
pub(super) fn not_stored(master: &mut Master<'_>, device: &Node) -> Result<Vec<Snapshot>, Failure> {
    let Some(entries) = described(device) else { return Ok(Vec::new()) };
    let objects: Vec<ObjectId> = entries
        .iter()
        .filter(|entry| entry.access == Access::Rw && entry.signature.is_none() && entry.stored.is_none())
        // The device itself writes this object, so it is not a setting.
        .filter(|entry| entry.name != "error-count")
        .flat_map(|entry| entry.objects())
        .collect();
    let mut settings = read_settings(master, device, &objects)?;
    settings.retain(|setting| default(device, setting.object).is_some_and(|default| default != setting.bytes));
    Ok(settings)
}

/// Returns the factory default of an object in the description.
pub(in crate::tasks) fn default(device: &Node, object: ObjectId) -> Option<Vec<u8>> {
    device.model.as_ref()?.dictionary.get(object)?.default_bytes(device.id)
}

/// Whether the manual contains the default of an object, and the default is the same for all devices.
pub(in crate::tasks) fn is_default_certain(device: &Node, object: ObjectId) -> bool {
    let Some(entries) = described(device) else { return false };
    entries.iter().find(|entry| entry.at.contains(object)).is_some_and(|entry| entry.doubt.is_empty())
}

/// Resets a node, waits for its boot-up, runs `work`, and starts the node again if it was operational. Returns the
/// result of `work`, and a note about the NMT state.
///
/// # Errors
/// No boot-up, the failure of `work`, bus errors and Ctrl-C; with the effect on the NMT state.
pub(in crate::tasks) fn reset<T>(
    master: &mut Master<'_>,
    node: NodeId,
    before: Option<NmtState>,
    work: impl FnOnce(&mut Master<'_>) -> Result<T, Failure>,
) -> Result<(T, Option<Note>), Failure> {
    let was_operational = before == Some(NmtState::Operational);
    let lost = |failure: Failure| match was_operational {
        true => failure.with(node, Effect::WasOperational),
        false => failure,
    };
    state::reset(master, node).map_err(|error| lost(error.into()))?;
    let result = work(master);
    if !was_operational {
        let note = before.is_none().then(|| Note::of_node(node, Fact::StateAsBooted));
        return result.map(|result| (result, note));
    }
    if result.is_err() {
        // After Ctrl-C, or if the node does not answer, the command is sent without a check.
        master.send(NmtCommand::Start.frame(Some(node)));
    }
    let result = result?;
    let reports = state::command(master, NmtCommand::Start, &[node], false).map_err(|error| lost(error.into()))?;
    let before = NmtState::Operational;
    let fact = match reports.first().and_then(|report| report.state) {
        Some(NmtState::Operational) => Fact::OperationalAgain,
        Some(now) => Fact::State(StateEffect::Differs { before, now }),
        None => Fact::State(StateEffect::Unconfirmed { before }),
    };
    Ok((result, Some(Note::of_node(node, fact))))
}
