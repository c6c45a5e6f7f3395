//! Node-ID and bit rate through objects of the device's own.

use super::STORE_TIME;
use super::progress::{Done, Stage};
use super::session::prepare;
use super::subject::Subject;
use super::ways::place;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::DownloadSize;
use crate::device::assign::{AssignEntry, AssignObject};
use crate::device::description::SizeIndication;
use crate::master::{Error, Master, Request, SdoError, SdoFailure};
use crate::tasks::{Failure, Kind};

/// What an object held before it was written, where it told.
type Before = Option<u8>;

/// Writes what `done` names to the objects of the way, and stores it.
///
/// # Errors
/// Refusals and silence. What is not stored is put back where the device told what it was.
pub(super) fn by_objects(
    master: &mut Master<'_>,
    subject: &Subject,
    way: &AssignEntry,
    store: bool,
    done: &mut Done,
) -> Result<(), Failure> {
    let Some(node) = subject.node else {
        return Err(subject.failure(Kind::CheckFailed, "its node-ID is not known"));
    };
    let id = done.id.map(|(id, _)| place(subject, way.node_id, "node-ID").map(|at| (at, id.get()))).transpose()?;
    let rate =
        done.rate.map(|(rate, _)| place(subject, way.bit_rate, "bit rate").map(|at| (at, rate.index))).transpose()?;
    prepare(master, subject, way.state)?;
    let held = [id, rate].map(|place| place.map(|(at, _)| at));
    let held = [read(master, node, held[0])?, read(master, node, held[1])?];
    let result = write_all(master, subject, way, (node, store), (id, rate), done);
    if result.is_err() && done.is_pending() {
        undo(master, subject, node, id.map(|(at, _)| at).zip(held[0]), rate.map(|(at, _)| at).zip(held[1]), done);
    }
    result
}

type Number = Option<(AssignObject, u8)>;

fn write_all(
    master: &mut Master<'_>,
    subject: &Subject,
    way: &AssignEntry,
    (node, store): (NodeId, bool),
    (id, rate): (Number, Number),
    done: &mut Done,
) -> Result<(), Failure> {
    if let (Some((at, number)), Some((_, stage))) = (id, &mut done.id) {
        write(master, subject, node, at, number, stage)?;
    }
    if let (Some((at, number)), Some((_, stage))) = (rate, &mut done.rate) {
        write(master, subject, node, at, number, stage)?;
    }
    let Some(object) = way.store else {
        // It is kept as soon as it is written.
        done.stored = Stage::Done;
        return Ok(());
    };
    if store {
        let wait = master.timing().timeout.max(STORE_TIME);
        let request = Request::write(node, object, b"save".to_vec(), size(subject)).once().within(wait);
        send(master, request, &mut done.stored)?;
    }
    Ok(())
}

fn write(
    master: &mut Master<'_>,
    subject: &Subject,
    node: NodeId,
    at: AssignObject,
    number: u8,
    stage: &mut Stage,
) -> Result<(), Failure> {
    let data = at.encode(number).map_err(|error| subject.failure(Kind::Usage, format!("{}: {error}", at.object)))?;
    let request = Request::write(node, at.object, data, size(subject));
    send(master, if at.signature { request.once() } else { request }, stage)
}

fn send(master: &mut Master<'_>, request: Request, stage: &mut Stage) -> Result<(), Failure> {
    *stage = Stage::Sent;
    match master.transfer_one(request)? {
        Ok(_) => {
            *stage = Stage::Done;
            Ok(())
        }
        Err(error) => {
            if matches!(error.failure, SdoFailure::Refused(_)) {
                *stage = Stage::No;
            }
            Err(error.into())
        }
    }
}

fn size(subject: &Subject) -> DownloadSize {
    match subject.model.as_ref().map(|model| model.description.sdo.size) {
        Some(SizeIndication::Omitted) => DownloadSize::Omitted,
        Some(SizeIndication::Indicated) | None => DownloadSize::Indicated,
    }
}

/// What the object holds: its lowest byte. A device that does not tell cannot be put back, no more.
fn read(master: &mut Master<'_>, node: NodeId, at: Option<AssignObject>) -> Result<Before, Error> {
    let Some(object) = at.map(|at: AssignObject| -> ObjectId { at.object }) else { return Ok(None) };
    match master.transfer_one(Request::read(node, object))? {
        Ok(answer) => Ok(answer.uploaded.and_then(|uploaded| uploaded.bytes.first().copied())),
        Err(SdoError { .. }) => Ok(None),
    }
}

fn undo(master: &mut Master<'_>, subject: &Subject, node: NodeId, id: Number, rate: Number, done: &mut Done) {
    let is_open = |stage: Stage| matches!(stage, Stage::Sent | Stage::Done);
    let id = id.zip(done.id.as_mut().map(|(_, stage)| stage));
    let rate = rate.zip(done.rate.as_mut().map(|(_, stage)| stage));
    for ((at, number), stage) in id.into_iter().chain(rate) {
        let mut undone = *stage;
        if is_open(*stage) && write(master, subject, node, at, number, &mut undone).is_ok() {
            *stage = Stage::Undone;
        }
    }
}
