//! A bus on which reading the clock takes long. The clock is not read after each request of a transfer, and no time-out
//! is too short.

use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::{Bus, BusError, Event, Mono, Stamp};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::master::{Answer, Master, Request, SdoError, SdoFailure, Timing};
use std::cell::Cell;
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_millis(100);
/// The longest wait that does not read the clock.
const ANSWER_TIME: Duration = Duration::from_millis(10);
/// How long the program is interrupted before it sends the last request.
const PAUSE: Duration = Duration::from_millis(80);
const SEGMENTS: usize = 100;

/// Counts how often the clock is read.
struct CostlyClock {
    inner: MemoryBus,
    readings: Cell<u32>,
    /// The number of frames to send before the pause.
    unpaused: usize,
    last_sent_at: Mono,
}

impl cangauge::bus::BitRateControl for CostlyClock {}

impl Bus for CostlyClock {
    cangauge::bus::delegate_bus!(self, self.inner => name timestamps is_live waits listen receive);

    fn now(&self) -> Stamp {
        self.readings.set(self.readings.get() + 1);
        self.inner.now()
    }

    fn waits_without_clock(&self) -> bool {
        true
    }

    fn receive_answer(&mut self) -> Result<Option<Event>, BusError> {
        let event = self.inner.receive(self.inner.now().mono + ANSWER_TIME)?;
        Ok(Some(event).filter(|event| *event != Event::Timeout))
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        if self.unpaused == 0 {
            let until = self.inner.now().mono + PAUSE;
            assert_eq!(self.inner.receive(until)?, Event::Timeout);
        }
        self.unpaused = self.unpaused.wrapping_sub(1);
        // The last frame is an abort, after the time-out.
        if frame.data()[0] != 0x80 {
            self.last_sent_at = self.inner.now().mono;
        }
        self.inner.send(frame)
    }
}

/// A server whose upload has 100 segments. It answers the last request after `delay`, or never.
struct Server {
    delay: Option<Duration>,
    answered: usize,
    due: Option<(Mono, Frame)>,
}

impl Station for Server {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, out: &mut Outbox) {
        if frame.data()[0] == 0x40 {
            return out.send("585#4000200000000000".parse().expect("a frame"));
        }
        self.answered += 1;
        let toggle = ((self.answered + 1) % 2) << 4;
        if self.answered == SEGMENTS {
            let last = format!("585#{:02X}41414141414141", toggle | 1).parse().expect("a frame");
            self.due = self.delay.map(|delay| (now + delay, last));
        } else {
            out.send(format!("585#{toggle:02X}41414141414141").parse().expect("a frame"));
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        if let Some((_, frame)) = self.due.take_if(|(due, _)| *due <= now) {
            out.send(frame);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.due.as_ref().map(|(due, _)| *due)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

/// Reads the object. Returns the result, the number of clock readings, and the time since the last request.
fn read(delay: Option<Duration>) -> (Result<Answer, SdoError>, u32, Duration) {
    let mut inner = MemoryBus::new(Clock::Virtual);
    inner.attach(Server { delay, answered: 0, due: None });
    let mut bus = CostlyClock { inner, readings: Cell::new(0), unpaused: SEGMENTS, last_sent_at: Mono::START };
    let mut master = Master::new(&mut bus, Timing { timeout: TIMEOUT, retries: 0 });
    let object = ObjectId::new(0x2000, 0);
    let request = Request::read(NodeId::new(5).expect("a node-ID"), object).once();
    let result = master.carry_out(request, &mut |_| {}).expect("the bus works");
    drop(master);
    let since_request = bus.inner.now().mono.since(bus.last_sent_at);
    (result, bus.readings.get(), since_request)
}

#[test]
fn clock_is_not_read_for_each_segment() {
    let (result, readings, _) = read(Some(Duration::ZERO));
    assert_eq!(result.expect("an answer").uploaded.expect("a read").bytes.len(), 7 * SEGMENTS);
    assert!(readings < 10, "{readings} readings for {SEGMENTS} segments");
}

#[test]
fn time_out_starts_after_sending_although_the_clock_was_not_read() {
    let (result, _, _) = read(Some(TIMEOUT - Duration::from_millis(1)));
    assert!(result.is_ok(), "the answer is in time: {result:?}");
    let (result, _, since_request) = read(None);
    assert!(matches!(result.expect_err("silence").failure, SdoFailure::NoAnswer { .. }));
    let longest = TIMEOUT + ANSWER_TIME * 2;
    assert!((TIMEOUT..longest).contains(&since_request), "{since_request:?}");
}
