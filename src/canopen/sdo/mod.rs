//! SDO client: transfers as pure state machines (CiA 301, 7.2.4).
//!
//! The caller passes received frames and time-outs to a state machine. The state machine reports whether a frame
//! belongs to the transfer. It returns the frames to send, and reports the end. It never waits.

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
pub use upload::{LONGEST, Upload, Uploaded, proves_upload_answer_60};

use super::frame::Frame;
use super::id::{CanId, NodeId};
use super::object::ObjectId;

/// The result of handling a frame or a time-out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Progress<T> {
    /// The frame does not belong to this transfer, or repeats an earlier frame. Nothing changed.
    NotOurs,
    /// The transfer continues.
    Continue,
    /// The transfer is complete.
    Done(T),
    /// The transfer failed.
    Failed(TransferError),
}

impl<T> Progress<T> {
    /// Converts the result of a complete transfer.
    pub fn map<U>(self, convert: impl FnOnce(T) -> U) -> Progress<U> {
        match self {
            Progress::NotOurs => Progress::NotOurs,
            Progress::Continue => Progress::Continue,
            Progress::Done(done) => Progress::Done(convert(done)),
            Progress::Failed(error) => Progress::Failed(error),
        }
    }
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransferError {
    /// The device sent an abort code.
    Aborted(AbortCode),
    /// The answer violates the protocol.
    Violation(Violation, Frame),
    /// The device did not answer in time.
    NoAnswer,
}

/// How an answer to our transfer violates the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// Command specifier 60h, the acknowledgement of a download, in answer to an upload.
    #[error("acknowledgement of a write (60h) in answer to a read")]
    WriteAcknowledgeToRead,
    /// The command specifier does not answer this request.
    #[error("unexpected command specifier")]
    Command,
    /// The toggle bit of a segment did not alternate.
    #[error("toggle bit not alternated")]
    Toggle,
    /// The transfer exceeds the size limit of the object.
    #[error("longer than the object can be, or without an end")]
    TooLong,
    /// The frame has too few bytes.
    #[error("frame too short")]
    Short,
    /// The block size is not in 1 to 127.
    #[error("invalid block size")]
    BlockSize,
    /// An acknowledgement of segments that were not sent.
    #[error("acknowledgement of segments that were not sent")]
    Sequence,
    /// Several blocks in a row without any received segment.
    #[error("no segment was received")]
    Stuck,
    /// The CRC of a block transfer does not match the data.
    #[error("CRC does not match the data")]
    Crc,
    /// The size differs from the announced size after segments were repeated.
    #[error("the size differs from the announced one after lost segments")]
    Size,
}

/// A block transfer is aborted after this number of consecutive blocks without progress.
const MAX_STALLED_BLOCKS: u8 = 3;

impl Violation {
    /// The abort code to send to the server.
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

/// Returns the abort frame that a client sends for `object` (CiA 301, 7.2.4.3.17).
pub fn abort_frame(node: NodeId, object: ObjectId, code: AbortCode) -> Frame {
    let [a, b, c] = object.multiplexer();
    let [d, e, f, g] = code.0.to_le_bytes();
    Frame::full(CanId::sdo_request(node), [0x80, a, b, c, d, e, f, g])
}

/// Returns the object in bytes 1 to 3 of a frame (the multiplexer), if the frame has them.
pub fn multiplexer(data: &[u8]) -> Option<ObjectId> {
    match data {
        [_, a, b, c, ..] => Some(ObjectId::from_multiplexer([*a, *b, *c])),
        _ => None,
    }
}

/// Returns the number in bytes 4 to 7, if the frame has them.
fn number(data: &[u8]) -> Option<u32> {
    match data {
        [_, _, _, _, a, b, c, d, ..] => Some(u32::from_le_bytes([*a, *b, *c, *d])),
        _ => None,
    }
}

/// Returns the abort code if `frame` aborts the transfer of `object`. A truncated code is read as 0.
///
/// An abort with the identifier of the request also counts. The D-20-9 manual (page 7) shows such an abort, and an
/// abort of another master also ends the transfer.
fn abort_of(frame: &Frame, node: NodeId, object: ObjectId) -> Option<AbortCode> {
    let is_on_channel = frame.id() == CanId::sdo_response(node) || frame.id() == CanId::sdo_request(node);
    let data = frame.data();
    (is_on_channel && data.first() == Some(&0x80) && multiplexer(data) == Some(object))
        .then(|| AbortCode(number(data).unwrap_or(0)))
}
