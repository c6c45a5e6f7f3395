//! The number of segments in a sub-block of a block transfer.

/// The block size, 1 to 127 segments (CiA 301, 7.2.4.3.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSize(u8);

impl BlockSize {
    /// The largest block size: 127 segments with 889 bytes.
    pub const LARGEST: BlockSize = BlockSize(127);

    /// The block size with this number of segments; `None` if it is not in 1 to 127.
    pub const fn new(segments: u8) -> Option<BlockSize> {
        if segments >= 1 && segments <= 127 { Some(BlockSize(segments)) } else { None }
    }

    /// The number of segments, as in the frame.
    pub fn get(self) -> u8 {
        self.0
    }
}
