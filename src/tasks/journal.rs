//! Temporary writes that must be undone if the program is killed. Each write is recorded before it is sent.
//!
//! The file is handled by the layer above. The tasks use the trait [`Journal`].

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Error as MasterError, Master, Request};
use crate::node::read::read_values;
use crate::node::write::write;
use crate::node::{Error, Node};

/// A temporary write of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TemporaryWrite {
    /// The node.
    pub node: NodeId,
    /// Vendor, product, revision and serial number of the device (1018h:1 to 4), as far as they are known.
    pub identity: [Option<u32>; 4],
    /// The object.
    pub object: ObjectId,
    /// The bytes of the object before the write.
    pub before: Vec<u8>,
    /// The bytes written.
    pub written: Vec<u8>,
}

/// Why a temporary write could not be recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JournalError {
    /// The file of the journal.
    pub file: String,
    /// The error of the operating system.
    pub reason: String,
}

/// Keeps temporary writes until they are undone.
pub trait Journal {
    /// Records a write. When this returns, the record is on the disk.
    ///
    /// # Errors
    /// The record cannot be written.
    fn record(&mut self, write: &TemporaryWrite) -> Result<(), JournalError>;

    /// Removes the record of a write that was undone.
    fn remove(&mut self, write: &TemporaryWrite);
}

/// Records nothing. For a bus whose devices exist only while the program runs.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoJournal;

impl Journal for NoJournal {
    fn record(&mut self, _: &TemporaryWrite) -> Result<(), JournalError> {
        Ok(())
    }

    fn remove(&mut self, _: &TemporaryWrite) {}
}

/// The result of undoing a temporary write of an earlier run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UndoResult {
    /// The object has its old value again.
    Restored,
    /// The object does not have the written value: another program changed it, or the device restarted.
    ChangedSince,
    /// Another device has the node-ID now.
    OtherDevice,
    /// The device did not answer, or rejected the write. The next run tries again.
    NotRestored,
}

impl UndoResult {
    /// Whether the record is still needed.
    pub fn is_open(self) -> bool {
        matches!(self, UndoResult::OtherDevice | UndoResult::NotRestored)
    }
}

impl TemporaryWrite {
    /// Creates the record of a write to this node.
    pub fn to(node: &Node, object: ObjectId, before: &[u8], written: &[u8]) -> TemporaryWrite {
        let identity = node.identity.numbers();
        TemporaryWrite { node: node.id, identity, object, before: before.to_vec(), written: written.to_vec() }
    }

    /// Undoes the write of an earlier run, if the device is the same and the object still has the written value.
    ///
    /// # Errors
    /// Bus errors and Ctrl-C.
    pub fn undo(&self, master: &mut Master<'_>) -> Result<UndoResult, MasterError> {
        let subs = [1, 2, 3, 4].map(|sub| (self.node, ObjectId::new(0x1018, sub), DataType::Unsigned(4)));
        for (value, recorded) in read_values(master, &subs)?.into_iter().zip(self.identity) {
            let found = value.ok().and_then(|value| value.as_u64());
            if let (Some(found), Some(recorded)) = (found, recorded)
                && found != u64::from(recorded)
            {
                return Ok(UndoResult::OtherDevice);
            }
        }
        match self.has_value(master, &self.written)? {
            Some(true) => {}
            Some(false) => return Ok(UndoResult::ChangedSince),
            None => return Ok(UndoResult::NotRestored),
        }
        match write(master, &Node::new(self.node), self.object, &self.before) {
            Ok(_) if self.has_value(master, &self.before)? == Some(true) => Ok(UndoResult::Restored),
            Err(Error::Bus(error)) => Err(MasterError::Bus(error)),
            Err(Error::Interrupted) => Err(MasterError::Interrupted),
            Ok(_) | Err(_) => Ok(UndoResult::NotRestored),
        }
    }

    /// Whether the object has this value. `None` if it cannot be read. A device that does not indicate the size sends
    /// four bytes for every type.
    fn has_value(&self, master: &mut Master<'_>, bytes: &[u8]) -> Result<Option<bool>, MasterError> {
        let answer = master.transfer_one(Request::read(self.node, self.object))?;
        let found = answer.ok().and_then(|answer| answer.uploaded).map(|uploaded| uploaded.bytes);
        Ok(found.map(|found| found.starts_with(bytes)))
    }
}
