//! A record of the frames that a master sends and receives.

use super::Master;
use crate::bus::Mono;
use crate::canopen::frame::Frame;

/// The number of frames that a transcript keeps; later frames are only counted.
const MAX_FRAMES: usize = 200;

/// A frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordedFrame {
    /// When the frame was passed to the bus or received.
    pub at: Mono,
    /// Whether this program sent it.
    pub is_sent: bool,
    /// The frame.
    pub frame: Frame,
}

/// The frames of one period, in the order of time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Transcript {
    /// The first frames, at most 200.
    pub frames: Vec<RecordedFrame>,
    /// The number of later frames, which are not stored.
    pub omitted: usize,
}

impl Transcript {
    pub(super) fn push(&mut self, at: Mono, is_sent: bool, frame: Frame) {
        if self.frames.len() < MAX_FRAMES {
            self.frames.push(RecordedFrame { at, is_sent, frame });
        } else {
            self.omitted += 1;
        }
    }
}

impl Master<'_> {
    /// Records all frames from now on.
    pub fn start_transcript(&mut self) {
        self.outgoing.transcript = Some(Transcript::default());
    }

    /// Ends the record, and returns the frames since [`Master::start_transcript`].
    pub fn take_transcript(&mut self) -> Transcript {
        self.outgoing.transcript.take().unwrap_or_default()
    }
}
