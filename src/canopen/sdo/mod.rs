//! SDO client: transfers as pure state machines (CiA 301, 7.2.4).
//!
//! A machine is fed the frames of the bus and says whether a frame was its own, what to send next, and
//! how the transfer ended. It never waits: time-outs are told to it.

mod abort;
mod block_download;
mod block_size;
mod block_upload;
mod crc;
mod download;
mod fit;
mod upload;

pub use abort::AbortCode;
pub use block_download::BlockDownload;
pub use block_size::BlockSize;
pub use block_upload::BlockUpload;
pub use crc::crc16;
pub use download::{Download, DownloadSize};
pub use fit::{FitError, Fitted, Note, fit};
pub use upload::{Upload, Uploaded};

use super::frame::Frame;
use super::id::{CanId, NodeId};
use super::object::ObjectId;

/// How a machine took a frame or a time-out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Progress<T> {
    /// The frame is no part of this transfer, or a part that has come before; nothing has changed.
    NotOurs,
    /// The transfer goes on.
    Continue,
    /// The transfer is complete.
    Done(T),
    /// The transfer is over without a result.
    Failed(TransferError),
}

impl<T> Progress<T> {
    /// The same with another result.
    pub fn map<U>(self, result: impl FnOnce(T) -> U) -> Progress<U> {
        match self {
            Progress::NotOurs => Progress::NotOurs,
            Progress::Continue => Progress::Continue,
            Progress::Done(done) => Progress::Done(result(done)),
            Progress::Failed(error) => Progress::Failed(error),
        }
    }
}

/// Why a transfer has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransferError {
    /// The device refused.
    Aborted(AbortCode),
    /// The device answered against the protocol.
    Violation(Violation, Frame),
    /// No answer came in time.
    NoAnswer,
}

/// What is wrong with an answer that is ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// Command specifier 60h, the acknowledge of a write, as the answer to a read.
    #[error("acknowledge of a write (60h) as the answer to a read")]
    WriteAcknowledgeToRead,
    /// A command specifier that fits no answer to this request.
    #[error("unexpected command specifier")]
    Command,
    /// The toggle bit of a segment did not alternate.
    #[error("toggle bit not alternated")]
    Toggle,
    /// More bytes than any object of a measuring device has.
    #[error("transfer without end")]
    TooLong,
    /// Too few bytes to say what it must say.
    #[error("frame too short")]
    Short,
    /// No block size from 1 to 127.
    #[error("invalid block size")]
    BlockSize,
    /// The acknowledge of segments that have not been sent.
    #[error("acknowledge of segments that were not sent")]
    Sequence,
    /// One sub-block after the other of which nothing arrives.
    #[error("no segment gets through")]
    Stuck,
    /// The data of a block transfer and its CRC do not fit together.
    #[error("CRC does not match the data")]
    Crc,
    /// Another size than announced, and segments had to be sent again: something was mixed up.
    #[error("another size than announced after lost segments")]
    Size,
}

/// How many sub-blocks in a row may bring nothing before a block transfer is given up.
const PATIENCE: u8 = 3;

impl Violation {
    /// The abort code that tells the server.
    fn abort_code(self) -> AbortCode {
        match self {
            Violation::WriteAcknowledgeToRead | Violation::Command => AbortCode::COMMAND_SPECIFIER,
            Violation::Toggle => AbortCode::TOGGLE,
            Violation::TooLong => AbortCode::OUT_OF_MEMORY,
            Violation::Short => AbortCode::GENERAL,
            Violation::BlockSize => AbortCode::BLOCK_SIZE,
            Violation::Sequence | Violation::Stuck => AbortCode::SEQUENCE,
            Violation::Crc => AbortCode::CRC,
            Violation::Size => AbortCode::LENGTH,
        }
    }
}

/// The abort frame that a client sends for `object` (CiA 301, 7.2.4.3.17).
pub fn abort_frame(node: NodeId, object: ObjectId, code: AbortCode) -> Frame {
    let [a, b, c] = object.multiplexer();
    let [d, e, f, g] = code.0.to_le_bytes();
    Frame::full(CanId::sdo_request(node), [0x80, a, b, c, d, e, f, g])
}

/// The multiplexer in bytes 1 to 3, where the frame has them.
fn multiplexer(data: &[u8]) -> Option<ObjectId> {
    match data {
        [_, a, b, c, ..] => Some(ObjectId::from_multiplexer([*a, *b, *c])),
        _ => None,
    }
}

/// The number in bytes 4 to 7, where the frame has them.
fn number(data: &[u8]) -> Option<u32> {
    match data {
        [_, _, _, _, a, b, c, d, ..] => Some(u32::from_le_bytes([*a, *b, *c, *d])),
        _ => None,
    }
}

/// The abort code of a frame that aborts the transfer of `object`. A truncated code reads as 0.
///
/// An abort on the identifier of the request counts too: the D-20-9 manual (page 7) draws it there, and
/// another client's abort of the same object ends the server's transfer just the same.
fn abort_of(frame: &Frame, node: NodeId, object: ObjectId) -> Option<AbortCode> {
    let here = frame.id() == CanId::sdo_response(node) || frame.id() == CanId::sdo_request(node);
    let data = frame.data();
    (here && data.first() == Some(&0x80) && multiplexer(data) == Some(object))
        .then(|| AbortCode(number(data).unwrap_or(0)))
}
