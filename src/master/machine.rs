//! The protocol state machine of one transfer: read or write, with or without blocks.

use super::transfer::{Blocks, LARGE};
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{
    AbortCode, BlockDownload, BlockUpload, Download, DownloadSize, Progress, TransferError, Upload, Uploaded,
};

/// The state machines of CiA 301, 7.2.4.3.
#[derive(Clone, Debug)]
pub(super) enum Machine {
    Read(Upload),
    ReadBlocks(BlockUpload),
    Write(Download),
    WriteBlocks(BlockDownload),
}

impl Machine {
    pub(super) fn read((node, object): (NodeId, ObjectId), limit: usize, accept_60: bool, blocks: Blocks) -> Machine {
        let in_blocks = |threshold| BlockUpload::new(node, object, threshold, accept_60).up_to(limit);
        match blocks {
            Blocks::Never | Blocks::WhenLarge => Machine::Read(Upload::new(node, object, accept_60).up_to(limit)),
            Blocks::First { threshold } => Machine::ReadBlocks(in_blocks(threshold)),
            Blocks::Only => Machine::ReadBlocks(in_blocks(0)),
        }
    }

    pub(super) fn write(node: NodeId, object: ObjectId, data: Vec<u8>, size: DownloadSize, blocks: Blocks) -> Machine {
        match blocks {
            Blocks::Never | Blocks::WhenLarge => Machine::Write(Download::new(node, object, data, size)),
            Blocks::First { .. } | Blocks::Only => Machine::WriteBlocks(BlockDownload::new(node, object, data, size)),
        }
    }

    /// Returns the frame that starts the transfer.
    pub(super) fn request(&self) -> Frame {
        match self {
            Machine::Read(upload) => upload.request(),
            Machine::ReadBlocks(upload) => upload.request(),
            Machine::Write(download) => download.request(),
            Machine::WriteBlocks(download) => download.request(),
        }
    }

    pub(super) fn has_begun(&self) -> bool {
        match self {
            Machine::Read(upload) => upload.has_begun(),
            Machine::ReadBlocks(upload) => upload.has_begun(),
            Machine::Write(download) => download.has_begun(),
            Machine::WriteBlocks(download) => download.has_begun(),
        }
    }

    /// Whether the data is transferred in blocks.
    pub(super) fn is_in_blocks(&self) -> bool {
        match self {
            Machine::Read(_) | Machine::Write(_) => false,
            Machine::ReadBlocks(upload) => upload.is_in_blocks(),
            Machine::WriteBlocks(download) => download.has_begun(),
        }
    }

    /// Whether this is a segmented upload at its start, and the device announced a large object.
    pub(super) fn is_worth_blocks(&self) -> bool {
        let Machine::Read(upload) = self else { return false };
        matches!(upload.received(), (0, Some(size)) if size >= LARGE)
    }

    /// Bytes transferred so far and in total, if known.
    pub(super) fn moved(&self) -> (usize, Option<usize>) {
        let announced = |size: Option<u32>| size.and_then(|size| usize::try_from(size).ok());
        match self {
            Machine::Read(upload) => (upload.received().0, announced(upload.received().1)),
            Machine::ReadBlocks(upload) => (upload.received().0, announced(upload.received().1)),
            Machine::Write(download) => (download.sent().0, Some(download.sent().1)),
            Machine::WriteBlocks(download) => (download.sent().0, Some(download.sent().1)),
        }
    }

    pub(super) fn on_frame(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Option<Uploaded>> {
        match self {
            Machine::Read(upload) => upload.on_frame(frame, out).map(Some),
            Machine::ReadBlocks(upload) => upload.on_frame(frame, out).map(Some),
            Machine::Write(download) => download.on_frame(frame, out).map(|()| None),
            Machine::WriteBlocks(download) => download.on_frame(frame, out).map(|()| None),
        }
    }

    /// Records that the bus has accepted a frame of the transfer.
    pub(super) fn on_sent(&mut self) {
        if let Machine::WriteBlocks(download) = self {
            download.on_sent();
        }
    }

    /// Handles a time-out. Returns `None` if the transfer continues.
    pub(super) fn on_timeout(&mut self, out: &mut Vec<Frame>) -> Option<TransferError> {
        match self {
            Machine::Read(upload) => Some(upload.on_timeout(out)),
            Machine::ReadBlocks(upload) => upload.on_timeout(out),
            Machine::Write(download) => Some(download.on_timeout(out)),
            Machine::WriteBlocks(download) => Some(download.on_timeout(out)),
        }
    }

    pub(super) fn abort(&mut self, code: AbortCode, out: &mut Vec<Frame>) {
        match self {
            Machine::Read(upload) => upload.abort(code, out),
            Machine::ReadBlocks(upload) => upload.abort(code, out),
            Machine::Write(download) => download.abort(code, out),
            Machine::WriteBlocks(download) => download.abort(code, out),
        }
    }
}
