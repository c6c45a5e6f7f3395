//! What is asked of an SDO server, and what comes of it.

use super::machine::Machine;
use super::transfer::{Blocks, Way};
use crate::bus::Stamp;
use crate::bus::time::spoken;
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize, FitError, Uploaded, Violation};
use std::fmt;
use std::time::Duration;

/// Names a transfer from its start to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket {
    pub(super) number: u64,
    pub(super) node: NodeId,
}

/// What is to be transferred.
#[derive(Clone, Debug)]
pub struct Request {
    /// With which node.
    pub node: NodeId,
    /// Which object.
    pub object: ObjectId,
    kind: Kind,
    pub(super) timeout: Option<Duration>,
    pub(super) repeatable: bool,
    pub(super) blocks: Blocks,
    /// The device does no block transfer of this object: that was found out in this very transfer.
    pub(super) refused_blocks: bool,
}

#[derive(Clone, Debug)]
enum Kind {
    Read,
    Write { data: Vec<u8>, size: DownloadSize },
}

impl Request {
    /// A read.
    pub fn read(node: NodeId, object: ObjectId) -> Request {
        Request::new(node, object, Kind::Read)
    }

    /// A write of a plain value.
    pub fn write(node: NodeId, object: ObjectId, data: Vec<u8>, size: DownloadSize) -> Request {
        Request::new(node, object, Kind::Write { data, size })
    }

    fn new(node: NodeId, object: ObjectId, kind: Kind) -> Request {
        let (blocks, refused_blocks) = (Blocks::Never, false);
        Request { node, object, kind, timeout: None, repeatable: true, blocks, refused_blocks }
    }

    /// In blocks, or not: see [`super::BlockMode`] for the choice.
    pub fn blocks(mut self, blocks: Blocks) -> Request {
        self.blocks = blocks;
        self
    }

    /// Sent once only, whatever the time-outs say: signatures, and scans that do their own asking.
    pub fn once(mut self) -> Request {
        self.repeatable = false;
        self
    }

    /// With a longer wait than others: storing.
    pub fn within(mut self, timeout: Duration) -> Request {
        self.timeout = Some(timeout);
        self
    }

    /// A read that is waited for as long as another request, and repeated even where that may not be. Asking for
    /// blocks in vain was asking once.
    pub(super) fn patient_as(mut self, other: &Request) -> Request {
        (self.timeout, self.repeatable) = (other.timeout, !other.refused_blocks);
        self
    }

    /// Whether a request for blocks is only the first try.
    pub(super) fn falls_back(&self) -> bool {
        matches!(self.blocks, Blocks::First { .. })
    }

    pub(super) fn fall_back(&mut self) {
        self.blocks = Blocks::Never;
        self.refused_blocks = true;
    }

    pub(super) fn machine(&self, accept_60: bool) -> Machine {
        match &self.kind {
            Kind::Read => Machine::read(self.node, self.object, accept_60, self.blocks),
            Kind::Write { data, size } => Machine::write(self.node, self.object, data.clone(), *size, self.blocks),
        }
    }

    /// Whether it reads or writes.
    pub fn operation(&self) -> Operation {
        match self.kind {
            Kind::Read => Operation::Read,
            Kind::Write { .. } => Operation::Write,
        }
    }
}

/// Whether a transfer reads or writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// SDO upload.
    Read,
    /// SDO download.
    Write,
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Operation::Read => "read",
            Operation::Write => "write",
        })
    }
}

/// The end of a transfer that succeeded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// What was read; `None` of a write.
    pub uploaded: Option<Uploaded>,
    /// When the last frame of the answer was received.
    pub at: Stamp,
    /// How the data went.
    pub way: Way,
}

/// Why a transfer has no result.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{operation} {object}: {failure}")]
pub struct SdoError {
    /// With which node.
    pub node: NodeId,
    /// Which object.
    pub object: ObjectId,
    /// Whether it was read or written.
    pub operation: Operation,
    /// What went wrong.
    pub failure: SdoFailure,
}

/// What went wrong with a transfer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SdoFailure {
    /// The device refused.
    #[error("refused by the device ({0})")]
    Refused(AbortCode),
    /// Nothing came.
    #[error("no answer within {}{}", spoken(*.waited), if *.begun { " in the middle of the transfer" } else { "" })]
    NoAnswer {
        /// The longest wait for one answer.
        waited: Duration,
        /// Whether the device had begun to answer.
        begun: bool,
    },
    /// The device answered against the protocol.
    #[error("{0}: {1}")]
    Violation(Violation, Frame),
    /// The device delivered bytes that make no value of the type.
    #[error("{0}")]
    Fit(FitError),
    /// The object holds text or bytes where a measured value was asked for.
    #[error("it is no number")]
    NotANumber,
    /// Another client wrote the same object at the same time.
    #[error("acknowledged, and whose write that was is not known: another master wrote the same object")]
    Ambiguous,
    /// Others use the channel, time and again.
    #[error("another master uses the node's SDO channel at the same time")]
    Disturbed,
    /// We gave up.
    #[error("not finished")]
    Cancelled,
}
