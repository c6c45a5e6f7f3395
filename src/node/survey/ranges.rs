//! Measuring ranges, and overloads that only the error register reports.

use super::{ObjectReader, U8, unsigned};
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::master::{Error, Master};
use crate::measure::layout::{MeasuringRange, NarrowValue, Scaling, Signal};
use crate::measure::sample::Number;
use crate::node::Node;
use crate::node::read::{Item, Reader};

/// Reads the measuring ranges (6148h, 6149h) if a value depends on them: an integer of at most 24 bits, or a described
/// signal without a status. A device with integers may have these objects as integers only (7148h to 9149h).
pub(super) fn read_ranges<A: ObjectReader>(reader: &mut Reader<'_, A>, nodes: &mut [Node]) -> Result<(), A::Stop> {
    read_family(reader, nodes, 0x6000, |_| true)?;
    for family in [0x9000, 0x8000, 0x7000] {
        let is_missing =
            |signal: &Signal| signal.range == MeasuringRange::Unknown && signal.value_object.0.index >= 0x7000;
        read_family(reader, nodes, family, is_missing)?;
    }
    Ok(())
}

/// Reads the measuring ranges of the selected signals from the objects of a family (6xxxh to 9xxxh).
fn read_family<A: ObjectReader>(
    reader: &mut Reader<'_, A>,
    nodes: &mut [Node],
    family: u16,
    is_selected: impl Fn(&Signal) -> bool,
) -> Result<(), A::Stop> {
    // Node, signal, and its two ends.
    type Range = (usize, usize, [(ObjectId, DataType); 2]);
    let mut wanted: Vec<Range> = Vec::new();
    for (at, node) in nodes.iter().enumerate() {
        for (number, signal) in node.signals.iter().enumerate() {
            if signal.rules.scaling != Scaling::Digits || !is_selected(signal) || !needs_range(node, signal) {
                continue;
            }
            let entries = node.model.iter().flat_map(|model| &model.description.signals);
            let entry = entries.into_iter().find(|entry| entry.name == signal.name);
            let object = |described: Option<ObjectId>, low: u16| {
                let of_channel = || signal.has_channel().then(|| ObjectId::new(family | low, signal.channel));
                let object = described.or_else(of_channel)?;
                Some((object, node.layout().data_type(object)?))
            };
            let start = object(entry.and_then(|entry| entry.span_start), 0x148);
            let end = object(entry.and_then(|entry| entry.span_end), 0x149);
            if let Some((start, end)) = start.zip(end) {
                wanted.push((at, number, [start, end]));
            }
        }
    }
    let items: Vec<Item> = wanted
        .iter()
        .flat_map(|(at, _, objects)| {
            let node = nodes[*at].id;
            objects.map(|(object, data_type)| (node, object, data_type))
        })
        .collect();
    let values = reader.values(&items)?;
    for (&(at, number, _), ends) in wanted.iter().zip(values.chunks(2)) {
        let signal = &mut nodes[at].signals[number];
        let number = |value: &Option<Value>| signal.number(value.as_ref()?).map(Number::as_f64);
        if let [start, end] = ends
            && let Some((start, end)) = number(start).zip(number(end))
            && start.is_finite()
            && end.is_finite()
            && start != end
        {
            signal.range = MeasuringRange::Known(start, end);
        }
    }
    Ok(())
}

/// Whether the samples of a signal depend on its measuring range.
fn needs_range(node: &Node, signal: &Signal) -> bool {
    let lacks_status = node.model.is_some() && !signal.has_status();
    lacks_status || is_narrow(signal.value_object.1) || has_narrow_entry(node, signal)
}

/// Whether a TPDO contains the signal as an integer of at most 24 bits, whose range may be too small.
fn has_narrow_entry(node: &Node, signal: &Signal) -> bool {
    let mut mapped = node.tpdos.iter().flat_map(|tpdo| &tpdo.mapping);
    mapped.any(|entry| signal.is_value(entry.object) && is_narrow(node.mapped_type(entry.object, entry.bits)))
}

fn is_narrow(data_type: Option<DataType>) -> bool {
    matches!(data_type, Some(DataType::Integer(1..=3)))
}

/// Finds the signals whose values may be clipped in the valid TPDOs of a node. Reads their measuring ranges first.
///
/// # Errors
/// A node that does not answer; bus errors and Ctrl-C.
pub fn narrow_values(master: &mut Master<'_>, node: &mut Node) -> Result<Vec<NarrowValue>, Error> {
    let is_narrow = |signal: &Signal| has_narrow_entry(node, signal);
    if node.signals.iter().any(is_narrow) {
        read_ranges(&mut Reader::new(master), std::slice::from_mut(node))?;
    }
    Ok(node.layout().narrow_values())
}

/// Reads the error registers (1001h) that report overloads.
pub(super) fn read_overloads<A: ObjectReader>(reader: &mut Reader<'_, A>, nodes: &mut [Node]) -> Result<(), A::Stop> {
    let wanted: Vec<(usize, u8)> =
        nodes.iter().enumerate().filter_map(|(at, node)| Some((at, node.overload_register()?))).collect();
    let items: Vec<Item> = wanted.iter().map(|&(at, _)| (nodes[at].id, Node::ERROR_REGISTER, U8)).collect();
    for (&(at, mask), register) in wanted.iter().zip(reader.values(&items)?) {
        nodes[at].has_overload = unsigned::<u8>(register.as_ref()).is_some_and(|bits| bits & mask == mask);
    }
    Ok(())
}
