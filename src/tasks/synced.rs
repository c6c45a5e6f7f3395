//! Detects TPDOs that arrive more than once per SYNC, because two devices send them or a bridge repeats frames.

use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::pdo::{TpdoNumber, Transmission};
use crate::measure::layout::Tpdo;
use crate::node::Node;
use std::collections::BTreeMap;

/// The number of TPDOs that may arrive in excess if another node sends SYNC. The SYNC before the first TPDO may not have
/// been received.
const FOREIGN_TOLERANCE: u64 = 1;

/// A TPDO that arrived without a SYNC for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Surplus {
    /// The node.
    pub(super) node: NodeId,
    /// The TPDO.
    pub(super) number: TpdoNumber,
    /// Whether its values differ from those of the previous frame, so that they come from two devices.
    pub(super) differs: bool,
    /// Whether this is the first surplus of this kind from this TPDO.
    pub(super) is_new: bool,
}

/// A TPDO that is sent at every n-th SYNC.
#[derive(Debug)]
struct SyncedTpdo {
    node: NodeId,
    number: TpdoNumber,
    sync: CanId,
    every: u64,
    /// SYNC messages, remote requests, and the TPDOs after the first SYNC.
    syncs: u64,
    requests: u64,
    received: u64,
    last: Option<Frame>,
    is_repeated: bool,
    is_shared: bool,
}

/// The TPDOs of nodes that are sent on SYNC.
#[derive(Debug, Default)]
pub(super) struct SyncedTpdos {
    tpdos: BTreeMap<CanId, SyncedTpdo>,
    /// Whether this program sends SYNC, so that every SYNC is counted.
    is_producer: bool,
    /// Whether this program sends remote requests, which it does not receive.
    is_requesting: bool,
}

impl SyncedTpdos {
    /// Creates a detector without TPDOs.
    pub(super) fn new(is_producer: bool, is_requesting: bool) -> SyncedTpdos {
        SyncedTpdos { is_producer, is_requesting, ..SyncedTpdos::default() }
    }

    /// Adds the present setup of a node.
    pub(super) fn set_up(&mut self, node: &Node) {
        let before = std::mem::take(&mut self.tpdos);
        let (mut own, others): (BTreeMap<_, _>, _) =
            before.into_iter().partition(|(_, tpdo): &(CanId, SyncedTpdo)| tpdo.node == node.id);
        self.tpdos = others;
        // A node also answers remote requests.
        let is_requesting = self.is_requesting;
        let is_watched = |tpdo: &&Tpdo| tpdo.cob_id.is_valid() && !(is_requesting && tpdo.cob_id.allows_rtr());
        for tpdo in node.tpdos.iter().filter(is_watched) {
            let Some(Transmission::Sync(every)) = tpdo.transmission else { continue };
            let id = tpdo.cob_id.can_id();
            let every = u64::from(every.max(1));
            let known = own.remove(&id).filter(|known| known.every == every && known.sync == node.sync);
            let new = SyncedTpdo {
                node: node.id,
                number: tpdo.number,
                sync: node.sync,
                every,
                syncs: 0,
                requests: 0,
                received: 0,
                last: None,
                is_repeated: false,
                is_shared: false,
            };
            self.tpdos.insert(id, known.unwrap_or(new));
        }
    }

    /// SYNC was sent with this COB-ID.
    pub(super) fn on_sync(&mut self, id: CanId) {
        self.tpdos.values_mut().filter(|tpdo| tpdo.sync == id).for_each(|tpdo| tpdo.syncs += 1);
    }

    /// Frames were lost, perhaps SYNC messages.
    pub(super) fn on_lost_frames(&mut self) {
        self.tpdos.values_mut().for_each(|tpdo| (tpdo.syncs, tpdo.requests, tpdo.received) = (0, 0, 0));
    }

    /// Handles a frame. Returns a surplus TPDO, which must not be used.
    pub(super) fn take(&mut self, frame: &Frame) -> Option<Surplus> {
        let is_producer = self.is_producer;
        let Some(tpdo) = self.tpdos.get_mut(&frame.id()) else {
            if !is_producer && !frame.is_remote() {
                self.on_sync(frame.id());
            }
            return None;
        };
        if frame.is_remote() {
            // The answer to a request before the first SYNC may arrive after it.
            tpdo.requests = if tpdo.syncs > 0 { tpdo.requests + 1 } else { 1 };
            return None;
        }
        let due = tpdo.requests
            + match is_producer {
                true => tpdo.syncs.div_ceil(tpdo.every),
                false => tpdo.syncs / tpdo.every + FOREIGN_TOLERANCE,
            };
        let previous = tpdo.last.replace(*frame);
        if tpdo.syncs == 0 || tpdo.received < due && !tpdo.is_shared {
            tpdo.received += u64::from(tpdo.syncs > 0);
            return None;
        }
        let differs = tpdo.is_shared || previous.is_some_and(|previous| previous != *frame);
        let reported = if differs { &mut tpdo.is_shared } else { &mut tpdo.is_repeated };
        let is_new = !std::mem::replace(reported, true);
        Some(Surplus { node: tpdo.node, number: tpdo.number, differs, is_new })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::pdo::CobId;

    /// The result for a TPDO at every n-th SYNC: `S` is SYNC, and other letters are TPDOs with this content.
    fn found(is_producer: bool, every: u8, frames: &str) -> Vec<(usize, bool)> {
        let mut node = Node::new(NodeId::new(5).expect("a node-ID"));
        node.tpdos.push(Tpdo {
            number: TpdoNumber::new(1).expect("a number"),
            cob_id: CobId(0x4000_0185),
            transmission: Some(Transmission::Sync(every)),
            event_timer_ms: None,
            mapping: Vec::new(),
        });
        let mut synced = SyncedTpdos::new(is_producer, false);
        synced.set_up(&node);
        let mut found = Vec::new();
        for (at, letter) in frames.bytes().enumerate() {
            if letter == b'S' && is_producer {
                synced.on_sync(CanId::SYNC);
                continue;
            }
            let text = match letter {
                b'S' => "080#".to_owned(),
                b'R' => "185#R1".to_owned(),
                _ => format!("185#{letter:02X}"),
            };
            let surplus = synced.take(&text.parse().expect("a frame"));
            found.extend(surplus.filter(|surplus| surplus.is_new).map(|surplus| (at, surplus.differs)));
        }
        found
    }

    #[test]
    fn second_tpdo_after_one_sync_shows_two_senders_or_a_repetition() {
        assert_eq!(found(true, 1, "SASBSC"), []);
        assert_eq!(found(true, 1, "SaSSbcSd"), [], "late, not twice");
        assert_eq!(found(true, 1, "xySaSb"), [], "before the first SYNC");
        assert_eq!(found(true, 1, "Sab"), [(2, true)]);
        assert_eq!(found(true, 1, "Saa"), [(2, false)]);
        assert_eq!(found(true, 1, "SaaSbbSbc"), [(2, false), (8, true)]);
        assert_eq!(found(true, 3, "SSSaSSSb"), []);
        assert_eq!(found(true, 3, "SSSabSSSab"), [(4, true)]);
        assert_eq!(found(true, 1, "SaRbSRcd"), [], "answers to remote requests");
        assert_eq!(found(true, 1, "SaRbc"), [(4, true)], "one answer too many");
        assert_eq!(found(true, 1, "RaRSbc"), [], "an answer after the first SYNC");
    }

    #[test]
    fn sync_of_another_node_may_have_been_missed() {
        assert_eq!(found(false, 1, "SabScSd"), [], "one SYNC may be missing");
        assert_eq!(found(false, 1, "SabSab"), [(5, true)]);
        assert_eq!(found(false, 1, "SaaSaaSaa"), [(5, false)]);
        assert_eq!(found(false, 2, "aSSbSScSSdSSe"), []);
    }
}
