//! Sets node-ID and bit rate through objects of the device.

use super::STORE_TIMEOUT;
use super::device::LssDevice;
use super::failure::{LssCause, Setting};
use super::method::object_for;
use super::progress::{Progress, Stage};
use super::session::enter_state;
use crate::bus::Received;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::assign::{AssignEntry, AssignObject};
use crate::master::{Error, Master, OnTwoDevices, Request};
use crate::node::write::write_with;
use crate::node::{self, Node, WriteOptions};
use crate::tasks::Failure;
use std::time::Duration;

/// An object and the number to write to it.
type Write = Option<(AssignObject, u8)>;

/// Writes the values of `progress` to the objects of the method, and stores them.
///
/// # Errors
/// The device rejects a write or does not answer. Values that are not stored are restored if the previous values could
/// be read.
pub(super) fn by_objects(
    master: &mut Master<'_>,
    device: &LssDevice,
    method: &AssignEntry,
    store: bool,
    progress: &mut Progress,
) -> Result<(), Failure> {
    let Some(id) = device.node else { return Err(device.failure(LssCause::ObjectsOutOfReach)) };
    // Otherwise, two devices with this node-ID would both be changed.
    master.set_on_two_devices(OnTwoDevices::RefuseWrites);
    let node = device.as_node(id);
    let object = |object, setting| object_for(device, object, setting);
    let new_id = match progress.id {
        Some((id, _)) => Some((object(method.node_id, Setting::NodeId)?, id.get())),
        None => None,
    };
    let new_rate = match progress.rate {
        Some((rate, _)) => Some((object(method.bit_rate, Setting::BitRate)?, rate.index)),
        None => None,
    };
    enter_state(master, device, method.state)?;
    let old_id = read_previous(master, id, new_id)?;
    let old_rate = read_previous(master, id, new_rate)?;
    let result = write_all(master, device, &node, method.store.filter(|_| store), (new_id, new_rate), progress);
    // A method without a store object stores the values by itself.
    if result.is_ok() && method.store.is_none() {
        progress.stored = Stage::Done;
    }
    if result.is_err() && progress.is_pending() {
        revert(master, device, &node, (old_id, old_rate), progress);
    }
    result
}

fn write_all(
    master: &mut Master<'_>,
    device: &LssDevice,
    node: &Node,
    store: Option<ObjectId>,
    (id, rate): (Write, Write),
    progress: &mut Progress,
) -> Result<(), Failure> {
    if let (Some((object, number)), Some((_, stage))) = (id, &mut progress.id) {
        write_number(master, device, node, object, number, stage)?;
    }
    if let (Some((object, number)), Some((_, stage))) = (rate, &mut progress.rate) {
        write_number(master, device, node, object, number, stage)?;
    }
    match store {
        Some(object) => write_bytes(master, node, object, b"save", STORE_TIMEOUT, &mut progress.stored),
        None => Ok(()),
    }
}

fn write_number(
    master: &mut Master<'_>,
    device: &LssDevice,
    node: &Node,
    object: AssignObject,
    number: u8,
    stage: &mut Stage,
) -> Result<(), Failure> {
    let data = object.encode(number).map_err(|reason| device.failure(LssCause::Number(object.object, reason)))?;
    write_bytes(master, node, object.object, &data, Duration::ZERO, stage)
}

fn write_bytes(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    min_timeout: Duration,
    stage: &mut Stage,
) -> Result<(), Failure> {
    *stage = Stage::Sent;
    let (progress, watch) = (&mut |_| {}, &mut |_: &Received| {});
    let mut options = WriteOptions { min_timeout, ..WriteOptions::new(progress, watch) };
    let result = write_with(master, node, object, data, &mut options);
    *stage = match &result {
        Ok(_) => Stage::Done,
        Err(node::Error::Sdo(_) | node::Error::Width { .. }) => Stage::NotDone,
        Err(_) => Stage::Sent,
    };
    result.map(|_| ()).map_err(Failure::from)
}

/// Reads the number in an object (its lowest byte). Returns `None` if the device does not return it. The number then
/// cannot be restored.
fn read_previous(master: &mut Master<'_>, node: NodeId, write: Write) -> Result<Write, Error> {
    let Some((object, _)) = write else { return Ok(None) };
    let answer = master.transfer_one(Request::read(node, object.object))?;
    let uploaded = answer.ok().and_then(|answer| answer.uploaded);
    Ok(uploaded.and_then(|uploaded| uploaded.bytes.first().map(|&number| (object, number))))
}

/// Writes the previous numbers to the objects that may contain the new numbers.
fn revert(
    master: &mut Master<'_>,
    device: &LssDevice,
    node: &Node,
    (id, rate): (Write, Write),
    progress: &mut Progress,
) {
    let id = id.zip(progress.id.as_mut().map(|(_, stage)| stage));
    let rate = rate.zip(progress.rate.as_mut().map(|(_, stage)| stage));
    for ((object, number), stage) in id.into_iter().chain(rate) {
        let mut revert_stage = *stage;
        if stage.may_be_set() && write_number(master, device, node, object, number, &mut revert_stage).is_ok() {
            *stage = Stage::Reverted;
        }
    }
}
