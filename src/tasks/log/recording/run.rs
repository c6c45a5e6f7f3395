//! The loop of a recording.

use super::Recording;
use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::master::{Error, Master, MasterEvent};
use crate::node::wait::{self, Policy, Until, Waiter};
use crate::tasks::log::producer::Producer;
use crate::tasks::log::{FIRST_SAMPLE_TIMEOUT, LogEvent, Mode, Observer, TICK_INTERVAL};
use std::ops::ControlFlow;
use std::time::Duration;

/// The interval at which the loop checks whether the start commands were sent.
const START_CHECK_INTERVAL: Duration = Duration::from_millis(1);

/// The time for which the values of the first SYNC are kept. A second device with the same COB-ID answers within this
/// time.
const SECOND_SENDER_TIMEOUT: Duration = Duration::from_millis(50);

/// Times at which the loop must act, besides frames, polls and SYNC.
struct Schedule {
    start: Mono,
    /// The end of `--duration`.
    end: Option<Mono>,
    /// The recording ends at this moment if it has no row.
    give_up: Mono,
    next_tick: Mono,
    /// The time of the first Ctrl-C. Frames received until then are still recorded.
    interrupted_at: Option<Mono>,
}

impl Schedule {
    fn new(start: Mono, duration: Option<Duration>, is_live: bool) -> Schedule {
        // A replayed recording may contain other traffic for any time, and has its own end.
        let timeout = if is_live { FIRST_SAMPLE_TIMEOUT } else { Duration::MAX };
        Schedule {
            start,
            end: duration.map(|duration| start + duration),
            give_up: start + duration.unwrap_or(timeout).min(timeout),
            next_tick: start + TICK_INTERVAL,
            interrupted_at: None,
        }
    }

    /// Delays the start of the recording, so that `--duration` contains the same number of cycles.
    fn delay(&mut self, by: Duration) {
        self.start = self.start + by;
        self.end = self.end.map(|end| end + by);
        self.give_up = self.give_up + by;
    }

    fn is_over(&self, now: Mono, rows: u64) -> bool {
        self.end.is_some_and(|end| now >= end) || rows == 0 && now >= self.give_up
    }
}

impl Recording<'_> {
    /// Records until the end.
    ///
    /// # Errors
    /// The bus failed, or the user ended the recording before its first row.
    pub(in crate::tasks::log) fn run(
        &mut self,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        if let Some(buffer) = self.receive_buffer {
            observer.event(&LogEvent::Buffer(buffer), master.bus().now());
        }
        let start = master.now();
        self.started = start;
        self.tally.extend_to(start);
        for node in &self.nodes {
            self.liveness.watch_heartbeat(node, self.options.mode, start);
        }
        if self.poll.is_none() {
            self.nodes.iter().for_each(|node| self.synced.set_up(node));
        }
        let mut producer = match self.options.mode {
            Mode::Sync(interval) | Mode::Request(interval) => {
                let id = self.nodes.first().map_or(CanId::SYNC, |first| first.sync);
                let id = self.sync_interval().map(|_| id);
                let overflow = self.nodes.first().and_then(|first| first.sync_overflow);
                self.due.set_up(&self.nodes, &self.decoder, self.options.mode);
                Some(Producer::new(interval, id, overflow, start))
            }
            _ => None,
        };
        let schedule = Schedule::new(start, self.options.duration, master.bus().is_live());
        let mut recorder = Loop { recording: self, schedule, producer: producer.as_mut(), observer };
        let result = wait::run(master, Policy::Record, &mut recorder);
        // The result is not needed: the recording ends here even if the reader has not closed the output.
        let _ = self.pass_early(observer);
        self.timestamps = master.bus().timestamps();
        if let Some(producer) = producer {
            self.tally.syncs = producer.finish(master);
            if let Mode::Sync(interval) | Mode::Request(interval) = self.options.mode {
                self.tally.events.missing = std::mem::take(&mut self.due).missing(self.tally.end(), interval);
            }
        }
        let unreported_drops = master.unreported_drops();
        if unreported_drops > 0 {
            self.tally.dropped += u64::from(unreported_drops);
            observer.event(&LogEvent::Dropped(unreported_drops), master.bus().now());
        }
        self.report_repeated(master.bus().now(), true, observer);
        result
    }

    /// Returns the moment at which the loop must act if nothing is received.
    fn next_deadline(&self, schedule: &Schedule, producer: Option<&Producer>) -> Mono {
        let give_up = (self.tally.rows == 0).then_some(schedule.give_up);
        let poll = self.poll.as_ref().map(|poll| poll.due(schedule.start));
        let reread = self.rereads.due().filter(|_| self.link_is_up);
        let sync = producer.map(Producer::due);
        let due = [give_up, schedule.end, sync, poll, reread, self.early_until].into_iter().flatten();
        due.fold(schedule.next_tick, Mono::min)
    }

    /// Carries out the work that is due at `now`.
    fn on_deadline(
        &mut self,
        now: Mono,
        schedule: &mut Schedule,
        producer: Option<&mut Producer>,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> ControlFlow<()> {
        if let Some(at) = schedule.interrupted_at {
            self.tally.extend_to(at);
            return ControlFlow::Break(());
        }
        self.tally.extend_to(now);
        if self.early_until.is_some_and(|until| now >= until) {
            self.pass_early(observer)?;
        }
        if schedule.is_over(now, self.tally.rows) {
            return ControlFlow::Break(());
        }
        if let Some(producer) = producer.filter(|producer| now >= producer.due()) {
            if producer.slot() == 0 && master.is_sending() {
                // A SYNC must not be sent before the start commands, or the first TPDOs would be missing.
                schedule.delay(START_CHECK_INTERVAL);
                producer.delay_start(now + START_CHECK_INTERVAL);
                return ControlFlow::Continue(());
            }
            observer.cycle(producer.slot(), master.bus().now())?;
            self.due.on_sync(now);
            let is_free = !master.is_sending();
            if let Mode::Sync(interval) = self.options.mode {
                if producer.slot() == 0 {
                    self.early_until = Some(now + interval.min(SECOND_SENDER_TIMEOUT));
                }
                self.nodes.iter().map(|node| node.sync).take(1).for_each(|id| self.synced.on_sync(id, now));
            }
            producer.send(master);
            if is_free {
                self.send_requests(master);
            }
        }
        if let Some(poll) = &mut self.poll {
            if poll.due(schedule.start) <= now {
                observer.cycle(poll.next_cycle(), master.bus().now())?;
            }
            self.tally.skipped += poll.start_due(schedule.start, now, master);
        }
        if self.link_is_up {
            self.rereads.start_due(now, master);
            self.report_losses(now, master, observer);
        }
        if now < schedule.next_tick {
            return ControlFlow::Continue(());
        }
        schedule.next_tick = now + TICK_INTERVAL;
        self.examine_silent_nodes(now.since(schedule.start), master);
        self.report_repeated(master.bus().now(), false, observer);
        observer.tick(master.bus().now(), self.tally.rows)
    }

    /// Looks for the reasons why nodes send no values.
    fn examine_silent_nodes(&mut self, waited: Duration, master: &mut Master<'_>) {
        self.look_for_unknown_tpdos(waited, master);
        if !self.questions.were_asked && waited >= FIRST_SAMPLE_TIMEOUT {
            self.read_silent_nodes_during_recording(master);
        }
    }

    /// Sends a remote request (RTR) for each TPDO that is recorded.
    fn send_requests(&self, master: &mut Master<'_>) {
        if !matches!(self.options.mode, Mode::Request(_)) {
            return;
        }
        for (_, tpdo) in self.recorded_tpdos() {
            let bits: usize = tpdo.mapping.iter().map(|entry| usize::from(entry.bits)).sum();
            let length = u8::try_from(bits.div_ceil(8)).unwrap_or(u8::MAX);
            Frame::remote(tpdo.cob_id.can_id(), length).into_iter().for_each(|frame| master.send(frame));
        }
    }

    /// Handles Ctrl-C. After the first Ctrl-C, frames received earlier are still recorded. The second Ctrl-C ends the
    /// recording immediately.
    fn on_interrupt(&mut self, schedule: &mut Schedule, master: &Master<'_>) -> Result<ControlFlow<()>, Error> {
        let is_second = std::mem::replace(&mut self.interrupted, true);
        if self.tally.rows == 0 && self.early.is_empty() {
            return Err(Error::Interrupted);
        }
        if is_second || !master.bus().is_live() {
            return Ok(ControlFlow::Break(()));
        }
        schedule.interrupted_at = Some(master.now());
        Ok(ControlFlow::Continue(()))
    }
}

/// The recording, and the state of its loop.
struct Loop<'l, 'o> {
    recording: &'l mut Recording<'o>,
    schedule: Schedule,
    producer: Option<&'l mut Producer>,
    observer: &'l mut dyn Observer,
}

impl Waiter for Loop<'_, '_> {
    type Output = ();
    type Error = Error;

    fn until(&self) -> Until {
        match self.schedule.interrupted_at {
            Some(at) => Until::Drained(at),
            None => Until::Deadline(self.recording.next_deadline(&self.schedule, self.producer.as_deref())),
        }
    }

    fn on_event(&mut self, master: &mut Master<'_>, event: MasterEvent) -> Result<ControlFlow<()>, Error> {
        if let Some(producer) = &mut self.producer {
            producer.check_sent(master);
            self.recording.tally.syncs.sent = producer.sent();
        }
        let Loop { recording, schedule, producer, observer } = self;
        match event {
            MasterEvent::Frame(received) => return Ok(recording.on_frame(&received, master, *observer)),
            MasterEvent::Sdo(ticket, result) => return recording.on_answer(ticket, result, master, *observer),
            MasterEvent::Deadline => {
                // Nothing has changed since `until` returned this moment.
                let now = recording.next_deadline(schedule, producer.as_deref());
                return Ok(recording.on_deadline(now, schedule, producer.as_deref_mut(), master, *observer));
            }
            MasterEvent::Interrupted => return recording.on_interrupt(schedule, master),
            MasterEvent::Ended => return Ok(ControlFlow::Break(())),
            MasterEvent::Fault(fault, at) => recording.on_fault(fault, at, master, *observer),
            MasterEvent::Dropped(count) => recording.on_dropped(count, master, *observer),
            MasterEvent::Link(up) => recording.on_link(up, master, *observer),
        }
        Ok(ControlFlow::Continue(()))
    }
}
