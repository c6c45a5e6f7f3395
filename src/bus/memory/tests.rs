use super::*;
use crate::bus::time::Wall;
use crate::canopen::wire_length::frame_bits;
use std::time::Duration;

/// Sends given frames at given times. It records the received frames and the times when its own frames were sent.
#[derive(Default)]
struct Script {
    planned: VecDeque<(Mono, Frame)>,
    received: Vec<(Mono, Frame)>,
    sent: Vec<(Mono, Frame)>,
}

impl Station for Script {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        self.received.push((now, *frame));
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        while self.next_wake().is_some_and(|due| due <= now) {
            self.planned.pop_front().into_iter().for_each(|(_, frame)| out.send(frame));
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.planned.front().map(|(due, _)| *due)
    }

    fn sent(&mut self, now: Mono, frame: &Frame) {
        self.sent.push((now, *frame));
    }
}

mod rates;

fn frame(text: &str) -> Frame {
    text.parse().expect("a frame")
}

fn us(microseconds: u64) -> Mono {
    Mono::at(Duration::from_micros(microseconds))
}

fn script(frames: &[(u64, &str)]) -> Script {
    Script { planned: frames.iter().map(|(at, text)| (us(*at), frame(text))).collect(), ..Script::default() }
}

/// The duration of a frame at 250 kbit/s, without intermission.
fn length(text: &str) -> Duration {
    Duration::from_micros(u64::from(frame_bits(&frame(text))) * 4)
}

const INTERMISSION_TIME: Duration = Duration::from_micros(12);

/// Receives all frames up to `until`, each with its time in microseconds.
fn drain(bus: &mut MemoryBus, until: Mono) -> Vec<(u128, String)> {
    let mut seen = Vec::new();
    loop {
        match bus.receive(until).expect("a memory bus never fails") {
            Event::Frame(received) => {
                seen.push((received.at.mono.since_start().as_micros(), received.frame.to_string()));
            }
            Event::Timeout => return seen,
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_frame_takes_its_duration_and_reaches_all_but_its_sender() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[(1000, "701#00")]));
    bus.attach(script(&[]));
    let complete = us(1000) + length("701#00");
    assert_eq!(drain(&mut bus, us(5000)), [(complete.since_start().as_micros(), "701#00".to_owned())]);
    assert_eq!(bus.now().mono, us(5000));
    let stations: Vec<&Script> = bus.stations().collect();
    assert_eq!(stations[0].sent, [(complete, frame("701#00"))]);
    assert_eq!(stations[0].received, []);
    assert_eq!(stations[1].received, [(complete, frame("701#00"))]);
}

#[test]
fn the_program_does_not_receive_its_own_frames() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[]));
    bus.send(&frame("080#")).expect("room");
    assert_eq!(drain(&mut bus, us(1000)), []);
    let station: &Script = bus.stations().next().expect("one station");
    assert_eq!(station.received, [(Mono::START + length("080#"), frame("080#"))]);
}

#[test]
fn the_lowest_identifier_wins_and_no_frame_is_interrupted() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    // 7FFh starts alone and is not interrupted. Then 081h wins, then 182h, then the 29-bit frame, although they were
    // queued in the reverse order. The order within one station does not change.
    bus.attach(script(&[(0, "7FF#"), (10, "081#01")]));
    bus.attach(script(&[(5, "06080000#"), (5, "000#0100")]));
    bus.attach(script(&[(6, "182#02")]));
    let order: Vec<String> = drain(&mut bus, us(100_000)).into_iter().map(|(_, text)| text).collect();
    assert_eq!(order, ["7FF#", "081#01", "182#02", "06080000#", "000#0100"]);
    // Each frame starts when the intermission after the previous one is over.
    let sent: Vec<Mono> = bus.stations::<Script>().flat_map(|station| station.sent.iter().map(|(at, _)| *at)).collect();
    let first = Mono::START + length("7FF#");
    let second = first + INTERMISSION_TIME + length("081#01");
    let third = second + INTERMISSION_TIME + length("182#02");
    let fourth = third + INTERMISSION_TIME + length("06080000#");
    let fifth = fourth + INTERMISSION_TIME + length("000#0100");
    assert_eq!(sent, [first, second, fourth, fifth, third]);
}

#[test]
fn the_program_takes_part_in_the_arbitration() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[(0, "181#"), (0, "181#")]));
    bus.attach(script(&[]));
    bus.send(&frame("080#")).expect("room");
    bus.send(&frame("7E5#")).expect("room");
    drain(&mut bus, us(10_000));
    let observer: &Script = bus.stations().nth(1).expect("two stations");
    let order: Vec<String> = observer.received.iter().map(|(_, frame)| frame.to_string()).collect();
    assert_eq!(order, ["080#", "181#", "181#", "7E5#"]);
}

#[test]
fn the_bit_rate_decides_how_long_a_frame_takes() {
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(1_000_000);
    assert_eq!(bus.bit_rate(), Some(1_000_000));
    bus.attach(script(&[(0, "701#00")]));
    let bits = u128::from(frame_bits(&frame("701#00")));
    assert_eq!(drain(&mut bus, us(1000)), [(bits, "701#00".to_owned())]);
}

#[test]
fn the_transmit_queue_is_limited_and_empties_over_time() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[]));
    for _ in 0..QUEUE_LENGTH {
        bus.send(&frame("080#")).expect("room for ten");
    }
    assert!(matches!(bus.send(&frame("080#")), Err(BusError::QueueFull)));
    // When the first frame is on the bus, the queue has space for exactly one more.
    drain(&mut bus, us(1));
    bus.send(&frame("080#")).expect("room for one");
    assert!(matches!(bus.send(&frame("080#")), Err(BusError::QueueFull)));
    drain(&mut bus, us(100_000));
    for _ in 0..QUEUE_LENGTH {
        bus.send(&frame("080#")).expect("room again");
    }
    drain(&mut bus, us(200_000));
    let observer: &Script = bus.stations().next().expect("one station");
    assert_eq!(observer.received.len(), 2 * QUEUE_LENGTH + 1, "a refused frame is not sent");
}

#[test]
fn virtual_time_passes_only_while_receiving() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[(0, "701#00")]));
    assert_eq!(bus.now(), Stamp { mono: Mono::START, wall: VIRTUAL_EPOCH });
    bus.send(&frame("080#")).expect("room");
    assert_eq!(bus.now().mono, Mono::START);
    // A year passes at once, and the wall clock advances too.
    let year = Mono::at(Duration::from_secs(365 * 86_400));
    assert_eq!(drain(&mut bus, year).len(), 1);
    assert_eq!(bus.now().mono, year);
    assert_eq!(bus.now().wall.since_epoch().as_secs(), 1_767_225_600 + 365 * 86_400);
    // A deadline in the past neither waits nor sets the time back.
    assert_eq!(bus.receive(Mono::START).expect("no error"), Event::Timeout);
    assert_eq!(bus.now().mono, year);
}

#[test]
fn a_frame_that_arrives_at_the_deadline_is_received() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[(0, "701#00")]));
    let complete = Mono::START + length("701#00");
    assert_eq!(bus.receive(complete - Duration::from_nanos(1)).expect("no error"), Event::Timeout);
    assert!(matches!(bus.receive(complete), Ok(Event::Frame(_))));
}

#[test]
fn filters_apply_to_frames_that_are_complete_afterwards() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[(0, "181#01"), (0, "281#02"), (0, "281#R"), (0, "00000281#03"), (5000, "181#04")]));
    bus.listen(&Filters::Only(vec![frame("281#").id()])).expect("no error");
    let seen: Vec<String> = drain(&mut bus, us(4000)).into_iter().map(|(_, text)| text).collect();
    assert_eq!(seen, ["281#02", "281#R"]);
    bus.listen(&Filters::All).expect("no error");
    assert_eq!(drain(&mut bus, us(10_000)).len(), 1);
}

#[test]
fn an_interrupt_comes_once_at_its_time() {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(script(&[(0, "701#00"), (3000, "701#05")]));
    bus.interrupt_at(us(2000));
    assert!(matches!(bus.receive(us(9000)), Ok(Event::Frame(_))));
    assert_eq!(bus.receive(us(9000)).expect("no error"), Event::Interrupted);
    assert_eq!(bus.now().mono, us(2000));
    // The bus still works after an interrupt, for cleaning up.
    assert!(matches!(bus.receive(us(9000)), Ok(Event::Frame(_))));
    assert_eq!(bus.receive(us(9000)).expect("no error"), Event::Timeout);
}

/// Reports a stop by the user at the `n`-th wait.
struct StopsAt(u32);

impl Sleeper for StopsAt {
    fn sleep(&mut self, _: Duration) -> bool {
        self.0 = self.0.wrapping_sub(1);
        self.0 == 0
    }
}

#[test]
fn the_user_can_interrupt_the_real_clock_in_a_wait_and_the_virtual_one_between_waits() {
    let mut bus = MemoryBus::new(Clock::Real).with_sleeper(Box::new(StopsAt(2)));
    let started = std::time::Instant::now();
    assert_eq!(bus.receive(Mono::at(Duration::from_secs(3600))).expect("no error"), Event::Interrupted);
    assert!(started.elapsed() < Duration::from_secs(60));
    let mut bus = MemoryBus::new(Clock::Virtual).with_sleeper(Box::new(StopsAt(2)));
    assert_eq!(bus.receive(us(1)).expect("no error"), Event::Timeout);
    assert_eq!(bus.receive(us(2)).expect("no error"), Event::Interrupted);
    assert_eq!(bus.receive(us(2)).expect("no error"), Event::Timeout);
}

#[test]
fn the_real_clock_waits_and_missed_frames_keep_their_times() {
    let mut bus = MemoryBus::new(Clock::Real);
    bus.attach(script(&[(0, "701#00"), (2000, "701#05"), (30_000, "701#7F")]));
    let before = Wall::now();
    // Two frames arrive while the program is busy. They are received with their own times.
    std::thread::sleep(Duration::from_millis(5));
    let first = (Mono::START + length("701#00")).since_start().as_micros();
    let second = (us(2000) + length("701#05")).since_start().as_micros();
    let seen = drain(&mut bus, us(20_000));
    assert_eq!(seen, [(first, "701#00".to_owned()), (second, "701#05".to_owned())]);
    assert!(bus.now().mono >= us(20_000), "it waits until the deadline");
    let Ok(Event::Frame(received)) = bus.receive(us(10_000_000)) else { panic!("the third frame") };
    assert_eq!(received.at.mono, us(30_000) + length("701#7F"));
    assert!(received.at.wall >= Wall::at(before.since_epoch() + Duration::from_millis(20)));
    assert!(received.at.wall <= Wall::now());
    assert!(bus.now().mono >= received.at.mono, "nothing is received before it is complete");
}
