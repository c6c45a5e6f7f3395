//! Decides when frames may collect in the kernel, so that one system call reads many of them.

use crate::bus::Mono;
use std::time::Duration;

/// The time in which frames collect. Their timestamps are those of the kernel.
pub(super) const COLLECT_TIME: Duration = Duration::from_millis(1);
/// The least number of frames in [`COLLECT_TIME`] for which collecting costs fewer system calls than reading each frame.
const DENSE: u32 = 4;
/// For this time after a send, each frame is read at once, because it may be the answer.
const URGENT_TIME: Duration = Duration::from_secs(1);

/// The density of the traffic, and the last send.
#[derive(Debug)]
pub(super) struct Traffic {
    /// Whether a frame was sent, and none was received since then. The clock is not read at a send.
    has_sent: bool,
    urgent_until: Mono,
    /// The number of frames in the last batch.
    count: u32,
    /// The time of the last frame before this batch.
    before: Mono,
}

impl Traffic {
    pub(super) fn new() -> Traffic {
        Traffic { has_sent: false, urgent_until: Mono::START, count: 0, before: Mono::START }
    }

    /// Records a send.
    pub(super) fn on_send(&mut self) {
        (self.has_sent, self.count) = (true, 0);
    }

    /// Records that `count` frames were read with one system call. `before` is the time of the frame before them.
    pub(super) fn on_batch(&mut self, count: usize, before: Mono) {
        (self.count, self.before) = (u32::try_from(count).unwrap_or(u32::MAX), before);
    }

    /// Records that a wait received no frame.
    pub(super) fn on_silence(&mut self) {
        self.count = 0;
    }

    /// Whether the traffic is dense, and the next frames are not answers to this program. `last_frame_at` is the time of
    /// the last frame of the batch.
    pub(super) fn can_collect(&mut self, last_frame_at: Mono) -> bool {
        if self.count == 0 {
            return false;
        }
        if std::mem::take(&mut self.has_sent) {
            self.urgent_until = last_frame_at + URGENT_TIME;
        }
        last_frame_at >= self.urgent_until && last_frame_at.since(self.before) * DENSE <= COLLECT_TIME * self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(micros: u64) -> Mono {
        Mono::at(Duration::from_micros(micros))
    }

    #[test]
    fn four_frames_in_a_millisecond_are_dense() {
        let mut traffic = Traffic::new();
        assert!(!traffic.can_collect(at(0)));
        for (count, took, is_dense) in [(1, 250, true), (1, 251, false), (40, 1100, true), (4, 1001, false)] {
            traffic.on_batch(count, at(5000));
            assert_eq!(traffic.can_collect(at(5000 + took)), is_dense, "{count} frames in {took} us");
        }
        traffic.on_batch(40, at(5000));
        traffic.on_silence();
        assert!(!traffic.can_collect(at(5000)));
    }

    #[test]
    fn answers_are_read_at_once() {
        let mut traffic = Traffic::new();
        traffic.on_batch(40, at(5000));
        assert!(traffic.can_collect(at(6000)));
        traffic.on_send();
        // The time of the send is not known before the next frame.
        assert!(!traffic.can_collect(at(6000)));
        for (last_frame_at, is_answered) in [(90_000_000, false), (90_999_999, false), (91_000_000, true)] {
            traffic.on_batch(40, at(last_frame_at - 1000));
            assert_eq!(traffic.can_collect(at(last_frame_at)), is_answered, "{last_frame_at}");
        }
    }
}
