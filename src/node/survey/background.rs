//! Reads one instrument anew while everything else goes on.

use super::{Ask, Overrides, survey_nodes};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::quirk::Quirk;
use crate::master::{Answer, Error, Master, Request, SdoError, SdoFailure, Ticket};
use crate::node::Node;
use std::collections::BTreeMap;

/// A survey of one node that never waits.
///
/// The survey itself is written as if it waited for every answer. It is carried out as often as it stands
/// still: with the answers that have come so far it runs until it asks for something new, which is requested,
/// and when that has come it runs from the start again. It takes some eight steps.
pub struct BackgroundSurvey {
    node: NodeId,
    overrides: Overrides,
    answers: BTreeMap<ObjectId, Result<Answer, SdoError>>,
    under_way: BTreeMap<Ticket, ObjectId>,
}

/// Why the survey stands still.
enum Stop {
    /// These are to be asked for.
    Wanted(Vec<ObjectId>),
    Failed(Error),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Stop {
        Stop::Failed(error)
    }
}

/// What has been answered so far.
struct Known<'a, 'bus> {
    answers: &'a BTreeMap<ObjectId, Result<Answer, SdoError>>,
    master: &'a mut Master<'bus>,
}

impl Ask for Known<'_, '_> {
    type Stop = Stop;

    fn ask(&mut self, objects: &[(NodeId, ObjectId)]) -> Result<Vec<Result<Answer, SdoError>>, Stop> {
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
}

impl BackgroundSurvey {
    /// Begins to read `node` anew.
    pub fn begin(node: NodeId, overrides: &Overrides, master: &mut Master<'_>) -> BackgroundSurvey {
        let own = overrides.iter().filter(|(other, _)| **other == node);
        let overrides = own.map(|(&node, model)| (node, model.clone())).collect();
        let mut again = BackgroundSurvey { node, overrides, answers: BTreeMap::new(), under_way: BTreeMap::new() };
        // Nothing is known, and so it asks.
        let _ = again.go_on(master);
        again
    }

    /// Takes the end of a transfer; `None` where it was none of these, or more is to come.
    pub fn take(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
    ) -> Option<Result<Node, Error>> {
        let object = self.under_way.remove(&ticket)?;
        // Who is silent to one question is not asked the others.
        if let Err(error) = result
            && matches!(error.failure, SdoFailure::NoAnswer { .. })
        {
            master.forget(std::mem::take(&mut self.under_way).into_keys());
            return Some(Err(Error::Sdo(error.clone())));
        }
        self.answers.insert(object, result.clone());
        if self.under_way.is_empty() { self.go_on(master) } else { None }
    }

    /// Whether this transfer is one of these.
    pub fn has(&self, ticket: Ticket) -> bool {
        self.under_way.contains_key(&ticket)
    }

    /// Gives up what is under way.
    pub fn cancel(self, master: &mut Master<'_>) {
        master.forget(self.under_way.into_keys());
    }

    fn go_on(&mut self, master: &mut Master<'_>) -> Option<Result<Node, Error>> {
        let mut known = Known { answers: &self.answers, master };
        match survey_nodes(&mut known, &[self.node], &self.overrides) {
            Ok(mut read) => read.pop().map(Ok),
            Err(Stop::Failed(error)) => Some(Err(error)),
            Err(Stop::Wanted(objects)) => {
                for object in objects {
                    self.under_way.insert(master.start(Request::read(self.node, object)), object);
                }
                None
            }
        }
    }
}
