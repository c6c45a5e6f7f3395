//! Counts the values that were due after a SYNC or a remote request but did not arrive.

use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::pdo::Transmission;
use crate::measure::decode::Decoder;
use crate::node::Node;
use crate::tasks::log::Mode;
use std::collections::BTreeMap;
use std::time::Duration;

/// A TPDO that is sent at every n-th SYNC, or on each remote request.
#[derive(Debug, Default)]
struct DueTpdo {
    /// The number n, 1 to 240.
    every: u8,
    /// The number of recorded values of the TPDO.
    values: u64,
    /// SYNC messages whose cycle has ended.
    syncs: u64,
    /// Frames received in these cycles.
    received: u64,
    /// Frames received in the present cycle.
    current: u64,
}

/// Counts the values that are due after each SYNC of this program.
#[derive(Debug, Default)]
pub(super) struct DueTpdos {
    tpdos: BTreeMap<CanId, DueTpdo>,
    /// The time of the last SYNC.
    last: Option<Mono>,
}

impl DueTpdos {
    /// Applies the present setup of the nodes, and keeps the counts.
    pub(super) fn set_up(&mut self, nodes: &[Node], decoder: &Decoder, mode: Mode) {
        for tpdo in nodes.iter().flat_map(|node| &node.tpdos).filter(|tpdo| tpdo.cob_id.is_valid()) {
            let every = match (mode, tpdo.transmission) {
                (Mode::Request(_), _) => Some(1),
                (_, Some(Transmission::Sync(every))) => Some(every),
                _ => None,
            };
            if let Some(every) = every {
                let id = tpdo.cob_id.can_id();
                let due = self.tpdos.entry(id).or_default();
                (due.every, due.values) = (every, decoder.values_of(id));
            }
        }
    }

    /// Starts a cycle with the SYNC sent at `at`, and ends the previous cycle.
    pub(super) fn on_sync(&mut self, at: Mono) {
        if self.last.replace(at).is_some() {
            self.end_cycle();
        }
    }

    /// Handles a frame.
    pub(super) fn on_frame(&mut self, frame: &Frame) {
        if let Some(due) = self.tpdos.get_mut(&frame.id()).filter(|_| !frame.is_remote()) {
            due.current += 1;
        }
    }

    fn end_cycle(&mut self) {
        for due in self.tpdos.values_mut() {
            due.syncs += 1;
            due.received += std::mem::take(&mut due.current);
        }
    }

    /// Returns the number of values that were due by `end` but did not arrive.
    pub(super) fn missing(mut self, end: Mono, interval: Duration) -> u64 {
        if self.last.is_some_and(|last| end.since(last) >= interval) {
            self.end_cycle();
        }
        let missing =
            |due: &DueTpdo| (due.syncs / u64::from(due.every.max(1))).saturating_sub(due.received) * due.values;
        self.tpdos.values().map(missing).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: u64) -> Mono {
        Mono::at(Duration::from_millis(milliseconds))
    }

    fn missing(every: u8, received: &[u64], end: u64) -> u64 {
        let due = DueTpdo { every, values: 2, ..DueTpdo::default() };
        let mut tpdos = DueTpdos { tpdos: BTreeMap::from([(CanId::Standard(0x181), due)]), last: None };
        for cycle in 0..6 {
            tpdos.on_sync(at(cycle * 100));
            if received.contains(&cycle) {
                tpdos.on_frame(&"181#00".parse().expect("a frame"));
            }
        }
        tpdos.missing(at(end), Duration::from_millis(100))
    }

    #[test]
    fn value_without_frame_in_its_cycle_is_missing() {
        assert_eq!(missing(1, &[0, 1, 2, 3, 4, 5], 600), 0);
        assert_eq!(missing(1, &[1, 2, 4, 5], 600), 4, "two frames of two values");
        assert_eq!(missing(1, &[1, 2, 4], 520), 4, "the last cycle is not over");
        assert_eq!(missing(1, &[1, 2, 4], 600), 6);
    }

    #[test]
    fn tpdo_at_every_third_sync_is_due_at_every_third() {
        assert_eq!((missing(3, &[2, 5], 600), missing(3, &[2], 600), missing(240, &[], 600)), (0, 2, 0));
    }
}
