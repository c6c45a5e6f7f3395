//! Follows heartbeats, boot-ups and losses.

use crate::bus::{Mono, Stamp};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{Life, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Error, Happening, Master};
use crate::node::read::read_values;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

/// What happened to a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It was seen for the first time, or changed its state.
    State(NmtState),
    /// It (re)started.
    BootUp,
    /// Its heartbeat has not come for twice its period.
    Lost(Duration),
    /// Its heartbeat is back, in this state.
    Back(NmtState),
}

/// A change and its moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// When.
    pub at: Stamp,
    /// Whose.
    pub node: NodeId,
    /// What.
    pub change: Change,
}

/// What is known of a node's heartbeat.
#[derive(Clone, Copy, Debug, Default)]
struct Pulse {
    state: Option<NmtState>,
    last: Option<Mono>,
    /// 1017h, or learned: the longest interval seen.
    period: Option<Duration>,
    lost: bool,
}

/// A heartbeat may come late by this much more than its period again.
const GRACE: Duration = Duration::from_millis(50);

/// Follows the nodes until `until`, or until the user or `tell` ends it.
///
/// The period is that of 1017h where `ask` allows to read it, else it is learned from what is heard.
///
/// # Errors
/// What stops everything.
pub fn watch(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    ask: bool,
    until: Option<Mono>,
    tell: &mut dyn FnMut(&Seen) -> ControlFlow<()>,
) -> Result<(), Error> {
    let mut pulses: BTreeMap<NodeId, Pulse> = nodes.iter().map(|&node| (node, Pulse::default())).collect();
    if ask {
        let items: Vec<_> = nodes.iter().map(|&node| (node, ObjectId::new(0x1017, 0), DataType::Unsigned(2))).collect();
        for (node, value) in nodes.iter().zip(read_values(master, &items)?) {
            let period = value.ok().and_then(|value| value.as_u64()).filter(|&time| time > 0);
            if let Some(pulse) = pulses.get_mut(node) {
                pulse.period = period.map(Duration::from_millis);
            }
        }
    }
    let far = Mono::at(Duration::MAX);
    loop {
        let end = until.unwrap_or(far);
        let next = pulses.values().filter_map(Pulse::lost_at).min().unwrap_or(far).min(end);
        let seen = match master.next(next)? {
            Happening::Frame(received) => {
                let Some((node, life)) = Life::parse(&received.frame) else { continue };
                let Some(pulse) = pulses.get_mut(&node) else { continue };
                pulse.take(life, received.at.mono).map(|change| Seen { at: received.at, node, change })
            }
            Happening::Deadline if next >= end => return Ok(()),
            Happening::Deadline => {
                let at = master.bus().now();
                pulses.iter_mut().find(|(_, pulse)| pulse.lost_at().is_some_and(|due| due <= next)).map(
                    |(&node, pulse)| {
                        pulse.lost = true;
                        let silent = pulse.last.map_or(Duration::ZERO, |last| next.since(last));
                        Seen { at, node, change: Change::Lost(silent) }
                    },
                )
            }
            Happening::Interrupted | Happening::Ended => return Ok(()),
            Happening::Link(false) => {
                return Err(Error::Bus(crate::bus::BusError::Down(master.bus().name().to_owned())));
            }
            Happening::Sdo(..) | Happening::Fault(..) | Happening::Dropped(_) | Happening::Link(true) => None,
        };
        if let Some(seen) = seen
            && tell(&seen).is_break()
        {
            return Ok(());
        }
    }
}

impl Pulse {
    /// When the node counts as lost, if nothing comes.
    fn lost_at(&self) -> Option<Mono> {
        match (self.last, self.period, self.lost) {
            (Some(last), Some(period), false) => Some(last + period * 2 + GRACE),
            _ => None,
        }
    }

    fn take(&mut self, life: Life, at: Mono) -> Option<Change> {
        let state = match life {
            Life::BootUp => {
                // The rhythm begins anew.
                *self = Pulse { period: self.period, ..Pulse::default() };
                return Some(Change::BootUp);
            }
            Life::State(state) => state,
        };
        if let (Some(last), false) = (self.last, self.lost) {
            let interval = at.since(last);
            self.period = Some(self.period.map_or(interval, |known| known.max(interval)));
        }
        let was_lost = std::mem::take(&mut self.lost);
        let changed = self.state != Some(state);
        (self.state, self.last) = (Some(state), Some(at));
        match (was_lost, changed) {
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
    fn a_period_is_learned_and_a_loss_comes_after_two_of_them() {
        let mut pulse = Pulse::default();
        let operational = Life::State(NmtState::Operational);
        assert_eq!(pulse.take(operational, at(0)), Some(Change::State(NmtState::Operational)));
        assert_eq!(pulse.lost_at(), None);
        assert_eq!(pulse.take(operational, at(1000)), None);
        assert_eq!(pulse.lost_at(), Some(at(3050)));
        pulse.lost = true;
        // The silence is no interval to learn from.
        assert_eq!(pulse.take(operational, at(60_000)), Some(Change::Back(NmtState::Operational)));
        assert_eq!(pulse.lost_at(), Some(at(62_050)));
        assert_eq!(pulse.take(Life::BootUp, at(61_000)), Some(Change::BootUp));
        assert_eq!(pulse.lost_at(), None);
        let stopped = Life::State(NmtState::Stopped);
        assert_eq!(pulse.take(stopped, at(61_500)), Some(Change::State(NmtState::Stopped)));
    }
}
