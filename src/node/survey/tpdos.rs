//! The TPDOs of a device: communication parameters and mapping.

use super::{ObjectReader, U8, U16, U32, unsigned};
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber, Transmission};
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::node::read::{Item, Reader};

/// The number of TPDOs read from a device without a description. Four are not enough: a JUMO probe sends TPDO5.
const UNDESCRIBED_TPDOS: u16 = 8;

/// Returns the TPDOs that the description lists. Without a description, or if it lists none, the first TPDOs.
fn tpdo_numbers(node: &Node) -> Vec<TpdoNumber> {
    let is_described = |number: &TpdoNumber| {
        node.model.as_ref().is_some_and(|model| model.dictionary.has_index(number.communication(0).index))
    };
    let described: Vec<TpdoNumber> = (1..=512).filter_map(TpdoNumber::new).filter(is_described).collect();
    if described.is_empty() { (1..=UNDESCRIBED_TPDOS).filter_map(TpdoNumber::new).collect() } else { described }
}

/// Reads communication parameters and mapping of the TPDOs.
pub(super) fn read_tpdos<A: ObjectReader>(reader: &mut Reader<'_, A>, nodes: &mut [Node]) -> Result<(), A::Stop> {
    let wanted: Vec<(usize, TpdoNumber)> = nodes
        .iter()
        .enumerate()
        .flat_map(|(at, node)| tpdo_numbers(node).into_iter().map(move |number| (at, number)))
        .collect();
    let items: Vec<Item> = wanted.iter().map(|&(at, number)| (nodes[at].id, number.communication(1), U32)).collect();
    let cob_ids = reader.values(&items)?;
    let found: Vec<(usize, TpdoNumber, CobId)> = wanted
        .iter()
        .zip(&cob_ids)
        .filter_map(|(&(at, number), value)| Some((at, number, CobId(unsigned(value.as_ref())?))))
        .collect();
    let items: Vec<Item> = found
        .iter()
        .flat_map(|&(at, number, _)| {
            let node = nodes[at].id;
            [(node, number.communication(2), U8), (node, number.communication(5), U16), (node, number.mapping(0), U8)]
        })
        .collect();
    let values = reader.values(&items)?;
    let counts: Vec<u8> = values.chunks(3).map(|values| unsigned(values[2].as_ref()).unwrap_or(0)).collect();
    // FEh and FFh mean multiplexed PDOs (CiA 301, 7.5.2.38), which measuring devices do not send.
    let entries = |count: u8| 1..=if count > 64 { 0 } else { count };
    let items: Vec<Item> = found
        .iter()
        .zip(&counts)
        .flat_map(|(&(at, number, _), &count)| {
            let node = nodes[at].id;
            entries(count).map(move |sub| (node, number.mapping(sub), U32))
        })
        .collect();
    let mut words = reader.values(&items)?.into_iter();
    for ((&(at, number, cob_id), values), &count) in found.iter().zip(values.chunks(3)).zip(&counts) {
        // Reads all words of this TPDO, even if one is missing. The next words belong to the next TPDO.
        let own: Vec<Option<u32>> = entries(count).map(|_| unsigned(words.next().flatten().as_ref())).collect();
        let mapping: Option<Vec<MappingEntry>> =
            own.into_iter().map(|word| word.map(MappingEntry::from_word)).collect();
        let code: Option<u8> = unsigned(values[2].as_ref());
        if cob_id.is_valid() && (mapping.is_none() || code.is_none_or(|code| code > 64)) {
            nodes[at].not_decoded.push((number, code));
        }
        nodes[at].tpdos.push(Tpdo {
            number,
            cob_id,
            transmission: unsigned(values[0].as_ref()).map(Transmission::from_code),
            event_timer_ms: unsigned(values[1].as_ref()),
            mapping: mapping.unwrap_or_default(),
        });
    }
    Ok(())
}
