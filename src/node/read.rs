//! Reads objects of nodes.

use super::survey::Ask;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::master::{Error, SdoError, SdoFailure};

/// An object to read, with its type.
pub type Item = (NodeId, ObjectId, DataType);

/// Reads many values, the nodes in parallel. One result for each item, in their order.
///
/// # Errors
/// Bus errors and Ctrl-C. A device's own failure is in its result.
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
/// Also time-outs and protocol violations: a node that stops answering is not read in part.
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
