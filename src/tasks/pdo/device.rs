//! One device during a transaction: reads, and writes that are sent once and looked up when no answer comes.

use crate::bus::Received;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{Life, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize};
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::device::description::SizeIndication;
use crate::master::{Answer, Error, Happening, Master, Request, SdoError, SdoFailure};
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
    /// How sizes go, the device's own way first.
    sizes: [DownloadSize; 2],
    /// Whether a boot-up message came.
    pub(super) restarted: bool,
    /// Writes that the device has carried out.
    pub(super) writes: u32,
}

impl<'a, 'bus> Device<'a, 'bus> {
    pub(super) fn new(master: &'a mut Master<'bus>, node: NodeId, model: Option<&Model>) -> Device<'a, 'bus> {
        let omits = model.is_some_and(|model| model.description.sdo.size == SizeIndication::Omitted);
        let sizes = if omits {
            [DownloadSize::Omitted, DownloadSize::Indicated]
        } else {
            [DownloadSize::Indicated, DownloadSize::Omitted]
        };
        Device { master, node, sizes, restarted: false, writes: 0 }
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

    /// Writes once. When no answer comes the object is read: what has arrived is not sent again.
    pub(super) fn write(&mut self, write: &Write) -> Result<(), Trouble> {
        let mut attempts_left = self.master.timing().retries;
        let mut sizes = self.sizes;
        let mut first_refusal = None;
        loop {
            let request = Request::write(self.node, write.object, write.bytes(), sizes[0]).once();
            let error = match self.exchange(request)? {
                Ok(_) => break,
                Err(error) => error,
            };
            match error.failure {
                // Some servers do not know the one way of telling the size, some not the other.
                SdoFailure::Refused(AbortCode::COMMAND_SPECIFIER | AbortCode::LENGTH) if first_refusal.is_none() => {
                    sizes.reverse();
                    first_refusal = Some(error);
                }
                SdoFailure::Refused(_) => return Err(first_refusal.unwrap_or(error).into()),
                SdoFailure::NoAnswer { .. } | SdoFailure::Ambiguous | SdoFailure::Disturbed => {
                    match self.read(write.object, u8::try_from(write.width).unwrap_or(4)) {
                        Ok(_) if self.restarted => return Err(Trouble::Restarted),
                        Ok(found) if found == write.value => break,
                        Ok(_) if attempts_left > 0 => attempts_left -= 1,
                        Err(Trouble::Stopped(stopped)) => return Err(stopped.into()),
                        Ok(_) | Err(_) => return Err(Trouble::Lost(error)),
                    }
                }
                _ => return Err(Trouble::Lost(error)),
            }
        }
        self.writes += 1;
        if self.restarted { Err(Trouble::Restarted) } else { Ok(()) }
    }

    /// After an exchange that was broken off: once another object is answered no older answer can come.
    pub(super) fn clear_the_air(&mut self) -> Result<(), Trouble> {
        match self.exchange(Request::read(self.node, DEVICE_TYPE))? {
            Ok(_) | Err(SdoError { failure: SdoFailure::Refused(_), .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Waits for a sign of life of a node that is there to be talked to: whether one came.
    pub(super) fn wait_for_life(&mut self, at_most: Duration) -> Result<bool, Error> {
        let until = self.master.now() + at_most;
        loop {
            match self.master.next(until)? {
                Happening::Frame(received) => match Life::parse(&received.frame) {
                    Some((node, Life::BootUp)) if node == self.node => {
                        self.restarted = true;
                        return Ok(true);
                    }
                    Some((node, Life::State(state))) if node == self.node && state != NmtState::Stopped => {
                        return Ok(true);
                    }
                    _ => {}
                },
                Happening::Deadline | Happening::Ended => return Ok(false),
                Happening::Interrupted => return Err(Error::Interrupted),
                Happening::Sdo(..) | Happening::Fault(..) | Happening::Dropped(_) | Happening::Link(_) => {}
            }
        }
    }
}
