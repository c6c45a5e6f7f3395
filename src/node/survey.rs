//! Reads the facts for decoding the measurements of a device: identity, TPDOs, units, digits.
//!
//! Many nodes are read in parallel, in the same steps. They are read with an [`ObjectReader`]: the master, which waits
//! for the answers, or a [`BackgroundSurvey`], which does not wait.

mod background;
mod ranges;
mod tpdos;

use super::read::{Item, Reader, read_values};
use super::{Identity, Node, signals};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::CobId;
use crate::canopen::value::{DataType, Value};
use crate::device::catalog::{IdentityAnswers, Model, objects_to_read, recognise};
use crate::device::quirk::Quirk;
use crate::device::unit::Unit;
use crate::master::{Answer, Error, Master, Request, SdoError, SdoFailure};
use crate::measure::layout::PROCESS_VALUES;
pub use background::BackgroundSurvey;
pub use ranges::narrow_values;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

const U8: DataType = DataType::Unsigned(1);
const U16: DataType = DataType::Unsigned(2);
const U32: DataType = DataType::Unsigned(4);

/// The descriptions that the user named, by node.
pub type Overrides = BTreeMap<NodeId, Arc<Model>>;

/// The extra time that reading the setup may take, in addition to the duration of a recording or display.
pub const SETUP_TIMEOUT: Duration = Duration::from_secs(10);

/// Reads objects for a survey.
pub trait ObjectReader {
    /// Why the survey cannot continue.
    type Stop: From<Error>;

    /// Reads objects, and returns one result for each, in the same order.
    ///
    /// # Errors
    /// A failure that stops the whole survey. The failure of one device is in its result.
    fn read_objects(&mut self, objects: &[(NodeId, ObjectId)]) -> Result<Vec<Result<Answer, SdoError>>, Self::Stop>;

    /// Sets how a node's SDO server deviates from the standard.
    fn set_quirks(&mut self, node: NodeId, quirks: &[Quirk]);

    /// Whether reading continues if two devices answer with one node-ID.
    fn tolerates_two_devices(&self) -> bool;

    /// Records an optional object without a valid answer.
    fn add_unknown(&mut self, node: NodeId, object: ObjectId);
}

impl ObjectReader for Master<'_> {
    type Stop = Error;

    fn read_objects(&mut self, objects: &[(NodeId, ObjectId)]) -> Result<Vec<Result<Answer, SdoError>>, Error> {
        let requests = objects.iter().map(|&(node, object)| Request::read(node, object)).collect();
        self.transfer(requests, &mut |_| {})
    }

    fn set_quirks(&mut self, node: NodeId, quirks: &[Quirk]) {
        Master::set_quirks(self, node, quirks);
    }

    fn tolerates_two_devices(&self) -> bool {
        Master::tolerates_two_devices(self)
    }

    fn add_unknown(&mut self, node: NodeId, object: ObjectId) {
        Master::add_unknown(self, node, object);
    }
}

fn number(value: Option<&Value>) -> Option<u64> {
    value.and_then(Value::as_u64)
}

fn unsigned<T: TryFrom<u64>>(value: Option<&Value>) -> Option<T> {
    number(value).and_then(|number| T::try_from(number).ok())
}

/// Reads the identity of nodes. The name (1008h) is read only from the nodes for which `reads_name` is true.
fn identities<A: ObjectReader>(
    reader: &mut Reader<'_, A>,
    nodes: &[NodeId],
    reads_name: impl Fn(NodeId, &Identity) -> bool,
) -> Result<Vec<Identity>, A::Stop> {
    let objects = [
        (ObjectId::DEVICE_TYPE, U32),
        (ObjectId::new(0x1018, 1), U32),
        (ObjectId::new(0x1018, 2), U32),
        (ObjectId::new(0x1018, 3), U32),
        (ObjectId::new(0x1018, 4), U32),
    ];
    let items: Vec<Item> =
        nodes.iter().flat_map(|&node| objects.map(|(object, data_type)| (node, object, data_type))).collect();
    let values = reader.values(&items)?;
    let mut identities: Vec<Identity> = values
        .chunks(objects.len())
        .map(|values| Identity {
            device_type: unsigned(values[0].as_ref()),
            vendor: unsigned(values[1].as_ref()),
            product: unsigned(values[2].as_ref()),
            revision: unsigned(values[3].as_ref()),
            serial: unsigned(values[4].as_ref()),
            name: None,
        })
        .collect();
    let needs_name = |(node, identity): &(&NodeId, &Identity)| reads_name(**node, identity);
    let named: Vec<NodeId> = nodes.iter().zip(&identities).filter(needs_name).map(|(node, _)| *node).collect();
    let items: Vec<Item> =
        named.iter().map(|&node| (node, ObjectId::new(0x1008, 0), DataType::VisibleString)).collect();
    let mut names: BTreeMap<NodeId, Option<Value>> = named.into_iter().zip(reader.values(&items)?).collect();
    for (identity, node) in identities.iter_mut().zip(nodes) {
        if let Some(Some(Value::Text(name))) = names.remove(node) {
            identity.name = Some(name);
        }
    }
    Ok(identities)
}

/// Reads vendor, product and revision (1018h:1 to 3) of nodes. A missing number is `None`.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn revisions(master: &mut Master<'_>, nodes: &[NodeId]) -> Result<BTreeMap<NodeId, [Option<u32>; 3]>, Error> {
    let subs = [1, 2, 3];
    let items: Vec<Item> =
        nodes.iter().flat_map(|&node| subs.map(|sub| (node, ObjectId::new(0x1018, sub), U32))).collect();
    let values: Vec<Option<Value>> = read_values(master, &items)?.into_iter().map(Result::ok).collect();
    let devices = nodes.iter().zip(values.chunks(subs.len()));
    Ok(devices.map(|(&node, values)| (node, [0, 1, 2].map(|at: usize| unsigned(values[at].as_ref())))).collect())
}

/// Reads everything of the nodes: identity, signals with unit and digits, TPDOs.
///
/// # Errors
/// A node does not answer, or the survey cannot continue.
pub fn survey_nodes<A: ObjectReader>(
    master: &mut A,
    nodes: &[NodeId],
    overrides: &Overrides,
) -> Result<Vec<Node>, A::Stop> {
    survey_with(&mut Reader::new(master), nodes, overrides)
}

/// Like [`survey_nodes`], with a reader that keeps the answers for further reads.
///
/// # Errors
/// As [`survey_nodes`].
pub fn survey_with<A: ObjectReader>(
    reader: &mut Reader<'_, A>,
    nodes: &[NodeId],
    overrides: &Overrides,
) -> Result<Vec<Node>, A::Stop> {
    let mut found = identify_with(reader, nodes, overrides)?;
    read_services(reader, &mut found)?;
    tpdos::read_tpdos(reader, &mut found)?;
    find_signals(reader, &mut found)?;
    read_units(reader, &mut found)?;
    ranges::read_ranges(reader, &mut found)?;
    ranges::read_overloads(reader, &mut found)?;
    Ok(found)
}

/// Reads identities and finds the descriptions that fit. The name (1008h) is read only if the user did not name the
/// description of the device.
///
/// # Errors
/// A node does not answer, or the survey cannot continue.
pub fn identify<A: ObjectReader>(
    master: &mut A,
    nodes: &[NodeId],
    overrides: &Overrides,
) -> Result<Vec<Node>, A::Stop> {
    identify_with(&mut Reader::new(master), nodes, overrides)
}

fn identify_with<A: ObjectReader>(
    reader: &mut Reader<'_, A>,
    nodes: &[NodeId],
    overrides: &Overrides,
) -> Result<Vec<Node>, A::Stop> {
    // Some devices can be read only with their quirks. So the quirks of the named descriptions are set first.
    for (node, model) in overrides {
        reader.master.set_quirks(*node, &model.description.quirks);
    }
    let reads_name = |node, identity: &Identity| {
        overrides.get(&node).is_none_or(|model| model.description.signals.is_empty() && !identity.fits(model))
    };
    let identities = identities(reader, nodes, reads_name)?;
    let mut traits: Vec<IdentityAnswers> = identities.iter().map(Identity::traits).collect();
    let extra_reads: Vec<(usize, ObjectId)> = nodes
        .iter()
        .enumerate()
        .filter(|(at, node)| reads_name(**node, &identities[*at]))
        .flat_map(|(at, _)| objects_to_read(&traits[at]).into_iter().map(move |object| (at, object)))
        .collect();
    let objects: Vec<(NodeId, ObjectId)> = extra_reads.iter().map(|&(at, object)| (nodes[at], object)).collect();
    for (&(at, object), answer) in extra_reads.iter().zip(reader.answers(&objects)?) {
        traits[at].answers.extend(answer.and_then(|answer| answer.uploaded).map(|uploaded| (object, uploaded.bytes)));
    }
    let mut found: Vec<Node> = nodes.iter().map(|&node| Node::new(node)).collect();
    for ((node, identity), traits) in found.iter_mut().zip(identities).zip(&traits) {
        let given = overrides.get(&node.id).cloned();
        node.model = match given {
            // If the EDS is for another device, only its names are used. Types and units come from the description.
            Some(model) if model.description.signals.is_empty() && !identity.fits(&model) => {
                let own = recognise(traits).map(|own| Arc::new(own.with_eds(&model)));
                own.or(Some(model))
            }
            given => given.or_else(|| recognise(traits)),
        };
        node.identity = identity;
        node.is_identified = true;
        if let Some(model) = &node.model {
            reader.master.set_quirks(node.id, &model.description.quirks);
        }
    }
    Ok(found)
}

fn read_services<A: ObjectReader>(reader: &mut Reader<'_, A>, nodes: &mut [Node]) -> Result<(), A::Stop> {
    let objects = [
        (ObjectId::new(0x1017, 0), U16),
        (ObjectId::new(0x1014, 0), U32),
        (ObjectId::new(0x1005, 0), U32),
        (ObjectId::new(0x1019, 0), U8),
    ];
    let items: Vec<Item> = nodes
        .iter()
        .flat_map(|node| objects[..3].iter().map(|&(object, data_type)| (node.id, object, data_type)))
        .collect();
    let values = reader.values(&items)?;
    // If a description lists the SYNC object but not 1019h, the device has no SYNC counter.
    let may_count = |node: &Node| match &node.model {
        Some(model) => model.dictionary.has_index(0x1019) || !model.dictionary.has_index(0x1005),
        None => true,
    };
    let counting: Vec<usize> = (0..nodes.len()).filter(|&at| may_count(&nodes[at])).collect();
    let items: Vec<Item> = counting.iter().map(|&at| (nodes[at].id, objects[3].0, objects[3].1)).collect();
    for (&at, value) in counting.iter().zip(reader.values(&items)?) {
        nodes[at].sync_overflow = unsigned(value.as_ref()).filter(|overflow| (2..=240).contains(overflow));
    }
    for (node, values) in nodes.iter_mut().zip(values.chunks(3)) {
        node.heartbeat_ms = unsigned(values[0].as_ref());
        if let Some(word) = unsigned(values[1].as_ref()).map(CobId).filter(|word| word.is_valid()) {
            node.emergency = word.can_id();
        }
        if let Some(word) = unsigned(values[2].as_ref()).map(CobId) {
            node.sync = word.can_id();
        }
    }
    Ok(())
}

/// Finds the signals of each node. The first of these that exists is used: the signals of the description, the channels
/// of CiA 404, the values of the profile together with the contents of the TPDOs.
fn find_signals<A: ObjectReader>(reader: &mut Reader<'_, A>, nodes: &mut [Node]) -> Result<(), A::Stop> {
    let mut unknown = Vec::new();
    let mut others = Vec::new();
    for (at, node) in nodes.iter_mut().enumerate() {
        match node.model.clone().filter(|model| !model.description.signals.is_empty()) {
            Some(model) => {
                let entries = model.description.signals.iter();
                node.signals = entries.map(|entry| signals::described(node, entry)).collect();
            }
            None if signals::can_have_channels(node) => unknown.push(at),
            None => others.push(at),
        }
    }
    let items: Vec<Item> = unknown
        .iter()
        .flat_map(|&at| PROCESS_VALUES.map(|(index, _)| (nodes[at].id, ObjectId::new(index, 0), U8)))
        .collect();
    let counts = reader.values(&items)?;
    for (&at, counts) in unknown.iter().zip(counts.chunks(PROCESS_VALUES.len())) {
        let node = &mut nodes[at];
        let values = channel_values(node, counts);
        node.signals = values.into_iter().map(|value| signals::channel(node, value)).collect();
        if node.signals.is_empty() {
            others.push(at);
        }
    }
    find_objects(reader, nodes, &others)
}

/// The object with the process value of each channel. `counts` are the values of sub-index 0 of [`PROCESS_VALUES`].
fn channel_values(node: &Node, counts: &[Option<Value>]) -> Vec<ObjectId> {
    let channels = |value: &Option<Value>| unsigned::<u8>(value.as_ref()).unwrap_or(0).min(199);
    if let Some((&(index, _), count)) = PROCESS_VALUES.iter().zip(counts).find(|(_, count)| channels(count) > 0) {
        return (1..=channels(count)).map(|channel| ObjectId::new(index, channel)).collect();
    }
    // If sub-index 0 cannot be read, the mapping of the TPDOs shows which channels exist.
    let mapped = node.tpdos.iter().flat_map(|tpdo| &tpdo.mapping).map(|entry| entry.object);
    let rank = |object: ObjectId| PROCESS_VALUES.iter().position(|&(index, _)| index == object.index);
    let mut known: Vec<(u8, usize)> = mapped.filter_map(|object| Some((object.sub, rank(object)?))).collect();
    known.sort_unstable();
    known.dedup_by_key(|(channel, _)| *channel);
    known.into_iter().map(|(channel, rank)| ObjectId::new(PROCESS_VALUES[rank].0, channel)).collect()
}

/// Finds the signals of devices without channels of CiA 404.
fn find_objects<A: ObjectReader>(
    reader: &mut Reader<'_, A>,
    nodes: &mut [Node],
    others: &[usize],
) -> Result<(), A::Stop> {
    let rows: Vec<_> = others
        .iter()
        .flat_map(|&at| signals::profile_values(&nodes[at]).map(move |(row, object)| (at, row, object)))
        .collect();
    let data_type = |node: &Node, object: ObjectId| node.layout().data_type(object).unwrap_or(U8);
    let items: Vec<Item> =
        rows.iter().map(|&(at, _, object)| (nodes[at].id, object, data_type(&nodes[at], object))).collect();
    let values = reader.values(&items)?;
    for &at in others {
        let own = rows.iter().zip(&values).filter(|((of, ..), _)| *of == at);
        let found = own.flat_map(|((_, row, _), value)| {
            // A negative value is not a count, but shows that the device has the object.
            let number = value.as_ref().map(|value| value.as_u64().unwrap_or(0));
            signals::values_of(*row, number)
        });
        nodes[at].signals = signals::objects(&nodes[at], found.collect::<Vec<_>>());
    }
    Ok(())
}

fn read_units<A: ObjectReader>(reader: &mut Reader<'_, A>, nodes: &mut [Node]) -> Result<(), A::Stop> {
    // Node, signal, and the objects with the unit, the decimal digits and the resolution of the signal.
    let mut wanted: Vec<(usize, usize, [Option<ObjectId>; 3])> = Vec::new();
    for (at, node) in nodes.iter().enumerate() {
        for (number, signal) in node.signals.iter().enumerate() {
            let [unit, digits] = signals::unit_and_digits(node, signal);
            wanted.push((at, number, [unit, digits, signals::step(node, signal).map(|step| step.object)]));
        }
    }
    let objects: BTreeSet<(usize, ObjectId)> = wanted
        .iter()
        .flat_map(|&(at, _, objects)| objects.into_iter().flatten().map(move |object| (at, object)))
        .collect();
    let items: Vec<(NodeId, ObjectId)> = objects.iter().map(|&(at, object)| (nodes[at].id, object)).collect();
    let mut values: BTreeMap<(usize, ObjectId), Value> = BTreeMap::new();
    let mut refused: BTreeSet<(usize, ObjectId)> = BTreeSet::new();
    for ((at, object), answer) in objects.into_iter().zip(reader.read_optional(&items)?) {
        let node = &nodes[at];
        let is_unit = wanted.iter().any(|&(of, _, [unit, ..])| of == at && unit == Some(object));
        let or_else = if is_unit { U32 } else { U8 };
        let data_type = node.layout().data_type(object).unwrap_or(or_else);
        match answer.and_then(|answer| answer.value(node.id, object, Some(data_type))) {
            Ok((value, _)) => drop(values.insert((at, object), value)),
            Err(SdoError { failure: SdoFailure::Refused(_), .. }) => drop(refused.insert((at, object))),
            Err(_) => {}
        }
    }
    for (at, number, objects) in wanted {
        let is_unread = |object: &ObjectId| !values.contains_key(&(at, *object)) && !refused.contains(&(at, *object));
        let lacks_scale = objects[1..].iter().flatten().any(is_unread);
        let [unit, digits, step] =
            objects.map(|object| object.and_then(|object| self::number(values.get(&(at, object)))));
        let node = &mut nodes[at];
        let step = signals::step(node, &node.signals[number]).zip(Some(step));
        let fixed = node.fixed_unit(node.signals[number].value_object.0);
        let signal = &mut node.signals[number];
        let read = unit.and_then(|code| u32::try_from(code).ok()).map(Unit);
        signal.unit = read.or(signal.unit).or(fixed);
        signal.digits = digits.and_then(|digits| u8::try_from(digits).ok());
        signal.lacks_scale = lacks_scale;
        if let Some((step, number)) = step {
            signals::set_step(signal, step, number);
        }
    }
    Ok(())
}

/// Reads the identity of a node that is not identified yet.
///
/// # Errors
/// The node does not answer; bus errors and Ctrl-C.
pub fn identify_late(master: &mut Master<'_>, node: &mut Node) -> Result<(), Error> {
    if node.is_identified {
        return Ok(());
    }
    if let Some(found) = identify(master, &[node.id], &Overrides::new())?.pop() {
        (node.identity, node.model, node.is_identified) = (found.identity, found.model, true);
    }
    Ok(())
}

/// Like [`survey_nodes`], with one result for each node: a node that fails does not affect the others.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn survey_each(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    overrides: &Overrides,
) -> Result<Vec<Result<Node, SdoError>>, Error> {
    read_each(master, nodes, &mut |master, nodes| survey_nodes(master, nodes, overrides))
}

/// Like [`identify`], with one result for each node: a node that fails does not affect the others.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn identify_each(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    overrides: &Overrides,
) -> Result<Vec<Result<Node, SdoError>>, Error> {
    read_each(master, nodes, &mut |master, nodes| identify(master, nodes, overrides))
}

/// A function that reads nodes in parallel.
type ReadNodes<'a> = &'a mut dyn FnMut(&mut Master<'_>, &[NodeId]) -> Result<Vec<Node>, Error>;

/// Reads all nodes in parallel. If one of them fails, each node is read alone, except those that no longer answer.
fn read_each(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    read: ReadNodes<'_>,
) -> Result<Vec<Result<Node, SdoError>>, Error> {
    match read(master, nodes) {
        Ok(all) => return Ok(all.into_iter().map(Ok).collect()),
        Err(Error::Sdo(error)) if nodes.len() == 1 => return Ok(vec![Err(error)]),
        Err(Error::Sdo(_)) => {}
        Err(error) => return Err(error),
    }
    let objects = [ObjectId::DEVICE_TYPE, ObjectId::new(0x1018, 1)];
    let asked: Vec<(NodeId, ObjectId)> = nodes.iter().flat_map(|&node| objects.map(|object| (node, object))).collect();
    let answers = Reader::new(master).read(&asked)?;
    let mut results = Vec::new();
    for (&node, answers) in nodes.iter().zip(answers.chunks(objects.len())) {
        let is_silent = |error: &&SdoError| matches!(error.failure, SdoFailure::NoAnswer { .. });
        let silent: Vec<&SdoError> =
            answers.iter().filter_map(|answer| answer.as_ref().err().filter(is_silent)).collect();
        match silent[..] {
            [error, _] => results.push(Err(error.clone())),
            _ => results.extend(read_each(master, &[node], read)?),
        }
    }
    Ok(results)
}
