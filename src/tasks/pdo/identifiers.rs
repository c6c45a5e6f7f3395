//! Whether an identifier is free for a TPDO.

use super::device::Device;
use crate::bus::Filters;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::value::DataType;
use crate::master::{Error, Happening};
use crate::node::Node;
use crate::node::read::read_values;
use crate::tasks::scan::scan;
use crate::tasks::{Failure, Kind};
use std::time::Duration;

/// How long it is listened for somebody who sends with the identifier.
const LISTEN: Duration = Duration::from_millis(200);

/// TIME of the predefined connection set.
const TIME: CanId = CanId::Standard(0x100);

/// Words that hold an identifier: SYNC, EMCY, and the first PDOs of either direction (CiA 301).
const WORDS: [(u16, u8, &str); 14] = [
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

/// That nothing of the device itself has the identifier.
///
/// # Errors
/// What has it.
pub(super) fn free_of_own(instrument: &Node, number: TpdoNumber, id: CanId) -> Result<(), Failure> {
    let mut taken = vec![
        (instrument.sync, "SYNC".to_owned()),
        (CanId::SYNC, "SYNC".to_owned()),
        (TIME, "TIME".to_owned()),
        (instrument.emergency, "its EMCY".to_owned()),
    ];
    let others = instrument.tpdos.iter().filter(|tpdo| tpdo.number != number && tpdo.cob_id.is_valid());
    taken.extend(others.map(|tpdo| (tpdo.cob_id.can_id(), format!("its {}", tpdo.number))));
    match taken.into_iter().find(|(other, _)| *other == id) {
        Some((_, what)) => Err(occupied(instrument.id, id, &what)),
        None => Ok(()),
    }
}

/// That nobody else has the identifier: the other nodes that a scan finds are asked for theirs, and it is
/// listened for a moment.
///
/// # Errors
/// Who has it, and what stops everything.
pub(super) fn free_of_others(device: &mut Device<'_, '_>, id: CanId) -> Result<(), Failure> {
    let node = device.node;
    let master = &mut *device.master;
    let all: Vec<NodeId> = NodeId::all().filter(|&other| other != node).collect();
    let timeout = LISTEN.min(master.timing().timeout);
    let rounds = 1 + master.timing().retries;
    let found = scan(master, &all, timeout, rounds, &Default::default())?;
    let others: Vec<NodeId> = found.iter().map(|found| found.node).collect();
    master.listen_to(&others)?;
    let words = |&other: &NodeId| {
        WORDS.map(|(index, sub, what)| (what, (other, ObjectId::new(index, sub), DataType::Unsigned(4))))
    };
    let (names, items): (Vec<_>, Vec<_>) = others.iter().flat_map(words).unzip();
    let values = read_values(master, &items)?;
    master.listen(&Filters::Only(vec![id]))?;
    let taken = names.iter().zip(&items).zip(&values).find(|((_, (_, object, _)), value)| {
        let word = value.as_ref().ok().and_then(|value| value.as_u64()).and_then(|word| u32::try_from(word).ok());
        // Bit 31 of 1005h and 1012h says nothing about their existence.
        let exists = |word: CobId| word.is_valid() || matches!(object.index, 0x1005 | 0x1012);
        word.map(CobId).is_some_and(|word| exists(word) && word.can_id() == id)
    });
    if let Some(((what, (other, ..)), _)) = taken {
        return Err(occupied(node, id, &format!("{what} of node {other}")));
    }
    let until = master.now() + LISTEN;
    let heard = loop {
        match master.next(until)? {
            Happening::Frame(received) if received.frame.id() == id => break true,
            Happening::Deadline => break false,
            Happening::Interrupted => return Err(Error::Interrupted.into()),
            _ => {}
        }
    };
    master.listen_to(&[node])?;
    if heard { Err(occupied(node, id, "somebody who sends with it")) } else { Ok(()) }
}

fn occupied(node: NodeId, id: CanId, by: &str) -> Failure {
    let message = format!("identifier 0x{id} is occupied by {by}: nothing was changed");
    Failure::of_node(Kind::CheckFailed, node, message).hint("choose another one: --cob-id")
}
