//! Nodes of which it is not certain any more what their TPDOs mean, and how they are read again.
//!
//! Whatever may have changed a node's mapping, unit or digits makes it doubted: from then on no row is made of what
//! it sends, until all of it has been read again. A row that is missing is said and counted; a row that was read
//! by an old mapping is a number that looks right and is wrong.

use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::master::{Answer, Error, Master, SdoError, Ticket};
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::BackgroundSurvey;
use std::collections::BTreeMap;
use std::time::Duration;

/// Somebody who writes a mapping writes many objects; it is read when nothing has been written for this long.
const SETTLED: Duration = Duration::from_millis(500);
/// A node that did not answer is asked again after this long.
const RETRY: Duration = Duration::from_secs(1);
/// Lost frames make nobody read again so soon after others did: on a bus that is too fast that would go on for ever.
const MISSED_AGAIN: Duration = Duration::from_secs(60);
/// TPDOs of a wrong length make nobody read again so soon after they did and nothing had changed.
const LENGTH_AGAIN: Duration = Duration::from_secs(60);

/// Why a node is doubted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Doubt {
    /// It was away, or could not be heard: restarted, perhaps, and not started any more.
    Away,
    /// Somebody else wrote what its TPDOs depend on.
    Written,
    /// A TPDO has not the length of its mapping, and was not recorded for that. Others are, meanwhile.
    Length,
    /// Frames were lost, and with them perhaps what would have made it doubted. That is seldom so, and rows are
    /// missing already: others are made meanwhile, and if something has changed it is said since when.
    Missed,
}

/// A node that is doubted.
struct Doubted {
    /// When to read it.
    due: Mono,
    again: Option<BackgroundSurvey>,
    was_away: bool,
    /// Since when rows have been made of what it sends although it is doubted.
    unheld_since: Option<Mono>,
    /// It has been said that it cannot be read.
    said: bool,
}

/// A node that has been read again.
pub(super) struct Renewed {
    pub(super) instrument: Node,
    /// Whether it was away, and may have to be started.
    pub(super) was_away: bool,
    /// Since when rows have been made by what it was before, if they have.
    pub(super) unheld_since: Option<Mono>,
}

/// The nodes that are doubted.
pub(super) struct Renewals {
    overrides: Overrides,
    doubted: BTreeMap<NodeId, Doubted>,
    /// When TPDOs of a wrong length last made a node doubted.
    lengths: BTreeMap<NodeId, Mono>,
    /// When nodes were last read, or are to be, because frames were lost.
    missed: BTreeMap<NodeId, Mono>,
}

impl Renewals {
    pub(super) fn new(overrides: &Overrides) -> Renewals {
        Renewals {
            overrides: overrides.clone(),
            doubted: BTreeMap::new(),
            lengths: BTreeMap::new(),
            missed: BTreeMap::new(),
        }
    }

    /// Doubts a node from now on; what is being read of it is read once more. `false` where there is no reason to.
    pub(super) fn doubt(&mut self, node: NodeId, why: Doubt, now: Mono, master: &mut Master<'_>) -> bool {
        if why == Doubt::Length {
            if self.lengths.get(&node).is_some_and(|&before| now.since(before) < LENGTH_AGAIN) {
                return false;
            }
            self.lengths.insert(node, now);
        }
        let new = || Doubted { due: now, again: None, was_away: false, unheld_since: None, said: false };
        if why == Doubt::Missed {
            self.doubted.entry(node).or_insert_with(|| {
                let due = self.missed.get(&node).map_or(now, |&before| before + MISSED_AGAIN).max(now + SETTLED);
                self.missed.insert(node, due);
                Doubted { due, was_away: true, unheld_since: Some(now), ..new() }
            });
            return true;
        }
        let wait = if why == Doubt::Written { SETTLED } else { Duration::ZERO };
        let doubted = self.doubted.entry(node).or_insert_with(new);
        doubted.due = now + wait;
        doubted.was_away |= why == Doubt::Away;
        if why != Doubt::Length {
            doubted.unheld_since = None;
        }
        if let Some(again) = doubted.again.take() {
            again.cancel(master);
        }
        true
    }

    /// When something is to be done.
    pub(super) fn due(&self) -> Option<Mono> {
        self.doubted.values().filter(|doubted| doubted.again.is_none()).map(|doubted| doubted.due).min()
    }

    /// Begins to read the nodes that are due.
    pub(super) fn start_due(&mut self, now: Mono, master: &mut Master<'_>) {
        for (&node, doubted) in &mut self.doubted {
            if doubted.again.is_none() && doubted.due <= now {
                doubted.again = Some(BackgroundSurvey::begin(node, &self.overrides, master));
            }
        }
    }

    /// Whether this transfer is one of these.
    pub(super) fn has(&self, ticket: Ticket) -> bool {
        self.doubted.values().any(|doubted| doubted.again.as_ref().is_some_and(|again| again.has(ticket)))
    }

    /// Takes the end of a transfer: a node that has been read, or why one could not be, told once.
    pub(super) fn take(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
    ) -> Option<Result<Renewed, (NodeId, Error)>> {
        let holds = |doubted: &Doubted| doubted.again.as_ref().is_some_and(|again| again.has(ticket));
        let (&node, doubted) = self.doubted.iter_mut().find(|(_, doubted)| holds(doubted))?;
        match doubted.again.as_mut()?.take(ticket, result, master)? {
            Ok(instrument) => {
                let (was_away, unheld_since) = (doubted.was_away, doubted.unheld_since);
                self.doubted.remove(&node);
                Some(Ok(Renewed { instrument, was_away, unheld_since }))
            }
            Err(error) => {
                doubted.again = None;
                doubted.due = master.now() + RETRY;
                let first = !std::mem::replace(&mut doubted.said, true);
                first.then_some(Err((node, error)))
            }
        }
    }

    /// A node's mapping has changed: a wrong length is a reason to read it once more.
    pub(super) fn forget_lengths(&mut self, node: NodeId) {
        self.lengths.remove(&node);
    }

    /// The nodes of which no rows are made.
    pub(super) fn held(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.doubted.iter().filter(|(_, doubted)| doubted.unheld_since.is_none()).map(|(&node, _)| node)
    }
}

/// The node of which this frame of somebody else writes what its measurements are read by: PDO parameters and
/// mapping, unit, digits, and the identifiers and times of its other services.
pub(super) fn writes_setup(frame: &Frame) -> Option<NodeId> {
    let node = frame.id().sdo_request_node()?;
    let [command, low, high, ..] = frame.data() else { return None };
    // The start of a download, expedited or in segments, or in blocks.
    if !matches!(command >> 5, 1 | 6) {
        return None;
    }
    let index = u16::from_le_bytes([*low, *high]);
    matches!(index, 0x1005 | 0x1014 | 0x1017 | 0x1800..=0x1bff | 0x6131 | 0x6132).then_some(node)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_that_change_what_measurements_mean() {
        let node = |text: &str| writes_setup(&text.parse().expect("a frame")).map(NodeId::get);
        for text in ["605#2F001A0000000000", "605#2300180181010080", "605#2331610100004E00", "605#2131610104000000"] {
            assert_eq!(node(text), Some(5), "{text}");
        }
        assert_eq!(node("67F#C2001A0104000000"), Some(127), "in blocks");
        for text in ["605#40001A0000000000", "585#6000000000000000", "605#2B10610100000000", "605#", "605#A2001A01"] {
            assert_eq!(node(text), None, "{text}");
        }
    }
}
