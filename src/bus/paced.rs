//! A wrapper around a bus that delays SDO requests if other nodes send, so that the bus load stays below a limit.
//! Requests and answers have priority over heartbeats (CiA 301, 7.3.3): without a limit, a long series of reads delays
//! the heartbeats in a running machine.

use super::{BitRateControl, Bus, BusError, Event, Filters, Mode, Mono, delegate_bus};
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::wire_length::frame_time;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::time::Duration;

/// The highest bus load of requests, answers and other traffic together, in percent, if other nodes send.
pub const SHARED_LOAD: u8 = 50;

/// The bus load in percent that requests and their answers may always use, even if other traffic is heavier.
const MIN_LOAD: u8 = 5;

/// The bus counts as shared if other traffic has at least this load in percent. Heartbeats alone stay below it.
const TRAFFIC_LOAD: u8 = 1;

/// The bus counts as shared if the frames of other nodes would need more than this time at a load of [`TRAFFIC_LOAD`]
/// percent (6 ms of frames). A burst of heartbeats needs less.
const TRAFFIC_TIME: Duration = Duration::from_millis(600);

/// The upper limit of this time, so that the bus counts as shared for at most 1 s after the last frame of other nodes.
const MAX_TRAFFIC_TIME: Duration = Duration::from_millis(1600);

/// Frames may be sent this much earlier than the limit allows, if fewer were sent before.
const CREDIT: Duration = Duration::from_millis(4);

/// The longest delay of a request because of earlier traffic.
const LONGEST_WAIT: Duration = Duration::from_millis(100);

/// The longest time between two requests on a bus that is always above the limit.
const LONGEST_PAUSE: Duration = Duration::from_millis(500);

/// The number of requests after which the measurement starts. Fewer requests do not load the bus.
const MIN_REQUESTS: u32 = 16;

/// The measurement ends when no request was sent for this time.
const IDLE_TIMEOUT: Duration = Duration::from_secs(1);

/// A bus with a limit for the load of SDO transfers. While a request must wait, [`Bus::send`] returns
/// [`BusError::QueueFull`].
///
/// The limit needs the bit rate. If it is unknown (a virtual interface), nothing is delayed.
pub struct Paced<B> {
    bus: B,
    /// The limit in percent, and whether it also applies without traffic of other nodes.
    limit: (u8, bool),
    /// The bit rate in bit/s, read when first needed.
    bit_rate: Cell<Option<Option<u32>>>,
    /// Pairs of COB-IDs for requests and answers, for nodes that do not use the usual ones.
    channels: Vec<(CanId, CanId)>,
    /// The filters of the caller. During the measurement, the inner bus receives all frames.
    filters: Filters,
    /// The measurement; `None` if there were few requests.
    load: Option<Load>,
    /// The number of requests, and when the last one was sent.
    requests: (u32, Mono),
    /// The COB-IDs of the answers to all requests so far.
    answers: BTreeSet<CanId>,
}

/// The measured load. Each `Mono` is the moment at which the frames so far would end if sent with a given load.
struct Load {
    bit_rate: u32,
    /// For all frames, with the load limit.
    limit: Mono,
    /// For requests and answers, with [`MIN_LOAD`].
    least: Mono,
    /// For frames of other nodes, with [`TRAFFIC_LOAD`].
    traffic: Mono,
}

impl Load {
    fn new(bit_rate: u32, now: Mono) -> Load {
        Load { bit_rate, limit: now, least: now, traffic: now }
    }

    /// Returns the interval at which frames of this length cause a load of `percent`.
    fn time(&self, frame: &Frame, percent: u8) -> Duration {
        frame_time(frame, self.bit_rate) * 100 / u32::from(percent)
    }

    fn on_frame(&mut self, frame: &Frame, now: Mono, limit: u8) {
        self.limit = (self.limit.max(now - CREDIT) + self.time(frame, limit)).min(now + LONGEST_WAIT);
    }

    fn on_request(&mut self, frame: &Frame, now: Mono) {
        // The answer has the same length in most cases.
        self.least = (self.least.max(now) + 2 * self.time(frame, MIN_LOAD)).min(now + LONGEST_PAUSE);
    }

    fn on_traffic(&mut self, frame: &Frame, now: Mono) {
        self.traffic = (self.traffic.max(now) + self.time(frame, TRAFFIC_LOAD)).min(now + MAX_TRAFFIC_TIME);
    }

    fn is_shared(&self, now: Mono) -> bool {
        self.traffic.since(now) > TRAFFIC_TIME
    }

    fn is_free(&self, now: Mono) -> bool {
        now >= self.limit || now >= self.least
    }
}

impl<B: Bus> Paced<B> {
    /// Limits the load of `bus`. `limit` is in percent; if it is `None`, [`SHARED_LOAD`] applies while other nodes
    /// send. `channels` are further COB-IDs of SDO requests and answers.
    pub fn new(bus: B, limit: Option<u8>, channels: Vec<(CanId, CanId)>) -> Paced<B> {
        let limit = (limit.unwrap_or(SHARED_LOAD).clamp(MIN_LOAD, 100), limit.is_some());
        let (bit_rate, filters, load) = (Cell::new(None), Filters::All, None);
        let (requests, answers) = ((0, Mono::START), BTreeSet::new());
        Paced { bus, limit, bit_rate, channels, filters, load, requests, answers }
    }

    /// Returns the COB-ID of the answer if `frame` is an SDO request. Aborts do not count: they must not be delayed.
    fn answer_of(&self, frame: &Frame) -> Option<CanId> {
        let is_abort = frame.data().first() == Some(&0x80);
        if frame.is_remote() || frame.len() != 8 || is_abort {
            return None;
        }
        let channel = self.channels.iter().find(|(request, _)| *request == frame.id()).map(|&(_, answer)| answer);
        channel.or_else(|| frame.id().sdo_request_node().map(CanId::sdo_response))
    }

    /// Counts a request, and starts the measurement after many requests in a short time.
    fn count_request(&mut self, now: Mono) -> Result<(), BusError> {
        let (count, last) = self.requests;
        let count = if now.since(last) > IDLE_TIMEOUT { 1 } else { count.saturating_add(1) };
        self.requests = (count, now);
        if count < MIN_REQUESTS || self.load.is_some() {
            return Ok(());
        }
        let bit_rate = self.bit_rate.get().unwrap_or_else(|| self.bus.bit_rate().filter(|rate| *rate > 0));
        self.bit_rate.set(Some(bit_rate));
        if let Some(bit_rate) = bit_rate {
            self.load = Some(Load::new(bit_rate, now));
            self.bus.listen(&Filters::All)?;
        }
        Ok(())
    }

    fn stop_measuring(&mut self) -> Result<(), BusError> {
        self.load = None;
        self.requests.0 = 0;
        self.bus.listen(&self.filters)
    }
}

impl<B: Bus> Bus for Paced<B> {
    delegate_bus!(self, self.bus => name timestamps is_live sends_remote_frames waits now mono receive_buffer unreported_drops finish);

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        self.filters = filters.clone();
        if self.load.is_some() { Ok(()) } else { self.bus.listen(filters) }
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        // Without a bit rate, there is nothing to measure.
        if self.bit_rate.get() == Some(None) {
            return self.bus.send(frame);
        }
        let Some(answer) = self.answer_of(frame) else { return self.bus.send(frame) };
        let now = self.bus.mono();
        if let Some(load) = &self.load
            && (self.limit.1 || load.is_shared(now))
            && !load.is_free(now)
        {
            return Err(BusError::QueueFull);
        }
        self.bus.send(frame)?;
        self.answers.insert(answer);
        self.count_request(now)?;
        if let Some(load) = &mut self.load {
            load.on_frame(frame, now, self.limit.0);
            load.on_request(frame, now);
        }
        Ok(())
    }

    fn waits_without_clock(&self) -> bool {
        self.load.is_none() && self.bus.waits_without_clock()
    }

    fn receive_answer(&mut self) -> Result<Option<Event>, BusError> {
        // During the measurement, each frame is counted.
        if self.load.is_some() { Ok(None) } else { self.bus.receive_answer() }
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            let event = self.bus.receive(deadline)?;
            let (Some(load), Event::Frame(received)) = (&mut self.load, &event) else { return Ok(event) };
            let (frame, now) = (&received.frame, received.at.mono);
            load.on_frame(frame, now, self.limit.0);
            // Boot-up messages do not count as traffic: a device sends only one when it is switched on.
            let is_boot_up = frame.id().heartbeat_node().is_some() && frame.data() == [0];
            if !self.answers.contains(&frame.id()) && !is_boot_up {
                load.on_traffic(frame, now);
            }
            if now.since(self.requests.1) > IDLE_TIMEOUT {
                self.stop_measuring()?;
            }
            if self.filters.wants(frame) {
                return Ok(event);
            }
            // A frame that does not match the filters must not extend the wait.
            if now >= deadline {
                return Ok(Event::Timeout);
            }
        }
    }
}

impl<B: Bus> BitRateControl for Paced<B> {
    delegate_bus!(self, self.bus => bit_rate can_set_bit_rate);

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        self.bit_rate.set(None);
        self.load = None;
        self.bus.set_bit_rate(bit_rate, mode)?;
        self.bus.listen(&self.filters)
    }

    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        self.bit_rate.set(None);
        self.load = None;
        self.bus.restore_bit_rate()?;
        self.bus.listen(&self.filters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::memory::{Clock, MemoryBus, Outbox, Station};

    const BIT_RATE: u32 = 250_000;

    /// Sends one frame at an interval, and answers SDO requests.
    struct Sender {
        frame: &'static str,
        interval: Option<Duration>,
        next: Mono,
    }

    const TPDO: &str = "481#0011223344556677";

    impl Station for Sender {
        fn power_on(&mut self, now: Mono, _: &mut Outbox) {
            self.next = now;
        }

        fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
            if frame.id().sdo_request_node().is_some() {
                out.send("581#4300100094010200".parse().expect("a frame"));
            }
        }

        fn wake(&mut self, _: Mono, out: &mut Outbox) {
            out.send(self.frame.parse().expect("a frame"));
            self.next = self.next + self.interval.unwrap_or_default();
        }

        fn next_wake(&self) -> Option<Mono> {
            self.interval.map(|_| self.next)
        }

        fn sent(&mut self, _: Mono, _: &Frame) {}
    }

    /// Sends SDO requests as fast as possible for two seconds, while another station sends. Returns the number of
    /// answers, and the load in the last second.
    fn read(interval: Option<Duration>, limit: Option<u8>) -> (u32, f64) {
        read_with_sender(Sender { frame: TPDO, interval, next: Mono::START }, limit)
    }

    fn read_with_sender(sender: Sender, limit: Option<u8>) -> (u32, f64) {
        let mut memory = MemoryBus::new(Clock::Virtual).with_bit_rate(BIT_RATE);
        memory.attach(sender);
        let request: Frame = "601#4000100000000000".parse().expect("a frame");
        let mut bus = Paced::new(memory, limit, Vec::new());
        bus.listen(&Filters::All).expect("filters");
        let (mut answers, mut busy, mut is_waiting) = (0, Duration::ZERO, false);
        let (start, end) = (bus.mono() + Duration::from_secs(1), bus.mono() + Duration::from_secs(2));
        while bus.mono() < end {
            if !is_waiting && bus.send(&request).is_ok() {
                is_waiting = true;
                busy += if bus.mono() > start { frame_time(&request, BIT_RATE) } else { Duration::ZERO };
            }
            let until = bus.mono() + Duration::from_millis(1);
            if let Event::Frame(received) = bus.receive(until).expect("an event") {
                busy += if bus.mono() > start { frame_time(&received.frame, BIT_RATE) } else { Duration::ZERO };
                if received.frame.id() == CanId::sdo_response("1".parse().expect("a node")) {
                    (answers, is_waiting) = (answers + 1, false);
                }
            }
        }
        (answers, busy.as_secs_f64())
    }

    fn us(microseconds: u64) -> Option<Duration> {
        Some(Duration::from_micros(microseconds))
    }

    #[test]
    fn load_stays_below_the_limit_beside_other_traffic() {
        // One frame of about 0.5 ms each 2.5 ms.
        let (answers, load) = read(us(2_500), None);
        assert!((0.46..=0.505).contains(&load), "{load}, {answers} answers");
        let (_, load) = read(us(2_500), Some(30));
        assert!((0.26..=0.305).contains(&load), "{load}");
    }

    #[test]
    fn silent_bus_has_no_limit_unless_the_user_sets_one() {
        let (free, load) = read(None, None);
        assert!(load > 0.8, "{load}, {free} answers");
        // A heartbeat per second does not count as traffic.
        let (beside, _) = read(us(1_000_000), None);
        assert!(beside.abs_diff(free) <= 2, "{beside} and {free}");
        // Boot-up messages do not count as traffic either, but frequent heartbeats do.
        let (_, load) = read_with_sender(Sender { frame: "701#00", interval: us(10_000), next: Mono::START }, None);
        assert!(load > 0.8, "{load}");
        let (_, load) = read_with_sender(Sender { frame: "701#7F", interval: us(10_000), next: Mono::START }, None);
        assert!((0.46..=0.505).contains(&load), "{load}");
        let (_, load) = read(None, Some(20));
        assert!((0.17..=0.205).contains(&load), "{load}");
    }

    #[test]
    fn requests_go_on_slowly_if_others_alone_exceed_the_limit() {
        // One frame of about 0.5 ms each 0.7 ms.
        let (answers, load) = read(us(700), None);
        assert!((60..=140).contains(&answers), "{answers} answers: about 5 % of the time, load {load}");
    }

    #[test]
    fn unwanted_frames_stay_away_and_do_not_extend_the_wait() {
        let mut memory = MemoryBus::new(Clock::Virtual).with_bit_rate(BIT_RATE);
        memory.attach(Sender { frame: TPDO, interval: us(700), next: Mono::START });
        let mut bus = Paced::new(memory, None, Vec::new());
        let answer = CanId::sdo_response("1".parse().expect("a node"));
        bus.listen(&Filters::Only(vec![answer])).expect("filters");
        for _ in 0..2 * MIN_REQUESTS {
            while bus.send(&"601#4000100000000000".parse().expect("a frame")).is_err() {
                let until = bus.mono() + Duration::from_millis(1);
                assert_eq!(bus.receive(until).expect("an event"), Event::Timeout);
            }
            let until = bus.mono() + Duration::from_millis(100);
            let event = bus.receive(until).expect("an event");
            assert!(matches!(event, Event::Frame(received) if received.frame.id() == answer), "{event:?}");
        }
        assert!(bus.load.is_some(), "measuring");
        let until = bus.mono() + Duration::from_millis(50);
        assert_eq!(bus.receive(until).expect("an event"), Event::Timeout);
        assert!(bus.mono() < until + Duration::from_millis(1));
        // The measurement ends when no more requests are sent.
        let until = bus.mono() + Duration::from_secs(2);
        assert_eq!(bus.receive(until).expect("an event"), Event::Timeout);
        assert!(bus.load.is_none());
    }
}
