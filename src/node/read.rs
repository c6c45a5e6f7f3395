//! Reads objects of nodes.

use super::survey::Ask;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::master::{Answer, Error, SdoError, SdoFailure};
use std::collections::BTreeSet;

/// An object to read, with its type.
pub type Item = (NodeId, ObjectId, DataType);

/// Reads many values, the nodes in parallel. One result for each item, in their order.
///
/// # Errors
/// Bus errors and Ctrl-C. The failure of one device is in its result.
pub fn read_values<A: Ask>(master: &mut A, items: &[Item]) -> Result<Vec<Result<Value, SdoError>>, A::Stop> {
    let objects: Vec<(NodeId, ObjectId)> = items.iter().map(|&(node, object, _)| (node, object)).collect();
    let answers = master.ask(&objects)?;
    let values = answers.into_iter().zip(items).map(|(answer, &(node, object, data_type))| {
        answer.and_then(|answer| answer.value(node, object, Some(data_type))).map(|(value, _)| value)
    });
    Ok(values.collect())
}

/// Like [`read_values`], with `None` if the device rejects the read or the bytes do not fit the type.
///
/// # Errors
/// Also time-outs and protocol violations, because partial results are not returned.
pub(super) fn read_known<A: Ask>(master: &mut A, items: &[Item]) -> Result<Vec<Option<Value>>, A::Stop> {
    read_values(master, items)?
        .into_iter()
        .map(|result| match result {
            Ok(value) => Ok(Some(value)),
            Err(error) => match error.failure {
                SdoFailure::Refused(_) | SdoFailure::Fit(_) => Ok(None),
                _ => Err(Error::Sdo(error).into()),
            },
        })
        .collect()
}

/// The answers, and the error of a node that does not answer at all.
type OptionalAnswers = (Vec<Option<Answer>>, Option<SdoError>);

/// Reads optional objects. An object without a valid answer is `None` and does not affect the others.
///
/// After a silent sub-index, the other sub-indices of its object are not read. If a node is silent twice in a row, its
/// remaining objects are `None`, and the error is returned, too.
///
/// # Errors
/// Failures of the bus, and Ctrl-C.
pub(super) fn ask_optional<A: Ask>(master: &mut A, objects: &[(NodeId, ObjectId)]) -> Result<OptionalAnswers, A::Stop> {
    let mut answers: Vec<Option<Answer>> = objects.iter().map(|_| None).collect();
    let mut open: Vec<usize> = (0..objects.len()).collect();
    let (mut silent, mut dead): (BTreeSet<NodeId>, _) = (BTreeSet::new(), None);
    let mut repeated = BTreeSet::new();
    while !open.is_empty() {
        let asked: Vec<(NodeId, ObjectId)> = open.iter().map(|&at| objects[at]).collect();
        let results = master.ask(&asked)?;
        let has_failed = |error: &SdoError| {
            !matches!(error.failure, SdoFailure::NoAnswer { started: false, .. } | SdoFailure::Cancelled)
        };
        let before = repeated.len();
        let answering: BTreeSet<NodeId> = asked
            .iter()
            .zip(&results)
            .filter(|(_, result)| result.as_ref().err().is_none_or(has_failed))
            .map(|(&(node, _), _)| node)
            .collect();
        let mut rest = Vec::new();
        let mut unanswered = BTreeSet::new();
        for (at, result) in open.into_iter().zip(results) {
            match result {
                Ok(answer) => answers[at] = Some(answer),
                Err(error) => match error.failure {
                    // These objects were not read, because an earlier one got no answer.
                    SdoFailure::Cancelled => rest.push(at),
                    SdoFailure::NoAnswer { started: false, .. }
                        if unanswered.insert((error.node, error.object.index))
                            && !answering.contains(&error.node)
                            && !silent.insert(error.node) =>
                    {
                        dead = dead.or(Some(error));
                    }
                    SdoFailure::Refused(_) | SdoFailure::Fit(_) | SdoFailure::TwoDevices(_) => {}
                    SdoFailure::NoAnswer { started: false, .. } => {}
                    // A transfer that failed in the middle is repeated once.
                    _ if repeated.insert(at) => rest.push(at),
                    _ => {}
                },
            }
        }
        rest.retain(|&at| !unanswered.contains(&(objects[at].0, objects[at].1.index)));
        let is_stuck = rest.len() == asked.len() && repeated.len() == before;
        open = if is_stuck || dead.is_some() { Vec::new() } else { rest };
    }
    Ok((answers, dead))
}

/// The values of `ask_optional`; `None` also if the bytes do not fit the type.
///
/// # Errors
/// A node is silent twice in a row; failures of the bus, and Ctrl-C.
pub fn read_optional<A: Ask>(master: &mut A, items: &[Item]) -> Result<Vec<Option<Value>>, A::Stop> {
    let objects: Vec<(NodeId, ObjectId)> = items.iter().map(|&(node, object, _)| (node, object)).collect();
    let (answers, dead) = ask_optional(master, &objects)?;
    if let Some(error) = dead {
        return Err(Error::Sdo(error).into());
    }
    let values = answers.into_iter().zip(items).map(|(answer, &(node, object, data_type))| {
        answer?.value(node, object, Some(data_type)).ok().map(|(value, _)| value)
    });
    Ok(values.collect())
}
