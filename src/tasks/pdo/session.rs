//! Reads and writes objects of a node during one change. A boot-up message during the change counts as a restart.

use super::failure::{StepError, StepWrite};
use crate::bus::Received;
use crate::canopen::nmt::{ErrorControlMessage, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Answer, Error, Master, MasterEvent, Operation, Request, SdoError, SdoFailure};
use crate::node::wait::{Policy, wait};
use crate::node::write::write_with;
use crate::node::{self, Node, Repeat, WriteOptions};
use std::ops::ControlFlow;
use std::time::Duration;

/// The reads and writes of one change.
pub(super) struct Session<'a, 'bus> {
    pub(super) master: &'a mut Master<'bus>,
    pub(super) node: &'a Node,
    /// Whether the node sent a boot-up message.
    pub(super) has_restarted: bool,
    /// The number of writes that the node carried out.
    pub(super) writes: u32,
    /// Whether the device need not answer reads of optional objects. Their values are then unknown.
    pub(super) accepts_silence: bool,
}

impl<'a, 'bus> Session<'a, 'bus> {
    pub(super) fn new(master: &'a mut Master<'bus>, node: &'a Node) -> Session<'a, 'bus> {
        Session { master, node, has_restarted: false, writes: 0, accepts_silence: false }
    }

    fn error(&self, object: ObjectId, operation: Operation, failure: SdoFailure) -> SdoError {
        SdoError { node: self.node.id, object, operation, failure }
    }

    /// Carries out one read request.
    fn exchange(&mut self, object: ObjectId) -> Result<Result<Answer, SdoError>, Error> {
        let node = self.node.id;
        let mut has_booted = false;
        let mut watch = |received: &Received| {
            has_booted |= ErrorControlMessage::parse(&received.frame) == Some((node, ErrorControlMessage::BootUp))
        };
        let result = self.master.transfer(vec![Request::read(node, object)], &mut watch);
        self.has_restarted |= has_booted;
        let answer = result?.pop();
        Ok(answer.unwrap_or_else(|| Err(self.error(object, Operation::Read, SdoFailure::Cancelled))))
    }

    /// Reads an unsigned number of `width` bytes, at most four.
    pub(super) fn read(&mut self, object: ObjectId, width: u8) -> Result<u32, StepError> {
        let answer = self.exchange(object)??;
        let (value, _) = answer.value(self.node.id, object, Some(DataType::Unsigned(width)))?;
        let number = value.as_u64().and_then(|number| u32::try_from(number).ok());
        number.ok_or_else(|| StepError::Lost(self.error(object, Operation::Read, SdoFailure::NotANumber)))
    }

    /// Writes once. If no answer comes, the object is read back before it is written again.
    pub(super) fn write(&mut self, write: &StepWrite) -> Result<(), StepError> {
        let node = self.node.id;
        let mut has_booted = false;
        let mut watch = |received: &Received| {
            has_booted |= ErrorControlMessage::parse(&received.frame) == Some((node, ErrorControlMessage::BootUp))
        };
        let progress = &mut |_| {};
        let mut options = WriteOptions { repeat: Repeat::Once, ..WriteOptions::new(progress, &mut watch) };
        let result = write_with(self.master, self.node, write.object, &write.bytes(), &mut options);
        self.has_restarted |= has_booted;
        match result {
            Ok(_) => self.writes += 1,
            Err(node::Error::Bus(error)) => return Err(Error::Bus(error).into()),
            Err(node::Error::Interrupted) => return Err(StepError::Interrupted),
            Err(_) if self.has_restarted => return Err(StepError::Restarted),
            Err(node::Error::Sdo(error)) => return Err(error.into()),
            Err(node::Error::Unknown(error)) => return Err(StepError::Lost(error)),
            // The object is wider than its value.
            Err(_) => {
                return Err(StepError::Lost(self.error(write.object, Operation::Write, SdoFailure::NotANumber)));
            }
        }
        if self.has_restarted { Err(StepError::Restarted) } else { Ok(()) }
    }

    /// Reads another object after a cancelled exchange. After its answer, no older answer can arrive.
    pub(super) fn discard_late_answers(&mut self) -> Result<(), StepError> {
        match self.exchange(ObjectId::DEVICE_TYPE)? {
            Ok(_) | Err(SdoError { failure: SdoFailure::Refused(_), .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Waits for a heartbeat or boot-up message of a node that can answer SDO requests. Returns whether it was
    /// received.
    pub(super) fn wait_for_life(&mut self, timeout: Duration) -> Result<bool, Error> {
        let (until, own) = (self.master.now() + timeout, self.node.id);
        let life = wait(self.master, until, Policy::Reconnect, |_, event| {
            let MasterEvent::Frame(received) = event else { return ControlFlow::Continue(()) };
            match ErrorControlMessage::parse(&received.frame) {
                Some((node, ErrorControlMessage::State(NmtState::Stopped))) if node == own => ControlFlow::Continue(()),
                Some((node, life)) if node == own => ControlFlow::Break(life),
                _ => ControlFlow::Continue(()),
            }
        })?;
        let life = life.done();
        self.has_restarted |= life == Some(ErrorControlMessage::BootUp);
        Ok(life.is_some())
    }
}
