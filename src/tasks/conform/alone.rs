//! Whether the node is alone on the bus.

use super::failure::ConformFailure;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::master::{Master, MasterEvent};
use crate::node::wait::{Policy, wait};
use crate::node::{Error, Node, scan};
use std::ops::ControlFlow;
use std::time::Duration;

/// The wait for the answers of other nodes.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(200);

/// How long other traffic is looked for.
const LISTEN: Duration = Duration::from_secs(1);

/// Looks for other nodes and for frames that are not from this node. `None` if there are none.
pub(super) fn others(master: &mut Master<'_>, node: &Node) -> Result<Option<ConformFailure>, Error> {
    let everyone: Vec<NodeId> = NodeId::all().filter(|id| *id != node.id).collect();
    let mut nodes: Vec<NodeId> = scan::find(master, &everyone, ANSWER_TIMEOUT, 2)?.nodes().into_iter().collect();
    nodes.retain(|id| *id != node.id);
    let mut frame = None;
    let until = master.now() + LISTEN;
    wait(master, until, Policy::Command, |_, event| match event {
        MasterEvent::Frame(received) if !is_from(node, &received.frame) => {
            frame = Some(received.frame);
            ControlFlow::Break(())
        }
        _ => ControlFlow::Continue(()),
    })?;
    let is_alone = nodes.is_empty() && frame.is_none();
    Ok((!is_alone).then_some(ConformFailure::NotAlone { nodes, frame }))
}

/// Whether a frame can be from the node.
pub(super) fn is_from(node: &Node, frame: &Frame) -> bool {
    let id = frame.id();
    let own = [CanId::sdo_response(node.id), CanId::heartbeat(node.id), node.emergency, CanId::LSS_SLAVE];
    let is_own = own.contains(&id) || node.tpdos.iter().any(|tpdo| tpdo.cob_id.can_id() == id);
    is_own && !frame.is_remote()
}
