//! Computes the monotonic and wall time of a frame from its kernel timestamp.

use crate::bus::{Mono, Stamp, Wall};
use std::time::Duration;

/// The time for which a comparison of the clocks is valid. The clocks drift apart by less than 1 ms in this time.
const COMPARE_INTERVAL: Duration = Duration::from_secs(1);
/// The shortest time between two comparisons. On a busy machine, the program may be interrupted after reading the
/// frames and before reading the clock. A frame that arrives meanwhile seems to be too old, although no clock was set.
const MIN_COMPARE_INTERVAL: Duration = Duration::from_millis(10);
/// The longest time between two readings for a good comparison.
const MAX_READING_GAP: Duration = Duration::from_micros(100);
/// The inaccuracy of a comparison, because the clocks are read one after the other and drift.
const JITTER: Duration = Duration::from_millis(1);

/// The kernel timestamps frames with the wall clock only. Deadlines and intervals need the monotonic time. So the
/// clocks are compared regularly, and the wall time of a frame is shifted by the difference.
///
/// The wall clock may be set at any time. Then a frame seems to be received after it was read, or before the socket was
/// last found empty. The result is always between these two moments.
#[derive(Debug, Default)]
pub(super) struct Clocks {
    /// When the current batch was read.
    read: Mono,
    /// When the socket was last found empty before this batch, or the time of the frame before this batch.
    empty_at: Mono,
    /// Whether the current batch left the socket empty.
    emptied: bool,
    /// When the clocks were last compared, and the resulting wall time at [`Mono::START`].
    compared: Option<(Mono, Duration)>,
}

impl Clocks {
    /// Records a batch that was read at `now`. `emptied`: the socket was empty afterwards.
    pub(super) fn batch(&mut self, now: Mono, emptied: bool) {
        if self.emptied {
            self.empty_at = self.read;
        }
        self.emptied = emptied;
        self.read = now;
    }

    /// Records a batch that was read after a wait of unknown length, but not later than `latest`. Its frames are not
    /// older than the frame before, which was received at `previous_frame`.
    pub(super) fn batch_after_wait(&mut self, previous_frame: Mono, latest: Mono) {
        self.empty_at = self.empty_at.max(previous_frame);
        (self.read, self.emptied) = (latest, false);
    }

    /// Returns the receive time of a frame of the current batch. `now` reads both clocks.
    pub(super) fn stamp(&mut self, kernel: Option<Duration>, now: &dyn Fn() -> Stamp) -> Stamp {
        let start = match self.compared {
            Some((at, start)) if self.read.since(at) < COMPARE_INTERVAL => start,
            _ => self.compare(now),
        };
        let Some(wall) = kernel else {
            return Stamp { mono: self.read, wall: Wall::at(start.saturating_add(self.read.since_start())) };
        };
        let mut mono = shift(wall, start);
        // The clock may have been set since the last comparison, so the clocks are compared again. If the time is still
        // impossible, the frame was received before the clock was set.
        let may_compare = || self.compared.is_some_and(|(at, _)| at + MIN_COMPARE_INTERVAL <= self.read);
        if !self.is_possible(mono) && may_compare() {
            let start = self.compare(now);
            // After a send, the recorded read time is only an estimate.
            self.read = self.read.max(now().mono);
            mono = shift(wall, start);
        }
        Stamp { mono: mono.clamp(self.empty_at.min(self.read), self.read), wall: Wall::at(wall) }
    }

    fn compare(&mut self, now: &dyn Fn() -> Stamp) -> Duration {
        // The wall clock is read between two readings of the other clock. If these are far apart, the program was
        // interrupted, and the clocks are read again.
        let mut first = now();
        let mut best = (first, Duration::MAX);
        for _ in 0..4 {
            let second = now();
            let apart = second.mono.since(first.mono);
            if apart < best.1 {
                best = (first, apart);
            }
            if apart < MAX_READING_GAP {
                break;
            }
            first = second;
        }
        let at = best.0.mono;
        let start = best.0.wall.since_epoch().saturating_sub(at.since_start());
        self.compared = Some((at, start));
        start
    }

    /// Whether a frame of this batch can have this time.
    fn is_possible(&self, mono: Mono) -> bool {
        mono + JITTER >= self.empty_at && mono <= self.read + JITTER
    }
}

/// Returns the monotonic time for `wall`. `start` is the wall time at [`Mono::START`].
fn shift(wall: Duration, start: Duration) -> Mono {
    Mono::at(wall.saturating_sub(start))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::{Cell, RefCell};

    const OPENED: u64 = 1_436_509_052_000;

    fn mono(millis: u64) -> Mono {
        Mono::at(Duration::from_millis(millis))
    }

    /// The clocks of a host, in milliseconds. Readings are counted.
    struct Computer {
        mono: Cell<u64>,
        wall: Cell<u64>,
        reading_count: Cell<u32>,
    }

    impl Computer {
        fn new() -> Computer {
            Computer { mono: Cell::new(0), wall: Cell::new(OPENED), reading_count: Cell::new(0) }
        }

        fn pass(&self, millis: u64) {
            self.mono.set(self.mono.get() + millis);
            self.wall.set(self.wall.get() + millis);
        }

        fn stamp(&self, clocks: &mut Clocks, wall: u64) -> Mono {
            let now = || {
                self.reading_count.set(self.reading_count.get() + 1);
                Stamp { mono: mono(self.mono.get()), wall: Wall::at(Duration::from_millis(self.wall.get())) }
            };
            let stamp = clocks.stamp(Some(Duration::from_millis(wall)), &now);
            assert_eq!(stamp.wall, Wall::at(Duration::from_millis(wall)));
            stamp.mono
        }
    }

    #[test]
    fn a_frame_was_received_before_it_was_read() {
        let (computer, mut clocks) = (Computer::new(), Clocks::default());
        computer.pass(100);
        clocks.batch(mono(100), true);
        assert_eq!(computer.stamp(&mut clocks, OPENED + 40), mono(40));
        assert_eq!(computer.stamp(&mut clocks, OPENED + 90), mono(90));
        computer.pass(500);
        clocks.batch(mono(600), true);
        assert_eq!(computer.stamp(&mut clocks, OPENED + 599), mono(599));
        assert_eq!(computer.reading_count.get(), 2);
        computer.pass(700);
        clocks.batch(mono(1300), true);
        assert_eq!(computer.stamp(&mut clocks, OPENED + 1200), mono(1200));
        assert_eq!(computer.reading_count.get(), 4);
    }

    #[test]
    fn the_wall_clock_is_set_between_two_batches() {
        for step in [-3_600_000, -50, 50, 3_600_000i64] {
            let (computer, mut clocks) = (Computer::new(), Clocks::default());
            computer.pass(100);
            clocks.batch(mono(100), true);
            assert_eq!(computer.stamp(&mut clocks, OPENED + 40), mono(40));
            computer.wall.set(computer.wall.get().saturating_add_signed(step));
            computer.pass(10);
            let wall = computer.wall.get();
            computer.pass(2);
            clocks.batch(mono(112), true);
            assert_eq!(computer.stamp(&mut clocks, wall), mono(110), "{step}");
        }
    }

    #[test]
    fn the_wall_clock_is_set_while_a_frame_waits() {
        for step in [-3_600_000, 3_600_000i64] {
            let (computer, mut clocks) = (Computer::new(), Clocks::default());
            computer.pass(100);
            clocks.batch(mono(100), true);
            assert_eq!(computer.stamp(&mut clocks, OPENED + 40), mono(40));
            computer.pass(10);
            let before = computer.wall.get();
            computer.wall.set(before.saturating_add_signed(step));
            computer.pass(2);
            clocks.batch(mono(112), true);
            // Timestamps from before and after the step, in either order.
            let after = computer.wall.get();
            assert_eq!(computer.stamp(&mut clocks, after), mono(112), "{step}");
            assert!((mono(100)..=mono(112)).contains(&computer.stamp(&mut clocks, before)), "{step}");
            assert_eq!(computer.stamp(&mut clocks, after), mono(112), "{step}");
            assert!(computer.reading_count.get() <= 6);
        }
    }

    #[test]
    fn a_backlog_is_older_than_the_last_reading() {
        let (computer, mut clocks) = (Computer::new(), Clocks::default());
        computer.pass(100);
        clocks.batch(mono(100), false);
        assert_eq!(computer.stamp(&mut clocks, OPENED + 10), mono(10));
        clocks.batch(mono(101), true);
        assert_eq!(computer.stamp(&mut clocks, OPENED + 20), mono(20));
        // The socket was empty at 101, so a frame of the next batch cannot be older than that.
        clocks.batch(mono(105), true);
        assert_eq!(computer.stamp(&mut clocks, OPENED + 100), mono(101));
    }

    #[test]
    fn program_interrupted_after_reading_compares_the_clocks_rarely() {
        let (computer, mut clocks) = (Computer::new(), Clocks::default());
        for _ in 0..100 {
            // It was received after the last frames were read, and before the clock was read.
            let frame = computer.wall.get() - 3;
            computer.pass(4);
            let before = computer.mono.get();
            clocks.batch(mono(before), true);
            let at = computer.stamp(&mut clocks, frame);
            assert!(at <= mono(before) && at + Duration::from_millis(4) >= mono(before), "{at:?}");
        }
        // A comparison takes 3 readings.
        assert!(computer.reading_count.get() < 150, "{} readings", computer.reading_count.get());
    }

    #[test]
    fn a_comparison_that_was_interrupted_is_repeated() {
        let readings = RefCell::new([0, 5, 5].into_iter());
        let now = || {
            let millis = readings.borrow_mut().next().unwrap();
            // The program was interrupted between the first two readings, before it read the wall clock.
            let late = if millis == 0 { 5 } else { 0 };
            Stamp { mono: mono(millis), wall: Wall::at(Duration::from_millis(OPENED + millis + late)) }
        };
        let mut clocks = Clocks::default();
        clocks.batch(mono(20), true);
        assert_eq!(clocks.stamp(Some(Duration::from_millis(OPENED + 7)), &now).mono, mono(7));
    }

    #[test]
    fn frame_of_a_wait_is_not_older_than_the_frame_before() {
        let (computer, mut clocks) = (Computer::new(), Clocks::default());
        computer.pass(100);
        clocks.batch(mono(100), false);
        assert_eq!(computer.stamp(&mut clocks, OPENED + 90), mono(90));
        computer.pass(20);
        // The clock was set back by 50 ms.
        computer.wall.set(OPENED + 70);
        clocks.batch_after_wait(mono(90), mono(130));
        assert_eq!(computer.stamp(&mut clocks, OPENED + 65), mono(115));
    }

    #[test]
    fn frame_without_kernel_time_gets_the_time_of_reading() {
        let (computer, mut clocks) = (Computer::new(), Clocks::default());
        computer.pass(100);
        clocks.batch(mono(90), true);
        let now = || Stamp { mono: mono(100), wall: Wall::at(Duration::from_millis(OPENED + 100)) };
        let expected = Stamp { mono: mono(90), wall: Wall::at(Duration::from_millis(OPENED + 90)) };
        assert_eq!(clocks.stamp(None, &now), expected);
    }
}
