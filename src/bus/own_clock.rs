//! Converts the interface's own clock to the host's time.

use crate::bus::{Mono, Stamp, Wall};
use std::time::Duration;

/// The largest drift between the two clocks, in parts per million. Crystals deviate by at most 100, and the host
/// corrects its clock by up to 500.
const MAX_DRIFT_PPM: i128 = 600;
/// The longest delay of a frame between the interface and the kernel. A longer delay means that the clock of the
/// interface was set or restarted.
const MAX_LATENCY: Duration = Duration::from_millis(50);

/// Some drivers report the receive time of a frame by the clock of the interface. A busy host does not delay this
/// clock, so its intervals are more accurate than intervals of kernel times. But the clock starts at any value, drifts,
/// and is not synchronized.
///
/// The kernel receives a frame only after the interface. So the smallest difference between the two times is the offset
/// of the clocks. The offset may grow only as fast as the clocks can drift. The result is never later than the time of
/// the kernel, and at most [`MAX_LATENCY`] earlier. It never goes backwards.
#[derive(Debug, Default)]
pub(super) struct InterfaceClock {
    /// The last time of the interface clock, and the offset of the host clock from it, in nanoseconds.
    last_offset: Option<(i128, i128)>,
    /// When the last frame was received.
    last: Mono,
}

impl InterfaceClock {
    /// Returns the time of a frame that the interface received at `own` (on its clock) and the kernel at `kernel`.
    pub(super) fn place(&mut self, own: Duration, kernel: Stamp) -> Stamp {
        let own = nanoseconds(own);
        let offset = nanoseconds(kernel.mono.since_start()) - own;
        let min_offset = match self.last_offset {
            None => offset,
            Some((last_own, min_offset)) => {
                let grown_offset = min_offset + (own - last_own).max(0) * MAX_DRIFT_PPM / 1_000_000;
                if offset - grown_offset > nanoseconds(MAX_LATENCY) { offset } else { grown_offset.min(offset) }
            }
        };
        self.last_offset = Some((own, min_offset));
        let delay = Duration::from_nanos(u64::try_from(offset - min_offset).unwrap_or(0));
        let mono = (kernel.mono - delay).max(self.last).min(kernel.mono);
        self.last = mono;
        let wall = kernel.wall.since_epoch().saturating_sub(kernel.mono.since(mono));
        Stamp { mono, wall: Wall::at(wall) }
    }

    /// Records the time of a frame that has only a kernel time. A later frame then never gets an earlier time.
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

    /// The delay of the kernel for the `n`th frame: mostly short, sometimes long.
    fn latency(n: u64) -> Duration {
        let noise = n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        if noise.is_multiple_of(50) { us(20_000) } else { us(100 + noise % 2000) }
    }

    /// Returns the time on a clock that deviates by `ppm` parts per million.
    fn clock_time(length: Duration, ppm: i32) -> Duration {
        let deviation = length * ppm.unsigned_abs() / 1_000_000;
        if ppm < 0 { length - deviation } else { length + deviation }
    }

    #[test]
    fn intervals_follow_the_clock_of_the_interface() {
        // The clock started an hour earlier and runs 80 ppm too fast or too slow for half an hour.
        for wrong in [-80, 0, 80] {
            let mut clock = InterfaceClock::default();
            let mut last = None;
            for n in 0..180_000 {
                let on_the_bus = us(n * 10_000);
                let own = Duration::from_secs(3600) + clock_time(on_the_bus, wrong);
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
    fn a_clock_that_is_set_never_exceeds_the_kernels_time() {
        let mut clock = InterfaceClock::default();
        let mut last = Mono::START;
        for n in 0..2000u64 {
            // The clock restarts, jumps ahead, stands still, or shows random values.
            let own = match n / 500 {
                0 => us(n * 1000),
                1 => us((n % 100) * 1000),
                2 => Duration::from_secs(1 << 40) + us(n / 10),
                _ => Duration::from_nanos(n.wrapping_mul(0x9e37_79b9_7f4a_7c15)),
            };
            let at = kernel(us(n * 1000) + latency(n).min(us(900)));
            let stamp = clock.place(own, at);
            assert!(stamp.mono <= at.mono && at.mono.since(stamp.mono) <= MAX_LATENCY, "{n}: {stamp:?} for {at:?}");
            assert!(stamp.mono >= last, "{n}: {stamp:?} after {last:?}");
            last = stamp.mono;
        }
    }

    #[test]
    fn a_frame_after_one_without_hardware_time_is_not_earlier() {
        let mut clock = InterfaceClock::default();
        clock.place(us(1000), kernel(us(5000)));
        clock.pass(kernel(us(9000)));
        assert_eq!(clock.place(us(3000), kernel(us(9100))).mono, Mono::at(us(9000)));
    }
}
