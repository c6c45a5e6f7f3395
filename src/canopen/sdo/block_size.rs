//! How many segments make a sub-block of a block transfer.

/// 1 to 127 segments (CiA 301, 7.2.4.3.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSize(u8);

impl BlockSize {
    /// The largest: 127 segments, 889 bytes.
    pub const LARGEST: BlockSize = BlockSize(127);

    /// A block size out of its byte.
    pub const fn new(segments: u8) -> Option<BlockSize> {
        if segments >= 1 && segments <= 127 { Some(BlockSize(segments)) } else { None }
    }

    /// The byte in a frame.
    pub fn get(self) -> u8 {
        self.0
    }
}
