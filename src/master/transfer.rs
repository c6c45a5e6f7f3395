//! Reads and writes one object with the best kind of transfer: expedited, segmented or block.
//!
//! Cost of a transfer of `n` bytes, with `s = n/7` segments, rounded up:
//!
//! | | frames | waits for the other side |
//! |---|---|---|
//! | segmented, read or write | `2 + 2s` | `1 + s` |
//! | block download | `4 + s`, plus 1 for every 127 segments | 2, plus 1 for every 127 segments |
//! | block upload | `5 + s`, plus 1 for every 127 segments | 3, plus 1 for every 127 segments |
//!
//! Block transfer needs fewer frames for more than 3 written segments or more than 4 read segments. With 28 bytes as
//! the limit for both, it never needs more frames. A rejected block request costs two extra frames. Most sensors do not
//! support block transfer. So it is used only if it saves frames: see [`BlockMode::Auto`].

use super::request::NUMBER_LIMIT;
use super::{Answer, Error, Master, MasterEvent, Operation, Request, SdoError, SdoFailure, Ticket};
use crate::bus::{BusError, Received};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize};
use crate::canopen::value::{DataType, Value};
use std::time::Duration;

/// Up to this size in bytes, a segmented transfer needs no more frames than a block transfer.
pub const SMALL: u8 = 28;

/// From this size in bytes (one full block), a segmented upload is aborted and restarted as a block upload. If the
/// device rejects blocks, the restart costs 6 extra frames; the transfer itself has at least 256.
pub const LARGE: u32 = 889;

/// The interval between two progress reports of a transfer.
const REPORT_INTERVAL: Duration = Duration::from_millis(250);

/// The longest delay of a progress report. It avoids waits with a near deadline, which need more system calls.
const REPORT_DELAY: Duration = Duration::from_millis(50);

/// When block transfer is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BlockMode {
    /// If it saves frames: writes of more than [`SMALL`] bytes, reads of type DOMAIN, and reads of at least [`LARGE`]
    /// bytes. For DOMAIN objects of up to [`SMALL`] bytes, the server may answer segmented. If the device rejects or
    /// ignores the block request, the transfer is segmented.
    ///
    /// Strings and unknown types are first read segmented. Most are short, and some servers react badly to an unknown
    /// request.
    #[default]
    Auto,
    /// Always. If the device rejects it, the transfer fails.
    Always,
    /// Never.
    Never,
}

/// How one transfer uses blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blocks {
    /// Expedited or segmented.
    #[default]
    Never,
    /// An upload starts segmented. It restarts as [`Blocks::First`] if the device announces [`LARGE`] bytes or more. A
    /// download is never in blocks.
    WhenLarge,
    /// In blocks; segmented if the device does not support blocks.
    First {
        /// For an upload: up to this size in bytes, the server may answer segmented.
        threshold: u8,
    },
    /// Only in blocks.
    Only,
}

/// The kind of transfer that carried the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransferKind {
    /// Expedited or segmented.
    Plain,
    /// In blocks.
    Blocks,
    /// Expedited or segmented, after the device rejected or did not answer the block request.
    PlainFallback,
}

impl BlockMode {
    /// Returns the choice for an upload of this type; pass `None` if the type is unknown.
    pub fn for_read(self, data_type: Option<DataType>) -> Blocks {
        match self {
            BlockMode::Never => Blocks::Never,
            BlockMode::Always => Blocks::Only,
            BlockMode::Auto if data_type == Some(DataType::Domain) => Blocks::First { threshold: SMALL },
            // An object of a known, fixed width is never large.
            BlockMode::Auto if data_type.is_some_and(|data_type| data_type.width().is_some()) => Blocks::Never,
            BlockMode::Auto => Blocks::WhenLarge,
        }
    }

    /// Returns the choice for a download of `length` bytes.
    pub fn for_write(self, length: usize) -> Blocks {
        match self {
            BlockMode::Never => Blocks::Never,
            BlockMode::Always => Blocks::Only,
            BlockMode::Auto if length > usize::from(SMALL) => Blocks::First { threshold: 0 },
            BlockMode::Auto => Blocks::Never,
        }
    }
}

/// Whether an abort code is about the object. Another kind of transfer would then fail with the same code.
pub(super) fn is_about_object(code: AbortCode) -> bool {
    matches!(code, AbortCode::NO_OBJECT | AbortCode::NO_SUB_INDEX | AbortCode::WRITE_ONLY | AbortCode::READ_ONLY)
}

/// Bytes transferred so far, and in total if known.
pub type Moved = (usize, Option<usize>);

/// Reads an object. An object of unknown length has at most `longest` bytes. `progress` is called every 100 ms.
///
/// # Errors
/// Outer: the bus failed or the user interrupted. Inner: the transfer failed.
pub fn read_object(
    master: &mut Master<'_>,
    (node, object): (NodeId, ObjectId),
    data_type: Option<DataType>,
    (mode, longest): (BlockMode, usize),
    progress: &mut dyn FnMut(Moved),
) -> Result<Result<Answer, SdoError>, Error> {
    let limit = data_type.and_then(DataType::width).map_or(longest, |_| NUMBER_LIMIT);
    let request = Request::read(node, object).blocks(mode.for_read(data_type)).up_to(limit);
    master.carry_out(request, progress)
}

/// Writes an object. `progress` is called every 100 ms.
///
/// # Errors
/// Outer: the bus failed or the user interrupted. Inner: the transfer failed.
pub fn write_object(
    master: &mut Master<'_>,
    (node, object): (NodeId, ObjectId),
    data: Vec<u8>,
    size: DownloadSize,
    mode: BlockMode,
    progress: &mut dyn FnMut(Moved),
) -> Result<Result<Answer, SdoError>, Error> {
    let blocks = mode.for_write(data.len());
    master.carry_out(Request::write(node, object, data, size).blocks(blocks), progress)
}

impl Master<'_> {
    /// Returns the bytes of a transfer so far, and in total if known; `None` if it is not in progress.
    pub fn moved(&self, ticket: Ticket) -> Option<Moved> {
        self.sdo.moved(ticket)
    }

    /// Carries out one transfer, with progress reports.
    ///
    /// # Errors
    /// Outer: the bus failed or the user interrupted. Inner: the transfer failed.
    pub fn carry_out(
        &mut self,
        request: Request,
        progress: &mut dyn FnMut(Moved),
    ) -> Result<Result<Answer, SdoError>, Error> {
        self.carry_out_watching(request, progress, &mut |_| {})
    }

    /// Like [`Master::carry_out`]; frames that do not belong to the transfer go to `watch`.
    ///
    /// # Errors
    /// Outer: the bus failed or the user interrupted. Inner: the transfer failed.
    pub fn carry_out_watching(
        &mut self,
        request: Request,
        progress: &mut dyn FnMut(Moved),
        watch: &mut dyn FnMut(&Received),
    ) -> Result<Result<Answer, SdoError>, Error> {
        let (node, object, operation) = (request.node, request.object, request.operation());
        let ticket = self.start(request);
        // Uses the latest known moment, so that a short transfer does not read the clock.
        let mut report_at = self.seen + REPORT_INTERVAL;
        let mut has_updated_clock = false;
        loop {
            match self.next_or(report_at + REPORT_DELAY, report_at)? {
                MasterEvent::Sdo(ended, result) if ended == ticket => {
                    if operation == Operation::Read {
                        self.await_second_answers(watch)?;
                    }
                    return Ok(result.and_then(|answer| match self.sdo.failure_of(node, object) {
                        Some(failure) => Err(SdoError::two_devices(node, object, operation, failure)),
                        None => Ok(answer),
                    }));
                }
                MasterEvent::Frame(received) => watch(&received),
                MasterEvent::Deadline => {
                    // The first deadline only updates the clock.
                    if let Some(moved) = self.moved(ticket).filter(|_| has_updated_clock) {
                        progress(moved);
                    }
                    has_updated_clock = true;
                    report_at = self.now() + REPORT_INTERVAL;
                }
                MasterEvent::Interrupted => {
                    self.cancel();
                    return Err(Error::Interrupted);
                }
                MasterEvent::Link(false) => {
                    self.cancel();
                    return Err(Error::Bus(BusError::Down(self.bus().name().to_owned())));
                }
                _ => {}
            }
        }
    }
}

impl Master<'_> {
    /// Carries out one transfer.
    ///
    /// # Errors
    /// Outer: the bus failed or the user interrupted. Inner: the transfer failed.
    pub fn transfer_one(&mut self, request: Request) -> Result<Result<Answer, SdoError>, Error> {
        let (node, object, operation) = (request.node, request.object, request.operation());
        let result = self.transfer(vec![request], &mut |_| {})?.pop();
        Ok(result.unwrap_or(Err(SdoError { node, object, operation, failure: SdoFailure::Cancelled })))
    }

    /// Reads a value of a known type.
    ///
    /// # Errors
    /// Outer: the bus failed or the user interrupted. Inner: the transfer failed or the bytes do not fit the type.
    pub fn read(
        &mut self,
        node: NodeId,
        object: ObjectId,
        data_type: DataType,
    ) -> Result<Result<Value, SdoError>, Error> {
        let answer = self.transfer_one(Request::read(node, object))?;
        Ok(answer.and_then(|answer| answer.value(node, object, Some(data_type)).map(|(value, _)| value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_used_only_if_they_save_frames() {
        let auto = BlockMode::Auto;
        assert_eq!(auto.for_read(Some(DataType::Unsigned(4))), Blocks::Never);
        assert_eq!(auto.for_read(Some(DataType::VisibleString)), Blocks::WhenLarge);
        assert_eq!(auto.for_read(None), Blocks::WhenLarge);
        assert_eq!(auto.for_read(Some(DataType::Domain)), Blocks::First { threshold: 28 });
        assert_eq!((auto.for_write(28), auto.for_write(29)), (Blocks::Never, Blocks::First { threshold: 0 }));
        assert_eq!(BlockMode::Always.for_write(0), Blocks::Only);
        assert_eq!(BlockMode::Always.for_read(Some(DataType::Unsigned(1))), Blocks::Only);
        assert_eq!(BlockMode::Never.for_write(1 << 20), Blocks::Never);
        assert_eq!(BlockMode::Never.for_read(Some(DataType::Domain)), Blocks::Never);
    }
}
