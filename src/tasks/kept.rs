//! What a device keeps beyond a reset: which objects these are, what they hold, and the reset that shows it.

use crate::canopen::id::NodeId;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::description::{Access, ObjectEntry};
use crate::device::standard;
use crate::master::{Error, Master, Request, SdoError, SdoFailure};
use crate::node::Node;
use crate::tasks::nmt;
use crate::tasks::store::Group;
use crate::tasks::{Failure, Kind};

/// Settings that CiA 301 and CiA 404 define, looked for on a device whose description does not say what it keeps.
const COMMUNICATION: [u16; 11] =
    [0x1005, 0x1006, 0x1007, 0x100c, 0x100d, 0x1012, 0x1014, 0x1015, 0x1017, 0x1019, 0x1f80];
const APPLICATION: [u16; 14] =
    [0x6110, 0x6112, 0x6114, 0x6124, 0x6126, 0x6127, 0x6131, 0x6132, 0x6133, 0x6134, 0x6135, 0x6136, 0x61a0, 0x61a1];
/// TPDOs and channels looked for on such a device.
const TRIED: u8 = 4;

/// What an object holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Held {
    pub(super) object: ObjectId,
    /// In the width of its type, where the type is known.
    pub(super) bytes: Vec<u8>,
    name: Option<String>,
    data_type: Option<DataType>,
}

impl Held {
    /// Address and name: `0x1017:0 producer-heartbeat-time`.
    pub(super) fn name(&self) -> String {
        match &self.name {
            Some(name) => format!("{} {name}", self.object),
            None => self.object.to_string(),
        }
    }

    /// Bytes as a value of this object.
    pub(super) fn show(&self, bytes: &[u8]) -> String {
        match self.data_type.and_then(|data_type| data_type.decode(bytes).ok()) {
            Some(value) => value.to_string(),
            None => bytes.iter().fold("0x".to_owned(), |text, byte| format!("{text}{byte:02X}")),
        }
    }
}

/// The marked entries of a device's description; none where it does not say what 1010h keeps.
fn marked(device: &Node) -> Option<&[ObjectEntry]> {
    let entries = &device.model.as_ref()?.description.objects;
    entries.iter().any(|entry| entry.stored.is_some()).then_some(entries)
}

/// The objects that a store or a restore of these groups reaches, so far as they can be read and hold a value.
pub(super) fn objects(device: &Node, groups: &[Group]) -> Vec<ObjectId> {
    let reached = |stored: &str| groups.iter().any(|group| group.reaches(stored));
    if let Some(entries) = marked(device) {
        return entries
            .iter()
            // Node-ID and bit rate have their own way, and read as what they will be.
            .filter(|entry| entry.signature.is_none() && entry.access.is_readable())
            .filter(|entry| entry.stored.is_some_and(|group| reached(group.as_str())))
            .flat_map(|entry| entry.objects())
            .collect();
    }
    let mut objects = Vec::new();
    if reached("comm") {
        objects.extend(COMMUNICATION.map(|index| ObjectId::new(index, 0)));
        for number in 0..u16::from(TRIED) {
            objects.extend([1, 2, 3, 5].map(|sub| ObjectId::new(0x1800 + number, sub)));
            objects.extend((0..=8).map(|sub| ObjectId::new(0x1a00 + number, sub)));
        }
    }
    if reached("app") {
        let channels = |index: u16| (1..=TRIED).map(move |channel| ObjectId::new(index, channel));
        objects.extend(APPLICATION.into_iter().flat_map(channels));
    }
    objects
}

/// What objects hold at present; those that the device refuses to tell are left out.
///
/// # Errors
/// Silence, and what stops everything.
pub(super) fn hold(master: &mut Master<'_>, device: &Node, objects: &[ObjectId]) -> Result<Vec<Held>, Failure> {
    let requests = objects.iter().map(|&object| Request::read(device.id, object)).collect();
    let answers = master.transfer(requests, &mut |_| {})?;
    let mut held = Vec::new();
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
        // A server that omits the size sends four bytes whatever the type.
        bytes.truncate(data_type.and_then(DataType::width).unwrap_or(usize::MAX));
        held.push(Held { object, bytes, name: entry.map(|entry| entry.full_name()), data_type });
    }
    Ok(held)
}

/// What a device holds otherwise than as delivered and does not keep, by its description.
///
/// # Errors
/// Silence, and what stops everything.
pub(super) fn not_kept(master: &mut Master<'_>, device: &Node) -> Result<Vec<String>, Failure> {
    let Some(entries) = marked(device) else { return Ok(Vec::new()) };
    let objects: Vec<ObjectId> = entries
        .iter()
        .filter(|entry| entry.access == Access::Rw && entry.signature.is_none() && entry.stored.is_none())
        // What the device writes by itself is no setting.
        .filter(|entry| entry.name != "error-count")
        .flat_map(|entry| entry.objects())
        .collect();
    let held = hold(master, device, &objects)?;
    let changed = held.iter().filter(|held| default(device, held.object).is_some_and(|default| default != held.bytes));
    Ok(changed.map(|held| format!("{} ({})", held.name(), held.show(&held.bytes))).collect())
}

/// What an object holds as delivered, by the description.
pub(super) fn default(device: &Node, object: ObjectId) -> Option<Vec<u8>> {
    device.model.as_ref()?.dictionary.get(object)?.default_bytes(device.id)
}

/// Whether the default of an object is printed, or only likely, or depends on the piece.
pub(super) fn default_is_sure(device: &Node, object: ObjectId) -> bool {
    let Some(entries) = marked(device) else { return false };
    entries.iter().find(|entry| entry.at.contains(object)).is_some_and(|entry| entry.doubt.is_empty())
}

/// The NMT state of a node, where something tells it.
///
/// # Errors
/// What stops everything.
pub(super) fn state(master: &mut Master<'_>, node: NodeId) -> Result<Option<NmtState>, Error> {
    Ok(nmt::states(master, &[node])?.first().and_then(|report| report.state))
}

/// Resets a node, waits for its boot-up, lets `look` look at it, and puts the NMT state back that it `was` in.
/// Returns what `look` found, and what is to be said of the state.
///
/// # Errors
/// A node that does not boot, what `look` fails with, and what stops everything; each says what became of the
/// state.
pub(super) fn reset<T>(
    master: &mut Master<'_>,
    node: NodeId,
    was: Option<NmtState>,
    look: impl FnOnce(&mut Master<'_>) -> Result<T, Failure>,
) -> Result<(T, Option<String>), Failure> {
    let ran = was == Some(NmtState::Operational);
    let lost = |failure: Failure| match ran {
        true => failure.knowing(node, format!("it was operational: cangauge nmt start {node}")),
        false => failure,
    };
    let reports = nmt::command(master, NmtCommand::ResetNode, &[node], false).map_err(|error| lost(error.into()))?;
    if reports.iter().all(|report| report.state.is_none()) {
        let failure = Failure::of_node(Kind::NoAnswer, node, "no boot-up came after the reset");
        return Err(lost(failure).hint(format!("is it there? cangauge nmt state {node}; cangauge scan")));
    }
    let found = look(master);
    if !ran {
        let note = was.is_none().then(|| "what state it was in is not known: it is as it boots".to_owned());
        return found.map(|found| (found, note));
    }
    if found.is_err() {
        // Whoever asked to stop, or cannot be answered, gets no more than the command itself.
        master.send(NmtCommand::Start.frame(Some(node)));
    }
    let found = found?;
    let reports = nmt::command(master, NmtCommand::Start, &[node], false).map_err(|error| lost(error.into()))?;
    let note = match reports.first().and_then(|report| report.state) {
        Some(NmtState::Operational) => "it was operational and is again".to_owned(),
        Some(state) => format!("it was operational, was told to start, and is {state}"),
        None => "it was operational and was told to start again; nothing confirms it".to_owned(),
    };
    Ok((found, Some(note)))
}
