//! A node from its description, without a bus.

use super::Node;
use super::signals::described;
use crate::canopen::id::NodeId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::device::catalog::Model;
use crate::measure::layout::Tpdo;
use std::sync::Arc;

/// Creates a node from its description, with the signals and TPDOs of the description.
pub fn offline(id: NodeId, model: &Arc<Model>) -> Node {
    let mut node = Node { model: Some(Arc::clone(model)), is_identified: true, ..Node::new(id) };
    node.signals = model.description.signals.iter().map(|entry| described(&node, entry)).collect();
    let numbers = (1..=512).filter_map(TpdoNumber::new);
    let numbers = numbers.filter(|number| model.dictionary.has_index(number.communication(0).index));
    let tpdo =
        |number| Tpdo { number, cob_id: CobId(0), transmission: None, event_timer_ms: None, mapping: Vec::new() };
    node.tpdos = numbers.map(tpdo).collect();
    node
}
