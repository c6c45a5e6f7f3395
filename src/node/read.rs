//! Reads objects of nodes.

use super::survey::ObjectReader;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::master::{Answer, Error, Operation, SdoError, SdoFailure};
use std::collections::{BTreeMap, BTreeSet};

/// An object to read, with its type.
pub type Item = (NodeId, ObjectId, DataType);

/// Reads many values, the nodes in parallel. One result for each item, in their order.
///
/// # Errors
/// Bus errors and Ctrl-C. The failure of one device is in its result.
pub fn read_values<A: ObjectReader>(master: &mut A, items: &[Item]) -> Result<Vec<Result<Value, SdoError>>, A::Stop> {
    let objects: Vec<(NodeId, ObjectId)> = items.iter().map(|&(node, object, _)| (node, object)).collect();
    let answers = master.read_objects(&objects)?;
    let values = answers.into_iter().zip(items).map(|(answer, &(node, object, data_type))| {
        answer.and_then(|answer| answer.value(node, object, Some(data_type))).map(|(value, _)| value)
    });
    Ok(values.collect())
}

/// If more consecutive reads get no answer, a node is treated as silent, even if it answers other objects.
const MAX_SILENT: u32 = 8;

/// Reads objects that a device may not have, or may not answer. An object without a valid answer does not affect the
/// others. The answers of optional objects are kept: each of them is read once.
pub struct Reader<'a, A> {
    pub(super) master: &'a mut A,
    /// For each node, an object that it answered. 1000h is not used, because some devices answer only this object.
    answered: BTreeMap<NodeId, ObjectId>,
    /// The errors of nodes that do not answer any more, or whose answers come from two devices.
    failed: BTreeMap<NodeId, SdoError>,
    /// The answers of optional objects. A rejected read is also an answer.
    known: BTreeMap<(NodeId, ObjectId), Result<Answer, SdoError>>,
}

/// For each node: the first error, and the number of consecutive objects without an answer.
type Silences = BTreeMap<NodeId, (SdoError, u32)>;

impl<'a, A: ObjectReader> Reader<'a, A> {
    /// Creates a reader without known answers.
    pub fn new(master: &'a mut A) -> Reader<'a, A> {
        Reader { master, answered: BTreeMap::new(), failed: BTreeMap::new(), known: BTreeMap::new() }
    }

    /// Reads objects. One result for each, in their order.
    ///
    /// After a sub-index without an answer, the other sub-indices of the object are not read. If a node does not answer
    /// twice in a row, an object that it answered before is read again. Without an answer, the remaining objects of the
    /// node get the same error.
    ///
    /// # Errors
    /// Failures of the bus, and Ctrl-C. The failure of one device is in its results.
    pub fn read(&mut self, objects: &[(NodeId, ObjectId)]) -> Result<Vec<Result<Answer, SdoError>>, A::Stop> {
        let mut results: Vec<Option<Result<Answer, SdoError>>> = objects.iter().map(|_| None).collect();
        let mut pending: Vec<usize> = (0..objects.len()).collect();
        let (mut repeated, mut silences) = (BTreeSet::new(), Silences::new());
        while !pending.is_empty() {
            let asked: Vec<(NodeId, ObjectId)> = pending.iter().map(|&at| objects[at]).collect();
            let (mut rest, mut unanswered) = (Vec::new(), BTreeSet::new());
            let before = repeated.len();
            for (at, result) in pending.into_iter().zip(self.master.read_objects(&asked)?) {
                let (node, object) = objects[at];
                match result.as_ref().map_err(|error| &error.failure) {
                    // This object was not read, because an earlier read got no answer.
                    Err(SdoFailure::Cancelled) => {
                        rest.push(at);
                        continue;
                    }
                    Err(SdoFailure::NoAnswer { started: false, .. }) => {
                        unanswered.insert((node, object.index));
                        let error = result.as_ref().err().cloned();
                        silences.entry(node).or_insert_with(|| (error.expect("an error"), 0)).1 += 1;
                    }
                    // With `None`, the answers may be late answers of one device.
                    Err(SdoFailure::TwoDevices(Some(_)) | SdoFailure::NotWritten(_))
                        if self.master.tolerates_two_devices() => {}
                    Err(SdoFailure::TwoDevices(Some(_)) | SdoFailure::NotWritten(_) | SdoFailure::TimeLimit(_)) => {
                        self.failed.extend(result.as_ref().err().map(|error| (node, error.clone())));
                    }
                    Ok(_) | Err(SdoFailure::Refused(_) | SdoFailure::Fit(_)) => {
                        silences.remove(&node);
                        if object != ObjectId::DEVICE_TYPE {
                            self.answered.insert(node, object);
                        }
                    }
                    // A transfer that failed in the middle is repeated once.
                    Err(_) if repeated.insert(at) => {
                        rest.push(at);
                        continue;
                    }
                    Err(_) => {}
                }
                results[at] = Some(result);
            }
            self.check_silent(&silences)?;
            rest.retain(|&at| {
                let (node, object) = objects[at];
                !unanswered.contains(&(node, object.index)) && !self.failed.contains_key(&node)
            });
            let is_stuck = rest.len() == asked.len() && repeated.len() == before;
            pending = if is_stuck { Vec::new() } else { rest };
        }
        let unread = |(node, object)| {
            let operation = Operation::Read;
            let cancelled = SdoError { node, object, operation, failure: SdoFailure::Cancelled };
            self.failed.get(&node).cloned().unwrap_or(cancelled)
        };
        let results = results.into_iter().zip(objects);
        Ok(results.map(|(result, &object)| result.unwrap_or_else(|| Err(unread(object)))).collect())
    }

    /// Checks the nodes that did not answer twice in a row. A node that does not answer any object has failed.
    fn check_silent(&mut self, silences: &Silences) -> Result<(), A::Stop> {
        for (&node, (error, count)) in silences.iter().filter(|(_, (_, count))| *count > 1) {
            let is_alive = match self.answered.get(&node).filter(|_| *count <= MAX_SILENT) {
                Some(&object) => self.master.read_objects(&[(node, object)])?.iter().all(|answer| {
                    answer.as_ref().err().is_none_or(|error| matches!(error.failure, SdoFailure::Refused(_)))
                }),
                None => false,
            };
            if !is_alive {
                self.failed.entry(node).or_insert_with(|| error.clone());
            }
        }
        Ok(())
    }

    /// Reads optional objects; `None` without a valid answer.
    ///
    /// # Errors
    /// A node does not answer any more; failures of the bus, and Ctrl-C.
    pub(super) fn answers(&mut self, objects: &[(NodeId, ObjectId)]) -> Result<Vec<Option<Answer>>, A::Stop> {
        Ok(self.read_optional(objects)?.into_iter().map(Result::ok).collect())
    }

    /// Reads optional objects that this reader has not read before. Those without a valid answer are recorded as
    /// unknown.
    ///
    /// # Errors
    /// A node does not answer any more; failures of the bus, and Ctrl-C.
    pub fn read_optional(&mut self, objects: &[(NodeId, ObjectId)]) -> Result<Vec<Result<Answer, SdoError>>, A::Stop> {
        let unread: Vec<_> = objects.iter().filter(|object| !self.known.contains_key(object)).copied().collect();
        let mut results = self.read(&unread)?.into_iter();
        if let Some(error) = self.failed.values().next() {
            return Err(Error::Sdo(error.clone()).into());
        }
        let results: Vec<Result<Answer, SdoError>> =
            objects.iter().filter_map(|object| self.known.get(object).cloned().or_else(|| results.next())).collect();
        for error in results.iter().filter_map(|result| result.as_ref().err()) {
            let is_answered = matches!(error.failure, SdoFailure::Refused(_) | SdoFailure::Fit(_));
            if !is_answered && !matches!(error.failure, SdoFailure::Cancelled | SdoFailure::TwoDevices(Some(_))) {
                self.master.add_unknown(error.node, error.object);
            }
        }
        let is_answer = |result: &Result<Answer, SdoError>| match result {
            Ok(_) => true,
            Err(error) => matches!(error.failure, SdoFailure::Refused(_)),
        };
        let answered = objects.iter().zip(&results).filter(|(_, result)| is_answer(result));
        self.known.extend(answered.map(|(&object, result)| (object, result.clone())));
        Ok(results)
    }

    /// Reads the values of optional objects; `None` without a valid answer, or if the bytes do not fit the type.
    ///
    /// # Errors
    /// A node does not answer any more; failures of the bus, and Ctrl-C.
    pub fn values(&mut self, items: &[Item]) -> Result<Vec<Option<Value>>, A::Stop> {
        let objects: Vec<(NodeId, ObjectId)> = items.iter().map(|&(node, object, _)| (node, object)).collect();
        let values = self.answers(&objects)?.into_iter().zip(items).map(|(answer, &(node, object, data_type))| {
            answer?.value(node, object, Some(data_type)).ok().map(|(value, _)| value)
        });
        Ok(values.collect())
    }
}
