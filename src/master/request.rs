//! SDO requests, answers and errors.

use super::machine::Machine;
use super::missed_answer::MissedAnswer;
use super::second_answer::SecondAnswer;
use super::transfer::{Blocks, TransferKind};
use crate::bus::Stamp;
use crate::bus::time::format_duration;
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize, FitError, LONGEST, Note, Uploaded, Violation, fit};
use crate::canopen::value::{DataType, Value};
use std::fmt;
use std::time::Duration;

/// Identifies a transfer from its start to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket {
    pub(super) number: u64,
    pub(super) node: NodeId,
}

/// A transfer to carry out.
#[derive(Clone, Debug)]
pub struct Request {
    /// The node.
    pub node: NodeId,
    /// The object.
    pub object: ObjectId,
    kind: Kind,
    pub(super) timeout: Option<Duration>,
    pub(super) repeatable: bool,
    pub(super) blocks: Blocks,
    /// The limit for the size of a read object in bytes.
    limit: usize,
    /// Whether the device rejected block transfer during this request.
    pub(super) refused_blocks: bool,
    /// Whether a length other than the announced one is always a failure.
    pub(super) is_exact: bool,
}

#[derive(Clone, Debug)]
enum Kind {
    Read,
    Write { data: Vec<u8>, size: DownloadSize },
}

impl Request {
    /// Creates an SDO upload.
    pub fn read(node: NodeId, object: ObjectId) -> Request {
        Request::new(node, object, Kind::Read)
    }

    /// Creates an SDO download of a plain value, which may be repeated.
    pub fn write(node: NodeId, object: ObjectId, data: Vec<u8>, size: DownloadSize) -> Request {
        Request::new(node, object, Kind::Write { data, size })
    }

    fn new(node: NodeId, object: ObjectId, kind: Kind) -> Request {
        let (blocks, refused_blocks) = (Blocks::Never, false);
        let limit = size_limit(object);
        Request { node, object, kind, timeout: None, repeatable: true, blocks, limit, refused_blocks, is_exact: false }
    }

    /// Sets how blocks are used. [`super::BlockMode`] chooses the value.
    pub fn blocks(mut self, blocks: Blocks) -> Request {
        self.blocks = blocks;
        self
    }

    /// Sets whether a length other than the announced one is a failure. Set it for content that is saved to a file.
    pub fn exact(mut self, is_exact: bool) -> Request {
        self.is_exact = is_exact;
        self
    }

    /// Sets the limit for the size of a read object, if the caller knows more than the index shows.
    pub fn up_to(mut self, limit: usize) -> Request {
        self.limit = limit;
        self
    }

    /// Never repeats the request. For signatures, and for scans that repeat requests themselves.
    pub fn once(mut self) -> Request {
        self.repeatable = false;
        self
    }

    /// Sets a time-out that differs from the time-out of the master, for example for storing.
    pub fn within(mut self, timeout: Duration) -> Request {
        self.timeout = Some(timeout);
        self
    }

    /// Sets the time-out of `other`. The request may be repeated, even if `other` must not be. Exception: if `other`
    /// was a rejected block request, this request is already the second attempt.
    pub(super) fn with_timing_of(mut self, other: &Request) -> Request {
        (self.timeout, self.repeatable) = (other.timeout, !other.refused_blocks);
        self
    }

    /// Whether a failed transfer may be restarted. The download of a program may not: it may have had an effect.
    pub(super) fn may_restart(&self) -> bool {
        self.repeatable && (self.operation() == Operation::Read || !(0x1f00..=0x1fff).contains(&self.object.index))
    }

    /// Whether the transfer continues without blocks if the device rejects them.
    pub(super) fn falls_back(&self) -> bool {
        matches!(self.blocks, Blocks::First { .. })
    }

    pub(super) fn fall_back(&mut self) {
        self.blocks = Blocks::Never;
        self.refused_blocks = true;
    }

    pub(super) fn machine(&self, accept_60: bool) -> Machine {
        match &self.kind {
            Kind::Read => Machine::read((self.node, self.object), self.limit, accept_60, self.blocks),
            Kind::Write { data, size } => Machine::write(self.node, self.object, data.clone(), *size, self.blocks),
        }
    }

    /// Returns the error of this request with this failure.
    pub(super) fn error(&self, failure: SdoFailure) -> SdoError {
        SdoError { node: self.node, object: self.object, operation: self.operation(), failure }
    }

    /// Upload or download.
    pub fn operation(&self) -> Operation {
        match self.kind {
            Kind::Read => Operation::Read,
            Kind::Write { .. } => Operation::Write,
        }
    }
}

/// The size limit in bytes for an object that is a number. The widest number has 8 bytes; some devices send more,
/// filled with zeros.
pub const NUMBER_LIMIT: usize = 16;

/// The size limit in bytes for an object that is read as text.
pub const TEXT_LIMIT: usize = 64 * 1024;

/// Returns the size limit of an object in bytes, according to its index (CiA 301 and the device profiles).
fn size_limit(object: ObjectId) -> usize {
    match object.index {
        // Name and versions of the manufacturer.
        0x1008..=0x100a => 255,
        // EDS and commands of the operating system; programs and concise DCF (CiA 302).
        0x1021..=0x1026 | 0x1f00..=0x1fff => LONGEST,
        0x1000..=0x1fff | 0x6000..=0x9fff => NUMBER_LIMIT,
        _ => 1024,
    }
}

/// The direction of a transfer.
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

/// The result of a successful transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The bytes read; `None` for a write.
    pub uploaded: Option<Uploaded>,
    /// When the last frame of the answer was received.
    pub at: Stamp,
    /// The kind of transfer that carried the data.
    pub kind: TransferKind,
}

/// A failed transfer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{operation} {object}: {failure}")]
pub struct SdoError {
    /// The node.
    pub node: NodeId,
    /// The object.
    pub object: ObjectId,
    /// Upload or download.
    pub operation: Operation,
    /// The reason.
    pub failure: SdoFailure,
}

/// Why a transfer failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SdoFailure {
    /// The device sent an abort code.
    #[error("refused by the device ({0})")]
    Refused(AbortCode),
    /// The device did not answer in time.
    #[error("no answer within {}{}{}", format_duration(*.waited), if *.started { " in the middle of the transfer" } else { "" }, received(.missed))]
    NoAnswer {
        /// The longest wait for one answer.
        waited: Duration,
        /// Whether the device answered before and then stopped.
        started: bool,
        /// The facts that explain the missing answer.
        missed: MissedAnswer,
    },
    /// The answer violates the protocol.
    #[error("{0}: {1}")]
    Violation(Violation, Frame),
    /// The bytes do not fit the data type.
    #[error("{0}")]
    Fit(FitError),
    /// A number was expected, but the object contains text or bytes.
    #[error("the value is not a number")]
    NotANumber,
    /// Another master wrote the same object at the same time, so the acknowledgement may be for the other write.
    #[error("acknowledged, but another master wrote the same object at the same time")]
    Ambiguous,
    /// The length differs from the announced length, or a segment in the middle is short.
    #[error("{}: {frame}", lengths(*.announced, *.delivered))]
    WrongLength {
        /// Bytes announced.
        announced: Option<u32>,
        /// Bytes delivered.
        delivered: usize,
        /// The last frame.
        frame: Frame,
    },
    /// Two devices answer with this node-ID.
    #[error("{}", two_devices(.0.as_ref()))]
    TwoDevices(Option<SecondAnswer>),
    /// Two devices answer with this node-ID, before the first write of the command.
    #[error("{}; nothing was written", two_devices(Some(.0)))]
    NotWritten(SecondAnswer),
    /// Another master used the channel repeatedly.
    #[error("another master uses the node's SDO channel at the same time")]
    Disturbed,
    /// The time limit of the transfer, or of all transfers, has passed.
    #[error("not finished within {}", format_duration(*.0))]
    TimeLimit(Duration),
    /// The caller cancelled the transfer, or the node did not answer an earlier transfer.
    #[error("not finished")]
    Cancelled,
}

fn lengths(announced: Option<u32>, delivered: usize) -> String {
    match announced {
        Some(size) if u64::from(size) == delivered as u64 => {
            format!("two reads delivered different lengths, the second one {delivered} bytes")
        }
        Some(size) => format!("the device announced {size} bytes and delivered {delivered}"),
        None => format!("a segment before the last one is not full ({delivered} bytes were delivered)"),
    }
}

fn two_devices(answers: Option<&SecondAnswer>) -> String {
    match answers {
        Some(SecondAnswer { first, second }) => {
            format!("two devices have this node-ID: one request got the answers {first} and {second}")
        }
        None => "more than one answer arrives: two devices have this node-ID, or a bridge repeats frames".to_owned(),
    }
}

/// Describes the frames that were received instead of an answer.
fn received(missed: &MissedAnswer) -> String {
    let received = missed.frame.map(|frame| format!("; received {frame}")).unwrap_or_default();
    let state = missed.state.map(|state| format!("; its heartbeat shows {state}")).unwrap_or_default();
    format!("{received}{state}")
}

impl Answer {
    /// Returns the value read, and a note if the device deviated from the protocol.
    ///
    /// # Errors
    /// The bytes do not fit the type.
    pub fn value(
        &self,
        node: NodeId,
        object: ObjectId,
        data_type: Option<DataType>,
    ) -> Result<(Value, Option<Note>), SdoError> {
        let empty = Uploaded::complete(Vec::new());
        let uploaded = self.uploaded.as_ref().unwrap_or(&empty);
        fit(data_type, uploaded).map(|fitted| (fitted.value, fitted.note)).map_err(|error: FitError| SdoError {
            node,
            object,
            operation: Operation::Read,
            failure: SdoFailure::Fit(error),
        })
    }
}
