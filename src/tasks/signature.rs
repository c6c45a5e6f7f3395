//! Writes a signature: "save", "load", "zero". It acts, so it goes out once and never again.

use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize};
use crate::device::description::SizeIndication;
use crate::master::{Error, Master, Operation, Request, SdoError, SdoFailure};
use crate::node::Node;
use std::time::Duration;

/// The shortest time that a device gets to store or restore: writing an EEPROM outlasts an ordinary answer.
pub(super) const STORING: Duration = Duration::from_secs(3);

/// The forms in which a device may want its four bytes, the likelier first: with the size, or without.
fn sizes(device: &Node) -> [DownloadSize; 2] {
    let omits = device.model.as_ref().is_some_and(|model| model.description.sdo.size == SizeIndication::Omitted);
    if omits {
        [DownloadSize::Omitted, DownloadSize::Indicated]
    } else {
        [DownloadSize::Indicated, DownloadSize::Omitted]
    }
}

/// Writes a signature and waits at least `wait` for its answer. Only a device that refused it, and so has not
/// acted, for the form in which it came is asked in the other form.
///
/// # Errors
/// What stops everything; the device's refusal or silence is in the result.
pub(super) fn sign(
    master: &mut Master<'_>,
    device: &Node,
    object: ObjectId,
    signature: &[u8],
    wait: Duration,
) -> Result<Result<(), SdoError>, Error> {
    let wait = wait.max(master.timing().timeout);
    let mut request = |size| {
        let request = Request::write(device.id, object, signature.to_vec(), size).once().within(wait);
        master.transfer_one(request)
    };
    let [likely, other] = sizes(device);
    let first = match request(likely)? {
        Ok(_) => return Ok(Ok(())),
        Err(error) => error,
    };
    let form = [AbortCode::COMMAND_SPECIFIER, AbortCode::LENGTH];
    if !matches!(first.failure, SdoFailure::Refused(code) if form.contains(&code)) {
        return Ok(Err(first));
    }
    match request(other)? {
        Ok(_) => Ok(Ok(())),
        // If the other form is refused too, the first refusal is the one that counts.
        Err(SdoError { failure: SdoFailure::Refused(_), .. }) => Ok(Err(first)),
        Err(error) => Ok(Err(error)),
    }
}

/// Whether a signature may have acted although no acknowledge proves it. A refusal is proof that it has not, and so
/// is the silence of what is read before a write.
pub(super) fn may_have_acted(error: &SdoError) -> bool {
    error.operation == Operation::Write && !matches!(error.failure, SdoFailure::Refused(_))
}
