//! Frames that were received instead of an answer. They explain why a request failed.

use super::Master;
use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{ErrorControlMessage, NmtState};
use crate::canopen::object::ObjectId;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Requests without an answer are repeated for this time after a boot-up message.
const START_TIME: Duration = Duration::from_secs(5);

/// The limit for the total time of repeats without an answer. It is needed because random traffic may look like many
/// boot-up messages.
const TOTAL_REPEAT_LIMIT: Duration = Duration::from_secs(10);

/// Facts about a node that did not answer a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MissedAnswer {
    /// The first frame that looks like an answer: with another index, or with another COB-ID.
    pub frame: Option<Frame>,
    /// The state in the last heartbeat of the node.
    pub state: Option<NmtState>,
    /// Whether the node answered an earlier request.
    pub has_answered: bool,
}

/// The facts about all nodes.
#[derive(Debug, Default)]
pub(super) struct MissedAnswers {
    states: BTreeMap<NodeId, NmtState>,
    answered: BTreeSet<NodeId>,
    /// The time of the boot-up message of each node that has not answered since.
    boot_times: BTreeMap<NodeId, Mono>,
    /// The total time spent on unanswered repeats after boot-up messages.
    time_without_answer: Duration,
    /// The object of each request without an answer so far, and another frame that was received instead.
    open: BTreeMap<NodeId, (ObjectId, Option<Frame>)>,
    /// The last request of another master to each node.
    foreign_requests: BTreeMap<NodeId, ObjectId>,
    /// Optional objects without a valid answer.
    unknown: BTreeSet<(NodeId, ObjectId)>,
    /// Nodes whose request was repeated. Their answers may have another COB-ID.
    repeated: BTreeSet<NodeId>,
}

impl Master<'_> {
    /// Records an optional object without a valid answer.
    pub fn add_unknown(&mut self, node: NodeId, object: ObjectId) {
        self.sdo.missed_answers.unknown.insert((node, object));
    }

    /// The state in the last heartbeat of a node, if one was received after its last boot-up message.
    pub fn last_state(&self, node: NodeId) -> Option<NmtState> {
        self.sdo.missed_answers.states.get(&node).copied()
    }

    /// The optional objects without a valid answer, by node.
    pub fn unknown_objects(&self) -> BTreeMap<NodeId, Vec<ObjectId>> {
        let mut objects: BTreeMap<NodeId, Vec<ObjectId>> = BTreeMap::new();
        for &(node, object) in &self.sdo.missed_answers.unknown {
            objects.entry(node).or_default().push(object);
        }
        objects
    }
}

impl MissedAnswers {
    /// Records that a request was sent.
    pub(super) fn on_request(&mut self, node: NodeId, object: ObjectId) {
        self.open.insert(node, (object, None));
    }

    /// Records that a request without an answer is repeated.
    pub(super) fn on_repeat(&mut self, node: NodeId) {
        self.repeated.insert(node);
    }

    /// Adds the time for which requests were repeated after a boot-up message, without an answer.
    pub(super) fn add_time_without_answer(&mut self, time: Duration) {
        self.time_without_answer += time;
    }

    /// Whether a node started a short time ago and has not answered since. Some devices do not answer for 2 to 3 s
    /// after their boot-up message. `asked_at` is the time of the first request: further boot-up messages do not extend
    /// the time limit.
    pub(super) fn is_starting(&self, node: NodeId, asked_at: Option<Mono>, now: Mono) -> bool {
        let is_recent = |moment: Mono| now.since(moment) < START_TIME;
        let has_started = self.boot_times.get(&node).copied().is_some_and(is_recent);
        has_started && asked_at.is_none_or(is_recent) && self.time_without_answer < TOTAL_REPEAT_LIMIT
    }

    /// Whether frames with other COB-IDs are needed, because the answer to a repeated request may have such a COB-ID.
    pub(super) fn wants_all_frames(&self) -> bool {
        !self.repeated.is_empty()
    }

    /// Whether a request has no answer so far.
    pub(super) fn has_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// Records an answer from a node.
    pub(super) fn on_answer(&mut self, node: NodeId) {
        self.answered.insert(node);
        self.boot_times.remove(&node);
        self.end(node);
    }

    /// Ends the open request of a node. Returns the facts that explain a missing answer.
    pub(super) fn end(&mut self, node: NodeId) -> MissedAnswer {
        self.repeated.remove(&node);
        let frame = self.open.remove(&node).and_then(|(_, frame)| frame);
        let (state, has_answered) = (self.states.get(&node).copied(), self.answered.contains(&node));
        MissedAnswer { frame, state, has_answered }
    }

    /// Forgets the open requests.
    pub(super) fn cancel(&mut self) {
        (self.open, self.repeated) = (BTreeMap::new(), BTreeSet::new());
    }

    /// Handles a frame on the SDO channel of a node, if the frame is not part of our transfer.
    pub(super) fn on_channel(&mut self, node: NodeId, frame: &Frame, now: Mono) {
        if frame.id().sdo_request_node().is_some() {
            // Another master uses the channel: the frames may be answers to that master.
            self.open.remove(&node);
            self.foreign_requests.extend(object_of(frame).map(|object| (node, object)));
        } else if let Some((_, candidate)) = self.open.get_mut(&node) {
            candidate.get_or_insert(*frame);
        } else if !self.answered.contains(&node) && self.foreign_requests.get(&node).copied() != object_of(frame) {
            self.on_other_cob_id(frame, now);
        }
    }

    /// Handles a frame with another COB-ID.
    pub(super) fn on_other_cob_id(&mut self, frame: &Frame, now: Mono) {
        if let Some((node, life)) = ErrorControlMessage::parse(frame) {
            match life {
                ErrorControlMessage::State(state) => {
                    self.states.insert(node, state);
                }
                ErrorControlMessage::BootUp => {
                    self.states.remove(&node);
                    self.boot_times.insert(node, now);
                }
            }
            return;
        }
        let [0x41..=0x43 | 0x47 | 0x4b | 0x4f | 0x60 | 0x80, ..] = *frame.data() else { return };
        let Some(object) = object_of(frame) else { return };
        for (asked, candidate) in self.open.values_mut() {
            if *asked == object {
                candidate.get_or_insert(*frame);
            }
        }
    }
}

/// Returns the object in the first frame of a transfer.
fn object_of(frame: &Frame) -> Option<ObjectId> {
    let [_, a, b, c, _, _, _, _] = *frame.data() else { return None };
    Some(ObjectId::from_multiplexer([a, b, c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJECT: ObjectId = ObjectId::new(0x1017, 0);

    fn missed(frames: &[&str]) -> MissedAnswer {
        let node = NodeId::new(5).expect("a node-ID");
        let mut missed_answers = MissedAnswers::default();
        missed_answers.on_request(node, OBJECT);
        for text in frames {
            let frame: Frame = text.parse().expect("a frame");
            match frame.id().sdo_response_node().or_else(|| frame.id().sdo_request_node()) {
                Some(other) => missed_answers.on_channel(other, &frame, Mono::START),
                None => missed_answers.on_other_cob_id(&frame, Mono::START),
            }
        }
        missed_answers.end(node)
    }

    #[test]
    fn frames_that_look_like_the_answer_are_kept() {
        for candidate in
            ["585#6000000000000000", "585#6017100100000000", "5C5#6017100000000000", "586#4B171000F4010000"]
        {
            assert_eq!(missed(&[candidate]).frame.map(|frame| frame.to_string()).as_deref(), Some(candidate));
        }
        for other in ["5C5#6018100000000000", "185#6017100000000000AA", "605#4018100100000000", "705#05"] {
            assert_eq!(missed(&other.parse::<Frame>().map(|_| vec![other]).unwrap_or_default()).frame, None, "{other}");
        }
        assert_eq!(missed(&["605#4018100100000000", "585#4318100147000000"]).frame, None, "another master's");
        assert_eq!(missed(&["606#4017100000000000", "586#4B171000F4010000"]).frame, None, "asked by another master");
        assert_eq!(missed(&["705#04"]).state, Some(NmtState::Stopped));
        assert_eq!(missed(&["705#04", "705#00"]).state, None);
    }
}
