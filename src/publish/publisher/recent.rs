//! Acknowledged rows that the server may have only in its memory. They are sent again if the server was restarted.
//!
//! The position file has the position before these rows. So they are also sent again after a restart of the publisher.

use super::{
    POLL_INTERVAL, Position, PublishError, PublishEvent, Publisher, RowReader, SendError, Sink, Spool, Stage, Start,
    Step, Trouble, header,
};
use crate::bus::{Mono, Stamp, Wall};
use std::collections::VecDeque;
use std::time::Duration;

/// Positions closer together are one.
const INTERVAL: Duration = Duration::from_secs(1);

/// Positions after acknowledged rows, with the time of the acknowledgement; the oldest first.
#[derive(Debug, Default)]
pub(super) struct Recent(VecDeque<(Mono, Position)>);

impl Recent {
    pub(super) fn push(&mut self, now: Mono, position: Position) {
        let before = self.0.len().checked_sub(2).and_then(|at| self.0.get(at));
        if before.is_some_and(|(time, _)| now.since(*time) < INTERVAL) {
            self.0.pop_back();
        }
        self.0.push_back((now, position));
    }

    /// Takes the last position whose rows were acknowledged at least `grace` ago.
    pub(super) fn settle(&mut self, now: Mono, grace: Duration) -> Option<Position> {
        let count = self.0.iter().take_while(|(time, _)| now.since(*time) >= grace).count();
        self.0.drain(..count).next_back().map(|(_, position)| position)
    }

    /// Whether rows were acknowledged at least `grace` ago.
    pub(super) fn is_due(&self, now: Mono, grace: Duration) -> bool {
        self.0.front().is_some_and(|(time, _)| now.since(*time) >= grace)
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn take_last(&mut self) -> Option<Position> {
        self.0.drain(..).next_back().map(|(_, position)| position)
    }
}

impl<S: Sink> Publisher<S> {
    /// There are no further rows at present.
    pub(super) fn idle(&mut self, now: Stamp) -> Result<Step, PublishError> {
        if !self.options.follow {
            self.settle_all(now.wall)?;
            return Ok(Step::Done);
        }
        let probe = self.recent.is_due(now.mono, self.sink.grace());
        match self.sink.idle(probe) {
            Err(trouble) => {
                if self.is_lost_connection(&trouble) {
                    self.go_back(false)?;
                }
                self.set_trouble(trouble, None, now)?;
            }
            Ok(()) if probe && self.sink.has_restarted() && self.go_back(false)? => {}
            Ok(()) => {
                if self.retry.trouble.is_some() {
                    self.recover();
                    "ok".clone_into(&mut self.position.state);
                }
                self.settle(now)?;
            }
        }
        Ok(Step::Wait(POLL_INTERVAL))
    }

    /// Saves the position whose rows the server has certainly stored.
    pub(super) fn settle(&mut self, now: Stamp) -> Result<(), PublishError> {
        let settled = self.recent.settle(now.mono, self.sink.grace());
        if settled.is_none() && self.safe.state == self.position.state {
            return Ok(());
        }
        self.safe = settled.unwrap_or_else(|| self.safe.clone());
        self.store(now.wall)
    }

    /// Saves the position after all acknowledged rows.
    pub(super) fn settle_all(&mut self, now: Wall) -> Result<(), PublishError> {
        let Some(last) = self.recent.take_last() else { return Ok(()) };
        self.safe = last;
        self.store(now)
    }

    /// Whether an answer, or its absence, can mean that the server was restarted.
    pub(super) fn is_restarted(&self, answer: &Result<(), SendError>) -> bool {
        match answer {
            Err(SendError::Trouble(trouble, _)) if self.is_lost_connection(trouble) => true,
            _ => self.sink.has_restarted(),
        }
    }

    /// Whether a failure can mean that the server was restarted.
    pub(super) fn is_lost_connection(&self, trouble: &Trouble) -> bool {
        match trouble {
            Trouble::NoConnection(_) | Trouble::Closed | Trouble::Status(502, _) => true,
            // A slow server must not get the same rows again and again.
            Trouble::Timeout => self.retry.trouble.is_some(),
            _ => false,
        }
    }

    /// The server may have been restarted: goes back to the rows that it may have lost. `false` if there are none;
    /// `is_partly_sent` are rows of the present batch.
    pub(super) fn go_back(&mut self, is_partly_sent: bool) -> Result<bool, PublishError> {
        if self.sink.grace().is_zero() || self.recent.is_empty() && !is_partly_sent {
            return Ok(false);
        }
        self.recent = Recent::default();
        let position = Some(&self.safe).filter(|position| !position.file.is_empty());
        self.spool = Spool::open(&self.recording, position, Start::Start).map_err(PublishError::Read)?;
        self.events.extend(self.spool.take_events().into_iter().map(PublishEvent::Spool));
        self.reader = RowReader::after(&header(&self.spool, position));
        self.origin_of = None;
        self.sent_now = self.sent_now.saturating_sub(self.position.sent.saturating_sub(self.safe.sent));
        self.rejected_now = self.rejected_now.saturating_sub(self.position.rejected.saturating_sub(self.safe.rejected));
        self.position = Position { state: self.position.state.clone(), ..self.safe.clone() };
        self.stage = Stage::Read;
        Ok(true)
    }
}
