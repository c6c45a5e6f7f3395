//! Reads one node again in the background, for example after it restarted during a recording.

use super::{ObjectReader, Overrides, survey_nodes};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::quirk::Quirk;
use crate::master::{Answer, Error, Master, Request, SdoError, SdoFailure, Ticket};
use crate::node::Node;
use std::collections::{BTreeMap, BTreeSet};

/// A survey of one node that never waits.
///
/// [`survey_nodes`] normally waits for each answer. Here it runs with the answers received so far, and stops at the
/// first object without an answer. This object is then requested. When the answer arrives, the survey runs again from
/// the start. A complete survey needs about eight runs.
pub struct BackgroundSurvey {
    node: NodeId,
    overrides: Overrides,
    answers: BTreeMap<ObjectId, Result<Answer, SdoError>>,
    pending: BTreeMap<Ticket, ObjectId>,
    /// The number of consecutive objects without an answer until now.
    silent: u8,
    /// Whether the survey fails if an object that was answered before has no valid answer now.
    requires_known_objects: bool,
    /// The optional objects without a valid answer.
    unknown: BTreeSet<ObjectId>,
}

/// Why a run of the survey stopped.
enum Stop {
    /// These objects have no answer yet.
    Wanted(Vec<ObjectId>),
    Failed(Error),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Stop {
        Stop::Failed(error)
    }
}

/// Reads objects from the answers received so far.
struct KnownAnswers<'a, 'bus> {
    answers: &'a BTreeMap<ObjectId, Result<Answer, SdoError>>,
    unknown: &'a mut BTreeSet<ObjectId>,
    master: &'a mut Master<'bus>,
}

impl ObjectReader for KnownAnswers<'_, '_> {
    type Stop = Stop;

    fn read_objects(&mut self, objects: &[(NodeId, ObjectId)]) -> Result<Vec<Result<Answer, SdoError>>, Stop> {
        let wanted = objects.iter().map(|(_, object)| *object).filter(|object| !self.answers.contains_key(object));
        let wanted: Vec<ObjectId> = wanted.collect();
        if wanted.is_empty() {
            Ok(objects.iter().filter_map(|(_, object)| self.answers.get(object).cloned()).collect())
        } else {
            Err(Stop::Wanted(wanted))
        }
    }

    fn set_quirks(&mut self, node: NodeId, quirks: &[Quirk]) {
        self.master.set_quirks(node, quirks);
    }

    fn tolerates_two_devices(&self) -> bool {
        self.master.tolerates_two_devices()
    }

    fn add_unknown(&mut self, _: NodeId, object: ObjectId) {
        self.unknown.insert(object);
    }
}

impl BackgroundSurvey {
    /// Starts to read `node` again. With `requires_known_objects`, an object that was answered before and has no valid
    /// answer now is an error.
    pub fn start(
        node: NodeId,
        overrides: &Overrides,
        requires_known_objects: bool,
        master: &mut Master<'_>,
    ) -> BackgroundSurvey {
        let own = overrides.iter().filter(|(other, _)| **other == node);
        let overrides = own.map(|(&node, model)| (node, model.clone())).collect();
        let (answers, pending, unknown) = (BTreeMap::new(), BTreeMap::new(), BTreeSet::new());
        let mut survey =
            BackgroundSurvey { node, overrides, answers, pending, silent: 0, requires_known_objects, unknown };
        // The first run has no answers: it only sends requests.
        let _ = survey.run(master);
        survey
    }

    /// Handles the result of a transfer. `None` if the transfer is not part of this survey, or the survey is not
    /// complete.
    pub fn take(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
    ) -> Option<Result<Node, Error>> {
        let object = self.pending.remove(&ticket)?;
        let error = result.as_ref().err().filter(|error| matches!(error.failure, SdoFailure::NoAnswer { .. }));
        self.silent = if error.is_some() { self.silent + 1 } else { 0 };
        if let Some(error) = error {
            // The other objects are requested again. After two objects without an answer, the node is tested with an
            // object that it answered before. The stored answer is removed, so the next run reads the object again.
            master.forget(std::mem::take(&mut self.pending).into_keys());
            let answered = self.answers.iter().find(|(_, answer)| answer.is_ok()).map(|(&object, _)| object);
            let is_known = self.silent > 1 && answered.is_some_and(|object| self.answers.remove(&object).is_some());
            if self.silent > 2 || self.silent > 1 && !is_known {
                return Some(Err(Error::Sdo(error.clone())));
            }
        }
        self.answers.insert(object, result.clone());
        if self.pending.is_empty() { self.run(master) } else { None }
    }

    /// Whether this transfer is part of the survey.
    pub fn has(&self, ticket: Ticket) -> bool {
        self.pending.contains_key(&ticket)
    }

    /// Cancels the pending transfers.
    pub fn cancel(self, master: &mut Master<'_>) {
        master.forget(self.pending.into_keys());
    }

    fn run(&mut self, master: &mut Master<'_>) -> Option<Result<Node, Error>> {
        let mut known = KnownAnswers { answers: &self.answers, unknown: &mut self.unknown, master };
        match survey_nodes(&mut known, &[self.node], &self.overrides) {
            Ok(mut read) => match self.no_longer_answered(master) {
                Some(error) => Some(Err(Error::Sdo(error))),
                None => read.pop().map(Ok),
            },
            Err(Stop::Failed(error)) => Some(Err(error)),
            Err(Stop::Wanted(objects)) => {
                for object in objects {
                    self.pending.insert(master.start(Request::read(self.node, object)), object);
                }
                None
            }
        }
    }

    /// Returns the error of an object that was answered before, but not now. If there is none, records the unknown
    /// objects.
    fn no_longer_answered(&self, master: &mut Master<'_>) -> Option<SdoError> {
        let before = master.unknown_objects().remove(&self.node).unwrap_or_default();
        let error = |object| self.answers.get(object).and_then(|answer| answer.as_ref().err()).cloned();
        let new = self
            .unknown
            .iter()
            .filter(|object| self.requires_known_objects && !before.contains(object))
            .find_map(error);
        if new.is_none() {
            self.unknown.iter().for_each(|&object| master.add_unknown(self.node, object));
        }
        new
    }
}
