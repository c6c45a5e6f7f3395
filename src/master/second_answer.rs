//! Detects a second answer to one request: two devices with one node-ID, or a bridge that repeats frames.
//!
//! A server answers each request once, so a second answer shows two devices or a bridge. The second answer is ignored
//! if another master sent a request, or if the request was repeated, because then it may belong to the other request.

use super::Master;
use super::request::{Operation, SdoError, SdoFailure};
use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::multiplexer;
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// The time in which answers may belong to a request of another master.
const FOREIGN_ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// The longest wait for a second answer.
const LONGEST_WAIT: Duration = Duration::from_millis(20);

/// The largest number of earlier answers that are stored, to recognise repeated answers. A slow device answers while a
/// fast one with the same node-ID has already answered many later requests, for example all requests of a set-up.
const MAX_HISTORY: usize = 128;

/// The reaction if two devices answer with one node-ID.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnTwoDevices {
    /// Transfers with the node-ID fail.
    #[default]
    Fail,
    /// Transfers with the node-ID fail, and the failure reports that nothing was written. For commands that write.
    RefuseWrites,
    /// Transfers continue; the value of the object with two answers is unknown. For scans, which report the conflict.
    Report,
}

/// Two answers to one request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SecondAnswer {
    /// The answer that was used.
    pub first: Frame,
    /// The other answer.
    pub second: Frame,
}

impl SecondAnswer {
    /// Returns the object of the request.
    pub(super) fn object(self) -> Option<ObjectId> {
        multiplexer(self.second.data())
    }

    /// Whether the answers differ. They then come from two devices.
    pub fn differs(self) -> bool {
        self.first != self.second
    }
}

impl Master<'_> {
    /// Sets the reaction if two devices answer with one node-ID.
    pub fn set_on_two_devices(&mut self, reaction: OnTwoDevices) {
        self.sdo.on_two_devices = reaction;
    }

    /// Whether transfers with a node-ID continue if two devices answer.
    pub fn tolerates_two_devices(&self) -> bool {
        self.sdo.on_two_devices == OnTwoDevices::Report
    }

    /// Returns the nodes that sent two answers to one request.
    pub fn second_answers(&self) -> Vec<(NodeId, SecondAnswer)> {
        self.sdo.second_answers().collect()
    }
}

impl SdoError {
    /// Returns the error of a transfer if two devices have the node-ID. It contains the request that got two answers,
    /// which may be an earlier request.
    pub(super) fn two_devices(node: NodeId, object: ObjectId, operation: Operation, failure: SdoFailure) -> SdoError {
        let answers = match &failure {
            SdoFailure::TwoDevices(Some(answers)) | SdoFailure::NotWritten(answers) => Some(*answers),
            _ => None,
        };
        let is_write = |answers: SecondAnswer| {
            [answers.first, answers.second].iter().any(|frame| frame.data().first() == Some(&0x60))
        };
        let operation = match answers {
            Some(answers) if is_write(answers) => Operation::Write,
            Some(_) => Operation::Read,
            None => operation,
        };
        SdoError { node, object: answers.and_then(SecondAnswer::object).unwrap_or(object), operation, failure }
    }
}

/// The answers of one node.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    /// The first frame of the latest answer, and the operation that it answers.
    initial: Option<(Frame, Operation)>,
    /// The latest frame that was used.
    latest: Option<Frame>,
    /// Earlier values of `initial`, the latest value last.
    history: VecDeque<(Frame, Operation)>,
    /// Objects whose request was repeated or dropped. More than one answer may arrive.
    repeated: BTreeSet<ObjectId>,
    foreign_until: Option<Mono>,
    finding: Option<SecondAnswer>,
    /// Until this time, a second answer to the latest request may arrive.
    wait_until: Option<Mono>,
    /// Whether a second answer was once awaited and did not arrive: only one device has this node-ID.
    is_single: bool,
    /// Whether [`Answers::take_check`] was called.
    is_checked: bool,
}

impl Answers {
    /// Returns the two different answers, or else the answer that arrived twice.
    pub fn finding(&self) -> Option<SecondAnswer> {
        self.finding
    }

    pub(super) fn differing(&self) -> Option<SecondAnswer> {
        self.finding.filter(|finding| finding.differs())
    }

    /// Whether the serial number must be read before the first write. This is needed if the node has not answered yet,
    /// or if its answers arrive twice. Only the first call returns `true`.
    pub(super) fn take_check(&mut self) -> bool {
        let is_first = !std::mem::replace(&mut self.is_checked, true);
        is_first && (self.latest.is_none() || self.finding.is_some())
    }

    /// Records that the request for this object was repeated or dropped.
    pub fn on_repeated(&mut self, object: ObjectId) {
        self.repeated.insert(object);
    }

    /// Records a request of another master.
    pub(super) fn on_foreign_request(&mut self, at: Mono) {
        self.foreign_until = Some(at + FOREIGN_ANSWER_TIMEOUT);
    }

    /// Records a frame that was used as an answer. `asked_at` is given for the first frame of a transfer.
    pub fn on_answer(&mut self, frame: Frame, operation: Operation, asked_at: Option<Mono>, at: Mono) {
        self.latest = Some(frame);
        let Some(asked_at) = asked_at else { return };
        // Only one device has this node-ID if no second answer to the previous request arrived in time.
        self.is_single |= self.initial.is_some() && self.wait_until.is_none_or(|until| until <= at);
        self.initial = Some((frame, operation));
        self.history.push_back((frame, operation));
        if self.history.len() > MAX_HISTORY {
            self.history.pop_front();
        }
        let wait = (at.since(asked_at) * 2 + Duration::from_millis(2)).min(LONGEST_WAIT);
        self.wait_until = Some(at + wait);
    }

    /// Whether this frame repeats the latest frame and so does not belong to the present request. This is certain in a
    /// segmented transfer, because two successive segments always differ (toggle bit). It is also certain if the previous
    /// request was of the other kind (read or write). An abort is the same for both kinds, so it proves nothing.
    pub(super) fn is_repetition(&self, frame: &Frame, operation: Operation, is_in_segments: bool, at: Mono) -> bool {
        let is_abort = frame.data().first() == Some(&0x80);
        let is_other = !is_abort && self.initial.is_some_and(|(_, previous)| previous != operation);
        self.latest == Some(*frame) && (is_in_segments || is_other) && !self.may_be_foreign(at)
    }

    fn may_be_foreign(&self, at: Mono) -> bool {
        self.foreign_until.is_some_and(|until| at < until)
    }

    /// Handles a frame that does not answer a request. Returns whether it is a second answer.
    pub fn on_unexpected(&mut self, frame: &Frame, at: Mono) -> bool {
        let object = multiplexer(frame.data());
        if self.may_be_foreign(at) || object.is_some_and(|object| self.repeated.contains(&object)) {
            return false;
        }
        if self.latest == Some(*frame) || self.count(frame) > 0 {
            self.finding.get_or_insert(SecondAnswer { first: *frame, second: *frame });
            return true;
        }
        // The second answer of a slow device may arrive after the answer to a later request.
        let is_same =
            |answer: &Frame, operation| multiplexer(answer.data()) == object && could_answer(frame, operation, answer);
        let mut earlier = self.history.iter().rev().map(|&(answer, operation)| (answer, operation));
        let Some((first, _)) = earlier.find(|&(answer, operation)| object.is_some() && is_same(&answer, operation))
        else {
            return false;
        };
        // An answer that was received twice may be a late one, so it proves nothing.
        if self.count(&first) == 1 && self.differing().is_none() {
            self.finding = Some(SecondAnswer { first, second: *frame });
        }
        true
    }

    /// Returns how often this answer is in the history.
    fn count(&self, frame: &Frame) -> usize {
        self.history.iter().filter(|(answer, _)| answer == frame).count()
    }

    /// Returns the time until which a second answer may arrive; `None` if only one device has this node-ID.
    pub(super) fn wait_until(&self) -> Option<Mono> {
        self.wait_until.filter(|_| !self.is_single || self.finding.is_some())
    }

    /// Call this after a wait that ended at `now` without a second answer.
    pub(super) fn on_waited(&mut self, now: Mono) {
        if self.wait_until.is_some_and(|until| until <= now) {
            self.wait_until = None;
            self.is_single = true;
        }
    }
}

/// Whether a frame could answer the same request as `initial`.
fn could_answer(frame: &Frame, operation: Operation, initial: &Frame) -> bool {
    let command = |frame: &Frame| frame.data().first().copied().unwrap_or_default();
    // A server may abort a segmented transfer that it began, so this abort is not a second answer.
    let is_whole = operation == Operation::Write || command(initial) & 0x02 != 0 || command(initial) == 0x80;
    match (command(frame), operation) {
        (0x80, _) => is_whole,
        (0x60, Operation::Write) => true,
        (0x60, Operation::Read) => command(initial) == 0x60,
        (other, Operation::Read) => other >> 5 == 2,
        (_, Operation::Write) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(millis: u64) -> Mono {
        Mono::at(Duration::from_millis(millis))
    }

    fn frame(text: &str) -> Frame {
        text.parse().expect("a frame")
    }

    /// Returns the record after one answer to each request, at 10, 20, … ms.
    fn after(answers: &[(&str, Operation)]) -> Answers {
        let mut log = Answers::default();
        for (at, &(text, operation)) in (1..).zip(answers) {
            log.on_answer(frame(text), operation, Some(ms(at * 10 - 1)), ms(at * 10));
        }
        log
    }

    const SERIAL: &str = "585#4318100434120000";
    const OTHER_SERIAL: &str = "585#4318100499880000";

    #[test]
    fn a_differing_second_answer_shows_two_devices() {
        for (first, second, operation) in [
            (SERIAL, OTHER_SERIAL, Operation::Read),
            (SERIAL, "585#8018100411000906", Operation::Read),
            ("585#8018100411000906", SERIAL, Operation::Read),
            ("585#4108100008000000", "585#4108100003000000", Operation::Read),
            ("585#6017100000000000", "585#8017100022000008", Operation::Write),
        ] {
            let mut log = after(&[(first, operation)]);
            assert!(log.on_unexpected(&frame(second), ms(11)), "{second}");
            let expected = SecondAnswer { first: frame(first), second: frame(second) };
            assert_eq!(log.differing(), Some(expected), "{second}");
        }
    }

    #[test]
    fn a_repeated_answer_is_no_proof_of_two_devices() {
        let mut log = after(&[(SERIAL, Operation::Read), ("585#4F01100000000000", Operation::Read)]);
        for late in [SERIAL, "585#4F01100000000000"] {
            assert!(log.on_unexpected(&frame(late), ms(21)));
        }
        assert!(log.finding().is_some() && log.differing().is_none());
        // The first answer to the second request may be the late answer to the first request.
        let mut log = after(&[(SERIAL, Operation::Read), (SERIAL, Operation::Read)]);
        assert!(log.on_unexpected(&frame(OTHER_SERIAL), ms(21)));
        assert_eq!(log.differing(), None);
    }

    #[test]
    fn a_second_answer_after_a_later_one_shows_two_devices() {
        for (second, expected) in [(OTHER_SERIAL, true), ("585#4318100399880000", false)] {
            let mut log = after(&[(SERIAL, Operation::Read), ("585#4F01100000000000", Operation::Read)]);
            log.on_unexpected(&frame(second), ms(21));
            assert_eq!(log.differing().is_some(), expected, "{second}");
        }
    }

    #[test]
    fn a_second_answer_after_the_reads_of_a_set_up_shows_two_devices() {
        let later: Vec<String> = (0..100).map(|sub| format!("585#43001A{sub:02X}20010161")).collect();
        let answers: Vec<_> = std::iter::once(SERIAL).chain(later.iter().map(String::as_str)).collect();
        let mut log = after(&answers.into_iter().map(|answer| (answer, Operation::Read)).collect::<Vec<_>>());
        assert!(log.on_unexpected(&frame(OTHER_SERIAL), ms(2000)));
        assert!(log.differing().is_some());
    }

    #[test]
    fn other_answers_prove_nothing() {
        let mut log = after(&[(SERIAL, Operation::Read)]);
        // Another object, the acknowledgement of an earlier write, or a segment.
        for other in ["585#4318100134120000", "585#6018100400000000", "585#0018100400000000", "585#"] {
            assert!(!log.on_unexpected(&frame(other), ms(11)), "{other}");
        }
        log.on_foreign_request(ms(11));
        assert!(!log.on_unexpected(&frame(OTHER_SERIAL), ms(900)));
        let mut log = after(&[(SERIAL, Operation::Read)]);
        log.on_repeated(ObjectId::new(0x1018, 4));
        assert!(!log.on_unexpected(&frame(OTHER_SERIAL), ms(11)));
        assert_eq!(log.finding(), None);
    }

    #[test]
    fn repeated_frame_does_not_end_a_later_transfer() {
        let acknowledge = "585#6017100000000000";
        let log = after(&[(acknowledge, Operation::Write)]);
        assert!(log.is_repetition(&frame(acknowledge), Operation::Read, false, ms(11)));
        assert!(!log.is_repetition(&frame(acknowledge), Operation::Write, false, ms(11)));
        assert!(!log.is_repetition(&frame("585#6017100100000000"), Operation::Read, false, ms(11)));
        assert!(log.is_repetition(&frame(acknowledge), Operation::Write, true, ms(11)));
        // A read and a write of a missing object have the same answer.
        let missing = "585#80FF5F0000000206";
        let log = after(&[(missing, Operation::Read)]);
        assert!(!log.is_repetition(&frame(missing), Operation::Write, false, ms(11)));
    }

    #[test]
    fn the_wait_for_a_second_answer_is_short_and_comes_once() {
        let mut log = after(&[(SERIAL, Operation::Read)]);
        assert_eq!(log.wait_until(), Some(ms(14)), "twice the answer time, and 2 ms");
        log.on_waited(ms(14));
        log.on_answer(frame(SERIAL), Operation::Read, Some(ms(30)), ms(31));
        assert_eq!(log.wait_until(), None);
        // After a repeated answer, the master waits after every request again.
        assert!(log.on_unexpected(&frame(SERIAL), ms(32)));
        assert_eq!(log.wait_until(), Some(ms(35)));
        assert!(Answers::default().take_check());
    }
}
