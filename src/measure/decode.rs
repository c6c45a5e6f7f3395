//! Decodes TPDOs into samples, by mapping, data type, decimal digits and status.

use super::layout::{Layout, Signal, Tpdo, fits};
pub use super::reading::{Reading, is_smallest};
use super::sample::{Sample, Source};
use crate::bus::Received;
use crate::canopen::id::{CanId, CanIdMap, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{Field, TpdoNumber, field_layout};
use crate::canopen::value::DataType;
use crate::device::unit::Unit;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A requested value of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// A signal: `pressure`.
    Signal(String),
    /// The status of a signal: `pressure.status`.
    Status(String),
    /// An object by its address, with the type that the user states: `0x6130:1`, `0x6010:0/i16`.
    Object(ObjectId, Option<DataType>),
    /// An object by its name: see [`Layout::resolve`].
    Named(String, ObjectId),
}

impl Wanted {
    /// The name as in [`Source`]: `pressure`, `pressure.status`, `0x6010:0/i16`.
    pub fn name(&self) -> String {
        match self {
            Wanted::Signal(name) | Wanted::Named(name, _) => name.clone(),
            Wanted::Status(name) => format!("{name}.status"),
            Wanted::Object(object, None) => object.to_string(),
            Wanted::Object(object, Some(data_type)) => format!("{object}/{data_type}"),
        }
    }
}

impl Layout<'_> {
    /// Finds the signal or object that a requested value means on this node. A name that is not a signal may be the
    /// name of an object.
    pub fn resolve(&self, item: &Wanted) -> Wanted {
        let (Wanted::Signal(signal) | Wanted::Status(signal)) = item else { return item.clone() };
        if self.signals.iter().any(|known| known.name == *signal) {
            return item.clone();
        }
        let name = &item.name();
        if let Some(object) = self.part(name) {
            return Wanted::Named(name.clone(), object);
        }
        let Some(object) = self.object(name) else { return item.clone() };
        let named = |signal: &&Signal| !signal.has_channel() && signal.value_object.0 == object;
        match self.signals.iter().find(named) {
            Some(signal) => Wanted::Signal(signal.name.clone()),
            None => Wanted::Named(self.name_of(object), object),
        }
    }
}

/// One value in a TPDO.
#[derive(Debug)]
struct MappedValue {
    field: Field,
    reading: Reading,
    status: Option<Field>,
}

/// How one TPDO is decoded.
#[derive(Debug)]
struct TpdoDecoder {
    node: NodeId,
    number: TpdoNumber,
    /// Another TPDO with the same COB-ID. The sender or the mapping of a frame is then unknown.
    shared_with: Option<(NodeId, TpdoNumber)>,
    /// Length of the mapping in bytes.
    length: usize,
    values: Vec<MappedValue>,
    /// Whether TPDOs are ignored at present.
    is_paused: bool,
    /// The number of TPDOs received with another length.
    wrong_lengths: u64,
    /// The length of the first TPDO with another length.
    other_length: Option<usize>,
    /// Whether a TPDO with the length of the mapping was received.
    has_mapped_length: bool,
    /// Whether TPDOs had more than one length.
    has_mixed_lengths: bool,
    /// Whether TPDOs of [`TpdoDecoder::other_length`] are used up to the mapped length.
    uses_longer: bool,
}

impl TpdoDecoder {
    fn new(node: NodeId, number: TpdoNumber, length: usize, values: Vec<MappedValue>) -> TpdoDecoder {
        TpdoDecoder {
            node,
            number,
            shared_with: None,
            length,
            values,
            is_paused: false,
            wrong_lengths: 0,
            other_length: None,
            has_mapped_length: false,
            has_mixed_lengths: false,
            uses_longer: false,
        }
    }
}

/// Decodes the TPDOs of several nodes.
#[derive(Debug, Default)]
pub struct Decoder {
    tpdos: CanIdMap<TpdoDecoder>,
    sources: Vec<Source>,
    /// COB-IDs that two TPDOs share, not reported yet.
    shared: BTreeMap<CanId, [(NodeId, TpdoNumber); 2]>,
    /// Overloads that nodes report by emergencies, each with its channel if the emergency contains one.
    overloads: BTreeSet<(NodeId, Option<u8>)>,
}

/// TPDO lengths that differ from the mapping: the first such length, and whether there were other lengths.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LengthsSeen(BTreeMap<CanId, (usize, bool)>);

/// The result of decoding a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoded {
    /// The frame is not a known TPDO.
    OtherFrame,
    /// A TPDO of this node. Its samples were added.
    Tpdo(NodeId),
    /// A TPDO of this node that is ignored at present.
    Paused(NodeId),
    /// A TPDO of this node whose length differs from its mapping. It was ignored.
    WrongLength(NodeId),
}

impl Decoder {
    /// Adds a source and returns its number. A known source keeps its number. Polled values use the same numbers.
    pub fn add_source(&mut self, source: Source) -> usize {
        if let Some(at) = self.sources.iter().position(|known| *known == source) {
            return at;
        }
        self.sources.push(source);
        self.sources.len() - 1
    }

    /// Adds the valid TPDOs of a node. If `wanted` is not empty, only these values are decoded.
    pub fn add(&mut self, layout: Layout<'_>, wanted: &[Wanted]) {
        for tpdo in layout.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()) {
            let mut decoder = self.tpdo_decoder(layout, tpdo, wanted);
            let id = tpdo.cob_id.can_id();
            match self.tpdos.remove(&id) {
                // Both TPDOs belong to the node. If the mapping of one is empty, the other one is decoded.
                Some(other) if other.node == layout.node && decoder.length == 0 => decoder = other,
                Some(other) if other.node == layout.node && other.length == 0 => {}
                Some(other) => {
                    decoder.is_paused = true;
                    decoder.shared_with = Some((other.node, other.number));
                    decoder.values.extend(other.values);
                    self.shared.insert(id, [(other.node, other.number), (layout.node, tpdo.number)]);
                }
                None => {}
            }
            self.tpdos.insert(id, decoder);
        }
    }

    /// Replaces the TPDOs of a node that was read again.
    pub fn replace(&mut self, layout: Layout<'_>, wanted: &[Wanted]) {
        self.remove(layout.node);
        self.add(layout, wanted);
    }

    /// Uses the TPDOs of a node that are always longer than their mapping, up to the mapped length. Call this only if
    /// the mapping was read twice from the device without a difference. `before` has the lengths received before the
    /// second read. Returns the mapped and the received length of each such TPDO.
    pub fn use_longer(&mut self, node: NodeId, before: &LengthsSeen) -> Vec<(CanId, usize, usize)> {
        let mut used = Vec::new();
        for (&id, tpdo) in self.tpdos.iter_mut().filter(|(_, tpdo)| tpdo.node == node) {
            let Some(&(length, has_mixed_lengths)) = before.0.get(&id) else { continue };
            (tpdo.other_length, tpdo.has_mixed_lengths) = (Some(length), has_mixed_lengths);
            tpdo.uses_longer = !has_mixed_lengths && length > tpdo.length;
            if tpdo.uses_longer {
                used.push((id, tpdo.length, length));
            }
        }
        used
    }

    /// Returns the lengths that the TPDOs of a node had, if they differ from the mapping.
    pub fn lengths_seen(&self, node: NodeId) -> LengthsSeen {
        let of_node = self.tpdos.iter().filter(|(_, tpdo)| tpdo.node == node);
        LengthsSeen(
            of_node.filter_map(|(&id, tpdo)| Some((id, (tpdo.other_length?, tpdo.has_mixed_lengths)))).collect(),
        )
    }

    /// Returns the first TPDO of a node with a wrong length: its mapped and its received length in bytes.
    pub fn wrong_length(&self, node: NodeId) -> Option<(usize, usize)> {
        let of_node = self.tpdos.iter().filter(|(_, tpdo)| tpdo.node == node && !tpdo.uses_longer);
        let lengths = of_node.filter_map(|(id, tpdo)| Some((id, (tpdo.length, tpdo.other_length?))));
        lengths.min_by_key(|&(id, _)| id).map(|(_, lengths)| lengths)
    }

    /// Removes the TPDOs of a node.
    pub fn remove(&mut self, node: NodeId) {
        self.tpdos.retain(|_, tpdo| tpdo.node != node);
    }

    /// Records that a node reports an overload of a channel; `None` if the emergency contains no channel.
    pub fn begin_overload(&mut self, node: NodeId, channel: Option<u8>) {
        self.overloads.insert((node, channel));
    }

    /// Sets or ends the overload of a node, from its error register.
    pub fn set_overload(&mut self, node: NodeId, has_overload: bool) {
        self.end_overload(node);
        if has_overload {
            self.begin_overload(node, None);
        }
    }

    /// Removes the overloads of a node, because the node reports that they have ended.
    pub fn end_overload(&mut self, node: NodeId) {
        self.overloads.retain(|(of, _)| *of != node);
    }

    /// Sets the status of a sample from the overloads that its node reports.
    pub fn report_overloads(&self, node: NodeId, reading: &Reading, sample: &mut Sample) {
        let of_node = self.overloads.iter().filter(|(of, _)| *of == node);
        of_node.for_each(|(_, channel)| reading.report_overload(sample, *channel));
    }

    /// Ignores the TPDOs of a node until [`Decoder::replace`], because its configuration may have changed.
    pub fn pause(&mut self, node: NodeId) {
        self.tpdos.values_mut().filter(|tpdo| tpdo.node == node).for_each(|tpdo| tpdo.is_paused = true);
    }

    fn tpdo_decoder(&mut self, layout: Layout<'_>, tpdo: &Tpdo, wanted: &[Wanted]) -> TpdoDecoder {
        let fields = field_layout(&tpdo.mapping);
        let bits: usize = fields.iter().map(|field| usize::from(field.entry.bits)).sum();
        let mut values = Vec::new();
        for field in &fields {
            let object = field.entry.object;
            let data_type = layout.mapped_type(object, field.entry.bits);
            let mut add = |name: &str, unit: String, reading: &dyn Fn(usize) -> Reading, status: Option<Field>| {
                let source = Source { node: layout.node, signal: name.into(), unit: unit.into() };
                values.push(MappedValue { field: *field, reading: reading(self.add_source(source)), status });
            };
            let is_wanted = |item: &Wanted| wanted.contains(item);
            let signal = layout.value_signal(object);
            let status_object = signal.or(layout.measured_signal(object)).and_then(|signal| signal.status);
            let status = fields.iter().find(|other| Some(other.entry.object) == status_object).copied();
            if let Some(signal) = signal {
                if wanted.is_empty() || is_wanted(&Wanted::Signal(signal.name.clone())) {
                    let reading = |source| Reading::of_signal(signal, data_type, source);
                    add(&signal.name, unit_text(signal.unit), &reading, status);
                }
            } else if let Some(signal) = layout.signals.iter().find(|signal| signal.status == Some(object)) {
                if is_wanted(&Wanted::Status(signal.name.clone())) {
                    let name = format!("{}.status", signal.name);
                    add(&name, String::new(), &|source| Reading::plain(data_type, source), None);
                }
            } else if wanted.is_empty() && !is_dummy(object) {
                let reading = |source| Reading::of_object(layout, object, data_type, source);
                add(&layout.name_of(object), unit_text(layout.unit_of(object)), &reading, status);
            }
            for item in wanted {
                if let Wanted::Object(wanted, _) | Wanted::Named(_, wanted) = item
                    && *wanted == object
                {
                    let stated = if let Wanted::Object(_, stated) = item { *stated } else { None };
                    let reading = |source| match stated {
                        Some(stated) => {
                            Reading::plain(Some(stated).filter(|stated| fits(*stated, field.entry.bits)), source)
                        }
                        None => Reading::of_object(layout, object, data_type, source),
                    };
                    let (unit, status) = if stated.is_none() { (layout.unit_of(object), status) } else { (None, None) };
                    add(&item.name(), unit_text(unit), &reading, status);
                }
            }
        }
        TpdoDecoder::new(layout.node, tpdo.number, bits.div_ceil(8), values)
    }

    /// Every source, in the order of their numbers.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Returns the new COB-IDs that two TPDOs share, of one node or of two nodes. The decoder ignores both TPDOs.
    pub fn take_shared_cob_ids(&mut self) -> BTreeMap<CanId, [(NodeId, TpdoNumber); 2]> {
        std::mem::take(&mut self.shared)
    }

    /// Returns the two TPDOs with this COB-ID, if there are two.
    pub fn shared_cob_id(&self, id: CanId) -> Option<[(NodeId, TpdoNumber); 2]> {
        let tpdo = self.tpdos.get(&id)?;
        Some([tpdo.shared_with?, (tpdo.node, tpdo.number)])
    }

    /// All COB-IDs that two TPDOs of the same node share.
    pub fn shared_cob_ids(&self) -> impl Iterator<Item = (CanId, [(NodeId, TpdoNumber); 2])> + '_ {
        let shared = self.tpdos.keys().filter_map(|&id| Some((id, self.shared_cob_id(id)?)));
        shared.filter(|(_, [(one, _), (other, _)])| one == other)
    }

    /// Returns the node and the mapped length in bytes of the TPDO with this COB-ID.
    pub fn mapped_length(&self, id: CanId) -> Option<(NodeId, usize)> {
        self.tpdos.get(&id).map(|tpdo| (tpdo.node, tpdo.length))
    }

    /// The COB-IDs of the decoded TPDOs.
    pub fn can_ids(&self) -> impl Iterator<Item = CanId> + '_ {
        self.tpdos.keys().copied()
    }

    /// Whether the TPDO with this COB-ID is known.
    pub fn decodes(&self, id: CanId) -> bool {
        self.tpdos.contains_key(&id)
    }

    /// The number of values that are decoded from the TPDO with this COB-ID.
    pub fn values_of(&self, id: CanId) -> u64 {
        self.tpdos.get(&id).map_or(0, |tpdo| tpdo.values.len() as u64)
    }

    /// Whether the TPDO with this COB-ID carries this source.
    pub fn carries(&self, id: CanId, source: usize) -> bool {
        self.tpdos.get(&id).is_some_and(|tpdo| tpdo.values.iter().any(|value| value.reading.source == source))
    }

    /// Returns the number of TPDOs of a node whose length differed from their mapping.
    pub fn wrong_lengths(&self, node: NodeId) -> u64 {
        self.tpdos.values().filter(|tpdo| tpdo.node == node).map(|tpdo| tpdo.wrong_lengths).sum()
    }

    /// Decodes a frame. Its samples are added to `samples` in the order of the mapping.
    ///
    /// A TPDO whose length differs from its mapping is ignored: its mapping was changed, or another device sent it.
    pub fn decode(&mut self, received: &Received, samples: &mut Vec<Sample>) -> Decoded {
        let frame = &received.frame;
        let Some(tpdo) = self.tpdos.get_mut(&frame.id()).filter(|_| !frame.is_remote()) else {
            return Decoded::OtherFrame;
        };
        if tpdo.length == 0 {
            // The mapping could not be read, or it is a multiplexed PDO.
            return Decoded::OtherFrame;
        }
        if tpdo.is_paused {
            return Decoded::Paused(tpdo.node);
        }
        let data = frame.data();
        let is_mapped_length = data.len() == tpdo.length;
        tpdo.has_mapped_length |= is_mapped_length;
        if !is_mapped_length {
            tpdo.wrong_lengths += 1;
        }
        let other =
            if is_mapped_length { tpdo.other_length } else { Some(*tpdo.other_length.get_or_insert(data.len())) };
        if other.is_some_and(|other| tpdo.has_mapped_length || other != data.len()) {
            // Two devices send with this COB-ID, or the mapping has changed.
            tpdo.has_mixed_lengths = true;
            tpdo.uses_longer = false;
        }
        if !is_mapped_length && !tpdo.uses_longer {
            return Decoded::WrongLength(tpdo.node);
        }
        for value in &tpdo.values {
            let Some((bytes, len)) = value.field.bytes(data) else { continue };
            let status = value.status.and_then(|status| status.bytes(data)).map(|(bits, _)| u64::from_le_bytes(bits));
            let mut sample = value.reading.sample(received.at, &bytes[..len], status);
            if let Some(sample) = &mut sample {
                let of_node = self.overloads.iter().filter(|(of, _)| *of == tpdo.node);
                of_node.for_each(|(_, channel)| value.reading.report_overload(sample, *channel));
            }
            samples.extend(sample);
        }
        Decoded::Tpdo(tpdo.node)
    }
}

/// Whether a mapped object only fills a gap: indices 0001h to 001Fh (CiA 301, 7.4.7.1).
fn is_dummy(object: ObjectId) -> bool {
    object.index < 0x20
}

/// Creates the source for a value of a node.
pub fn source(node: NodeId, name: &str, unit: Option<Unit>) -> Source {
    Source { node, signal: Arc::from(name), unit: Arc::from(unit_text(unit)) }
}

/// Returns the symbol of a unit; empty if it is unknown.
fn unit_text(unit: Option<Unit>) -> String {
    unit.map(|unit| unit.to_string()).unwrap_or_default()
}

#[cfg(test)]
mod tests;
