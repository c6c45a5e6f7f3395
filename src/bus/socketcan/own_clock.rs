//! The interface's own clock, laid upon the computer's.

use crate::bus::{Mono, Stamp, Wall};
use std::time::Duration;

/// By how many parts in a million the two clocks may run apart. Crystals are off by 100 at most, and the computer's
/// clock is slewed by up to 500.
const DRIFT: i128 = 600;
/// No frame takes longer from the interface to the kernel. If one seems to, the interface's clock was set or began
/// anew.
const LATENCY: Duration = Duration::from_millis(50);

/// Some drivers say when the interface itself saw a frame, by a clock of its own: it runs on while the computer is
/// busy, so it tells intervals far better than the kernel; but it starts anywhere, drifts, and nobody sets it.
///
/// A frame is never in the kernel before it was on the bus. The least that the kernel's time was ever later than
/// the interface's is therefore how far the clocks are apart, and it may grow no faster than they can drift. What
/// comes out is never later than the kernel says, never earlier by more than [`LATENCY`], and goes backwards never.
#[derive(Debug, Default)]
pub(super) struct OwnClock {
    /// What it showed last, and how far the computer's was ahead of it then, in nanoseconds.
    known: Option<(i128, i128)>,
    /// When the last frame was received.
    last: Mono,
}

impl OwnClock {
    /// When a frame was received that the interface saw at `own`, and the kernel at `kernel`.
    pub(super) fn place(&mut self, own: Duration, kernel: Stamp) -> Stamp {
        let own = nanoseconds(own);
        let ahead = nanoseconds(kernel.mono.since_start()) - own;
        let least = match self.known {
            None => ahead,
            Some((before, least)) => {
                let grown = least + (own - before).max(0) * DRIFT / 1_000_000;
                if ahead - grown > nanoseconds(LATENCY) { ahead } else { grown.min(ahead) }
            }
        };
        self.known = Some((own, least));
        let late = Duration::from_nanos(u64::try_from(ahead - least).unwrap_or(0));
        let mono = (kernel.mono - late).max(self.last).min(kernel.mono);
        self.last = mono;
        let wall = kernel.wall.since_epoch().saturating_sub(kernel.mono.since(mono));
        Stamp { mono, wall: Wall::at(wall) }
    }

    /// A frame of which only the kernel says when it came: none that follows is earlier.
    pub(super) fn pass(&mut self, kernel: Stamp) {
        self.last = kernel.mono;
    }
}

fn nanoseconds(length: Duration) -> i128 {
    i128::try_from(length.as_nanos()).unwrap_or(i128::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPENED: Duration = Duration::from_secs(1_436_509_052);

    fn kernel(mono: Duration) -> Stamp {
        Stamp { mono: Mono::at(mono), wall: Wall::at(OPENED + mono) }
    }

    fn us(microseconds: u64) -> Duration {
        Duration::from_micros(microseconds)
    }

    /// How late the kernel is for the `n`th frame: mostly a little, now and then a lot.
    fn latency(n: u64) -> Duration {
        let noise = n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        if noise.is_multiple_of(50) { us(20_000) } else { us(100 + noise % 2000) }
    }

    /// What a clock shows that is wrong by this many parts in a million.
    fn shown(length: Duration, wrong: i32) -> Duration {
        let by = length * wrong.unsigned_abs() / 1_000_000;
        if wrong < 0 { length - by } else { length + by }
    }

    #[test]
    fn intervals_are_those_of_the_interface() {
        // It began an hour before, and runs 80 ppm too fast or too slow for half an hour.
        for wrong in [-80, 0, 80] {
            let mut clock = OwnClock::default();
            let mut last = None;
            for n in 0..180_000 {
                let on_the_bus = us(n * 10_000);
                let own = Duration::from_secs(3600) + shown(on_the_bus, wrong);
                let stamp = clock.place(own, kernel(on_the_bus + latency(n)));
                let off = stamp.mono.since_start().saturating_sub(on_the_bus);
                assert!(stamp.mono.since_start() >= on_the_bus, "{n}: before it was sent");
                if n > 200 {
                    assert!(off < us(600), "{n}: {off:?} late at {wrong} ppm");
                    let interval = stamp.mono.since(last.expect("a frame before")).abs_diff(us(10_000));
                    assert!(interval < us(600), "{n}: {interval:?} off at {wrong} ppm");
                }
                assert_eq!(stamp.wall.since_epoch() - OPENED, stamp.mono.since_start());
                last = Some(stamp.mono);
            }
        }
    }

    #[test]
    fn a_clock_that_is_set_does_no_harm() {
        let mut clock = OwnClock::default();
        let mut last = Mono::START;
        for n in 0..2000u64 {
            // Begins anew, jumps ahead, stands still, shows anything.
            let own = match n / 500 {
                0 => us(n * 1000),
                1 => us((n % 100) * 1000),
                2 => Duration::from_secs(1 << 40) + us(n / 10),
                _ => Duration::from_nanos(n.wrapping_mul(0x9e37_79b9_7f4a_7c15)),
            };
            let at = kernel(us(n * 1000) + latency(n).min(us(900)));
            let stamp = clock.place(own, at);
            assert!(stamp.mono <= at.mono && at.mono.since(stamp.mono) <= LATENCY, "{n}: {stamp:?} for {at:?}");
            assert!(stamp.mono >= last, "{n}: {stamp:?} after {last:?}");
            last = stamp.mono;
        }
    }

    #[test]
    fn what_follows_a_frame_without_its_time_is_not_earlier() {
        let mut clock = OwnClock::default();
        clock.place(us(1000), kernel(us(5000)));
        clock.pass(kernel(us(9000)));
        assert_eq!(clock.place(us(3000), kernel(us(9100))).mono, Mono::at(us(9000)));
    }
}
