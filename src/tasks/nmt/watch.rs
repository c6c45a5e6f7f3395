//! Follows heartbeats, boot-up messages and losses.

use crate::bus::{Mono, Stamp};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{ErrorControlMessage, NmtState};
use crate::canopen::value::DataType;
use crate::master::{Answer, Error, Master, MasterEvent, Request, SdoError, Ticket};
use crate::node::state::HEARTBEAT_TIME;
use crate::node::wait::{Policy, Until, Waiter, run};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

/// A change of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The first heartbeat, or a heartbeat with another state.
    State(NmtState),
    /// The node started.
    BootUp,
    /// No heartbeat came for twice the heartbeat time. The value is the time since the last heartbeat.
    Lost(Duration),
    /// The heartbeat is back, with this state.
    Back(NmtState),
}

/// A change with its moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateEvent {
    /// The moment.
    pub at: Stamp,
    /// The node.
    pub node: NodeId,
    /// The change.
    pub change: Change,
}

/// The additional delay of a heartbeat that is tolerated.
const LATE_TOLERANCE: Duration = Duration::from_millis(50);

/// Follows nodes until `until`, until Ctrl-C, or until `on_change` breaks.
///
/// With `ask`, the heartbeat time is read from 1017h; otherwise it is the longest interval so far.
///
/// # Errors
/// Bus errors.
pub fn watch(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    ask: bool,
    until: Option<Mono>,
    on_change: &mut dyn FnMut(&StateEvent) -> ControlFlow<()>,
) -> Result<(), Error> {
    let heartbeats = nodes.iter().map(|&node| (node, Heartbeat::default())).collect();
    let asked = if ask { nodes } else { &[] };
    let reads = asked.iter().map(|&node| (master.start(Request::read(node, HEARTBEAT_TIME)), node)).collect();
    let end = until.unwrap_or(Mono::at(Duration::MAX));
    let result = run(master, Policy::Observe, &mut Watcher { heartbeats, reads, end, on_change });
    master.cancel();
    result
}

struct Watcher<'a> {
    heartbeats: BTreeMap<NodeId, Heartbeat>,
    /// The reads of 1017h that are in progress. Meanwhile, heartbeats are already evaluated.
    reads: BTreeMap<Ticket, NodeId>,
    end: Mono,
    on_change: &'a mut dyn FnMut(&StateEvent) -> ControlFlow<()>,
}

impl Watcher<'_> {
    /// Returns the end, or the earlier moment at which the next node is lost.
    fn deadline(&self) -> Mono {
        self.heartbeats.values().filter_map(Heartbeat::lost_at).min().map_or(self.end, |at| at.min(self.end))
    }

    /// Stores the heartbeat time of a node from the answer to a read.
    fn on_answer(&mut self, ticket: Ticket, result: Result<Answer, SdoError>) {
        let Some(node) = self.reads.remove(&ticket) else { return };
        let value = result.and_then(|answer| answer.value(node, HEARTBEAT_TIME, Some(DataType::Unsigned(2))));
        let period = value.ok().and_then(|(value, _)| value.as_u64()).filter(|&time| time > 0);
        if let (Some(heartbeat), Some(period)) = (self.heartbeats.get_mut(&node), period) {
            heartbeat.period = Some(Duration::from_millis(period));
        }
    }

    /// Marks a node with an overdue heartbeat as lost, and returns the event.
    fn mark_lost(&mut self, at: Stamp) -> Option<StateEvent> {
        let now = self.deadline();
        let is_overdue = |heartbeat: &Heartbeat| heartbeat.lost_at().is_some_and(|due| due <= now);
        let (&node, heartbeat) = self.heartbeats.iter_mut().find(|(_, heartbeat)| is_overdue(heartbeat))?;
        heartbeat.is_lost = true;
        let silence = heartbeat.last.map_or(Duration::ZERO, |last| now.since(last));
        Some(StateEvent { at, node, change: Change::Lost(silence) })
    }
}

impl Waiter for Watcher<'_> {
    type Output = ();
    type Error = Error;

    fn until(&self) -> Until {
        Until::Deadline(self.deadline())
    }

    fn on_event(&mut self, master: &mut Master<'_>, event: MasterEvent) -> Result<ControlFlow<()>, Error> {
        let state_event = match event {
            MasterEvent::Frame(received) => ErrorControlMessage::parse(&received.frame).and_then(|(node, life)| {
                let change = self.heartbeats.get_mut(&node)?.on_life(life, received.at.mono)?;
                Some(StateEvent { at: received.at, node, change })
            }),
            MasterEvent::Sdo(ticket, result) => {
                self.on_answer(ticket, result);
                None
            }
            MasterEvent::Deadline if self.deadline() >= self.end => return Ok(ControlFlow::Break(())),
            MasterEvent::Deadline => self.mark_lost(master.bus().now()),
            MasterEvent::Interrupted | MasterEvent::Ended => return Ok(ControlFlow::Break(())),
            _ => None,
        };
        Ok(state_event.map_or(ControlFlow::Continue(()), |state_event| (self.on_change)(&state_event)))
    }
}

/// The heartbeat of a node.
#[derive(Clone, Copy, Debug, Default)]
struct Heartbeat {
    state: Option<NmtState>,
    last: Option<Mono>,
    /// The heartbeat time from 1017h, or the longest interval so far.
    period: Option<Duration>,
    is_lost: bool,
}

impl Heartbeat {
    /// Returns the moment at which the node counts as lost if no heartbeat arrives.
    fn lost_at(&self) -> Option<Mono> {
        match (self.last, self.period, self.is_lost) {
            (Some(last), Some(period), false) => Some(last + period * 2 + LATE_TOLERANCE),
            _ => None,
        }
    }

    fn on_life(&mut self, life: ErrorControlMessage, at: Mono) -> Option<Change> {
        let state = match life {
            ErrorControlMessage::BootUp => {
                // The time from the last heartbeat to the first one after a restart is not an interval.
                *self = Heartbeat { period: self.period, ..Heartbeat::default() };
                return Some(Change::BootUp);
            }
            ErrorControlMessage::State(state) => state,
        };
        if let (Some(last), false) = (self.last, self.is_lost) {
            let interval = at.since(last);
            self.period = Some(self.period.map_or(interval, |known| known.max(interval)));
        }
        let was_lost = std::mem::take(&mut self.is_lost);
        let has_changed = self.state != Some(state);
        (self.state, self.last) = (Some(state), Some(at));
        match (was_lost, has_changed) {
            (true, _) => Some(Change::Back(state)),
            (false, true) => Some(Change::State(state)),
            (false, false) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: u64) -> Mono {
        Mono::at(Duration::from_millis(milliseconds))
    }

    #[test]
    fn a_node_is_lost_after_twice_the_learned_period() {
        let mut heartbeat = Heartbeat::default();
        let operational = ErrorControlMessage::State(NmtState::Operational);
        assert_eq!(heartbeat.on_life(operational, at(0)), Some(Change::State(NmtState::Operational)));
        assert_eq!(heartbeat.lost_at(), None);
        assert_eq!(heartbeat.on_life(operational, at(1000)), None);
        assert_eq!(heartbeat.lost_at(), Some(at(3050)));
        heartbeat.is_lost = true;
        // The silence of a lost node is not an interval.
        assert_eq!(heartbeat.on_life(operational, at(60_000)), Some(Change::Back(NmtState::Operational)));
        assert_eq!(heartbeat.lost_at(), Some(at(62_050)));
        assert_eq!(heartbeat.on_life(ErrorControlMessage::BootUp, at(61_000)), Some(Change::BootUp));
        assert_eq!(heartbeat.lost_at(), None);
        let stopped = ErrorControlMessage::State(NmtState::Stopped);
        assert_eq!(heartbeat.on_life(stopped, at(61_500)), Some(Change::State(NmtState::Stopped)));
    }
}
