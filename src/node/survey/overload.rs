//! Overloads that only the error register reports.

use super::{Ask, U8, small};
use crate::node::Node;
use crate::node::read::{Item, read_optional};

/// Reads the error registers (1001h) that report overloads.
pub(super) fn read_overloads<A: Ask>(master: &mut A, nodes: &mut [Node]) -> Result<(), A::Stop> {
    let wanted: Vec<(usize, u8)> =
        nodes.iter().enumerate().filter_map(|(at, node)| Some((at, node.overload_register()?))).collect();
    let items: Vec<Item> = wanted.iter().map(|&(at, _)| (nodes[at].id, Node::ERROR_REGISTER, U8)).collect();
    for (&(at, mask), register) in wanted.iter().zip(read_optional(master, &items)?) {
        nodes[at].has_overload = small::<u8>(register.as_ref()).is_some_and(|bits| bits & mask == mask);
    }
    Ok(())
}
