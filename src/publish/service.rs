//! Publishes several recordings at once, each in a thread of its own.

use super::publisher::{Progress, PublishError, PublishEvent, Publisher, Step};
use super::sink::{Record, SendError, Sink, Trouble};
use crate::bus::time::HostClock;
use crate::bus::{Mono, Wall};
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// The interval at which a busy publisher reports its progress.
const REPORT_INTERVAL: Duration = Duration::from_millis(500);

/// The stack of a thread, in bytes. It allows hundreds of recordings.
const STACK_SIZE: usize = 512 * 1024;

/// What a thread has reported.
#[derive(Debug, Default)]
struct Report {
    progress: Progress,
    events: Vec<PublishEvent>,
    end: Option<Result<(), PublishError>>,
    has_ended: bool,
}

#[derive(Debug, Default)]
struct Shared {
    reports: Mutex<Vec<Report>>,
    stop: Mutex<bool>,
    stopped: Condvar,
}

impl Shared {
    fn reports(&self) -> MutexGuard<'_, Vec<Report>> {
        self.reports.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_stopped(&self) -> bool {
        *self.stop.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for `length`, or until all threads are to end.
    fn wait(&self, length: Duration) {
        let stop = self.stop.lock().unwrap_or_else(PoisonError::into_inner);
        drop(self.stopped.wait_timeout_while(stop, length, |stop| !*stop));
    }
}

/// News of a recording.
#[derive(Debug)]
pub struct News {
    /// The present state.
    pub progress: Progress,
    /// The events since the last call.
    pub events: Vec<PublishEvent>,
    /// The result, once, when the publisher has ended.
    pub end: Option<Result<(), PublishError>>,
}

/// Running publishers.
#[derive(Debug)]
pub struct Service {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

impl Service {
    /// Starts publishers.
    ///
    /// # Errors
    /// The system has no more threads.
    pub fn start(publishers: Vec<Publisher<Box<dyn Sink>>>, clock: HostClock) -> io::Result<Service> {
        let shared = Arc::new(Shared::default());
        let first = publishers.iter().map(|publisher| Report { progress: publisher.progress(), ..Report::default() });
        shared.reports().extend(first);
        let mut threads = Vec::new();
        for (number, publisher) in publishers.into_iter().enumerate() {
            let shared = Arc::clone(&shared);
            let builder = thread::Builder::new().stack_size(STACK_SIZE);
            threads.push(builder.spawn(move || run(number, publisher, &shared, clock))?);
        }
        Ok(Service { shared, threads })
    }

    /// The news of each recording, in their order.
    pub fn news(&self) -> Vec<News> {
        let mut reports = self.shared.reports();
        let news = reports.iter_mut().zip(&self.threads).map(|(report, thread)| {
            if thread.is_finished() && !std::mem::replace(&mut report.has_ended, true) {
                report.end = Some(Err(PublishError::Panicked));
            }
            News {
                progress: report.progress.clone(),
                events: std::mem::take(&mut report.events),
                end: report.end.take(),
            }
        });
        news.collect()
    }

    /// Whether all publishers have ended.
    pub fn has_ended(&self) -> bool {
        self.threads.iter().all(JoinHandle::is_finished)
    }

    /// Asks the publishers to end after their present request.
    pub fn stop(&self) {
        *self.shared.stop.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.shared.stopped.notify_all();
    }
}

/// The thread of a publisher.
fn run(number: usize, mut publisher: Publisher<Box<dyn Sink>>, shared: &Shared, clock: HostClock) {
    let mut reported = Mono::START;
    let result = loop {
        let now = clock.now();
        let step = publisher.step(now);
        let is_due = now.mono.since(reported) >= REPORT_INTERVAL;
        if is_due || !matches!(step, Ok(Step::Again)) {
            reported = now.mono;
            let (progress, events) = (publisher.progress(), publisher.take_events());
            let report = &mut shared.reports()[number];
            report.progress = progress;
            report.events.extend(events);
        }
        match step {
            Ok(_) if shared.is_stopped() => break Ok(()),
            Ok(Step::Again) => {}
            Ok(Step::Wait(length)) => shared.wait(length),
            Ok(Step::Done) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    publisher.close(clock.now().wall);
    let (progress, events) = (publisher.progress(), publisher.take_events());
    let report = &mut shared.reports()[number];
    report.progress = progress;
    report.events.extend(events);
    (report.end, report.has_ended) = (Some(result), true);
}

impl Sink for Box<dyn Sink> {
    fn most_rows(&self) -> usize {
        (**self).most_rows()
    }

    fn announce(&mut self, bench: &str) {
        (**self).announce(bench);
    }

    fn encode(&mut self, record: &Record<'_>, out: &mut Vec<u8>) {
        (**self).encode(record, out);
    }

    fn send(&mut self, rows: &[u8], now: Wall) -> Result<(), SendError> {
        (**self).send(rows, now)
    }

    fn grace(&self) -> Duration {
        (**self).grace()
    }

    fn has_restarted(&self) -> bool {
        (**self).has_restarted()
    }

    fn idle(&mut self, probe: bool) -> Result<(), Trouble> {
        (**self).idle(probe)
    }

    fn close(&mut self) {
        (**self).close();
    }
}
