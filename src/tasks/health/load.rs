//! The load of a bus.

use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::wire_length::{INTERMISSION, bit_time, frame_bits};
use std::collections::VecDeque;
use std::time::Duration;

/// The time over which the present load and the peak are measured.
const LOAD_WINDOW: Duration = Duration::from_secs(1);

/// Frames with a shorter pause between them belong to one burst. Receive times vary by about this time.
const BURST_PAUSE: Duration = Duration::from_micros(50);

/// The load of a bus, by the length of its frames with stuff bits and intermission.
#[derive(Clone, Debug, Default)]
pub struct Load {
    bit_rate: Option<u32>,
    start: Mono,
    end: Mono,
    bits: u64,
    /// The frames of the last [`LOAD_WINDOW`].
    recent: VecDeque<(Mono, u64)>,
    recent_bits: u64,
    peak_bits: u64,
    /// The time of the last frame; the number of frames and the start of the burst that ends with this frame.
    burst: Option<(Mono, u64, Mono)>,
    longest: (Duration, u64),
}

impl Load {
    pub(super) fn new(bit_rate: Option<u32>, start: Mono) -> Load {
        Load { bit_rate, start, end: start, ..Load::default() }
    }

    /// Counts a frame that was received at this time. Returns the number of its bits.
    pub(super) fn add(&mut self, frame: &Frame, at: Mono) -> u64 {
        let bits = frame_bits(frame) + INTERMISSION;
        self.count(u64::from(bits), at);
        if let Some(rate) = self.bit_rate {
            self.add_to_burst(at, bit_time(bits, rate));
        }
        self.end = self.end.max(at);
        u64::from(bits)
    }

    fn count(&mut self, bits: u64, at: Mono) {
        self.bits += bits;
        self.recent_bits += bits;
        self.recent.push_back((at, bits));
        self.drop_old(at);
        if at.since(self.start) >= LOAD_WINDOW {
            self.peak_bits = self.peak_bits.max(self.recent_bits);
        }
    }

    fn drop_old(&mut self, now: Mono) {
        while let Some(&(at, bits)) = self.recent.front() {
            if now.since(at) < LOAD_WINDOW {
                return;
            }
            self.recent_bits -= bits;
            self.recent.pop_front();
        }
    }

    /// Adds a frame that ends at `at` to the burst.
    fn add_to_burst(&mut self, at: Mono, length: Duration) {
        let (frames, start) = match self.burst {
            Some((last, frames, start)) if at.since(last) <= length + BURST_PAUSE => (frames + 1, start),
            _ => (1, at - length),
        };
        self.burst = Some((at, frames, start));
        if frames > self.longest.1 {
            self.longest = (at.since(start), frames);
        }
    }

    pub(super) fn finish(&mut self, end: Mono) {
        self.end = end;
        self.drop_old(end);
    }

    fn share(&self, bits: u64, time: Duration) -> Option<f64> {
        let rate = f64::from(self.bit_rate?);
        (!time.is_zero()).then(|| bits as f64 / (rate * time.as_secs_f64()))
    }

    /// Returns the mean load, 0 to 1. `None` if the bit rate is unknown.
    pub fn mean(&self) -> Option<f64> {
        self.share(self.bits, self.end.since(self.start))
    }

    /// Returns the load during the last second.
    pub fn now(&self) -> Option<f64> {
        if self.end.since(self.start) < LOAD_WINDOW { self.mean() } else { self.share(self.recent_bits, LOAD_WINDOW) }
    }

    /// Returns the load during the busiest second.
    pub fn peak(&self) -> Option<f64> {
        if self.end.since(self.start) < LOAD_WINDOW { self.mean() } else { self.share(self.peak_bits, LOAD_WINDOW) }
    }

    /// Returns the duration and the number of frames of the longest burst (frames without a pause). `None` if the bit
    /// rate is unknown.
    pub fn longest_burst(&self) -> Option<(Duration, u64)> {
        self.bit_rate.map(|_| self.longest)
    }

    /// Returns the bus load caused by these bits, 0 to 1.
    pub fn share_of(&self, bits: u64) -> Option<f64> {
        self.share(bits, self.end.since(self.start))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn load_peak_and_burst_of_known_frames() {
        let frame: Frame = "705#05".parse().expect("a frame");
        let bits = u64::from(frame_bits(&frame) + INTERMISSION);
        let at = |microseconds: u64| Mono::at(Duration::from_micros(microseconds));
        let mut load = Load::new(Some(125_000), Mono::START);
        // 100 frames in the first second, 300 in the second one, the last 5 of them without a pause.
        let slow = (1..=100).map(|count| count * 10_000);
        let fast = (1..=295).map(|count| 1_000_000 + count * 3000);
        let burst = (1..=5).map(|count| 1_990_000 + count * bits * 8);
        for time in slow.chain(fast).chain(burst) {
            load.add(&frame, at(time));
        }
        load.finish(at(2_000_000));
        let share = |frames: u64, seconds: f64| (frames * bits) as f64 / (125_000.0 * seconds);
        assert_eq!(load.mean(), Some(share(400, 2.0)));
        // The busiest second ends before the burst: it has 295 fast frames and 12 slow ones.
        assert_eq!((load.peak(), load.now()), (Some(share(307, 1.0)), Some(share(300, 1.0))));
        assert_eq!(load.longest_burst(), Some((Duration::from_micros(5 * bits * 8), 5)));
        assert_eq!(Load::new(None, Mono::START).mean(), None);
    }
}
