//! A macro that forwards methods to an inner bus, so that a wrapper implements only the methods it changes.

/// Implements methods of [`Bus`](crate::bus::Bus) and [`BitRateControl`](crate::bus::BitRateControl) by calling the
/// same method of an inner bus.
///
/// Arguments: `self`, the expression of the inner bus, and the names of the methods.
///
/// ```
/// use cangauge::bus::{BitRateControl, Bus, BusError};
/// use cangauge::canopen::frame::Frame;
///
/// /// Counts the frames that are sent.
/// struct Counting<B> {
///     inner: B,
///     sent: u32,
/// }
///
/// impl<B: Bus> Bus for Counting<B> {
///     cangauge::bus::delegate_bus!(self, self.inner => name timestamps is_live sends_remote_frames waits now mono listen receive
///         receive_buffer unreported_drops finish);
///
///     fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
///         self.sent += 1;
///         self.inner.send(frame)
///     }
/// }
///
/// impl<B: Bus> BitRateControl for Counting<B> {
///     cangauge::bus::delegate_bus!(self, self.inner => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
/// }
/// ```
#[macro_export]
macro_rules! delegate_bus {
    ($this:ident, $inner:expr => name) => {
        fn name(&$this) -> &str {
            $inner.name()
        }
    };
    ($this:ident, $inner:expr => timestamps) => {
        fn timestamps(&$this) -> $crate::bus::TimestampSource {
            $inner.timestamps()
        }
    };
    ($this:ident, $inner:expr => is_live) => {
        fn is_live(&$this) -> bool {
            $inner.is_live()
        }
    };
    ($this:ident, $inner:expr => sends_remote_frames) => {
        fn sends_remote_frames(&$this) -> bool {
            $inner.sends_remote_frames()
        }
    };
    ($this:ident, $inner:expr => waits) => {
        fn waits(&$this) -> bool {
            $inner.waits()
        }
    };
    ($this:ident, $inner:expr => now) => {
        fn now(&$this) -> $crate::bus::Stamp {
            $inner.now()
        }
    };
    ($this:ident, $inner:expr => mono) => {
        fn mono(&$this) -> $crate::bus::Mono {
            $inner.mono()
        }
    };
    ($this:ident, $inner:expr => waits_without_clock) => {
        fn waits_without_clock(&$this) -> bool {
            $inner.waits_without_clock()
        }
    };
    ($this:ident, $inner:expr => receive_answer) => {
        fn receive_answer(&mut $this) -> Result<Option<$crate::bus::Event>, $crate::bus::BusError> {
            $inner.receive_answer()
        }
    };
    ($this:ident, $inner:expr => listen) => {
        fn listen(&mut $this, filters: &$crate::bus::Filters) -> Result<(), $crate::bus::BusError> {
            $inner.listen(filters)
        }
    };
    ($this:ident, $inner:expr => send) => {
        fn send(&mut $this, frame: &$crate::canopen::frame::Frame) -> Result<(), $crate::bus::BusError> {
            $inner.send(frame)
        }
    };
    ($this:ident, $inner:expr => receive) => {
        fn receive(&mut $this, deadline: $crate::bus::Mono) -> Result<$crate::bus::Event, $crate::bus::BusError> {
            $inner.receive(deadline)
        }
    };
    ($this:ident, $inner:expr => receive_buffer) => {
        fn receive_buffer(&$this) -> Option<$crate::bus::ReceiveBuffer> {
            $inner.receive_buffer()
        }
    };
    ($this:ident, $inner:expr => unreported_drops) => {
        fn unreported_drops(&mut $this) -> u32 {
            $inner.unreported_drops()
        }
    };
    ($this:ident, $inner:expr => finish) => {
        fn finish(&mut $this) -> Result<(), $crate::bus::BusError> {
            $inner.finish()
        }
    };
    ($this:ident, $inner:expr => bit_rate) => {
        fn bit_rate(&$this) -> Option<u32> {
            $inner.bit_rate()
        }
    };
    ($this:ident, $inner:expr => can_set_bit_rate) => {
        fn can_set_bit_rate(&$this) -> Result<(), $crate::bus::BusError> {
            $inner.can_set_bit_rate()
        }
    };
    ($this:ident, $inner:expr => set_bit_rate) => {
        fn set_bit_rate(&mut $this, rate: u32, mode: $crate::bus::Mode) -> Result<(), $crate::bus::BusError> {
            $inner.set_bit_rate(rate, mode)
        }
    };
    ($this:ident, $inner:expr => restore_bit_rate) => {
        fn restore_bit_rate(&mut $this) -> Result<(), $crate::bus::BusError> {
            $inner.restore_bit_rate()
        }
    };
    ($this:ident, $inner:expr => $($method:ident)+) => {
        $($crate::bus::delegate_bus!($this, $inner => $method);)+
    };
}

pub use delegate_bus;

#[cfg(test)]
mod tests {
    use crate::bus::faults::{FaultPlan, Faulty};
    use crate::bus::trace::Traced;
    use crate::bus::{
        BitRateControl, Bus, BusError, Event, Filters, Mode, Mono, ReceiveBuffer, Stamp, TimestampSource, Wall,
    };
    use crate::canopen::frame::Frame;
    use crate::canopen::id::CanId;
    use std::cell::RefCell;
    use std::rc::Rc;
    use std::time::Duration;

    /// A bus whose results all differ from the defaults of the traits. It records the calls that change the bus.
    struct Unusual(Rc<RefCell<Vec<String>>>);

    impl Unusual {
        fn record(&self, call: &str) -> Result<(), BusError> {
            self.0.borrow_mut().push(call.to_owned());
            Ok(())
        }
    }

    const BUFFER: ReceiveBuffer = ReceiveBuffer { bytes: 3, wanted: 4 };
    const NOW: Stamp = Stamp { mono: Mono::START, wall: Wall::at(Duration::from_secs(9)) };

    impl Bus for Unusual {
        fn name(&self) -> &str {
            "unusual"
        }

        fn timestamps(&self) -> TimestampSource {
            TimestampSource::Recorded
        }

        fn is_live(&self) -> bool {
            false
        }

        fn sends_remote_frames(&self) -> bool {
            false
        }

        fn waits(&self) -> bool {
            false
        }

        fn now(&self) -> Stamp {
            NOW
        }

        fn mono(&self) -> Mono {
            Mono::at(Duration::from_secs(5))
        }

        fn listen(&mut self, _: &Filters) -> Result<(), BusError> {
            self.record("listen")
        }

        fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
            self.record(&frame.to_string())
        }

        fn receive(&mut self, _: Mono) -> Result<Event, BusError> {
            Ok(Event::Dropped(7))
        }

        fn receive_buffer(&self) -> Option<ReceiveBuffer> {
            Some(BUFFER)
        }

        fn unreported_drops(&mut self) -> u32 {
            11
        }

        fn finish(&mut self) -> Result<(), BusError> {
            self.record("finish")
        }
    }

    impl BitRateControl for Unusual {
        fn bit_rate(&self) -> Option<u32> {
            Some(33_333)
        }

        fn can_set_bit_rate(&self) -> Result<(), BusError> {
            self.record("can set")
        }

        fn set_bit_rate(&mut self, bit_rate: u32, _: Mode) -> Result<(), BusError> {
            self.record(&format!("set {bit_rate}"))
        }

        fn restore_bit_rate(&mut self) -> Result<(), BusError> {
            self.record("restore")
        }
    }

    #[test]
    fn wrappers_forward_every_method() -> Result<(), BusError> {
        let calls = Rc::default();
        let traced = Traced::new(Unusual(Rc::clone(&calls)), Box::new(std::io::sink()), "t.log");
        let mut bus: Box<dyn Bus> = Box::new(Faulty::new(traced, FaultPlan::default()));
        assert_eq!((bus.name(), bus.timestamps()), ("unusual", TimestampSource::Recorded));
        assert_eq!((bus.is_live(), bus.waits(), bus.now()), (false, false, NOW));
        assert_eq!((bus.mono(), bus.bit_rate()), (Mono::at(Duration::from_secs(5)), Some(33_333)));
        assert_eq!((bus.receive_buffer(), bus.unreported_drops()), (Some(BUFFER), 11));
        assert_eq!(bus.receive(Mono::START)?, Event::Dropped(7));
        bus.listen(&Filters::All)?;
        bus.send(&Frame::empty(CanId::SYNC))?;
        bus.can_set_bit_rate()?;
        bus.set_bit_rate(125_000, Mode::Normal)?;
        bus.restore_bit_rate()?;
        bus.finish()?;
        assert_eq!(*calls.borrow(), ["listen", "080#", "can set", "set 125000", "restore", "finish"]);
        Ok(())
    }
}
