//! The heartbeats of the nodes recorded: lost, back, another state.

use crate::bus::Mono;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{Life, NmtState};
use crate::node::Node;
use std::collections::BTreeMap;
use std::time::Duration;

/// A heartbeat may come late by this much more than its period again: devices keep it no better.
const GRACE: Duration = Duration::from_millis(50);

/// What a heartbeat says that was not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Beat {
    /// Nothing.
    AsBefore,
    /// It is back after it was lost.
    Back,
    /// The node is in another state than at its last heartbeat.
    State(NmtState),
}

#[derive(Debug)]
struct Heart {
    /// 1017h.
    period: Duration,
    last: Mono,
    state: Option<NmtState>,
    lost: bool,
}

/// The nodes that have a heartbeat (1017h is not 0).
#[derive(Debug, Default)]
pub(super) struct Hearts {
    hearts: BTreeMap<NodeId, Heart>,
}

impl Hearts {
    /// Expects the heartbeat of an instrument from now on, or none where it has none.
    pub(super) fn expect(&mut self, instrument: &Node, now: Mono) {
        self.hearts.remove(&instrument.id);
        if let Some(milliseconds) = instrument.heartbeat_ms.filter(|&milliseconds| milliseconds > 0) {
            let period = Duration::from_millis(u64::from(milliseconds));
            self.hearts.insert(instrument.id, Heart { period, last: now, state: None, lost: false });
        }
    }

    /// Takes a sign of life.
    pub(super) fn take(&mut self, node: NodeId, life: Life, now: Mono) -> Beat {
        let Some(heart) = self.hearts.get_mut(&node) else { return Beat::AsBefore };
        heart.last = now;
        let was_lost = std::mem::take(&mut heart.lost);
        let state = match life {
            Life::State(state) => Some(state),
            // It says nothing of the state that comes after.
            Life::BootUp => None,
        };
        let before = std::mem::replace(&mut heart.state, state);
        match (before, state) {
            _ if was_lost => Beat::Back,
            (Some(before), Some(state)) if before != state => Beat::State(state),
            _ => Beat::AsBefore,
        }
    }

    /// A node whose heartbeat is lost and has not been told yet, and for how long it has been silent.
    pub(super) fn lost(&mut self, now: Mono) -> Option<(NodeId, Duration)> {
        let late = |heart: &Heart| !heart.lost && now.since(heart.last) > heart.period * 2 + GRACE;
        let (&node, heart) = self.hearts.iter_mut().find(|(_, heart)| late(heart))?;
        heart.lost = true;
        Some((node, now.since(heart.last)))
    }

    /// Time begins anew: nobody could have been heard until now.
    pub(super) fn excuse(&mut self, now: Mono) {
        self.hearts.values_mut().for_each(|heart| heart.last = now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_after_two_periods_and_back() {
        let at = |milliseconds| Mono::at(Duration::from_millis(milliseconds));
        let node = NodeId::new(5).expect("a node-ID");
        let mut instrument = Node::new(node);
        let mut hearts = Hearts::default();
        hearts.expect(&instrument, at(0));
        assert_eq!(hearts.lost(at(1_000_000)), None, "it has none");
        instrument.heartbeat_ms = Some(100);
        hearts.expect(&instrument, at(0));
        let operational = Life::State(NmtState::Operational);
        assert_eq!(hearts.take(node, operational, at(100)), Beat::AsBefore);
        assert_eq!(hearts.take(node, Life::State(NmtState::Stopped), at(200)), Beat::State(NmtState::Stopped));
        assert_eq!(hearts.lost(at(450)), None);
        assert_eq!(hearts.lost(at(451)), Some((node, Duration::from_millis(251))));
        assert_eq!(hearts.lost(at(600)), None, "told once");
        assert_eq!(hearts.take(node, operational, at(700)), Beat::Back);
        assert_eq!(hearts.take(node, Life::BootUp, at(750)), Beat::AsBefore);
        assert_eq!(hearts.take(node, operational, at(800)), Beat::AsBefore, "after a boot-up any state is new");
        hearts.excuse(at(9000));
        assert_eq!(hearts.lost(at(9250)), None);
    }
}
