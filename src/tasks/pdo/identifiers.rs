//! Checks whether a CAN identifier is free for a TPDO.

use super::failure::{CobIdUser, PdoFailure};
use super::session::Session;
use crate::bus::Filters;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::value::DataType;
use crate::master::MasterEvent;
use crate::node::Node;
use crate::node::read::read_values;
use crate::node::wait::{Policy, wait};
use crate::tasks::Failure;
use crate::tasks::scan::scan;
use std::ops::ControlFlow;
use std::time::Duration;

/// How long to listen for frames with the identifier.
const LISTEN_TIMEOUT: Duration = Duration::from_millis(200);

/// The COB-ID of TIME in the predefined connection set.
const TIME: CanId = CanId::Standard(0x100);

/// The objects that contain an identifier: SYNC, TIME, EMCY, and the first PDOs of both directions (CiA 301).
const COB_IDS: [(u16, u8, &str); 14] = [
    (0x1005, 0, "SYNC"),
    (0x1012, 0, "TIME"),
    (0x1014, 0, "EMCY"),
    (0x1400, 1, "RPDO1"),
    (0x1401, 1, "RPDO2"),
    (0x1402, 1, "RPDO3"),
    (0x1403, 1, "RPDO4"),
    (0x1800, 1, "TPDO1"),
    (0x1801, 1, "TPDO2"),
    (0x1802, 1, "TPDO3"),
    (0x1803, 1, "TPDO4"),
    (0x1804, 1, "TPDO5"),
    (0x1805, 1, "TPDO6"),
    (0x1806, 1, "TPDO7"),
];

/// Checks that the node does not use the identifier for another object.
///
/// # Errors
/// [`PdoFailure::Occupied`].
pub(super) fn check_own(node: &Node, number: TpdoNumber, id: CanId) -> Result<(), Failure> {
    let mut used = vec![
        (node.sync, CobIdUser::Service("SYNC")),
        (CanId::SYNC, CobIdUser::Service("SYNC")),
        (TIME, CobIdUser::Service("TIME")),
        (node.emergency, CobIdUser::Own("EMCY".to_owned())),
    ];
    let others = node.tpdos.iter().filter(|tpdo| tpdo.number != number && tpdo.cob_id.is_valid());
    used.extend(others.map(|tpdo| (tpdo.cob_id.can_id(), CobIdUser::Own(tpdo.number.to_string()))));
    match used.into_iter().find(|(other, _)| *other == id) {
        Some((_, by)) => Err(Failure::at(node.id, PdoFailure::Occupied { id, by })),
        None => Ok(()),
    }
}

/// Checks that no other node uses the identifier. Reads the identifiers of the nodes found by a scan, and listens for a
/// short time.
///
/// # Errors
/// [`PdoFailure::Occupied`]; bus errors and Ctrl-C.
pub(super) fn check_others(session: &mut Session<'_, '_>, id: CanId) -> Result<(), Failure> {
    let node = session.node.id;
    let master = &mut *session.master;
    let all: Vec<NodeId> = NodeId::all().filter(|&other| other != node).collect();
    let timeout = LISTEN_TIMEOUT.min(master.timing().timeout);
    let rounds = 1 + master.timing().retries;
    let found = scan(master, &all, timeout, rounds, &Default::default())?;
    let others: Vec<NodeId> = found.iter().map(|found| found.node).collect();
    master.listen_to(&others)?;
    let cob_ids = |&other: &NodeId| {
        COB_IDS.map(|(index, sub, name)| (name, (other, ObjectId::new(index, sub), DataType::Unsigned(4))))
    };
    let (names, items): (Vec<_>, Vec<_>) = others.iter().flat_map(cob_ids).unzip();
    let values = read_values(master, &items)?;
    master.listen(&Filters::Only(vec![id]))?;
    let used = names.iter().zip(&items).zip(&values).find(|((_, (_, object, _)), value)| {
        let number = value.as_ref().ok().and_then(|value| value.as_u64()).and_then(|number| u32::try_from(number).ok());
        // Bit 31 of 1005h and 1012h does not mean "invalid".
        let is_used = |cob_id: CobId| cob_id.is_valid() || matches!(object.index, 0x1005 | 0x1012);
        number.map(CobId).is_some_and(|cob_id| is_used(cob_id) && cob_id.can_id() == id)
    });
    if let Some(((name, (other, ..)), _)) = used {
        return Err(Failure::at(node, PdoFailure::Occupied { id, by: CobIdUser::Other(*other, name) }));
    }
    let until = master.now() + LISTEN_TIMEOUT;
    let received = wait(master, until, Policy::Command, |_, event| match event {
        MasterEvent::Frame(received) if received.frame.id() == id => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    })?;
    master.listen_to(&[node])?;
    match received.done() {
        Some(()) => Err(Failure::at(node, PdoFailure::Occupied { id, by: CobIdUser::Traffic })),
        None => Ok(()),
    }
}
