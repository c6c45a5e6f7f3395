//! Detects TPDOs that arrive more than once per SYNC, because two devices send them or a bridge repeats frames.

use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::pdo::{TpdoNumber, Transmission};
use crate::measure::layout::Tpdo;
use crate::node::Node;
use std::collections::BTreeMap;
use std::time::Duration;

/// If another node sends SYNC, this many surplus TPDOs are tolerated, because the SYNC before the first TPDO may have
/// been missed.
const FOREIGN_TOLERANCE: u64 = 1;

/// A TPDO of unknown transmission type is treated as synchronous if a pair of its frames follows each of this many
/// consecutive SYNC messages.
const MIN_PAIRS: u32 = 3;

/// The two frames of a pair arrive within 1/`PAIR_DIVISOR` of the SYNC interval.
const PAIR_DIVISOR: u32 = 4;

/// A second sender of a TPDO is detected within this number of SYNC messages of another node.
const SYNCS_TO_DECIDE: u64 = FOREIGN_TOLERANCE + 2;

/// A TPDO that arrived without a SYNC for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Surplus {
    /// The node.
    pub(super) node: NodeId,
    /// The TPDO.
    pub(super) number: TpdoNumber,
    /// Whether its values differ from the values of the previous frame. Two devices then send this TPDO.
    pub(super) differs: bool,
    /// Whether this is the first surplus of this kind from this TPDO.
    pub(super) is_new: bool,
}

/// A TPDO that is sent at every n-th SYNC, or whose transmission type is unknown.
#[derive(Debug)]
struct SyncedTpdo {
    node: NodeId,
    number: TpdoNumber,
    sync: CanId,
    /// The number n; `None` if the transmission type is unknown.
    every: Option<u64>,
    /// The numbers of SYNC messages, of remote requests, and of TPDOs after the first SYNC.
    syncs: u64,
    requests: u64,
    received: u64,
    last: Option<Frame>,
    /// The time of the last SYNC, and of the TPDOs since then.
    last_sync: Option<Mono>,
    since_sync: Vec<Mono>,
    /// The time between the last two SYNC messages.
    interval: Duration,
    /// The number of consecutive SYNC messages, up to the latest, that were each followed by a pair of TPDOs.
    pairs: u32,
    is_repeated: bool,
    is_shared: bool,
}

impl SyncedTpdo {
    fn on_sync(&mut self, at: Mono) {
        self.syncs += 1;
        self.interval = self.last_sync.replace(at).map_or(Duration::ZERO, |last| at.since(last));
        self.pairs = if self.has_pair() { self.pairs + 1 } else { 0 };
        self.since_sync.clear();
    }

    /// Whether two TPDOs arrived since the last SYNC, one shortly after the other.
    fn has_pair(&self) -> bool {
        matches!(self.since_sync[..], [first, second] if second.since(first) < self.interval / PAIR_DIVISOR)
    }

    /// Whether a TPDO that arrives now is in excess.
    fn is_surplus(&self, is_only_producer: bool) -> bool {
        let Some(every) = self.every else {
            return self.is_shared || self.pairs + 1 >= MIN_PAIRS && self.has_pair() && self.requests == 0;
        };
        let due = self.requests
            + match is_only_producer {
                true => self.syncs.div_ceil(every),
                false => self.syncs / every + FOREIGN_TOLERANCE,
            };
        self.syncs > 0 && (self.received >= due || self.is_shared)
    }

    /// Whether enough SYNC messages were received to detect a second sender.
    fn is_decided(&self) -> bool {
        self.last.is_none()
            || self.syncs >= self.every.map_or(u64::from(MIN_PAIRS) + 1, |every| every * SYNCS_TO_DECIDE)
    }
}

/// The TPDOs of nodes that are sent on SYNC.
#[derive(Debug, Default)]
pub(super) struct SyncedTpdos {
    tpdos: BTreeMap<CanId, SyncedTpdo>,
    /// Whether this program sends SYNC.
    is_producer: bool,
    /// Whether another node sends SYNC, so that a SYNC may have been missed.
    has_other_producer: bool,
    /// Whether this program sends remote requests. It does not receive its own requests, so it cannot count them.
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
        // If this program sends remote requests, the answers look like surplus TPDOs. So TPDOs that allow RTR are not
        // watched.
        let is_requesting = self.is_requesting;
        let is_watched = |tpdo: &&Tpdo| tpdo.cob_id.is_valid() && !(is_requesting && tpdo.cob_id.allows_rtr());
        for tpdo in node.tpdos.iter().filter(is_watched) {
            let every = match tpdo.transmission {
                Some(Transmission::Sync(every)) => Some(u64::from(every.max(1))),
                Some(_) => continue,
                None => None,
            };
            let id = tpdo.cob_id.can_id();
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
                last_sync: None,
                since_sync: Vec::new(),
                interval: Duration::ZERO,
                pairs: 0,
                is_repeated: false,
                is_shared: false,
            };
            self.tpdos.insert(id, known.unwrap_or(new));
        }
    }

    /// Counts a SYNC that was sent with this COB-ID.
    pub(super) fn on_sync(&mut self, id: CanId, at: Mono) {
        self.tpdos.values_mut().filter(|tpdo| tpdo.sync == id).for_each(|tpdo| tpdo.on_sync(at));
    }

    /// Whether this TPDO may still have a second sender that is not detected yet. This is possible only if another node
    /// may send SYNC.
    pub(super) fn may_have_second_sender(&self, id: CanId) -> bool {
        !self.is_producer && self.tpdos.get(&id).is_some_and(|tpdo| !tpdo.is_decided())
    }

    /// Whether enough SYNC messages were received to detect a second sender of each received TPDO.
    pub(super) fn is_decided(&self) -> bool {
        self.is_producer || self.tpdos.values().all(SyncedTpdo::is_decided)
    }

    /// Counts from zero again, because SYNC messages may be among the lost frames.
    pub(super) fn on_lost_frames(&mut self) {
        for tpdo in self.tpdos.values_mut() {
            (tpdo.syncs, tpdo.requests, tpdo.received, tpdo.pairs) = (0, 0, 0, 0);
        }
    }

    /// Handles a frame. Returns a surplus TPDO, which must not be used.
    pub(super) fn on_frame(&mut self, frame: &Frame, at: Mono) -> Option<Surplus> {
        let is_only_producer = self.is_producer && !self.has_other_producer;
        let Some(tpdo) = self.tpdos.get_mut(&frame.id()) else {
            if !frame.is_remote() && self.tpdos.values().any(|tpdo| tpdo.sync == frame.id()) {
                self.has_other_producer = true;
                self.on_sync(frame.id(), at);
            }
            return None;
        };
        if frame.is_remote() {
            // The answer to a remote request that was sent before the first SYNC may arrive after this SYNC.
            tpdo.requests = if tpdo.syncs > 0 { tpdo.requests + 1 } else { 1 };
            return None;
        }
        tpdo.since_sync.push(at);
        tpdo.since_sync.truncate(3);
        let previous = tpdo.last.replace(*frame);
        if !tpdo.is_surplus(is_only_producer) {
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

    /// Returns the surplus frames (index, whether they differ) of a TPDO at every n-th SYNC (0: its type is unknown):
    /// `S` is SYNC, `-` a pause, and other letters are TPDOs with this content, one every millisecond. `F` is a SYNC of
    /// another node.
    fn found(is_producer: bool, every: u8, frames: &str) -> Vec<(usize, bool)> {
        let mut node = Node::new(NodeId::new(5).expect("a node-ID"));
        node.tpdos.push(Tpdo {
            number: TpdoNumber::new(1).expect("a number"),
            cob_id: CobId(0x4000_0185),
            transmission: (every > 0).then_some(Transmission::Sync(every)),
            event_timer_ms: None,
            mapping: Vec::new(),
        });
        let mut synced = SyncedTpdos::new(is_producer, false);
        synced.set_up(&node);
        let mut found = Vec::new();
        for (at, letter) in frames.bytes().enumerate() {
            let now = Mono::START + Duration::from_millis(at as u64);
            if letter == b'S' && is_producer {
                synced.on_sync(CanId::SYNC, now);
                continue;
            }
            let text = match letter {
                b'-' => continue,
                b'S' | b'F' => "080#".to_owned(),
                b'R' => "185#R1".to_owned(),
                _ => format!("185#{letter:02X}"),
            };
            let surplus = synced.on_frame(&text.parse().expect("a frame"), now);
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
        assert_eq!(found(true, 1, "SaFbSFcdSeFFfgS"), [], "both nodes send SYNC");
        assert_eq!(found(true, 1, "SaFbScSdeSfg"), [(11, true)]);
    }

    #[test]
    fn tpdo_of_unknown_type_in_pairs_at_sync_has_two_senders() {
        let pairs = |pair: &str, count: usize| format!("{pair}------").repeat(count);
        for is_producer in [false, true] {
            assert_eq!(found(is_producer, 0, &pairs("Sab", 2)), []);
            assert_eq!(found(is_producer, 0, &pairs("Sab", 4)), [(20, true)]);
            assert_eq!(found(is_producer, 0, &pairs("Saa", 4)), [(20, false)]);
            assert_eq!(found(is_producer, 0, &pairs("Sa---b", 4)), [], "a timer of half the interval");
            assert_eq!(found(is_producer, 0, &pairs("Sabc", 4)), [], "sent on change");
            assert_eq!(found(is_producer, 0, &"Sab------Sa-------".repeat(4)), []);
            assert_eq!(found(is_producer, 0, &pairs("SRab", 4)), [], "answers to remote requests");
        }
    }
}
