//! Writes a signature ("save", "load", "zero") and tells a certain refusal from an unknown result.

use crate::canopen::object::ObjectId;
use crate::master::{Error, Master, Operation, SdoError, SdoFailure};
use crate::node::write::write_with;
use crate::node::{self, Node, WriteOptions};
use std::time::Duration;

/// The shortest time-out for storing and restoring: writing to non-volatile memory takes longer than other requests.
pub(super) const STORE_TIMEOUT: Duration = Duration::from_secs(3);

/// Writes a signature, and waits at least `at_least` for its answer.
///
/// # Errors
/// Bus errors and Ctrl-C; a transfer that failed is in the result.
pub(super) fn sign(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    signature: &[u8],
    at_least: Duration,
) -> Result<Result<(), SdoError>, Error> {
    let (progress, watch) = (&mut |_| {}, &mut |_: &_| {});
    let mut options = WriteOptions { at_least, ..WriteOptions::new(progress, watch) };
    match write_with(master, node, object, signature, &mut options) {
        Err(node::Error::Bus(error)) => Err(Error::Bus(error)),
        Err(node::Error::Interrupted) => Err(Error::Interrupted),
        Err(node::Error::Sdo(error) | node::Error::Unknown(error)) => Ok(Err(error)),
        // The other errors concern values, not signatures.
        Ok(_) | Err(_) => Ok(Ok(())),
    }
}

/// Whether a signature without an acknowledge may have acted. A rejected one has not, and neither has one that was never
/// sent because a read before it failed.
pub(super) fn may_have_acted(error: &SdoError) -> bool {
    error.operation == Operation::Write && !matches!(error.failure, SdoFailure::Refused(_))
}
