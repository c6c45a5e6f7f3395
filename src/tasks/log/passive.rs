//! Passive recording. The setup of the nodes comes from the SDO traffic of another master, or from a description named
//! by the user. The setup is never guessed.

use crate::bus::Received;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber, Transmission};
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::device::unit::Unit;
use crate::master::SecondAnswer;
use crate::measure::decode::{Decoder, Wanted};
use crate::measure::layout::{MeasuringRange, PROCESS_VALUES, Signal, Tpdo};
use crate::measure::sample::Number;
use crate::node::overheard::{Overheard, first_four};
use crate::node::signals;
use crate::node::{Node, Overrides};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Reads the setup of nodes from the SDO traffic of other masters.
pub(in crate::tasks) struct SetupListener {
    nodes: BTreeSet<NodeId>,
    overrides: Overrides,
    wanted: Vec<Wanted>,
    overheard: Overheard,
    /// Descriptions of devices whose identity is known from another source.
    pub(in crate::tasks) recognised: Overrides,
    /// COB-IDs of TPDOs whose mapping is unknown, and the nodes that sent them.
    pub(in crate::tasks) unknown_mappings: BTreeMap<CanId, NodeId>,
}

impl SetupListener {
    pub(in crate::tasks) fn new(nodes: &[NodeId], overrides: &Overrides, wanted: &[Wanted]) -> SetupListener {
        SetupListener {
            nodes: nodes.iter().copied().collect(),
            overrides: overrides.clone(),
            wanted: wanted.to_vec(),
            overheard: Overheard::default(),
            recognised: Overrides::new(),
            unknown_mappings: BTreeMap::new(),
        }
    }

    /// Decodes the nodes whose descriptions the user named.
    pub(in crate::tasks) fn apply_overrides(&mut self, decoder: &mut Decoder) {
        let nodes: Vec<NodeId> = self.overrides.keys().copied().filter(|node| self.nodes.contains(node)).collect();
        nodes.into_iter().for_each(|node| self.update(node, decoder));
    }

    /// Handles a frame. If the frame completes the setup of a TPDO, `decoder` decodes this TPDO from now on. Returns
    /// the recorded node if the frame contained information about the node.
    pub(in crate::tasks) fn on_frame(&mut self, received: &Received, decoder: &mut Decoder) -> Option<NodeId> {
        let frame = &received.frame;
        if let Some((node, _)) = self.overheard.take(received).filter(|(node, _)| self.nodes.contains(node)) {
            self.update(node, decoder);
            return Some(node);
        }
        if let Some(node) = predefined_tpdo(frame)
            && !decoder.decodes(frame.id())
            && self.nodes.contains(&node)
        {
            self.unknown_mappings.insert(frame.id(), node);
        }
        None
    }

    /// Returns the next node that sent two answers to one request of another master, with the object.
    pub(in crate::tasks) fn next_second_answer(&mut self) -> Option<(NodeId, ObjectId, SecondAnswer)> {
        std::iter::from_fn(|| self.overheard.next_second_answer()).find(|(node, ..)| self.nodes.contains(node))
    }

    /// Ignores a node from now on. Returns whether other nodes are left.
    pub(in crate::tasks) fn exclude(&mut self, node: NodeId, decoder: &mut Decoder) -> bool {
        self.nodes.remove(&node);
        decoder.remove(node);
        !self.nodes.is_empty()
    }

    /// Handles a restart of a node, which may have lost its setup. Its identity and the descriptions of the user stay
    /// valid.
    pub(in crate::tasks) fn forget(&mut self, node: NodeId, decoder: &mut Decoder) {
        self.overheard.forget(node, is_setup);
        decoder.remove(node);
        if self.overrides.contains_key(&node) && self.nodes.contains(&node) {
            self.update(node, decoder);
        }
    }

    /// Returns the number in an object: from the SDO traffic, else the default in the description that the user named.
    pub(in crate::tasks) fn number(&self, node: NodeId, object: ObjectId) -> Option<u32> {
        let default = || first_four(&self.named(node)?.dictionary.get(object)?.default_bytes(node)?).into();
        self.overheard.number(node, object).or_else(default)
    }

    /// Returns the description that the user named for a node, unless the node reports another vendor or product.
    fn named(&self, node: NodeId) -> Option<&Arc<Model>> {
        self.overrides.get(&node).filter(|model| self.overheard.identity(node).fits(model))
    }

    /// Returns the number in an object of four bytes. After an answer with fewer bytes, the number is unknown: the
    /// default is not used.
    fn word(&self, node: NodeId, object: ObjectId) -> Option<u32> {
        let is_truncated = self.overheard.bytes(node, object).is_some_and(|bytes| bytes.len() < 4);
        self.number(node, object).filter(|_| !is_truncated)
    }

    fn byte(&self, node: NodeId, object: ObjectId) -> Option<u8> {
        Some(self.number(node, object)?.to_le_bytes()[0])
    }

    fn update(&mut self, id: NodeId, decoder: &mut Decoder) {
        let mut node = self.known_node(id);
        // Without its decimal digits an integer would be wrong by a power of ten.
        let has_digits = |node: &Node, tpdo: &Tpdo| {
            tpdo.mapping.iter().all(|entry| {
                let signal = node.signals.iter().find(|signal| signal.is_value(entry.object));
                signal.is_none_or(|signal| {
                    let [_, digits] = signals::unit_and_digits(node, signal);
                    let step = signals::step(node, signal).map(|step| step.object);
                    let data_type = node.mapped_type(entry.object, entry.bits);
                    let is_integer = matches!(data_type, Some(DataType::Integer(_) | DataType::Unsigned(_)));
                    let mut needed = digits.into_iter().filter(|_| signal.digits.is_none()).chain(step);
                    !is_integer || needed.all(|object| self.overheard.is_refused(id, object))
                })
            })
        };
        let mut tpdos = std::mem::take(&mut node.tpdos);
        tpdos.retain(|tpdo| has_digits(&node, tpdo));
        node.tpdos = tpdos;
        if !node.tpdos.is_empty() {
            decoder.replace(node.layout(), &node.all_wanted(&self.wanted));
            self.unknown_mappings.retain(|&id, _| !decoder.decodes(id));
        }
    }

    /// Returns the known part of a node. It contains only TPDOs with a known COB-ID and a complete mapping.
    pub(in crate::tasks) fn known_node(&self, id: NodeId) -> Node {
        let mut node = Node::new(id);
        node.identity = self.overheard.identity(id);
        let recognised = || self.overheard.recognise(id).or_else(|| self.recognised.get(&id).cloned());
        node.model = self.named(id).cloned().or_else(recognised);
        if let Some(word) = self.number(id, ObjectId::new(0x1014, 0)).map(CobId).filter(|word| word.is_valid()) {
            node.emergency = word.can_id();
        }
        if let Some(word) = self.number(id, ObjectId::new(0x1005, 0)).map(CobId) {
            node.sync = word.can_id();
        }
        node.tpdos = (1..=512).filter_map(TpdoNumber::new).filter_map(|number| self.tpdo(id, number)).collect();
        node.signals = self.signals(&node);
        node
    }

    fn tpdo(&self, node: NodeId, number: TpdoNumber) -> Option<Tpdo> {
        let cob_id = CobId(self.word(node, number.communication(1))?);
        let count = self.byte(node, number.mapping(0)).filter(|&count| count <= 64)?;
        let mapping: Option<Vec<MappingEntry>> =
            (1..=count).map(|sub| self.word(node, number.mapping(sub)).map(MappingEntry::from_word)).collect();
        let transmission = self.byte(node, number.communication(2)).map(Transmission::from_code);
        Some(Tpdo { number, cob_id, transmission, event_timer_ms: None, mapping: mapping? })
    }

    /// Returns the measuring range (6148h, 6149h), if another master read it.
    fn range(&self, node: &Node, channel: u8, digits: Option<u8>) -> MeasuringRange {
        let end_of_range = |index: u16| {
            let object = ObjectId::new(index, channel);
            let value = node.layout().data_type(object)?.decode(self.overheard.bytes(node.id, object)?).ok()?;
            Number::from_value(&value, digits.unwrap_or(0)).map(Number::as_f64)
        };
        let ends = end_of_range(0x6148).zip(end_of_range(0x6149));
        ends.map_or(MeasuringRange::Unknown, |(start, end)| MeasuringRange::Known(start, end))
    }

    fn signals(&self, node: &Node) -> Vec<Signal> {
        let described = node.model.as_ref().map_or(&[][..], |model| &model.description.signals);
        let mut found: Vec<Signal> = described.iter().map(|entry| signals::described(node, entry)).collect();
        if found.is_empty() && signals::can_have_channels(node) {
            let entries = node.tpdos.iter().flat_map(|tpdo| &tpdo.mapping);
            let values = entries.filter(|entry| PROCESS_VALUES.iter().any(|&(index, _)| index == entry.object.index));
            found = values.map(|entry| signals::channel(node, entry.object)).collect();
            found.dedup_by_key(|signal| signal.channel);
        }
        if found.is_empty() {
            found = signals::objects(node, []);
        }
        found.into_iter().map(|signal| self.with_unit(node, signal)).collect()
    }

    /// Adds unit, digits and range to a signal, as far as they are known.
    fn with_unit(&self, node: &Node, mut signal: Signal) -> Signal {
        let [unit, digits] = signals::unit_and_digits(node, &signal);
        let unit = unit.and_then(|object| self.word(node.id, object)).map(Unit);
        signal.unit = unit.or(signal.unit).or_else(|| node.fixed_unit(signal.value_object.0));
        signal.digits = digits.and_then(|object| self.byte(node.id, object));
        if let Some(step) = signals::step(node, &signal) {
            let data_type = node.layout().data_type(step.object);
            let mask =
                data_type.and_then(DataType::width).map_or(u32::MAX, |width| u32::MAX >> (32 - 8 * width.clamp(1, 4)));
            signals::set_step(
                &mut signal,
                step,
                self.number(node.id, step.object).map(|number| u64::from(number & mask)),
            );
        }
        if signal.has_channel() {
            signal.range = match self.range(node, signal.channel, signal.digits) {
                MeasuringRange::Unknown => signal.range,
                known => known,
            };
        }
        signal
    }
}

/// Whether an object belongs to the setup of the TPDOs, and not to the identity of the device.
fn is_setup(object: ObjectId) -> bool {
    matches!(object.index, 0x1800..=0x1bff | 0x6131 | 0x6132)
}

/// Whether an object belongs to the setup of the TPDOs or to the identity, so that its value does not change by itself.
pub(in crate::tasks) fn is_constant(object: ObjectId) -> bool {
    is_setup(object) || matches!(object.index, 0x1000 | 0x1008..=0x100a | 0x1018)
}

/// Returns the node that sends TPDOs with this COB-ID in the predefined connection set.
pub(super) fn predefined_tpdo(frame: &Frame) -> Option<NodeId> {
    match frame.id() {
        CanId::Standard(id) if matches!(id & 0x780, 0x180 | 0x280 | 0x380 | 0x480) && !frame.is_remote() => {
            NodeId::new((id & 0x7f) as u8).ok()
        }
        _ => None,
    }
}
