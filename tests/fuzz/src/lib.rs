//! Common parts of the fuzz targets: they make frames and scripts from arbitrary bytes.
//!
//! `cargo fuzz run --fuzz-dir tests/fuzz TARGET` (with `RUSTC_BOOTSTRAP=1` on a stable toolchain). Besides panics, the
//! targets check that printed values parse again, and that state machines end and send only to their node. Each fault
//! that is found becomes a test next to the code. `corpus` contains initial inputs for each target.

use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};

/// The number of the node that the tested state machines use.
pub const NODE: u8 = 5;

/// The node-ID of this node.
pub fn node() -> NodeId {
    NodeId::new(NODE).expect("a node-ID")
}

/// Reads values from arbitrary bytes.
#[derive(Clone, Copy, Debug)]
pub struct Bytes<'a>(pub &'a [u8]);

impl<'a> Bytes<'a> {
    /// The next byte; 0 after the end.
    pub fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    /// The next two bytes as a number.
    pub fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// The next four bytes as a number.
    pub fn long(&mut self) -> u32 {
        u32::from(self.word()) | u32::from(self.word()) << 16
    }

    /// The next `count` bytes, or all if there are fewer.
    pub fn take(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        taken
    }

    /// Whether all bytes were read.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The next frame. Most have the identifier `ours`.
    pub fn frame(&mut self, ours: CanId) -> Frame {
        let head = self.byte();
        let id = match head >> 4 {
            0 => CanId::standard(self.word() & 0x7ff).expect("eleven bits"),
            1 => CanId::extended(self.long() & 0x1fff_ffff).expect("29 bits"),
            2 => CanId::sdo_request(node()),
            3 => CanId::sdo_response(NodeId::new(NODE + 1).expect("a node-ID")),
            _ => ours,
        };
        let length = head & 0xf;
        match length {
            0..=7 => Frame::new(id, self.take(usize::from(length))).expect("less than eight bytes"),
            15 => Frame::remote(id, self.byte() % 9).expect("at most eight bytes"),
            _ => {
                let mut data = [0; 8];
                let taken = self.take(8);
                data[..taken.len()].copy_from_slice(taken);
                Frame::full(id, data)
            }
        }
    }
}

/// Checks that all frames are SDO requests to [`node`] with eight bytes.
pub fn assert_requests(sent: &[Frame]) {
    for frame in sent {
        assert_eq!((frame.id(), frame.len()), (CanId::sdo_request(node()), 8), "{frame}");
    }
}
