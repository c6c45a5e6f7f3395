//! Nodes whose setup must be read again.
//!
//! After any event that may have changed the mapping, unit or digits of a node, its setup is uncertain. Its frames are
//! then ignored until the setup was read again (exceptions: [`RereadReason`]). The missing rows are counted and
//! reported. Rows decoded with an old mapping would look right but be wrong.

use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::master::{Answer, Error, Master, SdoError, Ticket};
use crate::node::Node;
use crate::node::Overrides;
use crate::node::signals;
use crate::node::survey::BackgroundSurvey;
use std::collections::BTreeMap;
use std::time::Duration;

/// A node is read again after this time without a write. A change of a mapping consists of many writes.
const WRITE_SETTLE_TIME: Duration = Duration::from_millis(500);
/// Interval between two attempts to read a node that does not answer.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);
/// In this number of attempts, every object that was answered before must be answered again. Later attempts accept a
/// missing answer.
const STRICT_ATTEMPTS: u32 = 5;
/// Shortest interval between two rereads of a node because frames were lost. An overloaded bus loses frames all the
/// time.
const FRAMES_LOST_INTERVAL: Duration = Duration::from_secs(60);
/// Shortest interval between two rereads of a node because of a wrong length, if the last one found no change.
const WRONG_LENGTH_INTERVAL: Duration = Duration::from_secs(60);

/// Why the setup of a node must be read again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RereadReason {
    /// The node restarted, or nothing could be received from it for a while. It may need a start command.
    Disconnected,
    /// The heartbeat of the node paused, so a boot-up message may be lost. It may need a start command. A survey in
    /// progress continues: the heartbeats of a busy device can pause again before a survey is complete.
    HeartbeatPaused,
    /// Another master wrote an object on which the TPDOs of the node depend.
    Written,
    /// The length of a TPDO differs from its mapping, so the TPDO was ignored. Other TPDOs are still recorded.
    WrongLength,
    /// Frames were lost. The lost frames rarely contain a boot-up message or a write, so frames of the node are still
    /// recorded. If the setup did change, the affected time is reported.
    FramesLost,
}

/// A node to be read again.
struct Pending {
    /// When the read starts.
    due: Mono,
    survey: Option<BackgroundSurvey>,
    /// Whether the node may need a start command.
    may_need_start: bool,
    /// Since when frames of the node are recorded although its setup is uncertain.
    recorded_since: Option<Mono>,
    /// The number of failed attempts. The first one is reported.
    failures: u32,
}

/// A node that was read again.
pub(super) struct Reread {
    pub(super) node: Node,
    /// Whether the node may need a start command.
    pub(super) may_need_start: bool,
    /// Since when its frames were recorded although its setup was uncertain.
    pub(super) recorded_since: Option<Mono>,
}

/// The nodes to be read again.
pub(super) struct Rereads {
    overrides: Overrides,
    pending: BTreeMap<NodeId, Pending>,
    /// When a reread of each node was last requested because of a wrong length.
    wrong_lengths: BTreeMap<NodeId, Mono>,
    /// When a reread of each node was last requested because frames were lost.
    frames_lost: BTreeMap<NodeId, Mono>,
}

impl Rereads {
    pub(super) fn new(overrides: &Overrides) -> Rereads {
        Rereads {
            overrides: overrides.clone(),
            pending: BTreeMap::new(),
            wrong_lengths: BTreeMap::new(),
            frames_lost: BTreeMap::new(),
        }
    }

    /// Requests a reread of a node. In most cases, a survey in progress is restarted. Returns `false` if no reread is
    /// needed.
    pub(super) fn request(&mut self, node: NodeId, why: RereadReason, now: Mono, master: &mut Master<'_>) -> bool {
        if why == RereadReason::WrongLength {
            if self.wrong_lengths.get(&node).is_some_and(|&before| now.since(before) < WRONG_LENGTH_INTERVAL) {
                return false;
            }
            self.wrong_lengths.insert(node, now);
        }
        let new = || Pending { due: now, survey: None, may_need_start: false, recorded_since: None, failures: 0 };
        if why == RereadReason::FramesLost {
            self.pending.entry(node).or_insert_with(|| {
                let earliest = self.frames_lost.get(&node).map_or(now, |&before| before + FRAMES_LOST_INTERVAL);
                let due = earliest.max(now + WRITE_SETTLE_TIME);
                self.frames_lost.insert(node, due);
                Pending { due, may_need_start: true, recorded_since: Some(now), ..new() }
            });
            return true;
        }
        if why == RereadReason::HeartbeatPaused
            && let Some(pending) = self.pending.get_mut(&node)
            && pending.survey.is_some()
            && pending.recorded_since.is_none()
        {
            pending.may_need_start = true;
            return true;
        }
        let delay = if why == RereadReason::Written { WRITE_SETTLE_TIME } else { Duration::ZERO };
        let pending = self.pending.entry(node).or_insert_with(new);
        pending.due = now + delay;
        pending.may_need_start |= matches!(why, RereadReason::Disconnected | RereadReason::HeartbeatPaused);
        if why != RereadReason::WrongLength {
            pending.recorded_since = None;
        }
        if let Some(survey) = pending.survey.take() {
            survey.cancel(master);
        }
        true
    }

    /// Whether a node is to be read again.
    pub(super) fn is_pending(&self, node: NodeId) -> bool {
        self.pending.contains_key(&node)
    }

    /// Returns when the next survey starts.
    pub(super) fn due(&self) -> Option<Mono> {
        self.pending.values().filter(|pending| pending.survey.is_none()).map(|pending| pending.due).min()
    }

    /// Starts the surveys that are due.
    pub(super) fn start_due(&mut self, now: Mono, master: &mut Master<'_>) {
        for (&node, pending) in &mut self.pending {
            if pending.survey.is_none() && pending.due <= now {
                let requires_known_objects = pending.failures < STRICT_ATTEMPTS;
                pending.survey = Some(BackgroundSurvey::start(node, &self.overrides, requires_known_objects, master));
            }
        }
    }

    /// Whether this transfer belongs to a survey.
    pub(super) fn has(&self, ticket: Ticket) -> bool {
        self.pending.values().any(|pending| pending.has(ticket))
    }

    /// Handles the result of a transfer. Returns a node that was read completely, or the first failure of a node.
    pub(super) fn on_answer(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
    ) -> Option<Result<Reread, (NodeId, Error)>> {
        let (&node, pending) = self.pending.iter_mut().find(|(_, pending)| pending.has(ticket))?;
        match pending.survey.as_mut()?.take(ticket, result, master)? {
            Ok(node) => {
                let (may_need_start, recorded_since) = (pending.may_need_start, pending.recorded_since);
                self.pending.remove(&node.id);
                Some(Ok(Reread { node, may_need_start, recorded_since }))
            }
            Err(error) => {
                pending.survey = None;
                pending.due = master.now() + RETRY_INTERVAL;
                pending.failures += 1;
                (pending.failures == 1).then_some(Err((node, error)))
            }
        }
    }

    /// Allows a reread at the next wrong length, because the mapping of the node has changed.
    pub(super) fn forget_wrong_length(&mut self, node: NodeId) {
        self.wrong_lengths.remove(&node);
    }

    /// Returns the nodes with an uncertain setup, except nodes of which only frames were lost.
    pub(super) fn paused(&self) -> impl Iterator<Item = NodeId> + '_ {
        self.pending.iter().filter(|(_, pending)| pending.recorded_since.is_none()).map(|(&node, _)| node)
    }
}

impl Pending {
    fn has(&self, ticket: Ticket) -> bool {
        self.survey.as_ref().is_some_and(|survey| survey.has(ticket))
    }
}

/// Returns the node whose setup this frame of another master changes: PDO parameters and mapping, unit, digits, and the
/// COB-IDs and times of SYNC, emergency and heartbeat.
pub(super) fn node_with_written_setup(frame: &Frame, nodes: &[Node]) -> Option<NodeId> {
    let node = frame.id().sdo_request_node()?;
    let [command, low, high, sub, ..] = frame.data() else { return None };
    // The start of a download: expedited or segmented (1), or block (6).
    if !matches!(command >> 5, 1 | 6) {
        return None;
    }
    let index = u16::from_le_bytes([*low, *high]);
    let object = ObjectId::new(index, *sub);
    let is_scaling = |known: &Node| known.id == node && signals::scaling_objects(known).contains(&object);
    let is_setup = matches!(index, 0x1005 | 0x1014 | 0x1017 | 0x1800..=0x1bff | 0x6131 | 0x6132);
    (is_setup || nodes.iter().any(is_scaling)).then_some(node)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_that_change_the_setup() {
        let node = |text: &str| node_with_written_setup(&text.parse().expect("a frame"), &[]).map(NodeId::get);
        for text in ["605#2F001A0000000000", "605#2300180181010080", "605#2331610100004E00", "605#2131610104000000"] {
            assert_eq!(node(text), Some(5), "{text}");
        }
        assert_eq!(node("67F#C2001A0104000000"), Some(127), "block download");
        for text in ["605#40001A0000000000", "585#6000000000000000", "605#2B10610100000000", "605#", "605#A2001A01"] {
            assert_eq!(node(text), None, "{text}");
        }
    }
}
