//! The figures of one node.

use crate::bus::Mono;
use crate::canopen::nmt::NmtState;
use crate::canopen::value::Value;
use crate::master::Operation;
use crate::measure::histogram::Histogram;
use crate::node::state::HEARTBEAT_TIME;
use crate::node::transfers::Outcome;
use crate::tasks::monitor::{Content, Entry, SdoMessage};
use std::time::Duration;

/// Statistics of times: number, minimum, maximum, mean and 99 % quantile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spread {
    histogram: Histogram,
    sum: Duration,
}

impl Spread {
    pub(super) fn add(&mut self, time: Duration) {
        self.histogram.add(time);
        self.sum += time;
    }

    /// Returns the number of times.
    pub fn count(&self) -> u64 {
        self.histogram.count()
    }

    /// Returns the shortest time.
    pub fn min(&self) -> Option<Duration> {
        self.histogram.shortest()
    }

    /// Returns the longest time.
    pub fn max(&self) -> Option<Duration> {
        self.histogram.longest()
    }

    /// Returns the mean.
    pub fn mean(&self) -> Option<Duration> {
        (self.count() > 0).then(|| self.sum.div_f64(self.count() as f64))
    }

    /// Returns the time that 99 % of all times do not exceed.
    pub fn p99(&self) -> Option<Duration> {
        self.histogram.quantile(0.99)
    }
}

/// The figures of one node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeTally {
    /// The number of its frames.
    pub frames: u64,
    /// The number of bits of these frames on the bus.
    pub bits: u64,
    /// The last known NMT state.
    pub state: Option<NmtState>,
    /// The intervals between its heartbeats.
    pub heartbeat: Spread,
    /// The time from its last heartbeat to the end, if it is longer than all intervals.
    pub overdue: Option<Duration>,
    /// The producer heartbeat time (1017h), if it was read.
    pub heartbeat_time: Option<Duration>,
    /// The times from an SDO read request to the first answer.
    pub answers: Spread,
    /// SDO reads without an answer.
    pub unanswered: u64,
    /// Emergencies, except messages that an error is over.
    pub emergencies: u64,
    /// The code and the meaning of the last emergency.
    pub last_emergency: Option<(u16, String)>,
    /// Boot-up messages.
    pub restarts: u64,
    last_heartbeat: Option<Mono>,
}

impl NodeTally {
    pub(super) fn count(&mut self, entry: &Entry) {
        match &entry.content {
            Content::State(state) => {
                self.state = Some(*state);
                let at = entry.at.mono;
                if let Some(last) = self.last_heartbeat.replace(at) {
                    self.heartbeat.add(at.since(last));
                }
            }
            Content::Guarded(state, _) => self.state = Some(*state),
            Content::BootUp => {
                self.restarts += 1;
                // The interval that includes a restart is not counted.
                self.last_heartbeat = None;
            }
            Content::Emergency(emergency, meaning) if emergency.code != 0 => {
                self.emergencies += 1;
                self.last_emergency = Some((emergency.code, meaning.clone()));
            }
            Content::Sdo(message) => self.count_transfer(message),
            _ => {}
        }
    }

    fn count_transfer(&mut self, message: &SdoMessage) {
        let transfer = &message.transfer;
        let is_done = matches!(transfer.outcome, Outcome::Done(_));
        if let (true, HEARTBEAT_TIME, Some(Value::Unsigned(time))) = (is_done, transfer.object, &message.value) {
            self.heartbeat_time = Some(Duration::from_millis(*time));
        }
        if transfer.operation != Operation::Read {
            return;
        }
        match transfer.answered {
            Some(answered) => self.answers.add(answered.mono.since(transfer.requested.mono)),
            None => self.unanswered += 1,
        }
    }

    pub(super) fn finish(&mut self, end: Mono) {
        let since = self.last_heartbeat.map(|last| end.since(last));
        self.overdue = since.filter(|&since| self.heartbeat.max().is_some_and(|longest| since > longest));
    }

    /// Returns the longest time without a heartbeat.
    pub fn longest_heartbeat(&self) -> Option<Duration> {
        self.overdue.or(self.heartbeat.max())
    }
}
