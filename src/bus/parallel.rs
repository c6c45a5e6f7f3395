//! Runs several procedures concurrently on one bus. Each procedure has its own [`Bus`] and its own thread. Only one
//! thread is active at any moment, and the others wait for an event. So the order of the frames depends on the bus
//! only.

use super::{BitRateControl, Bus, BusError, Event, Filters, Mono, Stamp, TimestampSource};
use crate::canopen::frame::Frame;
use crate::canopen::wire_length::frame_time;
use std::cell::Cell;
use std::collections::VecDeque;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

/// The highest bus load of all procedures together. The rest is for frames of low priority, such as heartbeats. If
/// other nodes send, [`Paced`](super::paced::Paced) applies a lower limit.
const MAX_LOAD: f64 = 0.9;

/// The most bus time that the frames in the transmit queue may need together.
const MAX_QUEUED_TIME: Duration = Duration::from_millis(2);

/// The wait before a rejected frame is sent again.
const RETRY_INTERVAL: Duration = Duration::from_millis(1);

/// How long a rejected frame is sent again. After that, the procedure gets the error.
const RETRY_LIMIT: Duration = Duration::from_secs(1);

/// Runs `work` for all items at the same time; the results have the order of the items. A procedure cannot change the
/// bit rate of the interface. Each error of the bus is returned to one waiting procedure.
pub fn in_parallel<T: Send, R: Send>(
    bus: &mut dyn Bus,
    items: Vec<T>,
    work: &(dyn Fn(&mut dyn Bus, T) -> R + Sync),
) -> Vec<R> {
    thread::scope(|scope| {
        let (mut procedures, mut threads) = (Vec::new(), Vec::new());
        for item in items {
            let ((calls, called), (answers, answered)) = (channel(), channel());
            let mut procedure_bus = ProcedureBus {
                name: bus.name().to_owned(),
                timestamps: bus.timestamps(),
                is_live: bus.is_live(),
                waits: bus.waits(),
                sends_remote_frames: bus.sends_remote_frames(),
                bit_rate: bus.bit_rate(),
                last: Cell::new(bus.now()),
                calls,
                answers: answered,
            };
            threads.push(scope.spawn(move || work(&mut procedure_bus, item)));
            let missed = VecDeque::new();
            procedures.push(Procedure { calls: called, answers, filters: Filters::All, waits_until: None, missed });
        }
        Dispatcher::new(bus, procedures).run();
        let results = threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)));
        results.collect()
    })
}

/// A call of a procedure. The thread with the real bus carries it out.
enum Call {
    Now,
    Listen(Filters),
    Send(Frame),
    Receive(Mono),
}

enum Answer {
    Now(Stamp),
    Done(Result<(), BusError>),
    Event(Result<Event, BusError>),
}

/// The bus of one procedure.
struct ProcedureBus {
    name: String,
    timestamps: TimestampSource,
    is_live: bool,
    waits: bool,
    sends_remote_frames: bool,
    bit_rate: Option<u32>,
    /// The last known time. It is used if the thread with the real bus has ended.
    last: Cell<Stamp>,
    calls: Sender<Call>,
    answers: Receiver<Answer>,
}

impl ProcedureBus {
    /// Returns `None` if the thread with the real bus has ended.
    fn call(&self, call: Call) -> Option<Answer> {
        self.calls.send(call).ok()?;
        self.answers.recv().ok()
    }

    fn perform(&self, call: Call) -> Result<(), BusError> {
        match self.call(call) {
            Some(Answer::Done(result)) => result,
            _ => Err(BusError::Down(self.name.clone())),
        }
    }
}

impl Bus for ProcedureBus {
    fn name(&self) -> &str {
        &self.name
    }

    fn timestamps(&self) -> TimestampSource {
        self.timestamps
    }

    fn is_live(&self) -> bool {
        self.is_live
    }

    fn waits(&self) -> bool {
        self.waits
    }

    fn sends_remote_frames(&self) -> bool {
        self.sends_remote_frames
    }

    fn now(&self) -> Stamp {
        if let Some(Answer::Now(now)) = self.call(Call::Now) {
            self.last.set(now);
        }
        self.last.get()
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        self.perform(Call::Listen(filters.clone()))
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.perform(Call::Send(*frame))
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        match self.call(Call::Receive(deadline)) {
            Some(Answer::Event(event)) => event,
            _ => Err(BusError::Down(self.name.clone())),
        }
    }
}

impl BitRateControl for ProcedureBus {
    fn bit_rate(&self) -> Option<u32> {
        self.bit_rate
    }
}

/// A procedure, as the thread with the real bus sees it.
struct Procedure {
    calls: Receiver<Call>,
    answers: Sender<Answer>,
    filters: Filters,
    /// The deadline of the wait for an event; `None` if the procedure waits to send or has ended.
    waits_until: Option<Mono>,
    /// Events that arrived while the procedure waited to send.
    missed: VecDeque<Event>,
}

/// Limits the bus load of the procedures.
struct LoadLimiter {
    /// `None` if it is unknown. The load is then not limited.
    bit_rate: Option<u32>,
    /// When the next frame may be sent.
    ready_at: Mono,
}

impl LoadLimiter {
    /// Counts a sent frame and its answer, which is assumed to have the same length.
    fn on_sent(&mut self, frame: &Frame, now: Mono) {
        let Some(bit_rate) = self.bit_rate else { return };
        self.ready_at = self.ready_at.max(now - MAX_QUEUED_TIME) + (2 * frame_time(frame, bit_rate)).div_f64(MAX_LOAD);
    }
}

/// Carries out the calls of all procedures on the real bus.
struct Dispatcher<'a> {
    bus: &'a mut dyn Bus,
    procedures: Vec<Procedure>,
    /// The frames that wait to be sent, with their procedures.
    waiting: VecDeque<(usize, Frame)>,
    /// The time since which the bus accepts no frames.
    full_since: Option<Mono>,
    limiter: LoadLimiter,
}

impl Dispatcher<'_> {
    fn new(bus: &mut dyn Bus, procedures: Vec<Procedure>) -> Dispatcher<'_> {
        let (now, bit_rate) = (bus.mono(), bus.bit_rate().filter(|rate| *rate > 0));
        Dispatcher {
            bus,
            procedures,
            waiting: VecDeque::new(),
            full_since: None,
            limiter: LoadLimiter { bit_rate, ready_at: now },
        }
    }

    /// Receives events for all procedures, until they have ended.
    fn run(&mut self) {
        (0..self.procedures.len()).for_each(|index| self.serve(index));
        loop {
            self.send_waiting();
            let ready_at = self.waiting.front().map(|_| self.limiter.ready_at);
            let untils = self.procedures.iter().filter_map(|procedure| procedure.waits_until);
            let Some(until) = untils.chain(ready_at).min() else { return };
            let event = self.bus.receive(until);
            self.deliver(event, until.max(self.bus.mono()));
        }
    }

    /// Passes an event to each procedure that waits for it, and keeps it for each procedure that waits to send.
    fn deliver(&mut self, event: Result<Event, BusError>, now: Mono) {
        let Ok(event) = event else {
            // Only one procedure gets this error. The next error goes to the next waiting procedure.
            let Some(index) = self.procedures.iter().position(|procedure| procedure.waits_until.is_some()) else {
                return;
            };
            return self.answer(index, Answer::Event(event));
        };
        for index in 0..self.procedures.len() {
            let procedure = &mut self.procedures[index];
            let concerns = match event {
                Event::Frame(received) => procedure.filters.wants(&received.frame),
                Event::Timeout => procedure.waits_until.is_some_and(|until| until <= now),
                _ => true,
            };
            match procedure.waits_until {
                Some(_) if concerns => self.answer(index, Answer::Event(Ok(event))),
                None if concerns && event != Event::Timeout => procedure.missed.push_back(event),
                _ => {}
            }
        }
    }

    /// Sends the waiting frames in their order, as far as the bus load allows it.
    fn send_waiting(&mut self) {
        while self.limiter.ready_at <= self.bus.mono()
            && let Some((index, frame)) = self.waiting.pop_front()
        {
            let result = self.bus.send(&frame);
            let now = self.bus.mono();
            if matches!(result, Err(BusError::QueueFull)) {
                let since = *self.full_since.get_or_insert(now);
                if now.since(since) < RETRY_LIMIT {
                    self.waiting.push_front((index, frame));
                    self.limiter.ready_at = now + RETRY_INTERVAL;
                    return;
                }
            }
            self.full_since = None;
            if result.is_ok() {
                self.limiter.on_sent(&frame, now);
            }
            self.answer(index, Answer::Done(result));
        }
    }

    /// Answers a call of a procedure, and carries out its next calls.
    fn answer(&mut self, index: usize, answer: Answer) {
        // If the procedure has ended, this fails, and `serve` sees the end.
        let _ = self.procedures[index].answers.send(answer);
        self.serve(index);
    }

    /// Carries out the calls of one procedure until it waits or ends.
    fn serve(&mut self, index: usize) {
        self.procedures[index].waits_until = None;
        loop {
            let procedure = &mut self.procedures[index];
            let answer = match procedure.calls.recv() {
                Ok(Call::Receive(until)) => match procedure.missed.pop_front() {
                    Some(event) => Answer::Event(Ok(event)),
                    None => {
                        procedure.waits_until = Some(until);
                        return;
                    }
                },
                Ok(Call::Now) => Answer::Now(self.bus.now()),
                Ok(Call::Send(frame)) => {
                    self.waiting.push_back((index, frame));
                    return;
                }
                Ok(Call::Listen(filters)) => {
                    procedure.filters = filters;
                    let each = self.procedures.iter().map(|procedure| &procedure.filters);
                    Answer::Done(self.bus.listen(&Filters::any_of(each)))
                }
                Err(_) => {
                    procedure.filters = Filters::Only(Vec::new());
                    return;
                }
            };
            // If the procedure has ended, this fails, and the next `recv` reports the end.
            let _ = self.procedures[index].answers.send(answer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::memory::{Clock, MemoryBus, Outbox, Station};
    use std::time::Duration;

    /// Answers each frame with the same data and the next identifier.
    struct Echo;

    impl Station for Echo {
        fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

        fn receive(&mut self, _: Mono, frame: &Frame, out: &mut Outbox) {
            let text = frame.to_string().replacen('1', "2", 1);
            out.send(text.parse().expect("a frame"));
        }

        fn wake(&mut self, _: Mono, _: &mut Outbox) {}

        fn next_wake(&self) -> Option<Mono> {
            None
        }

        fn sent(&mut self, _: Mono, _: &Frame) {}
    }

    fn ms(milliseconds: u64) -> Mono {
        Mono::at(Duration::from_millis(milliseconds))
    }

    #[test]
    fn procedures_share_the_bus_and_get_their_own_frames_and_deadlines() {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(Echo);
        let ask = |bus: &mut dyn Bus, number: u64| {
            let wanted: Frame = format!("20{number}#0{number}").parse().expect("a frame");
            bus.listen(&Filters::Only(vec![wanted.id()])).expect("filters");
            bus.send(&format!("10{number}#0{number}").parse().expect("a frame")).expect("sent");
            let answer = bus.receive(ms(100)).expect("an event");
            assert!(matches!(answer, Event::Frame(received) if received.frame == wanted), "{number}: {answer:?}");
            assert_eq!(bus.receive(ms(100 + number)).expect("an event"), Event::Timeout);
            bus.now().mono
        };
        let ends = in_parallel(&mut bus, vec![3, 1, 2], &ask);
        assert_eq!(ends, [ms(103), ms(101), ms(102)]);
    }

    #[test]
    fn each_procedure_is_interrupted_and_reports_by_itself() {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.interrupt_at(ms(5));
        let wait = |bus: &mut dyn Bus, until: Mono| bus.receive(until).expect("an event");
        let events = in_parallel(&mut bus, vec![ms(1), ms(9), ms(8)], &wait);
        assert_eq!(events, [Event::Timeout, Event::Interrupted, Event::Interrupted]);
    }

    #[test]
    #[should_panic(expected = "a mistake")]
    fn a_panic_reaches_the_caller() {
        let mut bus = MemoryBus::new(Clock::Virtual);
        in_parallel(&mut bus, vec![1, 2], &|_, number| assert_eq!(number, 1, "a mistake"));
    }
}
