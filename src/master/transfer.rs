//! One object, whole, in the way that suits it: expedited, in segments or in blocks.
//!
//! What a transfer of `n` bytes costs, with `s = n/7` segments, rounded up:
//!
//! | | frames | waits for the other side |
//! |---|---|---|
//! | in segments, both ways | `2 + 2s` | `1 + s` |
//! | block download | `4 + s`, and one for every 127 segments | 2, and one for every 127 segments |
//! | block upload | `5 + s`, and one for every 127 segments | 3, and one for every 127 segments |
//!
//! So blocks are the shorter way for more than 3 segments written and more than 4 read; in between it makes no
//! difference, and with 28 bytes as the limit for both the worst case is level. A refusal costs two frames more.
//! Most sensors know no block transfer (none of the four described does), so a device is bothered with it only
//! where it pays: see [`BlockMode::Auto`].

use super::{Answer, Error, Happening, Master, Request, SdoError, Ticket};
use crate::bus::{BusError, Received};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize};
use crate::canopen::value::DataType;
use std::time::Duration;

/// Up to so many bytes segments are as good as blocks.
pub const SMALL: u8 = 28;

/// From so many bytes on (one full sub-block) it pays to break off a read in segments and begin anew in blocks:
/// at worst 6 frames in vain beside 256.
pub const LARGE: u32 = 889;

/// How often a transfer under way is reported.
const REPORT_EVERY: Duration = Duration::from_millis(100);

/// When block transfer is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BlockMode {
    /// Where it pays: writes of more than [`SMALL`] bytes, reads of type DOMAIN (the server may answer in the
    /// usual way up to [`SMALL`] bytes), and reads that turn out to be [`LARGE`]. A device that does not do
    /// it, be it that it refuses or that it is silent, gets the transfer in segments.
    ///
    /// Strings and unknown types are not asked for in blocks: they are mostly short, and how a server takes
    /// a request that it does not know is its secret.
    #[default]
    Auto,
    /// For everything; what the device says to it is the result.
    Always,
    /// For nothing.
    Never,
}

/// How one transfer goes about blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blocks {
    /// Expedited or in segments.
    #[default]
    Never,
    /// A read that begins in the usual way, and begins anew as [`Blocks::First`] when the device announces
    /// [`LARGE`] bytes or more. A write never.
    WhenLarge,
    /// In blocks; as [`Blocks::Never`] if the device does not do it.
    First {
        /// Of a read: up to so many bytes the server may answer in the usual way.
        threshold: u8,
    },
    /// In blocks and in no other way.
    Only,
}

/// How the data of a transfer went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Expedited or in segments.
    Plain,
    /// In blocks.
    Blocks,
    /// Expedited or in segments, after the device was asked for blocks in vain.
    PlainAfterAll,
}

impl BlockMode {
    /// For a read of an object of this type; `None` if the type is not known.
    pub fn for_read(self, data_type: Option<DataType>) -> Blocks {
        match self {
            BlockMode::Never => Blocks::Never,
            BlockMode::Always => Blocks::Only,
            BlockMode::Auto if data_type == Some(DataType::Domain) => Blocks::First { threshold: SMALL },
            // Nothing of a known and fixed width is ever large.
            BlockMode::Auto if data_type.is_some_and(|data_type| data_type.width().is_some()) => Blocks::Never,
            BlockMode::Auto => Blocks::WhenLarge,
        }
    }

    /// For a write of so many bytes.
    pub fn for_write(self, length: usize) -> Blocks {
        match self {
            BlockMode::Never => Blocks::Never,
            BlockMode::Always => Blocks::Only,
            BlockMode::Auto if length > usize::from(SMALL) => Blocks::First { threshold: 0 },
            BlockMode::Auto => Blocks::Never,
        }
    }
}

/// Whether an abort code speaks of the object and not of the way it was asked for: asked for in another way,
/// the device would say the same.
pub(super) fn names_the_object(code: AbortCode) -> bool {
    matches!(code, AbortCode::NO_OBJECT | AbortCode::NO_SUB_INDEX | AbortCode::WRITE_ONLY | AbortCode::READ_ONLY)
}

/// Bytes transferred so far and bytes in all, where known.
pub type Moved = (usize, Option<usize>);

/// Reads an object. `progress` hears of it every 100 ms.
///
/// # Errors
/// Outside: what stops everything. Inside: what the device does.
pub fn read_object(
    master: &mut Master<'_>,
    (node, object): (NodeId, ObjectId),
    data_type: Option<DataType>,
    mode: BlockMode,
    progress: &mut dyn FnMut(Moved),
) -> Result<Result<Answer, SdoError>, Error> {
    let request = Request::read(node, object).blocks(mode.for_read(data_type));
    master.carry_out(request, progress)
}

/// Writes an object. `progress` hears of it every 100 ms.
///
/// # Errors
/// Outside: what stops everything. Inside: what the device does.
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
    /// Bytes of a transfer so far and in all, where known; `None` while it has not begun or when it is over.
    pub fn moved(&self, ticket: Ticket) -> Option<Moved> {
        self.sdo.moved(ticket)
    }

    /// One transfer, with reports on how far it has come.
    ///
    /// # Errors
    /// Outside: what stops everything. Inside: what the device does.
    pub fn carry_out(
        &mut self,
        request: Request,
        progress: &mut dyn FnMut(Moved),
    ) -> Result<Result<Answer, SdoError>, Error> {
        self.carry_out_watching(request, progress, &mut |_| {})
    }

    /// Like [`Master::carry_out`]; frames that belong to no SDO transfer are given to `watch`.
    ///
    /// # Errors
    /// Outside: bus errors and Ctrl-C. Inside: what the device does.
    pub fn carry_out_watching(
        &mut self,
        request: Request,
        progress: &mut dyn FnMut(Moved),
        watch: &mut dyn FnMut(&Received),
    ) -> Result<Result<Answer, SdoError>, Error> {
        let ticket = self.start(request);
        // From the latest moment known: a transfer that is over at once costs no look at the clock.
        let mut report_at = self.seen + REPORT_EVERY;
        let mut timed = false;
        loop {
            match self.next(report_at)? {
                Happening::Sdo(ended, result) if ended == ticket => return Ok(result),
                Happening::Frame(received) => watch(&received),
                Happening::Deadline => {
                    // The first time only tells the time.
                    if let Some(moved) = self.moved(ticket).filter(|_| timed) {
                        progress(moved);
                    }
                    timed = true;
                    report_at = self.now() + REPORT_EVERY;
                }
                Happening::Interrupted => {
                    self.cancel();
                    return Err(Error::Interrupted);
                }
                Happening::Link(false) => {
                    self.cancel();
                    return Err(Error::Bus(BusError::Down(self.bus().name().to_owned())));
                }
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_only_where_they_pay() {
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
