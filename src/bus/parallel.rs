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

/// The highest bus load of all procedures together. The rest is for frames of low priority, such as heartbeats. With
/// other traffic, [`Paced`](super::paced::Paced) has a lower limit.
const OWN_LOAD: f64 = 0.9;

/// The frames in the transmit queue may together need this time on the bus.
const QUEUED: Duration = Duration::from_millis(2);

/// The wait before a frame is sent again that the bus did not accept.
const RETRY_INTERVAL: Duration = Duration::from_millis(1);

/// How long a frame is sent again. Then the procedure gets the error.
const RETRY_LIMIT: Duration = Duration::from_secs(1);

/// Runs `work` for all items at the same time; the results have the order of the items. A procedure cannot change the
/// bit rate of the interface. A failure of the bus is an error for each procedure that waits.
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
            procedures.push(Procedure { calls: called, answers, filters: Filters::All, until: None, missed });
        }
        Dispatcher::new(bus, procedures).carry_out();
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
    /// The last known moment.
    last: Cell<Stamp>,
    calls: Sender<Call>,
    answers: Receiver<Answer>,
}

impl ProcedureBus {
    /// `None` if the thread with the real bus ended.
    fn call(&self, call: Call) -> Option<Answer> {
        self.calls.send(call).ok()?;
        self.answers.recv().ok()
    }

    fn done(&self, call: Call) -> Result<(), BusError> {
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
        self.done(Call::Listen(filters.clone()))
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.done(Call::Send(*frame))
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

/// A procedure, for the thread with the real bus.
struct Procedure {
    calls: Receiver<Call>,
    answers: Sender<Answer>,
    filters: Filters,
    /// Until when it waits for an event; `None` if it waits to send, or ended.
    until: Option<Mono>,
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
    /// A frame was sent. Its answer is assumed to have the same length.
    fn on_sent(&mut self, frame: &Frame, now: Mono) {
        let Some(bit_rate) = self.bit_rate else { return };
        self.ready_at = self.ready_at.max(now - QUEUED) + (2 * frame_time(frame, bit_rate)).div_f64(OWN_LOAD);
    }
}

/// Carries out the calls of all procedures on the real bus.
struct Dispatcher<'a> {
    bus: &'a mut dyn Bus,
    procedures: Vec<Procedure>,
    /// The frames that wait to be sent, with their procedures.
    waiting: VecDeque<(usize, Frame)>,
    /// Since when the bus accepts no frame.
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
    fn carry_out(&mut self) {
        (0..self.procedures.len()).for_each(|at| self.serve(at));
        loop {
            self.send_waiting();
            let ready_at = self.waiting.front().map(|_| self.limiter.ready_at);
            let untils = self.procedures.iter().filter_map(|procedure| procedure.until);
            let Some(until) = untils.chain(ready_at).min() else { return };
            let event = self.bus.receive(until);
            self.deliver(event, until.max(self.bus.mono()));
        }
    }

    /// Passes an event to the procedures that it concerns.
    fn deliver(&mut self, event: Result<Event, BusError>, now: Mono) {
        let Ok(event) = event else {
            // Only one procedure gets this error. The next error goes to the next waiting procedure.
            let Some(at) = self.procedures.iter().position(|procedure| procedure.until.is_some()) else { return };
            return self.answer(at, Answer::Event(event));
        };
        for at in 0..self.procedures.len() {
            let procedure = &mut self.procedures[at];
            let concerns = match event {
                Event::Frame(received) => procedure.filters.wants(&received.frame),
                Event::Timeout => procedure.until.is_some_and(|until| until <= now),
                _ => true,
            };
            match procedure.until {
                Some(_) if concerns => self.answer(at, Answer::Event(Ok(event))),
                None if concerns && event != Event::Timeout => procedure.missed.push_back(event),
                _ => {}
            }
        }
    }

    /// Sends the waiting frames in their order, as far as the bus load allows it.
    fn send_waiting(&mut self) {
        while self.limiter.ready_at <= self.bus.mono()
            && let Some((at, frame)) = self.waiting.pop_front()
        {
            let result = self.bus.send(&frame);
            let now = self.bus.mono();
            if matches!(result, Err(BusError::QueueFull)) {
                let since = *self.full_since.get_or_insert(now);
                if now.since(since) < RETRY_LIMIT {
                    self.waiting.push_front((at, frame));
                    self.limiter.ready_at = now + RETRY_INTERVAL;
                    return;
                }
            }
            self.full_since = None;
            if result.is_ok() {
                self.limiter.on_sent(&frame, now);
            }
            self.answer(at, Answer::Done(result));
        }
    }

    /// Answers a call of a procedure, and carries out its next calls.
    fn answer(&mut self, at: usize, answer: Answer) {
        // If the procedure has ended, this fails, and `serve` sees the end.
        let _ = self.procedures[at].answers.send(answer);
        self.serve(at);
    }

    /// Carries out the calls of one procedure until it waits or ends.
    fn serve(&mut self, at: usize) {
        self.procedures[at].until = None;
        loop {
            let procedure = &mut self.procedures[at];
            let answer = match procedure.calls.recv() {
                Ok(Call::Receive(until)) => match procedure.missed.pop_front() {
                    Some(event) => Answer::Event(Ok(event)),
                    None => {
                        procedure.until = Some(until);
                        return;
                    }
                },
                Ok(Call::Now) => Answer::Now(self.bus.now()),
                Ok(Call::Send(frame)) => {
                    self.waiting.push_back((at, frame));
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
            let _ = self.procedures[at].answers.send(answer);
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
