//! One device during a transaction: reads, and writes that are sent once and looked up when no answer comes.

use crate::bus::Received;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{Life, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Answer, Error, Happening, Master, Request, SdoError, SdoFailure};
use crate::node::wait::{Policy, wait};
use crate::node::write::write_with;
use crate::node::{self, Node, Repeat, WriteOptions};
use std::ops::ControlFlow;
use std::time::Duration;

const DEVICE_TYPE: ObjectId = ObjectId::new(0x1000, 0);

/// Why a step was not done.
#[derive(Debug)]
pub(super) enum Trouble {
    /// The device said no.
    Refused(SdoError),
    /// The device does not answer, or not in a way that can be understood.
    Lost(SdoError),
    /// The device has restarted.
    Restarted,
    /// The user asked to stop, or the bus fails.
    Stopped(Error),
    /// An object was written and reads otherwise: the object, what it reads, what was written.
    NotKept(ObjectId, u64, u64),
}

impl From<Error> for Trouble {
    fn from(error: Error) -> Trouble {
        Trouble::Stopped(error)
    }
}

impl From<SdoError> for Trouble {
    fn from(error: SdoError) -> Trouble {
        match error.failure {
            SdoFailure::Refused(_) => Trouble::Refused(error),
            _ => Trouble::Lost(error),
        }
    }
}

/// One write of a step: an unsigned number of `width` bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Write {
    pub(super) object: ObjectId,
    pub(super) value: u32,
    pub(super) width: usize,
}

impl Write {
    pub(super) fn new(object: ObjectId, value: u32, width: usize) -> Write {
        Write { object, value, width }
    }

    fn bytes(&self) -> Vec<u8> {
        self.value.to_le_bytes().into_iter().take(self.width).collect()
    }
}

/// One device.
pub(super) struct Device<'a, 'bus> {
    pub(super) master: &'a mut Master<'bus>,
    pub(super) node: NodeId,
    /// What is known of the node: the form of its writes.
    known: Node,
    /// Whether a boot-up message came.
    pub(super) restarted: bool,
    /// Writes that the device has carried out.
    pub(super) writes: u32,
}

impl<'a, 'bus> Device<'a, 'bus> {
    pub(super) fn new(master: &'a mut Master<'bus>, node: &Node) -> Device<'a, 'bus> {
        Device { master, node: node.id, known: node.clone(), restarted: false, writes: 0 }
    }

    /// One exchange; boot-ups that come meanwhile are noted.
    fn exchange(&mut self, request: Request) -> Result<Result<Answer, SdoError>, Error> {
        let (node, object, operation) = (self.node, request.object, request.operation());
        let mut booted = false;
        let mut watch = |received: &Received| booted |= Life::parse(&received.frame) == Some((node, Life::BootUp));
        let result = self.master.transfer(vec![request], &mut watch);
        self.restarted |= booted;
        let result = result?.pop();
        Ok(result.unwrap_or(Err(SdoError { node, object, operation, failure: SdoFailure::Cancelled })))
    }

    /// Reads an unsigned number of `width` bytes, at most four.
    pub(super) fn read(&mut self, object: ObjectId, width: u8) -> Result<u32, Trouble> {
        let answer = self.exchange(Request::read(self.node, object))??;
        let (value, _) = answer.value(self.node, object, Some(DataType::Unsigned(width)))?;
        let number = value.as_u64().and_then(|number| u32::try_from(number).ok());
        let operation = crate::master::Operation::Read;
        let failure = SdoFailure::NotANumber;
        number.ok_or(Trouble::Lost(SdoError { node: self.node, object, operation, failure }))
    }

    /// Writes once. If no answer comes, the object is read back before it is written again.
    pub(super) fn write(&mut self, write: &Write) -> Result<(), Trouble> {
        let node = self.node;
        let mut has_booted = false;
        let mut watch = |received: &Received| has_booted |= Life::parse(&received.frame) == Some((node, Life::BootUp));
        let progress = &mut |_| {};
        let mut options = WriteOptions { repeat: Repeat::Once, ..WriteOptions::new(progress, &mut watch) };
        let result = write_with(self.master, &self.known, write.object, &write.bytes(), &mut options);
        self.restarted |= has_booted;
        match result {
            Ok(_) => self.writes += 1,
            Err(node::Error::Bus(error)) => return Err(Error::Bus(error).into()),
            Err(node::Error::Interrupted) => return Err(Error::Interrupted.into()),
            Err(_) if self.restarted => return Err(Trouble::Restarted),
            Err(node::Error::Sdo(error)) => return Err(error.into()),
            Err(node::Error::Unknown(error)) => return Err(Trouble::Lost(error)),
            Err(_) => return Err(Trouble::Lost(self.wrong_width(write.object))),
        }
        if self.restarted { Err(Trouble::Restarted) } else { Ok(()) }
    }

    /// The object is wider than its value.
    fn wrong_width(&self, object: ObjectId) -> SdoError {
        let operation = crate::master::Operation::Write;
        SdoError { node: self.node, object, operation, failure: SdoFailure::NotANumber }
    }

    /// After an exchange that was broken off: once another object is answered no older answer can come.
    pub(super) fn clear_the_air(&mut self) -> Result<(), Trouble> {
        match self.exchange(Request::read(self.node, DEVICE_TYPE))? {
            Ok(_) | Err(SdoError { failure: SdoFailure::Refused(_), .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Waits for a sign of life of a node that can answer SDO requests. Returns whether one came.
    pub(super) fn wait_for_life(&mut self, at_most: Duration) -> Result<bool, Error> {
        let (until, own) = (self.master.now() + at_most, self.node);
        let life = wait(self.master, until, Policy::Reconnect, |_, event| {
            let Happening::Frame(received) = event else { return ControlFlow::Continue(()) };
            match Life::parse(&received.frame) {
                Some((node, Life::State(NmtState::Stopped))) if node == own => ControlFlow::Continue(()),
                Some((node, life)) if node == own => ControlFlow::Break(life),
                _ => ControlFlow::Continue(()),
            }
        })?;
        let life = life.done();
        self.restarted |= life == Some(Life::BootUp);
        Ok(life.is_some())
    }
}
