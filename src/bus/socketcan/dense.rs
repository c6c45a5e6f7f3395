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
    sent_at: Option<Mono>,
    /// The number of frames in the last batch.
    count: u32,
    /// The time of the last frame before this batch.
    before: Mono,
}

impl Traffic {
    pub(super) fn new() -> Traffic {
        Traffic { sent_at: None, count: 0, before: Mono::START }
    }

    /// Records a send.
    pub(super) fn on_send(&mut self, at: Mono) {
        self.sent_at = Some(at);
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
    pub(super) fn can_collect(&self, last_frame_at: Mono, now: Mono) -> bool {
        let is_urgent = self.sent_at.is_some_and(|sent_at| now.since(sent_at) < URGENT_TIME);
        let is_dense = self.count > 0 && last_frame_at.since(self.before) * DENSE <= COLLECT_TIME * self.count;
        is_dense && !is_urgent
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
        assert!(!traffic.can_collect(at(0), at(0)));
        for (count, took, is_dense) in [(1, 250, true), (1, 251, false), (40, 1100, true), (4, 1001, false)] {
            traffic.on_batch(count, at(5000));
            assert_eq!(traffic.can_collect(at(5000 + took), at(9000)), is_dense, "{count} frames in {took} us");
        }
        traffic.on_batch(40, at(5000));
        traffic.on_silence();
        assert!(!traffic.can_collect(at(5000), at(9000)));
    }

    #[test]
    fn answers_are_read_at_once() {
        let mut traffic = Traffic::new();
        traffic.on_send(at(1000));
        traffic.on_batch(40, at(5000));
        assert!(!traffic.can_collect(at(6000), at(1_000_999)));
        assert!(traffic.can_collect(at(6000), at(1_001_000)));
    }
}
